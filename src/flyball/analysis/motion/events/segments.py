"""What held at the output times of a motion with events, collected as the motion goes on."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ....constraints.modes import BRANCH
from ....equations.engine import MOTION, engine
from ....equations.sharing import renewed_kernel, shared_kernel
from ....equations.tasks import Sheet
from ....equations.within import ROWS
from ....numerics.cone.shares import OPEN
from ....numerics.integrators.clock import STATES, Clock, ClockCounts, ClockReals
from ....numerics.integrators.tableaux import tableau
from ....results.booked import booked
from ....results.result import Result
from ....results.stretches import RecordedModes, Stretch, stretched
from ....tables.system import HELD, OFF, VALUE, assign
from .here import Here


@dataclass
class Segments:
    """Rows of output between events, with the modes and parameters that held there."""

    all: list[Stretch] = field(default_factory=list)

    def add(self, here: Here, rows: np.ndarray) -> None:
        """Take note of rows that the compiled loop has just written, none of them too; modes are those of now."""
        c, W = here.c, here.c.work
        n = len(here.structure.switches)
        ways = W.sensed[VALUE, W.sensed.shape[1] - n :].copy()
        if any(x.switch.kind == BRANCH and W.modes.mode[k] != OFF for k, x in enumerate(here.structure.switches)):
            ways = _ways(here, rows)
        _quiet(here, rows)
        share(here, rows)
        self.all.append(
            Stretch(
                len(rows),
                np.array(W.modes[: len(RecordedModes._fields)]),
                ways,
                c.values,
                here.lost,
                getattr(here, "given", 0.0),
                here.y.copy(),
            )
        )

    def told(self, result: Result) -> None:
        """Give a result what held, and what events did to its energy, if anything can switch."""
        s = result.values.structure
        if not s.switches and not s.guards and not s.model.events:
            return
        result.stretches = stretched(self.all)
        result.exchanged |= booked(result)


def _quiet(here: Here, rows: np.ndarray) -> None:
    """Take the rounding from the rates of coordinates that are held by a row alone, at rows of output."""
    S, W, s = here.c.system, here.c.work, here.structure
    first, ny = 1 + s.nq, 1 + len(here.y)
    for k in np.flatnonzero(W.modes.mode == HELD).tolist():
        row = S.switches.row[k]
        if row >= 0 and S.row_start[row + 1] - S.row_start[row] == 1:
            column = S.column[S.row_start[row]]
            rows[:, [first + column, ny + column]] = 0.0


def _ways(here: Here, rows: np.ndarray) -> np.ndarray:
    """The ways of all switches at rows of output, (ns, n), where laws follow their switching surface."""
    s, c, n = here.structure, here.c, len(here.structure.switches)
    out = np.zeros((n, len(rows)))
    again = c.again()
    assign(again.work.modes, c.work.modes)
    again.work.sensed[:] = c.work.sensed
    for k, row in enumerate(rows):
        again.z = row[1 + s.nq + s.nv : 1 + len(here.y)].copy()
        again.at(row[0], row[1 : 1 + s.nq], row[1 + s.nq : 1 + s.nq + s.nv], MOTION)
        out[:, k] = again.work.sensed[VALUE, again.work.sensed.shape[1] - n :]
    return out


# Forces of what shares them in many ways, as they are told: within all bounds.


def share(here: Here, rows: np.ndarray) -> None:
    """Put shares that friction can hold in place of those of least squares, at rows of output of a group."""
    group = getattr(here, "sharing", None)
    if group is None or group.Q.count[OPEN] == 0 or not len(rows):
        return
    s, again, G = here.structure, here.c.again(), group
    W, S, ny = again.work, again.system, len(here.y)
    assign(W.modes, here.c.work.modes)
    W.sensed[:] = here.c.work.sensed
    none, R = np.zeros(0, np.int64), tableau("rk45")
    seen, state = np.zeros((ROWS, 0)), np.zeros((STATES, ny))
    own = Clock(ClockReals.blank(), ClockCounts.blank(), np.zeros(0), state, np.zeros((1, ny)), none, seen)
    sheet = Sheet(np.zeros((4, max(s.nv, len(S.rows.law), 1))))
    address = engine.address
    lam = slice(1 + ny + s.nv, 1 + ny + s.nv + len(S.rows.law))
    for row in rows:
        again.z = row[1 + s.nq + s.nv : 1 + ny].copy()
        again.at(row[0], row[1 : 1 + s.nq], row[1 + s.nq : 1 + s.nq + s.nv], MOTION)
        renewed_kernel(address, S, W, R, own, sheet, G)
        W.rows.multiplier[:] = row[lam]
        shared_kernel(S, W, row[0], G)
        row[lam] = W.rows.multiplier
