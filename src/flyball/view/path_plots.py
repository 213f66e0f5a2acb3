"""Plots of paths of points with their velocities, and of the mechanism in some of its positions."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import ModelError
from ..model.body import GROUND, Body, Frame
from .body_shapes import BodyShapes
from .plotting import LEGEND_BESIDE, PALETTE, finish_figure, new_figure, plot_style, set_title
from .symbols import AttachedFrames

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ..results.result import Result

PointRequest = str | tuple[str, Sequence[float]]
LONGEST_ARROW = 0.16  # length of the longest arrow, relative to the picture
ARROW_UNITS = {"velocity": "m/s", "acceleration": "m/s²"}
ARROW_PLURALS = {"velocity": "velocities", "acceleration": "accelerations"}
LINK_COLOR, FILL_COLOR = "#5a6b7b", "#9aa5b1"


def plot_path(
    result: Result,
    *points: PointRequest,
    arrows: str | None = "velocity",
    number: int = 24,
    positions: int = 4,
    path: str | os.PathLike | None = None,
) -> Any:
    """Draw the paths of points with arrows for their velocities, and the mechanism in some of its positions.

    In the plane to scale; in space seen from the front, from the side and from above.

    Parameters
    ----------
    result : Result
    *points : str or (str, vector)
        Bodies and frames (their origins), or a body and a point in its reference frame [m]. Default: the frames on
        moving bodies, or else the bodies.
    arrows : ``"velocity"``, ``"acceleration"`` or None
    number : int
        Number of arrows on each path, evenly spaced in time.
    positions : int
        Number of drawn positions of the mechanism, the first one darkest; 0 for none.
    path : path, optional
        Write a PNG, SVG or PDF file, by the suffix, instead of returning the figure.

    Returns
    -------
    Figure, or None where a file was written.

    Raises
    ------
    ModelError
        If there is no such point, it does not move, or the file cannot be written.
    """
    if arrows is not None and arrows not in ARROW_UNITS:
        raise ModelError(f"arrows must be 'velocity', 'acceleration' or None, not {arrows!r}")
    if not len(result.t):
        raise ModelError(f"the result of {result.model.name!r} has no times: there is nothing to plot")
    tracks = {name: record for p in points or _default_points(result) for name, record in [_point_motion(result, p)]}
    links = _mechanism_positions(result, points, positions)
    with plot_style():
        drawing = _path_figure(result, tracks, links, arrows, number)
        set_title(drawing, f"{result.model.name}: {f'paths and {ARROW_PLURALS[arrows]}' if arrows else 'paths'}")
        return finish_figure(drawing, path)


def _path_figure(result: Result, tracks: dict, links: list, arrows: str | None, number: int) -> Any:
    """Return one view of planar paths, three of spatial ones."""
    if result.planar:
        every = np.concatenate([t[0] for t in tracks.values()] + [x for _, shapes in links for x in shapes])
        extent = np.ptp(every[np.isfinite(every).all(axis=1)], axis=0)
        drawing = new_figure(1.0 + 6.0 * min(max(extent[1] / max(extent[0], 1e-12), 0.4), 1.1))
        ax = drawing.subplots()
        _plot_projection(ax, "xy", tracks, links, arrows, number)
        ax.legend(**LEGEND_BESIDE, **_legend_title(tracks, arrows))
        return drawing
    drawing = new_figure(7.2)
    axes = drawing.subplots(2, 2)
    for ax, (view, across) in zip(axes.flat, (("front", "xz"), ("side", "yz"), ("top", "xy")), strict=False):
        _plot_projection(ax, across, tracks, links, arrows, number)
        ax.set_title(view)
    handles, labels = axes[0, 0].get_legend_handles_labels()
    axes[1, 1].axis("off")
    axes[1, 1].legend(handles, labels, loc="upper left", **_legend_title(tracks, arrows))
    return drawing


def _default_points(result: Result) -> Sequence[PointRequest]:
    """Return the default points."""
    frames = [f.name for f in result.model.frames if f.body != GROUND]
    return (frames or [b.name for b in result.model.bodies])[: len(PALETTE)]


def _point_motion(result: Result, point: PointRequest) -> tuple[str, tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Return label, and position, velocity and acceleration (n, 3) of a point."""
    if isinstance(point, str):
        e = result.model[point]
        if not isinstance(e, (Body, Frame)):
            raise ModelError(f"{e.title} has no path; name a body, a frame, or a body and a point in it")
        if isinstance(e, Frame) and e.body == GROUND:
            raise ModelError(f"{e.title} is fixed on ground and has no path")
        record, name = result.records.named(point), point
    else:
        body, local = point
        e = result.model[body]
        if not isinstance(e, Body):
            raise ModelError(f"{e.title} is no body; give a body and a point in its reference frame")
        if len(local) != (2 if result.planar else 3):
            raise ModelError(f"the point {tuple(local)} of {e.title} needs {2 if result.planar else 3} components")
        p = np.zeros(3)
        p[: len(local)] = local
        x = result.values
        offset = tuple((p - x.bodies[body].com.real).tolist())
        record = result.records.attached(x.structure.place[body], offset, tuple(np.eye(3).ravel()))
        name = f"{body} ({', '.join(f'{c:g}' for c in local)})"
    full = [np.stack([np.broadcast_to(c, len(result.t)) for c in record[k]], axis=1) for k in (0, 3, 5)]
    return name, (full[0], full[1], full[2])


