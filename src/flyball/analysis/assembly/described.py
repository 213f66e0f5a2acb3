"""Velocities that the description gives: those of the state, and how far a state is from them.

A body may be told the velocity of its reference frame's origin, its angular velocity, both or neither, along world
axes. What it is not told is free, and has the least kinetic energy.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ...math.vec import cross
from ...model.geometry import quaternion_to_matrix, rotation_about
from ...results.departure import FAST, Departure
from ...tables.system import POINT
from ...tables.values import Values
from ..compiled import Compiled

KEPT = 1e-6  # part of a velocity by which it may differ from the given one, near singular positions, and is still kept
STILL = 1e-9  # part of the mechanism's largest velocity that is none


@dataclass(frozen=True)
class Given:
    """A body that is told how it moves."""

    name: str
    at: int  # its first velocity
    shifts: int  # how many of its velocities are translations
    turns: int  # and how many are not
    origin: bool  # whether the velocity of its reference frame's origin is given
    turning: bool  # whether its angular velocity is
    as_drawn: bool

    @property
    def whole(self) -> bool:
        """Whether nothing of it is free."""
        return self.origin and (self.turning or not self.turns)

    @property
    def n(self) -> int:
        """How many velocities it has."""
        return self.shifts + self.turns

    @property
    def planar(self) -> bool:
        """Whether it moves in the plane."""
        return self.shifts == 2


def given(x: Values) -> list[Given]:
    """Bodies that are told how they move; of a mechanism in absolute coordinates."""
    return [g for g in _all_bodies(x) if g.origin or g.turning]


def _all_bodies(x: Values) -> list[Given]:
    """All bodies, with what is given of each."""
    out = []
    shifts = 2 if x.structure.model.planar else 3
    for b in x.structure.model.bodies:
        origin, turning = b.velocity is not None, b.angular_velocity is not None
        if (at := x.structure.place[b.name]) < 0:
            continue
        v0, nv = int(x.system.tree.v[at]), int(x.system.tree.nv[at])
        out.append(Given(b.name, v0, shifts, nv - shifts, origin, turning, b.as_drawn))
    return out


def described(x: Values, q: np.ndarray) -> np.ndarray:
    """Velocities (nv,) of bodies alone at the pose q: those of the least kinetic energy that are as described.

    Steps of least kinetic energy from here on to the constraints lead to the least of all.
    """
    v = np.zeros(x.structure.nv, np.result_type(x.v, q))
    for g in given(x):
        v[g.at : g.at + g.n] = _own(x, g, q)
    return v


def _own(x: Values, g: Given, q: np.ndarray) -> list[Any]:
    """Velocities of one body as described: the mass centre of one that is told its turn only rests."""
    d, R = x.bodies[g.name], rotation(x, g.name, q)
    if not g.turns:
        return list(_origin(d)[: g.shifts])
    w = d.w if g.turning else R @ _blow(x, g, R.T @ _origin(d))
    u = _origin(d) + _cross(w, R @ d.com) if g.origin else np.zeros(3)
    return [u[0], u[1], w[2]] if g.planar else [*u, *(R.T @ w)]


def _blow(x: Values, g: Given, u: np.ndarray) -> np.ndarray:
    """The turn that a blow at a body's origin gives it besides the velocity u of that origin, all in its axes.

    The turn w of least m |u + w x c|^2 + w J w. Missing inertias have stand-ins.
    """
    d, table, b = x.bodies[g.name], x.system.bodies, x.structure.place[g.name]
    J = (table.inertia[b] + table.excess_inertia[b]).reshape(3, 3)
    about = J + d.mass * ((d.com @ d.com) * np.eye(3) - np.outer(d.com, d.com))
    moment = d.mass * _cross(u, d.com)
    return np.array([0.0, 0.0, moment[2] / about[2, 2]]) if g.planar else np.linalg.solve(about, moment)


def _cross(a: Any, b: Any) -> np.ndarray:
    """Cross product; NumPy's own takes ten times as long."""
    return np.array(cross(a, b))


def _origin(d: Any) -> np.ndarray:
    """Velocity of the reference frame's origin, as described."""
    return d.v - _cross(d.w, d.R @ d.com)


def rotation(x: Values, name: str, q: np.ndarray) -> np.ndarray:
    """Rotation of a body at q; to the bit as it is drawn where it was not turned."""
    b = x.structure.place[name]
    if x.system.tree.joint[b] == POINT:
        return x.bodies[name].R
    at = int(x.system.tree.q[b])
    here = q[at + 2 : at + 3] if x.structure.model.planar else q[at + 3 : at + 7]
    drawn = x.q[at + 2 : at + 3] if x.structure.model.planar else x.q[at + 3 : at + 7]
    if np.array_equal(here, drawn):
        return x.bodies[name].R
    return rotation_about(2, here[0]) if x.structure.model.planar else quaternion_to_matrix(here)


