"""Interval arithmetic on arrays: ranges (low, high) of sums, products, functions; ends a little wider than rounding."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...math.scalar import integer_power, power
from ..evaluation import power_slopes, slopes, value
from ..opcodes import (
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
)

Array = np.ndarray
Range = tuple[Any, Any]
WIDER = 4.5e-16  # part of its size by which an end is moved out
SEAM = 1e-12  # by which part of its size a range may reach beyond a pole or a table's corner, where it ends
# where a function, and where its slope, is greatest or least, besides the ends of a range
_TURNS: dict[int, tuple[tuple[float, ...], tuple[float, ...]]] = {
    TANH: ((), (0.0,)), ATAN: ((), (0.0,)), COSH: ((0.0,), ()), ASIN: ((), (0.0,)), ACOS: ((), (0.0,)),
    CUBIC: ((0.0, 1.0), (0.5,)), QUINTIC: ((0.0, 1.0), (0.0, 0.5, 1.0)),
}  # fmt: skip
_SINH_SLOPE = (0.0,)
_DOMAIN = {ASIN: (-1.0, 1.0), ACOS: (-1.0, 1.0), SQRT: (0.0, np.inf), LOG: (0.0, np.inf)}


def wider(lo: Any, hi: Any) -> Range:
    """A range with room for rounding; what is no number is everything."""
    lo, hi = lo - WIDER * np.abs(lo), hi + WIDER * np.abs(hi)
    return np.where(np.isnan(lo), -np.inf, lo), np.where(np.isnan(hi), np.inf, hi)


def plus(a: Range, b: Range) -> Range:
    """Range of a sum."""
    return wider(a[0] + b[0], a[1] + b[1])


def minus(a: Range, b: Range) -> Range:
    """Range of a difference."""
    return wider(a[0] - b[1], a[1] - b[0])


def negative(a: Range) -> Range:
    """Range of -a."""
    return -a[1], -a[0]


def times(a: Range, b: Range) -> Range:
    """Range of a product; nothing times everything is nothing."""
    p = [np.where(np.isnan(x), 0.0, x) for x in (a[0] * b[0], a[0] * b[1], a[1] * b[0], a[1] * b[1])]
    lo = np.minimum(np.minimum(p[0], p[1]), np.minimum(p[2], p[3]))
    hi = np.maximum(np.maximum(p[0], p[1]), np.maximum(p[2], p[3]))
    below = (lo == 0.0) & np.signbit(p).any(axis=0)  # zero may be -0.0, of which atan2 makes something else
    lo, hi = wider(lo, hi)
    return np.where(below, -0.0, lo), hi


def over(a: Range) -> Range:
    """Range of 1 / a: everything where a may be zero."""
    pole = (a[0] <= 0.0) & (a[1] >= 0.0)
    lo, hi = wider(np.divide(1.0, a[1]), np.divide(1.0, a[0]))
    return np.where(pole, -np.inf, lo), np.where(pole, np.inf, hi)


def hull(values: list[Any]) -> Range:
    """The range of numbers; of one that is no number everything."""
    lo = hi = values[0]
    for x in values[1:]:
        lo, hi = np.minimum(lo, x), np.maximum(hi, x)
    return wider(lo, hi)


def among(a: Range, f: Any, turns: tuple[float, ...]) -> Range:
    """Range of a function that turns at some places only."""
    return hull([f(a[0]), f(a[1]), *(f(np.clip(x + 0.0 * a[0], a[0], a[1])) for x in turns)])


def wave(a: Range, shift: float) -> Range:
    """Range of cos(x - shift)."""
    lo, hi = wider(a[0] - shift, a[1] - shift)
    turn = 2.0 * np.pi
    up = np.ceil(lo / turn) * turn <= hi
    down = (np.ceil((lo - np.pi) / turn) * turn + np.pi) <= hi
    low, high = hull([np.cos(lo), np.cos(hi)])
    vague = ~np.isfinite(hi - lo)
    return np.where(down | vague, -1.0, np.maximum(low, -1.0)), np.where(up | vague, 1.0, np.minimum(high, 1.0))


def function(number: int, a: Range) -> tuple[Range, Range]:
    """Ranges of a function of one argument, and of its slope, over the range of its argument."""
    if number == SIN or number == COS:
        shift = 0.5 * np.pi if number == SIN else 0.0
        return wave(a, shift), wave(a, shift - 0.5 * np.pi)
    if number in _DOMAIN:
        least, most = _DOMAIN[number]
        a = np.clip(a[0], least, most), np.clip(a[1], least, most)
    turns, slope_turns = _TURNS.get(number, ((), _SINH_SLOPE))
    f = among(a, lambda x: value(number, x), turns)
    slope = among(a, lambda x: slopes(number, x, value(number, x))[0] + 0.0 * x, slope_turns)
    if number == TAN:
        near = SEAM * np.maximum(np.abs(a[0]), np.abs(a[1]))  # a range may end at a pole
        pole = _branch(np.minimum(a[0] + near, a[1])) != _branch(np.maximum(a[1] - near, a[0]))
        f = (
            np.where(pole | (_branch(a[0] - near) != _branch(a[0] + near)), -np.inf, f[0]),
            np.where(pole | (_branch(a[1] - near) != _branch(a[1] + near)), np.inf, f[1]),
        )
        slope = among(f, lambda x: 1.0 + x * x, (0.0,))
    return f, slope


def _branch(x: Array) -> Array:
    """Which branch of the tangent an angle is on."""
    return np.floor((x - 0.5 * np.pi) / np.pi)


def whole_power(a: Range, n: int) -> Range:
    """Range of a ** n."""
    if n < 0:
        return over(whole_power(a, -n))
    return among(a, lambda x: integer_power(x, n) + 0.0 * x, (0.0,) if n % 2 == 0 else ())


def broken_power(a: Range, b: float) -> tuple[Range, Range]:
    """Ranges of a ** b, where a is not negative, and of its slope."""
    a = np.maximum(a[0], 0.0), np.maximum(a[1], 0.0)
    return among(a, lambda x: power(x, b), ()), among(a, lambda x: power_slopes(x, b)[0] + 0.0 * x, ())


def angle(y: Range, x: Range) -> tuple[Range, Range, Range]:
    """Ranges of atan2(y, x) and of its two slopes."""
    y = y[0], y[1] + 0.0  # a zero at the upper end may be 0.0 as well as -0.0
    from_zero = (y[0] == 0.0) & ~np.signbit(y[0])
    vague = (x[0] <= 0.0) & (y[0] <= 0.0) & (y[1] >= 0.0) & ~(from_zero | (y[1] == 0.0) & (y[0] < 0.0))
    vague |= (x[0] <= 0.0) & (x[1] >= 0.0) & (y[0] <= 0.0) & (y[1] >= 0.0)
    lo, hi = hull([np.arctan2(v, u) for v in y for u in x])
    square = plus(whole_power(x, 2), whole_power(y, 2))
    per = over(square)
    f = np.where(vague, -np.pi, lo), np.where(vague, np.pi, hi)
    return f, times(x, per), negative(times(y, per))
