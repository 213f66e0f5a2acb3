"""Orders of elimination: they leave the solution alone, and decide what a factor of a net costs."""

from math import log

import numpy as np
import pytest

from flyball.numerics.graphs import minimum_degree, nested_dissection
from flyball.numerics.sparse_factorisation import analyse_ldl, ldl_factor_kernel


def grid(n, rows=1, steps=((0, 1), (1, 0), (0, 0))):
    """Entries of the matrix of a net of n x n points, joined to their neighbours, ``rows`` unknowns at each."""
    x, y = (k.ravel() for k in np.meshgrid(np.arange(n), np.arange(n)))
    i, j = [], []
    for dx, dy in steps:
        there = (x + dx >= 0) & (x + dx < n) & (y + dy < n)
        a, b = (n * y + x)[there], (n * (y + dy) + x + dx)[there]
        for k in range(rows):
            for m in range(rows):
                i.append(rows * a + k)
                j.append(rows * b + m)
    return n * n * rows, np.concatenate(i), np.concatenate(j)


def work(n, i, j):
    """Products of a factorisation."""
    column = np.diff(analyse_ldl(n, i, j)[0].Lp).astype(float)
    return (column * (column + 3.0)).sum() / 2.0


@pytest.mark.parametrize("order", [minimum_degree, nested_dissection])
def test_every_unknown_has_one_place(order):
    n, i, j = grid(12, rows=2)
    assert sorted(order(n, i, j)) == list(range(n))


def test_parts_that_do_not_touch_are_ordered_too():
    n, i, j = grid(11)
    perm = nested_dissection(3 * n + 5, np.r_[i, i + n, i + 2 * n], np.r_[j, j + n, j + 2 * n])
    assert sorted(perm) == list(range(3 * n + 5))


def test_a_graph_that_cannot_be_halved_is_ordered_too():
    i, j = np.tril_indices(100)
    assert sorted(nested_dissection(100, i, j)) == list(range(100))
    star = np.arange(1, 200)
    assert sorted(nested_dissection(200, star, 0 * star)) == list(range(200))


def test_the_factor_solves_the_equations():
    """L D L^T of a matrix whose factor is filled so much that nested dissection is tried, against a dense solution."""
    n, i, j = grid(14, rows=3)
    P, place = analyse_ldl(n, i, j)
    rng = np.random.default_rng(1)
    dense = np.zeros((n, n))
    lower = i >= j
    value = rng.uniform(-1, 1, len(i)) + 40.0 * (i == j)
    A = np.zeros(len(P.Ai))
    for entry, x, row, column in zip(place[: len(i)][lower], value[lower], i[lower], j[lower], strict=True):
        A[entry] = dense[row, column] = dense[column, row] = x
    D, L = np.zeros(n), np.zeros(len(P.Li))
    assert ldl_factor_kernel(P, A, L, D, np.zeros(n)) == 0
    full = np.eye(n)
    full[P.Li, np.repeat(np.arange(n), np.diff(P.Lp))] = L
    again = (full / D) @ full.T
    assert np.abs(again[np.ix_(P.perm, P.perm)] - dense).max() < 1e-13 * 40.0


@pytest.mark.parametrize("n", [20, 40, 60])
def test_work_of_a_net_is_that_of_nested_dissection(n):
    """George 1973: 829/84 n^3 products, for points joined to all eight neighbours."""
    every = ((0, 1), (1, 0), (0, 0), (1, 1), (-1, 1))
    assert work(*grid(n, steps=every)) < 829 / 84 * n**3


def rods(n):
    """Rods of a net of n x n points: two are neighbours where they share a point."""
    across = [(n * y + x, n * y + x + 1) for y in range(n) for x in range(n - 1)]
    ends = np.array(across + [(n * y + x, n * y + x + n) for y in range(n - 1) for x in range(n)])
    at = [[] for _ in range(n * n)]
    for k, both in enumerate(ends):
        for p in both:
            at[p].append(k)
    pairs = np.array([(a, b) for some in at for a in some for b in some if a >= b])
    return len(ends), pairs[:, 0], pairs[:, 1]


def test_work_a_point_of_a_net_of_rods_grows_as_its_side():
    """N^1.5 in all; with minimum degree N^1.75, and more than twice as much for 60 x 60 points."""
    each = [work(*rods(n)) / n**2 for n in (20, 40, 60)]
    assert log(each[1] / each[0]) / log(4) < 0.52
    assert log(each[2] / each[1]) / log(2.25) < 0.52


def test_chains_have_no_fill():
    k = np.arange(4000)
    n = 4001
    P, _ = analyse_ldl(n, k + 1, k)
    assert len(P.Li) == n - 1
