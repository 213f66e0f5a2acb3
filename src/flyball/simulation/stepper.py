"""The stepper: a mechanism that another program advances step by step, with inputs and outputs as arrays.

A step is one of an integrated motion, or one of impulse time stepping.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple, Protocol

import numpy as np

from ..analysis_options import AnalysisOptions, require_count, require_positive, seconds
from ..engine.entry_point import INTEGRATE
from ..errors import FlyballError, ModelError, SimulationError
from ..laws.breakpoints import NO_BREAKPOINTS
from ..laws.python_functions import clear_faults, deferred_interrupts
from ..model.body import Initial
from ..model.expressions import number
from ..model.model import Model
from ..model.unsupported_elements import unsupported_elements
from ..numerics.integrators import time_loop as ex
from ..numerics.integrators.butcher_tableaux import tableau
from ..results.part_views.bodies import BodySetMotion
from ..results.result import Result
from ..tables.structure_definition import Structure, velocity_names
from ..tables.table_definitions import assign, copied
from .diagnosis import failure_reason
from .impulse_stepping.impulse_simulation import NO_WAY_MESSAGE, OutputRecorder, begin_by_impulses, body_sets
from .impulse_stepping.impulse_stepper import NoSolution, SavedState
from .initial_state import InitialState, find_initial_state
from .integration_intervals import SmoothIntervals, known_breaks, laws_checked_in_steps, laws_of_time
from .integration_options import Integration, Stepping, default_integration
from .measurement import Measurement, StateSample, model_with_inputs
from .method_choice import AUTO_METHOD, IMPULSE_METHOD, IMPULSE_STEPPING, unknown_to_impulse_stepping
from .simulate import clock_for, row_width

HORIZON = 1000  # steps whose duration scales the tolerances of an integration, as the time span of a simulation does


POSE_WIDTH = 12  # of a row of `Movers.pose`


class StepMotion(Protocol):
    """A motion that advances step by step."""

    structure: Structure
    tree: tuple[str, ...]  # tree joints of its coordinates

    def set_inputs(self, values: np.ndarray) -> None:
        """Set the inputs from now on."""

    def advance(self, t: float) -> None:
        """Move to a later time."""

    def measure_by(self, x: Measurement) -> None:
        """Prepare for `write_state` to a measurement in the coordinates of the motion."""

    def write_state(self, x: Measurement) -> None:
        """Write the state to that measurement."""

    def sets(self) -> dict[str, BodySetMotion]:
        """Return the sets of bodies at the present time, by name."""

    def save(self) -> Any:
        """Return a copy of all that `advance` changes."""

    def restore(self, saved: Any) -> None:
        """Return to a saved state."""


class IntegratedState(NamedTuple):
    """Copies of what a step of `IntegratedMotion` changes."""

    clock: ex.StepState
    work: Any


class IntegratedMotion:
    """A smooth motion, integrated by an explicit method from step to step.

    Parameters
    ----------
    start : InitialState
        With its own workspace, without switches.
    o : Integration
    dt : float [s]
        Usual duration of a step.
    inputs : sequence of str
        Parameters that are inputs.
    """

    def __init__(self, start: InitialState, o: Integration, dt: float, inputs: Sequence[str]) -> None:
        self.start, self.method = start, str(o.method)
        c = self.c = start.assembly.compiled
        s = self.structure = c.structure
        self.tree = s.tree
        c.system = c.system._replace(const=c.system.const.copy())
        self._inputs = input_places(s.model, inputs)
        t = start.base.t
        clock = self.clock = clock_for(
            start, t, t + HORIZON * dt, np.zeros(0), o, laws_checked_in_steps(c, NO_BREAKPOINTS)
        )
        clock.real.h_max = np.inf if o.step is None else o.step
        clock.count.quota = clock.count.limit
        self._timed = bool(laws_of_time(c))
        self._call = c.bound(tableau(self.method), clock, np.zeros((2, row_width(start.assembly))))

    def set_inputs(self, values: np.ndarray) -> None:
        """Set the inputs from now on: forces may jump."""
        self.c.system.const[self._inputs] = values
        if self.clock.count.started == 1:
            self.clock.count.started = ex.FORCES_JUMPED

    def advance(self, t: float) -> None:
        """Integrate to time t.

        Raises
        ------
        SimulationError
            If the integration cannot continue.
        """
        clock = self.clock
        clock.real.t_end, clock.real.largest = t, max(abs(t), clock.real.largest)
        clear_faults(self.c.array("stack"))
        intervals = None
        if self._timed:
            intervals = SmoothIntervals(clock, known_breaks(self.c, float(clock.real.t), t))
        with deferred_interrupts(self.structure.functions):
            while True:
                clock.count.accepted = clock.count.rejected = 0
                self._call(INTEGRATE)
                if clock.count.status != ex.DONE or intervals is None or not intervals.next():
                    break
        if clock.count.status != ex.DONE:
            message, cause = failure_reason(
                self.start.assembly, self.start.base, clock, with_result=False, method=self.method
            )
            raise SimulationError(message, None, float(clock.real.t)) from cause

    def measure_by(self, x: Measurement) -> None:
        """Prepare for `write_state`."""
        n = self.structure.nq + self.structure.nv
        c = self.start.assembly.compiled
        hints = self.start.base.compiled.hints | c.hints | c.turned(self.start.assembly.q)
        there, here, sign = x.start(float(self.clock.real.t), hints, c)
        self._from, self._to = np.r_[np.arange(n), there], np.r_[np.arange(n), here]
        self._sign = np.r_[np.ones(n), sign]

    def write_state(self, x: Measurement) -> None:
        """Write the state to the measurement."""
        x.state[self._to] = self._sign * self.clock.y.current.take(self._from)

    def sets(self) -> dict[str, BodySetMotion]:
        """Return nothing: sets of bodies move by impulse time stepping."""
        return {}

    def save(self) -> IntegratedState:
        """Return copies of the integrator's state and the engine's workspace."""
        return IntegratedState(copied(self.clock), copied(self.c.work))

    def restore(self, saved: IntegratedState) -> None:
        """Return to a saved state."""
        assign(self.clock, saved.clock)
        assign(self.c.work, saved.work)


def input_places(model: Model, inputs: Sequence[str]) -> np.ndarray:
    """Return where the values of parameters are in the constants of laws."""
    names = list(model.parameters)
    return np.array([names.index(name) for name in inputs], np.int64)


class FreeBodyPlaces(NamedTuple):
    """Places of free bodies' coordinates; entries of a table (n, width) are numbered row by row."""

    q: np.ndarray  # (n, k) entries of the state
    v: np.ndarray  # (n, k) entries of the state for their rates
    source: np.ndarray  # (n, k) entries of the table of positions or orientations
    twist: np.ndarray  # (n, k) entries of the table of twists
    mover: np.ndarray  # (n,)


