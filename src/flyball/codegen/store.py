"""Whether code can be generated for a mechanism, its key, its cost, and its cache in memory and on disk.

Code is cached in this process, and on disk beside the engine's (`compiler.object_files`), for other processes.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import threading
import time
from collections import OrderedDict
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from ..compiler.formulas import GENERATED_SOURCES, PACKAGE, compiled_files
from ..compiler.object_code import object_code_of_text
from ..compiler.object_files import (
    HASH_DIGITS,
    cache_folder,
    mark_used,
    read_object,
    remove_oldest,
    write_object,
)
from ..expression_graph.tracing import TRACED_TABLES, traced_arrays
from ..tables.structure_definition import Structure
from ..tables.table_definitions import System, named_arrays
from ..tables.values import Values
from .machine_code import (
    Entry,
    GeneratedCode,
    LoadedProcedures,
    Refused,
    target_description,
    trace_procedures,
)
from .procedures import PLAIN_ENTRIES

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
