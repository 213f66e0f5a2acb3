"""The event loop: integrates to the next event, resolves it and continues; records phases, detects accumulating events.

Without guards, steps end only at times known beforehand and the engine's own loop runs between them. Events that
accumulate (t = T - c n^-a) are distinguished from frequent ones by the times of the 1st, 2nd, 4th, 8th, ...
occurrence.
"""

from __future__ import annotations

import math
import time
from collections import deque
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from ...constraints.switches.switch_kind import (
    DISTANCE_GUARDS,
    FORCE_GUARDS,
    G_BACK,
    G_CORNER,
    G_SHARED,
    HELD,
)
from ...engine.calls import OutputBuffer
from ...engine.entry_point import INTEGRATE, MOTION, REPORT, engine, run_task
from ...engine.guards import distribute_forces_kernel, update_null_vectors_kernel
from ...engine.integration_loop import ExplicitMethod, GuardedLoop, SmoothLoop
from ...engine.pulse_detection import INSPECTION_ROWS
from ...engine.sampled_controllers import SampledControllers
from ...errors import FlyballError, ModelError
from ...laws.breakpoints import Breakpoints
from ...laws.python_functions import clear_faults, deferred_interrupts
from ...numerics.complementarity.interior_point import UNKNOWN_COUNT
from ...numerics.event_location.guards import (
    CHECK_NODES,
    EVENT_FOUND,
    NODES,
    UNKNOWN_SIDE,
)
from ...numerics.integrators import time_loop as ex
from ...numerics.integrators.butcher_tableaux import tableau
from ...numerics.integrators.time_loop import StateVectors, StepCounts, StepReals, StepState
from ...progress import ReportProgress
from ...results.events import Phase, RecordedModes, event_energies, phases_or_none
from ...results.result import Result
from ...tables.table_definitions import assign
from ..implicit_integrators import implicit_integrator
from ..integration_intervals import IMPLICIT_STEP_WEIGHT, SegmentEnd, SmoothIntervals, known_breaks, sampling
from ..integration_options import Integration
from ..method_choice import IMPLICIT_METHODS, explicit_substitute
from ..motion_result import missing_accelerations
from ..solver_switching import (
    BECAUSE_JUMPED,
    BECAUSE_NOT_STIFF,
    BECAUSE_STIFF,
    EXPLICIT_METHOD,
    FAILED_STATUS,
    CodeSelection,
    StiffnessMonitor,
    slides_on_corner,
)
from .context import EventContext
from .event_actions import event_expressions, events_at_start, initially_true, passed_at_jump_time, report_missed_events
from .event_messages import accumulating_events, endless_events
from .instant_problem import instant_problem
from .mode_selection import write_rounding_levels
from .resolution import resolve_event, resolve_start

LEAST_OCCURRENCES = 8192  # least number of occurrences of an accumulating event
RATIO_COUNT = 4  # number of ratios of intervals that must agree
STEADY_RATIO = 1.25  # largest quotient of the largest and the smallest ratio
RATIO_LIMIT = 0.95  # largest ratio of a converging series
MOST_EMPTY_EVENTS = 500  # events in a row without effect from which on they are endless
EMPTY_SPAN_SHARE = 1e-3  # part of the time span within which they are endless


class OccurrenceTimes:
    """Times at which each guard had triggered 1, 2, 4, 8, ... times."""

    def __init__(self) -> None:
        self.times: dict[int, tuple[int, list[float]]] = {}
        self.empty = 0
        self._since = 0.0
        self._before: tuple[np.ndarray, int] | None = None

    def add(self, fired: Iterable[int], t: float) -> None:
        """Count guards that trigger at t [s]."""
        for g in fired:
            n, past = self.times.get(g, (0, []))
            n += 1
            if n & (n - 1) == 0:
                past.append(t)
            self.times[g] = n, past

    def nothing(self, here: EventContext) -> tuple[int, float] | None:
        """Return the number of successive events without effect and their time span [s], if they are endless; else
        None.

        An event without effect changes no mode, no switch state and adds no record.
        """
        W = here.c.work
        first = W.sensed.shape[1] - W.modes.mode.shape[0]
        now = np.vstack((*W.modes, W.sensed.value[first:])), len(here.records)
        old, self._before = self._before, now
        same = old is not None and old[1] == now[1] and np.array_equal(old[0], now[0])
        if not same or self.empty == 0:
            self.empty, self._since = 0, here.t
        self.empty += 1
        within = here.t - self._since
        endless = self.empty >= MOST_EMPTY_EVENTS and within < EMPTY_SPAN_SHARE * here.clock.real.span
        return (self.empty, within) if endless else None

    def accumulate(self, fired: Iterable[int], until: float) -> tuple[int, int, float] | None:
        """Return a guard that accumulates before ``until`` [s]: the guard, its count, and the accumulation time; or
        None.
        """
        for g in fired:
            n, past = self.times[g]
            if n >= LEAST_OCCURRENCES and n & (n - 1) == 0:
                end = accumulation_point(past)
                if end < until:
                    return g, n, end
        return None


