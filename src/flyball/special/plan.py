"""Whether code can be made for a mechanism, by what it is known again, and what it will cost."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np

from ..compiler.sources import PACKAGE, TEXTS, compiled_files
from ..tables.specs import Structure
from ..tables.system import System, arrays
from ..tables.values import Values
from ..tracing.trace import TRACED, traced_arrays
from .machine import machine
from .recorder import PLAIN

MOST = 40_000
"""Operations, as estimated, up to which code is made: compiling takes seconds there, and grows faster than they."""
LOOKING, LOADING, MAKING, GROWING = 50e3, 3e6, 20e3, 3.5
"""What it costs to look a mechanism up, to load code from disk [ns]; to make an operation [ns], and more for each of
all others: 0.2 s for Andrews' mechanism, 1.8 s for the Stewart platform."""


@dataclass(frozen=True)
class Plan:
    """What is known before anything is made.

    Attributes
    ----------
    key : str
        The same for all mechanisms that the same code may serve: their structure, which entries of their tables are 0,
        1 or -1, the sources that all this comes from, the processor.
    size : int
        Estimated operations.
    refused : str
        Why no code is made for it, in words; empty if it is.
    """

    key: str
    size: int
    refused: str


def plan(x: Values) -> Plan:
    """Look at a mechanism; nothing is traced."""
    return x.kept.get("plan of made code", None, 1, lambda: _planned(x.structure, x.system))


def _planned(s: Structure, S: System) -> Plan:
    digest = hashlib.sha256(s.kept.get("code of structure", None, 1, lambda: _structure(s, S)))
    entries = np.concatenate([table.ravel() for table in traced_arrays(S).values()])
    for x in PLAIN:
        digest.update(np.packbits(entries == x).tobytes())
    size = estimate(S)
    why = ""
    if np.iscomplexobj(S.const):
        why = "its numbers are complex"
    elif s.controls:
        why = "states of controllers are for the tables"
    elif size > MOST:
        why = f"it would be some {size} operations, and is made up to {MOST}"
    return Plan(digest.hexdigest()[:32], size, why)


def estimate(S: System) -> int:
    """Operations of all procedures, from the tables' sizes (within a factor of two)."""
    return 30 * len(S.column) + 45 * len(S.ldl.Li) + 150 * len(S.frame_body) + 200 * len(S.tree.parent)


def _structure(s: Structure, S: System) -> bytes:
    """Hash of what parameters cannot change, of sources and processor."""
    digest = hashlib.sha256(machine().encode() + sources())
    digest.update(" ".join("" if x is None else x.content for x in (*s.force_code, *s.term_code)).encode())
    for name, a in arrays(S._replace(force_code=S.force_code != 0, term_code=S.term_code != 0)):
        number = name.partition(".")[0] in TRACED
        digest.update(f"{name} {a.shape} {a.dtype}".encode() + (b"" if number else np.ascontiguousarray(a).tobytes()))
    digest.update(f"{s.nq} {s.nv} {len(s.states)} {s.depth} {len(s.measured)} {len(s.loads)}".encode())
    return digest.digest()


@lru_cache(maxsize=1)
def sources() -> bytes:
    """Hash of all files that formulas come from, or that make code of them."""
    digest = hashlib.sha256()
    files: set[Path] = compiled_files()
    for room in ("graph", "tracing", "special"):
        files |= set((PACKAGE / room).rglob("*.py"))
    for path in sorted(files):
        digest.update(str(path.relative_to(PACKAGE)).encode() + path.read_bytes())
    for name, text in sorted(TEXTS.items()):
        digest.update(name.encode() + text.encode())
    return digest.digest()
