"""Machine code of functions, and the formulas of a user's own classes, which kernels call by address.

The built-in elements are compiled into the kernels. The formulas of a user's own class are compiled alone, one function
of machine code for each, and a kernel calls them through the addresses in the class's `CodeTable`. So no kernel has to
be compiled again when a user's source changes. `references` says how such a call is made.
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

_tables: WeakKeyDictionary[type, CodeTable] = WeakKeyDictionary()


class Signature(NamedTuple):
    """Arguments and result of a formula that kernels call by address.

    Attributes
    ----------
    name : str
        The attribute of the class that is the formula.
    arguments : str
        Names of its arguments.
    lengths : tuple
        Lengths of the arguments, which are numbers (0) or tuples of numbers, nested as these are.
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

    def __init__(
        self, function: Callable[..., Any], first_order: bool = False, signature: Signature | None = None
    ) -> None:
        self.function, self.first_order, self.signature = function, first_order, signature
        self._loaded: Any = None
        update_wrapper(self, function)

    @property
    def name(self) -> str:
        """Module and name of the function."""
        return f"{self.function.__module__}.{self.function.__qualname__}"

    @property
    def used(self) -> bool:
        """Whether the code is in the memory of this process."""
        return self._loaded is not None

    @property
    def origin(self) -> str:
        """Where the code is from: "shipped", "cache" or "compiled"; empty as long as its address was not read."""
        return self._loaded.origin if self._loaded is not None else ""

    @property
    def address(self) -> int:
        """Address of the code in memory."""
        if self._loaded is None:
            with LOCK:
                if self._loaded is None:
                    from .store import code_of

                    self._loaded = code_of(self)
        return int(self._loaded.address)


class FormulaCode(CompiledCode):
    """The machine code of one formula of a user's own, for floats or for complex numbers."""

    signature: Signature

    def __init__(self, function: FunctionType, first_order: bool, signature: Signature) -> None:
        super().__init__(twin(function, {}), first_order, signature)
        self._original = function

    @property
    def parameters(self) -> tuple[Any, ...]:  # type: ignore[override]
        """Lengths of its arguments."""
        return self.signature.lengths

    @property
    def content(self) -> str:  # type: ignore[override]
        """Hash of the formula, of its signature, and of the functions and numbers that it uses."""
        return f"{self.signature} {self.signature.result} {content(self._original)}"


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
        If a formula is no static method, or has other arguments than its signature.
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
                code = FormulaCode(function, first_order, signature)
                try:
                    words[int(first_order)] = code.address
                except (ImportError, MemoryError):
                    raise
                except Exception as error:  # Numba's, of many kinds
                    raise ModelError(_cannot_compile(self.owner, signature, first_order, error)) from error
                self._code.append(code)

    def _content(self) -> str:
        return " ".join(content(f) for f in self.functions if f is not None)

    def __reduce__(self) -> Any:
        return code_table, (self.owner, self.signatures)


def code_table(owner: type, signatures: Sequence[Signature], required: Sequence[Signature] = ()) -> CodeTable:
    """The code table of a class; a new one where a formula has changed.

    Raises
    ------
    ModelError
        If the class lacks a required formula, or one is not as its signature says.
    """
    for x in required:
        if not hasattr(owner, x.name):
            raise ModelError(
                f"{owner.__name__} has no formula {x}; define it as a static method. It returns {x.returns}"
            )
    with LOCK:
        found = _tables.get(owner)
        if found is None or found.stale:
            found = _tables[owner] = CodeTable(owner, signatures)
        return found


def addresses(tables: Sequence[CodeTable | None]) -> np.ndarray:
    """Addresses of code tables; 0 of None."""
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
    """The line of an error of Numba that says what is wrong."""
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