def accumulation_point(past: list[float]) -> float:
    """Return the limit of times whose intervals shrink by a steady ratio; infinite if they do not."""
    between = [b - a for a, b in pairwise(past[-RATIO_COUNT - 2 :])]
    if len(between) <= RATIO_COUNT or min(between) <= 0.0:
        return math.inf
    ratios = [b / a for a, b in pairwise(between)]
    if max(ratios) > RATIO_LIMIT or max(ratios) > STEADY_RATIO * min(ratios):
        return math.inf
    return past[-1] + between[-1] * ratios[-1] / (1.0 - ratios[-1])


CHECKS_PER_STEP = NODES - 1 + CHECK_NODES  # least number of points of a step at which guards are evaluated


def guard_check_remark(loop: GuardedLoop) -> str:
    """Return the health remark on the number of points at which guards were evaluated."""
    count = loop.guard_state.count
    guards, steps = len(loop.guard_state.way), max(int(count.steps), 1)
    what = "1 event function" if guards == 1 else f"{guards} event functions"
    most = max(count.looks / steps + 1, CHECKS_PER_STEP)  # plus the end of the step
    return (
        f"{what} evaluated at about {most:.0f} points per step (at least {CHECKS_PER_STEP}): a function that crosses "
        "zero twice between two points can be missed; a smaller max_step reduces that risk"
    )


def note_fired_zeros(here: EventContext, loop: GuardedLoop) -> None:
    """Store the rounding of event expressions where a step ended on events, and the values of those that triggered."""
    events, guard_state = here.structure.events, loop.guard_state
    here.nothing = {g: float(guard_state.guards.zero_band[g]) for g in events}
    here.zero |= {events[g].name: float(guard_state.guards.trigger[g]) for g in loop.fired if g in events}


def note_rounding_zeros(here: EventContext, loop: GuardedLoop) -> None:
    """Store the rounding of event expressions where a step ended at a time at which forces jump."""
    here.nothing = {
        g: float(loop.guard_state.real.drift * loop.guard_state.guards.end_rounding[g]) for g in here.structure.events
    }


def save_final_signs(here: EventContext, loop: GuardedLoop) -> None:
    """Store the last signs of event expressions that are zero to rounding at the end of the motion."""
    guard_state, here.final_signs = loop.guard_state, {}
    for g, e in here.structure.events.items():
        near = abs(guard_state.guards.end[g]) <= guard_state.real.drift * guard_state.guards.end_rounding[g]
        if near and abs(guard_state.side[g]) == 1.0:
            here.final_signs[e.name] = float(guard_state.side[g])


def restore_signs(here: EventContext, loop: GuardedLoop) -> None:
    """Restore the signs of event expressions where a motion continues.

    An event at the very end of the earlier motion has just happened. Any other is still ahead, however near: it keeps
    the sign that it had before its value was rounding. A value that is clearly nonzero now gives the sign itself.
    """
    guard_state, told = loop.guard_state, events_at_start(here)
    values = instant_problem(here).guards()
    for g, e in here.structure.events.items():
        guard_state.side[g] = (
            0.0 if e.name in told else here.final_signs.get(e.name) or np.sign(values[g]) or UNKNOWN_SIDE
        )
        guard_state.guards.end[g], guard_state.guards.trigger[g] = values[g], here.zero.get(e.name, 0.0)


