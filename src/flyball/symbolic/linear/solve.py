"""Linear equations between expressions: Gaussian elimination as straight-line code, pivots chosen by value."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ...graph.arrays import zeros

GOOD = 1e-3  # part of the largest pivot that one which is simpler may have
NOTHING = 1e-12  # part of its row below which a pivot is none


class Dependent(Exception):
    """Equations that depend on each other: ``row`` is left without a pivot."""

    def __init__(self, row: int) -> None:
        super().__init__(f"row {row} depends on the others")
        self.row = row


def number(x: Any) -> float:
    """Its value with the parameters' own values."""
    return float(x.real)


def numbers(A: np.ndarray) -> np.ndarray:
    """Values of an array of expressions."""
    return np.array([number(x) for x in A.ravel()], float).reshape(A.shape)


def product(A: np.ndarray, B: np.ndarray) -> np.ndarray:
    """A B, zeros left out."""
    out = zeros(A.shape[0], B.shape[1])
    for i, row in enumerate(A):
        for k, a in enumerate(row):
            if not is_zero(a):
                for j in range(B.shape[1]):
                    if not is_zero(B[k, j]):
                        out[i, j] = out[i, j] + a * B[k, j]
    return out


def is_zero(x: Any) -> bool:
    """Whether it is zero for all values of everything."""
    return bool(x == 0.0)


def solved(A: np.ndarray, B: np.ndarray) -> np.ndarray:
    """X with A X = B.

    Parameters
    ----------
    A : ndarray (n, n)
        Nodes or numbers.
    B : ndarray (n, m)

    Raises
    ------
    Dependent
        If A is singular with the parameters' own values.
    """
    A, B = A.astype(object), B.astype(object)
    n = len(A)
    size = np.abs(numbers(A)).max(axis=1, initial=0.0)
    left, columns = list(range(n)), list(range(n))
    order: list[tuple[int, int]] = []
    for _ in range(n):
        i, j = _pivot(A, left, columns, size)
        order.append((i, j))
        left.remove(i)
        columns.remove(j)
        for k in left:
            if not is_zero(A[k, j]):
                f = A[k, j] / A[i, j]
                _less(A[k], f, A[i], columns)
                _less(B[k], f, B[i], range(B.shape[1]))
                A[k, j] = 0.0
    X = zeros(n, B.shape[1])
    known: list[int] = []
    for i, j in reversed(order):
        for m in range(B.shape[1]):
            x = B[i, m]
            for k in known:
                if not is_zero(A[i, k]) and not is_zero(X[k, m]):
                    x = x - A[i, k] * X[k, m]
            X[j, m] = x / A[i, j] if not is_zero(x) else 0.0
        known.append(j)
    return X


def _less(row: np.ndarray, f: Any, other: np.ndarray, columns: Sequence[int]) -> None:
    for m in columns:
        if not is_zero(other[m]):
            row[m] = row[m] - f * other[m]


def _pivot(A: np.ndarray, left: Sequence[int], columns: Sequence[int], size: np.ndarray) -> tuple[int, int]:
    """The simplest entry that is large enough: a number, in a row and column with few others (Markowitz 1957)."""
    found = []
    part = {(i, j): abs(number(A[i, j])) / (size[i] or 1.0) for i in left for j in columns if not is_zero(A[i, j])}
    largest = max(part.values(), default=0.0)
    if not largest > NOTHING:
        raise Dependent(left[0])
    for (i, j), x in part.items():
        if x >= GOOD * largest:
            r = sum((i, k) in part for k in columns) - 1
            c = sum((k, j) in part for k in left) - 1
            known = isinstance(A[i, j], int | float) or A[i, j].known
            found.append((r * c, not known, -x, i, j))
    *_, i, j = min(found)
    return i, j
