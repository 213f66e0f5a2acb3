"""Plots of results over time: the standard pictures, panels of any named quantities, formulations compared."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..model.body import GROUND
from ..model.names import curve_parts
from .event_marks import event_marks
from .figures import centre, count_note, evenly_chosen, hidden_counts, moving_bodies, panels_by_unit, standard_figures
from .motion_with_events import motion_with_event_states
from .plotting import (
    DASH_STYLES,
    LEGEND_BESIDE,
    PALETTE,
    finish_figure,
    new_figure,
    panels_over_time,
    plot_panel,
    plot_style,
    set_title,
)
from .recording import Channel, Figure, Panel, Picture, PointPaths

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Drawing

    from ..results.comparison import Comparison
    from ..results.measurements import MeasurementComparison
    from ..results.momentum import Momentum
    from ..results.result import Result
    from ..results.spectrum import Spectrum


def write_pictures(pictures: Sequence[Picture], folder: Path) -> list[Path]:
    """Write pictures as PNG files into an existing folder; return their paths.

    Raises
    ------
    ModelError
        If a file cannot be written.
    """
    written = [folder / f"{p.name}.png" for p in pictures]
    with plot_style():
        for picture, path in zip(pictures, written, strict=True):
            shown = picture.content
            drawing = _curves_figure(picture, shown) if isinstance(shown, Figure) else _paths_figure(shown)
            set_title(drawing, picture.title)
            finish_figure(drawing, path)
    return written


def _curves_figure(picture: Picture, figure: Figure) -> Drawing:
    """Return a figure of curves over time; the energy balance gets a smaller panel."""
    ratios = [*([1.6] if len(figure.panels) == 2 else [1.0] * (len(figure.panels) - 1)), 0.8]
    drawing = panels_over_time(picture.t, figure.panels, ratios if figure.name == "energy" else [], picture.marks)
    if figure.note:
        drawing.supxlabel(figure.note, fontsize=8, x=0.012, ha="left")
    return drawing


def _paths_figure(paths: PointPaths) -> Drawing:
    """Paths of points: in the plane, or from the front, the side and above."""
    points, note = paths.points, paths.note
    if paths.planar:
        every = np.concatenate(list(points.values()))
        finite = np.isfinite(every).all(axis=1)
        extent = np.ptp(every[finite], axis=0) if finite.any() else every[0]
        ratio = extent[1] / max(extent[0], 1e-12)
        drawing = new_figure(1.0 + 6.0 * min(max(ratio, 0.3), 1.0))
        ax = drawing.subplots()
        _plot_paths(ax, points, "xy")
        ax.set_title(note)
        ax.legend(**LEGEND_BESIDE)
        return drawing
    drawing = new_figure(7.2)
    axes = drawing.subplots(2, 2)
    for ax, (seen, across) in zip(axes.flat, (("front", "xz"), ("side", "yz"), ("top", "xy")), strict=False):
        _plot_paths(ax, points, across)
        ax.set_title(seen)
    handles, labels = axes[0, 0].get_legend_handles_labels()
    axes[1, 1].axis("off")
    axes[1, 1].legend(handles, labels, loc="upper left", title=note, alignment="left")
    return drawing


def _plot_paths(ax: Axes, points: dict[str, np.ndarray], across: str) -> None:
    """Draw paths seen along one axis, to scale; a path that coincides with another one is dashed."""
    i, j = ("xyz".index(c) for c in across)
    flat = [p[:, [i, j]].ravel() for p in points.values()]
    for k, ((name, p), under) in enumerate(zip(points.items(), hidden_counts(flat), strict=True)):
        color, style = PALETTE[k % len(PALETTE)], DASH_STYLES[max(under, k // len(PALETTE)) % len(DASH_STYLES)]
        ax.plot(p[:, i], p[:, j], label=name, color=color, linestyle=style)
        ax.plot(p[0, i], p[0, j], "o", color=color, markersize=4.5)
    ax.set_aspect("equal", adjustable="datalim")
    ax.margins(0.08)
    ax.set_xlabel(f"{across[0]} [m]")
    ax.set_ylabel(f"{across[1]} [m]")


PICTURE_ORDER = (
    "energy",
    "coordinates",
    "positions",
    "paths",
    "contacts",
    "reactions",
    "actuation",
    "sensors",
    "controllers",
)


def standard_pictures(result: Result) -> list[Picture]:
    """Return the standard pictures of a motion, without empty ones.

    ``energy``, ``coordinates`` (of joints), ``positions`` (of spatial bodies over time), ``paths`` (of points, seen
    in the plane or from three sides), ``contacts``, ``reactions``, ``actuation``, ``sensors`` and ``controllers``.
    """
    whole = motion_with_event_states(result)
    found: dict[str, Figure | PointPaths] = {f.name: f for f in standard_figures(whole)}
    if len(result.t):
        found["paths"] = _mass_centre_paths(whole)
    when, name = event_marks(result), result.model.name
    return [Picture(k, f"{name}: {k}", whole.t, found[k], when) for k in PICTURE_ORDER if k in found]


def _mass_centre_paths(result: Result) -> PointPaths:
    """Paths of centres of mass and named frames."""
    every = moving_bodies(result)
    bodies = evenly_chosen(every)
    points = {name: centre(result, name) for name in bodies}
    for frame in result.model.frames if len(points) < 6 else ():
        if frame.body != GROUND:
            p = result[frame.name].position
            points[frame.name] = np.column_stack([p, np.zeros((len(p), 3 - p.shape[1]))])
    note = "; ".join(x for x in (count_note(len(bodies), len(every), "bodies"), "dots: start") if x)
    return PointPaths(points, result.planar, note)


def plot_curves(result: Result, *names: str, path: str | os.PathLike | None = None) -> Any:
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
    whole = motion_with_event_states(result)
    curves = {c.name: c for name in names or ("energy",) for c in _curves_of(whole, name)}
    with plot_style():
        drawing = panels_over_time(
            whole.t, tuple(panels_by_unit(list(curves.values()), len(curves))), marks=event_marks(result)
        )
        set_title(drawing, result.model.name)
        return finish_figure(drawing, path)


def _curves_of(result: Result, name: str) -> list[Channel]:
    if curve_parts(name, result.model)[1]:
        return [Channel(name, *result.channel(name))]
    return [Channel(f"{name}.{k}", unit, values) for k, (unit, values) in result[name].channels().items()]


def write_standard_plots(result: Result, folder: str | os.PathLike) -> list[Path]:
    """Write the standard pictures into an existing folder; return their paths."""
    return write_pictures(standard_pictures(result), Path(folder))


AXIS_ROOM = 0.05  # of the range of values, left free above and below


def measurement_plot(comparison: MeasurementComparison, path: str | os.PathLike | None = None) -> Any:
    """Draw curves of a motion with the measured values as dots; see `plot_curves`."""
    whole = motion_with_event_states(comparison.result)
    curves = [Channel(name, *whole.curve(name)) for name in comparison.names]
    measured = dict(zip(comparison.names, comparison.measured.T, strict=True))
    with plot_style():
        panels = tuple(replace(p, note="dots: measured") for p in panels_by_unit(curves, len(curves)))
        drawing = panels_over_time(whole.t, panels, marks=event_marks(comparison.result))
        for ax, panel in zip(drawing.axes, panels, strict=True):
            for line, c in zip(ax.lines[: len(panel.curves)], panel.curves, strict=True):
                points = measured[c.name]
                room = AXIS_ROOM * np.nanmax([np.ptp(c.values), np.nanmax(points) - np.nanmin(points)])
                low, high = ax.get_ylim()
                ax.plot(comparison.t, points, "o", color=line.get_color(), markersize=3.5)
                ax.set_ylim(min(low, np.nanmin(points) - room), max(high, np.nanmax(points) + room))
        set_title(drawing, f"{comparison.result.model.name}: measured and computed")
        return finish_figure(drawing, path)


NAMED_BODIES = 4  # number of bodies that a title names
DENSITY_DECADES = 12  # shown below the largest power spectral density


def momentum_plot(momentum: Momentum, path: str | os.PathLike | None = None) -> Any:
    """Draw the components of the linear and angular momentum over time.

    Parameters
    ----------
    momentum : Momentum
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
    panels = []
    for label, values, unit in (("momentum", momentum.linear, "kg m/s"), ("angular", momentum.angular, "kg m²/s")):
        columns = values.reshape(len(values), -1).T
        names = "xyz" if len(columns) > 1 else "z"
        panels.append(Panel(label, tuple(Channel(n, unit, x) for n, x in zip(names, columns, strict=False))))
    with plot_style():
        drawing = panels_over_time(momentum.t, tuple(panels))
        few = len(momentum.bodies) <= NAMED_BODIES
        bodies = ", ".join(momentum.bodies) if few else f"{len(momentum.bodies)} bodies"
        set_title(drawing, f"Momentum of {bodies} about {momentum.about}")
        return finish_figure(drawing, path)