# Switches whose guards are beyond zero at the end of a step though no crossing was detected.


SLOW_SHARE = 0.5  # largest ratio of the rate at the start of the step to that at the stop for a missed crossing


def missed_crossings(here: EventContext, loop: GuardedLoop) -> frozenset[int]:
    """Return switches whose crossing was not detected: stops crept past, corners on the other side.

    Such a stop hardly moved at the start of the step; one that moved closes with an impact. The side of a law is
    decided in `nonsmooth_laws`.
    """
    S, out = here.c.system, set()
    for g in loop.fired if loop.guard_state.count.leaves_required_side else ():
        kind, s = int(S.guards.kind[g]), int(S.guards.of[g])
        if kind == G_CORNER:
            out.add(s)
        elif kind in DISTANCE_GUARDS:
            before, now = np.abs(loop.guard_state.moving[:, 1, S.switches.measured[s]])
            if before <= SLOW_SHARE * now:
                out.add(s)
    return frozenset(out)


@dataclass
class PhaseRecorder:
    """Output rows between events, with the modes and parameters that were active."""

    all: list[Phase] = field(default_factory=list)

    def add(self, here: EventContext, rows: np.ndarray) -> None:
        """Record rows that the compiled loop has just written (possibly none), with the present modes."""
        c, W = here.c, here.c.work
        n = len(here.structure.switches)
        ways = W.sensed.value[W.sensed.shape[1] - n :].copy()
        if slides_on_corner(c):
            ways = _switch_states(here, rows)
        _clear_held_rates(here, rows)
        distribute_forces(here, rows)
        self.all.append(
            Phase(
                len(rows),
                np.array(W.modes[: len(RecordedModes._fields)]),
                ways,
                c.values,
                here.lost,
                getattr(here, "given", 0.0),
                here.y.copy(),
            )
        )

    def add_phases(self, result: Result) -> None:
        """Add the phases, and the energy exchanged by events, to a result, if anything can switch."""
        s = result.values.structure
        if not s.switches and not s.guards and not s.model.events:
            return
        result.phases = phases_or_none(self.all)
        result.exchanged |= event_energies(result)


def _clear_held_rates(here: EventContext, rows: np.ndarray) -> None:
    """Set the rates of coordinates that a single row keeps at a value to exactly zero at output rows."""
    S, W, s = here.c.system, here.c.work, here.structure
    first, ny = 1 + s.nq, 1 + len(here.y)
    for k in np.flatnonzero(W.modes.mode == HELD).tolist():
        row = S.switches.row[k]
        if row >= 0 and S.rows.law[row] < 0 and S.row_start[row + 1] - S.row_start[row] == 1:
            column = S.column[S.row_start[row]]
            rows[:, [first + column, ny + column]] = 0.0


def _switch_states(here: EventContext, rows: np.ndarray) -> np.ndarray:
    """Return the states of all switches at output rows, (ns, n), where laws slide along their switching surface."""
    s, c, n = here.structure, here.c, len(here.structure.switches)
    out = np.zeros((n, len(rows)))
    again = c.again()
    assign(again.work.modes, c.work.modes)
    again.work.sensed[:] = c.work.sensed
    for k, row in enumerate(rows):
        again.z = row[1 + s.nq + s.nv : 1 + len(here.y)].copy()
        again.at(row[0], row[1 : 1 + s.nq], row[1 + s.nq : 1 + s.nq + s.nv], MOTION)
        out[:, k] = again.work.sensed.value[again.work.sensed.shape[1] - n :]
    return out


# Indeterminate forces as reported: a distribution within all bounds.


