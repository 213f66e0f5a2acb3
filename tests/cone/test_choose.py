"""Every island by its solver: the same answers as all at once, and what was picked is said."""

from __future__ import annotations

import numpy as np
import pytest

from flyball.numerics.cone.choose import (
    BY_ONE,
    BY_OTHER,
    CALLS,
    CONTACTS_BY_ONE,
    HANDED_ON,
    ISLANDS,
    LARGEST,
    THE_REST,
)
from flyball.numerics.cone.gauss_seidel import gauss_seidel
from flyball.numerics.cone.islands import islands_of
from flyball.numerics.cone.problem import CONVERGED, Factor
from flyball.numerics.cone.registry import names, ready
from flyball.numerics.cone.rooms import rooms, unfilled
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
    made = ready("auto", P, X, W, O)
    made.F.limit[:] = limit, 100, limit, 100, 1000
    made.F.doors[THE_REST] = gauss_seidel.address
    made.kernel(P, X, W, O, made.F, 0)
    p = impulses(P, X)
    assert O.count.ended == CONVERGED and O.real.residual < 1e-9
    assert cone_lack(P, p, N @ p + b) < 1e-9 * (1 + abs(p).max())
    after = np.concatenate([X.v[:, :6].ravel(), X.wide])
    np.testing.assert_allclose(after, free + DK.T @ p, atol=1e-12 * (1 + abs(p).max()))
    told, (count, I) = made.told, islands_of(P.at, P.line_at, P.size[1], P.size[2])
    contacts = np.diff(I.island[: count + 1])
    limit = -1 if len(P.turn) else limit  # rolling friction is for sweeps
    expected = 1, count, (contacts <= limit).sum(), (contacts > limit).sum()
    assert tuple(told[[CALLS, ISLANDS, BY_ONE, BY_OTHER]]) == expected
    assert told[LARGEST] == contacts.max() and told[CONTACTS_BY_ONE] == contacts[contacts <= limit].sum()


@pytest.mark.parametrize("name", names())
def test_every_name_solves(name):
    P, X, W, O, _ = random_problem(4)
    _, _, N, b = dense(P, X)
    O.count.most, O.real.enough = 100_000, 1e-10
    made = ready(name, P, X, W, O)
    made.kernel(P, X, W, O, made.F, 0)
    p = impulses(P, X)
    assert O.count.ended == CONVERGED
    assert cone_lack(P, p, N @ p + b) < 1e-8


def test_what_does_not_fit_is_handed_on():
    P, X, W, O, _ = random_problem(4)
    _, _, N, b = dense(P, X)
    O.count.most, O.real.enough = 100_000, 1e-10
    made = ready("newton", P, X, W, O)
    tight = made.F._replace(numbers=np.zeros(8), places=np.zeros(40, np.int64))
    made.kernel(P, X, W, O, tight, 0)
    p = impulses(P, X)
    assert made.told[HANDED_ON] == 1 and O.count.ended == CONVERGED
    assert cone_lack(P, p, N @ p + b) < 1e-8


def test_few_bodies_need_no_sweeps():
    P, X, W, O, _ = random_problem(4)
    made = ready("auto", P, X, W, O)
    assert made.F.doors[THE_REST] == 0
    made.kernel(P, X, W, O, made.F, 0)
    assert O.count.ended == CONVERGED and made.told[BY_OTHER] == 0


def test_nothing_to_do():
    P, X, W, O, F = random_problem(4, nc=0, nn=2)
    made = ready("auto", P, X, W, O)
    before = X.v.copy()
    made.kernel(P, X, W, O, made.F, 0)
    assert O.count.ended == CONVERGED and isinstance(F, Factor)
    np.testing.assert_array_equal(X.v, before)


@pytest.mark.parametrize(("ratio", "to_newton"), [(1.0, 0), (1000.0, 1)])
def test_uneven_masses_go_to_newton_in_larger_islands(ratio, to_newton):
    """A chain of 60 nodes is too long for Newton, unless one of them is heavy."""
    n = 60
    P = unfilled(n, n)
    X, W, O, _ = rooms(P)
    P.node[:, 0] = P.node[:, 1] = P.node[:, 2] = P.node[:, 3] = 1.0
    P.node[-1, :4] /= ratio
    P.at[:, 0], P.at[:, 1] = np.arange(n) - 1, np.arange(n)
    P.frame[:] = 0, 0, 1, 1, 0, 0, 0, 1, 0
    X.v[:, 2] = -1.0
    O.count.most, O.real.enough = 100_000, 1e-9
    made = ready("auto", P, X, W, O)
    made.kernel(P, X, W, O, made.F, 0)
    assert made.told[BY_ONE] == to_newton and made.told[BY_OTHER] == 1 - to_newton
    assert O.count.ended == CONVERGED
    assert X.p[:, 0] == pytest.approx((1 / P.node[::-1, 0]).cumsum()[::-1], rel=1e-4)
    assert abs(X.v).max() < 1e-5
