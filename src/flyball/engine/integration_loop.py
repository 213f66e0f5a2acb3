"""Integration loops: steps of any method called by address, with event detection or without; explicit methods.

A step method is a kernel that a loop calls by address; the explicit methods are here, others in `implicit_steps`
and `fixed_step_methods`. The loops are those of `numerics/integrators`, which call the engine and the method by
address.

With events, what guards depend on is kept at the ends of every step, and multipliers and loads at some places
within it; between the ends guards are the same formula on another `Work`, whose measured quantities and multipliers
are interpolated. Without events, everything the loop needs is laid out once and copied for each run
(`kernels.StructPool`).
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any, NamedTuple, Protocol

import numpy as np

from ..compiler.formulas import formula
from ..compiler.kernels import ArrayBuffer, BoundKernel, JoinedBuffer, PooledBuffer, StructBuffer, StructPool, kernel
from ..compiler.struct_layout import Array, Float2, Int1
from ..numerics.complementarity.interior_point import UNKNOWN_COUNT
from ..numerics.event_location.event_steps import finish_step_with_events, start_event_segment
from ..numerics.event_location.guards import (
    CORNER_DEPTHS,
    END_ROUNDING,
    START_ROUNDING,
    START_VALUES,
    GuardState,
    allocate_guard_state,
    predict_sensed,
)
from ..numerics.integrators.butcher_tableaux import Tableau, tableau
from ..numerics.integrators.explicit_runge_kutta import run_explicit_task
from ..numerics.integrators.time_loop import (
    TRY_STEP,
    StepCounts,
    StepReals,
    StepState,
    advance,
    finish_step,
    no_segment_start,
)
from ..tables.structure_definition import Structure
from ..tables.table_definitions import BIAS, G_BACK, G_SHARED, G_TURNS, RATE, RETURNED, VALUE, System, Work
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
from .entry_point import engine, struct_tables
from .guards import (
    GROUP_ROUNDING,
    KINEMATIC_GUARDS,
    MODE_GUARDS,
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
    """What goes to the engine's door besides tables and scratch."""

    clock: StepState  # its desk: time and state that it is asked for
    output: OutputBuffer
    R: Tableau
    doors: Int1  # addresses of the engine, and of the residuals where they are asked


class RunState(NamedTuple):
    """A motion that is going on."""

    clock: StepState
    watch: GuardState
    group: ForceDistribution  # what holds together


@formula
def store_levels(A, K, at):
    """Keep what has no known rate."""
    W = A[W_]
    n = K.rows.shape[0]
    for k in range(n):
        K.levels[at, k] = W.rows.multiplier[K.rows[k]]
    for k in range(K.sensed_places.shape[0]):
        K.levels[at, n + k] = W.sensed[K.sensed_places[k, 0], K.sensed_places[k, 1]]


@formula
def store_guards_within(A, K, j):
    """Keep guards and levels at place j of those that are met within a step; the engine has just done WATCH there."""
    S, last = A[S_], K.way.shape[0] - 1
    for i in range(last + 1):
        K.compared_values[j, i] = A[OUTPUT].rows[0, i]
    if S.guards.kind[last] == G_SHARED:
        call_group_guard(S, A[W_], A[OWN].real.t, A[GROUP], K, -1 - j)
    for k in range(K.stages.shape[0]):
        if K.stages[k] == K.compared_stages[j]:
            store_levels(A, K, 1 + k)


@formula
def stage_derivative(t, y, dy, A, K):
    """The right-hand side; guards and what they depend on are kept at the stages chosen for it."""
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
    """`explicit_runge_kutta.run_explicit_task`, asked of the engine."""
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
    """`perform_explicit` behind an address."""
    return perform_explicit(S, W, R, engine_arguments, run_state, task)


class ExplicitMethod:
    """Steps of an explicit method.

    Parameters
    ----------
    R : Tableau
    """

    failed, width = None, 0  # what it has the engine write is a row of output

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
        """The door with these tuples bound to it."""
        return BoundKernel(explicit_steps, tables, scratch, StructBuffer(self.R), engine_arguments, run_state)


INTERPOLATED = 7
HELD_RESIDUE = 1e-10  # of `Watch.tied`, of the fastest rate: what rows that hold leave of others


