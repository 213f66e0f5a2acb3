"""Kernels: entry points of compiled code, layouts and buffers of their arguments, code tables of formulas.

A kernel is called by Python or, by its address, by other kernels. Its parameters are structures of arrays, arrays and
numbers, declared by annotations: a named tuple whose fields are annotated with the names below (``mass: Float1``,
``pattern: Pattern``) is a structure of arrays. An array is described by seven words and two for each dimension, as in
Numba: two for memory ownership (0 here), its length, the bytes of an entry, the address of its numbers, its shape, its
strides. A structure is a sequence of array descriptions. `StructBuffer` describes the arrays of a named tuple, which
stay where they are; `StructPool` makes named tuples whose arrays share one block of memory.

Built-in elements are compiled into the kernels. The formulas of a user-defined class are compiled alone, and a kernel
calls them through the addresses in the class's `CodeTable`, so that no kernel has to be compiled again when a user's
source changes. Numba is imported only when something must be compiled.
"""

from __future__ import annotations

import ctypes
import inspect
import threading
from collections.abc import Callable, Iterator, Sequence
from copy import copy
from functools import cached_property, update_wrapper
from types import FunctionType
from typing import Any, NamedTuple
from weakref import WeakKeyDictionary

import numpy as np

from ..errors import ModelError
from .formulas import CODE_TABLES, KERNELS, LOCK, content_hash, fresh_copy, source_hash
from .struct_layout import (
    DATA,
    DIMENSION,
    HEAD,
    Array,
    CodeTables,
    RecordLayout,
    Struct,
    parameter_layouts,
    struct_layout,
)

_code_tables: WeakKeyDictionary[type, CodeTable] = WeakKeyDictionary()


class Signature(NamedTuple):
    """Arguments and result of a formula that kernels call by address.

    Attributes
    ----------
    name : str
        Attribute of the class that holds the formula.
    arguments : str
        Names of its arguments.
    lengths : tuple
        Lengths of the arguments, which are numbers (0) or nested tuples of numbers.
    result : int or tuple
        Lengths of the result, likewise.
    returns : str
        The result in words, for messages.
    """

    name: str
    arguments: str
    lengths: tuple[Any, ...]
    result: Any
    returns: str

    def __str__(self) -> str:
        return f"{self.name}({self.arguments})"


class CompiledCode:
    """The machine code of a function, loaded from a file or compiled when its address is first read.

    Parameters
    ----------
    function : function
    first_order : bool
        Whether its numbers are complex, with derivatives as imaginary parts; else floats.
    signature : Signature
        Of a formula that kernels call by address; None of a kernel.
    """

    parameters: Any
    content: Any
    vectorised = False  # whether loops and straight code use vector instructions

    def __init__(
        self, function: Callable[..., Any], first_order: bool = False, signature: Signature | None = None
    ) -> None:
        self.function, self.first_order, self.signature = function, first_order, signature
        self._loaded: Any = None
        update_wrapper(self, function)  # type: ignore[arg-type]

    @property
    def name(self) -> str:
        """Module and name of the function."""
        return f"{self.function.__module__}.{self.function.__qualname__}"

    @property
    def used(self) -> bool:
        """Whether the code is loaded in this process."""
        return self._loaded is not None

    @property
    def origin(self) -> str:
        """Origin of the code: "shipped", "cache" or "compiled"; empty before its address is first read."""
        return self._loaded.origin if self._loaded is not None else ""

    @property
    def address(self) -> int:
        """Address of the code in memory."""
        if self._loaded is None:
            with LOCK:
                if self._loaded is None:
                    from .object_files import code_of

                    self._loaded = code_of(self)
        return int(self._loaded.address)


class FormulaCode(CompiledCode):
    """Machine code of one formula of a user-defined class, for floats or for complex numbers."""

    signature: Signature

    def __init__(self, function: FunctionType, first_order: bool, signature: Signature) -> None:
        super().__init__(fresh_copy(function, {}), first_order, signature)
        self._original = function

    @property
    def parameters(self) -> tuple[Any, ...]:  # type: ignore[override]
        """Lengths of its arguments."""
        return self.signature.lengths

    @property
    def content(self) -> str:  # type: ignore[override]
        """Hash of the formula, its signature, and the functions and numbers that it uses."""
        return f"{self.signature} {self.signature.result} {content_hash(self._original)}"


