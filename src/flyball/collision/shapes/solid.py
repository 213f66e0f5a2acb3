"""A user-defined convex shape, by its support function: see `model.shapes.solid.ConvexSolid`.

Parameters: seven numbers for that function, and a scale factor.
"""

from __future__ import annotations

from math import nan

from ...compiler.formulas import formula, formula_at
from ...compiler.kernels import Signature
from ...math.vec import scale
from ..shape_kinds import SOLID

KIND = SOLID
SUPPORT_SIGNATURES = (Signature("support", "par, d", (7, 3), 3, "a point: a tuple of three numbers"),)
"""Signature of the formula of a user-defined shape."""


@formula
def support(G, i, d):
    """Evaluate the user's formula."""
    x = G.dimensions.par
    par = (x[i, 0], x[i, 1], x[i, 2], x[i, 3], x[i, 4], x[i, 5], x[i, 6])
    return scale(x[i, 7], formula_at(G.code[i], 0, (par, d), (nan, nan, nan)))
