"""Efforts of drivers and couplings, states and signals of controllers, values of sensors."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...engine.rows import COEFFICIENT
from ...errors import ModelError
from ...math.vec import mtv, sub
from ...model.controller_signals import signal_law
from .base import PartView


class DriverView(PartView):
    """Effort and work of a driver."""

    @property
    def effort(self) -> np.ndarray:
        """Force [N] or torque [N m] along its coordinate."""
        return self._result.multipliers[:, self._x.structure.slices[self.element.name].start]

    @property
    def work(self) -> np.ndarray:
        """Work done on the mechanism since the start [J]."""
        return self._result.states[:, self._x.structure.state_at[f"{self.element.name}.work"]]


class CouplingView(PartView):
    """Efforts of a coupling."""

    def effort(self, coordinate: str) -> np.ndarray:
        """Return the force [N] or torque [N m] of the coupling on one of its coordinates, along it."""
        s, S = self._x.structure, self._x.system
        for k in s.terms_of[self.element.name]:
            t = s.terms[k]
            if f"{t.owner.name}.{t.what}" == coordinate:
                return self._result.multipliers[:, t.row] * S.term_parameters[k, COEFFICIENT] / t.sign
        has = ", ".join(self.element.coupled())
        raise ModelError(f"{self.element.title} does not couple {coordinate!r}; it couples {has}")

    def _found(self, name: str) -> np.ndarray:
        """Return ``effort_1``, ``effort_2`` ... on its coordinates, in order."""
        return self.effort(list(self.element.coupled())[int(name.removeprefix("effort_")) - 1])


class ControllerView(PartView):
    """States and signals of a controller over time."""

    def _found(self, name: str) -> np.ndarray:
        """Return a state, or a signal from the formula that replaces it in laws."""
        s = self._x.structure
        state = s.state_at.get(f"{self.element.name}.{name}")
        if state is not None:
            return self._result.states[:, state]
        law = signal_law(s.model, self.element, name)
        sensed = self._result.measured.slots
        env: dict[str, Any] = {"t": self._result.t, **self._x.env}
        env |= {k: sensed[0, m] for k, m in s.slots.items()}
        return law.evaluate(env, {x.name: x for x in s.model.tables}) + self._result.records.zeros()


class SensorView(PartView):
    """A measured quantity with its own name."""

    @property
    def value(self) -> np.ndarray:
        """Measured values over time, in SI units."""
        return self._result.channel(self.element.of)[1]

    @property
    def unit(self) -> str:
        """Unit of the measured quantity."""
        return self.names["value"].unit


class IMUView(PartView):
    """Readings of accelerometers and gyroscopes on a body."""

    def _axes(self) -> tuple:
        return self._result.records.named(self.element.frame)

    @property
    def specific_force(self) -> np.ndarray:
        """Acceleration of its origin minus gravity, along its own axes [m/s^2], (n, 3)."""
        _, R, _, _, _, a = self._axes()
        gravity = tuple(self._x.system.gravity)
        return np.stack(mtv(R, sub(a, gravity)), axis=1)

    @property
    def angular_velocity(self) -> np.ndarray:
        """Angular velocity along its own axes [rad/s], (n, 3)."""
        _, R, w, _, _, _ = self._axes()
        return np.stack(mtv(R, w), axis=1)
