"""Curves of a result as Matplotlib figures: one axis for each unit, names beside the curves."""

from __future__ import annotations

import os
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..model.body import GROUND
from .drawing import BESIDE, DASHES, PALETTE, handed_out, headed, new_figure, stacked, styled
from .figures import centre, few, figures, hidden, panels, some
from .recording import Channel, Figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Drawing

    from ..results.result import Result


def plot(result: Result, *names: str, path: str | os.PathLike | None = None) -> Any:
    """Plot curves over time; those of equal unit share an axis.

    Parameters
    ----------
    result : Result
    *names : str
        Curves such as ``"slider.x"``, or parts such as ``"slider"`` for all their curves; the energies if none is
        given.
    path : path, optional
        Write a PNG, SVG or PDF file, by the suffix, instead of returning the figure.

    Returns
    -------
    Figure, or None where a file was written.

    Raises
    ------
    ModelError
        If there is no such curve or part, the suffix is of no known kind, or the file cannot be written.
    """
    curves = {c.name: c for name in names or ("energy",) for c in _curves(result, name)}
    with styled():
        drawing = stacked(result, tuple(panels(list(curves.values()), len(curves))))
        headed(drawing, result.model.name)
        return handed_out(drawing, path)


def _curves(result: Result, name: str) -> list[Channel]:
    if "." in name:
        return [Channel(name, *result.channel(name))]
    return [Channel(f"{name}.{k}", unit, values) for k, (unit, values) in result[name].channels().items()]


def standard_plots(result: Result, folder: str | os.PathLike) -> list[Path]:
    """Write the pictures that tell most of a motion, into a folder that is there; returns their paths.

    ``energy``, ``coordinates`` (of joints), ``positions`` (of spatial bodies over time), ``paths`` (of points, seen
    in the plane or from three sides), ``reactions``, ``actuation`` and ``sensors``: those that have something to show.
    """
    folder = Path(folder)
    makers: dict[str, Callable[[], Drawing]] = {f.name: partial(_drawn, result, f) for f in figures(result)}
    if len(result.t):
        makers["paths"] = partial(_paths, result)
    order = ("energy", "coordinates", "positions", "paths", "reactions", "actuation", "sensors")
    written = []
    with styled():
        for name in (k for k in order if k in makers):
            drawing = makers[name]()
            headed(drawing, f"{result.model.name}: {name}")
            written.append(folder / f"{name}.png")
            handed_out(drawing, written[-1])
    return written


def _drawn(result: Result, figure: Figure) -> Drawing:
    """A figure of curves over time; the balance of energies takes less room than they do."""
    ratios = [*([1.6] if len(figure.panels) == 2 else [1.0] * (len(figure.panels) - 1)), 0.8]
    ratios = ratios if figure.name == "energy" else []
    drawing = stacked(result, figure.panels, ratios)
    if figure.note:
        drawing.supxlabel(figure.note, fontsize=8, x=0.012, ha="left")
    return drawing


def _paths(result: Result) -> Drawing:
    """Paths of centres of mass and named frames: in the plane, or from the front, the side and above."""
    bodies = some(result.model.bodies)
    points = {b.name: centre(result, b.name) for b in bodies}
    for frame in result.model.frames if len(points) < 6 else ():
        if frame.body != GROUND:
            p = result[frame.name].position
            points[frame.name] = np.column_stack([p, np.zeros((len(p), 3 - p.shape[1]))])
    note = "; ".join(x for x in (few(len(bodies), len(result.model.bodies), "bodies"), "dots: start") if x)
    every = np.concatenate(list(points.values()))
    extent = np.ptp(every[np.isfinite(every).all(axis=1)], axis=0) if np.isfinite(every).all(axis=1).any() else every[0]
    if result.planar:
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
