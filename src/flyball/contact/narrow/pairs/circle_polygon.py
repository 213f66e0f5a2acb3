"""A circle and a convex polygon in the plane."""

from __future__ import annotations

from ....compiler.formulas import formula
from ....math.vec import mtv, mv, neg, scale
from ...kinds import POLYGON, SPHERE
from ...tables import PAR
from ..balls import point
from ..polygons import nearest_side

KINDS = (SPHERE, POLYGON)


@formula
def collide(G, i, j, A, B, reach, room):
    """One point; where the middle is inside the polygon, towards the nearest side."""
    r = G.shape_x[i, PAR]
    length, d, _ = nearest_side(G, j, neg(mtv(B[1], B[0])))
    gap = length - r - G.shape_x[j, PAR]
    if not gap <= reach:
        return 0
    n = mv(B[1], (-d[0], -d[1], 0.0))
    n = (n[0], n[1], 0.0)
    point(scale(r + 0.5 * gap, n), n, gap, 0.0, room, 0)
    return 1
