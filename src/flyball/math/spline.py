"""Piecewise cubics in a flat list of numbers: interpolated tables for formulas, arrays and compiled code.

A spline of m breaks stands in an array from place ``at`` on as::

    period, m, break[0] ... break[m-1], piece 0, piece 1, ..., piece m

with four coefficients c0 c1 c2 c3 for each piece, f = c0 + c1 s + c2 s^2 + c3 s^3. Piece k covers break[k-1] to
break[k], and s = x - break[k-1]; piece 0 extends the spline before the first break (there s = x - break[0]), piece m
behind the last one. A break belongs to the piece behind it, the last one to the piece before it, so that the ends of a
table count as inside. With a period greater than zero, x is first brought into [break[0], break[0] + period). Where a
spline must not be evaluated beyond its ends, the outer pieces are nan, and begin slightly farther out, beyond rounding
errors (`GRACE`).
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ..compiler.formulas import formula, when_compiling

GRACE = 1e-9  # relative to a table's width: margin for rounding at its ends
BREAKS = 2  # place of the first break
PIECE = 4  # numbers for each piece


def spline(data, at, x):
    """Value, first and second derivative at ``x`` of the spline at ``data[at]``.

    ``x`` is a float, a complex number (its real part chooses the piece), an array, or an expression (or an array of
    these), whose method ``tabulated(data, at)`` gives the result. ``data`` is an array of floats or complex numbers
    (for single numbers also a list).
    """
    if hasattr(x, "tabulated"):
        return x.tabulated(data, at)
    if isinstance(x, np.ndarray) and x.dtype == object:
        return np.frompyfunc(lambda e: spline(data, at, e), 1, 3)(x)
    return evaluate_piece(data, at, x)


@formula
def evaluate_piece(data, at, x):
    """`spline` where x is a number, which chooses the piece."""
    start, origin = find_piece(data, at, x)
    s = x - origin
    c0, c1, c2, c3 = data[start], data[start + 1], data[start + 2], data[start + 3]
    return c0 + s * (c1 + s * (c2 + s * c3)), c1 + s * (2.0 * c2 + 3.0 * c3 * s), 2.0 * c2 + 6.0 * c3 * s


def find_piece(data, at, x):
    """Place of the coefficients that apply at x, and x relative to their origin."""
    if isinstance(x, float | int | complex):
        return find_piece_of_number(data, at, x)
    count = int(data[at + 1].real)
    all_breaks = data[at + BREAKS : at + BREAKS + count]
    breaks = all_breaks.real
    period, x = data[at].real, np.real(x)
    turns = np.floor((x - breaks[0]) / period) if period > 0.0 else 0.0 * x
    shift = period * turns
    k = np.searchsorted(breaks, x - shift, side="right")
    k = np.where(x - shift == breaks[-1], count - 1, k)
    return at + BREAKS + count + PIECE * k, all_breaks[np.maximum(k - 1, 0)] + data[at] * turns


def find_piece_of_number(data, at, x):
    """`find_piece` for one number, by bisection; used in compiled code."""
    x = x.real
    count = int(data[at + 1].real)
    first = at + BREAKS
    period = data[at].real
    turns = 0.0
    if period > 0.0:
        turns = (x - data[first].real) / period
        turns = float(math.floor(turns)) if turns - turns == 0.0 else turns
    shift = period * turns
    low, high = 0, count
    while low < high:
        middle = (low + high) // 2
        if data[first + middle].real <= x - shift:
            low = middle + 1
        else:
            high = middle
    if low == count and x - shift == data[first + count - 1].real:
        low = count - 1
    return first + count + PIECE * low, data[first + max(low - 1, 0)] + data[at] * turns


def complex_cubic(x: np.ndarray, y: np.ndarray, periodic: bool) -> np.ndarray:
    """Coefficients (n - 1, 4) of the C2 cubic spline through four or more points whose numbers may be complex.

    SciPy's takes no complex places. Ends are periodic or "not a knot" (de Boor, *A Practical Guide to Splines*, 1978,
    chapter IV).
    """
    n, h = len(x), np.diff(x)
    d = np.diff(y) / h
    A, b = np.zeros((n, n), complex), np.zeros(n, complex)  # for the slopes at the points
    for k in range(1, n - 1):
        A[k, k - 1 : k + 2] = h[k], 2.0 * (h[k - 1] + h[k]), h[k - 1]
        b[k] = 3.0 * (h[k] * d[k - 1] + h[k - 1] * d[k])
    if periodic:
        A[0, 0], A[0, n - 1] = 1.0, -1.0
        A[n - 1, 1], A[n - 1, 0], A[n - 1, n - 2] = h[-1], 2.0 * (h[-1] + h[0]), h[0]
        b[n - 1] = 3.0 * (h[0] * d[-1] + h[-1] * d[0])
    else:
        for end, beside, i, j in ((0, 1, 0, 1), (n - 1, n - 2, -1, -2)):
            width = h[i] + h[j]
            A[end, end], A[end, beside] = h[j], width
            b[end] = ((h[i] + 2.0 * width) * h[j] * d[i] + h[i] ** 2 * d[j]) / width
    slopes = np.linalg.solve(A, b)
    left, right = slopes[:-1], slopes[1:]
    return np.column_stack([y[:-1], left, (3.0 * d - 2.0 * left - right) / h, (left + right - 2.0 * d) / h**2])


def pack_spline(x: np.ndarray, y: np.ndarray, pieces: np.ndarray, beyond: str) -> np.ndarray:
    """Flat list of a spline: ``pieces`` between the points, and beyond the ends as ``beyond`` states.

    "hold", "line" (straight on), "repeat", or "refuse": nan.
    """
    behind = [y[-1], *_shifted_cubic(pieces[-1], x[-1] - x[-2])[1:]]
    if beyond == "refuse":
        more = max(GRACE * (x[-1] - x[0]), 4.0 * np.spacing(np.abs(x).max()))
        first = _shifted_cubic(pieces[0], -more)
        x = np.r_[x[0] - more, x, x[-1] + more]
        pieces = np.vstack([first, pieces, behind])
        before = behind = [np.nan] * PIECE
    else:
        slopes = (0.0, 0.0) if beyond == "hold" else (pieces[0, 1], behind[1])
        before, behind = ([f, slope, 0.0, 0.0] for f, slope in zip((y[0], y[-1]), slopes, strict=True))
    period = x[-1] - x[0] if beyond == "repeat" else 0.0
    return np.r_[period, len(x), x, np.vstack([before, pieces, behind]).ravel()]


def _shifted_cubic(piece: np.ndarray, by: float) -> list[float]:
    """A cubic relative to another origin."""
    c0, c1, c2, c3 = piece
    return [c0 + by * (c1 + by * (c2 + by * c3)), c1 + by * (2.0 * c2 + 3.0 * by * c3), c2 + 3.0 * by * c3, c3]


def spline_expression(data: Any, at: int, x: Any) -> Any:
    """The spline's value as a SymPy expression of the symbol (or expression) ``x``."""
    import sympy

    count = int(data[at + 1])
    breaks = [float(b) for b in data[at + BREAKS : at + BREAKS + count]]
    if data[at] > 0.0:
        x = x - float(data[at]) * sympy.floor((x - breaks[0]) / float(data[at]))
    pieces = []
    for k in range(count + 1):
        start = at + BREAKS + count + PIECE * k
        c0, c1, c2, c3 = (float(c) for c in data[start : start + PIECE])
        s = x - breaks[max(k - 1, 0)]
        inside = sympy.true if k == count else x <= breaks[k] if k == count - 1 else x < breaks[k]
        value = c0 + s * (c1 + s * (c2 + s * c3)) if math.isfinite(c0) else sympy.nan
        pieces.append((value, inside))
    return sympy.Piecewise(*pieces)


@when_compiling
def _register() -> None:
    """Register the compiled version, where x is one number."""
    from ..compiler.numba_target import overload

    @overload(find_piece)
    def choose(data, at, x):
        return find_piece_of_number

    @overload(spline)
    def choose_spline(data, at, x):
        return lambda data, at, x: evaluate_piece(data, at, x)
