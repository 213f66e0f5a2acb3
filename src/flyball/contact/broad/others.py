"""Contacts of pairs that the narrow phase is asked about."""

from __future__ import annotations

from ...compiler.formulas import formula
from ...math.vec import add, dot, load3, norm, scale, sub
from ..tables import AHEAD, MARGIN
from .carried import velocity
from .desk import AT, BOUNDED, DRIFT, FLAT, FORM, GOES, MOVES, ORIGIN, SHAPE, SIZE, SPIN, TURNS, UP
from .envelopes import bodies_meet, depth
from .rows import sign, write
from .same import before
from .swept import ask, first_touch, recall, remember

FAR = 0.25  # what goes further than this with a step, in radii of the smaller shape, is carried on to where it touches


@formula
def frame_velocity(B):
    """The velocity with which all go together, if they do."""
    return (B.real[DRIFT], B.real[DRIFT + 1], B.real[DRIFT + 2])


@formula
def way(B, s, t):
    """What two bounded slots cover of their distance in `AHEAD` seconds at most."""
    u = norm(sub(load3(B.now, t, GOES), load3(B.now, s, GOES)))
    return B.real[AHEAD] * (u + B.now[s, SPIN] + B.now[t, SPIN])


@formula
def farthest(B, s, t):
    """The largest gap at which a pair of bounded slots may touch within `AHEAD` seconds; below 0 if it cannot."""
    now = B.now
    reach = B.real[MARGIN]
    D = frame_velocity(B)
    v, w = sub(load3(now, s, GOES), D), sub(load3(now, t, GOES), D)
    u = max(norm(sub(w, v)), norm(v), norm(w))
    d = sub(load3(now, t, AT), load3(now, s, AT))
    reach += B.real[AHEAD] * (u + now[s, SPIN] + now[t, SPIN])
    whole = reach + now[s, SIZE] + now[t, SIZE]
    return reach if dot(d, d) < whole * whole and bodies_meet(B, B.axes, s, t, d, reach) else -1.0


@formula
def above(M, B, w, s):
    """As `farthest`, for wide slot w and slot s."""
    k = w - B.count[BOUNDED]
    q = B.wide
    p, n = load3(B.now, s, AT), load3(q, k, UP)
    u = norm(sub(velocity(M, B.slot[w, MOVES], p), load3(B.now, s, GOES)))
    gap = dot(n, sub(p, load3(q, k, ORIGIN))) - depth(B, B.axes, s, n)
    reach = B.real[MARGIN] + B.real[AHEAD] * (u + B.now[s, SPIN] + norm(load3(q, k, TURNS)) * B.now[s, SIZE])
    return -1.0 if gap > reach else reach


@formula
def taken_back(M, p, a, b, time):
    """A point at which movers a and b will touch after some time, before it, and half of what it is apart on them.

    Each mover has it where it will be from its origin when they touch.
    """
    v = load3(M.twist, a, 0) if a >= 0 else (0.0, 0.0, 0.0)
    u = load3(M.twist, b, 0) if b >= 0 else (0.0, 0.0, 0.0)
    if a < 0 or b < 0:
        return sub(p, scale(time, add(v, u))), (0.0, 0.0, 0.0)
    return sub(p, scale(0.5 * time, add(v, u))), scale(0.5 * time, sub(v, u))


@formula
def take(M, C, O, B, pair, rows, time, found):
    """Of the contacts in ``room``, after some time of motion, those that may touch: into C, as they are before it.

    ``rows`` are the first contact of the pair before and the row that the first now goes to. Returns how many.
    """
    many, used, ahead = 0, 0, B.real[AHEAD]
    s, t = pair
    i, j = B.slot[s, SHAPE], B.slot[t, SHAPE]
    size = min(B.now[s, SIZE], B.now[t, SIZE])
    for k in range(found):
        p, e = load3(B.room, k, 0), load3(B.room, k, 3)
        v, u = velocity(M, B.slot[s, MOVES], p), velocity(M, B.slot[t, MOVES], p)
        closing = dot(e, sub(v, u))
        gap = B.room[k, 6] + time * closing
        D = frame_velocity(B)
        if s < B.count[BOUNDED] and t < B.count[BOUNDED]:  # something else may stop one of them
            closing = max(closing, dot(e, sub(v, D)), dot(e, sub(D, u)))
        if gap < B.real[MARGIN] + ahead * max(0.0, closing):
            p, apart = taken_back(M, p, B.slot[s, MOVES], B.slot[t, MOVES], time)
            feature = int(B.room[k, 7])
            c, bit = before(O, (i, j), rows[0], feature, sub(p, scale(ahead, v)), size, used)
            used |= bit
            write(C, rows[1] + many, p, e, gap, apart)
            sign(C, rows[1] + many, i, j, feature, c)
            many += 1
    return many


@formula
def others(G, M, C, O, B, pair, first, n):
    """Contacts of any pair of slots, from row n on: how many. ``first`` is the pair's first contact before."""
    s, t = pair
    bounded = B.count[BOUNDED]
    reach = farthest(B, s, t) if s < bounded and t < bounded else above(M, B, max(s, t), min(s, t))
    if reach < 0.0:
        return 0
    a, b, size = B.slot[s, MOVES], B.slot[t, MOVES], min(B.now[s, SIZE], B.now[t, SIZE])
    flat = (s >= bounded and B.slot[s, FORM] == FLAT) or (t >= bounded and B.slot[t, FORM] == FLAT)
    near = way(B, s, t) if s < bounded and t < bounded else reach - B.real[MARGIN]
    if flat or near <= FAR * size:
        return take(M, C, O, B, pair, (first, n), 0.0, ask(G, M, B, s, t, reach))
    found = ask(G, M, B, s, t, B.real[MARGIN])
    if found > 0:
        return take(M, C, O, B, pair, (first, n), 0.0, ask(G, M, B, s, t, reach))
    remember(M, B, 0, a)
    remember(M, B, 1, b)
    found, time = first_touch(G, M, B, s, t, B.real[MARGIN] + near, size)
    found = take(M, C, O, B, pair, (first, n), time, found)
    recall(M, B, 0, a)
    recall(M, B, 1, b)
    return found
