"""Users' Python functions compiled to code that laws can call, and the report of a call that failed.

A function of numbers is compiled by Numba where possible; otherwise it is called back in Python, and a notice reports
it. The code is kept as long as the function exists. It is compiled again when something that the function reads from
outside (a global name, an enclosing function) has changed.
"""

from __future__ import annotations

import ctypes
import signal
import threading
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, ExitStack, contextmanager, nullcontext, suppress
from inspect import CO_VARARGS
from types import CellType, CodeType, FunctionType, ModuleType
from typing import TYPE_CHECKING, Any, NamedTuple
from weakref import WeakKeyDictionary, WeakValueDictionary, ref

import numpy as np

from ..compiler.formulas import LOCK
from ..compiler.kernels import short_reason
from ..errors import ExpressionError, ModelError, PerformanceNotice, warn_user
from ..model.controller import FunctionWithMemory
from ..model.expression_parser import MAX_ARGUMENTS, FunctionCall, function_name
from .bytecode import COMPILED_FUNCTIONS, STACK_RESERVE

if TYPE_CHECKING:
    from ..model.table import Table


_compiled_functions: WeakKeyDictionary[FunctionType, dict[int, CompiledFunction]] = WeakKeyDictionary()
_equal_functions: WeakValueDictionary[Any, CompiledFunction] = (
    WeakValueDictionary()
)  # compiled functions, by everything that determines their code
_notified: WeakValueDictionary[int, Any] = WeakValueDictionary()


class CompiledFunction:
    """Machine code for a Python function of ``count`` numbers, at ``address`` as long as this object exists.

    ``python`` is the function itself, ``reason`` states why it is called back instead of compiled ("" if compiled).
    """

    def __init__(self, python: Callable[..., Any], count: int) -> None:
        self.python, self.count = python, count
        self.original: Callable[[], Any] = lambda: None  # the function that ``python`` is a copy of, if it exists
        self.outside: tuple[Any, ...] = ()
        self.equal: CompiledFunction | None = None
        self._code: Any = None
        key = None
        self.reason = ""
        self.raised: list[Exception] = []  # the last exception of a call from compiled code, if known
        if isinstance(python, FunctionType):
            self.outside = _outside(python, set())
            key = _decisive(python, count, self.outside)
            self.equal = _equal_functions.get(key)  # its code is used for this one, and is kept alive
            try:
                self._code = self.equal._code if self.equal else _compiled(python, count)
            except Exception as error:  # Numba raises many kinds of exceptions
                self.reason = short_reason(error)
        else:
            self.reason = f"it is no plain function but a {type(python).__name__}"
        if self.reason:
            self._code = _callback(python, count, self.raised)
        code = self._code
        self.address = code.address if hasattr(code, "address") else ctypes.cast(code, ctypes.c_void_p).value or 0
        COMPILED_FUNCTIONS.setdefault(self.address, self)
        if key is not None and not self.reason and not self.equal:
            _equal_functions[key] = self

    @property
    def stale(self) -> bool:
        """Whether the function, or something it reads from outside, has changed since it was compiled."""
        plain = self.original()
        return isinstance(plain, FunctionType) and not _same(self.outside, _outside(plain, set()))

    def __reduce__(self) -> Any:
        raise TypeError(
            f"the code of the Python function '{function_name(self.python)}' is at an address of this process and "
            "cannot be sent to another process; send the mechanism, or use threads"
        )


def compile_function(request: FunctionCall) -> CompiledFunction:
    """Compile a Python function that a law calls."""
    count = len(request.names)
    plain: Any = getattr(request.function, "py_func", request.function)  # the Python function under Numba's decorators
    with LOCK:
        if not isinstance(plain, FunctionType):
            made = CompiledFunction(plain, count)
        else:
            codes = _compiled_functions.setdefault(plain, {})
            if count not in codes or not _same(codes[count].outside, _outside(plain, set())):
                # the value must not keep the key alive
                codes[count] = CompiledFunction(_twin(plain, plain.__globals__, plain.__closure__), count)
                codes[count].original = ref(plain)
            made = codes[count]
    if made.reason and not isinstance(plain, FunctionWithMemory):
        _notify_callback(request, plain, made.reason)
    return made