def deviation(x: Values, g: Given, q: np.ndarray, v: np.ndarray) -> np.ndarray:
    """What a body's velocities have beyond those it is told: of its mass centre and the turn where both are given.

    Else of its reference frame's origin along world axes, or of the turn (of a spatial body along its own axes).
    """
    d, R = x.bodies[g.name], rotation(x, g.name, q)
    own = v[g.at : g.at + g.n]
    if g.whole:
        return own - np.array(_own(x, g, q))
    if g.origin:
        w = np.array([0.0, 0.0, own[2]]) if g.planar else R @ own[3:]
        moved = np.r_[own[:2], 0.0] if g.planar else own[:3]
        return (moved - _cross(w, R @ d.com) - _origin(d))[: g.shifts]
    return own[2:] - d.w[2:] if g.planar else own[3:] - R.T @ d.w


def gradient(x: Values, g: Given, q: np.ndarray) -> np.ndarray:
    """Derivatives of `deviation` by the body's own velocities."""
    if g.whole:
        return np.eye(g.n)
    if g.turning:
        return np.eye(g.n)[g.shifts :]
    d, R = x.bodies[g.name], rotation(x, g.name, q)
    a = R @ d.com
    if g.planar:
        return np.array([[1.0, 0.0, a[1]], [0.0, 1.0, -a[0]]])
    return np.hstack([np.eye(3), np.array([_cross(a, k) for k in R.T]).T])


def _motion(x: Values, g: Given, q: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Velocity of the origin of a body's reference frame, and its angular velocity, along world axes; of three each."""
    d, R = x.bodies[g.name], rotation(x, g.name, q)
    own = v[g.at : g.at + g.n]
    w = np.zeros(3) if not g.turns else np.array([0.0, 0.0, own[2]]) if g.planar else R @ own[3:]
    return (np.r_[own[:2], 0.0] if g.planar else own[:3]) - _cross(w, R @ d.com), w


def not_kept(c: Compiled, q: np.ndarray, v: np.ndarray) -> list[Departure]:
    """Given velocities that the state (q, v) does not have."""
    x, out = c.values, []
    told, largest = given(x), float(np.abs(v / c.sizes).max(initial=0.0)) * x.length
    for g in told:
        d = x.bodies[g.name]
        u, w = _motion(x, g, q, v)
        pairs = [("velocity", _origin(d)[: g.shifts], u[: g.shifts], "m/s", 1.0)] if g.origin else []
        turns = slice(2, 3) if g.planar else slice(0, 3)
        pairs += [("angular_velocity", d.w[turns], w[turns], "rad/s", x.length)] if g.turning else []
        for what, wanted, got, unit, size in pairs:
            apart = np.abs(got - wanted).max()
            own_size = max(np.abs(wanted).max(), np.abs(got).max())
            if apart > KEPT * own_size and apart * size > STILL * max(largest, size * np.abs(wanted).max()):
                out.append(Departure(g.name, what, tuple(wanted.tolist()), tuple(got.tolist()), unit))
    return out


def fast(c: Compiled, q: np.ndarray, v: np.ndarray, rates: np.ndarray) -> list[Departure]:
    """Velocities that are not given and are far above all that are: what was given asks for them, or comes near to it.

    Near a dead centre, for instance. ``rates``: those that drivers and initial conditions prescribe, in 1/s. Turning is
    compared with velocities through the mechanism's length.
    """
    x = c.values
    told = given(x)
    if not told:
        return []
    drawn = [x.bodies[g.name] for g in told]
    speeds = [float(np.linalg.norm(y)) for d in drawn for y in (_origin(d) / x.length, d.w)]
    limit = FAST * max(*speeds, float(np.abs(rates).max(initial=0.0)))
    out = []
    for g in _all_bodies(x):
        u, w = _motion(x, g, q, v)
        turns = slice(2, 3) if g.planar else slice(0, 3)
        if not g.turning and np.linalg.norm(w) > limit:
            out.append(Departure(g.name, "angular_velocity", (), tuple(w[turns].tolist()), "rad/s"))
        elif not g.origin and np.linalg.norm(u) > limit * x.length:
            out.append(Departure(g.name, "velocity", (), tuple(u[: g.shifts].tolist()), "m/s"))
    return out
