"""Axes and colours over values that are spread in logarithms: a stiffness of 1e3, 1e4, 1e5."""

from __future__ import annotations

from typing import Any

import numpy as np

WIDE = 10.0  # the largest over the least of what may need a logarithmic axis
FINE = 1.0001  # a colour scale has to have a length, even where all is alike


def logarithmic(values: np.ndarray, wide: float = WIDE) -> bool:
    """Whether values lie more evenly by their logarithms: their median, beside the middle of the least and largest."""
    known = np.unique(values[np.isfinite(values)])
    if len(known) < 3 or known[0] <= 0.0 or known[-1] < wide * known[0]:
        return False
    logs = np.log(known)
    plain, by_log = ((np.median(v) - v[0]) / (v[-1] - v[0]) for v in (known, logs))
    return bool(abs(by_log - 0.5) < abs(plain - 0.5))


def scale(ax: Any, axis: str, values: np.ndarray, wide: float = WIDE) -> None:
    """Make an axis logarithmic where that shows these values more evenly."""
    if logarithmic(values, wide):
        getattr(ax, f"set_{axis}scale")("log")


def shades(values: np.ndarray, wide: float = WIDE) -> Any:
    """What turns values into parts of a colour map: linear, or by logarithms."""
    from matplotlib.colors import LogNorm, Normalize

    low, high = float(np.nanmin(values)), float(np.nanmax(values))
    if logarithmic(values, wide):
        return LogNorm(low, high)
    return Normalize(low, high if high > low else low + (abs(low) or 1.0) * (FINE - 1.0))
