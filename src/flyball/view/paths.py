"""Paths of points with their velocities, and the mechanism that draws them in some of its positions."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import ModelError
from ..model.body import GROUND, Body, Frame
from .drawing import BESIDE, PALETTE, handed_out, headed, new_figure, styled
from .looks import Looks
from .places import Places

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ..results.result import Result

Point = str | tuple[str, Sequence[float]]
LONGEST = 0.16  # the longest arrow, as part of the picture
ARROWS = {"velocity": "m/s", "acceleration": "m/s²"}
PLURAL = {"velocity": "velocities", "acceleration": "accelerations"}
LINK, FRAME = "#5a6b7b", "#9aa5b1"


def plot_path(
    result: Result,
    *points: Point,
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
        Bodies and frames, whose origin is meant, or a body and a point in its reference frame [m]. Without any, the
        frames on moving bodies are taken; without those, the bodies.
    arrows : ``"velocity"``, ``"acceleration"`` or None
    number : int
        Arrows on each path, evenly spaced in time.
    positions : int
        Positions of the mechanism that are drawn, the first one darkest; 0 for none.
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
    if arrows is not None and arrows not in ARROWS:
        raise ModelError(f"arrows must be 'velocity', 'acceleration' or None, not {arrows!r}")
    if not len(result.t):
        raise ModelError(f"the result of {result.model.name!r} has no times: there is nothing to draw")
    tracks = {name: record for p in points or _usual(result) for name, record in [_track(result, p)]}
    links = _links(result, points, positions)
    with styled():
        drawing = _laid_out(result, tracks, links, arrows, number)
        headed(drawing, f"{result.model.name}: {f'paths and {PLURAL[arrows]}' if arrows else 'paths'}")
        return handed_out(drawing, path)


def _laid_out(result: Result, tracks: dict, links: list, arrows: str | None, number: int) -> Any:
    """One view of what lies in the plane, three of what does not."""
    if result.planar:
        every = np.concatenate([t[0] for t in tracks.values()] + [x for _, shapes in links for x in shapes])
        extent = np.ptp(every[np.isfinite(every).all(axis=1)], axis=0)
        drawing = new_figure(1.0 + 6.0 * min(max(extent[1] / max(extent[0], 1e-12), 0.4), 1.1))
        ax = drawing.subplots()
        _seen(ax, "xy", tracks, links, arrows, number)
        ax.legend(**BESIDE, **_key(tracks, arrows))
        return drawing
    drawing = new_figure(7.2)
    axes = drawing.subplots(2, 2)
    for ax, (view, across) in zip(axes.flat, (("front", "xz"), ("side", "yz"), ("top", "xy")), strict=False):
        _seen(ax, across, tracks, links, arrows, number)
        ax.set_title(view)
    handles, labels = axes[0, 0].get_legend_handles_labels()
    axes[1, 1].axis("off")
    axes[1, 1].legend(handles, labels, loc="upper left", **_key(tracks, arrows))
    return drawing


def _usual(result: Result) -> Sequence[Point]:
    """What is drawn if nobody says."""
    frames = [f.name for f in result.model.frames if f.body != GROUND]
    return (frames or [b.name for b in result.model.bodies])[: len(PALETTE)]


def _track(result: Result, point: Point) -> tuple[str, tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Label, and position, velocity and acceleration (n, 3) of a point."""
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
        record = result.records.carried(x.structure.place[body], offset, tuple(np.eye(3).ravel()))
        name = f"{body} ({', '.join(f'{c:g}' for c in local)})"
    full = [np.stack([np.broadcast_to(c, len(result.t)) for c in record[k]], axis=1) for k in (0, 3, 5)]
    return name, (full[0], full[1], full[2])


def _links(result: Result, points: Sequence[Point], positions: int) -> list[tuple[float, list[np.ndarray]]]:
    """Bodies at some times as the points that joints and paths have on them: [(how faint, shapes (k, 3))]."""
    if positions < 1:
        return []
    places = Places(result)
    looks = Looks(result, places)
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


