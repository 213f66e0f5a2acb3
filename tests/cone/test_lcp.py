"""Lemke's pivoting as a solver: complementarity to rounding, closed forms, and the motions of other solvers."""

from __future__ import annotations

import numpy as np
import pytest

import flyball as fb
from flyball.numerics.complementarity.contact_problem import (
    CONVERGED,
    SOLVE_FAILED,
    STORAGE_TOO_SMALL,
    allocate_solver,
    empty_problem,
    solve_contacts,
)
from flyball.numerics.complementarity.friction_pyramid import MAX_UNKNOWNS, lcp, lcp_storage, pyramid
from tests.cone.lemke import delassus
from tests.cone.problems import random_problem


def solved(P, X, directions=8):
    """The solution, and the settings with its residual."""
    Y, W, O, _ = allocate_solver(P)
    Y.v[:], Y.wide[:] = X.v, X.wide
    O.count.directions, O.count.coulomb = directions, 1
    solve_contacts(lcp, P, Y, W, O, lcp_storage())
    return Y, O


def violation(P, X, Y, d):
    """Largest violation of the laws of contact, friction on the pyramid and lines, from the dense operator."""
    N, b = delassus(P, X)
    nc, worst = int(P.size[0]), 0.0
    u = N @ np.r_[Y.p[:nc].ravel(), Y.line] + b
    angle = 2 * np.pi * np.arange(d) / d
    edges = np.column_stack([np.cos(angle), np.sin(angle)])
    for c in range(nc):
        p, un, ut = Y.p[c], u[3 * c], u[3 * c + 1 : 3 * c + 3]
        least = P.least[c] if len(P.least) else 0.0
        worst = max(worst, abs(min(un, p[0] - least)))
        middle = 2 * np.pi * (np.arange(d) + 0.5) / d  # the sides of the polygon
        inside = np.cos(np.pi / d) * P.mu[c] * p[0] - (np.cos(middle) * p[1] + np.sin(middle) * p[2]).max()
        worst = max(worst, -inside)
        dissipated = -(p[1:] @ ut)  # the largest that the polygon allows
        worst = max(worst, abs(dissipated - P.mu[c] * p[0] * max((-edges @ ut).max(), 0.0)))
    for k in range(int(P.size[3])):
        low, high, w, x = P.line_law.lower[k], P.line_law.upper[k], u[3 * nc + k], Y.line[k]
        worst = max(worst, abs(x - np.clip(x - w, low, high)))
    return worst


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("kind", [{}, {"nc": 30, "nn": 8}, {"ng": 2, "nl": 6}, {"soft": 0.2}, {"mu": 0.0}])
def test_complementarity(kind, seed):
    """Gaps that are not negative, as in a time step: a solution exists, also with many redundant contacts."""
    P, X, *_ = random_problem(seed, **kind)
    P.bias[:, 0], P.bias[:, 1:] = abs(P.bias[:, 0]), 0.0
    Y, O = solved(P, X, 6)
    assert O.count.ended == CONVERGED
    assert O.real.residual < 1e-10
    assert violation(P, X, Y, 6) < 1e-10


def boxes(n, mu, v, w):
    """A stack of cubes on the floor, each on four corners: redundant and symmetric, so that many ratios are ties."""
    P = empty_problem(4 * n, n)
    P.node[:, 0], P.node[:, 1:4], P.mu[:] = 1.0, 6.0, mu
    for i in range(4 * n):
        k, x, y = i // 4, 0.5 - i % 2, 0.5 - (i % 4) // 2
        P.at[i], P.frame[i] = (k - 1 if k else -1, k), (0, 0, 1, 1, 0, 0, 0, 1, 0)
        P.arm[i] = x, y, 0.5, x, y, -0.5
    X = allocate_solver(P)[0]
    X.v[:, :3], X.v[:, 3:6] = v, w
    return P, X


@pytest.mark.parametrize("n", [1, 3, 6])
@pytest.mark.parametrize("directions", [4, 8])
@pytest.mark.parametrize("mu", [0.1, 0.6])
def test_stacks_of_cubes(n, directions, mu):
    """At rest they carry the weight of those above; sliding ones are braked by mu times it."""
    for v, w in (
        ((0, 0, -1), (0, 0, 0)),
        ((0.3, 0.2, -1), (0, 0, 0.5)),
        ((1e-9, 0, -1), (0, 0, 1e-9)),
        ((0, 0, -1), (0.1, 0, 0)),
    ):
        P, X = boxes(n, mu, v, w)
        Y, O = solved(P, X, directions)
        assert O.count.ended == CONVERGED
        assert violation(P, X, Y, directions) < 1e-10
    P, X = boxes(n, mu, (0, 0, -1), (0, 0, 0))
    Y, _ = solved(P, X, directions)
    np.testing.assert_allclose(Y.p[:, 0].reshape(n, 4).sum(axis=1), np.arange(n, 0, -1), atol=1e-12)
    np.testing.assert_allclose(Y.v[:, :6], 0.0, atol=1e-12)
    P, X = boxes(n, 0.1, (10, 0, -1), (0, 0, 0))  # does not tip
    Y, _ = solved(P, X, directions)
    assert Y.v[:, 0].sum() == pytest.approx(10 * n - 0.1 * n, abs=1e-10)


