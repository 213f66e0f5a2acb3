"""Translation of one mechanism's procedures to LLVM text, machine code and addresses.

Values that procedures share are computed once, by the first that needs them. Expressions of table entries only are
computed once for a `System` (they are stored after the addresses in `System.flat`); shared values that depend on the
state are stored in `Work.flat`. No pass of Numba is run. The object code is stored on disk. `Refused` states why a
mechanism cannot be translated.
"""

from __future__ import annotations

import ctypes
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from ..compiler.object_code import LoadedCode, baseline, llvm_binding, target_triple
from ..compiler.struct_layout import DATA, Struct, struct_layout
from ..expression_graph.evaluation import nodes_in_order
from ..expression_graph.graph import MULTIPLY, NUMBER, SYMBOL, Node, UndeterminedDecision
from ..expression_graph.printers.llvm import (
    Module,
    Place,
    Procedure,
    SearchKey,
    UnsupportedOperation,
    ordered_operations,
    search_key,
    spline_of,
)
from ..expression_graph.tracing import TRACED_TABLES, traced_arrays
from ..tables.structure_definition import Structure
from ..tables.table_definitions import ARTICULATED, FIRST_FREE, FLAT, SAMPLED, SCRATCH, System, Work
from .procedures import MechanismProcedures

PREDECESSORS: dict[str, tuple[str, ...]] = {
    "MOVE": ("PLACE",),
    "LOADS": ("PLACE", "MOVE"),
    "FINISH": ("PLACE", "MOVE"),
} | dict.fromkeys(("FACTOR", "REUSE", "STEP", "STEP_UNLOADED", "REFINE", "DRIFT"), ("PLACE",))
"""Procedures that have run, at this state, before another one does."""
SHARED_ARRAYS = ("W_G", "W_frames")
"""Arrays that only the procedures write to."""
ENTRIES = (
    "SCRATCH", "PREPARE", "PLACE", "MOVE", "LOADS", "FACTOR", "REUSE", "STEP", "STEP_UNLOADED", "REFINE", "FINISH",
    "DRIFT", "SHOW", "SAMPLED",
)  # fmt: skip
"""Entries of `System.flat` by name; the first is a length, the last the index of an entry; all others are addresses."""


class LinkedProcedures:
    """The procedures with their inputs and outputs linked.

    Attributes
    ----------
    procedures : list of Procedure
        ``CONSTANTS`` first, which fills in the numbers behind the addresses.
    constants, scratch : int
        Numbers behind the addresses in `System.flat`; length of `Work.flat`.
    """

    def __init__(self, stages: MechanismProcedures) -> None:
        self.stages = stages
        self.slots: dict[int, Place] = {}
        self.scratch = FIRST_FREE
        self.hoisted: list[Node] = []
        self.computed: dict[str, set[int]] = {}
        self.searched: dict[str, set[tuple[SearchKey, int] | None]] = {}
        made = stages.procedures
        before = dict(PREDECESSORS)
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
        reads = dict(p.inputs)
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
            found = None if _is_multiple(x) else self._stored_place(x, before)
            if found is not None:
                reads[x.index] = found
                continue
            if x.op == SYMBOL:
                raise KeyError(f"{p.name} needs {x!r}, and nobody has left it")
            to_see.extend(x.args)
        p.inputs = reads
        made = ordered_operations(p.results, reads)
        self.computed[p.name] = {x.index for x in made}
        self.searched[p.name] = {_spline_search(x) for x in made if x.index not in reads} - {None}
        for place, x in p.stores:
            if place[0] in SHARED_ARRAYS and isinstance(x, Node) and x.moving:
                self.slots.setdefault(x.index, place)

    def _constant(self, x: Node) -> Place:
        if x.index not in self.slots:
            self.slots[x.index] = ("S_flat", FLAT + len(self.hoisted))
            self.hoisted.append(x)
        return self.slots[x.index]

    def _stored_place(self, x: Node, before: list[Procedure]) -> Place | None:
        for p in before:
            here = x.index in self.computed[p.name] or (x.op == SYMBOL and x.index in p.inputs)
            if (
                here or _spline_search(x) in self.searched[p.name]
            ):  # the piece is known, so another derivative order is cheap
                if x.index not in self.slots:
                    self.slots[x.index] = ("W_flat", self.scratch)
                    self.scratch += 1
                    p.stores.append((self.slots[x.index], x))
                    self.computed[p.name].add(x.index)
                return self.slots[x.index]
        return None


def _is_multiple(x: Node) -> bool:
    return x.op == MULTIPLY and x.args[0].op == NUMBER


def _spline_search(x: Node) -> tuple[SearchKey, int] | None:
    """Piece of a spline that an operation needs: key of the breaks, and index of the argument."""
    spline = spline_of(x.data)
    return None if spline is None or not isinstance(x.args[0], Node) else (search_key(spline[0]), x.args[0].index)


ARGUMENTS = "ptr %S, ptr %W, double %t, ptr %a, ptr %b, ptr %c, ptr %d"


@lru_cache(maxsize=1)
def array_offsets() -> dict[str, int]:
    """Offsets [bytes], in a `System` or `Work`, of the data addresses of their arrays."""
    return dict(_places(struct_layout(System), "S_", DATA)) | dict(_places(struct_layout(Work), "W_", DATA))


def _places(of: Struct, prefix: str, at: int) -> Iterator[tuple[str, int]]:
    for name, x in of.fields:
        if isinstance(x, Struct):
            yield from _places(x, f"{prefix}{name}_", at + of.offset(name))
        else:
            yield prefix + name, at + of.offset(name)


def llvm_text(linked: LinkedProcedures) -> str:
    """Text of the whole module."""
    module = Module(ARGUMENTS, _base_lines)
    for p in linked.procedures:
        module.add(p)
    return str(module)


