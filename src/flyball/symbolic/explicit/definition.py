"""What dependent quantities are: formulas, or equations that Newton's method solves."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...graph.derivative import jacobian
from ...graph.node import Node
from .solve import Determinants, solve, times


@dataclass(frozen=True)
class Definition:
    """Symbols, and what they are in terms of symbols that are known before.

    Attributes
    ----------
    symbols : tuple of Node
    values : tuple of Node
        Formulas; empty where there are none, and ``residuals`` determine the symbols.
    residuals : tuple of Node
        What vanishes; as many as symbols.
    how : str
        How the formula was found, and which branch of it is taken.
    radius : Node or number, optional
        sqrt(x^2 + y^2) of a formula atan2(y, x), where that is known.
    """

    symbols: tuple[Node, ...]
    values: tuple[Any, ...] = ()
    residuals: tuple[Any, ...] = ()
    how: str = ""
    radius: Any = None

    @property
    def closed(self) -> bool:
        """Whether there are formulas."""
        return bool(self.values)

    @property
    def names(self) -> tuple[str, ...]:
        """What it defines."""
        return tuple(x.data.name for x in self.symbols)


class Formulas:
    """Expressions with formulas put in for symbols that have some; each expression of the graph is seen once.

    Parameters
    ----------
    definitions : sequence of Definition
        Each stands on those before.

    Attributes
    ----------
    implicit : list of Definition
        Those without formulas, their equations with all formulas put in.
    """

    def __init__(self, definitions: Sequence[Definition]) -> None:
        self._known: dict[int, Node] = {}
        self.implicit: list[Definition] = []
        for d in definitions:
            if d.closed:
                found = self([d.symbols[0].graph.node(y) for y in d.values])
                self._known |= {s.index: y for s, y in zip(d.symbols, found, strict=True)}
            else:
                gaps = self([d.symbols[0].graph.node(y) for y in d.residuals])
                self.implicit.append(Definition(d.symbols, (), tuple(gaps), d.how))

    def __call__(self, nodes: Sequence[Any]) -> list[Any]:
        """Expressions in which no symbol with a formula is left."""
        for x in unseen(nodes, self._known):
            args = tuple(self._known[a.index] for a in x.args)
            same = all(a is b for a, b in zip(args, x.args, strict=True))
            self._known[x.index] = x if same else x.graph.rebuilt(x, args)
        return [self._known[x.index] if isinstance(x, Node) else x for x in nodes]


def unseen(nodes: Sequence[Any], known: Mapping[int, Any]) -> list[Node]:
    """What expressions are made of and is not known, in an order of evaluation."""
    found: dict[int, Node] = {}
    to_see = [x for x in nodes if isinstance(x, Node)]
    while to_see:
        x = to_see.pop()
        if x.index not in found and x.index not in known:
            found[x.index] = x
            to_see.extend(x.args)
    return [found[k] for k in sorted(found)]


def rates(definitions: Sequence[Definition], by: Sequence[Node], dets: Determinants) -> list[tuple[Node, list[Any]]]:
    """Derivatives of symbols without formulas: dw/du = -(dr/dw)^-1 dr/du, one after the other.

    Parameters
    ----------
    definitions : sequence of Definition
        All without formulas: see `Formulas`.
    by : sequence of Node
        Symbols.

    Returns
    -------
    list of (symbol, derivatives by each of these)
    """
    found: list[tuple[Node, list[Any]]] = []
    for d in definitions:
        own, others = jacobian(d.residuals, d.symbols), jacobian(d.residuals, by)
        if found:
            before = jacobian(d.residuals, [w for w, _ in found])
            others = others + times(before, np.array([row for _, row in found], object))
        X = solve(own, others, dets)
        found += [(w, [-y for y in row]) for w, row in zip(d.symbols, X, strict=True)]
    return found
