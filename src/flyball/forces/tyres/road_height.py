"""Height and slope of a road at a point: a grid along x and y, or along a curved reference line and across it.

A road stands in ``surfaces`` from place ``at`` on as::

    points of the reference line, or 0 for a straight one along x; place of the grid, from ``at``
    first arc length, spacing, distance of the road's middle to the left, coefficients of x, of y (of uniform quintic
    B-splines, four more than points)
    x0, y0, width of a cell, columns, rows, arc length near the middle of each cell (nan where there is no road)

and its grid (`math.grid_spline`), whose first argument is x or the arc length s, and whose second is y or the distance
t to the left of the line. With the curve c(s), s is found from (p - c).c' = 0; the gradient of s is c' / (c'.c' - (p -
c).c''), that of t the normal of the curve. Where legs of a road lie side by side, a point belongs to that of whose
middle it is nearest. Beyond its ends the line is straight.
"""

from __future__ import annotations

import math

import numpy as np

from ...compiler.formulas import formula, when_compiling
from ...math.grid_spline import EXTRA, HEAD, MARGIN, ORDER, grid_spline, pack_grid, weights
from ...math.scalar import sqrt

PASSES = 6  # of Newton's method
LINE = 2  # place of the first arc length
MIDDLE = LINE + 2  # place of the middle
POINTS = MIDDLE + 1  # place of the coefficients
TABLE_LIMIT = 1e9  # cells: beyond it a point is nowhere near the road
SAME_LEG = 8.0  # widths of a cell: distance along the line from which on two places belong to different legs


@formula
def line_point(surfaces, at, s):
    """Return the reference line at s with two derivatives: (x, x', x'', y, y', y'')."""
    n, ds = int(surfaces[at]), surfaces[at + LINE + 1]
    place = (s - surfaces[at + LINE]) / ds
    inside = min(max(place.real, 0.0), n - 1.0) if place.real == place.real else 0.0
    i = min(int(inside), n - 2)
    beyond = 0.0 * place if inside == place.real else place - inside
    u = place - beyond - i
    a, a1, a2 = weights(u)
    o = 0.0 * u
    x, x1, x2, y, y1, y2 = o, o, o, o, o, o
    first = at + POINTS + i
    for k in range(ORDER + 1):
        cx, cy = surfaces[first + k], surfaces[first + k + n + 2 * EXTRA]
        x, x1, x2 = x + a[k] * cx, x1 + a1[k] * cx, x2 + a2[k] * cx
        y, y1, y2 = y + a[k] * cy, y1 + a1[k] * cy, y2 + a2[k] * cy
    if beyond.real != 0.0:
        x, y, x2, y2 = x + beyond * x1, y + beyond * y1, o, o
    return x, x1 / ds, x2 / (ds * ds), y, y1 / ds, y2 / (ds * ds)


@formula
def cell_start(surfaces, at, i, j):
    """Return an arc length near the middle of a cell of the table; nan where there is no road."""
    cells = at + POINTS + 2 * (int(surfaces[at]) + 2 * EXTRA)
    columns, rows = int(surfaces[cells + 3]), int(surfaces[cells + 4])
    if surfaces[at + int(surfaces[at + 1]) + HEAD - 1] > 0.0:  # its edges are held
        i, j = min(max(i, 0), columns - 1), min(max(j, 0), rows - 1)
    if not (0 <= i < columns and 0 <= j < rows):
        return math.nan
    return surfaces[cells + 5 + i * rows + j]


@formula
def foot(surfaces, at, start, x, y):
    """Return the arc length of the point of the line next to a point, near a given one."""
    s = start + 0.0 * (x + y)
    for _ in range(PASSES):
        cx, x1, x2, cy, y1, y2 = line_point(surfaces, at, s)
        along = (x - cx) * x1 + (y - cy) * y1
        s = s + along / (x1 * x1 + y1 * y1 - (x - cx) * x2 - (y - cy) * y2)
    return s


