"""Plots that compare formulations of the same motion: drift and energy over time, and cost."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any

import numpy as np

from .plotting import DASH_STYLES, PALETTE, finish_figure, new_figure, plot_style, set_title

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ..results.comparison import Comparison

SMALLEST_SHOWN = 1e-18  # value drawn for a violation of zero


def comparison_plot(comparison: Comparison, path: str | os.PathLike | None = None) -> Any:
    """Draw violations of positions and velocities and the energy deviation over time (logarithmic), and cost as bars.

    Parameters
    ----------
    comparison : Comparison
    path : path, optional
        Write a PNG, SVG or PDF file, by the suffix, instead of returning the figure.

    Returns
    -------
    Figure, or None where a file was written.

    Raises
    ------
    ModelError
        If the file cannot be written.
    """
    with plot_style():
        drawing = new_figure(8.4, 11.0)
        axes = drawing.subplots(2, 2)
        _plot_deviation(axes[0, 0], comparison, "g", "|g| [m, rad]")
        _plot_deviation(axes[0, 1], comparison, "gv", "|G v - ν| [m/s, rad/s]")
        _plot_deviation(axes[1, 0], comparison, "balance", "energy, deviation [J]")
        _plot_costs(axes[1, 1], comparison)
        handles, labels = axes[0, 0].get_legend_handles_labels()
        drawing.legend(handles, labels, loc="outside lower center", ncols=5)
        set_title(drawing, f"{comparison.model}: formulations compared")
        return finish_figure(drawing, path)


def _curve_style(k: int) -> dict[str, Any]:
    return {"color": PALETTE[k % len(PALETTE)], "linestyle": DASH_STYLES[k // len(PALETTE) % len(DASH_STYLES)]}


def _plot_deviation(ax: Axes, comparison: Comparison, what: str, label: str) -> None:
    for k, f in enumerate(comparison):
        y = np.maximum(np.abs(getattr(f, what)), SMALLEST_SHOWN)
        single = "o" if len(f.t) == 1 else None
        ax.plot(f.t, y, label=f.name, linewidth=1.3, alpha=0.9, marker=single, **_curve_style(k))
        if len(f.t) and not f.success:
            ax.plot(f.t[-1], y[-1], "x", color=PALETTE[k % len(PALETTE)], markersize=9, markeredgewidth=2.2)
    ax.set_yscale("log")
    ax.set_ylim(bottom=SMALLEST_SHOWN)
    ax.margins(x=0.0)
    ax.set_xlabel("time [s]")
    ax.set_ylabel(label)
    if any(not f.success for f in comparison):
        ax.set_title("cross: it went no further")


def _plot_costs(ax: Axes, comparison: Comparison) -> None:
    timed = any(np.isfinite(f.cpu) for f in comparison)
    values = [1e3 * f.cpu if timed else float(f.evaluations) for f in comparison]
    places = np.arange(len(values))
    colors = [PALETTE[k % len(PALETTE)] for k in places]
    hatches = ["//" if k >= len(PALETTE) else "" for k in places]  # dashed in the curves
    ax.barh(places, np.nan_to_num(values), color=colors, hatch=hatches, edgecolor="white", linewidth=0.0, height=0.7)
    for k, x in enumerate(values):
        text = f" {x:.3g}" if np.isfinite(x) else " failed"
        ax.text(np.nan_to_num(x), k, text, va="center", fontsize=9, color="#333333")
    ax.set_yticks(places, [f.name for f in comparison])
    ax.invert_yaxis()
    ax.grid(axis="y", visible=False)
    ax.margins(x=0.12)
    ax.set_xlim(left=0.0)
    ax.set_xlabel("time of the processor [ms]" if timed else "evaluations")
