"""What procedures hand on to each other: each number is reckoned once, by the first that needs it.

Expressions of the tables' entries alone are reckoned once for a `System` (they stand behind the addresses in
`System.flat`); what moves and a later procedure needs is left in `Work.flat`.
"""

from __future__ import annotations

from typing import Any

from ..graph.node import Node
from ..graph.operations import MULTIPLY, NUMBER, SYMBOL
from ..graph.printers.llvm import Place, Procedure
from ..graph.printers.llvm_order import operations
from ..graph.printers.llvm_spline import Head, asked, head
from ..tables.system import ARTICULATED, FIRST_FREE, FLAT
from .stages import Stages

BEFORE: dict[str, tuple[str, ...]] = {
    "MOVE": ("PLACE",),
    "LOADS": ("PLACE", "MOVE"),
    "FINISH": ("PLACE", "MOVE"),
} | dict.fromkeys(("FACTOR", "REUSE", "STEP", "STEP_UNLOADED", "REFINE", "DRIFT"), ("PLACE",))
"""Procedures that have run, at this state, when another one does."""
LEFT = ("W_G", "W_FK")
"""Arrays that nobody writes to but the procedures."""
ENTRIES = (
    "SCRATCH", "PREPARE", "PLACE", "MOVE", "LOADS", "FACTOR", "REUSE", "STEP", "STEP_UNLOADED", "REFINE", "FINISH",
    "DRIFT", "SHOW", "SAMPLED",
)  # fmt: skip
"""Entries of `System.flat` by name; the first is a length, the last a number of an entry; all others are addresses."""


class Linked:
    """The procedures with all that they read and leave.

    Attributes
    ----------
    procedures : list of Procedure
        ``CONSTANTS`` first, which fills in what stands behind the addresses.
    constants, scratch : int
        Numbers behind the addresses in `System.flat`; length of `Work.flat`.
    """

    def __init__(self, stages: Stages) -> None:
        self.stages = stages
        self.slots: dict[int, Place] = {}
        self.scratch = FIRST_FREE
        self.hoisted: list[Node] = []
        self.reckoned: dict[str, set[int]] = {}
        self.searched: dict[str, set[tuple[Head, int] | None]] = {}
        made = stages.procedures
        before = dict(BEFORE)
        if stages.S.sizes.solver == ARTICULATED:
            before["STEP"] = before["STEP_UNLOADED"] = ("PLACE", "FACTOR")
        self.laws = stages.laws
        for name in (*ENTRIES, *filter(None, self.laws)):
            if name in made:
                self._link(made[name], [made[k] for k in before.get(name, ())])
        stores: list[tuple[Place, Any]] = [(("a", k), x) for k, x in enumerate(self.hoisted)]
        constants = Procedure("CONSTANTS", stages.constants, stores)
        self.constants = len(self.hoisted)
        self.procedures = [constants, *made.values()]

    def _link(self, p: Procedure, before: list[Procedure]) -> None:
        reads = dict(p.reads)
        to_see = [x for x in p.results if isinstance(x, Node)]
        seen = set()
        while to_see:
            x = to_see.pop()
            if x.index in seen or x.index in reads or x.op == NUMBER:
                continue
            seen.add(x.index)
            if not x.moving:
                reads[x.index] = self._constant(x)
                continue
            found = None if _is_multiple(x) else self._left(x, before)
            if found is not None:
                reads[x.index] = found
                continue
            if x.op == SYMBOL:
                raise KeyError(f"{p.name} needs {x!r}, and nobody has left it")
            to_see.extend(x.args)
        p.reads = reads
        made = operations(p.results, reads)
        self.reckoned[p.name] = {x.index for x in made}
        self.searched[p.name] = {_search(x) for x in made if x.index not in reads} - {None}
        for place, x in p.stores:
            if place[0] in LEFT and isinstance(x, Node) and x.moving:
                self.slots.setdefault(x.index, place)

    def _constant(self, x: Node) -> Place:
        if x.index not in self.slots:
            self.slots[x.index] = ("S_flat", FLAT + len(self.hoisted))
            self.hoisted.append(x)
        return self.slots[x.index]

    def _left(self, x: Node, before: list[Procedure]) -> Place | None:
        for p in before:
            here = x.index in self.reckoned[p.name] or (x.op == SYMBOL and x.index in p.reads)
            if here or _search(x) in self.searched[p.name]:  # where the piece is known, another order costs nothing
                if x.index not in self.slots:
                    self.slots[x.index] = ("W_flat", self.scratch)
                    self.scratch += 1
                    p.stores.append((self.slots[x.index], x))
                    self.reckoned[p.name].add(x.index)
                return self.slots[x.index]
        return None


def _is_multiple(x: Node) -> bool:
    return x.op == MULTIPLY and x.args[0].op == NUMBER


def _search(x: Node) -> tuple[Head, int] | None:
    """Which piece of a spline an operation needs: breaks, and the number of the argument."""
    spline = asked(x.data)
    return None if spline is None or not isinstance(x.args[0], Node) else (head(spline[0]), x.args[0].index)