class AbsoluteImpulseMotion:
    """A motion by impulse time stepping, in absolute coordinates.

    Parameters
    ----------
    model : Model
    t : float [s]
    o : Stepping
    parameters : mapping, optional
    inputs : sequence of str
        Parameters that are inputs.
    """

    tree: tuple[str, ...] = ()

    def __init__(
        self, model: Model, t: float, o: Stepping, parameters: Mapping[str, float] | None, inputs: Sequence[str]
    ) -> None:
        base, scene, self.stepper, self.held, self.chosen = begin_by_impulses(model, t, o, parameters)
        self._model, self._scene = model, scene
        self.stepper.state.times.now = t
        self.c = base.compiled
        self.structure = self.c.structure
        self._reference, self._hints = base.q.copy(), base.compiled.hints
        first = {k: scene.carriers.slices[k].start for k in self.structure.place if k in scene.carriers.slices}
        tree, free = self.structure.tables["tree"], len(self.stepper.free.turn)
        rows = [(k, b) for name, b in self.structure.place.items() if b >= 0 and (k := first.get(name, free)) < free]
        movers, bodies = np.array(rows, np.int64).reshape(-1, 2).T
        n, nq, nv = (2, 3, 3) if model.planar else (3, 7, 6)  # of shifts; of a body that turns
        q, v, k = tree.q[bodies, None], self.structure.nq + tree.v[bodies, None], movers[:, None]
        width = self.stepper.workspaces.X.v.shape[1]
        i = np.arange(n)
        self._shifting = FreeBodyPlaces(q + i, v + i, POSE_WIDTH * k + i, width * k + i, movers)
        i, j = (np.arange(1), np.array([5])) if model.planar else (np.arange(4), np.arange(3, 6))
        turns = FreeBodyPlaces(q + np.arange(n, nq), v + np.arange(n, nv), len(i) * k + i, width * k + j, movers)
        self._turning = FreeBodyPlaces(*(x[tree.nv[bodies] > n] for x in turns))
        self._sign = np.ones((0, 1))
        if not model.planar:  # a quaternion and its negative are the same rotation
            same = (self.stepper.free.turn.take(self._turning.source) * base.q[self._turning.q]).sum(axis=1)
            self._sign = np.where(same < 0.0, -1.0, 1.0)[:, None]
        if self.held:
            self._inputs = input_places(self.held.start.assembly.compiled.structure.model, inputs)
        elif inputs:
            raise ModelError(f"{model.name!r} has no force or motor that reads the inputs {', '.join(inputs)}")

    def measure_by(self, x: Measurement) -> None:
        """Find where the state of the jointed mechanism is in that of the whole."""
        now = float(self.stepper.state.times.now)
        self._from = self._to = np.zeros(0, np.int64)
        if not self.held:
            x.start(now, self._hints, self.c)
            return
        own = self.held.start.assembly.compiled
        s, whole = own.structure, self.structure
        here, there, states = s.tables["tree"], whole.tables["tree"], x.start(now, self._hints, own)
        pairs = list(zip(states[0].tolist(), states[1].tolist(), strict=True))
        for name, b in s.place.items():
            if b >= 0:
                k = whole.place[name]
                pairs += [(here.q[b] + i, there.q[k] + i) for i in range(here.nq[b])]
                pairs += [(s.nq + here.v[b] + i, whole.nq + there.v[k] + i) for i in range(here.nv[b])]
        self._from, self._to = np.array(pairs, np.int64).T

    def set_inputs(self, values: np.ndarray) -> None:
        """Set the inputs from now on."""
        if self.held:
            self.stepper.joints.S.const[self._inputs] = values

    def advance(self, t: float) -> None:
        """Step to time t, by as many equal steps as the longest step requires.

        Raises
        ------
        SimulationError
            If the stepping cannot continue.
        """
        now = float(self.stepper.state.times.now)
        steps = max(1, math.ceil((t - now) / self.chosen.step * (1.0 - 1e-9)))
        try:
            self.stepper.run(steps, (t - now) / steps)
        except NoSolution:
            at = float(self.stepper.state.times.now)
            name = self.structure.model.name
            raise SimulationError(f"{name!r} cannot continue at t = {at:.6g} s: {NO_WAY_MESSAGE}", None, at) from None
        self.stepper.state.times.now = t

    def write_state(self, x: Measurement) -> None:
        """Write the state to the measurement."""
        f, twist, pose = self.stepper.free, self.stepper.workspaces.X.v, self.stepper.movers.pose
        a, b, state = self._shifting, self._turning, x.state
        if len(a.mover):
            state[a.q], state[a.v] = pose.take(a.source), twist.take(a.twist)
        if len(b.mover) and self.structure.model.planar:
            state[b.q] = self._reference[b.q] + f.angle.take(b.source)
            state[b.v] = twist.take(b.twist)
        elif len(b.mover):
            state[b.q] = self._sign * f.turn.take(b.source)
            rotation = pose[b.mover, 3:].reshape(-1, 3, 3)
            state[b.v] = (twist.take(b.twist)[:, None] @ rotation)[:, 0]  # R^T w, in body axes
        if self.held:
            state[self._to] = self.stepper.joints.clock.y.current.take(self._from)

    def sets(self) -> dict[str, BodySetMotion]:
        """Return the sets of bodies at the present time, by name."""
        recorder = OutputRecorder(self.stepper, None, np.zeros(0, np.int64))
        recorder.add(False)
        return body_sets(self._model, self._scene, recorder)

    def save(self) -> SavedState:
        """Return copies of the stepper's tables."""
        return self.stepper.save()

    def restore(self, saved: SavedState) -> None:
        """Return to a saved state."""
        self.stepper.restore(saved)


