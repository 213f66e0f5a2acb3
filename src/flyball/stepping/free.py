"""Free bodies: turning that keeps angular momentum and energy exactly, and the inverse inertia in the world."""

from __future__ import annotations

import numpy as np

from ..compiler.jit import formula
from ..math.scalar import cos, sin, sqrt
from ..math.vec import add, cross, scale, sub
from .tables import FREE_INERTIA, FREE_INVERSE

PASSES = 20  # of Newton's method for half a step of turning; three or four are usual
CLOSE = 1e-15  # change of the angular momentum, relative to it, that is rounding


@formula
def times(J, k, first, a):
    """A symmetric matrix that stands in row k of a table from column ``first``, xx yy zz xy xz yz, times a."""
    xx, yy, zz = J[k, first], J[k, first + 1], J[k, first + 2]
    xy, xz, yz = J[k, first + 3], J[k, first + 4], J[k, first + 5]
    return (xx * a[0] + xy * a[1] + xz * a[2], xy * a[0] + yy * a[1] + yz * a[2], xz * a[0] + yz * a[1] + zz * a[2])


@formula
def rotated(R, a):
    """R a, R row by row."""
    return (
        R[0] * a[0] + R[1] * a[1] + R[2] * a[2],
        R[3] * a[0] + R[4] * a[1] + R[5] * a[2],
        R[6] * a[0] + R[7] * a[1] + R[8] * a[2],
    )


@formula
def unrotated(R, a):
    """R' a, R row by row."""
    return (
        R[0] * a[0] + R[3] * a[1] + R[6] * a[2],
        R[1] * a[0] + R[4] * a[1] + R[7] * a[2],
        R[2] * a[0] + R[5] * a[1] + R[8] * a[2],
    )


@formula
def matrix(q):
    """Rotation matrix, row by row, of a unit quaternion."""
    w, x, y, z = q
    return (
        1.0 - 2.0 * (y * y + z * z),
        2.0 * (x * y - w * z),
        2.0 * (x * z + w * y),
        2.0 * (x * y + w * z),
        1.0 - 2.0 * (x * x + z * z),
        2.0 * (y * z - w * x),
        2.0 * (x * z - w * y),
        2.0 * (y * z + w * x),
        1.0 - 2.0 * (x * x + y * y),
    )


@formula
def turned(q, w, h):
    """The unit quaternion after turning by Cayley's map of h w, w along the world's axes.

    The rotation is cay(h w) = (1 - h/2 [w])^-1 (1 + h/2 [w]), whose quaternion is (1, h w / 2) made unit.
    """
    x, y, z = 0.5 * h * w[0], 0.5 * h * w[1], 0.5 * h * w[2]
    a = q[0] - x * q[1] - y * q[2] - z * q[3]
    b = q[1] + x * q[0] + y * q[3] - z * q[2]
    c = q[2] + y * q[0] + z * q[1] - x * q[3]
    d = q[3] + z * q[0] + x * q[2] - y * q[1]
    return unit(a, b, c, d)


@formula
def spun(q, w, h):
    """The unit quaternion after turning by the angle |w| h about w, which is exact where w stays what it is."""
    a = sqrt(w[0] * w[0] + w[1] * w[1] + w[2] * w[2])
    half = 0.5 * h * a
    s, c = sin(half) / a, cos(half)
    x, y, z = s * w[0], s * w[1], s * w[2]
    return unit(
        c * q[0] - x * q[1] - y * q[2] - z * q[3],
        c * q[1] + x * q[0] + y * q[3] - z * q[2],
        c * q[2] + y * q[0] + z * q[1] - x * q[3],
        c * q[3] + z * q[0] + x * q[2] - y * q[1],
    )


@formula
def unit(a, b, c, d):
    """A quaternion of length 1."""
    s = 1.0 / sqrt(a * a + b * b + c * c + d * d)
    return (a * s, b * s, c * s, d * s)


@formula
def middle(J, k, momentum, h):
    """Angular velocity, in body axes, that a free body turns with for a step h: (mean, momentum at the end).

    With p the angular momentum in body axes, p+ - p = h m x w, w = J^-1 m, m = (p + p+) / 2, and the turn cay(h w):
    energy and momentum stay what they are (Lewis and Simo, 1994, section 3). By Newton's method on m:
    m - h/2 m x J^-1 m = p.
    """
    p = momentum
    m = p
    for _ in range(PASSES):
        w = times(J, k, FREE_INVERSE, m)
        e = sub(sub(m, scale(0.5 * h, cross(m, w))), p)
        if (e[0] * e[0] + e[1] * e[1] + e[2] * e[2]) <= CLOSE * CLOSE * (p[0] * p[0] + p[1] * p[1] + p[2] * p[2]):
            break
        m = sub(m, corrected(J, k, m, w, h, e))
    return times(J, k, FREE_INVERSE, m), sub(scale(2.0, m), p)


@formula
def corrected(J, k, m, w, h, e):
    """(1 - h/2 ([m] J^-1 - [w]))^-1 e, the step of Newton's method, by the columns of the matrix."""
    a = column(J, k, m, w, h, (1.0, 0.0, 0.0))
    b = column(J, k, m, w, h, (0.0, 1.0, 0.0))
    c = column(J, k, m, w, h, (0.0, 0.0, 1.0))
    bc, ca, ab = cross(b, c), cross(c, a), cross(a, b)
    d = 1.0 / (a[0] * bc[0] + a[1] * bc[1] + a[2] * bc[2])
    return (
        d * (bc[0] * e[0] + bc[1] * e[1] + bc[2] * e[2]),
        d * (ca[0] * e[0] + ca[1] * e[1] + ca[2] * e[2]),
        d * (ab[0] * e[0] + ab[1] * e[1] + ab[2] * e[2]),
    )


@formula
def column(J, k, m, w, h, d):
    """The matrix of `corrected` times a unit vector."""
    return sub(d, scale(0.5 * h, add(cross(m, times(J, k, FREE_INVERSE, d)), cross(d, w))))


@formula
def momentum_of(J, k, w):
    """Angular momentum, in body axes."""
    return times(J, k, FREE_INERTIA, w)


@formula
def inverse_in_world(R, J, k, node):
    """The inverse inertia along the world's axes, R J^-1 R', into a node of the cone problem."""
    c0 = times(J, k, FREE_INVERSE, (R[0], R[1], R[2]))
    c1 = times(J, k, FREE_INVERSE, (R[3], R[4], R[5]))
    node[k, 1] = R[0] * c0[0] + R[1] * c0[1] + R[2] * c0[2]
    node[k, 2] = R[3] * c1[0] + R[4] * c1[1] + R[5] * c1[2]
    c2 = times(J, k, FREE_INVERSE, (R[6], R[7], R[8]))
    node[k, 3] = R[6] * c2[0] + R[7] * c2[1] + R[8] * c2[2]
    node[k, 4] = R[0] * c1[0] + R[1] * c1[1] + R[2] * c1[2]
    node[k, 5] = R[0] * c2[0] + R[1] * c2[1] + R[2] * c2[2]
    node[k, 6] = R[3] * c2[0] + R[4] * c2[1] + R[5] * c2[2]


def rotation_matrices(turn: np.ndarray) -> np.ndarray:
    """Rotations (n, 9), row by row, of unit quaternions (n, 4)."""
    return np.stack(matrix(turn.T), axis=1)
