"""Inputs and outputs of a stepper: parameters that laws read, and quantities measured at a state."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import groupby
from typing import Any, NamedTuple

import numpy as np

from ..assembly.assembled_state import Assembly, initial_conditions
from ..assembly.compiled_mechanism import CompiledMechanism, compile_mechanism
from ..engine.entry_point import POSITION
from ..errors import ModelError
from ..mobility.mobility import mobility
from ..model.body import GROUND, Driver, Frame
from ..model.controller import Sensor
from ..model.element_laws import with_inputs
from ..model.expressions import parameter_formulas
from ..model.joint import Coupling
from ..model.model import Model
from ..model.quantities import single_quantity
from ..numerics.integrators.butcher_tableaux import tableau
from ..numerics.integrators.time_loop import StateVectors, StepCounts, StepReals, StepState
from ..results.events import Phase, Phases
from ..results.health import Health
from ..results.mobility import Mobility
from ..results.part_views.bodies import BodySetMotion, join_in_time
from ..results.result import Result
from ..tables.element_numbers import element_numbers
from ..tables.law_inputs import element_laws
from ..tables.values import Values, values

CHANGED_INPUT = 1.5  # factor of an input's value, to find out which numbers depend on it


def model_with_inputs(model: Model, names: Sequence[str]) -> tuple[Model, list[str]]:
    """Return a copy of a model in which inputs are parameters, and the names of these parameters.

    Raises
    ------
    ModelError
        If there is no such input, or it sets more than laws of forces, motors and controllers.
    """
    repeated = [name for k, name in enumerate(names) if name in names[:k]]
    if repeated:
        raise ModelError(f"the input {repeated[0]!r} is named twice; leave one of them out")
    out, inputs = with_inputs(model, names)
    out = out.snapshot()
    read = [(e, law.names) for e, law, _ in element_laws(out)]
    named = {name for _, names in read for name in names}
    named.update(*(law.names for law in out.gravity_laws() if law is not None))
    for x in inputs:
        driven = [e.title for e, found in read if isinstance(e, (Driver, Coupling)) and x.parameter in found]
        if driven:
            raise ModelError(
                f"{x.name!r} cannot be an input of a stepper: it sets the position of {driven[0]}, which would jump "
                "from one step to the next. Use a motor whose torque is the input, or whose law is that of a servo"
            )
        _refuse_numbers(out, x.name, x.parameter)
        if x.parameter not in named:
            raise ModelError(f"{x.name!r} cannot be an input of a stepper: no law reads it")
    return out, [x.parameter for x in inputs]


def _refuse_numbers(model: Model, name: str, parameter: str) -> None:
    """Refuse a parameter that anything but a law depends on."""
    value = float(model.environment({})[parameter])
    other = {parameter: CHANGED_INPUT * value if value else 1.0}
    refusal = f"{name!r} cannot be an input of a stepper: "
    dependent = [k for k, formula in parameter_formulas(model.parameters).items() if parameter in formula.names]
    if dependent:
        raise ModelError(f"{refusal}the parameter {dependent[0]!r} depends on it; write laws with {name!r} itself")
    try:
        what = _dependent_number(model, other)
    except ModelError as error:  # the other value is invalid: some number depends on it
        raise ModelError(f"{refusal}it sets numbers of elements: {error}") from None
    if what:
        raise ModelError(
            f"{refusal}{what} depends on it by a number (a mass, a length, a stiffness), and inputs are read by laws "
            "only. Give a force or motor as input, or write the law with a parameter of its own"
        )


def _dependent_number(model: Model, other: Mapping[str, float]) -> str:
    """Return what has other numbers with other values of parameters, besides laws; empty if there is nothing."""
    before, after = element_numbers(model), element_numbers(model, other)
    if not np.array_equal(model.gravity_vector(before.env), model.gravity_vector(after.env)):
        return "gravity"
    for found, changed in ((before.of, after.of), (before.bodies, after.bodies)):
        for k, x in found.items():
            if not _equal(vars(x), vars(changed[k])):
                return str(model[k].title)
    if initial_conditions(model, before.env) != initial_conditions(model, after.env):
        return "an initial value"
    return ""


def _equal(a: Mapping[str, Any], b: Mapping[str, Any]) -> bool:
    return all(np.array_equal(x, b[k]) if isinstance(x, np.ndarray) else repr(x) == repr(b[k]) for k, x in a.items())


class CountedAngles(NamedTuple):
    """Angles whose whole turns are counted, each (n,)."""

    state: np.ndarray  # entries of the state
    rate: np.ndarray  # entries of the measured values
    factor: np.ndarray  # rate of the state by the measured rate


@dataclass(frozen=True)
class StateSample:
    """Time [s], state and inputs of one copy of a stepper at an instant; of sets of bodies their motions at that time.

    Inputs are those of the step that ended in the state.
    """

    t: float
    state: np.ndarray
    inputs: np.ndarray
    sets: Mapping[str, BodySetMotion]


class Measurement:
    """Outputs, and poses of bodies and frames, at states of one motion.

    Parameters
    ----------
    model : Model
    outputs : sequence of str
        Sensors, and curves such as ``"A.angle"``.
    tree : sequence of str
        Tree joints of the motion's coordinates; empty for absolute coordinates.
    parameters : mapping, optional
    inputs : sequence of str
        Parameters that are inputs.

    Attributes
    ----------
    state : ndarray (ny,)
        The state (q, v, z) that `update` evaluates; to be written in place.
    q, v : ndarray (nq,), (nv,)
        Parts of it.

    Raises
    ------
    ModelError
        If an output is not a position, angle, length or rate.
    """

    def __init__(
        self,
        model: Model,
        outputs: Sequence[str],
        tree: Sequence[str],
        parameters: Mapping[str, float] | None,
        inputs: Sequence[str] = (),
    ) -> None:
        self._described, self._inputs = model, tuple(inputs)
        model, names = _with_sensors(model, outputs)
        c = self._compiled = compile_mechanism(model, parameters=parameters, tree=tree, outputs=names, solved=False)
        s = self.structure = c.structure
        ny = s.nq + s.nv + len(s.states)
        y = StateVectors.blank(ny)
        clock = StepState(
            StepReals.blank(), StepCounts.blank(), np.zeros(0), y, np.zeros((1, ny)), np.zeros(0, np.int64)
        )
        self._time, self.state = clock.real, y.current
        self.state[:] = np.concatenate([c.values.q, c.values.v, c.z])
        self.q, self.v = self.state[: s.nq], self.state[s.nq : s.nq + s.nv]
        self._evaluate = c.bound(tableau("rk45"), clock, np.zeros((0, 0)))
        self._columns = np.array([s.slots[name] for name in names], np.int64)
        self._values, bodies = c.work.sensed.value, c.work.bodies
        self._positions, self._rotations = bodies.position, bodies.rotation.reshape(-1, 3, 3)
        self._velocities, self._angular_velocities = bodies.velocity, bodies.angular_velocity
        self._frames: dict[str, tuple[int, np.ndarray, np.ndarray]] = {}
        self._turns = self._counted_angles(())

    def _counted_angles(self, known: Collection[int]) -> CountedAngles:
        """Return the angles whose whole turns are counted here: all but those at some entries of the state."""
        s, first, nm = self.structure, self.structure.nq + self.structure.nv, len(self.structure.measured)
        angles = [t for t in s.terms if t.measured and t.hint >= 0 and t.formula.of_kind.turns]
        terms = [t for t in angles if first + t.hint not in known]
        return CountedAngles(
            np.array([first + t.hint for t in terms], np.int64),
            np.array([nm + t.row - len(s.rows) for t in terms], np.int64),
            np.array([1.0 / t.sign for t in terms]),
        )

    def start(
        self, t: float, hints: Mapping[str, float], other: CompiledMechanism
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Take over time and angles with their whole turns at the start of a motion of another mechanism.

        Returns the entries in its state of controller states, angles and places, those in this state, and factors: the
        motion counts the turns of these angles itself, among them the angles of joints that are its coordinates.
        """
        self._time.t = t
        first = self.structure.nq + self.structure.nv
        for name, k in self.structure.state_at.items():
            if name in hints:
                self.state[first + k] = hints[name]
        s, own = other.structure, self.structure.state_at
        found = {name: (s.nq + s.nv + k, 1.0) for name, k in s.state_at.items()} | other.turning_coordinates
        shared = [(k, first + own[name], sign) for name, (k, sign) in found.items() if name in own]
        there, here, sign = np.array(shared).reshape(-1, 3).T
        self._turns = self._counted_angles(here.astype(np.int64).tolist())
        return there.astype(np.int64), here.astype(np.int64), sign

    @property
    def counts_turns(self) -> bool:
        """Whether whole turns of angles are counted here, from one update to the next."""
        return len(self._turns.state) > 0

    def update(self, t: float) -> None:
        """Evaluate at time t and the state.

        Angles are predicted with the mean of their rates at both times; the prediction selects the whole turn.
        """
        turns, since = self._turns, t - float(self._time.t)
        self._time.t = t
        if not self.counts_turns:
            self._evaluate(POSITION)
            return
        before, rate = self.state[turns.state], self._values[turns.rate]
        self._evaluate(POSITION)
        self.state[turns.state] = before + 0.5 * since * turns.factor * (rate + self._values[turns.rate])
        self._evaluate(POSITION)

    def save(self) -> tuple[float, np.ndarray]:
        """Return copies of time and state."""
        return float(self._time.t), self.state.copy()

    def restore(self, saved: tuple[float, np.ndarray]) -> None:
        """Return to a saved time and state."""
        self._time.t, self.state[:] = saved

    def sample(self, t: float, inputs: np.ndarray, sets: Mapping[str, BodySetMotion]) -> StateSample:
        """Return time, inputs and the state as last written."""
        return StateSample(t, self.state.copy(), inputs.copy(), sets)

    def motion(self, samples: Sequence[StateSample]) -> Result:
        """Return the motion through states, each with its own inputs; accelerations and multipliers are nan.

        Raises
        ------
        ModelError
            If there are no samples.
        """
        if not len(samples):
            raise ModelError("a motion is made of the samples of a stepper, got none; collect sim.sample() after steps")
        t, rows = np.array([x.t for x in samples]), np.array([x.state for x in samples])
        phases = self._phases(samples)
        result = motion_through_states(phases[-1].values, t, rows)
        if len(phases) > 1:
            result.phases = Phases(phases)
        result.bulk = {name: join_in_time([x.sets[name] for x in samples]) for name in samples[0].sets}
        return result

    def _phases(self, samples: Sequence[StateSample]) -> tuple[Phase, ...]:
        """Return phases of equal inputs, with the tables of laws that read them."""
        s, given, out = self.structure, self._compiled.parameters, []
        for inputs, group in groupby(samples, key=lambda x: tuple(x.inputs.tolist())):
            own = list(group)
            tables = values(s, {**given, **dict(zip(self._inputs, inputs, strict=True))})
            modes, directions = np.zeros((5, len(s.switches))), np.zeros(len(s.switches))
            out.append(Phase(len(own), modes, directions, tables, 0.0, 0.0, own[-1].state))
        return tuple(out)

    def outputs(self, out: np.ndarray) -> None:
        """Write the outputs at the state last evaluated."""
        out[:] = self._values[self._columns]

    def pose(self, name: str) -> tuple[np.ndarray, np.ndarray]:
        """Return position (3,) and rotation (3, 3) of a body's reference frame or a named frame."""
        b, p, R = self._frame(name)
        if b < 0:
            return p.copy(), R.copy()
        turned = self._rotations[b]
        return self._positions[b] + turned @ p, turned @ R

    def velocity(self, name: str) -> tuple[np.ndarray, np.ndarray]:
        """Return the velocity of the origin and the angular velocity of a body's reference frame or a named frame.

        Both are (3,), along the axes of the world.
        """
        b, p, _ = self._frame(name)
        if b < 0:
            return np.zeros(3), np.zeros(3)
        spin = self._angular_velocities[b].copy()
        return self._velocities[b] + np.cross(spin, self._rotations[b] @ p), spin

    def _frame(self, name: str) -> tuple[int, np.ndarray, np.ndarray]:
        """Return the body's row, and the frame's position and rotation on it."""
        if name not in self._frames:
            values, e = self._compiled.values, self._described[name]
            if name != GROUND and e.category not in ("bodies", "frames"):
                raise ModelError(f"{e.title} has no pose; name a body or a frame")
            p, R = values.poses.named(name)
            carrier = e.body if isinstance(e, Frame) else name
            body, row = values.bodies[carrier], self.structure.place[carrier]
            self._frames[name] = (row, p, R) if row < 0 else (row, body.R.T @ (p - body.c), body.R.T @ R)
        return self._frames[name]


