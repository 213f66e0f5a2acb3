"""A sphere and a cylinder."""

from __future__ import annotations

from ....compiler.formulas import formula
from ....math.vec import mtv, mv, neg, scale
from ...shape_kinds import CYLINDER, SPHERE
from ..primitives import lateral_direction, unit_vector_between, write_point

KINDS = (SPHERE, CYLINDER)


@formula
def collide(G, i, j, A, B, reach, scratch):
    """Write one contact; if the centre is inside the cylinder, with the normal of the nearest part of its surface."""
    r, s, h = G.dimensions.par[i, 0], G.dimensions.par[j, 0], G.dimensions.par[j, 1]
    c = neg(mtv(B[1], B[0]))  # the sphere's centre in the cylinder's axes
    (x, y), rho = lateral_direction(c)
    q = min(rho, s)
    d, length = unit_vector_between(c, (q * x, q * y, max(-h, min(h, c[2]))))
    if rho <= s and abs(c[2]) <= h:
        if s - rho < h - abs(c[2]):
            d, length = (-x, -y, 0.0), rho - s
        else:
            d, length = (0.0, 0.0, -1.0 if c[2] >= 0 else 1.0), abs(c[2]) - h
    gap = length - r
    if not gap <= reach:
        return 0
    n = mv(B[1], d)
    write_point(scale(r + 0.5 * gap, n), n, gap, 0.0, scratch, 0)
    return 1
