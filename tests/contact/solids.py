"""The solids again, plainly: the farthest point along a direction, whether a point is inside, a random one."""

from __future__ import annotations

import numpy as np

from flyball.collision.shape_kinds import BOX, CAPSULE, CONE, CYLINDER, PLANE, SPHERE
from tests.contact.scenes import turned

SOLIDS = {"sphere": SPHERE, "plane": PLANE, "box": BOX, "capsule": CAPSULE, "cylinder": CYLINDER, "cone": CONE}
SIZES = {SPHERE: 1, PLANE: 0, BOX: 3, CAPSULE: 2, CYLINDER: 2, CONE: 2}


def farthest(shape, d):
    """How far it reaches along the unit vector d, in its axes."""
    kind, p = shape
    across = np.hypot(d[0], d[1])
    if kind == SPHERE:
        return p[0]
    if kind == PLANE:
        return 0.0 if across < 1e-9 and d[2] > 0 else np.inf
    if kind == BOX:
        return np.abs(d) @ p
    if kind == CAPSULE:
        return p[0] + p[1] * abs(d[2])
    if kind == CYLINDER:
        return p[0] * across + p[1] * abs(d[2])
    return max(p[0] * across, p[1] * d[2])


def outside(shape, x):
    """How far a point in its axes is outside, not more than the distance; not above 0: inside."""
    kind, p = shape
    rho = np.hypot(x[0], x[1])
    if kind == SPHERE:
        return np.linalg.norm(x) - p[0]
    if kind == PLANE:
        return x[2]
    if kind == BOX:
        return np.max(np.abs(x) - p)
    if kind == CAPSULE:
        return np.hypot(rho, max(0, abs(x[2]) - p[1])) - p[0]
    if kind == CYLINDER:
        return max(rho - p[0], abs(x[2]) - p[1])
    return max(-x[2], (p[1] * rho + p[0] * (x[2] - p[1])) / np.hypot(*p))


def separation(a, b, at_a, at_b, n):
    """By how much b is beyond a along the unit vector n."""
    (p, R), (q, Q) = at_a, at_b
    return n @ (q - p) - farthest(a, R.T @ n) - farthest(b, -Q.T @ n)


def rotation(rng):
    """Any rotation matrix."""
    Q, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    return Q * np.linalg.det(Q)


def solid(kind, rng):
    """A solid of this kind, its sizes from 0.2 to 2."""
    return kind, np.exp(rng.uniform(np.log(0.2), np.log(2), SIZES[kind]))


def two(a, b, rng):
    """Two solids anywhere near each other, often with axes (nearly) along each other."""
    A, B = (solid(a, rng), solid(b, rng))
    R, Q = rotation(rng), rotation(rng)
    p = rng.normal(size=3)
    q = p + rng.normal(size=3) * rng.choice([0.3, 1, 2])
    how = rng.integers(4)
    if how == 0:
        Q = R @ turned(np.eye(3)[rng.integers(3)], rng.choice([0, 1e-9, 1e-6, 1e-3, np.pi / 2]))
    if how == 1:
        q = p + R @ np.round(rng.normal(size=3))
    return A, B, (p, R), (q, Q)
