"""A plane and any convex shape."""

from __future__ import annotations

from math import inf

from ....compiler.formulas import formula
from ....math.vec import add, col, dot, mtv, mv, neg, store3
from ...shape_kinds import PLANE
from ...shapes.registry import radius, support
from ..manifold import (
    DEPTH,
    EDGE,
    NEAREST_FEATURE,
    SAME_POINT,
    X,
    Y,
    Z,
    contact_frame,
    face_in_frame,
    reduce_to_four,
    write_contacts,
)
from ..primitives import FACE_1, MAX_CORNERS

KINDS = (PLANE, None)


@formula
def collide(G, i, j, A, B, reach, scratch):
    """Write contacts of the corners of the face towards the plane, and of the lowest point if it is lower."""
    n = col(A[1], 2)
    frame = contact_frame(n)
    kind = G.shape.kind[j]
    r = radius(kind, G, j)
    d = mtv(B[1], neg(n))
    lowest = add(B[0], mv(B[1], support(kind, G, j, d)))
    gap = dot(n, lowest) - r
    if not gap <= reach:
        return 0
    count, number = face_in_frame(G, j, B, neg(n), frame, scratch, FACE_1)
    kept, least = 0, inf
    for k in range(FACE_1, FACE_1 + count):
        g = scratch[k, Z] - r
        if g <= reach:
            to = FACE_1 + kept
            store3(scratch, to, 0, (scratch[k, X], scratch[k, Y], 0.5 * g))
            scratch[to, EDGE], scratch[to, DEPTH] = number * MAX_CORNERS + k - FACE_1, g
            kept += 1
            least = min(least, g)
    same = SAME_POINT * G.dimensions.radius[j]
    if gap < least - same:
        store3(scratch, FACE_1 + kept, 0, (dot(frame[0], lowest), dot(frame[1], lowest), 0.5 * gap))
        scratch[FACE_1 + kept, EDGE], scratch[FACE_1 + kept, DEPTH] = NEAREST_FEATURE, gap
        kept += 1
    if kept > 4:
        kept = reduce_to_four(scratch, FACE_1, kept, same)
    write_contacts(scratch, FACE_1, kept, frame)
    return kept
