"""Free bodies in a step: gravity, displacements, and rotation that conserves angular momentum and energy exactly."""

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

SPIN_ITERATIONS = 20  # Newton iterations for half a step of rotation; three or four are usual
SPIN_TOLERANCE = 1e-15  # relative change of the angular momentum that is rounding


@formula
def turned_by_cayley(q, w, h):
    """Return the unit quaternion after the Cayley map of h w, w in world axes.

    The rotation is cay(h w) = (1 - h/2 [w])^-1 (1 + h/2 [w]), whose quaternion is (1, h w / 2) normalised.
    """
    e = scale(0.5 * h, w)
    return unit_quaternion(quaternion_product((1.0, e[0], e[1], e[2]), q))


@formula
def turned_by_angle(q, w, h):
    """Return the unit quaternion after a rotation by |w| h about w, which is exact for constant w."""
    a = sqrt(dot(w, w))
    half = 0.5 * h * a
    e = scale(sin(half) / a, w)
    return unit_quaternion(quaternion_product((cos(half), e[0], e[1], e[2]), q))


@formula
def unit_quaternion(q):
    """Return the normalised quaternion."""
    s = 1.0 / sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
    return (s * q[0], s * q[1], s * q[2], s * q[3])


@formula
def mean_spin(inverse, momentum, h):
    """Return the mean angular velocity in body axes of a free body in a step h, and the angular momentum at its end.

    With p the angular momentum in body axes, p+ - p = h m x w, w = J^-1 m, m = (p + p+) / 2, and the rotation cay(h w),
    energy and momentum are conserved (Lewis and Simo, 1994, section 3). Newton's method on m: m - h/2 m x J^-1 m = p.
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
    """Return (1 - h/2 ([m] J^-1 - [w]))^-1 e, the step of Newton's method, from the columns of the matrix."""
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
def inverse_in_world(R, inverse, k, node):
    """Write the inverse inertia in world axes, R J^-1 R', into a node of the cone problem."""
    xx, xy, xz, yy, yz, zz = symmetric_block(inverse, k, 0)
    set_symmetric_block(node.inverse_inertia, k, 0, turned_inertia(R, (xx, xy, xz, xy, yy, yz, xz, yz, zz)))


def rotation_matrices(turn: np.ndarray) -> np.ndarray:
    """Return the rotation matrices (n, 9), row by row, of unit quaternions (n, 4)."""
    return np.stack(quaternion_matrix(*turn.T), axis=1)


NO_SPIN = 1e-300
REST_FACTOR = 2.0  # closing speed of a resting contact, relative to the speed by gravity in a step


@formula
def speed_of_fall(state, h):
    """Return the speed that gravity causes in h seconds."""
    g0, g1, g2 = state.gravity[0], state.gravity[1], state.gravity[2]
    return h * sqrt(g0 * g0 + g1 * g1 + g2 * g2)


@formula
def rest_speed(state, h):
    """Return the closing speed up to which a contact rests, rather than having an impact, in steps of h seconds."""
    return max(state.tolerances.rebound_speed, REST_FACTOR * speed_of_fall(state, h))


@formula
def velocities_without_contact(N, M, P, X, state):
    """Compute the velocities without contact in ``M.twist``, and the masses of the nodes; ``X.v`` keeps the start."""
    h = state.times.step
    for k in range(N.body.shape[0]):
        for i in range(3):
            M.twist[k, i] = X.v[k, i] + (h * state.gravity[i] if N.body.inverse_mass[k] > 0.0 else 0.0)
            M.twist[k, 3 + i] = X.v[k, 3 + i]
        P.node.inverse_mass[k] = N.body.inverse_mass[k]
        if N.body.isotropic[k] == 0.0:
            inverse_in_world(load9(M.pose, k, 3), N.body.inverse_inertia, k, P.node)


@formula
def start_from_free_velocities(N, M, X):
    """Store the velocities at the start, and continue from those without contact."""
    for k in range(N.body.shape[0]):
        for i in range(6):
            N.before[k, i] = X.v[k, i]
            X.v[k, i] = M.twist[k, i]