DEFAULT_RTOL = 1e-6
MOST_STEPS = 100_000  # integration steps within one step of the stepper


@dataclass(frozen=True, kw_only=True)
class StepperOptions(AnalysisOptions):
    """Arguments of `Mechanism.stepper`."""

    dt: float
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    method: str | Stepping
    rtol: float | None
    step: float | None
    coordinates: str
    parameters: Mapping[str, float] | None
    t_start: float
    copies: int | None
    threads: int

    def __post_init__(self) -> None:
        super().__post_init__()
        own = vars(self)
        own["dt"] = seconds(self.dt, "dt")
        own["step"] = None if self.step is None else seconds(self.step, "step")
        require_positive(self.dt, "dt")
        require_count(self.threads, "threads")
        if self.copies is not None:
            require_count(self.copies, "copies")
        if self.step is not None and self.rtol is not None:
            raise ModelError("rtol has no effect with steps of fixed width (step=); leave one of the two out")
        if self.copies is None and self.threads != 1:
            raise ModelError("threads divide copies; give their number, copies=, or leave threads out")

    def integration(self) -> Integration:
        """Return the options of an integration; they are checked."""
        rtol = DEFAULT_RTOL if self.rtol is None else self.rtol
        usual = default_integration(self.coordinates, rtol, None, MOST_STEPS)  # type: ignore[arg-type]
        method = usual.method if self.method == AUTO_METHOD else self.method
        return Integration(**{**usual.choices(), "method": method, "step": self.step})


