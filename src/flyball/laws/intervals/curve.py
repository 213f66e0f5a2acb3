"""Ranges of tables: exact in the pieces at the ends of a range, those of whole pieces between."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...math.spline import BREAKS, PIECE
from .ranges import SEAM, Array, Range, hull


class Curve:
    """A table of points: ranges of its values and slopes."""

    def __init__(self, const: Array, at: int) -> None:
        count = int(const[at + 1])
        x = np.asarray(const[at + BREAKS : at + BREAKS + count], float)
        first = at + BREAKS + count
        c = np.asarray(const[first : first + PIECE * (count + 1)], float).reshape(count + 1, PIECE)
        self.period = float(const[at])
        if self.period > 0.0:  # a range may reach beyond the seam once, or is as long as all
            c = np.vstack([c[:1], c[1:count], c[1:count], c[-1:]])
            x = np.r_[x, x[1:] + self.period]
        self.x, self.c = x, c
        self.origin = np.r_[x[0], x]
        whole = np.r_[0.0, np.diff(x), 0.0]
        self.value, self.slope = _ranges(c, 0.0 * whole, whole)

    def ranges(self, a: Range) -> tuple[Range, Range]:
        """Ranges of value and slope over a range of its argument."""
        near = SEAM * (self.x[-1] - self.x[0])
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
        (least, most), slope = out  # at an end of a piece that is the range's own, slopes are those inside
        way = near * np.maximum(np.abs(slope[0]), np.abs(slope[1]))
        return (least - way, most + way), slope


def _over(ufunc: Any, x: Array, first: Array, stop: Array) -> Array:
    """The least or greatest of x from first up to, not including, stop, for each pair of these that is not empty."""
    pairs = np.column_stack([first.ravel(), np.maximum(stop, first).ravel()]).ravel()
    return ufunc.reduceat(np.r_[x, x[-1], x[-1]], np.minimum(pairs, len(x) + 1))[::2].reshape(first.shape)


def _ranges(c: Array, s0: Array, s1: Array) -> tuple[Range, Range]:
    """Ranges of cubics and of their slopes between s0 and s1."""

    def value(s: Array) -> Array:
        return c[..., 0] + s * (c[..., 1] + s * (c[..., 2] + s * c[..., 3]))

    def slope(s: Array) -> Array:
        return c[..., 1] + s * (2.0 * c[..., 2] + 3.0 * c[..., 3] * s)

    with np.errstate(all="ignore"):
        turns = [np.clip(np.nan_to_num(s), s0, s1) for s in _turns(c[..., 1], 2.0 * c[..., 2], 3.0 * c[..., 3])]
        flat = np.clip(np.nan_to_num(-c[..., 2] / (3.0 * c[..., 3])), s0, s1)
    return hull([value(s) for s in (s0, s1, *turns)]), hull([slope(s) for s in (s0, s1, flat)])


def _turns(c: Array, b: Array, a: Array) -> tuple[Array, Array]:
    """The zeros of c + b s + a s^2; anything where there are none."""
    q = -0.5 * (b + np.where(b < 0.0, -1.0, 1.0) * np.sqrt(np.maximum(b * b - 4.0 * a * c, 0.0)))
    return q / a, c / q
