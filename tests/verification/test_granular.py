"""Granular matter: discharge of an hourglass, angle of repose, a wheel on grains, a gripper in a bin."""

from __future__ import annotations

import runpy

import numpy as np
import pytest

import flyball as fb
from tests.mechanisms import EXAMPLES

HOURGLASS, DRUM, WHEEL, BIN = (
    runpy.run_path(str(EXAMPLES / f"{name}.py"))
    for name in ("hourglass", "rotating_drum", "wheel_in_gravel", "bin_picking")
)
GRAIN, STEP = HOURGLASS["GRAIN"], HOURGLASS["STEP"]


def discharge(t_end=0.5, **options):
    """Motion of an hourglass."""
    return HOURGLASS["mechanism"](**options).simulate(t_end, outputs=round(200 * t_end) + 1, method=STEP)


def test_rate_of_an_hourglass_grows_with_its_neck_by_beverloos_law():
    """Rates to the power 2/3 are linear in the neck; k = 1 to 3 and C as in the plane (Mankoc and others 2007)."""
    necks = GRAIN * np.array([5.0, 7.0, 9.0, 11.0])
    roots = np.array([HOURGLASS["rate"](discharge(0.45, neck=D, count=250)) for D in necks]) ** (2 / 3)
    slope, at_zero = np.polyfit(necks, roots, 1)
    assert slope * necks + at_zero == pytest.approx(roots, rel=0.07)
    assert 1 < -at_zero / slope / GRAIN < 3
    assert 0.8 < slope**1.5 / (0.8 / (np.pi * GRAIN**2 / 4) * np.sqrt(9.81)) < 1.8


def test_rate_of_an_hourglass_is_constant_and_independent_of_its_filling():
    """Water would run slower by 29 per cent at half the height."""
    half, full = (discharge(0.4 + 1e-3 * n, neck=7 * GRAIN, radius=0.035, count=n) for n in (300, 600))
    rates = [HOURGLASS["rate"](run) for run in (half, full)]
    assert rates[0] == pytest.approx(rates[1], rel=0.12)
    early, late = HOURGLASS["rate"](full, 0.2, 0.5), HOURGLASS["rate"](full, 0.5, 0.8)  # water: 1.4 to 1
    assert early == pytest.approx(late, rel=0.2)
    assert full.health.contact.worst_overlap < 0.15 * GRAIN


def test_a_block_on_a_tilted_plane_slides_from_the_angle_of_friction():
    """tan(angle) = friction, exactly; the plane turns by w, so after a time t it has slid g w t^3 / (6 cos(angle))."""
    m = fb.Mechanism("incline", planar=True, gravity=(0, -9.81))
    m.add(fb.Body("plane", shape=fb.Box(edges=(1, 0.02, 0.1), position=(0, -0.01, 0)), density=1000))
    m.add(fb.Body("block", shape=fb.Box(edges=(0.04, 0.02, 0.02)), density=1000, position=(0, 0.01)))
    m.add(fb.Revolute("hinge", "ground", "plane", at=(0, 0)), fb.Driver("tilt", "hinge.angle", "0.1*t"))
    m.add(fb.Contact(friction=0.25))
    begins, slid = np.arctan(0.25), 1e-5
    run = m.simulate(3.0, outputs=3001, method=fb.Stepping(step=1e-3))
    along = np.einsum("ti,ti->t", run["plane"].rotation[:, :2, 0], run["block"].position[:, :2])
    found = np.argmax(abs(along - along[0]) > slid)
    later = 0.1 * (6 * slid * np.cos(begins) / (9.81 * 0.1)) ** (1 / 3)
    assert run["hinge.angle"][found] == pytest.approx(begins + later, abs=3e-4)


@pytest.fixture(scope="module")
def drums():
    """Motions of drums by the friction of their grains."""
    step = fb.Stepping(step=2e-3, solver="gauss-seidel")
    return {mu: DRUM["mechanism"](mu).simulate(2.2, outputs=111, method=step) for mu in (0.0, 0.1, 0.5)}


def test_angle_of_repose_grows_with_friction(drums):
    """That of grains without friction is small but not zero: 6 degrees at rest, more where they fall."""
    none, little, much = (DRUM["slope"](run)[run.t > 1.3].mean() for run in drums.values())
    assert 5 < none < 18
    assert none + 3 < little < much - 3
    assert 22 < much < 32
    before = DRUM["slope"](drums[0.5])[drums[0.5].t < 0.3]
    assert abs(before[-1]) < 2


