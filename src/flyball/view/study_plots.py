"""Plots over parameters: studies, response surfaces, Sobol' indices, equilibria, sensitivities, optima.

Axes and colours are logarithmic where values are spread in logarithms. Curves of a few runs are drawn by
themselves, coloured by what varies; of many runs percentiles are drawn. Where other parameters vary too, a
response surface is the local mean of scattered samples.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import ModelError
from ..results.wording import UNSTABLE
from .figures import UNIT_LABELS
from .plotting import DASH_STYLES, LEGEND_BESIDE, PALETTE, axis_label, finish_figure, new_figure, plot_style, set_title

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ..results.equilibrium import Equilibrium, EquilibriumSeries
    from ..results.sensitivity_and_optimum import Optimum, Sensitivity
    from ..results.study import Indices, Study


LOG_RATIO = 10.0  # ratio of largest to smallest value for a logarithmic axis
MIN_COLOR_RANGE = 1.0001  # least extent of a colour scale, even for equal values


def is_logarithmic(values: np.ndarray, wide: float = LOG_RATIO) -> bool:
    """Return whether values are more uniform in logarithms, by the position of their median in their range."""
    known = np.unique(values[np.isfinite(values)])
    if len(known) < 3 or known[0] <= 0.0 or known[-1] < wide * known[0]:
        return False
    logs = np.log(known)
    plain, by_log = ((np.median(v) - v[0]) / (v[-1] - v[0]) for v in (known, logs))
    return bool(abs(by_log - 0.5) < abs(plain - 0.5))


def set_scale(ax: Any, axis: str, values: np.ndarray, wide: float = LOG_RATIO) -> None:
    """Set a logarithmic axis if values are more uniform in logarithms."""
    if is_logarithmic(values, wide):
        getattr(ax, f"set_{axis}scale")("log")


def color_norm(values: np.ndarray, wide: float = LOG_RATIO) -> Any:
    """Return the colour normalisation of values: linear or logarithmic."""
    from matplotlib.colors import LogNorm, Normalize

    low, high = float(np.nanmin(values)), float(np.nanmax(values))
    if is_logarithmic(values, wide):
        return LogNorm(low, high)
    return Normalize(low, high if high > low else low + (abs(low) or 1.0) * (MIN_COLOR_RANGE - 1.0))


SURFACE_POINTS = 48  # grid points along each axis
MIN_SINGULAR_PART = 1e-10  # smallest relative singular value of a local fit


def surface_of_means(x: np.ndarray, y: np.ndarray, z: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Mean of z by x and y on a grid, nan outside of the samples, which do not lie on a line.

    By local linear regression with Gaussian weights (Cleveland and Devlin, Journal of the American Statistical
    Association 83, 1988), their widths by Scott's rule, n^(-1/6) standard deviations (Scott, *Multivariate Density
    Estimation*, 1992, eq. 6.42).

    Parameters
    ----------
    x, y, z : ndarray (n,)

    Returns
    -------
    tuple of ndarray
        x (g,), y (g,), means (g, g), y along the rows.
    """
    from scipy.spatial import Delaunay

    points = np.column_stack([(v - v.mean()) / (v.std() or 1.0) for v in (x, y)])
    inside = Delaunay(points)
    axes = [np.linspace(v.min(), v.max(), SURFACE_POINTS) for v in points.T]
    width = max(len(z), 2) ** (-1.0 / 6.0)
    means = np.full((SURFACE_POINTS, SURFACE_POINTS), np.nan)
    for k, b in enumerate(axes[1]):
        at = np.column_stack([axes[0], np.full(SURFACE_POINTS, b)])
        known = inside.find_simplex(at) >= 0
        means[k, known] = _local_fit(points, z, at[known], width)
    return np.linspace(x.min(), x.max(), SURFACE_POINTS), np.linspace(y.min(), y.max(), SURFACE_POINTS), means


def _local_fit(points: np.ndarray, z: np.ndarray, at: np.ndarray, width: float) -> np.ndarray:
    """Return values at some points of the planes fitted locally around each of them."""
    d = points[None] - at[:, None]
    w = np.exp(-0.5 * (d**2).sum(axis=2) / width**2)
    A = np.concatenate([np.ones((*d.shape[:2], 1)), d], axis=2)
    S = np.einsum("gni,gn,gnj->gij", A, w, A)
    r = np.einsum("gni,gn->gi", A, w * z)
    return np.einsum("gij,gj->gi", np.linalg.pinv(S, rcond=MIN_SINGULAR_PART, hermitian=True), r)[:, 0]


