"""Examples of robots: control by their own equations of motion, contact, closed loops, assembly modes."""

from __future__ import annotations

import runpy

import numpy as np
import pytest

import flyball as fb
from tests.mechanisms import EXAMPLES


def script(name: str) -> dict:
    return runpy.run_path(str(EXAMPLES / name))


@pytest.mark.filterwarnings("ignore::flyball.ModelWarning")
def test_an_arm_draws_a_circle_and_sags_by_a_load_that_its_controller_does_not_know():
    x = script("robot_arm_circle.py")
    m = x["mechanism"]()
    run = m.simulate(x["DURATION"], outputs=101)
    assert x["distance"](run).max() < 2e-6  # between waypoints
    assert np.ptp(run["tip"].position, axis=0) == pytest.approx([0.8 * 0.24, 0.24, 0.6 * 0.24], rel=2e-2)
    down = run["tip"].rotation[:, :, 2]
    assert down == pytest.approx(np.tile([0.0, 0, -1], (101, 1)), abs=2e-5)
    unknown = x["mechanism"](2.9).simulate(1.0, outputs=21)
    assert 1e-4 < x["distance"](unknown).max() < 1e-2


@pytest.mark.filterwarnings("ignore::flyball.ModelWarning")
def test_a_quadruped_falls_and_stands_up():
    x = script("quadruped.py")
    run = x["mechanism"]().simulate(2.6, outputs=131)
    height = run["trunk"].position[:, 2] + x["DROP"]
    lying, standing = height[run.t < 0.9], height[run.t > 2.3]
    assert lying.min() < 0.17  # folded legs bend under the weight
    thigh, shank = x["STANDING"][1:]
    stretched = 0.2 * np.cos(thigh) + 0.2 * np.cos(thigh + shank) + 0.024
    assert standing == pytest.approx(stretched - 0.02, abs=0.02)
    upright = 1 - 2 * (run["trunk"].quaternion[:, 1] ** 2 + run["trunk"].quaternion[:, 2] ** 2)
    assert upright.min() > np.cos(0.25)
    weight = 9.80665 * sum(float(run.values.bodies[b.name].mass) for b in run.model.bodies)
    feet = -run.contacts.on("ground").force[(run.t > 2.4) & (run.t < 2.5)]
    assert feet.mean(axis=0)[2] == pytest.approx(weight, rel=0.1)


def test_torques_of_a_delta_robot_do_the_work_of_its_motion():
    x = script("delta_robot.py")
    m, times = x["mechanism"](), np.linspace(0, 1.2, 241)
    found = x["torques"](m, times)
    run = m.kinematics(times)
    power = sum(found.drives[f"{name}.angle"].effort * run[f"{name}.rate"] for name in x["MOTORS"])
    energy = run.energy.kinetic + run.energy.potential
    work = np.concatenate([[0], np.cumsum((power[1:] + power[:-1]) / 2 * np.diff(times))])
    assert work == pytest.approx(energy - energy[0], abs=5e-3 * np.ptp(energy))
    assert run["platform"].rotation == pytest.approx(np.tile(np.eye(3), (241, 1, 1)), abs=1e-10)


def test_torques_of_a_five_bar_are_those_of_its_inverse_dynamics():
    x = script("five_bar.py")
    m, times = x["mechanism"](), np.linspace(0, 2, 41)
    found = x["torques"](m, times)
    run = m.kinematics(times)
    free = m.changed({d.name: None for d in m.drivers})
    angles = {f"{name}.angle": run[f"{name}.angle"] for name in x["MOTORS"]}
    other = free.inverse_dynamics(np.linspace(0, 2, 41), angles)
    for k, name in enumerate(x["MOTORS"]):
        assert found[2:-2, k] == pytest.approx(other.drives[f"{name}.angle"].effort[2:-2], abs=0.02)  # of the spline
    power = (found * np.column_stack([run[f"{name}.rate"] for name in x["MOTORS"]])).sum(axis=1)
    efforts = run["pen_x.effort"] * run["pen.vx"] + run["pen_y.effort"] * run["pen.vy"]
    assert power == pytest.approx(efforts, abs=1e-9)


def test_a_hexapod_has_forty_postures():
    """Dietmaier (1998); origins and x axes of some of them as the demo stewgou40 of PHCpack lists them."""
    x = script("hexapod_postures.py")
    found = x["postures"]()
    assert len(found) == 40
    assert np.array([x["lengths"](q) for q in found]) == pytest.approx(np.tile(x["LENGTHS"], (40, 1)), abs=1e-9)
    published = [
        (5.34003548614846e-01, 6.17464537788932e-03, -8.45459687874714e-01, 6.36859679827326e-02),
        (8.63325713770891e-01, 5.64402867997359e-03, -5.04615553547690e-01, 1.91288333012351e-01),
        (4.58734196042698e-01, -3.73482566386209e-01, -8.06271486527107e-01, 3.68860267183001e-01),
        (8.32284652705197e-01, -2.82751760714109e-01, 4.76816210593203e-01, -3.82981891941851e-01),
        (8.25080174807858e-01, -3.18925637259120e-01, 4.66400196224120e-01, -2.60309875080715e-01),
        (9.58098206425925e-01, -2.84038680295125e-01, -3.70115514350629e-02, -2.51037203502158e-01),
        (5.35059805089595e-01, -7.49596111150599e-01, -3.89636593668234e-01, 2.75453499517998e-01),
        (5.39848418396206e-01, 6.78840402335085e-01, 4.97734259733700e-01, 8.72889092300304e-01),
    ]
    mine = np.column_stack([found[:, :3], [fb.rotations.matrix(q)[0, 0] for q in found[:, 3:]]])
    for posture in published:
        assert np.abs(mine - posture).max(axis=1).min() < 1e-5  # the demo's coefficients have ten digits
    run = x["mechanism"]().simulate(1.0)
    assert run.health.success
    assert run.energy.drift < 1e-6 * np.ptp(run.energy.kinetic)


def test_a_hexapod_without_loops_to_close_is_refused():
    m = fb.Mechanism("free")
    m.add(fb.Body("platform", mass=1, inertia=(1, 1, 1)))
    with pytest.raises(fb.ModelError, match="there are no loops"):
        m.prepare().inverse_kinematics("platform")
