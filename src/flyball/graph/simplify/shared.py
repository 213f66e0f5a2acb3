"""Names for what occurs again and again, or is too long to stand inside of something else."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from typing import Any

from ..node import Graph, Node, Symbol
from ..operations import ADD, MULTIPLY, NUMBER, SYMBOL
from ..values import reached
from .cost import read

GAIN = 12.0  # symbols that a name saves, from which on it is given
LONG = 60.0  # symbols in a factor or an argument, from which on it has a name
SHORT = 4.0  # what is as short is written out

Definitions = list[tuple[Node, Node]]
"""Symbols and what they stand for, in an order of evaluation."""


def shared(nodes: Sequence[Any], gain: float = GAIN, long: float = LONG) -> tuple[list[Any], Definitions]:
    """Expressions with symbols for parts that are long and stand there more than once.

    Parameters
    ----------
    nodes : sequence of Node or number
    gain, long : float
        Symbols that a name must save; length from which on a factor or an argument has a name, though it stands once.

    Returns
    -------
    list, list of (Node, Node)
        The expressions, and what the symbols stand for.
    """
    order = [x for x in reached(nodes) if x.op not in (NUMBER, SYMBOL)]
    uses, inside = _uses(order)
    lengths: dict[int, float] = {}
    made: dict[int, Node] = {}
    definitions: Definitions = []
    letter = _letter(order[0].graph) if order else ""
    for x in order:
        args = tuple(made.get(a.index, a) for a in x.args)
        new = made[x.index] = x if args == x.args else x.graph.rebuilt(x, args)
        length = read(new, lengths)
        saved = (uses[x.index] - 1) * (length - 1.0)
        scaled = x.op == MULTIPLY and x.args[0].op == NUMBER
        if length > SHORT and not scaled and (saved > gain or (length > long and x.index in inside)):
            name = f"{letter}_{len(definitions) + 1}"
            index = f"{letter[0]}_{{{letter[1:]}{len(definitions) + 1}}}"
            symbol = Symbol(name, "shared" if x.moving else "constant", index)
            made[x.index] = x.graph.symbol(symbol, None if x.moving else x.value)
            definitions.append((made[x.index], new))
    return [made.get(x.index, x) if isinstance(x, Node) else x for x in nodes], definitions


def _letter(graph: Graph) -> str:
    """Of the symbols (w_1, w_2, ...): one that no symbol of the graph has with a number behind."""
    taken = {x.data.name.partition("_")[0] for x in graph if x.op == SYMBOL and "_" in x.data.name}
    return next(x for x in (*"wchkb", *(f"w{n}" for n in range(len(taken) + 1))) if x not in taken)


def _uses(order: Sequence[Node]) -> tuple[dict[int, int], set[int]]:
    """How often an operation stands in others; which sums stand in something else than a sum."""
    uses: dict[int, int] = defaultdict(int)
    inside: set[int] = set()
    for x in order:
        scaled = x.op == MULTIPLY and x.args[0].op == NUMBER
        for a in x.args:
            uses[a.index] += 1
            if x.op != ADD and not scaled and a.op == ADD:
                inside.add(a.index)
    return uses, inside
