"""Every island by its solver: the same answers as all at once, and what was picked is said."""

from __future__ import annotations

import numpy as np
import pytest

from flyball.numerics.complementarity.contact_problem import CONVERGED, FactorStorage, allocate_solver, empty_problem
from flyball.numerics.complementarity.gauss_seidel import gauss_seidel
from flyball.numerics.complementarity.solver_choice import (
    CALLS,
    ISLANDS,
    LARGEST_ISLAND,
    OTHER_SOLVED,
    OTHER_SOLVER,
    PASSED_ON,
    SMALL_CONTACTS,
    SMALL_SOLVED,
    islands_of,
    prepare_solver,
    solver_names,
)
from tests.cone.problems import KINDS, dense, impulses, random_problem
from tests.cone.test_gauss_seidel import cone_lack


def apart(seed, kind):
    """A random problem of several islands: many nodes, few contacts."""
    return random_problem(seed, **{**KINDS[kind], "nc": 14, "nn": 24})


@pytest.mark.parametrize("limit", [0, 3, 100])
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("seed", range(3))
def test_islands_one_by_one(limit, kind, seed):
    P, X, W, O, _ = apart(seed, kind)
    _, DK, N, b = dense(P, X)
    free = np.concatenate([X.v[:, :6].ravel(), X.wide])
    O.count.most, O.real.enough = 200_000, 1e-12
    made = prepare_solver("auto", P, X, W, O)
    made.F.limit[:] = limit, 100, limit, 100, 1000
    made.F.doors[OTHER_SOLVER] = gauss_seidel.address
    made.kernel(P, X, W, O, made.F, 0)
    p = impulses(P, X)
    assert O.count.ended == CONVERGED and O.real.residual < 1e-9
    assert cone_lack(P, p, N @ p + b) < 1e-9 * (1 + abs(p).max())
    after = np.concatenate([X.v[:, :6].ravel(), X.wide])
    np.testing.assert_allclose(after, free + DK.T @ p, atol=1e-12 * (1 + abs(p).max()))
    told, (count, I) = made.statistics, islands_of(P.at, P.line_at, P.size[1], P.size[2])
    contacts = np.diff(I.island[: count + 1])
    limit = -1 if len(P.turn) else limit  # rolling friction is for sweeps
    expected = 1, count, (contacts <= limit).sum(), (contacts > limit).sum()
    assert tuple(told[[CALLS, ISLANDS, SMALL_SOLVED, OTHER_SOLVED]]) == expected
    assert told[LARGEST_ISLAND] == contacts.max() and told[SMALL_CONTACTS] == contacts[contacts <= limit].sum()


@pytest.mark.parametrize("name", [n for n in solver_names() if n not in ("pyramid", "lcp")])  # no cone
def test_every_name_solves(name):
    P, X, W, O, _ = random_problem(4)
    _, _, N, b = dense(P, X)
    O.count.most, O.real.enough = 100_000, 1e-10
    made = prepare_solver(name, P, X, W, O)
    made.kernel(P, X, W, O, made.F, 0)
    p = impulses(P, X)
    assert O.count.ended == CONVERGED
    assert cone_lack(P, p, N @ p + b) < 1e-8


def test_what_does_not_fit_is_handed_on():
    P, X, W, O, _ = random_problem(4)
    _, _, N, b = dense(P, X)
    O.count.most, O.real.enough = 100_000, 1e-10
    made = prepare_solver("newton", P, X, W, O)
    tight = made.F._replace(numbers=np.zeros(8), places=np.zeros(40, np.int64))
    made.kernel(P, X, W, O, tight, 0)
    p = impulses(P, X)
    assert made.statistics[PASSED_ON] == 1 and O.count.ended == CONVERGED
    assert cone_lack(P, p, N @ p + b) < 1e-8


def test_few_bodies_need_no_sweeps():
    P, X, W, O, _ = random_problem(4)
    made = prepare_solver("auto", P, X, W, O)
    assert made.F.doors[OTHER_SOLVER] == 0
    made.kernel(P, X, W, O, made.F, 0)
    assert O.count.ended == CONVERGED and made.statistics[OTHER_SOLVED] == 0


def test_nothing_to_do():
    P, X, W, O, F = random_problem(4, nc=0, nn=2)
    made = prepare_solver("auto", P, X, W, O)
    before = X.v.copy()
    made.kernel(P, X, W, O, made.F, 0)
    assert O.count.ended == CONVERGED and isinstance(F, FactorStorage)
    np.testing.assert_array_equal(X.v, before)


@pytest.mark.parametrize(("ratio", "to_newton"), [(1.0, 0), (1000.0, 1)])
def test_uneven_masses_go_to_newton_in_larger_islands(ratio, to_newton):
    """A chain of 60 nodes is too long for Newton, unless one of them is heavy."""
    n = 60
    P = empty_problem(n, n)
    X, W, O, _ = allocate_solver(P)
    P.node[:, 0] = P.node[:, 1] = P.node[:, 2] = P.node[:, 3] = 1.0
    P.node[-1, :4] /= ratio
    P.at[:, 0], P.at[:, 1] = np.arange(n) - 1, np.arange(n)
    P.frame[:] = 0, 0, 1, 1, 0, 0, 0, 1, 0
    X.v[:, 2] = -1.0
    O.count.most, O.real.enough = 100_000, 1e-9
    made = prepare_solver("auto", P, X, W, O)
    made.kernel(P, X, W, O, made.F, 0)
    assert made.statistics[SMALL_SOLVED] == to_newton and made.statistics[OTHER_SOLVED] == 1 - to_newton
    assert O.count.ended == CONVERGED
    assert X.p[:, 0] == pytest.approx((1 / P.node[::-1, 0]).cumsum()[::-1], rel=1e-4)
    assert abs(X.v).max() < 1e-5
