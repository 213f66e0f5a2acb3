"""Rolling and spinning friction: closed forms, where the energy goes, and which solver did it."""

from __future__ import annotations

import numpy as np
import pytest

import flyball as fb
from flyball.collision.tables import no_contacts
from flyball.numerics.complementarity.contact_operator import to_world_frame
from flyball.numerics.complementarity.contact_problem import allocate_solver, empty_problem
from flyball.simulation.impulse_stepping.contact_constraints import account_contact, account_rolling, warm_start
from flyball.simulation.impulse_stepping.contact_laws import add_expansion
from flyball.simulation.impulse_stepping.stepping_tables import (
    ContactMemory,
    initial_run_state,
)
from tests.cone.problems import KINDS, dense, random_problem

G, R, RHO, SIGMA = 9.81, 0.1, 0.002, 0.001


def ball(velocity: tuple, turning: tuple, solver: str) -> fb.Result:
    m = fb.Mechanism("ball", gravity=(0, 0, -G))
    m.add(fb.Ground("floor", shape=fb.Plane()))
    start = {"velocity": velocity, "angular_velocity": turning}
    m.add(fb.Body("ball", shape=fb.Sphere(radius=R), mass=1, position=(0, 0, R), **start))
    m.add(fb.Contact(friction=0.5, rolling_friction=RHO, spinning_friction=SIGMA))
    return m.simulate(0.5, outputs=11, method=fb.Stepping(step=2e-3, solver=solver))


@pytest.mark.parametrize("solver", ["auto", "newton", "gauss-seidel"])
def test_rolling_and_spinning_slow_down(solver: str) -> None:
    """By rho g / R / (1 + 2/5) and by sigma m g / I; what is lost is friction's."""
    run = ball((1, 0, 0), (0, 1 / R, 0), solver)
    assert run["ball"].vx[-1] == pytest.approx(1 - RHO * G / R / 1.4 * 0.5, abs=1e-9)
    assert np.abs(run.energy.balance).max() < 1e-9
    assert run.energy.friction_loss[-1] == pytest.approx(0.7 * (1 - run["ball"].vx[-1] ** 2))
    run = ball((0, 0, 0), (0, 0, 20), solver)
    assert run["ball"].omega_z[-1] == pytest.approx(20 - SIGMA * G / (0.4 * R * R) * 0.5, abs=1e-9)
    assert np.abs(run.energy.balance).max() < 1e-9
    if solver != "gauss-seidel":
        assert "by Gauss-Seidel" in run.health.contact.solver


def test_a_solver_of_the_convex_form_is_refused_for_coulombs_law() -> None:
    with pytest.raises(fb.ModelError, match=r"convex problem only(?s:.*)coulomb=False"):
        fb.Stepping(solver="barzilai-borwein")
    assert fb.Stepping(solver="barzilai-borwein", coulomb=False).solver == "barzilai-borwein"


@pytest.mark.parametrize("held", [False, True])
@pytest.mark.parametrize("law", ["poisson", "newton", "moreau"])
@pytest.mark.parametrize("restitution", [0.5, 1.0])
def test_what_torques_take_in_impacts_is_frictions_too(restitution: float, law: str, held: bool) -> None:
    """A spinning ball that bounces with rolling friction; free, or part of a mechanism by a spring that is soft."""
    m = fb.Mechanism("ball", gravity=(0, 0, -G))
    m.add(fb.Ground("floor", shape=fb.Plane()))
    start = {"velocity": (1, 0, 0), "angular_velocity": (0, 3, 20)}
    m.add(fb.Body("ball", shape=fb.Sphere(radius=R), mass=1, position=(0, 0, R + 0.2), **start))
    if held:  # its forces are not those of gravity alone
        m.add(fb.SpringDamper("spring", "ground", "ball", at=((0, 0, 9), (0, 0, R + 0.2)), stiffness=1e-3))
    m.add(fb.Contact(friction=0.5, rolling_friction=0.01, spinning_friction=0.01, restitution=restitution))
    run = m.simulate(1, outputs=11, method=fb.Stepping(step=2e-3, restitution=law))
    assert run.energy.friction_loss[-1] > 0.9
    assert np.abs(run.energy.balance).max() < (1e-5 if held else 1e-12)
    assert np.diff(run.energy.total).max() < (1e-5 if held else 1e-12)


