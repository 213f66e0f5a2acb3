"""Expressions of a document made short: parts that mean something have names, and parts that occur again and again."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from ...graph.node import Node, Symbol
from ...graph.operations import MULTIPLY, NUMBER, SYMBOL
from ...graph.simplify.cost import length
from ...graph.simplify.shared import Definitions
from ...graph.simplify.simplify import simplified
from ...graph.values import reached

FEW = 2500  # operations up to which everything is written out first
BRIEF = 4.0  # symbols below which a part has no name
READABLE = 900.0  # symbols of all equations together up to which that stays


Candidate = tuple[Any, Symbol]


def named(nodes: Sequence[Any], candidates: Sequence[Candidate]) -> tuple[list[Any], Definitions, list[Candidate]]:
    """Expressions with symbols for parts that have a meaning, what these stand for, and which candidates they are.

    A part that is a number times something is named too where another multiple of it stands.
    """
    wanted: dict[int, tuple[float, Candidate]] = {}
    for x, symbol in candidates:
        if isinstance(x, Node) and x.op not in (NUMBER, SYMBOL):
            scaled = x.op == MULTIPLY and x.args[0].op == NUMBER
            inner = x.args[1] if scaled else x
            if inner.op != SYMBOL and inner.index not in wanted:
                wanted[inner.index] = (x.args[0].value if scaled else 1.0, (x, symbol))
    made: dict[int, Node] = {}
    definitions: Definitions = []
    found: list[Candidate] = []
    for x in reached(nodes):
        args = tuple(made.get(a.index, a) for a in x.args)
        new = made[x.index] = x if args == x.args else x.graph.rebuilt(x, args)
        if x.index in wanted:
            c, candidate = wanted[x.index]
            name = x.graph.symbol(candidate[1], None if x.moving else c * x.value)
            definitions.append((name, c * new))
            found.append(candidate)
            made[x.index] = name / c
    return [made.get(x.index, x) if isinstance(x, Node) else x for x in nodes], definitions, found


def shortened(
    nodes: Sequence[Any], units: Sequence[Sequence[Node]], candidates: Sequence[Candidate]
) -> tuple[list[Any], Definitions]:
    """Expressions made short, and parts with names: with these, or without, as is shorter."""
    found: list[Any] | None = None
    if len(reached(nodes)) <= FEW or not candidates:
        found = simplified(nodes, units=units)
        if not candidates or length(found) <= READABLE:
            return found, []
    left = list(candidates)
    while True:
        rest, meant, of = named(nodes, left)
        defined = simplified([y for _, y in meant], units=units)
        brief = {x.index for (x, _), y in zip(of, defined, strict=True) if length([y]) < BRIEF}
        if not brief:
            break
        left = [c for c in left if not (isinstance(c[0], Node) and c[0].index in brief)]
    other = simplified(rest, units=units)
    if found is not None and len(reached(found)) < len(reached([*other, *defined])):
        return found, []
    return other, [(x, y) for (x, _), y in zip(meant, defined, strict=True)]
