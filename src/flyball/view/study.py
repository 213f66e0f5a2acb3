"""Studies as pictures: over one parameter, as a surface over two, scattered over more, and how often values occur."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import ModelError
from .drawing import BESIDE, PALETTE, PRETTY, handed_out, headed, new_figure, styled
from .smoothing import surface_of_means

if TYPE_CHECKING:
    from ..results.indices import Indices
    from ..results.study import Study

MOST_CURVES = 40  # that are drawn one by one
BANDS = ((5.0, 95.0, 0.15), (25.0, 75.0, 0.3))  # percent, and how dark what lies between them is
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
                _over_time(ax, found, name)
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
                ax.hist(y, bins="auto" if np.ptp(y) > 0.0 else 1, color=PALETTE[0], edgecolor="white", linewidth=0.5)
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


def _title(found: Study) -> str:
    return f"{found.name}: {int(found.done.sum())} of {len(found)} runs"


def _label(found: Study, name: str) -> str:
    unit = found.unit(name)
    return f"{name} [{PRETTY.get(unit, unit)}]" if unit else name


def _over_time(ax: Any, found: Study, name: str) -> None:
    """A few curves as they are; of many the median, and between what most lie."""
    y = found.values[name][found.done]
    if len(y) <= MOST_CURVES:
        for curve in y:
            ax.plot(found.t, curve, color=PALETTE[0], alpha=0.5, linewidth=0.9)
    else:
        for low, high, dark in BANDS:
            a, b = np.nanpercentile(y, (low, high), axis=0)
            ax.fill_between(found.t, a, b, color=PALETTE[0], alpha=dark, linewidth=0, label=f"{low:g} to {high:g} %")
        ax.plot(found.t, np.nanmedian(y, axis=0), color=PALETTE[0], label="median")
        ax.legend(**BESIDE)
    ax.set_xlabel("time [s]")
    ax.set_ylabel(_label(found, name))


def _over_one(ax: Any, found: Study, name: str) -> None:
    order = np.argsort(found.points[:, 0], kind="stable")
    ax.plot(found.points[order, 0], found.values[name][order], marker="o" if len(found) <= MOST_CURVES else None)
    ax.set_xlabel(found.parameters[0])
    ax.set_ylabel(_label(found, name))


def _scattered(row: Any, found: Study, name: str) -> None:
    for k, (ax, parameter) in enumerate(zip(row, found.parameters, strict=True)):
        ax.plot(found.points[:, k], found.values[name], ".", markersize=3 if len(found) > 200 else 5, alpha=0.6)
        ax.set_xlabel(parameter)
        if k == 0:
            ax.set_ylabel(_label(found, name))
        else:
            ax.sharey(row[0])


def _over_samples(ax: Any, x: np.ndarray, y: np.ndarray, z: np.ndarray, scattered: bool) -> Any:
    """By triangles between samples; the smooth mean where others vary too; by their colours if they lie on a line."""
    from scipy.spatial import Delaunay, QhullError

    if len(z) < 3:
        return ax.scatter(x, y, c=z)
    try:
        triangles = Delaunay(np.column_stack([(v - v.mean()) / (np.ptp(v) or 1.0) for v in (x, y)])).simplices
    except (QhullError, ValueError):
        return ax.scatter(x, y, c=z)
    if scattered:
        a, b, mean = surface_of_means(x, y, z)
        drawn = ax.contourf(a, b, np.ma.masked_invalid(mean), LEVELS)
    else:
        drawn = ax.tricontourf(x, y, triangles, z, LEVELS)
    ax.plot(x, y, ".", color="#222222", markersize=1.5, alpha=0.5)
    return drawn


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
        drawn = ax.contourf(found.axes[i][a], found.axes[j][b], np.ma.masked_invalid(mean[np.ix_(b, a)]), LEVELS)
    else:
        known = np.isfinite(found.values[name])
        px, py, z = found.points[known, i], found.points[known, j], found.values[name][known]
        varied = any(np.ptp(x) > 0.0 for k, x in enumerate(found.points[known].T) if k not in (i, j))
        drawn = _over_samples(ax, px, py, z, varied)
    drawing.colorbar(drawn, ax=ax, label=_label(found, name))
    ax.set_xlabel(x)
    ax.set_ylabel(y)
