"""What was computed of each kind of mechanism in this process: many short motions pay for code as one long one does."""

from __future__ import annotations

import hashlib
import threading
from collections import OrderedDict

from ...tables.cost import cost
from ...tables.specs import Structure
from ...tables.system import arrays

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


EACH, PART = 150.0, 0.6  # an evaluation on average [ns], and part of the cost of a right-hand side


def kind(s: Structure) -> tuple[str, float]:
    """The same for mechanisms that differ in numbers only; what an evaluation of the table-driven engine takes [ns]."""
    return s.kept.get("kind", None, 1, lambda: (_hashed(s), EACH + PART * cost(s)))


def _hashed(s: Structure) -> str:
    digest = hashlib.blake2b(digest_size=16)
    for table, of in sorted(s.tables.items()):
        for name, x in arrays(of, table):
            digest.update(f"{name}{x.shape}".encode() + x.tobytes())
    return digest.hexdigest()
