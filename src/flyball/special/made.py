"""Code made for one mechanism, in memory: the tables that have the engine call it."""

from __future__ import annotations

import ctypes
from dataclasses import dataclass

import numpy as np

from ..tables.system import FLAT, SCRATCH, System
from .linked import ORDER
from .machine import Loaded, tables_of

ENTRIES = (
    "SCRATCH", "PREPARE", "PLACE", "MOVE", "LOADS", "FACTOR", "REUSE", "STEP", "STEP_UNLOADED", "REFINE", "FINISH", "DRIFT",
)  # fmt: skip
"""Names of the entries of `System.flat`, in their order."""
_FUNCTION = ctypes.CFUNCTYPE(ctypes.c_double, *[ctypes.c_void_p] * 2, ctypes.c_double, *[ctypes.c_void_p] * 4)


@dataclass(frozen=True)
class Made:
    """Code for one structure.

    Attributes
    ----------
    loaded : Loaded
        The machine code.
    scratch, constants : int
        Length of `Work.flat`; numbers that are reckoned once for a `System`.
    operations : int
        Operations of a right-hand side.
    seconds : float
        What tracing and compiling took [s], when it was made.
    """

    loaded: Loaded
    scratch: int
    constants: int
    operations: int
    seconds: float

    def system(self, S: System) -> System:
        """The tables with the addresses in them; the code lives as long as the array in which they stand."""
        memory = (ctypes.c_int64 * (FLAT + self.constants))()
        memory.code = self.loaded
        flat = np.frombuffer(memory, np.int64)
        flat[SCRATCH] = self.scratch
        for k, name in enumerate(ENTRIES):
            if name in ORDER:
                flat[k] = self.loaded.address(name)
        tables = tables_of(S)
        fill = _FUNCTION(self.loaded.address("CONSTANTS"))
        fill(tables.ctypes.data, None, 0.0, flat.ctypes.data + 8 * FLAT, None, None, None)
        return S._replace(flat=flat)
