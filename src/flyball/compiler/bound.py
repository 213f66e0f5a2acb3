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


TOLD = 0x1 | 0x100 | 0x400  # flags of an array that its type depends on: C order, aligned, writeable
_byte, _place_of = ctypes.c_char.from_buffer, ctypes.addressof


def _place(x: np.ndarray, flags: int) -> int:
    """Where an array's first number stands; by its buffer, where it has one to write to, in a fifth of the time."""
    return _place_of(_byte(x)) if flags == TOLD and x.size else x.__array_interface__["data"][0]


class Written:
    """A named tuple of arrays as it stands in the memory of compiled code.

    Its arrays may be written to, but not replaced. Of each: no owners, length, width of an entry, place, shape, and
    strides. What was ``known`` of a tuple among the fields is not looked at again.
    """

    def __init__(self, fields: Any, known: Written | None = None) -> None:
        self.fields = fields
        self.numbers, kinds = self._told(fields, known)
        self.kinds = type(fields), *kinds
        self.place = self.numbers.ctypes.data

    def _told(self, fields: Any, known: Written | None) -> tuple[np.ndarray, list[Any]]:
        numbers: list[int] = []
        kinds: list[Any] = []
        for x in _arrays(fields, known):
            if isinstance(x, Written):
                numbers += x.numbers.tolist()
                kinds += x.kinds[1:]
                continue
            told = x.flags.num & TOLD
            numbers += (0, 0, x.size, x.itemsize, _place(x, told), *x.shape, *x.strides)
            kinds.append((x.dtype.num, x.ndim, told))
        return np.array(numbers, np.int64), kinds


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


def _arrays(fields: Any, known: Written | None) -> list[Any]:
    """The arrays of a tuple, of tuples in it too; in place of those of a tuple that is known what is."""
    if known is not None and fields is known.fields:
        return [known]
    return [y for x in fields for y in (_arrays(x, known) if isinstance(x, tuple) else [x])]


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
