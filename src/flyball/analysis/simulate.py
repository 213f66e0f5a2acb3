"""Motion in time: the compiled loop, called in chunks, and what it hands out made into a ``Result``."""

from __future__ import annotations

import time
from functools import partial

import numpy as np

from ..constraints.modes import BRANCH, FRICTION
from ..equations.engine import FOLLOW, INTEGRATE
from ..equations.projection import TIGHT_G, TIGHT_V
from ..equations.within import ROWS, breaking, kept
from ..errors import FlyballError, Interrupted, ModelError, SimulationError, StartWarning, warn
from ..laws.breaks import NO_BREAKS
from ..laws.functions import forget, interrupts_kept
from ..model.model import Model
from ..numerics.integrators import clock as ex
from ..numerics.integrators.tableaux import Tableau, tableau
from ..results.departure import changed_velocities, not_allowed
from ..results.result import Result
from ..tables.system import ALPHA, BETA, LATER, MASS, PASS, STABILIZE, TOL_G, TOL_V, System
from .assembly.start import Assembly
from .compiled import Compiled
from .motion import partition
from .motion.ahead import refuse_missing
from .motion.choice import AUTO, SimulateOptions, chosen, instead_of, unresolved
from .motion.driven import at_outputs, leaves_no_freedom, owed_works
from .motion.engines import TABLES, Engine
from .motion.events.here import Here
from .motion.events.legs import breaks
from .motion.events.run import run_events
from .motion.implicit.suited import IMPLICIT, VARIATIONAL, explicit, suited, unsuited
from .motion.implicit.variational import refuse_unknown
from .motion.impulse.run import impulse_motion
from .motion.impulse.settings import Stepping
from .motion.known import sampled_laws, told_of
from .motion.later import open_until_asked, solved
from .motion.options import STABILIZATION, Integration, output_times, refuse_unheld
from .motion.outcome import outcome
from .motion.part import Part, whole
from .motion.samples import refuse_too_often
from .motion.start import Start, begin, start_time
from .motion.stiff import EXPLICIT, Pace
from .motion.touches import with_places
from .progress import Tell, shown
from .watched import remark_friction

NEARER = 1e-8  # tolerances below this ask the stages to be nearer to the constraints by their square
UNMADE = {"partitioning": "partitioning chooses coordinates on the way, which made code does not know"}
"""Stabilizations that code made for a mechanism does nothing for, and why."""
SLICE = 0.05  # seconds that a call of the compiled loop should take


def simulate(model: Model, o: SimulateOptions) -> Result:
    """The motion by the method asked for, or by the one that suits the model: see `Mechanism.simulate`."""
    model = model.snapshot()
    t_start = start_time(o.t_start, o.start)
    span = (t_start, o.t_end, output_times(t_start, o.t_end, o.outputs))
    way = chosen(model, o)
    try:
        return told(model, way.options, span, way.why, o.method == AUTO)
    except (ModelError, SimulationError) as error:
        if way.instead is None or not unresolved(error):
            raise
        try:
            return told(model, way.instead, span, instead_of(error), False)
        except FlyballError:
            raise error from None


Span = tuple[float, float, np.ndarray]
"""Start and end of a motion [s], and its output times."""


def told(model: Model, o: SimulateOptions, span: Span, why: str, auto: bool, part: Part | None = None) -> Result:
    """The motion, or a part of it, which says by what it was computed, and why; ``auto``: methods may change.

    Raises
    ------
    Interrupted
        If the user ends it.
    """
    part = part or whole()
    try:
        result = _computed(model, o, span, auto, part)
    except SimulationError as error:
        if isinstance(error.result, Result):
            _tell(error.result, why)
        raise
    _tell(result, why)
    if not result.health.success and not part.paused:
        raise Interrupted(result.health.message, result)
    return result


def _tell(result: Result, why: str) -> None:
    result.health.method = "; ".join(x for x in (why, result.health.method) if x)


