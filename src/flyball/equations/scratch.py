"""The scratch arrays of one run."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..laws.call import STACK_RESERVE
from ..tables.reads import width
from ..tables.specs import Structure
from ..tables.system import (
    FLAT,
    INVERSE_JACOBIAN,
    INVERSE_SLOPES,
    LOWER,
    MADE,
    SCRATCH,
    SWITCH_LOWER,
    SWITCH_UPPER,
    UPPER,
    System,
    Work,
)
from .kinematics import ground_frames


def work(s: Structure, system: System, dtype: Any = None) -> Work:
    """Scratch arrays for one run: of the tables' own kind of numbers, if not told."""
    dtype = system.body_x.dtype if dtype is None else dtype
    nb, nf, nr, nv = len(system.body_i), len(system.frame_i), len(system.row_i), s.nv
    n, ny, nl, nw = len(system.ldl.perm), s.nq + nv + len(s.states), len(s.loads), len(s.switches)
    nc, ne = len(system.control_i), width(s)

    def z(*shape: int) -> np.ndarray:
        return np.zeros(shape, dtype)

    W = Work(
        z(nb, 24), z(nf, 24), z(nv, 14), z(nb, 3), z(nb, 6), z(nb, 30), z(len(system.mass_i)), z(len(system.col_i)),
        z(len(system.col_i)), z(len(s.terms) if s.loads or s.reads else 0, 6), z(9, nr), z(8, nv),
        z(INVERSE_JACOBIAN + nl, 2 * len(s.measured) + nl + ne + nc + nw), z(INVERSE_SLOPES + nw, nw),
        z(len(system.ldl.Ai) + 1), z(len(system.ldl.Li)), z(3, n), z(s.depth + 1 + STACK_RESERVE, 3), z(3, ny),
        np.zeros(11), np.zeros(MADE + FLAT, np.int64), z(system.flat[SCRATCH]),
    )  # fmt: skip
    W.switch[LOWER], W.switch[UPPER] = system.switch_x[:, SWITCH_LOWER], system.switch_x[:, SWITCH_UPPER]
    ground_frames(system, W)
    return W
