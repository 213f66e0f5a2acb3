"""Wording shared by results: names of kinds of events and singular positions, and numbers as text.

A number that is only rounding beside the size of its kind is written as 0.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

PASSAGE, LOCK_UP, BIFURCATION, SELF_MOTION = "regular passage", "lock-up", "bifurcation", "self-motion"
"""Of singular positions."""

INSTANT_KINDS = ("event", "impact", "kick", "jam", "rest", "turn", "hold", "leave")
SWITCH_KINDS = (
    "close",
    "open",
    "stick",
    "slip",
    "lock",
    "overrun",
    "latch",
    "unlatch",
    "taut",
    "slack",
    "touch",
    "part",
)
EVENT_KINDS = frozenset((*INSTANT_KINDS, *SWITCH_KINDS))
"""What happenings may be."""


NEGLIGIBLE = 1e-10  # part of the size of its kind below which a number is what rounding, or an iteration, left


def without_rounding(values: Any, size: float | None = None) -> np.ndarray:
    """The values, with 0 for those that are nothing beside ``size`` (the largest of them, if not given)."""
    a = np.asarray(values)
    known = np.abs(a[np.isfinite(a)])
    size = float(known.max(initial=0.0)) if size is None else size
    with np.errstate(invalid="ignore"):
        return np.where(np.abs(a) <= NEGLIGIBLE * size, 0.0, a) + 0.0


def number_text(x: float, size: float | None = None, digits: int = 6) -> str:
    """One number, or 0 where it is nothing beside ``size``."""
    return f"{float(without_rounding([x], size)[0]):.{digits}g}"


def tuple_text(values: Sequence[float] | np.ndarray, digits: int = 4, size: float | None = None) -> str:
    """Components of a vector: ``(0, 0, 6.283)``."""
    return f"({', '.join(f'{x:.{digits}g}' for x in without_rounding(values, size).tolist())})"


def range_text(values: np.ndarray, digits: int = 4, size: float | None = None) -> str:
    """From the least to the largest of a series, those that are not a number left out; one number if it is constant."""
    a = without_rounding(values, size)
    low, high = (f"{f(a):.{digits}g}" for f in (np.nanmin, np.nanmax))
    return low if low == high else f"{low} to {high}"


def with_unit(name: str, unit: str) -> str:
    """``A.angle [rad]``; the name alone of what has no unit, the unit alone where the name stands elsewhere."""
    return f"{name} [{unit}]".strip() if unit else name


def json_numbers(values: np.ndarray) -> list:
    """Numbers as plain data: a complex one as its real and imaginary part."""
    return values.tolist() if np.isrealobj(values) else [[float(z.real), float(z.imag)] for z in values]
