"""Tables of many runs at once: the model's expressions are evaluated once for a block of points (`math/lanes.py`).

A block falls into groups that decide alike. What decides like few others, or fails, is left to be computed by itself.
"""

from __future__ import annotations

import threading
from collections import OrderedDict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from ...equations.scratch import on_ground
from ...errors import FlyballError
from ...math.lanes import Diverged, Lanes, lanes_of
from ...tables.numbers import numbers
from ...tables.specs import Structure
from ...tables.system import System
from ...tables.values import Values, values, values_of
from ..compiled import places

BLOCK = 512  # points in a block
HELD = 3  # blocks that are kept
LEAST = 4  # points from which on it is worth while
SPLIT = 24  # groups that are tried in a block
TABLES = ("force_x", "const", "body_x", "glob", "frame_x", "term_x", "switch_x")
"""Tables of numbers in `System`."""


@dataclass(frozen=True)
class Column:
    """An array of one run, and which of its entries (k,) differ from run to run, (n, k)."""

    base: np.ndarray
    at: np.ndarray
    x: np.ndarray

    @classmethod
    def of(cls, array: np.ndarray, n: int) -> Column:
        """Of an array of numbers, some of which may be for many runs."""
        if array.dtype != object:
            return cls(array, np.zeros(0, np.int64), np.zeros((n, 0)))
        flat = array.ravel().tolist()
        at = [k for k, a in enumerate(flat) if type(a) is Lanes]
        base = np.array([float(a.x[0]) if type(a) is Lanes else float(a) for a in flat]).reshape(array.shape)
        return cls(base, np.array(at, np.int64), np.array([flat[k].x for k in at]).reshape(len(at), n).T.copy())

    def write(self, k: int, out: np.ndarray) -> None:
        """The array of run k."""
        out[...] = self.base
        out.ravel()[self.at] = self.x[k]

    def of_run(self, k: int) -> np.ndarray:
        """The same, made."""
        out = self.base.copy()
        self.write(k, out)
        return out


@dataclass(frozen=True)
class Tables:
    """What `values` says of each run of a group, in one structure."""

    system: Mapping[str, Column]
    ground: Column  # records of the frames on ground
    q: Column
    v: Column
    z: Column
    length: np.ndarray
    values: Values  # with lanes

    @classmethod
    def of(cls, x: Values, n: int) -> Tables:
        """From values with lanes."""
        length = x.length.x if isinstance(x.length, Lanes) else np.full(n, x.length)
        system = {name: Column.of(getattr(x.system, name), n) for name in TABLES}
        state = Column.of(x.q, n), Column.of(x.v, n), Column.of(places(x), n)
        return cls(system, Column.of(on_ground(x.system), n), *state, length, x)

    def is_of(self, x: Values, k: int) -> bool:
        """Whether run k has the tables of ``x`` to the bit."""
        pairs = [(self.system[name].of_run(k), getattr(x.system, name)) for name in TABLES]
        pairs += [(self.q.of_run(k), x.q), (self.v.of_run(k), x.v), (self.z.of_run(k), places(x))]
        return all(a.tobytes() == b.tobytes() for a, b in pairs) and float(self.length[k]) == x.length


@dataclass
class Group:
    """Runs that decide alike: their tables in each structure."""

    tables: tuple[Tables, ...]

    @property
    def finite(self) -> np.ndarray:
        """Which runs have nothing but finite numbers where runs differ, (n,)."""
        columns = [c for t in self.tables for c in (*t.system.values(), t.q, t.v, t.z)]
        return np.all([np.isfinite(c.x).all(axis=1) for c in columns], axis=0)


Place = tuple[Group | None, int]
"""The group that a run is in, if there are groups, and its number there."""


@dataclass
class Together:
    """Points of a group: their numbers among those asked for, and in the group."""

    group: Group
    runs: list[int]
    lanes: list[int]


@dataclass
class Block:
    """Groups of a block; which one a run is in and its number there, by its point."""

    at: dict[bytes, tuple[Group, int]] = field(default_factory=dict)
    points: set[bytes] = field(default_factory=set)


class Spread:
    """Tables of the runs of a study, block after block as these are asked for; threads share it.

    ``points`` (n, d) are known to be asked for, in this order.
    """

    def __init__(
        self, structures: Sequence[Structure], parameters: Mapping[str, float], names: Sequence[str], points: np.ndarray
    ) -> None:
        self.structures, self.parameters, self.names, self.points = structures, parameters, names, points
        self.given = 0  # points that were in a block
        self.useless = False  # some code takes nothing but floats
        self._blocks: OrderedDict[int, Block] = OrderedDict()
        self._turn = threading.Lock()

    def of(self, point: np.ndarray) -> tuple[Group, int] | None:
        """The group of a point and its number there; None if it is for itself."""
        key = point.tobytes()
        if self.useless:
            return None
        with self._turn:
            while (block := self._holding(key)) is None:
                if self.useless or self.given >= len(self.points):
                    return None
                self._next(self.points[self.given : self.given + BLOCK])
                self.given += BLOCK
            return block.at.get(key)

    def groups(self, points: np.ndarray) -> tuple[list[Together], list[int]]:
        """Which of the points are in which group, and those that are for themselves."""
        found: dict[int, Together] = {}
        alone = []
        for k, point in enumerate(points):
            if (place := self.of(point)) is None:
                alone.append(k)
                continue
            its = found.setdefault(id(place[0]), Together(place[0], [], []))
            its.runs.append(k)
            its.lanes.append(place[1])
        return list(found.values()), alone

    def also(self, points: np.ndarray) -> None:
        """Points that are asked for next, if they are not known yet."""
        with self._turn:
            if self.given >= len(self.points) and len(points) >= LEAST and self._holding(points[0].tobytes()) is None:
                self._next(points)

    def _holding(self, key: bytes) -> Block | None:
        return next((b for b in self._blocks.values() if key in b.points), None)

    def _next(self, points: np.ndarray) -> None:
        self._blocks[next(reversed(self._blocks), 0) + 1] = block = Block(points={p.tobytes() for p in points})
        while len(self._blocks) > HELD:
            self._blocks.popitem(last=False)
        todo, tried = [np.arange(len(points))], 0
        while todo and not self.useless:
            some = todo.pop()
            if len(some) < LEAST or tried >= SPLIT:
                continue
            tried += 1
            try:
                group = self._group(points[some])
            except Diverged as told:
                if told.yes.shape != some.shape:
                    self.useless = True
                    return
                todo += [some[told.yes], some[~told.yes]]
            except (FlyballError, ZeroDivisionError):  # all of them: each says why by itself
                continue
            except Exception:  # something knows floats only
                self.useless = True
            else:
                good = group.finite.tolist()
                block.at.update({points[k].tobytes(): (group, i) for i, k in enumerate(some.tolist()) if good[i]})

    def _group(self, points: np.ndarray) -> Group:
        """Tables of runs that decide alike; the first is looked at, whether it is what it is by itself."""
        given = {**self.parameters, **lanes_of(points, self.names)}
        with np.errstate(all="ignore"):
            found = numbers(self.structures[0].model, given)
            group = Group(tuple(Tables.of(values_of(s, found), len(points)) for s in self.structures))
        one = {**self.parameters, **dict(zip(self.names, points[0].tolist(), strict=True))}
        if not all(t.is_of(values(s, one), 0) for s, t in zip(self.structures, group.tables, strict=True)):
            raise TypeError("some operation is another one for floats")
        return group


def system_of(x: Values) -> System:
    """The tables of values with arrays of their own in place of those that change."""
    return x.system._replace(**{name: getattr(x.system, name).copy() for name in TABLES})
