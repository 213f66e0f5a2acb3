"""A door with its tuples bound to it: called from Python at the price of a call of C.

A kernel takes its tuples apart at each call, some fifty arrays in 30 us. What stands behind a door takes addresses of
tuples, so these are written down once, as Numba has them, and only the task is handed over.
"""

from __future__ import annotations

import ctypes
from collections.abc import Iterator, Sequence
from functools import cached_property, lru_cache
from typing import Any

import numpy as np

from .door import Door

_C = ctypes.CFUNCTYPE(ctypes.c_int64, *[ctypes.c_void_p] * 5, ctypes.c_int64)
PARTS = ("meminfo", "parent", "nitems", "itemsize", "data", "shape", "strides")


EVEN = 64  # bytes at whose multiples arrays begin in a block
TOLD = 0x1 | 0x100 | 0x400  # flags of an array that its type depends on: C order, aligned, writeable
_byte, _place_of = ctypes.c_char.from_buffer, ctypes.addressof


def _place(x: np.ndarray, flags: int) -> int:
    """Where an array's first number stands; by its buffer, where it has one to write to, in a fifth of the time."""
    return _place_of(_byte(x)) if flags == TOLD and x.size else x.__array_interface__["data"][0]


class Written:
    """A named tuple of arrays as it stands in the memory of compiled code.

    Its arrays may be written to, but not replaced. Of each: no owners, length, width of an entry, place, shape, and
    strides. What was written of tuples among the fields is not looked at again.

    Parameters
    ----------
    fields : tuple
    known : Written
        Of tuples among the fields.
    """

    def __init__(self, fields: Any, *known: Written) -> None:
        self.fields = fields
        numbers: list[int] = []
        kinds: list[Any] = [type(fields)]
        self._look(fields, {id(x.fields): x for x in known}, numbers, kinds)
        self.numbers = np.array(numbers, np.int64)
        self.kinds = tuple(kinds)
        self.kind = _number_of(self.kinds)
        self.place = _place(self.numbers, TOLD)

    def _look(self, fields: Any, known: dict[int, Written], numbers: list[int], kinds: list[Any]) -> None:
        for x in fields:
            if isinstance(x, tuple):
                if (there := known.get(id(x))) is not None:
                    numbers += there.numbers.tolist()
                    kinds += there.kinds[1:]
                else:
                    self._look(x, known, numbers, kinds)
                continue
            told = x.flags.num & TOLD
            numbers += (0, 0, x.size, x.itemsize, _place(x, told), *x.shape, *x.strides)
            kinds.append((x.dtype.num, x.ndim, told))


class Moulded(Written):
    """What a `Mould` makes: its arrays stand in one block of memory; in Python they are made when first asked for."""

    def __init__(self, of: Mould) -> None:
        self._of, self._block = of, of.block.copy()
        begin = _place(self._block, TOLD)
        self.numbers = of.numbers.copy()
        self.numbers[of.own] += begin
        self.kinds, self.kind = of.kinds, of.kind
        self.place = _place(self.numbers, TOLD)

    @cached_property
    def fields(self) -> Any:  # type: ignore[override]
        """The tuple of arrays."""
        return self._of.fill(self._block)

    def array(self, name: str) -> np.ndarray:
        """One of the tuple's own arrays, without the others; of a tuple in it ``"inner.name"``."""
        return self._of.named(name, self._block)


class Joined(Written):
    """A tuple of tuples that are written."""

    def __init__(self, make: type, *parts: Written) -> None:
        self._make, self._parts = make, parts
        self.numbers = np.concatenate([x.numbers for x in parts])
        self.kind = _number_of((make, *(x.kind for x in parts)))
        self.place = _place(self.numbers, TOLD)

    @cached_property
    def kinds(self) -> tuple[Any, ...]:  # type: ignore[override]
        """Types of the tuple and of its arrays."""
        return self._make, *(k for x in self._parts for k in x.kinds[1:])

    @cached_property
    def fields(self) -> Any:  # type: ignore[override]
        """The tuple of tuples."""
        return self._make(*(x.fields for x in self._parts))


