"""Where nothing drives what holds, what is asked of it is rounding: it is not refused, and nothing comes of it."""

import numpy as np
import pytest

import flyball as fb
from tests.layers import both_layers

pytestmark = both_layers


def turning(rates, *parts):
    """Wheels of 0.5 kg m^2 on bearings of their own, without gravity."""
    m = fb.Mechanism("wheels", planar=True, gravity=None)
    for name, rate in rates.items():
        m.add(fb.Body(name, mass=2, inertia=0.5, angular_velocity=rate))
        m.add(fb.Revolute(name.upper(), "ground", name, at=(0, 0)))
    m.add(*parts)
    return m


def test_a_clutch_engages_beside_friction_that_slides():
    """Capacity 2 brings both to one rate at t = 2 / (2/0.5 + 2/0.5); the bearing takes 0.1 of the first, then of both."""
    rub = fb.JointFriction("rub", "A", static=0.1, radius=0.1, preload=10.0)
    m = turning({"a": 3.0, "b": 1.0}, fb.Clutch("clutch", "B.angle", "A.angle", capacity=2.0), rub)
    r = m.simulate(1.0, outputs=11)
    meet = 2.0 / ((2.0 + 0.1) / 0.5 + 2.0 / 0.5)
    assert [e.t for e in r.events if e.name == "clutch"] == pytest.approx([meet], rel=1e-9)
    rate = 1.0 + 4.0 * meet
    late = r.t > meet
    assert r["A"].rate[late] == pytest.approx(rate - 0.1 * (r.t[late] - meet), rel=1e-9)
    assert np.abs(r["B"].rate - r["A"].rate)[late].max() < 1e-10


def test_a_blow_that_friction_does_not_feel():
    """A couple leaves no reaction in the hinge, so none of it is lost: the rate grows by 0.4 / 0.5."""
    m = turning({"a": -3.0}, fb.JointFriction("rub", "A", static=0.1, radius=0.1, preload=5.0))
    m.add(fb.Event("blow", "t - 0.2", do=[fb.Impulse("a", (0, 0), torque=0.4)]))
    r = m.simulate(0.4, outputs=5)
    slowed = 0.1 * 0.1 * 5.0 / 0.5
    assert r["A"].rate[-1] == pytest.approx(-3.0 + 0.4 / 0.5 + slowed * 0.4, rel=1e-9)
