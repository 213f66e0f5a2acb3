"""|p_M - p_F| = L: a massless link between two points (Hahn's BB5)."""

from __future__ import annotations

from ..compiler.formulas import formula
from ..math.scalar import divide
from ..math.vec import dot, norm, scale, sub

KIND = 3
OFTEN = True
POINTS = "FM"


@formula
def row(par, F, M, hint, data):
    """Value, force on M at its origin (minus that on F), torques on M and F about their origins, acceleration bias.

    g = |d| - L, gdot = e.u, gddot = e.(a_M - a_F) + (u.u - (e.u)^2) / |d| with e = d / |d|.
    """
    d = sub(M[0], F[0])
    u = sub(M[3], F[3])
    length = norm(d)
    e = scale(divide(1.0, length), d)
    rate = dot(e, u)
    o = 0.0 * par[0]
    bias = dot(e, sub(M[5], F[5])) + divide(dot(u, u) - rate * rate, length)
    return length - par[6], e, (o, o, o), (o, o, o), bias
