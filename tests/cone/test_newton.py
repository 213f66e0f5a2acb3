"""Newton's method: optimality by definition on dense matrices, Coulomb's law, heavy on light, cut solves."""

from __future__ import annotations

import numpy as np
import pytest

from flyball.numerics.complementarity.contact_problem import CONVERGED, SOLVE_FAILED, STORAGE_TOO_SMALL, solve_contacts
from flyball.numerics.complementarity.newton import newton
from tests.cone.enlarge import solved
from tests.cone.problems import KINDS, dense, impulses, random_problem
from tests.cone.test_gauss_seidel import cone_lack

ROLLING = {k for k in KINDS if "rolling" in k}


@pytest.mark.parametrize("kind", [k for k in KINDS if k not in ROLLING])
@pytest.mark.parametrize("seed", range(6))
def test_the_convex_form_is_solved(kind, seed):
    P, X, W, O, F = random_problem(seed, **KINDS[kind])
    _, DK, N, b = dense(P, X)
    free = np.concatenate([X.v[:, :6].ravel(), X.wide])
    O.count.most, O.real.enough = 200, 1e-12
    solved(newton, P, X, W, O, F)
    p = impulses(P, X)
    assert O.count.ended == CONVERGED and O.real.residual < 1e-12
    assert cone_lack(P, p, N @ p + b) < 1e-10 * (1 + abs(p).max())
    after = np.concatenate([X.v[:, :6].ravel(), X.wide])
    np.testing.assert_allclose(after, free + DK.T @ p, atol=1e-12 * (1 + abs(p).max()))


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("seed", range(6))
def test_coulombs_law(kind, seed):
    """|p_t| <= mu p_n, u_n >= 0, u_n p_n = 0, and friction against the velocity."""
    P, X, W, O, F = random_problem(seed, **KINDS[kind])
    _, _, N, b = dense(P, X)
    O.count.most, O.real.enough, O.count.coulomb = 200, 1e-12, 1
    solved(newton, P, X, W, O, F)
    p = impulses(P, X)
    assert O.count.ended == CONVERGED
    assert cone_lack(P, p, N @ p + b, coulomb=True) < 1e-10 * (1 + abs(p).max())


CUT_SOLVES = [(kind, coulomb) for kind in KINDS for coulomb in (0, 1) if coulomb or kind not in ROLLING]


@pytest.mark.parametrize(("kind", "coulomb"), CUT_SOLVES)
@pytest.mark.parametrize("most", [0, 1, 2, 5])
def test_a_cut_solve_makes_no_energy(kind, coulomb, most):
    """p' N p / 2 + b' p, by which the kinetic energy changes, is at most 0, from a foolish warm start as well."""
    P, X, W, O, F = random_problem(5, **KINDS[kind])
    _, _, N, b = dense(P, X)
    O.count.most, O.count.coulomb = most, coulomb
    X.p[:, 0] = 50.0
    solved(newton, P, X, W, O, F)
    p = impulses(P, X)
    assert 0.5 * p @ N @ p + b @ p < 1e-10


def test_least_impulses_are_held():
    P, X, W, O, F = random_problem(2, balls=True)
    P = P._replace(least=np.full(12, 0.7))
    _, _, N, b = dense(P, X)
    O.real.enough = 1e-12
    solved(newton, P, X, W, O, F)
    p, u = X.p, (N @ X.p.ravel() + b).reshape(-1, 3)
    assert p[:, 0].min() == pytest.approx(0.7, rel=1e-14)
    for c in range(12):  # the nearest point of the cut cone to p - u is p
        n, s, t = p[c] - u[c]
        r, mu = np.hypot(s, t), P.mu[c]
        near = max(n if r <= mu * n else (n + mu * r) / (1 + mu * mu), 0.7)
        a = min(1, mu * near / r)
        np.testing.assert_allclose(p[c], (near, a * s, a * t), atol=1e-10)


@pytest.mark.parametrize("seed", range(3))
def test_what_is_left_is_told_as_a_force_too(seed):
    """The impulse that is lacking by the natural map, over the largest impulse; rough solves, so that some is left."""
    P, X, W, O, F = random_problem(seed)
    _, _, N, b = dense(P, X)
    O.count.most, O.real.enough = 200, 0.3
    solved(newton, P, X, W, O, F)
    p, u = X.p, (N @ X.p.ravel() + b).reshape(-1, 3)
    lacking = 0.0
    for c in range(12):
        n, s, t = p[c] - 3.0 * u[c] / np.trace(N[3 * c : 3 * c + 3, 3 * c : 3 * c + 3])
        r, mu = np.hypot(s, t), P.mu[c]
        near = n if r <= mu * n else max(0.0, (n + mu * r) / (1 + mu * mu))
        a = min(1.0, mu * near / r)
        lacking = max(lacking, np.linalg.norm(p[c] - (near, a * s, a * t)))
    assert lacking > 0.0
    assert O.real.force_residual == pytest.approx(lacking / np.linalg.norm(p, axis=1).max(), rel=1e-6)


def test_rooms_too_small_are_said():
    P, X, W, O, F = random_problem(0)
    p = X.p.copy()
    assert solve_contacts(newton, P, X, W, O, F) == 0 and O.count.ended == STORAGE_TOO_SMALL
    np.testing.assert_array_equal(X.p, p)


def test_the_convex_form_of_rolling_friction_is_refused():
    P, X, W, O, F = random_problem(0, **KINDS["rolling friction"])
    v = X.v.copy()
    assert solve_contacts(newton, P, X, W, O, F) == 0 and O.count.ended == SOLVE_FAILED
    np.testing.assert_array_equal(X.v, v)
