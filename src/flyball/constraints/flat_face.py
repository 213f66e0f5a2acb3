"""A flat face on M touches a convex profile in F's x-y plane: a cam with a flat-faced follower.

M's x axis n is the normal of the face, away from the profile, and psi its angle in F. The support function h(psi) of
the profile is its extent along n, from F's origin: a spline at par[1] in ``data``. The face touches where n.d = h(psi),
d = p_M - p_F, at the point h n + h' t (t = z x n), where the row's force n acts; h + h'' is the radius of curvature
there. (Support function: L. A. Santalo, *Integral Geometry and Geometric Probability* (1976), chapter 1.)
"""

from __future__ import annotations

from ..compiler.formulas import formula
from ..math.spline import spline
from ..math.vec import dot, neg, scale, sub
from . import angle, displacement

KIND = 22
SPLINES = True


@formula
def row(par, F, M, hint, data):
    """Value n.d - h(psi), force on M at its origin, torques on M and F about their origins, acceleration bias.

    n.d is the reverse of the displacement of F's origin along M's x axis; psi is the angle of M's x axis in F.
    """
    o = 0.0 * par[0]
    reverse, force, torque_F, torque_M, bias = displacement.row((o + 1.0, o, o, o, o, o, o, o), M, F, hint, data)
    psi, _, turn_M, turn_F, turn_bias = angle.row((o, o, o, o, o, o, o, o), F, M, hint, data)
    h, h1, h2 = spline(data, int(par[1].real), psi)
    rate = dot(turn_M, M[2]) + dot(turn_F, F[2])
    torque_M = sub(neg(torque_M), scale(h1, turn_M))
    torque_F = sub(neg(torque_F), scale(h1, turn_F))
    second = -bias - h1 * turn_bias - h2 * rate * rate
    return -reverse - h - par[6], force, torque_M, torque_F, second
