"""Interval arithmetic on arrays: ranges (low, high) of sums, products, functions and tables.

The ends are a little wider than rounding requires. Moore, Kearfott and Cloud, *Introduction to Interval Analysis*
(2009), chapters 5 and 6.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..math.scalar import integer_power, power
from ..math.spline import BREAKS, PIECE
from .bytecode import (
    ACOS,
    ASIN,
    ATAN,
    COS,
    COSH,
    CUBIC,
    LOG,
    QUINTIC,
    SIN,
    SQRT,
    TAN,
    TANH,
    function_slopes,
    function_value,
    power_slopes,
)

Array = np.ndarray
Range = tuple[Any, Any]
ROUNDING = 4.5e-16  # relative to its size: by how much an end is moved outwards
# relative to its size: by how much a range may reach beyond a pole or a table's corner at which it ends
SEAM_TOLERANCE = 1e-12
# arguments, besides the ends of a range, at which a function and its slope are extreme
_TURNS: dict[int, tuple[tuple[float, ...], tuple[float, ...]]] = {
    TANH: ((), (0.0,)), ATAN: ((), (0.0,)), COSH: ((0.0,), ()), ASIN: ((), (0.0,)), ACOS: ((), (0.0,)),
    CUBIC: ((0.0, 1.0), (0.5,)), QUINTIC: ((0.0, 1.0), (0.0, 0.5, 1.0)),
}  # fmt: skip
_SINH_SLOPE = (0.0,)
_DOMAIN = {ASIN: (-1.0, 1.0), ACOS: (-1.0, 1.0), SQRT: (0.0, np.inf), LOG: (0.0, np.inf)}


def widened(lo: Any, hi: Any) -> Range:
    """Range widened for rounding; nan becomes everything."""
    lo, hi = lo - ROUNDING * np.abs(lo), hi + ROUNDING * np.abs(hi)
    return np.where(np.isnan(lo), -np.inf, lo), np.where(np.isnan(hi), np.inf, hi)


def range_sum(a: Range, b: Range) -> Range:
    """Range of a sum."""
    return widened(a[0] + b[0], a[1] + b[1])


def range_difference(a: Range, b: Range) -> Range:
    """Range of a difference."""
    return widened(a[0] - b[1], a[1] - b[0])


def range_negative(a: Range) -> Range:
    """Range of -a."""
    return -a[1], -a[0]


def range_product(a: Range, b: Range) -> Range:
    """Range of a product; zero times everything is zero."""
    p = [np.where(np.isnan(x), 0.0, x) for x in (a[0] * b[0], a[0] * b[1], a[1] * b[0], a[1] * b[1])]
    lo = np.minimum(np.minimum(p[0], p[1]), np.minimum(p[2], p[3]))
    hi = np.maximum(np.maximum(p[0], p[1]), np.maximum(p[2], p[3]))
    below = (lo == 0.0) & np.signbit(p).any(axis=0)  # zero may be -0.0, which changes the branch of atan2
    lo, hi = widened(lo, hi)
    return np.where(below, -0.0, lo), hi


def range_reciprocal(a: Range) -> Range:
    """Range of 1 / a: everything where a may be zero."""
    pole = (a[0] <= 0.0) & (a[1] >= 0.0)
    lo, hi = widened(np.divide(1.0, a[1]), np.divide(1.0, a[0]))
    return np.where(pole, -np.inf, lo), np.where(pole, np.inf, hi)


def range_hull(values: list[Any]) -> Range:
    """Range of numbers; everything if one is nan."""
    lo = hi = values[0]
    for x in values[1:]:
        lo, hi = np.minimum(lo, x), np.maximum(hi, x)
    return widened(lo, hi)


def range_with_turns(a: Range, f: Any, turns: tuple[float, ...]) -> Range:
    """Range of a function with extrema at given places only."""
    return range_hull([f(a[0]), f(a[1]), *(f(np.clip(x + 0.0 * a[0], a[0], a[1])) for x in turns)])


def cosine_range(a: Range, shift: float) -> Range:
    """Range of cos(x - shift)."""
    lo, hi = widened(a[0] - shift, a[1] - shift)
    turn = 2.0 * np.pi
    up = np.ceil(lo / turn) * turn <= hi
    down = (np.ceil((lo - np.pi) / turn) * turn + np.pi) <= hi
    low, high = range_hull([np.cos(lo), np.cos(hi)])
    vague = ~np.isfinite(hi - lo)
    return np.where(down | vague, -1.0, np.maximum(low, -1.0)), np.where(up | vague, 1.0, np.minimum(high, 1.0))


def function_ranges(number: int, a: Range) -> tuple[Range, Range]:
    """Ranges of a function of one argument, and of its slope, over the range of its argument."""
    if number == SIN or number == COS:
        shift = 0.5 * np.pi if number == SIN else 0.0
        return cosine_range(a, shift), cosine_range(a, shift - 0.5 * np.pi)
    if number in _DOMAIN:
        least, most = _DOMAIN[number]
        a = np.clip(a[0], least, most), np.clip(a[1], least, most)
    turns, slope_turns = _TURNS.get(number, ((), _SINH_SLOPE))
    f = range_with_turns(a, lambda x: function_value(number, x), turns)
    slope = range_with_turns(
        a, lambda x: function_slopes(number, x, function_value(number, x))[0] + 0.0 * x, slope_turns
    )
    if number == TAN:
        near = SEAM_TOLERANCE * np.maximum(np.abs(a[0]), np.abs(a[1]))  # a range may end at a pole
        pole = _branch(np.minimum(a[0] + near, a[1])) != _branch(np.maximum(a[1] - near, a[0]))
        f = (
            np.where(pole | (_branch(a[0] - near) != _branch(a[0] + near)), -np.inf, f[0]),
            np.where(pole | (_branch(a[1] - near) != _branch(a[1] + near)), np.inf, f[1]),
        )
        slope = range_with_turns(f, lambda x: 1.0 + x * x, (0.0,))
    return f, slope


def _branch(x: Array) -> Array:
    """Branch of the tangent that an angle is on."""
    return np.floor((x - 0.5 * np.pi) / np.pi)


def integer_power_range(a: Range, n: int) -> Range:
    """Range of a ** n."""
    if n < 0:
        return range_reciprocal(integer_power_range(a, -n))
    return range_with_turns(a, lambda x: integer_power(x, n) + 0.0 * x, (0.0,) if n % 2 == 0 else ())


def real_power_ranges(a: Range, b: float) -> tuple[Range, Range]:
    """Ranges of a ** b, where a is not negative, and of its slope."""
    a = np.maximum(a[0], 0.0), np.maximum(a[1], 0.0)
    return range_with_turns(a, lambda x: power(x, b), ()), range_with_turns(
        a, lambda x: power_slopes(x, b)[0] + 0.0 * x, ()
    )


def atan2_ranges(y: Range, x: Range) -> tuple[Range, Range, Range]:
    """Ranges of atan2(y, x) and of its two slopes."""
    y = y[0], y[1] + 0.0  # a zero at the upper end may be 0.0 as well as -0.0
    from_zero = (y[0] == 0.0) & ~np.signbit(y[0])
    vague = (x[0] <= 0.0) & (y[0] <= 0.0) & (y[1] >= 0.0) & ~(from_zero | (y[1] == 0.0) & (y[0] < 0.0))
    vague |= (x[0] <= 0.0) & (x[1] >= 0.0) & (y[0] <= 0.0) & (y[1] >= 0.0)
    lo, hi = range_hull([np.arctan2(v, u) for v in y for u in x])
    square = range_sum(integer_power_range(x, 2), integer_power_range(y, 2))
    per = range_reciprocal(square)
    f = np.where(vague, -np.pi, lo), np.where(vague, np.pi, hi)
    return f, range_product(x, per), range_negative(range_product(y, per))


class TableRanges:
    """Ranges of a table's values and slopes."""

    def __init__(self, const: Array, at: int) -> None:
        count = int(const[at + 1])
        x = np.asarray(const[at + BREAKS : at + BREAKS + count], float)
        first = at + BREAKS + count
        c = np.asarray(const[first : first + PIECE * (count + 1)], float).reshape(count + 1, PIECE)
        self.period = float(const[at])
        if self.period > 0.0:  # a range may reach beyond the period once, or is a whole period long
            c = np.vstack([c[:1], c[1:count], c[1:count], c[-1:]])
            x = np.r_[x, x[1:] + self.period]
        self.x, self.c = x, c
        self.origin = np.r_[x[0], x]
        whole = np.r_[0.0, np.diff(x), 0.0]
        self.value, self.slope = _ranges(c, 0.0 * whole, whole)

    def ranges(self, a: Range) -> tuple[Range, Range]:
        """Ranges of value and slope over a range of its argument."""
        near = SEAM_TOLERANCE * (self.x[-1] - self.x[0])
        lo, hi = np.broadcast_arrays(*(np.asarray(x, float) for x in a))
        lo, hi = np.minimum(lo + near, 0.5 * (lo + hi)), np.maximum(hi - near, 0.5 * (lo + hi))
        if self.period > 0.0:
            turns = self.period * np.floor((lo - self.x[0]) / self.period)
            lo = lo - turns
            hi = np.minimum(hi - turns, lo + self.period)
        first = np.searchsorted(self.x, lo, side="right")
        last = np.maximum(np.searchsorted(self.x, hi, side="left"), first)
        one = first == last
        end = self.x[np.minimum(first, len(self.x) - 1)]
        start = self.x[np.maximum(last - 1, 0)]
        before = _ranges(self.c[first], lo - self.origin[first], np.where(one, hi, end) - self.origin[first])
        behind = _ranges(self.c[last], np.where(one, lo, start) - self.origin[last], hi - self.origin[last])
        between = first + 1 < last
        out = []
        for k, (low, high) in enumerate((self.value, self.slope)):
            least = np.where(between, _over(np.minimum, low, first + 1, last), np.inf)
            most = np.where(between, _over(np.maximum, high, first + 1, last), -np.inf)
            lows, highs = (before[k][0], behind[k][0], least), (before[k][1], behind[k][1], most)
            out.append((np.minimum.reduce(lows), np.maximum.reduce(highs)))
        (least, most), slope = out  # at an end of a piece that is also an end of the range, slopes are those inside
        way = near * np.maximum(np.abs(slope[0]), np.abs(slope[1]))
        return (least - way, most + way), slope


