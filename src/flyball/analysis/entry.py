"""The compiled entry points. Few on purpose: the right-hand side takes seconds to compile, so it is compiled once."""

from __future__ import annotations

import numpy as np

from .._jit import kernel
from ..numerics.integrators.explicit import Clock, advance
from ..numerics.integrators.tableaux import tableau
from ..numerics.ldl import ldl_factor
from ..system.motion import arrive, derivative, move, place, report
from ..system.tables import System, Work

POSITION, MOTION, INTEGRATE = 0, 1, 2


@kernel
def motion_kernel(S, W, R, clock, out, task):
    """The one kernel with the right-hand side in it.

    POSITION: kinematics and rows at the clock's state are left in W. MOTION: also its derivative, in clock.K[0].
    INTEGRATE: go on with the integration; returns the number of output rows written. The others return a status.
    """
    y = clock.y[0]
    if task == 0:
        nq = S.kinds[-2]
        place(S, W, clock.real[0], y[:nq])
        move(S, W, y[nq : nq + W.vel.shape[1]])
        return 0
    if task == 1:
        return derivative(clock.real[0], y, clock.K[0], S, W)
    return advance(derivative, arrive, report, S, W, R, clock, out)


def evaluate(S: System, W: Work, t: float, y: np.ndarray, task: int) -> tuple[int, np.ndarray]:
    """Evaluate at one state; returns (status, derivative) and leaves kinematics and rows in W."""
    real = np.zeros(9)
    real[0] = t
    Y = np.zeros((3, len(y)))
    Y[0] = y
    clock = Clock(real, np.zeros(8, np.int64), np.zeros(0), Y, np.zeros((1, len(y))))
    return motion_kernel(S, W, tableau("rk45"), clock, np.zeros((0, 0)), task), clock.K[0]


@kernel
def factor_kernel(P, A, L, D, Y):
    """Factor a sparse symmetric matrix; see ``ldl_factor``."""
    return ldl_factor(P, A, L, D, Y)
