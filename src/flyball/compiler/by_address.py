"""Compiled code by its address: what every kernel is, and the formulas of classes that are not flyball's own.

A kernel that calls formulas of elements has those of the built-in elements in it. The formulas of a user's class are
compiled alone, each behind an entry point of its own, and called by the addresses in the class's `CodeTable`, so that
no kernel depends on the user's source. `references` says how they are called.
"""

from __future__ import annotations

import inspect
import threading
from collections.abc import Callable, Sequence
from functools import update_wrapper
from types import FunctionType
from typing import Any, NamedTuple
from weakref import WeakKeyDictionary

import numpy as np

from ..errors import ModelError
from .formulas import CODE_TABLES, LOCK
from .sources import content, twin

_made: WeakKeyDictionary[type, CodeTable] = WeakKeyDictionary()


class Form(NamedTuple):
    """How kernels call a formula.

    Attributes
    ----------
    name : str
        The attribute of the class that is the formula.
    arguments : str
        Names of its arguments.
    shapes : tuple
        Lengths of the arguments, nested as the tuples are; 0 is a number.
    result : int or tuple
        Lengths of the result.
    """

    name: str
    arguments: str
    shapes: tuple[Any, ...]
    result: Any

    def __str__(self) -> str:
        return f"{self.name}({self.arguments})"


class CompiledCode:
    """A function's machine code, found in the store or compiled when it is first needed.

    Parameters
    ----------
    function : function
    first_order : bool
        Whether it is for complex numbers that carry steps.
    form : Form
        Of a formula that kernels call by its address.
    """

    parameters: Any
    content: Any

    def __init__(self, function: Callable[..., Any], first_order: bool = False, form: Form | None = None) -> None:
        self.function, self.first_order, self.form = function, first_order, form
        self._loaded: Any = None
        update_wrapper(self, function)

    @property
    def name(self) -> str:
        """By which it is known: module and function."""
        return f"{self.function.__module__}.{self.function.__qualname__}"

    @property
    def used(self) -> bool:
        """Whether this process has its code."""
        return self._loaded is not None

    @property
    def origin(self) -> str:
        """Where its code is from: "shipped", "cache", "compiled"; empty if this process has not needed it."""
        return self._loaded.origin if self._loaded is not None else ""

    @property
    def address(self) -> int:
        """Where its code is."""
        if self._loaded is None:
            with LOCK:
                if self._loaded is None:
                    from .store import code_of

                    self._loaded = code_of(self)
        return int(self._loaded.address)


class FormulaCode(CompiledCode):
    """Code of one formula for one type of numbers."""

    form: Form

    def __init__(self, function: FunctionType, first_order: bool, form: Form) -> None:
        super().__init__(twin(function, {}), first_order, form)
        self._original = function

    @property
    def parameters(self) -> tuple[Any, ...]:  # type: ignore[override]
        """Lengths of its arguments."""
        return self.form.shapes

    @property
    def content(self) -> str:  # type: ignore[override]
        """Hash of the formula and all that it calls."""
        return f"{self.form} {self.form.result} {content(self._original)}"


class CodeTable:
    """The formulas of a class by address: two words a formula, its code for floats and for complex numbers.

    Parameters
    ----------
    owner : type
    forms : sequence of Form
        The formulas that kernels may call.

    Attributes
    ----------
    functions : tuple
        The formulas of the class; None where it has none of that name.
    address : int
        Valid as long as the table exists.

    Raises
    ------
    ModelError
        If a formula is no static method with the arguments of its form.
    """

    def __init__(self, owner: type, forms: Sequence[Form]) -> None:
        self.owner, self.forms = owner, tuple(forms)
        self.functions = tuple(_function(owner, f) for f in forms)
        self.content = self._content()
        self._words = np.zeros((len(forms), 2), np.int64)
        self._code: list[FormulaCode] = []
        self._lock = threading.RLock()
        self.address = int(self._words.ctypes.data)
        CODE_TABLES[self.address] = self

    @property
    def stale(self) -> bool:
        """Whether a formula, or a number that it takes from outside, is no longer what it was."""
        return self.functions != tuple(_function(self.owner, f) for f in self.forms) or self.content != self._content()

    def make_ready(self, first_order: bool) -> None:
        """Load or compile the code of every formula.

        Raises
        ------
        ModelError
            If one cannot be compiled.
        """
        for form, function, words in zip(self.forms, self.functions, self._words, strict=True):
            if function is None or words[int(first_order)]:
                continue
            with self._lock:
                code = FormulaCode(function, first_order, form)
                try:
                    words[int(first_order)] = code.address
                except (ImportError, MemoryError):
                    raise
                except Exception as error:  # Numba's, of many kinds
                    raise ModelError(_refusal(self.owner, form, first_order, error)) from error
                self._code.append(code)

    def _content(self) -> str:
        return " ".join(content(f) for f in self.functions if f is not None)

    def __reduce__(self) -> Any:
        return code_table, (self.owner, self.forms)


def code_table(owner: type, forms: Sequence[Form]) -> CodeTable:
    """The code table of a class, made anew where a formula has changed."""
    with LOCK:
        found = _made.get(owner)
        if found is None or found.stale:
            found = _made[owner] = CodeTable(owner, forms)
        return found


def make_ready(addresses: np.ndarray, first_order: bool) -> None:
    """Load or compile the code of the tables at some addresses; 0 is none.

    Raises
    ------
    ModelError
        If a formula cannot be compiled.
    """
    for address in set(addresses.tolist()) - {0}:
        CODE_TABLES[address].make_ready(first_order)


def short_reason(error: Exception) -> str:
    """The line of an error of Numba that says what is wrong."""
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    lines = [line for line in lines if not line.startswith(("Failed in", "During:"))] or [type(error).__name__]
    return lines[0][:200]


def _function(owner: type, form: Form) -> Callable[..., Any] | None:
    static = inspect.getattr_static(owner, form.name, None)
    if static is None:
        return None
    function = getattr(owner, form.name)
    code = getattr(function, "__code__", None)
    if not isinstance(static, staticmethod) or code is None:
        raise ModelError(
            f"{owner.__name__}.{form.name} must be a static method, a plain function {form}: write "
            f"{form.name}: ClassVar = staticmethod({form.name}), or @staticmethod above it"
        )
    if code.co_argcount != len(form.shapes):
        raise ModelError(
            f"{owner.__name__}.{form.name} takes {', '.join(code.co_varnames[: code.co_argcount])}; it must take "
            f"{form.arguments}"
        )
    return function  # type: ignore[no-any-return]


def _refusal(owner: type, form: Form, first_order: bool, error: Exception) -> str:
    numbers = "complex numbers, which derivatives are computed with" if first_order else "floats"
    return (
        f"{owner.__name__}.{form.name} cannot be compiled for {numbers}: {short_reason(error)}. A formula uses "
        f"numbers, tuples of these, and functions of flyball.math and of your own that do the same"
    )
