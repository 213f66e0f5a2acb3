"""What comes out of a motion: the ``Result`` with its health, or the exception that says why there is no more."""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial
from itertools import accumulate
from typing import Any

import numpy as np

from ...compiler.notice import compiled_since
from ...errors import SimulationError
from ...model.touching import nothing_touches
from ...numerics.integrators import clock as ex
from ...results import doubts
from ...results.departure import changed_velocities, not_allowed
from ...results.health import Health
from ...results.result import Owed, Result
from ...results.touched import contacts
from ..assembly.start import Assembly
from ..mobility import mobility
from .crossed import crossed
from .events.carried import carried
from .events.here import Here
from .options import Integration
from .part import KEPT
from .reasons import of_drivers, reason, remarks
from .residual import acceleration_violation
from .samples import never
from .start import Start, begun


def outcome(
    here: Here,
    rows: np.ndarray,
    o: Integration,
    interrupted: bool = False,
    owed: Owed | None = None,
    unsolved: Callable[[Health], tuple[np.ndarray, np.ndarray]] | None = None,
) -> Result:
    """Result and health; a failed run raises with its partial result.

    ``owed`` finds works when they are asked for, ``unsolved`` accelerations and multipliers; it
    puts into the health at which times there are none.

    Raises
    ------
    SimulationError
        If the integration could not go on.
    """
    start, clock = here.start, here.clock
    a, model = start.assembly, start.base.compiled.structure.model
    status = int(clock.count.status)
    t = float(clock.real.t)
    message, cause = here.stopped or "reached the end", here.failed
    if interrupted:
        message = f"interrupted by the user at t = {t:.6g} s; what was computed is kept"
    elif here.start.part.paused:
        message = KEPT.format(t)
    elif here.failed is not None:
        broken = _behind(a, clock) if status == ex.STUCK else ""
        message = (
            f"{model.name!r}: {broken or here.failed}. The motion up to t = {t:.6g} s is kept in the error's result"
        )
    elif status != ex.DONE:
        message, cause = reason(a, start.base, clock, method=str(o.method))
    health = _health(start, clock, o)
    ended = here.failed is None and not interrupted and not here.start.part.paused
    health.message, health.success = message, ended and status == ex.DONE
    health.watched, health.method = here.watched, here.method
    health.remarks = (*health.remarks, *here.doubts)
    s = a.compiled.structure
    cuts = list(accumulate((1, s.nq, s.nv, len(s.states), s.nv), initial=0))
    parts = zip(cuts, (*cuts[1:], rows.shape[1]), strict=True)
    t_out, q, v, z, vdot, lam = (np.ascontiguousarray(rows[:, a:b]) for a, b in parts)
    result = Result(model, a.compiled.values, t_out[:, 0], q, v, z, vdot, lam, health)
    result.final = (t, clock.y[0].copy())
    result.owed, result.unsolved = owed, unsolved and partial(unsolved, health)
    result.wound, result.begun = start.wound, begun(start)
    result.carried |= carried(here)
    if here.start.part.paused:
        result.carried |= _for_the_next(here, owed is not None)
    health.late = {
        "mobility": partial(mobility, model, start.base),
        "energy_drift": partial(_energy_drift, result),
        "acceleration_violation": partial(acceleration_violation, result),
        "creep": partial(doubts.creep, result),
        "warnings": partial(doubts.warnings, result),
        "doubtful": partial(doubts.doubtful, result),
    }
    result.events = here.records
    if here.seen is not None:
        here.seen.told(result)
        result.contacts = contacts(result)
    if here.failed is not None or status not in (ex.DONE, ex.RUNNING):
        raise SimulationError(message, result, t) from cause
    return result


def _behind(a: Assembly, clock: ex.Clock) -> str:
    """What is behind a step of fixed width that has no solution, if it is known; else nothing."""
    t = float(clock.real.t)
    text = crossed(a.compiled, t)
    return f"at t = {t:.6g} s, {text}" if text else of_drivers(a.compiled, t, float(clock.real.largest))


def _for_the_next(here: Here, followed: bool) -> dict[str, Any]:
    """What the next part of the motion begins with."""
    pace, found = here.start.pace, {"open": here.start.part.open, "followed": followed}
    return found | {"by": pace.carried if pace else "", "width": float(here.clock.real.h)}


def _health(start: Start, clock: ex.Clock, o: Integration) -> Health:
    """Figures of a run."""
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
            *map(not_allowed, changed_velocities(start.base.departures)),
            *remarks(start.assembly, clock),
            *nothing_touches(start.base.compiled.structure.model),
            *never(start.assembly.compiled, clock),
        ),
        departures=start.base.departures,
        coordinates=start.coordinates,
        engine=start.engine.told if start.engine else "",
    )


def _energy_drift(result: Result) -> float:
    return result.energy.drift