class CodeTable:
    """Addresses of the formulas of one class: for each signature the code for floats and that for complex numbers.

    Parameters
    ----------
    owner : type
        The class.
    signatures : sequence of Signature
        Of the formulas that kernels may call.

    Attributes
    ----------
    functions : tuple
        The formulas in Python; None where the class does not have one.
    address : int
        Of the table in memory; valid as long as this object exists.

    Raises
    ------
    ModelError
        If a formula is not a static method, or its arguments differ from its signature.
    """

    def __init__(self, owner: type, signatures: Sequence[Signature]) -> None:
        self.owner, self.signatures = owner, tuple(signatures)
        self.functions = tuple(_static_method(owner, x) for x in signatures)
        self.content = self._content()
        self._words = np.zeros((len(signatures), 2), np.int64)
        self._code: list[FormulaCode] = []
        self._lock = threading.RLock()
        self.address = int(self._words.ctypes.data)
        CODE_TABLES[self.address] = self

    @property
    def stale(self) -> bool:
        """Whether a formula, or a function or number that it uses, has changed since the table was made."""
        now = tuple(_static_method(self.owner, x) for x in self.signatures)
        return self.functions != now or self.content != self._content()

    def make_ready(self, first_order: bool) -> None:
        """Load or compile the code of every formula.

        Parameters
        ----------
        first_order : bool
            For complex numbers; else for floats.

        Raises
        ------
        ModelError
            If a formula cannot be compiled.
        """
        for signature, function, words in zip(self.signatures, self.functions, self._words, strict=True):
            if function is None or words[int(first_order)]:
                continue
            with self._lock:
                code = FormulaCode(function, first_order, signature)  # type: ignore[arg-type]
                try:
                    words[int(first_order)] = code.address
                except (ImportError, MemoryError):
                    raise
                except Exception as error:  # Numba raises many kinds of exceptions
                    raise ModelError(_cannot_compile(self.owner, signature, first_order, error)) from error
                self._code.append(code)

    def _content(self) -> str:
        return " ".join(content_hash(f) for f in self.functions if f is not None)

    def __reduce__(self) -> Any:
        return code_table, (self.owner, self.signatures)


def code_table(owner: type, signatures: Sequence[Signature], required: Sequence[Signature] = ()) -> CodeTable:
    """Code table of a class; a new one if a formula has changed.

    Raises
    ------
    ModelError
        If the class lacks a required formula, or one does not match its signature.
    """
    for x in required:
        if not hasattr(owner, x.name):
            raise ModelError(
                f"{owner.__name__} has no formula {x}; define it as a static method. It returns {x.returns}"
            )
    with LOCK:
        found = _code_tables.get(owner)
        if found is None or found.stale:
            found = _code_tables[owner] = CodeTable(owner, signatures)
        return found


def table_addresses(tables: Sequence[CodeTable | None]) -> np.ndarray:
    """Addresses of code tables; 0 for None."""
    return np.array([0 if x is None else x.address for x in tables], np.int64)


def make_ready(addresses: np.ndarray, first_order: bool) -> None:
    """Load or compile the code of the tables at some addresses; 0 stands for no table.

    Raises
    ------
    ModelError
        If a formula cannot be compiled.
    """
    for address in set(addresses.tolist()) - {0}:
        CODE_TABLES[address].make_ready(first_order)


def short_reason(error: Exception) -> str:
    """Line of a Numba error that states the cause."""
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    lines = [line for line in lines if not line.startswith(("Failed in", "During:"))] or [type(error).__name__]
    return lines[0][:200]