def distribute_forces(here: EventContext, rows: np.ndarray) -> None:
    """Replace least-squares forces by a distribution within the friction bounds, at output rows of indeterminate
    contacts.
    """
    group = getattr(here, "sharing", None)
    if group is None or group.Q.count[UNKNOWN_COUNT] == 0 or not len(rows):
        return
    s, again, G = here.structure, here.c.again(), group
    W, S, ny = again.work, again.system, len(here.y)
    assign(W.modes, here.c.work.modes)
    W.sensed[:] = here.c.work.sensed
    none, R = np.zeros(0, np.int64), tableau("rk45")
    seen, state = np.zeros((INSPECTION_ROWS, 0)), StateVectors.blank(ny)
    own = StepState(StepReals.blank(), StepCounts.blank(), np.zeros(0), state, np.zeros((1, ny)), none, seen)
    sheet = OutputBuffer(np.zeros((4, max(s.nv, len(S.rows.law), 1))))
    address = engine.address
    lam = slice(1 + ny + s.nv, 1 + ny + s.nv + len(S.rows.law))
    for row in rows:
        again.z = row[1 + s.nq + s.nv : 1 + ny].copy()
        again.at(row[0], row[1 : 1 + s.nq], row[1 + s.nq : 1 + s.nq + s.nv], MOTION)
        update_null_vectors_kernel(address, S, W, R, own, sheet, G)
        W.rows.multiplier[:] = row[lam]
        distribute_forces_kernel(S, W, row[0], G)
        row[lam] = W.rows.multiplier


CALL_SECONDS = 0.05  # intended duration of one call of the compiled loop [s]
ENDLESS = 2000  # number of events within `AT_ONCE` that counts as endless
REPORTED_EVENTS = 20  # last events that the message names
CONTACT_TOLERANCE = 1e-10  # distance at which a stop is reached, relative to the mechanism's length or a radian
HELD_GUARDS = (*FORCE_GUARDS, G_SHARED, G_CORNER)  # guards of active rows, by the forces that they carry
AT_ONCE = 1e-9  # part of the time span within which `ENDLESS` events are endless


