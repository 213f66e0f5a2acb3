"""Curves of a result as Matplotlib figures: one axis for each unit, names at the curves' ends of the legend."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import ModelError
from ..model.joint import Joint

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from ..results.result import Result

Curve = tuple[str, str, np.ndarray]  # name, unit, values

# Okabe and Ito's palette, which people with any colour vision can tell apart, darkest first.
PALETTE = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#56B4E9", "#E69F00", "#4D4D4D", "#B8A800")
STYLE: dict[str, Any] = {
    "figure.dpi": 100,
    "savefig.dpi": 150,
    "figure.facecolor": "white",
    "font.size": 10,
    "axes.titlesize": 11,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
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
    "axes.formatter.useoffset": False,
    "axes.formatter.limits": (-4, 5),
    "svg.hashsalt": "flyball",
}
SUFFIXES = (".png", ".svg", ".pdf")
MOST = 12  # curves in one axis of a standard plot
PRETTY = {"N*m": "N m", "rad": "rad", "m/s^2": "m/s²", "rad/s^2": "rad/s²", "1": "-"}


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
        If there is no such curve or part, or the suffix is of no known kind.
    """
    curves = [c for name in names or ("energy",) for c in _curves(result, name)]
    groups: dict[str, list[Curve]] = {}
    for c in {c[0]: c for c in curves}.values():
        groups.setdefault(c[1], []).append(c)
    with _drawing():
        figure = _figure(len(groups))
        axes = figure.subplots(len(groups), 1, sharex=True, squeeze=False)[:, 0]
        for ax, (unit, group) in zip(axes, groups.items(), strict=True):
            _over_time(ax, result.t, group, unit)
        axes[-1].set_xlabel("time [s]")
        figure.suptitle(result.model.name, x=0.012, ha="left", fontsize=12, fontweight="bold")
        return _handed_out(figure, path)


def _curves(result: Result, name: str) -> list[Curve]:
    if "." in name:
        return [(name, *result.channel(name))]
    return [(f"{name}.{k}", unit, values) for k, (unit, values) in result[name].channels().items()]


@contextmanager
def _drawing() -> Iterator[None]:
    """Our style, for the time of drawing only."""
    import matplotlib
    from cycler import cycler

    style: Any = STYLE | {"axes.prop_cycle": cycler(color=PALETTE)}
    with matplotlib.rc_context(style):
        yield


