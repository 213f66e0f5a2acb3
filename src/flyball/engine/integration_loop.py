"""Integration loops: steps of any method called by address, with or without event detection; explicit methods.

A step method is a kernel that a loop calls by address. The explicit methods are here, others in `implicit_steps` and
`fixed_step_methods`. The loops are those of `numerics/integrators`, which call the engine and the method by address.

With events, the quantities that guards depend on are stored at the ends of every step, and multipliers and loads also
at some places within it. Between the ends, guards are evaluated by the same formula on another `Work`, whose measured
quantities and multipliers are interpolated. Without events, the arrays of a loop are laid out once and copied for each
run (`kernels.StructPool`).
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any, NamedTuple, Protocol

import numpy as np

from ..compiler.formulas import formula
from ..compiler.kernels import ArrayBuffer, BoundKernel, JoinedBuffer, PooledBuffer, StructBuffer, StructPool, kernel
from ..compiler.struct_layout import Array, Float2, Int1
from ..constraints.switches.switch_kind import DISTANCE_GUARDS, FORCE_GUARDS, G_BACK, G_SHARED, G_TURNS, RATE_GUARDS
from ..numerics.complementarity.interior_point import UNKNOWN_COUNT
from ..numerics.event_location.event_steps import finish_step_with_events, start_event_segment
from ..numerics.event_location.guards import (
    START,
    GuardState,
    allocate_guard_state,
    predict_sensed,
)
from ..numerics.integrators.butcher_tableaux import Tableau
from ..numerics.integrators.explicit_runge_kutta import run_explicit_task
from ..numerics.integrators.time_loop import (
    TRY_STEP,
    StateVectors,
    StepCounts,
    StepReals,
    StepState,
    advance,
    finish_step,
    no_segment_start,
)
from ..tables.structure_definition import Structure
from ..tables.table_definitions import Sensed, System, Work
from .calls import (
    ENGINE,
    GROUP,
    GUARD_VALUES,
    MOTION,
    OUTPUT,
    OWN,
    R_,
    S_,
    W_,
    OutputBuffer,
    call_engine,
    call_step_method,
    engine_arrive,
    engine_inspect,
    engine_report,
    engine_tangent,
    set_state,
)
from .entry_point import engine, idle_tableau, struct_tables
from .guards import (
    GROUP_ROUNDING,
    ForceDistribution,
    call_group_guard,
    corner_tolerances,
    empty_distribution,
    group_guard_kernel,
    guard_rounding,
    update_null_vectors,
)
from .guards import evaluate_guards as guards
from .rows import count_measured, largest_measured_rate
from .sampled_controllers import SampledControllers, SamplePlan
from .sampled_controllers import advance_between_samples as from_instant_to_instant


class EngineArguments(NamedTuple):
    """Arguments of the engine besides tables and workspace."""

    clock: StepState  # the engine's integrator state: time and state at which it evaluates
    output: OutputBuffer
    R: Tableau
    doors: Int1  # addresses of the engine, and of the residuals where they are used


class RunState(NamedTuple):
    """State of a running integration."""

    clock: StepState
    watch: GuardState
    group: ForceDistribution  # active constraints with indeterminate forces


@formula
def store_levels(A, K, at):
    """Store the values whose rates are not known: multipliers, loads and the like."""
    W = A[W_]
    n = K.rows.shape[0]
    for k in range(n):
        K.levels[at, k] = W.rows.multiplier[K.rows[k]]
    for k in range(K.sensed_places.shape[0]):
        K.levels[at, n + k] = W.sensed[K.sensed_places[k, 0], K.sensed_places[k, 1]]


@formula
def store_guards_within(A, K, j):
    """Store guards and levels at place j within a step; the engine has just run GUARD_VALUES there."""
    S, last = A[S_], K.way.shape[0] - 1
    for i in range(last + 1):
        K.compared_values[j, i] = A[OUTPUT].rows[0, i]
    if S.guards.kind[last] == G_SHARED:
        call_group_guard(S, A[W_], A[OWN].real.t, A[GROUP], K, K.compared_values[j])
    for k in range(K.stages.shape[0]):
        if K.stages[k] == K.compared_stages[j]:
            store_levels(A, K, 1 + k)


@formula
def stage_derivative(t, y, dy, A, K):
    """Evaluate the right-hand side; store guards and their inputs at the stages chosen for it."""
    own = A[OWN]
    set_state(own, t, y)
    K.count.stage += 1
    met = -1
    for j in range(K.compared_stages.shape[0]):
        if K.compared_stages[j] == K.count.stage:
            met = j
    status = call_engine(A, GUARD_VALUES if met >= 0 else MOTION)
    if status == 0:
        for i in range(dy.shape[0]):
            dy[i] = own.K[0, i]
    if met >= 0:
        store_guards_within(A, K, met)
    return status


@formula
def perform_explicit(S, W, R, engine_arguments, run_state, task):
    """Run a task of `explicit_runge_kutta.run_explicit_task` with the engine."""
    if task == TRY_STEP:
        run_state.watch.count.stage = 0
    A = (engine_arguments.doors[0], S, W, R, engine_arguments.clock, engine_arguments.output, run_state.group)
    return run_explicit_task(
        (stage_derivative, engine_arrive, engine_tangent, engine_inspect), A, run_state.watch, R, run_state.clock, task
    )


@kernel
def explicit_steps(
    S: System, W: Work, R: Tableau, engine_arguments: EngineArguments, run_state: RunState, task: int
) -> int:
    """`perform_explicit` as a kernel."""
    return perform_explicit(S, W, R, engine_arguments, run_state, task)


class ExplicitMethod:
    """Steps of an explicit method.

    Parameters
    ----------
    R : Tableau
    """

    failed, width = None, 0  # the engine writes a row of output

    def __init__(self, R: Tableau) -> None:
        self.R, self.c, self.stages = R, R.c, int(R.order_i[1])

    def bind(
        self,
        tables: StructBuffer,
        scratch: StructBuffer,
        engine_arguments: StructBuffer,
        run_state: StructBuffer,
        doors: np.ndarray,
    ) -> BoundKernel:
        """The kernel bound to these structures."""
        return BoundKernel(explicit_steps, tables, scratch, StructBuffer(self.R), engine_arguments, run_state)


INTERPOLATED = 7
# relative to `GuardState.tied`, or the fastest rate: what active rows leave of quantities they keep at zero
HELD_RESIDUE = 1e-10


@formula
def evaluate_all_guards(A, W, t, K, out):
    """Write all guards to ``out``, from the values in W; the group's guard last, followed by its terms."""
    S, last = A[S_], K.way.shape[0] - 1
    remove_rate_residue(S, W, K)
    guards(S, W, t, out)
    remove_guard_residue(S, W, K, out)
    if S.guards.kind[last] == G_SHARED:
        call_group_guard(S, W, t, A[GROUP], K, out)


