"""Small linear systems solved in straight-line code on expressions: no inverse is ever formed, and nothing is decided.

Equations are taken block by block in an order in which they can be solved. Blocks of up to three are solved by Cramer's
rule, whose determinants are what vanishes at a singular position; larger ones by orthogonalisation (modified
Gram-Schmidt of the matrix with its right-hand sides appended, which is backward stable without pivots: Björck 1967).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ...graph.arrays import zeros
from ...math.scalar import sqrt
from .blocks import Block, blocks

CRAMER = 3  # unknowns up to which determinants are written out


@dataclass
class Determinants:
    """What must not vanish: (which unknowns, expression)."""

    found: list[tuple[tuple[int, ...], Any]] = field(default_factory=list)

    def add(self, columns: list[int], value: Any) -> None:
        """Another one; plain numbers are none."""
        if not getattr(value, "known", True):
            self.found.append((tuple(columns), value))


def pattern(A: np.ndarray) -> np.ndarray:
    """Which entries are no zeros."""
    return np.array([[x != 0.0 for x in row] for row in A], bool).reshape(A.shape)


def solve(A: np.ndarray, B: np.ndarray, dets: Determinants, order: list[Block] | None = None) -> np.ndarray:
    """X with A X = B.

    Parameters
    ----------
    A, B : ndarray of Node (n, n), (n, m)
    dets : Determinants
        Those of the blocks are added.
    order : list of Block, optional
        The blocks of A; found here if not given.

    Raises
    ------
    ZeroDivisionError
        If A is singular by its pattern.
    """
    order = blocks(pattern(A)) if order is None else order
    if order is None:
        raise ZeroDivisionError("the equations are singular")
    X = zeros(*B.shape)
    done: list[int] = []
    for rows, columns in order:
        right = B[rows] - times(A[np.ix_(rows, done)], X[done])
        X[columns] = _block(A[np.ix_(rows, columns)], right, columns, dets)
        done += columns
    return X


def transposed(order: list[Block]) -> list[Block]:
    """Blocks of the transposed matrix."""
    return [(columns, rows) for rows, columns in reversed(order)]


def times(A: np.ndarray, B: np.ndarray) -> np.ndarray:
    """A B, zeros dropped."""
    out = zeros(len(A), *B.shape[1:])
    for i, row in enumerate(A):
        for k, a in enumerate(row):
            if a != 0.0:
                out[i] = out[i] + a * B[k]
    return out


def _block(A: np.ndarray, B: np.ndarray, columns: list[int], dets: Determinants) -> np.ndarray:
    n = len(A)
    if n > CRAMER:
        return _orthogonal(A, B, columns, dets)
    adjugate, det = _adjugate(A)
    dets.add(columns, det)
    return times(adjugate, B) / det


def _adjugate(A: np.ndarray) -> tuple[np.ndarray, Any]:
    """Adjugate and determinant of up to three rows."""
    n = len(A)
    out = zeros(n, n)
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
    C, R, Y = B.copy(), zeros(n, n), zeros(*B.shape)
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
    X = zeros(*B.shape)
    for k in reversed(range(n)):
        X[k] = (Y[k] - times(R[k : k + 1, k + 1 :], X[k + 1 :])[0]) / R[k, k]
    return X


def _dot(a: np.ndarray, b: np.ndarray) -> Any:
    return sum((x * y for x, y in zip(a, b, strict=True) if x != 0.0 and y != 0.0), 0.0)


def solve_symmetric(M: np.ndarray, B: np.ndarray, pivots: Determinants) -> np.ndarray:
    """X with M X = B by M = L D L^T, for a positive definite M; the pivots are added."""
    n = len(M)
    L, D = zeros(n, n), zeros(n)
    for k in range(n):
        for j in range(k):
            L[k, j] = (M[k, j] - sum((L[k, i] * D[i] * L[j, i] for i in range(j)), 0.0)) / D[j]
        D[k] = M[k, k] - sum((L[k, i] * L[k, i] * D[i] for i in range(k)), 0.0)
        pivots.add([k], D[k])
    X = B.copy()
    for k in range(n):
        X[k] = X[k] - times(L[k : k + 1, :k], X[:k])[0]
    for k in range(n):
        X[k] = X[k] / D[k]
    for k in reversed(range(n)):
        X[k] = X[k] - times(L[k + 1 :, k : k + 1].T, X[k + 1 :])[0]
    return X
