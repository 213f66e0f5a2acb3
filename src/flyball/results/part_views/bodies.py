"""Motion of bodies, named frames, sets of bodies and their members.

A set of many bodies has one array for each quantity, times along axis 0, bodies along axis 1.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from ...math.scalar import atan2
from ...math.vec import mtv, mv, quaternion_matrix
from ...model.body import Body, Frame
from ...model.geometry import matrix_to_quaternion
from ...model.joint import ORIENTATION_ANGLES
from ...model.quantities import Quantity, quantities
from ..motion_record import KinematicRecord, measured_coordinate
from .base import NamedQuantities, PartView, components_array, continuous_quaternions

if TYPE_CHECKING:
    from ..result import Result


class FrameView(PartView):
    """Motion of a frame: a body's reference frame or a named one."""

    instead: ClassVar = {"angle": "a body in space has no single angle: use roll, pitch, yaw, rotation or quaternion"}

    def __init__(self, result: Result, element: Body | Frame) -> None:
        super().__init__(result, element)
        self._placed = self._body, _, self._turn = result.motions.placed(element.name)

    @cached_property
    def _moving(self) -> KinematicRecord:
        """Return its record without accelerations."""
        return self._result.motions.attached(*self._placed)

    @cached_property
    def _record(self) -> KinematicRecord:
        return self._result.records.attached(*self._placed)

    @property
    def position(self) -> np.ndarray:
        """Position of its origin in the world [m], (n, 2) or (n, 3)."""
        return components_array(self._moving[0], self._result.planar)

    @property
    def velocity(self) -> np.ndarray:
        """Velocity of its origin, world axes [m/s]."""
        return components_array(self._moving[3], self._result.planar)

    @property
    def acceleration(self) -> np.ndarray:
        """Acceleration of its origin, world axes [m/s^2]."""
        return components_array(self._record[5], self._result.planar)

    def _found(self, name: str) -> np.ndarray:
        """Return the effort of a locked coordinate, an angle of orientation, or a body's contact force."""
        if name.endswith("_effort"):
            return self.lock_effort(name.removesuffix("_effort"))
        if (angle := name.removesuffix("_rate")) in ORIENTATION_ANGLES:
            return self._orientation_angle(angle)[int(angle != name)]
        found, n = self._result.contacts, 2 if self._result.planar else 3
        if found is None or self.element.name not in found.sides.names:
            return np.zeros((len(self._result.t), n))
        return found.force_on(*found.sides.span(self.element.name))[:, 0, :n]

    def _orientation_angle(self, what: str) -> tuple[np.ndarray, np.ndarray]:
        """Return roll, pitch or yaw [rad] and its rate [rad/s]; whole turns as laws count them, if any names it."""
        at = self._x.structure.state_at.get(f"{self.element.name}.{what}")
        turns = None if at is None else self._result.states[:, at]
        return measured_coordinate(self._result.motions, self.element, what, turns)[:2]

    @property
    def rotation(self) -> np.ndarray:
        """Rotation matrices, world from frame, (n, 3, 3)."""
        R = [x + self._result.motions.zeros() for x in self._moving[1]]  # in the plane some are scalars
        return np.stack(R, axis=1).reshape(-1, 3, 3)

    @property
    def quaternion(self) -> np.ndarray:
        """Unit quaternions, scalar first, (n, 4), continuous in sign; in the plane by half the angle."""
        if self._result.planar:
            half, zero = 0.5 * self.angle, self._result.motions.zeros()
            return np.stack([np.cos(half), zero, zero, np.sin(half)], axis=1)
        return continuous_quaternions(matrix_to_quaternion(self.rotation))

    @property
    def angle(self) -> np.ndarray:
        """Planar: orientation [rad], with full turns."""
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


class BodySetView(NamedQuantities):
    """Motion of a whole set: arrays (n, m, ...), times first, bodies second."""

    def __init__(self, result: Result, bulk: BodySetMotion) -> None:
        self._result, self._bulk = result, bulk
        self._axes = 2 if result.planar else 3

    @property
    def title(self) -> str:
        """Title for messages."""
        return f"set of bodies {self._bulk.name!r}"

    @cached_property
    def names(self) -> dict[str, Quantity]:
        """All its quantities, by name."""
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
        """Planar: orientations [rad], (n, m), full turns counted from the start as far as output times resolve them."""
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


class SetMemberView(BodySetView):
    """Motion of one member of a set."""

    def __init__(self, result: Result, bulk: BodySetMotion, k: int) -> None:
        super().__init__(result, bulk)
        self._k = k

    @property
    def title(self) -> str:
        """Title for messages."""
        return f"body '{self._bulk.name}[{self._k}]'"

    @cached_property
    def names(self) -> dict[str, Quantity]:
        """All its quantities, by name."""
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
        """Unit quaternions, scalar first, world from body, (n, 4), continuous in sign."""
        return continuous_quaternions(self._bulk.quaternion[:, self._k])

    @property
    def rotation(self) -> np.ndarray:
        """Rotation matrices, world from body, (n, 3, 3)."""
        return np.stack(quaternion_matrix(*self.quaternion.T), axis=1).reshape(-1, 3, 3)

    @property
    def angle(self) -> np.ndarray:
        """Planar: orientation [rad], (n,), full turns counted from the start as far as output times resolve them."""
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