@formula
def evaluate_all_guards(A, W, t, K, row):
    """Guards by what stands in W, that of the group last, to a row; then its terms."""
    S, out, last = A[S_], K.g[row], K.way.shape[0] - 1
    remove_rate_residue(S, W, K)
    guards(S, W, t, out)
    remove_guard_residue(S, W, K, out)
    if S.guards.kind[last] == G_SHARED:
        call_group_guard(S, W, t, A[GROUP], K, row)


@formula
def remove_guard_residue(S, W, K, out):
    """Take from guards that what holds keeps at zero what it leaves of them."""
    fastest = -1.0
    for i in range(K.tied.shape[0]):
        if K.tied[i] > 0.0:
            least = HELD_RESIDUE * K.tied[i]
            if S.guards.kind[i] == G_BACK:
                fastest = largest_measured_rate(S, W) if fastest < 0.0 else fastest
                least = HELD_RESIDUE * max(fastest, K.tied[i])
            out[i] -= min(max(out[i], -least), least)


@formula
def remove_rate_residue(S, W, K):
    """Take from rates that laws of events name and that what holds keeps at zero what it leaves of them."""
    fastest, nm = -1.0, count_measured(S)
    for m in range(nm):
        if K.still[m] > 0.0:
            fastest = largest_measured_rate(S, W) if fastest < 0.0 else fastest
            least = HELD_RESIDUE * max(fastest, K.still[m])
            x = W.sensed[VALUE, nm + m]
            W.sensed[VALUE, nm + m] -= min(max(x, -least), least)


@formula
def renew_group(A):
    """Bring what is in balance by itself up to the state last evaluated."""
    update_null_vectors(A[ENGINE], A[S_], A[W_], A[R_], A[OWN], A[OUTPUT], A[GROUP])


@formula
def evaluate_with_guards(t, y, A, K, row):
    """Evaluate the equations at a state, and the guards there."""
    own = A[OWN]
    set_state(own, t, y)
    status = call_engine(A, MOTION)
    if status == 0:
        renew_group(A)
    evaluate_all_guards(A, A[W_], t, K, row)
    return status


@formula
def store_guard_inputs(A, K, row):
    """Keep what guards depend on at the state last evaluated, and the guards there."""
    S, W = A[S_], A[W_]
    nr = S.rows.law.shape[0]
    end = 0 if row == START_VALUES else 1
    for m in range(count_measured(S)):
        a = W.sensed[BIAS, m]
        for e in range(S.row_start[nr + m], S.row_start[nr + m + 1]):
            a += W.G[e] * W.velocities.solved[S.column[e]]
        K.moving[end, 0, m], K.moving[end, 1, m], K.moving[end, 2, m] = W.sensed[VALUE, m], W.sensed[RATE, m], a
    store_levels(A, K, 0 if row == START_VALUES else K.levels.shape[0] - 1)
    renew_group(A)
    evaluate_all_guards(A, W, A[OWN].real.t, K, row)
    grain = START_ROUNDING if row == START_VALUES else END_ROUNDING
    K.real.fastest = max(K.real.fastest, largest_measured_rate(S, W))
    guard_rounding(S, W, A[OWN].real.t, A[INTERPOLATED].sensed, K.real.fastest, K.g[grain])
    corner_tolerances(S, W, A[OWN].real.t, K.g[CORNER_DEPTHS])
    last = K.grain.shape[0] - 1
    if S.guards.kind[last] == G_SHARED:
        K.g[grain, last] = GROUP_ROUNDING * A[GROUP].size[0]
    for i in range(K.grain.shape[0]):
        K.g[grain, i] = max(K.g[grain, i], K.least[i])
        K.grain[i] = K.g[grain, i] if K.kept[i] == 1 else min(K.g[START_ROUNDING, i], K.g[grain, i])


@formula
def interpolated_guards(t, h, x, A, K, row):
    """Guards expected at a part x of the step that begins at t."""
    predict_sensed(K, x, h)
    evaluate_all_guards(A, A[INTERPOLATED], t + x * h, K, row)


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
    """Go on with a watched integration; ``method``: see `kernels.call_bound`; ``address``: the engine's."""
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
    """The loop in which nothing is watched."""
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
    """Go on with an integration in which nothing is watched, from instant to instant of what is sampled.

    ``part``: rows of output between two of them.
    """
    A = (address, S, W, R, engine_clock, output)
    X = ((call_step_method, method, engine_report, no_segment_start, finish_step), A, detection, R, clock)
    return from_instant_to_instant(integrate_between_samples, X, (address, S, W, R, clock, output, P), part, out)


