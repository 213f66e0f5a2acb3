"""A sphere and a box."""

from __future__ import annotations

from ....compiler.formulas import formula
from ....math.vec import load3, mtv, mv, neg, scale
from ...shape_kinds import BOX, SPHERE
from ..primitives import unit_vector_between, write_point

KINDS = (SPHERE, BOX)


@formula
def collide(G, i, j, A, B, reach, scratch):
    """Write one contact; if the centre is inside the box, with the normal of the nearest side."""
    h, r = load3(G.dimensions.par, j, 0), G.dimensions.par[i, 0]
    c = neg(mtv(B[1], B[0]))  # the sphere's centre in the box's axes
    q = (max(-h[0], min(h[0], c[0])), max(-h[1], min(h[1], c[1])), max(-h[2], min(h[2], c[2])))
    d, length = unit_vector_between(c, q)
    if length == 0.0:
        x, y, z = h[0] - abs(c[0]), h[1] - abs(c[1]), h[2] - abs(c[2])
        if x <= y and x <= z:
            d, length = (-1.0 if c[0] >= 0 else 1.0, 0.0, 0.0), -x
        elif y <= z:
            d, length = (0.0, -1.0 if c[1] >= 0 else 1.0, 0.0), -y
        else:
            d, length = (0.0, 0.0, -1.0 if c[2] >= 0 else 1.0), -z
    gap = length - r
    if not gap <= reach:
        return 0
    n = mv(B[1], d)
    write_point(scale(r + 0.5 * gap, n), n, gap, 0.0, scratch, 0)
    return 1
