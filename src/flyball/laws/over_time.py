"""Values of a law at many times at once."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from .evaluation import evaluate
from .opcodes import BLEND, FUNCTION, TABLE

ONE_BY_ONE = (TABLE, FUNCTION)  # operations that take nothing but numbers


def takes_arrays(code: np.ndarray, at: int) -> bool:
    """Whether the law that starts at ``at`` can be evaluated on arrays."""
    return not np.isin(_operations(code, at), ONE_BY_ONE).any()


def over_time(
    code: np.ndarray, const: np.ndarray, at: int, x: tuple[np.ndarray, ...], sensed: tuple[np.ndarray, np.ndarray]
) -> np.ndarray:
    """Its values, (n,).

    Parameters
    ----------
    code, const : ndarray
        Of the tables; constants may be arrays over time, (n,).
    at : int
        Where it starts.
    x : tuple of ndarray (n,)
        Time and what else it is a law of.
    sensed : pair of ndarray (slots, n)
        Values of sensors; behind them, the sides of corners that it is on: where it has corners, times that are on the
        same sides are taken together.
    """
    stack, out = np.empty((int(code[at + 1]) + 1, 3), object), np.empty(x[0].shape)
    values, sides = sensed
    corners = (_operations(code, at) == BLEND).any()
    for some in _alike(sides, len(out)) if corners else (slice(None),):
        row = np.empty((1, len(values) + len(sides)), object)
        row[0, :] = [*values[:, some], *(sides[:, some][:, 0] if corners else sides)]
        with np.errstate(all="ignore"):
            out[some] = evaluate(code, _part(const, some), at, stack, tuple(a[some] for a in x), row)
    return out


def _operations(code: np.ndarray, at: int) -> np.ndarray:
    return code[at + 2 : at + 2 + 2 * code[at] : 2]


def _alike(sides: np.ndarray, n: int) -> Iterator[np.ndarray]:
    """Times at which all sides are the same."""
    _, which = np.unique(sides, axis=1, return_inverse=True) if len(sides) else (None, np.zeros(n, int))
    for k in range(int(which.max(initial=-1)) + 1):
        yield np.flatnonzero(which == k)


def _part(const: np.ndarray, some: slice | np.ndarray) -> np.ndarray:
    """Constants at some of the times."""
    if const.dtype != object or isinstance(some, slice):
        return const
    out = const.copy()
    for k, a in enumerate(const):
        out[k] = a[some] if isinstance(a, np.ndarray) else a
    return out