def motion_through_states(values: Values, t: np.ndarray, rows: np.ndarray) -> Result:
    """Return a motion of which states are known: accelerations and multipliers are nan.

    Parameters
    ----------
    values : Values
        The mechanism, in the coordinates of the states.
    t : ndarray (n,) [s]
    rows : ndarray (n, ny)
        States (q, v, z).
    """
    s, n = values.structure, len(t)
    q, v, z = (np.ascontiguousarray(x) for x in np.split(rows, [s.nq, s.nq + s.nv], axis=1))
    vdot = np.full((n, s.nv), np.nan)
    multipliers = np.full((n, len(values.system.rows.law) + len(s.prescribed)), np.nan)
    health = Health(True, "states of a motion", np.nan, np.nan, steps=n, rejected=0, evaluations=0, factorisations=0,
                    seconds=0.0)  # fmt: skip
    health.late = {"mobility": partial(_mobility, CompiledMechanism(values, z[0].copy()), float(t[0]), q[0], v[0])}
    result = Result(s.model, values, t, q, v, z, vdot, multipliers, health)
    result.final = float(t[-1]), rows[-1].copy()
    return result


def _mobility(c: CompiledMechanism, t: float, q: np.ndarray, v: np.ndarray) -> Mobility:
    model = c.structure.model
    base = compile_mechanism(model, parameters=c.values.parameter_values)
    return mobility(model, Assembly(base, t, *base.take(c, t, q, v)))


def _with_sensors(model: Model, outputs: Sequence[str]) -> tuple[Model, list[str]]:
    """Return a copy with a sensor for each output that is not one, and the names of the sensors."""
    out, names = model.copy(), []
    for k, name in enumerate(outputs):
        single_quantity(model, name)  # refuses unknown names
        sensor = out.find(name)
        if not isinstance(sensor, Sensor):
            sensor = Sensor(f"output_{k}_of_{''.join(c if c.isalnum() else '_' for c in name)}", of=name)
            out.add(sensor)
        if out.measured(sensor) is None:
            raise ModelError(
                f"{name!r} cannot be an output of a stepper, which are positions, angles, lengths and their rates; "
                "accelerations and reactions follow from forces"
            )
        names.append(sensor.name)
    return out.snapshot(), names
