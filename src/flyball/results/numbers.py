"""Numbers in the texts of results: what is only rounding beside its own kind is written as 0."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

NOTHING = 1e-10  # part of the size of its kind below which a number is what rounding, or an iteration, left


def clean(values: Any, size: float | None = None) -> np.ndarray:
    """The values, with 0 for those that are nothing beside ``size`` (the largest of them, if not given)."""
    a = np.asarray(values)
    known = np.abs(a[np.isfinite(a)])
    size = float(known.max(initial=0.0)) if size is None else size
    with np.errstate(invalid="ignore"):
        return np.where(np.abs(a) <= NOTHING * size, 0.0, a) + 0.0


def number(x: float, size: float | None = None, digits: int = 6) -> str:
    """One number, or 0 where it is nothing beside ``size``."""
    return f"{float(clean([x], size)[0]):.{digits}g}"


def tuple_of(values: Sequence[float] | np.ndarray, digits: int = 4, size: float | None = None) -> str:
    """Components of a vector: ``(0, 0, 6.283)``."""
    return f"({', '.join(f'{x:.{digits}g}' for x in clean(values, size).tolist())})"


def span(values: np.ndarray, digits: int = 4, size: float | None = None) -> str:
    """From the least to the largest of a series, those that are not a number left out; one number if it is constant."""
    a = clean(values, size)
    low, high = (f"{f(a):.{digits}g}" for f in (np.nanmin, np.nanmax))
    return low if low == high else f"{low} to {high}"


def with_unit(name: str, unit: str) -> str:
    """``A.angle [rad]``; the name alone of what has no unit, the unit alone where the name stands elsewhere."""
    return f"{name} [{unit}]".strip() if unit else name


def plain(values: np.ndarray) -> list:
    """Numbers as plain data: a complex one as its real and imaginary part."""
    return values.tolist() if np.isrealobj(values) else [[float(z.real), float(z.imag)] for z in values]