def _computed(model: Model, o: SimulateOptions, span: Span, auto: bool, part: Part) -> Result:
    """The motion, or a part of it, by a method that is chosen."""
    started = time.perf_counter()
    t_start, _, times = span
    if isinstance(o.method, Stepping):
        with shown(o.progress, "simulating") as tell:
            return impulse_motion(model, (t_start, o.t_end), times, o.method, o.parameters, tell, o.start, part)
    model = with_places(model, o.parameters)
    begun = begin(model, t_start, o.parameters, o.start, o.coordinates, switches=True, part=part)
    slides = _no_stops(begun) and _held(begun)  # what drivers prescribe follows no force
    if slides:
        begun = begin(model, t_start, o.parameters, o.start, o.coordinates, part=part)
    begun.since = started
    if o.method in IMPLICIT and (watched(begun) or not _held(begun)):
        begun = suited(begun, str(o.method), o.coordinates, o.parameters)
        if o.method == VARIATIONAL:
            refuse_unknown(begun)
    if o.stabilization != "projection":
        _refuse_idle(begun, o.stabilization)
    for d in changed_velocities(begun.base.departures):
        warn(not_allowed(d), StartWarning)
    made = False if o.method in IMPLICIT else o.specialize
    begun.engine = Engine(begun.assembly.compiled, made, UNMADE.get(o.stabilization, ""))
    if o.method in IMPLICIT:
        begun.engine.told = f"{TABLES}: {o.method} goes through the tables"
    mixed = auto and o.stabilization == "projection" and o.step is None
    begun.pace = Pace(float(o.t_end), AUTO if mixed else str(o.method), partial(unsuited, begun))
    begun.pace.goes_on(begun.carried.get("by", ""))
    follow = o.stabilization == "projection" and not watched(begun) and _held(begun)
    with shown(o.progress, "simulating") as tell:
        result = moved(begun, o.t_end, times, o, FOLLOW if follow else INTEGRATE, tell)
    if slides:
        remark_friction(result)
    return result


def moved(
    begun: Start,
    t_end: float,
    times: np.ndarray,
    o: Integration,
    task: int,
    tell: Tell,
) -> Result:
    """The motion from where it begins, integrated (task INTEGRATE) or as drivers prescribe it (FOLLOW).

    Raises
    ------
    ModelError
        If a table of time ends before the motion does, or the start lies beyond the ends of a table.
    SimulationError
        If it cannot go on; its ``result`` holds the motion up to then.
    """
    refuse_missing(begun.base, float(t_end))
    o = o.sized(begun.base.compiled.values.length)
    if o.stabilization == "partitioning":
        partition.choose(begun.base.compiled.structure.model, begun)
    c, engine = begun.assembly.compiled, begun.engine or Engine(begun.assembly.compiled, False)
    begun.part.begin(c.structure)
    if task == INTEGRATE:
        refuse_too_often(c, (begun.base.t, float(t_end)), o.max_steps)
    known = breaks(c, begun.base.t, float(t_end)) if task == INTEGRATE else NO_BREAKS
    sampled = sampled_laws(c, known)
    clock = clock_for(begun, begun.base.t, float(t_end), times, o, sampled)
    later = not watched(begun) and open_until_asked(begun, o, task)
    c.array("option")[LATER] = float(later)
    here = Here(begun, clock)
    if task == INTEGRATE and (o.method in IMPLICIT or watched(begun) or len(known.times) or c.structure.sampled):
        rows, interrupted = run_events(here, o, width(begun.assembly), tell, engine, known)
    else:
        method = tableau(explicit(o.method))
        rows, interrupted = np.zeros((0, width(begun.assembly))), False
        if begun.pace is None or not begun.pace.asked:
            rows, interrupted = run_clock(begun.assembly, clock, method, tell, task, engine, begun.pace, begun.part)
        if begun.pace is not None and begun.pace.asked and not begun.part.paused:
            more, interrupted = run_events(here, o, width(begun.assembly), tell, engine, known)
            rows = np.concatenate([rows, more])
        elif begun.pace is not None:
            here.method = "; ".join(begun.pace.told)
    if task == INTEGRATE:
        here.watched = "; ".join(x for x in (here.watched, told_of(c, sampled)) if x)
    owed = None
    if task == FOLLOW:
        owed = partial(owed_works, begun, clock, rows)
        rows = at_outputs(clock, rows)
    return outcome(here, rows, o, interrupted, owed, partial(solved, begun, rows) if later else None)


