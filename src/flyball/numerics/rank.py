"""Rank and fundamental subspaces by singular values; defines which singular values count as zero."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

RANK_TOLERANCE = 1e-8  # relative to the largest singular value; rows are scaled to unit length


def svd(A: np.ndarray, full: bool = False) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Singular values and vectors: U, d, V^T of A = U diag(d) V^T.

    NumPy's algorithm, divide and conquer (LAPACK's ``gesdd``), does not converge for some finite matrices with many
    singular values that are equal up to rounding. The slower implicit QR iteration (``gesvd``) does.
    """
    try:
        return np.linalg.svd(A, full_matrices=full)
    except np.linalg.LinAlgError:
        from scipy.linalg import svd as by_iteration

        return by_iteration(A, full_matrices=full, lapack_driver="gesvd")


class FundamentalSubspaces(NamedTuple):
    """Orthonormal bases of the four fundamental subspaces of a matrix A (n, m) of rank r."""

    span: np.ndarray  # (n, r): column space
    dependencies: np.ndarray  # (n, n - r): y with y A = 0
    row_space: np.ndarray  # (m, r): row space
    null: np.ndarray  # (m, m - r): x with A x = 0
    values: np.ndarray  # (r,): nonzero singular values

    @property
    def rank(self) -> int:
        """Number of independent rows."""
        return len(self.values)


def fundamental_subspaces(
    A: np.ndarray, tolerance: float = RANK_TOLERANCE, size: float | None = None
) -> FundamentalSubspaces:
    """Compute the four fundamental subspaces by singular value decomposition.

    Parameters
    ----------
    A : ndarray (n, m)
    tolerance : float
        Singular values below ``tolerance * size`` count as zero.
    size : float, optional
        Default: the largest singular value.
    """
    n, m = A.shape
    if not A.size:
        return FundamentalSubspaces(np.zeros((n, 0)), np.eye(n), np.zeros((m, 0)), np.eye(m), np.zeros(0))
    U, d, Vt = svd(A, full=True)
    r = _count_nonzero(d, tolerance, size)
    return FundamentalSubspaces(U[:, :r], U[:, r:], Vt[:r].T, Vt[r:].T, d[:r])


def rank(A: np.ndarray, tolerance: float = RANK_TOLERANCE, size: float | None = None) -> int:
    """Return the number of independent rows (and columns); parameters as for `fundamental_subspaces`."""
    return _count_nonzero(np.linalg.svd(A, compute_uv=False), tolerance, size) if A.size else 0


def column_space(A: np.ndarray, tolerance: float = RANK_TOLERANCE, size: float | None = None) -> np.ndarray:
    """Orthonormal basis (n, r) of the column space; efficient for few columns. As for `fundamental_subspaces`."""
    if not A.size:
        return A[:, :0]
    U, d, _ = svd(A)
    return U[:, : _count_nonzero(d, tolerance, size)]


def null_space(A: np.ndarray, tolerance: float = RANK_TOLERANCE, size: float | None = None) -> np.ndarray:
    """Orthonormal basis (m, m - r) of the vectors x with A x = 0; parameters as for `fundamental_subspaces`."""
    return fundamental_subspaces(A, tolerance, size).null


def _count_nonzero(d: np.ndarray, tolerance: float, size: float | None) -> int:
    return int((d > tolerance * max(d[0] if size is None else size, 1e-300)).sum())
