"""A part of a motion that is kept on the way: how many steps it has, and what all parts have in common.

Where a part ends is told by steps, not by a clock, so that the same call has the same parts and the same digits,
interrupted or not. A clock ends one only where steps take far longer than was estimated.
"""

from __future__ import annotations

import math
import time

from ...numerics.integrators import clock as ex
from ...tables.specs import Structure
from .engines import kind

KEPT = "not at its end: kept at t = {:.6g} s"
"""What a result that is a part of a motion says of its end."""
LASTS = 4e9  # that a part should last, as estimated [ns]
STAGES = 12  # evaluations that a step takes, about
LEAST = 50  # steps of a part
OLD = 10.0  # seconds after which an interrupt ends a part where it is: by then it was to have ended
LATEST = 40.0  # seconds after which a part ends in any case
WEIGHT = 10.0  # explicit steps that a step of an implicit method takes as long as
DECISION = 1e6  # what an event costs [ns]
BODY = 2e4  # what a body that touches costs in a step by impulses [ns]


class Part:
    """A part of a motion.

    Parameters
    ----------
    first : float [s], optional
        When the whole motion began; if not given with this part.
    later : bool
        Whether it goes on from another part, whose coordinates it then has.
    lasts : float [ns], optional
        How long it should take, as estimated; `LASTS` if not given, inf: to the end of the motion.

    Attributes
    ----------
    paused : bool
        Whether it has ended before the motion did.
    asked : bool
        Whether the user had it end where it is.
    open : bool
        Whether something is still to happen at the time at which it ended: the output of that time is not there.
    """

    def __init__(self, first: float | None = None, later: bool = False, lasts: float | None = None) -> None:
        self.first, self.later, self.paused = first, later, False
        self.open = self.asked = False
        self._lasts = LASTS if lasts is None else lasts
        self._left = math.inf
        self._event, self._since = 0.0, time.monotonic()

    def begin(self, s: Structure) -> None:
        """It is integrated: how many steps it has."""
        self._measure(STAGES * kind(s)[1])

    def begin_by_impulses(self, bodies: int) -> None:
        """It is stepped by impulses."""
        self._measure(BODY * max(bodies, 1))

    def _measure(self, step: float) -> None:
        self._event = DECISION / step
        self._left = max(LEAST, math.ceil(self._lasts / step)) if self._lasts < math.inf else math.inf

    def most(self, steps: float, weight: float = 1.0) -> int:
        """As many of these steps, each of which counts so much, as are left of it; one at least."""
        return int(max(1.0, min(steps, math.ceil(self._left / weight) if self._left < math.inf else steps)))

    def took(self, steps: float) -> None:
        """So many steps were taken."""
        self._left -= steps

    def decided(self) -> None:
        """What happens at an instant was decided."""
        self._left -= self._event

    def interrupted(self) -> bool:
        """The user interrupts it: whether it ends in order, soon, because it is too old to be computed once more."""
        if self.asked or not self._lasts < math.inf or time.monotonic() - self._since <= OLD:
            return False
        self.asked = True
        return True

    def due(self) -> bool:
        """Whether it is to end."""
        return self.asked or self._left <= 0.0 or (self._lasts < math.inf and time.monotonic() - self._since > LATEST)

    def over(self, clock: ex.Clock | None = None) -> bool:
        """Whether it ends here: not after a step that was refused."""
        calm = clock is None or (clock.count.accepted > 0 and clock.real.grow > 1.0)
        if calm and self.due():
            self.paused = True
        return self.paused


def whole() -> Part:
    """A motion in one part."""
    return Part(lasts=math.inf)
