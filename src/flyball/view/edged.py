"""A motion with the states just before and after each event between its output times: jumps upright.

Accelerations and forces of constraints have no value there, so their curves are broken.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from itertools import groupby
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..results.booked import booked
from ..results.moment import Moment
from ..results.stretches import Stretch, Stretches

if TYPE_CHECKING:
    from ..results.result import Result

MOST = 400  # instants; of more, jumps are too near to each other to be told apart


class _Edge(NamedTuple):
    """An instant between two stretches: the number of the first, and the states on both sides."""

    stretch: int
    t: float
    before: np.ndarray
    after: np.ndarray


def edged(result: Result) -> Result:
    """The motion with two more times at each event; itself where there are none."""
    edges = _edges(result)
    if not edges:
        return result
    stretches = result.stretches
    if stretches is None:
        return result
    ends = np.cumsum([x.rows for x in stretches.all])
    at = np.repeat([int(ends[e.stretch]) for e in edges], 2)
    y = np.array([x for e in edges for x in (e.before, e.after)])
    s = result.values.structure
    q, v, z = np.split(y, [s.nq, s.nq + s.nv], axis=1)
    unknown = (np.full((len(at), a.shape[1]), np.nan) for a in (result.vdot, result.multipliers))
    t = np.repeat([e.t for e in edges], 2)
    arrays = (result.t, result.q, result.v, result.states, result.vdot, result.multipliers)
    more = (t, q, v, z, *unknown)
    t, q, v, z, vdot, lam = (np.insert(a, at, x, axis=0) for a, x in zip(arrays, more, strict=True))
    out = type(result)(result.model, result.values, t, q, v, z, vdot, lam, result.health)
    out.wound = result.wound
    out.stretches = _longer(stretches, edges)
    out.exchanged |= booked(out)
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
    for own in moments:
        before, after = own[0].before.y, own[-1].after.y
        found = next((j for j in range(k, len(every) - 1) if np.array_equal(every[j].end, before)), None)
        if found is not None:
            out.append(_Edge(found, own[0].t, before, after))
            k = found + 1
    return out


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
