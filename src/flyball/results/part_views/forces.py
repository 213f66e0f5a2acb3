"""Quantities measured by force elements and contact points, and the forces they exert."""

from __future__ import annotations

from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np

from ...constraints.switches.switch_kind import BY_RATE, HELD
from ...engine.entry_point import characteristic_rate_within
from ...engine.loads import REST_SPEED, force_row, wrench_power
from ...errors import AnalysisError
from ...forces.rope_geometry import RopeCourse, drawn_rope, is_backward, rope_course
from ...forces.rope_geometry import sign as sign_of
from ...laws.bytecode import STACK_RESERVE, evaluate
from ...laws.interval_evaluation import evaluate_over_time, read_steps, takes_arrays
from ...math.scalar import divide, sign, unless_zero
from ...math.vec import cross, dot, norm, sub
from ...model.force import CoordinateForce, JointForce, PathForce
from ...model.joint import Coupling
from ...model.names import curve_parts
from ..contacts import ContactHistory
from ..events import RecordedModes, stored_reference
from ..motion_record import coordinate_records
from .base import Curves, PartView


class ForceView(PartView):
    """Measured quantities and forces of a force element."""

    def _index(self) -> int:
        return next(i for i, f in enumerate(self._x.structure.forces) if f is self.element)

    def _between(self) -> tuple[tuple, tuple, tuple]:
        """(inputs, force on M, torque on M) over time, of a force between frames."""
        e, S = self.element, self._x.system
        k = self._index()
        F, M, par = self._frames
        if e.states():
            force, torque, rates = e.wrench_and_rates(par, F, M, self._states, S.const, S.surfaces)
            return rates, force, torque
        a, b = (np.broadcast_to(i, (self._result.motions.n,)) for i in e.inputs(par, F, M))
        laws = tuple(self._law(int(S.forces.laws[k, i]), a, b) for i in range(3))
        force, torque = e.wrench_between(par, F, M, laws, (a, b), S.const)
        return (a, b), force, torque

    @cached_property
    def _figures(self) -> dict[str, np.ndarray]:
        """Outputs of a force that computes them by a formula of its own."""
        F, M, par = self._frames
        e, S, n = self.element, self._x.system, len(self._result.t)
        with np.errstate(all="ignore"):  # without contact
            if e.states():
                found = e.figures(par, F, M, self._states, S.const, S.surfaces)
            else:
                k = self._index()
                a, b = e.inputs(par, F, M)
                laws = tuple(self._law(int(S.forces.laws[k, i]), a, b) for i in range(3))
                found = e.figures(par, F, M, laws, S.const)
        return {k: np.broadcast_to(x + 0.0, (n,)) for k, x in zip(e.outputs, found, strict=True)}

    @property
    def _states(self) -> tuple[np.ndarray, np.ndarray]:
        """The two states of a force over time."""
        at = int(self._x.system.forces.state[self._index()])
        return self._result.states[:, at], self._result.states[:, at + 1]

    @property
    def _frames(self) -> tuple[tuple, tuple, Any]:
        """Records of F and M over time, and its numbers, of a force between frames."""
        r, S = self._result.motions, self._x.system
        k = self._index()
        F, M = (r.frame(int(side[k])) for side in (S.forces.F, S.forces.M))
        return F, M, force_row(S.force_parameters, k)

    def acts(self) -> tuple[tuple[int, int], tuple, tuple, tuple]:
        """For a force between frames, return: bodies of F and M; point, force and torque on M's body over time."""
        S = self._x.system
        _, force, torque = self._between()
        k = self._index()
        i, j = (int(S.frame_body[side[k]]) for side in (S.forces.F, S.forces.M))
        return (i, j), self._frames[1][0], force, torque

    def pushes(self) -> tuple[int, np.ndarray]:
        """For a force along a measured quantity, return: index of that, and its effort over time; without its row."""
        return int(self._x.system.forces.F[self._index()]), self._along()[2]

    def _along(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """(value, rate, effort) over time, of a force along a measured quantity."""
        e, S = self.element, self._x.system
        k = self._index()
        x, rate = self._result.measured.quantity(int(S.forces.F[k]))
        laws = (self._law(int(S.forces.laws[k, 0]), x, rate), 0.0 * x, self._way(k, rate))
        load = 0.0 * x
        if S.forces.load[k] >= 0:
            force, torque = self._result.reactions.of(e.joint)
            load = e.load(
                force_row(S.force_parameters, k), self._result.motions.frame(int(S.forces.M[k])), force, torque
            )
        effort = e.effort(force_row(S.force_parameters, k), x, rate, laws, load) + 0.0 * x
        for rotor, d in self._x.structure.rotors:
            if rotor is e:
                effort = effort - e.added_inertia(self._x.numbers[e.name]) * self._result.vdot[:, d]
        return x, rate, effort

    def _way(self, k: int, rate: np.ndarray) -> np.ndarray:
        """Return the sliding direction: as recorded by its switch; without a switch the sign of the rate."""
        s = int(self._x.system.forces.switch[k])
        stretches = self._result.phases
        if s < 0 or stretches is None:
            return sign(rate)
        S, t = self._x.system, self._result.t
        slow = REST_SPEED * S.units[S.forces.F[k]] * characteristic_rate_within(S, float(t[-1] - t[0]))
        by_rate = np.where(np.abs(rate) > slow, sign(rate), 0.0)
        return np.where(stretches.sigma[s] == BY_RATE, by_rate, stretches.sigma[s] + 0.0 * rate)

    def _rows(self) -> list[int]:
        """Return the indices of its switches."""
        return [k for k, x in enumerate(self._x.structure.switches) if x.element is self.element and x.row >= 0]

    @cached_property
    def _whole_along(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Return (value, rate, effort, closed side), including the forces of active rows.

        The effort of a rigid element without a row, because the motion was computed without it, is unknown: nan.
        """
        s, own = self._x.structure, self._rows()
        if self._slips:
            return self._slipping()
        if isinstance(self.element, CoordinateForce) and (other := self.element.measured_with()):
            view = self._result[other]
            return view._whole_along if isinstance(view, ForceView) else self._held()
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
            effort = self._transmitted() if e.transmitted() else nothing
        side = sign(effort) * (effort != 0.0)
        stretches = self._result.phases
        if own and stretches is not None:
            side = 0.0 * x
            for k in own:
                held, way = stretches.mode[k] == HELD, stretches.sigma[k]
                effort = effort + self._result.multipliers[:, s.switches[k].row]
                side = np.where(held, np.where(way == 0.0, 1.0, way), side)
        return x, rate, effort, side + 0.0

    def _transmitted(self) -> np.ndarray:
        """Return the effort of the part that carries the element's own; at rest a constraint may replace that part."""
        name = self.element.transmitted()
        owner = curve_parts(name)[0]
        if not isinstance(self._result.model[owner], Coupling):
            return self._result.channel(name)[1]
        return self._result[f"{owner}.effort_1"] / self._x.numbers[owner].weights[0]

    def _held(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Return (length, rate, effort, side) of a rope over pulleys that a constraint keeps taut at rest."""
        n, zero = self._x.numbers[self.element.name], self._result.motions.zeros()
        drawn = drawn_rope(self.element, n)
        length = sum(drawn.lengths) + drawn.arcs(n.radii) if n.length is None else n.length
        return length + zero, zero, self._transmitted(), 1.0 + zero

    @property
    def _slips(self) -> bool:
        """Return whether it is a rope with friction around a pulley, whose tensions differ."""
        return isinstance(self.element, PathForce) and getattr(self.element, "friction", None) is not None

    @cached_property
    def _tensions(self) -> list[np.ndarray]:
        """For a rope: the tension of each straight part over time [N], (n,)."""
        e, count = self.element, len(self.element.bodies) - 1
        if not self._slips:
            return [-self._whole_along[2]] * count
        (i,) = e.slips_at()
        return [self._result.channel(f"{e.name}_slip.tension_{1 if k < i else 2}")[1] for k in range(count)]

    def _slipping(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Return (length, rate, effort, side) of a rope with friction: of its largest tension."""
        e, n, model = self.element, self._x.numbers[self.element.name], self._result.model
        drawn, zero = drawn_rope(e, n), self._result.motions.zeros()
        parts = zip(drawn.lengths, drawn.places, pairwise(n.radii), strict=True)
        moving = (length - (b - a) * x for k, (length, x, (a, b)) in enumerate(parts, 1) if f"{e.name}_{k}" in model)
        pulls = [self._result[name] for k in (1, 2) if (name := f"{e.name}_pull_{k}") in model]
        length = sum((x.value for x in pulls), sum(drawn.lengths) + drawn.arcs(n.radii) - sum(moving) + zero)
        tension = np.maximum(self._tensions[0], self._tensions[-1])
        return length, sum((x.rate for x in pulls), zero), -tension, np.where(tension > 0.0, 1.0, 0.0)

    def _law(self, at: int, a: np.ndarray, b: np.ndarray) -> np.ndarray:
        """Return the values of a law over time."""
        if at < 0:
            return self._result.motions.zeros()
        s, S, t = self._x.structure, self._x.system, self._result.t
        if self._result.motions.dtype == float and takes_arrays(S.code, at):
            slots = self._result.measured.slots[0]
            behind = len(slots) - len(s.switches)
            steps = s.cache.get("steps of laws", at, len(S.code), lambda: read_steps(S.code, at))
            return evaluate_over_time(steps, S.const, (t, a, b), (slots[:behind], slots[behind:]))
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
                    "must give the same number for the same arguments; give a function without memory"
                ) from error
        return out

    @property
    def wrench(self) -> tuple[np.ndarray, np.ndarray]:
        """Force [N] and torque [N m] on the second body, world axes; of a two-point force at the second point.

        Raises
        ------
        AttributeError
            For forces along coordinates, which may act on several bodies.
        """
        n = len(self._result.t)
        if isinstance(self.element, JointForce):
            joint = self._x.structure.model[self.element.joint]
            axis = coordinate_records(self._result.motions, joint, "angle")[0][1]
            effort = self._whole_along[2]
            return np.zeros((n, 3)), np.stack([a * effort for a in (axis[2], axis[5], axis[8])], axis=1)
        if isinstance(self.element, CoordinateForce):
            raise AttributeError(f"{self.element.title} acts along a coordinate; it has {', '.join(self.names)}")
        _, force, torque = self._between()
        return tuple(np.stack([np.broadcast_to(c, (n,)) for c in w], axis=1) for w in (force, torque))  # type: ignore[return-value]

    @cached_property
    def course(self) -> RopeCourse:
        """Where a rope or path runs, over time."""
        r, s, n = self._result.motions, self._x.structure, self._x.numbers[self.element.name]
        frames = [r.frame(s.frame_at[self.element.name, role, ""]) for role in self.element.ends()]
        centres = [np.stack(p, axis=1) for p, *_ in frames]
        axes = [np.stack(np.broadcast_arrays(R[2], R[5], R[8] + r.zeros()), axis=1) for _, R, *_ in frames]
        return rope_course(centres, axes, getattr(n, "radii", None) or (0.0,) * len(frames))

    @property
    def pulls(self) -> list[tuple[np.ndarray, np.ndarray]]:
        """For a rope: each of its points over time [m] and the force on the body there [N], world axes, (n, 3)."""
        x = self.course
        forces = [np.zeros_like(p) for p in x.centres]
        for k, (u, tension) in enumerate(zip(x.pulls, self._tensions, strict=True)):
            forces[k] += u * tension[:, None]
            forces[k + 1] -= u * tension[:, None]
        return list(zip(x.centres, forces, strict=True))

    @cached_property
    def wraps(self) -> list[np.ndarray]:
        """For a rope over pulleys: the angle around each point over time [rad], with full turns, (n,)."""
        e, n = self.element, self._x.numbers[self.element.name]
        drawn = drawn_rope(e, n)
        out = [phi + self._result.motions.zeros() for phi in drawn.wraps]
        for k, place in enumerate(drawn.places):
            name = f"{e.name}_{k + 1}"
            if name not in self._result.model or not hasattr(self._result.model[name], "radii"):
                continue
            part = self._result[name]
            turned = part.place - place
            back = is_backward(n.radii[k], n.radii[k + 1])
            out[k] = out[k] + sign_of(n.radii[k]) * turned
            out[k + 1] = out[k + 1] - sign_of(n.radii[k + 1]) * (turned if back else turned - part.angle)
        return [0.0 * phi if r == 0.0 else phi for phi, r in zip(out, n.radii, strict=True)]

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
            x = self._result.measured.quantity(int(S.forces.F[k]))[0]
            return self._in_force() * e.energy(force_row(S.force_parameters, k), x)
        F, M, par = self._frames
        return e.energy(par, F, M)

    def _in_force(self) -> Any:
        """Return whether it is active: 0 after an event has released it."""
        stretches = self._result.phases
        own = [k for k, x in enumerate(self._x.structure.switches) if x.element is self.element]
        return 1.0 if stretches is None or not own else RecordedModes(*stretches.over("switch")).released[own[0]] == 0.0

    @property
    def power(self) -> np.ndarray:
        """Power supplied to the bodies [W]."""
        if isinstance(self.element, CoordinateForce):
            if self._slips:
                pulls = (p for p in self.element.parts(self._x.structure.model) if isinstance(p, CoordinateForce))
                return sum((self._result[p.name].power for p in pulls), self._result.motions.zeros())
            _, rate, effort, _ = self._whole_along
            return rate * effort
        _, force, torque = self._between()
        F, M, _ = self._frames
        return wrench_power(F, M, force, torque)

    @property
    def work(self) -> np.ndarray:
        """Work done on the bodies since the start [J]: integrated with the motion, or the decrease of stored energy."""
        name = f"{self.element.name}.work"
        states = self._x.structure.state_at
        if parts := [p for p in self.element.parts(self._x.structure.model) if f"{p.name}.work" in states]:
            return sum((self._result[p.name].work for p in parts), self._result.motions.zeros())
        if name in states:
            return self._result.states[:, states[name]]
        return stored_reference(self._result, self.element.name) - self.energy

    @property
    def _whole(self) -> tuple[np.ndarray, np.ndarray]:
        """Return force and torque of a force between frames: (n, 2) and (n,) in the plane."""
        force, torque = self.wrench
        return (force[:, :2], torque[:, 2]) if self._result.planar else (force, torque)

    def _found(self, name: str) -> np.ndarray:
        """One of its outputs: length, rate and tension of a two-point force; angle, rate and torque about a joint.

        For a force on a body, or between two frames: force and torque.
        """
        outputs = list(self.element.outputs)
        if name.startswith("load_"):
            pull = self.pulls[int(name.removeprefix("load_")) - 1][1]
            return np.sqrt((pull * pull).sum(axis=1))
        if name.startswith("wrap_"):
            return self.wraps[int(name.removeprefix("wrap_")) - 1]
        if name.startswith("tension_"):
            return self._tensions[int(name.removeprefix("tension_")) - 1]
        if name not in outputs:
            return self._whole[name == "torque"]
        if self.element.figures is not None:
            return self._figures[name]
        k = outputs.index(name)
        if isinstance(self.element, CoordinateForce):
            value = self._whole_along[k]
            if k > 2:
                return np.abs(value) if name == "taut" else value
            seen = self.element.outward(self._x.numbers[self.element.name])
            return (self.element.sign if k == 2 else 1.0) * seen * value + 0.0  # no -0.0 of a slack rope
        inputs, force, _ = self._between()
        if k < 2:
            return inputs[k]
        F, M, _ = self._frames
        along = divide(-dot(force, sub(M[0], F[0])), inputs[0])
        return unless_zero(inputs[0], along, norm(force)) + 0.0  # a damper between coinciding points: c times its rate

    def channels(self) -> Curves:
        """Return its outputs; for other elements, the components of force and torque that are not zero all the time."""
        out = super().channels()
        return out if self.element.outputs else {k: v for k, v in out.items() if v[1].any()}


class ContactPlaceView(PartView):
    """A contact point; nan if the motion was computed without it."""

    @cached_property
    def _touched(self) -> ContactHistory:
        return ContactHistory(self._result, self.element)

    def acts(self) -> tuple[tuple[int, int], tuple, tuple, tuple]:
        """Return bodies of F and M; point, force and torque on M's body over time: of sliding friction."""
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
        """Stored energy [J]: zero."""
        return self._result.records.zeros()

    @property
    def power(self) -> np.ndarray:
        """Power of friction [W]."""
        return self._touched.power if self._touched.known else self._result.records.zeros() * np.nan

    @property
    def work(self) -> np.ndarray:
        """Work of friction since the start [J], integrated with the motion."""
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
