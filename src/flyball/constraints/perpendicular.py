"""m . f = 0 with f fixed in F and m fixed in M: two axes at right angles.

Two of them make axes parallel (Hahn's BB2), one blocks a rotation (BB4). Valid near the solution only: four
orientations satisfy the rows and the gradient vanishes at 90 degrees, so assembly starts with ``alignment`` rows
instead.
"""

from __future__ import annotations

from ..compiler.formulas import formula
from ..math.vec import cross, dot, mv, neg

KIND = 2
OFTEN = True


@formula
def row(par, F, M, hint, data):
    """Value, force on M at its origin (minus that on F), torques on M and F about their origins, acceleration bias.

    g = m.f, gdot = (w_M - w_F).(m x f).
    """
    f = mv(F[1], (par[0], par[1], par[2]))
    m = mv(M[1], (par[3], par[4], par[5]))
    o = 0.0 * par[0]
    t = cross(m, f)
    f1 = cross(F[2], f)
    m1 = cross(M[2], m)
    bias = dot(M[4], t) - dot(F[4], t) + dot(cross(M[2], m1), f) + 2.0 * dot(m1, f1) + dot(m, cross(F[2], f1))
    return dot(m, f) - par[6], (o, o, o), t, neg(t), bias
