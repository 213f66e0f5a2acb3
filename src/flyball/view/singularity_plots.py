"""Plots of singular positions: the mechanism in each of them, and the curve that they lie on."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import ModelError
from ..model.body import GROUND
from ..model.messages import listing, suggest
from ..results.wording import BIFURCATION, LOCK_UP, PASSAGE, SELF_MOTION
from .plotting import PALETTE, axis_label, finish_figure, new_figure, plot_style, set_title

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ..results.singularities import Singularities, Singularity

KIND_MARKS = {
    PASSAGE: ("o", PALETTE[2]),
    LOCK_UP: ("s", PALETTE[1]),
    BIFURCATION: ("D", PALETTE[0]),
    SELF_MOTION: ("^", PALETTE[3]),
}
MAX_SKETCHES = 12  # number of pictures
SKETCHES_PER_ROW = 4
ISOMETRIC_PROJECTION = np.array([[-0.7071, 0.7071, 0.0], [-0.4082, -0.4082, 0.8165]])


def singularity_plot(
    result: Singularities, path: str | os.PathLike | None = None, coordinate: str | None = None
) -> Any:
    """Draw the singular positions, a coordinate over the driver's, and the distance from singularity.

    Parameters
    ----------
    result : Singularities
    path : path, optional
        Write a PNG, SVG or PDF file, by the suffix, instead of returning the figure.
    coordinate : str, optional
        Coordinate drawn over the driver's; by default the joint coordinate that moves most.

    Returns
    -------
    Figure, or None where a file was written.

    Raises
    ------
    ModelError
        If there is no such coordinate, or the file cannot be written.
    """
    name = _most_moving_coordinate(result) if coordinate is None else coordinate
    if name not in result.values:
        raise ModelError(
            f"{result.model!r} has no coordinate {name!r}{suggest(name, result.values)}; {listing(list(result.values))}"
        )
    shown = result.points[:MAX_SKETCHES]
    rows = -(-len(shown) // SKETCHES_PER_ROW)
    with plot_style():
        drawing = new_figure(3.4 + 2.1 * rows, 9.0)
        grid = drawing.add_gridspec(rows + 1, 2 * SKETCHES_PER_ROW, height_ratios=[1.0] * rows + [1.5])
        for k, p in enumerate(shown):
            ax = drawing.add_subplot(
                grid[k // SKETCHES_PER_ROW, 2 * (k % SKETCHES_PER_ROW) : 2 * (k % SKETCHES_PER_ROW) + 2]
            )
            plot_sketch(ax, p, result.planar)
            ax.set_title(f"{k + 1}: {p.kind}\na = {_short_value(p.a, result.unit)}", color=KIND_MARKS[p.kind][1])
        _plot_over_driver(drawing.add_subplot(grid[rows, :SKETCHES_PER_ROW]), result, name)
        _plot_distance(drawing.add_subplot(grid[rows, SKETCHES_PER_ROW:]), result)
        more = f" (first {MAX_SKETCHES} of {len(result.points)})" if len(result.points) > MAX_SKETCHES else ""
        set_title(drawing, f"{result.model}: singular positions over {result.coordinate}{more}")
        return finish_figure(drawing, path)


def plot_sketch(ax: Axes, p: Singularity, planar: bool = True) -> None:
    """Draw bodies as lines between joints, joints as circles, ground as triangles, guides dotted."""
    names = list(dict.fromkeys(body for body, _, _ in p.outline))
    colors = {b: PALETTE[k % len(PALETTE)] for k, b in enumerate(n for n in names if n != GROUND)}
    seen: dict[str, dict[str, np.ndarray]] = {}
    for body, joint, point in p.outline:
        seen.setdefault(body, {})[joint] = point[:2] if planar else ISOMETRIC_PROJECTION @ point
    for k, (body, points) in enumerate(seen.items()):
        P = np.array(list(points.values()))
        if body == GROUND:
            ax.plot(P[:, 0], P[:, 1], "^", color="#8a8a8a", markersize=9, zorder=1)
        elif np.ptp(P, axis=0).max() < 1e-9:
            ax.plot(P[:1, 0], P[:1, 1], "s", color=colors[body], markersize=9, alpha=0.5, zorder=1)
        else:
            P = P if len(P) < 3 else np.vstack([P, P[:1]])
            width = 6.0 if k % 2 else 3.0  # coincident bars remain visible
            ax.plot(P[:, 0], P[:, 1], color=colors[body], linewidth=width, alpha=0.6, solid_capstyle="round", zorder=2)
    for joint in dict.fromkeys(j for _, j, _ in p.outline):  # a slider is connected to its guide
        ends = np.array([points[joint] for points in seen.values() if joint in points])
        if np.ptp(ends, axis=0).max() > 1e-6:
            ax.plot(ends[:, 0], ends[:, 1], ":", color="#555555", linewidth=1.2, zorder=1)
    every = np.array([q for points in seen.values() for q in points.values()])
    ax.plot(every[:, 0], every[:, 1], "o", color="white", markeredgecolor="#333333", markersize=4.5, zorder=3)
    ax.set_aspect("equal", adjustable="datalim")
    ax.margins(0.15)
    ax.set_xticks([])
    ax.set_yticks([])
    ax.grid(False)
    for side in ax.spines.values():
        side.set_visible(False)


def _most_moving_coordinate(result: Singularities) -> str:
    """Return the joint or body coordinate that moves most; angles first."""
    spread = {
        k: (float(np.ptp(v)) if len(v) else 0.0) * (1.0 if "angle" in k else 0.1)
        for k, v in result.values.items()
        if k != result.coordinate
    }
    values = result.values.get(result.coordinate)
    for k, v in result.values.items():
        if (
            k in spread
            and values is not None
            and len(v)
            and np.ptp(np.abs(v - v[0]) - np.abs(values - values[0])) < 1e-9
        ):
            spread[k] = 0.0  # duplicate of another coordinate
    return max(spread, key=lambda k: round(spread[k], 9)) if spread else result.coordinate


def _plot_over_driver(ax: Axes, result: Singularities, name: str) -> None:
    unit = "rad" if "angle" in name else "m"
    ax.plot(result.a, result.values[name], color=PALETTE[6], linewidth=1.2)
    for k, p in enumerate(result.points):
        mark, color = KIND_MARKS[p.kind]
        y = result.values[name][int(np.argmin(np.abs(result.s - p.at)))]
        ax.plot(p.a, y, mark, color=color, markersize=6)
        ax.annotate(f"{k + 1}", (p.a, y), textcoords="offset points", xytext=(5, 5), fontsize=8)
    ax.set_xlabel(axis_label(result.coordinate, result.unit))
    ax.set_ylabel(axis_label(name, unit))


def _plot_distance(ax: Axes, result: Singularities) -> None:
    ax.plot(result.s, result.distance, color=PALETTE[6], linewidth=1.2)
    for p in result.points:
        mark, color = KIND_MARKS[p.kind]
        ax.plot(p.at, 0.0, mark, color=color, markersize=6, clip_on=False)
    ax.set_xlabel("arc length [1]")
    ax.set_ylabel("smallest singular value [1]")
    ax.set_ylim(bottom=0.0)


def _short_value(a: float, unit: str) -> str:
    a = 0.0 if abs(a) < 1e-9 else a
    return f"{np.degrees(a):.5g}°" if unit == "rad" else f"{a:.5g} {unit}"
