"""Kernels: entry points of compiled code, called by Python or, by their addresses, by other kernels.

The parameters of a kernel are structures of arrays, arrays and numbers (`layout`). It is compiled as a whole with all
formulas that it calls, and its code is kept in a file (`store`). Numba is imported only where something is compiled.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from functools import cached_property
from typing import Any

import numpy as np

from .buffers import StructBuffer, described
from .by_address import CompiledCode
from .formulas import KERNELS
from .layout import Array, Struct, parameters
from .sources import source_hash


def kernel(function: Callable[..., Any]) -> Kernel:
    """Make ``function`` a compiled entry point."""
    return Kernel(function)


def first_order_kernel(function: Callable[..., Any]) -> Kernel:
    """The same for complex numbers that carry steps: (a + i b)(c + i d) = a c + i (a d + b c)."""
    return Kernel(function, first_order=True)


class Kernel(CompiledCode):
    """A compiled entry point, found in the store or compiled when it is first needed.

    Attributes
    ----------
    parameters : tuple
        Layouts of its parameters; `int` and `float` are numbers.
    """

    def __init__(self, function: Callable[..., Any], first_order: bool = False) -> None:
        super().__init__(function, first_order)
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
    def content(self) -> str:
        """Hash of all sources that it is made of."""
        return source_hash(self.function)

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
    """An array as kernels read it.

    Parameters
    ----------
    x : ndarray
        It is kept.
    of : Array
    name : str
        In a message where it is not of that type.
    """

    def __init__(self, x: np.ndarray, of: Array, name: str) -> None:
        self.array = x
        self.words = np.array(described(x, of, name), np.int64)
        self.address = self.words.ctypes.data


def _buffer(x: Any, of: Any, kernel: Kernel) -> Any:
    if of is int:
        return int(x)
    if of is float:
        return float(x)
    if isinstance(of, Array):
        return x if isinstance(x, ArrayBuffer) else ArrayBuffer(x, of, kernel.name)
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
        self.words = np.array([self.address, *self._addresses], np.int64)  # for `formulas.call_bound`

    def __call__(self, task: int) -> int:
        """Have a task done."""
        return int(self.kernel.call(*self._addresses, task))
