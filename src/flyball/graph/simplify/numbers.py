"""Numbers that a reader knows again: short fractions, roots, parts of pi."""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache

NEAR = 4.0 * 2.0**-52  # relative: what rounding makes of a number
LARGEST = 100_000  # numerators above are better read as decimals
DENOMINATORS = 720
ROOTS = (2, 3, 5, 6, 7, 10)


@dataclass(frozen=True)
class Known:
    """A number as fraction times the root of a small number, or times pi."""

    numerator: int
    denominator: int
    root: int = 1
    pi: bool = False


@lru_cache(maxsize=65536)
def fraction(x: float, largest: int = DENOMINATORS) -> Fraction | None:
    """The short fraction that a number is, if it is one."""
    if not math.isfinite(x) or abs(x) > LARGEST:
        return None
    found = Fraction(x).limit_denominator(largest)
    if found == 0 or abs(found.numerator) > LARGEST or abs(float(found) - x) > NEAR * abs(x):
        return None
    return found


@lru_cache(maxsize=65536)
def known(x: float) -> Known | None:
    """What a reader knows a number as; None if it is best written as a decimal."""
    found = fraction(x)
    if found is not None:
        q = found.denominator
        decimal = len(f"{abs(x):.12g}".replace(".", "").lstrip("0")) <= 4 and float(f"{x:.12g}") == x
        if q == 1 or q <= 12 or (not decimal and q <= DENOMINATORS and abs(found.numerator) < 1000):
            return Known(found.numerator, q)
        return None
    over_pi = fraction(x / math.pi, 48)
    if over_pi is not None and abs(over_pi.numerator) <= 48:
        return Known(over_pi.numerator, over_pi.denominator, pi=True)
    for root in ROOTS:
        over_root = fraction(x / math.sqrt(root), 24)
        if over_root is not None and abs(over_root.numerator) <= 48:
            return Known(over_root.numerator, over_root.denominator, root)
    return None


@lru_cache(maxsize=65536)
def snapped(x: float) -> float:
    """A number without the rounding that has gathered in it, where it is plainly a short one."""
    if x == 0.0 or not math.isfinite(x):
        return x
    found = fraction(x, 48)
    if found is not None:
        return float(found)
    short = float(f"{x:.14g}")
    return short if abs(short - x) <= NEAR * abs(x) else x
