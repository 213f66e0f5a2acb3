"""The scratch arrays of one run."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from ..compiler.buffers import PooledBuffer, StructBuffer, StructPool
from ..laws.call import STACK_RESERVE
from ..tables.reads import width
from ..tables.specs import Structure
from ..tables.system import (
    FLAT,
    GROUND_FRAMES,
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

MOST = 4  # kinds of scratch, and tables, of a structure that are known


def work(s: Structure, system: System, dtype: Any = None) -> Work:
    """Scratch arrays for one run: of the tables' own kind of numbers, if not told."""
    dtype = np.dtype(system.body_x.dtype if dtype is None else dtype)
    if dtype.kind in "fc":
        return scratch(s, system, dtype).fields  # type: ignore[no-any-return]
    W = blank(s, system, dtype)
    W.switch[LOWER], W.switch[UPPER] = system.switch_x[:, SWITCH_LOWER], system.switch_x[:, SWITCH_UPPER]
    ground_frames(system, W)
    return W


def scratch(s: Structure, system: System, dtype: Any) -> PooledBuffer:
    """The same as compiled code has it."""
    key = np.dtype(dtype).char, int(system.flat[SCRATCH])
    made = s.kept.get("scratch", key, MOST, lambda: StructPool(blank(s, system, dtype))).new()
    fill(s, system, made.array)
    return made


def fill(s: Structure, system: System, array: Callable[[str], np.ndarray]) -> None:
    """Put into blank scratch, whose arrays are found by name, what the tables say of it."""
    if len(system.switch_x):
        switch = array("switch")
        switch[LOWER], switch[UPPER] = system.switch_x[:, SWITCH_LOWER], system.switch_x[:, SWITCH_UPPER]
    if n := system.kinds[GROUND_FRAMES]:
        frames = system.frame_x  # told by their address
        _, at_rest = s.kept.get("ground", id(frames), MOST, lambda: (frames, on_ground(system)))
        array("FK")[:n] = at_rest


def tables(s: Structure, system: System) -> StructBuffer:
    """The tables as compiled code has them."""
    return s.kept.get("written", id(system), MOST, lambda: _described(s, system))  # whose address it keeps from others


def _described(s: Structure, system: System) -> StructBuffer:
    first = s.kept.get("written first", None, 1, lambda: StructBuffer(system))
    return first.of(system)


def on_ground(system: System) -> np.ndarray:
    """Records of the frames on ground: they stand first in `Work.FK`, and nothing writes them again."""
    W = Records(np.zeros((system.kinds[GROUND_FRAMES], 24), system.frame_x.dtype))
    ground_frames(system, W)
    return W.FK


class Records(NamedTuple):
    """Of frames."""

    FK: np.ndarray


def blank(s: Structure, system: System, dtype: Any) -> Work:
    """Scratch of zeros."""
    nb, nf, nr, nv = len(system.body_i), len(system.frame_i), len(system.row_i), s.nv
    n, ny, nl, nw = len(system.ldl.perm), s.nq + nv + len(s.states), len(s.loads), len(s.switches)
    nc, ne = len(system.control_i), width(s)

    def z(*shape: int) -> np.ndarray:
        return np.zeros(shape, dtype)

    return Work(
        z(nb, 24), z(nf, 24), z(nv, 14), z(nb, 3), z(nb, 6), z(nb, 30), z(len(system.mass_i)), z(len(system.col_i)),
        z(len(system.col_i)), z(len(s.terms) if s.loads or s.reads else 0, 6), z(9, nr), z(8, nv),
        z(INVERSE_JACOBIAN + nl, 2 * len(s.measured) + nl + ne + nc + nw), z(INVERSE_SLOPES + nw, nw),
        z(len(system.ldl.Ai) + 1), z(len(system.ldl.Li)), z(3, n), z(s.depth + 1 + STACK_RESERVE, 3), z(3, ny),
        np.zeros(11), np.zeros(MADE + FLAT, np.int64), z(system.flat[SCRATCH]),
    )  # fmt: skip
