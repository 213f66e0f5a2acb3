"""The small problem of rows that hold, push, grip: against all combinations, and closed forms."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from flyball.numerics.complementarity.dense_problem import (
    AT_HIGH,
    AT_LOW,
    AT_REST,
    BILATERAL,
    FRICTION_DISC,
    FRICTION_DISC_2,
    FRICTION_LINE,
    HOLD_IMPOSSIBLE,
    INACTIVE,
    NO_IMPULSE,
    NO_SOLUTION,
    SLIDING,
    SOLUTION_FOUND,
    UNILATERAL,
    DenseProblem,
    allocate_dense,
)
from flyball.numerics.complementarity.dense_solver import solve_dense_problem

OPEN = {
    INACTIVE: (NO_IMPULSE,),
    BILATERAL: (AT_REST,),
    UNILATERAL: (NO_IMPULSE, AT_REST),
    FRICTION_LINE: (AT_LOW, AT_REST, AT_HIGH),
}


def problem(A, b, rule, const=None, gain=None) -> DenseProblem:
    P = allocate_dense(len(b))
    P.A[:], P.b[:], P.rule[:] = A, b, rule
    if const is not None:
        P.const[:] = const
    if gain is not None:
        P.gain[:] = gain
    return P


def by_all_combinations(P: DenseProblem) -> list[tuple[np.ndarray, np.ndarray]]:
    """Every (x, u) that fulfils all rules."""
    n, out = len(P.b), []
    for states in itertools.product(*(OPEN[r] for r in P.rule)):
        K, r = np.zeros((n, n)), np.zeros(n)
        for i, s in enumerate(states):
            K[i, i] = 1.0
            if s == AT_REST:
                K[i], r[i] = P.A[i], -P.b[i]
            elif s != NO_IMPULSE:
                way = 1.0 if s == AT_HIGH else -1.0
                K[i] -= way * P.gain[i]
                r[i] = way * P.const[i]
        if abs(np.linalg.det(K)) < 1e-12:
            continue
        x = np.linalg.solve(K, r)
        u = P.A @ x + P.b
        if fulfilled(P, x, u, 1e-9):
            out.append((x, u))
    return out


def fulfilled(P: DenseProblem, x, u, tolerance) -> bool:
    reach = P.const + P.gain @ x
    for i, rule in enumerate(P.rule):
        if rule == BILATERAL and abs(u[i]) > tolerance:
            return False
        if rule == UNILATERAL and not (x[i] > -tolerance and u[i] > -tolerance and abs(x[i] * u[i]) < tolerance):
            return False
        if rule == FRICTION_LINE:
            inside = abs(x[i]) <= reach[i] + tolerance
            at_end = abs(abs(x[i]) - reach[i]) < tolerance and x[i] * u[i] <= tolerance
            if not inside or not (abs(u[i]) < tolerance or at_end):
                return False
    return True


@pytest.mark.parametrize("seed", range(60))
def test_random_rows_fulfil_their_rules_and_are_those_of_all_combinations(seed):
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 7))
    J = rng.normal(size=(n, n + int(rng.integers(0, 3)))) * 10.0 ** rng.uniform(-3, 3, (n, 1))
    P = problem(
        J @ J.T,
        rng.normal(size=n) * np.sqrt((J @ J.T).diagonal()),
        rng.choice([INACTIVE, BILATERAL, UNILATERAL, FRICTION_LINE], n),
    )
    P.const[:] = rng.uniform(0, 1, n) / np.sqrt(P.A.diagonal())
    P.state[:] = rng.integers(0, 4, n)
    assert solve_dense_problem(P) == SOLUTION_FOUND
    ((x, u),) = by_all_combinations(P)
    size = np.sqrt(P.A.diagonal())
    np.testing.assert_allclose(P.x * size, x * size, atol=1e-9 * np.abs(x * size).max())
    np.testing.assert_allclose(P.u / size, u / size, atol=1e-10 * (1 + np.abs(x * size).max()))


@pytest.mark.parametrize("seed", range(60))
def test_contacts_with_friction_of_their_own_load(seed):
    """Stewart and Trinkle's problem has a solution whatever the friction is."""
    rng = np.random.default_rng(100 + seed)
    n = int(rng.integers(1, 4))
    J = rng.normal(size=(2 * n, 2 * n + 1))
    P = problem(J @ J.T, rng.normal(size=2 * n), [UNILATERAL, FRICTION_LINE] * n)
    for k in range(n):
        P.gain[2 * k + 1, 2 * k] = rng.uniform(0.0, 2.0)
    P.state[:] = rng.integers(0, 4, 2 * n)
    assert solve_dense_problem(P) == SOLUTION_FOUND
    assert fulfilled(P, P.x, P.u, 1e-9)
    assert any(np.allclose(P.u, u, atol=1e-8) for _, u in by_all_combinations(P))


