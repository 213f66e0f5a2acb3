"""Studies as pictures: over one parameter, as a surface over two, scattered over more, and how often values occur."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import ModelError
from .drawing import BESIDE, PALETTE, handed_out, headed, new_figure, styled, titled
from .logs import logarithmic, scale, shades
from .smoothing import surface_of_means
from .study_curves import over_time

if TYPE_CHECKING:
    from ..results.indices import Indices
    from ..results.study import Study

MARKED = 40  # points on a line that are marked
VAST = 100.0  # the largest over the least of quantities that may need a logarithmic axis
LEVELS = 24
Path = str | os.PathLike | None


def study(found: Study, of: Sequence[str], path: Path = None) -> Any:
    """See `Study.plot`."""
    names = _named(found, of)
    curves = [name for name in names if found.values[name].ndim > 1]
    d = len(found.parameters)
    with styled():
        columns = d if d > 2 and len(curves) < len(names) else 1
        drawing = new_figure(0.9 + 2.6 * len(names), max(8.0, 2.6 * columns))
        grid = drawing.add_gridspec(len(names), columns)
        for i, name in enumerate(names):
            if d > 2 and name not in curves:
                _scattered([drawing.add_subplot(grid[i, k]) for k in range(d)], found, name)
                continue
            ax = drawing.add_subplot(grid[i, :])
            if name in curves:
                over_time(drawing, ax, found, name)
                ax.set_ylabel(_label(found, name))
            elif d == 1:
                _over_one(ax, found, name)
            else:
                _surface(drawing, ax, found, name, *found.parameters)
        headed(drawing, _title(found))
        return handed_out(drawing, path)


def scatter(found: Study, of: Sequence[str], path: Path = None) -> Any:
    """See `Study.scatter`."""
    names = _numbers(found, of)
    with styled():
        drawing = new_figure(0.9 + 2.6 * len(names), max(5.0, 2.8 * len(found.parameters)))
        axes = drawing.subplots(len(names), len(found.parameters), squeeze=False)
        for row, name in zip(axes, names, strict=True):
            _scattered(row, found, name)
        headed(drawing, _title(found))
        return handed_out(drawing, path)


def histogram(found: Study, of: Sequence[str], path: Path = None) -> Any:
    """See `Study.histogram`."""
    names = _numbers(found, of)
    with styled():
        drawing = new_figure(0.9 + 2.4 * len(names))
        for ax, name in zip(drawing.subplots(len(names), 1, squeeze=False)[:, 0], names, strict=True):
            y = found.values[name]
            y = y[np.isfinite(y)]
            if len(y):
                scale(ax, "x", y, VAST)
                ax.hist(y, bins=_bins(y), color=PALETTE[0], edgecolor="white", linewidth=0.5)
                for q, style in ((5.0, ":"), (50.0, "-"), (95.0, ":")):
                    ax.axvline(np.percentile(y, q), color=PALETTE[1], linestyle=style, linewidth=1.2)
            ax.set_xlabel(_label(found, name))
            ax.set_ylabel("runs")
        headed(drawing, f"{_title(found)}; lines: median, 5 and 95 %")
        return handed_out(drawing, path)


def surface(found: Study, of: str, x: str, y: str, path: Path = None) -> Any:
    """See `Study.surface`."""
    (name,) = _numbers(found, (of,))
    for p in (x, y):
        if p not in found.parameters:
            raise ModelError(f"the study varies {', '.join(found.parameters)}, not {p!r}")
    if x == y:
        raise ModelError(f"a surface is over two parameters, not twice over {x!r}")
    with styled():
        drawing = new_figure(5.0)
        _surface(drawing, drawing.subplots(), found, name, x, y)
        headed(drawing, _title(found))
        return handed_out(drawing, path)


def indices(found: Indices, path: Path = None) -> Any:
    """See `Indices.plot`."""
    with styled():
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
            ax.legend(**BESIDE)
        headed(drawing, f"Sobol' indices, {found.samples} samples")
        return handed_out(drawing, path)


def _named(found: Study, of: Sequence[str]) -> list[str]:
    for name in of:
        found[name]  # says what there is
    return list(of or found.of)


def _numbers(found: Study, of: Sequence[str]) -> list[str]:
    """Quantities that are one number a run."""
    names = _named(found, of) if of else [name for name in found.of if found.values[name].ndim == 1]
    curves = [name for name in names if found.values[name].ndim > 1]
    if curves or not names:
        name = (curves or list(found.of))[0]
        raise ModelError(f"{name} is a curve; ask for end({name}), or max, min, mean, rms of it")
    return names


def _bins(y: np.ndarray) -> Any:
    """Edges of a histogram, by logarithms where its axis is."""
    if logarithmic(y, VAST):
        return np.exp(np.histogram_bin_edges(np.log(y), "auto"))
    return "auto" if np.ptp(y) > 0.0 else 1


def _title(found: Study) -> str:
    return f"{found.name}: {int(found.done.sum())} of {len(found)} runs"


def _label(found: Study, name: str) -> str:
    return titled(name, found.unit(name))


def _over_one(ax: Any, found: Study, name: str) -> None:
    order = np.argsort(found.points[:, 0], kind="stable")
    ax.plot(found.points[order, 0], found.values[name][order], marker="o" if len(found) <= MARKED else None)
    scale(ax, "x", found.points[:, 0])
    scale(ax, "y", found.values[name], VAST)
    ax.set_xlabel(found.parameters[0])
    ax.set_ylabel(_label(found, name))


def _scattered(row: Any, found: Study, name: str) -> None:
    for k, (ax, parameter) in enumerate(zip(row, found.parameters, strict=True)):
        ax.plot(found.points[:, k], found.values[name], ".", markersize=3 if len(found) > 200 else 5, alpha=0.6)
        scale(ax, "x", found.points[:, k])
        ax.set_xlabel(parameter)
        if k == 0:
            scale(ax, "y", found.values[name], VAST)
            ax.set_ylabel(_label(found, name))
        else:
            ax.sharey(row[0])


def _over_samples(ax: Any, x: np.ndarray, y: np.ndarray, z: np.ndarray, scattered: bool) -> Any:
    """By triangles between samples; the smooth mean where others vary too; by their colours if they lie on a line."""
    from scipy.spatial import Delaunay, QhullError

    if len(z) < 3:
        return ax.scatter(x, y, c=z)
    shown = (x, y)
    x, y = (np.log(v) if logarithmic(v) else v for v in shown)
    try:
        triangles = Delaunay(np.column_stack([(v - v.mean()) / (np.ptp(v) or 1.0) for v in (x, y)])).simplices
    except (QhullError, ValueError):
        return ax.scatter(*shown, c=z)
    if scattered:
        a, b, mean = surface_of_means(x, y, z)
        a, b = (np.exp(v) if logarithmic(old) else v for v, old in zip((a, b), shown, strict=True))
        drawn = ax.contourf(a, b, np.ma.masked_invalid(mean), **_levels(mean))
    else:
        drawn = ax.tricontourf(*shown, triangles, z, **_levels(z))
    ax.plot(*shown, ".", color="#222222", markersize=1.5, alpha=0.5)
    return drawn


def _levels(z: np.ndarray) -> dict[str, Any]:
    """Where colours change, by logarithms of what is spread in these."""
    if not logarithmic(z, VAST):
        return {"levels": LEVELS}
    low, high = float(np.nanmin(z)), float(np.nanmax(z))
    return {"levels": np.geomspace(low, high, LEVELS + 1), "norm": shades(z, VAST)}


def _surface(drawing: Any, ax: Any, found: Study, name: str, x: str, y: str) -> None:
    """Over a grid as it is, the mean over its other axes; over samples what lies between them."""
    i, j = found.parameters.index(x), found.parameters.index(y)
    values = found[name]
    if found.axes and min(len(found.axes[i]), len(found.axes[j])) > 1:
        others = tuple(k for k in range(len(found.axes)) if k not in (i, j))
        there = np.isfinite(values).sum(axis=others)
        mean = np.where(there > 0, np.nansum(values, axis=others) / np.maximum(there, 1), np.nan)
        mean = mean if i > j else mean.T
        a, b = np.argsort(found.axes[i]), np.argsort(found.axes[j])
        drawn = ax.contourf(
            found.axes[i][a], found.axes[j][b], np.ma.masked_invalid(mean[np.ix_(b, a)]), **_levels(mean)
        )
    else:
        known = np.isfinite(found.values[name])
        px, py, z = found.points[known, i], found.points[known, j], found.values[name][known]
        varied = any(np.ptp(x) > 0.0 for k, x in enumerate(found.points[known].T) if k not in (i, j))
        drawn = _over_samples(ax, px, py, z, varied)
    drawing.colorbar(drawn, ax=ax, label=_label(found, name))
    scale(ax, "x", found.points[:, i])
    scale(ax, "y", found.points[:, j])
    ax.set_xlabel(x)
    ax.set_ylabel(y)
