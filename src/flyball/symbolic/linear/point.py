"""Where equations are made linear: a state of expressions or numbers, under multipliers that balance it.

A state is one about which the equations are linear if it is an equilibrium or a motion with constant velocities that
looks the same at all times (a governor that spins evenly, seen by its joints' coordinates).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...analysis.compiled import compiled
from ...errors import ModelError
from ...graph.derivative import jacobian, replaced
from ...graph.node import Node
from ...graph.values import evaluate
from ...model.body import Initial
from ...model.expressions import number as number_of
from ...model.words import listing, suggest
from ...tables.forest import steps
from .solve import number
from .traced import Mechanics
from .velocities import completed, velocities

CLOSED = 1e-9  # of the mechanism's length: gaps of a position that is closed
PASSES = 30
QUARTER = 0.5 * np.pi
NEW = 1e-10  # of the mechanism's length: coordinates found by Newton's method


@dataclass
class Point:
    """A state.

    Attributes
    ----------
    q, v : list
        Coordinates and velocities: nodes or numbers.
    z : list of float
        Turns of angles, places on curves.
    t : float [s]
    found : tuple of str
        Coordinates that were found so that the loops close: numbers, whatever the parameters.
    """

    q: list[Any]
    v: list[Any]
    z: list[float]
    t: float = 0.0
    found: tuple[str, ...] = ()

    def numbers(self, m: Mechanics) -> dict[str, float]:
        """Symbol's name -> value."""
        out = {m.x.t.data.name: self.t}
        for symbols, values in ((m.x.q, self.q), (m.x.v, self.v), (m.x.z, self.z)):
            out |= {s.data.name: number(x) for s, x in zip(symbols, values, strict=True)}
        return out | {s.data.name: 0.0 for s in m.vdot}

    def replacing(self, m: Mechanics) -> list[tuple[Node, Any]]:
        """What stands in place of the state's symbols, the multipliers not yet."""
        pairs = [(m.x.t, self.t)]
        for symbols, values in ((m.x.q, self.q), (m.x.v, self.v), (m.x.z, self.z)):
            pairs += zip(symbols, values, strict=True)
        pairs += self._quarters(m)
        return pairs + [(s, 0.0) for s in m.vdot]

    def _quarters(self, m: Mechanics) -> list[tuple[Node, Any]]:
        """Sines and cosines of whole quarters of a turn, which are no rounded numbers."""
        out: list[tuple[Node, Any]] = []
        for s, x in zip(m.x.q, self.q, strict=True):
            if isinstance(x, int | float) or x.known:
                k = round(number(x) / QUARTER)
                if k and abs(number(x) - k * QUARTER) < 1e-14 * abs(k):
                    g = m.graph
                    out += [(g.function("sin", s), (0, 1, 0, -1)[k % 4]), (g.function("cos", s), (1, 0, -1, 0)[k % 4])]
        return out


def drawn(m: Mechanics) -> Point:
    """As drawn, with the rates that are told of tree joints' coordinates and the velocities told of free bodies."""
    x, n = m.values, m.values.structure
    q, v = x.q.tolist(), x.v.tolist()
    z = compiled(m.model, tree=n.tree, coupled=bool(n.tree)).z.real.tolist()
    if n.tree:
        v = velocities(m, [*zip(m.x.q, q, strict=True), *zip(m.x.z, z, strict=True)])
    at = coordinates(m)
    for e in m.model.initial:
        for name, value in _told(m, e):
            if value is not None and name not in at:
                raise ModelError(
                    f"the initial condition of {e.name!r} is of no coordinate that these equations are in; say where "
                    f"the mechanism is: at={{...}}, or at=m.equilibrium()"
                )
            if value is not None:
                _put(q, v, at[name], value)
    for k, d, law, rate in m.laws:
        q[k], v[d] = replaced([law, rate], [(m.x.t, 0.0)])
    return Point(q, v, z)


def _told(m: Mechanics, e: Initial) -> list[tuple[str, Any]]:
    """What an initial condition says of a coordinate and of its rate, by their names; None where it says nothing."""
    unit = m.model.unit(e.name, e)
    every = ((e.name, e.value, unit, "value"), (f"{e.name} rate", e.rate, f"{unit}/s", "rate"))
    env = m.values.env
    return [(name, x if x is None else number_of(x, env, of, f"{what} of {e.title}")) for name, x, of, what in every]


@dataclass(frozen=True)
class Place:
    """Where a named coordinate or rate stands: value = x + offset."""

    k: int
    rate: bool
    offset: Any = 0.0


def coordinates(m: Mechanics) -> dict[str, Place]:
    """What may be given of a state: coordinates and, as ``"A.angle rate"``, their rates."""
    s, S = m.values.structure, m.x.system
    out: dict[str, Place] = {}
    for t, row, step in steps(s):
        if step.coordinate in t.joint.coordinates:
            name = f"{t.joint.name}.{step.coordinate}"
            out[name] = Place(int(S.tree.q[row]), False, S.bodies.offset[row])
            out[f"{name} rate"] = Place(int(S.tree.v[row]), True)
    for d, own in enumerate(m.names):
        if own.name not in out:
            k = _plain_coordinate(m, d)
            if k >= 0:
                out[own.name] = Place(k, False)
            out[f"{own.name} rate"] = Place(d, True)
    return out