def test_many_rows():
    rng = np.random.default_rng(7)
    n = 40
    J = rng.normal(size=(n, 25))  # and redundant
    P = problem(J @ J.T, J @ rng.normal(size=25), rng.choice([UNILATERAL, FRICTION_LINE], n), const=np.full(n, 0.05))
    assert solve_dense_problem(P) == SOLUTION_FOUND
    assert fulfilled(P, P.x, P.u, 1e-8)


def test_rod_on_three_supports_shares_its_weight_with_the_least_squares():
    """Weights at -1, 0, 1 under a load at 0.1: x_k = 1/3 + 0.1 k / 2; at 0.9 the far one lets go."""
    J = np.array([[1.0, -1.0], [1.0, 0.0], [1.0, 1.0]])
    for at, expected in ((0.1, [1 / 3 - 0.05, 1 / 3, 1 / 3 + 0.05]), (0.9, [0.0, 0.1, 0.9])):
        # equal mass and inertia of 1, so that every diagonal is not the same: weights 2, 1, 2
        for inertia in (1.0, 1e4):
            P = problem(J @ np.diag([1.0, 1 / inertia]) @ J.T, -J @ np.array([1.0, at / inertia]), [UNILATERAL] * 3)
            assert solve_dense_problem(P) == SOLUTION_FOUND
            np.testing.assert_allclose(P.u, 0.0, atol=1e-12)
            np.testing.assert_allclose([P.x.sum(), P.x[2] - P.x[0]], [1.0, at], rtol=1e-9)
            if inertia == 1e4:
                np.testing.assert_allclose(P.x, expected, atol=1e-4)


def test_answer_does_not_depend_on_what_was_tried_first():
    J = np.array([[1.0, -1.0], [1.0, 0.0], [1.0, 1.0]])
    seen = []
    for state in itertools.product((NO_IMPULSE, AT_REST), repeat=3):
        P = problem(J @ J.T, -J @ np.array([1.0, 0.3]), [UNILATERAL] * 3)
        P.state[:] = state
        assert solve_dense_problem(P) == SOLUTION_FOUND
        seen.append((*P.x, *P.state))
    np.testing.assert_allclose(seen, [seen[0]] * 8, atol=1e-14)


def test_two_walls_that_close_on_a_body_cannot_be_kept():
    P = problem([[1.0, -1.0], [-1.0, 1.0]], [-1.0, -1.0], [UNILATERAL] * 2)
    assert solve_dense_problem(P) in (NO_SOLUTION, HOLD_IMPOSSIBLE)


def test_nothing_moves_what_a_driver_moves():
    P = problem([[0.0]], [-1.0], [UNILATERAL])
    assert solve_dense_problem(P) in (NO_SOLUTION, HOLD_IMPOSSIBLE)


def painleve(mu: float, angle: float, spin: float) -> DenseProblem:
    """A rod of mass 1, length 2 slides to the right on its lower end: accelerations of that end, g = 1.

    Normal and friction are one row, N (1 - mu ...): u = N (1 + 3 cos a (cos a - mu sin a)) + spin^2 sin a - 1
    (Painleve 1895; Stewart 2000, SIAM Review 42, section 1.2).
    """
    c, s = np.cos(angle), np.sin(angle)
    A = np.array([[1 + 3 * c * c, -3 * c * s], [-3 * c * s, 1 + 3 * s * s]])
    P = problem(A, [spin**2 * s - 1.0, spin**2 * c], [UNILATERAL, SLIDING])
    P.gain[1, 0] = mu
    P.bound_sign[1] = -1.0  # the end slides to the left when seen along the row
    return P


