"""Samples of a stepper become a result: positions, velocities and energies are those of the motion."""

from __future__ import annotations

import numpy as np
import pytest

import flyball as fb
from tests.mechanisms import example


@pytest.mark.parametrize("name", ["governor.toml", "spatial_four_bar.toml", "slider_crank.toml"])
def test_samples_are_the_motion_that_simulate_finds(name):
    m = example(name)
    sim = m.stepper(0.01, rtol=1e-9)
    samples = [sim.sample()]
    for _ in range(50):
        sim.step()
        samples.append(sim.sample())
    found, expected = sim.motion(samples), m.simulate(0.5, outputs=51, rtol=1e-9)
    np.testing.assert_allclose(found.t, expected.t, atol=1e-12)
    for b in m.bodies:
        np.testing.assert_allclose(found[b.name].position, expected[b.name].position, atol=1e-6)
        np.testing.assert_allclose(found[b.name].velocity, expected[b.name].velocity, atol=1e-5)
    for j in m.joints:
        for k in j.coordinates:
            np.testing.assert_allclose(found[f"{j.name}.{k}"], expected[f"{j.name}.{k}"], atol=1e-6)
    scale = np.abs(expected.energy.kinetic).max()
    np.testing.assert_allclose(found.energy.kinetic, expected.energy.kinetic, atol=1e-6 * scale)
    assert np.isnan(found.vdot).all()
    assert np.isnan(found.multipliers).all()


def test_samples_of_one_copy_and_of_a_later_state():
    m = fb.Mechanism("fall", gravity=(0, 0, -9.81))
    m.add(fb.Body("b", mass=1, inertia=(1, 1, 1), position=(0, 0, 0)))
    sim = m.stepper(0.1, copies=2)
    saved = sim.state
    sim.step(steps=5)
    assert sim.motion([sim.sample(1)])["b"].position[0, 2] == pytest.approx(-0.5 * 9.81 * 0.25)
    sim.state = saved
    assert sim.sample(1).t == 0.0
