"""Files of object code: those shipped with flyball, and those compiled on this machine; announcement of compilations.

A file is identified by its content: a hash of the sources of the kernel, the layouts of its parameters and the target
processor. Files shipped with flyball are searched first, then those compiled on this machine.

A long compilation is announced with the duration that is expected on this machine under its present load.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import re
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from functools import lru_cache
from pathlib import Path
from threading import Lock
from typing import Any, NamedTuple

from ..errors import PerformanceNotice, warn_user
from .formulas import ENTRY_NAME, PACKAGE
from .object_code import LoadedCode, baseline, compile_kernel, start_compiler, target_triple

NOTICE_PREFIX = "compiling for this machine, once: "
NUMBA_IMPORT_SECONDS = 0.25
"""Seconds to import Numba on the machine on which `COSTS` were measured."""
COSTS: dict[str, tuple[str, float]] = {
    "engine": ("the equations of motion", 26.6),
    "residuals_kernel": ("the derivatives of the equations", 15.0),
    "radau_steps": ("the Radau method", 9.5),
    "alpha_steps": ("the generalised-alpha method", 6.0),
    "variational_steps": ("the variational method", 4.0),
    "event_loop_kernel": ("the search for events", 8.7),
    "mode_kernel": ("what happens at events", 3.2),
    "explicit_steps": ("explicit methods", 2.1),
    "variation_kernel": ("sensitivities of motions", 4.5),
    "record_motion_kernel": ("energies and errors of motions", 1.1),
    "batch_kernel": ("recursive dynamics", 5.0),
    "between": ("contact of all shapes", 9.0),
    "between_convex": ("contact of convex shapes", 2.3),
    "between_planar": ("contact in the plane", 1.3),
    "search": ("the search for contacts", 5.6),
    "step_loop_kernel": ("time stepping with contact", 7.7),
    "mechanism_kernel": ("mechanisms in time stepping", 7.9),
    "newton": ("the contact solver", 5.8),
    "gauss_seidel": ("the contact solver by sweeps", 3.5),
    "block_kernel": ("the contact solver by sweeps", 3.0),
    "contact_kernel": ("time stepping with contact", 2.5),
    "admm": ("the contact solver admm", 7.7),
    "apgd": ("the contact solver apgd", 6.4),
    "barzilai_borwein": ("the contact solver barzilai-borwein", 2.7),
    "jacobi": ("the contact solver jacobi", 2.9),
    "scaled_apgd": ("the contact solver apgd-lean", 2.8),
    "solve_dense_kernel": ("contact forces at rest", 3.8),
    "auto": ("the choice of contact solvers", 1.8),
    "group_guard_kernel": ("forces that are shared", 2.1),
    "margin_kernel": ("forces that are shared", 1.7),
    "distribute_forces_kernel": ("forces that are shared", 2.1),
    "dependencies_kernel": ("dependent constraints", 1.6),
    "sampled_kernel": ("sampled controllers", 1.2),
    "sampled_steps_kernel": ("sampled controllers", 1.5),
    "largest_margin_kernel": ("forces that are shared", 1.3),
    "pyramid": ("the contact solver of pyramids", 1.7),
    "lcp": ("the contact solver by pivoting", 3.0),
}
"""Description of each kernel, and the seconds of its compilation on that machine, without the import of Numba."""
DEFAULT_COST = ("part of the numerics", 0.5)

_compile_spans: list[tuple[float, float]] = []
_spans_lock = Lock()
_scale: list[float] = []  # processor time of compilation here, relative to the reference machine


@contextmanager
def announce_compilation(kernel: Any) -> Iterator[None]:
    """Announce the compilation of a kernel and its expected duration, from previous ones; record the time."""
    began = time.perf_counter()
    if not _scale:
        start_compiler()
        _scale.append((time.perf_counter() - began) / NUMBA_IMPORT_SECONDS)
    what, seconds = COSTS.get(kernel.__qualname__, DEFAULT_COST)
    if seconds * _scale[-1] >= 1.0:
        warn_user(f"{NOTICE_PREFIX}{what}, about {_rounded_seconds(seconds * _scale[-1])} s", PerformanceNotice)
    try:
        yield
    finally:
        with _spans_lock:
            _compile_spans.append((began, time.perf_counter()))
        took = time.perf_counter() - began
        if seconds >= 1.0:
            _scale.append(took / seconds)


def compiled_since(begin: float) -> float:
    """Seconds since ``begin`` (of `time.perf_counter`) during which this process compiled."""
    with _spans_lock:
        return sum(max(0.0, b - max(a, begin)) for a, b in _compile_spans if b > begin)


def _rounded_seconds(seconds: float) -> int:
    return 5 * max(1, round(seconds / 5)) if seconds > 7.5 else max(1, round(seconds))


FILE_MARK = b"flyball object code 1\n"
HASH_DIGITS = 24  # digits of the hash in the name of a file
SHIPPED = PACKAGE / "objects"
"""Object code shipped with this installation."""
MAX_FOLDER_BYTES = 500_000_000  # size of all files in the user's folder; those used last are kept


class LoadedKernel(NamedTuple):
    """A kernel's code in memory."""

    address: int
    code: Any  # freed with this object
    origin: str  # "shipped", "cache" or "compiled"


