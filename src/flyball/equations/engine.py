"""The one engine: everything that needs the right-hand side, compiled once, behind a door that any loop may go through.

Another loop (an implicit method, contact) hands its own desk to the engine: a `Clock` with the time in ``real[T]`` and
the state in ``y[0]``. It never contains the right-hand side, so that it compiles in half a second.
"""

from __future__ import annotations

from functools import cache, lru_cache

import numpy as np

from ..compiler.buffers import StructBuffer, StructPool
from ..compiler.formulas import formula
from ..compiler.kernels import kernel
from ..numerics.integrators.clock import STATES, Clock, ClockCounts, ClockReals
from ..numerics.integrators.explicit import answer
from ..numerics.integrators.loop import advance, nothing, whole
from ..numerics.integrators.tableaux import Tableau, tableau
from ..tables.system import System, Work
from .dispatch import remember
from .follow import follow
from .guards import watch
from .made import choose_code
from .motion import arrive, derivative, report, respond
from .projection import move, place, tangent
from .residual import residual
from .slopes import slopes
from .tasks import (
    ARRIVE,
    COMPLETE,
    FOLLOW,
    INSPECT,
    INTEGRATE,
    MOTION,
    POSITION,
    REPORT,
    RESIDUAL,
    SLOPES,
    SOLVE,
    TANGENT,
    WATCH,
    Sheet,
)
from .within import ROWS, inspect


@formula
def perform(S, W, R, clock, out, task):
    """One task; see `motion_kernel`. A formula, so that callees have one caller's flags and are compiled once."""
    t = clock.real.t
    y = clock.y[0]
    choose_code(S, W, task)
    if task == POSITION:
        nq = S.sizes.coordinates
        z = y[nq + W.velocities.solved.shape[0] :]
        place(S, W, t, y[:nq], z)
        move(S, W, t, y[nq : nq + W.velocities.solved.shape[0]], z)
        remember(S, W, z)
        return 0
    if task == MOTION:
        return derivative(t, y, clock.K[0], S, W)
    if task == WATCH:
        status = derivative(t, y, clock.K[0], S, W)
        watch(S, W, t, out[0])
        return status
    if task == FOLLOW:
        return follow(S, W, clock, out)
    if task == ARRIVE:
        status, moved = arrive(t, y, clock.K[0], S, W)
        out[0, 0] = moved
        return status
    if task == REPORT or task == COMPLETE:
        status = 0
        for n in range(out.shape[0] if task == COMPLETE else 1):
            if task == COMPLETE:
                t = out[n, 0]
                for i in range(y.shape[0]):
                    y[i] = out[n, 1 + i]
            found = report(t, y, out[n], S, W)
            status = max(status, found)
            if found != 0 and task == COMPLETE:
                for i in range(1 + y.shape[0], out.shape[1]):
                    out[n, i] = np.nan
        return status
    if task == RESIDUAL:
        for i in range(y.shape[0]):
            W.y[0, i] = y[i]
        residual(S, W, t, W.y[0], out[1], out[2], out[0])
        return 0
    if task == SOLVE:
        nv = W.velocities.solved.shape[0]
        nr = S.rows.law.shape[0]
        respond(S, W, out[0, :nv], out[1, :nr], out[2, :nv], out[3, :nr])
        return 0
    if task == TANGENT:
        tangent(y, clock.K[0], S, W)
        return 0
    if task == INSPECT:
        at = inspect(t, clock.real.h, clock.real.span, clock.count.next, clock.seen, S, W)
        clock.count.next, clock.real.h, clock.real.grow = at
        return 0
    if task == SLOPES:
        slopes(S, W, t, out)
        return 0
    if task == INTEGRATE:
        callbacks = (answer, (derivative, arrive, tangent, inspect), report, nothing, whole)
        return advance(callbacks, S, W, R, clock, out)
    return 0


@kernel
def engine(S: System, W: Work, R: Tableau, clock: Clock, sheet: Sheet, task: int) -> int:
    """`perform` behind an address."""
    return perform(S, W, R, clock, sheet.rows, task)


def motion_kernel(S: System, W: Work, R: Tableau, clock: Clock, out: np.ndarray, task: int) -> int:
    """Have the engine do a task.

    Parameters
    ----------
    S, W : System, Work
        Tables and scratch; kinematics and rows at the state are left in W.
    R : Tableau
        The integrator's coefficients; only INTEGRATE looks at them.
    clock : Clock
        Time and state.
    out : (n, width)
        Rows of output.
    task : int
        POSITION: kinematics and rows; the state's turns and places on curves are brought up to it. MOTION: also its
        derivative, in ``clock.K[0]``. ARRIVE: the state is put on the constraints, and how far that moved it goes to
        ``out[0, 0]``. REPORT: its row of output, in ``out[0]``. COMPLETE: rows of
        ``out`` whose accelerations and multipliers were left for later. RESIDUAL: of the equations at the accelerations
        ``out[1]`` and multipliers ``out[2]``, in ``out[0]``. SOLVE: at the state last evaluated, accelerations
        ``out[2]`` and multipliers ``out[3]`` that other forces ``out[0]`` and right-hand sides of the rows ``out[1]``
        make; see ``motion.respond``. TANGENT: an error ``clock.K[0]`` less what the projection takes off it. INSPECT:
        see ``within.inspect``; in and out by the clock. SLOPES: of every force, see
        ``slopes.slopes``. WATCH: MOTION, and what is watched, into ``out[0]``; see `guards`.
        INTEGRATE: go on with the integration; FOLLOW: go on with what the drivers prescribe.

    Returns
    -------
    int
        Of INTEGRATE and FOLLOW the number of rows written, of the others a status.
    """
    return int(engine(S, W, R, clock, Sheet(out), task))


def evaluate(S: System, W: Work, t: float, y: np.ndarray, task: int) -> tuple[int, np.ndarray]:
    """Evaluate at one state; returns (status, derivative) and leaves kinematics and rows in W.

    With POSITION the turns and places in ``y`` are brought up to date.
    """
    clock = _standing(len(y)).new()
    clock.array("real").t = t
    state = clock.array("y")[0]
    state[:] = y
    status = int(engine(S, W, _unused(), clock, _no_rows(), task))
    y[:] = state
    return status, clock.array("K")[0]


@lru_cache
def _standing(ny: int) -> StructPool:
    """Clocks that stand, of states of so many numbers."""
    none, one = np.zeros(0, np.int64), np.zeros((1, ny))
    return StructPool(
        Clock(ClockReals.blank(), ClockCounts.blank(), np.zeros(0), np.zeros((STATES, ny)), one, none,
              np.zeros((ROWS, 0)))
    )  # fmt: skip


@cache
def _unused() -> StructBuffer:
    """Coefficients of an integrator, for tasks that integrate nothing."""
    return StructBuffer(tableau("rk45"))


@cache
def _no_rows() -> StructBuffer:
    return StructBuffer(Sheet(np.zeros((0, 0))))
