"""Warnings on tyres that left the ranges for which their models are valid."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from .result import Result


def tyre_warnings(result: Result) -> list[str]:
    """Return warnings on tyres beyond the ranges of their files."""
    forces: list[Any] = result.values.structure.forces
    found = []
    for e in (x for x in forces if hasattr(x, "model")):
        curves = result[e.name]
        load = curves.load
        for what, (low, high) in e.model.limits(result.values.numbers[e.name].tyre).items():
            x = np.where(load > 0.0, getattr(curves, what), 0.5 * (low + high))  # in the air nothing matters
            beyond = np.maximum(low - x, x - high)
            k = int(np.argmax(beyond))
            if beyond[k] > 0.0:
                found.append(
                    f"{e.title}: {what} is {x[k]:.4g} at t = {result.t[k]:.6g} s, beyond the range {low:g} to {high:g} "
                    f"for which {e.model.title} was measured: its forces are extrapolated there"
                )
    return found
