"""Examples with contact: closed forms, invariants, and what everybody knows of them."""

from __future__ import annotations

import numpy as np
import pytest
from typer.testing import CliRunner

import flyball as fb
from flyball.cli import app
from flyball.results.result import Result
from tests.examples.test_examples import mechanism
from tests.mechanisms import EXAMPLES

G = 9.81


def losing(r: Result) -> None:
    """Energy is accounted for to rounding, and lost, never won, but for what moving surfaces give.

    Undoing an overlap may lift a body by as much: that is less than a thousandth of what is lost.
    """
    e = r.energy
    size = np.ptp(e.total) + np.ptp(e.kinetic) + np.ptp(e.potential)
    assert e.drift < 1e-9 * size
    assert np.minimum(np.diff(e.friction_loss), 0.0).sum() > -1e-4 * size  # what a solve leaves of sliding
    assert np.maximum(np.diff(e.total - e.surface_work), 0.0).sum() < 1e-3 * size


def test_a_conveyor_takes_boxes_along():
    """Speed mu g t until that of the belt, then as fast as the belt; half of what the belt gives is lost."""
    r = mechanism("conveyor.toml").simulate(1.6, outputs=161)
    a, v = 0.25 * G, 1.0
    slips = r.t < v / a
    x = np.where(slips, a * r.t**2 / 2, v * r.t - v**2 / (2 * a))
    for name in ("first", "second"):
        np.testing.assert_allclose(r[name].position[:, 0] - r[name].position[0, 0], x, atol=2e-3)
        np.testing.assert_allclose(r[f"{name}.vx"][r.t > v / a + 0.01], v, rtol=1e-6)
    mass = sum(float(r.values.bodies[name].mass) for name in ("first", "second"))
    np.testing.assert_allclose(r.energy.surface_work[-1], mass * v**2, rtol=0.02)
    np.testing.assert_allclose(r.energy.friction_loss[-1], mass * v**2 / 2, rtol=0.02)
    held = r.contacts.between("ground", "first")
    np.testing.assert_allclose(held.normal_force[1:], float(r.values.bodies["first"].mass) * G, rtol=2e-5)
    assert held.states[5] == "slip"
    assert held.states[100] == "stick"
    losing(r)


def test_a_box_carries_the_weight_of_what_lies_in_it():
    r = mechanism("pile_in_a_box.py").simulate(3.0, outputs=61)
    weight = G * sum(b.mass.sum() for b in r.bulk.values())
    assert r.energy.kinetic[-1] < 1e-4 * r.energy.kinetic.max()
    np.testing.assert_allclose(-r.contacts.on("ground").force[-10:].mean(axis=0), [0, 0, weight], atol=0.01 * weight)
    for name in ("balls", "bricks"):
        p = r[name].position[-1]
        assert (np.abs(p[:, :2]) < 0.5).all()
        assert (p[:, 2] > 0.03).all()
    losing(r)


def test_dominoes_fall_one_after_the_other_at_a_steady_pace():
    r = mechanism("dominoes.py").simulate(4.0, outputs=401)
    q = r["dominoes"].quaternion
    upright = 1 - 2 * (q[:, :, 1] ** 2 + q[:, :, 2] ** 2)
    assert (upright[0] == 1).all()
    assert (upright[-1] < 0.6).all()
    fallen = r.t[(upright < np.cos(0.35)).argmax(axis=0)]
    assert (np.diff(fallen) >= 0).all()
    pace = np.array([fallen[30] - fallen[10], fallen[60] - fallen[40], fallen[90] - fallen[70]])
    np.testing.assert_allclose(pace, pace.mean(), rtol=0.08)
    losing(r)


def jellett(r: Result) -> np.ndarray:
    """Angular momentum of the tippe top about its mass centre along the line to the point of contact."""
    R, w = r["top"].rotation, r["top"].angular_velocity
    spin = np.einsum("tij,j,tkj,tk->ti", R, [3.0e-6, 3.0e-6, 3.2e-6], R, w)
    return ((0.006 * R[:, :, 2] - (0, 0, 0.02)) * spin).sum(axis=1)


@pytest.fixture(scope="module")
def tops() -> list[Result]:
    m = mechanism("tippe_top.py")
    return [m.simulate(t, outputs=51, method=fb.Stepping(step=h)) for t, h in ((0.3, 4e-4), (0.3, 2e-4), (3.0, 2e-4))]


def test_a_tippe_top_keeps_jelletts_quantity(tops):
    """The error falls with the step."""
    error = [np.ptp(jellett(r)) / jellett(r)[0] for r in tops[:2]]
    assert abs(error[1]) < 0.6 * abs(error[0]) < 6e-3


