"""How long an expression is to read."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from ..node import Node
from ..operations import ADD, DIVIDE, MULTIPLY, NUMBER, SYMBOL
from .numbers import known

UNBOUNDED = 1e9


def read(x: Node, costs: dict[int, float]) -> float:
    """Symbols, numbers and functions that a reader meets; ``costs`` keeps what is known."""
    to_see = [x]
    while to_see:
        y = to_see[-1]
        if y.index in costs:
            to_see.pop()
            continue
        missing = [a for a in y.args if a.index not in costs]
        if missing:
            to_see += missing
            continue
        costs[y.index] = min(_own(y, [costs[a.index] for a in y.args]), UNBOUNDED)
        to_see.pop()
    return costs[x.index]


def length(nodes: Iterable[Any]) -> float:
    """Symbols that a reader meets in all of them."""
    costs: dict[int, float] = {}
    return sum(read(x, costs) for x in nodes if isinstance(x, Node))


def _own(y: Node, args: list[float]) -> float:
    if y.op == NUMBER:
        return 0.0 if abs(y.value) == 1.0 else 1.0 if known(y.value) else 1.4
    if y.op == SYMBOL:
        return 1.0
    if y.op == ADD:
        return sum(args) + 0.05 + sum(1.0 for a in y.args if a.op == NUMBER and abs(a.value) == 1.0)
    if y.op == MULTIPLY:
        if y.args[0] is y.args[1]:
            return args[0] + 0.4
        return sum(args) + sum(0.5 for a in y.args if a.op == ADD)
    if y.op == DIVIDE:
        return sum(args) + 0.3 + (1.0 if y.args[0].op == NUMBER and y.args[0].value == 1.0 else 0.0)
    return sum(args) + 1.0
