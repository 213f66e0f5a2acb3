"""Turns at compiling: of processes that need the same kernel at once one compiles it, and the others wait for that.

A turn is a lock of the operating system on a file beside the kernel in the cache. It ends with the process that has it,
however that ends. Who has waited too long, or cannot lock files there, compiles beside the others as if there were no
turns: what is kept is the same.
"""

from __future__ import annotations

import os
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

try:
    import fcntl
except ImportError:  # not on this system: every process compiles for itself
    fcntl = None  # type: ignore[assignment]

PATIENCE = 240.0  # seconds: several times what compiling takes, on a busy machine too
PAUSE = 0.02  # seconds between two looks


class Turn:
    """The turn at compiling one kernel, of all processes that share its cache."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._file: int | None = None

    def take(self) -> bool:
        """Wait until it is nobody else's, and no longer than ``PATIENCE``.

        Returns
        -------
        bool
            Whether it was somebody's. Where files cannot be locked it is nobody's.
        """
        self.give()
        if fcntl is None:
            return False
        waited = False
        with suppress(OSError):
            self._file = os.open(self.path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o666)
            until = time.monotonic() + PATIENCE
            while not self._mine() and time.monotonic() < until:
                waited = True
                time.sleep(PAUSE)
        return waited

    def _mine(self) -> bool:
        try:
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            return False
        return True

    def give(self) -> None:
        """Let others have it."""
        file, self._file = self._file, None
        if file is not None:
            with suppress(OSError):  # said, not left to closing: a fork has the file open as well
                fcntl.flock(file, fcntl.LOCK_UN)
            os.close(file)


@contextmanager
def in_turn(cache: Any) -> Iterator[None]:
    """While a kernel is looked for in its cache and compiled: the turn that the cache takes is given back then."""
    try:
        yield
    finally:
        if (turn := getattr(cache, "turn", None)) is not None:
            turn.give()
