"""Rank and null spaces of sparse matrices whose rows have unit length: by singular values, or large ones by pivots."""

from __future__ import annotations

from typing import Any

import numpy as np

from .ldl import Pattern, analyse, factor_kernel
from .rank import parts

DENSE = 1500  # rows or columns up to which the rank comes from a singular value decomposition
WEAK = 1e-10  # pivots of a large matrix with unit rows below this count as zero
ADDED = 1e-13  # to the diagonal of such a matrix
SHOWN = 64  # vectors of a large matrix' null spaces that are made


def rank_by_pivots(G: Any) -> int:
    """How many rows are independent, of a large matrix."""
    return G.shape[0] - len(weak_pivots(G @ G.T)[0])


def null_spaces(G: Any) -> tuple[int, np.ndarray, np.ndarray | None]:
    """Rank, basis of the dependencies among rows (n, n - rank), basis of what the rows allow (m, m - rank).

    G is sparse, or an array. Of a large matrix up to `SHOWN` dependencies are given and nothing of what is allowed:
    there would be too much.
    """
    if max(G.shape) <= DENSE:
        p = parts(G if isinstance(G, np.ndarray) else G.toarray())
        return p.rank, p.dependencies, p.null
    count, dependent = sparse_null_space(G @ G.T)
    return G.shape[0] - count, dependent, None


def sparse_null_space(A: Any) -> tuple[int, np.ndarray]:
    """Dimension of the null space of a sparse positive semidefinite matrix, and up to `SHOWN` vectors of its basis."""
    weak, vectors = weak_pivots(A)
    return len(weak), vectors


def weak_pivots(A: Any) -> tuple[np.ndarray, np.ndarray]:
    """Unknowns of a sparse positive semidefinite matrix that those eliminated before them leave nothing of.

    From A = L D L^T in a pattern and order of its own: where a pivot is nothing but what was added to the diagonal,
    L^T x = e_k gives a vector of the null space. Its pivot is x^T A x, so that of a vector spread over very many
    entries is larger by their number: there the quotient of Rayleigh decides.

    Returns
    -------
    weak : ndarray of int
        As many as the null space has dimensions. Of G G^T: rows that depend on the others, which do not on each other.
    vectors : ndarray (n, k)
        Up to `SHOWN` vectors of a basis of the null space.
    """
    import scipy.sparse as sp
    from scipy.sparse.linalg import spsolve_triangular

    n = A.shape[0]
    size = np.sqrt(np.where(A.diagonal() > 0.0, A.diagonal(), 1.0))
    P, L, D = _factor(sp.diags(1.0 / size) @ A @ sp.diags(1.0 / size), ADDED)
    transposed = (sp.csc_matrix((L, P.Li, P.Lp), shape=(n, n)) + sp.identity(n, format="csc")).T.tocsr()

    def vectors(pivots: np.ndarray) -> np.ndarray:
        ends = np.zeros((n, len(pivots)))
        ends[pivots, np.arange(len(pivots))] = 1.0
        return spsolve_triangular(transposed, ends, lower=False) if len(pivots) else ends

    with np.errstate(divide="ignore"):
        pivots = 1.0 / D
    sure, doubtful = ~(pivots > WEAK), (pivots > WEAK) & (pivots < 10.0 * ADDED * n)
    which = np.flatnonzero(doubtful)
    quotients = pivots[which] / np.maximum((vectors(which) ** 2).sum(axis=0), 1.0)
    weak = np.sort(np.r_[np.flatnonzero(sure), which[quotients < 10.0 * ADDED]])
    ends = vectors(weak[:SHOWN])[P.perm] / size[:, None]
    return np.argsort(P.perm)[weak], ends / np.maximum(np.abs(ends).max(axis=0, initial=0.0), 1e-300)


def negative_pivots(A: Any) -> int:
    """How many eigenvalues of a sparse symmetric matrix are negative (Sylvester's law of inertia)."""
    return int((_factor(A, 0.0)[2] < 0.0).sum())


def _factor(A: Any, added: float) -> tuple[Pattern, np.ndarray, np.ndarray]:
    """L D L^T in a pattern and order of its own, of A and so much more on its diagonal; D is inverse."""
    A = A.tocoo()
    n = A.shape[0]
    P, place = analyse(n, A.row, A.col)
    upper = P.perm[A.row] <= P.perm[A.col]  # each pair of entries counts once
    x = np.zeros(len(P.Ai))
    np.add.at(x, place[: A.nnz][upper], A.data[upper])
    x[P.Ap[1:] - 1] += added
    D, L = np.zeros(n), np.zeros(len(P.Li))
    factor_kernel(P, x, L, D, np.zeros(n))
    return P, L, D
