"""Rotations on plain tuples: rotation vectors, Cayley steps, and sequences of rotations about coordinate axes.

A Cayley step is the rotation axis times 2 tan(angle / 2).

Axes are numbered 0, 1, 2. A sequence (i, j, k) rotates by a about axis i, by b about the new axis j, by c about the
newer axis k: R = R_i(a) R_j(b) R_k(c). An angular velocity is the sum of its three rates, each along the axis of
its rotation, so these axes are the columns of the kinematic matrix H in w = H (adot, bdot, cdot).
"""

from __future__ import annotations

from ..compiler.formulas import formula
from .scalar import atan2, choose, cos, divide, sin, sqrt
from .vec import add, cross, dot, mtv, mv, quaternion_product, scale

SMALL_ANGLE_SQUARE = 1e-4  # square of the angle [rad^2] below which series are exact to rounding
HALF_TURN = 3.1406  # above this angle [rad] the axis is about to flip: no value
NOT_A_NUMBER = float("nan")


@formula
def rotation_vector(R):
    """Axis times angle of a rotation matrix; not a number within 1e-3 rad of half a turn, where the axis flips."""
    e = (0.5 * (R[7] - R[5]), 0.5 * (R[2] - R[6]), 0.5 * (R[3] - R[1]))  # sin(angle) times the axis
    c = 0.5 * (R[0] + R[4] + R[8] - 1.0)
    s2 = dot(e, e)
    far = choose(c, s2 - SMALL_ANGLE_SQUARE, s2 + 1.0)  # positive where the series are not accurate
    s = sqrt(choose(far, s2, 1.0 + s2))
    angle = atan2(s, c)
    series = 1.0 + s2 * (1.0 / 6.0 + s2 * (3.0 / 40.0 + s2 * (15.0 / 336.0 + s2 * 105.0 / 3456.0)))  # asin(s) / s
    ratio = choose(far, angle / s, series)
    flips = choose(far, angle - HALF_TURN, far)
    ratio = choose(flips, ratio + NOT_A_NUMBER, ratio)
    return scale(ratio, e)


@formula
def log_curvature(t2):
    """k = 1/t^2 - (1 + cos t) / (2 t sin t) and dk/d(t^2) for the square of an angle t [rad] below a turn.

    With h = t/2: k = (1 - h cot h) / t^2 and dk/d(t^2) = ((h / sin^2 h - cot h) / (8 h) - k) / t^2.
    """
    far = t2 - SMALL_ANGLE_SQUARE
    half = 0.5 * sqrt(choose(far, t2, 1.0 + t2))
    s = sin(half)
    k = (1.0 - half * cos(half) / s) / (4.0 * half * half)
    slope = ((half / s - cos(half)) / (8.0 * half * s) - k) / (4.0 * half * half)
    near = 1.0 / 12.0 + t2 * (1.0 / 720.0 + t2 / 30240.0)
    near_slope = 1.0 / 720.0 + t2 * (1.0 / 15120.0 + t2 / 403200.0)
    return choose(far, k, near), choose(far, slope, near_slope)


@formula
def log_gradient(theta, a):
    """J^T a, where thetadot = J omega and omega is the angular velocity in the axes that theta starts from.

    J = 1 - [theta]/2 + k [theta]^2, so J^T a = a + theta x a / 2 + k theta x (theta x a), with
    k = 1/t^2 - (1 + cos t) / (2 t sin t) (Bullo and Murray, 1995). J a is the same of -theta.
    """
    k, _ = log_curvature(dot(theta, theta))
    across = cross(theta, a)
    return add(a, add(scale(0.5, across), scale(k, cross(theta, across))))


@formula
def log_gradient_rate(theta, rate, a):
    """Rate of J^T a (`log_gradient`) for a constant a, where theta has this rate."""
    k, slope = log_curvature(dot(theta, theta))
    across, moved = cross(theta, a), cross(rate, a)
    bend = add(cross(rate, across), cross(theta, moved))
    return add(scale(0.5, moved), add(scale(2.0 * slope * dot(theta, rate), cross(theta, across)), scale(k, bend)))


LEAST_SCALAR_PART = 1e-150  # smallest scalar part of a quaternion; it stands for half a turn


