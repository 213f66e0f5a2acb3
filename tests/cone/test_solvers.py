"""First-order solvers: optimality by definition, one another, an independent optimiser, units, cut solves, histories."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import block_diag
from scipy.optimize import nnls

from flyball.numerics.complementarity.apgd import apgd, scaled_apgd
from flyball.numerics.complementarity.barzilai_borwein import barzilai_borwein
from flyball.numerics.complementarity.cone_projection import project_on_rolling_cone
from flyball.numerics.complementarity.contact_operator import (
    apply_contact_impulse,
    apply_torque_impulse,
    contact_angular_velocity,
    contact_velocity,
    diagonal_block,
    residuals,
    rolling_diagonal_block,
)
from flyball.numerics.complementarity.contact_problem import CONVERGED, SOLVE_FAILED, allocate_solver, solve_contacts
from flyball.numerics.complementarity.douglas_rachford import ConeProduct
from flyball.numerics.complementarity.gauss_seidel import gauss_seidel
from flyball.numerics.complementarity.jacobi import jacobi
from tests.cone.problems import KINDS, cone_lack, dense, impulses, random_problem

GRADIENTS = {"jacobi": jacobi, "barzilai_borwein": barzilai_borwein, "apgd": apgd, "lean": scaled_apgd}
SOLVERS = {"gauss_seidel": gauss_seidel, **GRADIENTS}


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("name", GRADIENTS)
def test_the_convex_form_is_solved(kind, name):
    P, X, W, O, F = random_problem(2, **KINDS[kind])
    _, DK, N, b = dense(P, X)
    free = np.concatenate([X.v[:, :6].ravel(), X.wide])
    O.count.most, O.real.enough = 100_000, 1e-10
    solve_contacts(SOLVERS[name], P, X, W, O, F)
    p = impulses(P, X)
    assert O.count.ended == CONVERGED and O.real.residual < 1e-9
    assert cone_lack(P, p, N @ p + b) < 1e-8 * (1 + abs(p).max())
    after = np.concatenate([X.v[:, :6].ravel(), X.wide])
    np.testing.assert_allclose(after, free + DK.T @ p, atol=1e-12 * (1 + abs(p).max()))


def pyramid_objective(N, b, mu, directions, outside):
    """The least objective over pyramids in the cones or around them: non-negative least squares of SciPy."""
    angle = 2 * np.pi * np.arange(directions) / directions
    wide = 1 / np.cos(np.pi / directions) if outside else 1.0
    edges = [np.array([np.ones(directions), m * wide * np.cos(angle), m * wide * np.sin(angle)]) for m in mu]
    G = block_diag(*edges)
    L = np.linalg.cholesky(N)
    return 0.5 * nnls(L.T @ G, -np.linalg.solve(L, b), maxiter=10_000)[1] ** 2 - 0.5 * b @ np.linalg.solve(N, b)


@pytest.mark.parametrize("seed", range(3))
def test_pyramids_enclose_the_objective(seed):
    """Over pyramids inside it is larger, over those around smaller, by no more than d^-2: an independent solver."""
    P, X, W, O, F = random_problem(seed, nc=5, nn=5, soft=0.1)
    _, _, N, b = dense(P, X)
    N = N + 1e-9 * np.eye(len(N))
    above, below = (pyramid_objective(N, b, P.mu, 64, outside) for outside in (False, True))
    assert above - below < 5e-3 * abs(above)
    O.count.most, O.real.enough = 10_000, 1e-10
    for solver in SOLVERS.values():
        Y = allocate_solver(P)[0]
        Y.v[:] = X.v
        solve_contacts(solver, P, Y, W, O, F)
        p = impulses(P, Y)
        assert below - 1e-7 <= 0.5 * p @ N @ p + b @ p <= above + 1e-7


@pytest.mark.parametrize("kind", ["nodes", "balls", "groups and lines"])
@pytest.mark.parametrize("name", [n for n in SOLVERS if n != "barzilai_borwein"])
def test_coulombs_law(name, kind):
    """Where it converges it is Coulomb's law, by De Saxce's correction."""
    fewer = {} if kind == "groups and lines" else {"nc": 5}
    P, X, W, O, F = random_problem(4, **KINDS[kind], **fewer)
    P.mu[:] *= 0.5
    _, _, N, b = dense(P, X)
    O.count.most, O.real.enough, O.count.coulomb = 50_000, 1e-10, 1
    solve_contacts(SOLVERS[name], P, X, W, O, F)
    assert O.count.ended == CONVERGED
    p = impulses(P, X)
    assert cone_lack(P, p, N @ p + b, coulomb=True) < 1e-8


def test_what_needs_an_objective_leaves_coulombs_law_alone():
    P, X, W, O, F = random_problem(4)
    before, O.count.coulomb = X.v.copy(), 1
    assert solve_contacts(barzilai_borwein, P, X, W, O, F) == 0
    assert O.count.ended == SOLVE_FAILED
    np.testing.assert_array_equal(X.v, before)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("name", GRADIENTS)
def test_a_cut_solve_makes_no_energy(kind, name):
    for most in (1, 3, 10):
        P, X, W, O, F = random_problem(5, **KINDS[kind])
        _, _, N, b = dense(P, X)
        O.count.most = most
        X.p[:, 0] = 50.0
        solve_contacts(SOLVERS[name], P, X, W, O, F)
        p = impulses(P, X)
        assert 0.5 * p @ N @ p + b @ p < 1e-10


@pytest.mark.parametrize("kind", KINDS)
def test_what_velocities_contacts_see_and_impulses_change(kind):
    """By the dense matrices: relative velocities D v, and changes of velocities K^-1 D' p, each of all contacts."""
    P, X, *_ = random_problem(8, **KINDS[kind])
    D, DK, *_ = dense(P, X)
    r, rng = 6 if len(P.turn) else 3, np.random.default_rng(8)
    v, wide = X.v.copy(), X.wide.copy()
    before = np.concatenate([v[:, :6].ravel(), wide])
    for c in range(P.size[0]):
        rows = slice(c * r, c * r + r)
        both = np.ravel(
            [contact_velocity(P, X.v, X.wide, c), *([contact_angular_velocity(P, X.v, X.wide, c)] if r == 6 else [])]
        )
        np.testing.assert_allclose(both, (D @ before)[rows], atol=1e-13)
        p = rng.standard_normal(r)
        v[:], wide[:] = X.v, X.wide
        apply_contact_impulse(P, v, wide, c, tuple(p[:3]))
        if r == 6:
            apply_torque_impulse(P, v, wide, c, tuple(p[3:]))
        change = np.concatenate([v[:, :6].ravel(), wide]) - before
        np.testing.assert_allclose(change, DK[rows].T @ p, atol=1e-13)


