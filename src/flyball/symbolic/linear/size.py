"""How large the terms are that an expression is the sum of: what rounding leaves of it is a part of that."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from ...graph.node import ADD, CALL, DIVIDE, MULTIPLY, NUMBER, OPERATIONS, SYMBOL, Node
from ...graph.values import reached


def sizes(nodes: Sequence[Any]) -> list[float]:
    """Sums of the absolute values of all terms, with the parameters' own values."""
    found: dict[int, float] = {}
    for x in reached(nodes):
        a = [found[k.index] for k in x.args]
        if x.op in (NUMBER, SYMBOL, CALL):
            found[x.index] = abs(x.value)
        elif x.op in (ADD, MULTIPLY):
            found[x.index] = float(OPERATIONS[x.op](*a))
        elif x.op == DIVIDE:
            found[x.index] = a[0] / abs(x.args[1].value) if x.args[1].value else float("inf")
        else:
            found[x.index] = 1.0 if x.op in ("sin", "cos") else abs(x.value)
    return [found[x.index] if isinstance(x, Node) else abs(float(x)) for x in nodes]