def _seen(ax: Axes, across: str, tracks: dict, links: list, arrows: str | None, number: int) -> None:
    """One view, to scale."""
    i, j = ("xyz".index(c) for c in across)
    for strength, shapes in reversed(links):
        for shape in shapes:
            flat = _outline(shape[:, [i, j]])
            if len(flat) > 2:
                ax.fill(flat[:, 0], flat[:, 1], color=FRAME, alpha=0.18 * strength, lw=0, zorder=1)
            ax.plot(*np.vstack([flat, flat[:1]]).T, color=LINK, alpha=strength, lw=2.2, zorder=2,
                    solid_capstyle="round")  # fmt: skip
            ax.plot(*shape[:, [i, j]].T, "o", ms=4.5, mfc="white", mec=LINK, alpha=strength, zorder=3)
    for k, (name, (p, *_)) in enumerate(tracks.items()):
        color = PALETTE[k % len(PALETTE)]
        ax.plot(p[:, i], p[:, j], color=color, label=name, zorder=4)
        ax.plot(p[0, i], p[0, j], "o", color=color, ms=5, zorder=5)
    ax.set_aspect("equal", adjustable="datalim")
    ax.margins(0.12)
    ax.set_xlabel(f"{across[0]} [m]")
    ax.set_ylabel(f"{across[1]} [m]")
    if arrows is not None:
        _arrows(ax, (i, j), tracks, arrows, number)


def _arrows(ax: Axes, across: tuple[int, int], tracks: dict, arrows: str, number: int) -> None:
    """Arrows along the paths, all of one scale, which a key says."""
    i, j = across
    which = 1 if arrows == "velocity" else 2
    largest = _largest(tracks, arrows)
    if not largest > 0.0:
        return
    every = np.concatenate([t[0][:, [i, j]] for t in tracks.values()])
    size = max(float(ax.dataLim.width), float(ax.dataLim.height), float(np.ptp(every, axis=0).max()), 1e-12)
    scale = largest / (LONGEST * size)
    for k, (p, *more) in enumerate(tracks.values()):
        u = more[which - 1]
        at = np.unique(np.linspace(0, len(p) - 1, number).astype(int))
        ax.quiver(p[at, i], p[at, j], u[at, i], u[at, j], angles="xy", scale_units="xy", scale=scale,
                          color=PALETTE[k % len(PALETTE)], width=0.0032, zorder=6, alpha=0.8)  # fmt: skip
    tips = np.concatenate([t[0][:, [i, j]] + t[which][:, [i, j]] / scale for t in tracks.values()])
    ax.update_datalim(tips[np.isfinite(tips).all(axis=1)])
    ax.autoscale_view()


def _largest(tracks: dict, arrows: str) -> float:
    which = 1 if arrows == "velocity" else 2
    return max(float(np.nanmax(np.linalg.norm(t[which], axis=1), initial=0.0)) for t in tracks.values())


def _key(tracks: dict, arrows: str | None) -> dict[str, Any]:
    """Heading of the legend: how long arrows are."""
    if arrows is None:
        return {}
    text = f"arrows: {arrows}, at most\n{_largest(tracks, arrows):.3g} {ARROWS[arrows]}"
    return {"title": text, "alignment": "left"}


def _outline(points: np.ndarray) -> np.ndarray:
    """The corners of what points span in a plane: a polygon, or the ends of a line."""
    if len(points) < 3:
        return points
    d = points - points.mean(axis=0)
    _, sizes, axes = np.linalg.svd(d, full_matrices=False)
    if sizes[1] < 1e-6 * max(sizes[0], 1e-300):
        along = d @ axes[0]
        return points[[int(np.argmin(along)), int(np.argmax(along))]]
    from scipy.spatial import ConvexHull

    return points[ConvexHull(points).vertices]
