"""Curves of many runs over time: a few by themselves, coloured by what varies; of many what most of them do."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from .drawing import BESIDE, DASHES, PALETTE
from .logs import shades

if TYPE_CHECKING:
    from ..results.study import Study

MOST = 40  # that are drawn one by one
NAMED = 8  # that are told by a legend
BANDS = ((5.0, 95.0, 0.15), (25.0, 75.0, 0.3))  # percent, and how dark what lies between them is
DARKEST, BRIGHTEST = 0.0, 0.88  # parts of the colour map that can be seen on white


def over_time(drawing: Any, ax: Any, found: Study, name: str) -> None:
    """Draw the curves of one quantity."""
    y, points = found.values[name][found.done], found.points[found.done]
    if len(y) > MOST:
        _bands(ax, found.t, y)
    elif len(y) > NAMED:
        _shaded(drawing, ax, found, y, points)
    elif len(y):
        _named(ax, found, y, points)
    ax.set_xlabel("time [s]")


def _bands(ax: Any, t: np.ndarray, y: np.ndarray) -> None:
    for low, high, dark in BANDS:
        a, b = np.nanpercentile(y, (low, high), axis=0)
        ax.fill_between(t, a, b, color=PALETTE[0], alpha=dark, linewidth=0, label=f"{low:g} to {high:g} %")
    ax.plot(t, np.nanmedian(y, axis=0), color=PALETTE[0], label="median")
    ax.legend(**BESIDE)


def _named(ax: Any, found: Study, y: np.ndarray, points: np.ndarray) -> None:
    """Each with the values of its parameters."""
    varied = [k for k in range(points.shape[1]) if np.ptp(points[:, k]) > 0.0] or [0]
    for i, (curve, point) in enumerate(zip(y, points, strict=True)):
        label = ", ".join(f"{found.parameters[k]} = {point[k]:.4g}" for k in varied)
        style = DASHES[i // len(PALETTE) % len(DASHES)]
        ax.plot(found.t, curve, color=PALETTE[i % len(PALETTE)], linestyle=style, linewidth=1.2, label=label)
    ax.legend(**BESIDE)


def _shaded(drawing: Any, ax: Any, found: Study, y: np.ndarray, points: np.ndarray) -> None:
    """By the value of the parameter that tells most of them apart."""
    from matplotlib import colormaps
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import ListedColormap

    k = telling(points, y)
    norm, colours = shades(points[:, k]), ListedColormap(colormaps["viridis"](np.linspace(DARKEST, BRIGHTEST, 256)))
    for curve, x in zip(y, points[:, k], strict=True):
        ax.plot(found.t, curve, color=colours(norm(x)), linewidth=1.1)
    drawing.colorbar(ScalarMappable(norm, colours), ax=ax, label=found.parameters[k])


def telling(points: np.ndarray, y: np.ndarray) -> int:
    """The parameter that the curves depend on most: by how much a straight line over its ranks explains of them."""
    known = y[:, np.isfinite(y).all(axis=0)]
    ranks = np.argsort(np.argsort(points, axis=0, kind="stable"), axis=0).astype(float)
    ranks = np.stack([_tied(x, r) for x, r in zip(points.T, ranks.T, strict=True)], axis=1)
    ranks -= ranks.mean(axis=0)
    size = np.maximum((ranks**2).sum(axis=0), 1e-300)
    explained = ((ranks.T @ (known - known.mean(axis=0))) ** 2).sum(axis=1) / size
    return int(np.argmax(explained))


def _tied(x: np.ndarray, ranks: np.ndarray) -> np.ndarray:
    """Equal values have the mean of their ranks."""
    _, group = np.unique(x, return_inverse=True)
    return (np.bincount(group, ranks) / np.bincount(group))[group]