class EventDrivenMotion:
    """A motion integrated from event to event.

    Parameters
    ----------
    here : EventContext
    o : Integration
        The integrator and its options.
    width : int
        Width of an output row.
    report : callable
        Called with the completed fraction.
    engine : CodeSelection
        Which code runs where there are no guards.
    """

    def __init__(
        self, here: EventContext, o: Integration, width: int, report: ReportProgress, engine: CodeSelection
    ) -> None:
        self.engine, self.now, self.options = engine, o.method, o
        self.pace = here.start.pace or StiffnessMonitor(float(here.clock.real.t_end), o.method, str)
        self.here, self.method, self.width, self.tell = here, tableau(explicit_substitute(o.method)), width, report
        clock = here.clock
        self.buffer = np.zeros((max(2, min(len(clock.times), 1_000_000 // width + 1)), width))
        self.rows: list[np.ndarray] = [np.zeros((0, width))]
        self.end = float(clock.real.t_end)  # of the motion; that of the integrator is the end of an interval
        self.first, self.span = here.t, self.end - here.t or 1.0
        self.part, self.quota = here.start.part, int(clock.count.quota)
        self.segment_end_finder = SegmentEnd(self.part, clock)
        self.recent: deque[float] = deque(maxlen=ENDLESS)
        self.latest: deque[Sequence[int]] = deque(maxlen=REPORTED_EVENTS)
        self.counts = OccurrenceTimes()
        self.guarded = len(here.c.system.guards.kind) > 0
        watched = self.guarded or len(here.c.system.switches.row) or here.structure.model.events
        here.recorder = PhaseRecorder() if watched else None
        self.sampling = self._sampling(here.t)
        self.loop = self._loop()

    def _sampling(self, t: float) -> SampledControllers | None:
        return sampling(self.here.c, self.method, self.pace.mixed, (t, self.end), (self.width, len(self.buffer)))

    @property
    def stops(self) -> SampledControllers | None:
        """Sampled controllers for which the loop has to stop; without guards the loop samples them itself."""
        return self.sampling if self.guarded else None

    def _until(self, end: float) -> float:
        """Return the time up to which the loop should run: the next sampling instant, or the end of a segment."""
        return self.segment_end_finder.until(
            min(end, math.inf if self.stops is None else self.stops.next(self.here.clock.times))
        )

    def sampled(self) -> bool:
        """Sample the controllers that are due, where the loop stops for them. Returns whether any was; forces may
        jump.
        """
        here = self.here
        if self.stops is None or not self.stops.due(here.t):
            return False
        before = event_expressions(here)
        if self.stops.sample(*here.c.buffers, here.clock) != 0:
            here.clock.count.status = ex.STEP_FAILED
            return True
        self.resolve_force_jump(before)
        if len(self.rows[-1]) and self.rows[-1][-1, 0] == here.t:
            self.rows[-1][-1] = self.row()
        return True

    def _loop(self) -> GuardedLoop | SmoothLoop | None:
        """Create the loop for an implicit method or guards; None where the engine's own loop is used."""
        here, c = self.here, self.here.c
        if self.now not in IMPLICIT_METHODS and not self.guarded:
            return None
        steps = (
            implicit_integrator(self.now, c, here.clock, self.options)
            if self.now in IMPLICIT_METHODS
            else ExplicitMethod(self.method)
        )
        way = steps, here.clock, c.structure, c.system, c.scratch, max(self.width, steps.width)
        return GuardedLoop(*way, here.group) if self.guarded or self.sampling is not None else SmoothLoop(*way)

    def go(self, known: Breakpoints) -> tuple[np.ndarray, bool]:
        """Compute the motion as far as possible. Returns (output rows, whether the user interrupted)."""
        here, engine = self.here, self.engine
        clear_faults(here.c.array("stack"))
        try:
            self.begin()
            engine.begin(here.clock)
            self.intervals = SmoothIntervals(here.clock, known, self._until)
            # a sampling that was still due at the end of the earlier motion may cause events
            if here.start.before is not None and self.sampled():
                here.clock.count.status = ex.RUNNING
                self.turned()
            while not here.stopped:
                self.integrate()
                if self.over():
                    break
            if here.stopped or self.part.paused:
                self.stop()
            if not self.part.paused:
                report_missed_events(here)
        except KeyboardInterrupt:
            here.clock.count.status = ex.RUNNING
            return np.concatenate(self.rows), True
        except FlyballError as error:
            if isinstance(error, ModelError) and not here.t > self.first:  # the model is invalid
                raise
            here.failed = error
        finally:
            engine.end()
            if isinstance(self.loop, GuardedLoop) and self.guarded:
                here.detection_remark = guard_check_remark(self.loop)
                save_final_signs(here, self.loop)
            if self.loop is not None and here.failed is None:
                here.failed = self.loop.steps.failed
            here.method = self.pace.words()
        return np.concatenate(self.rows), False

    def turn(self, to: str, why: str) -> None:
        """Continue by another method."""
        clock, before = self.here.clock, self.loop
        self.pace.turned(clock, to, why)
        self.now = to
        self.engine.stop()
        self.loop = self._loop()
        if isinstance(before, GuardedLoop) and isinstance(self.loop, GuardedLoop):
            now, old = self.loop.guard_state, before.guard_state
            now.side[:], now.guards[:] = old.side, old.guards
        clock.count.started, clock.count.status = 0, ex.RUNNING
        if to not in IMPLICIT_METHODS and not clock.real.step:
            clock.real.h = 0.0  # chosen as at the start

    def turned(self) -> bool:
        """Change the method where that pays, or where the present one is not applicable. Returns whether it changed."""
        pace, c, clock = self.pace, self.here.c, self.here.clock
        implicit, corner = self.now in IMPLICIT_METHODS, slides_on_corner(c)
        if implicit and corner:
            pace.back = self.now
            self.turn(EXPLICIT_METHOD, "while the motion stays on the corner of a law")
        elif pace.back and not corner:
            to, pace.back = pace.back, ""
            self.turn(to, "where none is any more")
        elif implicit and pace.mixed and clock.count.status in FAILED_STATUS:
            self.turn(EXPLICIT_METHOD, f"where {self.now} could not continue")
            pace.stays()
        elif pace.asked and clock.count.status in (ex.RUNNING, EVENT_FOUND):
            self.turn(pace.asked, BECAUSE_STIFF if pace.asked in IMPLICIT_METHODS else BECAUSE_JUMPED)
        elif clock.count.status == ex.RUNNING and (to := pace.turns(c, clock, self.now)):
            self.turn(to, BECAUSE_STIFF if to in IMPLICIT_METHODS else BECAUSE_NOT_STIFF)
        else:
            return False
        return True

    def over(self) -> bool:
        """Handle the status with which the compiled loop returned. Returns whether the motion is over."""
        clock, engine = self.here.clock, self.engine
        status = clock.count.status
        if status == EVENT_FOUND:
            self.event()
        elif status == ex.DONE:
            return self.arrived()
        elif status != ex.RUNNING and not engine.falls_back(clock) and not self.turned():
            return True
        self.turned()
        self.intervals.whole()
        if self.loop is None:
            engine.choose_again(clock)
        if self.segment_end_finder.here():
            return True
        self.intervals.aim()
        return False

    def arrived(self) -> bool:
        """Handle the end of an interval. Returns whether the motion is over."""
        clock, through = self.here.clock, self.intervals.through()
        if not through and self.segment_end_finder.here():
            clock.real.h = max(clock.real.h, clock.real.wide)  # the last step was cut short
            return True
        if self.sampled() or not through:
            if clock.count.status == ex.STEP_FAILED:
                return True
            clock.count.status = ex.RUNNING
            self.turned()
            self.intervals.aim()
            return False
        sharp = self.intervals.ends_with_jump() and self.guarded
        before = event_expressions(self.here) if sharp else {}
        self.segment_end_finder.note_event()
        if not self.intervals.next():
            return True
        if sharp:
            self.resolve_force_jump(before)
            self.turned()
        return False

    def begin(self) -> None:
        """Resolve the start of the motion."""
        here, on = self.here, self.here.start.before is not None
        if not on and self.stops is not None and self.stops.due(here.t):
            self.stops.sample(*here.c.buffers, here.clock)
        resolve_start(here)
        if isinstance(self.loop, GuardedLoop) and self.guarded and on:
            restore_signs(here, self.loop)
        here.true = initially_true(here)
        self.here.fresh = False
        self.turned()

    def integrate(self) -> None:
        """Call the compiled loop once."""
        here, c, clock = self.here, self.here.c, self.here.clock
        before = time.perf_counter()
        weight = IMPLICIT_STEP_WEIGHT if self.now in IMPLICIT_METHODS else 1.0
        clock.count.quota = self.part.most(self.pace.limited(clock, self.quota), weight)
        steps = clock.count.accepted + clock.count.rejected
        with deferred_interrupts(c.structure.functions):
            if self.loop is None and self.sampling is not None:
                used = self.sampling.go_on(*c.buffers, clock, self.buffer)
            elif self.loop is None:
                used = run_task(*c.buffers, self.method, clock, self.buffer, INTEGRATE)
            elif isinstance(self.loop, SmoothLoop):
                used = self.loop.go_on(self.buffer)
            else:
                write_rounding_levels(here, self.loop)
                used = self.loop.go_on(c.system, self.buffer, self.sampling)
            self.take(self.buffer[:used].copy())
        self.tell(max(0.0, min(1.0, (clock.real.t - self.first) / self.span)))
        done = int(clock.count.accepted + clock.count.rejected - steps)
        self.part.count_steps(done * weight)
        if clock.count.status == ex.RUNNING:
            took = max(time.perf_counter() - before, 1e-6)
            self.quota = self.engine.limited(clock, max(done, 1) * CALL_SECONDS / took)

    def take(self, rows: np.ndarray) -> None:
        """Store output rows."""
        self.rows.append(rows)
        if self.here.recorder is not None:
            self.here.recorder.add(self.here, rows)

    def event(self) -> None:
        """Resolve the event at which the loop stopped, and restart the integration."""
        here = self.here
        fired = self.loop.fired if self.loop else ()
        self.recent.append(here.t)
        self.latest.append(fired)
        many, since = len(self.recent), self.recent[-1] - self.recent[0]
        if often := (many, since) if many == ENDLESS and since < AT_ONCE * self.span else self.counts.nothing(here):
            raise endless_events(instant_problem(here), self.latest, *often)
        self.counts.add(fired, here.t)
        if found := self.counts.accumulate(fired, self.intervals.end):
            raise accumulating_events(instant_problem(here), *found)
        if isinstance(self.loop, GuardedLoop):
            here.missed_crossings = missed_crossings(here, self.loop)
            note_fired_zeros(here, self.loop)
        self.resolve(fired)
        here.missed_crossings, here.nothing = frozenset(), {}

    def resolve(self, fired: Sequence[int]) -> None:
        """Resolve the instant at which these guards triggered."""
        here, clock = self.here, self.here.clock
        system, before = here.c.system, here.v.copy()
        resolve_event(here, fired)
        if np.abs(here.v - before).max(initial=0.0) > self.options.rtol * np.abs(before).max(initial=0.0):
            self.pace.velocity_jumped(self.now)
        self.part.decided()
        self.segment_end_finder.note_event()
        clock.count.started = 0
        at, over = here.t, self.guarded and not here.stopped and self.intervals.over()
        was = {g: x for g, x in event_expressions(here).items() if g not in fired} if over else {}
        self.intervals.passed()
        if here.c.system is not system:  # another value of a parameter: laws have other corners
            self.intervals.whole()
            self.intervals = SmoothIntervals(clock, known_breaks(here.c, here.t, self.intervals.end), self._until)
            other = self._sampling(here.t)
            if other is not None and self.sampling is not None and other.differs(self.sampling):
                self.sampling = other
        if self.loop is not None and here.c.scratch is not self.loop.scratch:
            self.loop = self._loop()
        if here.fresh:
            clock.real.h = min(clock.real.h, clock.real.wide or clock.real.h)
            here.fresh = False
        if over and here.t > at:  # laws may jump at the same instant
            self.resolve_force_jump(was)

    def resolve_force_jump(self, before: Mapping[int, float]) -> None:
        """Resolve the instant after a possible jump of forces.

        Active rows may have to open, and stops at their bound may be pressed. No guard has crossed zero there.
        ``before``: values of event expressions before that time, across which they are not followed.
        """
        here = self.here
        if isinstance(self.loop, GuardedLoop):
            note_rounding_zeros(here, self.loop)
        n, kinds, of = instant_problem(here), here.c.system.guards.kind, here.c.system.guards.of
        values, sides = n.guards(), np.isin(kinds, (*DISTANCE_GUARDS, G_BACK))
        at = sides & (np.abs(values) <= CONTACT_TOLERANCE * n.unit[np.where(sides, of, 0)]) if sides.any() else sides
        against = np.flatnonzero(((values < 0.0) & np.isin(kinds, HELD_GUARDS)) | at)
        if fired := [*against.tolist(), *passed_at_jump_time(here, before)]:
            self.resolve(fired)
        here.nothing = {}

    def stop(self) -> None:
        """End the motion or the segment here, and write the last row unless it is there already."""
        here, clock, part = self.here, self.here.clock, self.part
        part.open = part.paused and self.sampling is not None and self.sampling.due(here.t)
        if part.paused and len(self.rows[-1]) and self.rows[-1][-1, 0] == here.t:
            return
        self.take(self.row()[None, :])
        if not part.paused:
            clock.count.status = ex.DONE

    def row(self) -> np.ndarray:
        """Return the output row at the present time."""
        here, c = self.here, self.here.c
        status = here.clock.count.status
        row, y = np.zeros((1, self.width)), here.y.copy()
        if run_task(*c.buffers, self.method, here.clock, row, REPORT) != 0:
            row[0, 1 + len(y) :] = np.nan  # these entries are from the last evaluation, at another state
            here.doubts.append(missing_accelerations(c, row))
        here.y[:], here.clock.count.status = y, status
        return row[0]


def integrate_events(
    here: EventContext, o: Integration, width: int, report: ReportProgress, engine: CodeSelection, known: Breakpoints
) -> tuple[np.ndarray, bool]:
    """Integrate from event to event. Returns (output rows, whether the user interrupted).

    Parameters
    ----------
    here : EventContext
        The start of the motion; receives the events, and in ``failed`` why it could not continue.
    o : Integration
        The integrator and its options.
    width : int
        Width of an output row.
    report : callable
        Called with the completed fraction.
    engine : CodeSelection
        Which code runs where there are no guards.
    known : Breakpoints
        Times at which steps end.
    """
    return EventDrivenMotion(here, o, width, report, engine).go(known)
