"""A cylinder along z."""

from __future__ import annotations

from ....compiler.formulas import formula
from ....math.vec import put3
from ...kinds import CYLINDER
from ...tables import PAR
from ..disc import across, disc

KIND = CYLINDER


@formula
def support(G, i, d):
    """A point of either rim."""
    r, h = G.shape_x[i, PAR], G.shape_x[i, PAR + 1]
    (x, y), _ = across(d)
    return (r * x, r * y, h if d[2] >= 0 else -h)


@formula
def face(G, i, d, room, at):
    """A line of its side, or either disc as a polygon."""
    r, h = G.shape_x[i, PAR], G.shape_x[i, PAR + 1]
    (x, y), s = across(d)
    if s > abs(d[2]):
        put3(room, at, 0, (r * x, r * y, -h))
        put3(room, at + 1, 0, (r * x, r * y, h))
        return 2, 0
    up = 1.0 if d[2] >= 0 else -1.0
    return disc(r, up * h, up, d, room, at), 1 if up > 0 else 2
