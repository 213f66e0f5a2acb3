"""The angle of M's x axis about F's z axis, counted from F's x axis: the coordinate of a revolute joint.

Exact also if the constraint is violated (M's x axis out of F's plane): theta = atan2(s, c), c = m.x, s = m.y. If par[0]
is 1, full turns are added so that it is nearest to ``hint``.
"""

from __future__ import annotations

from ..compiler.formulas import formula
from ..math.scalar import atan2, divide, rounded
from ..math.vec import add, col, cross, dot, neg, scale, sub

KIND = 4
OFTEN = True
TURNS = True


@formula
def unwrapped(theta, hint):
    """Return theta plus the full turns that bring it nearest to ``hint``."""
    return theta + 6.283185307179586 * rounded(0.15915494309189535 * (hint - theta))


@formula
def row(par, F, M, hint, data):
    """Value, force on M at its origin (minus that on F), torques on M and F about their origins, acceleration bias.

    thetadot = n.(w_M - w_F), n = m x u / (c^2 + s^2), u = c y - s x.
    """
    m = col(M[1], 0)
    x = col(F[1], 0)
    y = col(F[1], 1)
    w = sub(M[2], F[2])
    c = dot(m, x)
    s = dot(m, y)
    r = c * c + s * s
    u = sub(scale(c, y), scale(s, x))
    mu = cross(m, u)
    n = scale(divide(1.0, r), mu)
    c1 = dot(w, cross(m, x))
    s1 = dot(w, cross(m, y))
    u1 = add(sub(scale(c1, y), scale(s1, x)), cross(F[2], u))
    mu1 = add(cross(cross(M[2], m), u), cross(m, u1))
    r1 = 2.0 * (c * c1 + s * s1)
    n1 = scale(divide(1.0, r), sub(mu1, scale(r1, n)))
    o = 0.0 * par[0]
    bias = dot(n, sub(M[4], F[4])) + dot(n1, w)
    theta = atan2(s, c)
    if par[0].real > 0.5:
        theta = unwrapped(theta, hint)
    return theta - par[6], (o, o, o), n, neg(n), bias
