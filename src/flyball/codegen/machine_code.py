"""Machine code of one mechanism: translation of its procedures to LLVM text, its cost, and its cache.

Values that procedures share are computed once, by the first that needs them. Expressions of table entries only are
computed once for a `System` (they are stored after the addresses in `System.flat`); shared values that depend on the
state are stored in `Work.flat`. No pass of Numba is run. `Refused` states why a mechanism cannot be translated.

Code is cached in this process, and on disk beside the engine's (`compiler.object_files`), for other processes.
"""

from __future__ import annotations

import contextlib
import ctypes
import hashlib
import json
import threading
import time
from collections import OrderedDict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from ..compiler.formulas import GENERATED_SOURCES, PACKAGE, compiled_files
from ..compiler.object_code import LoadedCode, baseline, llvm_binding, object_code_of_text, target_triple
from ..compiler.object_files import HASH_DIGITS, cache_folder, mark_used, read_object, remove_oldest, write_object
from ..compiler.struct_layout import DATA, Struct, struct_layout
from ..expression_graph.graph import MULTIPLY, NUMBER, SYMBOL, Node, UndeterminedDecision, nodes_in_order
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
from ..tables.table_definitions import ARTICULATED, FIRST_FREE, FLAT, SAMPLED, SCRATCH, System, Work, named_arrays
from ..tables.values import Values
from .procedures import PLAIN_ENTRIES, MechanismProcedures

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


MAX_OPERATIONS = 40_000
"""Estimated operations up to which code is generated: its compilation takes seconds, and grows faster than linearly."""
LOOKUP_COST, LOAD_COST, OPERATION_COST, GROWTH_COST = 50e3, 3e6, 20e3, 3.5
"""Cost [ns] of finding code in memory, of loading it from disk, of compiling an operation, and its growth.

The cost of an operation grows with the number of operations. Compiling
takes 0.2 s for Andrews' mechanism, 1.8 s for the Stewart platform.
"""


@dataclass(frozen=True)
class Plan:
    """What is known before code is generated.

    Attributes
    ----------
    key : str
        The same for all mechanisms that the same code may serve: a hash of their structure, of the table entries
        that are 0, 1 or -1, of the sources, and of the processor.
    size : int
        Estimated operations.
    refused : str
        Why no code is generated, in words; empty if it is.
    """

    key: str
    size: int
    refused: str


def plan(x: Values) -> Plan:
    """Inspect a mechanism; nothing is traced."""
    return x.cache.get("plan of made code", None, 1, lambda: _planned(x.structure, x.system))


def _planned(s: Structure, S: System) -> Plan:
    digest = hashlib.sha256(s.cache.get("code of structure", None, 1, lambda: _structure(s, S)))
    entries = np.concatenate([table.ravel() for table in traced_arrays(S).values()])
    for x in PLAIN_ENTRIES:
        digest.update(np.packbits(entries == x).tobytes())
    size = estimate_operations(S)
    why = ""
    if np.iscomplexobj(S.const):
        why = "its numbers are complex"
    elif s.controls:
        why = "states of controllers are for the tables"
    elif size > MAX_OPERATIONS:
        why = f"it would be some {size} operations, and is made up to {MAX_OPERATIONS}"
    return Plan(digest.hexdigest()[:32], size, why)


def estimate_operations(S: System) -> int:
    """Operations of all procedures, from the tables' sizes (within a factor of two)."""
    return 30 * len(S.column) + 45 * len(S.ldl.Li) + 150 * len(S.frame_body) + 200 * len(S.tree.parent)


def _structure(s: Structure, S: System) -> bytes:
    """Hash of everything that parameters cannot change, of sources and processor."""
    digest = hashlib.sha256(target_description().encode() + sources_digest())
    digest.update(" ".join("" if x is None else x.content for x in (*s.force_code, *s.term_code)).encode())
    for name, a in named_arrays(
        S._replace(force_code=S.force_code != 0, term_code=S.term_code != 0, guard_code=S.guard_code != 0)
    ):
        number = name.partition(".")[0] in TRACED_TABLES
        digest.update(f"{name} {a.shape} {a.dtype}".encode() + (b"" if number else np.ascontiguousarray(a).tobytes()))
    digest.update(f"{s.nq} {s.nv} {len(s.states)} {s.depth} {len(s.measured)} {len(s.loads)}".encode())
    return digest.digest()


@lru_cache(maxsize=1)
def sources_digest() -> bytes:
    """Hash of all source files of formulas and of the code generator."""
    digest = hashlib.sha256()
    files: set[Path] = compiled_files() | {PACKAGE / "compiler/object_code.py"}
    for folder in ("codegen", "expression_graph"):
        files |= set((PACKAGE / folder).rglob("*.py"))
    for path in sorted(files):
        digest.update(str(path.relative_to(PACKAGE)).encode() + path.read_bytes())
    for name, text in sorted(GENERATED_SOURCES.items()):
        digest.update(name.encode() + text.encode())
    return digest.digest()


