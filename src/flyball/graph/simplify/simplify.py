"""Expressions made short and readable: see the head of this folder."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Any, cast

import numpy as np

from ..node import Graph, Node
from ..operations import ADD, CALL, DIVIDE, MULTIPLY, NUMBER, SYMBOL
from ..values import reached
from .angles import contracted, doubled, opened, phased
from .cost import read
from .expand import FEW_TERMS, Expander
from .factors import Gatherer, Term, flat
from .terms import Terms
from .units import shortened

TERMS = 60  # of a sum that is multiplied out
MANY = 2500  # operations from which on only short sums are
HUGE = 3000.0  # symbols from which on nobody reads an expression: it stays as it is shared
INNER = 16  # terms up to which a part of an expression is gathered by itself
SHORT = 6.0  # what is as short as this is not looked at in another way


def simplified(
    nodes: Sequence[Any] | np.ndarray, units: Iterable[Sequence[Node]] = (), keep: Iterable[Node] = (), most: int = 0
) -> Any:
    """Expressions of the same value that are shorter to read, in the same graph.

    Parameters
    ----------
    nodes : sequence or array of Node or number
    units : sequence of sequences of Node
        Symbols whose squares add up to one, such as the four of a unit quaternion.
    keep : sequence of Node
        Expressions that stay as they are, as if they were symbols.
    most : int, optional
        Terms up to which sums are multiplied out; fewer where expressions are large, if not given.

    Returns
    -------
    list of Node, or array of the shape given
        Numbers among the expressions stay numbers.
    """
    flat = list(nodes.ravel()) if isinstance(nodes, np.ndarray) else list(nodes)
    graph = next((x.graph for x in flat if isinstance(x, Node)), None)
    if graph is not None:
        made = Simplifier(graph, flat, units, keep, most)
        flat = [made(x) if isinstance(x, Node) else x for x in flat]
    if not isinstance(nodes, np.ndarray):
        return flat
    out = np.empty(nodes.shape, object)
    out.ravel()[:] = flat
    return out


class Barriers:
    """Numbers of the nodes that are not looked into: those to keep, and operations on infinity or nan.

    These are values that no law of algebra holds for: infinity times a sum is not the sum of infinity times its terms.
    """

    def __init__(self, graph: Graph, kept: set[int]) -> None:
        self.graph, self.kept = graph, kept

    def __contains__(self, k: object) -> bool:
        return k in self.kept or any(
            a.op == NUMBER and not math.isfinite(a.value) for a in self.graph.nodes[cast(int, k)].args
        )


class Simplifier:
    """Makes expressions of one graph short; what it has found serves the next.

    Parameters
    ----------
    graph : Graph
    nodes : sequence of Node or number
        Their number of operations decides how far sums are multiplied out.
    units, keep, most
        As of `simplified`.
    """

    def __init__(
        self, graph: Graph, nodes: Sequence[Any], units: Iterable[Sequence[Node]], keep: Iterable[Node], most: int
    ) -> None:
        self.graph = graph
        self.units = [tuple(x.index for x in unit) for unit in units]
        self.barriers = Barriers(graph, {x.index for x in keep})
        self.costs: dict[int, float] = {}
        size = len(reached(nodes))
        self.expander = Expander(self, most or (TERMS if size < MANY else FEW_TERMS))
        self.gathered = Gatherer(graph, self.costs)
        self._short: dict[Any, Node] = {}
        self._best: dict[int, Node] = {}  # of parts
        self._whole: dict[int, Node] = {}  # of what was asked for

    def __call__(self, x: Node) -> Node:
        """The shortest expression found."""
        for y in reached([x]):
            if y.index not in self._best:
                self._best[y.index] = self._shortest(y) if len(self.expander(y)) <= INNER else self._parts(y)
        if x.index not in self._whole:
            self._whole[x.index] = self._shortest(x)
        return self._whole[x.index]

    def cost(self, x: Node) -> float:
        """How long it is to read."""
        return read(x, self.costs)

    def _shortest(self, x: Node) -> Node:
        if x.op in (NUMBER, SYMBOL) or x.index in self.barriers:
            return x
        found = self.short(self.expander(x))
        if x.op in (ADD, MULTIPLY, DIVIDE) and self.cost(found) > SHORT:
            parts = self._parts(x)
            if x.op == ADD:
                other = self.gathered(joined(flat(parts, self.barriers)))
                parts = min(other, parts, key=self.cost)
            if min(self.cost(found), self.cost(parts)) > HUGE:
                return parts
            found = min(found, parts, key=self.cost)
        return found

    def _parts(self, x: Node) -> Node:
        """The same operation on the best of its arguments."""
        return self.graph.rebuilt(x, tuple(self._best[a.index] for a in x.args))

    def shorter(self, x: Node, other: Node) -> Node:
        """The best that is known for ``x``, or the other of the same value."""
        return min(other, self._best.get(x.index, other), key=self.cost)

    def inside(self, x: Node) -> Node:
        """A function of short arguments."""
        args = tuple(self._best[a.index] if a.index in self._best else self(a) for a in x.args)
        return x if x.op == CALL and args == x.args else self.graph.rebuilt(x, args)

    def short(self, terms: Terms) -> Node:
        """A node for a sum of terms: with sums of angles, or products of waves, as is shorter."""
        key = frozenset(terms.items())
        found = self._short.get(key)
        if found is None:
            self.expander.spend(len(terms) ** 2 // 4)
            terms = phased(shortened(terms, self.units))
            found = self._made([(c, p, w) for (p, w), c in sorted(terms.items())])
            if sum(1 for _, w in terms if w) > 1 or (len(terms) > 1 and any(w for _, w in terms)):
                for other in (contracted(terms), doubled(terms)):
                    found = min(found, self._made(other), key=self.cost)
            self._short[key] = found
        return found

    def _made(self, products: list[Any]) -> Node:
        terms: list[Term] = []
        for c, powers, waves in products:
            found = dict(powers)
            for w in waves:
                k = opened(self.graph, w).index
                found[k] = found.get(k, 0) + 1
            terms.append((c, {k: n for k, n in found.items() if n}))
        made = self.gathered(joined(terms))
        if len(terms) < 4:
            return made
        again = self.gathered(joined(flat(made, self.barriers)))  # sums that several terms have got for a factor
        return min(made, again, key=self.cost)


def joined(terms: list[Term]) -> list[Term]:
    """Equal terms as one."""
    found: dict[Any, tuple[float, dict[int, int]]] = {}
    for c, p in terms:
        key = tuple(sorted(p.items()))
        before = found.get(key)
        total = c + (before[0] if before else 0.0)
        if before and abs(total) <= 1e-14 * max(abs(c), abs(before[0])):
            del found[key]
        else:
            found[key] = (total, p)
    return list(found.values())