class StepMethod(Protocol):
    """Steps of a method behind a door."""

    R: Tableau
    c: np.ndarray  # where in a step guards may be seen, as stages of a method
    stages: int  # how many of these there are
    failed: Exception | None  # why it does not go on, where that is the method's own reason

    def bind(
        self,
        tables: StructBuffer,
        scratch: StructBuffer,
        engine_arguments: StructBuffer,
        run_state: StructBuffer,
        doors: np.ndarray,
    ) -> BoundKernel:
        """The door bound to a System, a Work, an `EngineArguments` and a `RunState`; ``doors``: of `EngineArguments`, its second to be set."""


def guard_classes(S: System) -> np.ndarray:
    """1 for guards that are above zero as long as modes are right, 2 for those of distances and rates, (ng,).

    A slip in the plane is one of them: what begins at rest goes its way. One in space turns where it likes.
    """
    kinds, of = S.guards.kind, S.guards.of
    slips = np.flatnonzero(kinds == G_TURNS)
    kept = np.isin(kinds, MODE_GUARDS)
    kept[slips[S.switches.partner[of[slips]] < 0]] = True
    return np.where(kept, np.where(np.isin(kinds, KINEMATIC_GUARDS), 2, 1), 0)


def _event_workspace(S: System, expected: Work, c: np.ndarray, stages: int) -> GuardState:
    """What a loop keeps that watches."""
    nm = len(S.row_start) - 1 - len(S.rows.law)
    rows = np.unique(S.switches.row[S.switches.row >= 0])
    columns = np.arange(2 * nm, expected.sensed.shape[1])
    loads = columns[: len(columns) - len(S.switches.row)]
    spots = [(VALUE, m) for m in columns] + [(RETURNED, m) for m in loads]
    there = expected.sensed, expected.rows.multiplier
    guarded = S.guards.direction, guard_classes(S)
    return allocate_guard_state(*guarded, c, stages, nm, rows, np.array(spots, int), there, 3 * len(S.switches.row))


@lru_cache(maxsize=16)
def idle_event_workspace(c: bytes, stages: int) -> StructBuffer:
    """What a loop keeps where there is nothing to watch, for all of them."""
    none, empty = np.zeros(0, np.int64), (np.zeros((RETURNED + 1, 0)), np.zeros(0))
    return StructBuffer(allocate_guard_state(none, none, np.frombuffer(c).copy(), stages, 0, none, none, empty))


@lru_cache(maxsize=1)
def idle_tableau() -> StructBuffer:
    """A tableau that the engine does not look at."""
    return StructBuffer(tableau("rk45"))