def _compiled(function: FunctionType, count: int) -> Any:
    """The function compiled by Numba with the calling convention of `call_address`; a failure leaves nan."""
    from numba import carray, cfunc, config, types
    from numba.core.errors import NumbaWarning

    if getattr(config, "DISABLE_JIT", False):
        return _callback(function, count, [])
    if MAX_ARGUMENTS != 6:
        raise RuntimeError("the arguments below are six")
    f = _translatable(function, {})
    rows, last = max(count, 1), max(count - 1, 0)

    def law(p):
        x = carray(p, (rows, 3))[:, 0]
        args = (x[0], x[min(1, last)], x[min(2, last)], x[min(3, last)], x[min(4, last)], x[min(5, last)])
        try:
            p[1] = f(*args[:count])
        except Exception:  # `function_fault` runs the function again and finds it
            p[1] = np.nan

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", NumbaWarning)  # hints for users of Numba
        return cfunc(types.void(types.CPointer(types.float64)))(law)


def _callback(function: Callable[..., Any], count: int, raised: list[Exception]) -> Any:
    """Callback from compiled code into Python; the function's last exception is kept in a list."""
    places = [3 * k for k in range(count)]

    def law(p: Any) -> None:
        try:
            p[1] = function(*[p[k] for k in places])
        except (
            BaseException
        ) as error:  # no exception may leave into compiled code; `function_fault` runs the function again
            raised[:] = [error] if isinstance(error, Exception) else raised
            p[1] = np.nan

    return ctypes.CFUNCTYPE(None, ctypes.POINTER(ctypes.c_double))(law)


def _translatable(function: FunctionType, done: dict[FunctionType, Any]) -> Any:
    """The function in a form for Numba, including the plain Python functions that it calls."""
    from numba import njit

    if function in done:
        return done[function]
    scope: dict[str, Any] = {"__builtins__": __builtins__, "__name__": function.__module__}
    closure = tuple(CellType() for _ in function.__closure__ or ())
    made = done[function] = njit(boundscheck=True)(_by_place(_twin(function, scope, closure)))

    def known(name: str, value: Any) -> Any:
        if isinstance(value, list | set | dict):  # Numba would copy its present value
            raise TypeError(f"'{name}' is a {type(value).__name__}, which may change; an array or a tuple would do")
        if isinstance(value, FunctionType) and str(value.__module__).partition(".")[0] not in ("numpy", "flyball"):
            return _translatable(value, done)
        return value

    names = _names(function.__code__)
    scope.update({k: known(k, v) for k, v in function.__globals__.items() if k in names})
    for name, cell, original in zip(function.__code__.co_freevars, closure, function.__closure__ or (), strict=True):
        cell.cell_contents = known(name, original.cell_contents)
    return made


def _twin(function: FunctionType, scope: dict[str, Any], closure: tuple | None) -> FunctionType:
    """Copy of the function with another scope and closure."""
    twin = FunctionType(function.__code__, scope, function.__name__, function.__defaults__, closure or None)
    twin.__kwdefaults__ = function.__kwdefaults__
    twin.__module__, twin.__qualname__ = function.__module__, function.__qualname__
    return twin


def _by_place(function: FunctionType) -> FunctionType:
    """The function with keyword-only arguments made positional, as Numba requires for a positional call."""
    code, by_keyword = function.__code__, function.__kwdefaults__ or {}
    count = code.co_kwonlyargcount
    names = code.co_varnames[code.co_argcount : code.co_argcount + count]
    if count and len(by_keyword) == count and not code.co_flags & CO_VARARGS:
        function.__code__ = code.replace(co_argcount=code.co_argcount + count, co_kwonlyargcount=0)
        function.__defaults__ = (*(function.__defaults__ or ()), *(by_keyword[name] for name in names))
        function.__kwdefaults__ = None
    return function


def _names(code: CodeType) -> set[str]:
    """Global names and attributes that code uses, including nested functions."""
    return set(code.co_names).union(*(_names(c) for c in code.co_consts if isinstance(c, CodeType)))


