"""The linear complementarity problem: pivoting against enumeration, pyramids against their closed forms and the cone."""

from __future__ import annotations

from itertools import pairwise, product

import numpy as np
import pytest

import flyball as fb
from flyball.errors import AnalysisError
from flyball.numerics.complementarity.contact_problem import (
    CONVERGED,
    SOLVE_FAILED,
    allocate_solver,
    empty_problem,
    solve_contacts,
)
from flyball.numerics.complementarity.friction_pyramid import project_on_polygon, pyramid, pyramid_sliding_friction
from flyball.numerics.complementarity.gauss_seidel import gauss_seidel
from tests.cone.lemke import delassus, lemke, pyramid_by_lemke
from tests.cone.problems import dense, random_problem


def enumerated(M, q):
    """All solutions of a small problem: every choice of what is zero."""
    n, found = len(q), []
    for active in product([False, True], repeat=n):
        a = np.array(active)
        z = np.zeros(n)
        if a.any():
            sub = M[np.ix_(a, a)]
            if abs(np.linalg.det(sub)) < 1e-12:
                continue
            z[a] = np.linalg.solve(sub, -q[a])
        if (z > -1e-10).all() and (M @ z + q > -1e-9).all():
            found.append(z)
    return found


@pytest.mark.parametrize("seed", range(20))
def test_pivoting_finds_what_enumeration_finds(seed):
    rng = np.random.default_rng(seed)
    n = int(rng.integers(2, 9))
    A = rng.standard_normal((n, n))
    M, q = A @ A.T + (A - A.T), rng.standard_normal(n)  # positive definite, not symmetric: one solution
    z = lemke(M, q)
    (only,) = enumerated(M, q)
    np.testing.assert_allclose(z, only, atol=1e-9)


def test_ties_do_not_run_in_circles():
    """All q equal, and zeros: every ratio is a tie."""
    M = np.array([[1.0, 2, 0], [0, 1, 2], [2, 0, 1]])  # Murty 1988: needs care
    z = lemke(M, -np.ones(3))
    w = M @ z - 1
    assert (z >= 0).all() and w.min() > -1e-12 and abs(w @ z) < 1e-12


def test_no_solution_and_too_much_are_told():
    with pytest.raises(AnalysisError, match="ray"):
        lemke(np.array([[0.0, 0], [0, 0]]), np.array([-1.0, 1]))
    with pytest.raises(AnalysisError, match="too many"):
        lemke(np.eye(2001), -np.ones(2001))
    P, X, *_ = random_problem(0)
    with pytest.raises(AnalysisError, match="3 edges"):
        pyramid_by_lemke(P, X, 2)


def test_the_dense_operator():
    P, X, *_ = random_problem(3, ng=2, nl=4, soft=0.2)
    _, _, N, b = dense(P, X)
    for made, told in zip(delassus(P, X), (N, b)):
        np.testing.assert_allclose(made, told, atol=1e-12)


@pytest.mark.parametrize("d", [3, 4, 7, 16])
def test_the_nearest_point_of_a_polygon(d):
    """As far away as the nearest of the sides, each taken by itself."""
    rng = np.random.default_rng(d)
    corners = 0.7 * np.exp(2j * np.pi * np.arange(d + 1) / d)
    for x, y in rng.uniform(-1.5, 1.5, (100, 2)):
        near, inside = [], True
        for s, e in pairwise(corners):
            t = (complex(x, y) - s) / (e - s)
            inside &= t.imag >= 0
            near.append(abs(t - min(max(t.real, 0), 1)) * abs(e - s))
        a, b = project_on_polygon(d, 0.7, x, y)
        assert abs(complex(a - x, b - y)) == pytest.approx(0 if inside else min(near), abs=1e-12)


@pytest.mark.parametrize("d", [3, 4, 8])
@pytest.mark.parametrize("angle", [0.0, 0.3, 1.0, 2.5])
def test_a_slider_on_a_pyramid(d, angle):
    """Friction acts along the edge nearest to the direction against the velocity; both ways of solving agree."""
    P = empty_problem(1, 1)
    P.node[0, 0], P.at[0], P.mu[0], P.frame[0] = 1.0, (-1, 0), 0.3, (0, 0, 1, 1, 0, 0, 0, 1, 0)
    X, W, O, F = allocate_solver(P)
    free = -500 * np.cos(angle), -500 * np.sin(angle), -1.0
    X.v[0, :3], O.count.directions, O.count.coulomb = free, d, 1
    O.count.most, O.real.enough = 1000, 1e-14
    solve_contacts(pyramid, P, X, W, O, F)
    along, across = pyramid_sliding_friction(d, angle)
    assert X.p[0, 0] == pytest.approx(1.0)
    force = X.p[0, 1] * np.cos(angle) + X.p[0, 2] * np.sin(angle), X.p[0, 2] * np.cos(angle) - X.p[0, 1] * np.sin(angle)
    assert force == pytest.approx((0.3 * along, 0.3 * across), abs=1e-9)
    Y = allocate_solver(P)[0]
    Y.v[0, :3] = free
    pyramid_by_lemke(P, Y, d)
    np.testing.assert_allclose(Y.p, X.p, atol=1e-9)


