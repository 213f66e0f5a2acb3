"""Signed distance of two convex cores, with its direction and the points where they are nearest: all cases.

Apart, the search for the nearest points ends it. Where the cores touch or overlap, the separation along a direction n
found so far is improved by looking from outside: shape 2 is moved off along n until there is a clear gap, and the
nearest points then have a direction that separates at least as well (the origin is projected on the difference of both
from a point beyond its surface; equality is a local best). Few such steps settle shallow overlaps to rounding, for
curved shapes too; how deep ones overlap least of all is asked of the polytope first.
"""

from __future__ import annotations

from ...compiler.formulas import formula
from ...math.vec import add, dot, load3, norm, put3, scale, sub
from .epa import ROWS as POLYTOPE
from .epa import deepest
from .gjk import APART, BEYOND, MEET, nearest, point, reach
from .manifold import axes_of

OFF = 0.03  # of the size: the gap that is made
LOOKS = 48  # at most
NEAR = 1e-6  # of the size: the least
SAME = 1e-13  # of the size: what one more look brings when it was the last
SHALLOW = 1e-8  # of the size: depth below which nobody asks whether another direction is less deep
ONWARD = 10  # doublings
ASIDE = 1e-3  # angle
EARLY = 4  # of these, before the polytope is asked
ROWS = 8 + POLYTOPE  # of scratch


@formula
def onward(G, i, j, p, R, room, s, n, d):
    """From n, a step to d made the separation s; go on that way in doubled steps while it grows."""
    step = sub(d, n)
    best = d
    for _k in range(ONWARD):
        step = scale(2.0, step)
        e = add(n, step)
        e = scale(1.0 / norm(e), e)
        a, x = reach(G, i, j, p, R, room, e)
        if not -dot(x, e) > s:
            break
        s, best = -dot(x, e), e
    return s, best


@formula
def aside(G, i, j, p, R, room, s, n):
    """The better of n, with the separation s, and what lies to its sides: a saddle has no other way to be left."""
    best = n
    for k in range(4):
        u = axes_of(n)[k // 2]
        d = add(n, scale(ASIDE if k % 2 == 0 else -ASIDE, u))
        d = scale(1.0 / norm(d), d)
        a, x = reach(G, i, j, p, R, room, d)
        if -dot(x, d) > s:
            return onward(G, i, j, p, R, room, -dot(x, d), n, d)
    return s, best


@formula
def separation(G, i, j, p, R, start, far, room, at):
    """Separation of the cores, direction from 1 to 2, point of core 1; all in the axes of shape 1.

    Above ``far`` the separation is only a bound from below, and the point is none. The nearest point of core 2 is the
    point of core 1 plus separation times direction. ``start``, not all zeros, is a guess of the direction.
    """
    best, n, size, corners, asked = -1e300, start, 0.0, 0, False
    a, away, limit = p, 0.0, far
    for look in range(LOOKS):
        q = add(p, scale(away, n))
        status, s, d, length, count = nearest(G, i, j, q, R, n, limit, room, at)
        if look == 0 and status == BEYOND:
            return s, d, a
        a = point(room, at, count)
        if look == 0 and status == APART:
            return s, d, a
        if look == 0:
            size, corners, limit = length, count, 1e300
            for k in range(count):
                put3(room, at + 8 + k, 0, load3(room, at + k, 0))
        s -= away * dot(n, d)
        better = status != MEET and s > best + SAME * size
        if look == 0:
            best, n = s, d
        elif better:
            best, n = onward(G, i, j, p, R, room, s, n, d)
        if look > 0 and (not better or (look == EARLY and not asked)):
            if -best <= SHALLOW * size:
                return best, n, a
            s, d = best, n
            if not asked:
                s, d = deepest(G, i, j, p, R, room, at + 8, corners, size, best, n)
                asked = True
            if not better and s <= best + SAME * size:
                s, d = aside(G, i, j, p, R, room, best, n)
                if s <= best + SAME * size:
                    return best, n, a
            best, n = s, d
        away = min(OFF * size, max(NEAR * size, -best)) - best
    return best, n, a