@dataclass
class _Copy:
    """One copy of the mechanism: its motion, what is measured, the steps so far, and its start."""

    motion: StepMotion
    measurement: Measurement
    count: int = 0

    def __post_init__(self) -> None:
        self.start = self.save()

    def save(self) -> tuple[int, Any, Any]:
        return self.count, self.motion.save(), self.measurement.save()

    def restore(self, saved: tuple[int, Any, Any]) -> None:
        self.count = saved[0]
        self.motion.restore(saved[1])
        self.measurement.restore(saved[2])


@dataclass(frozen=True)
class StepperState:
    """A state of a `Stepper`, to which it can return; only `Stepper.state` reads it."""

    owner: object
    copies: tuple[tuple[_Copy, tuple[int, Any, Any]], ...]
    inputs: np.ndarray


class Stepper:
    """A mechanism, or several copies of it, advanced by steps of constant duration: see `Mechanism.stepper`.

    Arrays have a leading axis of length ``copies`` if that was given. The same steps give the same bits, with any
    number of threads.

    Attributes
    ----------
    dt : float [s]
        Duration of a step.
    input_names, output_names : tuple of str
        Order of the entries of inputs and outputs.
    copies : int, optional
        Number of copies; None: one, and arrays without an axis for copies.
    method : str
        How the motion is computed, and why.
    """

    def __init__(self, model: Model, o: StepperOptions) -> None:
        self._options, self.dt, self.copies = o, float(o.dt), o.copies
        self.input_names, self.output_names = tuple(o.inputs), tuple(o.outputs)
        self._model, self._parameters = model_with_inputs(model.snapshot(), self.input_names)
        env = self._model.environment(o.parameters or {})
        self._usual = np.array([float(env[name]) for name in self._parameters])
        self._resets: dict[tuple[Any, ...], Model] = {}
        self.method = _way_of_motion(self._model, o)
        count = o.copies or 1
        self._described = [self._begin(self._model, {}) for _ in range(count)]
        first = self._described[0].motion
        if isinstance(first, AbsoluteImpulseMotion):
            self.method += f"; steps of {first.chosen.text}"
        self._copies = list(self._described)
        self._inputs = np.tile(self._usual, (count, 1))
        self._outputs = np.zeros((count, len(self.output_names)))
        for k in range(count):
            self._measure(k)

    def _begin(self, model: Model, values: Mapping[str, float]) -> _Copy:
        """Return a copy at the start, as a model describes it."""
        o = self._options
        parameters = {**(o.parameters or {}), **values}
        motion: StepMotion
        if self.method.startswith(IMPULSE_STEPPING):
            stepping = o.method if isinstance(o.method, Stepping) else Stepping()
            motion = AbsoluteImpulseMotion(model, o.t_start, stepping, parameters, self._parameters)
        else:
            start = find_initial_state(model, o.t_start, parameters, None, o.coordinates)
            motion = IntegratedMotion(start, o.integration(), self.dt, self._parameters)
        x = Measurement(model, self.output_names, motion.tree, parameters, self._parameters)
        motion.measure_by(x)
        return _Copy(motion, x)

    def _measure(self, k: int) -> None:
        x = self._copies[k]
        x.motion.write_state(x.measurement)
        x.measurement.update(self._time(x))
        x.measurement.outputs(self._outputs[k])

    def _time(self, x: _Copy, steps: int = 0) -> float:
        return self._options.t_start + (x.count + steps) * self.dt

    def _shaped(self, x: np.ndarray) -> np.ndarray:
        """Return an array with the axis of copies only where there are copies."""
        return x if self.copies is not None else x[0]

    @property
    def t(self) -> float | np.ndarray:
        """Present time [s]; (copies,) of several copies."""
        if self.copies is None:
            return self._time(self._copies[0])
        return np.array([self._time(x) for x in self._copies])

    @property
    def names(self) -> tuple[str, ...]:
        """The coordinate whose rate each velocity is, (nv,)."""
        return tuple(x.name for x in velocity_names(self._copies[0].motion.structure))

    @property
    def q(self) -> np.ndarray:
        """Positions, (nq,) or (copies, nq), in the coordinates of the motion; see `Prepared` for their meaning."""
        return self._shaped(np.array([x.measurement.q for x in self._copies]))

    @property
    def v(self) -> np.ndarray:
        """Velocities, (nv,) or (copies, nv)."""
        return self._shaped(np.array([x.measurement.v for x in self._copies]))

    def outputs(self) -> np.ndarray:
        """Return the outputs at the present state, (ny,) or (copies, ny), in SI units."""
        return self._shaped(self._outputs.copy())

    def step(self, inputs: Any = None, steps: int = 1) -> np.ndarray:
        """Advance by a number of steps with constant inputs.

        Parameters
        ----------
        inputs : array_like, (nu,) or (copies, nu)
            In SI units, constant during the steps. If not given, those of the last step; at first the values of
            parameters, and zero for forces and motors.
        steps : int

        Returns
        -------
        ndarray, (ny,) or (copies, ny)
            Outputs at the end, in SI units.

        Raises
        ------
        ModelError
            If inputs have another shape or are not finite.
        SimulationError
            If the motion cannot continue. ``t`` is then the time before; `reset` its copy, or set `state`.
        """
        require_count(steps, "steps")
        if inputs is not None:
            self._set_inputs(inputs)
        numbers = range(len(self._copies))
        if self._pool is None:
            failed = [self._advance(k, steps) for k in numbers]
        else:
            failed = list(self._pool.map(self._advance, numbers, [steps] * len(self._copies)))
        for k, error in enumerate(failed):  # all copies were advanced, whatever happened to one
            if error is not None:
                if self.copies is not None:
                    error.args = (f"copy {k}: {error}", *error.args[1:])
                raise error
        return self.outputs()

    def _set_inputs(self, inputs: Any) -> None:
        try:
            u = np.asarray(inputs, float)
        except (TypeError, ValueError):
            raise ModelError(f"inputs of the stepper are numbers in SI units, not {inputs!r}") from None
        shape = self._inputs.shape if self.copies is not None else self._inputs.shape[1:]
        if u.shape != shape:
            names = ", ".join(self.input_names) or "no inputs"
            raise ModelError(f"inputs of the stepper have the shape {shape} ({names}), not {u.shape}")
        if not np.isfinite(u).all():
            raise ModelError(f"inputs of the stepper must be finite, got {u.tolist()}")
        self._inputs[:] = u

    def _advance(self, k: int, steps: int) -> FlyballError | None:
        """Advance a copy; returns why it cannot continue."""
        x = self._copies[k]
        x.motion.set_inputs(self._inputs[k])
        try:
            at_once = 1 if x.measurement.counts_turns else steps
            for _ in range(0, steps, at_once):
                x.motion.advance(self._time(x, at_once))
                x.count += at_once
                x.motion.write_state(x.measurement)
                x.measurement.update(self._time(x))
        except FlyballError as error:
            return error
        finally:
            x.measurement.outputs(self._outputs[k])
        return None

    @cached_property
    def _pool(self) -> ThreadPoolExecutor | None:
        threads = min(self._options.threads, len(self._copies))
        return ThreadPoolExecutor(threads) if threads > 1 else None

    def reset(self, values: Mapping[str, float | Sequence[float]] | None = None, copy: int | None = None) -> np.ndarray:
        """Return to the start, with other initial values if they are given; inputs return to their first values.

        Parameters
        ----------
        values : mapping, optional
            Coordinate such as ``"A.angle"`` or ``"cart.x"`` to its value, or to value and rate: numbers in SI units or
            quantities such as ``"30 deg"``, None where one is free. A value alone leaves a described rate. The
            mechanism is assembled with them, as with `Initial`.
        copy : int, optional
            Number of one copy; by default all copies are reset.

        Returns
        -------
        ndarray, (ny,) or (copies, ny)
            Outputs of all copies.

        Raises
        ------
        AssemblyError
            If there is no position with these values.
        """
        if copy is not None:
            self._require_copy(copy)
        for k in range(len(self._copies)) if copy is None else (copy,):
            if values:
                self._copies[k] = self._begin(*self._model_at(values))
            else:
                self._copies[k] = self._described[k]
                self._copies[k].restore(self._copies[k].start)
            self._inputs[k] = self._usual
            self._measure(k)
        return self.outputs()

    def _require_copy(self, copy: int) -> None:
        last = len(self._copies) - 1
        if isinstance(copy, bool) or not isinstance(copy, int) or not 0 <= copy <= last:
            raise ModelError(f"copy is a number from 0 to {last}, got {copy!r}")

    def _model_at(self, values: Mapping[str, float | Sequence[float]]) -> tuple[Model, dict[str, float]]:
        """Return the model with initial values that are parameters, and the values of these."""
        if not isinstance(values, Mapping):
            raise ModelError(f"values of a reset are a mapping such as {{'A.angle': (0.1, 2.0)}}, not {values!r}")
        numbers, described = dict[str, float](), []
        for k, (name, x) in enumerate(values.items()):
            pair = tuple(x) if isinstance(x, list | tuple) else (x,)
            made: dict[str, Any] = {}
            unit = self._model.unit(name, Initial(name, value=0.0))
            for field, given, per in zip(("value", "rate"), pair, ("", "/s"), strict=False):
                if given is not None:
                    made[field] = f"initial_{field}_{k}"
                    numbers[made[field]] = float(number(given, {}, unit + per, f"{field} of {name!r} in reset"))
            if len(pair) > 2 or not made:
                raise ModelError(f"{name!r} is reset to a value, or to value and rate, not to {x!r}")
            kept = next((i for i in self._model.initial if i.name == name), None)
            if len(pair) == 1 and kept is not None and kept.rate is not None:
                made["rate"] = kept.rate
            described.append(Initial(name, **made))
        key = tuple((e.name, e.value is not None, e.rate) for e in described)
        if key not in self._resets:
            out = self._model.copy()
            out.parameters.update(numbers)
            for e in described:
                out.initial = [i for i in out.initial if i.name != e.name]
                out.add(e)
            self._resets[key] = out.snapshot()
        return self._resets[key], numbers

    @property
    def state(self) -> StepperState:
        """The complete state of all copies: setting it continues with the same bits."""
        return StepperState(self, tuple((x, x.save()) for x in self._copies), self._inputs.copy())

    @state.setter
    def state(self, saved: StepperState) -> None:
        """Return to a state that this stepper gave."""
        if not isinstance(saved, StepperState) or saved.owner is not self:
            raise ModelError("the state is one that this stepper gave; others may have other parameters or methods")
        for k, (x, of_copy) in enumerate(saved.copies):
            x.restore(of_copy)
            self._copies[k] = x
            self._measure(k)
        self._inputs[:] = saved.inputs

    def sample(self, copy: int = 0) -> StateSample:
        """Return time, state and inputs of a copy, from which `motion` makes a result."""
        self._require_copy(copy)
        x = self._copies[copy]
        return x.measurement.sample(self._time(x), self._inputs[copy], x.motion.sets())

    def motion(self, samples: Sequence[StateSample]) -> Result:
        """Return the motion through samples of this stepper, in the order of time, as a result.

        It has positions, velocities, energies of the bodies, what laws measure, and forces of laws. Laws are evaluated
        with the inputs of the step that ended in the sample; at the start with the values of parameters, and zero for
        forces and motors. Accelerations and reactions are nan: steps do not keep them.

        Raises
        ------
        ModelError
            If there are no samples.
        """
        return self._copies[0].measurement.motion(samples)

    def pose(self, name: str) -> tuple[np.ndarray, np.ndarray]:
        """Return position [m] and rotation of a body's reference frame or a named frame, in the world.

        Returns
        -------
        position : ndarray, (3,) or (copies, 3)
        rotation : ndarray, (3, 3) or (copies, 3, 3)
            The frame's axes as columns.
        """
        return self._stacked([x.measurement.pose(name) for x in self._copies])

    def velocity(self, name: str) -> tuple[np.ndarray, np.ndarray]:
        """Return the velocity of a frame's origin [m/s] and its angular velocity [rad/s], along the world's axes.

        Returns
        -------
        velocity, angular_velocity : ndarray, (3,) or (copies, 3)
        """
        return self._stacked([x.measurement.velocity(name) for x in self._copies])

    def _stacked(self, pairs: Sequence[tuple[np.ndarray, np.ndarray]]) -> tuple[np.ndarray, np.ndarray]:
        first, second = (self._shaped(np.array(x)) for x in zip(*pairs, strict=True))
        return first, second

    def __repr__(self) -> str:
        return (
            f"stepper      {self._model.name}, steps of {self.dt:g} s"
            f"{'' if self.copies is None else f', {self.copies} copies'}\n"
            f"inputs       {', '.join(self.input_names) or 'none'}\n"
            f"outputs      {', '.join(self.output_names) or 'none'}\n"
            f"method       {self.method}"
        )


