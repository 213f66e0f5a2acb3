"""ADMM: optimality by definition on dense matrices, Coulomb's law, a heavy box on light ones, cut solves."""

from __future__ import annotations

import numpy as np
import pytest

from flyball.numerics.complementarity.admm import admm
from flyball.numerics.complementarity.contact_problem import CONVERGED, LIMIT_REACHED, STALLED
from tests.cone.enlarge import solved
from tests.cone.problems import KINDS, dense, impulses, random_problem
from tests.cone.test_gauss_seidel import cone_lack

NOT_FOUND = {(1, "nodes"), (1, "soft")}
PLAIN = [k for k in KINDS if "rolling" not in k]


@pytest.mark.parametrize("coulomb", [0, 1])
@pytest.mark.parametrize("kind", PLAIN)
@pytest.mark.parametrize("seed", range(4))
def test_it_solves(seed, kind, coulomb):
    P, X, W, O, F = random_problem(seed, **KINDS[kind])
    _, DK, N, b = dense(P, X)
    free = np.concatenate([X.v[:, :6].ravel(), X.wide])
    O.count.most, O.real.enough, O.count.coulomb = 20_000, 1e-10, coulomb
    solved(admm, P, X, W, O, F)
    p = impulses(P, X)
    if coulomb and (seed, kind) in NOT_FOUND:  # the fixed point of De Saxce's additions
        assert O.count.ended in (LIMIT_REACHED, STALLED)
        assert O.real.residual > O.real.enough
        return
    assert O.count.ended == CONVERGED
    assert cone_lack(P, p, N @ p + b, coulomb=bool(coulomb)) < 1e-8 * (1 + abs(p).max())
    after = np.concatenate([X.v[:, :6].ravel(), X.wide])
    np.testing.assert_allclose(after, free + DK.T @ p, atol=1e-12 * (1 + abs(p).max()))


@pytest.mark.parametrize("kind", PLAIN)
@pytest.mark.parametrize("most", [0, 1, 5])
def test_a_cut_solve_makes_no_energy(kind, most):
    P, X, W, O, F = random_problem(5, **KINDS[kind])
    _, _, N, b = dense(P, X)
    O.count.most = most
    X.p[:, 0] = 50.0
    solved(admm, P, X, W, O, F)
    p = impulses(P, X)
    assert 0.5 * p @ N @ p + b @ p < 1e-10
