"""Contacts of two convex shapes of any kind."""

from __future__ import annotations

from ...compiler.formulas import formula
from .manifold import manifold
from .nearest import closest


@formula
def any_pair(G, i, j, A, B, reach, room):
    """Where they are nearest, then the faces that meet there: see ``pairs.registry``."""
    gap, n, p = closest(G, i, j, A, B, reach, room)
    if not gap <= reach:
        return 0
    return manifold(G, i, j, A, B, n, (gap, p), reach, room)