@pytest.mark.parametrize("seed", range(4))
def test_an_expansion_goes_as_far_as_the_energy_before_the_impact(seed: int) -> None:
    """With torques of rolling and spinning friction: kinetic energy by masses and inertias, to rounding."""
    P, X, *_ = random_problem(seed, **KINDS["rolling friction"])
    Z, E = allocate_solver(P)[0], allocate_solver(P)[0]
    nc, nodes = P.size[0], P.size[1]
    D, DK, *_ = dense(P, X)
    rng, first = np.random.default_rng(seed), X.v[:, :6].ravel().copy()

    def kinetic(v: np.ndarray) -> float:
        total = 0.0
        for (inverse, xx, yy, zz, xy, xz, yz), u in zip(P.node[:, :7], v.reshape(nodes, 6), strict=True):
            turning = np.linalg.inv([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
            total += 0.5 * (u[:3] @ u[:3] / inverse + u[3:] @ turning @ u[3:])
        return total

    seen = (D @ first).reshape(nc, 6)
    now, state = (
        ContactMemory.blank(nc),
        initial_run_state(np.zeros(3)),
    )
    (
        now.impact_velocity,
        now.impact_spin,
    ) = seen[:, :3], seen[:, 3:]
    lost = -0.02 * seen.ravel()  # against what the contacts see: energy is lost
    more = 2.0 * rng.standard_normal((nc, 6))
    Z.p[:], Z.torque[:] = lost.reshape(nc, 6)[:, :3], lost.reshape(nc, 6)[:, 3:]
    E.p[:], E.torque[:] = more[:, :3], more[:, 3:]
    X.v[:, :6] = (first + DK.T @ lost).reshape(nodes, 6)
    E.v[:, :6] = X.v[:, :6] + (DK.T @ more.ravel()).reshape(nodes, 6)
    C = no_contacts(nc)
    C.count.found = nc
    assert kinetic(X.v[:, :6].ravel()) < kinetic(first) < kinetic(E.v[:, :6].ravel())
    add_expansion(P, np.zeros((nc, 3)), Z, E, X, C, state, now)
    assert kinetic(X.v[:, :6].ravel()) == pytest.approx(kinetic(first), rel=1e-12)
    assert state.counts.reduced_expansions == 1


def test_impulses_and_torques_of_the_step_before_follow_their_contacts() -> None:
    """Renumbered, with other tangents and with unequal friction along these, they are the same in the world."""
    rng, n = np.random.default_rng(4), 5
    P = empty_problem(n, 0, 0, 0, 0, True)
    X, Y = allocate_solver(P)[0], allocate_solver(P)[0]
    before, now = ContactMemory.blank(n), ContactMemory.blank(n)
    P.at[:] = -1
    P.mu[:] = 1.0

    def tangents() -> None:
        for c in range(n):
            u = rng.normal(size=3)
            u -= (u @ normal[c]) * normal[c]
            u /= np.linalg.norm(u)
            P.frame[c] = np.r_[normal[c], u, 0.7 * np.cross(normal[c], u)]

    def world() -> np.ndarray:
        return np.array([[to_world_frame(P, c, *x[c]) for c in range(n)] for x in (X.p, X.torque)])

    normal = rng.normal(size=(n, 3))
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    tangents()
    X.p[:], X.torque[:] = 1.0 + rng.random((n, 3)), rng.normal(size=(n, 3))
    was = world()
    for c in range(n):
        account_contact(P, X, c, (0.0, 0.0, 0.0), before)
        account_rolling(P, X, Y, c, before)
    C = no_contacts(n)
    C.count.found, C.at.before[:] = n, (3, 0, -1, 4, 1)
    normal = normal[C.at.before[:]]
    tangents()
    warm_start(C, P, X, now, before, (0, n))
    old = C.at.before[:] >= 0
    assert world()[:, old] == pytest.approx(was[:, C.at.before[old]], abs=1e-14)
    assert not X.p[~old].any()
    assert not X.torque[~old].any()
