"""The engine's loops run on expressions, task by task: what each reads, and what it writes where.

What stands in the engine's own arrays afterwards is what the made code has to write, at the same places. The tables'
entries are symbols, so that the code holds for other values of parameters; entries that are 0, 1 or -1 stay numbers.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from ..equations.dispatch import progress, remember
from ..equations.friction import loads_end, reaction_loads
from ..equations.motion import finish, loaded
from ..equations.prescribed import prepare
from ..equations.projection import move, place
from ..equations.rows import BY_TIME
from ..equations.within import LAWS, kept, law_at, noted, take_note
from ..graph.node import Node, Undecided
from ..graph.printers.llvm_order import operations
from ..laws.evaluation import evaluate, evaluate_jet
from ..laws.manner import brief
from ..tables.specs import Structure
from ..tables.system import (
    BIAS,
    LAW_INPUT,
    LOAD,
    RATE,
    VALUE,
    System,
    Work,
)
from .solves import Solves


class Stages(Solves):
    """All procedures of one mechanism, as far as expressions go; `Linked` says what they hand on to each other."""

    def __init__(self, s: Structure, S: System, known: Sequence[tuple[str, int]] = ()) -> None:
        super().__init__(s, S, known)
        self.read_by_others = self.entries((self._advanced, self._weighed))
        self.read_at_ends = self.entries((self._remembered, self._noted), far=True)
        self.finishes = self._progresses()
        self.prepared()
        self.placed()
        self.moved()
        self.graph.strict = True  # where a force has no value, neither has what it is added to
        self.loaded()
        self.graph.strict = False
        self.finished()
        self.solved()
        self.drifted()
        self.graph.strict = True
        self.sampled()

    def prepared(self) -> None:
        """Unit quaternions, prescribed coordinates."""
        q, v = self.q.copy(), self.v.copy()
        prepare(self.S, self.W, self.t, q, v)
        stores = [(("a", k), x) for k, x in enumerate(q) if x is not self.q[k]]
        stores += [(("b", k), x) for k, x in enumerate(v) if x is not self.v[k]]
        stores += [(self.at("velocities.prescribed", d), self.W.velocities.prescribed[d]) for d in self.driven]
        self.add("PREPARE", {**self.given("a", self.q), **self.given("b", self.v), **self.time}, stores)

    def placed(self) -> None:
        """Poses and rows."""
        nm, nr = self.nm, self.nr
        reads = self.fresh("sensed", VALUE, range(nm, 2 * nm))  # rates, as last measured
        place(self.S, self.W, self.t, self.q, self.z)
        rows = range(nr)
        stores = [x for name in ("value", "nu", "nu_dot") for x in self.stored(f"rows.{name}", None, rows)]
        stores += [(self.at("G", e), x) for e, x in enumerate(self.W.G)]
        stores += self.stored("sensed", VALUE, range(nm))
        stores += [(self.at("T", k, c), x) for (k, c), x in np.ndenumerate(self.W.T)]
        stores += [(self.at("FK", *e), self.W.FK[e]) for e in self.read_by_others if e[1] < 12]
        reads |= {**self.given("a", self.q), **self.given("b", self.z), **self.time}
        self.add("PLACE", reads, stores)
        shown = [(self.at("FK", *e), self.W.FK[e]) for e in self.read_at_ends if e[1] < 12]
        self.add("SHOW", self.given("a", self.q), shown)

    def entries(self, readers: Sequence[Callable[[Work], list[Any]]], far: bool = False) -> list[tuple[int, int]]:
        """Entries of the frames' records that others read; all positions if they ask how ``far`` frames are."""
        S, FK, graph = self.S, self.W.FK, self.graph
        moving = range(S.sizes.ground_frames, S.sizes.moving_frames)
        asked = {(k, c) for k in moving for c in range(3)} if far else set()
        granted = len(graph.granted)
        for reader in readers:
            trial = FK.copy()
            names = {}
            for k in moving:
                for c in range(24):
                    trial[k, c] = graph.symbol(f"FK[{k}, {c}]")
                    names[trial[k, c].index] = (k, c)
            try:
                found = reader(self.W._replace(FK=trial))
            except Undecided:
                found = list(trial[list(moving)].ravel())
            asked |= {names[x.index] for x in operations(found, {}) if x.index in names}
        del graph.granted[granted:]  # by formulas of symbols that stand in no procedure
        return sorted(asked)

    def _progresses(self) -> bool:
        """Whether expressions can say how places on curves go on."""
        granted = len(self.graph.granted)
        try:
            self._advanced(self.W._replace(FK=self.numbered("FK?", self.W.FK.size).reshape(self.W.FK.shape)))
        except Undecided:
            return False
        finally:
            del self.graph.granted[granted:]
        return True

    def _advanced(self, W: Work) -> list[Any]:
        """Nothing, if expressions can do it."""
        progress(self.S, W, self.z, np.zeros(len(self.z), object))
        return []

    def _remembered(self, W: Work) -> list[Any]:
        z = self.z.copy()
        remember(self.S, W, z)
        return list(z)

    def _noted(self, W: Work) -> list[Any]:
        if kept(self.S).shape[1] == 0:
            return []
        seen = np.zeros((6, noted(self.S)), object)
        take_note(self.S, W, seen, 1)
        return list(seen.ravel())

    def _weighed(self, W: Work) -> list[Any]:
        if not len(self.S.load_terms.load):
            return []
        T, lam, sensed = (np.array([self.graph.symbol(f"{n}?{k}") for k in range(x.size)], object).reshape(x.shape)
                          for n, x in (("T", W.T), ("lam", W.rows.multiplier), ("sensed", W.sensed)))  # fmt: skip
        reaction_loads(self.S, W._replace(T=T, rows=W.rows._replace(multiplier=lam), sensed=sensed))
        return list(sensed.ravel())

    def moved(self) -> None:
        """Velocities, bias accelerations, and what follows."""
        nm = self.nm
        move(self.S, self.W, self.t, self.v, self.z)
        stores = self.stored("rows.gamma", None, range(self.nr))
        stores += self.stored("sensed", RATE, range(nm)) + self.stored("sensed", BIAS, range(nm))
        stores += self.stored("sensed", VALUE, range(nm, 2 * nm))
        stores += [(self.at("FK", *e), self.W.FK[e]) for e in (*self.read_by_others, *self.read_at_ends) if e[1] >= 12]
        self.add("MOVE", {**self.given("a", self.v), **self.given("b", self.z), **self.time}, stores)

    def loaded(self) -> None:
        """Generalised forces."""
        nm = self.nm
        reads = self.fresh("sensed", LOAD, range(2 * nm, loads_end(self.S, self.W)))
        rates = np.full(len(self.z), None, object)
        loaded(self.S, self.W, self.t, None, rates)
        stores = self.stored("velocities.applied", None, range(self.nv))
        stores += [(("b", k), x) for k, x in enumerate(rates) if x is not None]
        self.add("LOADS", {**self.state, **reads}, stores)

    def finished(self) -> None:
        """The state's derivative."""
        if not self.finishes:
            return
        nq, nv = self.s.nq, self.nv
        given = self.W.velocities.solved, self.W.rows.multiplier
        x, lam = self.numbered("x", nv), self.numbered("lam", self.nr)
        self.W.velocities.solved[:], self.W.rows.multiplier[:] = x, lam
        reads = self.fresh("velocities.effort", None, self.driven)
        before = self.numbered("dy", nq + nv + len(self.z))  # works stand there already
        dy = before.copy()
        finish(self.S, self.W, self.t, np.concatenate([self.q, self.v, self.z]), dy)
        self.W.velocities.solved[:], self.W.rows.multiplier[:] = given
        stores = [(("b", k), y) for k, y in enumerate(dy) if y is not before[k]]
        reads |= {**self.state, **self.given("b", before), **self.given("c", x), **self.given("d", lam)}
        made = self.add("FINISH", reads, stores)
        made.checks = [(list({y.index: y for y in dy if isinstance(y, Node)}.values()), "finite", 1.0)]

    def sampled(self) -> None:
        """Laws that may do much within a step, one by one."""
        S, W = self.S, self.W
        sensed = np.full((3, 2 * self.nm), None, object)
        sensed[VALUE] = values = self.numbered("within", 2 * self.nm)
        inputs = (self.t, *self.numbered("input", 2))
        forces = LAWS * len(S.forces.F)
        self.laws: list[str] = []
        for k in range(forces + len(S.rows.law) + len(S.tree.parent)) if kept(S).shape[1] else ():
            law = law_at(S, k)
            self.laws.append("")
            if law < 0 or not brief(S.code, law):
                continue
            if k < forces:
                value = evaluate(S.code, S.const, law, W.stack, inputs, sensed)
            else:
                value = evaluate_jet(S.code, S.const, law, W.stack, self.t, sensed, BY_TIME)[2]
            reads = {**self.time, **self.given("a", values)}
            reads |= {x.index: ("W_flat", LAW_INPUT + n) for n, x in enumerate(inputs[1:])}
            self.laws[k] = f"LAW{k}"
            self.add(self.laws[k], reads, [], value)
