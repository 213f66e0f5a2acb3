"""Runs of a study read as if they were one motion: where they differ, arrays over time stand in the tables."""

from __future__ import annotations

from collections.abc import Callable, Mapping
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
from ...tables.values import Values
from .spread import TABLES

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
