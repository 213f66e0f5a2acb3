"""Where a part of a motion may end: behind a step that was accepted and at whose end nothing happens.

Where every step ends on something, such as an event or a corner of a law, the next one is cut in two, and ends before.
"""

from __future__ import annotations

import math

from ....numerics.integrators import clock as ex
from ..part import Part

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
