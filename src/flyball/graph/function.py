"""Functions that a graph knows by name only: tables, and what users have written in Python."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from ..math.spline import BREAKS, PIECE, piece, spline

ORDERS = 4  # a cubic's value and derivatives that are not zero


class Function:
    """A function that the graph knows by name only: of the user's, or a table.

    Parameters
    ----------
    name : str
    python : callable
        Its value for numbers.
    derivatives : callable, optional
        From the index of an argument to the `Function` that is the derivative by it; raises `Opaque` if there is none.
    """

    def __init__(
        self, name: str, python: Callable[..., Any], derivatives: Callable[[int], Function] | None = None, **told: Any
    ) -> None:
        self.name, self.python, self._derivatives = name, python, derivatives
        self.told = told  # what printers of a certain kind of function need

    def __call__(self, *args: Any) -> Any:
        """Its value for numbers; element by element for arrays."""
        if any(np.ndim(x) for x in args):
            return np.frompyfunc(self.python, len(args), 1)(*args).astype(float)
        return self.python(*args)

    @property
    def shown(self) -> str:
        """Its name as it is printed: of derivatives of a table with primes."""
        return self.name + "'" * self.told.get("order", 0)

    def derivative(self, k: int) -> Function:
        """By the k-th argument."""
        if self._derivatives is None:
            raise Opaque(f"the derivative of {self.name!r} is not known: it is a Python function")
        return self._derivatives(k)


class Opaque(Exception):
    """Something is asked of a function that is known by name only."""


class Functions:
    """The functions of one graph, each once."""

    def __init__(self) -> None:
        self._found: dict[Any, Any] = {}
        self.names: dict[int, str] = {}  # of tables, by where they begin
        self._kept: list[Any] = []  # what keys stand for lives as long

    def opaque(self, python: Callable[..., Any]) -> Function:
        """A Python function of the user's."""
        found = self._found.get(id(python))
        if found is None:
            name = getattr(python, "__name__", type(python).__name__)
            found = self._found[id(python)] = Function(name, python)
            self._kept.append(python)
        return found

    def table(self, data: Any, at: int) -> tuple[Sequence[Function], list[Any]]:
        """The spline at ``data[at]``: its value and derivatives, and which of its numbers are no plain numbers.

        These are further arguments of the functions, whose derivatives by them are not known.
        """
        count = int(data[at + 1].real)
        end = at + BREAKS + count + PIECE * (count + 1)
        numbers = [data[k] for k in range(at, end)]
        moved = [k for k, x in enumerate(numbers) if not isinstance(x, int | float) and not getattr(x, "known", False)]
        plain = [float(x.real) for x in numbers]
        key = (at, np.array(plain).tobytes(), *[numbers[k] for k in moved])
        found = self._found.get(key)
        if found is None:
            found = self._found[key] = orders(plain, moved, at, self.names.get(at, f"table{at}"))
        return found, [numbers[k] for k in moved]


def orders(data: list[float], moved: list[int], at: int, name: str) -> list[Function]:
    """Value and derivatives of a spline whose numbers ``moved`` are given anew with each call."""

    def of(order: int) -> Callable[..., Any]:
        def value(x: Any, *others: Any) -> Any:
            numbers = np.array(data)
            numbers[moved] = others
            return spline(numbers, 0, x)[order] if order < 3 else third(numbers, x)

        return value

    made: list[Function] = []

    def next_of(order: int) -> Callable[[int], Function]:
        def derivative(k: int) -> Function:
            if k > 0:
                raise Opaque("derivatives by the points of a table are not known")
            return made[order + 1] if order + 1 < ORDERS else zero

        return derivative

    zero = Function("zero", lambda *args: 0.0 * args[0], lambda k: zero, constant=0.0)
    for order in range(ORDERS):
        made.append(Function(name, of(order), next_of(order), table=data, moved=moved, order=order, at=at))
        made[order].told["value"] = made[0]
    return made


def third(data: np.ndarray, x: Any) -> Any:
    """Third derivative of a spline at x: six times the last coefficient of the piece."""
    start, _ = piece(data, 0, x)
    return 6.0 * data[np.asarray(start) + PIECE - 1]
