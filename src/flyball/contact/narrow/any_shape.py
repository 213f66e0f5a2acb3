"""What is asked of a shape of any kind: the lists of kinds are written from ``shapes``, so none is named here.

A shape of an unknown kind has its surface nowhere (nan).
"""

from __future__ import annotations

from ...compiler.formulas import formula
from ...compiler.sources import ladder
from ...math.vec import put3
from .shapes.registry import SHAPES

support = ladder(__name__, "support", "G, i, d", {s.kind: s.support for s in SHAPES}, "(nan, nan, nan)")
"""The farthest point of a core along d."""

radius = ladder(__name__, "radius", "G, i", {s.kind: s.radius for s in SHAPES}, "nan")
"""The rounding radius."""

_flat = ladder(__name__, "flat", "G, i, d, room, at", {s.kind: s.face for s in SHAPES if s.face}, "0, 0")


@formula
def face(kind, G, i, d, room, at):
    """Corners of the part of a core's surface that faces d, and its number; a kind without faces has one point."""
    count, number = _flat(kind, G, i, d, room, at)
    if count == 0:
        put3(room, at, 0, support(kind, G, i, d))
        count = 1
    return count, number
