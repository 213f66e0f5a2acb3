"""Code that has been made: in this process, and on disk beside the engine's, for others (`compiler.store`)."""

from __future__ import annotations

import contextlib
import hashlib
import json
import threading
import time
from collections import OrderedDict
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from ..compiler.store import DIGITS, cache_folder, read, remove_oldest, touch, write
from ..tables.system import System
from ..tables.values import Values
from ..tracing.trace import traced_arrays
from .machine import Loaded, assembled
from .made import Made
from .plan import GROWING, LOADING, LOOKING, MAKING, Plan
from .trace import Entry, Refused, traced

IN_MEMORY = 64  # codes that a process keeps
TOLD = ("scratch", "constants", "operations", "laws", "seconds", "known")
"""What a file says of its code."""
_LOCK = threading.RLock()
_found: OrderedDict[tuple[str, str], Made] = OrderedDict()
_refused: dict[str, str] = {}
_nowhere: dict[str, int] = {}  # of what was not on disk, when the folder had last been changed


def ready() -> bool:
    """Whether this process has any such code."""
    return bool(_found)


def kept() -> bool:
    """Whether code can be left on disk for other processes."""
    return _folder() is not None


def known(p: Plan, x: Values) -> str:
    """Where code for a mechanism is: "memory", "disk", or "" (nowhere)."""
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
    """Why no code is made for it, as far as that is known; empty if nothing speaks against it."""
    return p.refused or _refused.get(p.key, "")


def price(p: Plan, where: str) -> float:
    """What it costs to have the code [ns], by counts: never by a clock."""
    return {"memory": LOOKING, "disk": LOADING}.get(where, p.size * (MAKING + GROWING * p.size))


def code(p: Plan, x: Values) -> tuple[Made, str]:
    """The code for a mechanism, and where it comes from, in words.

    Raises
    ------
    Refused
        If none is made for it.
    """
    if why := refusal(p):
        raise Refused(why)
    with _LOCK:
        if (found := in_memory(p, x)) is not None:
            return found, "kept in this process"
        if (found := _on_disk(p, x.system)) is not None:
            return found, "found on disk"
        found = _made(p, x)
        return found, f"made now in {found.seconds:.1f} s"


def _made(p: Plan, x: Values) -> Made:
    begun = time.process_time()
    try:
        text = traced(x.structure, x.system)
    except Refused as error:
        _refused[p.key] = str(error)
        raise
    machine_code = assembled(text.text)
    seconds = time.process_time() - begun
    told = (text.scratch, text.constants, text.operations, text.laws, seconds, text.known)
    made = Made(Loaded(machine_code, text.laws), *told)
    _remember(p, x.system, made)
    _write(p, digest(x.system, made.known), dict(zip(TOLD, told, strict=True)), machine_code)
    return made


def digest(S: System, entries: list[Entry]) -> str:
    """Hash of the values of some entries of the tables, to the last bit."""
    tables = traced_arrays(S) if entries else {}
    values = np.array([tables[name].ravel()[k] for name, k in entries], float)
    return hashlib.sha256(repr(entries).encode() + values.tobytes()).hexdigest()[:DIGITS]


def in_memory(p: Plan, x: Values) -> Made | None:
    """The code for a mechanism that this process has."""
    for key, made in list(_found.items()):
        if key[0] == p.key and key[1] == digest(x.system, made.known):
            return made
    return None


def _remember(p: Plan, S: System, made: Made) -> None:
    _found[p.key, digest(S, made.known)] = made
    while len(_found) > IN_MEMORY:
        _found.popitem(last=False)


# -- on disk


def _folder() -> Path | None:
    return cache_folder()


def _files(p: Plan) -> list[Path]:
    folder = _folder()
    return sorted(folder.glob(f"made-{p.key}-*.o")) if folder is not None else []


def _fitting(p: Plan, S: System) -> Iterator[tuple[dict[str, Any], bytes]]:
    """What files say that may serve a mechanism, and their code."""
    for path in _files(p):
        if (data := read(path)) is not None:
            text, _, machine_code = data.partition(b"\n")
            told = json.loads(text)
            told["known"] = [(str(name), int(k)) for name, k in told["known"]]
            if path.stem.rpartition("-")[2] == digest(S, told["known"]):
                touch(path)
                yield told, machine_code


def _on_disk(p: Plan, S: System) -> Made | None:
    for told, machine_code in _fitting(p, S):
        with contextlib.suppress(RuntimeError):  # LLVM's, of wrong code
            made = Made(Loaded(machine_code, told["laws"]), *(told[k] for k in TOLD))
            _remember(p, S, made)
            return made
    return None


def _write(p: Plan, of: str, told: dict[str, Any], machine_code: bytes) -> None:
    """Leave it for others; where that cannot be, nothing is lost but time."""
    folder = _folder()
    if folder is None:
        return
    with contextlib.suppress(OSError):
        write(folder / f"made-{p.key}-{of}.o", json.dumps(told).encode() + b"\n" + machine_code)
        remove_oldest(folder)