@formula
def remove_guard_residue(S, W, K, out):
    """Remove from guards that active constraints keep at zero the residue that these leave."""
    fastest = -1.0
    for i in range(K.tied.shape[0]):
        if K.tied[i] > 0.0:
            least = HELD_RESIDUE * K.tied[i]
            if S.guards.kind[i] == G_BACK:
                fastest = largest_measured_rate(S, W) if fastest < 0.0 else fastest
                unit = S.units[S.switches.measured[S.guards.of[i]]]
                least = HELD_RESIDUE * max(fastest * unit, K.tied[i])
            out[i] -= min(max(out[i], -least), least)


@formula
def remove_rate_residue(S, W, K):
    """Remove the residue from rates that event expressions use and active constraints keep at zero."""
    fastest, nm = -1.0, count_measured(S)
    for m in range(nm):
        if K.still[m] > 0.0:
            fastest = largest_measured_rate(S, W) if fastest < 0.0 else fastest
            least = HELD_RESIDUE * max(fastest * S.units[m], K.still[m])
            x = W.sensed.value[nm + m]
            W.sensed.value[nm + m] -= min(max(x, -least), least)


@formula
def renew_group(A):
    """Update the null vectors of the group to the state last evaluated."""
    update_null_vectors(A[ENGINE], A[S_], A[W_], A[R_], A[OWN], A[OUTPUT], A[GROUP])


@formula
def evaluate_with_guards(t, y, A, K, out):
    """Evaluate the equations at a state, and write the guards there to ``out``. Returns a status."""
    own = A[OWN]
    set_state(own, t, y)
    status = call_engine(A, MOTION)
    if status == 0:
        renew_group(A)
    evaluate_all_guards(A, A[W_], t, K, out)
    return status