def code_of(kernel: Any) -> LoadedKernel:
    """Code of a kernel: loaded, or compiled now and stored."""
    for origin, folder in object_folders():
        path = folder / file_name(kernel, baseline())
        if (code := read_object(path)) is not None:
            if origin == "cache":
                mark_used(path)
            with contextlib.suppress(RuntimeError):  # LLVM's error for code of another machine
                return _load(code, origin)
    with announce_compilation(kernel):
        (code,) = compile_kernel(kernel, (baseline(),))
    store_object(kernel, code)
    return _load(code, "compiled")


def is_stored(kernel: Any) -> bool:
    """Whether a kernel's code is in a file."""
    return any((folder / file_name(kernel, baseline())).is_file() for _, folder in object_folders())


def _load(code: bytes, origin: str) -> LoadedKernel:
    made = LoadedCode(code)
    return LoadedKernel(made.address(ENTRY_NAME), made, origin)


def object_folders() -> list[tuple[str, Path]]:
    """Folders that are searched for files."""
    cache = cache_folder()
    return [("shipped", SHIPPED), *([("cache", cache)] if cache is not None else [])]


@lru_cache(maxsize=1)
def cache_folder() -> Path | None:
    """User's folder for compiled code: ``FLYBALL_CACHE``, else the system's cache folder; None if there is none."""
    given = os.environ.get("FLYBALL_CACHE")
    if given:
        root = Path(given)
    elif sys.platform == "win32":
        root = Path(os.environ.get("LOCALAPPDATA", Path.home())) / "flyball"
    elif sys.platform == "darwin":
        root = Path.home() / "Library/Caches/flyball"
    else:
        root = Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache")) / "flyball"
    try:
        root.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=root):
            return root
    except OSError as error:
        warn_user(
            f"compiled code cannot be kept in {root} ({error.strerror}): each process compiles. FLYBALL_CACHE names "
            f"another folder",
            PerformanceNotice,
        )
        return None


def file_name(kernel: Any, cpu: str) -> str:
    """Name of the file of a kernel's code."""
    name = re.sub(r"\W+", "_", kernel.function.__qualname__)
    return f"{name}-{content_key(kernel, cpu)}.o"


def content_key(kernel: Any, cpu: str) -> str:
    """Hash of everything a kernel's code depends on."""
    layouts = ", ".join(str(x) for x in kernel.parameters)
    text = (
        f"{kernel.name} {kernel.first_order} {kernel.vectorised} ({layouts}) {target_triple()} {cpu} {kernel.content}"
    )
    return hashlib.sha256(text.encode()).hexdigest()[:HASH_DIGITS]


def read_object(path: Path) -> bytes | None:
    """Content of a file after its header; None if there is none, or it is damaged."""
    try:
        data = path.read_bytes()
    except OSError:
        return None
    head, digest, code = data[: len(FILE_MARK)], data[len(FILE_MARK) : len(FILE_MARK) + 64], data[len(FILE_MARK) + 64 :]
    return code if head == FILE_MARK and hashlib.sha256(code).hexdigest().encode() == digest else None


def write_object(path: Path, code: bytes) -> None:
    """Write a file atomically.

    Raises
    ------
    OSError
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    handle, name = tempfile.mkstemp(dir=path.parent, suffix=".part")
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(FILE_MARK + hashlib.sha256(code).hexdigest().encode() + code)
        Path(name).replace(path)
    except OSError:
        Path(name).unlink(missing_ok=True)
        raise


def store_object(kernel: Any, code: bytes) -> None:
    """Store code for other processes; warn if that is impossible."""
    folder = cache_folder()
    if folder is None:
        return
    try:
        write_object(folder / file_name(kernel, baseline()), code)
    except OSError as error:
        warn_user(f"compiled code cannot be kept in {folder}: {error.strerror}", PerformanceNotice)
        return
    remove_oldest(folder)


def mark_used(path: Path) -> None:
    """Mark a file of the user's folder as used."""
    with contextlib.suppress(OSError):
        path.touch()


def remove_oldest(folder: Path) -> None:
    """Remove the least recently used files beyond `MAX_FOLDER_BYTES`; other processes may do the same meanwhile."""
    total = 0
    with contextlib.suppress(OSError):
        found = [(path.stat(), path) for path in folder.glob(f"*-{'[0-9a-f]' * HASH_DIGITS}.o")]
        for status, path in sorted(found, key=lambda x: x[0].st_mtime, reverse=True):
            total += status.st_size
            if total > MAX_FOLDER_BYTES:
                path.unlink()