def test_without_friction_it_is_the_quadratic_program():
    """min p' N p / 2 + b' p, p >= 0, by SciPy's non-negative least squares of a factor of N."""
    from scipy.optimize import nnls

    for seed in range(5):
        P, X, *_ = random_problem(seed, nc=14, nn=5, mu=0.0)
        N, b = delassus(P, X)
        n = slice(0, None, 3)
        N, b = N[n, n], b[n]
        w, V = np.linalg.eigh(N)
        kept = w > 1e-12 * w.max()
        L = (V[:, kept] * np.sqrt(w[kept])).T  # N = L' L
        c = -np.linalg.lstsq(L.T, b, rcond=None)[0]
        if np.abs(L.T @ c + b).max() > 1e-9:
            continue  # b outside of the range: gaps that no velocities have
        p = nnls(L, c, maxiter=10_000)[0]
        Y, O = solved(P, X)
        assert O.count.ended == CONVERGED
        np.testing.assert_allclose(N @ Y.p[:, 0], N @ p, atol=1e-9)


def pile(friction):
    m = fb.Mechanism("pile", gravity=(0, 0, -9.81))
    m.add(fb.Ground("floor", shape=fb.Plane()))
    at = [(0.03 * (k % 2), 0.02 * (k % 3), 0.055 + 0.1 * k) for k in range(5)]
    m.add(fb.Bodies("balls", shape=fb.Sphere(radius=0.05), density=1000, position=at), fb.Contact(friction=friction))
    return m


@pytest.mark.parametrize(("friction", "other"), [(0.4, "pyramid"), (0.0, "newton"), (0.0, "pyramid")])
def test_motions_of_a_pile(friction, other):
    """With friction as by sweeps on the same pyramid, without as the cone's Newton method."""
    fine = {"tolerance": 1e-12, "iterations": 20_000, "position_iterations": 20_000}
    run, expected = (
        pile(friction).simulate(0.3, method=fb.Stepping(step=1e-3, solver=solver, **more), outputs=7)
        for solver, more in (("lcp", {}), (other, fine))
    )
    np.testing.assert_allclose(run["balls"].position, expected["balls"].position, atol=1e-8)
    assert run.health.contact.residual < 1e-9
    assert run.health.contact.unconverged == 0


def test_joints_with_stops_and_friction():
    """A rod on a hinge with friction that falls on its stop, beside a ball: lines with bounds; as by sweeps."""

    def rod():
        m = fb.Mechanism("rod", gravity=(0, 0, -9.81))
        m.add(fb.Ground("floor", shape=fb.Plane()))
        m.add(fb.Body("rod", shape=fb.Box(edges=(1, 0.1, 0.1)), density=500, position=(0.5, 0, 0.5)))
        m.add(fb.Revolute("A", "ground", "rod", at=(0, 0, 0.5), axis=(0, 1, 0)))
        m.add(fb.JointFriction("f", "A", static=0.3, radius=0.05), fb.Limit("stop", "A.angle", upper=0.2))
        m.add(fb.Body("ball", shape=fb.Sphere(radius=0.05), density=1000, position=(0.8, 0, 0.6)))
        return m.add(fb.Contact(friction=0.3)) and m

    fine = {"tolerance": 1e-12, "iterations": 20_000, "position_iterations": 20_000}
    run, expected = (
        rod().simulate(0.5, method=fb.Stepping(step=1e-3, solver=solver, **more), outputs=11)
        for solver, more in (("lcp", {}), ("pyramid", fine))
    )
    np.testing.assert_allclose(run["A.angle"], expected["A.angle"], atol=1e-7)
    np.testing.assert_allclose(run["ball"].position, expected["ball"].position, atol=1e-6)
    assert run["A.angle"][-1] == pytest.approx(0.2, abs=1e-3)


def test_its_limits():
    """Too many unknowns, rolling friction, options without effect."""
    n = MAX_UNKNOWNS // (4 * 10) + 1
    Y, O = solved(*boxes(n, 0.5, (0, 0, -1), (0, 0, 0)))
    assert O.count.ended == STORAGE_TOO_SMALL
    assert O.count.needed_numbers == 40 * n
    assert not Y.p.any()
    P, X, *_ = random_problem(0, nc=4, nn=3, turning=True)
    assert solved(P, X)[1].count.ended == SOLVE_FAILED
    with pytest.raises(fb.ModelError, match=r"'lcp' of Stepping solves at most 600 unknowns .* are needed; give fewer"):
        pile(0.4).simulate(1, method=fb.Stepping(step=1e-3, solver="lcp", directions=300))
    with pytest.raises(fb.ModelError, match=r"'lcp' of Stepping finds the solution by pivoting.*leave tolerance out"):
        fb.Stepping(solver="lcp", tolerance=1e-6)
    with pytest.raises(fb.ModelError, match=r"'lcp' of Stepping solves Coulomb's law on a pyramid"):
        fb.Stepping(solver="lcp", coulomb=False)


def test_no_solution_is_told():
    """Two walls that approach: no impulse keeps both gaps open."""
    P = empty_problem(2, 1)
    P.node[0, 0] = 1.0
    P.at[:], P.bias[:, 0] = (-1, 0), -1.0
    P.frame[0], P.frame[1] = (0, 0, 1, 1, 0, 0, 0, 1, 0), (0, 0, -1, 1, 0, 0, 0, -1, 0)
    X = allocate_solver(P)[0]
    Y, O = solved(P, X)
    assert O.count.ended == SOLVE_FAILED
    np.testing.assert_array_equal(Y.v, X.v)


def test_both_pyramids_agree_where_the_solution_is_unique():
    P, X, W, O, F = random_problem(8, nc=5)
    P.mu[:] *= 0.5
    Y, _ = solved(P, X, 6)
    O.count.most, O.real.enough, O.count.directions, O.count.coulomb = 100_000, 1e-13, 6, 1
    solve_contacts(pyramid, P, X, W, O, F)
    np.testing.assert_allclose(Y.v, X.v, atol=1e-10)
