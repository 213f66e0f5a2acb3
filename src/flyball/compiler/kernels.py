"""Formulas and kernels: what is compiled, and how compiled code is called.

``@formula`` marks plain Python code that compiled code may call. The function itself stays plain Python, so the same
source runs on floats, complex numbers, arrays over time and symbols. ``@kernel`` marks an entry point: its parameters
are structures of arrays, arrays and numbers (`layout`), it is compiled as a whole with all formulas that it calls, and
the code is kept in a file (`store`). Numba is imported only where something is compiled.
"""

from __future__ import annotations

import ctypes
import threading
from collections.abc import Callable
from functools import cached_property, update_wrapper
from typing import Any, TypeVar

import numpy as np

from .buffers import StructBuffer, described
from .layout import Array, Struct, parameters

F = TypeVar("F", bound=Callable[..., Any])

OPTIONS: dict[str, Any] = {"error_model": "numpy", "_nrt": False}  # division as in C; nothing is allocated
KERNELS: list[Kernel] = []
LOCK = threading.RLock()
FAILED = -(2**63)  # what a kernel returns whose formulas ended in an error
_pending: list[Callable[[], None]] = []
_started = False


def when_compiling(callback: Callable[[], None]) -> Callable[[], None]:
    """Run ``callback`` once before anything is compiled (at once if something was)."""
    if _started:
        callback()
    else:
        _pending.append(callback)
    return callback


def start_compiler() -> None:
    """Import Numba, and register every formula defined so far."""
    global _started
    with LOCK:
        if not _started:
            from . import target  # noqa: F401

            _started = True
            while _pending:
                _pending.pop(0)()


def formula(function: F) -> F:
    """Let compiled code call ``function``; the function itself stays plain Python and can be run on any numbers."""

    def register() -> None:
        from .target import overload

        overload(function, strict=False)(lambda *args, **more: function)

    when_compiling(register)
    return function


def kernel(function: Callable[..., Any]) -> Kernel:
    """Make ``function`` a compiled entry point."""
    return Kernel(function)


def first_order_kernel(function: Callable[..., Any]) -> Kernel:
    """The same for complex numbers that carry steps: (a + i b)(c + i d) = a c + i (a d + b c)."""
    return Kernel(function, first_order=True)


class Kernel:
    """A compiled entry point, found in the store or compiled when it is first needed.

    Attributes
    ----------
    parameters : tuple
        Layouts of its parameters; `int` and `float` are numbers.
    """

    def __init__(self, function: Callable[..., Any], first_order: bool = False) -> None:
        self.function, self.first_order = function, first_order
        self._loaded: Any = None
        update_wrapper(self, function)
        KERNELS.append(self)

    @cached_property
    def _signature(self) -> tuple[tuple[Any, ...], type | None]:
        return parameters(self.function)

    @property
    def parameters(self) -> tuple[Any, ...]:
        """Layouts of its parameters."""
        return self._signature[0]

    @property
    def returns(self) -> type | None:
        """`int`, `float` or None."""
        return self._signature[1]

    @property
    def name(self) -> str:
        """By which it is known: module and function."""
        return f"{self.function.__module__}.{self.function.__qualname__}"

    @property
    def used(self) -> bool:
        """Whether this process has its code."""
        return self._loaded is not None

    @property
    def address(self) -> int:
        """Where its code is."""
        if self._loaded is None:
            with LOCK:
                if self._loaded is None:
                    from .store import code_of

                    self._loaded = code_of(self)
        return int(self._loaded.address)

    @cached_property
    def call(self) -> Any:
        """The code, for Python: takes addresses and numbers."""
        kinds = [{int: ctypes.c_int64, float: ctypes.c_double}.get(p, ctypes.c_void_p) for p in self.parameters]
        returned = ctypes.c_double if self.returns is float else ctypes.c_int64
        return ctypes.CFUNCTYPE(returned, *kinds)(self.address)

    def __call__(self, *args: Any) -> Any:
        """Run it on named tuples, arrays and numbers.

        Raises
        ------
        TypeError
            If an argument is not of the kind that the kernel takes.
        """
        kept = [_buffer(x, of, self) for x, of in zip(args, self.parameters, strict=True)]
        return self.call(*(getattr(x, "address", x) for x in kept))