IN_MEMORY = 64  # codes that a process caches
STORED_FIELDS = ("scratch", "constants", "operations", "laws", "seconds", "known")
"""Metadata of the code in a file."""
_LOCK = threading.RLock()
_found: OrderedDict[tuple[str, str], GeneratedCode] = OrderedDict()
_refused: dict[str, str] = {}
_nowhere: dict[str, int] = {}  # key -> modification time of the folder when the code was not on disk


def ready() -> bool:
    """Whether this process has any generated code."""
    return bool(_found)


def can_store() -> bool:
    """Whether code can be stored on disk for other processes."""
    return _folder() is not None


def known(p: Plan, x: Values) -> str:
    """Location of the code for a mechanism: "memory", "disk", or "" (none)."""
    if in_memory(p, x) is not None:
        return "memory"
    folder = _folder()
    if folder is None or _nowhere.get(p.key) == (changed := folder.stat().st_mtime_ns):
        return ""
    if any(True for _ in _fitting(p, x.system)):
        return "disk"
    _nowhere[p.key] = changed
    return ""


def refusal(p: Plan) -> str:
    """Reason why no code is generated, as far as known; empty if there is none."""
    return p.refused or _refused.get(p.key, "")


def price(p: Plan, where: str) -> float:
    """Estimated cost of obtaining the code [ns], from counts and not from measured time."""
    return {"memory": LOOKUP_COST, "disk": LOAD_COST}.get(where, p.size * (OPERATION_COST + GROWTH_COST * p.size))


def code(p: Plan, x: Values) -> tuple[GeneratedCode, str]:
    """Code for a mechanism, and its origin in words.

    Raises
    ------
    Refused
        If no code is generated for it.
    """
    if why := refusal(p):
        raise Refused(why)
    with _LOCK:
        if (found := in_memory(p, x)) is not None:
            return found, "kept in this process"
        if (found := _on_disk(p, x.system)) is not None:
            return found, "found on disk"
        found = _generate(p, x)
        return found, f"made now in {found.seconds:.1f} s"


def _generate(p: Plan, x: Values) -> GeneratedCode:
    begun = time.process_time()
    try:
        text = trace_procedures(x.structure, x.system)
    except Refused as error:
        _refused[p.key] = str(error)
        raise
    machine_code = object_code_of_text(text.text)
    seconds = time.process_time() - begun
    told = (text.scratch, text.constants, text.operations, text.laws, seconds, text.known)
    made = GeneratedCode(LoadedProcedures(machine_code, text.laws), *told)
    _keep_in_memory(p, x.system, made)
    _write(p, digest(x.system, made.known), dict(zip(STORED_FIELDS, told, strict=True)), machine_code)
    return made


def digest(S: System, entries: list[Entry]) -> str:
    """Hash of the values of some entries of the tables, to the last bit."""
    tables = traced_arrays(S) if entries else {}
    values = np.array([tables[name].ravel()[k] for name, k in entries], float)
    return hashlib.sha256(repr(entries).encode() + values.tobytes()).hexdigest()[:HASH_DIGITS]


def in_memory(p: Plan, x: Values) -> GeneratedCode | None:
    """Code for a mechanism from this process's cache."""
    for key, made in list(_found.items()):
        if key[0] == p.key and key[1] == digest(x.system, made.known):
            return made
    return None


def _keep_in_memory(p: Plan, S: System, generated: GeneratedCode) -> None:
    _found[p.key, digest(S, generated.known)] = generated
    while len(_found) > IN_MEMORY:
        _found.popitem(last=False)


# -- on disk


def _folder() -> Path | None:
    return cache_folder()


def _files(p: Plan) -> list[Path]:
    folder = _folder()
    return sorted(folder.glob(f"made-{p.key}-*.o")) if folder is not None else []


def _fitting(p: Plan, S: System) -> Iterator[tuple[dict[str, Any], bytes]]:
    """Metadata and code of the files that fit a mechanism."""
    for path in _files(p):
        if (data := read_object(path)) is not None:
            text, _, machine_code = data.partition(b"\n")
            told = json.loads(text)
            told["known"] = [(str(name), int(k)) for name, k in told["known"]]
            if path.stem.rpartition("-")[2] == digest(S, told["known"]):
                mark_used(path)
                yield told, machine_code


def _on_disk(p: Plan, S: System) -> GeneratedCode | None:
    for told, machine_code in _fitting(p, S):
        with contextlib.suppress(RuntimeError):  # LLVM's error for invalid code
            made = GeneratedCode(LoadedProcedures(machine_code, told["laws"]), *(told[k] for k in STORED_FIELDS))
            _keep_in_memory(p, S, made)
            return made
    return None


def _write(p: Plan, of: str, fields: dict[str, Any], machine_code: bytes) -> None:
    """Store code for other processes; a failure costs only time."""
    folder = _folder()
    if folder is None:
        return
    with contextlib.suppress(OSError):
        write_object(folder / f"made-{p.key}-{of}.o", json.dumps(fields).encode() + b"\n" + machine_code)
        remove_oldest(folder)