@pytest.mark.parametrize("kind", KINDS)
def test_diagonal_blocks_by_definition(kind):
    """What a contact's own impulses and torques change its own velocities by, as six numbers each, without compliance."""
    P, X, *_ = random_problem(8, **KINDS[kind])
    D, DK, *_ = dense(P, X)
    r = 6 if len(P.turn) else 3
    upper = np.triu_indices(3)
    for c in range(P.size[0]):
        block = (D @ DK.T)[c * r : c * r + r, c * r : c * r + r]
        np.testing.assert_allclose(diagonal_block(P, c), block[:3, :3][upper], atol=1e-13)
        if r == 6:
            np.testing.assert_allclose(rolling_diagonal_block(P, c), block[3:, 3:][upper], atol=1e-13)


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("kind", ["nodes", "smooth", "soft", "groups and lines", "lines"])
@pytest.mark.parametrize("coulomb", [0, 1])
def test_residuals_by_definition(kind, coulomb, seed):
    """The largest |p - P(p - s u)| / s, s = 3 / trace of the diagonal block, u_n with mu |u_t| by Coulomb's law."""
    P, X, _, O, _ = random_problem(seed, **(KINDS | {"lines": {"nc": 0, "ng": 2, "nl": 3}})[kind])
    _, DK, N, b = dense(P, X)
    rng, nc = np.random.default_rng(seed), P.size[0]
    X.p[:], X.line[:] = rng.standard_normal(X.p.shape) + (1, 0, 0), rng.standard_normal(X.line.shape)
    p = impulses(P, X)
    free = np.concatenate([X.v[:, :6].ravel(), X.wide])
    (v, wide), w = (X.v.copy(), X.wide.copy()), free + DK.T @ p
    v[:, :6], wide[:] = w[: v[:, :6].size].reshape(-1, 6), w[v[:, :6].size :]
    O.count.coulomb = coulomb
    found = residuals(P, X, O, (v, wide, X.v, X.wide))
    u, lack, rates = N @ p + b, [], []
    for c in range(nc):
        k = slice(3 * c, 3 * c + 3)
        size, mu = 3 / np.trace(N[k, k]), P.mu[c]
        y = p[k] - size * (u[k] + (coulomb * mu * np.linalg.norm(u[k][1:]), 0, 0))
        t = np.linalg.norm(y[1:])
        edge = np.array([1, *(mu * y[1:] / t)])
        near = y if t <= mu * y[0] else max(0.0, edge @ y) / (edge @ edge) * edge
        lack.append(np.linalg.norm(near - p[k]))
        rates.append(lack[-1] / size)
    for k, line in enumerate(P.line_law, 3 * nc):
        size = 1 / N[k, k]
        lack.append(abs(np.clip(p[k] - size * u[k], *line[2:4]) - p[k]))
        rates.append(lack[-1] / size)
    largest = max([*np.linalg.norm(X.p, axis=1), *np.abs(X.line)])
    np.testing.assert_allclose(found, [max(rates), max(lack) / largest, b @ p, p @ N @ p], rtol=1e-12)


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("coulomb", [0, 1])
def test_residuals_with_rolling_and_spinning_friction_by_definition(coulomb, seed):
    """The same with torques as forces on an arm, the root of the ratio of the traces of both diagonal blocks."""
    P, X, _, O, _ = random_problem(seed, **KINDS["rolling friction"])
    _, DK, N, b = dense(P, X)
    rng = np.random.default_rng(seed)
    X.p[:], X.torque[:] = rng.standard_normal(X.p.shape) + (1, 0, 0), 0.3 * rng.standard_normal(X.p.shape)
    p = impulses(P, X)
    (v, wide), w = (X.v.copy(), X.wide.copy()), np.concatenate([X.v[:, :6].ravel(), X.wide]) + DK.T @ p
    v[:, :6], wide[:] = w[: v[:, :6].size].reshape(-1, 6), w[v[:, :6].size :]
    O.count.coulomb = coulomb
    found = residuals(P, X, O, (v, wide, X.v, X.wide))
    u, lack, rates = N @ p + b, [], []
    for c in range(P.size[0]):
        k, q = slice(6 * c, 6 * c + 3), slice(6 * c + 3, 6 * c + 6)
        size, arm = 3 / np.trace(N[k, k]), np.sqrt(np.trace(N[k, k]) / np.trace(N[q, q]))
        mu, rho, sigma = P.mu[c], P.turn[c, 0] / arm, P.turn[c, 1] / arm
        force, torque, rate, turn = p[k], p[q] / arm, u[k], arm * u[q]
        slip = mu * np.linalg.norm(rate[1:]) + rho * np.linalg.norm(turn[1:]) + sigma * abs(turn[0])
        to = force - size * (rate + (coulomb * slip, 0, 0)), torque - size * turn
        near = project_on_rolling_cone(mu, rho, sigma, 0.0, *map(tuple, to))
        lack.append(np.linalg.norm(np.ravel(near) - np.r_[force, torque]))
        rates.append(lack[-1] / size)
    largest = np.linalg.norm(X.p, axis=1).max()
    np.testing.assert_allclose(found, [max(rates), max(lack) / largest, b @ p, p @ N @ p], rtol=1e-12)


