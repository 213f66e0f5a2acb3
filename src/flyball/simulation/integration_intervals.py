"""Intervals of integration: times at which steps must end, and segments of a checkpointed motion.

Laws of time have breakpoints and short pulses; steps end there. A checkpointed motion is computed in segments,
whose length is counted in steps and not in seconds, so that the same call gives the same digits, interrupted or
not.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable

import numpy as np

from ..assembly.compiled_mechanism import CompiledMechanism
from ..constraints.switch_kinds import BRANCH
from ..engine.pulse_detection import law_starts
from ..laws.breakpoints import Breakpoints, Timed, acts_briefly, find_breakpoints, rounding_margin, time_dependent_laws
from ..numerics.integrators import time_loop as ex
from ..tables.structure_definition import Structure
from ..tables.table_definitions import G_LAW
from .solver_switching import mechanism_kind


def laws_checked_in_steps(c: CompiledMechanism, breaks: Breakpoints) -> frozenset[int]:
    """Starts of the laws that samples have to guard within steps: what they do follows the state, or is not known."""
    by_state = c.structure.kept.get("laws that follow the state", None, 1, lambda: _laws_of_state(c))
    if not breaks.given_up:
        return by_state
    return by_state | {int(at) for at in law_starts(c.system) if at in breaks.given_up}


def _laws_of_state(c: CompiledMechanism) -> frozenset[int]:
    code = c.system.code.tolist()
    return frozenset(at for at in set(law_starts(c.system).tolist()) if at >= 0 and acts_briefly(code, at))


def remark_on_checked_laws(c: CompiledMechanism, sampled: frozenset[int]) -> str:
    """What health says of laws that are sampled; nothing where there are none."""
    if not sampled:
        return ""
    names = dict.fromkeys(c.structure.laws[at] for at in sorted(sampled))
    first = ", ".join(list(names)[:3]) + (f" and {len(names) - 3} more" if len(names) > 3 else "")
    return f"{first}: sampled within steps; what a state passes between two samples is not seen"


PAUSED_MESSAGE = "not at its end: kept at t = {:.6g} s"
"""What a result that is a part of a motion says of its end."""
SEGMENT_COST = 4e9  # that a part should last, as estimated [ns]
EVALUATIONS_PER_STEP = 12  # evaluations that a step takes, about
LEAST_STEPS = 50  # steps of a part
OLD = 10.0  # seconds after which an interrupt ends a part where it is: by then it was to have ended
LATEST = 40.0  # seconds after which a part ends in any case
IMPLICIT_STEP_WEIGHT = 10.0  # explicit steps that a step of an implicit method takes as long as
EVENT_COST = 1e6  # what an event costs [ns]
BODY_COST = 2e4  # what a body that touches costs in a step by impulses [ns]


class Segment:
    """A part of a motion.

    Parameters
    ----------
    first : float [s], optional
        When the whole motion began; if not given with this part.
    later : bool
        Whether it goes on from another part, whose coordinates it then has.
    lasts : float [ns], optional
        How long it should take, as estimated; `SEGMENT_COST` if not given, inf: to the end of the motion.

    Attributes
    ----------
    paused : bool
        Whether it has ended before the motion did.
    asked : bool
        Whether the user had it end where it is.
    open : bool
        Whether something is still to happen at the time at which it ended: the output of that time is not there.
    """

    def __init__(self, first: float | None = None, resumes: bool = False, lasts: float | None = None) -> None:
        self.first, self.later, self.paused = first, resumes, False
        self.open = self.asked = False
        self._cost_limit = SEGMENT_COST if lasts is None else lasts
        self._left = math.inf
        self._event, self._since = 0.0, time.monotonic()

    def begin(self, s: Structure) -> None:
        """It is integrated: how many steps it has."""
        self._measure(EVALUATIONS_PER_STEP * mechanism_kind(s)[1])

    def begin_by_impulses(self, bodies: int) -> None:
        """It is stepped by impulses."""
        self._measure(BODY_COST * max(bodies, 1))

    def _measure(self, step: float) -> None:
        self._event = EVENT_COST / step
        self._left = max(LEAST_STEPS, math.ceil(self._cost_limit / step)) if self._cost_limit < math.inf else math.inf

    def most(self, steps: float, weight: float = 1.0) -> int:
        """As many of these steps, each of which counts so much, as are left of it; one at least."""
        return int(max(1.0, min(steps, math.ceil(self._left / weight) if self._left < math.inf else steps)))

    def count_steps(self, steps: float) -> None:
        """So many steps were taken."""
        self._left -= steps

    def decided(self) -> None:
        """What happens at an instant was decided."""
        self._left -= self._event

    def interrupted(self) -> bool:
        """The user interrupts it: whether it ends in order, soon, because it is too old to be computed once more."""
        if self.asked or not self._cost_limit < math.inf or time.monotonic() - self._since <= OLD:
            return False
        self.asked = True
        return True

    def due(self) -> bool:
        """Whether it is to end."""
        return (
            self.asked or self._left <= 0.0 or (self._cost_limit < math.inf and time.monotonic() - self._since > LATEST)
        )

    def over(self, clock: ex.StepState | None = None) -> bool:
        """Whether it ends here: not after a step that was refused."""
        calm = clock is None or (clock.count.accepted > 0 and clock.real.max_growth > 1.0)
        if calm and self.due():
            self.paused = True
        return self.paused


def whole_motion() -> Segment:
    """A motion in one part."""
    return Segment(lasts=math.inf)


LAWS_PER_FORCE = 3  # of a force
SLIVER = 2e-14  # part of the largest time: what is left of a stretch is no step


def known_breaks(c: CompiledMechanism, t0: float, t1: float) -> Breakpoints:
    """Where laws of a mechanism, and guards, have corners or act briefly by time alone, between two times [s]."""
    return find_breakpoints(laws_of_time(c), c.system.const, t0, t1)


def laws_of_time(c: CompiledMechanism) -> Timed:
    """Laws that may have corners or act briefly by time alone, whatever their constants are."""
    return c.structure.kept.get("laws of time", None, 1, lambda: _find_laws_of_time(c))


def _find_laws_of_time(c: CompiledMechanism) -> Timed:
    """All laws that forces, rows, guards have by time."""
    S = c.system
    guards = S.guards.of[S.guards.kind == G_LAW]
    forces = S.forces.laws.ravel()
    corners = S.switches.law[S.switches.kind == BRANCH]
    starts = np.concatenate([forces, S.rows.law, S.tree.law, guards, corners, S.control_laws])
    return time_dependent_laws(S.code.tolist(), starts.tolist())


class SmoothIntervals:
    """The stretches of time between breaks, one after the other.

    A law that is sharp at a time may belong to either side there: a step ends a little before, the next begins as
    little behind, with what the equations are there.

    Parameters
    ----------
    clock : Clock
        As the motion begins.
    found : Breaks
    until : callable
        Of a time: one up to which the clock is to run at most, for reasons of its own, no later than that.
    """

    def __init__(
        self, clock: ex.StepState, found: Breakpoints, until: Callable[[float], float] = lambda end: end
    ) -> None:
        self.clock, self.end, self.until = clock, float(clock.real.t_end), until
        self.times, self.sharp = found.times, found.sharp
        self.at = 0
        self.aim()

    def passed(self) -> None:
        """Go on with the next one where nothing is left of this one; where that was the last, this is the end."""
        while self.over():
            if not self.next():
                self.clock.real.t = self.goal
                break

    def over(self) -> bool:
        """Whether nothing is left of this one that could be a step."""
        real = self.clock.real
        return bool(self.goal - real.t <= SLIVER * real.largest)

    def aim(self) -> None:
        """Have the clock run to the end of the stretch, or to what it stops for before. What rounding leaves to that
        (an instant of sampling beside an event's) is no step, and is passed.
        """
        real = self.clock.real
        real.t_end = end = self.until(self.goal)
        if end < self.goal and 0.0 < end - real.t <= SLIVER * real.largest:
            real.t = end

    @property
    def goal(self) -> float:
        """Where the stretch ends."""
        if self.at == len(self.times):
            return self.end
        end = float(self.times[self.at])
        return min(self.end, end - rounding_margin(end) if self.sharp[self.at] else end)

    def through(self) -> bool:
        """Whether the clock is at its end."""
        return bool(self.clock.real.t >= self.goal)

    def whole(self) -> None:
        """Have it run to the end of the motion."""
        self.clock.real.t_end = self.end

    def ends_with_jump(self) -> bool:
        """Whether forces may jump at the end of this stretch."""
        return bool(self.at < len(self.times) and self.sharp[self.at])

    def next(self) -> bool:
        """Go on with the next one, if there is one."""
        if self.at == len(self.times):
            return False
        real, t = self.clock.real, float(self.times[self.at])
        if self.sharp[self.at]:
            behind = t + rounding_margin(t)
            self.clock.y[ex.CURRENT] += (behind - real.t) * self.clock.K[0]
            real.t = behind
            self.clock.count.started = ex.FORCES_JUMPED
            real.h = max(real.h, real.wide)  # the last one was cut short
        self.at += 1
        self.aim()
        return True


# Where a part of a motion may end: behind a step that was accepted and at whose end nothing happens.
#
# Where every step ends on something, such as an event or a corner of a law, the next one is cut in two.


NARROWEST_SHARE = 1e-6  # part of what a step could be that is cut off at least
TINY_STEP = 1e-12  # of the largest time: less is no step


class SegmentEnd:
    """Where the part ends.

    Parameters
    ----------
    part : Part
    clock : Clock
    """

    def __init__(self, part: Segment, clock: ex.StepState) -> None:
        self.part, self.clock = part, clock
        self._settled, self._share = 0, 1.0

    def note_event(self) -> None:
        """Something does here and now: the part does not end."""
        self._settled = int(self.clock.count.accepted)
        if self.part.due():
            self._share = max(0.5 * self._share, NARROWEST_SHARE)

    def here(self) -> bool:
        """Whether the part ends here and now."""
        return bool(self.clock.count.accepted > self._settled and self.part.over(self.clock))

    def until(self, end: float) -> float:
        """The time up to which the loop is to run where it would run to ``end``."""
        real = self.clock.real
        if self._share == 1.0 or not self.part.due():
            return end
        t = float(real.t)
        way = min(end - t, float(real.h) or math.inf)
        return t + self._share * way if self._share * way > TINY_STEP * real.largest else end