@formula
def mean_velocities(N, X, Y):
    """Compute the mean velocities of the step in ``Y``, and their difference from those at its end in ``N.move``."""
    for k in range(N.body.shape[0]):
        for i in range(6):
            N.move[k, i] = 0.5 * (N.before[k, i] - X.v[k, i])
            Y.v[k, i] = X.v[k, i] + N.move[k, i]


BIN_RANGE = (
    2.5  # of the bins on both sides of the mean place, in standard deviations; farther bodies are in the last ones
)


@formula
def widest_axis(M, n):
    """Return the axis along which the places of n bodies vary most, their mean and standard deviation."""
    axis, middle, most = 0, 0.0, -1.0
    for k in range(3):
        mean, square = 0.0, 0.0
        for i in range(n):
            mean += M.pose[i, k]
        mean /= n
        for i in range(n):
            x = M.pose[i, k] - mean
            square += x * x
        if square > most:
            axis, middle, most = k, mean, square
    return axis, middle, sqrt(most / n)


@formula
def divide_space(M, half_slab, bins, halves):
    """Number the half slab of each body: layers of equally many bodies along the axis on which places vary most."""
    n, many = half_slab.shape[0], bins.shape[0]
    if n == 0:
        return
    axis, middle, width = widest_axis(M, n)
    per_width = many / (2.0 * BIN_RANGE * width) if width > 0.0 else 0.0
    for b in range(many):
        bins[b] = 0
    for i in range(n):
        b = int(min(many - 1.0, max(0.0, 0.5 * many + (M.pose[i, axis] - middle) * per_width)))
        half_slab[i] = b
        bins[b] += 1
    before = 0
    for b in range(many):
        count = bins[b]
        bins[b] = min(halves - 1, before * halves // n)
        before += count
    for i in range(n):
        half_slab[i] = bins[half_slab[i]]


@formula
def clear_velocities(Y):
    """Set all velocities to zero."""
    for k in range(Y.v.shape[0]):
        for i in range(6):
            Y.v[k, i] = 0.0
    for k in range(Y.wide.shape[0]):
        Y.wide[k] = 0.0


@formula
def displace_bodies(N, M, X, displacements, state):
    """Compute positions and orientations at the end of the step.

    Bodies move with the velocities at the end and the additional displacements: x += h v + h d, where d is ``N.move``
    plus ``displacements``. Rotation by v conserves energy and angular momentum. The rotation d also rotates the
    velocities, so that it changes no energy. The change of gravity's energy by displacements is accounted as numerical.
    """
    h = state.times.step
    for k in range(N.body.shape[0]):
        for i in range(3):
            state.sums.numerical_loss += h * N.body.mass[k] * state.gravity[i] * displacements[k, i]
            M.pose[k, i] += h * (X.v[k, i] + N.move[k, i] + displacements[k, i])
        w, d = load3(X.v, k, 3), add(load3(N.move, k, 3), load3(displacements, k, 3))
        if dot(w, w) + dot(d, d) < NO_SPIN:
            continue
        q = (N.turn[k, 0], N.turn[k, 1], N.turn[k, 2], N.turn[k, 3])
        if N.body.isotropic[k] > 0.0:
            w = add(w, d)
            if dot(w, w) < NO_SPIN:
                continue
            q = turned_by_angle(q, w, h)
            N.angle[k] += h * w[2]
        else:
            R, inverse = load9(M.pose, k, 3), symmetric_block(N.body.inverse_inertia, k, 0)
            mean, p = mean_spin(inverse, symmetric(symmetric_block(N.body.inertia, k, 0), mtv(R, w)), h)
            q = turned_by_cayley(turned_by_cayley(q, mv(R, mean), h), d, h)
            store3(X.v, k, 3, mv(quaternion_matrix(q[0], q[1], q[2], q[3]), symmetric(inverse, p)))
        N.turn[k, 0], N.turn[k, 1], N.turn[k, 2], N.turn[k, 3] = q
        store9(M.pose, k, 3, quaternion_matrix(q[0], q[1], q[2], q[3]))
