"""The examples with friction that sticks, against closed forms of their own numbers."""

import math

import numpy as np
import pytest

from tests.mechanisms import example

G = 9.81
TIGHT = {"rtol": 1e-10, "atol": 1e-11}


def changes(r, name):
    return [e.t for e in r.events if e.name == name and e.t > 0.0]


def test_clutch_start():
    """The load comes up when the clutch carries its friction; both at one speed when their difference is used up.

    Speeds up to there are integrals of a ramp and a constant; the difference is 0 at a root of a quadratic.
    """
    J1, J2, T, dry, C, w = 0.25, 0.6, 25.0, 20.0, 120.0, 1500 * 2 * math.pi / 60
    r = example("clutch_start.toml").simulate(4.0, outputs=401, **TIGHT)
    rises = 0.2 + 0.5 * dry / C
    c = C / 0.5
    w1 = w + (T * 0.7 - c * 0.125) / J1  # at 0.7 s, when it is pressed home
    s = 0.7 - rises
    w2 = (c * (rises - 0.2) * s + c * s * s / 2 - dry * s) / J2
    locks = 0.7 + (w1 - w2) / ((C - T) / J1 + (C - dry) / J2)
    together = w2 + (C - dry) / J2 * (locks - 0.7) + (T - dry) / (J1 + J2) * (3.0 - locks)
    # the jam slows the machine by (jam + dry - C) / J2, the engine by (C - T) / J1: the clutch slips
    stands = 3.0 + together * J2 / (500.0 + dry - C)
    assert changes(r, "load")[:2] == pytest.approx([rises, stands], abs=1e-8)
    assert changes(r, "clutch")[:2] == pytest.approx([locks, 3.0], abs=1e-8)
    slip = r["clutch"].rate[(r.t > locks + 1e-6) & (r.t < 3.0)]
    assert np.abs(slip).max() < 1e-12
    assert r.health.energy_drift < 1e-7 * r.energy.kinetic.max()


def test_stick_slip():
    mu_s, mu_k, speed, k = 0.4, 0.25, 0.2, 50.0
    A, w = (mu_s - mu_k) * G / k, math.sqrt(k)
    times = changes(example("stick_slip.toml").simulate(10.0, outputs=2, **TIGHT), "friction")
    slip, stick = 2 * (math.pi - math.atan(A * w / speed)) / w, 2 * A / speed
    assert np.diff(times[1:]) == pytest.approx(np.resize([slip, stick], len(times) - 2), abs=1e-8)


def test_capstan():
    """The load runs when the hand holds less than m g / exp(mu wrap), and stands when it has lost all its speed."""
    mass, hand, gain = 200.0, 20.0, math.exp(0.25 * 6 * math.pi)
    r = example("capstan.toml").simulate(4.0, outputs=41, **TIGHT)
    runs = 1.0 - mass * G / (hand * gain)  # where the hand, 1 - t of its force, holds no more
    gives = (0.25 - runs) - (0.25**2 - runs**2) / 2  # integral of 1 - t up to 0.25 s
    pulled = hand * gain * (gives + 0.75 * 1.5 + (1.0 - 0.75**2) / 2)
    stands = 2.0 + (mass * G * (2.0 - runs) - pulled) / (hand * gain - mass * G)
    assert changes(r, "post") == pytest.approx([runs, stands], abs=1e-8)
    assert np.abs(r["hoist"].rate[r.t > stands]).max() < 1e-13
    assert r["post"].friction[-1] == pytest.approx(-(mass * G - hand), rel=1e-9)


def test_safety_brake():
    r = example("safety_brake.toml").simulate(1.0, outputs=201, **TIGHT)
    v = 2.0
    falls, brakes = v / G, v / (0.8 * G)
    assert [e.t for e in r.events if e.t > 0.0][:2] == pytest.approx([falls, falls + brakes], abs=1e-8)
    assert r["rails"].displacement[-1] == pytest.approx(v**2 / (2 * G) + v**2 / (1.6 * G), abs=1e-8)
    assert r["wedges"].friction[-1] == pytest.approx(-500.0 * G, rel=1e-9)
