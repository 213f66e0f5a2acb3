"""The engine's loops run on expressions, task by task: inputs and outputs of each procedure.

The generated code has to write what the engine's arrays contain afterwards, at the same places. The tables' entries are
symbols, so that the code is valid for other values of parameters; entries that are 0, 1 or -1 stay numbers. Factors and
solves read their inputs from the engine's arrays.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import reduce
from typing import Any

import numpy as np

from ..engine.articulated_body import solve_articulated
from ..engine.element_dispatch import progress, remember
from ..engine.entry_point import allocate_work
from ..engine.loads import loads_end, reaction_loads
from ..engine.motion import apply_all_forces, store_derivative
from ..engine.pulse_detection import LAWS, count_law_inputs, inspection_buffer, law_at, store_law_inputs
from ..engine.rows import BY_TIME, count_measured, row_times
from ..engine.solve import (
    apply_inverse_mass,
    factor,
    pass_coupled,
    pass_schur,
    residual_coupled,
    residual_schur,
    rows_by_inverse_mass,
)
from ..engine.stabilization import set_prescribed, update_positions, update_velocities, velocity_violation
from ..expression_graph.graph import Graph, Node, Symbol, UndeterminedDecision
from ..expression_graph.printers.llvm import Place, Procedure, ordered_operations
from ..expression_graph.tracing import TRACED_TABLES
from ..laws.bytecode import evaluate, evaluate_jet, may_be_brief
from ..math.scalar import choose
from ..tables.structure_definition import Structure
from ..tables.table_definitions import (
    ARTICULATED,
    COUPLED,
    LAW_INPUT,
    LOADED,
    ROW_RESIDUAL,
    SCHUR,
    TERMS,
    KinematicRecords,
    Sensed,
    System,
    Work,
    Wrenches,
    with_numbers,
)

ROW = {name: first for name, (first, _) in Sensed.layout.entries.items()}
"""Rows of `Work.sensed` by name."""
POSE = range(KinematicRecords.layout.entries["angular_velocity"][0])
"""Entries of a kinematic record that are its pose."""
PLAIN_ENTRIES = (0.0, 1.0, -1.0)  # entries of tables that may be fixed in the code


def tables_of_symbols(
    S: System, graph: Graph, known: Sequence[tuple[str, int]] = ()
) -> tuple[System, dict[int, Place]]:
    """Tables with symbols as entries, and the place of each; entries that are ``known`` are numbers."""
    places: dict[int, Place] = {}
    told = set(known)

    def with_symbols(name: str, table: np.ndarray) -> np.ndarray:
        out = np.empty(table.shape, object)
        for k, x in enumerate(table.ravel().tolist()):
            law_zero = name == "const" and x == 0.0  # 0 sqrt(x) has no value where sqrt(x) has none
            if (x in PLAIN_ENTRIES and not law_zero) or (name, k) in told:
                out.ravel()[k] = x
                continue
            node = graph.symbol(Symbol(f"{name}[{k}]", "parameter"), x)
            places[node.index] = (f"C_{name}", k)
            out.ravel()[k] = node
        return out

    return with_numbers(S, with_symbols, TRACED_TABLES), places


class ProcedureRecorder:
    """Workspace of expressions, with the place of each in the engine's arrays.

    Attributes
    ----------
    graph : Graph
    constants : dict
        Symbols of the tables' entries: number of the node -> place.
    procedures : dict of str to Procedure
        By the names of `System.flat`'s entries.
    """

    def __init__(self, s: Structure, S: System, known: Sequence[tuple[str, int]] = ()) -> None:
        self.s, self.graph = s, Graph(rounded=True)
        self.S, self.constants = tables_of_symbols(S, self.graph, known)
        self.W: Work = allocate_work(s, self.S, dtype=object)
        self.nv, self.nr, self.nm = s.nv, len(S.rows.law), count_measured(S)
        self.procedures: dict[str, Procedure] = {}
        self.t = self.graph.symbol("t")
        self.q, self.v = self.numbered("q", s.nq), self.numbered("v", s.nv)
        self.z = self.numbered("z", len(s.states))

    def numbered(self, name: str, n: int) -> np.ndarray:
        """Array of n symbols, named by their indices."""
        out = np.zeros(n, object)
        out[:] = [self.graph.symbol(f"{name}[{k}]") for k in range(n)]
        return out

    def array(self, name: str) -> np.ndarray:
        """Array of `Work`, by its name: ``"rows.gamma"``."""
        found: Any = reduce(getattr, name.split("."), self.W)
        return found  # type: ignore[no-any-return]

    def at(self, name: str, *index: int) -> Place:
        """Place of an entry of an array of `Work`."""
        array = self.array(name)
        return f"W_{name.replace('.', '_')}", index[0] if array.ndim == 1 else index[0] * array.shape[1] + index[1]

    def fresh(self, name: str, row: int | None, columns: Sequence[int]) -> dict[int, Place]:
        """Replace an array of `Work`, or a row of it, by symbols; returns the places they are read from."""
        reads = {}
        array = self.array(name)
        for c in columns:
            index = (c,) if row is None else (row, c)
            node = self.graph.symbol(f"W.{name}[{', '.join(map(str, index))}]")
            array[index] = node
            reads[node.index] = self.at(name, *index)
        return reads

    def again(self, name: str) -> dict[int, Place]:
        """Replace all expressions in a one-dimensional array by symbols; returns the places they are read from."""
        array = self.array(name)
        reads = {}
        for e, x in enumerate(array):
            if isinstance(x, Node) and not x.known:
                array[e] = self.graph.symbol(f"W.{name}[{e}]")
                reads[array[e].index] = self.at(name, e)
        return reads

    def stored(self, name: str, row: int | None, columns: Sequence[int]) -> list[tuple[Place, Any]]:
        """Entries of an array of `Work`, or of a row of it, with the places to write them to."""
        array = self.array(name)
        return [(self.at(name, *i), array[i]) for i in ((c,) if row is None else (row, c) for c in columns)]

    def array_entries(self, name: str) -> list[tuple[Place, Any]]:
        """Entries of a whole one-dimensional array, with the places to write them to."""
        return [(self.at(name, e), x) for e, x in enumerate(self.array(name))]

    def given(self, base: str, nodes: np.ndarray, first: int = 0) -> dict[int, Place]:
        """Consecutive symbols with their places in an argument, from index ``first`` on."""
        return {x.index: (base, first + k) for k, x in enumerate(nodes)}

    @property
    def time(self) -> dict[int, Place]:
        """The time, as an input."""
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
        """Add a procedure; if an assumption made by its formulas fails, it returns a number greater than 0."""
        granted, self.graph.granted = self.graph.granted, []
        checks = [([x], what, k + 1.0) for k, (x, what) in enumerate(granted)]
        made = Procedure(
            name, reads, stores, returned, checks, name not in ("STEP", "STEP_UNLOADED", "REFINE", "DRIFT")
        )
        self.procedures[name] = made
        return made

    @property
    def driven(self) -> list[int]:
        """Velocities that drivers prescribe."""
        return self.S.tree.v[self.S.tree.law >= 0].tolist()


class SolveProcedures(ProcedureRecorder):
    """Procedures of the factorisation, the solves, and the constraint violation of velocities."""

    def solved(self) -> None:
        """Add the factorisation and the solves."""
        solver = self.S.sizes.solver
        S, W = self.S, self.W
        if solver == SCHUR:
            rows_by_inverse_mass(S, W)
            self.add("REUSE", {}, self.array_entries("H"))
        factor(S, W)
        stores = {SCHUR: self.array_entries("H"), COUPLED: self.array_entries("M"), ARTICULATED: []}[solver]
        if solver != ARTICULATED:
            stores += self.array_entries("L") + self.stored("ldl", 0, range(len(W.ldl.inverse_diagonal)))
            stores += self.stored("rows.diagonal", None, range(self.nr))
        self.add("FACTOR", {}, stores)
        reads: dict[int, Place] = {}
        if solver != ARTICULATED:
            reads |= self.again("H" if solver == SCHUR else "M") | self.again("L")
            reads |= self.fresh("ldl", 0, range(len(W.ldl.inverse_diagonal)))
        for name, is_loaded in (("STEP", True), ("STEP_UNLOADED", False)):
            self.stepped(name, is_loaded, reads)
        if solver != ARTICULATED:
            self.refined(reads)

    def stepped(self, name: str, is_loaded: bool, reads: dict[int, Place]) -> None:
        """Add the start of a solve: the solution without the rows' multipliers, and the residuals of the equations."""
        S, W = self.S, self.W
        f, gamma = self.numbered("f", self.nv), self.numbered("gamma", self.nr)
        reads = {**reads, **self.given("a", f), **self.given("b", gamma)}
        x, lam = np.array([0.0] * self.nv, object), np.array([0.0] * self.nr, object)
        W.rows.scratch_1[:] = gamma
        W.velocities.scratch_2[:] = W.velocities.effort[:] = 0.0
        if is_loaded:
            reads |= self.fresh("velocities.prescribed", None, self.driven)
            x[self.driven] = W.velocities.prescribed[self.driven]
        if S.sizes.solver == SCHUR and self.semidefinite:  # the correction by E applies to the whole step of a pass
            W.velocities.scratch_2[:] = f if is_loaded else 0.0
        elif S.sizes.solver == SCHUR:
            for b in range(len(S.tree.parent)) if is_loaded else ():
                apply_inverse_mass(S, b, f, S.tree.v[b], x, S.tree.v[b])
            W.rows.scratch_1[:] = [gamma[k] - row_times(S, W, k, x) for k in range(self.nr)]
        elif S.sizes.solver == COUPLED and is_loaded:
            residual_coupled(S, W, f, gamma, x, lam, W.velocities.scratch_2, True)
        elif S.sizes.solver == ARTICULATED:
            solve_articulated(S, W, f, x, W.velocities.effort)
        stores = [*self.solution(x, lam), (("W_flat", LOADED), 1.0 if is_loaded else 0.0)]
        self.add(name, reads, stores)

    def solution(self, x: np.ndarray, lam: np.ndarray) -> list[tuple[Place, Any]]:
        """Outputs of a pass: the solution, the residuals of the equations, efforts of drivers."""
        out: list[tuple[Place, Any]] = [(("c", k), y) for k, y in enumerate(x)] + [
            (("d", k), y) for k, y in enumerate(lam)
        ]
        if self.S.sizes.solver == SCHUR:
            left = self.stored("velocities.scratch_2", None, range(self.nv)) if self.semidefinite else []
        else:
            left = self.stored("velocities.scratch_2", None, range(self.nv)) + self.stored(
                "velocities.effort", None, self.driven
            )
        return out + left + self.stored("rows.scratch_1", None, range(self.nr))

    @property
    def semidefinite(self) -> bool:
        """Whether substitutes replace zero masses."""
        return bool(self.S.scales.semidefinite > 0.0)

    def refined(self, reads: dict[int, Place]) -> None:
        """Add a refinement pass."""
        S, W = self.S, self.W
        f, gamma = self.numbered("f", self.nv), self.numbered("gamma", self.nr)
        x, lam = self.numbered("x", self.nv), self.numbered("lam", self.nr)
        reads = {**reads, **self.given("a", f), **self.given("b", gamma), **self.given("c", x), **self.given("d", lam)}
        reads |= self.fresh("rows.scratch_1", None, range(self.nr)) | self.fresh(
            "velocities.scratch_2", None, range(self.nv)
        )
        x, lam = x.copy(), lam.copy()
        if S.sizes.solver == SCHUR:
            pass_schur(S, W, W.velocities.scratch_2, x, lam, self.semidefinite)
            worst, off = residual_schur(S, W, gamma, x, W.velocities.scratch_2, self.semidefinite)
        else:
            is_loaded = self.graph.symbol("loaded")
            reads[is_loaded.index] = ("W_flat", LOADED)
            f = np.array([choose(is_loaded, y, 0.0) for y in f] or [0.0], object)[: self.nv]
            worst, off = pass_coupled(S, W, f, gamma, x, lam, W.velocities.scratch_2, True)
        self.add("REFINE", reads, [*self.solution(x, lam), (("W_flat", ROW_RESIDUAL), off)], worst)

    def drifted(self) -> None:
        """Add the constraint violation of velocities."""
        out = np.array([0.0] * self.nr, object)
        worst, size = velocity_violation(self.S, self.W, self.v, out)
        stores = [(("b", k), x) for k, x in enumerate(out)] + [(("W_flat", TERMS), size)]
        self.add("DRIFT", self.given("a", self.v), stores, worst)


