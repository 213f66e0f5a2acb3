"""Symbols for what code reads, places for what it writes, and the procedures made of both."""

from __future__ import annotations

from collections.abc import Sequence
from functools import reduce
from typing import Any

import numpy as np

from ..equations.rows import measured
from ..equations.scratch import work
from ..graph.node import Graph, Node, Symbol
from ..graph.printers.llvm import Place, Procedure
from ..tables.specs import Structure
from ..tables.system import System, Work, with_numbers
from ..tracing.trace import TRACED

PLAIN = (0.0, 1.0, -1.0)  # entries of tables that the code may know
SOLVES = (
    "STEP",
    "STEP_UNLOADED",
    "REFINE",
    "DRIFT",
)  # best in the order in which they are made


def symbols(S: System, graph: Graph, known: Sequence[tuple[str, int]] = ()) -> tuple[System, dict[int, Place]]:
    """The tables with symbols in them, and where each stands; entries that are ``known`` are numbers."""
    places: dict[int, Place] = {}
    told = set(known)

    def with_symbols(name: str, table: np.ndarray) -> np.ndarray:
        out = np.empty(table.shape, object)
        for k, x in enumerate(table.ravel().tolist()):
            law_zero = name == "const" and x == 0.0  # 0 sqrt(x) has no value where sqrt(x) has none
            if (x in PLAIN and not law_zero) or (name, k) in told:
                out.ravel()[k] = x
                continue
            node = graph.symbol(Symbol(f"{name}[{k}]", "parameter"), x)
            places[node.index] = (f"C_{name}", k)
            out.ravel()[k] = node
        return out

    return with_numbers(S, with_symbols, TRACED), places


class Recorder:
    """What of the engine's arrays is an expression, and where each stands.

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
        self.S, self.constants = symbols(S, self.graph, known)
        self.W: Work = work(s, self.S, dtype=object)
        self.nv, self.nr, self.nm = s.nv, len(S.rows.law), measured(S)
        self.procedures: dict[str, Procedure] = {}
        self.t = self.graph.symbol("t")
        self.q, self.v = self.numbered("q", s.nq), self.numbered("v", s.nv)
        self.z = self.numbered("z", len(s.states))

    def numbered(self, name: str, n: int) -> np.ndarray:
        """Symbols that are called by their numbers."""
        out = np.zeros(n, object)
        out[:] = [self.graph.symbol(f"{name}[{k}]") for k in range(n)]
        return out

    def array(self, name: str) -> np.ndarray:
        """An array of `Work`, by its name: ``"rows.gamma"``."""
        found: Any = reduce(getattr, name.split("."), self.W)
        return found  # type: ignore[no-any-return]

    def at(self, name: str, *index: int) -> Place:
        """Where an entry of an array of `Work` stands."""
        array = self.array(name)
        return f"W_{name.replace('.', '_')}", index[0] if array.ndim == 1 else index[0] * array.shape[1] + index[1]

    def fresh(self, name: str, row: int | None, columns: Sequence[int]) -> dict[int, Place]:
        """Put symbols into an array of `Work`, or a row of it, in place of what is there; where they are read."""
        reads = {}
        array = self.array(name)
        for c in columns:
            index = (c,) if row is None else (row, c)
            node = self.graph.symbol(f"W.{name}[{', '.join(map(str, index))}]")
            array[index] = node
            reads[node.index] = self.at(name, *index)
        return reads

    def again(self, name: str) -> dict[int, Place]:
        """Symbols in place of what is no number in an array of one dimension: it is read from there."""
        array = self.array(name)
        reads = {}
        for e, x in enumerate(array):
            if isinstance(x, Node) and not x.known:
                array[e] = self.graph.symbol(f"W.{name}[{e}]")
                reads[array[e].index] = self.at(name, e)
        return reads

    def stored(self, name: str, row: int | None, columns: Sequence[int]) -> list[tuple[Place, Any]]:
        """What stands in an array of `Work`, or in a row of it, to be written there."""
        array = self.array(name)
        return [(self.at(name, *i), array[i]) for i in ((c,) if row is None else (row, c) for c in columns)]

    def kept(self, name: str) -> list[tuple[Place, Any]]:
        """A whole array of one dimension, to be written."""
        return [(self.at(name, e), x) for e, x in enumerate(self.array(name))]

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

    @property
    def driven(self) -> list[int]:
        """Velocities that drivers prescribe."""
        return self.S.tree.v[self.S.tree.law >= 0].tolist()
