"""All times at which steps of a law reach given levels: by interval Newton's way, bisection where that says nothing."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Literal, NamedTuple

import numpy as np

from ..opcodes import ADD, SUBTRACT
from .enclose import Law, Signs
from .ranges import WIDER, Range
from .steps import Corner, needed

MOST = 60000  # intervals looked at together
PARTS = 4  # that an interval is cut into
THIN = 1e-12  # part of the span: an interval that is not cut
THIN_TOUCH = 1e-9  # of one in which a level may be touched
BLURRED = 8.0 * WIDER  # part of what is subtracted that a difference may be wrong by
VAGUE = 100.0  # a range as many times its rounding says more than rounding
BESIDE = 1024.0  # units in the last place from an end of the span at which what is at the end is told
NEAREST = 200  # steps towards a zero: bisection alone takes sixty


class Spans(NamedTuple):
    """The time in parts, and the signs in each of what decides at inner corners."""

    edges: np.ndarray  # (n + 1,)
    signs: Mapping[int, np.ndarray]  # step -> (n,)

    def at(self, part: np.ndarray) -> dict[int, np.ndarray]:
        """The signs in intervals that lie in these parts."""
        return {k: s[part] for k, s in self.signs.items()}


def crossings(law: Law, c: Corner, spans: Spans) -> tuple[np.ndarray, bool]:
    """Times within the spans at which a corner's levels are reached, ascending, and whether these are all.

    Levels that are only touched count where the corner says so.
    """
    wanted = needed(law.steps, [c.of])
    a, b = spans.edges[:-1], spans.edges[1:]
    part = np.arange(len(a))
    span = spans.edges[-1] - spans.edges[0]
    thin = (THIN_TOUCH if c.touched else THIN) * span
    passed: list[tuple[np.ndarray, np.ndarray, np.ndarray]] = [(a[:0], a[:0], part[:0])]
    touched: list[np.ndarray] = []
    complete = True
    while len(a):
        if len(a) > MOST:
            complete = False
            break
        found = law.enclose(wanted, (a, b), spans.at(part))
        (lo, hi), slope = found[c.of]
        slope = np.broadcast_to(slope[0], a.shape), np.broadcast_to(slope[1], a.shape)
        signs = spans.at(part)
        lo, hi = _nearer(law.points(wanted, 0.5 * (a + b), signs)[0][c.of], b - a, (lo, hi), slope)
        blur = _blur(law, c, found, len(a))
        reached = _levels(c, hi) > _levels(c, lo, before=True)
        one_way = ((slope[0] >= 0.0) | (slope[1] <= 0.0)) & reached & ~(c.touched & (slope[0] * slope[1] == 0.0))
        sharp = hi - lo > VAGUE * blur
        open_ = reached & (one_way | sharp | (_levels(c, hi - blur) > _levels(c, lo + blur, before=True)))
        which = reached & ~open_
        if which.any():
            touched += _zero_ends(law, wanted, c, (a[which], b[which]), spans.at(part[which]), blur[which])
        flat = (slope[0] == 0.0) & (slope[1] == 0.0)
        narrow = open_ & ~one_way & (b - a <= thin)
        keep = (one_way | narrow) & ~flat
        passed.append((a[keep], b[keep], part[keep]))
        if c.touched:
            touched.append(0.5 * (a + b)[narrow])
        cut = open_ & ~one_way & ~narrow & ~flat
        a, b, part = _cut(a[cut], b[cut], part[cut])
    a, b, part = (np.concatenate(x) for x in zip(*passed, strict=True))
    zeros, all_of_them = _zeros(law, wanted, c, (a, b), spans.at(part))
    times = np.sort(np.concatenate([zeros, *touched, _at_ends(law, wanted, c, spans)]))
    return _apart(times, thin if c.touched else 0.0, spans.edges), complete and all_of_them


def _at_ends(law: Law, wanted: list[int], c: Corner, spans: Spans) -> np.ndarray:
    """A time beside an end of the span where a level is reached at the end itself, as far as rounding tells."""
    ends = spans.edges[[0, -1]]
    near = BESIDE * np.spacing(np.abs(ends).max())
    v, d = law.points(wanted, ends, spans.at(np.array([0, len(spans.edges) - 2])))
    f, slope = (np.broadcast_to(x[c.of], ends.shape) for x in (v, d))
    reach = np.where(np.isfinite(slope), np.abs(slope), 0.0) * near
    reached = _levels(c, f + reach) > _levels(c, f - reach, before=True)
    return (ends + near * np.array([1.0, -1.0]))[reached & (reach > 0.0)]


def _nearer(middle: Any, width: np.ndarray, f: Range, slope: Range) -> Range:
    """The range of a step, by its value in the middle and its slope where that says more."""
    way = 0.5 * width * np.maximum(np.abs(slope[0]), np.abs(slope[1]))
    way = np.where(np.isnan(way), np.inf, way) + WIDER * np.abs(middle)
    lo, hi = np.fmax(f[0], middle - way), np.fmin(f[1], middle + way)
    return np.broadcast_to(lo, width.shape), np.broadcast_to(hi, width.shape)


def _blur(law: Law, c: Corner, found: Mapping[int, Any], n: int) -> np.ndarray:
    """What a difference may be wrong by, of what is subtracted: a level less deep inside counts as not reached."""
    s = law.steps[c.of]
    if c.touched or s.operation not in (ADD, SUBTRACT):
        return np.zeros(n)
    sizes = [np.maximum(np.abs(lo), np.abs(hi)) for lo, hi in (found[k][0] for k in s.args)]
    blur = BLURRED * np.maximum(*sizes)
    return np.broadcast_to(np.where(np.isfinite(blur), blur, 0.0), n)


def _zero_ends(law: Law, wanted: list[int], c: Corner, t: Range, signs: Signs, blur: np.ndarray) -> list[np.ndarray]:
    """Ends of intervals that are given up for rounding where the difference is zero: what is beyond may have a sign."""
    return [x[np.abs(law.points(wanted, x, signs)[0][c.of]) <= blur] for x in t]


def _levels(c: Corner, x: Any, before: bool = False) -> np.ndarray:
    """Number of levels up to x; ``before``: without x itself."""
    side: Literal["left", "right"] = "left" if before else "right"
    if c.period == 0.0:
        return np.searchsorted(c.levels, x, side=side)
    x = np.clip(np.nan_to_num(x), -1e15 * c.period, 1e15 * c.period)
    turns = np.floor((x - c.levels[0]) / c.period)
    rest = np.clip(x - turns * c.period, c.levels[0], c.levels[0] + c.period)
    return len(c.levels) * turns + np.searchsorted(np.r_[c.levels, c.levels[0] + c.period], rest, side=side)


def _level(c: Corner, n: np.ndarray) -> np.ndarray:
    """Level number n, counted as `_levels` does."""
    if c.period == 0.0:
        return c.levels[n.astype(int)]
    turns, which = np.divmod(n, len(c.levels))
    return c.levels[which.astype(int)] + turns * c.period


def _cut(a: np.ndarray, b: np.ndarray, part: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    x = a[:, None] + (b - a)[:, None] * (np.arange(PARTS + 1) / PARTS)
    x[:, -1] = b
    return x[:, :-1].ravel(), x[:, 1:].ravel(), np.repeat(part, PARTS)


def _zeros(law: Law, wanted: list[int], c: Corner, t: Range, signs: Signs) -> tuple[np.ndarray, bool]:
    """The times at which levels are passed in intervals in which a step only rises or falls, and if these are all."""
    if not len(t[0]):
        return t[0], True
    ends = [np.broadcast_to(law.points(wanted, x, signs)[0][c.of], x.shape) for x in t]
    low, high = _levels(c, np.minimum(*ends)), _levels(c, np.maximum(*ends))
    if not (high - low).sum() <= MOST:
        return t[0][:0], False
    count = (high - low).astype(int)
    which = np.repeat(np.arange(len(count)), count)
    nth = np.arange(len(which)) - np.repeat(np.cumsum(count) - count, count)
    level = _level(c, low[which] + nth)
    rising = (ends[1] > ends[0])[which]

    def gap(x: np.ndarray, at: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        v, d = law.points(wanted, x, {k: s[which[at]] for k, s in signs.items()})
        sign = np.where(rising[at], 1.0, -1.0)
        return sign * (v[c.of] - level[at]), sign * np.broadcast_to(d[c.of], x.shape)

    return _nearest(gap, t[0][which].copy(), t[1][which].copy()), True


def _nearest(gap: Callable[[np.ndarray, np.ndarray], Any], a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Zeros of rising functions between a and b: Newton's steps, halves where these leave the interval.

    ``gap(x, which)`` gives values and slopes of the functions with these numbers.
    """
    t = 0.5 * (a + b)
    out = t.copy()
    left = np.arange(len(t))
    for _ in range(NEAREST):
        if not len(left):
            break
        f, slope = gap(t, left)
        a, b = np.where(f > 0.0, a, t), np.where(f > 0.0, t, b)
        step = t - f / slope
        new = np.where((step > a) & (step < b), step, 0.5 * (a + b))
        out[left] = np.where(f == 0.0, t, new)
        go = ~((f == 0.0) | (np.abs(new - t) <= 2.0 * np.spacing(np.abs(t))) | (new == a) | (new == b))
        left, t, a, b = left[go], new[go], a[go], b[go]
    return out


def _apart(t: np.ndarray, thin: float, edges: np.ndarray) -> np.ndarray:
    """Times that are one within rounding only once, and not the edges of the time again."""
    near = max(4.0 * thin, 16.0 * np.spacing(np.abs(edges).max()))
    keep = np.r_[True, np.diff(t) > near][: len(t)]
    t = t[keep]
    if not len(t):
        return t
    k = np.searchsorted(edges, t)
    beside = np.minimum(np.abs(t - edges[np.maximum(k - 1, 0)]), np.abs(t - edges[np.minimum(k, len(edges) - 1)]))
    return t[beside > near]
