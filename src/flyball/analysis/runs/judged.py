"""Runs that were computed, read and judged many at once, as single runs are."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from ...errors import FlyballError
from ...results.doubts import OPEN, suspected
from ...results.ledger import whole
from ...results.result import Result
from ...tables.values import Values, values
from .compute import Answers
from .reading import reduced
from .spread import Group, Place
from .stacked import AT_ONCE, of_rows, stacked

if TYPE_CHECKING:
    from .desk import Done
    from .lean import Shared


@dataclass
class Ran:
    """Runs of a task: points, and of those that were computed groups, rows of output (runs, times, ...), steps, and how
    open constraints got.
    """

    points: np.ndarray
    rows: np.ndarray
    steps: np.ndarray
    worst: np.ndarray
    there: np.ndarray
    places: list[Place]

    @classmethod
    def none(cls, points: np.ndarray, times: int, width: int) -> Ran:
        """None is there yet."""
        n = len(points)
        return cls(points, np.zeros((n, times, width)), np.zeros(n), np.zeros(n), np.zeros(n, bool), [(None, 0)] * n)

    def take(self, done: Done) -> None:
        """Some are there."""
        self.rows[done.runs], self.steps[done.runs], self.worst[done.runs] = done.rows, done.steps, done.worst
        self.there[done.runs] = True
        for k, place in zip(done.runs.tolist(), done.places, strict=True):
            self.places[k] = place

    def of(self, some: Sequence[int]) -> Ran:
        """Some of them."""
        places = [self.places[k] for k in some]
        return Ran(self.points[some], self.rows[some], self.steps[some], self.worst[some], self.there[some], places)


@dataclass
class Seen:
    """Some runs as one result: what is asked for, (runs, times) each, and which are suspected, (runs,)."""

    curves: list[np.ndarray]
    suspected: np.ndarray
    result: Result

    def is_of_first(self, one: Seen, times: int) -> bool:
        """Whether its first run is that one, to the bit."""
        pairs = [(a[0], b[0]) for a, b in zip(self.curves, one.curves, strict=True)]
        pairs += [(a[:times], b) for a, b in zip(self._energies(), one._energies(), strict=True)]
        return all(a.tobytes() == b.tobytes() for a, b in pairs)

    def _energies(self) -> tuple[np.ndarray, ...]:
        ledger = whole(self.result)
        return ledger.kinetic, *ledger.stored, *ledger.works


class Judge:
    """Reads what is asked for, and judges. Of those that it suspects, the runs by themselves tell what is to be said.

    Attributes
    ----------
    sound : dict
        Groups of runs, by their address, and whether these can be read at once.
    """

    def __init__(self, of: Shared) -> None:
        self.of = of
        self.sound: dict[int, tuple[Group, bool]] = {}

    def read(self, ran: Ran, out: Answers) -> np.ndarray:
        """Write what is asked for of the runs that are there; which of them are suspected, (runs,)."""
        found, groups = np.zeros(len(ran.points), bool), dict[int, list[int]]()
        for k in np.flatnonzero(ran.there).tolist():
            groups.setdefault(id(ran.places[k][0]), []).append(k)
        most = max(1, AT_ONCE // ran.rows.shape[1])
        for some in (g[k : k + most] for g in groups.values() for k in range(0, len(g), most)):
            for part, seen in self._seen(ran, some):
                if seen is None:
                    found[part] = True
                    continue
                self._write(seen.curves, part, out)
                found[part] = seen.suspected
        return found

    def _seen(self, ran: Ran, some: list[int]) -> Iterator[tuple[list[int], Seen | None]]:
        """Runs of a group at once; or if these are to be looked at one by one, each by itself: none if that fails."""
        group = ran.places[some[0]][0]
        if group is not None and (seen := self._at_once(group, ran.of(some))) is not None:
            yield some, seen
            return
        for k in some:
            try:
                yield [k], self._one(ran.of([k]))
            except FlyballError:
                yield [k], None

    def _at_once(self, group: Group, ran: Ran) -> Seen | None:
        """Those of a group; none if they are to be looked at one by one. The first of a group is compared."""
        known = self.sound.get(id(group))
        if known is not None and not known[1]:
            return None
        tables, at = group.tables[-1], np.array([k for _, k in ran.places])
        try:
            x = stacked(tables.values, at, ran.rows.shape[1])
            seen = self._look(replace(x, length=tables.length[at]), ran)
        except Exception:  # something knows floats only
            self.sound[id(group)] = group, False
            return None
        if known is None:
            same = seen.is_of_first(self._one(ran.of([0])), ran.rows.shape[1])
            self.sound[id(group)] = group, same
            return seen if same else None
        return seen

    def _one(self, ran: Ran) -> Seen:
        return self._look(values(self.of.values.structure, self.of.question.at(ran.points[0]).parameters), ran)

    def _look(self, x: Values, ran: Ran) -> Seen:
        q = self.of.question
        result = of_rows(q.model, x, ran.rows, self.of.begun.wound)
        result.health.options, result.health.steps = self.of.options.choices(), ran.steps  # type: ignore[assignment]
        curves = [result.curve(r.name)[1].reshape(len(ran.rows), -1) for r in q.asked]
        told = suspected(result, len(ran.points)) | (ran.worst > OPEN * x.length)
        return Seen(curves, told, result)

    def _write(self, curves: list[np.ndarray], at: list[int], out: Answers) -> None:
        q = self.of.question
        for r, its, curve in zip(q.asked, out.values, curves, strict=True):
            for k, y in zip(at, curve, strict=True):
                its[k] = reduced(r.how, q.times, np.ascontiguousarray(y), q.times)