def _way_of_motion(model: Model, o: StepperOptions) -> str:
    """Return how the motion is computed, and why.

    Raises
    ------
    ModelError
        If the method, or every method, does not support the model or the options.
    """
    name = model.name
    if sampled := [e.title for e in model.controllers if e.sampled]:
        raise ModelError(
            f"a stepper of {name!r} does not sample {sampled[0]}: compute its output between the steps and give it as "
            "an input, or leave out its period"
        )
    switching = [e.title for e in unsupported_elements(model)]
    unknown = unknown_to_impulse_stepping(model)
    if (o.method not in (AUTO_METHOD, IMPULSE_METHOD) and not isinstance(o.method, Stepping)) or not (
        switching or o.method != AUTO_METHOD
    ):
        if switching:
            raise ModelError(
                f"a stepper of {name!r} with method={o.method!r} does not support {switching[0]}: leave method out, "
                "and it uses impulse time stepping"
            )
        used = o.integration()
        return f"{used.method}, {f'steps of {used.step:g} s' if used.step else f'rtol {used.rtol:g}'}"
    if unknown:
        other = next((x for x in switching if x not in unknown), "")
        why = f" together with {other}" if other else ""
        names = ", ".join(f"{e.name!r}: None" for e in model.elements() if e.title in unknown)
        raise ModelError(
            f"a stepper of {name!r} does not support {unknown[0]}{why}; compute what it does between the steps. "
            f"Without it: m.changed({{{names}}}).stepper(...)"
        )
    if o.step is not None:
        raise ModelError(f"{IMPULSE_STEPPING} takes its step as method=fb.Stepping(step=...); leave step= out")
    if o.rtol is not None:
        raise ModelError(f"rtol has no effect with {IMPULSE_STEPPING}; leave it out")
    if o.coordinates == "joint":
        raise ModelError(f"{IMPULSE_STEPPING} uses absolute coordinates; leave coordinates='joint' out")
    return f"{IMPULSE_STEPPING}: {'as requested' if o.method != AUTO_METHOD else f'for {switching[0]}'}"


def make_stepper(model: Model, o: StepperOptions) -> Stepper:
    """Return the stepper: see `Mechanism.stepper`."""
    return Stepper(model, o)