MAX_SINGLE_CURVES = 40  # largest number of curves drawn one by one
MAX_LEGEND_CURVES = 8  # largest number of curves with a legend
PERCENTILE_BANDS = ((5.0, 95.0, 0.15), (25.0, 75.0, 0.3))  # percentile ranges, and their shading
DARKEST_COLOR, BRIGHTEST_COLOR = 0.0, 0.88  # parts of the colour map that are visible on white


def plot_study_curves(drawing: Any, ax: Any, found: Study, name: str) -> None:
    """Draw the curves of one quantity."""
    y, points = found.values[name][found.done], found.points[found.done]
    if len(y) > MAX_SINGLE_CURVES:
        _plot_bands(ax, found.t, y)
    elif len(y) > MAX_LEGEND_CURVES:
        _plot_colored_curves(drawing, ax, found, y, points)
    elif len(y):
        _plot_named_curves(ax, found, y, points)
    ax.set_xlabel("time [s]")


def _plot_bands(ax: Any, t: np.ndarray, y: np.ndarray) -> None:
    for low, high, dark in PERCENTILE_BANDS:
        a, b = np.nanpercentile(y, (low, high), axis=0)
        ax.fill_between(t, a, b, color=PALETTE[0], alpha=dark, linewidth=0, label=f"{low:g} to {high:g} %")
    ax.plot(t, np.nanmedian(y, axis=0), color=PALETTE[0], label="median")
    ax.legend(**LEGEND_BESIDE)


