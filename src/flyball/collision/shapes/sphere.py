"""A sphere: a point with a radius. In planar mechanisms a circle."""

from __future__ import annotations

from ...compiler.formulas import formula
from ..shape_kinds import SPHERE

KIND = SPHERE


@formula
def support(G, i, d):
    """Return the centre."""
    return (0.0, 0.0, 0.0)


@formula
def radius(G, i):
    """Radius; the core is a point."""
    return G.dimensions.par[i, 0]
