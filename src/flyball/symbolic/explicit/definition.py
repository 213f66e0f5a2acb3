"""What dependent quantities are: formulas, or equations that Newton's method solves."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...graph.derivative import jacobian, replaced
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
    """

    symbols: tuple[Node, ...]
    values: tuple[Any, ...] = ()
    residuals: tuple[Any, ...] = ()
    how: str = ""

    @property
    def closed(self) -> bool:
        """Whether there are formulas."""
        return bool(self.values)

    @property
    def names(self) -> tuple[str, ...]:
        """What it defines."""
        return tuple(x.data.name for x in self.symbols)


def inlined(nodes: Sequence[Any], definitions: Sequence[Definition]) -> list[Any]:
    """Expressions with every formula put in; symbols without one stay."""
    return replaced(nodes, formulas(definitions))


def formulas(definitions: Sequence[Definition]) -> list[tuple[Node, Any]]:
    """Symbols that have formulas, with formulas that hold no other of them."""
    known: list[tuple[Node, Any]] = []
    for d in definitions:
        if d.closed:
            known += zip(d.symbols, replaced([_node(d, y) for y in d.values], known), strict=True)
    return known


def _node(d: Definition, x: Any) -> Node:
    return d.symbols[0].graph.node(x)


def with_formulas(definitions: Sequence[Definition]) -> list[Definition]:
    """Those without formulas, their equations with all formulas put in."""
    known = formulas(definitions)
    return [
        Definition(d.symbols, (), tuple(replaced([_node(d, y) for y in d.residuals], known)), d.how)
        for d in definitions
        if not d.closed
    ]


def rates(definitions: Sequence[Definition], by: Sequence[Node], dets: Determinants) -> list[tuple[Node, list[Any]]]:
    """Derivatives of symbols without formulas: dw/du = -(dr/dw)^-1 dr/du, one after the other.

    Parameters
    ----------
    definitions : sequence of Definition
        All without formulas: see `with_formulas`.
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
