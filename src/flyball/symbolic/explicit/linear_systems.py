"""Linear systems of expressions: without pivoting in straight-line code, and with pivots chosen by value.

Without pivoting, equations and unknowns are matched (Hopcroft and Karp 1973) and ordered in block triangular form (the
strongly connected components of Tarjan 1972; Duff and Reid 1978). Blocks of up to three are solved by Cramer's rule,
whose determinants vanish at a singular position; larger ones by orthogonalisation (modified Gram-Schmidt of the matrix
with its right-hand sides appended, which is backward stable without pivoting: Björck 1967). `solve_equations` is
Gaussian elimination with pivots chosen by the parameters' own values.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ...derivatives.linearized_equations import product
from ...expression_graph.graph import zero_objects
from ...math.scalar import sqrt

Block = tuple[list[int], list[int]]
"""Equations and the unknowns that they determine together."""


def solution_blocks(pattern: np.ndarray) -> list[Block] | None:
    """Blocks in an order of solution.

    Parameters
    ----------
    pattern : ndarray of bool (n, n)
        Whether an unknown (column) occurs in an equation (row).

    Returns
    -------
    list of (rows, columns) or None
        None if the equations are singular by their pattern.
    """
    import scipy.sparse as sp
    from scipy.sparse.csgraph import connected_components, maximum_bipartite_matching

    n = len(pattern)
    if n == 0:
        return []
    match = maximum_bipartite_matching(sp.csr_matrix(pattern), perm_type="column")  # row -> column
    if (match < 0).any():
        return None
    moved = pattern[:, match]  # equation k is now solved for unknown k
    count, label = connected_components(sp.csr_matrix(moved), directed=True, connection="strong")
    rows = [np.flatnonzero(label == k).tolist() for k in range(count)]
    needs = [{int(label[j]) for r in rows[k] for j in np.flatnonzero(moved[r])} - {k} for k in range(count)]
    return [(rows[k], match[rows[k]].tolist()) for k in _in_order(needs, [min(match[r]) for r in rows])]


def _in_order(needs: Sequence[set[int]], first: Sequence[int]) -> list[int]:
    """Order in which each block follows those it needs, else by their first unknowns."""
    done: list[int] = []
    left = sorted(range(len(needs)), key=lambda k: first[k])
    while left:
        k = next(k for k in left if needs[k] <= set(done))
        done.append(k)
        left.remove(k)
    return done


MAX_CRAMER = 3  # largest block solved by Cramer's rule


@dataclass
class Determinants:
    """Determinants that must not vanish: (indices of unknowns, expression)."""

    found: list[tuple[tuple[int, ...], Any]] = field(default_factory=list)

    def add(self, columns: list[int], value: Any) -> None:
        """Add one; plain numbers are ignored."""
        if not getattr(value, "known", True):
            self.found.append((tuple(columns), value))


def nonzero_pattern(A: np.ndarray) -> np.ndarray:
    """Which entries are not zero."""
    return np.array([[x != 0.0 for x in row] for row in A], bool).reshape(A.shape)


def solve_blocks(A: np.ndarray, B: np.ndarray, dets: Determinants, order: list[Block] | None = None) -> np.ndarray:
    """Solve A X = B.

    Parameters
    ----------
    A, B : ndarray of Node (n, n), (n, m)
    dets : Determinants
        The determinants of the blocks are added.
    order : list of Block, optional
        Blocks of A; computed if not given.

    Raises
    ------
    ZeroDivisionError
        If A is singular by its pattern.
    """
    order = solution_blocks(nonzero_pattern(A)) if order is None else order
    if order is None:
        raise ZeroDivisionError("the equations are singular")
    X = zero_objects(*B.shape)
    done: list[int] = []
    for rows, columns in order:
        right = B[rows] - product(A[np.ix_(rows, done)], X[done])
        X[columns] = _block(A[np.ix_(rows, columns)], right, columns, dets)
        done += columns
    return X


def transposed_blocks(order: list[Block]) -> list[Block]:
    """Blocks of the transposed matrix."""
    return [(columns, rows) for rows, columns in reversed(order)]


def _block(A: np.ndarray, B: np.ndarray, columns: list[int], dets: Determinants) -> np.ndarray:
    n = len(A)
    if n > MAX_CRAMER:
        return _orthogonal(A, B, columns, dets)
    adjugate, det = _adjugate(A)
    dets.add(columns, det)
    return product(adjugate, B) / det


def _adjugate(A: np.ndarray) -> tuple[np.ndarray, Any]:
    """Adjugate and determinant of up to three rows."""
    n = len(A)
    out = zero_objects(n, n)
    if n == 1:
        out[0, 0] = 1.0
    elif n == 2:
        out[:] = [[A[1, 1], -A[0, 1]], [-A[1, 0], A[0, 0]]]
    else:
        for i in range(3):
            for j in range(3):
                (a, b), (c, d) = [k for k in range(3) if k != j], [k for k in range(3) if k != i]
                minor = A[a, c] * A[b, d] - A[a, d] * A[b, c]
                out[i, j] = minor if (i + j) % 2 == 0 else -minor
    return out, sum((A[0, k] * out[k, 0] for k in range(n)), 0.0)


def _orthogonal(A: np.ndarray, B: np.ndarray, columns: list[int], dets: Determinants) -> np.ndarray:
    n = len(A)
    Q = [A[:, k].copy() for k in range(n)]
    C, R, Y = B.copy(), zero_objects(n, n), zero_objects(*B.shape)
    det: Any = 1.0
    for k in range(n):
        R[k, k] = sqrt(sum((x * x for x in Q[k]), 0.0))
        det = det * R[k, k]
        e = Q[k] / R[k, k]
        for j in range(k + 1, n):
            R[k, j] = _dot(e, Q[j])
            Q[j] = Q[j] - R[k, j] * e
        for j in range(B.shape[1]):
            Y[k, j] = _dot(e, C[:, j])
            C[:, j] = C[:, j] - Y[k, j] * e
    dets.add(columns, det)
    X = zero_objects(*B.shape)
    for k in reversed(range(n)):
        X[k] = (Y[k] - product(R[k : k + 1, k + 1 :], X[k + 1 :])[0]) / R[k, k]
    return X


def _dot(a: np.ndarray, b: np.ndarray) -> Any:
    return sum((x * y for x, y in zip(a, b, strict=True) if x != 0.0 and y != 0.0), 0.0)


def solve_symmetric(M: np.ndarray, B: np.ndarray, pivots: Determinants) -> np.ndarray:
    """Solve M X = B by M = L D L^T for a positive definite M; the pivots are added to ``pivots``."""
    n = len(M)
    L, D = zero_objects(n, n), zero_objects(n)
    for k in range(n):
        for j in range(k):
            L[k, j] = (M[k, j] - sum((L[k, i] * D[i] * L[j, i] for i in range(j)), 0.0)) / D[j]
        D[k] = M[k, k] - sum((L[k, i] * L[k, i] * D[i] for i in range(k)), 0.0)
        pivots.add([k], D[k])
    X = B.copy()
    for k in range(n):
        X[k] = X[k] - product(L[k : k + 1, :k], X[:k])[0]
    for k in range(n):
        X[k] = X[k] / D[k]
    for k in reversed(range(n)):
        X[k] = X[k] - product(L[k + 1 :, k : k + 1].T, X[k + 1 :])[0]
    return X


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
