"""What has been worked out once of something that does not change, and is handed out again."""

from __future__ import annotations

import threading
from collections import OrderedDict
from collections.abc import Callable, Hashable, Mapping
from typing import Any, TypeVar

import numpy as np

T = TypeVar("T")


class Kept:
    """Results of pure functions of the object that this hangs on, the last few of each kind.

    It belongs to the process: a copy or a pickle of the object begins with an empty one. Two threads that ask for the
    same at once may both work it out; since the functions are pure, that is all they do.
    """

    def __init__(self) -> None:
        self._found: dict[str, OrderedDict[Hashable, Any]] = {}
        self._lock = threading.Lock()

    def get(self, kind: str, key: Hashable, most: int, make: Callable[[], T]) -> T:
        """What ``make`` returns, made now or earlier; of each kind the ``most`` used last are kept."""
        with self._lock:
            known = self._found.get(kind)
            if known is not None and key in known:
                if most > 1:
                    known.move_to_end(key)
                return known[key]
        made = make()
        with self._lock:
            known = self._found.setdefault(kind, OrderedDict())
            known[key] = made
            while len(known) > most:
                known.popitem(last=False)
        return made

    def known(self, kind: str, key: Hashable = None) -> Any:
        """The same if it is there, else None."""
        with self._lock:
            return self._found.get(kind, OrderedDict()).get(key)

    def drop(self, kind: str, key: Hashable) -> None:
        """Forget one of them."""
        with self._lock:
            self._found.get(kind, OrderedDict()).pop(key, None)

    def take(self, kind: str, other: Kept, made: Callable[[Any], Any]) -> None:
        """Begin with what is made of all that another has of a kind."""
        with other._lock:
            found = other._found.get(kind, OrderedDict()).copy()
        self._found[kind] = OrderedDict((key, made(x)) for key, x in found.items())

    def __reduce__(self) -> Any:
        return Kept, ()


def bits(values: Mapping[str, Any]) -> Hashable:
    """A key of numbers by name that tells every bit apart, real and complex numbers too."""
    x = np.array(list(values.values()))
    return tuple(values), x.dtype.char, x.tobytes()
