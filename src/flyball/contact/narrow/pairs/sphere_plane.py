"""A sphere and a plane."""

from __future__ import annotations

from ....compiler.formulas import formula
from ....math.vec import col, dot, neg, scale
from ...kinds import PLANE, SPHERE
from ...tables import PAR
from ..balls import point

KINDS = (SPHERE, PLANE)


@formula
def collide(G, i, j, A, B, reach, room):
    """One point below the sphere's middle."""
    n, r = neg(col(B[1], 2)), G.shape_x[i, PAR]
    gap = dot(n, B[0]) - r
    if not gap <= reach:
        return 0
    point(scale(r + 0.5 * gap, n), n, gap, 0.0, room, 0)
    return 1
