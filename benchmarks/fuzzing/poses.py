"""What a result says of poses and velocities, as NumPy arrays in space; everything else is worked out from these."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np

import flyball as fb

from .changes import matrix

Array = np.ndarray
Z = np.array([0.0, 0.0, 1.0])


def spatial(v: Any) -> Array:
    """Vectors of the plane as vectors of space."""
    v = np.asarray(v, float)
    return v if v.shape[-1] == 3 else np.concatenate([v, np.zeros((*v.shape[:-1], 1))], axis=-1)


class Motion:
    """Poses, velocities, accelerations of reference frames over time; ground is a body at rest."""

    def __init__(self, run: fb.Result, m: fb.Mechanism) -> None:
        self.run, self.m, self.t = run, m, np.asarray(run.t)
        self.n = len(self.t)
        self.drawn: dict[str, tuple[Array, Array]] = {"ground": (np.zeros(3), np.eye(3))}
        for b in m.bodies:
            R = matrix(b.orientation)
            if m.planar:
                c, s = np.cos(b.angle), np.sin(b.angle)
                R = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1.0]])
            self.drawn[b.name] = spatial(b.position[:2] if m.planar else b.position), R
        self._known: dict[tuple[str, str], Array] = {}

    def of(self, body: str, what: str) -> Array:
        """position, rotation, velocity, angular_velocity, acceleration, angular_acceleration."""
        if (body, what) not in self._known:
            self._known[body, what] = self._read(body, what)
        return self._known[body, what]

    def _read(self, body: str, what: str) -> Array:
        if body == "ground":
            return np.broadcast_to(np.eye(3), (self.n, 3, 3)) if what == "rotation" else np.zeros((self.n, 3))
        v = np.asarray(getattr(self.run[body], what), float)
        if what == "rotation":
            return v
        if what.startswith("angular") and self.m.planar:
            return v[:, None] * Z
        return spatial(v)

    def local(self, body: str, point: Any) -> Array:
        """A point of the drawn configuration, along a body's axes."""
        p, R = self.drawn[body]
        return R.T @ (spatial(point) - p)

    def direction(self, body: str, d: Any) -> Array:
        """A direction of the drawn configuration that is fixed on a body, over time."""
        d = spatial(d)
        return self.of(body, "rotation") @ (self.drawn[body][1].T @ (d / np.linalg.norm(d)))

    def arm(self, body: str, point: Any) -> Array:
        return self.of(body, "rotation") @ self.local(body, point)

    def point(self, body: str, point: Any) -> Array:
        """A point of the drawn configuration that is fixed on a body, over time."""
        return self.of(body, "position") + self.arm(body, point)

    def speed(self, body: str, point: Any) -> Array:
        return self.of(body, "velocity") + np.cross(self.of(body, "angular_velocity"), self.arm(body, point))

    def centre(self, body: fb.Body) -> Array:
        """Of mass, along the body's axes."""
        return np.zeros(3) if body.com is None else spatial(body.com[:2] if self.m.planar else body.com)

    @cached_property
    def masses(self) -> dict[str, tuple[float, Array]]:
        """Mass, and inertia about the mass centre along the body's axes, of bodies that say both as numbers."""
        out = {}
        for b in self.m.bodies:
            told = self.run.model[b.name]
            if (
                told.mass is None
                or told.inertia is None
                or told.inertia_about is not None
                or told.inertia_axes is not None
            ):
                continue
            i = np.asarray(told.inertia, float)
            tensor = np.diag([0.0, 0.0, float(i)]) if i.ndim == 0 else np.diag(i) if i.ndim == 1 else i
            out[b.name] = float(told.mass), tensor
        return out

    def at_centre(self, body: str) -> tuple[Array, Array, Array]:
        """Position, velocity and acceleration of the mass centre."""
        R, w, a = (self.of(body, k) for k in ("rotation", "angular_velocity", "angular_acceleration"))
        arm = R @ self.centre(self.m[body])
        swing = np.cross(w, arm)
        return (
            self.of(body, "position") + arm,
            self.of(body, "velocity") + swing,
            self.of(body, "acceleration") + np.cross(a, arm) + np.cross(w, swing),
        )

    def kinetic(self) -> Array:
        total = np.zeros(self.n)
        for name, (mass, inertia) in self.masses.items():
            v = self.at_centre(name)[1]
            w = np.einsum("nji,nj->ni", self.of(name, "rotation"), self.of(name, "angular_velocity"))
            total += 0.5 * mass * np.einsum("ni,ni->n", v, v) + 0.5 * np.einsum("ni,ij,nj->n", w, inertia, w)
        return total

    def gravity(self) -> Array:
        """Potential energy of weight."""
        g = spatial(np.asarray(self.m.gravity, float))
        total = np.zeros(self.n)
        for name, (mass, _) in self.masses.items():
            total -= mass * self.at_centre(name)[0] @ g
        return total

    def momentum(self) -> tuple[Array, Array]:
        """Linear, and angular about the world's origin."""
        P, L = np.zeros((self.n, 3)), np.zeros((self.n, 3))
        for name, (mass, inertia) in self.masses.items():
            x, v, _ = self.at_centre(name)
            R, w = self.of(name, "rotation"), self.of(name, "angular_velocity")
            P += mass * v
            L += np.cross(x, mass * v) + np.einsum("nij,jk,nlk,nl->ni", R, inertia, R, w)
        return P, L


class Uncounted(KeyError):
    """Outputs are too far apart to count turns by."""


def turn(motion: Motion, i: str, j: str, axis: Any) -> Array:
    """Angle by which j has turned relative to i about an axis since the drawn configuration, turns counted."""
    a = spatial(axis) / np.linalg.norm(spatial(axis))
    side = np.cross(a, np.eye(3)[np.argmin(np.abs(a))])
    side /= np.linalg.norm(side)
    on_i, on_j = motion.direction(i, side), motion.direction(j, side)
    other = np.cross(motion.direction(i, a), on_i)
    raw = np.arctan2(np.einsum("ni,ni->n", on_j, other), np.einsum("ni,ni->n", on_j, on_i))
    w = np.einsum(
        "ni,ni->n", motion.of(j, "angular_velocity") - motion.of(i, "angular_velocity"), motion.direction(i, a)
    )
    if (np.maximum(np.abs(w[1:]), np.abs(w[:-1])) * np.diff(motion.t)).max(initial=0.0) > 1.5:
        raise Uncounted(f"{i} and {j}")
    return _unwrapped(raw, w, motion.t)


def _unwrapped(raw: Array, rate: Array, t: Array) -> Array:
    """Whole turns by the mean speed between outputs, so that fast turns between outputs count."""
    out = raw.copy()
    for k in range(1, len(raw)):
        guess = out[k - 1] + 0.5 * (rate[k - 1] + rate[k]) * (t[k] - t[k - 1])
        out[k] = raw[k] + 2 * np.pi * np.round((guess - raw[k]) / (2 * np.pi))
    return out