def _figure(rows: int, width: float = 8.0, each: float = 2.6) -> Figure:
    """A figure that belongs to no window; notebooks show it all the same."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, 0.7 + each * rows), layout="constrained")
    FigureCanvasAgg(figure)
    figure._repr_png_ = partial(_png, figure)  # type: ignore[attr-defined]
    return figure


def _png(figure: Figure) -> bytes:
    """The picture as notebooks ask for it."""
    from io import BytesIO

    data = BytesIO()
    figure.savefig(data, format="png", dpi=100)
    return data.getvalue()


def _handed_out(figure: Figure, path: str | os.PathLike | None) -> Figure | None:
    if path is None:
        return figure
    path = Path(path)
    if path.suffix.lower() not in SUFFIXES:
        raise ModelError(f"cannot write a plot to {os.fspath(path)!r}: its suffix must be {', '.join(SUFFIXES)}")
    dated = {".png": {}, ".svg": {"Date": None}, ".pdf": {"CreationDate": None}}
    try:
        figure.savefig(path, metadata=dated[path.suffix.lower()])
    except OSError as error:
        raise ModelError(f"cannot write {os.fspath(path)!r}: {error.strerror or error}") from None
    return None


def _over_time(ax: Axes, t: np.ndarray, curves: Sequence[Curve], unit: str) -> None:
    """Curves of one unit, with a legend beside them."""
    dashes = ("-", "--", ":", "-.")
    for k, (name, _, values) in enumerate(curves):
        ax.plot(t, values, label=name, linestyle=dashes[k // len(PALETTE) % len(dashes)])
    _zoomed_out(ax, [values for _, _, values in curves])
    ax.set_ylabel(f"[{PRETTY.get(unit, unit)}]")
    ax.margins(x=0.0)
    ax.legend(loc="upper left", bbox_to_anchor=(1.0, 1.02), handlelength=1.4, borderaxespad=0.4)


def _zoomed_out(ax: Axes, values: Iterable[np.ndarray]) -> None:
    """Do not blow the rounding errors of a constant up to the height of the axis."""
    finite = np.concatenate([v[np.isfinite(v)] for v in values] or [np.zeros(0)])
    if not len(finite):
        return
    low, high = finite.min(), finite.max()
    middle = (low + high) / 2
    if high - low < 1e-9 * max(abs(middle), 1e-3):
        room = max(abs(middle) * 0.1, 1e-3)
        ax.set_ylim(middle - room, middle + room)


def standard_plots(result: Result, folder: str | os.PathLike) -> list[Path]:
    """Write the pictures that tell most of a motion; returns their paths.

    Energies with their balance, joint coordinates, paths of the bodies, reactions, and what drivers and forces do.
    Of a mechanism with many parts the most telling are shown.
    """
    folder = Path(folder)
    makers: dict[str, Callable[[Result], Figure | None]] = {
        "energy": _energies,
        "coordinates": _coordinates,
        "paths": _paths,
        "reactions": _reactions,
        "actuation": _actuation,
    }
    written = []
    for name, make in makers.items():
        with _drawing():
            figure = make(result) if len(result.t) else None
            if figure is not None:
                figure.suptitle(f"{result.model.name}: {name}", x=0.012, ha="left", fontsize=12, fontweight="bold")
                path = folder / f"{name}.png"
                _handed_out(figure, path)
                written.append(path)
    return written


def _energies(result: Result) -> Figure:
    e = result.energy
    figure = _figure(2)
    upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(2, 1))
    _over_time(upper, result.t, [(k, "J", getattr(e, k)) for k in ("kinetic", "potential", "total")], "J")
    _over_time(lower, result.t, [("balance", "J", e.balance)], "J")
    largest = max(abs(float(x)) for x in (*e.total[:1], e.drift, 1e-12))
    room = max(1.15 * e.drift, 1e-14 * largest)
    if np.isfinite(room):
        lower.set_ylim(-room, room)
    lower.set_xlabel("time [s]")
    return figure


def _stacked_by_unit(result: Result, curves: Sequence[Curve]) -> Figure | None:
    """One axis for each unit, the first curves where there are too many."""
    groups: dict[str, list[Curve]] = {}
    for c in curves:
        groups.setdefault(c[1], []).append(c)
    if not groups:
        return None
    figure = _figure(len(groups))
    axes = figure.subplots(len(groups), 1, sharex=True, squeeze=False)[:, 0]
    for ax, (unit, group) in zip(axes, groups.items(), strict=True):
        _over_time(ax, result.t, group[:MOST], unit)
        if len(group) > MOST:
            ax.set_title(f"{MOST} of {len(group)}", fontsize=9, fontweight="normal")
    axes[-1].set_xlabel("time [s]")
    return figure


def _coordinates(result: Result) -> Figure | None:
    every = [(e, what, c.unit) for e in result.model.joints for what, c in e.coordinates.items()]
    units = dict.fromkeys(unit for _, _, unit in every)
    chosen = [c for unit in units for c in _chosen([c for c in every if c[2] == unit])]
    curves = [(f"{e.name}.{what}", unit, getattr(result[e.name], what)) for e, what, unit in chosen]
    return _stacked_by_unit(result, curves)


def _chosen(parts: Sequence[Any], most: int = MOST) -> list[Any]:
    """Evenly chosen parts, first and last among them."""
    if len(parts) <= most:
        return list(parts)
    return [parts[i] for i in np.linspace(0, len(parts) - 1, most).round().astype(int)]


def _paths(result: Result) -> Figure | None:
    """Paths of the centres of mass: y over x in the plane; x, y, z over time in space."""
    bodies = _chosen(result.model.bodies)
    place, r = result.values.structure.place, result.records
    points = {b.name: np.stack(r.body(place[b.name])[0], axis=1) for b in bodies}
    if not result.planar:
        figure = _figure(3)
        axes = figure.subplots(3, 1, sharex=True)
        for i, ax in enumerate(axes):
            _over_time(ax, result.t, [(k, "m", p[:, i]) for k, p in points.items()], "m")
            ax.set_ylabel(f"{'xyz'[i]} [m]")
            if i:
                ax.get_legend().remove()
        axes[-1].set_xlabel("time [s]")
        return figure
    figure = _figure(1, 8.0, 5.0)
    ax = figure.subplots()
    for k, (name, p) in enumerate(points.items()):
        color = PALETTE[k % len(PALETTE)]
        ax.plot(p[:, 0], p[:, 1], label=name, color=color, linestyle="-" if k < len(PALETTE) else "--")
        ax.plot(p[0, 0], p[0, 1], "o", color=color, markersize=5)
    ax.set_aspect("equal", adjustable="datalim")
    ax.set_xlabel("x [m]")
    ax.set_ylabel("y [m]")
    few = f"{len(bodies)} of {len(result.model.bodies)} bodies; " if len(bodies) < len(result.model.bodies) else ""
    ax.set_title(f"{few}centres of mass, start marked", fontsize=9, fontweight="normal")
    ax.legend(loc="upper left", bbox_to_anchor=(1.0, 1.02), handlelength=1.4, borderaxespad=0.4)
    return figure


def _reactions(result: Result) -> Figure | None:
    """Sizes of the joints' reaction forces and torques."""
    curves = []
    for e in _chosen(result.model.joints):
        view = result[e.name]
        mark = "*" if view.undetermined else ""
        for what, unit in (("force", "N"), ("torque", "N*m")):
            a = np.asarray(getattr(view, what))
            size = np.abs(a) if a.ndim == 1 else np.sqrt((a**2).sum(axis=1))
            if what == "force" or _matters(e, size):
                curves.append((f"{e.name}{mark}", unit, size))
    figure = _stacked_by_unit(result, curves)
    if figure is not None:
        for ax, what in zip(figure.axes, ("|force|", "|torque|"), strict=False):
            ax.set_ylabel(f"{what} {ax.get_ylabel()}")
        if any(name.endswith("*") for name, _, _ in curves):
            figure.supxlabel("* redundancy leaves some components undetermined", fontsize=8, x=0.012, ha="left")
    return figure


def _matters(e: Joint, torque: np.ndarray) -> bool:
    """Whether a joint carries a torque at all, rather than rounding errors."""
    return bool(np.nanmax(torque, initial=0.0) > 1e-9)


def _actuation(result: Result) -> Figure | None:
    """What drivers need, and what force elements do."""
    curves: list[Curve] = []
    for e in (*result.model.drivers, *result.model.forces):
        channels = result[e.name].channels()
        curves += [(f"{e.name}.{k}", unit, v) for k, (unit, v) in channels.items() if unit in ("N", "N*m")]
    return _stacked_by_unit(result, curves)
