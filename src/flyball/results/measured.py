"""Measured quantities over time, through the formulas that the compiled loops use."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from ..math.vec import dot, sub
from ..tables.reads import width
from .terms import coefficient, term

if TYPE_CHECKING:
    from .result import Result


class Measured:
    """What forces act along and what laws name."""

    def __init__(self, result: Result) -> None:
        self._result = result
        self._known: dict[int, tuple[np.ndarray, np.ndarray]] = {}

    def quantity(self, m: int) -> tuple[np.ndarray, np.ndarray]:
        """Value and rate of quantity m over time."""
        if m not in self._known:
            self._known[m] = self._found(m)
        return self._known[m]

    @cached_property
    def _terms(self) -> dict[int, list[int]]:
        """Terms of every quantity."""
        s = self._result.values.structure
        out: dict[int, list[int]] = {m: [] for m in range(len(s.measured))}
        for k, t in enumerate(s.terms):
            if t.measured:
                out[t.row - len(s.rows)].append(k)
        return out

    def _found(self, m: int) -> tuple[np.ndarray, np.ndarray]:
        value, rate = self._result.motions.zeros(), self._result.motions.zeros()
        for k in self._terms[m]:
            F, M, (g, f, tM, tF, _) = term(self._result, k)
            c = coefficient(self._result, k)
            value = value + c * g
            rate = rate + c * (dot(f, sub(M[3], F[3])) + dot(tM, M[2]) + dot(tF, F[2]))
        return value, rate

    @cached_property
    def slots(self) -> np.ndarray:
        """What laws read: (3, slots, n): values, rates as values of their own, loads and forces (not these),
        states of controllers, ways of switches.
        """
        s = self._result.values.structure
        n, switches = len(s.measured), len(s.switches)
        first = 2 * n + len(s.loads) + width(s)
        out = self._result.motions.zeros(3, first + len(s.controls) + switches)
        if s.controls:
            out[0, first : first + len(s.controls)] = self._result.states[:, : len(s.controls)].T
        if s.slots or switches:
            for m in range(n):
                out[0, m], out[1, m] = self.quantity(m)
                out[0, n + m] = out[1, m]
        if switches and self._result.stretches is not None:
            out[0, -switches:] = self._result.stretches.sigma
        return out
