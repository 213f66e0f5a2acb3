"""Motion of bodies and frames."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from ...math.scalar import atan2
from ...model.body import Body, Frame
from ...model.geometry import matrix_to_quaternion
from ..records import Record
from .base import View, same_sign, stacked

if TYPE_CHECKING:
    from ..result import Result


class PointView(View):
    """Motion of a frame: a body's reference frame or a named one."""

    instead: ClassVar = {"angle": "what moves in space has no single angle: use rotation or quaternion"}

    def __init__(self, result: Result, element: Body | Frame) -> None:
        super().__init__(result, element)
        self._placed = self._body, _, self._turn = result.motions.placed(element.name)

    @cached_property
    def _moving(self) -> Record:
        """Its record without accelerations."""
        return self._result.motions.carried(*self._placed)

    @cached_property
    def _record(self) -> Record:
        return self._result.records.carried(*self._placed)

    @property
    def position(self) -> np.ndarray:
        """Position of its origin in the world [m], (n, 2) or (n, 3)."""
        return stacked(self._moving[0], self._result.planar)

    @property
    def velocity(self) -> np.ndarray:
        """Velocity of its origin, world axes [m/s]."""
        return stacked(self._moving[3], self._result.planar)

    @property
    def acceleration(self) -> np.ndarray:
        """Acceleration of its origin, world axes [m/s^2]."""
        return stacked(self._record[5], self._result.planar)

    def _found(self, name: str) -> np.ndarray:
        """Of a body: what holds a coordinate that events lock, or the sum of contact forces on it [N], world axes."""
        if name.endswith("_effort"):
            return self._effort(f"{self.element.name}.{name.removesuffix('_effort')}")
        found, n = self._result.contacts, 2 if self._result.planar else 3
        if found is None or self.element.name not in found.sides.names:
            return np.zeros((len(self._result.t), n))
        return found.force_on(*found.sides.span(self.element.name))[:, 0, :n]

    def _effort(self, coordinate: str) -> np.ndarray:
        """Force [N] or torque [N m] along a coordinate while it is locked, else 0: where no events happen, too."""
        rows = [w.row for w in self._result.values.structure.switches if w.switch.label == coordinate]
        return self._result.multipliers[:, rows[0]] if rows else self._result.motions.zeros()

    @property
    def rotation(self) -> np.ndarray:
        """Rotation matrices, world from frame, (n, 3, 3)."""
        R = [x + self._result.motions.zeros() for x in self._moving[1]]  # in the plane some are plain numbers
        return np.stack(R, axis=1).reshape(-1, 3, 3)

    @property
    def quaternion(self) -> np.ndarray:
        """Unit quaternions, scalar first, (n, 4): of the sign of the one before; in the plane of half the angle."""
        if self._result.planar:
            half, zero = 0.5 * self.angle, self._result.motions.zeros()
            return np.stack([np.cos(half), zero, zero, np.sin(half)], axis=1)
        return same_sign(matrix_to_quaternion(self.rotation))

    @property
    def angle(self) -> np.ndarray:
        """Planar: orientation [rad], whole turns counted."""
        if not self._result.planar:
            raise AttributeError(self._unknown("angle"))
        return self._result.motions.angle(self._body) + atan2(self._turn[3], self._turn[0])

    @property
    def angular_velocity(self) -> np.ndarray:
        """Angular velocity, world axes [rad/s]; planar: one number a time."""
        return self._moving[2][2] if self._result.planar else np.stack(self._moving[2], axis=1)

    @property
    def angular_acceleration(self) -> np.ndarray:
        """Angular acceleration, world axes [rad/s^2]; planar: one number a time."""
        return self._record[4][2] if self._result.planar else np.stack(self._record[4], axis=1)
