"""Numbers for expressions: every node once, in the order in which they were made, for numbers of any kind."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from .node import CALL, NUMBER, OPERATIONS, SYMBOL, Node


def reached(nodes: Iterable[Node]) -> list[Node]:
    """All nodes that these are made of, themselves included, in an order of evaluation."""
    found: dict[int, Node] = {}
    to_see = [x for x in nodes if isinstance(x, Node)]
    while to_see:
        x = to_see.pop()
        if x.index not in found:
            found[x.index] = x
            to_see.extend(x.args)
    return [found[k] for k in sorted(found)]


def symbols(nodes: Iterable[Node]) -> list[Node]:
    """Symbols in expressions, in the order in which they were made."""
    return [x for x in reached(nodes) if x.op == SYMBOL]


def written_out(nodes: Iterable[Any]) -> int:
    """How many symbols expressions have if nothing that recurs has a name."""
    nodes = [x for x in nodes if isinstance(x, Node)]
    size: dict[int, int] = {}
    for x in reached(nodes):
        size[x.index] = 1 + sum(size[a.index] for a in x.args)
    return sum(size[x.index] for x in nodes)


def evaluate(nodes: Sequence[Any], values: Mapping[str, Any]) -> list[Any]:
    """Values of expressions.

    Parameters
    ----------
    nodes : sequence of Node or number
    values : mapping
        Symbol's name -> number, complex number or array. Parameters that are left out have their own value.
    """
    known: dict[int, Any] = {}
    for x in reached(nodes):
        if x.op == NUMBER:
            known[x.index] = x.value
        elif x.op == SYMBOL:
            if x.data.name not in values and x.moving:
                raise KeyError(f"no value is given for {x.data.name!r}")
            known[x.index] = values.get(x.data.name, x.value)
        else:
            args = [known[a.index] for a in x.args]
            known[x.index] = x.data.python(*args) if x.op == CALL else OPERATIONS[x.op](*args)
    return [known[x.index] if isinstance(x, Node) else x for x in nodes]


def evaluated(array: np.ndarray, values: Mapping[str, Any]) -> np.ndarray:
    """The same for an array of expressions; an axis for arrays of values comes first."""
    flat = evaluate(list(array.ravel()), values)
    wide = np.broadcast_arrays(*flat) if flat else []
    shape = wide[0].shape if wide else ()
    return np.stack(wide, axis=-1).reshape(*shape, *array.shape) if wide else np.zeros(array.shape)
