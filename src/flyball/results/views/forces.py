"""What force elements measure and do."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...constraints.modes import BY_RATE
from ...equations.loads import at_rest, power, wide
from ...errors import AnalysisError
from ...laws.call import STACK_RESERVE
from ...laws.evaluation import evaluate
from ...laws.over_time import over_time, takes_arrays
from ...math.scalar import divide, sign, unless_zero
from ...math.vec import dot, norm, sub
from ...model.force import CoordinateForce, JointForce
from ...tables.system import FORCE_F, FORCE_LAW, FORCE_LOAD, FORCE_M, FORCE_SWITCH, HELD, SPARE
from ..booked import basis
from ..records import coordinate_frames, turned
from .base import Curves, View


class ForceView(View):
    """What a force element measures and does."""

    def _index(self) -> int:
        return next(i for i, f in enumerate(self._x.structure.forces) if f is self.element)

    def _between(self) -> tuple[tuple, tuple, tuple]:
        """(inputs, force on M, torque on M) over time, of a force between frames."""
        e, S = self.element, self._x.system
        k = self._index()
        F, M, par = self._frames
        a, b = (np.broadcast_to(i, (self._result.motions.n,)) for i in e.inputs(par, F, M))
        laws = tuple(self._law(int(S.force_i[k, FORCE_LAW + i]), a, b) for i in range(3))
        force, torque = e.wrench(par, F, M, laws, (a, b))
        return (a, b), force, torque

    @property
    def _frames(self) -> tuple[tuple, tuple, Any]:
        """Records of F and M over time, and its numbers, of a force between frames."""
        r, S = self._result.motions, self._x.system
        k = self._index()
        F, M = (r.frame(int(S.force_i[k, side])) for side in (FORCE_F, FORCE_M))
        return F, M, wide(S.force_x, k)

    def acts(self) -> tuple[tuple[int, int], tuple, tuple, tuple]:
        """Of a force between frames: bodies of F and M, point, force and torque there on M's body over time."""
        S = self._x.system
        _, force, torque = self._between()
        k = self._index()
        i, j = (int(S.frame_i[int(S.force_i[k, side])]) for side in (FORCE_F, FORCE_M))
        return (i, j), self._frames[1][0], force, torque

    def pushes(self) -> tuple[int, np.ndarray]:
        """Of a force along a measured quantity: number of that, and its effort along it over time; without its row."""
        return int(self._x.system.force_i[self._index(), FORCE_F]), self._along()[2]

    def _along(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """(value, rate, effort) over time, of a force along a measured quantity."""
        e, S = self.element, self._x.system
        k = self._index()
        x, rate = self._result.measured.quantity(int(S.force_i[k, FORCE_F]))
        laws = (self._law(int(S.force_i[k, FORCE_LAW]), x, rate), 0.0 * x, self._way(k, rate))
        load = 0.0 * x
        if S.force_i[k, FORCE_LOAD] >= 0:
            force, torque = self._result.reactions.of(e.joint)
            load = e.load(wide(S.force_x, k), self._result.motions.frame(int(S.force_i[k, FORCE_M])), force, torque)
        return x, rate, e.effort(wide(S.force_x, k), x, rate, laws, load) + 0.0 * x

    def _way(self, k: int, rate: np.ndarray) -> np.ndarray:
        """Which way it slides: as its switch said then; where there is none by the sign of the rate."""
        s = int(self._x.system.force_i[k, FORCE_SWITCH])
        stretches = self._result.stretches
        if s < 0 or stretches is None:
            return sign(rate)
        by_rate = np.where(np.abs(rate) > at_rest(self._x.system), sign(rate), 0.0)
        return np.where(stretches.sigma[s] == BY_RATE, by_rate, stretches.sigma[s] + 0.0 * rate)

    def _rows(self) -> list[int]:
        """Its switches, by number."""
        return [k for k, x in enumerate(self._x.structure.switches) if x.element is self.element and x.row >= 0]

    def _whole_along(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """(value, rate, effort, side that is closed): with what its rows carry while they hold.

        What is rigid and has no row, since the motion was not computed with any, has efforts that nothing tells: nan.
        """
        s, own = self._x.structure, self._rows()
        if any(f is self.element for f in s.forces):
            x, rate, effort = self._along()
        elif own:
            x, rate = self._result.measured.quantity(s.switches[own[0]].measured)
            effort = 0.0 * x
        else:
            e = self.element
            m = s.measured.get(e.coordinate_text() or f"{e.name}:length")
            nothing = self._result.motions.zeros() + np.nan
            x, rate = (nothing, nothing) if m is None else self._result.measured.quantity(m)
            effort = nothing
        side = sign(effort) * (effort != 0.0)
        stretches = self._result.stretches
        if own and stretches is not None:
            side = 0.0 * x
            for k in own:
                held, way = stretches.mode[k] == HELD, stretches.sigma[k]
                effort = effort + self._result.multipliers[:, s.switches[k].row]
                side = np.where(held, np.where(way == 0.0, 1.0, way), side)
        return x, rate, effort, side

    def _law(self, at: int, a: np.ndarray, b: np.ndarray) -> np.ndarray:
        """Values of a law over time."""
        if at < 0:
            return self._result.motions.zeros()
        s, S, t = self._x.structure, self._x.system, self._result.t
        if self._result.motions.dtype == float and takes_arrays(S.code, at):
            slots = self._result.measured.slots[0]
            behind = len(slots) - len(s.switches)
            return over_time(S.code, S.const, at, (t, a, b), (slots[:behind], slots[behind:]))
        stack = np.zeros((s.depth + 1 + STACK_RESERVE, 3), self._result.motions.dtype)
        sensed = self._result.measured.slots
        x = np.stack([t, a, b], axis=1)
        out = self._result.motions.zeros()
        for i in range(len(t)):
            try:
                out[i] = evaluate(S.code, S.const, at, stack, tuple(x[i]), sensed[:, :, i])
            except Exception as error:  # a user's function may raise anything
                raise AnalysisError(
                    f"{self.element.title}: its law raises {type(error).__name__} at t = {t[i]:.6g} s: {error}. A law "
                    f"must give the same number whenever it is asked; give a function without a memory"
                ) from error
        return out

    @property
    def wrench(self) -> tuple[np.ndarray, np.ndarray]:
        """Force [N] and torque [N m] on the second body, world axes; of a two-point force at the second point.

        Raises
        ------
        AttributeError
            For forces along coordinates in general, which may act on several bodies.
        """
        n = len(self._result.t)
        if isinstance(self.element, JointForce):
            (k, turn), _, _ = coordinate_frames(self._x, self._x.structure.model[self.element.joint], "angle")
            axis = turned(self._result.motions.frame(k), turn)[1]
            effort = self._whole_along()[2]
            return np.zeros((n, 3)), np.stack([a * effort for a in (axis[2], axis[5], axis[8])], axis=1)
        if isinstance(self.element, CoordinateForce):
            raise AttributeError(f"{self.element.title} acts along a coordinate; it has {', '.join(self.names)}")
        _, force, torque = self._between()
        return tuple(np.stack([np.broadcast_to(c, (n,)) for c in w], axis=1) for w in (force, torque))  # type: ignore[return-value]

    @property
    def pulls(self) -> list[tuple[np.ndarray, np.ndarray]]:
        """For a rope: each of its points over time [m] and the force on the body there [N], world axes, (n, 3)."""
        r, s = self._result.records, self._x.structure
        points = [np.stack(r.frame(s.frame_at[self.element.name, role, ""])[0], axis=1) for role in self.element.ends()]
        tension = -self._whole_along()[2]
        forces = [np.zeros_like(p) for p in points]
        for k in range(len(points) - 1):
            d = points[k + 1] - points[k]
            pull = d * (tension / np.sqrt((d * d).sum(axis=1)))[:, None]
            forces[k] += pull
            forces[k + 1] -= pull
        return list(zip(points, forces, strict=True))

    @property
    def energy(self) -> np.ndarray:
        """Potential energy stored in it [J]."""
        e = self.element
        if e.energy is None:
            return self._result.motions.zeros()
        if isinstance(e, CoordinateForce):
            if not any(f is e for f in self._x.structure.forces):
                return self._result.motions.zeros()
            S, k = self._x.system, self._index()
            x = self._result.measured.quantity(int(S.force_i[k, FORCE_F]))[0]
            return self._in_force() * e.energy(wide(S.force_x, k), x)
        F, M, par = self._frames
        return e.energy(par, F, M)

    def _in_force(self) -> Any:
        """Whether it is there: 0 from where an event has released it."""
        stretches = self._result.stretches
        own = [k for k, x in enumerate(self._x.structure.switches) if x.element is self.element]
        return 1.0 if stretches is None or not own else stretches.over("switch")[SPARE, own[0]] == 0.0

    @property
    def power(self) -> np.ndarray:
        """Power that it gives to the bodies [W]."""
        if isinstance(self.element, CoordinateForce):
            _, rate, effort, _ = self._whole_along()
            return rate * effort
        _, force, torque = self._between()
        F, M, _ = self._frames
        return power(F, M, force, torque)

    @property
    def work(self) -> np.ndarray:
        """Work given to the bodies since the start [J]: integrated with the motion, or what it stores no more."""
        name = f"{self.element.name}.work"
        states = self._x.structure.state_at
        if name in states:
            return self._result.states[:, states[name]]
        return basis(self._result, self.element.name) - self.energy

    @property
    def _whole(self) -> tuple[np.ndarray, np.ndarray]:
        """Force and torque of a force between frames: (n, 2) and (n,) in the plane."""
        force, torque = self.wrench
        return (force[:, :2], torque[:, 2]) if self._result.planar else (force, torque)

    def _found(self, name: str) -> np.ndarray:
        """One of its outputs: length, rate and tension of a two-point force; angle, rate and torque about a joint.

        Of a force on a body, or between two frames, force and torque there.
        """
        outputs = list(self.element.outputs)
        if name not in outputs:
            return self._whole[name == "torque"]
        k = outputs.index(name)
        if isinstance(self.element, CoordinateForce):
            value = self._whole_along()[k]
            if k > 2:
                return np.abs(value) if name == "taut" else value
            seen = self.element.outward(self._x.numbers[self.element.name])
            return (self.element.sign if k == 2 else 1.0) * seen * value
        inputs, force, _ = self._between()
        if k < 2:
            return inputs[k]
        F, M, _ = self._frames
        along = divide(-dot(force, sub(M[0], F[0])), inputs[0])
        return unless_zero(inputs[0], along, norm(force))  # a damper between coinciding points: c times its rate

    def channels(self) -> Curves:
        """Its outputs; for others, the components of force and torque that are not zero all the time."""
        out = super().channels()
        return out if self.element.outputs else {k: v for k, v in out.items() if v[1].any()}
