"""Motion of a set of many bodies: one array for each quantity, times along axis 0, bodies along axis 1."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from ..math.vec import mtv, mv, quaternion_matrix

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
