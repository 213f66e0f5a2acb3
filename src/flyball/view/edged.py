"""A motion with the states just before and after each event between its output times: jumps upright.

Accelerations and forces of constraints have no value there, so their curves are broken.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from itertools import groupby
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..results.booked import booked
from ..results.moment import Moment
from ..results.stretches import Stretch, Stretches
from ..results.touched import contacts

if TYPE_CHECKING:
    from ..results.result import Result

ROUNDING = 1e-12  # of a state, or of the time span
MOST = 400  # instants; of more, jumps are too near to each other to be told apart


class _Edge(NamedTuple):
    """An instant between two stretches: the number of the first, and the states on both sides."""

    stretch: int
    t: float
    before: np.ndarray
    after: np.ndarray


class Edged(NamedTuple):
    """A motion with two more times at each event.

    ``near`` is for each of its times the output time of the motion that it was made of: itself, or the last before and
    the first after an event. ``more`` says which times are more.
    """

    motion: Result
    near: np.ndarray
    more: np.ndarray


def edged(result: Result) -> Result:
    """The motion with two more times at each event; itself where there are none."""
    return with_edges(result).motion


def with_edges(result: Result) -> Edged:
    """The same, and where its times come from."""
    edges, stretches = _edges(result), result.stretches
    n = len(result.t)
    if not edges or stretches is None:
        return Edged(result, np.arange(n), np.zeros(n, bool))
    ends = np.cumsum([x.rows for x in stretches.all])
    after = np.array([int(ends[e.stretch]) for e in edges])
    at = np.repeat(after, 2)
    near = np.insert(np.arange(n), at, np.clip(np.column_stack([after - 1, after]).ravel(), 0, n - 1))
    return Edged(_longer_motion(result, stretches, edges, at), near, np.insert(np.zeros(n, bool), at, True))


def _longer_motion(result: Result, stretches: Stretches, edges: list[_Edge], at: np.ndarray) -> Result:
    """The motion with the states of edges before the rows ``at``."""
    y = np.array([x for e in edges for x in (e.before, e.after)])
    s = result.values.structure
    q, v, z = np.split(y, [s.nq, s.nq + s.nv], axis=1)
    unknown = (np.full((len(at), a.shape[1]), np.nan) for a in (result.vdot, result.multipliers))
    t = np.repeat([e.t for e in edges], 2)
    arrays = (result.t, result.q, result.v, result.states, result.vdot, result.multipliers)
    more = (t, q, v, z, *unknown)
    t, q, v, z, vdot, lam = (np.insert(a, at, x, axis=0) for a, x in zip(arrays, more, strict=True))
    out = type(result)(result.model, result.values, t, q, v, z, vdot, lam, result.health)
    out.wound, out.begun = result.wound, result.begun
    out.stretches = _longer(stretches, edges)
    out.exchanged |= booked(out)
    if result.contacts is not None:
        out.contacts = contacts(out)
    return out


def _edges(result: Result) -> list[_Edge]:
    """Instants within the motion whose states and stretches are known."""
    if result.stretches is None or result.bulk or len(result.t) < 2:
        return []
    inside = [h for h in result.events if result.t[0] < h.t < result.t[-1] and _told(h)]
    moments = [list(g) for _, g in groupby(inside, key=lambda h: h.t)]
    if len(moments) > MOST:
        return []
    every, k, out = result.stretches.all, 0, []
    rows = np.cumsum([x.rows for x in every])
    for own in moments:
        t, before, after = own[0].t, own[0].before.y, own[-1].after.y
        found = _ended(every[k:-1], before)
        if found is None:
            continue
        j = k + found
        i = int(rows[j])
        at = float(np.clip(t, result.t[max(i - 1, 0)], result.t[min(i, len(result.t) - 1)]))
        if abs(at - t) <= ROUNDING * (
            result.t[-1] - result.t[0]
        ):  # an output time within rounding may be on either side
            k = j + 1
            if not _same(every[j], every[k]) or not np.array_equal(before, after):
                out.append(_Edge(j, at, before, after))
    return out


def _ended(every: Sequence[Stretch], y: np.ndarray) -> int | None:
    """The stretch that ended in a state; an instant may be the last place of a time after it."""
    near = ROUNDING * np.abs(y).max(initial=0.0)
    for most in (0.0, near):
        found = next((j for j, x in enumerate(every) if np.abs(x.end - y).max(initial=0.0) <= most), None)
        if found is not None:
            return found
    return None


def _same(a: Stretch, b: Stretch) -> bool:
    """Whether the same holds in both, so that nothing jumps between them but velocities."""
    ways = np.array_equal(a.ways[:, -1:], b.ways[:, :1])
    return a.values is b.values and ways and np.array_equal(a.switch, b.switch, equal_nan=True)


def _told(h: Any) -> bool:
    return isinstance(h.before, Moment) and isinstance(h.after, Moment)


def _longer(stretches: Stretches, edges: Iterable[_Edge]) -> Stretches:
    """The stretches with one more time at each side of an edge."""
    first, last = np.zeros((2, len(stretches.all)), int)
    for e in edges:
        last[e.stretch], first[e.stretch + 1] = 1, 1
    return Stretches(tuple(_padded(x, *n) for x, *n in zip(stretches.all, first.tolist(), last.tolist(), strict=True)))


def _padded(x: Stretch, first: int, last: int) -> Stretch:
    """A stretch with more times before and after its own."""
    ways = x.sigma
    if ways.ndim == 2 and ways.shape[1] > 1:
        ways = np.concatenate([ways[:, :1]] * first + [ways] + [ways[:, -1:]] * last, axis=1)
    return replace(x, rows=x.rows + first + last, sigma=ways)
