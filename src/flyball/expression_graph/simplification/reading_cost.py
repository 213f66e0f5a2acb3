"""Length of an expression to read, and recognition of short fractions, roots and multiples of pi."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from typing import Any

from ..graph import ADD, DIVIDE, MULTIPLY, NUMBER, SYMBOL, Node

ROUNDING_FACTOR = 4.0 * 2.0**-52  # relative rounding error of a number
LARGEST = 100_000  # larger numerators are written as decimals
DENOMINATORS = 720
ROOTS = (2, 3, 5, 6, 7, 10)


@dataclass(frozen=True)
class ExactNumber:
    """A number as a fraction times the root of a small number, or times pi."""

    numerator: int
    denominator: int
    root: int = 1
    pi: bool = False


@lru_cache(maxsize=65536)
def fraction(x: float, largest: int = DENOMINATORS) -> Fraction | None:
    """The short fraction that a number equals; None if there is none."""
    if not math.isfinite(x) or abs(x) > LARGEST:
        return None
    found = Fraction(x).limit_denominator(largest)
    if found == 0 or abs(found.numerator) > LARGEST or abs(float(found) - x) > ROUNDING_FACTOR * abs(x):
        return None
    return found


@lru_cache(maxsize=65536)
def exact_number(x: float) -> ExactNumber | None:
    """Exact form of a number for display; None if a decimal is better."""
    found = fraction(x)
    if found is not None:
        q = found.denominator
        decimal = len(f"{abs(x):.12g}".replace(".", "").lstrip("0")) <= 4 and float(f"{x:.12g}") == x
        if q == 1 or q <= 12 or (not decimal and q <= DENOMINATORS and abs(found.numerator) < 1000):
            return ExactNumber(found.numerator, q)
        return None
    over_pi = fraction(x / math.pi, 48)
    if over_pi is not None and abs(over_pi.numerator) <= 48:
        return ExactNumber(over_pi.numerator, over_pi.denominator, pi=True)
    for root in ROOTS:
        over_root = fraction(x / math.sqrt(root), 24)
        if over_root is not None and abs(over_root.numerator) <= 48:
            return ExactNumber(over_root.numerator, over_root.denominator, root)
    return None


@lru_cache(maxsize=65536)
def without_rounding(x: float) -> float:
    """Remove accumulated rounding from a number that is clearly a short one."""
    if x == 0.0 or not math.isfinite(x):
        return x
    found = fraction(x, 48)
    if found is not None:
        return float(found)
    short = float(f"{x:.14g}")
    return short if abs(short - x) <= ROUNDING_FACTOR * abs(x) else x


LARGEST_COST = 1e9


def reading_cost(x: Node, costs: dict[int, float]) -> float:
    """Number of symbols, numbers and functions in an expression; ``costs`` is a cache."""
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
        costs[y.index] = min(_node_cost(y, [costs[a.index] for a in y.args]), LARGEST_COST)
        to_see.pop()
    return costs[x.index]


def symbol_count(nodes: Iterable[Any]) -> float:
    """Total reading length of several expressions."""
    costs: dict[int, float] = {}
    return sum(reading_cost(x, costs) for x in nodes if isinstance(x, Node))


def _node_cost(y: Node, args: list[float]) -> float:
    if y.op == NUMBER:
        return 0.0 if abs(y.value) == 1.0 else 1.0 if exact_number(y.value) else 1.4
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
