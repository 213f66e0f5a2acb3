"""The stepper: a mechanism that another program advances step by step, with inputs and outputs as arrays."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from ..analysis_options import AnalysisOptions, require_count, require_positive, seconds
from ..errors import FlyballError, ModelError
from ..model.body import Initial
from ..model.expressions import number
from ..model.model import Model
from ..model.unsupported_elements import unsupported_elements
from ..results.result import Result
from ..tables.structure_definition import velocity_names
from .initial_state import find_initial_state
from .integration_options import Integration, Stepping, default_integration
from .measurement import Measurement, StateSample, model_with_inputs
from .method_choice import AUTO_METHOD, IMPULSE_METHOD, IMPULSE_STEPPING, unknown_to_impulse_stepping
from .step_motions import AbsoluteImpulseMotion, IntegratedMotion, StepMotion

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
    if isinstance(o.method, Stepping) and o.method.history is not None:
        raise ModelError(
            f"a stepper of {name!r} has no result that would keep history={o.method.history!r}; leave it out"
        )
    if o.rtol is not None:
        raise ModelError(f"rtol has no effect with {IMPULSE_STEPPING}; leave it out")
    if o.coordinates == "joint":
        raise ModelError(f"{IMPULSE_STEPPING} uses absolute coordinates; leave coordinates='joint' out")
    return f"{IMPULSE_STEPPING}: {'as requested' if o.method != AUTO_METHOD else f'for {switching[0]}'}"


def make_stepper(model: Model, o: StepperOptions) -> Stepper:
    """Return the stepper: see `Mechanism.stepper`."""
    return Stepper(model, o)
