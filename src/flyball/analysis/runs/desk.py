"""Tables, scratch and clock of one thread: runs that share all but numbers are called one after the other."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from ...equations.engine import INTEGRATE, motion_kernel
from ...laws.breaks import NO_BREAKS
from ...laws.functions import forget
from ...numerics.integrators import clock as ex
from ...numerics.integrators.tableaux import tableau
from ...tables.system import LATER
from ...tables.values import Values
from ..compiled import Compiled
from ..motion.engines import LONGEST
from ..motion.implicit.suited import unsuited
from ..motion.known import sampled_laws
from ..motion.later import open_until_asked
from ..motion.stiff import EXPLICIT, Pace
from ..simulate import clock_for
from .codes import Code
from .spread import TABLES, system_of

if TYPE_CHECKING:
    from .lean import Shared


class Desk:
    """What one thread computes runs with.

    Attributes
    ----------
    filler
        What fills in the numbers of a run.
    loop : Loop
        Where the last run is.
    """

    loop: Loop

    def __init__(self, of: Shared) -> None:
        self.of = of
        x = replace(of.values, system=system_of(of.values))
        self.call = motion_kernel
        self.own = {name: getattr(x.system, name) for name in TABLES}
        self.filler = of.filling.desk(Compiled(x, of.begun.assembly.compiled.z.copy()))
        self._values = x
        self._loops: dict[int, Loop] = {}

    def run(self, point: np.ndarray) -> bool:
        """Compute the motion at a point; False if it is not for us."""
        of, code = self.of, None
        if not self.filler.fill(point, self.own):
            return False
        if of.codes is not None and (code := of.codes.of(self._values, self.filler.pattern)) is None:
            return False
        if id(code) not in self._loops:
            self._loops[id(code)] = Loop(of, self._values, code)
        self.loop = self._loops[id(code)]
        self.loop.afresh()
        self.filler.begin(self.loop.start.assembly, self.loop.clock)
        return self.loop.run(self.call)


class Loop:
    """Scratch and clock for the tables, or for some made code."""

    def __init__(self, of: Shared, x: Values, code: Code | None) -> None:
        self.of, self.code = of, code
        a = of.begun.assembly.again()
        c = Compiled(x, a.compiled.z, a.compiled.parameters)
        if code is not None:
            c.run_on(code.made)
        self.start = replace(of.begun, assembly=replace(a, compiled=c))
        self.method = tableau(of.options.method)
        times, o = of.question.times, of.options
        sampled = sampled_laws(c, NO_BREAKS)
        self.clock = clock_for(self.start, self.start.base.t, float(o.t_end), times, o, sampled)
        self.clock.count[ex.QUOTA] = LONGEST
        self.later = open_until_asked(self.start, o, INTEGRATE)
        c.work.option[LATER] = float(self.later)
        forget(c.work.stack)
        width = 1 + len(of.begun.y) + c.structure.nv + len(x.system.row_i) + len(c.structure.prescribed)
        self.rows = np.zeros((max(2, len(times)), width))
        self.kept = [(a, a.copy()) for a in (*c.work, self.clock.real, self.clock.count, self.clock.y, self.clock.K,
                                             self.clock.seen, self.rows)]  # fmt: skip

    def afresh(self) -> None:
        """Scratch and clock as new, addresses for the numbers of this run."""
        for array, new in self.kept:
            array[...] = new
        if self.code is not None:
            c = self.start.assembly.compiled
            c.system = self.code.made.system(c.values.system)

    def run(self, call) -> bool:  # type: ignore[no-untyped-def]
        """Compute the motion into ``rows``; False if it goes another way."""
        of, clock, used, c = self.of, self.clock, 0, self.start.assembly.compiled
        pace = Pace(float(of.options.t_end), of.asked, partial(unsuited, of.begun))
        while clock.count[ex.STATUS] == ex.RUNNING:
            clock.count[ex.QUOTA] = pace.limited(clock, LONGEST)
            used += call(c.system, c.work, self.method, clock, self.rows[used:], INTEGRATE)
            if clock.count[ex.STATUS] == ex.RUNNING and pace.turns(c, clock, EXPLICIT):
                return False  # it is stiff: by itself it goes on by another method
        return bool(clock.count[ex.STATUS] == ex.DONE and used == len(clock.times))
