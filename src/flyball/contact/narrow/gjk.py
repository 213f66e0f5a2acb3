"""Distance between two convex cores by their supports alone.

Gilbert, Johnson and Keerthi (1988). A direction n, from 1 to 2, separates the cores by
``s(n) = -max over 1 of n.x + min over 2 of n.x``; the distance is the largest s. Every step of the search knows s of
its direction, a bound from below, and a point of the difference of both cores whose length bounds from above. It ends
when these meet, when a step brings nothing (rounding), or after `MOST` steps: never otherwise.
"""

from __future__ import annotations

from ...compiler.formulas import formula
from ...math.scalar import sqrt
from ...math.vec import add, dot, load3, mtv, mv, neg, put3, scale, sub
from .cores import farthest
from .simplex import on_simplex

MOST = 128  # steps
EXACT = 1e-14  # of the size: bounds that have met
CLOSE = 1e-7  # of the size: distance below which the direction of the nearest points says too little
APART, BEYOND, MEET = range(3)  # found; further apart than asked; they touch or overlap


@formula
def reach(G, i, j, p, R, room, d):
    """Farthest points along d: of core 1, and of the difference 1 - 2."""
    a = farthest(G, i, room, d)
    b = farthest(G, j, room, neg(mtv(R, d)))
    return a, sub(a, add(p, mv(R, b)))


@formula
def keep(room, at, count, w):
    """Drop the corners without weight; those that are left and how many."""
    n = 0
    for k in range(count):
        if w[k] > 0.0:
            for c in range(6):
                room[at + n, c] = room[at + k, c]
            room[at + n, 6] = w[k]
            n += 1
    return n


@formula
def nearest(G, i, j, p, R, start, far, room, at):
    """Status, separation, its direction from 1 to 2, size of the difference, corners of the simplex left at ``at``.

    Parameters
    ----------
    i, j : int
        The shapes.
    p, R
        Pose of shape 2 in the axes of shape 1, which everything is in.
    start : tuple
        Direction from 1 to 2 to begin with, not all zeros.
    far : float
        Separation [m] that is enough: a larger one is not found out.
    room, at
        Scratch: rows ``at`` to ``at + 4`` take corners of the simplex: the difference, the point of core 1, the weight.

    Notes
    -----
    Where the cores overlap the separation is the largest s met (less than zero), a bound of the depth from above.
    """
    d, best, along, size, count, vv = start, -1e300, start, 0.0, 0, 1e300
    for _step in range(MOST):
        length = sqrt(dot(d, d))
        if not length > 0.0:
            return MEET, best, along, size, count
        a, x = reach(G, i, j, p, R, room, d)
        bound = -dot(d, x) / length
        if bound > best:
            best, along = bound, scale(1.0 / length, d)
            if bound > far:
                return BEYOND, best, along, size, count
        size = max(size, sqrt(dot(x, x)))
        if count > 0 and length - best <= EXACT * size:
            break
        put3(room, at + count, 0, x)
        put3(room, at + count, 3, a)
        v, w, inside = on_simplex(room, at, count + 1)
        new = dot(v, v)
        if inside:
            count = keep(room, at, 4, w)
            return MEET, best, along, size, count
        if count > 0 and not new < vv:
            break
        count = keep(room, at, count + 1, w)
        vv = new
        d = neg(v)
        if vv <= (1e-15 * size) ** 2:
            return MEET, best, along, size, count
    return (APART if vv > (CLOSE * size) ** 2 else MEET), best, along, size, count


@formula
def point(room, at, count):
    """The point of core 1 that the simplex found stands for."""
    x = (0.0, 0.0, 0.0)
    for k in range(count):
        x = add(x, scale(room[at + k, 6], load3(room, at + k, 3)))
    return x
