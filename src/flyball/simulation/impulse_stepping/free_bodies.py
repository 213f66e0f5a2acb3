"""Free bodies in a step: gravity, displacements, and rotation that keeps angular momentum and energy exactly."""

from __future__ import annotations

import numpy as np

from ...compiler.formulas import formula
from ...engine.articulated_body import rotated_inertia as turned_inertia
from ...math.rotation import reciprocal_rows
from ...math.scalar import cos, sin, sqrt
from ...math.vec import (
    add,
    cross,
    dot,
    load3,
    load9,
    mtv,
    mv,
    quaternion_matrix,
    quaternion_product,
    scale,
    store3,
    store9,
    sub,
    symmetric,
)
from ...numerics.complementarity.contact_operator import set_symmetric_block, symmetric_block
from ...numerics.complementarity.contact_problem import INVERSE_INERTIA
from .stepping_tables import (
    ANGLE,
    FREE_INERTIA,
    FREE_INVERSE,
    FREE_MASS,
    FREE_PER_MASS,
    FREE_ROUND,
    GRAVITY,
    NO_BOUNCE_BELOW,
    NUMERICAL,
    STEP,
)

SPIN_ITERATIONS = 20  # of Newton's method for half a step of turning; three or four are usual
SPIN_TOLERANCE = 1e-15  # change of the angular momentum, relative to it, that is rounding


@formula
def turned_by_cayley(q, w, h):
    """The unit quaternion after turning by Cayley's map of h w, w along the world's axes.

    The rotation is cay(h w) = (1 - h/2 [w])^-1 (1 + h/2 [w]), whose quaternion is (1, h w / 2) made unit.
    """
    e = scale(0.5 * h, w)
    return unit_quaternion(quaternion_product((1.0, e[0], e[1], e[2]), q))


@formula
def turned_by_angle(q, w, h):
    """The unit quaternion after turning by the angle |w| h about w, which is exact where w stays what it is."""
    a = sqrt(dot(w, w))
    half = 0.5 * h * a
    e = scale(sin(half) / a, w)
    return unit_quaternion(quaternion_product((cos(half), e[0], e[1], e[2]), q))


@formula
def unit_quaternion(q):
    """A quaternion made one of length 1."""
    s = 1.0 / sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
    return (s * q[0], s * q[1], s * q[2], s * q[3])


@formula
def mean_spin(inverse, momentum, h):
    """Angular velocity, in body axes, that a free body turns with for a step h: (mean, momentum at the end).

    With p the angular momentum in body axes, p+ - p = h m x w, w = J^-1 m, m = (p + p+) / 2, and the turn cay(h w):
    energy and momentum stay what they are (Lewis and Simo, 1994, section 3). By Newton's method on m:
    m - h/2 m x J^-1 m = p.
    """
    p = momentum
    m = p
    for _ in range(SPIN_ITERATIONS):
        w = symmetric(inverse, m)
        e = sub(sub(m, scale(0.5 * h, cross(m, w))), p)
        if dot(e, e) <= SPIN_TOLERANCE * SPIN_TOLERANCE * dot(p, p):
            break
        m = sub(m, newton_correction(inverse, m, w, h, e))
    return symmetric(inverse, m), sub(scale(2.0, m), p)


@formula
def newton_correction(inverse, m, w, h, e):
    """(1 - h/2 ([m] J^-1 - [w]))^-1 e, the step of Newton's method, by the columns of the matrix."""
    a = newton_column(inverse, m, w, h, (1.0, 0.0, 0.0))
    b = newton_column(inverse, m, w, h, (0.0, 1.0, 0.0))
    c = newton_column(inverse, m, w, h, (0.0, 0.0, 1.0))
    x, y, z = reciprocal_rows((a, b, c))
    return (dot(x, e), dot(y, e), dot(z, e))


@formula
def newton_column(inverse, m, w, h, d):
    """The matrix of `newton_correction` times a unit vector."""
    return sub(d, scale(0.5 * h, add(cross(m, symmetric(inverse, d)), cross(d, w))))


@formula
def inverse_in_world(R, J, k, node):
    """The inverse inertia along the world's axes, R J^-1 R', into a node of the cone problem."""
    xx, xy, xz, yy, yz, zz = symmetric_block(J, k, FREE_INVERSE)
    set_symmetric_block(node, k, INVERSE_INERTIA, turned_inertia(R, (xx, xy, xz, xy, yy, yz, xz, yz, zz)))


