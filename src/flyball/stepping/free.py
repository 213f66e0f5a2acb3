"""Free bodies: turning that keeps angular momentum and energy exactly, and the inverse inertia in the world."""

from __future__ import annotations

import numpy as np

from ..compiler.formulas import formula
from ..equations.mass import turned as turned_inertia
from ..math.scalar import cos, sin, sqrt
from ..math.turns import reciprocal
from ..math.vec import add, cross, dot, quaternion_matrix, quaternion_product, scale, sub, symmetric
from ..numerics.cone.operator import block_at, put_block
from ..numerics.cone.problem import BLOCK
from .tables import FREE_INVERSE

PASSES = 20  # of Newton's method for half a step of turning; three or four are usual
CLOSE = 1e-15  # change of the angular momentum, relative to it, that is rounding


@formula
def turned(q, w, h):
    """The unit quaternion after turning by Cayley's map of h w, w along the world's axes.

    The rotation is cay(h w) = (1 - h/2 [w])^-1 (1 + h/2 [w]), whose quaternion is (1, h w / 2) made unit.
    """
    e = scale(0.5 * h, w)
    return unit(quaternion_product((1.0, e[0], e[1], e[2]), q))


@formula
def spun(q, w, h):
    """The unit quaternion after turning by the angle |w| h about w, which is exact where w stays what it is."""
    a = sqrt(dot(w, w))
    half = 0.5 * h * a
    e = scale(sin(half) / a, w)
    return unit(quaternion_product((cos(half), e[0], e[1], e[2]), q))


@formula
def unit(q):
    """A quaternion made one of length 1."""
    s = 1.0 / sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
    return (s * q[0], s * q[1], s * q[2], s * q[3])


@formula
def middle(inverse, momentum, h):
    """Angular velocity, in body axes, that a free body turns with for a step h: (mean, momentum at the end).

    With p the angular momentum in body axes, p+ - p = h m x w, w = J^-1 m, m = (p + p+) / 2, and the turn cay(h w):
    energy and momentum stay what they are (Lewis and Simo, 1994, section 3). By Newton's method on m:
    m - h/2 m x J^-1 m = p.
    """
    p = momentum
    m = p
    for _ in range(PASSES):
        w = symmetric(inverse, m)
        e = sub(sub(m, scale(0.5 * h, cross(m, w))), p)
        if dot(e, e) <= CLOSE * CLOSE * dot(p, p):
            break
        m = sub(m, corrected(inverse, m, w, h, e))
    return symmetric(inverse, m), sub(scale(2.0, m), p)


@formula
def corrected(inverse, m, w, h, e):
    """(1 - h/2 ([m] J^-1 - [w]))^-1 e, the step of Newton's method, by the columns of the matrix."""
    a = column(inverse, m, w, h, (1.0, 0.0, 0.0))
    b = column(inverse, m, w, h, (0.0, 1.0, 0.0))
    c = column(inverse, m, w, h, (0.0, 0.0, 1.0))
    x, y, z = reciprocal((a, b, c))
    return (dot(x, e), dot(y, e), dot(z, e))


@formula
def column(inverse, m, w, h, d):
    """The matrix of `corrected` times a unit vector."""
    return sub(d, scale(0.5 * h, add(cross(m, symmetric(inverse, d)), cross(d, w))))


@formula
def inverse_in_world(R, J, k, node):
    """The inverse inertia along the world's axes, R J^-1 R', into a node of the cone problem."""
    xx, xy, xz, yy, yz, zz = block_at(J, k, FREE_INVERSE)
    put_block(node, k, BLOCK, turned_inertia(R, (xx, xy, xz, xy, yy, yz, xz, yz, zz)))


def rotation_matrices(turn: np.ndarray) -> np.ndarray:
    """Rotations (n, 9), row by row, of unit quaternions (n, 4)."""
    return np.stack(quaternion_matrix(*turn.T), axis=1)
