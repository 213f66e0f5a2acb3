"""The engine's factors and solves on expressions; what they work on is read from where the engine has it."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..equations.articulated import articulated_solve
from ..equations.projection import drift
from ..equations.rows import row_times
from ..equations.solve import (
    factor,
    inverse_mass,
    pass_coupled,
    pass_schur,
    remainder_coupled,
    remainder_schur,
    turn_rows,
)
from ..graph.printers.llvm import Place
from ..math.scalar import choose
from ..tables.system import (
    ARTICULATED,
    COUPLED,
    LOAD_RESIDUAL,
    LOAD_SIZE,
    LOADED,
    ROW_SIZE,
    SCHUR,
    TERMS,
)
from .recorder import Recorder


class Solves(Recorder):
    """Factor, solves, and what is missing of the velocities' constraints."""

    def solved(self) -> None:
        """Factor and solves."""
        solver = self.S.sizes.solver
        S, W = self.S, self.W
        if solver == SCHUR:
            turn_rows(S, W)
            self.add("REUSE", {}, self.kept("H"))
        factor(S, W)
        stores = {SCHUR: self.kept("H"), COUPLED: self.kept("M"), ARTICULATED: []}[solver]
        if solver != ARTICULATED:
            stores += self.kept("L") + self.stored("D", 0, range(len(W.D[0])))
        if len(S.load_terms.load):
            stores += self.stored("rows.diagonal", None, range(self.nr))
        self.add("FACTOR", {}, stores)
        reads: dict[int, Place] = {}
        if solver != ARTICULATED:
            reads |= self.again("H" if solver == SCHUR else "M") | self.again("L")
            reads |= self.fresh("D", 0, range(len(W.D[0])))
        for name, is_loaded in (("STEP", True), ("STEP_UNLOADED", False)):
            self.stepped(name, is_loaded, reads)
        if solver != ARTICULATED:
            self.refined(reads)

    def stepped(self, name: str, is_loaded: bool, reads: dict[int, Place]) -> None:
        """Begin of a solve: what there is without the rows' multipliers, and what is left of the equations."""
        S, W = self.S, self.W
        f, gamma = self.numbered("f", self.nv), self.numbered("gamma", self.nr)
        reads = {**reads, **self.given("a", f), **self.given("b", gamma)}
        x, lam = np.array([0.0] * self.nv, object), np.array([0.0] * self.nr, object)
        W.rows.scratch_1[:] = gamma
        W.velocities.scratch_2[:] = W.velocities.effort[:] = 0.0
        if is_loaded:
            reads |= self.fresh("velocities.prescribed", None, self.driven)
            x[self.driven] = W.velocities.prescribed[self.driven]
        if S.sizes.solver == SCHUR and self.semidefinite:  # what a pass gives back of E is of all that it has moved
            W.velocities.scratch_2[:] = f if is_loaded else 0.0
        elif S.sizes.solver == SCHUR:
            for b in range(len(S.tree.parent)) if is_loaded else ():
                inverse_mass(S, b, f, S.tree.v[b], x, S.tree.v[b])
            W.rows.scratch_1[:] = [gamma[k] - row_times(S, W, k, x) for k in range(self.nr)]
        elif S.sizes.solver == COUPLED and is_loaded:
            remainder_coupled(S, W, f, gamma, x, lam, W.velocities.scratch_2, True)
        elif S.sizes.solver == ARTICULATED:
            articulated_solve(S, W, f, x, W.velocities.effort)
        stores = [*self.solution(x, lam), (("W_flat", LOADED), 1.0 if is_loaded else 0.0)]
        self.add(name, reads, stores)

    def solution(self, x: np.ndarray, lam: np.ndarray) -> list[tuple[Place, Any]]:
        """What a pass leaves: the solution, what is left of the equations, efforts of drivers."""
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
        """Whether something stands in for missing masses."""
        return bool(self.S.scales.semidefinite > 0.0)

    def refined(self, reads: dict[int, Place]) -> None:
        """A pass for what is left."""
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
            off, *sizes = remainder_schur(S, W, gamma, x, W.velocities.scratch_2, self.semidefinite)
        else:
            is_loaded = self.graph.symbol("loaded")
            reads[is_loaded.index] = ("W_flat", LOADED)
            f = np.array([choose(is_loaded, y, 0.0) for y in f] or [0.0], object)[: self.nv]
            off, *sizes = pass_coupled(S, W, f, gamma, x, lam, W.velocities.scratch_2, True)
        places = [("W_flat", k) for k in (ROW_SIZE, LOAD_RESIDUAL, LOAD_SIZE)]
        self.add("REFINE", reads, self.solution(x, lam) + list(zip(places, sizes, strict=True)), off)

    def drifted(self) -> None:
        """What is missing of the velocities' constraints."""
        out = np.array([0.0] * self.nr, object)
        worst, size = drift(self.S, self.W, self.v, out)
        stores = [(("b", k), x) for k, x in enumerate(out)] + [(("W_flat", TERMS), size)]
        self.add("DRIFT", self.given("a", self.v), stores, worst)
