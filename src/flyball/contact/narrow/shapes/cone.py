"""A cone: its base in z = 0, its tip at +z."""

from __future__ import annotations

from ....compiler.formulas import formula
from ....math.scalar import sqrt
from ....math.vec import put3
from ...kinds import CONE
from ...tables import PAR
from ..disc import across, disc

KIND = CONE


@formula
def support(G, i, d):
    """Its tip or a point of its rim."""
    r, h = G.shape_x[i, PAR], G.shape_x[i, PAR + 1]
    (x, y), s = across(d)
    if h * d[2] > r * s:
        return (0.0, 0.0, h)
    return (r * x, r * y, 0.0)


@formula
def face(G, i, d, room, at):
    """A line of its mantle, or its base as a polygon."""
    r, h = G.shape_x[i, PAR], G.shape_x[i, PAR + 1]
    (x, y), s = across(d)
    if h * s + r * d[2] > -d[2] * sqrt(h * h + r * r):
        put3(room, at, 0, (r * x, r * y, 0.0))
        put3(room, at + 1, 0, (0.0, 0.0, h))
        return 2, 0
    return disc(r, 0.0, -1.0, d, room, at), 1
