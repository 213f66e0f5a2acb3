"""Gauss-Seidel: optimality by definition on dense matrices, Coulomb's law, closed forms, cut solves."""

from __future__ import annotations

import numpy as np
import pytest

from flyball.numerics.complementarity.contact_problem import CONVERGED, allocate_solver, empty_problem, solve_contacts
from flyball.numerics.complementarity.gauss_seidel import gauss_seidel
from tests.cone.problems import KINDS, cone_lack, dense, impulses, random_problem


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("seed", range(3))
def test_the_convex_form_is_solved(kind, seed):
    P, X, W, O, F = random_problem(seed, **KINDS[kind])
    _, DK, N, b = dense(P, X)
    free = np.concatenate([X.v[:, :6].ravel(), X.wide])
    O.count.most, O.real.enough = 200_000, 1e-12
    solve_contacts(gauss_seidel, P, X, W, O, F)
    p = impulses(P, X)
    assert cone_lack(P, p, N @ p + b) < 1e-9 * (1 + abs(p).max())
    after = np.concatenate([X.v[:, :6].ravel(), X.wide])
    np.testing.assert_allclose(after, free + DK.T @ p, atol=1e-12 * (1 + abs(p).max()))
    assert O.count.ended == CONVERGED and O.real.residual < 1e-9 and O.real.force_residual < 1e-9


@pytest.mark.parametrize("kind", ["nodes", "balls", "smooth", "soft", "groups and lines"])
def test_coulombs_law(kind):
    """|p_t| <= mu p_n, u_n >= 0, u_n p_n = 0, and friction against the velocity: where it converges it is that."""
    P, X, W, O, F = random_problem(1, **KINDS[kind])
    _, _, N, b = dense(P, X)
    O.count.most, O.real.enough, O.count.coulomb = 10_000, 1e-12, 1
    solve_contacts(gauss_seidel, P, X, W, O, F)
    p = impulses(P, X)
    assert cone_lack(P, p, N @ p + b, coulomb=True) < 1e-9


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("coulomb", [0, 1])
@pytest.mark.parametrize("most", [1, 2, 5])
def test_a_cut_solve_makes_no_energy(kind, coulomb, most):
    """p' N p / 2 + b' p, by which the kinetic energy changes, is at most 0, from a foolish warm start as well."""
    P, X, W, O, F = random_problem(5, **KINDS[kind])
    _, _, N, b = dense(P, X)
    O.count.most, O.count.coulomb = most, coulomb
    X.p[:, 0] = 50.0
    solve_contacts(gauss_seidel, P, X, W, O, F)
    p = impulses(P, X)
    assert 0.5 * p @ N @ p + b @ p < 1e-10


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("coulomb", [0, 1])
def test_a_start_outside_of_the_cone(kind, coulomb):
    """What is handed back is what acts: friction without a normal impulse once stayed, unfelt, and grew."""
    P, X, W, O, F = random_problem(6, **KINDS[kind])
    _, DK, _, _ = dense(P, X)
    free = np.concatenate([X.v[:, :6].ravel(), X.wide])
    X.p[:] = np.random.default_rng(0).standard_normal(X.p.shape)
    X.p[::2, 0] = 0.0
    O.count.most, O.count.coulomb = 3, coulomb
    solve_contacts(gauss_seidel, P, X, W, O, F)
    p, after = impulses(P, X), np.concatenate([X.v[:, :6].ravel(), X.wide])
    np.testing.assert_allclose(after, free + DK.T @ p, atol=1e-12 * (1 + abs(p).max()))
    assert (np.hypot(X.p[:, 1], X.p[:, 2]) <= P.mu * X.p[:, 0] * (1 + 1e-12)).all()


def on_a_slope(angle, mu, h=1e-2, g=9.81):
    """A ball of 2 kg and 0.1 m at rest on a slope, one step of gravity."""
    P = empty_problem(1, 1)
    X, W, O, F = allocate_solver(P)
    P.node[0] = 0.5, *[1 / (0.4 * 2 * 0.1**2)] * 3, 0, 0, 0, 1
    P.at[0], P.arm[0, 3:], P.mu[0] = (-1, 0), (0, 0, -0.1), mu
    P.frame[0] = 0, 0, 1, 1, 0, 0, 0, 1, 0
    X.v[0, :3] = h * g * np.sin(angle), 0, -h * g * np.cos(angle)
    return P, X, W, O, F


@pytest.mark.parametrize("angle", [0.1, 0.5, 1.2])
def test_a_ball_on_a_slope(angle):
    """It rolls with 5/7 g sin a up to tan a = 7/2 mu, and slides with g (sin a - mu cos a) beyond."""
    mu, h, g = 0.3, 1e-2, 9.81
    P, X, W, O, F = on_a_slope(angle, mu)
    O.count.coulomb, O.real.enough = 1, 1e-14
    solve_contacts(gauss_seidel, P, X, W, O, F)
    rolls = np.tan(angle) <= 3.5 * mu
    a = 5 / 7 * g * np.sin(angle) if rolls else g * (np.sin(angle) - mu * np.cos(angle))
    assert X.v[0, 0] == pytest.approx(h * a, rel=1e-12)
    assert X.v[0, 2] == pytest.approx(0, abs=1e-15)
    spin = a * h / 0.1 if rolls else 2.5 * mu * g * np.cos(angle) * h / 0.1
    assert X.v[0, 4] == pytest.approx(spin, rel=1e-12)


def test_the_convex_form_floats_by_mu_times_the_slip():
    angle, mu = 1.2, 0.3
    P, X, W, O, F = on_a_slope(angle, mu)
    O.count.most, O.real.enough = 1000, 1e-15
    solve_contacts(gauss_seidel, P, X, W, O, F)
    assert X.v[0, 2] == pytest.approx(mu * (X.v[0, 0] - 0.1 * X.v[0, 4]), rel=1e-9)


def test_a_least_impulse_is_held():
    P, X, W, O, F = random_problem(2, balls=True)
    P = P._replace(least=np.full(12, 0.7))
    O.count.most, O.real.enough = 10_000, 1e-12
    solve_contacts(gauss_seidel, P, X, W, O, F)
    assert X.p[:, 0].min() == 0.7 and O.real.residual < 1e-9


def test_islands_are_solved_one_at_a_time():
    """Two problems in one, an island each: as the two by themselves."""
    P, X, W, O, F = random_problem(4, balls=True, nc=8, nn=6)
    P.at[:4] = [[-1, 0], [0, 1], [1, 2], [-1, 2]]
    P.at[4:] = [[-1, 3], [3, 4], [4, 5], [-1, 5]]
    P = P._replace(island=np.array([0, 4, 8]), member_p=np.array([0, 3, 6]), line_p=np.zeros(3, np.int64))
    both = allocate_solver(P)[0]
    both.v[:] = X.v
    O.count.most, O.real.enough = 10_000, 1e-14
    solve_contacts(gauss_seidel, P, both, W, O, F)
    O.count.island = 1
    before = X.v.copy()
    solve_contacts(gauss_seidel, P, X, W, O, F)
    np.testing.assert_array_equal(X.v[:3], before[:3])
    np.testing.assert_allclose(X.v[3:], both.v[3:], atol=1e-12)
    O.count.island = 0
    solve_contacts(gauss_seidel, P, X, W, O, F)
    np.testing.assert_allclose(X.v, both.v, atol=1e-12)
