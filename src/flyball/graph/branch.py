"""Which branch of ``choose(x, a, b)`` is taken where that is known beforehand."""

from __future__ import annotations

import math
from typing import Any

from .operations import ADD, NUMBER


def taken(x: Any, a: Any, b: Any) -> Any:
    """The branch, as nodes; None where it is open: nan in a branch is a value like any other, which ends a motion."""
    if a is b:
        return a
    if x.op == NUMBER:
        return a if x.value > 0.0 else b
    if most(x) <= 0.0:
        return b
    return None


def most(x: Any) -> float:
    """What the sign of something, and a number, are at most; inf where nobody knows."""
    if x.op == ADD and NUMBER in (x.args[0].op, x.args[1].op):
        first, second = x.args if x.args[0].op == NUMBER else x.args[::-1]
        return float(first.value) + (1.0 if second.op == "sign" else math.inf)
    return 1.0 if x.op == "sign" else math.inf
