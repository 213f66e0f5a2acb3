"""Boxes on slopes by Newton: Coulomb's law to rounding, step after step, from the impulses before."""

from __future__ import annotations

import numpy as np
import pytest

from flyball.numerics.complementarity.contact_problem import CONVERGED, allocate_solver, empty_problem
from flyball.numerics.complementarity.newton import newton
from tests.cone.enlarge import solved

H, G, MU = 5e-3, 9.81, 0.5
SIDES = (0.5, 0.4, 0.3)  # half lengths


def box(mass=2.0):
    """A box with four corners on a plane z = 0."""
    P = empty_problem(4, 1)
    X, W, O, F = allocate_solver(P)
    a, b, c = SIDES
    inertia = mass / 3.0 * np.array([b * b + c * c, a * a + c * c, a * a + b * b])
    P.node[0] = 1 / mass, *(1 / inertia), 0, 0, 0, 0
    P.frame[:] = 0, 0, 1, 1, 0, 0, 0, 1, 0
    P.at[:] = -1, 0
    P.arm[:, 3:] = [(x, y, -c) for x in (-a, a) for y in (-b, b)]
    P.mu[:] = MU
    O.count.most, O.real.enough, O.count.coulomb = 200, 1e-12, 1
    return P, X, W, O, F


@pytest.mark.parametrize("degrees", [5, 25, 26.5])
def test_below_the_angle_of_friction_nothing_creeps(degrees):
    P, X, W, O, F = box()
    a = np.radians(degrees)
    moved = 0.0
    for _ in range(200):
        X.v[0, :3] += H * G * np.array([np.sin(a), 0, -np.cos(a)])
        _, F = solved(newton, P, X, W, O, F)
        assert O.count.ended == CONVERGED
        moved += H * X.v[0, :6]
    assert abs(moved).max() < 1e-9  # a second


@pytest.mark.parametrize("degrees", [27, 30, 40, 60])
def test_above_it_the_acceleration_is_exact(degrees):
    P, X, W, O, F = box()
    a = np.radians(degrees)
    away, steps = 0.0, []
    for k in range(1, 201):
        X.v[0, :3] += H * G * np.array([np.sin(a), 0, -np.cos(a)])
        used, F = solved(newton, P, X, W, O, F)
        assert O.count.ended == CONVERGED
        assert X.v[0, 0] == pytest.approx(k * H * G * (np.sin(a) - MU * np.cos(a)), rel=1e-10)
        away += H * X.v[0, 2]
        steps.append(used)
    assert abs(away) < 1e-10 and abs(X.v[0, 3:6]).max() < 1e-10
    assert np.mean(steps[5:]) <= 2  # impulses of the step before are nearly right


def test_a_turning_box_loses_its_spin_by_friction():
    """It spins about its normal on a plane: torque mu N times the mean distance of equally loaded corners."""
    P, X, W, O, F = box()
    X.v[0, 5] = 3.0
    X.v[0, 2] = -H * G
    solved(newton, P, X, W, O, F)
    arm = np.hypot(*SIDES[:2])
    inertia = 2.0 / 3.0 * arm**2
    assert X.v[0, 5] == pytest.approx(3.0 - MU * 2.0 * G * H * arm / inertia, rel=1e-6)
    assert abs(X.v[0, :5]).max() < 1e-10


def rod(mu, theta=0.9, spin=1.0):
    """A slender rod that slides on its lower end, thrown ahead of it (Painleve 1895): mass 1, half length 1."""
    P = empty_problem(1, 1)
    X, W, O, F = allocate_solver(P)
    P.node[0] = 1.0, 3.0, 3.0, 3.0, 0, 0, 0, 1
    P.frame[0] = 0, 0, 1, 1, 0, 0, 0, 1, 0
    P.at[0], P.mu[0] = (-1, 0), mu
    P.arm[0, 3:] = np.cos(theta), 0, -np.sin(theta)
    O.count.most, O.real.enough, O.count.coulomb = 200, 1e-10, 1
    return P, X, W, O, F


@pytest.mark.parametrize("mu", [0.3, 1.0, 3.0])
@pytest.mark.parametrize("speed", [1.0, -1.0])
def test_painleves_rod_ends(mu, speed):
    """Impulses always exist (a step is an impact); what comes back obeys the law, and takes energy."""
    P, X, W, O, F = rod(mu)
    X.v[0, 0], X.v[0, 2] = speed, -H * G
    before = 0.5 * (X.v[0, :3] @ X.v[0, :3]) + 0.5 * X.v[0, 3:6] @ X.v[0, 3:6] / 3.0
    solved(newton, P, X, W, O, F)
    after = 0.5 * (X.v[0, :3] @ X.v[0, :3]) + 0.5 * X.v[0, 3:6] @ X.v[0, 3:6] / 3.0
    assert after <= before * (1 + 1e-12)
    if O.count.ended == CONVERGED:
        u = X.v[0, :3] + np.cross(X.v[0, 3:6], P.arm[0, 3:])
        p = X.p[0]
        assert u[2] > -1e-9 and abs(p[0] * u[2]) < 1e-9 and np.hypot(p[1], p[2]) <= mu * p[0] * (1 + 1e-12)
        assert abs(mu * p[0] * abs(u[0]) + p[1] * u[0]) < 1e-9
