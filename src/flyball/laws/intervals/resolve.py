"""Where laws act briefly: time is cut until no step of a law changes by more than a part of its range in an interval.

Narrow intervals that stand alone are where an integrator has to look: steps that end at their ends cannot pass over
them.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..opcodes import ABS, CALL, MAXIMUM, MINIMUM, SIGN, WHERE
from .crossings import MOST, PARTS, Spans
from .enclose import Law
from .ranges import WIDER
from .steps import TIME, Step, brief, needed

SHARE = 0.5  # of its range by which a step may change within an interval; less than 1, or a pulse could stay unseen
LITTLE = 0.01  # part of its range that a step may change by however steep it is
THIN = 1e-13  # part of the span: an interval that is not cut
ALONE = 30.0  # widths of an interval, within which an integrator cannot overlook what it does
SMALL = 1e-300  # a range that is nothing


def grades(law: Law, spans: Spans) -> tuple[np.ndarray, bool]:
    """Times at which brief actions of a law begin and end, ascending, and whether all were found."""
    targets = _outermost(law.steps)
    if not targets:
        return np.zeros(0), True
    wanted = needed(law.steps, targets)
    a, b = spans.edges[:-1], spans.edges[1:]
    part = np.arange(len(a))
    n = len(targets)
    lows, highs, ways = (np.zeros((n, 0)) for _ in range(3))
    kept_a = kept_b = np.zeros(0)
    kept_part = np.zeros(0, int)
    thin = THIN * (spans.edges[-1] - spans.edges[0])
    while True:
        new = _looked_at(law, wanted, targets, (a, b), part, spans)
        lows, highs, ways = (np.concatenate(x, axis=1) for x in zip((lows, highs, ways), new, strict=True))
        kept_a, kept_b, kept_part = np.r_[kept_a, a], np.r_[kept_b, b], np.r_[kept_part, part]
        with np.errstate(all="ignore"):
            allowed = np.maximum((highs.max(axis=1) - lows.min(axis=1))[:, None], SMALL)
            slow = (ways <= SHARE * allowed) | (highs - lows <= LITTLE * allowed)
        cut = ~slow.all(axis=0) & (kept_b - kept_a > thin)
        if not cut.any():
            return _ends(kept_a, kept_b), True
        if len(kept_a) + (PARTS - 1) * int(cut.sum()) > MOST:
            return np.zeros(0), False
        a, b, part = _parts(kept_a[cut], kept_b[cut], kept_part[cut])
        lows, highs, ways = (x[:, ~cut] for x in (lows, highs, ways))
        kept_a, kept_b, kept_part = kept_a[~cut], kept_b[~cut], kept_part[~cut]


def _outermost(steps: Sequence[Step]) -> list[int]:
    """Steps of time that may do much within a short time, and stand in no other such one."""
    bent = [s.on == TIME and not s.logical and brief(s, steps) and not _transparent(s) for s in steps]
    within = [False] * len(steps)
    for k in range(len(steps) - 1, -1, -1):
        for n in steps[k].args:
            within[n] = within[n] or within[k] or bent[k]
    return [k for k in range(len(steps)) if bent[k] and not within[k]]


def _transparent(s: Step) -> bool:
    """Whether a step gives one of its arguments, or its sign: what it does besides are corners, which are known."""
    return s.operation in (MINIMUM, MAXIMUM, WHERE) or (s.operation == CALL and s.operand in (ABS, SIGN))


def _looked_at(
    law: Law, wanted: list[int], targets: list[int], t: tuple[np.ndarray, np.ndarray], part: np.ndarray, spans: Spans
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Of each target in each interval: least and greatest value, and the most by which it may change."""
    found = law.enclose(wanted, t, spans.at(part))
    width = t[1] - t[0]
    middle = law.points(wanted, 0.5 * (t[0] + t[1]))[0]
    out = np.zeros((3, len(targets), len(width)))
    for k, target in enumerate(targets):
        (lo, hi), (down, up) = found[target]
        steepest = np.maximum(np.abs(down), np.abs(up))
        way = np.where(np.isnan(steepest), np.inf, steepest) * width
        near = 0.5 * way + WIDER * np.abs(middle[target])
        lo, hi = np.fmax(lo, middle[target] - near), np.fmin(hi, middle[target] + near)
        out[:, k] = lo, hi, way
    return out[0], out[1], out[2]


def _parts(a: np.ndarray, b: np.ndarray, part: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    x = a[:, None] + (b - a)[:, None] * (np.arange(PARTS + 1) / PARTS)
    x[:, -1] = b
    return x[:, :-1].ravel(), x[:, 1:].ravel(), np.repeat(part, PARTS)


def _ends(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Ends of intervals that are narrow, where no others as narrow are near: brief actions begin and end there."""
    order = np.argsort(a)
    a, b = a[order], b[order]
    level = np.round(np.log(np.maximum(b - a, SMALL)) / np.log(PARTS)).astype(int)  # larger: wider
    out = []
    whole = b[-1] - a[0]
    for wide in np.unique(level):
        as_narrow = np.flatnonzero(level <= wide)
        mine = np.flatnonzero((level[as_narrow] == wide) & (ALONE * (b - a)[as_narrow] < whole))
        gap = np.r_[np.inf, a[as_narrow][1:] - b[as_narrow][:-1], np.inf]
        far = ALONE * (b - a)[as_narrow[mine]]
        out += [a[as_narrow[mine]][gap[mine] > far], b[as_narrow[mine]][gap[mine + 1] > far]]
    ends = np.unique(np.concatenate(out)) if out else np.zeros(0)
    return ends[(ends > a[0]) & (ends < b[-1])]
