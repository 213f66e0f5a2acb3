"""Contacts of the pairs on the list."""

from __future__ import annotations

from ...compiler.formulas import formula
from .desk import ANY, BALL_FLAT, BALLS, HALF, LISTED, SHAPE
from .others import others
from .rounds import balls, flat_ball
from .rows import sign


@formula
def touch(G, M, C, O, B):
    """All contacts: how many there are, also where there is no room for them all."""
    n, half = 0, B.count[HALF]
    for k in range(B.count[LISTED]):
        s, t, way = B.pair[k, 0] + 0, B.pair[k, 1] + 0, B.pair[k, 2]  # + 0: all integers of one type
        first = B.seen[half, k] + 0
        if way == ANY:
            found = others(G, M, C, O, B, (s, t), first, n)
        else:
            if way == BALLS:
                found = balls(C, B, s, t, n)
            elif way == BALL_FLAT:
                found = flat_ball(C, B, t, s, -1.0, n)
            else:
                found = flat_ball(C, B, s, t, 1.0, n)
            if found != 0:
                sign(C, n, B.slot[s, SHAPE], B.slot[t, SHAPE], 0, first)
        B.seen[1 - half, k] = n if found > 0 else -1
        n += found
    return n
