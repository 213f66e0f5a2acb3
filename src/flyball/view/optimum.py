"""Optimisations as pictures: what the quantities were, are, and should be."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any

import numpy as np

from .drawing import BESIDE, PALETTE, handed_out, headed, new_figure, styled, titled

if TYPE_CHECKING:
    from ..results.optimum import Optimum

LOOKS: dict[str, dict[str, Any]] = {  # what is drawn, in this order
    "start": {"color": "#8a8a8a", "linestyle": (0, (4, 3)), "marker": "o"},
    "target": {"color": PALETTE[1], "linestyle": (0, (1.5, 2)), "marker": "x"},
    "optimum": {"color": PALETTE[0], "linestyle": "-", "marker": "o"},
}


def optimum(found: Optimum, path: str | os.PathLike | None = None) -> Any:
    """One panel a quantity, over time or side by side; eigenvalues in the complex plane. See `Optimum.plot`."""
    parts = {"start": found.start_values, "target": found.target, "optimum": found.values}
    known = {k: v for k, v in parts.items() if v is not None}
    with styled():
        if np.iscomplexobj(found.values):
            drawing = new_figure(4.6)
            _plane(drawing.subplots(), known)
        else:
            drawing = new_figure(0.9 + 2.2 * len(found.of))
            axes = drawing.subplots(len(found.of), 1, squeeze=False, sharex=True)[:, 0]
            for k, ax in enumerate(axes):
                _quantity(ax, found, {name: v[:, k] for name, v in known.items()}, k)
                ax.label_outer()
            axes[0].legend(**BESIDE)
            drawing.align_ylabels(axes)
        headed(drawing, "optimum: " + ", ".join(f"{k} = {v:.6g}" for k, v in list(found.parameters.items())[:4]))
        return handed_out(drawing, path)


def _quantity(ax: Any, found: Optimum, values: dict[str, np.ndarray], k: int) -> None:
    ax.set_title(found.of[k])
    ax.set_ylabel(titled("", found.units[k]))
    for i, (name, v) in enumerate(values.items()):
        if len(found.t) > 1:
            ax.plot(found.t, v, label=name, **{k: x for k, x in LOOKS[name].items() if k != "marker"})
            ax.set_xlabel("time [s]")
        else:
            ax.plot([i], v, label=name, **LOOKS[name] | {"linestyle": "none"})
    if len(found.t) == 1:
        ax.set_xticks(range(len(values)), list(values))
        ax.margins(0.3)


def _plane(ax: Any, values: dict[str, np.ndarray]) -> None:
    for name, v in values.items():
        ax.plot(v.ravel().real, v.ravel().imag, label=name, **LOOKS[name] | {"linestyle": "none"})
    ax.axvline(0.0, color="#8a8a8a", linewidth=0.8)
    ax.set_xlabel("real part [1/s]")
    ax.set_ylabel("imaginary part [rad/s]")
    ax.legend(**BESIDE)
