"""A door with its tuples bound to it: called from Python at the price of a call of C.

A kernel takes its tuples apart at each call, some fifty arrays in 30 us. What stands behind a door takes addresses of
tuples, so these are written down once, as Numba has them, and only the task is handed over.
"""

from __future__ import annotations

import ctypes
from functools import lru_cache
from typing import Any

import numpy as np

from .door import Door

_C = ctypes.CFUNCTYPE(ctypes.c_int64, *[ctypes.c_void_p] * 5, ctypes.c_int64)
PARTS = ("meminfo", "parent", "nitems", "itemsize", "data", "shape", "strides")


class Written:
    """A named tuple of arrays as it stands in the memory of compiled code.

    Its arrays may be written to, but not replaced. Of each: no owners, length, width of an entry, place, shape, and
    strides.
    """

    def __init__(self, fields: Any) -> None:
        self.fields, numbers, kinds = fields, [], []
        for x in _arrays(fields):
            numbers += (0, 0, x.size, x.itemsize, x.__array_interface__["data"][0], *x.shape, *x.strides)
            kinds.append((x.dtype.char, x.ndim, x.flags.c_contiguous, x.flags.writeable, x.flags.aligned))
        self.numbers, self.kinds = np.array(numbers, np.int64), (type(fields), *kinds)
        self.place = self.numbers.ctypes.data


class Bound:
    """A door and the tuples that it is called with, which are kept.

    Parameters
    ----------
    door : Door
    tuples : five of Written

    Raises
    ------
    TypeError
        If it was not made for such tuples.
    """

    def __init__(self, door: Door, *tuples: Written) -> None:
        self.tuples = tuples
        self.address = door.address(*(x.fields for x in tuples))
        if not _fits(door, tuples):
            raise TypeError(f"{door.__qualname__} was not made for such tuples")
        self.enter = _C(self.address)
        self.places = [x.place for x in tuples]
        self.asked = np.array([self.address, *self.places], np.int64)  # for `door.ask`

    def __call__(self, task: int) -> int:
        """Have a task done."""
        return int(self.enter(*self.places, task))


def _arrays(fields: Any) -> list[np.ndarray]:
    """The arrays of a tuple, of tuples in it too."""
    return [y for x in fields for y in (_arrays(x) if isinstance(x, tuple) else [x])]


_KNOWN: set[Any] = set()


def _fits(door: Door, tuples: tuple[Written, ...]) -> bool:
    """Whether a door was made for tuples of these types; asked of Numba once for each kind."""
    kind = id(door), *(x.kinds for x in tuples)
    if kind not in _KNOWN:
        from numba import typeof

        from .held import held_type

        if not _as_known() or not door.fits(tuple(held_type(typeof(x.fields)) for x in tuples)):
            return False
        _KNOWN.add(kind)
    return True


@lru_cache(maxsize=1)
def _as_known() -> bool:
    """Whether Numba describes arrays in this order."""
    from numba.core.datamodel import default_manager
    from numba.core.types import Array, float64

    return tuple(default_manager[Array(float64, 2, "C")]._fields) == PARTS
