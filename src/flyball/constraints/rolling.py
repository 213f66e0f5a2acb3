"""The lowest point of a wheel on a plane: its height, and the sliding velocity of its material.

F's z axis n is the normal of the plane, which may move; M's z axis a is the wheel's axle, its origin the centre. The
wheel is a thin disk of radius par[3] swept by a ball of radius par[4]: a disk, a ball, or a wheel with a round tread.
The vector from the centre to the contact is rho = -R e - r n with e = (n - c a) / s, c = n.a, s = sqrt(1 - c^2).

If par[5] is 1, the direction par[0:3] (in F) must be the normal: the row is the height n.(d + rho), and the same wrench
is its gradient, since the lowest point does not move to first order. If it is 0, the row has no value, only a velocity:
no slip along that direction, a non-holonomic constraint.
"""

from __future__ import annotations

from ..compiler.formulas import formula
from ..math.scalar import sqrt
from ..math.vec import add, col, cross, dot, mv, neg, scale, sub

KIND = 9


@formula
def contact(par, F, M):
    """Return the vector rho from the centre to the contact, and its rate."""
    n = col(F[1], 2)
    a = col(M[1], 2)
    n1 = cross(F[2], n)
    a1 = cross(M[2], a)
    c = dot(n, a)
    c1 = dot(n1, a) + dot(n, a1)
    rho = neg(scale(par[4], n))
    rho1 = neg(scale(par[4], n1))
    if par[3] != 0.0:
        s = sqrt((1.0 - c) * (1.0 + c))
        e = scale(1.0 / s, sub(n, scale(c, a)))
        # sdot = -c cdot / s
        e1 = add(scale(1.0 / s, sub(n1, add(scale(c1, a), scale(c, a1)))), scale(c * c1 / (s * s), e))
        rho = sub(rho, scale(par[3], e))
        rho1 = sub(rho1, scale(par[3], e1))
    return rho, rho1


@formula
def row(par, F, M, hint, data):
    """Value, force on M at its origin (minus that on F), torques on M and F about their origins, acceleration bias.

    gdot = t.(u + w_M x rho - w_F x (d + rho)), u = v_M - v_F, the velocity of M's material over F's at the contact.
    """
    rho, rho1 = contact(par, F, M)
    t = mv(F[1], (par[0], par[1], par[2]))
    u = sub(M[3], F[3])
    arm = add(sub(M[0], F[0]), rho)
    slip = sub(add(u, cross(M[2], rho)), cross(F[2], arm))
    a = add(sub(M[5], F[5]), sub(cross(M[4], rho), cross(F[4], arm)))
    a = add(a, sub(cross(M[2], rho1), cross(F[2], add(u, rho1))))
    bias = dot(t, a) + dot(cross(F[2], t), slip)
    return par[5] * dot(t, arm) - par[6], t, cross(rho, t), neg(cross(arm, t)), bias
