"""A capsule: a line segment along z with a radius."""

from __future__ import annotations

from ...compiler.formulas import formula
from ...math.vec import store3
from ..shape_kinds import CAPSULE

KIND = CAPSULE


@formula
def support(G, i, d):
    """Return the upper or lower end of the segment."""
    h = G.dimensions.par[i, 1]
    return (0.0, 0.0, h if d[2] >= 0 else -h)


@formula
def face(G, i, d, scratch, at):
    """Write the segment."""
    h = G.dimensions.par[i, 1]
    store3(scratch, at, 0, (0.0, 0.0, -h))
    store3(scratch, at + 1, 0, (0.0, 0.0, h))
    return 2, 0


@formula
def radius(G, i):
    """Radius about the segment."""
    return G.dimensions.par[i, 0]
