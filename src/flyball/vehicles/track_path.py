"""Closed chains of equal chords around circles: where the pins of a track lie."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import acos, atan2, cos, hypot, pi, sin

import numpy as np
from scipy.optimize import brentq

FULL_TURN = 2.0 * pi


@dataclass(frozen=True)
class Arc:
    """The part of a circle on which a taut band lies, by the angles of its outward normals, and the straight after."""

    circle: int
    centre: tuple[float, float]
    radius: float
    first: float
    last: float
    straight: float

    @property
    def length(self) -> float:
        """Length of the arc and of the straight part after it [m]."""
        return self.radius * (self.last - self.first) + self.straight

    def point(self, s: float) -> tuple[float, float]:
        """Return the point at the length s behind the arc's start."""
        angle = min(self.first + s / self.radius, self.last)
        beyond = max(s - self.radius * (self.last - self.first), 0.0)
        x, y = self.centre
        c, s_ = cos(angle), sin(angle)
        return x + self.radius * c - beyond * s_, y + self.radius * s_ + beyond * c


def taut_band(centres: Sequence[tuple[float, float]], radii: Sequence[float]) -> list[Arc]:
    """Return the arcs of the shortest band around circles, counterclockwise from the lowest point.

    The straight parts are outer common tangents, n (c_j - c_i) = R_i - R_j with the outward normal n; of all tangents
    the band takes that with the least turn. Circles inside the band have no arc.
    """
    start = min(range(len(radii)), key=lambda k: centres[k][1] - radii[k])
    arcs: list[Arc] = []
    here, angle, end = start, -pi / 2, 1.5 * pi
    while angle < end:
        turn, there, straight = end - angle, start, 0.0
        for k, (c, r) in enumerate(zip(centres, radii, strict=True)):
            dx, dy = c[0] - centres[here][0], c[1] - centres[here][1]
            d, less = hypot(dx, dy), radii[here] - r
            if k == here or d <= abs(less):
                continue
            normal = (atan2(dy, dx) - acos(less / d) - angle + 1e-12) % FULL_TURN - 1e-12
            if normal < turn:
                turn, there, straight = normal, k, (d * d - less * less) ** 0.5
        arcs.append(Arc(here, centres[here], radii[here], angle, angle + turn, straight))
        here, angle = there, angle + turn
    return arcs


def chords(arcs: Sequence[Arc], start: float, pitch: float, number: int) -> tuple[np.ndarray, float]:
    """Return the ends (number, 2) of equal chords along a band from a length on, and what the last one is too far.

    The number is positive if the chain is longer than the band, so that it closes at zero.
    """
    ends = np.cumsum([a.length for a in arcs])
    around = float(ends[-1])

    def point(s: float) -> tuple[float, float]:
        s %= around
        k = min(int(np.searchsorted(ends, s, side="right")), len(arcs) - 1)
        return arcs[k].point(s - float(ends[k]) + arcs[k].length)

    def surplus(s: float, p: tuple[float, float]) -> float:
        q = point(s)
        return hypot(q[0] - p[0], q[1] - p[1]) - pitch

    s, points = start, []
    for _ in range(number):
        p = point(s)
        points.append(p)
        s = brentq(surplus, s + 0.999 * pitch, s + 1.6 * pitch, args=(p,), xtol=1e-14 * around)
    return np.array(points), s - start - around