@formula
def cayley_quaternion(d):
    """The unit quaternion of a step, for any d."""
    x = scale(0.5, d)
    r = divide(1.0, sqrt(1.0 + dot(x, x)))
    return (r, r * x[0], r * x[1], r * x[2])


@formula
def cayley_step(q):
    """Cayley step of a quaternion; very large for half a turn."""
    by = 2.0 / (q[0] if abs(q[0]) > LEAST_SCALAR_PART else LEAST_SCALAR_PART)
    return (by * q[1], by * q[2], by * q[3])


@formula
def rotation_change(d, a):
    """R(d)^T a - a, where R(d)^T a are the components of a along axes that are turned by d."""
    y = scale(-0.5, d)
    bend = cross(y, a)
    return scale(2.0 / (1.0 + dot(y, y)), add(bend, cross(y, bend)))


@formula
def cayley_rate(d, w):
    """Rate of the Cayley step whose axes have angular velocity w: w + d x w / 2 + d (d . w) / 4."""
    return add(w, add(scale(0.5, cross(d, w)), scale(0.25 * dot(d, w), d)))


@formula
def coordinate_axis(axis, o):
    """Coordinate axis, in numbers of the type of o, which is zero."""
    if axis == 0:
        return (o + 1, o, o)
    if axis == 1:
        return (o, o + 1, o)
    return (o, o, o + 1)


@formula
def axis_rotation(axis, angle):
    """Rotation matrix, row by row, of a rotation about a coordinate axis by an angle [rad]."""
    c, s, o = cos(angle), sin(angle), 0.0 * angle
    if axis == 0:
        return (o + 1, o, o, o, c, -s, o, s, c)
    if axis == 1:
        return (c, o, s, o, o + 1, o, -s, o, c)
    return (c, -s, o, s, c, o, o, o, o + 1)


@formula
def axis_quaternion(axis, angle):
    """Unit quaternion of a rotation about a coordinate axis by an angle [rad]."""
    half = angle / 2
    e = scale(sin(half), coordinate_axis(axis, 0.0 * angle))
    return (cos(half), e[0], e[1], e[2])


@formula
def sequence_quaternion(i, j, k, a, b, c):
    """Unit quaternion of a sequence of three rotations, each about an axis of the frame rotated by those before it."""
    return quaternion_product(quaternion_product(axis_quaternion(i, a), axis_quaternion(j, b)), axis_quaternion(k, c))


@formula
def axes_in_base(i, j, k, a, b):
    """Axes of the three rotations in the fixed frame: e_i, R_i(a) e_j, R_i(a) R_j(b) e_k."""
    o, A = 0.0 * (a + b), axis_rotation(i, a)
    return coordinate_axis(i, o), mv(A, coordinate_axis(j, o)), mv(A, mv(axis_rotation(j, b), coordinate_axis(k, o)))


@formula
def axes_in_body(i, j, k, b, c):
    """Axes of the three rotations in the rotated frame."""
    o, C = 0.0 * (b + c), axis_rotation(k, c)
    return mtv(C, mtv(axis_rotation(j, b), coordinate_axis(i, o))), mtv(C, coordinate_axis(j, o)), coordinate_axis(k, o)


@formula
def axes_in_base_rate(h, rates):
    """Rates of the axes h in the fixed frame: each is moved by the rotations before it."""
    o = 0.0 * rates[0]
    first = scale(rates[0], h[0])
    return (o, o, o), cross(first, h[1]), cross(add(first, scale(rates[1], h[1])), h[2])


@formula
def axes_in_body_rate(h, rates):
    """Rates of the axes h in the rotated frame: each is moved by the rotations after it."""
    o = 0.0 * rates[0]
    last = scale(rates[2], h[2])
    return cross(h[0], add(last, scale(rates[1], h[1]))), cross(h[1], last), (o, o, o)


@formula
def reciprocal_rows(h):
    """Rows of the inverse of the matrix with the columns h; not finite where these are coplanar."""
    n = cross(h[1], h[2])
    f = divide(1, dot(h[0], n))
    return scale(f, n), scale(f, cross(h[2], h[0])), scale(f, cross(h[0], h[1]))
