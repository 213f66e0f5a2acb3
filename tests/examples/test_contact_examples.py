"""Examples with contact: closed forms, invariants, and what everybody knows of them."""

from __future__ import annotations

import numpy as np
import pytest

import flyball as fb
from flyball.results.result import Result
from tests.examples.test_examples import mechanism

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
    return [m.simulate(t, outputs=51, method=fb.Impulse(step=h)) for t, h in ((0.3, 4e-4), (0.3, 2e-4), (3.0, 5e-4))]


def test_a_tippe_top_keeps_jelletts_quantity(tops):
    """The error falls with the step."""
    error = [np.ptp(jellett(r)) / jellett(r)[0] for r in tops[:2]]
    assert abs(error[1]) < 0.6 * abs(error[0]) < 6e-3


def test_a_tippe_top_turns_over(tops):
    r = tops[2]
    assert r["top"].rotation[0, 2, 2] > 0.99
    assert r["top"].rotation[-1, 2, 2] < -0.99
    rise = 0.02 * 2 * 0.006 * G  # its mass centre is higher by twice its depth
    np.testing.assert_allclose(np.ptp(r.energy.potential), rise, rtol=0.02)
    losing(r)
