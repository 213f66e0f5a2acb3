"""A cylinder along z."""

from __future__ import annotations

from ...compiler.formulas import formula
from ...math.vec import store3
from ..narrow_phase.primitives import disc_corners, lateral_direction
from ..shape_kinds import CYLINDER

KIND = CYLINDER


@formula
def support(G, i, d):
    """Return a point of one of the rims."""
    r, h = G.dimensions.par[i, 0], G.dimensions.par[i, 1]
    (x, y), _ = lateral_direction(d)
    return (r * x, r * y, h if d[2] >= 0 else -h)


@formula
def face(G, i, d, scratch, at):
    """Write a line of the lateral surface, or one of the discs as a polygon."""
    r, h = G.dimensions.par[i, 0], G.dimensions.par[i, 1]
    (x, y), s = lateral_direction(d)
    if s > abs(d[2]):
        store3(scratch, at, 0, (r * x, r * y, -h))
        store3(scratch, at + 1, 0, (r * x, r * y, h))
        return 2, 0
    up = 1.0 if d[2] >= 0 else -1.0
    return disc_corners(r, up * h, up, d, scratch, at), 1 if up > 0 else 2
