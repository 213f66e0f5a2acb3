"""A sphere and a plane."""

from __future__ import annotations

from ....compiler.formulas import formula
from ....math.vec import col, dot, neg, scale
from ...shape_kinds import PLANE, SPHERE
from ..primitives import write_point

KINDS = (SPHERE, PLANE)


@formula
def collide(G, i, j, A, B, reach, scratch):
    """Write one contact, below the sphere's centre."""
    n, r = neg(col(B[1], 2)), G.dimensions.par[i, 0]
    gap = dot(n, B[0]) - r
    if not gap <= reach:
        return 0
    write_point(scale(r + 0.5 * gap, n), n, gap, 0.0, scratch, 0)
    return 1
