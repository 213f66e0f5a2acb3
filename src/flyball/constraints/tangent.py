"""The straight part of a rope between two circles of one plane: its length, and that on the circles as it swings.

F has the first circle, in its x-y plane about its origin; M's origin is the centre of the second. The rope leaves the
first circle and reaches the second along a common tangent, which has the direction theta in F. A radius is positive
where the rope runs counterclockwise around that circle, so that the centre is on its left; with ``b`` the second radius
less the first,

    L = sqrt(r.r - b^2),  theta = atan2(y, x) - asin(b / rho),  rho^2 = x^2 + y^2,

where r is the position of M's origin in F. The value is L - b theta: as the tangent swings by theta, the arcs on both
circles change by -b theta. Its gradient is the unit vector along the tangent, for L dtheta = n.dr and dL = u.dr +
b dtheta with the unit vectors u along the tangent and n to its left. Outside the plane, where z is
not zero, L is the distance from the tangent point and theta that of the projection. ``data`` has b at par[1]; theta is
counted over full turns from ``hint``.
"""

from __future__ import annotations

from ..compiler.formulas import formula
from ..math.scalar import atan2, sqrt
from ..math.vec import dot, mtv, sub
from .angle import unwrapped
from .displacement import point_row, seen_from

KIND = 23
POINTS = "M"
SPLINES = True


@formula
def tangent(r, b):
    """Return length L and direction theta of the tangent, for M's origin at r in F."""
    rho = r[0] * r[0] + r[1] * r[1]
    return sqrt(rho + r[2] * r[2] - b * b), atan2(r[1], r[0]) - atan2(b + 0.0 * rho, sqrt(rho - b * b))


@formula
def gradient(r, b):
    """Return the derivative of L - b theta with respect to r: the pull on M of a unit tension, along F's axes."""
    rho = r[0] * r[0] + r[1] * r[1]
    length = sqrt(rho + r[2] * r[2] - b * b)
    along = 1.0 / length - b * b / (rho * sqrt(rho - b * b))
    across = b / rho
    return r[0] * along + r[1] * across, r[1] * along - r[0] * across, r[2] / length


@formula
def foot(par, F, M, hint, data):
    """Return theta, with the full turns nearest to ``hint``."""
    return unwrapped(tangent(mtv(F[1], sub(M[0], F[0])), data[int(par[1].real)])[1], hint)


@formula
def swing(r, v, b):
    """Return the rate of theta, and its second derivative at r'' = 0."""
    rho = r[0] * r[0] + r[1] * r[1]
    flat = sqrt(rho - b * b)
    s = r[0] * v[0] + r[1] * v[1]
    turn = (r[0] * v[1] - r[1] * v[0]) / rho
    tilt = b * s / (rho * flat)
    bend = b * (v[0] * v[0] + v[1] * v[1]) / (rho * flat) - tilt * s * (2.0 / rho + 1.0 / (flat * flat))
    return turn + tilt, bend - 2.0 * turn * s / rho


@formula
def progress(par, F, M, s, data):
    """Return the rate of theta, and the velocity of M's origin across the tangent."""
    b = data[int(par[1].real)]
    r, v = seen_from(F, M)
    rate = swing(r, v, b)[0]
    return rate, rate * tangent(r, b)[0]


@formula
def row(par, F, M, hint, data):
    """Value, force on M at its origin (minus that on F), torques on M and F about their origins, acceleration bias."""
    b = data[int(par[1].real)]
    r, v = seen_from(F, M)
    length, theta = tangent(r, b)
    along = dot(r, v) / length
    curvature = (dot(v, v) - along * along) / length - b * swing(r, v, b)[1]
    return point_row(F, M, length - b * unwrapped(theta, hint) - par[6], gradient(r, b), curvature)
