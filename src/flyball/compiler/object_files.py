"""Files of object code: those shipped with flyball, and those compiled on this machine.

A file is identified by its content: a hash of the sources of the kernel, the layouts of its parameters and the target
processor. Files shipped with flyball are searched first, then those compiled on this machine.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import re
import sys
import tempfile
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple

from ..errors import PerformanceNotice, warn_user
from .announcements import announce_compilation
from .formulas import ENTRY_NAME, PACKAGE
from .object_code import LoadedCode, baseline, compile_kernel, target_triple

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
    text = f"{kernel.name} {kernel.first_order} ({layouts}) {target_triple()} {cpu} {kernel.content}"
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
