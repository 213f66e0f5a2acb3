"""n . (p_M - p_F) = c with n fixed in the world: one row of a common point.

Three of them fix a point; their multipliers are the world components of the force.
"""

from __future__ import annotations

from ..compiler.formulas import formula
from ..math.vec import dot, sub

KIND = 0
OFTEN = True
POINTS = "FM"


@formula
def row(par, F, M, hint, data):
    """Value, force on M at its origin (minus that on F), torques on M and F about their origins, acceleration bias."""
    n = (par[0], par[1], par[2])
    o = 0.0 * par[0]
    zero = (o, o, o)
    return dot(n, sub(M[0], F[0])) - par[6], n, zero, zero, dot(n, sub(M[5], F[5]))