@pytest.mark.parametrize("bounds", [(0.5, 0.2, 0.05), (0.3, 0.02, 0.4), (1.5, 0.7, 0.7)])
def test_the_nearest_point_with_rolling_and_spinning_friction(bounds):
    """What is left is square on it, and has a positive part along no ray of the cone (Moreau's decomposition)."""
    mu, rho, sigma = bounds
    rng = np.random.default_rng(2)
    a = np.linspace(0.0, 2 * np.pi, 60, endpoint=False)
    circle = np.c_[np.cos(a), np.sin(a)]
    inside = 0
    for x in rng.standard_normal((200, 6)) * (1, 1, 1, 0.5, 0.5, 0.5) + (0.5, 0, 0, 0, 0, 0):
        y = np.ravel(project_on_rolling_cone(mu, rho, sigma, 0.0, tuple(x[:3]), tuple(x[3:])))
        rest = x - y
        assert np.linalg.norm(y[1:3]) <= mu * y[0] + 1e-12 and np.linalg.norm(y[4:]) <= rho * y[0] + 1e-12
        assert abs(y[3]) <= sigma * y[0] + 1e-12
        assert rest @ y == pytest.approx(0.0, abs=1e-12)
        most = rest[0] + mu * (circle @ rest[1:3]).max() + rho * (circle @ rest[4:]).max() + sigma * abs(rest[3])
        assert most <= 1e-12
        inside += y[0] > 0.0
    assert inside > 20


