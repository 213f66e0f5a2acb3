"""Code made for one mechanism, in memory: the tables that have the engine call it."""

from __future__ import annotations

import ctypes
from dataclasses import dataclass

import numpy as np

from ..tables.system import FLAT, SAMPLED, SCRATCH, System
from .linked import ENTRIES
from .machine import Loaded, tables_of
from .trace import Entry

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
        What has been compiled: operations of all procedures.
    laws : list of str
        Procedures of the laws that may do much within a step, in the order of `within.law_at`; "" for the others.
    seconds : float
        What tracing and compiling took [s of the processor].
    known : list of Entry
        Entries of the tables whose very values are in the code.
    """

    loaded: Loaded
    scratch: int
    constants: int
    operations: int
    laws: list[str]
    seconds: float
    known: list[Entry]

    def system(self, S: System) -> System:
        """The tables with the addresses in them; the code lives as long as the array in which they stand."""
        first = FLAT + self.constants
        memory = (ctypes.c_int64 * (first + len(self.laws)))()
        memory.code = self.loaded  # type: ignore[attr-defined]
        flat = np.frombuffer(memory, np.int64)  # type: ignore[call-overload]
        flat[SCRATCH] = self.scratch
        for k, name in enumerate(ENTRIES[1:-1], 1):
            flat[k] = self.loaded.addresses[name]
        if self.laws:
            flat[SAMPLED] = first
            flat[first:] = [self.loaded.addresses[name] if name else 0 for name in self.laws]
        S = S._replace(flat=flat)
        tables = tables_of(S)
        constants = flat.ctypes.data + 8 * FLAT
        _FUNCTION(self.loaded.addresses["CONSTANTS"])(tables.ctypes.data, None, 0.0, constants, None, None, None)
        return S
