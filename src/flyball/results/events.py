"""Events of a motion at their instants, and the phases between them.

Events are those of the model, impacts, stops, sticking and sliding. Within a phase the modes of all switches and all
parameters are constant. Quantities that are computed later use the phases for the state at their time: sliding
directions, closed stops, parameter values. `Moment` is the motion just before or after an event. Energies lost and
given by events are counted from the start of the motion.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import groupby
from typing import TYPE_CHECKING, Any, NamedTuple, overload

import numpy as np

from ..constraints.switches.switch_kind import SwitchKind
from ..errors import ModelError
from ..model.messages import listing, shortened_list, suggest
from ..tables.values import Values
from .reactions import IMPULSE_COMPONENTS, EventImpulses, impulse_data
from .wording import INSTANT_KINDS

if TYPE_CHECKING:
    import pandas

    from .result import Result


class RecordedModes(NamedTuple):
    """Recorded data of every switch, (ns,) each: see `tables.table_definitions.Modes`."""

    mode: np.ndarray
    hold: np.ndarray
    lower: np.ndarray
    upper: np.ndarray
    released: np.ndarray


@dataclass(frozen=True)
class Phase:
    """Consecutive output times between which nothing switched.

    Attributes
    ----------
    rows : int
        Number of output times, possibly 0.
    switch : ndarray (5, ns)
        Mode, held value, lower and upper bounds of every switch, whether it was released (`RecordedModes`).
    sigma : ndarray (ns,) or (ns, rows)
        Direction of each switch.
    values : Values
        The tables, with parameters as they were then.
    lost : float [J]
        Energy lost in impacts and sudden locking since the start.
    given : float [J]
        Energy given by applied impulses since the start.
    end : ndarray (ny,)
        The state at its end, before the event.
    """

    rows: int
    switch: np.ndarray
    sigma: np.ndarray
    values: Values
    lost: float
    given: float
    end: np.ndarray

    @property
    def modes(self) -> RecordedModes:
        """The rows of ``switch`` by name."""
        return RecordedModes(*self.switch)

    @property
    def ways(self) -> np.ndarray:
        """The directions as columns, (ns, 1) or (ns, rows)."""
        return self.sigma if self.sigma.ndim == 2 else self.sigma[:, None]


@dataclass(frozen=True)
class Phases:
    """All phases of a motion, in order."""

    all: tuple[Phase, ...]

    def over(self, what: str) -> np.ndarray:
        """Return a field of the phases at every output time, times last."""
        every = [np.asarray(getattr(x, what), float) for x in self.all]
        return np.concatenate([np.repeat(x[..., None], s.rows, -1) for x, s in zip(every, self.all, strict=True)], -1)

    @cached_property
    def mode(self) -> np.ndarray:
        """Mode of every switch, (ns, n)."""
        return self.over("switch")[0]

    @cached_property
    def sigma(self) -> np.ndarray:
        """Direction of every switch, (ns, n)."""
        every = [(x.ways, x.rows) for x in self.all]
        return np.concatenate([np.broadcast_to(x, (len(x), rows)) for x, rows in every], axis=1)

    def equal_parameter_phases(self) -> list[tuple[slice, Phases]]:
        """Return phases of equal parameters, and their output times."""
        out, first = [], 0
        for _, group in groupby(self.all, key=lambda x: id(x.values)):
            found = Phases(tuple(group))
            last = first + sum(x.rows for x in found.all)
            out.append((slice(first, last), found))
            first = last
        return out

    def moment(self, k: int) -> Phases | None:
        """Return phase k reduced to one time; None if directions change within it and none is recorded."""
        x = self.all[k]
        ways = x.ways[:, -1] if x.ways.shape[1] else None
        return None if ways is None else Phases((replace(x, rows=1, sigma=ways),))

    def cut(self, rows: int) -> Phases:
        """Return the phases of the first ``rows`` output times."""
        out, left = list[Phase](), rows
        for x in self.all:
            n = min(x.rows, left)
            out.append(replace(x, rows=n, sigma=x.sigma[:, :n] if x.sigma.ndim == 2 else x.sigma))
            left -= n
        return Phases(tuple(out))


def phases_or_none(phases: Sequence[Phase]) -> Phases | None:
    """Return the phases of a motion; None if there are none."""
    return Phases(tuple(phases)) if phases else None


def split_by_parameters(result: Any) -> tuple[Any, ...]:
    """Return a result in pieces of constant parameters, if parameters changed; else none."""
    cuts = result.phases.equal_parameter_phases() if result.phases is not None else []
    if len(cuts) < 2:
        return ()
    names = "t", "q", "v", "states", "vdot", "multipliers"
    out = []
    for at, stretches in cuts:
        parts = (getattr(result, name)[at] for name in names)
        piece = type(result)(result.model, stretches.all[0].values, *parts, result.health)
        piece.phases, piece.wound = stretches, result.wound
        piece.exchanged = {k: x[at] for k, x in result.exchanged.items()}
        piece.begun, piece.within = result.begun, (result, at)
        piece.bulk = {name: own.at_times(at) for name, own in result.bulk.items()}
        if result.contacts is not None:
            piece.contacts = result.contacts.at_times(range(at.start, at.stop))
        out.append(piece)
    return tuple(out)


EVENT_WORK = "event_work"
"""Energy given by events: by applied impulses, and by parameter changes."""
CUMULATIVE_ENERGIES = ("friction_loss", "impact_loss", "surface_work", "numerical_loss", EVENT_WORK)
"""Energies in `Result.exchanged` that are accumulated over consecutive motions."""
ALL_PARTS = ""


@dataclass
class MotionStart:
    """Initial state of a motion.

    Attributes
    ----------
    y : ndarray (ny,) or None
        The initial state vector; None if unknown.
    done : dict
        Energies exchanged by earlier motions [J], by the names of `CUMULATIVE_ENERGIES`, and the earlier work of each
        force's stored energy.
    """

    y: np.ndarray | None = None
    done: dict[str, float] = field(default_factory=dict)


def event_energies(result: Any) -> dict[str, np.ndarray]:
    """Return energies [J] since the start, by their names in `Result.exchanged`: lost in impacts, given by events."""
    if result.phases is None:
        return {}
    done, over = result.begun.done, result.phases.over
    lost, given = over("lost") + done.get("impact_loss", 0.0), over("given") + done.get(EVENT_WORK, 0.0)
    return {"impact_loss": lost, EVENT_WORK: given + _at_output_times(result, _stored_by_events(result, ALL_PARTS))}


def stored_reference(result: Any, name: str) -> np.ndarray:
    """Return the energy stored in a force at the start, plus that stored in it by events since [J] (n,).

    The work on the bodies since the start is this value minus the currently stored energy.
    """
    whole, at = result.within or (result, slice(None))
    if isinstance(at, int):  # a moment of that phase
        return np.full(len(result.t), _stored_by_events(whole, name)[at] + _stored_at_start(whole, name))
    known = whole.__dict__.setdefault("_basis", {})
    if name not in known:
        known[name] = stored_by_events(whole, name) + _stored_at_start(whole, name)
    return known[name][at]


def stored_by_events(result: Any, name: str) -> np.ndarray:
    """Return the energy [J] that events have stored in a force since the start, (n,)."""
    if result.phases is None:
        return np.zeros(len(result.t))
    return _at_output_times(result, _stored_by_events(result, name))


def event_energies_in_phase(result: Any, k: int) -> dict[str, np.ndarray]:
    """Return the same as `event_energies`, at a moment of phase k of a result."""
    done, x = result.begun.done, result.phases.all[k]
    given = x.given + done.get(EVENT_WORK, 0.0) + _stored_by_events(result, ALL_PARTS)[k]
    return {"impact_loss": np.array([x.lost + done.get("impact_loss", 0.0)]), EVENT_WORK: np.array([given])}


def energies_at_end(before: Any) -> dict[str, float]:
    """Return the energies with which a continued motion starts, for `MotionStart.done`."""
    done, last = before.begun.done, before.phases.all[-1] if before.phases is not None else None
    out = {k: done[k] for k in CUMULATIVE_ENERGIES if k in done}
    if last is not None:
        totals = {"impact_loss": last.lost, EVENT_WORK: last.given + _stored_by_events(before, ALL_PARTS)[-1]}
        out |= {k: x + done.get(k, 0.0) for k, x in totals.items()}
    else:
        out |= {k: float(x[-1]) for k, x in before.exchanged.items() if k in CUMULATIVE_ENERGIES and len(x)}
    values = before.values if last is None else last.values
    now = _stored_energies(before, (values, None if last is None else last.switch), before.final[1])
    for f in values.structure.forces:
        if f.energy is not None:
            jumped = _stored_by_events(before, f.name)[-1] if last is not None else 0.0
            out[f.name] = float(_stored_at_start(before, f.name) + jumped - now[f.name])
    return {k: x for k, x in out.items() if x != 0.0}


def cumulative_exchanges(result: Any) -> dict[str, np.ndarray]:
    """Return the energies exchanged by contacts, including earlier motions."""
    return {
        k: x + (result.begun.done.get(k, 0.0) if k in CUMULATIVE_ENERGIES else 0.0) for k, x in result.exchanged.items()
    }


def _stored_at_start(result: Any, name: str) -> Any:
    """Return the energy stored in a force at the start, and its earlier work [J]; at the first output if unknown."""
    if result.begun.y is None or _starts_at_first_output(result):
        stored = result[name].energy[:1].sum()  # complex for derivatives
        return stored + result.begun.done.get(name, 0.0)
    known = result.__dict__.setdefault("_at_first", {})
    if not known:
        every = result.phases.all if result.phases is not None else ()
        by = (every[0].values, every[0].switch) if every else (result.values, None)
        known.update(_stored_energies(result, by, result.begun.y))
    return known.get(name, 0.0) + result.begun.done.get(name, 0.0)


def _starts_at_first_output(result: Any) -> bool:
    """Return whether the first output is the initial state, with no change by events since."""
    if result.phases is not None or not len(result.t):
        return False
    first = np.concatenate([x[0] for x in (result.q, result.v, result.hints)])
    return np.array_equal(first, result.begun.y)


def _at_output_times(result: Any, each: list[float]) -> np.ndarray:
    """Return numbers of the phases at every output time."""
    return np.repeat(each, [x.rows for x in result.phases.all])


def _stored_by_events(result: Any, name: str) -> list[float]:
    """Return the energy stored by events since the start [J], by phases, in a force or in all parts (`ALL_PARTS`).

    It is the increase of the energy of the same state. A released force loses all its energy.
    """
    known = result.__dict__.setdefault("_jumped", {})
    if not known:
        known.update(_find_stored_by_events(result))
    return known.get(name) or [0.0] * len(result.phases.all)


def _find_stored_by_events(result: Any) -> dict[str, list[float]]:
    every = result.phases.all
    names = [ALL_PARTS, *(f.name for f in every[0].values.structure.forces)]
    total = dict.fromkeys(names, 0.0)
    out: dict[str, list[float]] = {name: [] for name in names}
    for k, x in enumerate(every):
        old = every[k - 1] if k else x
        other = x.values is not old.values
        if other or (x.modes.released != old.modes.released).any():
            now, then = (
                _stored_energies(result, by, old.end) for by in ((x.values, x.switch), (old.values, old.switch))
            )
            total |= {name: total[name] + now[name] - then[name] for name in names if name != ALL_PARTS}
            if other:
                total[ALL_PARTS] += (
                    _stored_energies(result, (x.values, old.switch), old.end)[ALL_PARTS] - then[ALL_PARTS]
                )
        for name in names:
            out[name].append(total[name])
    return out


def _stored_energies(result: Any, by: tuple[Any, Any], y: np.ndarray) -> dict[str, float]:
    """The energy [J] of a state with given tables and switches (none: all active): of every force, and in total."""
    values, switch = by
    s = values.structure
    q, v, z = np.split(y[None, :], [s.nq, s.nq + s.nv], axis=1)
    still, none = np.zeros((1, s.nv)), np.zeros((1, len(s.rows) + len(s.prescribed)))
    one = type(result)(result.model, values, np.zeros(1), q, v, z, still, none, result.health)
    released = np.zeros(len(s.switches)) if switch is None else RecordedModes(*switch).released
    gone = {x.element.name for k, x in enumerate(s.switches) if released[k] != 0.0}
    out = {f.name: 0.0 if f.energy is None or f.name in gone else float(one[f.name].energy[0]) for f in s.forces}
    return out | {ALL_PARTS: float(one.energy.kinetic[0] + one.energy.gravity[0]) + sum(out.values())}


class Moment:
    """Positions and velocities at one instant: ``moment["block.vx"]``.

    Accelerations and forces of constraints have no value there: they jump.

    Attributes
    ----------
    t : float [s]
    y : ndarray
        State vector: coordinates, velocities, angles and works.
    values : Values
        The mechanism with the parameters of that time.
    came : tuple of (ndarray, int)
        The state with which the motion reached the instant, and whether this moment is before (0) or after (1) it.
    """

    def __init__(
        self, result: Result, values: Values, t: float, y: np.ndarray, came: tuple[np.ndarray, int] | None = None
    ) -> None:
        self._of, self.values, self.t, self.y, self.came = result, values, float(t), y, came

    @cached_property
    def stretch(self) -> int:
        """Return the phase that it ends or begins; -1 if unknown, as at the start."""
        every = self._of.phases.all if self._of.phases is not None else ()
        if self.came is None:
            return -1
        y, after = self.came
        found = next((k for k, x in enumerate(every) if np.array_equal(x.end, y)), -1)
        return found if found < 0 else min(found + after, len(every) - 1)

    @cached_property
    def single_time_result(self) -> Result:
        """Return a result of this one time; unknown data are nan."""
        r = self._of
        s = self.values.structure
        q, v, z = (p[None, :] for p in np.split(self.y, [s.nq, s.nq + s.nv]))
        unknown = np.full((1, s.nv), np.nan), np.full((1, len(s.rows) + len(s.prescribed)), np.nan)
        made = type(r)(r.model, self.values, np.array([self.t]), q, v, z, *unknown, r.health)
        made.wound = r.wound
        if self.stretch >= 0 and r.phases is not None:
            made.begun, made.within = r.begun, (r, self.stretch)
            made.exchanged |= event_energies_in_phase(r, self.stretch)
            made.phases = r.phases.moment(self.stretch)
        return made

    def __getitem__(self, name: str) -> Any:
        """A curve such as ``"block.vx"`` as a number, or a vector such as ``"block.velocity"``.

        Raises
        ------
        ModelError
            If there is no such curve, or it jumps there.
        """
        value = np.asarray(
            self.single_time_result.channel(f"{name}.value" if name in self.single_time_result.model else name)[1]
        )[0]
        if not np.isfinite(value).all():
            raise ModelError(
                f"{name!r} has no value at the instant t = {self.t:.6g} s of an event: accelerations and forces of "
                "constraints jump there; read positions, velocities and energies, or values at output times"
            )
        return float(value) if np.ndim(value) == 0 else value

    def __repr__(self) -> str:
        return f"<{self._of.model.name!r} at t = {self.t:.6g} s>"


MAX_ROWS = 20  # number of lines of a printed table
TABLE_HEAD = ("t [s]", "name", "kind", "done", "lost [J]")


@dataclass(frozen=True)
class EventRecord:
    """An event at one instant.

    Attributes
    ----------
    t : float [s]
    name : str
        Name of the event or element; of simultaneous ones separated by commas.
    kind : str
        ``"event"`` for an `Event` of the model, else its kind: ``"impact"``, ``"stop"``, ``"stick"``, ...
    done : tuple of str
        Descriptions of the actions.
    lost : float [J]
        Energy lost in impacts and sudden locking.
    impulses : mapping
        Element -> impulse [N s] or [N m s]: a number along its coordinate, or components; see
        `reactions.EventImpulses`.
    before, after : Moment, optional
        The motion just before and after: ``happening.after["block.vx"]``.
    """

    t: float
    name: str
    kind: str
    done: tuple[str, ...] = ()
    lost: float = 0.0
    impulses: Mapping[str, Any] = field(default_factory=dict)
    before: Any = field(default=None, repr=False, compare=False)  # state vectors, until the result is attached
    after: Any = field(default=None, repr=False, compare=False)
    tables: Any = field(default=None, repr=False, compare=False)  # parameters before and after, if one was set

    def as_dict(self) -> dict[str, Any]:
        """Plain data, without the states."""
        told = {k: impulse_data(x) for k, x in self.impulses.items()}
        return {
            "t": float(self.t),
            "name": self.name,
            "kind": self.kind,
            "done": list(self.done),
            "lost": float(self.lost),
            "impulses": told,
        }

    def __str__(self) -> str:
        did = f": {', '.join(self.done)}" if self.done else ""
        lost = f", {self.lost:.4g} J lost" if self.lost else ""
        return f"t = {self.t:.6g} s, {self.name} ({self.kind}){did}{lost}"


class Events(Sequence):
    """All events of a motion, in the order of time; ``run.events["hit"]`` are those of a name.

    ``of`` is their result.
    """

    def __init__(self, records: Iterable[EventRecord], of: Result | None = None) -> None:
        self._all, self._of = tuple(records), of

    def __len__(self) -> int:
        return len(self._all)

    def __iter__(self) -> Iterator[EventRecord]:
        return iter(self._all)

    @overload
    def __getitem__(self, which: int) -> EventRecord: ...
    @overload
    def __getitem__(self, which: slice | str) -> Events: ...
    def __getitem__(self, which: int | slice | str) -> EventRecord | Events:
        """Return one by its index, several by a slice, or those of a name or kind."""
        if isinstance(which, str):
            return self.of(which)
        return Events(self._all[which], self._of) if isinstance(which, slice) else self._all[which]

    def of(self, name: str) -> Events:
        """Return those of an event, element or kind of this name; empty if it exists but never occurred.

        Raises
        ------
        ModelError
            If nothing has that name; the message lists the names that occurred.
        """
        found = [h for h in self._all if h.kind == name or name in h.name.split(", ")]
        if not found and name not in (*INSTANT_KINDS, *SwitchKind.transitions) and name not in (able := self._able()):
            names = self.names()
            meant, known = suggest(name, [*names, *sorted(able)]), listing(names) if names else "nothing did"
            raise ModelError(f"nothing named {name!r} happened{meant}; {known}")
        return Events(found, self._of)

    def _able(self) -> set[str]:
        """Return the names of all possible events."""
        if self._of is None:
            return set()
        held = self._of.phases.all[0].values.structure.switches if self._of.phases is not None else ()
        return {e.name for e in self._of.model.elements()} | {x.switch.label or x.element.name for x in held}

    def names(self) -> list[str]:
        """Names of the events that occurred, each once, in the order of time."""
        return list(dict.fromkeys(part for h in self._all for part in h.name.split(", ")))

    @property
    def t(self) -> np.ndarray:
        """Times, (n,) [s]."""
        return np.array([h.t for h in self._all])

    @property
    def lost(self) -> np.ndarray:
        """Energy lost at each, (n,) [J]."""
        return np.array([h.lost for h in self._all])

    def counts(self) -> dict[str, int]:
        """Number of occurrences, by name."""
        return {name: sum(name in h.name.split(", ") for h in self._all) for name in self.names()}

    def as_dict(self) -> list[dict[str, Any]]:
        """Plain data."""
        return [h.as_dict() for h in self._all]

    def summary(self) -> str:
        """Return the number of events, and how often each occurred; empty if there are none."""
        if not self._all:
            return ""
        told = shortened_list((f"{name} {n} times" if n > 1 else name for name, n in self.counts().items()), 90)
        lost = f"; {self.lost.sum():.4g} J lost" if self.lost.any() else ""
        return f"{len(self)}: {told}{lost}"

    def to_dataframe(self) -> pandas.DataFrame:
        """One row each: t, name, kind, done, lost; columns of impulses: ``"impulse stop"``, ``"impulse A fx"``."""
        import pandas as pd

        rows: list[dict[str, Any]] = []
        for h in self._all:
            row = {"t": h.t, "name": h.name, "kind": h.kind, "done": "; ".join(h.done), "lost": h.lost}
            rows.append(row | dict(_impulse_columns(h.impulses)))
        return pd.DataFrame(rows, columns=None if rows else ["t", "name", "kind", "done", "lost"])

    def _table(self) -> tuple[list[tuple[str, ...]], str]:
        """Return the rows of the printed table, and what is left out of it."""
        shown = self._all if len(self._all) <= MAX_ROWS else (*self._all[: MAX_ROWS - 1], self._all[-1])
        rows: list[tuple[str, ...]]
        rows = [(f"{h.t:.6g}", h.name, h.kind, "; ".join(h.done), f"{h.lost:.4g}" if h.lost else "") for h in shown]
        left = len(self._all) - len(shown)
        return rows, f"{left} more before the last one" if left else ""

    def __repr__(self) -> str:
        if not self._all:
            return "<no events>"
        rows, left = self._table()
        widths = [max(len(row[k]) for row in (TABLE_HEAD, *rows)) for k in range(len(TABLE_HEAD))]
        text = [
            "  ".join(cell.ljust(w) for cell, w in zip(row, widths, strict=True)).rstrip()
            for row in (TABLE_HEAD, *rows)
        ]
        if left:
            text.insert(-1, f"... {left}")
        return "\n".join(text)

    def _repr_html_(self) -> str:
        from html import escape

        rows, left = self._table()
        head = "".join(f"<th>{escape(cell)}</th>" for cell in TABLE_HEAD)
        body = ["".join(f"<td>{escape(cell)}</td>" for cell in row) for row in rows]
        if left:
            body.insert(-1, f"<td colspan={len(TABLE_HEAD)}>... {left}</td>")
        return f"<table><tr>{head}</tr>" + "".join(f"<tr>{row}</tr>" for row in body) + "</table>"


def _impulse_columns(impulses: Mapping[str, Any]) -> Iterator[tuple[str, float]]:
    """Return impulses by their column names: a number, or each component."""
    for name, x in impulses.items():
        parts = (
            dict(x)
            if isinstance(x, Mapping)
            else dict(zip(IMPULSE_COMPONENTS, x, strict=True))
            if np.ndim(x)
            else {"": x}
        )
        yield from ((f"impulse {name} {k}".rstrip(), float(v)) for k, v in parts.items())


def with_moments(records: list[EventRecord], result: Result) -> Iterator[EventRecord]:
    """Return events with states that can be read by name, with the parameters of their time."""
    now = next((h.tables[0] for h in records if h.tables is not None), result.values)
    since, came = np.nan, None
    for h in records:
        if h.t != since:
            since, came = h.t, h.before if isinstance(h.before, np.ndarray) else None
        both = h.tables or (now, now)
        now = both[1]
        before, after = (
            Moment(result, x, h.t, y, None if came is None else (came, k)) if isinstance(y, np.ndarray) else y
            for k, (x, y) in enumerate(zip(both, (h.before, h.after), strict=True))
        )
        impulses = h.impulses
        if isinstance(impulses, EventImpulses) and isinstance(before, Moment) and isinstance(after, Moment):
            impulses = impulses.bound(before, after)
        yield dataclasses.replace(h, before=before, after=after, impulses=impulses)
