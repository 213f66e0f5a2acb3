"""Times at which laws have corners, jump, or begin and end a brief pulse, as far as these depend on time alone.

They are found before a motion begins, from the laws' programs, by the interval Newton method and bisection, so that
none is missed however brief it is (Moore, Kearfott and Cloud, *Introduction to Interval Analysis*, 2009, chapter 8).
Those that depend on the state cannot be found beforehand.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, Literal, NamedTuple

import numpy as np

from .bytecode import ABS, ADD, CALL, CONSTANT, INPUT, MAXIMUM, MINIMUM, SIGN, SUBTRACT, WHERE
from .interval_arithmetic import ROUNDING, Range
from .interval_evaluation import (
    CONSTANT_IN_TIME,
    STATE_DEPENDENT,
    TIME_ONLY,
    CornerLevels,
    IntervalLaw,
    Signs,
    Step,
    find_corners,
    read_steps,
    required_steps,
    step_may_be_brief,
)

MAX_INTERVALS = 60000  # intervals processed together
SUBDIVISION = 4  # parts that an interval is divided into
THIN_CROSSING = 1e-12  # fraction of the span: an interval that is not divided
THIN_TOUCH = 1e-9  # fraction of the span: an interval that is not divided where a level may be touched
ROUNDOFF_FACTOR = 8.0 * ROUNDING  # relative to the operands: rounding error of a difference
SLOPE_FACTOR = 100.0  # a range is conclusive if it exceeds its rounding error by this factor
END_MARGIN = 1024.0  # units in the last place from an end of the span at which a level reached at the end is reported
MAX_NEWTON_STEPS = 200  # steps towards a zero: bisection alone takes sixty


class Spans(NamedTuple):
    """Time divided into spans, and in each the signs that decide at inner corners."""

    edges: np.ndarray  # (n + 1,)
    signs: Mapping[int, np.ndarray]  # step -> (n,)

    def at(self, part: np.ndarray) -> dict[int, np.ndarray]:
        """Signs in intervals that lie in these spans."""
        return {k: s[part] for k, s in self.signs.items()}


def level_crossings(law: IntervalLaw, c: CornerLevels, spans: Spans) -> tuple[np.ndarray, bool]:
    """Times within the spans at which a corner's levels are reached, ascending, and whether these are all.

    Levels that are only touched count where the corner states it.
    """
    wanted = required_steps(law.steps, [c.of])
    a, b = spans.edges[:-1], spans.edges[1:]
    part = np.arange(len(a))
    span = spans.edges[-1] - spans.edges[0]
    thin = (THIN_TOUCH if c.touched else THIN_CROSSING) * span
    passed: list[tuple[np.ndarray, np.ndarray, np.ndarray]] = [(a[:0], a[:0], part[:0])]
    touched: list[np.ndarray] = []
    complete = True
    while len(a):
        if len(a) > MAX_INTERVALS:
            complete = False
            break
        found = law.enclose(wanted, (a, b), spans.at(part))
        (lo, hi), slope = found[c.of]
        slope = np.broadcast_to(slope[0], a.shape), np.broadcast_to(slope[1], a.shape)
        signs = spans.at(part)
        lo, hi = _nearer(law.points(wanted, 0.5 * (a + b), signs)[0][c.of], b - a, (lo, hi), slope)
        blur = _roundoff(law, c, found, len(a))
        reached = _levels(c, hi) > _levels(c, lo, before=True)
        one_way = ((slope[0] >= 0.0) | (slope[1] <= 0.0)) & reached & ~(c.touched & (slope[0] * slope[1] == 0.0))
        sharp = hi - lo > SLOPE_FACTOR * blur
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
        a, b, part = _subdivide(a[cut], b[cut], part[cut])
    a, b, part = (np.concatenate(x) for x in zip(*passed, strict=True))
    zeros, all_of_them = _zeros(law, wanted, c, (a, b), spans.at(part))
    times = np.sort(np.concatenate([zeros, *touched, _at_ends(law, wanted, c, spans)]))
    return _distinct_times(times, thin if c.touched else 0.0, spans.edges), complete and all_of_them


def _at_ends(law: IntervalLaw, requested: list[int], c: CornerLevels, spans: Spans) -> np.ndarray:
    """Time beside an end of the span where a level is reached at the end itself, within rounding."""
    ends = spans.edges[[0, -1]]
    near = END_MARGIN * np.spacing(np.abs(ends).max())
    v, d = law.points(requested, ends, spans.at(np.array([0, len(spans.edges) - 2])))
    f, slope = (np.broadcast_to(x[c.of], ends.shape) for x in (v, d))
    reach = np.where(np.isfinite(slope), np.abs(slope), 0.0) * near
    reached = _levels(c, f + reach) > _levels(c, f - reach, before=True)
    return (ends + near * np.array([1.0, -1.0]))[reached & (reach > 0.0)]


def _nearer(middle: Any, width: np.ndarray, f: Range, slope: Range) -> Range:
    """Range of a step, intersected with the range from its value in the middle and its slope."""
    way = 0.5 * width * np.maximum(np.abs(slope[0]), np.abs(slope[1]))
    way = np.where(np.isnan(way), np.inf, way) + ROUNDING * np.abs(middle)
    lo, hi = np.fmax(f[0], middle - way), np.fmin(f[1], middle + way)
    return np.broadcast_to(lo, width.shape), np.broadcast_to(hi, width.shape)


def _roundoff(law: IntervalLaw, c: CornerLevels, found: Mapping[int, Any], n: int) -> np.ndarray:
    """Rounding error of a difference, from its operands: a level less deep inside counts as not reached."""
    s = law.steps[c.of]
    if c.touched or s.operation not in (ADD, SUBTRACT):
        return np.zeros(n)
    sizes = [np.maximum(np.abs(lo), np.abs(hi)) for lo, hi in (found[k][0] for k in s.args)]
    blur = ROUNDOFF_FACTOR * np.maximum(*sizes)
    return np.broadcast_to(np.where(np.isfinite(blur), blur, 0.0), n)


def _zero_ends(
    law: IntervalLaw, requested: list[int], c: CornerLevels, t: Range, signs: Signs, blur: np.ndarray
) -> list[np.ndarray]:
    """Ends, where the difference is zero, of intervals that rounding leaves undecided: it may have a sign beyond."""
    return [x[np.abs(law.points(requested, x, signs)[0][c.of]) <= blur] for x in t]


def _levels(c: CornerLevels, x: Any, before: bool = False) -> np.ndarray:
    """Number of levels up to x; ``before``: excluding x itself."""
    side: Literal["left", "right"] = "left" if before else "right"
    if c.period == 0.0:
        return np.searchsorted(c.levels, x, side=side)
    x = np.clip(np.nan_to_num(x), -1e15 * c.period, 1e15 * c.period)
    turns = np.floor((x - c.levels[0]) / c.period)
    rest = np.clip(x - turns * c.period, c.levels[0], c.levels[0] + c.period)
    return len(c.levels) * turns + np.searchsorted(np.r_[c.levels, c.levels[0] + c.period], rest, side=side)


def _level(c: CornerLevels, n: np.ndarray) -> np.ndarray:
    """Level number n, counted as `_levels` does."""
    if c.period == 0.0:
        return c.levels[n.astype(int)]
    turns, which = np.divmod(n, len(c.levels))
    return c.levels[which.astype(int)] + turns * c.period


def _subdivide(a: np.ndarray, b: np.ndarray, part: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    x = a[:, None] + (b - a)[:, None] * (np.arange(SUBDIVISION + 1) / SUBDIVISION)
    x[:, -1] = b
    return x[:, :-1].ravel(), x[:, 1:].ravel(), np.repeat(part, SUBDIVISION)


def _zeros(law: IntervalLaw, requested: list[int], c: CornerLevels, t: Range, signs: Signs) -> tuple[np.ndarray, bool]:
    """Times at which levels are crossed in intervals in which a step is monotonic, and whether these are all."""
    if not len(t[0]):
        return t[0], True
    ends = [np.broadcast_to(law.points(requested, x, signs)[0][c.of], x.shape) for x in t]
    low, high = _levels(c, np.minimum(*ends)), _levels(c, np.maximum(*ends))
    if not (high - low).sum() <= MAX_INTERVALS:
        return t[0][:0], False
    count = (high - low).astype(int)
    which = np.repeat(np.arange(len(count)), count)
    nth = np.arange(len(which)) - np.repeat(np.cumsum(count) - count, count)
    level = _level(c, low[which] + nth)
    rising = (ends[1] > ends[0])[which]

    def gap(x: np.ndarray, at: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        v, d = law.points(requested, x, {k: s[which[at]] for k, s in signs.items()})
        sign = np.where(rising[at], 1.0, -1.0)
        return sign * (v[c.of] - level[at]), sign * np.broadcast_to(d[c.of], x.shape)

    return _nearest(gap, t[0][which].copy(), t[1][which].copy()), True


def _nearest(gap: Callable[[np.ndarray, np.ndarray], Any], a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Zeros of rising functions between a and b: Newton's steps, bisection where these leave the interval.

    ``gap(x, which)`` gives values and slopes of the functions with these numbers.
    """
    t = 0.5 * (a + b)
    out = t.copy()
    left = np.arange(len(t))
    for _ in range(MAX_NEWTON_STEPS):
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