def _outside(function: FunctionType, done: set[int]) -> tuple[Any, ...]:
    """Everything a function reads from outside, in a form that can be compared later."""
    if id(function) in done:
        return ()
    done.add(id(function))
    names = _names(function.__code__)
    found = [(k, v) for k, v in function.__globals__.items() if k in names]
    for name, cell in zip(function.__code__.co_freevars, function.__closure__ or (), strict=True):
        with suppress(ValueError):  # an empty cell
            found.append((name, cell.cell_contents))
    out: list[Any] = [function.__code__, function.__defaults__]
    for name, value in found:
        if isinstance(value, FunctionType):
            out.append((name, _outside(value, done)))
        elif isinstance(value, ModuleType):
            inside = [(k, value.__dict__[k]) for k in sorted(names) if k in value.__dict__]
            out.append((name, value))
            out += [(name, k, _frozen(v)) for k, v in inside if isinstance(v, bool | int | float | tuple | np.ndarray)]
        else:
            out.append((name, type(value), _frozen(value)))
    return tuple(out)


def _decisive(function: FunctionType, count: int, outside: tuple[Any, ...]) -> tuple[Any, ...] | None:
    """Everything that determines the compiled code of a function, except its location; None if that has no hash."""
    code = function.__code__.replace(co_filename="", co_name="", co_qualname="", co_firstlineno=1, co_linetable=b"")
    by_keyword = function.__kwdefaults__ or {}
    given = (*(function.__defaults__ or ()), *by_keyword.values())
    key = (count, code, tuple(by_keyword), *((type(x), _frozen(x)) for x in given), *outside[2:])
    try:
        hash(key)
    except TypeError:
        return None
    return key


def _frozen(value: Any) -> Any:
    """Comparable snapshot of a value.

    For an array a copy of its numbers, for a number all its bits and, in a tuple, its type.
    """
    if isinstance(value, float):
        return value.hex()
    if isinstance(value, tuple):
        return tuple((type(x), _frozen(x)) for x in value)
    return (value.dtype, value.shape, value.tobytes()) if isinstance(value, np.ndarray) else value


def _same(a: Any, b: Any) -> bool:
    try:
        return bool(a == b)
    except Exception:  # the comparison of the user's objects may raise anything
        return False


def _notify_callback(request: FunctionCall, function: Any, reason: str) -> None:
    """Notify once for each function that it is called back in Python."""
    owner = getattr(function, "__func__", function)
    owner = getattr(owner, "__code__", owner)  # functions made in a loop count as one
    if _notified.get(id(owner)) is owner:
        return
    with suppress(TypeError):  # without weak references the notice is repeated
        _notified[id(owner)] = owner
    warn_user(
        f"{request.where + ': ' if request.where else ''}the Python function '{function_name(function)}' cannot "
        f"be compiled ({reason}). It is called back in Python: a call takes microseconds, with arrays tens of them, "
        f"where compiled code takes some ten nanoseconds, and simulations on several threads wait for each other "
        f"there. Use only numbers, arrays, math and NumPy in it, or give an expression or a Table",
        PerformanceNotice,
    )


@contextmanager
def motion_of(functions: Sequence[CalledFunction], continues: bool) -> Iterator[None]:
    """Context manager of one motion, for functions that depend on their earlier calls in it.

    Raises
    ------
    ModelError
        If there is such a function and the motion continues an earlier one.
    """
    with ExitStack() as stack:
        for f in functions:
            if continues and isinstance(f.native.python, FunctionWithMemory):
                raise ModelError(
                    f"{f.where}: a motion cannot continue an earlier one with it, since results do not contain its "
                    f"state; simulate the whole time in one call"
                )
        calls: list[Any] = [f.native.python for f in functions]
        for memory in dict.fromkeys(x.memory for x in calls if isinstance(x, FunctionWithMemory)):
            stack.enter_context(memory.motion())
        yield


def refuse_function_laws(functions: Sequence[CalledFunction], between_samples: bool = False) -> None:
    """Refuse laws that are Python functions: they have no derivatives.

    ``between_samples`` allows those that are evaluated at sampling instants only.
    """
    with_memory = [f for f in functions if isinstance(f.native.python, FunctionWithMemory)]
    found = [f for f in functions if not between_samples or f not in with_memory]
    if not found:
        return
    f = found[0]
    if f in with_memory:
        raise ModelError(f"{f.where}: it has no derivatives; put a formula in its place, a StateSpace for instance")
    raise ModelError(
        f"law {f.text!r} is a Python function, which has no derivatives; write it as an expression or give a table"
    )


