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


def pushed_pendulum() -> fb.Mechanism:
    m = fb.Mechanism("pushed", planar=True, gravity=(0, 0), parameters={"u": 1.0})
    m.add(fb.Body("rod", mass=1, inertia=0.1, com=(0.5, 0), position=(0, 0)))
    m.add(fb.Revolute("A", "ground", "rod", at=(0, 0)))
    m.add(fb.Motor("motor", "A", torque="u"), fb.CoordinateSpring("law", "A.angle", force="u*value"))
    m.add(fb.Actuator("push", "A.angle", force="0.5"), fb.Sensor("felt", of="motor.torque"))
    return m


def test_laws_are_evaluated_with_the_inputs_of_each_step(tmp_path):
    sim, rng = pushed_pendulum().stepper(0.01, inputs=["u", "push"]), np.random.default_rng(0)
    u = rng.uniform(-5, 5, (20, 2)).repeat(2, axis=0)
    samples = [sim.sample()]
    for row in u:
        sim.step(row)
        samples.append(sim.sample())
    held, push = np.r_[1.0, u[:, 0]], np.r_[0.0, u[:, 1]]
    found = sim.motion(samples)
    assert found.health.freedoms == 1
    assert "freedoms" in str(found)
    found.save(tmp_path / "motion.nc")
    for r in (found, fb.load_result(tmp_path / "motion.nc")):
        np.testing.assert_allclose(r["motor.torque"], held, rtol=1e-12)
        np.testing.assert_allclose(r["felt.value"], held, rtol=1e-12)
        np.testing.assert_allclose(r["law.force"], held * r["A.angle"], rtol=1e-12)
        np.testing.assert_allclose(r["push.force"], 0.5 + push, rtol=1e-12)
        np.testing.assert_allclose(r.energy.total, 0.5 * 0.35 * r["A.rate"] ** 2, rtol=1e-9)
    torque = u[:, 0] * (1 + found["A.angle"][1:]) + 0.5 + u[:, 1]  # at the end of each step
    change = np.diff(found["A.rate"]) / 0.01
    np.testing.assert_allclose(change, torque / 0.35, atol=0.02 * np.abs(change).max())


def test_energies_of_sets_are_those_of_all_members_when_inputs_change():
    m = fb.Mechanism("rain", gravity=(0, 0, -9.81))
    m.add(fb.Bodies("drops", shape=fb.Sphere(radius=0.01), density=1000, position=[(0, 0, 1), (1, 0, 2)]))
    m.add(fb.Body("stone", mass=1, inertia=(1, 1, 1), position=(5, 0, 0)), fb.Contact(friction=0))
    m.add(fb.Revolute("A", "ground", "stone", at=(5, 0, 0), axis=(0, 0, 1)), fb.Motor("motor", "A", torque="0"))
    sim, samples = m.stepper(0.01, inputs=["motor"]), []
    for k in range(10):
        sim.step([float(k)])
        samples.append(sim.sample())
    r = sim.motion(samples)
    np.testing.assert_allclose(r.energy.kinetic, r.bulk["drops"].kinetic + 0.5 * r["A.rate"] ** 2, rtol=1e-9)


def test_samples_of_no_copy_and_a_motion_of_no_samples_are_refused():
    sim = pushed_pendulum().stepper(0.01, copies=2)
    for copy in (2, -1, True, None):
        with pytest.raises(fb.ModelError, match="copy is a number from 0 to 1, got"):
            sim.sample(copy)
    with pytest.raises(fb.ModelError, match="made of the samples of a stepper, got none"):
        sim.motion([])
