"""n . (p_M - p_F) = c with n fixed in F: the displacement of M along an axis of F.

With n across the axis it is half of a straight-line follower (Hahn's BB3); with n along it, a sliding coordinate.
"""

from __future__ import annotations

from ..compiler.formulas import formula
from ..math.vec import cross, dot, mtv, mv, sub

KIND = 1
OFTEN = True
POINTS = "M"


@formula
def row(par, F, M, hint, data):
    """Value, force on M at its origin (minus that on F), torques on M and F about their origins, acceleration bias.

    g = n.d - c, gdot = n.u + w_F.(n x d), with d = p_M - p_F, u = v_M - v_F and ndot = w_F x n.
    """
    n = mv(F[1], (par[0], par[1], par[2]))
    d = sub(M[0], F[0])
    u = sub(M[3], F[3])
    o = 0.0 * par[0]
    arm = cross(n, d)
    n1 = cross(F[2], n)
    bias = dot(n, sub(M[5], F[5])) + dot(F[4], arm) + 2.0 * dot(n1, u) + dot(cross(F[2], n1), d)
    return dot(n, d) - par[6], n, (o, o, o), arm, bias


@formula
def seen_from(F, M):
    """Return the position r of M's origin relative to F's, and its rate, as seen in F: along the axes of F."""
    d = sub(M[0], F[0])
    return mtv(F[1], d), mtv(F[1], sub(sub(M[3], F[3]), cross(F[2], d)))


@formula
def point_row(F, M, value, gradient, curvature):
    """Return the result of a row whose value g(r) depends on the position r of M's origin as seen from F (`seen_from`).

    Parameters
    ----------
    F, M : tuple
        Kinematic records.
    value : number
        g(r).
    gradient : tuple of three numbers
        dg/dr, along the axes of F.
    curvature : number
        r' . (d^2g/dr^2 r'), r' being the rate of r; zero for a plane.
    """
    o = 0.0 * value
    _, n, none, arm, bias = row((gradient[0], gradient[1], gradient[2], o, o, o, o), F, M, o, None)
    return value, n, none, arm, bias + curvature
