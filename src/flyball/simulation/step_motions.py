"""Motions that advance from one step to the next: integrated ones, and those by impulse time stepping."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple, Protocol

import numpy as np

from ..engine.entry_point import INTEGRATE
from ..errors import ModelError, SimulationError
from ..laws.breakpoints import NO_BREAKPOINTS, Breakpoints, rounding_margin
from ..laws.bytecode import CONSTANT
from ..laws.python_functions import clear_faults, deferred_interrupts
from ..model.model import Model
from ..numerics.integrators import time_loop as ex
from ..numerics.integrators.butcher_tableaux import tableau
from ..results.part_views.bodies import BodySetMotion
from ..tables.structure_definition import Structure
from ..tables.table_definitions import assign, copied
from .diagnosis import failure_reason
from .impulse_stepping.impulse_simulation import NO_WAY_MESSAGE, OutputRecorder, begin_by_impulses, body_sets
from .impulse_stepping.impulse_stepper import NoSolution, SavedState
from .initial_state import InitialState
from .integration_intervals import SmoothIntervals, known_breaks, laws_checked_in_steps, laws_of_time
from .integration_options import Integration, Stepping
from .measurement import Measurement
from .simulate import clock_for, row_width

HORIZON = 1000  # steps whose duration scales the tolerances of an integration, as the time span of a simulation does;
# breakpoints of laws are found for as many at once


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


class KnownBreaks(NamedTuple):
    """Breakpoints of laws between two times [s], with these values of the inputs."""

    begin: float
    end: float
    inputs: bytes
    found: Breakpoints


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
        read = [x.operand for _, steps in laws_of_time(c) for x in steps if x.operation == CONSTANT]
        self._law_inputs = np.intersect1d(self._inputs, np.array(read, np.int64))
        self._ahead, self._known = HORIZON * dt, KnownBreaks(np.inf, -np.inf, b"", NO_BREAKPOINTS)
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
            intervals = SmoothIntervals(clock, self._breaks_until(t))
        with deferred_interrupts(self.structure.functions):
            while True:
                clock.count.accepted = clock.count.rejected = 0
                if intervals is not None:
                    intervals.passed()
                self._call(INTEGRATE)
                if clock.count.status != ex.DONE or intervals is None or not intervals.next():
                    break
        if clock.count.status != ex.DONE:
            message, cause = failure_reason(
                self.start.assembly, self.start.base, clock, with_result=False, method=self.method
            )
            raise SimulationError(message, None, float(clock.real.t)) from cause

    def _breaks_until(self, t: float) -> Breakpoints:
        """Return the breakpoints of laws from the present time to time t, found for many steps at once."""
        now, inputs = float(self.clock.real.t), self.c.system.const[self._law_inputs].tobytes()
        known = self._known
        if inputs != known.inputs or not known.begin <= now <= t <= known.end:
            end = max(t, now + self._ahead) if inputs == known.inputs or not known.inputs else t
            found = known_breaks(self.c, now, end)
            if found.given_up and end > t:  # they are too many for so long a time
                self._ahead, end = 0.0, t
                found = known_breaks(self.c, now, end)
            known = self._known = KnownBreaks(now, end, inputs, found)
        times = known.found.times
        due = (times >= now) & (times <= t + rounding_margin(t))
        return Breakpoints(times[due], known.found.sharp[due], known.found.given_up)

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