@formula
def store_guard_inputs(A, K, end):
    """Store the guards, and the quantities that they depend on, at the state last evaluated; ``end``: START or END."""
    S, W = A[S_], A[W_]
    nr = S.rows.law.shape[0]
    for m in range(count_measured(S)):
        a = W.sensed.bias[m]
        for e in range(S.row_start[nr + m], S.row_start[nr + m + 1]):
            a += W.G[e] * W.velocities.solved[S.column[e]]
        K.moving[end, 0, m], K.moving[end, 1, m], K.moving[end, 2, m] = W.sensed.value[m], W.sensed.rate[m], a
    store_levels(A, K, 0 if end == START else K.levels.shape[0] - 1)
    renew_group(A)
    evaluate_all_guards(A, W, A[OWN].real.t, K, K.guards.start if end == START else K.guards.end)
    rounding = K.guards.start_rounding if end == START else K.guards.end_rounding
    K.real.fastest = max(K.real.fastest, largest_measured_rate(S, W))
    guard_rounding(S, W, A[OWN].real.t, A[INTERPOLATED].sensed, K.real.fastest, rounding)
    corner_tolerances(S, W, A[OWN].real.t, K.guards.corner_depth)
    last = K.grain.shape[0] - 1
    if S.guards.kind[last] == G_SHARED:
        rounding[last] = GROUP_ROUNDING * A[GROUP].size[0]
    for i in range(K.grain.shape[0]):
        rounding[i] = max(rounding[i], K.least[i])
        K.grain[i] = rounding[i] if K.nonnegative[i] == 1 else min(K.guards.start_rounding[i], rounding[i])


@formula
def interpolated_guards(t, h, x, A, K, out):
    """Write the guards from interpolated quantities at fraction x of the step that begins at t to ``out``."""
    predict_sensed(K, x, h)
    evaluate_all_guards(A, A[INTERPOLATED], t + x * h, K, out)


@kernel
def event_loop_kernel(
    method: Int1,
    address: int,
    S: System,
    W: Work,
    R: Tableau,
    engine_clock: StepState,
    output: OutputBuffer,
    group: ForceDistribution,
    expected: Work,
    detection: GuardState,
    clock: StepState,
    out: Float2,
) -> int:
    """Continue an integration with event detection.

    ``method``: see `formulas.call_bound`; ``address``: the engine's.
    """
    A = (address, S, W, R, engine_clock, output, group, expected)
    callbacks = (
        call_step_method,
        method,
        engine_report,
        start_event_segment,
        finish_step_with_events,
        evaluate_with_guards,
        store_guard_inputs,
        interpolated_guards,
    )
    return advance(callbacks, A, detection, R, clock, out)


@formula
def integrate_between_samples(X, rows):
    """Integration loop without event detection."""
    callbacks, A, K, R, c = X
    return advance(callbacks, A, K, R, c, rows)


@kernel
def sampled_steps_kernel(
    method: Int1,
    address: int,
    S: System,
    W: Work,
    R: Tableau,
    engine_clock: StepState,
    output: OutputBuffer,
    detection: GuardState,
    clock: StepState,
    P: SamplePlan,
    part: Float2,
    out: Float2,
) -> int:
    """Continue an integration without event detection, from one sampling instant to the next.

    ``part``: rows of output between two instants.
    """
    A = (address, S, W, R, engine_clock, output)
    X = ((call_step_method, method, engine_report, no_segment_start, finish_step), A, detection, R, clock)
    return from_instant_to_instant(integrate_between_samples, X, (address, S, W, R, clock, output, P), part, out)


class StepMethod(Protocol):
    """Steps of a method that is called by address."""

    R: Tableau
    c: np.ndarray  # stages of a method at which guards may be evaluated, as fractions of the step
    stages: int  # number of these stages
    failed: Exception | None  # the method's own reason for stopping, if there is one

    def bind(
        self,
        tables: StructBuffer,
        scratch: StructBuffer,
        engine_arguments: StructBuffer,
        run_state: StructBuffer,
        doors: np.ndarray,
    ) -> BoundKernel:
        """The kernel bound to a System, a Work, an `EngineArguments` and a `RunState`.

        ``doors``: field of `EngineArguments`; the method sets its second entry.
        """


