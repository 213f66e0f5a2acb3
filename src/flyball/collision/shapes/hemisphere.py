"""A solid hemisphere: flat side in z = 0, dome towards +z."""

from __future__ import annotations

from ...compiler.formulas import formula
from ...math.scalar import sqrt
from ...math.vec import dot, scale
from ..narrow_phase.primitives import disc_corners, lateral_direction
from ..shape_kinds import HEMISPHERE

KIND = HEMISPHERE


@formula
def support(G, i, d):
    """Return a point of the dome or of the rim."""
    r = G.dimensions.par[i, 0]
    if d[2] > 0.0:
        return scale(r / sqrt(dot(d, d)), d)
    (x, y), s = lateral_direction(d)
    return (r * x, r * y, 0.0)


@formula
def face(G, i, d, scratch, at):
    """Write the flat side as a polygon, if d points down by more than 45 degrees; otherwise no flat part."""
    if d[2] * d[2] < 0.5 or d[2] > 0.0:
        return 0, 1
    return disc_corners(G.dimensions.par[i, 0], 0.0, -1.0, d, scratch, at), 0
