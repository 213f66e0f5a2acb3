"""Poles and zeros of a linear model in the complex plane."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any

import numpy as np

from .drawing import BESIDE, PALETTE, handed_out, headed, new_figure, styled
from .linear import framed, plane

if TYPE_CHECKING:
    from ..results.linear import LinearModel

MOST = 24  # numbers that can be read beside the marks


def poles(model: LinearModel, path: str | os.PathLike | None = None) -> Any:
    """Eigenvalues as crosses, of a single input and output its zeros as rings; see `LinearModel.plot`."""
    w, zeros = model.eigenvalues, np.zeros(0, complex)
    if len(model.inputs) == len(model.outputs) == 1:
        zeros = model.transfer()[0]
    with styled():
        picture = new_figure(5.4)
        ax = picture.subplots()
        framed(ax, np.r_[w, w.conj(), zeros])
        once, count = np.unique(w, return_counts=True)
        ax.plot(w.real, w.imag, "x", color=PALETTE[0], markersize=9, markeredgewidth=1.8, label="eigenvalues", zorder=4)
        if len(zeros):
            ring: dict[str, Any] = {"markerfacecolor": "none", "markeredgecolor": PALETTE[2], "markersize": 9}
            ax.plot(zeros.real, zeros.imag, "o", label=f"zeros of {model.outputs[0]} by {model.inputs[0]}", **ring)
        for at, n in list(zip(once, count, strict=True))[:MOST]:
            if n > 1:
                ax.annotate(f"{n}-fold", (at.real, at.imag), (8, 6), textcoords="offset points", fontsize=9)
        if len(w):
            ax.legend(**BESIDE)
        plane(ax)
        headed(picture, f"{model.name}: linear model" + (f", seen from {model.seen_from}" if model.seen_from else ""))
        return handed_out(picture, path)
