"""A motion with the states before and after each event, so that curves show jumps."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from itertools import groupby
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..results.contacts import event_driven_contacts
from ..results.events import Moment, Phase, Phases, event_energies

if TYPE_CHECKING:
    from ..results.result import Result

ROUNDING_PART = 1e-12  # relative tolerance for a state, or for the time span
MAX_INSTANTS = 400  # number of instants; more jumps could not be distinguished


class _EventState(NamedTuple):
    """An instant between two phases: the index of the first, and the states on both sides."""

    stretch: int
    t: float
    before: np.ndarray
    after: np.ndarray


class MotionWithEvents(NamedTuple):
    """A motion with two more times at each event.

    ``near`` is for each of its times the index of the original output time: itself, or the last before and the first
    after an event. ``more`` marks the additional times.
    """

    motion: Result
    near: np.ndarray
    more: np.ndarray


def motion_with_event_states(result: Result) -> Result:
    """Return the motion with two additional times at each event; itself if there are none."""
    return add_event_states(result).motion


def add_event_states(result: Result) -> MotionWithEvents:
    """Return the same, and the origin of its times."""
    edges, stretches = _event_states(result), result.phases
    n = len(result.t)
    if not edges or stretches is None:
        return MotionWithEvents(result, np.arange(n), np.zeros(n, bool))
    ends = np.cumsum([x.rows for x in stretches.all])
    after = np.array([int(ends[e.stretch]) for e in edges])
    at = np.repeat(after, 2)
    near = np.insert(np.arange(n), at, np.clip(np.column_stack([after - 1, after]).ravel(), 0, n - 1))
    return MotionWithEvents(
        _extended_motion(result, stretches, edges, at), near, np.insert(np.zeros(n, bool), at, True)
    )


def _extended_motion(result: Result, phases: Phases, edges: list[_EventState], at: np.ndarray) -> Result:
    """Return the motion with the states of ``edges`` inserted before the rows ``at``."""
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
    out.phases = _extended_phases(phases, edges)
    out.exchanged |= event_energies(out)
    if result.contacts is not None:
        out.contacts = event_driven_contacts(out)
    return out


def _event_states(result: Result) -> list[_EventState]:
    """Return the instants within the motion whose states and phases are known."""
    if result.phases is None or result.bulk or len(result.t) < 2:
        return []
    inside = [h for h in result.events if result.t[0] < h.t < result.t[-1] and _has_moments(h)]
    moments = [list(g) for _, g in groupby(inside, key=lambda h: h.t)]
    if len(moments) > MAX_INSTANTS:
        return []
    every, k, out = result.phases.all, 0, []
    rows = np.cumsum([x.rows for x in every])
    for own in moments:
        t, before, after = own[0].t, own[0].before.y, own[-1].after.y
        found = _phase_ending_in(every[k:-1], before)
        if found is None:
            continue
        j = k + found
        i = int(rows[j])
        at = float(np.clip(t, result.t[max(i - 1, 0)], result.t[min(i, len(result.t) - 1)]))
        if abs(at - t) <= ROUNDING_PART * (
            result.t[-1] - result.t[0]
        ):  # an output time within rounding may be on either side
            k = j + 1
            if not _same_modes(every[j], every[k]) or not np.array_equal(before, after):
                out.append(_EventState(j, at, before, after))
    return out


def _phase_ending_in(every: Sequence[Phase], y: np.ndarray) -> int | None:
    """Return the phase that ended in a state; its end may be rounded to the same time."""
    near = ROUNDING_PART * np.abs(y).max(initial=0.0)
    for most in (0.0, near):
        found = next((j for j, x in enumerate(every) if np.abs(x.end - y).max(initial=0.0) <= most), None)
        if found is not None:
            return found
    return None


def _same_modes(a: Phase, b: Phase) -> bool:
    """Return whether the modes are equal, so that only velocities can jump."""
    ways = np.array_equal(a.ways[:, -1:], b.ways[:, :1])
    return a.values is b.values and ways and np.array_equal(a.switch, b.switch, equal_nan=True)


def _has_moments(h: Any) -> bool:
    return isinstance(h.before, Moment) and isinstance(h.after, Moment)


def _extended_phases(phases: Phases, edges: Iterable[_EventState]) -> Phases:
    """Return the phases with an additional time at each side of an event."""
    first, last = np.zeros((2, len(phases.all)), int)
    for e in edges:
        last[e.stretch], first[e.stretch + 1] = 1, 1
    return Phases(
        tuple(_extended_phase(x, *n) for x, *n in zip(phases.all, first.tolist(), last.tolist(), strict=True))
    )


def _extended_phase(x: Phase, first: int, last: int) -> Phase:
    """Return a phase with additional times before and after its own."""
    ways = x.sigma
    if ways.ndim == 2 and ways.shape[1] > 1:
        ways = np.concatenate([ways[:, :1]] * first + [ways] + [ways[:, -1:]] * last, axis=1)
    return replace(x, rows=x.rows + first + last, sigma=ways)
