"""A driven mechanism's curve followed by pseudo-arc length, and the singular points on it.

Prediction by tangent and curvature, correction by Newton's method at right angles. No step turns the tangent by more
than a few degrees. Between two nodes the cubics through the values and the exact slopes of what vanishes at singular
points (the driver's part of the tangent, the smallest singular value of J) say whether one may lie there, also where
nothing changes its sign.

Source: H. B. Keller (1977); E. L. Allgower, K. Georg, Numerical Continuation Methods (1990), chapters 2, 6 and 8.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from ...errors import NotConverged
from .closure import Closure, Place, Rank
from .locate import branch_point, interior_least

TURN = 0.12  # the most that a step may turn the tangent [rad]
LEAST = 1e-7  # the shortest step [1]
SAME = 1e-5  # points nearer than this are one [1]
SMALL = 0.1  # part of the largest singular value below which others may vanish together with the least
HALF_TURN = 3.0  # of a driver's angle [rad]
STILL = 1e-8  # a driver's part of the tangent below this is none
ON_IT = 1e-6  # singular values below this are avoided by changing the step

LEAVES = "the curve cannot be followed away from a singular position along the branch chosen"


@dataclass(frozen=True)
class Node:
    """A regular point of the curve."""

    s: float
    x: Place
    t: np.ndarray  # unit tangent
    bend: np.ndarray  # x'' by arc length
    value: float  # smallest singular value of J that does not belong to the tangent
    slope: float

    @property
    def drive(self) -> float:
        """The driver's part of the tangent."""
        return float(self.t[-1])


@dataclass
class Way:
    """One direction of the curve from a point: nodes, singular points (arc length, place), and why it ends."""

    nodes: list[Node] = field(default_factory=list)
    found: list[tuple[float, Place]] = field(default_factory=list)
    end: str = ""


