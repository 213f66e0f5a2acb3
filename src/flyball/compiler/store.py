"""Files of object code: those that came with flyball, and those that this user's machine has made.

A file is known by its content: a hash of the sources that the kernel is made of, of the layouts of its parameters and
of the processor that it is for. It says of itself what it is; one that is damaged, or of anything else, is not used.
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

from ..errors import PerformanceNotice, warn
from .machine import LoadedCode, baseline, triple
from .notice import announce, note_compiled
from .sources import PACKAGE

MARK = b"flyball object code 1\n"
DIGITS = 24  # of the hash in the name of a file
SHIPPED = PACKAGE / "objects"
"""Object code that came with this installation."""
MOST = 500_000_000  # bytes of all files in the user's folder; those used last stay


class Loaded(NamedTuple):
    """A kernel's code in memory."""

    address: int
    code: Any  # which is freed with this
    origin: str  # "shipped", "cache" or "compiled"


def code_of(kernel: Any) -> Loaded:
    """The code of a kernel: found, or compiled now and kept."""
    for origin, folder in folders():
        path = folder / file_name(kernel, baseline())
        if (code := read(path)) is not None:
            if origin == "cache":
                touch(path)
            with contextlib.suppress(RuntimeError):  # LLVM's, of code that is none of this machine
                return _loaded(code, origin)
    with announce(kernel):
        from .emit import timed

        (code,), seconds = timed(kernel, (baseline(),))
    note_compiled(kernel, seconds)
    keep(kernel, code)
    return _loaded(code, "compiled")


def is_known(kernel: Any) -> bool:
    """Whether its code is in a file."""
    return any((folder / file_name(kernel, baseline())).is_file() for _, folder in folders())


def _loaded(code: bytes, origin: str) -> Loaded:
    from .emit import ENTRY

    made = LoadedCode(code)
    return Loaded(made.address(ENTRY), made, origin)


def folders() -> list[tuple[str, Path]]:
    """Where files are looked for."""
    cache = cache_folder()
    return [("shipped", SHIPPED), *([("cache", cache)] if cache is not None else [])]


@lru_cache(maxsize=1)
def cache_folder() -> Path | None:
    """The user's folder for compiled code: ``FLYBALL_CACHE``, else where the system has such; None if it has none."""
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
        warn(
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
    """A hash of all that a kernel's code depends on."""
    layouts = ", ".join(str(x) for x in kernel.parameters)
    text = f"{kernel.name} {kernel.first_order} ({layouts}) {triple()} {cpu} {kernel.content}"
    return hashlib.sha256(text.encode()).hexdigest()[:DIGITS]


def read(path: Path) -> bytes | None:
    """The content of a file after its head; None if there is none, or it is damaged."""
    try:
        data = path.read_bytes()
    except OSError:
        return None
    head, digest, code = data[: len(MARK)], data[len(MARK) : len(MARK) + 64], data[len(MARK) + 64 :]
    return code if head == MARK and hashlib.sha256(code).hexdigest().encode() == digest else None


def write(path: Path, code: bytes) -> None:
    """Write a file, at once or not at all.

    Raises
    ------
    OSError
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    handle, name = tempfile.mkstemp(dir=path.parent, suffix=".part")
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(MARK + hashlib.sha256(code).hexdigest().encode() + code)
        Path(name).replace(path)
    except OSError:
        Path(name).unlink(missing_ok=True)
        raise


def keep(kernel: Any, code: bytes) -> None:
    """Leave code for other processes; where that cannot be, say so."""
    folder = cache_folder()
    if folder is None:
        return
    try:
        write(folder / file_name(kernel, baseline()), code)
    except OSError as error:
        warn(f"compiled code cannot be kept in {folder}: {error.strerror}", PerformanceNotice)
        return
    remove_oldest(folder)


def touch(path: Path) -> None:
    """Note that a file of the user's folder is used."""
    with contextlib.suppress(OSError):
        path.touch()


def remove_oldest(folder: Path) -> None:
    """Remove the files that were used longest ago, beyond `MOST` bytes; other processes may do the same meanwhile."""
    total = 0
    with contextlib.suppress(OSError):
        found = [(path.stat(), path) for path in folder.glob(f"*-{'[0-9a-f]' * DIGITS}.o")]
        for status, path in sorted(found, key=lambda x: x[0].st_mtime, reverse=True):
            total += status.st_size
            if total > MOST:
                path.unlink()
