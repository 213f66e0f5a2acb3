"""Bases of what sparse constraints allow, by projections, against singular values; when rows are surely independent."""

import numpy as np
import pytest
import scipy.sparse as sp

from flyball.numerics.rank import (
    MAX_SVD_SIZE,
    clearly_independent,
    negative_pivots,
    null_basis,
    null_space,
    null_spaces,
    rank_by_pivots,
    sparse_matrix_rank,
    weak_pivots,
)


def rows(m: int, n: int, seed: int = 0) -> np.ndarray:
    """A band of random entries, rows of unit length."""
    random = np.random.default_rng(seed)
    A = np.where(np.abs(np.arange(m)[:, None] * n / m - np.arange(n)) < 6, random.standard_normal((m, n)), 0.0)
    return A / np.linalg.norm(A, axis=1)[:, None]


def test_a_basis_by_projections_spans_what_singular_values_say():
    A = rows(80, 120)
    Z, N = null_basis(sp.csr_matrix(A)), null_space(A)
    assert pytest.approx(np.eye(40), abs=1e-13) == Z.T @ Z
    assert np.abs(A @ Z).max() < 1e-13
    assert pytest.approx(Z, abs=1e-12) == N @ (N.T @ Z)
    assert null_basis(sp.csr_matrix((0, 3))) == pytest.approx(np.eye(3))


@pytest.mark.parametrize(("apart", "sure"), [(1.0, True), (1e-2, True), (1e-6, False), (0.0, False)])
def test_rows_that_nearly_depend_on_others_are_not_sure(apart, sure):
    A = rows(80, 120)
    A[40] = A[41] + apart * A[40]
    A /= np.linalg.norm(A, axis=1)[:, None]
    assert clearly_independent(sp.csr_matrix(A)) == sure


def test_pivots_count_what_eigenvalues_count():
    """Negative ones by Sylvester's law of inertia; of rows, those that depend on the others."""
    A = rows(60, 90)
    B = A @ A.T
    w = np.linalg.eigvalsh(B)
    for k in (5, 20, 40):
        shift = 0.5 * (w[k - 1] + w[k])
        assert negative_pivots(sp.csr_matrix(B - shift * np.eye(60))) == k
    A[[10, 30]] = A[11] + A[12], A[31] - 2 * A[32]
    A /= np.linalg.norm(A, axis=1)[:, None]
    weak, vectors = weak_pivots(sp.csr_matrix(A) @ sp.csr_matrix(A).T)
    assert len(weak) == vectors.shape[1] == 2
    assert np.linalg.matrix_rank(np.delete(A, weak, axis=0)) == 58
    assert np.abs(vectors.T @ A).max() < 1e-6


@pytest.mark.parametrize("apart", [1.0, 1e-3, 1e-5, 1e-6, 1e-7, 1e-10, 0.0])
def test_pivots_say_what_singular_values_say_or_nothing(apart):
    """Rows that depend on others nearly, or truly: the rank, and the dependencies to rounding."""
    A = rows(200, 300)
    A[40] = A[41] + A[90] + apart * A[40]
    A[150] = A[151] - 2 * A[152]
    A /= np.linalg.norm(A, axis=1)[:, None]
    d = np.linalg.svd(A, compute_uv=False)
    least = int((d > 1e-8 * d[0]).sum())
    assert max(A.shape) > MAX_SVD_SIZE
    assert sparse_matrix_rank(sp.csr_matrix(A)) == sparse_matrix_rank(A) == least
    found, lam, _ = null_spaces(sp.csr_matrix(A))
    assert (found, lam.shape) == (least, (200, 200 - least))
    assert np.linalg.matrix_rank(lam) == 200 - least
    assert np.linalg.norm(lam.T @ A, axis=1) == pytest.approx(0.0, abs=1e-8)
    assert (rank_by_pivots(sp.csr_matrix(A)) is None) == (1e-9 < apart < 1e-4)


def test_all_dependencies_of_many_are_found():
    """More of them than are made of a matrix that is very large."""
    A = rows(240, 300)
    for k in range(0, 240, 3):
        A[k] = A[k + 1] - A[k + 2]
    A /= np.linalg.norm(A, axis=1)[:, None]
    count, lam = rank_by_pivots(sp.csr_matrix(A))
    assert (count, lam.shape) == (160, (240, 80))
    assert np.abs(lam.T @ A).max() < 1e-12
