"""A component of the rotation vector from F to M (axis times angle, at most half a turn), along an axis fixed in F.

Its components are the same along F's axes and M's. At half a turn the axis flips and the value is no number.
"""

from __future__ import annotations

from ..compiler.formulas import formula
from ..math.rotation import log_gradient, log_gradient_rate, rotation_vector
from ..math.vec import cross, dot, mm, mtv, mv, neg, sub, transpose

KIND = 20


@formula
def row(par, F, M, hint, data):
    """Value, force on M, torques on M and F, acceleration bias.

    With the rotation vector theta and the relative angular velocity u along F's axes, thetadot = J u: the rate of the
    component along a is (J^T a).u.
    """
    a = (par[0], par[1], par[2])
    theta = rotation_vector(mm(transpose(F[1]), M[1]))
    w = sub(M[2], F[2])
    u = mtv(F[1], w)
    g = log_gradient(theta, a)
    rate = log_gradient(neg(theta), u)
    t = mv(F[1], g)
    bias = dot(t, sub(M[4], F[4])) + dot(cross(F[2], t), w) + dot(log_gradient_rate(theta, rate, a), u)
    o = 0.0 * par[0]
    return dot(a, theta) - par[6], (o, o, o), t, neg(t), bias
