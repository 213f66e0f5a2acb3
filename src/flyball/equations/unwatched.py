"""A motion that goes on by steps of any method and in which nothing is watched: the loop of the integrators, by a door.

All that it works with is laid out once and copied for each run (`buffers.StructPool`); nothing of it is looked at in
Python.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from ..compiler.buffers import JoinedBuffer, StructBuffer, StructPool
from ..compiler.formulas import formula
from ..compiler.kernels import BoundKernel, kernel
from ..compiler.layout import Float2, Int1
from ..numerics.integrators.clock import Clock, ClockCounts, ClockReals
from ..numerics.integrators.loop import advance, nothing, whole
from ..tables.specs import Structure
from ..tables.system import System, Work
from .asking import report, steps
from .callbacks import Going, Own
from .engine import engine
from .scratch import tables
from .sharing import sharing
from .tasks import Sheet
from .watched import idle_tableau, idle_watch

MOST = 4  # layouts of a structure that are known


class Out(NamedTuple):
    """The method (`BoundKernel.words`), and where rows of output go."""

    asked: Int1
    rows: Float2


@formula
def onward(S, W, own, going, out):
    """Go on with an integration. Returns rows written."""
    A = (own.doors[0], S, W, own.R, own.clock, own.sheet)
    callbacks = (steps, out.asked, report, nothing, whole)
    return advance(callbacks, A, going.watch, own.R, going.clock, out.rows)


@kernel
def unwatched(S: System, W: Work, own: Own, going: Going, out: Out, task: int) -> int:
    """`onward` behind an address."""
    return onward(S, W, own, going, out)


@lru_cache(maxsize=1)
def _alone() -> StructBuffer:
    """Nothing holds together."""
    return StructBuffer(sharing(0, 0))


def _own(ny: int, width: int, seen: np.ndarray) -> Own:
    """What goes to the engine's door besides: of its clock only time, state and what is seen are looked at."""
    none = np.zeros(0, np.int64)
    clock = Clock(
        ClockReals.blank(), ClockCounts.blank(), np.zeros(0), np.zeros((3, ny)), np.zeros((1, ny)), none, seen
    )
    return Own(clock, Sheet(np.zeros((4, width))), idle_tableau().fields, np.zeros(2, np.int64))


class Unwatched:
    """A motion by steps of a method: the compiled loop and what it keeps.

    Parameters
    ----------
    steps : Steps
    clock : Clock
        Of the integration.
    s : Structure
    S : System
    scratch : StructBuffer
        The Work.
    width : int
        Of a row of output, and of what the method has the engine write.
    """

    fired = ()

    def __init__(self, steps: Any, clock: Clock, s: Structure, S: System, scratch: StructBuffer, width: int) -> None:
        self.steps, self.clock, self.s, self.scratch = steps, clock, s, scratch
        ny, width, R = clock.y.shape[1], max(width, s.nv, len(s.rows), 1), idle_tableau()
        if clock.seen.shape[1]:
            own = _own(ny, width, clock.seen)
            self.own, doors = StructBuffer(own, R), own.doors
        else:
            mould = s.kept.get("own desk", (ny, width), MOST, lambda: StructPool(_own(ny, width, clock.seen), R.fields))
            self.own, doors = (made := mould.new()), made.array("doors")
        watch = idle_watch(steps.c.tobytes(), steps.stages)
        self.going = JoinedBuffer(Going, StructBuffer(clock), watch, _alone())
        written = tables(s, S)
        doors[0] = engine.address
        self.bound = steps.bind(written, scratch, self.own, self.going, doors)
        self._loop: tuple[np.ndarray, BoundKernel] | None = None

    def go_on(self, out: np.ndarray) -> int:
        """Go on until the end, or what else `loop.advance` returns for. Returns rows written."""
        if self._loop is None or self._loop[0] is not out:
            rows = StructBuffer(Out(self.bound.words, out))
            self._loop = out, BoundKernel(unwatched, self.bound.buffers[0], self.scratch, self.own, self.going, rows)
        return self._loop[1](0)
