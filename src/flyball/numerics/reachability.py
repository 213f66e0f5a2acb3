"""Reachable subspace of a linear system by the staircase form (Van Dooren 1981): orthogonal transformations only."""

from __future__ import annotations

import numpy as np

RANK_LIMIT = 1e-9  # singular values below this part of the norm of the balanced matrices count as zero


def unreachable_modes(A: np.ndarray, B: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Eigenvalues of x' = A x + B u that no input changes, and their left eigenvectors.

    Parameters
    ----------
    A, B : ndarray (n, n), (n, m)

    Returns
    -------
    values : ndarray (k,) complex
    vectors : ndarray (n, k) complex
        Columns w with w^T A = value w^T and w^T B = 0, of maximum entry 1: w^T x follows no input.
    """
    from scipy.linalg import matrix_balance

    n = len(A)
    balanced, (scale, _) = matrix_balance(A, permute=False, separate=True)
    size = np.linalg.norm(B / scale[:, None], axis=0)
    enters = B / scale[:, None] / np.where(size > 0.0, size, 1.0)
    Z, rest, norm = np.eye(n), balanced, 1.0
    while len(rest):
        U, s, _ = np.linalg.svd(enters)
        r = int((s > RANK_LIMIT * norm).sum())
        if not r:
            break
        rest = U.T @ rest @ U
        enters, rest, Z = rest[r:, :r], rest[r:, r:], (Z @ U)[:, r:]
        norm = float(np.linalg.norm(balanced))
    values, left = np.linalg.eig(rest.T)
    vectors = (Z @ left) / scale[:, None]
    most = vectors[np.abs(vectors).argmax(axis=0), np.arange(vectors.shape[1])] if len(values) else np.ones(0)
    order = np.lexsort((values.real, np.abs(values.imag), np.abs(values)))
    return values[order], (vectors / most)[:, order]
