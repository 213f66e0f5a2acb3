"""Sparse equations with constraints, and an orthonormal basis of what constraints allow."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from ..errors import AnalysisError
from .sparse_rank import negative_pivots

REFINED = 2  # times that a solution is improved
SURE = 1e-4  # singular values above this part of the largest are surely some


def saddle(
    P: Any, G: Any, H: Any = None, refined: int = REFINED
) -> Callable[[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]:
    """What gives x and l of P x - G^T l = f, H x = g; H is G if not given; improved so many times.

    Raises
    ------
    AnalysisError
        If there are no such x and l for every f and g.
    """
    import scipy.sparse as sp
    from scipy.sparse.linalg import splu

    n, size = P.shape[0], abs(P).max() or 1.0
    A = (sp.bmat([[P, -size * G.T], [size * (G if H is None else H), None]]) if G.shape[0] else P).tocsc()
    try:
        factor = splu(A)
    except RuntimeError:
        raise AnalysisError(
            "the linear equations have no one solution: something moves without inertia, or this is an eigenvalue"
        ) from None

    def once(b: np.ndarray) -> np.ndarray:
        if np.iscomplexobj(b) and not np.iscomplexobj(A.data):
            return once(np.ascontiguousarray(b.real)) + 1j * once(np.ascontiguousarray(b.imag))
        return factor.solve(b.astype(A.dtype))

    def solve(f: np.ndarray, g: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        b = np.concatenate([f, size * g])
        y = once(b)
        for _ in range(refined):
            y += once(b - A @ y)
        return y[:n], size * y[n:]

    return solve


def null_basis(G: Any) -> np.ndarray:
    """An orthonormal basis (n, n - m) of what independent rows (m, n) allow.

    Random vectors are projected on it and made orthonormal by Cholesky's factor of their products, twice (Yamamoto and
    others 2015): that is matrix products, where Householder's reflections would take several times as long.
    """
    import scipy.sparse as sp
    from scipy.linalg import solve_triangular

    m, n = G.shape
    if not m:
        return np.eye(n)
    project = saddle(sp.identity(n, format="csr"), G, refined=0)  # twice, which improves it
    basis = np.random.default_rng(1).standard_normal((n, n - m))
    for _ in range(2):
        basis = project(basis, np.zeros((m, n - m)))[0]
        basis = solve_triangular(np.linalg.cholesky(basis.T @ basis), basis.T, lower=True).T
    return basis


def surely_independent(G: Any) -> bool:
    """Whether rows of unit size are far from depending on one another: G G^T less a little has no negative pivots."""
    import scipy.sparse as sp

    A = G @ G.T
    largest = np.sqrt(abs(A).sum(axis=1).max())
    return negative_pivots(A - (SURE * largest) ** 2 * sp.identity(A.shape[0])) == 0