def _base_lines(base: str) -> list[str]:
    """Lines that load the data address of an array into ``%base``."""
    if base in ("a", "b", "c", "d"):
        return []
    if base.startswith("C_"):  # a table of `CONSTANTS`, which gets their addresses in place of S
        at = 8 * _constant_arrays().index(base.removeprefix("C_"))
        holder = "S"
    else:
        at, holder = array_offsets()[base], base[0]
    return [
        f"%at_{base} = getelementptr i8, ptr %{holder}, i64 {at}",
        f"%{base} = load ptr, ptr %at_{base}, !invariant.load !0",
    ]


@lru_cache(maxsize=1)
def _constant_arrays() -> list[str]:
    """Names of the arrays whose addresses ``CONSTANTS`` gets, in order: see `table_addresses`."""
    numbers = {name: layout for name, layout in struct_layout(System).fields if name in TRACED_TABLES}
    fields = {name: [x for x, _ in of.fields] if isinstance(of, Struct) else [] for name, of in numbers.items()}
    return [full for name in TRACED_TABLES for full in [f"{name}.{x}" for x in fields[name]] or [name]]


@lru_cache(maxsize=1)
def target_description() -> str:
    """Description of the target: processor, versions."""
    import llvmlite

    return f"{target_triple()} {baseline()} {llvmlite.__version__} {llvm_binding().llvm_version_info}"


class LoadedProcedures:
    """Machine code in memory, valid as long as this object exists.

    Attributes
    ----------
    addresses : dict of str to int
        Of the procedures; 0 if there is none.
    """

    def __init__(self, code: bytes, laws: Sequence[str] = ()) -> None:
        self._code = LoadedCode(code)
        names = ("CONSTANTS", *ENTRIES[1:-1], *filter(None, laws))
        self.addresses = {name: self._code.address(name) for name in names}


def table_addresses(S: System) -> np.ndarray:
    """Addresses of the tables, for ``CONSTANTS``."""
    return np.array([x.ctypes.data for x in traced_arrays(S).values()], np.int64)


Entry = tuple[str, int]
"""A table, and the index of an entry in it."""


class Refused(Exception):
    """No code is generated for a mechanism; the message is the reason."""


@dataclass(frozen=True)
class ProgramText:
    """Generated code as text.

    Attributes
    ----------
    text : str
    known : list of Entry
        Table entries whose values are fixed in it, since a formula branches on them.
    scratch, constants, operations, laws
        As in `GeneratedCode`.
    """

    text: str
    known: list[Entry]
    scratch: int
    constants: int
    operations: int
    laws: list[str]


def trace_procedures(s: Structure, S: System) -> ProgramText:
    """Run the engine's loops on expressions, and translate them to text.

    Raises
    ------
    Refused
        If something cannot be expressed.
    """
    known: set[Entry] = set()
    try:
        while True:
            stages = MechanismProcedures(s, S, sorted(known))
            more = _deciding_entries(stages)
            if not more:
                break
            known |= more
        linked = LinkedProcedures(stages)
        count = sum(len(ordered_operations(p.results, p.inputs)) for p in linked.procedures)
        return ProgramText(llvm_text(linked), sorted(known), linked.scratch, linked.constants, count, linked.laws)
    except UndeterminedDecision as error:
        raise Refused(f"a formula of it decides by where it is ({error})") from error
    except UnsupportedOperation as error:
        raise Refused(f"it calls {error}, a Python function") from error


def _deciding_entries(stages: MechanismProcedures) -> set[Entry]:
    """Table entries that formulas have branched on."""
    nodes = [x for x in stages.graph if x.index in stages.graph.decided]
    found = (stages.constants.get(x.index) for x in nodes_in_order(nodes))
    return {(base.removeprefix("C_"), k) for base, k in filter(None, found)}


_FUNCTION = ctypes.CFUNCTYPE(ctypes.c_double, *[ctypes.c_void_p] * 2, ctypes.c_double, *[ctypes.c_void_p] * 4)


@dataclass(frozen=True)
class GeneratedCode:
    """Code for one structure.

    Attributes
    ----------
    loaded : LoadedProcedures
        The machine code.
    scratch, constants : int
        Length of `Work.flat`; numbers that are computed once for a `System`.
    operations : int
        Compiled operations of all procedures.
    laws : list of str
        Procedures of the laws that may act briefly within a step, in the order of `pulse_detection.law_at`; "" for
        the others.
    seconds : float
        Processor time of tracing and compiling [s].
    known : list of Entry
        Table entries whose values are fixed in the code.
    """

    loaded: LoadedProcedures
    scratch: int
    constants: int
    operations: int
    laws: list[str]
    seconds: float
    known: list[Entry]

    def system(self, S: System) -> System:
        """Tables with the addresses in them; the array of addresses keeps the code in memory."""
        first = FLAT + self.constants
        memory = (ctypes.c_int64 * (first + len(self.laws)))()
        memory.code = self.loaded  # type: ignore[attr-defined]
        flat = np.frombuffer(memory, np.int64)  # type: ignore[call-overload]
        flat[SCRATCH] = self.scratch
        for k, name in enumerate(ENTRIES[1:-1], 1):
            flat[k] = self.loaded.addresses[name]
        if self.laws:
            flat[SAMPLED] = first
            flat[first:] = [self.loaded.addresses[name] if name else 0 for name in self.laws]
        S = S._replace(flat=flat)
        tables = table_addresses(S)
        constants = flat.ctypes.data + 8 * FLAT
        _FUNCTION(self.loaded.addresses["CONSTANTS"])(tables.ctypes.data, None, 0.0, constants, None, None, None)
        return S
