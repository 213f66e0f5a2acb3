"""An ellipsoid about its axes."""

from __future__ import annotations

from ...compiler.formulas import formula
from ...math.scalar import sqrt
from ...math.vec import load3
from ..shape_kinds import ELLIPSOID

KIND = ELLIPSOID


@formula
def support(G, i, d):
    """Return the point with normal d: A d / |A^(1/2) d|, with A the squares of the half axes."""
    a = load3(G.dimensions.par, i, 0)
    x, y, z = a[0] * d[0], a[1] * d[1], a[2] * d[2]
    length = sqrt(x * x + y * y + z * z)
    s = 1.0 / length if length > 0.0 else 0.0
    return (s * a[0] * x, s * a[1] * y, s * a[2] * z)
