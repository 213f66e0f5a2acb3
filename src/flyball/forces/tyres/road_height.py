"""Height and slope of a road at a point: a grid along x and y, or along a curved reference line and across it.

A road stands in ``surfaces`` from place ``at`` on as::

    points of the reference line, or 0 for a straight one along x; place of the grid, from ``at``
    first arc length, spacing, coefficients of x, of y (of uniform cubic B-splines, two more than points)
    x0, y0, width of a cell, columns, rows, arc length near the middle of each cell (nan where there is no road)

and its grid (`math.grid_spline`), whose first argument is x or the arc length s, and whose second is y or the distance
t to the left of the line. With the curve c(s), s is found from (p - c).c' = 0; the gradient of s is c' / (c'.c' - (p -
c).c''), that of t the normal of the curve.
"""

from __future__ import annotations

import math

import numpy as np

from ...compiler.formulas import formula, when_compiling
from ...math.grid_spline import MARGIN, grid_spline, pack_grid, weights
from ...math.scalar import sqrt

PASSES = 6  # of Newton's method
LINE = 2  # place of the first arc length


@formula
def line_point(surfaces, at, s):
    """Return the reference line at s with two derivatives: (x, x', x'', y, y', y'')."""
    n, ds = int(surfaces[at]), surfaces[at + LINE + 1]
    place = (s - surfaces[at + LINE]) / ds
    i = min(max(int(place.real), 0), n - 2) if place.real == place.real else 0
    u = place - i
    a, a1 = weights(u)
    a2 = (1.0 - u, 3.0 * u - 2.0, 1.0 - 3.0 * u, u)
    o = 0.0 * u
    x, x1, x2, y, y1, y2 = o, o, o, o, o, o
    first = at + LINE + 2 + i
    for k in range(4):
        cx, cy = surfaces[first + k], surfaces[first + k + n + 2]
        x, x1, x2 = x + a[k] * cx, x1 + a1[k] * cx, x2 + a2[k] * cx
        y, y1, y2 = y + a[k] * cy, y1 + a1[k] * cy, y2 + a2[k] * cy
    return x, x1 / ds, x2 / (ds * ds), y, y1 / ds, y2 / (ds * ds)


@formula
def nearest(surfaces, at, x, y):
    """Return an arc length near the point, from the table of cells; nan where there is no road."""
    cells = at + LINE + 2 + 2 * (int(surfaces[at]) + 2)
    width = surfaces[cells + 2]
    i, j = (x.real - surfaces[cells]) / width, (y.real - surfaces[cells + 1]) / width
    columns, rows = surfaces[cells + 3], surfaces[cells + 4]
    if not (0.0 <= i < columns and 0.0 <= j < rows):
        return math.nan
    return surfaces[cells + 5 + int(i) * int(rows) + int(j)]


@formula
def curved_height(surfaces, at, x, y):
    """Return height and slopes of a road along a curved line at one point."""
    s = nearest(surfaces, at, x, y) + 0.0 * (x + y)
    for _ in range(PASSES):
        cx, x1, x2, cy, y1, y2 = line_point(surfaces, at, s)
        along = (x - cx) * x1 + (y - cy) * y1
        s = s + along / (x1 * x1 + y1 * y1 - (x - cx) * x2 - (y - cy) * y2)
    cx, x1, x2, cy, y1, y2 = line_point(surfaces, at, s)
    speed = sqrt(x1 * x1 + y1 * y1)
    bend = speed * speed - (x - cx) * x2 - (y - cy) * y2
    left = ((y - cy) * x1 - (x - cx) * y1) / speed
    z, zs, zt = grid_spline(surfaces, at + int(surfaces[at + 1]), s, left)
    return z, zs * x1 / bend - zt * y1 / speed, zs * y1 / bend + zt * x1 / speed


@formula
def number_height(surfaces, at, x, y):
    """`road_height` at one point."""
    if surfaces[at] > 0.0:
        return curved_height(surfaces, at, x, y)
    return grid_spline(surfaces, at + int(surfaces[at + 1]), x, y)


def road_height(surfaces, at, x, y):
    """Height at (x, y) of the road at ``surfaces[at]``, and its slopes by x and y; nan where there is no road."""
    if isinstance(x, np.ndarray) or isinstance(y, np.ndarray):
        kind = np.result_type(np.asarray(x).dtype, np.asarray(y).dtype, float)
        return np.vectorize(lambda a, b: number_height(surfaces, at, a, b), otypes=[kind] * 3)(x, y)
    return number_height(surfaces, at, x, y)


@when_compiling
def _register() -> None:
    """Register the compiled version, for single numbers."""
    from ...compiler.numba_target import overload

    @overload(road_height)
    def choose(surfaces, at, x, y):
        return lambda surfaces, at, x, y: number_height(surfaces, at, x, y)


def uniform_spline(values: np.ndarray) -> np.ndarray:
    """Coefficients of the uniform cubic B-spline through the values (n, ...), two more than these."""
    from scipy.ndimage import spline_filter1d

    steps = np.arange(1, MARGIN + 1)[:, None]
    before = values[:1] - steps[::-1] * (values[1] - values[0])
    behind = values[-1:] + steps * (values[-1] - values[-2])
    c = spline_filter1d(np.concatenate([before, values, behind]), order=3, axis=0, mode="mirror")
    return c[MARGIN - 1 : 1 - MARGIN]


def pack_straight(z: np.ndarray, x: tuple[float, float], y: tuple[float, float], hold: bool) -> np.ndarray:
    """Numbers of a road on a grid along x and y."""
    return np.r_[0.0, 2.0, pack_grid(z, x, y, hold)]


MOST_CELLS = 250_000  # of the table that finds the nearest part of the line


def pack_curved(
    z: np.ndarray, s: tuple[float, float], t: tuple[float, float], line: np.ndarray, hold: bool
) -> np.ndarray:
    """Numbers of a road along a line: points (n, 2) at the arc lengths of the grid."""
    from scipy.spatial import cKDTree

    widest = max(abs(t[0]), abs(t[0] + t[1] * (z.shape[1] - 1)))
    low, high = line.min(axis=0) - widest, line.max(axis=0) + widest
    width = max(0.5 * widest, math.sqrt(np.prod(high - low) / MOST_CELLS))
    count = np.ceil((high - low) / width).astype(int)
    middle = low + width * (np.stack(np.meshgrid(*map(np.arange, count), indexing="ij"), axis=-1) + 0.5)
    away, near = cKDTree(line).query(middle.reshape(-1, 2))
    start = np.where(away <= widest + width, s[0] + s[1] * near, math.nan)
    c = uniform_spline(line)
    body = np.r_[s, c[:, 0], c[:, 1], low, width, count, start]
    return np.r_[float(len(line)), LINE + len(body), body, pack_grid(z, s, t, hold)]
