"""Simulation: the motion in time, by the chosen method, as a `Result`.

The compiled loop is called in chunks, so that progress can be reported and a keyboard interrupt is noticed.
"""

from __future__ import annotations

import time
from functools import partial

import numpy as np

from ..assembly.assembled_state import Assembly
from ..assembly.compiled_mechanism import CompiledMechanism
from ..engine.entry_point import FOLLOW, INTEGRATE, characteristic_rate_within
from ..engine.pulse_detection import INSPECTION_ROWS, any_formula_breaks, inspection_buffer
from ..engine.stabilization import TIGHT_G, TIGHT_V
from ..errors import FlyballError, Interrupted, ModelError, SimulationError, StartWarning, warn_user
from ..laws.breakpoints import NO_BREAKPOINTS
from ..laws.python_functions import clear_faults, deferred_interrupts, motion_of
from ..model.model import Model
from ..numerics.integrators import time_loop as ex
from ..numerics.integrators.butcher_tableaux import Tableau, tableau
from ..progress import ReportProgress, progress_bar
from ..results.health import changed_velocities, velocity_not_allowed
from ..results.result import Result
from ..tables.table_definitions import FREE, SPHERICAL, System
from . import initial_state
from .events.context import EventContext
from .events.event_loop import integrate_events
from .implicit_integrators import refuse_for_variational
from .initial_state import InitialState, find_initial_state, start_time
from .integration_intervals import (
    Segment,
    known_breaks,
    laws_checked_in_steps,
    refuse_too_often,
    remark_on_checked_laws,
    whole_motion,
)
from .integration_options import STABILIZATION, Integration, Stepping, output_times, refuse_beyond_memory
from .law_faults import refuse_out_of_table
from .method_choice import (
    AUTO_METHOD,
    IMPLICIT_METHODS,
    VARIATIONAL,
    SimulateOptions,
    choose_method,
    explicit_substitute,
    in_suitable_coordinates,
    is_unresolved,
    reason_against_implicit,
    reason_for_impulses,
    with_contact_points,
)
from .motion_result import can_defer_accelerations, make_result, solve_accelerations
from .prescribed_motion import at_outputs, deferred_works, leaves_no_freedom, remark_friction
from .solver_switching import EXPLICIT_METHOD, GENERAL_ENGINE, CodeSelection, StiffnessMonitor

# tolerances of the stages on the constraints, as parts of the tolerance of positions; and the largest, relative to the
# mechanism's length and speed
STAGE_POSITIONS, STAGE_VELOCITIES = 1e-2, 5e-2
COARSEST_POSITIONS, COARSEST_VELOCITIES = 1e-6, 1e-5
TIGHT_TOLERANCE = 1e-8  # relative tolerances below this tighten the constraint tolerance of the stages quadratically
UNSUPPORTED_BY_GENERATED = {
    "partitioning": (
        "coordinate partitioning changes coordinates during the motion, which code made for one mechanism does not "
        "support"
    )
}
"""Stabilizations that generated code does not support, each with the reason."""
SLICE = 0.05  # intended duration of one call of the compiled loop [s]


def simulate(model: Model, o: SimulateOptions) -> Result:
    """Simulate by the requested method, or by one chosen for the model: see `Mechanism.simulate`."""
    model = model.snapshot()
    t_start = start_time(o.t_start, o.start)
    span = (t_start, o.t_end, output_times(t_start, o.t_end, o.outputs))
    way = choose_method(model, o)
    try:
        return simulate_with_reason(model, way.options, span, way.why, o.method == AUTO_METHOD)
    except (ModelError, SimulationError) as error:
        if way.instead is None or not is_unresolved(error):
            raise
        try:
            return simulate_with_reason(model, way.instead, span, reason_for_impulses(error), False)
        except FlyballError:
            raise error from None


Span = tuple[float, float, np.ndarray]
"""Start time and end time [s], and the output times."""


def simulate_with_reason(
    model: Model, o: SimulateOptions, span: Span, why: str, auto: bool, part: Segment | None = None
) -> Result:
    """Simulate a motion or one segment of it; the health report gives the method and the reason ``why``.

    ``auto`` allows changes of the method during the motion.

    Raises
    ------
    Interrupted
        If the user ends it.
    """
    part = part or whole_motion()
    try:
        result = _simulated(model, o, span, auto, part)
    except SimulationError as error:
        if isinstance(error.result, Result):
            _add_reason(error.result, why)
        raise
    _add_reason(result, why)
    if not result.health.success and not part.paused:
        raise Interrupted(result.health.message, result)
    return result


def _add_reason(result: Result, why: str) -> None:
    result.health.method = "; ".join(x for x in (why, result.health.method) if x)