def test_a_tippe_top_turns_over(tops):
    """As its six equations do, written by hand and integrated by SciPy's LSODA with friction that slides below 1e-4 m/s."""
    r = tops[2]
    at = r["top"].rotation[[0, 5, 10, 15, 20], 2, 2]
    np.testing.assert_allclose(at, [0.9950, 0.8659, 0.4782, -0.3964, -0.8769], atol=0.08)
    assert r["top"].rotation[-1, 2, 2] < -0.95
    rise = 0.02 * 2 * 0.006 * G  # its mass centre is higher by twice its depth
    np.testing.assert_allclose(np.ptp(r.energy.potential), rise, rtol=0.02)
    losing(r)


def test_a_gripper_lifts_what_friction_holds():
    """It lifts the box with 20 N on each finger; with 9 N friction holds less than the weight of 9.81 N."""
    m = mechanism("gripper.py")
    r = m.simulate(3.0, outputs=61)
    up = r["box.z"] - r["box.z"][0]
    np.testing.assert_allclose(up[-10:], 0.25, atol=1e-3)
    for finger in ("left", "right"):
        held = r.contacts.between(finger, "box")
        np.testing.assert_allclose(held.normal_force[-10:], 20.0, rtol=0.02)
        assert (held.tangential_force[-10:] <= 0.5 * held.normal_force[-10:] * (1 + 1e-6)).all()
    assert np.ptp((r["box.z"] - r["hand.z"])[-15:]) < 1e-5  # it does not slide
    np.testing.assert_allclose(r["box"].contact_force[-10:, 2], G, rtol=1e-2)
    assert np.abs(m.simulate(3.0, outputs=31, parameters={"F": 9.0})["box.z"] - 0.05).max() < 1e-3


def test_a_ball_rolls_through_the_labyrinth():
    """It stays on the board and within its walls, and rolls: the point that touches is as fast as the board."""
    r = mechanism("labyrinth.py").simulate(6.0, outputs=181, method="impulse")
    R, p = r["board"].rotation, r["ball"].position
    on = np.einsum("tji,tj->ti", R, p)
    assert np.median(np.abs(on[:, 2] - 0.012)) < 1e-5
    assert np.abs(on[:, 2] - 0.012).max() < 1e-3  # friction on a wall lifts what rolls against it
    assert (np.abs(on[:, :2]) < 0.15 - 0.005 - 0.012 + 2e-4).all()
    assert np.ptp(on[:, 0]) > 0.2
    v, w, wb = r["ball"].velocity, r["ball"].angular_velocity, r["board"].angular_velocity
    foot = -0.012 * R[:, :, 2]
    slip = v + np.cross(w, foot) - np.cross(wb, p + foot)
    assert np.median(np.sqrt((slip**2).sum(axis=1))) < 1e-4
    assert r.energy.drift < 1e-3 * np.ptp(r.energy.total)


def test_a_wall_stands_until_the_ball_hits_it():
    r = mechanism("wrecking_ball.py").simulate(2.0, outputs=101)
    way = np.sqrt(((r["bricks"].position - r["bricks"].position[0]) ** 2).sum(axis=2))
    hit = r.contacts.between("ball", "bricks").normal_force > 0.0
    first = int(hit.argmax())
    assert 30 < first < 60
    assert way[: first - 1].max() < 1e-3
    assert (way[-1] > 0.1).sum() > 10
    np.testing.assert_allclose(r["ball"].velocity[first - 2, 0], np.sqrt(2 * G * fall(r, first - 2)), rtol=0.02)
    assert (np.diff(r.energy.total) < 1e-3 * np.ptp(r.energy.kinetic)).all()


def fall(r: Result, k: int) -> float:
    """How far the wrecking ball has come down, by the speed along its circle."""
    z, v = r["ball.z"], r["ball"].velocity[k]
    return float((z[0] - z[k]) * v[0] ** 2 / (v @ v))


def test_a_cradle_passes_the_blow_on():
    """The last ball rises as high as the first was lifted, the others hang still; two lifted, two fly off."""
    for lifted in (1, 2):
        m = mechanism("newtons_cradle.py", lifted=lifted)
        r = m.simulate(0.6, outputs=61, method=fb.Stepping(step=5e-4, impacts="sequential"))
        a = np.array([r[f"pivot {k}.angle"] for k in range(1, 6)])
        high = np.abs(a[:, 30:]).max(axis=1)
        np.testing.assert_allclose(high[5 - lifted :], 0.6, rtol=0.02)
        assert (high[: 5 - lifted] < 0.03).all()
        assert r.health.energy_drift < 1e-3 * np.ptp(r.energy.potential)


def test_the_command_runs_a_model_of_sets_only(tmp_path):
    words = ["run", str(EXAMPLES / "dominoes.py"), "--t-end", "0.05", "--outputs", "3", "--out", str(tmp_path / "out")]
    ended = CliRunner().invoke(app, words)
    assert ended.exit_code == 0, ended.output
    assert (tmp_path / "out" / "report.html").stat().st_size > 100_000
    assert len(fb.load_result(tmp_path / "out" / "result.nc").bulk["dominoes"]) == 100