def _no_stops(begun: Start) -> bool:
    """Whether nothing is watched but corners of laws and friction."""
    s = begun.assembly.compiled.structure
    return bool(s.switches) and not s.model.events and all(x.switch.kind in (BRANCH, FRICTION) for x in s.switches)


def _held(begun: Start) -> bool:
    """Whether drivers leave no freedom: as in the part before it, where there is one."""
    return bool(begun.carried["followed"]) if "followed" in begun.carried else leaves_no_freedom(begun)


def watched(begun: Start) -> bool:
    """Whether something may happen at an instant: there are guards, or rows with modes."""
    s = begun.assembly.compiled.structure
    return bool(s.guards or s.switches or s.model.events)


def _refuse_idle(begun: Start, stabilization: str) -> None:
    """Refuse to keep states on constraints where there are none."""
    if not len(begun.assembly.compiled.values.system.row_i):
        joint = len(begun.base.compiled.values.system.row_i) > 0
        where, remedy = ("in joint coordinates ", ", or give coordinates='absolute'") if joint else ("", "")
        raise ModelError(
            f"stabilization={stabilization!r} does nothing: {where}no constraint is left to be kept; leave it out"
            f"{remedy}"
        )


def clock_for(
    start: Start,
    t: float,
    t_end: float,
    times: np.ndarray,
    o: Integration,
    sampled: frozenset[int] | None = None,
) -> ex.Clock:
    """Everything the compiled loop needs to start, and the choices of the solve.

    ``sampled`` are the laws that are looked at within steps; without it all that can act briefly are.
    """
    a, y = start.assembly, start.y
    refuse_unheld(len(times), width(a))
    s, option = a.compiled.structure, a.compiled.array("option")
    real, count = np.zeros(ex.REALS), np.zeros(ex.COUNTS, np.int64)
    real[ex.T], real[ex.T_END], real[ex.RTOL] = t, t_end, o.rtol
    first = t if start.part.first is None else start.part.first
    real[ex.SPAN] = (t_end - first) or 1.0
    real[ex.STEP] = o.step or 0.0
    real[ex.H] = o.step or start.carried.get("width", 0.0)
    real[ex.H_MAX] = min(o.step or o.max_step, t_end - t)
    real[ex.LARGEST] = max(abs(t), abs(t_end))
    count[ex.QUOTA] = 50
    count[ex.LIMIT] = o.max_steps
    count[ex.CONTROLLED], count[ex.POSITIONS] = s.nq + s.nv + len(s.controls) - len(s.sampled), s.nq
    Y = np.zeros((ex.STATES, len(y)))
    Y[0] = y
    option[STABILIZE] = STABILIZATION[o.stabilization]
    option[ALPHA], option[BETA] = o.alpha or 0.0, o.beta or 0.0
    option[PASS] = 1e-13
    nothing = sampled is not None and not sampled and not breaking(a.compiled.values.system)
    seen = np.zeros((ROWS, 0)) if nothing else kept(a.compiled.values.system, sampled)
    works = [s.nq + s.nv + k for name, k in s.state_at.items() if name.endswith(".work")]
    K = np.zeros((len(tableau(explicit(o.method)).c) + 1, len(y)))
    clock = ex.Clock(real, count, times, Y, K, np.array(works, np.int64), seen)
    size(clock, start.base, a.compiled, o.tolerance(a.compiled.values.length))
    return clock


def size(clock: ex.Clock, base: Assembly, c: Compiled, atol: float) -> None:
    """Write what follows from a mechanism's length and weight: tolerances, and what they are compared with."""
    real, option = clock.real, c.array("option")
    energy = energy_size(base, float(real[ex.SPAN]))
    found = sizes(c.values.length, atol, real[ex.RTOL], energy)
    (real[ex.ATOL], real[ex.SCALE], real[ex.LEDGER]), (option[TOL_G], option[TOL_V]) = found