def _over(ufunc: Any, x: Array, first: Array, stop: Array) -> Array:
    """Least or greatest of x[first:stop], for each of these pairs that is not empty."""
    pairs = np.column_stack([first.ravel(), np.maximum(stop, first).ravel()]).ravel()
    return ufunc.reduceat(np.r_[x, x[-1], x[-1]], np.minimum(pairs, len(x) + 1))[::2].reshape(first.shape)


def _ranges(c: Array, s0: Array, s1: Array) -> tuple[Range, Range]:
    """Ranges of cubics and of their slopes between s0 and s1."""

    def value(s: Array) -> Array:
        return c[..., 0] + s * (c[..., 1] + s * (c[..., 2] + s * c[..., 3]))

    def slope(s: Array) -> Array:
        return c[..., 1] + s * (2.0 * c[..., 2] + 3.0 * c[..., 3] * s)

    with np.errstate(all="ignore"):
        turns = [
            np.clip(np.nan_to_num(s), s0, s1) for s in _stationary_points(c[..., 1], 2.0 * c[..., 2], 3.0 * c[..., 3])
        ]
        flat = np.clip(np.nan_to_num(-c[..., 2] / (3.0 * c[..., 3])), s0, s1)
    return range_hull([value(s) for s in (s0, s1, *turns)]), range_hull([slope(s) for s in (s0, s1, flat)])


def _stationary_points(c: Array, b: Array, a: Array) -> tuple[Array, Array]:
    """Zeros of c + b s + a s^2; arbitrary where there are none."""
    q = -0.5 * (b + np.where(b < 0.0, -1.0, 1.0) * np.sqrt(np.maximum(b * b - 4.0 * a * c, 0.0)))
    return q / a, c / q