def _distinct_times(t: np.ndarray, thin: float, edges: np.ndarray) -> np.ndarray:
    """Times without duplicates within rounding, and without the edges of the spans."""
    near = max(4.0 * thin, 16.0 * np.spacing(np.abs(edges).max()))
    keep = np.r_[True, np.diff(t) > near][: len(t)]
    t = t[keep]
    if not len(t):
        return t
    k = np.searchsorted(edges, t)
    beside = np.minimum(np.abs(t - edges[np.maximum(k - 1, 0)]), np.abs(t - edges[np.minimum(k, len(edges) - 1)]))
    return t[beside > near]


RESOLVED_SHARE = (
    0.5  # of its range by which a step may change within an interval; less than 1, or a pulse could be missed
)
SMALL_SHARE = 0.01  # fraction of its range that a step may change by however steep it is
THIN_INTERVAL = 1e-13  # fraction of the span: an interval that is not divided
ISOLATION_FACTOR = 30.0  # in widths of an interval: an integrator cannot miss an action within this distance
SMALL = 1e-300  # a range that counts as zero


def pulse_times(law: IntervalLaw, spans: Spans) -> tuple[np.ndarray, bool]:
    """Times at which brief actions of a law begin and end, ascending, and whether all were found."""
    targets = _outermost(law.steps)
    if not targets:
        return np.zeros(0), True
    wanted = required_steps(law.steps, targets)
    a, b = spans.edges[:-1], spans.edges[1:]
    part = np.arange(len(a))
    n = len(targets)
    lows, highs, ways = (np.zeros((n, 0)) for _ in range(3))
    kept_a = kept_b = np.zeros(0)
    kept_part = np.zeros(0, int)
    thin = THIN_INTERVAL * (spans.edges[-1] - spans.edges[0])
    while True:
        new = _target_ranges(law, wanted, targets, (a, b), part, spans)
        lows, highs, ways = (np.concatenate(x, axis=1) for x in zip((lows, highs, ways), new, strict=True))
        kept_a, kept_b, kept_part = np.r_[kept_a, a], np.r_[kept_b, b], np.r_[kept_part, part]
        with np.errstate(all="ignore"):
            allowed = np.maximum((highs.max(axis=1) - lows.min(axis=1))[:, None], SMALL)
            slow = (ways <= RESOLVED_SHARE * allowed) | (highs - lows <= SMALL_SHARE * allowed)
        cut = ~slow.all(axis=0) & (kept_b - kept_a > thin)
        if not cut.any():
            return _ends(kept_a, kept_b), True
        if len(kept_a) + (SUBDIVISION - 1) * int(cut.sum()) > MAX_INTERVALS:
            return np.zeros(0), False
        a, b, part = _parts(kept_a[cut], kept_b[cut], kept_part[cut])
        lows, highs, ways = (x[:, ~cut] for x in (lows, highs, ways))
        kept_a, kept_b, kept_part = kept_a[~cut], kept_b[~cut], kept_part[~cut]


