"""What free bodies do in a step: velocities that gravity leaves, then displacements and turns."""

from __future__ import annotations

from ..compiler.jit import formula
from ..math.vec import add
from .free import inverse_in_world, matrix, middle, momentum_of, rotated, spun, times, turned, unrotated
from .tables import ANGLE, FREE_INVERSE, FREE_MASS, FREE_PER_MASS, FREE_ROUND, GRAVITY, LOST_IMPACT, STEP

EPS = 1e-300


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
            inverse_in_world(axes(M.pose, k), N.body, k, P.node)


@formula
def axes(pose, k):
    """Rotation of a mover, row by row."""
    return (
        pose[k, 3],
        pose[k, 4],
        pose[k, 5],
        pose[k, 6],
        pose[k, 7],
        pose[k, 8],
        pose[k, 9],
        pose[k, 10],
        pose[k, 11],
    )


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
    changes no energy. What the lifts change the energy of gravity by is an impact's part.
    """
    h = pace.real[STEP]
    for k in range(N.body.shape[0]):
        for i in range(3):
            pace.real[LOST_IMPACT] += h * N.body[k, FREE_MASS] * pace.real[GRAVITY + i] * lifts[k, i]
            M.pose[k, i] += h * (X.v[k, i] + N.move[k, i] + lifts[k, i])
        w = (X.v[k, 3], X.v[k, 4], X.v[k, 5])
        d = (
            N.move[k, 3] + lifts[k, 3],
            N.move[k, 4] + lifts[k, 4],
            N.move[k, 5] + lifts[k, 5],
        )
        if w[0] * w[0] + w[1] * w[1] + w[2] * w[2] + d[0] * d[0] + d[1] * d[1] + d[2] * d[2] < EPS:
            continue
        q = (N.turn[k, 0], N.turn[k, 1], N.turn[k, 2], N.turn[k, 3])
        if N.body[k, FREE_ROUND] > 0.0:
            w = add(w, d)
            if w[0] * w[0] + w[1] * w[1] + w[2] * w[2] < EPS:
                continue
            q = spun(q, w, h)
            N.move[k, ANGLE] += h * w[2]
        else:
            R = axes(M.pose, k)
            mean, p = middle(N.body, k, momentum_of(N.body, k, unrotated(R, w)), h)
            q = turned(q, rotated(R, mean), h)
            q = turned(q, d, h)
            put(X.v, k, rotated(matrix(q), times(N.body, k, FREE_INVERSE, p)))
        N.turn[k, 0], N.turn[k, 1], N.turn[k, 2], N.turn[k, 3] = q
        R = matrix(q)
        for i in range(9):
            M.pose[k, 3 + i] = R[i]


@formula
def put(v, k, w):
    """Angular velocity of node k."""
    v[k, 3], v[k, 4], v[k, 5] = w
