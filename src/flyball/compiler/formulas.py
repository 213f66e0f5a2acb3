"""Formulas: plain Python code that compiled code may call.

``@formula`` marks it. The function itself stays plain Python, so the same source runs on floats, complex numbers,
arrays over time and symbols. What compiled code makes of a function is registered when something is compiled
(`emit`), and never before: describing and checking a mechanism does not pay for a compiler.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any, TypeVar
from weakref import WeakValueDictionary

F = TypeVar("F", bound=Callable[..., Any])

OPTIONS: dict[str, Any] = {"error_model": "numpy", "_nrt": False}  # division as in C; nothing is allocated
LOCK = threading.RLock()
KERNELS: list[Any] = []  # every `kernels.Kernel`
FIRST_ADDRESS = 1 << 16
"""No code table stands at a smaller address; the numbers of the kinds of built-in elements are smaller."""
CODE_TABLES: WeakValueDictionary[int, Any] = WeakValueDictionary()
"""The `by_address.CodeTable` at an address, as long as it exists."""
_formulas: list[Callable[..., Any]] = []
_callbacks: list[Callable[[], None]] = []
_overload: list[Any] = []  # `target.overload`, once something is compiled


def formula(function: F) -> F:
    """Let compiled code call ``function``; the function itself stays plain Python and can be run on any numbers."""
    _formulas.append(function)
    _register()
    return function


def when_compiling(callback: Callable[[], None]) -> Callable[[], None]:
    """Run ``callback`` once before anything is compiled (at once if something was)."""
    _callbacks.append(callback)
    _register()
    return callback


def register_all(overload: Any) -> None:
    """Tell the compiler of every formula, those of the future included, by ``target.overload``."""
    _overload[:] = [overload]
    _register()


def _register() -> None:
    if _overload:
        with LOCK:
            while _formulas:
                _make_callable(_formulas.pop(0))
            while _callbacks:
                _callbacks.pop(0)()


def _make_callable(function: Callable[..., Any]) -> None:
    _overload[0](function, strict=False)(lambda *args, **more: function)


def by_address(fields):  # type: ignore[no-untyped-def]
    """The named tuple by its address, in compiled code; the tuple itself in plain Python."""
    return fields


def call(address, A, B, C, D, E, task):  # type: ignore[no-untyped-def]
    """Call the kernel at ``address`` with five structures and a task; in compiled code only."""
    raise NotImplementedError("kernels are called by address from compiled code only")


def call_bound(words, task):  # type: ignore[no-untyped-def]
    """Call a kernel with structures bound to it (`kernels.BoundKernel.words`); in compiled code only."""
    raise NotImplementedError("kernels are called by address from compiled code only")


def formula_at(table, k, arguments, like):  # type: ignore[no-untyped-def]
    """Call formula k of the code table at an address.

    In compiled code its code is called, in plain Python the function itself.

    Parameters
    ----------
    table : int
        Address of a `by_address.CodeTable`; of any other number the result is ``like``.
    k : int
    arguments : tuple
    like : number or tuple
        The result where there is no such table; it has the type of every result.
    """
    found = CODE_TABLES.get(int(table))
    return like if found is None else found.functions[k](*arguments)


def has_formula(table, k):  # type: ignore[no-untyped-def]
    """Whether there is a code table at an address, and formula k in it."""
    found = CODE_TABLES.get(int(table))
    return found is not None and found.functions[k] is not None