def sizes(length: float, atol: float, rtol: float, energy: float) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Entries ATOL, SCALE and LEDGER of the clock, TOL_G and TOL_V of the options."""
    loose = atol + rtol * length
    near = loose * min(1.0, loose / (NEARER * length))
    return (atol, length, energy), (
        min(1e-6, max(TIGHT_G * length, 1e-2 * near)),
        min(1e-5, max(TIGHT_V, 1e-1 * near)),
    )


def energy_size(a: Assembly, span: float) -> float:
    """An energy [J] that errors of works are small against: to lift the mechanism by its length, and to move it by as
    much in the time there is, besides what it has.
    """
    x = a.compiled.values
    weight = x.unforced.kept.get("weight", None, 1, lambda: _weight(x.system))
    return lifted(weight, x.length, span) + a.compiled.kinetic_energy(a.v)


def _weight(S: System) -> tuple[float, float]:
    """Mass of all bodies [kg], and gravity [m/s^2]."""
    return float(S.body_x[:, MASS].sum()), float(np.sqrt((S.glob[:3] ** 2).sum()))


def lifted(weight: tuple[float, float], length: float, span: float) -> float:
    """That of a mechanism at rest: of its mass [kg] and gravity [m/s^2], its length [m] and the time [s]."""
    mass, g = weight
    fast = min(length / span, 1e150)  # its square is a number, however short the span
    return mass * (g * length + fast * fast)


def width(a: Assembly) -> int:
    """How many numbers are kept of each output time."""
    s = a.compiled.structure
    return 1 + s.nq + s.nv + len(a.compiled.z) + s.nv + len(a.compiled.values.system.row_i) + len(s.prescribed)


def run_clock(
    a: Assembly,
    clock: ex.Clock,
    method: Tableau,
    tell: Tell,
    task: int,
    engine: Engine | None = None,
    pace: Pace | None = None,
    part: Part | None = None,
) -> tuple[np.ndarray, bool]:
    """Call the compiled loop until it is through. Returns (output rows, whether the user interrupted).

    ``engine`` may choose another one on the way; without it the run is table-driven.
    ``pace`` may ask for another method, and then this one goes no further. It ends early where ``part`` does.
    """
    c, engine, part = a.compiled, engine or Engine(a.compiled, False), part or whole()
    s, wide = c.structure, width(a)
    buffer = np.zeros((max(2, min(len(clock.times), 1_000_000 // wide + 1)), wide))
    rows = []
    first = clock.real[ex.T]
    span, reached = clock.real[ex.T_END] - first or 1.0, 0.0
    bound, on = None, (c.system, c.scratch)
    forget(c.array("stack"))
    engine.begin(clock)
    quota = engine.limited(clock, float(clock.count[ex.QUOTA]))
    if pace is not None:
        quota = pace.limited(clock, quota)
    try:
        while True:
            begin, clock.count[ex.QUOTA] = time.perf_counter(), part.most(quota)
            before = clock.count[ex.ACCEPTED] + clock.count[ex.REJECTED]
            with interrupts_kept(s.functions):
                if bound is None or c.system is not on[0] or c.scratch is not on[1]:  # made code came, or went
                    bound, on = c.bound(method, clock, buffer), (c.system, c.scratch)
                used = bound(task)
                rows.append(buffer[:used].copy())
            reached = max(reached, (clock.real[ex.T] - first) / span)
            tell(reached)
            if clock.count[ex.STATUS] != ex.RUNNING and not engine.hands_over(clock):
                return np.concatenate(rows), False
            took = time.perf_counter() - begin
            done = clock.count[ex.ACCEPTED] + clock.count[ex.REJECTED] - before
            part.took(done)
            engine.choose_again(clock)
            if part.over(clock if task == INTEGRATE else None):  # of what is followed every step is one
                return np.concatenate(rows), False
            quota = engine.limited(clock, max(done, 1) * SLICE / max(took, 1e-6))
            if pace is not None and task == INTEGRATE:
                pace.asked = pace.turns(c, clock, EXPLICIT)
                if pace.asked:
                    return np.concatenate(rows), False
                quota = pace.limited(clock, quota)
    except KeyboardInterrupt:
        return np.concatenate(rows) if rows else np.zeros((0, wide)), True
    finally:
        engine.end()
