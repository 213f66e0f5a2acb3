"""Events that accumulate: told from those that only come often by when one has happened 1, 2, 4, 8, ... times.

Where the n-th is at t = T - c n^-a, the times between these shrink by the same ratio 2^-a, and there is no end of them
before T. What comes as often as before doubles them, what speeds up for ever (a sweep of its frequency) has a ratio
near 1 and more, and a series that ends, as of bounces, soon has ratios that fall themselves.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from itertools import pairwise

import numpy as np

from ....tables.system import VALUE
from .here import Here

MANY = 8192  # times that one has happened, at least
RATIOS = 4  # of these that are the same
STEADY = 1.25  # largest of them by the least
LESS = 0.95  # a ratio of a series with an end
EMPTY = 500  # events in a row of which nothing comes
NOWHERE = 1e-3  # of the time span, within which they are without end


class Counts:
    """When each guard had fired 1, 2, 4, 8, ... times."""

    def __init__(self) -> None:
        self.times: dict[int, tuple[int, list[float]]] = {}
        self.empty = 0
        self._since = 0.0
        self._before: tuple[np.ndarray, int] | None = None

    def add(self, fired: Iterable[int], t: float) -> None:
        """Count guards that fire at t [s]."""
        for g in fired:
            n, past = self.times.get(g, (0, []))
            n += 1
            if n & (n - 1) == 0:
                past.append(t)
            self.times[g] = n, past

    def nothing(self, here: Here) -> tuple[int, float] | None:
        """How many events nothing came of, one after the other, and within which time [s], where these have no end.

        No mode, no way, nothing to tell.
        """
        W = here.c.work
        first = W.sensed.shape[1] - W.modes.mode.shape[0]
        now = np.vstack((*W.modes, W.sensed[VALUE, first:])), len(here.records)
        old, self._before = self._before, now
        same = old is not None and old[1] == now[1] and np.array_equal(old[0], now[0])
        if not same or self.empty == 0:
            self.empty, self._since = 0, here.t
        self.empty += 1
        within = here.t - self._since
        endless = self.empty >= EMPTY and within < NOWHERE * here.clock.real.span
        return (self.empty, within) if endless else None

    def accumulate(self, fired: Iterable[int], until: float) -> tuple[int, int, float] | None:
        """One of these that never gets to ``until`` [s]: its guard, how often it has fired, where it accumulates."""
        for g in fired:
            n, past = self.times[g]
            if n >= MANY and n & (n - 1) == 0:
                end = limit(past)
                if end < until:
                    return g, n, end
        return None


def limit(past: list[float]) -> float:
    """The limit of times whose distances shrink by a steady ratio, infinite where they do not."""
    between = [b - a for a, b in pairwise(past[-RATIOS - 2 :])]
    if len(between) <= RATIOS or min(between) <= 0.0:
        return math.inf
    ratios = [b / a for a, b in pairwise(between)]
    if max(ratios) > LESS or max(ratios) > STEADY * min(ratios):
        return math.inf
    return past[-1] + between[-1] * ratios[-1] / (1.0 - ratios[-1])