def rotation_matrices(turn: np.ndarray) -> np.ndarray:
    """Rotations (n, 9), row by row, of unit quaternions (n, 4)."""
    return np.stack(quaternion_matrix(*turn.T), axis=1)


NO_SPIN = 1e-300
REST_FACTOR = 2.0  # times the speed that gravity makes in a step: what is slower rests


@formula
def speed_of_fall(pace, h):
    """Speed that gravity makes in h seconds."""
    g0, g1, g2 = pace.real[GRAVITY], pace.real[GRAVITY + 1], pace.real[GRAVITY + 2]
    return h * sqrt(g0 * g0 + g1 * g1 + g2 * g2)


@formula
def rest_speed(pace, h):
    """Speed up to which what closes rests, or comes to rest, and is not hit, in steps of h seconds."""
    return max(pace.real[NO_BOUNCE_BELOW], REST_FACTOR * speed_of_fall(pace, h))


@formula
def velocities_without_contact(N, M, P, X, pace):
    """Velocities without contact, in ``M.twist``; masses of the nodes. ``X.v`` keeps those of the start."""
    h = pace.real[STEP]
    for k in range(N.body.shape[0]):
        for i in range(3):
            M.twist[k, i] = X.v[k, i] + (h * pace.real[GRAVITY + i] if N.body[k, FREE_PER_MASS] > 0.0 else 0.0)
            M.twist[k, 3 + i] = X.v[k, 3 + i]
        P.node[k, 0] = N.body[k, FREE_PER_MASS]
        if N.body[k, FREE_ROUND] == 0.0:
            inverse_in_world(load9(M.pose, k, 3), N.body, k, P.node)


@formula
def start_from_free_velocities(N, M, X):
    """Keep the velocities of the start, and go on from those without contact."""
    for k in range(N.body.shape[0]):
        for i in range(6):
            N.before[k, i] = X.v[k, i]
            X.v[k, i] = M.twist[k, i]


@formula
def mean_velocities(N, X, Y):
    """The mean velocities of the step in ``Y``; by what they differ from those at its end in ``N.move``."""
    for k in range(N.body.shape[0]):
        for i in range(6):
            N.move[k, i] = 0.5 * (N.before[k, i] - X.v[k, i])
            Y.v[k, i] = X.v[k, i] + N.move[k, i]


@formula
def clear_velocities(Y):
    """No velocities."""
    for k in range(Y.v.shape[0]):
        for i in range(6):
            Y.v[k, i] = 0.0
    for k in range(Y.wide.shape[0]):
        Y.wide[k] = 0.0


@formula
def displace_bodies(N, M, X, displacements, pace):
    """Positions and turns at the end of the step.

    By the velocities at its end, and then by what displaces bodies beside these: x += h v + h d, d = ``N.move`` and
    the velocities of ``displacements``. Turns by v keep energy and angular momentum; d takes the velocities along, so that it
    changes no energy. What the lifts change the energy of gravity by is the method's.
    """
    h = pace.real[STEP]
    for k in range(N.body.shape[0]):
        for i in range(3):
            pace.real[NUMERICAL] += h * N.body[k, FREE_MASS] * pace.real[GRAVITY + i] * displacements[k, i]
            M.pose[k, i] += h * (X.v[k, i] + N.move[k, i] + displacements[k, i])
        w, d = load3(X.v, k, 3), add(load3(N.move, k, 3), load3(displacements, k, 3))
        if dot(w, w) + dot(d, d) < NO_SPIN:
            continue
        q = (N.turn[k, 0], N.turn[k, 1], N.turn[k, 2], N.turn[k, 3])
        if N.body[k, FREE_ROUND] > 0.0:
            w = add(w, d)
            if dot(w, w) < NO_SPIN:
                continue
            q = turned_by_angle(q, w, h)
            N.move[k, ANGLE] += h * w[2]
        else:
            R, inverse = load9(M.pose, k, 3), symmetric_block(N.body, k, FREE_INVERSE)
            mean, p = mean_spin(inverse, symmetric(symmetric_block(N.body, k, FREE_INERTIA), mtv(R, w)), h)
            q = turned_by_cayley(turned_by_cayley(q, mv(R, mean), h), d, h)
            store3(X.v, k, 3, mv(quaternion_matrix(q[0], q[1], q[2], q[3]), symmetric(inverse, p)))
        N.turn[k, 0], N.turn[k, 1], N.turn[k, 2], N.turn[k, 3] = q
        store9(M.pose, k, 3, quaternion_matrix(q[0], q[1], q[2], q[3]))
