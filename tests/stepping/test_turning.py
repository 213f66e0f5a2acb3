"""Rolling and spinning friction: closed forms, where the energy goes, and which solver did it."""

from __future__ import annotations

import numpy as np
import pytest

import flyball as fb

G, R, RHO, SIGMA = 9.81, 0.1, 0.002, 0.001


def ball(velocity: tuple, turning: tuple, solver: str) -> fb.Result:
    m = fb.Mechanism("ball", gravity=(0, 0, -G))
    m.add(fb.Ground("floor", shape=fb.Plane()))
    start = {"velocity": velocity, "angular_velocity": turning}
    m.add(fb.Body("ball", shape=fb.Sphere(radius=R), mass=1, position=(0, 0, R), **start))
    m.add(fb.Contact(friction=0.5, rolling_friction=RHO, spinning_friction=SIGMA))
    return m.simulate(0.5, outputs=11, method=fb.Impulse(step=2e-3, solver=solver))


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
        fb.Impulse(solver="barzilai-borwein")
    assert fb.Impulse(solver="barzilai-borwein", coulomb=False).solver == "barzilai-borwein"
