"""Linear equations that may be redundant or contradict each other: the smallest solution that leaves the least."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

DENSE = 400  # unknowns up to which singular values decide
NONE = 1e-11  # singular values below this part of the largest are none
WEAK = 1e-10  # what is added to the sparse equations' diagonal, of their entries
REFINED = 4  # times that a solution is improved, at most


def least(A, b: np.ndarray) -> np.ndarray:
    """The smallest x that leaves the least of A x = b; A is sparse, or an array if it is small.

    It is refined: a part of b that has nothing to do with a larger one is met to its own last digits.
    """
    A = A.toarray() if max(A.shape) <= DENSE and not isinstance(A, np.ndarray) else A
    solve = _dense(A) if max(A.shape) <= DENSE else _sparse(A)
    x, left, before = np.zeros(A.shape[1]), b, np.inf
    for _ in range(REFINED):
        step = solve(left)
        size = np.abs(step).max(initial=0.0)
        if not size < 0.5 * before:
            break
        x, before = x + step, size
        left = b - A @ x
    return x


def _dense(A) -> Callable[[np.ndarray], np.ndarray]:
    U, d, Vt = np.linalg.svd(A, full_matrices=False)
    k = int((d > NONE * d.max(initial=0.0)).sum())
    return lambda b: Vt[:k].T @ ((U[:, :k].T @ b) / d[:k])


def _sparse(A) -> Callable[[np.ndarray], np.ndarray]:
    """By the normal form [-e I, A; A^T, e I]."""
    import scipy.sparse as sp
    from scipy.sparse.linalg import splu

    m, n = A.shape
    e = WEAK * np.abs(A.data).max()
    factor = splu(sp.bmat([[-e * sp.identity(m), A], [A.T, e * sp.identity(n)]]).tocsc())
    return lambda b: factor.solve(np.r_[b, np.zeros(n)])[m:]
