"""What free bodies do in a step: velocities that gravity leaves, then displacements and turns."""

from __future__ import annotations

from ..compiler.formulas import formula
from ..math.scalar import sqrt
from ..math.vec import add, dot, load3, load9, mtv, mv, put3, put9, quaternion_matrix, symmetric
from ..numerics.cone.operator import block_at
from .free import inverse_in_world, middle, spun, turned
from .tables import (
    ANGLE,
    FREE_INERTIA,
    FREE_INVERSE,
    FREE_MASS,
    FREE_PER_MASS,
    FREE_ROUND,
    GRAVITY,
    NUMERICAL,
    SLOWEST,
    STEP,
)

EPS = 1e-300
REST = 2.0  # times the speed that gravity makes in a step: what is slower rests


@formula
def speed_of_fall(pace, h):
    """Speed that gravity makes in h seconds."""
    g0, g1, g2 = pace.real[GRAVITY], pace.real[GRAVITY + 1], pace.real[GRAVITY + 2]
    return h * sqrt(g0 * g0 + g1 * g1 + g2 * g2)


@formula
def no_impact(pace, h):
    """Speed up to which what closes rests, or comes to rest, and is not hit, in steps of h seconds."""
    return max(pace.real[SLOWEST], REST * speed_of_fall(pace, h))


@formula
def fall(N, M, P, X, pace):
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
def begin(N, M, X):
    """Keep the velocities of the start, and go on from those without contact."""
    for k in range(N.body.shape[0]):
        for i in range(6):
            N.before[k, i] = X.v[k, i]
            X.v[k, i] = M.twist[k, i]


@formula
def halfway(N, X, Y):
    """The mean velocities of the step in ``Y``; by what they differ from those at its end in ``N.move``."""
    for k in range(N.body.shape[0]):
        for i in range(6):
            N.move[k, i] = 0.5 * (N.before[k, i] - X.v[k, i])
            Y.v[k, i] = X.v[k, i] + N.move[k, i]


@formula
def rest(Y):
    """No velocities."""
    for k in range(Y.v.shape[0]):
        for i in range(6):
            Y.v[k, i] = 0.0
    for k in range(Y.wide.shape[0]):
        Y.wide[k] = 0.0


@formula
def displace(N, M, X, lifts, pace):
    """Positions and turns at the end of the step.

    By the velocities at its end, and then by what displaces bodies beside these: x += h v + h d, d = ``N.move`` and
    the velocities of ``lifts``. Turns by v keep energy and angular momentum; d takes the velocities along, so that it
    changes no energy. What the lifts change the energy of gravity by is the method's.
    """
    h = pace.real[STEP]
    for k in range(N.body.shape[0]):
        for i in range(3):
            pace.real[NUMERICAL] += h * N.body[k, FREE_MASS] * pace.real[GRAVITY + i] * lifts[k, i]
            M.pose[k, i] += h * (X.v[k, i] + N.move[k, i] + lifts[k, i])
        w, d = load3(X.v, k, 3), add(load3(N.move, k, 3), load3(lifts, k, 3))
        if dot(w, w) + dot(d, d) < EPS:
            continue
        q = (N.turn[k, 0], N.turn[k, 1], N.turn[k, 2], N.turn[k, 3])
        if N.body[k, FREE_ROUND] > 0.0:
            w = add(w, d)
            if dot(w, w) < EPS:
                continue
            q = spun(q, w, h)
            N.move[k, ANGLE] += h * w[2]
        else:
            R, inverse = load9(M.pose, k, 3), block_at(N.body, k, FREE_INVERSE)
            mean, p = middle(inverse, symmetric(block_at(N.body, k, FREE_INERTIA), mtv(R, w)), h)
            q = turned(turned(q, mv(R, mean), h), d, h)
            put3(X.v, k, 3, mv(quaternion_matrix(q[0], q[1], q[2], q[3]), symmetric(inverse, p)))
        N.turn[k, 0], N.turn[k, 1], N.turn[k, 2], N.turn[k, 3] = q
        put9(M.pose, k, 3, quaternion_matrix(q[0], q[1], q[2], q[3]))
