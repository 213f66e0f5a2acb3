"""A sphere: a point with a radius. In planar mechanisms a circle."""

from __future__ import annotations

from ...compiler.formulas import formula
from ..shape_kinds import SPHERE
from ..tables import PAR

KIND = SPHERE


@formula
def support(G, i, d):
    """The middle."""
    return (0.0, 0.0, 0.0)


@formula
def radius(G, i):
    """All of it is rounding."""
    return G.shape_x[i, PAR]
