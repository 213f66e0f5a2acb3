"""Parameters that change lengths, masses or gravity of a mechanism that starts at rest in the position that is drawn.

Its start is then what is drawn. That a run does start so, closed and at rest, is looked at in its own tables.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from ...numerics.integrators.clock import Clock
from ...tables.system import NU, SEMIDEFINITE
from ..assembly.positions import CLOSED, misfit
from ..assembly.start import Assembly
from ..compiled import Compiled
from ..motion.options import Integration
from ..motion.start import Start
from ..simulate import size
from .spread import TABLES, Place, Spread, Tables, system_of


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
    spread: Spread

    def also(self, points: np.ndarray) -> None:
        """Points that are asked for next."""
        self.spread.also(points)

    def desk(self, c: Compiled) -> Desk:
        """What one thread fills in, for a mechanism in the coordinates of the motion with tables of its own."""
        return Desk(self, c)


class Desk:
    """Tables and scratch of one thread, in the coordinates of assembly and of the motion."""

    def __init__(self, of: Drawn, c: Compiled) -> None:
        self.of = of
        plain = of.begun.base.compiled.values
        self.same = of.begun.assembly.compiled.values is plain
        self.motion = Compiled(c.values, c.z.copy(), c.parameters)
        own = c.values if self.same else replace(plain, system=system_of(plain))
        self.plain = self.motion if self.same else Compiled(own, c.z.copy(), c.parameters)
        self.base = Assembly(self.plain, of.begun.base.t, np.zeros(plain.structure.nq), of.begun.base.v.copy())
        self.start = of.begun.y.copy()
        self.place: Place = None, 0
        self.pattern = b""

    def fill(self, point: np.ndarray, own: Mapping[str, np.ndarray]) -> bool:
        """Write the tables of a run into ``own``, those of the motion; False if it does not start as drawn."""
        found = self.of.spread.of(point)
        if found is None:
            return False
        self.place = group, k = found
        tables = group.tables
        if not (self._take(self.plain, tables[0], k) and self._rests()):
            return False
        self.base.q[:] = self.plain.values.q
        if not self.same:
            hints = self.plain.hints
            if not self._take(self.motion, tables[1], k):
                return False
            self.motion.follow(hints)
            self.motion.at(self.base.t, self.motion.values.q, np.zeros(self.motion.structure.nv))
            if self.motion.z.tobytes() != tables[1].z.of_run(k).tobytes():
                return False
        x = self.motion.values
        self.pattern = tables[-1].pattern_of(k)
        self.start[:] = np.concatenate([x.q, np.zeros(x.structure.nv), self.motion.z])
        return True

    def _take(self, c: Compiled, tables: Tables, k: int) -> bool:
        """Write one structure's tables; False if something moves, or a body lacks inertia."""
        x = c.values
        for name, column in tables.system.items():
            column.write(k, getattr(x.system, name))
        x.q, x.v, x.length = tables.q.of_run(k), tables.v.of_run(k), float(tables.length[k])
        c.z = tables.z.of_run(k)
        return not (x.v.any() or x.system.glob[SEMIDEFINITE])

    def _rests(self) -> bool:
        """Whether it is closed as it is drawn, and nothing drives it; with the turns that it is drawn with."""
        c, t, z = self.plain, self.base.t, self.plain.z.tobytes()
        near = misfit(c, t, c.values.q, c.values.v, 0.0) <= CLOSED
        return near and not c.work.row[NU].any() and c.z.tobytes() == z

    def begin(self, at: Assembly, clock: Clock) -> None:
        """Write the start of the run that was filled in last, and what its length and weight say."""
        clock.y[0] = self.start
        size(clock, self.base, at.compiled, self.of.asked.tolerance(self.plain.values.length))
