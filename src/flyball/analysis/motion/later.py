"""Accelerations and reactions at output times, solved for when something first asks for them.

Positions and velocities are put on the constraints at once; to solve for the rest there takes as long as much of the
motion, and many never look at it.
"""

from __future__ import annotations

import numpy as np

from ...equations.engine import COMPLETE, INTEGRATE, MOTION, motion_kernel
from ...equations.within import ROWS
from ...model.actions import Set
from ...numerics.integrators import clock as ex
from ...numerics.integrators.tableaux import tableau
from ...results.health import Health
from ...tables.system import LATER
from ..compiled import Compiled
from .options import Integration
from .reasons import no_solution
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


def solved(start: Start, rows: np.ndarray, health: Health) -> tuple[np.ndarray, np.ndarray]:
    """Accelerations (n, nv) and multipliers (n, nr) at the states of rows of output; nan where there are none.

    Of these ``health`` tells in its remarks.
    """
    c = start.assembly.compiled
    s, W = c.structure, c.work
    ny = s.nq + s.nv + len(s.states)
    W.option[LATER] = 0.0
    out = rows.copy()
    if motion_kernel(*c.buffers, tableau("rk45"), standing(ny), out, COMPLETE):
        health.remarks = (*health.remarks, unsolved(c, out))
    return np.ascontiguousarray(out[:, 1 + ny : 1 + ny + s.nv]), np.ascontiguousarray(out[:, 1 + ny + s.nv :])


def unsolved(c: Compiled, rows: np.ndarray) -> str:
    """What is to be said of rows of output (n, width) some of which have no accelerations: when, and why."""
    s = c.structure
    missing = rows[~np.isfinite(rows).all(axis=1)]
    t, q, v, z = np.split(missing[0, : 1 + s.nq + s.nv + len(s.states)], np.cumsum([1, s.nq, s.nv]))
    again = c.again()
    again.z = z
    again.at(float(t[0]), q, v, MOTION)
    why = no_solution(again, float(t[0]), float(np.abs(rows[:, 0]).max()))
    return (
        f"at {len(missing)} of {len(rows)} output times, the first t = {t[0]:.6g} s, the equations of motion have no "
        f"solution: accelerations and reactions are nan there: {why}"
    )
