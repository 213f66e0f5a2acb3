"""Pictures drawn into files."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from .drawing import BESIDE, DASHES, PALETTE, handed_out, headed, new_figure, stacked, styled
from .figures import hidden
from .recording import Figure, Picture, PointPaths

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Drawing


def draw(pictures: Sequence[Picture], folder: Path) -> list[Path]:
    """Write pictures into a folder that is there, as PNG files; returns their paths.

    Raises
    ------
    ModelError
        If a file cannot be written.
    """
    written = [folder / f"{p.name}.png" for p in pictures]
    with styled():
        for picture, path in zip(pictures, written, strict=True):
            shown = picture.shown
            drawing = _over_time(picture, shown) if isinstance(shown, Figure) else _paths(shown)
            headed(drawing, picture.title)
            handed_out(drawing, path)
    return written


def _over_time(picture: Picture, figure: Figure) -> Drawing:
    """A figure of curves over time; the balance of energies takes less room than they do."""
    ratios = [*([1.6] if len(figure.panels) == 2 else [1.0] * (len(figure.panels) - 1)), 0.8]
    drawing = stacked(picture.t, figure.panels, ratios if figure.name == "energy" else [], picture.marks)
    if figure.note:
        drawing.supxlabel(figure.note, fontsize=8, x=0.012, ha="left")
    return drawing


def _paths(paths: PointPaths) -> Drawing:
    """Paths of points: in the plane, or from the front, the side and above."""
    points, note = paths.points, paths.note
    if paths.planar:
        every = np.concatenate(list(points.values()))
        finite = np.isfinite(every).all(axis=1)
        extent = np.ptp(every[finite], axis=0) if finite.any() else every[0]
        ratio = extent[1] / max(extent[0], 1e-12)
        drawing = new_figure(1.0 + 6.0 * min(max(ratio, 0.3), 1.0))
        ax = drawing.subplots()
        _views(ax, points, "xy")
        ax.set_title(note)
        ax.legend(**BESIDE)
        return drawing
    drawing = new_figure(7.2)
    axes = drawing.subplots(2, 2)
    for ax, (seen, across) in zip(axes.flat, (("front", "xz"), ("side", "yz"), ("top", "xy")), strict=False):
        _views(ax, points, across)
        ax.set_title(seen)
    handles, labels = axes[0, 0].get_legend_handles_labels()
    axes[1, 1].axis("off")
    axes[1, 1].legend(handles, labels, loc="upper left", title=note, alignment="left")
    return drawing


def _views(ax: Axes, points: dict[str, np.ndarray], across: str) -> None:
    """Paths seen along one axis, to scale; a path on top of another one is dashed."""
    i, j = ("xyz".index(c) for c in across)
    flat = [p[:, [i, j]].ravel() for p in points.values()]
    for k, ((name, p), under) in enumerate(zip(points.items(), hidden(flat), strict=True)):
        color, style = PALETTE[k % len(PALETTE)], DASHES[max(under, k // len(PALETTE)) % len(DASHES)]
        ax.plot(p[:, i], p[:, j], label=name, color=color, linestyle=style)
        ax.plot(p[0, i], p[0, j], "o", color=color, markersize=4.5)
    ax.set_aspect("equal", adjustable="datalim")
    ax.margins(0.08)
    ax.set_xlabel(f"{across[0]} [m]")
    ax.set_ylabel(f"{across[1]} [m]")
