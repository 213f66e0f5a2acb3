"""Motion of sets of bodies and of their members."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from ...math.vec import quaternion_matrix
from ...model.quantities import Quantity, quantities
from .base import Named, same_sign

if TYPE_CHECKING:
    from ..bulk import Bulk
    from ..result import Result


class SetView(Named):
    """Motion of a whole set: arrays (n, m, ...), times first, bodies second."""

    def __init__(self, result: Result, bulk: Bulk) -> None:
        self._result, self._bulk = result, bulk
        self._axes = 2 if result.planar else 3

    @property
    def title(self) -> str:
        """What it is called."""
        return f"set of bodies {self._bulk.name!r}"

    @cached_property
    def names(self) -> dict[str, Quantity]:
        """Everything that the result says of it, by name."""
        return quantities(self._result.model, self._bulk.name)

    def __len__(self) -> int:
        return len(self._bulk)

    @property
    def position(self) -> np.ndarray:
        """Of the reference frames' origins in the world [m], (n, m, 3) or (n, m, 2)."""
        return self._bulk.origin[:, :, : self._axes]

    @property
    def velocity(self) -> np.ndarray:
        """Of the reference frames' origins [m/s], world axes."""
        return self._bulk.origin_velocity[:, :, : self._axes]

    @property
    def quaternion(self) -> np.ndarray:
        """Unit quaternions, scalar first, world from body, (n, m, 4)."""
        return self._bulk.quaternion

    @property
    def angle(self) -> np.ndarray:
        """Planar: orientations [rad], (n, m), whole turns counted from the start as far as outputs tell."""
        if not self._result.planar:
            raise AttributeError(self._unknown("angle"))
        half = np.arctan2(self._bulk.quaternion[:, :, 3], self._bulk.quaternion[:, :, 0])
        return 2.0 * np.unwrap(half, axis=0, period=np.pi)

    @property
    def angular_velocity(self) -> np.ndarray:
        """Angular velocities, world axes [rad/s], (n, m, 3); planar: (n, m)."""
        w = self._bulk.angular_velocity
        return w[:, :, 2] if self._result.planar else w

    @cached_property
    def contact_force(self) -> np.ndarray:
        """Sum of the contact forces on each [N], world axes, (n, m, 3) or (n, m, 2)."""
        found = self._result.contacts
        if found is None:
            return np.zeros((len(self._result.t), len(self), self._axes))
        return found.force_on(*found.sides.span(self._bulk.name))[:, :, : self._axes]

    def __repr__(self) -> str:
        return f"<{len(self)} bodies {self._bulk.name!r} over {len(self._result.t)} times: {', '.join(self.names)}>"


class MemberView(SetView):
    """Motion of one member of a set."""

    def __init__(self, result: Result, bulk: Bulk, k: int) -> None:
        super().__init__(result, bulk)
        self._k = k

    @property
    def title(self) -> str:
        """What it is called."""
        return f"body '{self._bulk.name}[{self._k}]'"

    @cached_property
    def names(self) -> dict[str, Quantity]:
        """Everything that the result says of it, by name."""
        return quantities(self._result.model, f"{self._bulk.name}[{self._k}]")

    def __len__(self) -> int:
        return len(self._result.t)

    @property
    def position(self) -> np.ndarray:
        """Of the reference frame's origin in the world [m], (n, 3) or (n, 2)."""
        return super().position[:, self._k]

    @property
    def velocity(self) -> np.ndarray:
        """Of the reference frame's origin [m/s], world axes."""
        return super().velocity[:, self._k]

    @property
    def quaternion(self) -> np.ndarray:
        """Unit quaternions, scalar first, world from body, (n, 4); neighbours have the same sign."""
        return same_sign(self._bulk.quaternion[:, self._k])

    @property
    def rotation(self) -> np.ndarray:
        """Rotation matrices, world from body, (n, 3, 3)."""
        return np.stack(quaternion_matrix(*self.quaternion.T), axis=1).reshape(-1, 3, 3)

    @property
    def angle(self) -> np.ndarray:
        """Planar: orientation [rad], (n,), whole turns counted from the start as far as outputs tell."""
        return super().angle[:, self._k]

    @property
    def angular_velocity(self) -> np.ndarray:
        """Angular velocity, world axes [rad/s]; planar: one number a time."""
        return super().angular_velocity[:, self._k]

    @cached_property
    def contact_force(self) -> np.ndarray:
        """Sum of the contact forces on it [N], world axes, (n, 3) or (n, 2)."""
        found = self._result.contacts
        if found is None:
            return np.zeros((len(self), self._axes))
        low = found.sides.span(self._bulk.name)[0] + self._k
        return found.force_on(low, low + 1)[:, 0, : self._axes]

    def __repr__(self) -> str:
        return f"<{self.title} over {len(self)} times: {', '.join(self.names)}>"
