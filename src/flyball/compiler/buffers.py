"""Arguments of kernels as they stand in memory: structures of arrays by the addresses of their arrays.

A `StructBuffer` describes the arrays of a named tuple, which stay where they are. `StructPool` makes named tuples
whose arrays stand in one block of memory that is copied at once, for what each run needs anew.
"""

from __future__ import annotations

import ctypes
from collections.abc import Iterator, Sequence
from copy import copy
from functools import cached_property
from typing import Any

import numpy as np

from .by_address import make_ready
from .layout import DATA, DIMENSION, HEAD, Array, CodeTables, RecordLayout, Struct, struct

EVEN = 64  # bytes at whose multiples arrays begin in a block
_ORDER = 0x1 | 0x100  # flags of an array: C order, aligned
_WRITEABLE = 0x400
_byte, _address = ctypes.c_char.from_buffer, ctypes.addressof


def address_of(x: np.ndarray) -> int:
    """Where an array's first number stands; by its buffer, where it has one, in a fifth of the time."""
    return _address(_byte(x)) if x.size and x.flags.writeable and x.flags.c_contiguous else x.ctypes.data


def layout_of(fields: Any) -> Struct:
    """Layout of a named tuple: the ``Complex`` twin if an array that has one is complex."""
    return struct(type(fields), _is_complex(fields, struct(type(fields))))


def _is_complex(fields: Any, plain: Struct) -> bool:
    twin = struct(plain.of, True)
    for x, (_, a), (_, b) in zip(fields, plain.fields, twin.fields, strict=True):
        if a != b:
            return _is_complex(x, a) if isinstance(a, Struct) else x.dtype.kind == "c"
    return False


class StructBuffer:
    """A named tuple of arrays as kernels read it. The arrays may be written to, not replaced.

    Parameters
    ----------
    fields : tuple
    known : StructBuffer
        Of tuples among the fields, whose descriptions are copied.

    Attributes
    ----------
    layout : Struct
    address : int

    Raises
    ------
    TypeError
        If an array is not as the annotations of the tuple declare it.
    """

    def __init__(self, fields: Any, *known: StructBuffer) -> None:
        self.fields = fields
        self.layout = layout_of(fields)
        words: list[int] = []
        _describe(fields, self.layout, {id(x.fields): x for x in known}, words)
        self.words = np.array(words, np.int64)
        self.address = address_of(self.words)

    def of(self, fields: Any) -> StructBuffer:
        """That of another tuple of this kind, most of whose arrays are the same."""
        if layout_of(fields) != self.layout:
            return StructBuffer(fields)
        other = copy(self)
        other.fields, other.words = fields, self.words.copy()
        other.address = address_of(other.words)
        _describe_changed(self.fields, fields, self.layout, other.words, 0)
        return other


def _describe(fields: Any, layout: Struct, known: dict[int, StructBuffer], words: list[int]) -> None:
    for x, (name, of) in zip(fields, layout.fields, strict=True):
        if not isinstance(x, tuple):
            words += _described_field(x, of, name, layout)
        elif (there := known.get(id(x))) is not None:
            words += there.words.tolist()
        else:
            _describe(x, of, known, words)


def _described_field(x: np.ndarray, of: Any, name: str, layout: Struct) -> tuple[int, ...]:
    """The words that describe an array of a structure; code that it has the addresses of is made ready."""
    words = described(x, of, f"{layout.of.__name__}.{name}")
    if isinstance(of, CodeTables) and x.any():
        make_ready(x, layout.complex)
    return words