class GuardedLoop:
    """A motion by steps of a method that is watched, or sampled: the compiled loop and what it keeps.

    Parameters
    ----------
    steps : Steps
    clock : Clock
        Of the integration.
    s : Structure
    S : System
    scratch : PooledBuffer
        The Work.
    width : int
        Of a row of output, and of what the method has the engine write.
    group : Sharing
        What holds together.
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
            self.desk = _event_workspace(S, self.expected, steps.c, steps.stages)
        else:  # nobody looks at it, or writes to it
            self.expected = W
            idle = idle_event_workspace(steps.c.tobytes(), steps.stages)
            self.desk = idle.fields
            self._known.append(idle)
        ny = clock.y.shape[1]
        own = StepState(
            clock.real.copy(), clock.count.copy(), clock.times, np.zeros((3, ny)), np.zeros((1, ny)), clock.integrals,
            clock.seen,
        )  # fmt: skip
        self.group, nv = group, W.velocities.solved.shape[0]
        sheet = OutputBuffer(np.zeros((4, max(width, len(S.guards.kind), nv, len(S.rows.law), 1))))
        self.own = EngineArguments(own, sheet, self._known[0].fields, np.zeros(2, np.int64))
        self._bound: BoundKernel | None = None
        self._clock, self._watch, self._group = (StructBuffer(x) for x in (clock, self.desk, group))
        self._expected = StructBuffer(self.expected)
        self._own = [self._known[0], StructBuffer(own), StructBuffer(sheet)]

    def go_on(self, S: System, out: np.ndarray, sampling: SampledControllers | None = None) -> int:
        """Go on until an event, the end, or what else `time_loop.advance` returns for. Returns rows written.

        Where nothing is watched, what ``sampling`` says is sampled on the way.
        """
        x = self.own
        if self._bound is None or S is not self.S:
            x.doors[0] = engine.address
            own, going = (StructBuffer(f, *self._known) for f in (x, RunState(self.clock, self.desk, self.group)))
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
        """The guards that the last step ended on."""
        return tuple(np.flatnonzero(self.desk.fired).tolist())


MAX_LOOP_LAYOUTS = 4  # layouts of a structure that are known


class LoopOutput(NamedTuple):
    """The method (`BoundKernel.words`), and where rows of output go."""

    asked: Int1
    rows: Float2


@formula
def integrate_smooth(S, W, engine_arguments, run_state, out):
    """Go on with an integration. Returns rows written."""
    A = (engine_arguments.doors[0], S, W, engine_arguments.R, engine_arguments.clock, engine_arguments.output)
    callbacks = (call_step_method, out.asked, engine_report, no_segment_start, finish_step)
    return advance(callbacks, A, run_state.watch, engine_arguments.R, run_state.clock, out.rows)


@kernel
def smooth_loop_kernel(
    S: System, W: Work, engine_arguments: EngineArguments, run_state: RunState, out: LoopOutput, task: int
) -> int:
    """`finish_step_with_events` behind an address."""
    return integrate_smooth(S, W, engine_arguments, run_state, out)


@lru_cache(maxsize=1)
def _no_group() -> StructBuffer:
    """Nothing holds together."""
    return StructBuffer(empty_distribution(0, 0))


def _engine_arguments(ny: int, width: int, inspected: np.ndarray) -> EngineArguments:
    """What goes to the engine's door besides: of its clock only time, state and what is seen are looked at."""
    none = np.zeros(0, np.int64)
    clock = StepState(
        StepReals.blank(), StepCounts.blank(), np.zeros(0), np.zeros((3, ny)), np.zeros((1, ny)), none, inspected
    )
    return EngineArguments(clock, OutputBuffer(np.zeros((4, width))), idle_tableau().fields, np.zeros(2, np.int64))


class SmoothLoop:
    """A motion by steps of a method: the compiled loop and what it keeps.

    Parameters
    ----------
    steps : Steps
    clock : Clock
        Of the integration.
    s : Structure
    S : System
    scratch : StructBuffer
        The Work.
    width : int
        Of a row of output, and of what the method has the engine write.
    """

    fired = ()

    def __init__(
        self, steps: Any, clock: StepState, s: Structure, S: System, scratch: StructBuffer, width: int
    ) -> None:
        self.steps, self.clock, self.s, self.scratch = steps, clock, s, scratch
        ny, width, R = clock.y.shape[1], max(width, s.nv, len(s.rows), 1), idle_tableau()
        if clock.seen.shape[1]:
            own = _engine_arguments(ny, width, clock.seen)
            self.own, doors = StructBuffer(own, R), own.doors
        else:
            mould = s.kept.get(
                "own desk",
                (ny, width),
                MAX_LOOP_LAYOUTS,
                lambda: StructPool(_engine_arguments(ny, width, clock.seen), R.fields),
            )
            self.own, doors = (made := mould.new()), made.array("doors")
        watch = idle_event_workspace(steps.c.tobytes(), steps.stages)
        self.going = JoinedBuffer(RunState, StructBuffer(clock), watch, _no_group())
        written = struct_tables(s, S)
        doors[0] = engine.address
        self.bound = steps.bind(written, scratch, self.own, self.going, doors)
        self._loop: tuple[np.ndarray, BoundKernel] | None = None

    def go_on(self, out: np.ndarray) -> int:
        """Go on until the end, or what else `time_loop.advance` returns for. Returns rows written."""
        if self._loop is None or self._loop[0] is not out:
            rows = StructBuffer(LoopOutput(self.bound.words, out))
            self._loop = (
                out,
                BoundKernel(smooth_loop_kernel, self.bound.buffers[0], self.scratch, self.own, self.going, rows),
            )
        return self._loop[1](0)
