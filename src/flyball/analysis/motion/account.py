"""What was computed of each kind of mechanism in this process: many short motions pay for code as one long one does."""

from __future__ import annotations

import hashlib
import threading
from collections import OrderedDict

from ...tables.specs import Structure

MOST = 256  # kinds of mechanisms that are known


class Account:
    """Times [ns] by kind of mechanism."""

    def __init__(self) -> None:
        self._spent: OrderedDict[str, float] = OrderedDict()
        self._lock = threading.Lock()

    def add(self, key: str, more: float) -> None:
        """So much more."""
        with self._lock:
            self._spent[key] = self._spent.pop(key, 0.0) + more
            while len(self._spent) > MOST:
                self._spent.popitem(last=False)

    def of(self, key: str) -> float:
        """All of it."""
        with self._lock:
            return self._spent.get(key, 0.0)


SPENT = Account()
"""By the table-driven engine."""


def kind(s: Structure) -> str:
    """The same for mechanisms that differ in numbers only."""
    return s.kept.get("kind", None, 1, lambda: _hashed(s))


def _hashed(s: Structure) -> str:
    digest = hashlib.blake2b(digest_size=16)
    for name, table in sorted(s.tables.items()):
        digest.update(f"{name}{table.shape}".encode())
        digest.update(table.tobytes())
    return digest.hexdigest()
