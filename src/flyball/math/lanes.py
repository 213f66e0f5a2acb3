"""A number for many runs at once: formulas are evaluated once, each run has what it has by itself, to the bit.

``Lanes`` holds one float for each run and passes for an expression (`math/scalar.py`), so that all code that fills
tables takes it. Every operation is the one of floats, lane by lane. Where code decides by a number, all lanes have to
decide alike; else ``Diverged`` says which do and which do not.
"""

from __future__ import annotations

import operator
from collections.abc import Callable, Iterable, Mapping
from functools import wraps
from typing import Any, TypeVar

import numpy as np

from . import scalar

F = TypeVar("F", bound=Callable[..., Any])


class Diverged(Exception):
    """Lanes decide differently; ``yes`` (n,) says how each does."""

    def __init__(self, yes: np.ndarray) -> None:
        super().__init__("lanes decide differently")
        self.yes = yes


def _agreed(yes: np.ndarray) -> bool:
    if yes.all():
        return True
    if yes.any():
        raise Diverged(yes)
    return False


def _two(function: Callable[[Any, Any], Any]) -> Any:
    def forward(self: Lanes, other: Any) -> Any:
        if isinstance(other, np.ndarray):
            return NotImplemented
        return Lanes(function(self.x, other.x if type(other) is Lanes else other))

    return forward


def _two_back(function: Callable[[Any, Any], Any]) -> Any:
    def backward(self: Lanes, other: Any) -> Any:
        return Lanes(function(other, self.x))

    return backward


def _compared(function: Callable[[Any, Any], Any]) -> Any:
    def compare(self: Lanes, other: Any) -> Any:
        if isinstance(other, np.ndarray):
            return NotImplemented
        return _agreed(function(self.x, other.x if type(other) is Lanes else other))

    return compare


class Lanes:
    """One float for each run, (n,). What is no decision goes lane by lane; what is none of floats raises."""

    __slots__ = ("x",)
    __hash__ = None  # type: ignore[assignment]
    called = ()
    known = True  # decisions by it are its lanes' own
    imag = 0.0

    def __init__(self, x: np.ndarray) -> None:
        self.x = x

    @property
    def real(self) -> Lanes:
        """Itself."""
        return self

    __add__, __radd__ = _two(operator.add), _two_back(operator.add)
    __sub__, __rsub__ = _two(operator.sub), _two_back(operator.sub)
    __mul__, __rmul__ = _two(operator.mul), _two_back(operator.mul)
    __lt__, __le__ = _compared(operator.lt), _compared(operator.le)
    __gt__, __ge__ = _compared(operator.gt), _compared(operator.ge)
    __eq__, __ne__ = _compared(operator.eq), _compared(operator.ne)

    def __truediv__(self, other: Any) -> Any:
        if isinstance(other, np.ndarray):
            return NotImplemented
        return _quotient(self.x, other.x if type(other) is Lanes else other)

    def __rtruediv__(self, other: Any) -> Any:
        return _quotient(other, self.x)

    def __pow__(self, other: Any) -> Any:
        if isinstance(other, np.ndarray):
            return NotImplemented
        return lanewise(operator.pow, self, other)

    def __rpow__(self, other: Any) -> Any:
        return lanewise(operator.pow, other, self)

    def __neg__(self) -> Lanes:
        return Lanes(-self.x)

    def __pos__(self) -> Lanes:
        return self

    def __abs__(self) -> Lanes:
        return Lanes(np.abs(self.x))

    def __bool__(self) -> bool:
        return _agreed(self.x != 0.0)

    def __float__(self) -> float:
        if not (self.x == self.x[0]).all():
            raise TypeError("lanes are no single number")
        return float(self.x[0])

    def conjugate(self) -> Lanes:
        """Itself."""
        return self

    def sqrt(self) -> Lanes:
        """Square root, for NumPy."""
        _agreed(self.x >= 0.0)
        return Lanes(np.sqrt(self.x))

    def apply(self, name: str, *args: Any) -> Any:
        """A function of `scalar` by its name."""
        return lanewise(getattr(scalar, name), *args)

    def granted(self, what: str) -> bool:
        """Whether it is "positive", or "nonzero" and a number."""
        return _agreed(self.x > 0.0 if what == "positive" else (self.x != 0.0) & (self.x == self.x))


