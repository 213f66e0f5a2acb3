"""Curves of a result as Matplotlib figures: one axis for each unit, names beside the curves."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import ModelError
from ..model.body import GROUND
from .figures import centre, few, figures, hidden, panels, some
from .recording import Channel, Figure, Panel
from .writing import cannot

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Drawing

    from ..results.result import Result

# Okabe and Ito's palette, which people with any colour vision can tell apart, darkest first.
PALETTE = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#56B4E9", "#E69F00", "#4D4D4D", "#B8A800")
DASHES: tuple[Any, ...] = ("-", (0, (4, 4)), (0, (1.5, 3)), (0, (6, 2, 1.5, 2)))
STYLE: dict[str, Any] = {
    "figure.dpi": 100,
    "savefig.dpi": 150,
    "figure.facecolor": "white",
    "font.size": 10,
    "axes.titlesize": 9,
    "axes.titlelocation": "left",
    "axes.titlecolor": "#555555",
    "axes.labelcolor": "#333333",
    "axes.edgecolor": "#8a8a8a",
    "axes.linewidth": 0.8,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": "#e4e4e4",
    "grid.linewidth": 0.7,
    "xtick.color": "#555555",
    "ytick.color": "#555555",
    "lines.linewidth": 1.6,
    "lines.solid_joinstyle": "round",
    "legend.frameon": False,
    "legend.fontsize": 9,
    "legend.handlelength": 2.0,
    "axes.formatter.useoffset": False,
    "axes.formatter.limits": (-3, 5),
    "axes.formatter.use_mathtext": True,
    "svg.hashsalt": "flyball",
}
SUFFIXES = (".png", ".svg", ".pdf")
PRETTY = {"N*m": "N m", "m/s^2": "m/s²", "rad/s^2": "rad/s²", "1": "-"}
BESIDE: dict[str, Any] = {"loc": "upper left", "bbox_to_anchor": (1.0, 1.04), "borderaxespad": 0.4}


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
    with _drawing():
        drawing = _stacked(result, tuple(panels(list(curves.values()), len(curves))))
        _headed(drawing, result.model.name)
        return _handed_out(drawing, path)


def _curves(result: Result, name: str) -> list[Channel]:
    if "." in name:
        return [Channel(name, *result.channel(name))]
    return [Channel(f"{name}.{k}", unit, values) for k, (unit, values) in result[name].channels().items()]


@contextmanager
def _drawing() -> Iterator[None]:
    """Our style, for the time of drawing only."""
    import matplotlib
    from cycler import cycler

    style: Any = STYLE | {"axes.prop_cycle": cycler(color=PALETTE)}
    with matplotlib.rc_context(style):
        yield


def _figure(height: float, width: float = 8.0) -> Drawing:
    """A figure that belongs to no window; notebooks show it all the same."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure as Drawing

    drawing = Drawing(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(drawing)
    drawing._repr_png_ = partial(_png, drawing)  # type: ignore[attr-defined]
    return drawing


def _png(drawing: Drawing) -> bytes:
    """The picture as notebooks ask for it."""
    from io import BytesIO

    data = BytesIO()
    drawing.savefig(data, format="png", dpi=100)
    return data.getvalue()


def _headed(drawing: Drawing, title: str) -> None:
    drawing.suptitle(title, x=0.012, ha="left", fontsize=12, fontweight="bold")


def _handed_out(drawing: Drawing, path: str | os.PathLike | None) -> Drawing | None:
    if path is None:
        return drawing
    path = Path(path)
    if path.suffix.lower() not in SUFFIXES:
        raise ModelError(f"cannot write a plot to {os.fspath(path)!r}: its suffix must be {', '.join(SUFFIXES)}")
    dated = {".png": {}, ".svg": {"Date": None}, ".pdf": {"CreationDate": None}}
    try:
        drawing.savefig(path, metadata=dated[path.suffix.lower()])
    except OSError as error:
        raise cannot(path, error) from None
    return None


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
    for name in (k for k in order if k in makers):
        with _drawing():
            drawing = makers[name]()
            _headed(drawing, f"{result.model.name}: {name}")
            path = folder / f"{name}.png"
            _handed_out(drawing, path)
            written.append(path)
    return written


def _drawn(result: Result, figure: Figure) -> Drawing:
    """A figure of curves over time; the balance of energies takes less room than they do."""
    ratios = [*([1.6] if len(figure.panels) == 2 else [1.0] * (len(figure.panels) - 1)), 0.8]
    ratios = ratios if figure.name == "energy" else []
    drawing = _stacked(result, figure.panels, ratios)
    if figure.note:
        drawing.supxlabel(figure.note, fontsize=8, x=0.012, ha="left")
    return drawing


def _stacked(result: Result, parts: Sequence[Panel], ratios: Sequence[float] = ()) -> Drawing:
    """Panels one below the other; high enough for their legends."""
    each = [max(2.3, 0.5 + 0.19 * len(p.curves)) for p in parts]
    heights = [h * r for h, r in zip(each, ratios or [1.0] * len(each), strict=False)]
    drawing = _figure(0.9 + sum(heights))
    axes = drawing.subplots(len(parts), 1, sharex=True, squeeze=False, height_ratios=heights)[:, 0]
    for ax, panel in zip(axes, parts, strict=True):
        _over_time(ax, result.t, panel)
    axes[-1].set_xlabel("time [s]")
    drawing.align_ylabels(axes)
    return drawing


def _over_time(ax: Axes, t: np.ndarray, panel: Panel) -> None:
    """Curves of one unit, with a legend beside them; a curve that lies on another one is dashed."""
    values = [c.values for c in panel.curves]
    for k, (c, under) in enumerate(zip(panel.curves, hidden(values), strict=True)):
        style = DASHES[max(under, k // len(PALETTE)) % len(DASHES)]
        single = "o" if len(t) == 1 else None
        ax.plot(t, c.values, label=c.name, linestyle=style, marker=single)
    _zoomed_out(ax, values)
    ax.set_ylabel(f"{panel.label} [{PRETTY.get(panel.unit, panel.unit)}]".strip())
    if panel.note:
        ax.set_title(panel.note)
    if len(t) > 1:
        ax.margins(x=0.0)
    ax.legend(**BESIDE)


def _zoomed_out(ax: Axes, values: Iterable[np.ndarray]) -> None:
    """Do not blow the rounding errors of a constant up to the height of the axis."""
    finite = np.concatenate([v[np.isfinite(v)] for v in values] or [np.zeros(0)])
    if not len(finite):
        return
    low, high = finite.min(), finite.max()
    middle = (low + high) / 2
    if high - low < 1e-9 * abs(middle) or high == low:
        room = max(abs(middle) * 0.1, 1e-3)
        ax.set_ylim(middle - room, middle + room)


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
        drawing = _figure(1.0 + 6.0 * min(max(ratio, 0.3), 1.0))
        ax = drawing.subplots()
        _views(ax, points, "xy")
        ax.set_title(note)
        ax.legend(**BESIDE)
        return drawing
    drawing = _figure(7.2)
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
