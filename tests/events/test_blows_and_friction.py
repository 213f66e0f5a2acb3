"""Blows, clutches and friction by their closed forms, where loads are small: none of it is refused for its rounding."""

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


def struck(blow, rate=0.0, mu=0.3):
    """A rod of 2 kg, 1 kg m^2 about its hinge, struck at t = 0.2 by (0, blow) at its centre, 0.5 m from the hinge."""
    m = fb.Mechanism("rod", planar=True, gravity=None)
    m.add(fb.Body("rod", mass=2, inertia=0.5, position=(0.5, 0)))
    m.add(fb.Revolute("A", "ground", "rod", at=(0, 0)), fb.Initial("A.angle", rate=rate))
    m.add(fb.JointFriction("rub", "A", static=mu, radius=0.1))
    m.add(fb.Event("blow", "t - 0.2", do=[fb.Impulse("rod", (0, blow))]))
    return m


def test_friction_feels_what_a_blow_asks_of_its_joint():
    """w = F/2 - mu r |w - F|: the hinge takes m w / 2 - F of the blow F, and its friction takes of that."""
    r = struck(1.0).simulate(0.2 + 1e-9, outputs=2)
    w = (0.5 - 0.03) / (1.0 - 0.03)
    assert r["A"].rate[-1] == pytest.approx(w, rel=1e-8)
    assert np.abs(r.energy.balance).max() < 1e-12


def test_a_couple_that_the_hinge_does_not_feel():
    """All of it turns the wheel, whatever friction there is: the rate grows by 0.4 / 0.5."""
    m = turning({"a": -3.0}, fb.JointFriction("rub", "A", static=0.1, radius=0.1, preload=5.0))
    m.add(fb.Event("blow", "t - 0.2", do=[fb.Impulse("a", (0, 0), torque=0.4)]))
    r = m.simulate(0.4, outputs=5)
    slowed = 0.1 * 0.1 * 5.0 / 0.5
    assert r["A"].rate[-1] == pytest.approx(-3.0 + 0.4 / 0.5 + slowed * 0.4, rel=1e-9)
