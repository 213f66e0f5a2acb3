"""How large the terms are that an expression is the sum of: what rounding leaves of it is a part of that."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ...graph.node import Node
from ...graph.operations import ADD, CALL, DIVIDE, MULTIPLY, NUMBER, OPERATIONS, SYMBOL
from ...graph.values import reached, symbols

ROUNDED = 1e-12  # of its terms: what is left of an expression that is zero
DRAWS = 3


def sizes(nodes: Sequence[Any], values: Mapping[str, float] | None = None) -> list[tuple[float, float]]:
    """(value, sum of the absolute values of all terms); with the parameters' own values, or others."""
    told = values or {}
    found: dict[int, tuple[float, float]] = {}
    for x in reached(nodes):
        a = [found[k.index] for k in x.args]
        own = [v for v, _ in a]
        if x.op == NUMBER:
            value = x.value
        elif x.op == SYMBOL:
            value = told.get(x.data.name, x.value)
        else:
            value = float(x.data.python(*own) if x.op == CALL else OPERATIONS[x.op](*own))
        if x.op in (ADD, MULTIPLY):
            size = float(OPERATIONS[x.op](*(s for _, s in a)))
        elif x.op == DIVIDE:
            size = a[0][1] / abs(own[1]) if own[1] else float("inf")
        else:
            size = 1.0 if x.op in ("sin", "cos") else abs(value)
        found[x.index] = (value, size)
    return [found[x.index] if isinstance(x, Node) else (float(x), abs(float(x))) for x in nodes]


def vanishing(nodes: Sequence[Any]) -> list[bool]:
    """Which expressions are zero for all values of their parameters, by values that are drawn near their own."""
    rng = np.random.default_rng(0)
    out = np.ones(len(nodes), bool)
    for _ in range(DRAWS):
        told = {s.data.name: (s.value or 0.1) * float(rng.uniform(0.7, 1.3)) for s in symbols(nodes)}
        out &= np.array([abs(x) <= ROUNDED * size for x, size in sizes(nodes, told)], bool)
    return [bool(x) for x in out]
