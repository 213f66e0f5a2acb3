"""Rotation vectors on tuples of numbers, for formulas that are compiled."""

from __future__ import annotations

from ..compiler.formulas import formula
from .scalar import atan2, choose, cos, sin, sqrt
from .vec import add, cross, dot, scale

SMALL = 1e-4  # square of the angle [rad^2] below which series are exact to rounding
HALF_TURN = 3.1406  # above this angle [rad] the axis is about to flip and is not told any more
NOT_A_NUMBER = float("nan")


@formula
def rotation_vector(R):
    """Axis times angle of a rotation matrix; not a number within 1e-3 rad of half a turn, where the axis flips."""
    e = (0.5 * (R[7] - R[5]), 0.5 * (R[2] - R[6]), 0.5 * (R[3] - R[1]))  # sin(angle) times the axis
    c = 0.5 * (R[0] + R[4] + R[8] - 1.0)
    s2 = dot(e, e)
    far = choose(c, s2 - SMALL, s2 + 1.0)  # greater than zero where the series do not do
    s = sqrt(choose(far, s2, 1.0 + s2))
    angle = atan2(s, c)
    series = 1.0 + s2 * (1.0 / 6.0 + s2 * (3.0 / 40.0 + s2 * (15.0 / 336.0 + s2 * 105.0 / 3456.0)))  # asin(s) / s
    ratio = choose(far, angle / s, series)
    flips = choose(far, angle - HALF_TURN, far)
    ratio = choose(flips, ratio + NOT_A_NUMBER, ratio)
    return scale(ratio, e)


@formula
def log_gradient(theta, a):
    """J^T a, where thetadot = J omega and omega is the angular velocity in the axes that theta starts from.

    J = 1 - [theta]/2 + k [theta]^2, so J^T a = a + theta x a / 2 + k theta x (theta x a), with
    k = 1/t^2 - (1 + cos t) / (2 t sin t) (Bullo and Murray, 1995).
    """
    t2 = dot(theta, theta)
    far = t2 - SMALL
    half = 0.5 * sqrt(choose(far, t2, 1.0 + t2))
    series = 1.0 / 12.0 + t2 * (1.0 / 720.0 + t2 / 30240.0)
    k = choose(far, (1.0 - half * cos(half) / sin(half)) / (4.0 * half * half), series)
    across = cross(theta, a)
    return add(a, add(scale(0.5, across), scale(k, cross(theta, across))))
