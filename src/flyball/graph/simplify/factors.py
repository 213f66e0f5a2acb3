"""A sum of terms with common factors pulled out, as a node: what stands in most terms first."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Container
from typing import Any

from ..node import Graph, Node
from ..operations import ADD, DIVIDE, MULTIPLY, NUMBER
from .cost import read
from .numbers import fraction, snapped
from .quadratic import as_product

Term = tuple[float, dict[int, int]]
"""A number times powers of nodes, by their index."""


class Gatherer:
    """Makes nodes of terms."""

    def __init__(self, graph: Graph, costs: dict[int, float]) -> None:
        self.graph, self.costs = graph, costs

    def weight(self, powers: dict[int, int]) -> float:
        """Length of a product."""
        return sum(read(self.graph.nodes[k], self.costs) + 0.4 * (abs(n) - 1) for k, n in powers.items())

    def product(self, c: float, powers: dict[int, int]) -> Node:
        """A number times powers."""
        above: Any = snapped(c)
        below: Any = 1.0
        for k in sorted(powers):
            n = powers[k]
            if n > 0:
                above = self.graph.node(above) * self.graph.power(self.graph.nodes[k], n)
            else:
                below = self.graph.node(below) * self.graph.power(self.graph.nodes[k], -n)
        return self.graph.divide(above, below)

    def __call__(self, terms: list[Term]) -> Node:
        """The sum of terms."""
        if not terms:
            return self.graph.number(0.0)
        if len(terms) == 1:
            return self.product(*terms[0])
        powers = common([p for _, p in terms])
        c = content([c for c, _ in terms])
        c = 1.0 if c == -1.0 and not powers else c
        rest = [(d / c, quotient(p, powers)) for d, p in terms]
        return self.graph.multiply(self.product(c, powers), self.split(rest))

    def split(self, terms: list[Term]) -> Node:
        """A sum without a common factor: as a product of two sums, or with factors of some of its terms pulled out."""
        factors = as_product(terms)
        if factors is not None:
            first, second = (self.summed(x) for x in factors)
            return self.graph.multiply(first, second)
        best, saving = None, 0.0
        holding: dict[tuple[int, bool], list[int]] = defaultdict(list)
        for i, (_, p) in enumerate(terms):
            for k, n in p.items():
                holding[k, n > 0].append(i)
        for _, members in sorted(holding.items()):
            if len(members) > 1:
                found = self.saved([terms[i] for i in members])
                if (found, len(members)) > (saving + 1e-9, 0) or (
                    best and abs(found - saving) < 1e-9 and len(members) > len(best)
                ):
                    best, saving = members, found
        if not best:
            return self.summed(terms)
        chosen = set(best)
        inner = self([terms[i] for i in best])
        total = self.graph.add(inner, self([t for i, t in enumerate(terms) if i not in chosen]))
        return self.again(total)

    def again(self, x: Node) -> Node:
        """A sum whose terms have got a common factor, a sum itself, with this pulled out."""
        terms = flat(x)
        powers = common([p for _, p in terms])
        if not powers or len(terms) < 2:
            return x
        rest = [(c, quotient(p, powers)) for c, p in terms]
        return self.graph.multiply(self.product(1.0, powers), self(rest))

    def saved(self, terms: list[Term]) -> float:
        """How much shorter a sum is with its common factor pulled out."""
        powers = common([p for _, p in terms])
        alone = sum(1.0 for c, p in terms if p == powers)
        again = any(k in powers for _, p in terms for k in quotient(p, powers))  # l (l + 2 r) reads no better
        return (len(terms) - 1) * self.weight(powers) - alone - (2.6 if again else 0.9)

    def summed(self, terms: list[Term]) -> Node:
        """The sum as it stands."""
        total: Any = 0.0
        for c, p in terms:
            total = self.graph.node(total) + self.product(c, p)
        return self.graph.node(total)


def factors(x: Node, barriers: Container[int] = ()) -> Term:
    """A node as a number times powers of nodes that are no products; ``barriers`` are not looked into."""
    c: float = 1.0
    powers: dict[int, int] = {}
    to_see = [(x, 1)]
    while to_see:
        y, n = to_see.pop()
        if y.op == NUMBER:
            c *= y.value if n > 0 else 1.0 / y.value
        elif y.op in (MULTIPLY, DIVIDE) and y.index not in barriers:
            to_see += [(y.args[0], n), (y.args[1], n if y.op == MULTIPLY else -n)]
        else:
            powers[y.index] = powers.get(y.index, 0) + n
    return c, {k: n for k, n in powers.items() if n}


def flat(x: Node, barriers: Container[int] = ()) -> list[Term]:
    """Terms of a sum as they stand."""
    out: list[Term] = []
    to_see = [(x, 1.0)]
    while to_see:
        y, sign = to_see.pop()
        minus = y.op == MULTIPLY and y.args[0].op == NUMBER and y.args[0].value == -1.0 and y.args[1].op == ADD
        if y.index in barriers or not (y.op == ADD or minus):
            c, powers = factors(y, barriers)
            out.append((sign * c, powers))
        elif minus:
            to_see.append((y.args[1], -sign))
        else:
            to_see += [(a, sign) for a in y.args]
    return out


def common(powers: list[dict[int, int]]) -> dict[int, int]:
    """Powers that all products have."""
    found = dict(powers[0])
    for p in powers[1:]:
        for k in list(found):
            n = p.get(k, 0)
            if n * found[k] <= 0:
                del found[k]
            else:
                found[k] = min(n, found[k], key=abs)
        if not found:
            break
    return found


def quotient(p: dict[int, int], by: dict[int, int]) -> dict[int, int]:
    """Powers without those of ``by``."""
    out = {k: n - by.get(k, 0) for k, n in p.items()}
    return {k: n for k, n in out.items() if n}


def content(numbers: list[float]) -> float:
    """A numeric factor to pull out: the smallest number, where all are whole multiples of it and fewer are left."""
    smallest = min(map(abs, numbers))
    sign = -1.0 if all(x < 0.0 for x in numbers) else 1.0
    parts = [fraction(x, 48) for x in numbers]
    if all(parts) and not all(p.denominator == 1 for p in parts if p):
        under = math.lcm(*[p.denominator for p in parts if p])
        over = math.gcd(*[int(p * under) for p in parts if p])
        if under <= 48:
            smallest = over / under
    ratios = [x / smallest for x in numbers]
    whole = all(abs(r) <= 16.5 and abs(r - round(r)) <= 1e-12 * abs(r) for r in ratios)
    if not whole or smallest == 1.0:
        return sign
    before = sum(burden(x) for x in numbers)
    after = burden(smallest) + sum(burden(round(r)) for r in ratios)
    return sign * smallest if after < before else sign


def burden(x: float) -> int:
    """Digits' places that a number takes: none for one, two for a fraction."""
    return 0 if abs(x) == 1.0 else 1 if x == round(x) else 2
