"""An expression multiplied out: from nodes to sums of terms, as far as these stay few."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from ..node import Node
from ..operations import ADD, DIVIDE, MULTIPLY, NUMBER, SYMBOL
from .angles import opened
from .factors import factors
from .terms import (
    COS,
    ONE,
    PLAIN,
    SIN,
    Angle,
    Powers,
    Terms,
    divided,
    inverse,
    plus,
    powers_product,
    put,
    scaled,
    times,
    wave,
)
from .units import reduced

if TYPE_CHECKING:
    from .simplify import Simplifier


FEW_TERMS = 12  # that sums may have where expressions are large
BUDGET = 100_000  # products of terms, or their like, after which they are


class Expander:
    """Nodes of one graph as sums of terms; each node once.

    Parameters
    ----------
    parent : Simplifier
        Makes what is no sum of terms short: arguments of functions, denominators, sums that are too long.
    most : int
        Terms that a sum may have.
    """

    def __init__(self, parent: Simplifier, most: int) -> None:
        self.parent, self.graph, self.most = parent, parent.graph, most
        self.known: dict[int, Terms] = {}
        self.spent = 0

    def __call__(self, x: Node) -> Terms:
        """Terms of a node whose arguments are known, or become so."""
        found = self.known.get(x.index)
        if found is None:
            found = self.known[x.index] = self._terms(x)
        return found

    def _terms(self, x: Node) -> Terms:
        if x.index in self.parent.barriers or x.op == SYMBOL:
            return self.atom(x)
        if x.op == NUMBER:
            return {PLAIN: x.value} if x.value != 0.0 else {}
        if x.op == ADD:
            return self._sum(x)
        if x.op == MULTIPLY:
            return self._product(self(x.args[0]), self(x.args[1]))
        if x.op == DIVIDE:
            return self._quotient(x)
        if x.op in ("cos", "sin"):
            return self._wave(x)
        if x.op in ("sqrt", "absolute"):
            return self._root(x)
        return self.atom(self.parent.inside(x))

    def spend(self, work: int) -> None:
        """Count work; from a certain amount on sums are kept shorter."""
        self.spent += work
        if self.spent > BUDGET:
            self.most = min(self.most, FEW_TERMS)

    def atom(self, x: Node) -> Terms:
        """A node as it stands."""
        return {(((x.index, 1),), ()): 1.0}

    def factor(self, terms: Terms) -> Terms:
        """A sum as one term: its factors are atoms."""
        if len(terms) <= 1:
            return terms
        c, powers = factors(self.parent.short(terms), self.parent.barriers)
        return {(tuple(sorted(powers.items())), ()): c}

    def _sum(self, x: Node) -> Terms:
        a, b = self(x.args[0]), self(x.args[1])
        if len(a) + len(b) > 4 * self.most:
            a, b = sorted((a, b), key=len)
            b = self.factor(b)
            a = self.factor(a) if len(a) > self.most else a
        return plus(a, b)

    def _product(self, a: Terms, b: Terms) -> Terms:
        self.spend(len(a) * len(b))
        if len(a) * len(b) > 4 * self.most:
            a, b = sorted((a, b), key=len)
            b = self.factor(b)
            a = self.factor(a) if len(a) > self.most else a
        found = self.roots_squared(times(a, b))
        return reduced(found, self.parent.units) if self.parent.units else found

    def roots_squared(self, terms: Terms) -> Terms:
        """Squares of roots and of absolute values are what stands in them."""
        out: Terms = {}
        for (powers, waves), c in terms.items():
            rest: Terms = {(powers, waves): c}
            for k, n in powers:
                if (
                    abs(n) > 1
                    and (root := self.graph.nodes[k]).op in ("sqrt", "absolute")
                    and k not in self.parent.barriers
                ):
                    inner = self(root.args[0])
                    inner = inner if len(inner) <= 8 and n > 0 else self.factor(inner)
                    even = n - n % 2 if n > 0 else n + n % 2
                    gone: Terms = {(((k, -even),), ()): 1.0}
                    if n < 0:
                        if len(inner) != 1 or next(iter(inner))[1]:
                            continue
                        ((p, _), d) = next(iter(inner.items()))
                        inner = {(inverse(p), ()): 1.0 / d}
                    rest = times(rest, gone)
                    for _ in range(abs(even) // 2 if root.op == "sqrt" else abs(even)):
                        rest = times(rest, inner)
            out = plus(out, rest)
        return out

    def _quotient(self, x: Node) -> Terms:
        a, b = self(x.args[0]), self(x.args[1])
        if not b:  # as it is: 1 / 0
            return self.atom(self.parent.inside(x))
        same = divided(a, b)
        if same is not None:
            return self.roots_squared({(same[0], ()): same[1]})
        if len(b) > 1:
            b = self.factor(b)
        ((powers, waves), c) = next(iter(b.items()))
        under: Powers = inverse(powers)
        out: Terms = {}
        for (p, w), d in a.items():
            if w and w == waves:
                out = plus(out, {(powers_product(p, under), ()): d / c})
            else:
                more = tuple((opened(self.graph, u).index, -1) for u in waves)
                out = plus(out, {(powers_product(powers_product(p, under), tuple(sorted(more))), w): d / c})
        return self.roots_squared(out)

    def angle(self, x: Node) -> Angle | None:
        """An expression as a sum of atoms with factors; None if it has too many."""
        terms = self(x)
        if len(terms) > 8:
            return None
        found: dict[int, float] = {}
        for (powers, waves), c in terms.items():
            if powers == () and waves == ():
                found[ONE] = found.get(ONE, 0.0) + c
                continue
            single = len(powers) == 1 and powers[0][1] == 1 and not waves
            one = self.graph.nodes[powers[0][0]] if single else self.parent.short({(powers, waves): 1.0})
            inner = self._wrapped(one) if c % 1.0 == 0.0 else None
            for k, d in inner or ((one.index, 1.0),):
                found[k] = found.get(k, 0.0) + c * d
        return tuple(sorted((k, c) for k, c in found.items() if c))

    def _wrapped(self, x: Node) -> Angle | None:
        """U in atan2(sin u, cos u), which differs from it by whole turns."""
        if x.op != "atan2" or x.index in self.parent.barriers:
            return None
        y, z = (self(a) for a in x.args)
        if len(y) != 1 or len(z) != 1:
            return None
        ((p, u), c), ((r, w), d) = next(iter(y.items())), next(iter(z.items()))
        if p or r or d != 1.0 or not u or not w or u[0][0] != SIN or w != ((COS, u[0][1]),) or abs(c) != 1.0:
            return None
        return tuple((k, c * e) for k, e in u[0][1])

    def _wave(self, x: Node) -> Terms:
        angle = self.angle(x.args[0])
        if angle is None or not all(math.isfinite(c) for _, c in angle):
            return self.atom(self.parent.inside(x))
        kind = COS if x.op == "cos" else SIN
        found = dict(angle)
        quarter, c = quarters(found.get(ONE, 0.0)), 1.0
        if quarter:  # a whole number of right angles in front
            del found[ONE]
            steps = (quarter + (0 if kind == SIN else 1)) % 4  # sin(x + n pi/2)
            kind, c = (SIN, COS, SIN, COS)[steps], (1.0, 1.0, -1.0, -1.0)[steps]
        return turned_by(kind, found, found.pop(ONE, 0.0), c)

    def _root(self, x: Node) -> Terms:
        terms = self(x.args[0])
        if len(terms) == 1:
            ((powers, waves), c) = next(iter(terms.items()))
            if not waves and c > 0.0 and (x.op == "absolute" or not any(n % 2 for _, n in powers)):
                out: Terms = {((), ()): c if x.op == "absolute" else math.sqrt(c)}
                for k, n in powers:
                    size = self.graph.function("absolute", self.graph.nodes[k])
                    n = n if x.op == "absolute" else n // 2
                    out = times(out, {(((k if n % 2 == 0 else size.index, n),), ()): 1.0})
                return out
        if not terms:
            return {}
        number, inner = factors(self.parent.shorter(x.args[0], self.parent.short(terms)), self.parent.barriers)
        if number < 0.0 and x.op == "sqrt":
            return self.atom(self.parent.inside(x))
        if x.op == "absolute":
            return scaled(self.atom(self.graph.function(x.op, self.parent.gathered.product(1.0, inner))), abs(number))
        rest = {k: n % 2 if n > 0 else -(n % 2) for k, n in inner.items()}
        found: Terms = {PLAIN: math.sqrt(number)}
        for k, n in inner.items():
            half = (n - rest[k]) // 2
            size = self.graph.nodes[k] if half % 2 == 0 else self.graph.function("absolute", self.graph.nodes[k])
            found = times(found, {(((size.index, half),) if half else (), ()): 1.0})
        under = {k: n for k, n in rest.items() if n}
        if not under:
            return found
        return times(found, self.atom(self.graph.function("sqrt", self.parent.gathered.product(1.0, under))))


def turned_by(kind: int, angle: dict[int, float], phase: float, c: float) -> Terms:
    """C times cosine or sine of an angle and a number: cos(u + p) = cos p cos u - sin p sin u."""
    out: Terms = {}
    parts = [(kind, math.cos(phase))]
    if phase:
        parts.append((1 - kind, math.sin(phase) if kind == SIN else -math.sin(phase)))
    for k, factor in parts:
        waves, sign = wave(k, angle)
        if sign * factor:
            put(out, ((), waves), c * factor * sign)
    return out


def quarters(constant: float) -> int:
    """Right angles in a number, if it is a whole number of them."""
    n = round(constant / (math.pi / 2.0))
    return n if n and abs(constant - n * math.pi / 2.0) <= 4.0 * 2.0**-52 * abs(constant) else 0