@formula
def nearest(surfaces, at, x, y):
    """Return the arc length of the point of the line next to a point, on the leg to which that belongs."""
    cells = at + POINTS + 2 * (int(surfaces[at]) + 2 * EXTRA)
    width, length = surfaces[cells + 2], (surfaces[at] - 1.0) * surfaces[at + LINE + 1]
    best, least, last = 0.0 * (x + y) + math.nan, math.inf, math.nan
    column, row = (x.real - surfaces[cells]) / width, (y.real - surfaces[cells + 1]) / width
    if not (-TABLE_LIMIT < column < TABLE_LIMIT and -TABLE_LIMIT < row < TABLE_LIMIT):
        return best
    for k in range(4):  # the cells whose middles surround the point: of two legs, one of them knows the right one
        start = cell_start(surfaces, at, math.floor(column - 0.5) + k // 2, math.floor(row - 0.5) + k % 2)
        if start != start or abs(start - last) < SAME_LEG * width:
            continue
        last = start
        s = foot(surfaces, at, start, x, y)
        cx, x1, _, cy, y1, _ = line_point(surfaces, at, s)
        left = ((y - cy) * x1 - (x - cx) * y1).real / sqrt(x1 * x1 + y1 * y1).real
        away, beyond = left - surfaces[at + MIDDLE], s.real - surfaces[at + LINE]
        beyond = max(-beyond, beyond - length, 0.0)
        if away * away + beyond * beyond < least:
            best, least = s, away * away + beyond * beyond
    return best


@formula
def curved_height(surfaces, at, x, y):
    """Return height and slopes of a road along a curved line at one point."""
    s = nearest(surfaces, at, x, y)
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
    """Coefficients of the uniform quintic B-spline through the values (n, ...); its even derivatives end at zero."""
    from scipy.ndimage import spline_filter1d

    padded = np.pad(values, ((MARGIN, MARGIN), (0, 0)), mode="reflect", reflect_type="odd")
    return spline_filter1d(padded, order=ORDER, axis=0, mode="mirror")[MARGIN - EXTRA : EXTRA - MARGIN]


def pack_straight(z: np.ndarray, x: tuple[float, float], y: tuple[float, float], hold: bool) -> np.ndarray:
    """Numbers of a road on a grid along x and y."""
    return np.r_[0.0, 2.0, pack_grid(z, x, y, hold)]


MOST_CELLS = 250_000  # of the table that finds the nearest part of the line


def pack_curved(
    z: np.ndarray, s: tuple[float, float], t: tuple[float, float], line: np.ndarray, hold: bool
) -> np.ndarray:
    """Numbers of a road along a line: points (n, 2) at the arc lengths of the grid."""
    from scipy.spatial import cKDTree

    half = 0.5 * t[1] * (z.shape[1] - 1)
    to_middle = t[0] + half
    along = np.gradient(line, axis=0)
    along /= np.hypot(*along.T)[:, None]
    centres = line + to_middle * np.stack([-along[:, 1], along[:, 0]], axis=1)
    low, high = centres.min(axis=0) - half, centres.max(axis=0) + half
    width = max(0.5 * half, math.sqrt(np.prod(high - low) / MOST_CELLS))
    low = low - width  # so that each point of the road has four cells around it
    count = np.ceil((high + width - low) / width).astype(int)
    middle = low + width * (np.stack(np.meshgrid(*map(np.arange, count), indexing="ij"), axis=-1) + 0.5)
    away, near = cKDTree(centres).query(middle.reshape(-1, 2))
    start = s[0] + s[1] * near
    if not hold:
        start = np.where(away <= half + 2.0 * width + s[1], start, math.nan)
    c = uniform_spline(line)
    body = np.r_[s, to_middle, c[:, 0], c[:, 1], low, width, count, start]
    return np.r_[float(len(line)), LINE + len(body), body, pack_grid(z, s, t, hold)]
