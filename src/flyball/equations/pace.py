"""What rates are compared with: a mechanism's own speed, and the quickest of what is measured."""

from __future__ import annotations

from ..compiler.formulas import formula
from ..math.scalar import magnitude
from ..tables.system import RATE
from .rows import measured


@formula
def own_speed(S):
    """The mechanism's length at its own rate [m/s]."""
    return S.scales.length * S.scales.rate


@formula
def pace(S, m):
    """The same for quantity m, whose unit may be a radian."""
    return S.units[m] * S.scales.rate


@formula
def quickest(S, W):
    """The largest rate that is measured."""
    fastest = 0.0
    for m in range(measured(S)):
        fastest = max(fastest, magnitude(W.sensed[RATE, m]))
    return fastest
