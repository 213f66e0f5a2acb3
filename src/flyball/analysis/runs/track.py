"""Memory of one run, and the engine bound to it: runs go through it one after the other in one compiled call."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from ...compiler.buffers import StructBuffer, StructPool
from ...compiler.kernels import BoundKernel
from ...compiler.layout import Number1, Number2
from ...equations.engine import engine
from ...equations.many import one_after_another
from ...equations.tasks import COMPLETE, Sheet
from ...numerics.integrators.clock import Clock
from ...numerics.integrators.tableaux import Tableau
from ...tables.system import LATER, Work
from ..compiled import Compiled
from ..motion.later import standing
from .spread import TABLES, Place


class Numbers(NamedTuple):
    """Tables of numbers in `System`: see there."""

    force_x: Number2
    const: Number1
    body_x: Number2
    glob: Number1
    frame_x: Number2
    term_x: Number2
    switch_x: Number2


class Memory(NamedTuple):
    """All that a run reads as its own or writes to."""

    tables: Numbers
    work: Work
    clock: Clock
    sheet: Sheet


@dataclass(frozen=True)
class Part:
    """Numbers that differ from run to run: in which array (`Track.arrays`), where in it (j,), and these, (n, j)."""

    name: str
    at: np.ndarray
    x: np.ndarray


@dataclass(frozen=True)
class Batch:
    """Runs that are called together.

    Attributes
    ----------
    runs : (n,) ndarray of int
        Their numbers.
    base : mapping
        Array (`Track.arrays`) -> with what it begins in all of them, but for the parts.
    parts : sequence of Part
    length : (n,) ndarray
        Of the mechanism [m].
    places : list
        In which group each is.
    """

    runs: np.ndarray
    base: Mapping[str, np.ndarray]
    parts: Sequence[Part]
    length: np.ndarray
    places: list[Place]

    def some(self, k: Sequence[int]) -> Batch:
        """Some of them."""
        parts = [replace(p, x=p.x[k]) for p in self.parts]
        return Batch(self.runs[k], self.base, parts, self.length[k], [self.places[i] for i in k])


class Track:
    """Memory of a mechanism's runs, and the engine bound to it.

    Attributes
    ----------
    compiled : Compiled
        With tables and scratch in the memory.
    clock : Clock
    rows : ndarray
        Rows of output.
    arrays : dict
        By name what a run may have of its own: tables, ``"FK"`` (frames on ground), ``"y"``, ``"real"``, ``"option"``.
    """

    def __init__(self, c: Compiled, clock: Clock, rows: np.ndarray, method: Tableau, task: int) -> None:
        fields = Memory(Numbers(*(getattr(c.values.system, n) for n in TABLES)), c.work, clock, Sheet(rows))
        mould = StructPool(fields, (clock.times, clock.accounts))
        block = mould.block.copy()
        own = mould.fill(block)
        self._cells = block.view(np.int64)
        self._new = self._cells.copy()
        self._begin = _address(block)
        self.compiled, self.clock, self.rows, self.task = c, own.clock, own.sheet.rows, task
        c.values = replace(c.values, system=c.values.system._replace(**own.tables._asdict()))
        made, S = [0, 0, 0], c.values.system
        if c.made is not None:
            S = c.made.system(S)
            made, self._addresses = c.made.reckoning(S)
        c.system = S
        vars(c)["work"] = own.work
        self._made = np.array(made, np.int64)
        self._given = [StructBuffer(x) for x in (S, own.work, method, own.clock, own.sheet)]
        self._bound = BoundKernel(engine, *self._given)
        self._then = np.zeros(8, np.int64)
        self.arrays: dict[str, np.ndarray] = own.tables._asdict()
        self.arrays |= {"FK": own.work.FK, "y": own.clock.y, "real": own.clock.real, "option": own.work.option}

    def cells(self, array: np.ndarray) -> np.ndarray:
        """Where the numbers of an array of this memory, or of a part of one, stand in it."""
        at = np.zeros((), np.int64)
        for stride, n in zip(array.strides, array.shape, strict=True):
            at = at[..., None] + stride // 8 * np.arange(n)
        return np.ravel((_address(array) - self._begin) // 8 + at)

    def begin(self, batch: Batch) -> tuple[np.ndarray, np.ndarray]:
        """Have the memory begin as all runs of a batch do; where these differ (j,), and by what, (n, j)."""
        for name, x in batch.base.items():
            self._new[self.cells(self.arrays[name])[: x.size]] = np.ascontiguousarray(x).view(np.int64).ravel()
        at = [self.cells(self.arrays[p.name])[p.at] for p in batch.parts]
        own = [np.ascontiguousarray(p.x).view(np.int64) for p in batch.parts]
        none = np.zeros((len(batch.runs), 0), np.int64)
        return np.concatenate([np.zeros(0, np.int64), *at]), np.concatenate([none, *own], axis=1)

    def run(
        self, own: tuple[np.ndarray, np.ndarray], ends: np.ndarray, told: np.ndarray, out: np.ndarray
    ) -> int:  # fmt: skip
        """Runs one after the other; see `one_after_another`."""
        return int(one_after_another(self._bound.words, self.task, self._then, self._made, self._cells, self._new,
                                     own[0], own[1], ends, told, out))  # fmt: skip

    def completes(self) -> None:
        """From now on accelerations and multipliers are solved for when a run has ended (`later.solved`)."""
        S, W, method, _, sheet = self._given
        self._complete = BoundKernel(engine, S, W, method, StructBuffer(standing(self.clock.y.shape[1])), sheet)
        cell = self.cells(self.arrays["option"])[LATER]
        self._then = np.array([*self._complete.words, cell, COMPLETE], np.int64)

    def complete(self) -> bool:
        """Do so for the run in memory; whether there are such."""
        if not self._then[0]:
            return True
        self.arrays["option"][LATER] = 0.0
        return self._complete(COMPLETE) == 0

    def read(self, cells: np.ndarray) -> np.ndarray:
        """What stands in some cells."""
        return self._cells[cells]

    def go_on(self) -> int:
        """The run in memory goes on."""
        return self._bound(self.task)


def _address(array: np.ndarray) -> int:
    return int(array.__array_interface__["data"][0])
