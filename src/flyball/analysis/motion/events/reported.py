"""Forces of what shares them in many ways, as they are told: within all bounds."""

from __future__ import annotations

import numpy as np

from ....equations.engine import MOTION, engine
from ....equations.sharing import renewed_kernel, shared_kernel
from ....equations.tasks import Sheet
from ....equations.within import ROWS
from ....numerics.cone.shares import OPEN
from ....numerics.integrators.clock import STATES, Clock, ClockCounts, ClockReals
from ....numerics.integrators.tableaux import tableau
from ....tables.system import assign
from .here import Here


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
