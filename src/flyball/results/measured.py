"""Measured quantities over time, through the formulas that the compiled loops use."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from ..constraints.registry import FORMULAS
from ..math.vec import dot, sub
from ..system.rows import parameters

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

    def _found(self, m: int) -> tuple[np.ndarray, np.ndarray]:
        result, s, S = self._result, self._result.values.structure, self._result.values.system
        r = result.records
        value, rate = np.zeros(r.n), np.zeros(r.n)
        for k, t in enumerate(s.terms):
            if t.row != len(s.rows) + m:
                continue
            F, M = r.frame(t.F), r.frame(t.M)
            hint = result.states[:, t.hint] if t.hint >= 0 else 0.0
            par = parameters(S.term_x, k)
            g, f, tM, tF, _ = FORMULAS[t.formula.kind](par, F, M, hint, S.const)
            value = value + par[7] * g
            rate = rate + par[7] * (dot(f, sub(M[3], F[3])) + dot(tM, M[2]) + dot(tF, F[2]))
        return value, rate

    @cached_property
    def slots(self) -> np.ndarray:
        """What laws read: (3, slots, n), values first, then rates as values of their own."""
        n = len(self._result.values.structure.measured)
        out = np.zeros((3, 2 * n, self._result.records.n))
        if self._result.values.structure.slots:
            for m in range(n):
                out[0, m], out[1, m] = self.quantity(m)
                out[0, n + m] = out[1, m]
        return out
