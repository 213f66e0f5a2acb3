"""Two spheres."""

from __future__ import annotations

from ....compiler.formulas import formula
from ...shape_kinds import SPHERE
from ..primitives import sphere_contact

KINDS = (SPHERE, SPHERE)


@formula
def collide(G, i, j, A, B, reach, scratch):
    """Write one contact, on the line between the centres."""
    return sphere_contact(A[0], G.dimensions.par[i, 0], B[0], G.dimensions.par[j, 0], reach, scratch, 0, 0.0)
