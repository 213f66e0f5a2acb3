"""One thread at a time: for what is worked out when something first asks for it."""

from __future__ import annotations

import threading
from typing import Any


class Turn:
    """A lock that the thread which has it may take again; a copy or a pickle of its owner has one of its own."""

    def __init__(self) -> None:
        self._lock = threading.RLock()

    def __enter__(self) -> None:
        self._lock.acquire()

    def __exit__(self, *_: object) -> None:
        self._lock.release()

    def __reduce__(self) -> Any:
        return Turn, ()
