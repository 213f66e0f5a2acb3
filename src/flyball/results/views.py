"""What a result says of one part: arrays over time, named, in SI units."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ..constraints import angle
from ..constraints.angle import unwrapped
from ..math.vec import add, cross, dot, mtv, scale, sub
from ..model.body import GROUND, Body, Driver, Frame
from ..model.force import BodyForce, Force, JointForce
from ..model.geometry import matrix_to_quaternion
from ..model.joint import Joint
from ..system.laws import evaluate
from ..system.rows import parameters
from ..system.tables import Q0
from .records import coordinate_frames, turned

if TYPE_CHECKING:
    from .result import Result


def stacked(a: tuple, planar: bool) -> np.ndarray:
    """(n, 2) or (n, 3) array from a tuple of components."""
    return np.stack(a[:2] if planar else a, axis=1)


class View:
    """One part of a result."""

    def __init__(self, result: Result, element: Any) -> None:
        self._result = result
        self.element = element
        self._x = result.values

    def channels(self) -> dict[str, tuple[str, np.ndarray]]:
        """Named curves of this part: name -> (unit, values)."""
        return {}

    def __repr__(self) -> str:
        return f"<{self.element.title}: {', '.join(self.channels())}>"


class PointView(View):
    """Motion of a frame: a body's reference frame or a named one."""

    def __init__(self, result: Result, element: Body | Frame) -> None:
        super().__init__(result, element)
        body = element.name if isinstance(element, Body) else element.body
        pose = self._x.poses
        p, R = pose.named(element.name)
        b = self._x.bodies[body]
        local, turn = b.R.T @ (p - b.c), b.R.T @ R
        self._body = -1 if body == GROUND else self._x.structure.place[body]
        self._record = result.records.carried(self._body, tuple(local), tuple(turn.ravel()))
        self._turn = turn

    @property
    def position(self) -> np.ndarray:
        """Position of its origin in the world [m], (n, 2) or (n, 3)."""
        return stacked(self._record[0], self._result.planar)

    @property
    def velocity(self) -> np.ndarray:
        """Velocity of its origin, world axes [m/s]."""
        return stacked(self._record[3], self._result.planar)

    @property
    def acceleration(self) -> np.ndarray:
        """Acceleration of its origin, world axes [m/s^2]."""
        return stacked(self._record[5], self._result.planar)

    @property
    def rotation(self) -> np.ndarray:
        """Rotation matrices, world from frame, (n, 3, 3)."""
        return np.stack(self._record[1], axis=1).reshape(-1, 3, 3)

    @property
    def quaternion(self) -> np.ndarray:
        """Unit quaternions, scalar first, (n, 4); neighbours have the same sign."""
        e = np.array([matrix_to_quaternion(R) for R in self.rotation])
        flips = np.cumprod(np.r_[1.0, np.where((e[1:] * e[:-1]).sum(axis=1) < 0, -1.0, 1.0)])
        return e * flips[:, None]

    @property
    def angle(self) -> np.ndarray:
        """Planar: orientation [rad], whole turns counted."""
        if not self._result.planar:
            raise AttributeError(f"{self.element.title} moves in space and has no single angle; use rotation")
        local = np.arctan2(self._turn[1, 0], self._turn[0, 0])
        if self._body < 0:
            return np.full(len(self._result.t), local)
        return self._result.q[:, self._x.system.body_i[self._body, Q0] + 2] + local

    @property
    def angular_velocity(self) -> np.ndarray:
        """Angular velocity, world axes [rad/s]; planar: one number a time."""
        return self._record[2][2] if self._result.planar else np.stack(self._record[2], axis=1)

    @property
    def angular_acceleration(self) -> np.ndarray:
        """Angular acceleration, world axes [rad/s^2]; planar: one number a time."""
        return self._record[4][2] if self._result.planar else np.stack(self._record[4], axis=1)

    def channels(self) -> dict[str, tuple[str, np.ndarray]]:
        """x, y, z, their derivatives, and the orientation."""
        axes = "xy" if self._result.planar else "xyz"
        out = {a: ("m", self.position[:, i]) for i, a in enumerate(axes)}
        if self._result.planar:
            out["angle"] = ("rad", self.angle)
        out |= {f"v{a}": ("m/s", self.velocity[:, i]) for i, a in enumerate(axes)}
        out |= {f"a{a}": ("m/s^2", self.acceleration[:, i]) for i, a in enumerate(axes)}
        if self._result.planar:
            return out | {"omega": ("rad/s", self.angular_velocity)}
        return out | {f"omega_{a}": ("rad/s", self.angular_velocity[:, i]) for i, a in enumerate(axes)}