def _describe_changed(old: Any, new: Any, layout: Struct, words: np.ndarray, at: int) -> None:
    """Write anew the words, from ``at`` on, of the arrays that are not those of ``old``."""
    for before, x, (name, of) in zip(old, new, layout.fields, strict=True):
        if x is not before and isinstance(x, tuple):
            _describe_changed(before, x, of, words, at)
        elif x is not before:
            words[at : at + of.size // 8] = _described_field(x, of, name, layout)
        at += of.size // 8


def described(x: np.ndarray, of: Array | RecordLayout, name: str) -> tuple[int, ...]:
    """The words that describe an array.

    Raises
    ------
    TypeError
        If it is not of that type.
    """
    of = of.array if isinstance(of, RecordLayout) else of
    if x.ndim != of.ndim or x.dtype != of.dtype or x.flags.num & _ORDER != _ORDER:
        raise TypeError(
            f"{name}: an array of {np.dtype(of.dtype)} with {of.ndim} dimensions and without gaps is needed, got "
            f"{x.dtype} with {x.ndim}{'' if x.flags.c_contiguous else ', with gaps'}"
        )
    place = _address(_byte(x)) if x.size and x.flags.num & _WRITEABLE else x.__array_interface__["data"][0]
    return 0, 0, x.size, x.itemsize, place, *x.shape, *x.strides


class JoinedBuffer(StructBuffer):
    """A named tuple of tuples that have buffers."""

    def __init__(self, make: type, *parts: StructBuffer) -> None:
        self._make, self._parts = make, parts
        self.words = np.concatenate([x.words for x in parts])
        names = make._fields  # type: ignore[attr-defined]
        self.layout = Struct(make, False, tuple((n, x.layout) for n, x in zip(names, parts, strict=True)))
        self.address = address_of(self.words)

    @cached_property
    def fields(self) -> Any:  # type: ignore[override]
        """The tuple of tuples."""
        return self._make(*(x.fields for x in self._parts))


class PooledBuffer(StructBuffer):
    """What a `StructPool` makes: arrays in one block of memory; in Python they are made when first used."""

    def __init__(self, pool: StructPool) -> None:
        self._pool, self._block = pool, pool.block.copy()
        self.words = pool.words.copy()
        self.words[pool.places] += address_of(self._block)
        self.layout = pool.layout
        self.address = address_of(self.words)

    @cached_property
    def fields(self) -> Any:  # type: ignore[override]
        """The tuple of arrays."""
        return self._pool.fill(self._block)

    def array(self, name: str) -> Any:
        """One of its arrays, without the others; of a tuple in it ``"inner.name"``."""
        return self._pool.named(name, self._block)


class StructPool:
    """Makes named tuples of arrays of which each run has its own.

    Parameters
    ----------
    fields : tuple
        As they are new.
    constant : sequence of ndarray
        Those of them that all runs share, since nothing writes to them.
    """

    def __init__(self, fields: Any, constant: Sequence[np.ndarray] = ()) -> None:
        self._new, self._shared = fields, {id(x) for x in constant}
        self._size, places = 0, list[int]()
        self._laid: list[tuple[tuple[int, ...], Any, int, type[np.ndarray]]] = []
        self._named: dict[str, int] = {}
        self._lay(fields, 0, places)
        self.places = np.array(places, np.int64)
        self.block = np.zeros(max(self._size, 1), np.uint8)
        filled = self.fill(self.block)
        for mine, new in zip(_leaves(filled), _leaves(fields), strict=True):
            if mine is not new:
                mine[...] = new
        buffer = StructBuffer(filled)
        self.words, self.layout = buffer.words, buffer.layout
        self.words[self.places] = [begin for _, _, begin, _ in self._laid]

    def new(self) -> PooledBuffer:
        """A tuple of one's own."""
        return PooledBuffer(self)

    def fill(self, block: np.ndarray) -> Any:
        """The tuple, its arrays in a block."""
        return self._filled(self._new, block, iter(self._laid))

    def named(self, name: str, block: np.ndarray) -> np.ndarray:
        """One of the tuple's own arrays in a block: see `PooledBuffer.array`."""
        shape, dtype, begin, of = self._laid[self._named[name]]
        return np.ndarray(shape, dtype, block, begin).view(of)

    def _lay(self, fields: Any, at: int, places: list[int], of: str = "") -> int:
        """Decide where arrays begin in the block, and which words hold their addresses."""
        for name, x in zip(fields._fields, fields, strict=True):
            if isinstance(x, tuple):
                at = self._lay(x, at, places, f"{of}{name}.")
                continue
            if id(x) not in self._shared:
                self._named[of + name] = len(places)
                places.append(at + DATA // 8)
                self._laid.append((x.shape, x.dtype, self._size, type(x)))
                self._size += -(-x.nbytes // EVEN) * EVEN
            at += (HEAD + DIMENSION * x.ndim) // 8
        return at

    def _filled(
        self, fields: Any, block: np.ndarray, laid: Iterator[tuple[tuple[int, ...], Any, int, type[np.ndarray]]]
    ) -> Any:
        made: list[Any] = []
        for x in fields:
            if isinstance(x, tuple):
                made.append(self._filled(x, block, laid))
            elif id(x) in self._shared:
                made.append(x)
            else:
                shape, dtype, begin, of = next(laid)
                made.append(np.ndarray(shape, dtype, block, begin).view(of))
        return type(fields)(*made)


def _leaves(fields: Any) -> Iterator[np.ndarray]:
    """The arrays of a tuple, of tuples in it too."""
    for x in fields:
        if isinstance(x, tuple):
            yield from _leaves(x)
        else:
            yield x
