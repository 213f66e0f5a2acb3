"""Runs that were computed, read and judged many at once, as single runs are."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import numpy as np

from ...errors import FlyballError
from ...math.lanes import Lanes
from ...model.model import Model
from ...results.doubts import OPEN, suspected
from ...results.health import Health
from ...results.ledger import whole
from ...results.records import Records
from ...results.result import Result
from ...tables.poses import Poses
from ...tables.values import Values, values
from .compute import Answers
from .reading import reduced
from .spread import TABLES, Group, Place

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


# Runs of a study read as if they were one motion: where they differ, arrays over time stand in the tables.


AT_ONCE = 20_000  # times that are read at once: each takes some kilobytes


def of_rows(model: Model, x: Values, rows: np.ndarray, wound: Mapping[str, float]) -> Result:
    """Rows of output of runs (runs, times, ...), one after the other, as a result.

    With states alone it has no accelerations and reactions.
    """
    s, flat = x.structure, rows.reshape(-1, rows.shape[2])
    cuts = np.cumsum([1, s.nq, s.nv, len(s.states), s.nv])
    t, p, v, z, vdot, lam = (np.ascontiguousarray(a) for a in np.split(flat, cuts, axis=1))
    states = flat.shape[1] <= cuts[3]
    if states:
        vdot, lam = np.zeros((len(flat), s.nv)), np.zeros((len(flat), len(s.rows) + len(s.prescribed)))
    result = Result(model, x, t[:, 0], p, v, z, vdot, lam, unjudged())
    result.wound = dict(wound)
    if states:
        result.records = Records(x, p, v, None, wound)
    return result


def unjudged() -> Health:
    """Of a result that is read and forgotten."""
    return Health(True, "", 0.0, 0.0, 0, 0, 0, 0, 0.0)


def stacked(x: Values, some: np.ndarray, times: int) -> Values:
    """Values of some runs of a group, one after the other, each at so many times."""

    def over(a: Any) -> Any:
        return Lanes(np.repeat(a.x[some], times)) if type(a) is Lanes else a

    system: dict[str, Any] = {name: _each(getattr(x.system, name), lambda a: _array(over(a))) for name in TABLES}
    of = {name: _namespace(n, over) for name, n in x.given.of.items()}
    bodies = {name: _namespace(n, over) for name, n in x.given.bodies.items()}
    for n in bodies.values():
        if hasattr(n, "angle"):
            n.angle = _array(n.angle)
    given = replace(x.given, of=of, bodies=bodies, placed={}, world={}, local={})
    q = _each(x.q, lambda a: _array(over(a)))
    return replace(x, system=x.system._replace(**system), q=q, given=given, poses=Poses(x.structure, given))


def _array(a: Any) -> Any:
    return a.x if type(a) is Lanes else a


def _each(a: np.ndarray, function: Callable[[Any], Any]) -> np.ndarray:
    """An array of objects with a function of each in its place; others as they are."""
    if a.dtype != object:
        return a
    out = np.empty(a.size, object)
    for k, x in enumerate(a.ravel().tolist()):
        out[k] = function(x)
    return out.reshape(a.shape)


def _namespace(n: SimpleNamespace, over: Callable[[Any], Any]) -> SimpleNamespace:
    return SimpleNamespace(**{name: _within(x, over) for name, x in vars(n).items()})


def _within(x: Any, over: Callable[[Any], Any]) -> Any:
    if isinstance(x, tuple):
        return tuple(_within(y, over) for y in x)
    return _each(x, over) if isinstance(x, np.ndarray) else over(x)
