"""Layouts of the structures of arrays, arrays and records that kernels take, read from annotations."""

from __future__ import annotations

import re
import sys
from collections.abc import Callable, Iterator
from functools import cache
from typing import Annotated, Any, ClassVar, NamedTuple

import numpy as np

Float1 = Annotated[np.ndarray, "Float1"]
Float2 = Annotated[np.ndarray, "Float2"]
Float3 = Annotated[np.ndarray, "Float3"]
Complex1 = Annotated[np.ndarray, "Complex1"]
Complex2 = Annotated[np.ndarray, "Complex2"]
Int1 = Annotated[np.ndarray, "Int1"]
Int2 = Annotated[np.ndarray, "Int2"]
Short2 = Annotated[np.ndarray, "Short2"]
Number1 = Annotated[np.ndarray, "Number1"]  # of floats; of complex numbers where a structure is annotated as COMPLEX
Number2 = Annotated[np.ndarray, "Number2"]
CodeTables1 = Annotated[np.ndarray, "CodeTables1"]  # addresses of code tables, 0 for none (`by_address`)
# entries of a `Record`: one value; in records by rows, a column; several values side by side, as components of vectors
Column = Annotated[np.ndarray, 1]
Vector2 = Annotated[np.ndarray, 2]
Vector3 = Annotated[np.ndarray, 3]
Vector4 = Annotated[np.ndarray, 4]
Vector6 = Annotated[np.ndarray, 6]
Vector8 = Annotated[np.ndarray, 8]
Vector9 = Annotated[np.ndarray, 9]
COMPLEX = "complex"
"""``ComplexSystem = Annotated[System, COMPLEX]``: the structure whose numbers are complex."""

_TYPES = {"Float": "f8", "Complex": "c16", "Int": "i8", "Short": "i4", "CodeTables": "i8"}
HEAD, DATA, DIMENSION = 40, 32, 16
"""Sizes [bytes]: an array's description without its shape, the part before its data address, the part for a dimension.
"""


class Array(NamedTuple):
    """Contiguous array in C order."""

    dtype: str
    ndim: int

    @property
    def size(self) -> int:
        """Size of its description [bytes]."""
        return HEAD + DIMENSION * self.ndim

    def __str__(self) -> str:
        return f"{self.dtype}x{self.ndim}"


class CodeTables(Array):
    """Array of addresses of code tables, whose code is loaded or compiled before a kernel is given the array."""


class RecordLayout(NamedTuple):
    """Array whose entries, or columns, have names."""

    array: Array
    of: type[Record]

    @property
    def size(self) -> int:
        """Size of its description [bytes]."""
        return self.array.size

    def __str__(self) -> str:
        names = ",".join(k if n == 1 else f"{k}*{n}" for k, (_, n) in self.of.layout.entries.items())
        return f"{self.of.__name__}({names}):{self.array}"


class RecordForm(NamedTuple):
    """Entries of a record."""

    entries: dict[str, tuple[int, int]]  # first number and count of numbers by name
    width: int  # count of all numbers
    kind: str  # of number
    rows: bool  # whether there is a row of them for each element
    vectors: bool  # whether each is a row of the array
    arrays: frozenset[str]  # rows that are arrays


class Record(np.ndarray):
    """Numbers of one type with names, in one array: ``class Tolerances(Record, kind="Float"): position: float``.

    ``x.position`` is an entry, also in compiled code; a structure has the class as the annotation of a field. An entry
    annotated as `Vector3` is an array of three numbers. With ``rows=True`` the array has a row of these entries for
    each element, in one place of memory: ``x.mass[k]``, ``x.velocity[k, i]``; further dimensions, such as time, may
    follow, and one row, ``x[k].mass``, has the names too. With ``vectors=True`` each entry is a row of the array, of
    any length: annotated as `Column` it is read number by number, as `Float1` it is an array. There may be further
    rows. ``Annotated[np.ndarray, "mass"]`` is another name of ``mass``.
    """

    layout: ClassVar[RecordForm]

    def __init_subclass__(cls, kind: str, rows: bool = False, vectors: bool = False) -> None:
        entries, width = dict[str, tuple[int, int]](), 0
        for name, text in cls.__annotations__.items():
            if hasattr(Record, name):
                raise TypeError(f"{cls.__name__}: arrays have an attribute {name!r}; take another name")
            several = re.fullmatch(r"Vector(\d+)", str(text))
            other = re.fullmatch(r"""Annotated\[np\.ndarray, ["'](\w+)["']\]""", str(text))
            first, count = entries[name] = entries[other[1]] if other else (width, int(several[1]) if several else 1)
            width = max(width, first + count)
            setattr(cls, name, _entry_property(first, count, rows, vectors))
        arrays = frozenset(k for k, text in cls.__annotations__.items() if text == "Float1")
        cls.layout = RecordForm(entries, width, kind, rows, vectors, arrays)

    @classmethod
    def blank(cls, *count: int, dtype: Any = None) -> Any:
        """Record of zeros; of so many rows, or of vectors of such a length; ``dtype``: another type of number."""
        dtype = dtype or {"Int": np.int64, "Short": np.int32}.get(cls.layout.kind, np.float64)
        shape = (cls.layout.width, *count) if cls.layout.vectors else (*count, cls.layout.width)
        return np.zeros(shape, dtype).view(cls)


