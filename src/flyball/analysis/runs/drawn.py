"""Parameters that change lengths, masses or gravity of a mechanism that starts at rest in the position that is drawn.

Its start is then what is drawn. That a run does start so, closed and at rest, is looked at in its own tables.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from ...equations.tasks import POSITION
from ...numerics.integrators.clock import ATOL, LEDGER, SCALE, STATUS
from ...numerics.integrators.tableaux import tableau
from ...tables.system import G_VALUE, MASS, NU, SEMIDEFINITE, TOL_G, TOL_V
from ..assembly.positions import CLOSED
from ..compiled import Compiled
from ..motion.later import standing
from ..motion.options import Integration
from ..motion.start import Start
from ..simulate import lifted, sizes
from .spread import TABLES, Column, Place, Spread, Tables, Together
from .track import Batch, Part, Track


def rests_as_drawn(begun: Start) -> bool:
    """Whether a motion starts with every velocity zero, in the position that is drawn."""
    base, x = begun.base, begun.base.compiled.values
    model = x.structure.model
    still = not (base.v.any() or x.v.any() or begun.assembly.v.any())
    plain = not model.drivers and not model.initial and all(r.holonomic for r in x.structure.rows)
    plain = plain and all(j.at is not None for j in model.joints)  # else assembly closes it by its frames
    return still and plain and not begun.wound and base.q.tobytes() == x.q.tobytes()


@dataclass(frozen=True)
class Drawn:
    """What fills all tables of numbers in, and the start."""

    tables: ClassVar[tuple[str, ...]] = TABLES  # that it writes

    begun: Start
    asked: Integration  # tolerances as they were asked for, whatever its length
    span: float  # how long the motion lasts [s]
    spread: Spread

    def also(self, points: np.ndarray) -> None:
        """Points that are asked for next."""
        self.spread.also(points)

    def desk(self, c: Compiled) -> Desk:
        """What one thread fills in, for a mechanism in the coordinates of the motion with tables of its own."""
        return Desk(self, c)


class Desk:
    """Tables of some runs, and memory in which it is looked whether they start as they are drawn."""

    def __init__(self, of: Drawn, c: Compiled) -> None:
        self.of = of
        plain = of.begun.base.compiled
        self.plain = Still(plain.again(), of.begun.base.t)
        self.same = of.begun.assembly.compiled.values is plain.values
        self.motion = self.plain if self.same else Still(c, of.begun.base.t)

    def batches(self, points: np.ndarray) -> list[Batch]:
        """The runs at some points; those that are left out do not start as they are drawn, or it is not known."""
        return [b for some in self.of.spread.groups(points)[0] if (b := self._together(some)) is not None]

    def _together(self, some: Together) -> Batch | None:
        tables, lanes = some.group.tables, np.array(some.lanes)
        z = [_rows(t.z, lanes) for t in tables]
        good = self.plain.rests(tables[0], lanes, z[0])
        if not self.same:
            good &= self.motion.rests(tables[1], lanes, self._followed(z), z[1], closed=False)
        if not good.any():
            return None
        t, lanes, runs = tables[-1], lanes[good], np.array(some.runs)[good]
        base, parts = shared_and_own(t, lanes)
        q, z = _rows(t.q, lanes), z[-1][good]
        start = np.concatenate([q, np.zeros((len(q), self.motion.nv)), z], axis=1)
        parts.append(Part("y", np.arange(start.shape[1]), start))
        parts += self._sizes(tables, lanes)
        places: list[Place] = [(some.group, k) for k in lanes.tolist()]
        return Batch(runs, base, parts, t.length[lanes], places)

    def _followed(self, z: list[np.ndarray]) -> np.ndarray:
        """Turns and places that the motion takes over from absolute coordinates."""
        out, plain = z[1].copy(), self.plain.compiled.structure.state_at
        for name, k in self.motion.compiled.structure.state_at.items():
            if name in plain and not name.endswith(".work"):
                out[:, k] = z[0][:, plain[name]]
        return out

    def _sizes(self, tables: tuple[Tables, ...], lanes: np.ndarray) -> list[Part]:
        """What their lengths and weights say (`simulate.size`)."""
        plain, own = tables[0], tables[-1].length[lanes].tolist()
        body_x, glob = (_rows(plain.system[name], lanes) for name in ("body_x", "glob"))
        mass = body_x[..., MASS].sum(axis=1).tolist()
        g = np.sqrt((glob[:, :3] ** 2).sum(axis=1)).tolist()
        lengths = plain.length[lanes].tolist()
        asked, rtol, span = self.of.asked, np.float64(self.of.asked.rtol), self.of.span
        found = [
            sizes(x, asked.tolerance(length), rtol, lifted((m, w), length, span))
            for x, m, w, length in zip(own, mass, g, lengths, strict=True)
        ]
        clock, option = (np.array(x) for x in zip(*found, strict=True))
        return [Part("real", np.array([ATOL, SCALE, LEDGER]), clock), Part("option", np.array([TOL_G, TOL_V]), option)]


class Still:
    """Memory in which runs are looked at as they start, in some coordinates."""

    def __init__(self, c: Compiled, t: float) -> None:
        s = c.structure
        self.nv = s.nv
        self._track = track = Track(
            c, standing(s.nq + s.nv + len(s.states), t), np.zeros((0, 0)), tableau("rk45"), POSITION
        )
        self.compiled, self._metric, (self._nr, self._nz) = c, c.metric, (len(s.rows), len(s.states))
        row, y = c.work.row, track.clock.y
        self._told = np.concatenate([track.cells(a) for a in (row[G_VALUE], row[NU], y[0, s.nq + s.nv :])])
        self._ends = np.array([0, track.cells(track.clock.count)[STATUS], 0])

    def rests(
        self, t: Tables, lanes: np.ndarray, z: np.ndarray, drawn: np.ndarray | None = None, closed: bool = True
    ) -> np.ndarray:
        """Which runs are at rest with the turns that they are drawn with, (n,), from turns and places ``z`` (n, nz).

        ``closed``: and closed as drawn, and nothing drives them.
        """
        v = _rows(t.v, lanes)
        good = ~(v != 0.0).any(axis=1) & (_rows(t.system["glob"], lanes)[:, SEMIDEFINITE] == 0.0)
        q = _rows(t.q, lanes)
        state = np.concatenate([q, np.zeros_like(v), z], axis=1)
        base, parts = shared_and_own(t, lanes)
        n = len(lanes)
        batch = Batch(np.arange(n), base, [*parts, Part("y", np.arange(state.shape[1]), state)], t.length, [])
        out = np.zeros((n, 1 + len(self._told)), np.int64)
        good[self._track.run(self._track.begin(batch), self._ends, self._told, out) :] = False
        rows, nu, found = np.split(out.view(np.float64)[:, 1:], [self._nr, 2 * self._nr], axis=1)
        good &= (found == found).all(axis=1)
        good &= (out[:, 1 + 2 * self._nr :] == (z if drawn is None else drawn).view(np.int64)).all(axis=1)
        if closed:
            good &= closed_rows(rows, self._metric, t.length[lanes]) & ~(nu != 0.0).any(axis=1)
        return good


def shared_and_own(t: Tables, lanes: np.ndarray) -> tuple[dict[str, np.ndarray], list[Part]]:
    """What runs have in common of tables and frames on ground, and what each has of its own."""
    columns = {**t.system, "FK": t.ground}
    return {name: x.base for name, x in columns.items()}, [Part(name, x.at, x.x[lanes]) for name, x in columns.items()]


def closed_rows(g: np.ndarray, metric: np.ndarray, length: np.ndarray) -> np.ndarray:
    """Which of several positions are closed (`positions.misfit`), (n,), from their rows (n, nr)."""
    off = np.abs(g) / np.where(metric, length[:, None], 1.0)
    return np.isfinite(g).all(axis=1) & (off.max(axis=1, initial=0.0) <= CLOSED)


def _rows(column: Column, lanes: np.ndarray) -> np.ndarray:
    """Arrays of some runs, (n, ...)."""
    out = np.repeat(column.base[None], len(lanes), axis=0)
    out.reshape(len(lanes), -1)[:, column.at] = column.x[lanes]
    return out
