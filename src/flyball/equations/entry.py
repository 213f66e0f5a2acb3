"""The compiled entry points. Few on purpose: the right-hand side takes seconds to compile, so it is compiled once."""

from __future__ import annotations

import numpy as np

from ..compiler.held import held
from ..compiler.jit import formula, kernel
from ..numerics.integrators.explicit import Clock, advance
from ..numerics.integrators.tableaux import tableau
from ..numerics.ldl import ldl_factor
from ..tables.system import COORDINATES, System, Work
from .follow import follow
from .motion import arrive, derivative, move, place, remember, report
from .residual import residuals

POSITION, MOTION, INTEGRATE, FOLLOW = range(4)


@formula
def perform(S, W, R, clock, out, task):
    """What the kernel does. A formula, so that callees have one caller's flags and are compiled once."""
    y = clock.y[0]
    if task == POSITION:
        t = clock.real[0]
        nq = S.kinds[COORDINATES]
        z = y[nq + W.vel.shape[1] :]
        place(S, W, t, y[:nq], z)
        move(S, W, t, y[nq : nq + W.vel.shape[1]], z)
        remember(S, W, z)
        return 0
    if task == MOTION:
        return derivative(clock.real[0], y, clock.K[0], S, W)
    if task == FOLLOW:
        return follow(S, W, clock, out)
    return advance(derivative, arrive, report, S, W, R, clock, out)


@kernel
def motion_kernel(S, W, R, clock, out, task):
    """The one kernel with the right-hand side in it.

    POSITION: kinematics and rows at the clock's state are left in W; the state's turns and places on curves are
    brought up to it. MOTION: also its derivative, in clock.K[0].
    INTEGRATE: go on with the integration; FOLLOW: go on with what the drivers prescribe; both return the number of
    output rows written. The others return a status.
    """
    return perform(held(S), held(W), held(R), held(clock), out, task)


def evaluate(S: System, W: Work, t: float, y: np.ndarray, task: int) -> tuple[int, np.ndarray]:
    """Evaluate at one state; returns (status, derivative) and leaves kinematics and rows in W.

    With POSITION the turns and places in ``y`` are brought up to date.
    """
    real = np.zeros(10)
    real[0] = t
    Y = np.zeros((3, len(y)))
    Y[0] = y
    clock = Clock(real, np.zeros(9, np.int64), np.zeros(0), Y, np.zeros((1, len(y))), np.zeros(0, np.int64))
    status = motion_kernel(S, W, tableau("rk45"), clock, np.zeros((0, 0)), task)
    y[:] = Y[0]
    return status, clock.K[0]


@kernel
def residual_kernel(S, W, t, state, vdot, lam, steps, out):
    """The equations at states near one state, see ``residuals``; compiled for complex numbers, when first needed."""
    residuals(held(S), held(W), t, state, vdot, lam, steps, out)


@kernel
def factor_kernel(P, A, L, D, Y):
    """Factor a sparse symmetric matrix; see ``ldl_factor``."""
    return ldl_factor(P, A, L, D, Y)
