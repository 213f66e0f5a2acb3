"""What controllers keep and say."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...model.wiring import signal
from .base import View


class ControllerView(View):
    """States and signals of a controller over time."""

    def _found(self, name: str) -> np.ndarray:
        """A state, or a signal from the formula that laws have in its place."""
        s = self._x.structure
        state = s.state_at.get(f"{self.element.name}.{name}")
        if state is not None:
            return self._result.states[:, state]
        law = signal(s.model, self.element, name)
        sensed = self._result.measured.slots
        env: dict[str, Any] = {"t": self._result.t, **self._x.env}
        env |= {k: sensed[0, m] for k, m in s.slots.items()}
        return law.evaluate(env, {x.name: x for x in s.model.tables}) + self._result.records.zeros()
