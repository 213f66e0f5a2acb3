"""The engine's loops run on expressions, task by task: what each reads, and what it writes where.

What stands in the engine's own arrays afterwards is what the made code has to write, at the same places. The tables'
entries are symbols, so that the code holds for other values of parameters; entries that are 0, 1 or -1 stay numbers.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from ..equations.articulated import articulated_solve
from ..equations.dispatch import progress, remember
from ..equations.friction import reaction_loads
from ..equations.motion import finish, loaded
from ..equations.prescribed import prepare
from ..equations.projection import drift, move, place
from ..equations.rows import BY_TIME, measured, row_times
from ..equations.scratch import work
from ..equations.solve import excess, factor, inverse_mass, pass_coupled, pass_schur, remainder, residual, turn_rows
from ..equations.within import LAWS, kept, law_at, take_note
from ..graph.node import Graph, Node, Symbol, Undecided
from ..graph.printers.llvm import Place, Procedure
from ..graph.printers.llvm_order import operations
from ..laws.evaluation import brief, evaluate, evaluate_jet
from ..math.scalar import choose, larger
from ..tables.specs import Structure
from ..tables.system import (
    ARTICULATED,
    BIAS,
    BODY_LAW,
    COUPLED,
    DIAGONAL,
    EFFORT,
    F_APPLIED,
    FRAMES,
    G_VALUE,
    GAMMA,
    GIVEN,
    GROUND_FRAMES,
    LAM,
    LOAD,
    NU,
    NU_DOT,
    R1,
    RATE,
    SCHUR,
    SEMIDEFINITE,
    SOLVER,
    V0,
    V1,
    V2,
    VALUE,
    X_SOLVED,
    System,
    Work,
)
from ..tracing.trace import TABLES

PLAIN = (0.0, 1.0, -1.0)  # entries of tables that the code may know
SOLVES = (
    "STEP",
    "STEP_UNLOADED",
    "REFINE",
    "DRIFT",
)  # best in the order in which they are made
FIRST_FREE = 4  # of Work.flat: some entries have a meaning of their own
TERMS, LOADED, INPUT, INPUT_RATE = range(4)
"""The size of the terms that `DRIFT` has met; whether the solve that goes on is loaded; what a law depends on."""


def symbols(S: System, graph: Graph, known: Sequence[tuple[str, int]] = ()) -> tuple[System, dict[int, Place]]:
    """The tables with symbols in them, and where each stands; entries that are ``known`` are numbers."""
    places: dict[int, Place] = {}
    new: dict[str, Any] = {}
    told = set(known)
    for name in TABLES:
        table = getattr(S, name)
        out = np.empty(table.shape, object)
        for k, x in enumerate(table.ravel().tolist()):
            if x in PLAIN or (name, k) in told:
                out.ravel()[k] = x
                continue
            node = graph.symbol(Symbol(f"{name}[{k}]", "parameter"), x)
            places[node.index] = (f"C_{name}", k)
            out.ravel()[k] = node
        new[name] = out
    return S._replace(**new), places


class Stages:
    """Procedures of one mechanism, as far as expressions go; `Linked` says what they hand on to each other.

    Attributes
    ----------
    graph : Graph
    constants : dict
        Symbols of the tables' entries: number of the node -> place.
    procedures : dict of str to Procedure
        By the names of `System.flat`'s entries.
    """

    def __init__(self, s: Structure, S: System, known: Sequence[tuple[str, int]] = ()) -> None:
        self.s, self.graph = s, Graph()
        self.S, self.constants = symbols(S, self.graph, known)
        self.W: Work = work(s, self.S, dtype=object)
        self.nv, self.nr, self.nm = s.nv, len(S.row_i), measured(S)
        self.procedures: dict[str, Procedure] = {}
        self.t = self.graph.symbol("t")
        self.q, self.v = self._symbols("q", s.nq), self._symbols("v", s.nv)
        self.z = self._symbols("z", len(s.states))
        self.widths = {k: x.shape[1] for k, x in self.W._asdict().items() if np.ndim(x) == 2}
        self.read_by_others = self.entries((self._advanced, self._weighed))
        self.read_at_ends = self.entries((self._remembered, self._noted), far=True)
        self.finishes = self._progresses()
        self.prepared()
        self.placed()
        self.moved()
        self.loaded()
        self.finished()
        self.solved()
        self.drifted()
        self.sampled()

    # -- symbols and places

    def _symbols(self, name: str, n: int) -> np.ndarray:
        out = np.zeros(n, object)
        out[:] = [self.graph.symbol(f"{name}[{k}]") for k in range(n)]
        return out

    def at(self, name: str, row: int, column: int = 0) -> Place:
        """Where an entry of an array of `Work` stands."""
        return f"W_{name}", row * self.widths.get(name, 1) + column

    def fresh(self, name: str, row: int, columns: Sequence[int]) -> dict[int, Place]:
        """Put symbols into a row of an array of `Work` in place of what is there; where they are read."""
        reads = {}
        array = getattr(self.W, name)
        for c in columns:
            node = self.graph.symbol(f"W.{name}[{row}, {c}]")
            array[row, c] = node
            reads[node.index] = self.at(name, row, c)
        return reads

    def stored(self, name: str, row: int, columns: Sequence[int]) -> list[tuple[Place, Any]]:
        """What stands in a row of an array of `Work`, to be written there."""
        array = getattr(self.W, name)
        return [(self.at(name, row, c), array[row, c]) for c in columns]

    def given(self, base: str, nodes: np.ndarray, first: int = 0) -> dict[int, Place]:
        """Symbols that stand one after the other from an argument on."""
        return {x.index: (base, first + k) for k, x in enumerate(nodes)}

    @property
    def time(self) -> dict[int, Place]:
        """The time."""
        return {self.t.index: ("t", 0)}

    @property
    def state(self) -> dict[int, Place]:
        """The whole state as the first argument."""
        nq, nv = self.s.nq, self.nv
        return {
            **self.given("a", self.q),
            **self.given("a", self.v, nq),
            **self.given("a", self.z, nq + nv),
            **self.time,
        }

    def add(
        self, name: str, reads: dict[int, Place], stores: list[tuple[Place, Any]], returned: Any = 0.0
    ) -> Procedure:
        """Another procedure; what formulas took for granted meanwhile makes it return a number greater than 0."""
        granted, self.graph.granted = self.graph.granted, []
        checks = [([x], what, k + 1.0) for k, (x, what) in enumerate(granted)]
        made = Procedure(
            name, reads, stores, returned, checks, name not in ("STEP", "STEP_UNLOADED", "REFINE", "DRIFT")
        )
        self.procedures[name] = made
        return made

    # -- tasks

    def prepared(self) -> None:
        """Unit quaternions, prescribed coordinates."""
        q, v = self.q.copy(), self.v.copy()
        prepare(self.S, self.W, self.t, q, v)
        stores = [(("a", k), x) for k, x in enumerate(q) if x is not self.q[k]]
        stores += [(("b", k), x) for k, x in enumerate(v) if x is not self.v[k]]
        stores += [(self.at("vel", GIVEN, d), self.W.vel[GIVEN, d]) for d in self.driven]
        self.add("PREPARE", {**self.given("a", self.q), **self.given("b", self.v), **self.time}, stores)

    @property
    def driven(self) -> list[int]:
        """Velocities that drivers prescribe."""
        return [int(b[V0]) for b in self.S.body_i if b[BODY_LAW] >= 0]

    def placed(self) -> None:
        """Poses and rows."""
        nm, nr = self.nm, self.nr
        reads = self.fresh("sensed", VALUE, range(nm, 2 * nm))  # rates, as last measured
        place(self.S, self.W, self.t, self.q, self.z)
        rows = range(nr)
        stores = [x for r in (G_VALUE, NU, NU_DOT) for x in self.stored("row", r, rows)]
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
        moving = range(S.kinds[GROUND_FRAMES], S.kinds[FRAMES])
        asked = {(k, c) for k in moving for c in range(3)} if far else set()
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
        return sorted(asked)

    def _progresses(self) -> bool:
        """Whether expressions can say how places on curves go on."""
        try:
            self._advanced(self.W._replace(FK=self._symbols("FK?", self.W.FK.size).reshape(self.W.FK.shape)))
        except Undecided:
            return False
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
        seen = np.zeros((6, self.nm + len(self.S.force_i)), object)
        take_note(self.S, W, seen, 1)
        return list(seen.ravel())

    def _weighed(self, W: Work) -> list[Any]:
        if not len(self.S.load_i):
            return []
        T, row, sensed = (np.array([self.graph.symbol(f"{n}?{k}") for k in range(x.size)], object).reshape(x.shape)
                          for n, x in (("T", W.T), ("row", W.row), ("sensed", W.sensed)))  # fmt: skip
        reaction_loads(self.S, W._replace(T=T, row=row, sensed=sensed))
        return list(sensed.ravel())

    def moved(self) -> None:
        """Velocities, bias accelerations, and what follows."""
        nm = self.nm
        move(self.S, self.W, self.t, self.v, self.z)
        stores = self.stored("row", GAMMA, range(self.nr))
        stores += self.stored("sensed", RATE, range(nm)) + self.stored("sensed", BIAS, range(nm))
        stores += self.stored("sensed", VALUE, range(nm, 2 * nm))
        stores += [(self.at("FK", *e), self.W.FK[e]) for e in (*self.read_by_others, *self.read_at_ends) if e[1] >= 12]
        self.add("MOVE", {**self.given("a", self.v), **self.given("b", self.z), **self.time}, stores)

    def loaded(self) -> None:
        """Generalised forces."""
        nm = self.nm
        reads = self.fresh("sensed", LOAD, range(2 * nm, self.W.sensed.shape[1]))
        rates = np.full(len(self.z), None, object)
        loaded(self.S, self.W, self.t, None, rates)
        stores = self.stored("vel", F_APPLIED, range(self.nv))
        stores += [(("b", k), x) for k, x in enumerate(rates) if x is not None]
        self.add("LOADS", {**self.state, **reads}, stores)

    def finished(self) -> None:
        """The state's derivative."""
        if not self.finishes:
            return
        nq, nv = self.s.nq, self.nv
        given = self.W.vel[X_SOLVED], self.W.row[LAM]
        x, lam = self._symbols("x", nv), self._symbols("lam", self.nr)
        self.W.vel[X_SOLVED], self.W.row[LAM] = x, lam
        reads = self.fresh("vel", EFFORT, self.driven)
        before = self._symbols("dy", nq + nv + len(self.z))  # works stand there already
        dy = before.copy()
        finish(self.S, self.W, self.t, np.concatenate([self.q, self.v, self.z]), dy)
        self.W.vel[X_SOLVED], self.W.row[LAM] = given
        stores = [(("b", k), y) for k, y in enumerate(dy) if y is not before[k]]
        reads |= {**self.state, **self.given("b", before), **self.given("c", x), **self.given("d", lam)}
        made = self.add("FINISH", reads, stores)
        made.checks = [(list({y.index: y for y in dy if isinstance(y, Node)}.values()), "finite", 1.0)]

    def solved(self) -> None:
        """Factor and solves."""
        solver = self.S.kinds[SOLVER]
        S, W = self.S, self.W
        if solver == SCHUR:
            turn_rows(S, W)
            self.add("REUSE", {}, self.kept("H"))
        factor(S, W)
        stores = {SCHUR: self.kept("H"), COUPLED: self.kept("M"), ARTICULATED: []}[solver]
        if solver != ARTICULATED:
            stores += self.kept("L") + self.stored("D", 0, range(len(W.D[0])))
        if len(S.load_i):
            stores += self.stored("row", DIAGONAL, range(self.nr))
        self.add("FACTOR", {}, stores)
        reads: dict[int, Place] = {}
        if solver != ARTICULATED:
            reads |= self.again("H" if solver == SCHUR else "M") | self.again("L")
            reads |= self.fresh("D", 0, range(len(W.D[0])))
        for name, is_loaded in (("STEP", True), ("STEP_UNLOADED", False)):
            self.stepped(name, is_loaded, reads)
        if solver != ARTICULATED:
            self.refined(reads)

    def kept(self, name: str) -> list[tuple[Place, Any]]:
        """A whole array of one dimension, to be written."""
        return [(self.at(name, e), x) for e, x in enumerate(getattr(self.W, name))]

    def again(self, name: str) -> dict[int, Place]:
        """Symbols in place of what is no number in an array of one dimension: it is read from there."""
        array = getattr(self.W, name)
        reads = {}
        for e, x in enumerate(array):
            if isinstance(x, Node) and not x.known:
                array[e] = self.graph.symbol(f"W.{name}[{e}]")
                reads[array[e].index] = self.at(name, e)
        return reads

    def stepped(self, name: str, is_loaded: bool, reads: dict[int, Place]) -> None:
        """Begin of a solve: what there is without the rows' multipliers, and what is left of the equations."""
        S, W = self.S, self.W
        f, gamma = self._symbols("f", self.nv), self._symbols("gamma", self.nr)
        reads = {**reads, **self.given("a", f), **self.given("b", gamma)}
        x, lam = np.array([0.0] * self.nv, object), np.array([0.0] * self.nr, object)
        W.row[R1] = gamma
        W.vel[V2] = W.vel[EFFORT] = 0.0
        if is_loaded:
            reads |= self.fresh("vel", GIVEN, self.driven)
            x[self.driven] = W.vel[GIVEN, self.driven]
        if S.kinds[SOLVER] == SCHUR:
            for b in range(len(S.body_i)) if is_loaded else ():
                inverse_mass(S, b, f, S.body_i[b, V0], x, S.body_i[b, V0])
            W.row[R1] = [gamma[k] - row_times(S, W, k, x) for k in range(self.nr)]
        elif S.kinds[SOLVER] == COUPLED and is_loaded:
            remainder(S, W, f, gamma, x, lam, W.vel[V2], True)
        elif S.kinds[SOLVER] == ARTICULATED:
            articulated_solve(S, W, f, x, W.vel[EFFORT])
        stores = [*self.solution(x, lam), (("W_flat", LOADED), 1.0 if is_loaded else 0.0)]
        self.add(name, reads, stores)

    def solution(self, x: np.ndarray, lam: np.ndarray) -> list[tuple[Place, Any]]:
        """What a pass leaves: the solution, what is left of the equations, efforts of drivers."""
        out: list[tuple[Place, Any]] = [(("c", k), y) for k, y in enumerate(x)] + [
            (("d", k), y) for k, y in enumerate(lam)
        ]
        if self.S.kinds[SOLVER] == SCHUR:
            left = self.stored("vel", V2, range(self.nv)) if self.semidefinite else []
        else:
            left = self.stored("vel", V2, range(self.nv)) + self.stored("vel", EFFORT, self.driven)
        return out + left + self.stored("row", R1, range(self.nr))

    @property
    def semidefinite(self) -> bool:
        """Whether something stands in for missing masses."""
        return bool(self.S.glob[SEMIDEFINITE] > 0.0)

    def schur_left(self, gamma: np.ndarray, x: np.ndarray) -> Any:
        """What is left after a pass, and its size."""
        S, W = self.S, self.W
        worst = residual(S, W, gamma, x) if self.nr else 0.0
        return larger(worst, excess(S, W.vel[V1], W.vel[V2], x)) if self.semidefinite else worst

    def refined(self, reads: dict[int, Place]) -> None:
        """A pass for what is left."""
        S, W = self.S, self.W
        f, gamma = self._symbols("f", self.nv), self._symbols("gamma", self.nr)
        x, lam = self._symbols("x", self.nv), self._symbols("lam", self.nr)
        reads = {**reads, **self.given("a", f), **self.given("b", gamma), **self.given("c", x), **self.given("d", lam)}
        reads |= self.fresh("row", R1, range(self.nr)) | self.fresh("vel", V2, range(self.nv))
        x, lam = x.copy(), lam.copy()
        if S.kinds[SOLVER] == SCHUR:
            pass_schur(S, W, W.vel[V2], x, lam, self.semidefinite)
            worst = self.schur_left(gamma, x)
        else:
            is_loaded = self.graph.symbol("loaded")
            reads[is_loaded.index] = ("W_flat", LOADED)
            f = np.array([choose(is_loaded, y, 0.0) for y in f] or [0.0], object)[: self.nv]
            worst = pass_coupled(S, W, f, gamma, x, lam, W.vel[V2], True)
        self.add("REFINE", reads, self.solution(x, lam), worst)

    def drifted(self) -> None:
        """What is missing of the velocities' constraints."""
        out = np.array([0.0] * self.nr, object)
        worst, size = drift(self.S, self.W, self.v, out)
        stores = [(("b", k), x) for k, x in enumerate(out)] + [(("W_flat", TERMS), size)]
        self.add("DRIFT", self.given("a", self.v), stores, worst)

    def sampled(self) -> None:
        """Laws that may do much within a step, one by one."""
        S, W = self.S, self.W
        sensed = np.full((3, 2 * self.nm), None, object)
        sensed[VALUE] = values = self._symbols("within", 2 * self.nm)
        inputs = (self.t, *self._symbols("input", 2))
        forces = LAWS * len(S.force_i)
        self.laws: list[str] = []
        for k in range(forces + len(S.row_i) + len(S.body_i)) if kept(S).shape[1] else ():
            law = law_at(S, k)
            self.laws.append("")
            if law < 0 or not brief(S.code, law):
                continue
            if k < forces:
                value = evaluate(S.code, S.const, law, W.stack, inputs, sensed)
            else:
                value = evaluate_jet(S.code, S.const, law, W.stack, self.t, sensed, BY_TIME)[2]
            reads = {**self.time, **self.given("a", values)}
            reads |= {x.index: ("W_flat", INPUT + n) for n, x in enumerate(inputs[1:])}
            self.laws[k] = f"LAW{k}"
            self.add(self.laws[k], reads, [], value)