@pytest.mark.parametrize("mu", [0.0, 0.4, 2.0])
def test_the_nearest_forces_within_cones(mu):
    """Those of a balance at rest: what is left is square on them, and has a positive part along no ray of the cone."""
    n = 200
    x = np.random.default_rng(3).standard_normal(3 + 2 + 3 * n + 1)
    most = np.array([0.1])
    y = ConeProduct(3, np.array([1.0, -1.0]), np.full(n, mu), most).project(x)
    assert y[:3] == pytest.approx(x[:3], abs=0.0)
    assert y[3:5] == pytest.approx([max(x[3], 0.0), min(x[4], 0.0)], abs=0.0)
    assert y[-1] == np.clip(x[-1], -0.1, 0.1)
    p, rest = y[5:-1].reshape(n, 3), (x - y)[5:-1].reshape(n, 3)
    assert (np.hypot(p[:, 1], p[:, 2]) <= mu * p[:, 0] + 1e-14).all() and (p[:, 0] >= 0.0).all()
    assert np.abs((p * rest).sum(axis=1)).max() < 1e-14
    assert (rest[:, 0] + mu * np.hypot(rest[:, 1], rest[:, 2])).max() < 1e-14


@pytest.mark.parametrize("name", SOLVERS)
def test_the_units_of_residuals(name):
    """Other units of length and mass: one residual is a velocity, the other a number."""
    told = []
    for length, mass in ((1.0, 1.0), (1e3, 1.0), (1.0, 1e-3)):
        P, X, W, O, F = random_problem(6, nc=8)
        P.arm[:] *= length
        P.bias[:] *= length
        P.node[:, 0] /= mass
        P.node[:, 1:7] /= mass * length**2
        X.v[:, :3] *= length
        O.count.most, O.real.enough = 20, 0.0
        solve_contacts(SOLVERS[name], P, X, W, O, F)
        told.append(np.array([O.real.residual, O.real.force_residual]) / [length, 1.0])
    if name != "apgd":  # which takes N - 1 for a vector to start from, whatever the unit of 1
        np.testing.assert_allclose(told[1:], [told[0]] * 2, rtol=1e-6)
    assert (np.array(told) > 0).all()


@pytest.mark.parametrize("name", GRADIENTS)
def test_a_warm_start_is_used(name):
    """From the solution one iteration is enough."""
    P, X, W, O, F = random_problem(7)
    O.count.most, O.real.enough = 100_000, 1e-11
    free = X.v.copy()
    solve_contacts(SOLVERS[name], P, X, W, O, F)
    X.v[:], O.real.enough = free, 1e-9
    assert solve_contacts(SOLVERS[name], P, X, W, O, F) <= 3


@pytest.mark.parametrize("name", GRADIENTS)
def test_an_island_alone(name):
    P, X, W, O, F = random_problem(4, balls=True, nc=8, nn=6)
    P.at[:4] = [[-1, 0], [0, 1], [1, 2], [-1, 2]]
    P.at[4:] = [[-1, 3], [3, 4], [4, 5], [-1, 5]]
    P = P._replace(island=np.array([0, 4, 8]), member_p=np.array([0, 3, 6]), line_p=np.zeros(3, np.int64))
    both = allocate_solver(P)[0]
    both.v[:] = X.v
    O.count.most, O.real.enough = 10_000, 1e-13
    solve_contacts(SOLVERS[name], P, both, W, O, F)
    before = X.v.copy()
    for island in (1, 0):
        O.count.island = island
        solve_contacts(SOLVERS[name], P, X, W, O, F)
        if island:
            np.testing.assert_array_equal(X.v[:3], before[:3])
    np.testing.assert_allclose(X.v, both.v, atol=1e-10)


@pytest.mark.parametrize("name", SOLVERS)
def test_what_is_no_number_is_told(name):
    """Impulses are zero then, and velocities those without any."""
    P, X, W, O, F = random_problem(1)
    P.bias[3, 0] = np.nan
    free = X.v.copy()
    solve_contacts(SOLVERS[name], P, X, W, O, F)
    assert O.count.ended == SOLVE_FAILED
    np.testing.assert_array_equal(X.v, free)
    assert not X.p.any()


@pytest.mark.parametrize("balls", [False, True])
@pytest.mark.parametrize("name", SOLVERS)
def test_a_contact_of_what_cannot_move_is_left_alone(name, balls):
    """The others are solved as if it were not there."""
    P, X, W, O, F = random_problem(1, balls=balls)
    P.node[:3, :7], X.v[:3], P.bias[:, 0] = 0.0, 0.0, abs(P.bias[:, 0])
    P.bias[(P.at < 3).all(1), 0] = -1.0  # nothing can be done about these
    O.count.most, O.real.enough = 50_000, 1e-9
    solve_contacts(SOLVERS[name], P, X, W, O, F)
    stuck = (P.at < 3).all(1)
    assert stuck.any() and not stuck.all()
    assert not X.p[stuck].any() and X.p.any()
    assert O.count.ended == CONVERGED and O.real.residual < 1e-7