class ArrayBuffer:
    """An array as kernels read it."""

    def __init__(self, x: np.ndarray, of: Array, name: str) -> None:
        self.words = np.array(described(x, of, name), np.int64)
        self.address = self.words.ctypes.data


def _buffer(x: Any, of: Any, kernel: Kernel) -> Any:
    if of is int:
        return int(x)
    if of is float:
        return float(x)
    if isinstance(of, Array):
        return ArrayBuffer(x, of, kernel.name)
    made = x if isinstance(x, StructBuffer) else StructBuffer(x)
    check(kernel, of, made)
    return made


def check(kernel: Kernel, of: Struct, buffer: StructBuffer) -> None:
    """Refuse a structure of another layout than the kernel's.

    Raises
    ------
    TypeError
    """
    if buffer.layout != of:
        raise TypeError(f"{kernel.name} takes {of}, not {buffer.layout}")


class BoundKernel:
    """A kernel of structures and a task, with its structures: called from Python at the price of a call of C.

    Parameters
    ----------
    kernel : Kernel
    buffers : StructBuffer
        They are kept.

    Raises
    ------
    TypeError
        If they are not what the kernel takes.
    """

    def __init__(self, kernel: Kernel, *buffers: StructBuffer) -> None:
        self.buffers, self.kernel = buffers, kernel
        for of, x in zip(kernel.parameters, buffers, strict=False):
            check(kernel, of, x)
        self.address = kernel.address
        self._addresses = [x.address for x in buffers]
        self.words = np.array([self.address, *self._addresses], np.int64)  # for `call_bound`

    def __call__(self, task: int) -> int:
        """Have a task done."""
        return int(self.kernel.call(*self._addresses, task))


def by_address(fields):  # type: ignore[no-untyped-def]
    """The named tuple by its address, in compiled code; the tuple itself in plain Python."""
    return fields


def call(address, A, B, C, D, E, task):  # type: ignore[no-untyped-def]
    """Call the kernel at ``address`` with five structures and a task; in compiled code only."""
    raise NotImplementedError("kernels are called by address from compiled code only")


def call_bound(words, task):  # type: ignore[no-untyped-def]
    """Call a kernel with structures bound to it (`BoundKernel.words`); in compiled code only."""
    raise NotImplementedError("kernels are called by address from compiled code only")


@when_compiling
def _register() -> None:
    from llvmlite import ir
    from numba import types
    from numba.core.errors import TypingError
    from numba.extending import intrinsic

    from . import references  # noqa: F401
    from .target import overload

    integer = ir.IntType(64)

    @intrinsic
    def jump(typing, address, A, B, C, D, E, task):  # type: ignore[no-untyped-def]
        given = A, B, C, D, E
        layouts = tuple(getattr(x, "layout", None) for x in given)
        if not any(k.parameters[:-1] == layouts for k in KERNELS):
            raise TypingError(f"no kernel takes {given}")

        def generate(context, builder, signature, args):  # type: ignore[no-untyped-def]
            of = ir.FunctionType(integer, [x.type for x in args[1:]])
            return builder.call(builder.inttoptr(args[0], of.as_pointer()), list(args[1:]))

        return types.int64(types.int64, *given, types.int64), generate

    @intrinsic
    def leap(typing, address, A, B, C, D, E, task):  # type: ignore[no-untyped-def]
        def generate(context, builder, signature, args):  # type: ignore[no-untyped-def]
            of = ir.FunctionType(integer, [integer] * 6)
            return builder.call(builder.inttoptr(args[0], of.as_pointer()), list(args[1:]))

        return types.int64(*[types.int64] * 7), generate

    @overload(call)
    def choose(address, A, B, C, D, E, task):  # type: ignore[no-untyped-def]
        return lambda address, A, B, C, D, E, task: jump(address, A, B, C, D, E, task)

    @overload(call_bound)
    def choose_bound(words, task):  # type: ignore[no-untyped-def]
        return lambda words, task: leap(words[0], words[1], words[2], words[3], words[4], words[5], types.int64(task))
