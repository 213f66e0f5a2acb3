"""Sparse L D L^T of a symmetric (quasi-definite) matrix in a fixed pattern.

Up-looking, after Davis, *Algorithm 849: A concise sparse Cholesky factorization package* (2005). The ordering and the
pattern of L are found once (``analyse``); the compiled part only does arithmetic, with no search inside.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..compiler.jit import formula, kernel


class Pattern(NamedTuple):
    """Structure of A (upper triangle, permuted) and L. Column k of A is row k of the lower triangle."""

    perm: np.ndarray  # (n,): place of unknown i in the factored order
    Ap: np.ndarray  # (n + 1,)
    Ai: np.ndarray  # (nA,): the diagonal is the last entry of each column
    Lp: np.ndarray  # (n + 1,): first entry of each column of L
    Li: np.ndarray  # (nL,): rows of L
    Rp: np.ndarray  # (n + 1,): first entry of each row of L
    Ri: np.ndarray  # (nL,): columns of that row, ascending
    Rx: np.ndarray  # (nL,): their places in the columns of L


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
        if d.real == 0.0 or d.real != d.real:
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


def analyse(n: int, i: np.ndarray, j: np.ndarray) -> tuple[Pattern, np.ndarray]:
    """Minimum-degree ordering and pattern of L for a symmetric matrix with entries (i, j).

    Parameters
    ----------
    n : int
        Order of the matrix. The diagonal is always part of the pattern.
    i, j : ndarray of int
        Rows and columns of the entries, either triangle, repeats allowed.

    Returns
    -------
    Pattern
    place : ndarray of int
        Where each given entry goes in ``A``, followed by the places of the n diagonal entries.
    """
    i = np.r_[np.asarray(i, np.int64), np.arange(n)]
    j = np.r_[np.asarray(j, np.int64), np.arange(n)]
    perm = _minimum_degree(n, i, j)
    row, column = np.minimum(perm[i], perm[j]), np.maximum(perm[i], perm[j])
    keys, place = np.unique(column * n + row, return_inverse=True)
    Ai = keys % n
    Ap = np.r_[0, np.cumsum(np.bincount(keys // n, minlength=n))].astype(np.int64)
    return _symbolic(n, perm, Ap, Ai.astype(np.int64)), place.astype(np.int64)


def _minimum_degree(n: int, i: np.ndarray, j: np.ndarray) -> np.ndarray:
    import scipy.sparse as sp
    from scipy.sparse.linalg import splu

    if n < 3:
        return np.arange(n, dtype=np.int64)
    ones = sp.coo_matrix((np.ones(2 * len(i)), (np.r_[i, j], np.r_[j, i])), shape=(n, n)).tocsc()
    ones.data[:] = -1.0
    ones.setdiag(2.0 * n)  # diagonally dominant: the trial factorisation only yields the ordering
    lu = splu(ones.tocsc(), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    return np.asarray(lu.perm_c, np.int64)


def _symbolic(n: int, perm: np.ndarray, Ap: np.ndarray, Ai: np.ndarray) -> Pattern:
    """Rows of L through the elimination tree (Liu 1986)."""
    parent = [-1] * n
    mark = [-1] * n
    rows: list[list[int]] = []
    for k in range(n):
        mark[k] = k
        found = []
        for i in Ai[Ap[k] : Ap[k + 1] - 1].tolist():
            while mark[i] != k:
                if parent[i] == -1:
                    parent[i] = k
                found.append(i)
                mark[i] = k
                i = parent[i]
        rows.append(sorted(found))
    Rp = np.r_[0, np.cumsum([len(r) for r in rows])].astype(np.int64)
    Ri = np.array([i for r in rows for i in r], np.int64)
    Lp = np.r_[0, np.cumsum(np.bincount(Ri, minlength=n))].astype(np.int64)
    fill = Lp[:-1].copy()
    Li = np.zeros(len(Ri), np.int64)
    Rx = np.zeros(len(Ri), np.int64)
    for k, r in enumerate(rows):
        for at, i in enumerate(r, start=Rp[k]):
            Rx[at] = fill[i]
            Li[fill[i]] = k
            fill[i] += 1
    return Pattern(perm, Ap, Ai, Lp, Li, Rp, Ri, Rx)


@kernel
def factor_kernel(P, A, L, D, Y):
    """Factor a sparse symmetric matrix; see ``ldl_factor``."""
    return ldl_factor(P, A, L, D, Y)