def _entry_property(first: int, count: int, rows: bool, vectors: bool) -> property:
    where = first if count == 1 else slice(first, first + count)

    def get(self: Record) -> Any:
        if count == 1 and not rows and not vectors:
            return self[first]
        numbers = self.view(np.ndarray)
        return numbers[:, where] if rows and self.ndim > 1 else numbers[where]

    def put(self: Record, value: Any) -> None:
        self[(slice(None), where) if rows and self.ndim > 1 else where] = value

    return property(get, put)


class Struct(NamedTuple):
    """Named tuple of arrays and of structures."""

    of: type
    complex: bool
    fields: tuple[tuple[str, Any], ...]

    @property
    def size(self) -> int:
        """Size [bytes]."""
        return sum(x.size for _, x in self.fields)

    def offset(self, name: str) -> int:
        """Offset of a field [bytes]."""
        at = 0
        for field, x in self.fields:
            if field == name:
                return at
            at += x.size
        raise AttributeError(f"{self.of.__name__} has no field {name!r}")

    def arrays(self) -> Iterator[Array | RecordLayout]:
        """Arrays in it, including nested structures."""
        for _, x in self.fields:
            yield from x.arrays() if isinstance(x, Struct) else (x,)

    def __str__(self) -> str:
        return f"{self.of.__name__}({','.join(f'{name}:{x}' for name, x in self.fields)})"


@cache
def struct_layout(of: type, is_complex: bool = False) -> Struct:
    """Layout of a named tuple."""
    scope = vars(sys.modules[of.__module__])
    fields = tuple((name, _declared_layout(text, scope, is_complex)) for name, text in of.__annotations__.items())
    if is_complex and (plain := struct_layout(of)).fields == fields:
        return plain
    return Struct(of, is_complex, fields)


def parameter_layouts(function: Callable[..., Any]) -> tuple[tuple[Any, ...], type | None]:
    """Layouts of a kernel's parameters (`int` and `float` are numbers), and its return type.

    Raises
    ------
    TypeError
        If a parameter is not annotated with a layout or a number.
    """
    code = function.__code__
    names = code.co_varnames[: code.co_argcount]
    texts = function.__annotations__
    found: list[Any] = []
    for name in names:
        try:
            found.append(_declared_layout(texts[name], function.__globals__, False))
        except (KeyError, TypeError) as error:
            raise TypeError(
                f"kernel {function.__qualname__}: parameter {name!r} needs the annotation of a structure of arrays, of "
                f"an array ({', '.join(_TYPES)}, and the number of dimensions), int or float: {error}"
            ) from None
    return tuple(found), {"int": int, "float": float}.get(_annotation_text(texts.get("return")))


def _annotation_text(annotation: Any) -> str:
    """Annotation as it is written, also if it was evaluated."""
    if isinstance(annotation, str):
        return annotation
    array = getattr(annotation, "__metadata__", ("",))[0]
    return getattr(annotation, "__forward_arg__", "") or array or getattr(annotation, "__name__", "")


def _declared_layout(text: Any, scope: dict[str, Any], is_complex: bool) -> Any:
    """Layout that an annotation declares."""
    text = _annotation_text(text)
    if text in ("int", "float"):
        return int if text == "int" else float
    kind, ndim = text[:-1], text[-1:]
    if kind == "Number":
        kind = "Complex" if is_complex else "Float"
    if kind in _TYPES and ndim.isdigit():
        return (CodeTables if kind == "CodeTables" else Array)(_TYPES[kind], int(ndim))
    made = scope[text]
    if isinstance(made, type) and issubclass(made, Record):
        return RecordLayout(
            _declared_layout(f"{made.layout.kind}{1 + (made.layout.rows or made.layout.vectors)}", scope, is_complex),
            made,
        )
    if hasattr(made, "__metadata__"):  # Annotated[System, COMPLEX]
        return struct_layout(made.__origin__, COMPLEX in made.__metadata__)
    return struct_layout(made, is_complex)
