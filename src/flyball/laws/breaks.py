"""Times at which laws have corners, jump, or begin and end to do something brief, as far as these depend on time alone.

They are found before a motion begins, from the laws' programs, by interval arithmetic, so that none is missed however
brief it is. What depends on the state cannot be known before.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np

from .intervals.crossings import MOST, Spans, crossings
from .intervals.enclose import Law
from .intervals.resolve import grades
from .intervals.steps import NOTHING, STATE, TIME, Corner, Step, brief, corners, needed, read
from .opcodes import ABS, CALL, CONSTANT, INPUT

NONE = np.zeros(0)
NEAR = 256.0  # units in the last place that breaks are apart
INSIDE = 0.381966011250105  # part of a span where its sign is read: in the middle, by symmetry, a law may touch zero


class Breaks(NamedTuple):
    """Times [s] at which a step of the integration ends, and starts of laws of which not all could be found."""

    times: np.ndarray  # ascending
    sharp: np.ndarray  # whether a law has a corner there, or jumps; otherwise a step only has to end there
    given_up: tuple[int, ...]


NO_BREAKS = Breaks(NONE, np.zeros(0, bool), ())


Timed = tuple[tuple[int, list[Step]], ...]
"""Laws by where they start in the code, with their steps."""


def timed(code: Sequence[int], starts: Iterable[int]) -> Timed:
    """The laws among those that start at ``starts`` that may have corners or act briefly by time alone.

    Negative starts are left out. It follows from the programs, whatever their constants are.
    """
    every = ((at, read(code, at)) for at in dict.fromkeys(int(a) for a in starts if a >= 0))
    return tuple((at, steps) for at, steps in every if any(s.on == TIME and brief(s, steps) for s in steps))


def found_beforehand(laws: Timed, const: np.ndarray, t0: float, t1: float) -> Breaks:
    """Where laws have corners or act briefly between two times [s].

    Parameters
    ----------
    laws : Timed
        Equal ones are looked at once.
    const : ndarray
        Constants of their programs.
    t0, t1 : float
        The time [s] that is looked at, without its ends.

    Returns
    -------
    Breaks
        Where a law is sharp it may belong to either side at the time itself: a step ends `margin` before, and the
        next begins as much behind.
    """
    if not laws:
        return NO_BREAKS
    times: list[np.ndarray] = [NONE]
    smooth: list[np.ndarray] = [NONE]
    given_up = []
    done: dict[Any, bool] = {}
    for at, steps in laws:
        key = _meaning(steps, const)
        if key not in done:
            sharp, brief, done[key] = _of_law(steps, const, t0, t1)
            times.append(sharp)
            smooth.append(brief)
        if not done[key]:
            given_up.append(at)
    corner = _apart(np.unique(np.concatenate(times)), t0, t1)
    every = _apart(np.union1d(corner, np.concatenate(smooth)), t0, t1, corner)
    return Breaks(every, np.isin(every, corner), tuple(given_up))


def margin(t: float) -> float:
    """How far [s] from a sharp time t a law is on one side of it for sure, as far as rounding goes."""
    return 8.0 * float(np.spacing(abs(t)))


def _apart(t: np.ndarray, t0: float, t1: float, kept: np.ndarray = NONE) -> np.ndarray:
    """Times that are apart by more than both their margins, and from the ends; ``kept`` stay in any case."""
    near = NEAR * np.spacing(max(abs(t0), abs(t1)))
    t = t[(t > t0 + near) & (t < t1 - near)]
    if len(kept) and len(t):
        k = np.searchsorted(kept, t)
        beside = np.minimum(np.abs(t - kept[np.maximum(k - 1, 0)]), np.abs(t - kept[np.minimum(k, len(kept) - 1)]))
        t = t[(beside > near) | (beside == 0.0)]
    return t[np.r_[True, np.diff(t) > near][: len(t)]]


def reached(
    code: Sequence[int], const: np.ndarray, at: int, t0: float, t1: float
) -> tuple[np.ndarray, np.ndarray, bool]:
    """Times [s] at which a law of time alone changes its sign, whether it is positive behind each, and if that is all.

    Raises
    ------
    ValueError
        If the law depends on more than time.
    """
    steps = read(code, at)
    if steps[-1].on == STATE:
        raise ValueError("the law depends on more than time")
    if steps[-1].on == NOTHING or not t1 > t0:
        return NONE, np.zeros(0, bool), True
    law, spans, complete = _cut(steps, const, t0, t1)
    with np.errstate(all="ignore"):
        zeros, all_found = crossings(law, Corner(-1, len(steps) - 1, np.zeros(1)), spans)
        edges = np.unique(np.r_[spans.edges, zeros])
        t = within(edges)
        positive = np.broadcast_to(law.points(range(len(steps)), t)[0][len(steps) - 1], t.shape) > 0.0
    change = np.flatnonzero(positive[1:] != positive[:-1])
    return edges[1:-1][change], positive[1:][change], complete and all_found


def within(edges: np.ndarray) -> np.ndarray:
    """A time [s] within each span between edges where the sign of the span is read."""
    return edges[:-1] + INSIDE * (edges[1:] - edges[:-1])


def depends(code: Sequence[int], at: int) -> int:
    """What a law depends on: NOTHING, TIME, STATE."""
    return read(code, at)[-1].on


def acts_briefly(code: Sequence[int], at: int) -> bool:
    """Whether a law can act briefly by more than time alone, so that samples have to guard it.

    What is left of absolute values in a motion are squares u |u|, whose slope has no jump.
    """
    steps = read(code, at)
    bent = [s for s in steps if s.on == STATE and not (s.operation == CALL and s.operand == ABS)]
    return any(brief(s, steps) for s in bent)


def _of_law(steps: list[Step], const: np.ndarray, t0: float, t1: float) -> tuple[np.ndarray, np.ndarray, bool]:
    """Its corners, where brief actions of it begin and end, and whether these are all."""
    if not t1 > t0:
        return NONE, NONE, True
    law, spans, complete = _cut(steps, const, t0, t1)
    if not complete:
        return spans.edges[1:-1], NONE, False
    with np.errstate(all="ignore"):
        more, complete = grades(law, spans)
    return spans.edges[1:-1], more, complete


def _cut(steps: list[Step], const: np.ndarray, t0: float, t1: float) -> tuple[Law, Spans, bool]:
    """The law, the time cut at its corners, inner ones first, and whether all are found."""
    law = Law(steps, const)
    spans = Spans(np.array([t0, t1], float), {})
    known: list[Corner] = []
    complete = True
    with np.errstate(all="ignore"):
        for c in corners(steps, const):
            times, found = crossings(law, c, spans)
            complete = complete and found and len(spans.edges) + len(times) <= MOST
            known.append(c)
            edges = np.unique(np.r_[spans.edges, times])
            t = within(edges)
            at = law.points(needed(steps, [c.of for c in known]), t)[0]
            spans = Spans(edges, {c.at: np.sign(np.broadcast_to(at[c.of], t.shape)) for c in known})
            if not complete:
                break
    return law, spans, complete


def _meaning(steps: list[Step], const: np.ndarray) -> Any:
    """What tells laws apart."""
    return tuple(
        (s.operation, float(const[s.operand].real) if s.operation == CONSTANT else s.operand, s.args)
        if s.on != STATE or s.operation == INPUT
        else (s.operation, s.args)
        for s in steps
    )
