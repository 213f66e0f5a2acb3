"""Sparse L D L^T of a symmetric (quasi-definite) matrix in a fixed pattern.

Up-looking, after Davis, *Algorithm 849: A concise sparse Cholesky factorization package* (2005). The ordering and the
pattern of L are found once (``analyse``); the compiled part only does arithmetic, with no search inside.
"""

from __future__ import annotations

import itertools
from typing import NamedTuple

import numpy as np

from ..compiler.formulas import formula
from ..compiler.kernels import kernel
from ..compiler.layout import Float1, Int1
from ..math.scalar import nonzero
from .dissection import minimum_degree, nested_dissection

LARGE = 300  # unknowns from which on other orders than minimum degree are tried
FILLED = 100.0  # and products for each unknown


class Pattern(NamedTuple):
    """Structure of A (upper triangle, permuted) and L. Column k of A is row k of the lower triangle."""

    perm: Int1  # (n,): place of unknown i in the factored order
    Ap: Int1  # (n + 1,)
    Ai: Int1  # (nA,): the diagonal is the last entry of each column
    Lp: Int1  # (n + 1,): first entry of each column of L
    Li: Int1  # (nL,): rows of L
    Rp: Int1  # (n + 1,): first entry of each row of L
    Ri: Int1  # (nL,): columns of that row, ascending
    Rx: Int1  # (nL,): their places in the columns of L


@formula
def ldl_factor(P, A, L, D, Y):
    """Factor A in place of L and D (D holds the inverse diagonal). Returns 0, or 1 + the row of a zero pivot."""
    n = P.perm.shape[0]
    for k in range(n):
        last = P.Ap[k + 1] - 1
        d = A[last]
        for p in range(P.Ap[k], last):
            Y[P.Ai[p]] = A[p]
        for e in range(P.Rp[k], P.Rp[k + 1]):
            i = P.Ri[e]
            x = P.Rx[e]
            y = Y[i]
            Y[i] = 0.0
            for p in range(P.Lp[i], x):
                Y[P.Li[p]] -= L[p] * y
            l = y * D[i]
            d -= l * y
            L[x] = l
        if not nonzero(d):
            return 1 + k
        D[k] = 1.0 / d
    return 0


@formula
def ldl_solve(P, L, D, x):
    """Solve in place; x is in the factored order."""
    n = P.perm.shape[0]
    for k in range(n):
        v = x[k]
        for p in range(P.Lp[k], P.Lp[k + 1]):
            x[P.Li[p]] -= L[p] * v
    for k in range(n):
        x[k] *= D[k]
    for k in range(n - 1, -1, -1):
        v = x[k]
        for p in range(P.Lp[k], P.Lp[k + 1]):
            v -= L[p] * x[P.Li[p]]
        x[k] = v


def analyse(n: int, i: np.ndarray, j: np.ndarray, order: np.ndarray | None = None) -> tuple[Pattern, np.ndarray]:
    """Order of elimination and pattern of L for a symmetric matrix with entries (i, j).

    Parameters
    ----------
    n : int
        Order of the matrix. The diagonal is always part of the pattern.
    i, j : ndarray of int
        Rows and columns of the entries, either triangle, repeats allowed.
    order : ndarray of int, optional
        Place of every unknown in the order of elimination; if not given, one that makes little work.

    Returns
    -------
    Pattern
    place : ndarray of int
        Where each given entry goes in ``A``, followed by the places of the n diagonal entries.
    """
    i = np.r_[np.asarray(i, np.int64), np.arange(n)]
    j = np.r_[np.asarray(j, np.int64), np.arange(n)]
    L = _best(n, i, j) if order is None else _lower(n, i, j, order)
    row, column = np.minimum(L.perm[i], L.perm[j]), np.maximum(L.perm[i], L.perm[j])
    keys, place = np.unique(column * n + row, return_inverse=True)
    Ap = np.r_[0, np.cumsum(np.bincount(keys // n, minlength=n))].astype(np.int64)
    by_row = np.argsort(L.Li, kind="stable")
    Ri = np.repeat(np.arange(n), np.diff(L.Lp))[by_row]
    Rp = np.r_[0, np.cumsum(np.bincount(L.Li, minlength=n))].astype(np.int64)
    P = Pattern(L.perm, Ap, (keys % n).astype(np.int64), L.Lp, L.Li, Rp, Ri, by_row.astype(np.int64))
    return P, place.astype(np.int64)


class Lower(NamedTuple):
    """An order of elimination and the pattern of L that it makes, by columns."""

    perm: np.ndarray
    Lp: np.ndarray
    Li: np.ndarray

    @property
    def work(self) -> float:
        """Products of a factorisation."""
        column = np.diff(self.Lp).astype(float)
        return float((column * (column + 3.0)).sum() / 2.0)


def _best(n: int, i: np.ndarray, j: np.ndarray) -> Lower:
    """The order that makes less work: minimum degree, or nested dissection where it might pay."""
    L = _lower(n, i, j, minimum_degree(n, i, j))
    if n < LARGE or L.work < FILLED * n:
        return L
    other = _lower(n, i, j, nested_dissection(n, i, j))
    return other if other.work < L.work else L


def _lower(n: int, i: np.ndarray, j: np.ndarray, perm: np.ndarray) -> Lower:
    """Pattern of L: each column has the entries of A and of the columns whose first entry it is (Liu 1986)."""
    row, column = np.minimum(perm[i], perm[j]), np.maximum(perm[i], perm[j])
    order = np.argsort(row, kind="stable")
    start = np.searchsorted(row[order], np.arange(n + 1)).tolist()
    below = column[order].tolist()
    children: list[list[set[int]]] = [[] for _ in range(n)]
    columns: list[list[int]] = []
    for k in range(n):
        found = set(below[start[k] : start[k + 1]]).union(*children[k])
        children[k] = []
        found.discard(k)
        columns.append(sorted(found))
        if found:
            children[columns[-1][0]].append(found)
    Lp = np.r_[0, np.cumsum([len(c) for c in columns])].astype(np.int64)
    return Lower(perm, Lp, np.fromiter(itertools.chain.from_iterable(columns), np.int64, Lp[-1]))


@kernel
def factor_kernel(P: Pattern, A: Float1, L: Float1, D: Float1, Y: Float1) -> None:
    """Factor a sparse symmetric matrix; see ``ldl_factor``."""
    return ldl_factor(P, A, L, D, Y)