class Mould:
    """Tuples of arrays of which each run has its own: as they are new, in one block of memory that is copied at once.

    Parameters
    ----------
    fields : tuple
        As they are new.
    constant : sequence of ndarray
        Those of them that all runs may share, since nothing writes to them.
    """

    def __init__(self, fields: Any, constant: Sequence[np.ndarray] = ()) -> None:
        self._new, self._shared = fields, {id(x) for x in constant}
        self._size, own = 0, list[int]()
        self._laid: list[tuple[tuple[int, ...], Any, int]] = []
        self._named: dict[str, int] = {}
        self._lay(fields, 0, own)
        self.own = np.array(own, np.int64)
        self.block = np.zeros(max(self._size, 1), np.uint8)
        filled = self.fill(self.block)
        for mine, new in zip(_leaves(filled), _leaves(fields), strict=True):
            if mine is not new:
                mine[...] = new
        written = Written(filled)
        self.numbers, self.kinds, self.kind = written.numbers, written.kinds, written.kind
        self.numbers[self.own] = [begin for _, _, begin in self._laid]

    def new(self) -> Moulded:
        """A tuple of one's own."""
        return Moulded(self)

    def fill(self, block: np.ndarray) -> Any:
        """The tuple, its arrays in a block."""
        return self._filled(self._new, block, iter(self._laid))

    def named(self, name: str, block: np.ndarray) -> np.ndarray:
        """One of the tuple's own arrays in a block: see `Moulded.array`."""
        shape, dtype, begin = self._laid[self._named[name]]
        return np.ndarray(shape, dtype, block, begin)

    def _lay(self, fields: Any, at: int, own: list[int], of: str = "") -> int:
        """Say where arrays begin in the block, and where among the numbers that stands."""
        for name, x in zip(fields._fields, fields, strict=True):
            if isinstance(x, tuple):
                at = self._lay(x, at, own, f"{of}{name}.")
                continue
            if id(x) not in self._shared:
                self._named[of + name] = len(own)
                own.append(at + PARTS.index("data"))
                self._laid.append((x.shape, x.dtype, self._size))
                self._size += -(-x.nbytes // EVEN) * EVEN
            at += len(PARTS) - 2 + 2 * x.ndim
        return at

    def _filled(self, fields: Any, block: np.ndarray, laid: Iterator[tuple[tuple[int, ...], Any, int]]) -> Any:
        made: list[Any] = []
        for x in fields:
            if isinstance(x, tuple):
                made.append(self._filled(x, block, laid))
            elif id(x) in self._shared:
                made.append(x)
            else:
                shape, dtype, begin = next(laid)
                made.append(np.ndarray(shape, dtype, block, begin))
        return type(fields)(*made)


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
        self.address = door.address(*(() if door.used else (x.fields for x in tuples)))
        if not _fits(door, tuples):
            raise TypeError(f"{door.__qualname__} was not made for such tuples")
        self.places = [x.place for x in tuples]
        self.asked = np.array([self.address, *self.places], np.int64)  # for `door.ask`

    @cached_property
    def enter(self) -> Any:
        """The door, for Python; many are gone through by compiled code only."""
        return _C(self.address)

    def __call__(self, task: int) -> int:
        """Have a task done."""
        return int(self.enter(*self.places, task))


def _leaves(fields: Any) -> Iterator[np.ndarray]:
    """The arrays of a tuple, of tuples in it too."""
    for x in fields:
        if isinstance(x, tuple):
            yield from _leaves(x)
        else:
            yield x


_NUMBERED: dict[Any, int] = {}


def _number_of(kinds: tuple[Any, ...]) -> int:
    """The same number for tuples of the same types of arrays."""
    return _NUMBERED.setdefault(kinds, len(_NUMBERED))


_KNOWN: set[Any] = set()


def _fits(door: Door, tuples: tuple[Written, ...]) -> bool:
    """Whether a door was made for tuples of these types; asked of Numba once for each kind."""
    kind = id(door), *(x.kind for x in tuples)
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
