"""Steps that are wide since nothing bends: what is measured, or what holds, need be no polynomial between their ends."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

import flyball as fb
from tests.mechanisms import example


@pytest.mark.parametrize("rtol", [1e-5, 1e-7, 1e-8])
def test_a_rope_that_flies_is_caught_again(rtol):
    """In free flight the error of a step is none, however wide: the rope's length falls and rises within one."""
    r = example("rope_pendulum.toml").simulate(10, rtol=rtol, outputs=101, progress=False)
    assert [e.kind for e in r.events] == ["taut", "slack"] * 13
    assert r.energy.drift < 1e-2 * np.ptp(r.energy.kinetic)


@pytest.mark.parametrize("x", [-0.12068968610543229, -0.3, 0.55])
def test_a_ball_on_a_rope_stays_within_its_length(x):
    m = fb.Mechanism("ball", planar=True, gravity=(0, -9.81))
    m.add(fb.Body("b", mass=1, inertia=0.0025, position=(x, 0.5237304742104038)))
    m.add(fb.Rope("r", ["ground", "b"], at=[(0, 0), (x, 0.5237304742104038)], length=1, restitution=0.5))
    r = m.simulate(10, outputs=301)
    assert r["r"].length.max() < 1 + 1e-9
    assert np.abs(r["energy.balance"]).max() < 1e-5


def wheel(torque, *more):
    m = fb.Mechanism("wheel", gravity=None)
    m.add(fb.Body("a", mass=1, inertia=(0.1, 0.1, 0.2)), fb.Revolute("J", "ground", "a", at=(0, 0, 0), axis=(0, 0, 1)))
    m.add(fb.Motor("M", "J", torque=torque), *more)
    return m


@pytest.mark.parametrize("held", [fb.Limit("L", "J.angle", lower=0), fb.Ratchet("L", "J.angle", teeth=12)])
def test_a_stop_opens_whenever_what_presses_on_it_turns_round(held):
    """At rest the error of a step is none, while the reaction goes to and fro."""
    for a, phase in itertools.product((0.5, 0.2, 0, -0.2), (0, 1, 2, 4)):
        r = wheel(f"2*cos(4*t + {phase}) - ({a})", held).simulate(8, outputs=401)
        assert r["L"].force.min() > -1e-6, (a, phase)
        assert r["J"].angle.min() > -1e-9


def test_it_opens_between_two_corners_that_are_near():
    """-1 + 2 s passes zero in the middle of a smooth step from 1 to 1.01 s."""
    r = wheel("-1 + 2*step(t, 1, 0, 1.01, 1)", fb.Limit("L", "J.angle", lower=0)).simulate(2, outputs=2001)
    assert [e.kind for e in r.events] == ["open"]
    assert r.events[0].t == pytest.approx(1.005, abs=1e-9)
    assert r["L"].force.min() > -1e-6


@pytest.mark.parametrize("law", ["-t", "-t**3", "where(t < 0.5, 0, -1)", "-0.1*t - sin(5*t)**2"])
@pytest.mark.parametrize(
    "held",
    [
        fb.OneWay("w", "P.displacement"),
        fb.Limit("w", "P.displacement", lower=0),
        fb.Ratchet("w", "P.displacement", pitch=0.1, restitution=0),
        fb.Rope("w", ["ground", "b"], at=[(1, 0), (0, 0)]),
    ],
    ids=["one-way", "limit", "ratchet", "rope"],
)
def test_what_rests_without_load_holds_when_there_is_one(law, held):
    m = fb.Mechanism("slide", planar=True, gravity=None)
    m.add(fb.Body("b", mass=1, inertia=1), fb.Prismatic("P", "ground", "b", at=(0, 0), axis=(1, 0)), held)
    m.add(fb.Actuator("a", "P.displacement", force=law))
    r = m.simulate(2, outputs=5)
    assert np.abs(r["b"].position[:, 0]).max() < 1e-9
    assert np.abs(r["b"].velocity[:, 0]).max() < 1e-9


def test_a_driver_takes_nothing_through_a_stop():
    m = fb.Mechanism("slide", planar=True, gravity=None)
    m.add(fb.Body("b", mass=1, inertia=1), fb.Prismatic("P", "ground", "b", at=(0, 0), axis=(1, 0)))
    m.add(fb.Limit("w", "P.displacement", lower=0), fb.Driver("a", "P.displacement", "-t**3"))
    with pytest.raises(fb.SimulationError, match="'w'"):
        m.simulate(2)