def _mechanism_positions(
    result: Result, points: Sequence[PointRequest], positions: int
) -> list[tuple[float, list[np.ndarray]]]:
    """Return bodies at some times as their points on joints and paths: [(fading, shapes (k, 3))]."""
    if positions < 1:
        return []
    places = AttachedFrames(result)
    looks = BodyShapes(result, places)
    for p in points:
        if not isinstance(p, str):
            looks.points[p[0]].append(np.r_[np.asarray(p[1], float), np.zeros(3 - len(p[1]))])
        elif isinstance(e := result.model[p], Frame) and e.body != GROUND:
            b = result.values.bodies[e.body]
            looks.points[e.body].append(b.R.T @ (result.values.poses.named(p)[0] - b.p).real)
    steps = np.unique(np.linspace(0, len(result.t) - 1, positions + (positions > 1)).astype(int))[:positions]
    out = []
    for faint, k in enumerate(steps.tolist()):
        shapes = []
        for body in result.model.bodies:
            view = result[body.name]
            origin = np.r_[view.position[k], np.zeros(3 - len(view.position[k]))]
            local = looks.points[body.name] or [np.zeros(3)]
            shapes.append(np.array([origin + view.rotation[k] @ p for p in local]))
        out.append((1.0 if faint == 0 else 0.35, shapes))
    return out


def _plot_projection(ax: Axes, across: str, tracks: dict, links: list, arrows: str | None, number: int) -> None:
    """One view, to scale."""
    i, j = ("xyz".index(c) for c in across)
    for strength, shapes in reversed(links):
        for shape in shapes:
            flat = _outline_points(shape[:, [i, j]])
            if len(flat) > 2:
                ax.fill(flat[:, 0], flat[:, 1], color=FILL_COLOR, alpha=0.18 * strength, lw=0, zorder=1)
            ax.plot(*np.vstack([flat, flat[:1]]).T, color=LINK_COLOR, alpha=strength, lw=2.2, zorder=2,
                    solid_capstyle="round")  # fmt: skip
            ax.plot(*shape[:, [i, j]].T, "o", ms=4.5, mfc="white", mec=LINK_COLOR, alpha=strength, zorder=3)
    for k, (name, (p, *_)) in enumerate(tracks.items()):
        color = PALETTE[k % len(PALETTE)]
        ax.plot(p[:, i], p[:, j], color=color, label=name, zorder=4)
        ax.plot(p[0, i], p[0, j], "o", color=color, ms=5, zorder=5)
    ax.set_aspect("equal", adjustable="datalim")
    ax.margins(0.12)
    ax.set_xlabel(f"{across[0]} [m]")
    ax.set_ylabel(f"{across[1]} [m]")
    if arrows is not None:
        _plot_arrows(ax, (i, j), tracks, arrows, number)


def _plot_arrows(ax: Axes, across: tuple[int, int], tracks: dict, arrows: str, number: int) -> None:
    """Draw arrows along the paths, all of one scale, with a key."""
    i, j = across
    which = 1 if arrows == "velocity" else 2
    largest = _largest_vector(tracks, arrows)
    if not largest > 0.0:
        return
    every = np.concatenate([t[0][:, [i, j]] for t in tracks.values()])
    size = max(float(ax.dataLim.width), float(ax.dataLim.height), float(np.ptp(every, axis=0).max()), 1e-12)
    scale = largest / (LONGEST_ARROW * size)
    for k, (p, *more) in enumerate(tracks.values()):
        u = more[which - 1]
        at = np.unique(np.linspace(0, len(p) - 1, number).astype(int))
        ax.quiver(p[at, i], p[at, j], u[at, i], u[at, j], angles="xy", scale_units="xy", scale=scale,
                          color=PALETTE[k % len(PALETTE)], width=0.0032, zorder=6, alpha=0.8)  # fmt: skip
    tips = np.concatenate([t[0][:, [i, j]] + t[which][:, [i, j]] / scale for t in tracks.values()])
    ax.update_datalim(tips[np.isfinite(tips).all(axis=1)])
    ax.autoscale_view()


def _largest_vector(tracks: dict, arrows: str) -> float:
    which = 1 if arrows == "velocity" else 2
    return max(float(np.nanmax(np.linalg.norm(t[which], axis=1), initial=0.0)) for t in tracks.values())


def _legend_title(tracks: dict, arrows: str | None) -> dict[str, Any]:
    """Return the title of the legend, with the scale of arrows."""
    if arrows is None:
        return {}
    text = f"arrows: {arrows}, at most\n{_largest_vector(tracks, arrows):.3g} {ARROW_UNITS[arrows]}"
    return {"title": text, "alignment": "left"}


def _outline_points(points: np.ndarray) -> np.ndarray:
    """Return the corners of the convex hull of points in a plane: a polygon, or the ends of a line."""
    if len(points) < 3:
        return points
    d = points - points.mean(axis=0)
    _, sizes, axes = np.linalg.svd(d, full_matrices=False)
    if sizes[1] < 1e-6 * max(sizes[0], 1e-300):
        along = d @ axes[0]
        return points[[int(np.argmin(along)), int(np.argmax(along))]]
    from scipy.spatial import ConvexHull

    return points[ConvexHull(points).vertices]