class JointView(View):
    """Coordinates and reaction of a joint."""

    def _measure(self, what: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """A coordinate, its rate and its acceleration, through the row that measures it."""
        r, x = self._result.records, self._x
        (i, turn_i), (j, turn_j), c = coordinate_frames(x, self.element, what)
        F, M = turned(r.frame(i), turn_i), turned(r.frame(j), turn_j)
        value, f, tM, tF, second = self._formula(c.row.kind)((*c.row.par[:6], 0.0, 0.0), F, M)
        rate = dot(f, sub(M[3], F[3])) + dot(tM, M[2]) + dot(tF, F[2])
        offset = self.element.offset(x.numbers[self.element.name], what)
        value = c.sign * value + offset
        if c.row.kind == angle.KIND:
            value = unwrapped(value, self._turns(what, i, j, turn_i, turn_j, c.sign, offset))
        return value, c.sign * rate, c.sign * second

    def _turns(self, what: str, i: int, j: int, turn_i: Any, turn_j: Any, sign: float, offset: float) -> np.ndarray:
        """Something close to the angle that knows its whole turns."""
        name = f"{self.element.name}.{what}"
        s = self._x.structure
        if name in s.states:
            return sign * self._result.states[:, s.states.index(name)]
        psi = []
        for k in (i, j):
            b = int(self._x.system.frame_i[k])
            R = self._x.system.frame_x[k, 3:]
            psi.append(
                np.arctan2(R[3], R[0]) + (self._result.q[:, self._x.system.body_i[b, Q0] + 2] if b >= 0 else 0.0)
            )
        return psi[1] - psi[0] + offset

    def __getattr__(self, name: str) -> np.ndarray:
        """A coordinate by its name, with ``_rate`` and ``_acceleration`` behind it for its derivatives."""
        if name.startswith("_") or name == "element":  # asked for while it is being unpickled
            raise AttributeError(name)
        own = self.element.coordinates
        for ending, k in (("_rate", 1), ("_acceleration", 2)):
            if name.endswith(ending) and name.removesuffix(ending) in own:
                return self._measure(name.removesuffix(ending))[k]
            if name == ending[1:] and len(own) == 1:
                return self._measure(next(iter(own)))[k]
        if name in own:
            return self._measure(name)[0]
        has = ", ".join([*own, "force", "torque"])
        raise AttributeError(f"{self.element.title} has no {name!r}; it has {has}")

    def _wrench(self) -> tuple[tuple, tuple]:
        """Force on body_j at M's origin and torque about it, world components."""
        s, r = self._x.structure, self._result.records
        zero = np.zeros(r.n)
        force, torque = (zero,) * 3, (zero,) * 3
        rows = s.slices[self.element.name]
        for k, t in enumerate(s.terms):
            if rows.start <= t.row < rows.stop:
                lam = self._result.multipliers[:, t.row]
                par = parameters(self._x.system.term_x, k)
                _, f, tM, _, _ = self._formula(t.formula.kind)(par, r.frame(t.F), r.frame(t.M))
                force = add(force, scale(lam * par[7], f))
                torque = add(torque, scale(lam * par[7], tM))
        return force, torque

    @staticmethod
    def _formula(kind: int) -> Any:
        from ..constraints.blocks import FORMULAS

        return FORMULAS[kind]

    def reaction(self, *, axes: str = "world", on: str | None = None) -> tuple[np.ndarray, np.ndarray]:
        """Reaction force and torque of the joint.

        Parameters
        ----------
        axes : ``"world"``, ``"joint"`` or the name of one of the two bodies
            Axes of the components; ``"joint"`` are those of the joint's frame on ``body_i``.
        on : str
            Name of the body it acts on; ``body_j`` if not given.

        Returns
        -------
        force [N], torque [N m] : ndarray (n, 3)
            The torque is about the joint's point on ``body_j`` (for a two-point link: its second end).
        """
        e, s = self.element, self._x.structure
        force, torque = self._wrench()
        names = [s.model.carrier(name, e) for name in (e.body_i, e.body_j)]
        on = names[1] if on is None else on
        if on not in names:
            raise ValueError(f"{e.title} joins {names[0]!r} and {names[1]!r}, not {on!r}")
        if axes != "world":
            R = self._axes(axes, names)
            force, torque = mtv(R, force), mtv(R, torque)
        sign = 1.0 if on == names[1] else -1.0
        return sign * np.stack(force, axis=1), sign * np.stack(torque, axis=1)

    def _axes(self, axes: str, names: list[str]) -> tuple:
        records, x = self._result.records, self._x
        if axes == "joint":
            return records.frame(x.structure.frame_at[self.element.name, "F", ""])[1]
        if axes not in names:
            raise ValueError(f"axes must be 'world', 'joint', {names[0]!r} or {names[1]!r}, not {axes!r}")
        return (
            PointView(self._result, x.structure.model[axes])._record[1] if axes != GROUND else tuple(np.eye(3).ravel())
        )

    @property
    def force(self) -> np.ndarray:
        """Reaction force on ``body_j``, world axes [N], (n, 2) or (n, 3)."""
        return stacked(self._wrench()[0], self._result.planar)

    @property
    def torque(self) -> np.ndarray:
        """Reaction torque on ``body_j`` about the joint's point, world axes [N m]; planar: one number a time."""
        t = self._wrench()[1]
        return t[2] if self._result.planar else np.stack(t, axis=1)

    @property
    def undetermined(self) -> tuple[str, ...]:
        """Reaction components that redundancy leaves undetermined; of those one choice is given."""
        return self._result.health.undetermined.get(self.element.name, ())

    def channels(self) -> dict[str, tuple[str, np.ndarray]]:
        """Coordinates, their rates, reaction force and torque."""
        out: dict[str, tuple[str, np.ndarray]] = {}
        for what, c in self.element.coordinates.items():
            value, rate, _ = self._measure(what)
            out[what] = (c.unit, value)
            out["rate" if len(self.element.coordinates) == 1 else f"{what}_rate"] = (f"{c.unit}/s", rate)
        axes = "xy" if self._result.planar else "xyz"
        out |= {f"f{a}": ("N", self.force[:, i]) for i, a in enumerate(axes)}
        torque = np.atleast_2d(self.torque.T)
        names = ["torque"] if self._result.planar else [f"t{a}" for a in axes]
        return out | {k: ("N*m", torque[i]) for i, k in enumerate(names)}


class ForceView(View):
    """What a force element measures and does."""

    def _evaluated(self) -> tuple[tuple, tuple, tuple]:
        """(inputs, force on M, torque on M) over time."""
        e, x, r = self.element, self._x, self._result.records
        s, S = x.structure, x.system
        k = next(i for i, f in enumerate(s.forces) if f is e)
        F, M = r.frame(int(S.force_i[k, 0])), r.frame(int(S.force_i[k, 1]))
        par = parameters(S.force_x, k)
        turns = self._result.states[:, S.force_i[k, 6]] if S.force_i[k, 6] >= 0 else np.zeros(r.n)
        a, b = (np.broadcast_to(i, (r.n,)) for i in e.inputs(par, F, M, turns))
        laws = tuple(self._law(int(S.force_i[k, 2 + i]), a, b) for i in range(3))
        force, torque = e.wrench(par, F, M, laws, (a, b))
        self._frames = F, M, par, turns
        return (a, b), force, torque

    def _law(self, at: int, a: np.ndarray, b: np.ndarray) -> np.ndarray:
        if at < 0:
            return np.zeros(len(a))
        s, S = self._x.structure, self._x.system
        stack = np.zeros((s.depth + 1, 3))
        t = self._result.t
        # chief: sensed
        return np.array([evaluate(S.code, S.const, at, stack, (t[i], a[i], b[i]), stack) for i in range(len(t))])

    @property
    def wrench(self) -> tuple[np.ndarray, np.ndarray]:
        """Force [N] and torque [N m] on the second body (for a two-point force: at the second point), world axes."""
        _, force, torque = self._evaluated()
        n = len(self._result.t)
        return tuple(np.stack([np.broadcast_to(c, (n,)) for c in w], axis=1) for w in (force, torque))  # type: ignore[return-value]

    @property
    def energy(self) -> np.ndarray:
        """Potential energy stored in it [J]."""
        if self.element.energy is None:
            return np.zeros(len(self._result.t))
        self._evaluated()
        F, M, par, turns = self._frames
        return self.element.energy(par, F, M, turns)

    @property
    def power(self) -> np.ndarray:
        """Power that it gives to the bodies [W]."""
        _, force, torque = self._evaluated()
        F, M, _, _ = self._frames
        u = sub(sub(M[3], F[3]), cross(F[2], sub(M[0], F[0])))
        return dot(force, u) + dot(torque, sub(M[2], F[2]))

    @property
    def work(self) -> np.ndarray:
        """Work given to the bodies since the start [J], integrated with the motion."""
        name = f"{self.element.name}.work"
        states = self._x.structure.states
        if name in states:
            return self._result.states[:, states.index(name)]
        return self.energy[0] - self.energy

    def __getattr__(self, name: str) -> np.ndarray:
        """One of its outputs: length, rate and tension of a two-point force; angle, rate and torque about a joint."""
        if name.startswith("_") or name == "element":  # asked for while it is being unpickled
            raise AttributeError(name)
        if name not in self.element.outputs:
            has = ", ".join([*self.element.outputs, "wrench", "energy", "power", "work"])
            raise AttributeError(f"{self.element.title} has no {name!r}; it has {has}")
        (a, b), force, torque = self._evaluated()
        k = list(self.element.outputs).index(name)
        if k < 2:
            return (a, b)[k]
        F, M, _, _ = self._frames
        if isinstance(self.element, JointForce):
            return dot(torque, (F[1][2], F[1][5], F[1][8]))
        return -dot(force, sub(M[0], F[0])) / a

    def channels(self) -> dict[str, tuple[str, np.ndarray]]:
        """Its outputs; for a force on a body, its components."""
        if isinstance(self.element, BodyForce):
            force, torque = self.wrench
            out = {f"f{a}": ("N", force[:, i]) for i, a in enumerate("xyz")}
            out |= {f"t{a}": ("N*m", torque[:, i]) for i, a in enumerate("xyz")}
            return {k: v for k, v in out.items() if v[1].any()}
        return {k: (unit, getattr(self, k)) for k, unit in self.element.outputs.items()}


class DriverView(View):
    """What a driver has to do."""

    @property
    def effort(self) -> np.ndarray:
        """Force [N] or torque [N m] along its coordinate."""
        return self._result.multipliers[:, self._x.structure.slices[self.element.name].start]

    @property
    def work(self) -> np.ndarray:
        """Work given to the mechanism since the start [J]."""
        return self._result.states[:, self._x.structure.states.index(f"{self.element.name}.work")]

    def channels(self) -> dict[str, tuple[str, np.ndarray]]:
        """Effort and work."""
        unit = self._x.structure.model.unit(self.element.coordinate, self.element)
        return {"effort": ("N*m" if unit == "rad" else "N", self.effort), "work": ("J", self.work)}


VIEWS = ((Body, PointView), (Frame, PointView), (Joint, JointView), (Force, ForceView), (Driver, DriverView))


def view(result: Result, element: Any) -> View:
    """The view of a part."""
    return next(cls for kind, cls in VIEWS if isinstance(element, kind))(result, element)