class CalledFunction(NamedTuple):
    """A Python function and how a law calls it."""

    native: CompiledFunction
    names: tuple[str, ...]  # its arguments; "" where a default is given
    text: str
    where: str  # description of the law

    @property
    def title(self) -> str:
        """Description for messages."""
        if isinstance(self.native.python, FunctionWithMemory):
            return self.where
        return f"{self.where + ': ' if self.where else ''}the Python function {self.text}"


class FunctionFault(NamedTuple):
    """Call of a Python function that gave no finite number: its arguments, and the exception, if any."""

    function: CalledFunction
    arguments: tuple[float, ...]
    exception: Exception | None
    value: float

    @property
    def message(self) -> str:
        """Message about the fault."""
        given = zip(self.function.names, self.arguments, strict=True)
        listed = ", ".join(f"{name} = {x:.6g}" for name, x in given if name)
        at = f" for {listed}" if listed else ""
        if isinstance(self.exception, ExpressionError):
            return f"{self.function.title}{at}: {self.exception}"
        if self.exception is None:
            return f"{self.function.title} gives {self.value}{at}; it must give a finite number"
        return f"{self.function.title} raises {type(self.exception).__name__}{at}: {self.exception}"


class TableFault(NamedTuple):
    """Evaluation of a table by a law outside the table's range."""

    where: str  # description of the law
    table: Table
    x: float
    t: float
    exception: None = None

    @property
    def message(self) -> str:
        """Message about the fault."""
        return f"{self.where}: at t = {self.t:.6g} s {self.table.out_of_range_message(self.x)}"


def table_fault(stack: np.ndarray, laws: Mapping[int, str], tables: Mapping[int, Table]) -> TableFault | None:
    """The last law without a value due to a table, or None.

    Parameters
    ----------
    stack : array
        Scratch of the laws after a run; its last `STACK_RESERVE` rows hold the record.
    laws, tables : mapping
        Description of each law by its start in the code; tables by their place among the constants.
    """
    record = np.real(stack[-STACK_RESERVE:])
    if not (record[0, 0] > 0.0 and record[0, 1] < 0.0):
        return None
    return TableFault(laws[int(record[0, 0]) - 1], tables[int(record[0, 2])], float(record[1, 0]), float(record[1, 1]))


def function_fault(
    stack: np.ndarray, functions: Sequence[CalledFunction], overcome: bool = False
) -> FunctionFault | None:
    """The last call of a Python function that gave no finite number, or None.

    The Python function is run again with the same arguments to get the exception, which compiled code does not return.
    A function with internal state may not raise it again; then the last exception raised is used, if known.

    Parameters
    ----------
    stack : array
        Scratch of the laws after a run; its last `STACK_RESERVE` rows hold the record.
    functions : sequence of CalledFunction
        What `compile_law` appended to its list.
    overcome : bool
        Return a call in a step that was then repeated with a shorter step and succeeded without such a call.
    """
    record = np.real(stack[-STACK_RESERVE:])
    at = -record[0, 0] if overcome else record[0, 0]
    if not at > 0.0 or record[0, 1] < 0.0:
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
    return FunctionFault(function, arguments, error, value)


def clear_faults(stack: np.ndarray) -> None:
    """Clear the record of a fault before a run: an analysis may try positions that a law is not made for."""
    stack[-STACK_RESERVE:] = 0.0


def deferred_interrupts(functions: Sequence[CalledFunction]) -> AbstractContextManager[None]:
    """Delay the user's interrupt until compiled code has returned, where that calls back into Python.

    Python would raise KeyboardInterrupt on entering the callback, and ctypes would swallow it.
    """
    return _deferring_interrupts(functions) if functions else nullcontext()


@contextmanager
def _deferring_interrupts(functions: Sequence[CalledFunction]) -> Iterator[None]:
    in_main = threading.current_thread() is threading.main_thread()
    if not in_main or not any(f.native.reason for f in functions) or signal.getsignal(signal.SIGINT) is None:
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
