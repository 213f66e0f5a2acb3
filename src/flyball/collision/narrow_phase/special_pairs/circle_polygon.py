"""A circle and a convex polygon in the plane."""

from __future__ import annotations

from ....compiler.formulas import formula
from ....math.vec import mtv, mv, neg, scale
from ...shape_kinds import POLYGON, SPHERE
from ..distance import point_polygon_distance
from ..primitives import write_point

KINDS = (SPHERE, POLYGON)


@formula
def collide(G, i, j, A, B, reach, scratch):
    """Write one contact; if the centre is inside the polygon, with the normal of the nearest side."""
    r = G.dimensions.par[i, 0]
    length, d, _ = point_polygon_distance(G, j, neg(mtv(B[1], B[0])))
    gap = length - r - G.dimensions.par[j, 0]
    if not gap <= reach:
        return 0
    n = mv(B[1], (-d[0], -d[1], 0.0))
    n = (n[0], n[1], 0.0)
    write_point(scale(r + 0.5 * gap, n), n, gap, 0.0, scratch, 0)
    return 1