def _plot_named_curves(ax: Any, found: Study, y: np.ndarray, points: np.ndarray) -> None:
    """Draw curves labelled with the values of their parameters."""
    varied = [k for k in range(points.shape[1]) if np.ptp(points[:, k]) > 0.0] or [0]
    for i, (curve, point) in enumerate(zip(y, points, strict=True)):
        label = ", ".join(f"{found.parameters[k]} = {point[k]:.4g}" for k in varied)
        style = DASH_STYLES[i // len(PALETTE) % len(DASH_STYLES)]
        ax.plot(found.t, curve, color=PALETTE[i % len(PALETTE)], linestyle=style, linewidth=1.2, label=label)
    ax.legend(**LEGEND_BESIDE)


def _plot_colored_curves(drawing: Any, ax: Any, found: Study, y: np.ndarray, points: np.ndarray) -> None:
    """Draw curves coloured by the most influential parameter."""
    from matplotlib import colormaps
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import ListedColormap

    k = most_explaining_parameter(points, y)
    norm, colours = (
        color_norm(points[:, k]),
        ListedColormap(colormaps["viridis"](np.linspace(DARKEST_COLOR, BRIGHTEST_COLOR, 256))),
    )
    for curve, x in zip(y, points[:, k], strict=True):
        ax.plot(found.t, curve, color=colours(norm(x)), linewidth=1.1)
    drawing.colorbar(ScalarMappable(norm, colours), ax=ax, label=found.parameters[k])


def most_explaining_parameter(points: np.ndarray, y: np.ndarray) -> int:
    """Return the parameter that explains most of the curves' variance, by linear regression on its ranks."""
    known = y[:, np.isfinite(y).all(axis=0)]
    ranks = np.argsort(np.argsort(points, axis=0, kind="stable"), axis=0).astype(float)
    ranks = np.stack([_mean_ranks(x, r) for x, r in zip(points.T, ranks.T, strict=True)], axis=1)
    ranks -= ranks.mean(axis=0)
    size = np.maximum((ranks**2).sum(axis=0), 1e-300)
    explained = ((ranks.T @ (known - known.mean(axis=0))) ** 2).sum(axis=1) / size
    return int(np.argmax(explained))


def _mean_ranks(x: np.ndarray, ranks: np.ndarray) -> np.ndarray:
    """Return ranks, with mean ranks for equal values."""
    _, group = np.unique(x, return_inverse=True)
    return (np.bincount(group, ranks) / np.bincount(group))[group]


MAX_MARKED_POINTS = 40  # largest number of marked points on a line
QUANTITY_LOG_RATIO = 100.0  # ratio of largest to smallest value for a logarithmic axis of quantities
CONTOUR_LEVELS = 24
PathLike = str | os.PathLike | None


def study(found: Study, of: Sequence[str], path: PathLike = None) -> Any:
    """See `Study.plot`."""
    names = _checked_names(found, of)
    curves = [name for name in names if found.values[name].ndim > 1]
    d = len(found.parameters)
    with plot_style():
        columns = d if d > 2 and len(curves) < len(names) else 1
        drawing = new_figure(0.9 + 2.6 * len(names), max(8.0, 2.6 * columns))
        grid = drawing.add_gridspec(len(names), columns)
        for i, name in enumerate(names):
            if d > 2 and name not in curves:
                _plot_scatter([drawing.add_subplot(grid[i, k]) for k in range(d)], found, name)
                continue
            ax = drawing.add_subplot(grid[i, :])
            if name in curves:
                plot_study_curves(drawing, ax, found, name)
                ax.set_ylabel(_quantity_label(found, name))
            elif d == 1:
                _plot_over_parameter(ax, found, name)
            else:
                _plot_surface(drawing, ax, found, name, *found.parameters)
        set_title(drawing, _study_title(found))
        return finish_figure(drawing, path)


def scatter(found: Study, of: Sequence[str], path: PathLike = None) -> Any:
    """See `Study.scatter`."""
    names = _scalar_names(found, of)
    with plot_style():
        drawing = new_figure(0.9 + 2.6 * len(names), max(5.0, 2.8 * len(found.parameters)))
        axes = drawing.subplots(len(names), len(found.parameters), squeeze=False)
        for row, name in zip(axes, names, strict=True):
            _plot_scatter(row, found, name)
        set_title(drawing, _study_title(found))
        return finish_figure(drawing, path)


def histogram(found: Study, of: Sequence[str], path: PathLike = None) -> Any:
    """See `Study.histogram`."""
    names = _scalar_names(found, of)
    with plot_style():
        drawing = new_figure(0.9 + 2.4 * len(names))
        for ax, name in zip(drawing.subplots(len(names), 1, squeeze=False)[:, 0], names, strict=True):
            y = found.values[name]
            y = y[np.isfinite(y)]
            if len(y):
                set_scale(ax, "x", y, QUANTITY_LOG_RATIO)
                ax.hist(y, bins=_bin_edges(y), color=PALETTE[0], edgecolor="white", linewidth=0.5)
                for q, style in ((5.0, ":"), (50.0, "-"), (95.0, ":")):
                    ax.axvline(np.percentile(y, q), color=PALETTE[1], linestyle=style, linewidth=1.2)
            ax.set_xlabel(_quantity_label(found, name))
            ax.set_ylabel("runs")
        set_title(drawing, f"{_study_title(found)}; lines: median, 5 and 95 %")
        return finish_figure(drawing, path)


def surface(found: Study, of: str, x: str, y: str, path: PathLike = None) -> Any:
    """See `Study.surface`."""
    (name,) = _scalar_names(found, (of,))
    for p in (x, y):
        if p not in found.parameters:
            raise ModelError(f"the study varies {', '.join(found.parameters)}, not {p!r}")
    if x == y:
        raise ModelError(f"a surface is over two parameters, not twice over {x!r}")
    with plot_style():
        drawing = new_figure(5.0)
        _plot_surface(drawing, drawing.subplots(), found, name, x, y)
        set_title(drawing, _study_title(found))
        return finish_figure(drawing, path)


def indices(found: Indices, path: PathLike = None) -> Any:
    """See `Indices.plot`."""
    with plot_style():
        drawing = new_figure(0.9 + 2.4 * len(found.of))
        at = np.arange(len(found.parameters))
        for i, ax in enumerate(drawing.subplots(len(found.of), 1, squeeze=False)[:, 0]):
            sets = (("first order", found.first, found.first_range), ("total", found.total, found.total_range))
            for k, (label, value, bounds) in enumerate(sets):
                off = np.nan_to_num(np.abs(bounds[i].T - value[i]))
                ax.bar(at + 0.4 * k - 0.2, value[i], 0.36, yerr=off, label=label, color=PALETTE[k], capsize=2)
            ax.set_xticks(at, found.parameters)
            ax.set_title(found.of[i])
            ax.set_ylabel("part of the variance")
            ax.legend(**LEGEND_BESIDE)
        set_title(drawing, f"Sobol' indices, {found.samples} samples")
        return finish_figure(drawing, path)


def _checked_names(found: Study, of: Sequence[str]) -> list[str]:
    for name in of:
        found[name]  # explanatory text
    return list(of or found.of)


def _scalar_names(found: Study, of: Sequence[str]) -> list[str]:
    """Return the scalar quantities."""
    names = _checked_names(found, of) if of else [name for name in found.of if found.values[name].ndim == 1]
    curves = [name for name in names if found.values[name].ndim > 1]
    if curves or not names:
        name = (curves or list(found.of))[0]
        raise ModelError(f"{name} is a curve; give end({name}), or max, min, mean, rms of it")
    return names


def _bin_edges(y: np.ndarray) -> Any:
    """Return edges of a histogram, logarithmic if its axis is."""
    if is_logarithmic(y, QUANTITY_LOG_RATIO):
        return np.exp(np.histogram_bin_edges(np.log(y), "auto"))
    return "auto" if np.ptp(y) > 0.0 else 1


def _study_title(found: Study) -> str:
    return f"{found.name}: {int(found.done.sum())} of {len(found)} runs"


def _quantity_label(found: Study, name: str) -> str:
    return axis_label(name, found.unit(name))


def _plot_over_parameter(ax: Any, found: Study, name: str) -> None:
    order = np.argsort(found.points[:, 0], kind="stable")
    ax.plot(found.points[order, 0], found.values[name][order], marker="o" if len(found) <= MAX_MARKED_POINTS else None)
    set_scale(ax, "x", found.points[:, 0])
    set_scale(ax, "y", found.values[name], QUANTITY_LOG_RATIO)
    ax.set_xlabel(found.parameters[0])
    ax.set_ylabel(_quantity_label(found, name))


def _plot_scatter(row: Any, found: Study, name: str) -> None:
    for k, (ax, parameter) in enumerate(zip(row, found.parameters, strict=True)):
        ax.plot(found.points[:, k], found.values[name], ".", markersize=3 if len(found) > 200 else 5, alpha=0.6)
        set_scale(ax, "x", found.points[:, k])
        ax.set_xlabel(parameter)
        if k == 0:
            set_scale(ax, "y", found.values[name], QUANTITY_LOG_RATIO)
            ax.set_ylabel(_quantity_label(found, name))
        else:
            ax.sharey(row[0])


def _plot_samples(ax: Any, x: np.ndarray, y: np.ndarray, z: np.ndarray, scattered: bool) -> Any:
    """Draw triangles between samples; the smooth mean if other parameters vary; colours if samples are on a line."""
    from scipy.spatial import Delaunay, QhullError

    if len(z) < 3:
        return ax.scatter(x, y, c=z)
    shown = (x, y)
    x, y = (np.log(v) if is_logarithmic(v) else v for v in shown)
    try:
        triangles = Delaunay(np.column_stack([(v - v.mean()) / (np.ptp(v) or 1.0) for v in (x, y)])).simplices
    except (QhullError, ValueError):
        return ax.scatter(*shown, c=z)
    if scattered:
        a, b, mean = surface_of_means(x, y, z)
        a, b = (np.exp(v) if is_logarithmic(old) else v for v, old in zip((a, b), shown, strict=True))
        drawn = ax.contourf(a, b, np.ma.masked_invalid(mean), **_contour_levels(mean))
    else:
        drawn = ax.tricontourf(*shown, triangles, z, **_contour_levels(z))
    ax.plot(*shown, ".", color="#222222", markersize=1.5, alpha=0.5)
    return drawn


def _contour_levels(z: np.ndarray) -> dict[str, Any]:
    """Return contour levels, logarithmic if values are."""
    if not is_logarithmic(z, QUANTITY_LOG_RATIO):
        return {"levels": CONTOUR_LEVELS}
    low, high = float(np.nanmin(z)), float(np.nanmax(z))
    return {"levels": np.geomspace(low, high, CONTOUR_LEVELS + 1), "norm": color_norm(z, QUANTITY_LOG_RATIO)}


def _plot_surface(drawing: Any, ax: Any, found: Study, name: str, x: str, y: str) -> None:
    """Draw a grid, averaged over its other axes; for samples an interpolation."""
    i, j = found.parameters.index(x), found.parameters.index(y)
    values = found[name]
    if found.axes and min(len(found.axes[i]), len(found.axes[j])) > 1:
        others = tuple(k for k in range(len(found.axes)) if k not in (i, j))
        there = np.isfinite(values).sum(axis=others)
        mean = np.where(there > 0, np.nansum(values, axis=others) / np.maximum(there, 1), np.nan)
        mean = mean if i > j else mean.T
        a, b = np.argsort(found.axes[i]), np.argsort(found.axes[j])
        drawn = ax.contourf(
            found.axes[i][a], found.axes[j][b], np.ma.masked_invalid(mean[np.ix_(b, a)]), **_contour_levels(mean)
        )
    else:
        known = np.isfinite(found.values[name])
        px, py, z = found.points[known, i], found.points[known, j], found.values[name][known]
        varied = any(np.ptp(x) > 0.0 for k, x in enumerate(found.points[known].T) if k not in (i, j))
        drawn = _plot_samples(ax, px, py, z, varied)
    drawing.colorbar(drawn, ax=ax, label=_quantity_label(found, name))
    set_scale(ax, "x", found.points[:, i])
    set_scale(ax, "y", found.points[:, j])
    ax.set_xlabel(x)
    ax.set_ylabel(y)


UNSTABLE_DASHES = (0, (3.5, 2.5))
JUMP_DASHES = (0, (1.0, 2.0))

Branch = list[tuple[float, "Equilibrium"]]


def series(found: EquilibriumSeries, *names: str, path: str | os.PathLike | None = None) -> Any:
    """Curves over the parameter; those of equal unit share an axis. See `EquilibriumSeries.plot`."""
    chosen = names or tuple(found.telling())
    units: dict[str, list[str]] = {}
    for name in chosen:
        units.setdefault(found.channel(name)[0], []).append(name)
    with plot_style():
        drawing = new_figure(0.9 + 2.9 * max(len(units), 1))
        axes = drawing.subplots(max(len(units), 1), 1, sharex=True, squeeze=False)[:, 0]
        for ax, (unit, group) in zip(axes, units.items(), strict=False):
            for k, name in enumerate(group):
                _plot_equilibrium_curve(ax, found, name, PALETTE[k % len(PALETTE)])
            ax.set_ylabel(axis_label(UNIT_LABELS.get(unit, ""), unit))
        _explain_dashes(axes[0], found)
        for ax in axes:
            if ax.get_legend_handles_labels()[1]:
                ax.legend(**LEGEND_BESIDE)
        axes[-1].set_xlabel("time [s]" if found.parameter == "t" else found.parameter)
        drawing.align_ylabels(axes)
        set_title(drawing, f"{found.name}: equilibria over {found.parameter}")
        return finish_figure(drawing, path)


def equilibrium_branches(found: EquilibriumSeries) -> list[Branch]:
    """Return the equilibria in order, with those at jumps, cut at jumps."""
    out: list[Branch] = [[]]
    jumps = list(found.jumps)
    for k, (value, e) in enumerate(zip(found.values, found.equilibria, strict=True)):
        before = found.values[k - 1] if k else value
        while jumps and min(before, value) <= jumps[0].value <= max(before, value):
            j = jumps.pop(0)
            out[-1].append((j.value, j.before))
            out.append([(j.value, j.after)])
        out[-1].append((float(value), e))
    return out


def _plot_equilibrium_curve(ax: Axes, found: EquilibriumSeries, name: str, color: str) -> None:
    cuts = equilibrium_branches(found)
    ax.plot([], [], color=color, label=name)
    for part in cuts:
        x = np.array([value for value, _ in part])
        y = np.array([e[name] for _, e in part])
        bad = np.array([e.stability == UNSTABLE for _, e in part])
        for dashed, style in ((False, "-"), (True, UNSTABLE_DASHES)):
            own = (bad[:-1] | bad[1:]) == dashed
            points = np.full((3, 2, len(own)), np.nan)  # segments, each ended by a gap
            points[0], points[1] = (x[:-1], y[:-1]), (x[1:], y[1:])
            ax.plot(*points[:, :, own].transpose(1, 2, 0).reshape(2, -1), color=color, linestyle=style)
        if len(found.values) < 16 or len(part) == 1:
            ax.plot(x, y, ".", color=color, markersize=5)
    for a, b in pairwise(cuts):
        (x0, before), (x1, after) = a[-1], b[0]
        ax.plot([x0, x1], [before[name], after[name]], color=color, linestyle=JUMP_DASHES, linewidth=1.2)


def _explain_dashes(ax: Axes, found: EquilibriumSeries) -> None:
    """Explain dashes and dots, if there are any."""
    if UNSTABLE in found.stability or any(j.before.stability == UNSTABLE for j in found.jumps):
        ax.plot([], [], color="#555555", linestyle=UNSTABLE_DASHES, label="unstable")
    if found.jumps:
        ax.plot([], [], color="#555555", linestyle=JUMP_DASHES, linewidth=1.2, label="jump")


def sensitivity_plot(s: Sensitivity, path: str | os.PathLike | None = None) -> Any:
    """Draw for each quantity its change for a one percent change of each parameter, over time or as bars.

    For parameters that are zero a change by one unit is used.
    """
    percent = np.array([0.01 * abs(s.parameters[p]) or 1.0 for p in s.to])
    with plot_style():
        drawing = new_figure(0.8 + 2.2 * len(s.of))
        for k, axis in enumerate(drawing.subplots(len(s.of), 1, squeeze=False, sharex=True)[:, 0]):
            _sensitivity_panel(axis, s, k, percent)
            axis.label_outer()
        return finish_figure(drawing, path)


def _sensitivity_panel(axis: Any, s: Sensitivity, k: int, percent: np.ndarray) -> None:
    axis.set_title(f"change of {s.of[k]} by one percent more of a parameter")
    axis.set_ylabel(axis_label("", s.units[k]))
    found = s.derivatives[:, k, :] * percent
    if len(s.t) > 1:
        for i, name in enumerate(s.to):
            axis.plot(s.t, found[:, i].real, color=PALETTE[i % len(PALETTE)], label=name)
        axis.set_xlabel("time [s]")
        axis.legend(**LEGEND_BESIDE)
        return
    parts = [("real part", found[0].real)] if np.isrealobj(found) else []
    parts = parts or [("real part", found[0].real), ("imaginary part", found[0].imag)]
    width = 0.8 / len(parts)
    for i, (label, values) in enumerate(parts):
        axis.bar(
            np.arange(len(s.to)) + (i - (len(parts) - 1) / 2) * width, values, width, color=PALETTE[i], label=label
        )
    axis.axhline(0.0, color="#8a8a8a", linewidth=0.8)
    axis.set_xticks(range(len(s.to)), s.to)
    if len(parts) > 1:
        axis.legend(**LEGEND_BESIDE)


OPTIMUM_STYLES: dict[str, dict[str, Any]] = {  # drawn in this order
    "start": {"color": "#8a8a8a", "linestyle": (0, (4, 3)), "marker": "o"},
    "target": {"color": PALETTE[1], "linestyle": (0, (1.5, 2)), "marker": "x"},
    "optimum": {"color": PALETTE[0], "linestyle": "-", "marker": "o"},
}


def optimum_plot(found: Optimum, path: str | os.PathLike | None = None) -> Any:
    """One panel for each quantity, over time or side by side; eigenvalues in the complex plane. See `Optimum.plot`."""
    parts = {"start": found.start_values, "target": found.target, "optimum": found.values}
    known = {k: v for k, v in parts.items() if v is not None}
    with plot_style():
        if np.iscomplexobj(found.values):
            drawing = new_figure(4.6)
            _optimum_plane(drawing.subplots(), known)
        else:
            drawing = new_figure(0.9 + 2.2 * len(found.of))
            axes = drawing.subplots(len(found.of), 1, squeeze=False, sharex=True)[:, 0]
            for k, ax in enumerate(axes):
                _optimum_panel(ax, found, {name: v[:, k] for name, v in known.items()}, k)
                ax.label_outer()
            axes[0].legend(**LEGEND_BESIDE)
            drawing.align_ylabels(axes)
        set_title(drawing, "optimum: " + ", ".join(f"{k} = {v:.6g}" for k, v in list(found.parameters.items())[:4]))
        return finish_figure(drawing, path)


def _optimum_panel(ax: Any, found: Optimum, values: dict[str, np.ndarray], k: int) -> None:
    ax.set_title(found.of[k])
    ax.set_ylabel(axis_label("", found.units[k]))
    for i, (name, v) in enumerate(values.items()):
        if len(found.t) > 1:
            ax.plot(found.t, v, label=name, **{k: x for k, x in OPTIMUM_STYLES[name].items() if k != "marker"})
            ax.set_xlabel("time [s]")
        else:
            ax.plot([i], v, label=name, **OPTIMUM_STYLES[name] | {"linestyle": "none"})
    if len(found.t) == 1:
        ax.set_xticks(range(len(values)), list(values))
        ax.margins(0.3)


def _optimum_plane(ax: Any, values: dict[str, np.ndarray]) -> None:
    for name, v in values.items():
        ax.plot(v.ravel().real, v.ravel().imag, label=name, **OPTIMUM_STYLES[name] | {"linestyle": "none"})
    ax.axvline(0.0, color="#8a8a8a", linewidth=0.8)
    ax.set_xlabel("real part [1/s]")
    ax.set_ylabel("imaginary part [rad/s]")
    ax.legend(**LEGEND_BESIDE)
