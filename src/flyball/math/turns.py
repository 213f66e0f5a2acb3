"""Turns about coordinate axes, one after the other, and the axes about which they happen; on plain tuples.

Axes are numbered 0, 1, 2. A sequence (i, j, k) turns by a about axis i, by b about the new axis j, by c about the newer
axis k: R = R_i(a) R_j(b) R_k(c). An angular velocity is the sum of its three rates, each along the axis of its turn, so
these axes are the columns of the kinematic matrix H in w = H (adot, bdot, cdot).
"""

from __future__ import annotations

from ..compiler.formulas import formula
from .scalar import cos, divide, sin
from .vec import add, cross, dot, mtv, mv, quaternion_product, scale


@formula
def unit(axis, o):
    """Coordinate axis in numbers of the type of o, which is zero."""
    if axis == 0:
        return (o + 1, o, o)
    if axis == 1:
        return (o, o + 1, o)
    return (o, o, o + 1)


@formula
def turn(axis, angle):
    """Rotation matrix, row by row, of a turn about a coordinate axis by an angle [rad]."""
    c, s, o = cos(angle), sin(angle), 0.0 * angle
    if axis == 0:
        return (o + 1, o, o, o, c, -s, o, s, c)
    if axis == 1:
        return (c, o, s, o, o + 1, o, -s, o, c)
    return (c, -s, o, s, c, o, o, o, o + 1)


@formula
def turn_quaternion(axis, angle):
    """Unit quaternion of a turn about a coordinate axis by an angle [rad]."""
    half = angle / 2
    e = scale(sin(half), unit(axis, 0.0 * angle))
    return (cos(half), e[0], e[1], e[2])


@formula
def sequence_quaternion(i, j, k, a, b, c):
    """Unit quaternion of three turns, each about an axis of the frame that the turns before have left."""
    return quaternion_product(quaternion_product(turn_quaternion(i, a), turn_quaternion(j, b)), turn_quaternion(k, c))


@formula
def axes_in_base(i, j, k, a, b):
    """Axes of the three turns along the frame that stays: e_i, R_i(a) e_j, R_i(a) R_j(b) e_k."""
    o, A = 0.0 * (a + b), turn(i, a)
    return unit(i, o), mv(A, unit(j, o)), mv(A, mv(turn(j, b), unit(k, o)))


@formula
def axes_in_body(i, j, k, b, c):
    """Axes of the three turns along the frame that they lead to."""
    o, C = 0.0 * (b + c), turn(k, c)
    return mtv(C, mtv(turn(j, b), unit(i, o))), mtv(C, unit(j, o)), unit(k, o)


@formula
def axes_in_base_rate(h, rates):
    """Rates of the axes h as seen from the frame that stays: each is carried along by the turns before it."""
    o = 0.0 * rates[0]
    first = scale(rates[0], h[0])
    return (o, o, o), cross(first, h[1]), cross(add(first, scale(rates[1], h[1])), h[2])


@formula
def axes_in_body_rate(h, rates):
    """Rates of the axes h as seen from the turned frame: each is left behind by the turns after it."""
    o = 0.0 * rates[0]
    last = scale(rates[2], h[2])
    return cross(h[0], add(last, scale(rates[1], h[1]))), cross(h[1], last), (o, o, o)


@formula
def reciprocal(h):
    """Rows of the inverse of the matrix with the columns h; not finite where these lie in a plane."""
    n = cross(h[1], h[2])
    f = divide(1, dot(h[0], n))
    return scale(f, n), scale(f, cross(h[2], h[0])), scale(f, cross(h[0], h[1]))
