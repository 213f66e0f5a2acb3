"""The angular velocity m . (w_M - w_F) about an axis m fixed in M, as a gyroscope on that axis measures it.

The row has no value: angular velocities about spatial axes are not derivatives of angles.
"""

from __future__ import annotations

from ..compiler.formulas import formula
from ..math.vec import cross, dot, mv, neg, sub

KIND = 11


@formula
def row(par, F, M, hint, data):
    """No value, no force, torques on M and F, acceleration bias m.(alpha_M - alpha_F) + (w_M x m).(w_M - w_F)."""
    m = mv(M[1], (par[0], par[1], par[2]))
    o = 0.0 * par[0]
    bias = dot(m, sub(M[4], F[4])) + dot(cross(M[2], m), sub(M[2], F[2]))
    return o * m[0], (o, o, o), m, neg(m), bias
