"""The angle between a direction f fixed in F and a direction m fixed in M, and the pitch of m against a plane of F.

``angle_row``: theta = atan2(|m x f|, m.f), from 0 to pi: the deflection of an axis. ``pitch_row``: the angle of m
below the plane perpendicular to f, theta - pi/2, from -pi/2 to pi/2. For the coordinate of that name m is x of M and
f is z of F. Both have the rate n.(w_M - w_F) with the unit vector n = f x m / |f x m|.

Where m and f are parallel but for rounding, n has no direction. There a deflection is at its least or greatest value:
n is zero. A pitch is the second of three angles of rotation, of which the other two are undefined there: its row is
nan.
"""

from __future__ import annotations

from ..compiler.formulas import formula
from ..math.scalar import atan2, choose, divide, sqrt
from ..math.vec import add, cross, dot, mv, neg, scale, sub

KIND_ANGLE = 18
KIND_PITCH = 19
PARALLEL = 1e-13  # sine of the angle of two directions that rounding of rotations can cause


@formula
def directions(par, F, M):
    """F's direction f (par[0:3]), M's m (par[3:6]), f x m, |f x m|, and f.m."""
    f = mv(F[1], (par[0], par[1], par[2]))
    m = mv(M[1], (par[3], par[4], par[5]))
    e = cross(f, m)
    return f, m, e, sqrt(dot(e, e)), dot(f, m)


@formula
def turning_row(value, n, r, F, M, e1):
    """Return the result of a row with the rate n.(w_M - w_F), n = r e, r = 1 / |e|; ``e1`` is the rate of e.

    ndot = r (e1 - (n.e1) n).
    """
    w = sub(M[2], F[2])
    n1 = scale(r, sub(e1, scale(dot(n, e1), n)))
    o = 0.0 * value
    return value, (o, o, o), n, neg(n), dot(n, sub(M[4], F[4])) + dot(n1, w)


@formula
def product_rate(F, M, f, m):
    """Rate of f x m."""
    return add(cross(cross(F[2], f), m), cross(f, cross(M[2], m)))


@formula
def angle_row(par, F, M, hint, data):
    """Value, force on M, torques on M and F, acceleration bias."""
    f, m, e, s, c = directions(par, F, M)
    r = choose(s - PARALLEL, divide(1.0, s), 0.0 * s)
    return turning_row(atan2(s, c) - par[6], scale(r, e), r, F, M, product_rate(F, M, f, m))


@formula
def pitch_row(par, F, M, hint, data):
    """Value, force on M, torques on M and F, acceleration bias."""
    f, m, e, s, c = directions(par, F, M)
    r = divide(1.0, s)
    return turning_row(atan2(-c, s) - par[6], scale(r, e), r, F, M, product_rate(F, M, f, m))


ROWS = {KIND_ANGLE: angle_row, KIND_PITCH: pitch_row}