@pytest.mark.parametrize("kind", [{}, {"ng": 2, "nc": 6}, {"soft": 0.2}])
def test_pivoting_agrees_with_sweeps(kind):
    P, X, W, O, F = random_problem(8, **{"nc": 5, **kind})
    P.mu[:] *= 0.5
    Y = allocate_solver(P)[0]
    Y.v[:], Y.wide[:] = X.v, X.wide
    O.count.most, O.real.enough, O.count.directions, O.count.coulomb = 100_000, 1e-13, 6, 1
    solve_contacts(pyramid, P, X, W, O, F)
    assert O.count.ended == CONVERGED
    pyramid_by_lemke(P, Y, 6)
    np.testing.assert_allclose(Y.v, X.v, atol=1e-8)


def test_many_edges_are_the_cone():
    P, X, W, O, F = random_problem(8, nc=5)
    O.count.most, O.real.enough, O.count.directions, O.count.coulomb = 100_000, 1e-12, 400, 1
    Y = allocate_solver(P)[0]
    Y.v[:] = X.v
    solve_contacts(pyramid, P, X, W, O, F)
    solve_contacts(gauss_seidel, P, Y, W, O, F)
    np.testing.assert_allclose(X.v, Y.v, atol=2e-2)


def test_what_it_is_not_made_for_is_left_alone():
    P, X, W, O, F = random_problem(1)
    before, O.count.directions = X.v.copy(), 4
    assert solve_contacts(pyramid, P, X, W, O, F) == 0 and O.count.ended == SOLVE_FAILED
    np.testing.assert_array_equal(X.v, before)


@pytest.mark.parametrize(("directions", "angle"), [(4, 0.2), (4, 0.6), (4, 0.84), (8, 0.6), (16, 0.3)])
def test_a_sliding_body_is_braked_along_the_nearest_edge(directions, angle):
    """In a simulation, relative to mu g: along the velocity, and across it."""
    c, s = np.cos(angle), np.sin(angle)
    m = fb.Mechanism("puck", gravity=(0, 0, -9.81))
    m.add(fb.Ground("ice", shape=fb.Plane()), fb.Contact(friction=0.5))
    m.add(
        fb.Body(
            "b",
            shape=fb.Sphere(radius=0.1),
            mass=1,
            inertia=(1e6,) * 3,
            position=(0, 0, 0.1),
            velocity=(2 * c, 2 * s, 0),
        )
    )
    run = m.simulate(0.01, method=fb.Stepping(step=1e-3, solver="pyramid", directions=directions), outputs=2)
    x, y, _ = (run["b"].velocity[0] - run["b"].velocity[-1]) / (0.01 * 0.5 * 9.81)
    along, across = pyramid_sliding_friction(directions, angle)
    assert (c * x + s * y, s * x - c * y) == pytest.approx((along, -across), abs=2e-2)  # it turns a little meanwhile


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"directions": 4}, r"directions of Stepping is for solver='pyramid' and solver='lcp', not 'auto'"),
        ({"solver": "pyramid", "directions": 2}, "directions .* 3"),
        ({"solver": "pyramid", "coulomb": False}, "Coulomb's law on a pyramid"),
    ],
)
def test_options_of_the_pyramid(options, message):
    with pytest.raises(fb.ModelError, match=message):
        fb.Stepping(**options)


def test_the_pyramid_has_no_rolling_friction():
    m = fb.Mechanism("ball", gravity=(0, 0, -9.81))
    m.add(fb.Ground("floor", shape=fb.Plane()), fb.Contact(friction=0.5, rolling_friction=0.01))
    m.add(fb.Body("b", shape=fb.Sphere(radius=0.1), density=1000, position=(0, 0, 0.1)))
    with pytest.raises(fb.ModelError, match="'pyramid' of Stepping has no rolling or spinning friction"):
        m.simulate(0.1, method=fb.Stepping(solver="pyramid"))