def _plain_coordinate(m: Mechanics, d: int) -> int:
    """The coordinate whose rate a velocity is; -1 for turns in space."""
    column = [k for k in range(len(m.x.q)) if m.x.T[k, d] != 0.0]
    return column[0] if len(column) == 1 and m.x.T[column[0], d] == 1.0 else -1


def _put(q: list[Any], v: list[Any], p: Place, value: Any) -> None:
    if p.rate:
        v[p.k] = value
    else:
        q[p.k] = value - p.offset


def given(m: Mechanics, at: Mapping[str, Any]) -> Point:
    """As drawn, but with coordinates and rates that are given: numbers, texts with a unit, expressions of parameters.

    Raises
    ------
    ModelError
        If there is no such coordinate.
    """
    point = drawn(m)
    known = coordinates(m)
    for name, text in at.items():
        if name not in known:
            raise ModelError(
                f"{m.model.name!r} has no coordinate {name!r} that can be given{suggest(name, list(known))}; "
                f"{listing(list(known))}"
            )
        p = known[name]
        unit = next((n.unit for n in m.names if name in (n.name, f"{n.name} rate")), None)
        _put(point.q, point.v, p, number_of(text, m.env, f"{unit}/s" if p.rate and unit else unit, f"at[{name!r}]"))
    return closed(m, point, tuple(p.k for k, p in known.items() if k in at and not p.rate), at)


def closed(m: Mechanics, point: Point, fixed: Sequence[int], at: Mapping[str, Any]) -> Point:
    """With loops closed, by Newton's method in the coordinates that were not given; rates likewise.

    Raises
    ------
    ModelError
        If that is not possible.
    """
    which = np.flatnonzero(m.holonomic)
    length = m.values.length
    free = np.array([d for d in range(len(m.x.v)) if not _moves(m, d, fixed)], int)
    numbers = point.numbers(m)
    gaps = lambda: np.array(evaluate(list(m.g[which]), numbers), float)  # noqa: E731
    if not len(which) or np.abs(gaps()).max() <= CLOSED * length:
        return _with_rates(m, point)
    G, T = _functions(m, which)
    for _ in range(PASSES):
        g = gaps()
        if np.abs(g).max() <= 1e-14 * length:
            break
        step = np.zeros(len(m.x.v))
        scaled = np.array(evaluate(G, numbers), float).reshape(len(which), -1) * m.scale
        step[free] = (m.scale[free]) * np.linalg.lstsq(scaled[:, free], -g, rcond=1e-10)[0]
        dq = np.array(evaluate(T, numbers), float).reshape(len(m.x.q), -1) @ step
        for s, d in zip(m.x.q, dq, strict=True):
            numbers[s.data.name] += float(d)
    if np.abs(gaps()).max() > CLOSED * length:
        raise ModelError(
            f"{m.model.name!r} cannot be closed with {', '.join(map(repr, at)) or 'the coordinates as drawn'}: gaps of "
            f"{np.abs(gaps()).max():.3g} are left; give coordinates that can be, or at=m.equilibrium()"
        )
    moved = [k for k, (s, x) in enumerate(zip(m.x.q, point.q, strict=True))
             if abs(numbers[s.data.name] - number(x)) > NEW * length]  # fmt: skip
    q = [numbers[m.x.q[k].data.name] if k in moved else x for k, x in enumerate(point.q)]
    names = tuple(k for k, p in coordinates(m).items() if not p.rate and p.k in moved)
    return _with_rates(m, Point(q, point.v, point.z, point.t, names))


def _functions(m: Mechanics, which: np.ndarray) -> tuple[list[Any], list[Any]]:
    """G of the constraints on positions and T, to be evaluated."""
    return list(jacobian(list(m.n[which]), m.x.v).ravel()), list(m.x.T.ravel())


def _moves(m: Mechanics, d: int, fixed: Sequence[int]) -> bool:
    return any(m.x.T[k, d] != 0.0 for k in fixed)


def _with_rates(m: Mechanics, point: Point) -> Point:
    """With rates that the constraints ask for.

    Raises
    ------
    ModelError
        If they allow none.
    """
    if not len(m.n):
        return point
    where = [pair for pair in point.replacing(m) if pair[0] not in m.x.v]
    v = completed(m, where, point.v)
    point = Point(point.q, v, point.z, point.t, point.found)
    missed = np.abs(np.array(evaluate(list(m.n), point.numbers(m)), float)).max()
    if missed > CLOSED * (max(abs(number(x)) for x in v) + 1.0) * max(m.values.length, 1.0):
        raise ModelError(
            f"the velocities of {m.model.name!r} there do not fulfil its constraints (they miss by {missed:.3g}): give "
            f"the rates of all coordinates that move, for instance at={{'A.angle rate': 'omega'}}, or "
            f"at=m.equilibrium(turning=[...])"
        )
    return point
