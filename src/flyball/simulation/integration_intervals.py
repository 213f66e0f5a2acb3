"""Intervals of integration: times at which steps must end, sampling instants, and segments of a checkpointed motion.

Laws of time have breakpoints and short pulses; steps end there. A checkpointed motion is computed in segments. Their
length is counted in steps and not in seconds, so that the same call gives the same digits, interrupted or not.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from ..assembly.compiled_mechanism import CompiledMechanism
from ..constraints.switches.switch_kind import G_LAW
from ..engine.pulse_detection import law_starts
from ..engine.sampled_controllers import INSTANT_TOLERANCE, SampledControllers, SamplePlan
from ..errors import ModelError
from ..laws.breakpoints import Breakpoints, Timed, acts_briefly, find_breakpoints, rounding_margin, time_dependent_laws
from ..numerics.integrators import time_loop as ex
from ..numerics.integrators.butcher_tableaux import Tableau, tableau
from ..tables.structure_definition import Structure
from .solver_switching import mechanism_kind


def laws_checked_in_steps(c: CompiledMechanism, breaks: Breakpoints) -> frozenset[int]:
    """Return the start indices of laws that are sampled for pulses within steps.

    These are laws that depend on the state, and laws whose breakpoints could not be found.
    """
    by_state = c.structure.cache.get("laws that follow the state", None, 1, lambda: _laws_of_state(c))
    if not breaks.given_up:
        return by_state
    return by_state | {int(at) for at in law_starts(c.system) if at in breaks.given_up}


def _laws_of_state(c: CompiledMechanism) -> frozenset[int]:
    code = c.system.code.tolist()
    return frozenset(at for at in set(law_starts(c.system).tolist()) if at >= 0 and acts_briefly(code, at))


def remark_on_checked_laws(c: CompiledMechanism, sampled: frozenset[int]) -> str:
    """Return the health remark on laws that are sampled within steps; empty if there are none."""
    if not sampled:
        return ""
    names = dict.fromkeys(c.structure.laws[at] for at in sorted(sampled))
    first = ", ".join(list(names)[:3]) + (f" and {len(names) - 3} more" if len(names) > 3 else "")
    return f"{first}: evaluated at points within each step; a crossing and its return between two points can be missed"


PAUSED_MESSAGE = "not at its end: kept at t = {:.6g} s"
"""Message of a result that is one segment of a motion."""
SEGMENT_COST = 4e9  # intended estimated cost of a segment [ns]
EVALUATIONS_PER_STEP = 12  # approximate number of evaluations per step
LEAST_STEPS = 50  # least number of steps of a segment
OLD = 10.0  # computing time [s] from which an interrupt ends a segment at its present time
LATEST = 40.0  # computing time [s] at which a segment ends in any case
IMPLICIT_STEP_WEIGHT = 10.0  # cost of an implicit step, in explicit steps
EVENT_COST = 1e6  # estimated cost of an event [ns]
BODY_COST = 2e4  # estimated cost of a body in contact in one step of impulse time stepping [ns]


class Segment:
    """A segment of a motion.

    Parameters
    ----------
    first : float [s], optional
        Start time of the whole motion; by default the motion starts with this segment.
    resumes : bool
        Whether it continues another segment, whose coordinates it then has; stored as ``later``.
    lasts : float [ns], optional
        Its estimated cost; `SEGMENT_COST` if not given, inf: to the end of the motion.

    Attributes
    ----------
    paused : bool
        Whether it ended before the motion did.
    asked : bool
        Whether the user's interrupt ended it.
    open : bool
        Whether a sampling is still due at its end time: the output at that time does not exist yet.
    """

    def __init__(self, first: float | None = None, resumes: bool = False, lasts: float | None = None) -> None:
        self.first, self.later, self.paused = first, resumes, False
        self.open = self.asked = False
        self._cost_limit = SEGMENT_COST if lasts is None else lasts
        self._left = math.inf
        self._event, self._since = 0.0, time.monotonic()

    def begin(self, s: Structure) -> None:
        """Set the number of steps of an integrated segment."""
        self._measure(EVALUATIONS_PER_STEP * mechanism_kind(s)[1])

    def begin_by_impulses(self, bodies: int) -> None:
        """Set the number of steps of a segment computed by impulse time stepping."""
        self._measure(BODY_COST * max(bodies, 1))

    def _measure(self, step: float) -> None:
        self._event = EVENT_COST / step
        self._left = max(LEAST_STEPS, math.ceil(self._cost_limit / step)) if self._cost_limit < math.inf else math.inf

    def most(self, steps: float, weight: float = 1.0) -> int:
        """Return how many of these steps, each with this weight, are left in the segment; at least one."""
        return int(max(1.0, min(steps, math.ceil(self._left / weight) if self._left < math.inf else steps)))

    def count_steps(self, steps: float) -> None:
        """Subtract the steps that were taken."""
        self._left -= steps

    def decided(self) -> None:
        """Subtract the cost of an event."""
        self._left -= self._event

    def interrupted(self) -> bool:
        """Handle an interrupt. Returns whether the segment will end in order, because it has run too long to be
        repeated.
        """
        if self.asked or not self._cost_limit < math.inf or time.monotonic() - self._since <= OLD:
            return False
        self.asked = True
        return True

    def due(self) -> bool:
        """Return whether the segment should end."""
        return (
            self.asked or self._left <= 0.0 or (self._cost_limit < math.inf and time.monotonic() - self._since > LATEST)
        )

    def over(self, clock: ex.StepState | None = None) -> bool:
        """Return whether the segment ends here; it does not after a rejected step."""
        calm = clock is None or (clock.count.accepted > 0 and clock.real.max_growth > 1.0)
        if calm and self.due():
            self.paused = True
        return self.paused


def whole_motion() -> Segment:
    """Return a segment that covers the whole motion."""
    return Segment(lasts=math.inf)


CACHED_SPANS = 4  # spans and sets of constants of which the breakpoints are cached for each mechanism
SLIVER = 2e-14  # shortest remainder of an interval that is integrated, relative to the largest time


def known_breaks(c: CompiledMechanism, t0: float, t1: float) -> Breakpoints:
    """Return the times between two times [s] at which laws or guards have breakpoints or short pulses by time alone.

    They follow from the span and the constants of the laws, so they are cached for the next motion.
    """
    laws, const = laws_of_time(c), c.system.const
    key = t0, t1, const.tobytes()
    return c.structure.cache.get("breakpoints", key, CACHED_SPANS, lambda: find_breakpoints(laws, const, t0, t1))


def laws_of_time(c: CompiledMechanism) -> Timed:
    """Return the laws that may have breakpoints or pulses by time alone, for any values of their constants."""
    return c.structure.cache.get("laws of time", None, 1, lambda: _find_laws_of_time(c))


def _find_laws_of_time(c: CompiledMechanism) -> Timed:
    """Find the time-dependent laws among those of forces, rows, drivers, guards, corners, controllers and gravity."""
    S = c.system
    guards = S.guards.of[S.guards.kind == G_LAW]
    forces = S.forces.laws.ravel()
    corners = S.switches.law[S.switches.law >= 0]
    starts = np.concatenate([forces, S.rows.law, S.tree.law, guards, corners, S.control_laws, S.gravity_laws[:3]])
    return time_dependent_laws(S.code.tolist(), starts.tolist())


class SmoothIntervals:
    """The intervals between breakpoints, one after the other.

    At a time at which a law jumps, either of its sides may be evaluated. A step therefore ends slightly before that
    time and the next one begins slightly after it, where the equations are evaluated again.

    Parameters
    ----------
    clock : StepState
        At the start of the motion.
    found : Breakpoints
    until : callable
        Takes the end time of an interval and returns the time up to which the loop should run, at most that end.
    """

    def __init__(
        self, clock: ex.StepState, found: Breakpoints, until: Callable[[float], float] = lambda end: end
    ) -> None:
        self.clock, self.end, self.until = clock, float(clock.real.t_end), until
        self.times, self.sharp = found.times, found.sharp
        self.at = 0
        self.aim()

    def passed(self) -> None:
        """Advance to the next interval where nothing is left of this one; after the last, move to the end."""
        while self.over():
            if not self.next():
                self.clock.real.t = self.goal
                break

    def over(self) -> bool:
        """Return whether the rest of this interval is too short for a step."""
        real = self.clock.real
        return bool(self.goal - real.t <= SLIVER * real.largest)

    def aim(self) -> None:
        """Set the end time of the loop to the end of the interval, or to an earlier stop.

        A remainder of rounding size (a sampling instant next to an event) is skipped.
        """
        real = self.clock.real
        real.t_end = end = self.until(self.goal)
        if end < self.goal and 0.0 < end - real.t <= SLIVER * real.largest:
            real.t = end

    @property
    def goal(self) -> float:
        """End of the interval [s]."""
        if self.at == len(self.times):
            return self.end
        end = float(self.times[self.at])
        return min(self.end, end - rounding_margin(end) if self.sharp[self.at] else end)

    def through(self) -> bool:
        """Return whether the end of the interval is reached."""
        return bool(self.clock.real.t >= self.goal)

    def whole(self) -> None:
        """Set the end time of the loop to the end of the motion."""
        self.clock.real.t_end = self.end

    def ends_with_jump(self) -> bool:
        """Return whether forces may jump at the end of this interval."""
        return bool(self.at < len(self.times) and self.sharp[self.at])

    def next(self) -> bool:
        """Advance to the next interval. Returns whether there is one."""
        if self.at == len(self.times):
            return False
        real, t = self.clock.real, float(self.times[self.at])
        if self.sharp[self.at]:
            behind = t + rounding_margin(t)
            self.clock.y.current += (behind - real.t) * self.clock.K[0]
            real.t = behind
            self.clock.count.started = ex.FORCES_JUMPED
            real.h = max(real.h, real.wide)  # the last one was cut short
        self.at += 1
        self.aim()
        return True


# A segment may end after an accepted step at whose end no event occurs.
#
# Where every step ends on an event or a corner of a law, the next step is cut in two.


NARROWEST_SHARE = 1e-6  # smallest part of a step to which it is cut
TINY_STEP = 1e-12  # shortest step, relative to the largest time


class SegmentEnd:
    """Finds the end of a segment.

    Parameters
    ----------
    part : Segment
    clock : StepState
    """

    def __init__(self, part: Segment, clock: ex.StepState) -> None:
        self.part, self.clock = part, clock
        self._settled, self._share = 0, 1.0

    def note_event(self) -> None:
        """Note an event at the present time: the segment does not end here."""
        self._settled = int(self.clock.count.accepted)
        if self.part.due():
            self._share = max(0.5 * self._share, NARROWEST_SHARE)

    def here(self) -> bool:
        """Return whether the segment ends at the present time."""
        return bool(self.clock.count.accepted > self._settled and self.part.over(self.clock))

    def until(self, end: float) -> float:
        """Return the time up to which the loop should run where it would run to ``end``."""
        real = self.clock.real
        if self._share == 1.0 or not self.part.due():
            return end
        t = float(real.t)
        way = min(end - t, float(real.h) or math.inf)
        return t + self._share * way if self._share * way > TINY_STEP * real.largest else end


# Sampled controllers: their sampling instants in a motion, and messages where there are too many or none.


SAMPLING_SHARE = (
    0.5  # if at least this part of the steps end at sampling instants, sampling is named as the reason for their number
)


PERIOD_REMEDY = "Give a longer period (it is in seconds, or a text such as '1 ms'), or more steps (max_steps=)"


class SampledController(NamedTuple):
    """A sampled controller."""

    title: str
    period: float
    offset: float

    def between(self, a: float, b: float) -> int:
        """Return the number of sampling instants after ``a`` and before ``b``."""
        first = max(0, math.floor((a - self.offset) / self.period + INSTANT_TOLERANCE) + 1)
        return max(0, math.ceil((b - self.offset) / self.period - INSTANT_TOLERANCE) - first)

    def description(self, a: float, b: float) -> str:
        """Describe how many sampling instants lie between two times."""
        return (
            f"{self.title} has a period of {self.period:g} s: from t = {a:.6g} s to the end at {b:.6g} s it is sampled "
            f"{self.between(a, b):.3g} times, and each ends a step"
        )


def sampled_by_period(c: CompiledMechanism) -> list[SampledController]:
    """Return the sampled controllers, shortest period first."""
    s, numbers = c.structure, c.values.numbers
    if not s.sampled:
        return []
    names = dict.fromkeys(name for name, *_ in s.sampled)
    found = [SampledController(s.model[k].title, float(numbers[k].period), float(numbers[k].offset)) for k in names]
    return sorted(found, key=lambda x: x.period)


def refuse_too_often(c: CompiledMechanism, span: tuple[float, float], most: int) -> None:
    """Refuse a motion with more sampling instants than ``max_steps``, unless an event could end it earlier.

    Raises
    ------
    ModelError
        Naming the controller, its period and the number of instants.
    """
    for x in [] if c.structure.model.events else sampled_by_period(c)[:1]:
        if x.between(*span) > most:
            raise ModelError(f"{x.description(*span)}; max_steps = {most}. {PERIOD_REMEDY}")


def sampling_limits_steps(c: CompiledMechanism, clock: ex.StepState, t_start: float) -> str:
    """Name the controller whose sampling causes most steps, and the instants still to come; empty if there is none."""
    t, end = float(clock.real.t), _end_of_motion(clock)
    for x in sampled_by_period(c)[:1]:
        if x.between(t_start, t) >= SAMPLING_SHARE * clock.count.accepted:
            return (
                f"max_steps = {clock.count.limit} steps were taken up to t = {t:.6g} s. {x.description(t, end)}. "
                f"{PERIOD_REMEDY}"
            )
    return ""


def never_sampled(c: CompiledMechanism, clock: ex.StepState) -> tuple[str, ...]:
    """Return remarks on controllers whose first instant lies beyond the end; none where events might change that."""
    if c.structure.model.events or not c.structure.sampled:
        return ()
    end = _end_of_motion(clock)
    return tuple(
        f"{x.title} is never sampled: its first instant is at offset = {x.offset:g} s, the motion ends at {end:.6g} s; "
        f"its signals are 0 all the time"
        for x in sampled_by_period(c)
        if x.offset >= end - INSTANT_TOLERANCE * x.period
    )


def _end_of_motion(clock: ex.StepState) -> float:
    """Return the end time of the motion [s]; the end time of the loop may be earlier."""
    return float(max(clock.real.t_end, clock.times[-1] if len(clock.times) else -math.inf))


# The sampling schedule of a motion.


LOW_ORDER_METHOD = "rk45"  # for short intervals


def sampling(
    c: CompiledMechanism, R: Tableau, lower: bool, span: tuple[float, float], rows: tuple[int, int]
) -> SampledControllers | None:
    """Return the sampled controllers of a mechanism with their schedule between two times; None if there are none.

    Parameters
    ----------
    c : CompiledMechanism
    R : Tableau
    lower : bool
        Whether a method of lower order may be used where intervals are short.
    span : (float, float)
        First and last time [s]; at the last nothing is sampled.
    rows : (int, int)
        Width of an output row, and number of rows in the buffer.
    """
    s, numbers = c.structure, c.values.numbers
    if not s.sampled:
        return None
    clocks: dict[tuple[float, float], int] = {}
    table = []
    for name, state, law, later in s.sampled:
        n = numbers[name]
        table.append((clocks.setdefault((n.period, n.offset), len(clocks)), state, law, later))
    first = [max(0, math.ceil((span[0] - offset) / period - INSTANT_TOLERANCE)) for period, offset in clocks]
    plan = SamplePlan(
        np.array(list(clocks), float),
        np.array(first, np.int64),
        np.array(table, np.int64),
        np.zeros(len(table)),
        np.array([span[1]]),
        np.array([1 if lower else -1, 1, 0, 0], np.int64),
    )
    return SampledControllers(plan, R, tableau(LOW_ORDER_METHOD), *rows)