SET_MOTION_ARRAYS = {"position": 3, "quaternion": 4, "velocity": 3, "angular_velocity": 3}  # over time
SET_MEMBER_ARRAYS = {"mass": (), "inertia": (3, 3), "com": (3,)}  # of each body


@dataclass(frozen=True, eq=False)
class BodySetMotion:
    """Motion of the mass centres and rotations of the reference frames of a set of bodies.

    Attributes
    ----------
    name : str
        Name of the set; its members are ``name[0]``, ``name[1]``, ...
    mass : ndarray (m,) [kg]
    inertia : ndarray (m, 3, 3) [kg m^2]
        About each mass centre, along the axes of the reference frame.
    com : ndarray (m, 3) [m]
        Mass centre of each in its reference frame.
    position : ndarray (n, m, 3) [m]
        Of the mass centres.
    quaternion : ndarray (n, m, 4)
        Scalar first, world from body.
    velocity : ndarray (n, m, 3) [m/s]
        Of the mass centres.
    angular_velocity : ndarray (n, m, 3) [rad/s]
        World axes.
    """

    name: str
    mass: np.ndarray
    inertia: np.ndarray
    com: np.ndarray
    position: np.ndarray
    quaternion: np.ndarray
    velocity: np.ndarray
    angular_velocity: np.ndarray

    def __post_init__(self) -> None:
        """Refuse arrays that do not fit together."""
        n, m = np.shape(self.position)[:2]
        wanted = {k: (n, m, w) for k, w in SET_MOTION_ARRAYS.items()} | {
            k: (m, *w) for k, w in SET_MEMBER_ARRAYS.items()
        }
        for k, shape in wanted.items():
            if np.shape(getattr(self, k)) != shape:
                raise ValueError(f"set {self.name!r}: {k} must have shape {shape}, got {np.shape(getattr(self, k))}")

    def __len__(self) -> int:
        return len(self.mass)

    @cached_property
    def rotation(self) -> tuple:
        """Rotation matrices, world from body, as nine arrays (n, m)."""
        return quaternion_matrix(*_component_arrays(self.quaternion))

    @cached_property
    def _arm(self) -> np.ndarray:
        """From each reference frame's origin to the mass centre, world axes [m]."""
        com = tuple(np.broadcast_to(self.com[:, c], self.position.shape[:2]) for c in range(3))
        return np.stack(mv(self.rotation, com), axis=2)

    @property
    def origin(self) -> np.ndarray:
        """Origins of the reference frames [m], (n, m, 3)."""
        return self.position - self._arm if self.com.any() else self.position

    @property
    def origin_velocity(self) -> np.ndarray:
        """Velocities of the reference frames' origins [m/s], (n, m, 3)."""
        return self.velocity - np.cross(self.angular_velocity, self._arm) if self.com.any() else self.velocity

    @property
    def kinetic(self) -> np.ndarray:
        """Sum of m v^2 / 2 + w . I w / 2 over the set [J], (n,)."""
        total = 0.5 * np.einsum("tmi,tmi->tm", self.velocity, self.velocity) @ self.mass
        w = self.angular_velocity
        ball = self.inertia[:, 0, 0]
        if not np.array_equal(self.inertia, ball[:, None, None] * np.eye(3)):  # otherwise no axes are needed
            w = np.stack(mtv(self.rotation, _component_arrays(w)), axis=2)
        return total + 0.5 * np.einsum("tmi,mij,tmj->t", w, self.inertia, w)

    def potential(self, gravity: np.ndarray) -> np.ndarray:
        """Return the energy of gravity [J], zero if every mass centre is at the world's origin, (n,)."""
        return -np.einsum("tmi,i,m->t", self.position, np.asarray(gravity, float), self.mass)

    def at_times(self, rows: slice) -> BodySetMotion:
        """Return the motion at some of its times."""
        return replace(self, **{k: getattr(self, k)[rows] for k in SET_MOTION_ARRAYS})  # type: ignore[arg-type]

    def as_dict(self) -> dict[str, Any]:
        """Plain lists."""
        return {k: getattr(self, k).tolist() for k in (*SET_MOTION_ARRAYS, *SET_MEMBER_ARRAYS)}

    def __repr__(self) -> str:
        return f"<{len(self)} bodies {self.name!r} over {len(self.position)} times>"


def _component_arrays(a: np.ndarray) -> tuple[np.ndarray, ...]:
    return tuple(np.moveaxis(a, -1, 0))


def join_in_time(motions: Sequence[BodySetMotion]) -> BodySetMotion:
    """Return the motions of one set, one after the other, as one."""
    arrays = {k: np.concatenate([getattr(m, k) for m in motions]) for k in SET_MOTION_ARRAYS}
    return replace(motions[0], **arrays)  # type: ignore[arg-type]
