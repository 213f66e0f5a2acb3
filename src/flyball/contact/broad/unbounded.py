"""Planes and whatever else has no bounds: their pairs are looked for among all shapes, when they have moved.

What is no plane lies below one: its top.
"""

from __future__ import annotations

from ...compiler.formulas import formula
from ...math.scalar import sqrt
from ...math.vec import add, load3, put3, scale
from ..tables import AHEAD, AXES, MARGIN, PLACE, SKIN
from .carried import rotated, velocity_there
from .desk import (
    BOX_HALF,
    DRIFT,
    DRIFTS,
    FRAME,
    HALF_LINE,
    MIDDLE,
    ORIGIN,
    ORIGIN_0,
    ROUND,
    SIZE,
    SLACK,
    SPEED,
    TURNS,
    UP,
    UP_0,
    USUAL,
)
from .envelopes import depth


@formula
def place_wide(G, M, B, w, i, m):
    """Where the plane of wide shape ``w`` is and how it goes."""
    x, top = G.shape_x, B.hold[i, BOX_HALF]
    n = (x[i, AXES + 2], x[i, AXES + 5], x[i, AXES + 8])
    p = add(load3(x, i, PLACE), scale(top, n))
    v = (0.0, 0.0, 0.0)
    u = v
    if m >= 0:
        a, n = rotated(M, m, p), rotated(M, m, n)
        p, u, v = add(load3(M.pose, m, 0), a), load3(M.twist, m, 3), velocity_there(M, m, a)
    put3(B.wide, w, ORIGIN, p)
    put3(B.wide, w, UP, n)
    put3(B.wide, w, SPEED, v)
    put3(B.wide, w, TURNS, u)


@formula
def comes(B, w):
    """How far a plane comes along its normal in `AHEAD` seconds, in the frame."""
    x = B.wide
    a = x[w, UP] * (x[w, SPEED] - B.real[DRIFT])
    a += x[w, UP + 1] * (x[w, SPEED + 1] - B.real[DRIFT + 1])
    a += x[w, UP + 2] * (x[w, SPEED + 2] - B.real[DRIFT + 2])
    return B.real[AHEAD] * max(0.0, a)


@formula
def gone(B, w):
    """Whether a wide shape may have got pairs by moving."""
    x, along, turned = B.wide, 0.0, 0.0
    for c in range(3):
        along += x[w, UP + c] * (x[w, ORIGIN + c] - B.real[FRAME + c] - x[w, ORIGIN_0 + c])
        turned += abs(x[w, UP + c] - x[w, UP_0 + c]) + abs(x[w, TURNS + c])
    return turned > 0.0 or abs(along) + comes(B, w) > x[w, SLACK]


@formula
def settle(B, w, still):
    """Remember where a wide shape is while its pairs are looked for."""
    for c in range(3):
        B.wide[w, ORIGIN_0 + c] = B.wide[w, ORIGIN + c] - B.real[FRAME + c]
        B.wide[w, UP_0 + c] = B.wide[w, UP + c]
    B.wide[w, SLACK] = 0.0
    if not still or B.count[DRIFTS] != 0:
        B.wide[w, SLACK] = B.real[SKIN] * B.real[USUAL] + comes(B, w)


@formula
def reaches(B, w, s):
    """Whether the envelope of slot s comes below the plane of a wide shape."""
    x, gap, lead = B.wide, 0.0, 0.0
    far, turns = 0.0, 0.0
    for c in range(3):
        a = B.fat[s, MIDDLE + c] + B.real[FRAME + c] - x[w, ORIGIN + c]
        gap += x[w, UP + c] * a
        lead += x[w, UP + c] * B.fat[s, HALF_LINE + c]
        far += a * a
        turns += x[w, TURNS + c] ** 2
    deep = depth(B, B.turn, s, (x[w, UP], x[w, UP + 1], x[w, UP + 2]))
    reach = B.fat[s, ROUND] + 0.5 * B.real[MARGIN] - B.now[s, SIZE] + deep + x[w, SLACK]
    if turns > 0.0:
        reach += B.real[AHEAD] * sqrt(turns * far)
    return gap - abs(lead) <= reach
