"""Two convex polygons in the plane."""

from __future__ import annotations

from math import inf

from ....compiler.formulas import formula
from ....math.vec import add, mtv, mv, neg, scale, sub
from ...shape_kinds import POLYGON
from ...shapes.polygon import support
from ..distance import polygon_distance, polygon_separation
from ..manifold import manifold, smallest_contact_gap

KINDS = (POLYGON, POLYGON)
PREFER = 1e-9  # relative to the size; preference of sides over corners, of the first polygon over the second


@formula
def collide(G, i, j, A, B, reach, scratch):
    """Write one or two contacts of the facing sides."""
    r, s = G.dimensions.par[i, 0], G.dimensions.par[j, 0]
    prefer = PREFER * min(G.dimensions.radius[i], G.dimensions.radius[j])
    far, n = polygon_separation(G, i, j, A, B, prefer)
    if far - r - s > reach:
        return 0
    if far > -inf:
        n = (n[0], n[1], 0.0)
        count = manifold(G, i, j, A, B, n, (inf, n), reach, scratch)
        if count > 0 and (far <= 0.0 or smallest_contact_gap(scratch, count) <= far - r - s + prefer):
            return count
    if -inf < far <= 0.0:  # sides too steep to clip: the deepest corner of the second polygon
        p = add(B[0], mv(B[1], support(G, j, mtv(B[1], neg(n)))))
        p = sub(p, scale(0.5 * far, n))
    else:
        far, n, p = polygon_distance(G, i, j, A, B, prefer)
    if not far - r - s <= reach:
        return 0
    n = (n[0], n[1], 0.0)
    p = add(p, scale(0.5 * (r - s), n))
    return manifold(G, i, j, A, B, n, (far - r - s, (p[0], p[1], 0.0)), reach, scratch)
