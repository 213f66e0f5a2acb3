"""The sparse factors of implicit integrators against dense solutions."""

import numpy as np
import pytest

from flyball.numerics.sparse_factorisation import analyse_lu, constrained_order, lu_factor, lu_solve, sparse_product
from tests.compiled import compiled


@compiled
def factor_and_solve(P, A, L, U, D, Y, x, product):
    status = lu_factor(P, A, L, U, D, Y)
    sparse_product(P, A, x, product)
    lu_solve(P, L, U, D, x)
    return status


def saddle(n, rows, dtype, seed=0):
    """Entries of [K G; H C] with K unsymmetric and tridiagonal by blocks of two, a row touching two neighbours each."""
    rng = np.random.default_rng(seed)
    dense = np.zeros((n + rows, n + rows), dtype)

    def some(shape):
        x = rng.uniform(-1, 1, shape)
        return x + 1j * rng.uniform(-1, 1, shape) if dtype is complex else x

    for b in range(0, n, 2):
        dense[b : b + 2, b : b + 2] = some((2, 2)) + 4.0 * np.eye(2)
        if b:
            dense[b : b + 2, b - 2 : b], dense[b - 2 : b, b : b + 2] = 0.3 * some((2, 2)), 0.3 * some((2, 2))
    for r in range(rows):
        at = 2 * r + np.arange(4)
        dense[n + r, at] = some(4)
        dense[at, n + r] = -np.conj(dense[n + r, at])  # sign of multipliers: safe without pivots
    return dense


@pytest.mark.parametrize("dtype", [float, complex])
def test_solution_is_that_of_a_dense_solver(dtype):
    n, rows = 24, 9
    dense = saddle(n, rows, dtype)
    i, j = np.nonzero(dense)
    groups = np.r_[np.arange(n) // 2, n // 2 + np.arange(rows)]
    order = constrained_order(groups, np.arange(n // 2 + rows) >= n // 2, i, j)
    P, place = analyse_lu(n + rows, i, j, order)
    A = np.zeros(len(P.Aj), dtype)
    A[place] = dense[i, j]
    L, U, D = np.zeros(len(P.Lj), dtype), np.zeros(len(P.Uj), dtype), np.zeros(n + rows, dtype)
    b = np.random.default_rng(1).uniform(-1, 1, n + rows).astype(dtype)
    x, product, Y = np.zeros(n + rows, dtype), np.zeros(n + rows, dtype), np.full(n + rows, np.nan, dtype)
    x[P.perm] = b
    assert factor_and_solve(P, A, L, U, D, Y, x, product) == 0
    assert np.abs(x[P.perm] - np.linalg.solve(dense, b)).max() < 1e-12
    assert np.abs(product[P.perm] - dense @ b).max() < 1e-13


def test_what_is_late_comes_after_all_that_it_touches():
    i = np.array([4, 4, 5, 5, 6])
    j = np.array([0, 1, 1, 2, 3])
    place = constrained_order(np.arange(7), np.arange(7) >= 4, i, j)
    assert sorted(place) == list(range(7))
    assert all(place[a] > place[b] for a, b in zip(i, j, strict=True))
