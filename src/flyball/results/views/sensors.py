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
        return self._result.channel(self.element.of)[0]

    def channels(self) -> dict[str, tuple[str, np.ndarray]]:
        """Its value."""
        return {"value": self._result.channel(self.element.of)}


class IMUView(View):
    """What accelerometers and gyroscopes on a body show."""

    def _axes(self) -> tuple:
        return self._result.records.named(self.element.frame)

    @property
    def specific_force(self) -> np.ndarray:
        """Acceleration of its origin less gravity, along its own axes [m/s^2], (n, 3)."""
        _, R, _, _, _, a = self._axes()
        gravity = tuple(self._x.system.glob[:3])
        return np.stack(mtv(R, sub(a, gravity)), axis=1)

    @property
    def angular_velocity(self) -> np.ndarray:
        """Angular velocity along its own axes [rad/s], (n, 3)."""
        _, R, w, _, _, _ = self._axes()
        return np.stack(mtv(R, w), axis=1)

    def channels(self) -> dict[str, tuple[str, np.ndarray]]:
        """Components of both."""
        f, w = self.specific_force, self.angular_velocity
        if self._result.planar:
            return {"fx": ("m/s^2", f[:, 0]), "fy": ("m/s^2", f[:, 1]), "w": ("rad/s", w[:, 2])}
        out = {f"f{a}": ("m/s^2", f[:, i]) for i, a in enumerate("xyz")}
        return out | {f"w{a}": ("rad/s", w[:, i]) for i, a in enumerate("xyz")}
