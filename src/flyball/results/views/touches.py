"""What a place of contact measures and does."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from ...math.vec import cross
from ..touched import Touched
from .base import View


class TouchView(View):
    """A place of contact; nan where a motion was computed without."""

    @cached_property
    def _touched(self) -> Touched:
        return Touched(self._result, self.element)

    def acts(self) -> tuple[tuple[int, int], tuple, tuple, tuple]:
        """Bodies of F and M, a point, force and torque there on M's body over time: of friction that slides."""
        x = self._touched
        S, t = self._x.system, self._x.structure.terms
        one = next(k for k in t if k.element is self.element)
        zero = self._result.records.zeros()
        bodies = int(S.frame_body[one.F]), int(S.frame_body[one.M])
        return bodies, tuple(x.point.T), tuple(x.sliding.T), (zero, zero, zero)

    @property
    def wrench(self) -> tuple[np.ndarray, np.ndarray]:
        """Force [N] on the second body and torque [N m] about the origin of M, world axes."""
        x = self._touched
        if not x.known:
            nothing = np.full((len(self._result.t), 3), np.nan)
            return nothing, nothing
        arm = -x.element.radius * x.normal
        return x.force, np.stack(cross(tuple(arm.T), tuple(x.force.T)), axis=1)

    @property
    def energy(self) -> np.ndarray:
        """It stores none [J]."""
        return self._result.records.zeros()

    @property
    def power(self) -> np.ndarray:
        """Of friction [W]."""
        return self._touched.power if self._touched.known else self._result.records.zeros() * np.nan

    @property
    def work(self) -> np.ndarray:
        """Of friction since the start [J], integrated with the motion."""
        at = self._x.structure.state_at.get(f"{self.element.name}.work")
        return self._result.records.zeros() if at is None else self._result.states[:, at]

    def _found(self, name: str) -> np.ndarray:
        """Gap, normal force, friction, speed of slip; force and torque."""
        if name in ("force", "torque"):
            force, torque = self.wrench
            planar = self._result.planar
            return (
                force[:, :2]
                if planar and name == "force"
                else torque[:, 2]
                if planar
                else (force, torque)[name == "torque"]
            )
        x = self._touched
        if not x.known:
            return self._result.records.zeros() * np.nan
        if name == "gap":
            return x.gap
        if name == "normal":
            return x.pressure
        if name == "slip":
            return np.sqrt((x.slip**2).sum(axis=0))
        return np.sqrt(((x.sliding + x.sticking) ** 2).sum(axis=1))
