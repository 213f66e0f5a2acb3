"""Symbols for common subexpressions, and for long ones inside others."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from typing import Any

from ..evaluation import nodes_in_order
from ..graph import ADD, MULTIPLY, NUMBER, SYMBOL, Graph, Node, Symbol
from .reading_cost import reading_cost, symbol_count
from .simplify import simplified

MIN_GAIN = 12.0  # a subexpression gets a name if that saves so many symbols
LONG_COST = 60.0  # a factor or argument with so many symbols gets a name
SHORT_COST = 4.0  # expressions up to this length are written out

Definitions = list[tuple[Node, Node]]
"""Symbols and their definitions, in an order of evaluation."""


def extract_common_subexpressions(
    nodes: Sequence[Any], gain: float = MIN_GAIN, long: float = LONG_COST
) -> tuple[list[Any], Definitions]:
    """Replace long parts that occur more than once by symbols.

    Parameters
    ----------
    nodes : sequence of Node or number
    gain, long : float
        Symbols that a name must save; length above which a factor or an argument gets a name even if it occurs once.

    Returns
    -------
    list, list of (Node, Node)
        The expressions, and the definitions of the symbols.
    """
    order = [x for x in nodes_in_order(nodes) if x.op not in (NUMBER, SYMBOL)]
    uses, inside = _uses(order)
    lengths: dict[int, float] = {}
    made: dict[int, Node] = {}
    definitions: Definitions = []
    letter = _symbol_letter(order[0].graph) if order else ""
    for x in order:
        args = tuple(made.get(a.index, a) for a in x.args)
        new = made[x.index] = x if args == x.args else x.graph.rebuilt(x, args)
        length = reading_cost(new, lengths)
        saved = (uses[x.index] - 1) * (length - 1.0)
        scaled = x.op == MULTIPLY and x.args[0].op == NUMBER
        if length > SHORT_COST and not scaled and (saved > gain or (length > long and x.index in inside)):
            name = f"{letter}_{len(definitions) + 1}"
            index = f"{letter[0]}_{{{letter[1:]}{len(definitions) + 1}}}"
            symbol = Symbol(name, "shared" if x.moving else "constant", index)
            made[x.index] = x.graph.symbol(symbol, None if x.moving else x.value)
            definitions.append((made[x.index], new))
    return [made.get(x.index, x) if isinstance(x, Node) else x for x in nodes], definitions


def _symbol_letter(graph: Graph) -> str:
    """Letter of the symbols (w_1, w_2, ...) that no numbered symbol of the graph uses."""
    taken = {x.data.name.partition("_")[0] for x in graph if x.op == SYMBOL and "_" in x.data.name}
    return next(x for x in (*"wchkb", *(f"w{n}" for n in range(len(taken) + 1))) if x not in taken)


def _uses(order: Sequence[Node]) -> tuple[dict[int, int], set[int]]:
    """Number of uses of each operation; and the sums that occur in something other than a sum."""
    uses: dict[int, int] = defaultdict(int)
    inside: set[int] = set()
    for x in order:
        scaled = x.op == MULTIPLY and x.args[0].op == NUMBER
        for a in x.args:
            uses[a.index] += 1
            if x.op != ADD and not scaled and a.op == ADD:
                inside.add(a.index)
    return uses, inside


MAX_OPERATIONS = 600  # up to so many operations expressions are simplified before parts get names
READABLE_COST = 2500.0  # that result is kept up to so many symbols in all expressions


def simplified_with_symbols(
    nodes: Sequence[Any], units: Sequence[Sequence[Node]] = ()
) -> tuple[list[Any], Definitions]:
    """Short expressions of the same value, with symbols for common subexpressions and their definitions.

    Small expressions are simplified as a whole. In large ones common subexpressions get names first, and each piece is
    simplified by itself: the time is proportional to the number of operations, and the result does not grow.

    Parameters
    ----------
    nodes : sequence of Node or number
    units : sequence of sequences of Node
        As for `simplified`.

    Returns
    -------
    list, list of (Node, Node)
        The expressions, and symbols with their definitions, in an order of evaluation.
    """
    if len(nodes_in_order(nodes)) <= MAX_OPERATIONS:
        found = simplified(nodes, units)
        if symbol_count(found) <= READABLE_COST:
            return extract_common_subexpressions(found)
    rest, definitions = extract_common_subexpressions(nodes)
    short = simplified([*rest, *(y for _, y in definitions)], units)
    count = len(rest)
    return short[:count], [(x, y) for (x, _), y in zip(definitions, short[count:], strict=True)]
