"""m . (velocity of M's origin seen from F) = 0 with m fixed in M: a knife edge or skate, non-holonomic.

The row has no value; as a measured quantity its rate is a velocity along an axis that turns with M.
"""

from __future__ import annotations

from ..compiler.formulas import formula
from ..math.vec import cross, dot, mv, sub

KIND = 10


@formula
def row(par, F, M, hint, data):
    """No value, force on M at its origin (minus that on F), torques on M and F about their origins, acceleration bias.

    gdot = m.(u - w_F x d), u = v_M - v_F, d = p_M - p_F, mdot = w_M x m.
    """
    m = mv(M[1], (par[0], par[1], par[2]))
    o = 0.0 * par[0]
    d = sub(M[0], F[0])
    u = sub(M[3], F[3])
    seen = sub(u, cross(F[2], d))
    a = sub(sub(M[5], F[5]), cross(F[4], d))
    bias = dot(m, sub(a, cross(F[2], u))) + dot(cross(M[2], m), seen)
    return o * m[0], m, (o, o, o), cross(m, d), bias