def _static_method(owner: type, signature: Signature) -> Callable[..., Any] | None:
    static = inspect.getattr_static(owner, signature.name, None)
    if static is None:
        return None
    function = getattr(owner, signature.name)
    code = getattr(function, "__code__", None)
    if not isinstance(static, staticmethod) or code is None:
        raise ModelError(
            f"{owner.__name__}.{signature.name} must be a static method, a plain function {signature}: write "
            f"{signature.name}: ClassVar = staticmethod({signature.name}), or @staticmethod above it"
        )
    if code.co_argcount != len(signature.lengths):
        raise ModelError(
            f"{owner.__name__}.{signature.name} takes {', '.join(code.co_varnames[: code.co_argcount])}; it must take "
            f"{signature.arguments}"
        )
    return function  # type: ignore[no-any-return]


def _cannot_compile(owner: type, signature: Signature, first_order: bool, error: Exception) -> str:
    numbers = "complex numbers, which derivatives are computed with" if first_order else "floats"
    return (
        f"{owner.__name__}.{signature.name} cannot be compiled for {numbers}: {short_reason(error)}. It must return "
        f"{signature.returns}; a formula uses numbers, tuples of these, and functions of flyball.math and of your own "
        f"that do the same"
    )


ALIGNMENT = 64  # alignment of arrays in a block [bytes]
_ORDER = 0x1 | 0x100  # flags of an array: C order, aligned
_WRITEABLE = 0x400
_byte, _address = ctypes.c_char.from_buffer, ctypes.addressof


def address_of(x: np.ndarray) -> int:
    """Address of an array's first number; through its buffer if possible, which takes a fifth of the time."""
    return _address(_byte(x)) if x.size and x.flags.writeable and x.flags.c_contiguous else x.ctypes.data  # type: ignore[arg-type]


def tuple_layout(fields: Any) -> Struct:
    """Layout of a named tuple: the ``Complex`` variant if an array for which there is one is complex."""
    return struct_layout(type(fields), _is_complex(fields, struct_layout(type(fields))))  # type: ignore[arg-type]


