"""What drivers and couplings have to do."""

from __future__ import annotations

import numpy as np

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

    def channels(self) -> dict[str, tuple[str, np.ndarray]]:
        """Effort and work."""
        unit = self._x.structure.model.unit(self.element.coordinate, self.element)
        return {"effort": ("N*m" if unit == "rad" else "N", self.effort), "work": ("J", self.work)}


class CouplingView(View):
    """What a coupling passes on."""

    def effort(self, coordinate: str) -> np.ndarray:
        """Force [N] or torque [N m] that it puts on one of its coordinates, along it."""
        s, S = self._x.structure, self._x.system
        for k in s.terms_of[self.element.name]:
            t = s.terms[k]
            if f"{t.owner.name}.{t.what}" == coordinate:
                return self._result.multipliers[:, t.row] * S.term_x[k, 7] / t.sign
        has = ", ".join(self.element.coupled())
        raise ModelError(f"{self.element.title} does not couple {coordinate!r}; it couples {has}")

    def channels(self) -> dict[str, tuple[str, np.ndarray]]:
        """``effort_1``, ``effort_2`` ... on its coordinates, in order."""
        model = self._x.structure.model
        out = {}
        for k, text in enumerate(self.element.coupled(), 1):
            unit = "N*m" if model.unit(text, self.element) == "rad" else "N"
            out[f"effort_{k}"] = (unit, self.effort(text))
        return out
