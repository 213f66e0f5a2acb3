"""Python functions of users made into code that compiled laws can call.

A function of numbers is compiled by Numba where Numba can; otherwise it is called back in Python, and a notice says so.
Either way the same code serves as long as the function lives, and is made again when a number that it takes from
outside (a global name, an enclosing function) has changed: compiled code would go on with the old one.
"""

from __future__ import annotations

import ctypes
import signal
import sys
import threading
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from types import BuiltinFunctionType, CellType, CodeType, FunctionType, ModuleType
from typing import Any, NamedTuple
from weakref import WeakKeyDictionary, WeakValueDictionary

import numpy as np

from .._jit import PACKAGE, _lock, start_numba
from ..errors import ExpressionError, PerformanceNotice
from ..model.expressions import Expression
from ..model.function import MOST, function_name
from .call import NATIVE, STACK_RESERVE

_made: WeakKeyDictionary[FunctionType, dict[int, Native]] = WeakKeyDictionary()
_told: WeakValueDictionary[int, Any] = WeakValueDictionary()


class Native:
    """Machine code for a Python function of ``count`` numbers, at ``address`` as long as this object lives."""

    def __init__(self, python: Callable[..., Any], count: int) -> None:
        self.python, self.count = python, count
        self.raised: list[Exception] = []  # the last exception of a call from compiled code, where it can be known
        self.seen: Any = None
        self.reason = ""
        if isinstance(python, FunctionType):
            self.seen = _outside(python)
            try:
                self.code = _compiled(python, count)
            except Exception as error:  # Numba gives up in many ways
                self.reason = _short(error)
        else:
            self.reason = f"it is no plain function but a {type(python).__name__}"
        if self.reason:
            self.code = _callback(python, count, self.raised)
        self.address = _address(self.code)
        NATIVE[self.address] = self

    @property
    def compiled(self) -> bool:
        """Whether it runs without Python."""
        return not self.reason


class Called(NamedTuple):
    """A Python function as some law calls it."""

    native: Native
    names: tuple[str, ...]  # its arguments
    text: str
    where: str  # what it is the law of

    @property
    def title(self) -> str:
        """What it is, for messages."""
        return f"{self.where + ': ' if self.where else ''}the Python function {self.text}"


class Fault(NamedTuple):
    """A call of a Python function that gave no finite number: with which arguments, and what it raised, if it did."""

    function: Called
    arguments: tuple[float, ...]
    exception: Exception | None
    value: float

    @property
    def message(self) -> str:
        """What happened, in words."""
        given = ", ".join(f"{n} = {x:.6g}" for n, x in zip(self.function.names, self.arguments, strict=True))
        at = f" for {given}" if given else ""
        if self.exception is None:
            return f"{self.function.title} gives {self.value}{at}; make it give a finite number there"
        if isinstance(self.exception, ExpressionError):
            return f"{self.function.title}{at}: {self.exception}"
        return f"{self.function.title} raises {type(self.exception).__name__}{at}: {self.exception}"


def native(expression: Expression, count: int) -> Native:
    """The code of a law that is a Python function of ``count`` numbers; made once, as long as the function lives."""
    function = expression.function
    plain = getattr(function, "py_func", function)  # the Python under Numba's own decorators
    with _lock:
        if not isinstance(plain, FunctionType):
            made = Native(plain, count)  # type: ignore[arg-type]
        else:
            codes = _made.setdefault(plain, {})
            made = codes.get(count)  # type: ignore[assignment]
            if made is None or not _same(made.seen, _outside(plain)):
                made = codes[count] = Native(_twin(plain, plain.__globals__, plain.__closure__), count)
    if made.reason:
        _tell(expression, plain, made.reason)
    return made


def fault(stack: np.ndarray, functions: Sequence[Called], overcome: bool = False) -> Fault | None:
    """The last call that gave no finite number, or None.

    The Python function is run again with the same arguments, for the exception that compiled code has swallowed. A
    function with a memory may not raise it again; then it is the one that it raised last, if that is known.

    Parameters
    ----------
    stack : array
        Scratch of the laws after a run; its last `STACK_RESERVE` rows hold the record.
    functions : sequence of Called
        What `compile_law` appended to its list.
    overcome : bool
        Ask for a call in a step that was taken again, shorter, and then did without such a call.
    """
    record = np.real(stack[-STACK_RESERVE:])
    at = -record[0, 0] if overcome else record[0, 0]
    if not at > 0.0:
        return None
    function = functions[int(at) - 1]
    arguments = tuple(record[1:].ravel()[: int(record[0, 1])].tolist())
    value, error = float(record[0, 2]), None
    try:
        given = function.native.python(*arguments)
    except Exception as raised:
        error = raised
    else:
        try:
            value = float(given)
        except (TypeError, ValueError):
            error = ExpressionError(f"it returned {given!r} ({type(given).__name__}); a law returns a number")
    if error is None and np.isfinite(value) and function.native.raised:
        error = function.native.raised[0]
    return Fault(function, arguments, error, value)


@contextmanager
def interrupts_kept(functions: Sequence[Called]) -> Iterator[None]:
    """Keep the user's interrupt until the compiled code has returned, where it calls back into Python.

    Python would raise KeyboardInterrupt inside the callback, where ctypes swallows it.
    """
    here = threading.current_thread() is threading.main_thread()
    if not here or all(f.native.compiled for f in functions) or signal.getsignal(signal.SIGINT) is None:
        yield
        return
    asked: list[int] = []
    before = signal.signal(signal.SIGINT, lambda number, frame: asked.append(number))
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
    if asked:
        signal.raise_signal(signal.SIGINT)


