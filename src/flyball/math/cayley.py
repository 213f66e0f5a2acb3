"""Cayley's steps: turns told by their axis times 2 tan(angle / 2); on plain tuples."""

from __future__ import annotations

from ..compiler.formulas import formula
from .scalar import divide, sqrt
from .vec import add, cross, dot, scale

LEAST = 1e-150  # scalar part of a quaternion that half a turn is told by


@formula
def quaternion(d):
    """The unit quaternion of a step, for any d."""
    x = scale(0.5, d)
    r = divide(1.0, sqrt(1.0 + dot(x, x)))
    return (r, r * x[0], r * x[1], r * x[2])


@formula
def step(q):
    """The step of a quaternion; of half a turn a very large one."""
    by = 2.0 / (q[0] if abs(q[0]) > LEAST else LEAST)
    return (by * q[1], by * q[2], by * q[3])


@formula
def bent(d, a):
    """R(d)^T a - a, where R(d)^T a are the components of a along axes that are turned by d."""
    y = scale(-0.5, d)
    bend = cross(y, a)
    return scale(2.0 / (1.0 + dot(y, y)), add(bend, cross(y, bend)))


@formula
def rate(d, w):
    """Rate of the step whose axes turn at w: w + d x w / 2 + d (d . w) / 4."""
    return add(w, add(scale(0.5, cross(d, w)), scale(0.25 * dot(d, w), d)))