def _outermost(steps: Sequence[Step]) -> list[int]:
    """Steps of time that may act briefly, and are not arguments of another such step."""
    bent = [s.on == TIME_ONLY and not s.logical and step_may_be_brief(s, steps) and not _transparent(s) for s in steps]
    within = [False] * len(steps)
    for k in range(len(steps) - 1, -1, -1):
        for n in steps[k].args:
            within[n] = within[n] or within[k] or bent[k]
    return [k for k in range(len(steps)) if bent[k] and not within[k]]


def _transparent(s: Step) -> bool:
    """Whether a step gives one of its arguments, or its sign: apart from its known corners it adds nothing."""
    return s.operation in (MINIMUM, MAXIMUM, WHERE) or (s.operation == CALL and s.operand in (ABS, SIGN))


def _target_ranges(
    law: IntervalLaw,
    requested: list[int],
    targets: list[int],
    t: tuple[np.ndarray, np.ndarray],
    part: np.ndarray,
    spans: Spans,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """For each target in each interval: least and greatest value, and the largest possible change."""
    found = law.enclose(requested, t, spans.at(part))
    width = t[1] - t[0]
    middle = law.points(requested, 0.5 * (t[0] + t[1]))[0]
    out = np.zeros((3, len(targets), len(width)))
    for k, target in enumerate(targets):
        (lo, hi), (down, up) = found[target]
        steepest = np.maximum(np.abs(down), np.abs(up))
        way = np.where(np.isnan(steepest), np.inf, steepest) * width
        near = 0.5 * way + ROUNDING * np.abs(middle[target])
        lo, hi = np.fmax(lo, middle[target] - near), np.fmin(hi, middle[target] + near)
        out[:, k] = lo, hi, way
    return out[0], out[1], out[2]


def _parts(a: np.ndarray, b: np.ndarray, part: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    x = a[:, None] + (b - a)[:, None] * (np.arange(SUBDIVISION + 1) / SUBDIVISION)
    x[:, -1] = b
    return x[:, :-1].ravel(), x[:, 1:].ravel(), np.repeat(part, SUBDIVISION)


def _ends(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Ends of narrow intervals without equally narrow ones near: brief actions begin and end there."""
    order = np.argsort(a)
    a, b = a[order], b[order]
    level = np.round(np.log(np.maximum(b - a, SMALL)) / np.log(SUBDIVISION)).astype(int)  # larger: wider
    out = []
    whole = b[-1] - a[0]
    for wide in np.unique(level):
        as_narrow = np.flatnonzero(level <= wide)
        mine = np.flatnonzero((level[as_narrow] == wide) & (ISOLATION_FACTOR * (b - a)[as_narrow] < whole))
        gap = np.r_[np.inf, a[as_narrow][1:] - b[as_narrow][:-1], np.inf]
        far = ISOLATION_FACTOR * (b - a)[as_narrow[mine]]
        out += [a[as_narrow[mine]][gap[mine] > far], b[as_narrow[mine]][gap[mine + 1] > far]]
    ends = np.unique(np.concatenate(out)) if out else np.zeros(0)
    return ends[(ends > a[0]) & (ends < b[-1])]


NO_TIMES = np.zeros(0)
MARGIN_FACTOR = 256.0  # distance of breaks in units in the last place
INTERIOR_FRACTION = (
    # fraction of a span where its sign is evaluated: in the middle, by symmetry, a law may touch zero
    0.381966011250105
)


class Breakpoints(NamedTuple):
    """Times [s] at which a step of the integration must end, and starts of laws whose times could not all be found."""

    times: np.ndarray  # ascending
    sharp: np.ndarray  # whether a law has a corner or a jump there; otherwise a step only has to end there
    given_up: tuple[int, ...]


NO_BREAKPOINTS = Breakpoints(NO_TIMES, np.zeros(0, bool), ())


Timed = tuple[tuple[int, list[Step]], ...]
"""Laws by their start in the code, with their steps."""


def time_dependent_laws(code: Sequence[int], starts: Iterable[int]) -> Timed:
    """Those of the laws at ``starts`` that may have corners or act briefly by time alone.

    Negative starts are left out. The result follows from the programs, whatever their constants are.
    """
    every = ((at, read_steps(code, at)) for at in dict.fromkeys(int(a) for a in starts if a >= 0))
    return tuple(
        (at, steps) for at, steps in every if any(s.on == TIME_ONLY and step_may_be_brief(s, steps) for s in steps)
    )


def find_breakpoints(laws: Timed, const: np.ndarray, t0: float, t1: float) -> Breakpoints:
    """Find times between two times [s] at which laws have corners or act briefly.

    Parameters
    ----------
    laws : Timed
        Equal ones are analysed once.
    const : ndarray
        Constants of their programs.
    t0, t1 : float
        Ends [s] of the time span, excluded.

    Returns
    -------
    Breakpoints
        At a sharp time a law may belong to either side: a step ends `rounding_margin` before it, and the next
        begins as much after it.
    """
    if not laws:
        return NO_BREAKPOINTS
    times: list[np.ndarray] = [NO_TIMES]
    smooth: list[np.ndarray] = [NO_TIMES]
    given_up = []
    done: dict[Any, bool] = {}
    for at, steps in laws:
        key = _law_key(steps, const)
        if key not in done:
            sharp, brief, done[key] = _law_breakpoints(steps, const, t0, t1)
            times.append(sharp)
            smooth.append(brief)
        if not done[key]:
            given_up.append(at)
    corner = _separated_times(np.unique(np.concatenate(times)), t0, t1)
    every = _separated_times(np.union1d(corner, np.concatenate(smooth)), t0, t1, corner)
    return Breakpoints(every, np.isin(every, corner), tuple(given_up))


def rounding_margin(t: float) -> float:
    """Distance [s] from a sharp time t beyond which a law is on one side of it in spite of rounding."""
    return 8.0 * float(np.spacing(abs(t)))


def _separated_times(t: np.ndarray, t0: float, t1: float, required: np.ndarray = NO_TIMES) -> np.ndarray:
    """Times further apart than both their margins, also from the ends; ``required`` times are always kept."""
    near = MARGIN_FACTOR * np.spacing(max(abs(t0), abs(t1)))
    t = t[(t > t0 + near) & (t < t1 - near)]
    if len(required) and len(t):
        k = np.searchsorted(required, t)
        beside = np.minimum(
            np.abs(t - required[np.maximum(k - 1, 0)]), np.abs(t - required[np.minimum(k, len(required) - 1)])
        )
        t = t[(beside > near) | (beside == 0.0)]
    return t[np.r_[True, np.diff(t) > near][: len(t)]]


def sign_changes(
    code: Sequence[int], const: np.ndarray, at: int, t0: float, t1: float
) -> tuple[np.ndarray, np.ndarray, bool]:
    """Times [s] at which a law of time alone changes its sign.

    Also returns whether it is positive after each, and whether all are found.

    Raises
    ------
    ValueError
        If the law depends on more than time.
    """
    steps = read_steps(code, at)
    if steps[-1].on == STATE_DEPENDENT:
        raise ValueError("the law depends on more than time")
    if steps[-1].on == CONSTANT_IN_TIME or not t1 > t0:
        return NO_TIMES, np.zeros(0, bool), True
    law, spans, complete = _split_at_corners(steps, const, t0, t1)
    with np.errstate(all="ignore"):
        zeros, all_found = level_crossings(law, CornerLevels(-1, len(steps) - 1, np.zeros(1)), spans)
        edges = np.unique(np.r_[spans.edges, zeros])
        t = interior_times(edges)
        positive = np.broadcast_to(law.points(range(len(steps)), t)[0][len(steps) - 1], t.shape) > 0.0
    change = np.flatnonzero(positive[1:] != positive[:-1])
    return edges[1:-1][change], positive[1:][change], complete and all_found


def interior_times(edges: np.ndarray) -> np.ndarray:
    """A time [s] within each span between edges, where the sign of the span is evaluated."""
    return edges[:-1] + INTERIOR_FRACTION * (edges[1:] - edges[:-1])


def dependence(code: Sequence[int], at: int) -> int:
    """Dependence of a law: CONSTANT_IN_TIME, TIME_ONLY, STATE_DEPENDENT."""
    return read_steps(code, at)[-1].on


def acts_briefly(code: Sequence[int], at: int) -> bool:
    """Whether a law can act briefly by more than time alone, so that it has to be sampled within steps.

    The absolute values that remain in a motion are squares u |u|, whose slope does not jump.
    """
    steps = read_steps(code, at)
    bent = [s for s in steps if s.on == STATE_DEPENDENT and not (s.operation == CALL and s.operand == ABS)]
    return any(step_may_be_brief(s, steps) for s in bent)


def _law_breakpoints(steps: list[Step], const: np.ndarray, t0: float, t1: float) -> tuple[np.ndarray, np.ndarray, bool]:
    """Corners of a law, times at which its brief actions begin and end, and whether these are all."""
    if not t1 > t0:
        return NO_TIMES, NO_TIMES, True
    law, spans, complete = _split_at_corners(steps, const, t0, t1)
    if not complete:
        return spans.edges[1:-1], NO_TIMES, False
    with np.errstate(all="ignore"):
        more, complete = pulse_times(law, spans)
    return spans.edges[1:-1], more, complete


def _split_at_corners(steps: list[Step], const: np.ndarray, t0: float, t1: float) -> tuple[IntervalLaw, Spans, bool]:
    """The law, time divided at its corners (inner ones first), and whether all are found."""
    law = IntervalLaw(steps, const)
    spans = Spans(np.array([t0, t1], float), {})
    known: list[CornerLevels] = []
    complete = True
    with np.errstate(all="ignore"):
        for c in find_corners(steps, const):
            times, found = level_crossings(law, c, spans)
            complete = complete and found and len(spans.edges) + len(times) <= MAX_INTERVALS
            known.append(c)
            edges = np.unique(np.r_[spans.edges, times])
            t = interior_times(edges)
            at = law.points(required_steps(steps, [c.of for c in known]), t)[0]
            spans = Spans(edges, {c.at: np.sign(np.broadcast_to(at[c.of], t.shape)) for c in known})
            if not complete:
                break
    return law, spans, complete


def _law_key(steps: list[Step], const: np.ndarray) -> Any:
    """Key of a law: equal keys mean equal laws."""
    return tuple(
        (s.operation, float(const[s.operand].real) if s.operation == CONSTANT else s.operand, s.args)
        if s.on != STATE_DEPENDENT or s.operation == INPUT
        else (s.operation, s.args)
        for s in steps
    )
