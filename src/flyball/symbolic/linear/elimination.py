"""Gaussian elimination on expressions with pivots chosen by value, and detection of zero expressions.

The size of the terms of a sum bounds its rounding error.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ...expression_graph.evaluation import nodes_in_order, symbols_of
from ...expression_graph.graph import ADD, CALL, DIVIDE, MULTIPLY, NUMBER, OPERATIONS, SYMBOL, Node, zero_objects

GOOD_PIVOT = 1e-3  # smallest accepted pivot relative to the largest, if its expression is simpler
ZERO_TOLERANCE = 1e-12  # pivots below this part of their row count as zero


class DependentEquations(Exception):
    """The equations are dependent: ``row`` has no pivot."""

    def __init__(self, row: int) -> None:
        super().__init__(f"row {row} depends on the others")
        self.row = row


def nominal_value(x: Any) -> float:
    """Value of an expression with the parameters' own values."""
    return float(x.real)


def nominal_values(A: np.ndarray) -> np.ndarray:
    """Values of an array of expressions."""
    return np.array([nominal_value(x) for x in A.ravel()], float).reshape(A.shape)


def matrix_product(A: np.ndarray, B: np.ndarray) -> np.ndarray:
    """Product A B, skipping zeros."""
    out = zero_objects(A.shape[0], B.shape[1])
    for i, row in enumerate(A):
        for k, a in enumerate(row):
            if not is_zero(a):
                for j in range(B.shape[1]):
                    if not is_zero(B[k, j]):
                        out[i, j] = out[i, j] + a * B[k, j]
    return out


def is_zero(x: Any) -> bool:
    """Whether an expression is identically zero."""
    return bool(x == 0.0)


def solve_equations(A: np.ndarray, B: np.ndarray) -> np.ndarray:
    """Solve A X = B.

    Parameters
    ----------
    A : ndarray (n, n)
        Nodes or numbers.
    B : ndarray (n, m)

    Raises
    ------
    DependentEquations
        If A is singular with the parameters' own values.
    """
    A, B = A.astype(object), B.astype(object)
    n = len(A)
    size = np.abs(nominal_values(A)).max(axis=1, initial=0.0)
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
                _subtract_multiple(A[k], f, A[i], columns)
                _subtract_multiple(B[k], f, B[i], range(B.shape[1]))
                A[k, j] = 0.0
    X = zero_objects(n, B.shape[1])
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


def _subtract_multiple(row: np.ndarray, f: Any, other: np.ndarray, columns: Sequence[int]) -> None:
    for m in columns:
        if not is_zero(other[m]):
            row[m] = row[m] - f * other[m]


def _pivot(A: np.ndarray, remaining: Sequence[int], columns: Sequence[int], size: np.ndarray) -> tuple[int, int]:
    """Simplest entry that is large enough: a number, in a row and column with few others (Markowitz 1957)."""
    found = []
    part = {
        (i, j): abs(nominal_value(A[i, j])) / (size[i] or 1.0)
        for i in remaining
        for j in columns
        if not is_zero(A[i, j])
    }
    largest = max(part.values(), default=0.0)
    if not largest > ZERO_TOLERANCE:
        raise DependentEquations(remaining[0])
    for (i, j), x in part.items():
        if x >= GOOD_PIVOT * largest:
            r = sum((i, k) in part for k in columns) - 1
            c = sum((k, j) in part for k in remaining) - 1
            known = isinstance(A[i, j], int | float) or A[i, j].known
            found.append((r * c, not known, -x, i, j))
    *_, i, j = min(found)
    return i, j


ROUNDING_TOLERANCE = 1e-12  # values below this part of the terms are rounding
RANDOM_DRAWS = 3


def values_and_sizes(nodes: Sequence[Any], values: Mapping[str, float] | None = None) -> list[tuple[float, float]]:
    """(value, sum of the absolute values of all terms) of expressions, with the parameters' own or other values."""
    told = values or {}
    found: dict[int, tuple[float, float]] = {}
    for x in nodes_in_order(nodes):
        a = [found[k.index] for k in x.args]
        own = [v for v, _ in a]
        if x.op == NUMBER:
            value = x.value
        elif x.op == SYMBOL:
            value = told.get(x.data.name, x.value)
        else:
            value = float(x.data.python(*own) if x.op == CALL else OPERATIONS[x.op](*own))
        if x.op in (ADD, MULTIPLY):
            size = float(OPERATIONS[x.op](*(s for _, s in a)))
        elif x.op == DIVIDE:
            size = a[0][1] / abs(own[1]) if own[1] else float("inf")
        else:
            size = 1.0 if x.op in ("sin", "cos") else abs(value)
        found[x.index] = (value, size)
    return [found[x.index] if isinstance(x, Node) else (float(x), abs(float(x))) for x in nodes]


def identically_zero(nodes: Sequence[Any]) -> list[bool]:
    """Which expressions are identically zero, tested with random parameter values near their own."""
    rng = np.random.default_rng(0)
    out = np.ones(len(nodes), bool)
    for _ in range(RANDOM_DRAWS):
        told = {s.data.name: (s.value or 0.1) * float(rng.uniform(0.7, 1.3)) for s in symbols_of(nodes)}
        out &= np.array([abs(x) <= ROUNDING_TOLERANCE * size for x, size in values_and_sizes(nodes, told)], bool)
    return [bool(x) for x in out]