def _simulated(model: Model, o: SimulateOptions, span: Span, auto: bool, part: Segment) -> Result:
    """Simulate a motion or one segment of it by the method in the options."""
    started = time.perf_counter()
    t_start, _, times = span
    if isinstance(o.method, Stepping):
        with progress_bar(o.progress, "simulating") as tell:
            from .impulse_stepping.impulse_simulation import simulate_by_impulses  # other motions start without it

            return simulate_by_impulses(model, (t_start, o.t_end), times, o.method, o.parameters, tell, o.start, part)
    model = with_contact_points(model, o.parameters)
    begun = find_initial_state(model, t_start, o.parameters, o.start, o.coordinates, switches=True, part=part)
    slides = _no_stops(begun) and _fully_driven(begun)  # a motion that drivers prescribe does not depend on forces
    if slides:
        begun = find_initial_state(model, t_start, o.parameters, o.start, o.coordinates, part=part)
    begun.since = started
    if o.method in IMPLICIT_METHODS and (has_guards(begun) or not _fully_driven(begun)):
        begun = in_suitable_coordinates(begun, str(o.method), o.coordinates, o.parameters)
        if o.method == VARIATIONAL:
            refuse_for_variational(begun)
    if o.stabilization != "projection":
        _refuse_idle_stabilization(begun, o.stabilization)
    for d in changed_velocities(begun.base.departures):
        warn_user(velocity_not_allowed(d), StartWarning)
    made = False if o.method in IMPLICIT_METHODS else o.specialize
    begun.engine = CodeSelection(begun.assembly.compiled, made, UNSUPPORTED_BY_GENERATED.get(o.stabilization, ""))
    if o.method in IMPLICIT_METHODS:
        begun.engine.description = f"{GENERAL_ENGINE}: {o.method} uses it"
    mixed = auto and o.stabilization == "projection" and o.step is None
    begun.pace = StiffnessMonitor(
        float(o.t_end), AUTO_METHOD if mixed else str(o.method), partial(reason_against_implicit, begun)
    )
    begun.pace.resume_with(begun.earlier_data.get("by", ""))
    follow = o.stabilization == "projection" and not has_guards(begun) and _fully_driven(begun)
    functions = begun.assembly.compiled.structure.functions
    with progress_bar(o.progress, "simulating") as tell, motion_of(functions, begun.before is not None):
        result = integrate_motion(begun, o.t_end, times, o, FOLLOW if follow else INTEGRATE, tell)
    if slides:
        remark_friction(result)
    return result


def integrate_motion(
    start: InitialState,
    t_end: float,
    times: np.ndarray,
    o: Integration,
    task: int,
    report: ReportProgress,
) -> Result:
    """Compute the motion from an initial state: integrated (task INTEGRATE) or prescribed by drivers (task FOLLOW).

    Raises
    ------
    ModelError
        If a table of time ends before the motion does, or the start lies beyond the ends of a table.
    SimulationError
        If the integration fails; its ``result`` holds the motion up to the failure.
    """
    refuse_out_of_table(start.base, float(t_end))
    o = o.with_tolerance()
    if o.stabilization == "partitioning":
        initial_state.choose_independent(start.base.compiled.structure.model, start)
    c, engine = start.assembly.compiled, start.engine or CodeSelection(start.assembly.compiled, False)
    start.part.begin(c.structure)
    if task == INTEGRATE:
        refuse_too_often(c, (start.base.t, float(t_end)), o.max_steps)
    known = known_breaks(c, start.base.t, float(t_end)) if task == INTEGRATE else NO_BREAKPOINTS
    sampled = laws_checked_in_steps(c, known)
    clock = clock_for(start, start.base.t, float(t_end), times, o, sampled)
    later = not has_guards(start) and can_defer_accelerations(start, o, task)
    c.array("options").deferred = float(later)
    here = EventContext(start, clock)
    if task == INTEGRATE and (
        o.method in IMPLICIT_METHODS or has_guards(start) or len(known.times) or c.structure.sampled
    ):
        rows, interrupted = integrate_events(here, o, row_width(start.assembly), report, engine, known)
    else:
        method = tableau(explicit_substitute(o.method))
        rows, interrupted = np.zeros((0, row_width(start.assembly))), False
        if start.pace is None or not start.pace.asked:
            rows, interrupted = run_compiled_loop(
                start.assembly, clock, method, report, task, engine, start.pace, start.part
            )
        if start.pace is not None and start.pace.asked and not start.part.paused:
            more, interrupted = integrate_events(here, o, row_width(start.assembly), report, engine, known)
            rows = np.concatenate([rows, more])
        elif start.pace is not None:
            here.method = "; ".join(start.pace.changes)
    if task == INTEGRATE:
        here.detection_remark = "; ".join(x for x in (here.detection_remark, remark_on_checked_laws(c, sampled)) if x)
    owed = None
    if task == FOLLOW:
        owed = partial(deferred_works, start, clock, rows)
        rows = at_outputs(clock, rows)
    return make_result(here, rows, o, interrupted, owed, partial(solve_accelerations, start, rows) if later else None)