def guard_classes(S: System) -> np.ndarray:
    """Class of each guard, (ng,): 1 if positive while modes are right, 2 if it is also a distance or rate, else 0.

    Guards of slip in the plane are among them: sliding from rest keeps its direction. In space the direction turns
    freely.
    """
    kinds, of = S.guards.kind, S.guards.of
    slips = np.flatnonzero(kinds == G_TURNS)
    kept = np.isin(kinds, (*DISTANCE_GUARDS, *RATE_GUARDS, *FORCE_GUARDS, G_SHARED)) & (kinds != G_TURNS)
    kept[slips[S.switches.partner[of[slips]] < 0]] = True
    return np.where(kept, np.where(np.isin(kinds, (*DISTANCE_GUARDS, *RATE_GUARDS)), 2, 1), 0)


def _event_workspace(S: System, expected: Work, c: np.ndarray, stages: int) -> GuardState:
    """Workspace of a loop with event detection."""
    nm = len(S.row_start) - 1 - len(S.rows.law)
    rows = np.unique(S.switches.row[S.switches.row >= 0])
    columns = np.arange(2 * nm, expected.sensed.shape[1])
    loads = columns[: len(columns) - len(S.switches.row)]
    entries = Sensed.layout.entries
    spots = [(entries["value"][0], m) for m in columns] + [(entries["returned"][0], m) for m in loads]
    there = expected.sensed, expected.rows.multiplier
    guarded = S.guards.direction, guard_classes(S)
    return allocate_guard_state(*guarded, c, stages, nm, rows, np.array(spots, int), there, 3 * len(S.switches.row))


@lru_cache(maxsize=16)
def idle_event_workspace(c: bytes, stages: int) -> StructBuffer:
    """Empty guard workspace, shared by all loops without guards."""
    none, empty = np.zeros(0, np.int64), (Sensed.blank(0), np.zeros(0))
    return StructBuffer(allocate_guard_state(none, none, np.frombuffer(c).copy(), stages, 0, none, none, empty))


class GuardedLoop:
    """Integration loop with event detection or sampling, and its arrays.

    Parameters
    ----------
    steps : StepMethod
    clock : StepState
        Of the integration.
    s : Structure
    S : System
    scratch : PooledBuffer
        The Work.
    width : int
        Length of a row of output, and of what the method has the engine write.
    group : ForceDistribution
        Active constraints with indeterminate forces.
    """

    def __init__(
        self,
        steps: Any,
        clock: StepState,
        s: Structure,
        S: System,
        scratch: PooledBuffer,
        width: int,
        group: ForceDistribution,
    ) -> None:
        self.steps, self.clock, self.s, self.S, self.scratch = steps, clock, s, S, scratch
        W = scratch.fields
        self._known = [idle_tableau()]
        if len(S.guards.kind):
            self.expected = W._replace(
                sensed=W.sensed.copy(), rows=W.rows._replace(multiplier=W.rows.multiplier.copy())
            )
            self.guard_state = _event_workspace(S, self.expected, steps.c, steps.stages)
        else:  # neither read nor written
            self.expected = W
            idle = idle_event_workspace(steps.c.tobytes(), steps.stages)
            self.guard_state = idle.fields
            self._known.append(idle)
        ny = clock.y.shape[1]
        own = StepState(
            clock.real.copy(), clock.count.copy(), clock.times, StateVectors.blank(ny), np.zeros((1, ny)),
            clock.integrals, clock.inspection,
        )  # fmt: skip
        self.group, nv = group, W.velocities.solved.shape[0]
        sheet = OutputBuffer(np.zeros((4, max(width, len(S.guards.kind), nv, len(S.rows.law), 1))))
        self.arguments = EngineArguments(own, sheet, self._known[0].fields, np.zeros(2, np.int64))
        self._bound: BoundKernel | None = None
        self._clock, self._watch, self._group = (StructBuffer(x) for x in (clock, self.guard_state, group))
        self._expected = StructBuffer(self.expected)
        self._own = [self._known[0], StructBuffer(own), StructBuffer(sheet)]

    def go_on(self, S: System, out: np.ndarray, sampling: SampledControllers | None = None) -> int:
        """Continue until an event, the end, or another reason of `time_loop.advance`.

        Returns the number of rows written. Without event detection, controllers in ``sampling`` are sampled on the way.
        """
        x = self.arguments
        if self._bound is None or S is not self.S:
            x.doors[0] = engine.address
            own, going = (
                StructBuffer(f, *self._known) for f in (x, RunState(self.clock, self.guard_state, self.group))
            )
            written = struct_tables(self.s, S)
            self.S, self._bound = S, self.steps.bind(written, self.scratch, own, going, x.doors)
            method = ArrayBuffer(self._bound.words, Array("i8", 1), "method")
            self._asked = method, engine.address, written, self.scratch, *self._own
        if self.group.Q.count[UNKNOWN_COUNT] and not self.group.door[0]:
            self.group.door[0] = group_guard_kernel.address
        asked = self._asked
        if not len(S.guards.kind) and sampling is not None:
            plan, part = sampling.plan, sampling.output.rows
            return int(sampled_steps_kernel(*asked, self._watch, self._clock, plan, part, out))
        return int(event_loop_kernel(*asked, self._group, self._expected, self._watch, self._clock, out))

    @property
    def fired(self) -> tuple[int, ...]:
        """Guards whose events ended the last step."""
        return tuple(np.flatnonzero(self.guard_state.fired).tolist())


