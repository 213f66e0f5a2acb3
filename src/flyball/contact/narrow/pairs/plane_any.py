"""A plane and any convex shape."""

from __future__ import annotations

from math import inf

from ....compiler.formulas import formula
from ....math.vec import add, col, dot, mtv, mv, neg, put3
from ...kinds import PLANE
from ...tables import KIND, RADIUS
from ..any_shape import radius, support
from ..cut import DEPTH, EDGE, X, Y, Z
from ..manifold import NEAREST_NAME, SAME, axes_of, drawn, fewer, tell
from ..room import CORNERS, FACE_1

KINDS = (PLANE, None)


@formula
def collide(G, i, j, A, B, reach, room):
    """Corners of the face that looks down on the plane, and the lowest point where that is lower than these."""
    n = col(A[1], 2)
    frame = axes_of(n)
    kind = G.shape_i[j, KIND]
    r = radius(kind, G, j)
    d = mtv(B[1], neg(n))
    lowest = add(B[0], mv(B[1], support(kind, G, j, d)))
    gap = dot(n, lowest) - r
    if not gap <= reach:
        return 0
    count, number = drawn(G, j, B, neg(n), frame, room, FACE_1)
    kept, least = 0, inf
    for k in range(FACE_1, FACE_1 + count):
        g = room[k, Z] - r
        if g <= reach:
            to = FACE_1 + kept
            put3(room, to, 0, (room[k, X], room[k, Y], 0.5 * g))
            room[to, EDGE], room[to, DEPTH] = number * CORNERS + k - FACE_1, g
            kept += 1
            least = min(least, g)
    same = SAME * G.shape_x[j, RADIUS]
    if gap < least - same:
        put3(room, FACE_1 + kept, 0, (dot(frame[0], lowest), dot(frame[1], lowest), 0.5 * gap))
        room[FACE_1 + kept, EDGE], room[FACE_1 + kept, DEPTH] = NEAREST_NAME, gap
        kept += 1
    if kept > 4:
        kept = fewer(room, FACE_1, kept, same)
    tell(room, FACE_1, kept, frame)
    return kept