def test_grains_turn_with_the_drum_before_they_slide(drums):
    """The slope grows as fast as the drum turns; then the motor carries the grains at the arm of their mass centre."""
    run = drums[0.5]
    slope, angle = DRUM["slope"](run), np.degrees(run["axle.angle"])
    rising = (angle > 5) & (angle < 18)
    assert np.polyfit(angle[rising], slope[rising], 1)[0] == pytest.approx(1, abs=0.1)
    centre, mass = DRUM["mass_centre"](run)
    late = run.t > 1.3
    assert run["motor.effort"][late].mean() == pytest.approx(9.81 * mass * centre[late, 0].mean(), rel=0.07)


@pytest.fixture(scope="module")
def wheels():
    """Motions of a wheel by its slip."""
    step = fb.Stepping(step=2e-3, solver="gauss-seidel")
    return {s: WHEEL["mechanism"](s, 0.75, 5).simulate(1.8, outputs=451, method=step) for s in (0.0, 0.3, 0.6)}


def test_grains_carry_a_wheel_which_pulls_more_with_slip(wheels):
    """Without slip it is a brake, by its rolling resistance; at most friction times the weight."""
    means = [WHEEL["means"](run, 0.9) for run in wheels.values()]
    for of in means:
        assert of["normal"] == pytest.approx(1, abs=0.06)
        assert of["pull"] == pytest.approx(of["traction"], abs=0.02)
    free, medium, large = (of["pull"] for of in means)
    assert free < 0 < large < WHEEL["FRICTION"]
    assert free + 0.03 < medium < large + 0.03
    assert means[0]["torque"] < means[1]["torque"]


def test_work_of_the_motor_is_that_of_the_pull_and_of_losses(wheels):
    """The drivers' work is the gain of energy and what contacts dissipate."""
    e = (run := wheels[0.3]).energy
    own = (e.kinetic + e.potential)[[0, -1]]
    work = run["motor.work"][-1] + run["pull.work"][-1]
    lost = e.friction_loss[-1] + e.impact_loss[-1] + e.numerical_loss[-1]
    assert work == pytest.approx(own[1] - own[0] + lost, rel=1e-3)
    assert e.friction_loss[-1] > 0 and abs(e.numerical_loss[-1]) < 0.15 * lost


def test_a_gripper_takes_a_part_from_a_bin():
    """The part goes up with the fingers: their force is its weight and within the cones, and nothing enters a finger."""
    m = BIN["mechanism"](30)
    settled = m.simulate(BIN["SETTLED"], outputs=2, method=BIN["STEP"])
    k, place = BIN["target"](settled)
    run = m.simulate(4.0, outputs=101, method=BIN["STEP"], parameters=place)
    height = run["parts"].position[:, k, 2]
    assert height[-1] - settled["parts"].position[-1, k, 2] == pytest.approx(BIN["HEIGHT"] - place["low"], abs=2e-3)
    assert (np.delete(run["parts"].position[-1, :, 2], k) < BIN["TALL"]).all()  # one part alone
    mass = BIN["DENSITY"] * np.pi * BIN["RADIUS"] ** 2 * (BIN["LENGTH"] + 4 / 3 * BIN["RADIUS"])
    force, press = BIN["part_force"](run, k, 3.8)
    assert force == pytest.approx((0, 0, 9.81 * mass), abs=0.05 * 9.81 * mass)
    assert press == pytest.approx(4.0, rel=0.05)
    for finger in ("left", "right"):
        pair = run.contacts.between(finger, "parts")
        assert (pair.tangential_force <= 0.5 * pair.normal_force + 1e-9).all()
        assert np.nanmin(pair.gap) > -0.02 * BIN["RADIUS"]


def test_a_gripper_drops_what_it_presses_too_little():
    """2 mu F is a third of the weight."""
    m = BIN["mechanism"](30, force=0.2)
    k, place = BIN["target"](m.simulate(BIN["SETTLED"], outputs=2, method=BIN["STEP"]))
    run = m.simulate(4.0, outputs=3, method=BIN["STEP"], parameters=place)
    assert run["parts"].position[-1, k, 2] < BIN["TALL"]
