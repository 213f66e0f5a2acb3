"""Two spheres."""

from __future__ import annotations

from ....compiler.formulas import formula
from ...kinds import SPHERE
from ...tables import PAR
from ..balls import balls

KINDS = (SPHERE, SPHERE)


@formula
def collide(G, i, j, A, B, reach, room):
    """One point, on the line between the middles."""
    return balls(A[0], G.shape_x[i, PAR], B[0], G.shape_x[j, PAR], reach, room, 0, 0.0)