def _quotient(a: Any, b: Any) -> Lanes:
    """Floats that are divided by zero raise."""
    if not _agreed(np.asarray(b != 0.0)):
        raise ZeroDivisionError("float division by zero")
    return Lanes(a / b)


def lanewise(function: Callable[..., Any], *args: Any) -> Lanes:
    """A function of numbers for every lane, as floats have it."""
    n = next(len(a.x) for a in args if type(a) is Lanes)
    columns = [a.x.tolist() if type(a) is Lanes else [a] * n for a in args]
    return Lanes(np.array([function(*row) for row in zip(*columns, strict=True)], float))


def over_time(x: Any) -> Any:
    """What a formula over time takes: of lanes, which then are times, the array of them."""
    return x.x if type(x) is Lanes else x


def has_lanes(values: Iterable[Any]) -> bool:
    """Whether one of these is for many runs."""
    return any(type(x) is Lanes for x in values)


def laned(x: Any) -> bool:
    """Whether an array has such a number in it."""
    return isinstance(x, np.ndarray) and x.dtype == object and has_lanes(x.ravel().tolist())


def deciding(x: np.ndarray) -> np.ndarray:
    """What is decided by: real parts, or the lanes themselves."""
    return x if laned(x) else scalar.real_parts(x)


def spread(x: Any, n: int) -> np.ndarray:
    """An array of objects as floats (n, ...): its lanes first."""
    x = np.asarray(x)
    out = np.empty((n, x.size))
    for k, a in enumerate(x.ravel().tolist()):
        out[:, k] = a.x if type(a) is Lanes else a
    return out.reshape(n, *x.shape)


def gathered(rows: np.ndarray) -> Any:
    """The reverse: an array of objects from floats (n, ...); plain numbers where all lanes have the same bits."""
    flat = rows.reshape(len(rows), -1)
    same = (flat.view(np.int64) == flat.view(np.int64)[0]).all(axis=0)
    out = np.empty(flat.shape[1], object)
    out[:] = [float(c[0]) if s else Lanes(np.ascontiguousarray(c)) for c, s in zip(flat.T, same, strict=True)]
    return out.reshape(rows.shape[1:]) if rows.ndim > 1 else out[0]


def per_lane(function: F) -> F:
    """Let a function of arrays and numbers take each lane by itself, where there are lanes: for what decides."""

    @wraps(function)
    def each(*args: Any) -> Any:
        n = count(args)
        if n == 0:
            return function(*args)
        many = [spread(a, n) if type(a) is Lanes or np.asarray(a).dtype == object else None for a in args]
        found = [function(*(_run(a, x, k) for a, x in zip(args, many, strict=True))) for k in range(n)]
        if isinstance(found[0], tuple):
            return tuple(gathered(np.array(part, float)) for part in zip(*found, strict=True))
        return gathered(np.array(found, float))

    return each  # type: ignore[return-value]


def _run(plain: Any, many: np.ndarray | None, k: int) -> Any:
    return plain if many is None else many[k] if many.ndim > 1 else float(many[k])


def over_lanes(function: F) -> F:
    """Give a function of arrays that takes leading axes all lanes at once, as the first."""

    @wraps(function)
    def at_once(*args: Any) -> Any:
        n = count(args)
        return gathered(function(*(spread(a, n) for a in args))) if n else function(*args)

    return at_once  # type: ignore[return-value]


def count(values: Iterable[Any]) -> int:
    """How many lanes there are; 0 if these are plain."""
    for x in values:
        if type(x) is Lanes:
            return len(x.x)
        if isinstance(x, np.ndarray) and x.dtype == object and (n := count(x.ravel().tolist())):
            return n
    return 0


def lanes_of(points: np.ndarray, names: Iterable[str]) -> Mapping[str, Lanes]:
    """Parameters from points (n, parameters)."""
    return {name: Lanes(np.ascontiguousarray(x)) for name, x in zip(names, points.T, strict=True)}
