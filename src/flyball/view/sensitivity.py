"""Sensitivities as pictures: derivatives over time, or bars for one instant."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any

import numpy as np

from .drawing import BESIDE, PALETTE, handed_out, new_figure, styled, titled

if TYPE_CHECKING:
    from ..results.sensitivity import Sensitivity


def sensitivity(s: Sensitivity, path: str | os.PathLike | None = None) -> Any:
    """One panel a quantity: what a change of each parameter by one percent changes, over time or as bars.

    Parameters that are zero count by their unit.
    """
    percent = np.array([0.01 * abs(s.parameters[p]) or 1.0 for p in s.to])
    with styled():
        drawing = new_figure(0.8 + 2.2 * len(s.of))
        for k, axis in enumerate(drawing.subplots(len(s.of), 1, squeeze=False, sharex=True)[:, 0]):
            _panel(axis, s, k, percent)
            axis.label_outer()
        return handed_out(drawing, path)


def _panel(axis: Any, s: Sensitivity, k: int, percent: np.ndarray) -> None:
    axis.set_title(f"change of {s.of[k]} by one percent more of a parameter")
    axis.set_ylabel(titled("", s.units[k]))
    found = s.derivatives[:, k, :] * percent
    if len(s.t) > 1:
        for i, name in enumerate(s.to):
            axis.plot(s.t, found[:, i].real, color=PALETTE[i % len(PALETTE)], label=name)
        axis.set_xlabel("time [s]")
        axis.legend(**BESIDE)
        return
    parts = [("real part", found[0].real)] if np.isrealobj(found) else []
    parts = parts or [("real part", found[0].real), ("imaginary part", found[0].imag)]
    width = 0.8 / len(parts)
    for i, (label, values) in enumerate(parts):
        axis.bar(
            np.arange(len(s.to)) + (i - (len(parts) - 1) / 2) * width, values, width, color=PALETTE[i], label=label
        )
    axis.axhline(0.0, color="#8a8a8a", linewidth=0.8)
    axis.set_xticks(range(len(s.to)), s.to)
    if len(parts) > 1:
        axis.legend(**BESIDE)