def spectrum_plot(spectrum: Spectrum, path: str | os.PathLike | None = None) -> Any:
    """Draw amplitude spectra, and power spectral densities (logarithmic) over frequency; a row for each unit.

    Parameters
    ----------
    spectrum : Spectrum
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
    units = list(dict.fromkeys(spectrum.units))
    with plot_style():
        drawing = new_figure(0.9 + 2.7 * len(units), 11.0)
        for (left, right), unit in zip(drawing.subplots(len(units), 2, squeeze=False), units, strict=True):
            own = [k for k, u in enumerate(spectrum.units) if u == unit]
            density = np.where(spectrum.density > 0.0, spectrum.density, np.nan)
            for ax, label, x, values, its_unit, legend in (
                (left, "amplitude", spectrum.frequency, spectrum.amplitude, unit, {}),
                (right, "density", spectrum.density_frequency, density, spectrum.density_units[own[0]], LEGEND_BESIDE),
            ):
                curves = tuple(Channel(spectrum.names[k], its_unit.replace("^2", "²"), values[:, k]) for k in own)
                plot_panel(ax, x, Panel(label, curves), legend)
            left.set_ylim(bottom=0.0)
            if (most := spectrum.density[:, own].max()) > 0.0:
                right.set_yscale("log")
                low, high = right.get_ylim()
                right.set_ylim(max(low, most * 10.0**-DENSITY_DECADES), high)
            for ax in (left, right):
                ax.set_xscale("log")
                ax.set_xlim(spectrum.frequency[1], spectrum.frequency[-1])
                ax.set_xlabel("frequency [Hz]")
        set_title(drawing, f"Spectrum, window {spectrum.window}")
        return finish_figure(drawing, path)


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
