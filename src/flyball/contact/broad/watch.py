"""What has moved: where all shapes are, which have left their envelopes, and where the frame goes."""

from __future__ import annotations

from ...compiler.formulas import formula
from ..tables import AHEAD, SKIN
from .desk import AT, BALL, BOUNDED, DRIFT, DRIFTS, FORM, LAG, MOVED, MOVES, SHAPE, STRIDE, USUAL, WIDE
from .envelopes import STEPS, axes_now, locate, within
from .unbounded import gone, place_wide

TOGETHER, APART = 0.6, 0.4  # squared common velocity over mean square: above, the frame goes along; below, it stops
SLOW = 0.5  # but not where an envelope reaches less far ahead than this, in skins


@formula
def census(M, B):
    """The first mover with a number that is none, or -1; whether all move together, and then the frame's velocity."""
    v, v2, n = (0.0, 0.0, 0.0), 0.0, 1.0 * M.pose.shape[0]
    for m in range(M.pose.shape[0]):
        total = 0.0
        for c in range(12):
            total += 0.0 * M.pose[m, c]
        for c in range(6):
            total += 0.0 * M.twist[m, c]
        if not total == 0.0:
            return m
        a, b, c = M.twist[m, 0], M.twist[m, 1], M.twist[m, 2]
        v = (v[0] + a, v[1] + b, v[2] + c)
        v2 += a * a + b * b + c * c
    mean2 = (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]) / max(1.0, n)  # n times the square of the mean velocity
    goes = n > 1.0 and mean2 > (TOGETHER if B.count[DRIFTS] == 0 else APART) * v2
    for s in range(B.count[BOUNDED] + B.count[WIDE]):  # what stands may stop what moves past the frame
        goes = goes and B.slot[s, MOVES] >= 0
    slow = SLOW * B.real[SKIN] * B.real[USUAL]
    goes = goes and mean2 * (STEPS * B.real[AHEAD]) ** 2 > n * slow * slow
    for c in range(3):
        B.real[DRIFT + c] = v[c] / n if goes else 0.0
    B.count[DRIFTS] = 1 if goes else 0
    return -1


@formula
def follow(B, n, way):
    """Where the frame goes with the next search: as far as all n shapes did now, and what it lags behind.

    ``way`` is the sum of their displacements since the last search.
    """
    for c in range(3):
        if B.count[DRIFTS] != 0 and n > 0.0:
            B.real[LAG + c] += way[c] / n - B.real[STRIDE + c]
            B.real[STRIDE + c] = way[c] / n + B.real[LAG + c]
        else:
            B.real[LAG + c] = B.real[STRIDE + c] = 0.0


@formula
def look(G, M, B):
    """Bring all up to now; slots that have left their envelopes go to ``moved``, marked.

    Returns how many shapes can move, and the sum of their displacements.
    """
    moved, n, way = 0, 0.0, (0.0, 0.0, 0.0)
    now = B.now
    for s in range(B.count[BOUNDED]):
        m, i, ball = B.slot[s, MOVES], B.slot[s, SHAPE], B.slot[s, FORM] == BALL
        if m >= 0:
            x, y, z = now[s, AT], now[s, AT + 1], now[s, AT + 2]
            locate(M, B, i, m, ball, now, s)
            way = (way[0] + now[s, AT] - x, way[1] + now[s, AT + 1] - y, way[2] + now[s, AT + 2] - z)
            n += 1.0
            if not ball:
                axes_now(G, M, B, s, i, m)
        B.mark[s] = 0
        if not within(B, s, ball):
            B.mark[s] = 1
            B.moved[moved] = s
            moved += 1
    for w in range(B.count[WIDE]):
        s = B.count[BOUNDED] + w
        place_wide(G, M, B, w, B.slot[s, SHAPE], B.slot[s, MOVES])
        B.mark[s] = 0
        if gone(B, w):
            B.mark[s] = 1
            B.moved[moved] = s
            moved += 1
    B.count[MOVED] = moved
    return n, way
