"""Rank and null spaces of sparse matrices whose rows have unit length: by singular values, or large ones by pivots."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np

from .ldl import Pattern, analyse, factor_kernel
from .rank import TOLERANCE, parts
from .rank import rank as rank_of_array

FEW = 150  # rows or columns up to which singular values take no longer than pivots
DENSE = 1500  # rows or columns up to which they decide where pivots leave a doubt
CLEAR = 1e-8  # pivots of unit rows above this are surely some: singular values of 1e-4 and more
WEAK = 1e-10  # pivots of a large matrix with unit rows below this count as zero
SPREAD = 1e-5  # up to this one may be nothing but what was added, of a vector whose square is up to 1e8
ADDED = 1e-13  # to the diagonal of such a matrix
ROOM = 2**24  # numbers (128 MB) that the vectors of a null space may have, of a matrix that is larger than `DENSE`


def rank(G: Any) -> int:
    """How many rows are independent, of a sparse matrix or an array."""
    if max(G.shape) > FEW and (found := by_pivots(G)) is not None:
        return found[0]
    return rank_of_array(_array(G))


def null_spaces(G: Any) -> tuple[int, np.ndarray, np.ndarray | None]:
    """Rank, basis of the dependencies among rows (n, n - rank), basis of what the rows allow (m, m - rank).

    G is sparse, or an array. Where pivots decide, the dependencies are no orthonormal basis, and nothing of what is
    allowed is given; of a matrix larger than `DENSE` as many dependencies are as there is `ROOM` for.
    """
    if max(G.shape) > FEW and (found := by_pivots(G)) is not None:
        return *found, None
    q = parts(_array(G))
    return q.rank, q.dependencies, q.null


def by_pivots(G: Any) -> tuple[int, np.ndarray] | None:
    """Rank, and a basis of the dependencies among rows; None where pivots leave a doubt that singular values do not."""
    import scipy.sparse as sp

    G = sp.csr_matrix(G)
    p = Pivots(G @ G.T)
    basis = p.vectors(p.shown) if max(G.shape) > DENSE else p.dependencies(G)
    return None if basis is None else (int(G.shape[0]) - len(p.weak), basis)


def _array(G: Any) -> np.ndarray:
    return G if isinstance(G, np.ndarray) else np.asarray(G.toarray())


def sparse_null_space(A: Any) -> tuple[int, np.ndarray]:
    """Dimension of the null space of a sparse positive semidefinite matrix, and its basis as far as there is `ROOM`."""
    weak, vectors = weak_pivots(A)
    return len(weak), vectors


def weak_pivots(A: Any) -> tuple[np.ndarray, np.ndarray]:
    """Unknowns of a sparse positive semidefinite matrix that those eliminated before them leave nothing of.

    Returns
    -------
    weak : ndarray of int
        As many as the null space has dimensions. Of G G^T: rows that depend on the others, which do not on each other.
    vectors : ndarray (n, k)
        A basis of the null space: as many of its vectors as there is `ROOM` for.
    """
    p = Pivots(A)
    return np.argsort(p.pattern.perm)[p.weak], p.vectors(p.shown)


class Pivots:
    """Pivots of a sparse positive semidefinite matrix, in an order of its own: where they are none.

    From A = L D L^T: where a pivot is nothing but what was added to the diagonal, L^T x = e_k gives a vector of the
    null space. Its pivot is x^T A x, so that of a vector with very many entries, or with large ones, is larger by its
    square: there the quotient of Rayleigh decides.

    Attributes
    ----------
    weak : ndarray of int
        Which of them are none, in their order.
    least : float
        The least of the others.
    """

    def __init__(self, A: Any) -> None:
        import scipy.sparse as sp

        n = A.shape[0]
        self.size = np.sqrt(np.where(A.diagonal() > 0.0, A.diagonal(), 1.0))
        unit = sp.diags(1.0 / self.size)
        self.pattern, L, self.inverse = _factor(unit @ A @ unit, ADDED)
        self.lower = sp.csc_matrix((L, self.pattern.Li, self.pattern.Lp), shape=(n, n)) + sp.identity(n, format="csc")
        with np.errstate(divide="ignore"):
            pivots = 1.0 / self.inverse
        sure, doubtful = ~(pivots > WEAK), (pivots > WEAK) & (pivots < SPREAD)
        found = [np.flatnonzero(sure)]
        for which in np.split(rest := np.flatnonzero(doubtful), range(most(n), len(rest), most(n))):
            quotients = pivots[which] / np.maximum((self._ends(which) ** 2).sum(axis=0), 1.0)
            found.append(which[quotients < 10.0 * ADDED])
        self.weak = np.sort(np.concatenate(found))
        self.least = float(np.delete(pivots, self.weak).min(initial=np.inf))

    @property
    def shown(self) -> np.ndarray:
        """Those weak pivots for whose vectors there is `ROOM`."""
        return self.weak[: most(len(self.inverse))]

    def vectors(self, which: np.ndarray) -> np.ndarray:
        """Vectors (n, k) of the null space that belong to weak pivots, their largest entry 1."""
        return _scaled(self._ends(which)[self.pattern.perm] / self.size[:, None])

    def dependencies(self, G: Any) -> np.ndarray | None:
        """A basis (n, k) of the null space where the matrix is G G^T; None if it is in doubt what is none.

        What was added to the diagonal is taken out by a step of inverse iteration; what is left of x G then says
        whether rows depend on one another as truly as singular values tell it.
        """
        if not self.least > CLEAR:
            return None
        x = self.vectors(self.weak)
        if len(self.weak):
            x = _scaled(x - self._solve(G @ (G.T @ x)))
            if not (np.linalg.norm(G.T @ x, axis=0) <= TOLERANCE * np.linalg.norm(x, axis=0)).all():
                return None
        return x

    def _ends(self, which: np.ndarray) -> np.ndarray:
        """Vectors x with L^T x = e_k, in the order of the pivots."""
        from scipy.sparse.linalg import spsolve_triangular

        ends = np.zeros((len(self.inverse), len(which)))
        ends[which, np.arange(len(which))] = 1.0
        return spsolve_triangular(self._upper, ends, lower=False) if len(which) else ends

    @cached_property
    def _upper(self) -> Any:
        return self.lower.T.tocsr()

    def _solve(self, b: np.ndarray) -> np.ndarray:
        """(A + what was added)^-1 b."""
        from scipy.sparse.linalg import spsolve_triangular

        y = np.zeros_like(b)
        y[self.pattern.perm] = b / self.size[:, None]
        y = spsolve_triangular(self.lower.tocsr(), y, unit_diagonal=True)
        y = spsolve_triangular(self._upper, self.inverse[:, None] * y, lower=False, unit_diagonal=True)
        return y[self.pattern.perm] / self.size[:, None]


def most(n: int) -> int:
    """How many vectors of n numbers there is `ROOM` for."""
    return max(ROOM // max(n, 1), 1)


def _scaled(x: np.ndarray) -> np.ndarray:
    """Columns whose largest entry is 1."""
    return x / np.maximum(np.abs(x).max(axis=0, initial=0.0), 1e-300)


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
