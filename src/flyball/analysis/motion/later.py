"""Accelerations and reactions at output times, solved for when something first asks for them.

Positions and velocities are put on the constraints at once; to solve for the rest there takes as long as much of the
motion, and many never look at it.
"""

from __future__ import annotations

import numpy as np

from ...equations.engine import COMPLETE, INTEGRATE, motion_kernel
from ...equations.within import ROWS
from ...model.actions import Set
from ...numerics.integrators import clock as ex
from ...numerics.integrators.tableaux import tableau
from ...tables.system import LATER
from .options import Integration
from .start import Start


def open_until_asked(start: Start, o: Integration, task: int) -> bool:
    """Whether accelerations can be left for later: they would be the same then.

    Friction starts from the loads found last, a Python function may have a memory, and events may change modes and
    numbers.
    """
    s = start.assembly.compiled.structure
    usual = task == INTEGRATE and o.stabilization == "projection"
    changes = any(isinstance(a, Set) for e in s.model.events for a in e.do)
    return usual and not (s.loads or s.functions or s.switches or changes)


def standing(ny: int, t: float = 0.0) -> ex.Clock:
    """Time and state, so many numbers, for tasks that integrate nothing."""
    real = np.zeros(ex.REALS)
    real[ex.T] = t
    none = np.zeros(0, np.int64)
    count, y, K = np.zeros(ex.COUNTS, np.int64), np.zeros((ex.STATES, ny)), np.zeros((1, ny))
    return ex.Clock(real, count, np.zeros(0), y, K, none, np.zeros((ROWS, 0)))


def solved(start: Start, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Accelerations (n, nv) and multipliers (n, nr) at the states of rows of output."""
    c = start.assembly.compiled
    s, W, rows = c.structure, c.work, rows.copy()
    ny = s.nq + s.nv + len(s.states)
    clock = standing(ny)
    W.option[LATER] = 0.0
    before = rows.copy()
    motion_kernel(c.system, W, tableau("rk45"), clock, rows, COMPLETE)
    if c.made is not None and not np.isfinite(rows).all():  # what made code cannot do the engine's loops may
        rows = before
        motion_kernel(c.values.system, W, tableau("rk45"), clock, rows, COMPLETE)
    return np.ascontiguousarray(rows[:, 1 + ny : 1 + ny + s.nv]), np.ascontiguousarray(rows[:, 1 + ny + s.nv :])
