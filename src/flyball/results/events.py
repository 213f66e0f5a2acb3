"""Events of a motion at their instants: events of the model, impacts, stops, sticking and sliding."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, overload

import numpy as np

from ..constraints.switches.switch_kind import SwitchKind
from ..errors import ModelError
from ..model.messages import listing, shortened_list, suggest
from .phases import Moment
from .reactions import IMPULSE_COMPONENTS, EventImpulses, impulse_data
from .wording import INSTANT_KINDS

if TYPE_CHECKING:
    import pandas

    from .result import Result

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
