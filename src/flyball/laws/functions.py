"""Python functions as laws call them, and what is left of a call that failed, or of a table asked beyond its ends."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ..errors import ExpressionError
from .call import STACK_RESERVE
from .native import Native

if TYPE_CHECKING:
    from ..model.table import Table


class Called(NamedTuple):
    """A Python function as some law calls it."""

    native: Native
    names: tuple[str, ...]  # its arguments; "" where a default is given
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
        given = zip(self.function.names, self.arguments, strict=True)
        listed = ", ".join(f"{name} = {x:.6g}" for name, x in given if name)
        at = f" for {listed}" if listed else ""
        if isinstance(self.exception, ExpressionError):
            return f"{self.function.title}{at}: {self.exception}"
        if self.exception is None:
            return f"{self.function.title} gives {self.value}{at}; it must give a finite number"
        return f"{self.function.title} raises {type(self.exception).__name__}{at}: {self.exception}"


class Missed(NamedTuple):
    """A table that a law asked for a value that it has not."""

    where: str  # what it is the law of
    table: Table
    x: float
    t: float
    exception: None = None

    @property
    def message(self) -> str:
        """What happened, in words."""
        return f"{self.where}: at t = {self.t:.6g} s {self.table.told_beyond(self.x)}"


def missed(stack: np.ndarray, laws: Mapping[int, str], tables: Mapping[int, Table]) -> Missed | None:
    """The last law that a table left without a value, or None.

    Parameters
    ----------
    stack : array
        Scratch of the laws after a run; its last `STACK_RESERVE` rows hold the record.
    laws, tables : mapping
        What each law is the law of, by its start in the code; tables by their place among the constants.
    """
    record = np.real(stack[-STACK_RESERVE:])
    if not (record[0, 0] > 0.0 and record[0, 1] < 0.0):
        return None
    return Missed(laws[int(record[0, 0]) - 1], tables[int(record[0, 2])], float(record[1, 0]), float(record[1, 1]))


def fault(stack: np.ndarray, functions: Sequence[Called], overcome: bool = False) -> Fault | None:
    """The last call of a Python function that gave no finite number, or None.

    The Python function is run again with the same arguments, for the exception that compiled code does not tell. A
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
    return Fault(function, arguments, error, value)


def forget(stack: np.ndarray) -> None:
    """Wipe the record of a fault, as before a run: an analysis may try positions that a law is not made for."""
    stack[-STACK_RESERVE:] = 0.0


def interrupts_kept(functions: Sequence[Called]) -> AbstractContextManager[None]:
    """Keep the user's interrupt until compiled code has returned, where that calls back into Python.

    Python would raise KeyboardInterrupt on entering the callback, and ctypes would swallow it.
    """
    return _kept(functions) if functions else nullcontext()


@contextmanager
def _kept(functions: Sequence[Called]) -> Iterator[None]:
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