def _no_stops(start: InitialState) -> bool:
    """Return whether there are no events, and all switches are corners of laws or sliding friction."""
    s = start.assembly.compiled.structure
    return bool(s.switches) and not s.model.events and all(x.law >= 0 or x.switch.kind.kinetic for x in s.switches)


def _fully_driven(start: InitialState) -> bool:
    """Return whether drivers leave no freedom; a later segment takes this from the segment before it."""
    return bool(start.earlier_data["followed"]) if "followed" in start.earlier_data else leaves_no_freedom(start)


def has_guards(start: InitialState) -> bool:
    """Return whether events can occur: whether there are guards, switches or events."""
    s = start.assembly.compiled.structure
    return bool(s.guards or s.switches or s.model.events)


def _refuse_idle_stabilization(start: InitialState, stabilization: str) -> None:
    """Refuse a stabilization option where there are no constraints to stabilize."""
    if not len(start.assembly.compiled.values.system.rows.law):
        joint = len(start.base.compiled.values.system.rows.law) > 0
        where, remedy = ("in joint coordinates ", ", or give coordinates='absolute'") if joint else ("", "")
        raise ModelError(
            f"stabilization={stabilization!r} has no effect: {where}there are no constraints to stabilise; leave it "
            f"out{remedy}"
        )


def clock_for(
    start: InitialState,
    t: float,
    t_end: float,
    times: np.ndarray,
    o: Integration,
    sampled: frozenset[int] | None = None,
) -> ex.StepState:
    """Create the integrator state with which the compiled loop starts, and set the solver options.

    ``sampled`` are the laws that are checked for pulses within steps; if not given, all laws that can act briefly are.
    """
    a, y = start.assembly, start.y
    refuse_beyond_memory(len(times), row_width(a))
    s, array = a.compiled.structure, a.compiled.array
    real, count = ex.StepReals.blank(), ex.StepCounts.blank()
    real.t, real.t_end, real.rtol = t, t_end, o.rtol
    first = t if start.part.first is None else start.part.first
    real.span = (t_end - first) or 1.0
    real.step = o.step or 0.0
    real.h = o.step or start.earlier_data.get("width", 0.0)
    real.h_max = min(o.step or o.max_step, t_end - t)
    real.largest = max(abs(t), abs(t_end))
    count.quota = 50
    count.limit = o.max_steps
    count.controlled, count.positions = s.nq + s.nv + len(s.controls) - len(s.sampled), s.nq
    Y = ex.StateVectors.blank(len(y))
    Y[0] = y
    array("options").stabilization = STABILIZATION[o.stabilization]
    array("options").alpha, array("options").beta = o.alpha or 0.0, o.beta or 0.0
    array("options").solve_tolerance = 1e-13
    nothing = sampled is not None and not sampled and not any_formula_breaks(a.compiled.values.system)
    seen = np.zeros((INSPECTION_ROWS, 0)) if nothing else inspection_buffer(a.compiled.values.system, sampled)
    works = [s.nq + s.nv + k for name, k in s.state_at.items() if name.endswith(".work")]
    K = np.zeros((len(tableau(explicit_substitute(o.method)).c) + 1, len(y)))
    clock = ex.StepState(real, count, times, Y, K, np.array(works, np.int64), seen)
    real.atol = o.with_tolerance().atol
    set_scales(clock, start.base, a.compiled)
    return clock


def set_scales(clock: ex.StepState, base: Assembly, c: CompiledMechanism) -> None:
    """Set the units of the state, the energy scale and the tolerances on the constraints."""
    real, length = clock.real, c.values.length
    real.energy_size = energy_scale(base, float(real.span))
    rate = c.array("options").rate = characteristic_rate_within(c.values.system, float(real.span))
    nq, nv = c.structure.nq, c.structure.nv
    clock.y.unit = c.values.cache.get("units of the state", None, 1, lambda: state_units(c, clock.y.shape[1]))
    clock.y.unit[nq : nq + nv] *= rate
    loose = real.atol + real.rtol
    near = loose * min(1.0, loose / TIGHT_TOLERANCE)
    c.array("options").position_tolerance = length * min(COARSEST_POSITIONS, max(TIGHT_G, STAGE_POSITIONS * near))
    c.array("options").velocity_tolerance = min(COARSEST_VELOCITIES, max(TIGHT_V, STAGE_VELOCITIES * near))


