"""Result of an integrated motion: `Result` with its health report, or the exception with the partial result.

Accelerations and reactions at output times are computed on first access, where that gives the same values.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial
from itertools import accumulate
from typing import Any

import numpy as np

from ..assembly.assembled_state import Assembly
from ..assembly.compiled_mechanism import CompiledMechanism
from ..compiler.object_files import compiled_since
from ..engine.entry_point import COMPLETE, INTEGRATE, MOTION, run_task
from ..engine.pulse_detection import INSPECTION_ROWS
from ..errors import SimulationError
from ..mobility.mobility import mobility
from ..model.contact import contact_warnings
from ..model.event import Set
from ..numerics.integrators import time_loop as ex
from ..numerics.integrators.butcher_tableaux import tableau
from ..results import diagnostics
from ..results.contacts import event_driven_contacts
from ..results.health import Health, changed_velocities, velocity_not_allowed
from ..results.motion_record import record_motion
from ..results.result import DeferredArrays, Result
from .diagnosis import (
    contradicting_limits,
    driver_fault,
    failure_reason,
    health_remarks,
    reason_without_solution,
)
from .events.context import EventContext
from .events.event_actions import continuation_data
from .initial_state import InitialState, start_record
from .integration_intervals import PAUSED_MESSAGE, never_sampled
from .integration_options import Integration


def can_defer_accelerations(start: InitialState, o: Integration, task: int) -> bool:
    """Return whether accelerations can be computed later with the same values.

    This is not so with friction (its solve starts from the loads found last), with Python functions (they may have
    memory), or where events change modes and numbers.
    """
    s = start.assembly.compiled.structure
    usual = task == INTEGRATE and o.stabilization == "projection"
    changes = any(isinstance(a, Set) for e in s.model.events for a in e.do)
    return usual and not (s.loads or s.functions or s.switches or changes)


def idle_clock(ny: int, t: float = 0.0) -> ex.StepState:
    """Create an integrator state with time and ``ny`` state entries, for tasks that integrate nothing."""
    real = ex.StepReals.blank()
    real.t = t
    none = np.zeros(0, np.int64)
    count, y, K = ex.StepCounts.blank(), ex.StateVectors.blank(ny), np.zeros((1, ny))
    return ex.StepState(real, count, np.zeros(0), y, K, none, np.zeros((INSPECTION_ROWS, 0)))


def solve_accelerations(start: InitialState, rows: np.ndarray, health: Health) -> tuple[np.ndarray, np.ndarray]:
    """Return accelerations (n, nv) and multipliers (n, nr) at the states of output rows; nan where there are none.

    Missing ones are reported in the remarks of ``health``.
    """
    c = start.assembly.compiled
    s, W = c.structure, c.work
    ny = s.nq + s.nv + len(s.states)
    W.options.deferred = 0.0
    out = rows.copy()
    if run_task(*c.buffers, tableau("rk45"), idle_clock(ny), out, COMPLETE):
        health.remarks = (*health.remarks, missing_accelerations(c, out))
    return np.ascontiguousarray(out[:, 1 + ny : 1 + ny + s.nv]), np.ascontiguousarray(out[:, 1 + ny + s.nv :])


def missing_accelerations(c: CompiledMechanism, rows: np.ndarray) -> str:
    """Describe at which of the output rows (n, width) there are no accelerations, and why."""
    s = c.structure
    missing = rows[~np.isfinite(rows).all(axis=1)]
    t, q, v, z = np.split(missing[0, : 1 + s.nq + s.nv + len(s.states)], np.cumsum([1, s.nq, s.nv]))
    again = c.again()
    again.z = z
    again.at(float(t[0]), q, v, MOTION)
    why = reason_without_solution(again, float(t[0]), float(np.abs(rows[:, 0]).max()))
    return (
        f"at {len(missing)} of {len(rows)} output times, the first t = {t[0]:.6g} s, the equations of motion have no "
        f"solution: accelerations and reactions are nan there: {why}"
    )


def _how_it_ended(here: EventContext, o: Integration, interrupted: bool) -> tuple[str, BaseException | None]:
    """Return the message on how the motion ended, and the error behind it if there is one."""
    a, clock = here.start.assembly, here.clock
    status, t = int(clock.count.status), float(clock.real.t)
    if interrupted:
        return f"interrupted by the user at t = {t:.6g} s; the motion so far is kept", here.failed
    if here.start.part.paused:
        return PAUSED_MESSAGE.format(t), here.failed
    if here.failed is not None:
        broken = _cause_of_failed_step(a, clock) if status == ex.STEP_FAILED else ""
        name = here.start.base.compiled.structure.model.name
        kept = f"The motion up to t = {t:.6g} s is kept in the error's result"
        return f"{name!r}: {broken or here.failed}. {kept}", here.failed
    if status != ex.DONE:
        return failure_reason(a, here.start.base, clock, method=str(o.method))
    return here.stopped or "reached the end", None


def make_result(
    here: EventContext,
    rows: np.ndarray,
    o: Integration,
    interrupted: bool = False,
    deferred: DeferredArrays | None = None,
    unsolved: Callable[[Health], tuple[np.ndarray, np.ndarray]] | None = None,
) -> Result:
    """Build the result and its health report; a failed run raises with its partial result.

    ``deferred`` computes works on first access, and ``unsolved`` accelerations and multipliers; the latter adds to the
    health report the times without a solution.

    Raises
    ------
    SimulationError
        If the integration could not continue.
    """
    start, clock = here.start, here.clock
    a, model = start.assembly, start.base.compiled.structure.model
    status = int(clock.count.status)
    t = float(clock.real.t)
    message, cause = _how_it_ended(here, o, interrupted)
    health = _health(start, clock, o)
    ended = here.failed is None and not interrupted and not here.start.part.paused
    health.message, health.success = message, ended and status == ex.DONE
    health.event_detection, health.method = here.detection_remark, here.method
    health.remarks = (*health.remarks, *here.doubts)
    s = a.compiled.structure
    cuts = list(accumulate((1, s.nq, s.nv, len(s.states), s.nv), initial=0))
    parts = zip(cuts, (*cuts[1:], rows.shape[1]), strict=True)
    t_out, q, v, z, vdot, lam = (np.ascontiguousarray(rows[:, a:b]) for a, b in parts)
    result = Result(model, a.compiled.values, t_out[:, 0], q, v, z, vdot, lam, health)
    result.final = (t, clock.y.current.copy())
    result.deferred_works, result.deferred_accelerations = deferred, unsolved and partial(unsolved, health)
    result.wound, result.begun = start.wound, start_record(start)
    result.carried |= continuation_data(here)
    if here.start.part.paused:
        result.carried |= _data_for_next_segment(here, deferred is not None)
    result.events = here.records
    if here.recorder is not None:
        here.recorder.add_phases(result)
        result.contacts = event_driven_contacts(result)
    result.record = record_motion(result, a.compiled.scratch, system=a.compiled.system)
    if unsolved is not None and not result.record.solved:
        _ = result.vdot  # adds to the remarks where there are no accelerations
    health.late = motion_judgements(result, partial(mobility, model, start.base))
    if here.failed is not None or status not in (ex.DONE, ex.RUNNING):
        raise SimulationError(message, result, t) from cause
    return result


def motion_judgements(result: Result, mobility: Callable[[], Any]) -> dict[str, Callable[[], Any]]:
    """Return the figures of `Health.late` of a motion, from what its record contains."""
    return {
        "mobility": mobility,
        "energy_drift": partial(diagnostics.energy_drift, result),
        "acceleration_violation": partial(diagnostics.acceleration_violation, result),
        "creep": partial(diagnostics.friction_creep, result),
        "warnings": partial(diagnostics.motion_warnings, result),
        "doubtful": partial(diagnostics.doubt_messages, result),
    }


def _cause_of_failed_step(a: Assembly, clock: ex.StepState) -> str:
    """Return why a step of fixed width has no solution, if the cause is known; else an empty string."""
    t = float(clock.real.t)
    text = contradicting_limits(a.compiled, t)
    return f"at t = {t:.6g} s, {text}" if text else driver_fault(a.compiled, t, float(clock.real.largest))


def _data_for_next_segment(here: EventContext, followed: bool) -> dict[str, Any]:
    """Return the data with which the next segment starts."""
    pace, found = here.start.pace, {"open": here.start.part.open, "followed": followed}
    return found | {"by": pace.continuing_method if pace else "", "width": float(here.clock.real.h)}


def _health(start: InitialState, clock: ex.StepState, o: Integration) -> Health:
    """Create the health report of a run."""
    array = start.assembly.compiled.array
    return Health(
        success=True,
        message="",
        violation=float(array("options").position_violation),
        velocity_violation=float(array("options").velocity_violation),
        steps=int(clock.count.accepted),
        rejected=int(clock.count.rejected),
        evaluations=int(array("counts").evaluations),
        factorisations=int(array("counts").factorisations),
        seconds=time.perf_counter() - start.since,
        compiling=compiled_since(start.since),
        options=o.choices(),
        remarks=(
            *map(velocity_not_allowed, changed_velocities(start.base.departures)),
            *health_remarks(start.assembly, clock),
            *contact_warnings(start.base.compiled.structure.model),
            *never_sampled(start.assembly.compiled, clock),
        ),
        departures=start.base.departures,
        coordinates=start.coordinates,
        engine=start.engine.description if start.engine else "",
    )
