"""Wording shared by results: names of kinds of events and singular positions, and numbers as text.

A number that is only rounding beside the size of its kind is written as 0.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

PASSAGE, LOCK_UP, BIFURCATION, SELF_MOTION = "regular passage", "lock-up", "bifurcation", "self-motion"
"""Kinds of singular positions."""

INSTANT_KINDS = ("event", "impact", "kick", "jam", "rest", "turn", "hold", "leave")
"""Kinds of events that are no transition of a switch; those are `SwitchKind.transitions`."""


NEGLIGIBLE = 1e-10  # relative to the size of its kind: smaller numbers are rounding or iteration errors

STABLE, MARGINAL, UNSTABLE, NOT_JUDGED = "stable", "marginal", "unstable", "not judged"
"""Stability of an equilibrium."""


def without_rounding(values: Any, size: float | None = None) -> np.ndarray:
    """Return the values, with 0 for those negligible beside ``size`` (the largest of them, if not given)."""
    a = np.asarray(values)
    known = np.abs(a[np.isfinite(a)])
    size = float(known.max(initial=0.0)) if size is None else size
    with np.errstate(invalid="ignore"):
        return np.where(np.abs(a) <= NEGLIGIBLE * size, 0.0, a) + 0.0


def number_text(x: float, size: float | None = None, digits: int = 6) -> str:
    """Return a number as text; 0 if it is negligible beside ``size``."""
    return f"{float(without_rounding([x], size)[0]):.{digits}g}"


def tuple_text(values: Sequence[float] | np.ndarray, digits: int = 4, size: float | None = None) -> str:
    """Return components of a vector as text: ``(0, 0, 6.283)``."""
    return f"({', '.join(f'{x:.{digits}g}' for x in without_rounding(values, size).tolist())})"


def range_text(values: np.ndarray, digits: int = 4, size: float | None = None) -> str:
    """Return the range of a series as text, without nan; one number if it is constant."""
    a = without_rounding(values, size)
    low, high = (f"{f(a):.{digits}g}" for f in (np.nanmin, np.nanmax))
    return low if low == high else f"{low} to {high}"


def with_unit(name: str, unit: str) -> str:
    """Return ``A.angle [rad]``; the name alone without a unit, the unit alone without a name."""
    return f"{name} [{unit}]".strip() if unit else name


def json_numbers(values: np.ndarray) -> list:
    """Convert numbers to plain data: a complex one to its real and imaginary part."""
    return values.tolist() if np.isrealobj(values) else [[float(z.real), float(z.imag)] for z in values]