MAX_LOOP_LAYOUTS = 4  # layouts that are cached for each structure


class LoopOutput(NamedTuple):
    """Method (`BoundKernel.words`) and rows of output."""

    method: Int1
    rows: Float2


@formula
def integrate_smooth(S, W, engine_arguments, run_state, out):
    """Continue an integration. Returns the number of rows written."""
    A = (engine_arguments.doors[0], S, W, engine_arguments.R, engine_arguments.clock, engine_arguments.output)
    callbacks = (call_step_method, out.method, engine_report, no_segment_start, finish_step)
    return advance(callbacks, A, run_state.watch, engine_arguments.R, run_state.clock, out.rows)


@kernel
def smooth_loop_kernel(
    S: System, W: Work, engine_arguments: EngineArguments, run_state: RunState, out: LoopOutput, task: int
) -> int:
    """`integrate_smooth` as a kernel."""
    return integrate_smooth(S, W, engine_arguments, run_state, out)


@lru_cache(maxsize=1)
def _no_group() -> StructBuffer:
    """Empty group."""
    return StructBuffer(empty_distribution(0, 0))


def _engine_arguments(ny: int, width: int, inspected: np.ndarray) -> EngineArguments:
    """Arguments of the engine besides tables and workspace.

    Of the integrator state only time, state and inspection data are used.
    """
    none = np.zeros(0, np.int64)
    clock = StepState(
        StepReals.blank(), StepCounts.blank(), np.zeros(0), StateVectors.blank(ny), np.zeros((1, ny)), none, inspected
    )
    return EngineArguments(clock, OutputBuffer(np.zeros((4, width))), idle_tableau().fields, np.zeros(2, np.int64))


class SmoothLoop:
    """Integration loop without events or sampling, and its arrays.

    Parameters
    ----------
    steps : StepMethod
    clock : StepState
        Of the integration.
    s : Structure
    S : System
    scratch : StructBuffer
        The Work.
    width : int
        Length of a row of output, and of what the method has the engine write.
    """

    fired = ()

    def __init__(
        self, steps: Any, clock: StepState, s: Structure, S: System, scratch: StructBuffer, width: int
    ) -> None:
        self.steps, self.clock, self.s, self.scratch = steps, clock, s, scratch
        ny, width, R = clock.y.shape[1], max(width, s.nv, len(s.rows), 1), idle_tableau()
        if clock.inspection.shape[1]:
            own = _engine_arguments(ny, width, clock.inspection)
            self.arguments, doors = StructBuffer(own, R), own.doors
        else:
            mould = s.cache.get(
                "own desk",
                (ny, width),
                MAX_LOOP_LAYOUTS,
                lambda: StructPool(_engine_arguments(ny, width, clock.inspection), R.fields),
            )
            self.arguments, doors = (made := mould.new()), made.array("doors")
        watch = idle_event_workspace(steps.c.tobytes(), steps.stages)
        self.going = JoinedBuffer(RunState, StructBuffer(clock), watch, _no_group())
        written = struct_tables(s, S)
        doors[0] = engine.address
        self.bound = steps.bind(written, scratch, self.arguments, self.going, doors)
        self._loop: tuple[np.ndarray, BoundKernel] | None = None

    def go_on(self, out: np.ndarray) -> int:
        """Continue until the end, or another reason of `time_loop.advance`. Returns the number of rows written."""
        if self._loop is None or self._loop[0] is not out:
            rows = StructBuffer(LoopOutput(self.bound.words, out))
            self._loop = (
                out,
                BoundKernel(smooth_loop_kernel, self.bound.buffers[0], self.scratch, self.arguments, self.going, rows),
            )
        return self._loop[1](0)