class Tracer:
    """Follows the curve of a closure."""

    def __init__(self, c: Closure, step: float) -> None:
        self.c, self.step = c, step

    def node(self, s: float, x: Place, r: Rank, along: np.ndarray) -> Node:
        """A node at a point with the rank r, its tangent in the direction ``along``."""
        c = self.c
        n = c.columns - 1
        t = r.V[:, n] * (1.0 if r.V[:, n] @ along > 0.0 else -1.0)
        usable = r.values[:n] > 1e-9 * r.values[0]
        U, V = r.U[:, :n][:, usable[: r.U.shape[1]]], r.V[:, :n][:, usable]
        bend = -V @ ((U.T @ c.second(x, t)) / r.values[:n][usable])
        slope = float(r.U[:, n - 1] @ c.mixed(x, t, r.V[:, n - 1]))
        return Node(s, x, t, bend, float(r.values[n - 1]), slope)

    def ahead(self, node: Node, h: float) -> Node | None:
        """The node at a distance h (or -h, backwards) from one, if it can be reached in one step."""
        predicted = self.c.at(self.c.moved(node.x, h * node.t + 0.5 * h * h * node.bend))
        found = self.c.close(predicted)
        if found is None or found[2] > 0.3 * abs(h) + 1e-9:
            return None
        new = self.node(node.s + h, found[0], found[1], node.t)
        turned = float(
            np.arccos(np.clip(new.t @ (node.t + h * node.bend) / np.linalg.norm(node.t + h * node.bend), -1, 1))
        )
        return None if turned > 0.5 * TURN + 0.5 * abs(h) * TURN else new

    def off(self, x: Place, n: np.ndarray, bend: np.ndarray) -> Node:
        """A regular node a small step away from a point in the direction n of one of its branches."""
        for h in (0.02, 0.01, 0.005, 0.002, 0.03, 5e-4):
            found = self.c.close(self.c.at(self.c.moved(x, h * n + 0.5 * h * h * bend)))
            if found is not None and found[2] < 0.2 * h and found[1].values[self.c.columns - 2] > 1e-5 * h:
                return self.node(h, found[0], found[1], n + h * bend)
        raise NotConverged(LEAVES)

    def onto(self, x: Place, d: np.ndarray) -> Node:
        """A regular node a step d away from a point."""
        found = self.c.close(self.c.at(self.c.moved(x, d)))
        if found is None:
            raise NotConverged(LEAVES)
        return self.node(float(np.linalg.norm(d)), found[0], found[1], d)

    def follow(self, first: Node, within: Callable[[float], bool], steps: int, home: Node | None) -> Way:
        """Go on from a node until the driver's coordinate leaves what it may be, or the curve closes."""
        way = Way([first])
        h = self._longest(first)
        while True:
            last = way.nodes[-1]
            if len(way.nodes) > steps:
                way.end = f"stopped after {steps} steps"
                return way
            new = self._next(last, h)
            self._search(last, new, way)
            way.nodes.append(new)
            if not within(new.x.a):
                way.end = "end of the range"
                return way
            again = home is not None and abs(new.x.a - home.x.a) < HALF_TURN  # a whole turn on is another value
            if home is not None and again and new.s - first.s > 4.0 * self.step and self._home(new, home):
                way.end = "closed"
                return way
            h = min(2.0 * (new.s - last.s), self._longest(new))

    def _longest(self, node: Node) -> float:
        turning = float(np.linalg.norm(node.bend))
        return min(self.step / float(np.abs(node.t).max()), TURN / max(turning, 1e-12))

    def _next(self, last: Node, h: float) -> Node:
        while h > LEAST:
            new = self.ahead(last, h)
            if new is not None:
                if new.value > ON_IT:
                    return new
                h *= 0.83
            else:
                h *= 0.5
        raise NotConverged(
            f"the curve cannot be followed beyond {last.x.a:.6g} of the driver's coordinate: no step, however short, "
            f"leads to a neighbouring position"
        )

    def _home(self, node: Node, home: Node) -> bool:
        d = self.c.way(node.x, home.x)
        h = float(d @ node.t)
        if abs(h) > 2.0 * self.step or np.linalg.norm(d - h * node.t) > 0.3 * self.step or node.t @ home.t < 0.7:
            return False
        there = self.ahead(node, h) if abs(h) > 1e-9 else node
        return there is not None and h < 0.0 and float(np.linalg.norm(self.c.way(there.x, home.x))) < 0.05 * self.step

    def _search(self, m: Node, n: Node, way: Way) -> None:
        """Singular points between two nodes."""
        ds = n.s - m.s
        least = interior_least(m.value, m.slope, n.value, n.slope, ds)
        if least is not None and least[1] < 0.8 * min(m.value, n.value):
            self._lost(m, n, least[0], way)
        if max(abs(m.drive), abs(n.drive)) < STILL:
            return
        if m.drive * n.drive < 0.0:
            self._turned(m, n, way)
            return
        sign = 1.0 if m.drive + n.drive > 0.0 else -1.0
        least = interior_least(sign * m.drive, sign * m.bend[-1], sign * n.drive, sign * n.bend[-1], ds)
        if least is not None and least[1] < 0.5 * min(abs(m.drive), abs(n.drive)):
            self._touched(m, n, way)

    def _lost(self, m: Node, n: Node, u: float, way: Way) -> None:
        middle = self.ahead(m, u * (n.s - m.s)) or m
        for near in (middle, m, n):
            values = self.c.rank(near.x).values[: self.c.columns - 1]
            for dropped in range(max(1, int((values < SMALL * values[0]).sum())), 0, -1):
                x = branch_point(self.c, near.x, dropped)
                if x is not None and self._between(m, n, x):
                    self._note(m.s + float(np.linalg.norm(self.c.way(m.x, x))), x, way)
                    return

    def _between(self, m: Node, n: Node, x: Place) -> bool:
        ds = n.s - m.s
        return bool(max(np.linalg.norm(self.c.way(k.x, x)) for k in (m, n)) < 1.2 * ds + 1e-9)

    def _turned(self, m: Node, n: Node, way: Way) -> None:
        """The root of the driver's part of the tangent, by secants that keep it between."""
        from scipy.optimize import brentq

        def drive(s: float) -> float:
            at[0] = self.ahead(m, s - m.s) if s > m.s else m
            if at[0] is None:
                raise ArithmeticError
            return at[0].drive

        at: list[Node | None] = [None]
        try:
            s = brentq(drive, m.s, n.s, xtol=1e-14, rtol=1e-14)
            drive(s)
        except (ArithmeticError, ValueError, RuntimeError):
            return
        if at[0] is not None:
            self._note(s, at[0].x, way)

    def _touched(self, m: Node, n: Node, way: Way) -> None:
        """Where the driver's part of the tangent comes nearest to zero: two roots, a double one, or none."""
        low, high = m, n
        sign = 1.0 if m.drive > 0.0 else -1.0
        for _ in range(60):
            middle = self.ahead(m, 0.5 * (low.s + high.s) - m.s)
            if middle is None:
                return
            if sign * middle.drive < 0.0:
                self._turned(m, middle, way)
                self._turned(middle, n, way)
                return
            low, high = (middle, high) if sign * middle.bend[-1] < 0.0 else (low, middle)
            if high.s - low.s < 1e-14:
                break
        if abs(low.drive) < STILL:
            self._note(low.s, low.x, way)

    def _note(self, s: float, x: Place, way: Way) -> None:
        if all(np.linalg.norm(self.c.way(x, y)) > SAME or abs(x.a - y.a) > HALF_TURN for _, y in way.found):
            way.found.append((s, x))
