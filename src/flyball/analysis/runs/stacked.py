"""Runs of a study read as if they were one motion: where they differ, arrays over time stand in the tables."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np

from ...math.lanes import Lanes
from ...model.model import Model
from ...results.health import Health
from ...results.records import Records
from ...results.result import Result
from ...tables.poses import Poses
from ...tables.values import Values, values
from .compute import Answers, Question
from .readable import of_states
from .reading import ends_only, reduced
from .spread import TABLES, Group, Place

AT_ONCE = 20_000  # times that are read at once: each takes some kilobytes


class Reader:
    """Reads what depends on positions and velocities alone.

    Attributes
    ----------
    stacked : list of int
        Which of the quantities that are asked for do.
    """

    def __init__(self, question: Question, wound: Mapping[str, float]) -> None:
        self.question, self.wound = question, wound
        self.stacked = [k for k, r in enumerate(question.asked) if of_states(question.model, r.name)]

    def read(
        self, x: Values, rows: np.ndarray, points: np.ndarray, places: Sequence[Place], at: np.ndarray, out: Answers
    ) -> None:
        """Write the quantities of runs, of which rows (runs, times, ...) have the states, as numbers ``at`` of ``out``.

        ``x`` are values of runs that are in no group: where things are is there the same.
        """
        if not len(at) or not self.stacked:
            return
        if ends_only(self.question.asked):
            rows = rows[:, -1:]
        groups: dict[int, list[int]] = {}
        for k, (group, _) in enumerate(places):
            groups.setdefault(id(group), []).append(k)
        most = max(1, AT_ONCE // rows.shape[1])
        for some in (g[k : k + most] for g in groups.values() for k in range(0, len(g), most)):
            group = places[some[0]][0]
            lanes = np.array([places[k][1] for k in some])
            curves = self._curves(x, rows[some]) if group is None else self._at_once(group, lanes, points, rows, some)
            if curves is None:
                found = [self._curves(self._values(x, points[k]), rows[[k]]) for k in some]
                curves = [np.concatenate(parts) for parts in zip(*found, strict=True)]
            self._write(curves, at[some], out)

    def _at_once(
        self, group: Group, lanes: np.ndarray, points: np.ndarray, rows: np.ndarray, some: list[int]
    ) -> list[np.ndarray] | None:
        """Curves of runs of a group; none if these are to be read one by one. The first of a group is compared."""
        if group.reads is False:
            return None
        x = group.tables[-1].values
        try:
            found = self._curves(stacked(x, lanes, rows.shape[1]), rows[some])
        except Exception:  # something knows floats only
            group.reads = False
            return None
        if group.reads is None:
            one = self._curves(self._values(x, points[some[0]]), rows[some[:1]])
            group.reads = all(a[:1].tobytes() == b.tobytes() for a, b in zip(found, one, strict=True))
        return found if group.reads else None

    def _values(self, x: Values, point: np.ndarray) -> Values:
        return values(x.structure, self.question.at(point).parameters)

    def _curves(self, x: Values, rows: np.ndarray) -> list[np.ndarray]:
        """What is asked for of states, (runs, times) each, as of one motion."""
        q = self.question
        result = of_rows(q.model, x, rows, self.wound)
        return [result.curve(q.asked[i].name)[1].reshape(len(rows), -1) for i in self.stacked]

    def _write(self, curves: list[np.ndarray], at: np.ndarray, out: Answers) -> None:
        q = self.question
        for i, curve in zip(self.stacked, curves, strict=True):
            for k, y in zip(at, curve, strict=True):
                t = q.times[-len(y) :]
                out.values[i][k] = reduced(q.asked[i].how, t, np.ascontiguousarray(y), t)


def of_rows(model: Model, x: Values, rows: np.ndarray, wound: Mapping[str, float]) -> Result:
    """States of runs (runs, times, ...), one after the other, as a result without accelerations and reactions."""
    s, flat = x.structure, rows.reshape(-1, rows.shape[2])
    t, p, v, z = (np.ascontiguousarray(a) for a in np.split(flat, np.cumsum([1, s.nq, s.nv]), axis=1))
    none = np.zeros((len(flat), s.nv)), np.zeros((len(flat), len(s.rows) + len(s.prescribed)))
    result = Result(model, x, t[:, 0], p, v, z, *none, unjudged())
    result.wound = dict(wound)
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
