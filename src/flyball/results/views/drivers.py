"""What drivers and couplings have to do."""

from __future__ import annotations

import numpy as np

from ...equations.rows import COEFFICIENT
from ...errors import ModelError
from .base import View


class DriverView(View):
    """What a driver has to do."""

    @property
    def effort(self) -> np.ndarray:
        """Force [N] or torque [N m] along its coordinate."""
        return self._result.multipliers[:, self._x.structure.slices[self.element.name].start]

    @property
    def work(self) -> np.ndarray:
        """Work given to the mechanism since the start [J]."""
        return self._result.states[:, self._x.structure.state_at[f"{self.element.name}.work"]]


class CouplingView(View):
    """What a coupling passes on."""

    def effort(self, coordinate: str) -> np.ndarray:
        """Force [N] or torque [N m] that it puts on one of its coordinates, along it."""
        s, S = self._x.structure, self._x.system
        for k in s.terms_of[self.element.name]:
            t = s.terms[k]
            if f"{t.owner.name}.{t.what}" == coordinate:
                return self._result.multipliers[:, t.row] * S.term_parameters[k, COEFFICIENT] / t.sign
        has = ", ".join(self.element.coupled())
        raise ModelError(f"{self.element.title} does not couple {coordinate!r}; it couples {has}")

    def _found(self, name: str) -> np.ndarray:
        """``effort_1``, ``effort_2`` ... on its coordinates, in order."""
        return self.effort(list(self.element.coupled())[int(name.removeprefix("effort_")) - 1])
