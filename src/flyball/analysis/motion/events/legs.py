"""Times known beforehand at which steps end: corners of laws of time, begins and ends of what they do briefly."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from ....constraints.modes import BRANCH
from ....laws.breaks import Breaks, Timed, found_beforehand, margin, timed
from ....numerics.integrators import clock as ex
from ....tables.system import (
    G_LAW,
)
from ...compiled import Compiled
from ..part import Part

LAWS = 3  # of a force
SLIVER = 2e-14  # part of the largest time: what is left of a stretch is no step


def breaks(c: Compiled, t0: float, t1: float) -> Breaks:
    """Where laws of a mechanism, and guards, have corners or act briefly by time alone, between two times [s]."""
    return found_beforehand(laws_of_time(c), c.system.const, t0, t1)


def laws_of_time(c: Compiled) -> Timed:
    """Laws that may have corners or act briefly by time alone, whatever their constants are."""
    return c.structure.kept.get("laws of time", None, 1, lambda: _timed(c))


def _timed(c: Compiled) -> Timed:
    """All laws that forces, rows, guards have by time."""
    S = c.system
    guards = S.guards.of[S.guards.kind == G_LAW]
    forces = S.forces.laws.ravel()
    corners = S.switches.law[S.switches.kind == BRANCH]
    starts = np.concatenate([forces, S.rows.law, S.tree.law, guards, corners, S.control_laws])
    return timed(S.code.tolist(), starts.tolist())


class Legs:
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

    def __init__(self, clock: ex.Clock, found: Breaks, until: Callable[[float], float] = lambda end: end) -> None:
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
        return min(self.end, end - margin(end) if self.sharp[self.at] else end)

    def through(self) -> bool:
        """Whether the clock is at its end."""
        return bool(self.clock.real.t >= self.goal)

    def whole(self) -> None:
        """Have it run to the end of the motion."""
        self.clock.real.t_end = self.end

    def ends_sharply(self) -> bool:
        """Whether forces may jump at the end of this stretch."""
        return bool(self.at < len(self.times) and self.sharp[self.at])

    def next(self) -> bool:
        """Go on with the next one, if there is one."""
        if self.at == len(self.times):
            return False
        real, t = self.clock.real, float(self.times[self.at])
        if self.sharp[self.at]:
            behind = t + margin(t)
            self.clock.y[ex.NOW] += (behind - real.t) * self.clock.K[0]
            real.t = behind
            self.clock.count.started = ex.JUMPED
            real.h = max(real.h, real.wide)  # the last one was cut short
        self.at += 1
        self.aim()
        return True


# Where a part of a motion may end: behind a step that was accepted and at whose end nothing happens.
#
# Where every step ends on something, such as an event or a corner of a law, the next one is cut in two.


NARROWEST = 1e-6  # part of what a step could be that is cut off at least
TINY = 1e-12  # of the largest time: less is no step


class Pauses:
    """Where the part ends.

    Parameters
    ----------
    part : Part
    clock : Clock
    """

    def __init__(self, part: Part, clock: ex.Clock) -> None:
        self.part, self.clock = part, clock
        self._settled, self._share = 0, 1.0

    def happened(self) -> None:
        """Something does here and now: the part does not end."""
        self._settled = int(self.clock.count.accepted)
        if self.part.due():
            self._share = max(0.5 * self._share, NARROWEST)

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
        return t + self._share * way if self._share * way > TINY * real.largest else end
