"""The constraint Jacobian in units in which its rows and columns compare, its rank and its null spaces."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ...numerics.ldl import analyse, factor_kernel
from ...numerics.rank import parts, rank
from ..assembly.start import Assembly
from ..compiled import Compiled

DENSE = 1500  # velocities up to which the rank comes from a singular value decomposition
WEAK = 1e-10  # pivots of a large matrix with unit rows below this count as zero
ADDED = 1e-13  # to the diagonal of such a matrix
SHOWN = 64  # vectors of a large mechanism's null spaces that are made


@dataclass(frozen=True)
class Found:
    """Where a mechanism was looked at, and what the null spaces of its Jacobian are there."""

    assembly: Assembly
    dependencies: np.ndarray  # multipliers (nr, k) that act on nothing; of a large mechanism up to `SHOWN` of them
    allowed: np.ndarray | None  # velocities (nv, f) that the rows allow; None where there may be very many
    gap: str = ""  # why it cannot be assembled, if it cannot

    @property
    def velocities(self) -> np.ndarray:
        """Velocities (nv, f) that the rows allow; of a large mechanism up to `SHOWN`."""
        if self.allowed is not None:
            return self.allowed
        a = self.assembly
        a.compiled.at(a.t, a.q, a.v)
        G, _, scale = scaled_jacobian(a.compiled)
        return sparse_null_space((G.T @ G).tocsr())[1] * scale[:, None]


def lengths(c: Compiled) -> np.ndarray:
    """1 for velocities that are metres a second, 1 / length of the mechanism for those that are radians."""
    return c.sizes / c.values.length


def scaled_jacobian(c: Compiled) -> tuple[Any, np.ndarray, np.ndarray]:
    """The Jacobian last evaluated with turns counted in lengths and rows of unit size, and both scales.

    Returns
    -------
    G : sparse (nr, nv)
    size : ndarray (nr,)
        What rows were divided by.
    scale : ndarray (nv,)
        What columns were multiplied with: velocities are ``scale`` times those that G takes.
    """
    import scipy.sparse as sp

    scale = lengths(c)
    G = c.sparse_jacobian() @ sp.diags(scale)
    size = np.sqrt(np.asarray(G.multiply(G).sum(axis=1)).ravel())
    return (sp.diags(1.0 / np.maximum(size, 1e-300)) @ G).tocsr(), size, scale


def rank_of(c: Compiled) -> int:
    """Rank of the Jacobian last evaluated."""
    if max(len(c.structure.rows), c.structure.nv) > DENSE:
        G = scaled_jacobian(c)[0]
        return G.shape[0] - sparse_null_space(G @ G.T)[0]
    G = c.jacobian() * lengths(c)
    return rank(G / np.maximum(np.sqrt((G * G).sum(axis=1, keepdims=True)), 1e-300))


def null_spaces(G: Any) -> tuple[int, np.ndarray, np.ndarray | None]:
    """Rank, basis of the dependencies among rows (nr, nr - rank), basis of the free motions (nv, nv - rank).

    Of a large mechanism up to `SHOWN` dependencies are given and no motions: there would be too many.
    """
    if max(G.shape) <= DENSE:
        p = parts(G.toarray())
        return p.rank, p.dependencies, p.null
    count, dependent = sparse_null_space(G @ G.T)
    return G.shape[0] - count, dependent, None


def sparse_null_space(A: Any) -> tuple[int, np.ndarray]:
    """Dimension of the null space of a sparse positive semidefinite matrix, and up to `SHOWN` vectors of its basis.

    From A = L D L^T in a pattern and order of its own: where a pivot is nothing but what was added to the diagonal,
    L^T x = e_k gives a vector of the null space. Its pivot is x^T A x, so that of a vector spread over very many
    entries is larger by their number: there the quotient of Rayleigh decides.
    """
    import scipy.sparse as sp
    from scipy.sparse.linalg import spsolve_triangular

    n = A.shape[0]
    size = np.sqrt(np.where(A.diagonal() > 0.0, A.diagonal(), 1.0))
    A = (sp.diags(1.0 / size) @ A @ sp.diags(1.0 / size)).tocoo()
    P, place = analyse(n, A.row, A.col)
    upper = P.perm[A.row] <= P.perm[A.col]  # each pair of entries counts once
    x = np.zeros(len(P.Ai))
    np.add.at(x, place[: A.nnz][upper], A.data[upper])
    x[P.Ap[1:] - 1] += ADDED
    D, L = np.zeros(n), np.zeros(len(P.Li))
    factor_kernel(P, x, L, D, np.zeros(n))
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
    return len(weak), ends / np.maximum(np.abs(ends).max(axis=0, initial=0.0), 1e-300)
