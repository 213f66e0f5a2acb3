"""n . (d - s1 f - s2 m - k f x m) = 0 with d = p_M - p_F, n fixed in the world: a row that fixes two lines together.

f and m are the z axes of F and M. With the angle between them fixed too (``perpendicular``), three of these keep two
lines, one on either body, in a fixed relative position: a massless link with a hinge at either end whose axes are skew
and offset (Hahn, *Rigid Body Dynamics of Mechanisms 1*, appendix A.4). Regular also where the axes meet.
"""

from __future__ import annotations

from ..compiler.formulas import formula
from ..math.vec import add, cross, dot, neg, scale, sub

KIND = 7


@formula
def row(par, F, M, hint, data):
    """Value, force on M at its origin (minus that on F), torques on M and F about their origins, acceleration bias.

    s1, s2, k = par[3:6]; fdot = w_F x f, mdot = w_M x m.
    """
    n = (par[0], par[1], par[2])
    f = (F[1][2], F[1][5], F[1][8])
    m = (M[1][2], M[1][5], M[1][8])
    d = sub(M[0], F[0])
    value = dot(n, sub(d, add(add(scale(par[3], f), scale(par[4], m)), scale(par[5], cross(f, m)))))
    torque_M = neg(cross(m, add(scale(par[4], n), scale(par[5], cross(n, f)))))
    torque_F = neg(cross(f, add(scale(par[3], n), scale(par[5], cross(m, n)))))
    f1 = cross(F[2], f)
    m1 = cross(M[2], m)
    f2 = cross(F[2], f1)
    m2 = cross(M[2], m1)
    turned = add(add(cross(f2, m), scale(2.0, cross(f1, m1))), cross(f, m2))
    centripetal = add(add(scale(par[3], f2), scale(par[4], m2)), scale(par[5], turned))
    bias = dot(n, sub(sub(M[5], F[5]), centripetal)) + dot(torque_M, M[4]) + dot(torque_F, F[4])
    return value - par[6], n, torque_M, torque_F, bias