def _compiled(function: FunctionType, count: int) -> Any:
    """The function compiled by Numba, behind the calling convention of `call`; a failure leaves nan."""
    start_numba()
    from numba import carray, cfunc, config, types

    if getattr(config, "DISABLE_JIT", False):
        return _callback(function, count, [])
    f = _translatable(function, {})
    rows, last = max(count, 1), max(count - 1, 0)

    def law(p):
        x = carray(p, (rows, 3))[:, 0]
        args = (x[0], x[min(1, last)], x[min(2, last)], x[min(3, last)], x[min(4, last)], x[min(5, last)])
        try:
            p[1] = f(*args[:count])
        except Exception:  # whatever it is: nan stays
            p[1] = np.nan

    if MOST != 6:
        raise RuntimeError("the arguments above are six")
    return cfunc(types.void(types.CPointer(types.float64)))(law)


def _callback(function: Callable[..., Any], count: int, raised: list[Exception]) -> Any:
    """A way from compiled code back into Python; what the function raises last is kept in a list."""
    places = [3 * k for k in range(count)]

    def law(p: Any) -> None:
        try:
            p[1] = function(*[p[k] for k in places])
        except Exception as error:  # nan stays; `fault` runs the function again for the exception
            raised[:] = [error]
            p[1] = np.nan
        except BaseException:
            p[1] = np.nan

    return ctypes.CFUNCTYPE(None, ctypes.POINTER(ctypes.c_double))(law)


def _address(code: Any) -> int:
    return code.address if hasattr(code, "address") else ctypes.cast(code, ctypes.c_void_p).value or 0


def _translatable(function: FunctionType, done: dict[FunctionType, Any]) -> Any:
    """The function for Numba, plain Python functions that it calls included."""
    from numba import njit

    if function in done:
        return done[function]
    scope: dict[str, Any] = {"__builtins__": __builtins__, "__name__": function.__globals__.get("__name__")}
    closure = tuple(CellType() for _ in function.__closure__ or ())
    made = done[function] = njit(_twin(function, scope, closure))

    def known(value: Any) -> Any:
        ours = isinstance(value, FunctionType) and value.__module__.partition(".")[0] not in ("numpy", "flyball")
        return _translatable(value, done) if ours else value

    names = _names(function.__code__)
    scope.update({k: known(v) for k, v in function.__globals__.items() if k in names})
    for cell, original in zip(closure, function.__closure__ or (), strict=True):
        cell.cell_contents = known(original.cell_contents)
    return made


def _twin(function: FunctionType, scope: dict[str, Any], closure: tuple | None) -> FunctionType:
    """The same function as another object, so that keeping it does not keep the user's."""
    twin = FunctionType(function.__code__, scope, function.__name__, function.__defaults__, closure or None)
    twin.__kwdefaults__ = function.__kwdefaults__
    twin.__module__, twin.__qualname__ = function.__module__, function.__qualname__
    return twin


def _names(code: CodeType) -> set[str]:
    """Global names and attributes that code uses, functions inside it included."""
    return set(code.co_names).union(*(_names(c) for c in code.co_consts if isinstance(c, CodeType)))


def _outside(function: FunctionType, done: set[int] | None = None) -> tuple[Any, ...]:
    """What a function takes from outside, in a form that can be compared later."""
    done = set() if done is None else done
    if id(function) in done:
        return ()
    done.add(id(function))
    names = _names(function.__code__)
    found = [(k, v) for k, v in function.__globals__.items() if k in names]
    for name, cell in zip(function.__code__.co_freevars, function.__closure__ or (), strict=True):
        try:
            found.append((name, cell.cell_contents))
        except ValueError:  # not filled yet
            found.append((name, None))
    out: list[Any] = [function.__code__, function.__defaults__]
    for name, value in found:
        if isinstance(value, ModuleType):
            inside = ((k, value.__dict__[k]) for k in sorted(names) if k in value.__dict__)
            out += [(name, k, v) for k, v in inside if isinstance(v, bool | int | float | complex | str | tuple)]
            out += [(name, k, v.tobytes()) for k, v in inside if isinstance(v, np.ndarray)]
        elif isinstance(value, np.ndarray):
            out.append((name, value.dtype, value.shape, value.tobytes()))
        elif isinstance(value, FunctionType):
            out.append((name, _outside(value, done)))
        elif not isinstance(value, BuiltinFunctionType):
            out.append((name, value))
    return tuple(out)


def _same(a: Any, b: Any) -> bool:
    try:
        return bool(a == b)
    except Exception:  # things that do not compare
        return False


def _short(error: Exception) -> str:
    """The line of an error of Numba that says what is wrong."""
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    lines = [line for line in lines if not line.startswith(("Failed in", "During:"))] or [type(error).__name__]
    return lines[0][:200]


def _tell(expression: Expression, function: Any, reason: str) -> None:
    """Say once for each function that it is called back in Python."""
    owner = getattr(function, "__func__", function)
    if _told.get(id(owner)) is owner:
        return
    with suppress(TypeError):  # of what cannot be referred to weakly it is told again
        _told[id(owner)] = owner
    who = f"{expression.where}: " if expression.where else ""
    depth, frame = 1, sys._getframe(0)
    while frame.f_back is not None and Path(frame.f_code.co_filename).is_relative_to(PACKAGE):
        depth, frame = depth + 1, frame.f_back
    warnings.warn(
        f"{who}the Python function '{function_name(function)}' cannot be compiled ({reason}). It is called back in "
        f"Python: each call takes about a hundred times as long, and simulations on several threads wait "
        f"for each other there. Use only numbers, arrays, math and NumPy in it, or give an expression or a Table",
        PerformanceNotice,
        stacklevel=depth,
    )
