"""What one thread computes runs with: those that share all but numbers go through one memory, many in a call."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from copy import copy
from dataclasses import dataclass, field, replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from ...equations.engine import INTEGRATE
from ...laws.breaks import NO_BREAKS
from ...laws.functions import forget
from ...numerics.integrators import clock as ex
from ...numerics.integrators.tableaux import tableau
from ...tables.system import LATER, WORST_G
from ...tables.values import Values
from ..compiled import Compiled
from ..motion.engines import LONGEST
from ..motion.implicit.suited import unsuited
from ..motion.known import sampled_laws
from ..motion.later import open_until_asked
from ..motion.reasons import remarks
from ..motion.rounding import remarkable
from ..motion.stiff import EXPLICIT, Pace
from ..simulate import clock_for
from ..simulate import width as wide
from .codes import Code
from .spread import Place, system_of
from .track import Batch, Track

if TYPE_CHECKING:
    from .lean import Shared

SLICE = 0.05  # seconds that a call of compiled code should take


@dataclass(frozen=True)
class Done:
    """Runs that were computed, those of a call.

    Attributes
    ----------
    loop : Loop
        With the last of them in memory, if nothing is to be said of others.
    runs : (n,) ndarray of int
        Their numbers.
    places : list
        In which group each is.
    rows : (n, times, ...) ndarray
        Their output, with accelerations and multipliers where these are asked for.
    steps, worst : (n,) ndarray
        How many steps each took, and how open constraints got.
    excess, atol, far : (n,) ndarray
        What `remarkable` goes by.
    remarks : dict
        What is to be said, by number among these.
    """

    loop: Loop
    runs: np.ndarray
    places: list[Place]
    rows: np.ndarray
    steps: np.ndarray
    worst: np.ndarray
    excess: np.ndarray
    atol: np.ndarray
    far: np.ndarray
    remarks: dict[int, tuple[str, ...]] = field(default_factory=dict)


class Desk:
    """What one thread computes runs with; ``call`` has some of a batch computed."""

    def __init__(self, of: Shared) -> None:
        self.of = of
        x = replace(of.values, system=system_of(of.values))
        self._filler = of.filling.desk(Compiled(x, of.begun.assembly.compiled.z.copy()))
        self._loops: dict[bool, Loop] = {}  # by the tables, and by made code
        self._most = 1  # runs in a call
        self.call = Track.run

    def compute(self, points: np.ndarray, stopped: Callable[[], bool]) -> Iterator[Done]:
        """The runs at some points, as they are done; those that are left out are for themselves."""
        for batch in self._filler.batches(points):
            for code, some in self._by_code(batch):
                if (made := code is not None) not in self._loops:
                    x = replace(self.of.values, system=system_of(self.of.values))
                    self._loops[made] = Loop(self.of, x, code)
                yield from self._calls(self._loops[made], some, stopped)

    def _by_code(self, batch: Batch) -> Iterator[tuple[Code | None, Batch]]:
        """The runs that made code serves, and those that go through the tables."""
        code = self.of.code
        if code is None:
            yield None, batch
            return
        serves = code.serves(batch)
        for which, some in ((code, np.flatnonzero(serves)), (None, np.flatnonzero(~serves))):
            if len(some):
                yield which, batch.some(some.tolist())

    def _calls(self, loop: Loop, batch: Batch, stopped: Callable[[], bool]) -> Iterator[Done]:
        own, n, at = loop.track.begin(batch), len(batch.runs), 0
        while at < n and not stopped():
            some = slice(at, min(n, at + self._most))
            x = own[0], own[1][some]
            out = np.zeros((len(x[1]), 1 + len(loop.told)), np.int64)
            begin = time.perf_counter()
            good = at_once = self.call(loop.track, x, loop.ends, loop.told, out)
            took = time.perf_counter() - begin
            self._most = max(1, min(2 * self._most, int(SLICE * max(good, 1) / max(took, 1e-6))))
            if good < len(out):  # that one ended in another way, or is still running
                good += loop.goes_on(float(batch.length[at + good]), out[good])
            if good:
                some = slice(at, at + good)
                found = loop.found(batch.runs[some], batch.places[some], out[:good])
                yield replace(found, remarks=self._remarks(loop, x, found, batch.length[some]))
            at += min(at_once + 1, len(out))

    def _remarks(
        self, loop: Loop, own: tuple[np.ndarray, np.ndarray], done: Done, length: np.ndarray
    ) -> dict[int, tuple[str, ...]]:
        """What is to be said of some of the runs; they are computed again for that."""
        out: dict[int, tuple[str, ...]] = {}
        relative = self.of.options.rtol * length
        for k in np.flatnonzero(remarkable(done.excess, done.far, done.atol, relative)).tolist():
            told = np.zeros((1, 1 + len(loop.told)), np.int64)
            if not self.call(loop.track, (own[0], own[1][k : k + 1]), loop.ends, loop.told, told):
                loop.goes_on(float(length[k]), told[0])
            out[k] = loop.remarks(float(length[k]))
        return out


class Loop:
    """A track on which motions are integrated, by the tables or by some made code."""

    def __init__(self, of: Shared, x: Values, code: Code | None) -> None:
        self.of, times, o = of, of.question.times, of.options
        a = of.begun.assembly.again()
        c = Compiled(x, a.compiled.z, a.compiled.parameters)
        if code is not None:
            c.run_on(code.made)
        self.start = start = replace(of.begun, assembly=replace(a, compiled=c))
        clock = clock_for(start, start.base.t, float(o.t_end), times, o, sampled_laws(c, NO_BREAKS))
        c.work.option[LATER] = float(later := open_until_asked(start, o, INTEGRATE))
        forget(c.work.stack)
        self._pace = Pace(float(o.t_end), of.asked, partial(unsuited, of.begun))
        clock.count[ex.QUOTA] = self._pace.limited(clock, LONGEST)
        nt, width = len(times), wide(start.assembly)
        self.track = track = Track(c, clock, np.zeros((max(2, nt), width)), tableau(o.method), INTEGRATE)
        if later and of.whole:
            track.completes()
        self.ends = np.array([nt, track.cells(track.clock.count)[ex.STATUS], ex.DONE])
        real, count, W = track.clock.real, track.clock.count, c.work
        some = (real, ex.EXCESS), (real, ex.ATOL), (W.option, WORST_G), (count, ex.ACCEPTED)
        few = [track.cells(array)[[k]] for array, k in some]
        self.shape = nt, of.width
        self.told = np.concatenate([track.cells(track.rows[:nt, : of.width]), *few, track.cells(W.FK[:, :3])])

    def goes_on(self, length: float, told: np.ndarray) -> bool:
        """Bring the run in memory to its end, by so many steps at a time; False if it goes another way."""
        clock, c, rows = self.track.clock, self.track.compiled, self.track.rows
        c.values.length = length
        pace, found = copy(self._pace), [rows[: told[0]].copy()]
        while clock.count[ex.STATUS] == ex.RUNNING:
            if pace.turns(c, clock, EXPLICIT):
                return False  # it is stiff: by itself it goes on by another method
            clock.count[ex.QUOTA] = pace.limited(clock, LONGEST)
            found.append(rows[: self.track.go_on()].copy())
        every = np.concatenate(found)
        if clock.count[ex.STATUS] != ex.DONE or len(every) != len(clock.times):
            return False
        rows[: len(every)] = every
        if not self.track.complete():
            return False  # by itself it is completed by the tables
        told[1:] = self.track.read(self.told)
        return True

    def remarks(self, length: float) -> tuple[str, ...]:
        """What is to be said of the run in memory."""
        self.track.compiled.values.length = length
        return remarks(self.start.assembly, self.track.clock)

    def found(self, runs: np.ndarray, places: list[Place], told: np.ndarray) -> Done:
        """What was copied out of some runs."""
        nt, ny = self.shape
        x = told.view(np.float64)
        rows, few, FK = np.split(x[:, 1:], [nt * ny, nt * ny + 3], axis=1)
        steps, far = told[:, nt * ny + 4], np.abs(FK[:, 1:]).max(axis=1, initial=0.0)
        excess, atol, worst = few.T
        return Done(self, runs, places, rows.reshape(len(x), nt, ny), steps, worst, excess, atol, far)
