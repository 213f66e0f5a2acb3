"""Biquintic B-splines on uniform grids in a flat list of numbers: heights of roads, for formulas and compiled code.

A grid of nx by ny points stands in an array from place ``at`` on as::

    nx, ny, x0, dx, y0, dy, hold, (nx + 4) (ny + 4) coefficients, those of the first x first

The spline interpolates and has four continuous derivatives (de Boor, *A Practical Guide to Splines*, 1978, chapter
XVII): a motion over it passes a knot every few milliseconds, and at the jumps of a third derivative integrators of high
order would shorten their steps. At the edges its curvature across them is zero. Beyond the grid the value is nan, or,
where ``hold`` is 1, that of the nearest edge. Where a point has no value, it is nan, and so is the spline nearer than
three cells.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ..compiler.formulas import formula, when_compiling

HEAD = 7  # numbers before the coefficients
ORDER = 5  # of the splines; a cell has ORDER + 1 weights
EXTRA = 2  # coefficients beyond each edge
MARGIN = 30  # cells beyond the edges, where the grid is continued: what is beyond them is felt by less than 2e-11
GRACE = 1e-9  # cells: margin for rounding at the edges


def grid_spline(data, at, x, y):
    """Value at (x, y) and its derivatives by x and y of the grid at ``data[at]``.

    ``x`` and ``y`` are floats, complex numbers (their real parts choose the cell) or arrays.
    """
    if isinstance(x, np.ndarray) or isinstance(y, np.ndarray):
        kind = np.result_type(np.asarray(x).dtype, np.asarray(y).dtype, float)
        return np.vectorize(lambda a, b: grid_value(data, at, a, b), otypes=[kind] * 3)(x, y)
    return grid_value(data, at, x, y)


@formula
def cell(s, n, hold):
    """Return the cell of n - 1 in which the coordinate s lies, s within it, and 1 inside, 0 where it is held there."""
    place = s.real
    if not place >= -GRACE or not place <= n - 1.0 + GRACE:
        if hold > 0.0 and place == place:
            return (0, 0.0 * s, 0.0) if place < 0.0 else (n - 2, 0.0 * s + 1.0, 0.0)
        return 0, 0.0 * s + math.nan, 1.0
    i = min(max(int(place), 0), n - 2)
    return i, s - i, 1.0


@formula
def weights(u):
    """Return the six quintic B-splines of a cell at u, from 0 to 1, and their first and second derivatives."""
    w = 1.0 - u
    s, r = u * u, w * w
    outer, inner = outer_weight(u), inner_weight(u)
    outer_w, inner_w = outer_weight(w), inner_weight(w)
    return (
        (r * r * w / 120.0, outer[0], inner[0], inner_w[0], outer_w[0], s * s * u / 120.0),
        (-r * r / 24.0, outer[1], inner[1], -inner_w[1], -outer_w[1], s * s / 24.0),
        (r * w / 6.0, outer[2], inner[2], inner_w[2], outer_w[2], s * u / 6.0),
    )


@formula
def outer_weight(u):
    """Return the second B-spline of a cell at u, with two derivatives."""
    return (
        (26.0 + u * (-50.0 + u * (20.0 + u * (20.0 + u * (-20.0 + 5.0 * u))))) / 120.0,
        (-10.0 + u * (8.0 + u * (12.0 + u * (-16.0 + 5.0 * u)))) / 24.0,
        (2.0 + u * (6.0 + u * (-12.0 + 5.0 * u))) / 6.0,
    )


@formula
def inner_weight(u):
    """Return the third B-spline of a cell at u, with two derivatives."""
    s = u * u
    return (
        (66.0 + s * (-60.0 + s * (30.0 - 10.0 * u))) / 120.0,
        u * (-12.0 + s * (12.0 - 5.0 * u)) / 12.0,
        (-3.0 + s * (9.0 - 5.0 * u)) / 3.0,
    )


@formula
def grid_value(data, at, x, y):
    """`grid_spline` at one point."""
    nx, ny, hold = int(data[at]), int(data[at + 1]), data[at + 6]
    dx, dy = data[at + 3], data[at + 5]
    i, u, inside_x = cell((x - data[at + 2]) / dx, nx, hold)
    j, v, inside_y = cell((y - data[at + 4]) / dy, ny, hold)
    a, a1, _ = weights(u)
    b, b1, _ = weights(v)
    o = 0.0 * (u + v)
    z, zx, zy = o, o, o
    for k in range(ORDER + 1):
        first = at + HEAD + (i + k) * (ny + 2 * EXTRA) + j
        row, slope = o, o
        for l in range(ORDER + 1):
            row += b[l] * data[first + l]
            slope += b1[l] * data[first + l]
        z += a[k] * row
        zx += a1[k] * row
        zy += a[k] * slope
    return z, inside_x * zx / dx, inside_y * zy / dy


def pack_grid(z: np.ndarray, x: tuple[float, float], y: tuple[float, float], hold: bool) -> np.ndarray:
    """Flat list of a grid of heights (nx, ny); ``x`` and ``y`` are the first coordinate and the spacing."""
    from scipy.ndimage import distance_transform_edt, spline_filter

    missing = np.isnan(z)
    if missing.any():  # filled with the nearest height, so that the coefficients elsewhere are numbers
        nearest: Any = distance_transform_edt(missing, return_distances=False, return_indices=True)
        z = z[tuple(nearest)]
    c = spline_filter(np.pad(z, MARGIN, mode="reflect", reflect_type="odd"), order=ORDER, mode="mirror")
    c = c[MARGIN - EXTRA : EXTRA - MARGIN, MARGIN - EXTRA : EXTRA - MARGIN]
    c[EXTRA:-EXTRA, EXTRA:-EXTRA][missing] = math.nan
    return np.r_[z.shape, *x, *y, float(hold), c.ravel()]


@when_compiling
def _register() -> None:
    """Register the compiled version, for single numbers."""
    from ..compiler.numba_target import overload

    @overload(grid_spline)
    def choose(data, at, x, y):
        return lambda data, at, x, y: grid_value(data, at, x, y)