class MechanismProcedures(SolveProcedures):
    """All procedures of one mechanism, as expressions; `LinkedProcedures` determines the values that they share."""

    def __init__(self, s: Structure, S: System, known: Sequence[tuple[str, int]] = ()) -> None:
        super().__init__(s, S, known)
        self.read_by_others = self.entries((self._place_rates, self._weighed))
        self.read_at_ends = self.entries((self._updated_angle_states, self._law_inputs), far=True)
        self.finishes = self._can_progress()
        self.prepared()
        self.placed()
        self.moved()
        self.graph.strict = True  # where a force has no value, a sum with it has none
        self.loaded()
        self.graph.strict = False
        self.finished()
        self.solved()
        self.drifted()
        self.graph.strict = True
        self.sampled()

    def prepared(self) -> None:
        """Add the normalisation of quaternions, and prescribed coordinates."""
        q, v = self.q.copy(), self.v.copy()
        set_prescribed(self.S, self.W, self.t, q, v)
        stores = [(("a", k), x) for k, x in enumerate(q) if x is not self.q[k]]
        stores += [(("b", k), x) for k, x in enumerate(v) if x is not self.v[k]]
        stores += [(self.at("velocities.prescribed", d), self.W.velocities.prescribed[d]) for d in self.driven]
        self.add("PREPARE", {**self.given("a", self.q), **self.given("b", self.v), **self.time}, stores)

    def placed(self) -> None:
        """Add poses and rows."""
        nm, nr = self.nm, self.nr
        reads = self.fresh("sensed", ROW["value"], range(nm, 2 * nm))  # rates, as last measured
        update_positions(self.S, self.W, self.t, self.q, self.z)
        rows = range(nr)
        stores = [x for name in ("value", "nu", "nu_dot") for x in self.stored(f"rows.{name}", None, rows)]
        stores += [(self.at("G", e), x) for e, x in enumerate(self.W.G)]
        stores += self.stored("sensed", ROW["value"], range(nm))
        stores += [(self.at("term_wrenches", k, c), x) for (k, c), x in np.ndenumerate(self.W.term_wrenches)]
        stores += [(self.at("frames", *e), self.W.frames[e]) for e in self.read_by_others if e[1] in POSE]
        reads |= {**self.given("a", self.q), **self.given("b", self.z), **self.time}
        self.add("PLACE", reads, stores)
        shown = [(self.at("frames", *e), self.W.frames[e]) for e in self.read_at_ends if e[1] in POSE]
        self.add("SHOW", self.given("a", self.q), shown)

    def entries(self, readers: Sequence[Callable[[Work], list[Any]]], far: bool = False) -> list[tuple[int, int]]:
        """Entries of the frames' records that other code reads; all positions if ``far``."""
        S, frames, graph = self.S, self.W.frames, self.graph
        moving = range(S.sizes.ground_frames, S.sizes.moving_frames)
        asked = {(k, c) for k in moving for c in range(3)} if far else set()
        granted = len(graph.granted)
        for reader in readers:
            trial = frames.copy()
            names = {}
            for k in moving:
                for c in range(frames.shape[1]):
                    trial[k, c] = graph.symbol(f"frames[{k}, {c}]")
                    names[trial[k, c].index] = (k, c)
            try:
                found = reader(self.W._replace(frames=trial))
            except UndeterminedDecision:
                found = list(trial[list(moving)].ravel())
            asked |= {names[x.index] for x in ordered_operations(found, {}) if x.index in names}
        del graph.granted[granted:]  # by formulas of symbols that occur in no procedure
        return sorted(asked)

    def _can_progress(self) -> bool:
        """Whether the rates of places on curves can be expressed."""
        granted = len(self.graph.granted)
        try:
            frames = self.numbered("frames?", self.W.frames.size).reshape(self.W.frames.shape)
            self._place_rates(self.W._replace(frames=frames.view(KinematicRecords)))
        except UndeterminedDecision:
            return False
        finally:
            del self.graph.granted[granted:]
        return True

    def _place_rates(self, W: Work) -> list[Any]:
        """Run the rates of places on curves on expressions; returns no outputs."""
        progress(self.S, W, self.z, np.zeros(len(self.z), object))
        return []

    def _updated_angle_states(self, W: Work) -> list[Any]:
        z = self.z.copy()
        remember(self.S, W, z)
        return list(z)

    def _law_inputs(self, W: Work) -> list[Any]:
        if inspection_buffer(self.S).shape[1] == 0:
            return []
        seen = np.zeros((6, count_law_inputs(self.S)), object)
        store_law_inputs(self.S, W, seen, 1)
        return list(seen.ravel())

    def _weighed(self, W: Work) -> list[Any]:
        if not len(self.S.load_terms.load):
            return []
        arrays = {"term_wrenches": W.term_wrenches, "multiplier": W.rows.multiplier, "sensed": W.sensed}
        wrenches, lam, sensed = (self.numbered(f"{n}?", x.size).reshape(x.shape) for n, x in arrays.items())
        W = W._replace(term_wrenches=wrenches.view(Wrenches), sensed=sensed.view(Sensed))
        reaction_loads(self.S, W._replace(rows=W.rows._replace(multiplier=lam)))
        return list(sensed.ravel())

    def moved(self) -> None:
        """Add velocities, bias accelerations, and quantities that follow from them."""
        nm = self.nm
        update_velocities(self.S, self.W, self.t, self.v, self.z)
        stores = self.stored("rows.gamma", None, range(self.nr))
        stores += self.stored("sensed", ROW["rate"], range(nm)) + self.stored("sensed", ROW["bias"], range(nm))
        stores += self.stored("sensed", ROW["value"], range(nm, 2 * nm))
        read = (*self.read_by_others, *self.read_at_ends)
        stores += [(self.at("frames", *e), self.W.frames[e]) for e in read if e[1] not in POSE]
        self.add("MOVE", {**self.given("a", self.v), **self.given("b", self.z), **self.time}, stores)

    def loaded(self) -> None:
        """Add generalised forces."""
        nm = self.nm
        reads = self.fresh("sensed", ROW["load"], range(2 * nm, loads_end(self.S, self.W)))
        rates = np.full(len(self.z), None, object)
        apply_all_forces(self.S, self.W, self.t, None, rates)
        stores = self.stored("velocities.applied", None, range(self.nv))
        stores += [(("b", k), x) for k, x in enumerate(rates) if x is not None]
        self.add("LOADS", {**self.state, **reads}, stores)

    def finished(self) -> None:
        """Add the derivative of the state."""
        if not self.finishes:
            return
        nq, nv = self.s.nq, self.nv
        given = self.W.velocities.solved, self.W.rows.multiplier
        x, lam = self.numbered("x", nv), self.numbered("lam", self.nr)
        self.W.velocities.solved[:], self.W.rows.multiplier[:] = x, lam
        reads = self.fresh("velocities.effort", None, self.driven)
        before = self.numbered("dy", nq + nv + len(self.z))  # works are there already
        dy = before.copy()
        store_derivative(self.S, self.W, self.t, np.concatenate([self.q, self.v, self.z]), dy)
        self.W.velocities.solved[:], self.W.rows.multiplier[:] = given
        stores = [(("b", k), y) for k, y in enumerate(dy) if y is not before[k]]
        reads |= {**self.state, **self.given("b", before), **self.given("c", x), **self.given("d", lam)}
        made = self.add("FINISH", reads, stores)
        made.checks = [(list({y.index: y for y in dy if isinstance(y, Node)}.values()), "finite", 1.0)]

    def sampled(self) -> None:
        """Add the laws that may act briefly within a step, one by one."""
        S, W = self.S, self.W
        sensed = np.full((3, 2 * self.nm), None, object)
        sensed[0] = values = self.numbered("within", 2 * self.nm)
        inputs = (self.t, *self.numbered("input", 2))
        forces = LAWS * len(S.forces.F)
        self.laws: list[str] = []
        for k in range(forces + len(S.rows.law) + len(S.tree.parent)) if inspection_buffer(S).shape[1] else ():
            law = law_at(S, k)
            self.laws.append("")
            if law < 0 or not may_be_brief(S.code, law):
                continue
            if k < forces:
                value = evaluate(S.code, S.const, law, W.stack, inputs, sensed)
            else:
                value = evaluate_jet(S.code, S.const, law, W.stack, self.t, sensed, BY_TIME)[2]
            reads = {**self.time, **self.given("a", values)}
            reads |= {x.index: ("W_flat", LAW_INPUT + n) for n, x in enumerate(inputs[1:])}
            self.laws[k] = f"LAW{k}"
            self.add(self.laws[k], reads, [], value)