def _is_complex(fields: Any, real_layout: Struct) -> bool:
    twin = struct_layout(real_layout.of, True)
    for x, (_, a), (_, b) in zip(fields, real_layout.fields, twin.fields, strict=True):
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
        If an array does not match the annotations of the tuple.
    """

    def __init__(self, fields: Any, *known: StructBuffer) -> None:
        self.fields = fields
        self.layout = tuple_layout(fields)
        words: list[int] = []
        _add_descriptions(fields, self.layout, {id(x.fields): x for x in known}, words)
        self.words = np.array(words, np.int64)
        self.address = address_of(self.words)

    def of(self, fields: Any) -> StructBuffer:
        """Buffer of another tuple of this type, most of whose arrays are the same."""
        if tuple_layout(fields) != self.layout:
            return StructBuffer(fields)
        other = copy(self)
        other.fields, other.words = fields, self.words.copy()
        other.address = address_of(other.words)
        _update_descriptions(self.fields, fields, self.layout, other.words, 0)
        return other


def _add_descriptions(fields: Any, layout: Struct, known: dict[int, StructBuffer], words: list[int]) -> None:
    for x, (name, of) in zip(fields, layout.fields, strict=True):
        if not isinstance(x, tuple):
            words += _field_description(x, of, name, layout)
        elif (there := known.get(id(x))) is not None:
            words += there.words.tolist()
        else:
            _add_descriptions(x, of, known, words)


def _field_description(x: np.ndarray, of: Any, name: str, layout: Struct) -> tuple[int, ...]:
    """Descriptor words of an array of a structure; code whose addresses it contains is loaded or compiled."""
    words = array_description(x, of, f"{layout.of.__name__}.{name}")
    if isinstance(of, CodeTables) and x.any():
        make_ready(x, layout.complex)
    return words


def _update_descriptions(old: Any, new: Any, layout: Struct, words: np.ndarray, at: int) -> None:
    """Rewrite the words, from ``at`` on, of the arrays that differ from those of ``old``."""
    for before, x, (name, of) in zip(old, new, layout.fields, strict=True):
        if x is not before and isinstance(x, tuple):
            _update_descriptions(before, x, of, words, at)
        elif x is not before:
            words[at : at + of.size // 8] = _field_description(x, of, name, layout)
        at += of.size // 8


def array_description(x: np.ndarray, of: Array | RecordLayout, name: str) -> tuple[int, ...]:
    """Descriptor words of an array.

    Raises
    ------
    TypeError
        If it is not of that type.
    """
    if isinstance(of, RecordLayout):
        if x.shape[0] < of.of.layout.width if of.of.layout.vectors else x.shape[-1] != of.of.layout.width:
            raise TypeError(f"{name}: {of.of.layout.width} numbers are needed for {of}, got {x.shape}")
        of = of.array
    if x.ndim != of.ndim or x.dtype != of.dtype or x.flags.num & _ORDER != _ORDER:
        raise TypeError(
            f"{name}: an array of {np.dtype(of.dtype)} with {of.ndim} dimensions and without gaps is needed, got "
            f"{x.dtype} with {x.ndim}{'' if x.flags.c_contiguous else ', with gaps'}"
        )
    place = _address(_byte(x)) if x.size and x.flags.num & _WRITEABLE else x.__array_interface__["data"][0]  # type: ignore[arg-type]
    return 0, 0, x.size, x.itemsize, place, *x.shape, *x.strides


class JoinedBuffer(StructBuffer):
    """Buffer of a named tuple of tuples that have buffers."""

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
    """Result of a `StructPool`: arrays in one block of memory; the Python arrays are created when first used."""

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
        """One of its arrays, without creating the others; in a nested tuple ``"inner.name"``."""
        return self._pool.named(name, self._block)


class StructPool:
    """Pool of named tuples of arrays, one for each run.

    Parameters
    ----------
    fields : tuple
        Their initial values.
    constant : sequence of ndarray
        Arrays among them that all runs share, since nothing writes to them.
    """

    def __init__(self, fields: Any, constant: Sequence[np.ndarray] = ()) -> None:
        self._new, self._shared = fields, {id(x) for x in constant}
        self._size, places = 0, list[int]()
        self._placements: list[tuple[tuple[int, ...], Any, int, type[np.ndarray]]] = []
        self._named: dict[str, int] = {}
        self._place_arrays(fields, 0, places)
        self.places = np.array(places, np.int64)
        self.block = np.zeros(max(self._size, 1), np.uint8)
        filled = self.fill(self.block)
        for mine, new in zip(_arrays_of(filled), _arrays_of(fields), strict=True):
            if mine is not new:
                mine[...] = new
        buffer = StructBuffer(filled)
        self.words, self.layout = buffer.words, buffer.layout
        self.words[self.places] = [begin for _, _, begin, _ in self._placements]

    def new(self) -> PooledBuffer:
        """New tuple with arrays of its own."""
        return PooledBuffer(self)

    def fill(self, block: np.ndarray) -> Any:
        """Tuple with its arrays in a block."""
        return self._filled(self._new, block, iter(self._placements))

    def named(self, name: str, block: np.ndarray) -> np.ndarray:
        """One of the tuple's own arrays in a block: see `PooledBuffer.array`."""
        shape, dtype, begin, of = self._placements[self._named[name]]
        return np.ndarray(shape, dtype, block, begin).view(of)

    def _place_arrays(self, fields: Any, at: int, places: list[int], of: str = "") -> int:
        """Assign places in the block to arrays, and the words that hold their addresses."""
        for name, x in zip(fields._fields, fields, strict=True):
            if isinstance(x, tuple):
                at = self._place_arrays(x, at, places, f"{of}{name}.")
                continue
            if id(x) not in self._shared:
                self._named[of + name] = len(places)
                places.append(at + DATA // 8)
                self._placements.append((x.shape, x.dtype, self._size, type(x)))
                self._size += -(-x.nbytes // ALIGNMENT) * ALIGNMENT
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


def _arrays_of(fields: Any) -> Iterator[np.ndarray]:
    """Arrays of a tuple, including nested tuples."""
    for x in fields:
        if isinstance(x, tuple):
            yield from _arrays_of(x)
        else:
            yield x


def kernel(function: Callable[..., Any]) -> Kernel:
    """Make ``function`` a compiled entry point."""
    return Kernel(function)


def first_order_kernel(function: Callable[..., Any]) -> Kernel:
    """Make ``function`` an entry point for complex steps, with (a + i b)(c + i d) = a c + i (a d + b c)."""
    return Kernel(function, first_order=True)


def vectorised_kernel(function: Callable[..., Any]) -> Kernel:
    """Make ``function`` an entry point whose loops use vector instructions; no sum is reordered, so no bit changes."""
    return Kernel(function, vectorised=True)


class Kernel(CompiledCode):
    """Compiled entry point, loaded from the cache or compiled when it is first needed.

    Attributes
    ----------
    parameters : tuple
        Layouts of its parameters; `int` and `float` are numbers.
    """

    def __init__(self, function: Callable[..., Any], first_order: bool = False, vectorised: bool = False) -> None:
        super().__init__(function, first_order)
        self.vectorised = vectorised  # pays where kernels spend their time in rows of numbers
        KERNELS.append(self)

    @cached_property
    def _signature(self) -> tuple[tuple[Any, ...], type | None]:
        return parameter_layouts(self.function)

    @property
    def parameters(self) -> tuple[Any, ...]:
        """Layouts of its parameters."""
        return self._signature[0]

    @property
    def returns(self) -> type | None:
        """Type of the result: `int`, `float` or None."""
        return self._signature[1]

    @property
    def content(self) -> str:
        """Hash of all its sources."""
        return source_hash(self.function)

    @cached_property
    def call(self) -> Any:
        """Code callable from Python: takes addresses and numbers."""
        kinds = [{int: ctypes.c_int64, float: ctypes.c_double}.get(p, ctypes.c_void_p) for p in self.parameters]
        returned = ctypes.c_double if self.returns is float else ctypes.c_int64
        return ctypes.CFUNCTYPE(returned, *kinds)(self.address)  # type: ignore[arg-type]

    def __call__(self, *args: Any) -> Any:
        """Run it on named tuples, arrays and numbers.

        Raises
        ------
        TypeError
            If an argument does not match the parameter.
        """
        kept = [_argument_buffer(x, of, self) for x, of in zip(args, self.parameters, strict=True)]
        return self.call(*(getattr(x, "address", x) for x in kept))


class ArrayBuffer:
    """An array as kernels read it.

    Parameters
    ----------
    x : ndarray
        Kept alive by this object.
    of : Array
    name : str
        For the message if it is not of that type.
    """

    def __init__(self, x: np.ndarray, of: Array, name: str) -> None:
        self.array = x
        self.words = np.array(array_description(x, of, name), np.int64)
        self.address = self.words.ctypes.data


def _argument_buffer(x: Any, of: Any, kernel: Kernel) -> Any:
    if of is int:
        return int(x)
    if of is float:
        return float(x)
    if isinstance(of, Array):
        return x if isinstance(x, ArrayBuffer) else ArrayBuffer(x, of, kernel.name)
    made = x if isinstance(x, StructBuffer) else StructBuffer(x)
    check_layout(kernel, of, made)
    return made


def check_layout(kernel: Kernel, of: Struct, buffer: StructBuffer) -> None:
    """Refuse a structure whose layout is not the kernel's.

    Raises
    ------
    TypeError
    """
    if buffer.layout != of:
        raise TypeError(f"{kernel.name} takes {of}, not {buffer.layout}")


class BoundKernel:
    """A kernel bound to its structures, called with a task: as fast from Python as a call of C.

    Parameters
    ----------
    kernel : Kernel
    buffers : StructBuffer
        Kept alive by this object.

    Raises
    ------
    TypeError
        If they do not match the kernel's parameters.
    """

    def __init__(self, kernel: Kernel, *buffers: StructBuffer) -> None:
        self.buffers, self.kernel = buffers, kernel
        for of, x in zip(kernel.parameters, buffers, strict=False):
            check_layout(kernel, of, x)
        self.address = kernel.address
        self._addresses = [x.address for x in buffers]
        self.words = np.array([self.address, *self._addresses], np.int64)  # for `formulas.call_bound`

    def __call__(self, task: int) -> int:
        """Run a task."""
        return int(self.kernel.call(*self._addresses, task))
