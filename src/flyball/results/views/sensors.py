"""Sensors' outputs."""

from __future__ import annotations

import numpy as np

from ...math.vec import mtv, sub
from .base import View


class SensorView(View):
    """A measured quantity under a name of its own."""

    @property
    def value(self) -> np.ndarray:
        """What it measures, over time, in SI units."""
        return self._result.channel(self.element.of)[1]

    @property
    def unit(self) -> str:
        """Unit of what it measures."""
        return self.names["value"].unit


class IMUView(View):
    """What accelerometers and gyroscopes on a body show."""

    def _axes(self) -> tuple:
        return self._result.records.named(self.element.frame)

    @property
    def specific_force(self) -> np.ndarray:
        """Acceleration of its origin less gravity, along its own axes [m/s^2], (n, 3)."""
        _, R, _, _, _, a = self._axes()
        gravity = tuple(self._x.system.gravity)
        return np.stack(mtv(R, sub(a, gravity)), axis=1)

    @property
    def angular_velocity(self) -> np.ndarray:
        """Angular velocity along its own axes [rad/s], (n, 3)."""
        _, R, w, _, _, _ = self._axes()
        return np.stack(mtv(R, w), axis=1)
