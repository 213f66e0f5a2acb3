"""Which branch of ``choose(x, a, b)`` is taken where that is known beforehand."""

from __future__ import annotations

import math
from typing import Any

from .operations import ADD, NUMBER

SMALLEST = 1e-300  # what is greater than zero with this added to it is not negative


def taken(x: Any, a: Any, b: Any) -> Any:
    """The branch, as nodes; None where it is open.

    A first branch that is no number stands for an error: it is taken for granted that x is not greater than zero.
    """
    if a is b:
        return a
    if x.op == NUMBER:
        return a if x.value > 0.0 else b
    if most(x) <= 0.0:
        return b
    if a.op == NUMBER and a.value != a.value:
        x.graph.granted.append((x.graph.subtract(SMALLEST, x), "positive"))
        return b
    return None


def most(x: Any) -> float:
    """What the sign of something, and a number, are at most; inf where nobody knows."""
    if x.op == ADD and NUMBER in (x.args[0].op, x.args[1].op):
        first, second = x.args if x.args[0].op == NUMBER else x.args[::-1]
        return float(first.value) + (1.0 if second.op == "sign" else math.inf)
    return 1.0 if x.op == "sign" else math.inf