def state_units(c: CompiledMechanism, width: int) -> np.ndarray:
    """Return the unit of every component of the state.

    It is the mechanism's length or a radian, the same per second for velocities, and 1 of what follows them.
    """
    S, nq = c.values.system, c.structure.nq
    out = np.ones(width)
    for kind, q, v, nv in zip(S.tree.joint, S.tree.q, S.tree.v, S.tree.nv, strict=True):
        shifts = 3 if kind == FREE else 0 if kind == SPHERICAL else nv  # the others are quaternions
        out[q : q + shifts] = S.velocity_units[v : v + shifts]
    out[nq : nq + c.structure.nv] = S.velocity_units
    return out


def energy_scale(a: Assembly, span: float) -> float:
    """Return the energy [J] with which errors of work are compared.

    It is the energy to lift the mechanism by its length and to move it by as much within ``span``, plus its kinetic
    energy.
    """
    x = a.compiled.values
    weight = x.unforced.cache.get("weight", None, 1, lambda: _weight(x.system))
    return rest_energy(weight, x.length, span) + a.compiled.kinetic_energy(a.v)


def _weight(S: System) -> tuple[float, float]:
    """Return the mass of all bodies [kg] and the acceleration of gravity [m/s^2]."""
    return float(S.bodies.mass.sum()), float(np.sqrt((S.gravity**2).sum()))


def rest_energy(weight: tuple[float, float], length: float, span: float) -> float:
    """Return the energy scale [J] of a mechanism at rest.

    It follows from the mass [kg] and gravity in ``weight``, the length [m] and the time span [s].
    """
    mass, g = weight
    fast = min(length / span, 1e150)  # the square stays finite, however short the span
    return mass * (g * length + fast * fast)


def row_width(a: Assembly) -> int:
    """Return how many numbers are stored for each output time."""
    s = a.compiled.structure
    return 1 + s.nq + s.nv + len(a.compiled.z) + s.nv + len(a.compiled.values.system.rows.law) + len(s.prescribed)


def run_compiled_loop(
    a: Assembly,
    clock: ex.StepState,
    method: Tableau,
    report: ReportProgress,
    task: int,
    engine: CodeSelection | None = None,
    pace: StiffnessMonitor | None = None,
    part: Segment | None = None,
) -> tuple[np.ndarray, bool]:
    """Call the compiled loop until the motion is complete. Returns (output rows, whether the user interrupted).

    ``engine`` may switch between the general engine and generated code; without it the general engine is used. If
    ``pace`` requests another method, the run ends there. It also ends where the segment ``part`` does.
    """
    c, engine, part = a.compiled, engine or CodeSelection(a.compiled, False), part or whole_motion()
    s, wide = c.structure, row_width(a)
    buffer = np.zeros((max(2, min(len(clock.times), 1_000_000 // wide + 1)), wide))
    rows = []
    first = clock.real.t
    span, reached = clock.real.t_end - first or 1.0, 0.0
    bound, on = None, (c.system, c.scratch)
    clear_faults(c.array("stack"))
    engine.begin(clock)
    quota = engine.limited(clock, float(clock.count.quota))
    if pace is not None:
        quota = pace.limited(clock, quota)
    try:
        while True:
            begin, clock.count.quota = time.perf_counter(), part.most(quota)
            before = clock.count.accepted + clock.count.rejected
            with deferred_interrupts(s.functions):
                if bound is None or c.system is not on[0] or c.scratch is not on[1]:  # changed code
                    bound, on = c.bound(method, clock, buffer), (c.system, c.scratch)
                used = bound(task)
                rows.append(buffer[:used].copy())
            reached = max(reached, (clock.real.t - first) / span)
            report(reached)
            if clock.count.status != ex.RUNNING and not engine.falls_back(clock):
                return np.concatenate(rows), False
            took = time.perf_counter() - begin
            done = clock.count.accepted + clock.count.rejected - before
            part.count_steps(done)
            engine.choose_again(clock)
            if part.over(clock if task == INTEGRATE else None):  # in task FOLLOW a segment may end after any step
                return np.concatenate(rows), False
            quota = engine.limited(clock, max(done, 1) * SLICE / max(took, 1e-6))
            if pace is not None and task == INTEGRATE:
                pace.asked = pace.turns(c, clock, EXPLICIT_METHOD)
                if pace.asked:
                    return np.concatenate(rows), False
                quota = pace.limited(clock, quota)
    except KeyboardInterrupt:
        return np.concatenate(rows) if rows else np.zeros((0, wide)), True
    finally:
        engine.end()
