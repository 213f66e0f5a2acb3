"""A cone: base in z = 0, tip at +z."""

from __future__ import annotations

from ...compiler.formulas import formula
from ...math.scalar import sqrt
from ...math.vec import store3
from ..narrow_phase.primitives import disc_corners, lateral_direction
from ..shape_kinds import CONE

KIND = CONE


@formula
def support(G, i, d):
    """Return the tip or a point of the rim."""
    r, h = G.dimensions.par[i, 0], G.dimensions.par[i, 1]
    (x, y), s = lateral_direction(d)
    if h * d[2] > r * s:
        return (0.0, 0.0, h)
    return (r * x, r * y, 0.0)


@formula
def face(G, i, d, scratch, at):
    """Write a line of the lateral surface, or the base as a polygon."""
    r, h = G.dimensions.par[i, 0], G.dimensions.par[i, 1]
    (x, y), s = lateral_direction(d)
    if h * s + r * d[2] > -d[2] * sqrt(h * h + r * r):
        store3(scratch, at, 0, (r * x, r * y, 0.0))
        store3(scratch, at + 1, 0, (0.0, 0.0, h))
        return 2, 0
    return disc_corners(r, 0.0, -1.0, d, scratch, at), 1