def test_painleves_rod():
    """Where 1 + 3 cos^2 a < 3 mu sin a cos a: none if it would sink in, else to go on or to lift off."""
    a = 1.1
    mu = 1.5 * (1 + 3 * np.cos(a) ** 2) / (3 * np.sin(a) * np.cos(a))
    P = painleve(0.3, a, 0.0)
    P.bound_sign[1] = 1.0
    assert solve_dense_problem(P) == SOLUTION_FOUND
    c, s = np.cos(a), np.sin(a)
    np.testing.assert_allclose(P.x[0], 1.0 / (1 + 3 * c * c + 0.3 * 3 * s * c), rtol=1e-12)
    P = painleve(mu, a, 0.0)
    assert solve_dense_problem(P) == NO_SOLUTION
    lifted, pressed = painleve(mu, a, 2.0), painleve(mu, a, 2.0)
    pressed.state[:] = AT_REST
    assert solve_dense_problem(lifted) == solve_dense_problem(pressed) == SOLUTION_FOUND
    assert lifted.x[0] == 0.0 < lifted.u[0]
    np.testing.assert_allclose(pressed.x[0], (4 * s - 1.0) / (mu * 3 * s * c - 1 - 3 * c * c), rtol=1e-9)


def coulomb(P: DenseProblem, c: int) -> None:
    """What contact c (rows n, t1, t2) has to fulfil."""
    n, t = P.x[3 * c], P.x[3 * c + 1 : 3 * c + 3]
    v, reach = P.u[3 * c + 1 : 3 * c + 3], P.reach[3 * c + 1]
    size = np.abs(P.b).max()
    assert n >= 0.0 and P.u[3 * c] > -1e-11 * size and n * P.u[3 * c] < 1e-10 * size**2
    assert np.hypot(*t) <= reach * (1 + 1e-10) + 1e-12 * size
    if np.hypot(*v) > 1e-10 * size:
        np.testing.assert_allclose(t, -reach * v / np.hypot(*v), atol=1e-9 * size)


@pytest.mark.parametrize("seed", range(40))
def test_cones_in_space(seed):
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 4))
    J = rng.normal(size=(3 * n, 3 * n + 2))
    P = problem(J @ J.T, rng.normal(size=3 * n), [UNILATERAL, FRICTION_DISC, FRICTION_DISC_2] * n)
    for k in range(n):
        P.gain[3 * k + 1, 3 * k] = rng.uniform(0.0, 0.8)
    assert solve_dense_problem(P) == SOLUTION_FOUND
    for k in range(n):
        coulomb(P, k)


def test_block_that_is_pushed_along_a_plane_slides_the_way_it_is_pushed():
    P = problem(np.eye(3), [-1.0, 3.0, 4.0], [UNILATERAL, FRICTION_DISC, FRICTION_DISC_2])
    P.gain[1, 0] = 0.5
    assert solve_dense_problem(P) == SOLUTION_FOUND
    np.testing.assert_allclose(P.x, [1.0, -0.3, -0.4], rtol=1e-12)
    np.testing.assert_allclose(P.u, [0.0, 2.7, 3.6], atol=1e-12)


def test_what_is_all_rounding_is_solved():
    """Of two stops from which both loads have gone at once, one carries nothing: the other is held by itself then."""
    P = allocate_dense(2)
    P.A[:], P.rule[:], P.state[:] = (
        [[0.62886209644231463, -2.5849336681079205], [-2.5849336681079205, 19.63456324632039]],
        UNILATERAL,
        AT_REST,
    )
    P.b[:], P.grain[:] = [2.6303011932863456e-13, -2.2006461027982152e-12], 2.1047211629579372e-13
    assert solve_dense_problem(P) == SOLUTION_FOUND
    assert P.x[1] == pytest.approx(-P.b[1] / P.A[1, 1], rel=1e-12) and P.x[0] == 0.0


@pytest.mark.parametrize("seed", range(20))
def test_friction_holds_nothing_where_its_line_is_below_zero(seed):
    """Loads made linear elsewhere can be negative; what they hold cannot: these rows slide freely, or as if there."""
    rng = np.random.default_rng(200 + seed)
    n = int(rng.integers(2, 9))
    J = rng.normal(size=(n, n + 1))
    P = problem(J @ J.T, rng.normal(size=n), [FRICTION_LINE] * n)
    P.const[:] = rng.uniform(-1.0, 1.0, n)
    assert solve_dense_problem(P) == SOLUTION_FOUND
    none = P.const < 0.0
    assert not P.x[none].any()
    P.const[none] = 0.0
    assert fulfilled(P, P.x, P.u, 1e-9)
    assert all(s == (AT_LOW if u > 0.0 else AT_HIGH) for s, u in zip(P.state[none], P.u[none], strict=True))
