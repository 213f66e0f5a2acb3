"""Sines and cosines of arctangents as algebraic expressions, and symbols replaced by their definitions.

    w = atan2(y, x):   cos w = x / r,   sin w = y / r,   r^2 = x^2 + y^2

Sums of angles follow from the addition theorems; whole turns are dropped. For reading only: a parameter keeps the sign
of its own value, so that sqrt(l^2) = l for a length.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Sequence
from typing import Any

from ...math.scalar import cos, sin, sqrt
from ..evaluation import nodes_in_order
from ..graph import ADD, MULTIPLY, NUMBER, SYMBOL, Node
from .simplify import simplified

FULL_TURN = 2.0 * math.pi
MAX_OPERATIONS = 300  # up to so many operations the cosine and sine of an angle are simplified
MAX_FACTOR = 3  # largest factor of an angle in a sum

ArctangentWave = tuple[Any, Any, list[Node]]
"""Cosine and sine of an angle, each times factors, and the squares of these factors."""


class ArctangentSubstitution:
    """Replaces sines and cosines of arctangents and substitutes formulas; each node is processed once.

    Parameters
    ----------
    definitions : sequence of (Node, Node, Node or None)
        Symbol, its formula in earlier symbols, and, if it is atan2(y, x), sqrt(x^2 + y^2) if known.
    """

    def __init__(self, definitions: Iterable[tuple[Node, Any, Any]] = ()) -> None:
        self._known: dict[int, Node] = {}
        self._angles: dict[int, dict[Node, float]] = {}
        self._waves: dict[int, ArctangentWave] = {}
        for w, value, radius in definitions:
            y = w.graph.node(value)
            parts = self._parts(y)
            if all(a.op in (SYMBOL, NUMBER, "atan2") for a in parts):
                self._angles[w.index] = parts
            if radius is not None and y.op == "atan2":
                a, b, r = self([y.args[1], y.args[0], w.graph.node(radius)])
                c, s = fast_simplification([w.graph.node(a / r), w.graph.node(b / r)])
                self._waves[y.index] = (c, s, [])
            self._known[w.index] = self([without_whole_turns(y)])[0]

    def __call__(self, nodes: Sequence[Any]) -> list[Any]:
        """Substitute all symbols that have a formula."""
        for x in nodes_in_order(nodes):
            if x.index not in self._known:
                self._known[x.index] = self._constructed(x)
        return [self._known[x.index] if isinstance(x, Node) else x for x in nodes]

    def _constructed(self, x: Node) -> Node:
        if x.op in ("sin", "cos"):
            found = self._wave(x.args[0])
            if found is not None:
                return found[0] if x.op == "cos" else found[1]
        args = tuple(self._known[a.index] for a in x.args)
        same = all(a is b for a, b in zip(args, x.args, strict=True))
        return x if same else x.graph.rebuilt(x, args)

    def _parts(self, x: Node) -> dict[Node, float]:
        """An angle as a sum of symbols and arctangents with factors, without whole turns."""
        found: dict[Node, float] = {}
        to_see = [(x, 1.0)]
        while to_see:
            y, c = to_see.pop()
            if y.op == ADD:
                to_see += [(a, c) for a in y.args]
            elif y.op == MULTIPLY and y.args[0].op == NUMBER:
                to_see.append((y.args[1], c * y.args[0].value))
            elif y.index in self._angles:
                to_see += [(a, c * n) for a, n in self._angles[y.index].items()]
            elif y.op == NUMBER:
                one = y.graph.number(1.0)
                found[one] = found.get(one, 0.0) + c * y.value
            elif not (y.op == "rounded" and abs(abs(c) / FULL_TURN - round(abs(c) / FULL_TURN)) < 1e-12):
                found[y] = found.get(y, 0.0) + c
        return {y: c for y, c in found.items() if c}

    def _wave(self, angle: Node) -> tuple[Node, Node] | None:
        """Cosine and sine of an angle that contains arctangents; None if it contains none."""
        parts = self._parts(angle)
        arcs = [(y, c) for y, c in parts.items() if y.op == "atan2"]
        if not arcs or any(c != round(c) or abs(c) > MAX_FACTOR for _, c in arcs):
            return None
        g = angle.graph
        rest: Any = 0.0
        for y, c in parts.items():
            if y.op != "atan2":
                rest = rest + c * self([y])[0]
        c, s = (cos(rest), sin(rest)) if isinstance(rest, Node) else (math.cos(rest), math.sin(rest))
        squares: list[Node] = []
        for y, n in arcs:
            a, b, r = self._of(y)
            for _ in range(abs(int(n))):
                c, s = (c * a - s * b, s * a + c * b) if n > 0 else (c * a + s * b, s * a - c * b)
                squares += r
        under: Any = 1.0
        for square, k in Counter(squares).items():
            under = under * square ** (k // 2) * (sqrt(square) if k % 2 else 1.0)
        made = fast_simplification([g.node(c / under), g.node(s / under)])
        return made[0], made[1]

    def _of(self, y: Node) -> ArctangentWave:
        """Cosine and sine of an arctangent."""
        if y.index not in self._waves:
            b, a = fast_simplification(self(y.args))
            self._waves[y.index] = (a, b, fast_simplification([a * a + b * b]))
        return self._waves[y.index]


def without_whole_turns(y: Node) -> Node:
    """An angle without its term that counts whole turns."""
    if y.op == ADD:
        a, b = y.args
        for one, other in ((a, b), (b, a)):
            if one.op == MULTIPLY and one.args[0] == FULL_TURN and one.args[1].op == "rounded":
                return other
    return y


def fast_simplification(nodes: Sequence[Node]) -> list[Node]:
    """Simplify if that is quick; absolute values of parameters are resolved by the sign of their values."""
    if len(nodes_in_order(nodes)) > MAX_OPERATIONS:
        return list(nodes)
    return without_absolute_values(simplified(list(nodes)))


def without_absolute_values(nodes: Sequence[Any]) -> list[Any]:
    """Resolve absolute values of expressions of parameters by the sign of their values."""
    known: dict[int, Node] = {}
    for x in nodes_in_order(nodes):
        args = tuple(known[a.index] for a in x.args)
        if x.op == "absolute" and not x.moving and x.args[0].op != NUMBER and x.value != 0.0:
            known[x.index] = args[0] if x.args[0].value > 0.0 else -args[0]
        else:
            same = all(a is b for a, b in zip(args, x.args, strict=True))
            known[x.index] = x if same else x.graph.rebuilt(x, args)
    return [known[x.index] if isinstance(x, Node) else x for x in nodes]
