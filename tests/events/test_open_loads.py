"""Friction that follows reactions which redundant joints leave open: a choice is made, told, and the same in every order."""

from __future__ import annotations

import numpy as np
import pytest

import flyball as fb

HINGES = {"low": 0.3, "high": 1.7}
STATIC, KINETIC, RADIUS, J = 0.4, 0.3, 0.02, 1.5 + 20 * 0.4**2


def door(order=("low", "high")):
    """20 kg on two hinges that carry all: how they share its weight is open. A growing torque opens it."""
    m = fb.Mechanism("door", gravity=(0, 0, -9.81))
    m.add(fb.Body("door", mass=20, inertia=(2, 2, 1.5), position=(0.4, 0, 1)))
    for name in order:
        m.add(fb.Revolute(name, "ground", "door", at=(0, 0, HINGES[name]), axis=(0, 0, 1)))
    for name in order:
        m.add(fb.JointFriction(f"rub {name}", name, static=STATIC, kinetic=KINETIC, radius=RADIUS))
    m.add(fb.Motor("push", "low", torque="2*t"))
    return m


def four_bar():
    """A planar linkage of spatial joints: the thrust of its bearings is open."""
    m = fb.Mechanism("four-bar", gravity=(0, -9.81, 0))
    A, B, C, D = ((0, 0, 0), (0, 0.3, 0), (0.8, 0.6, 0), (1, 0, 0))
    for name, p, q in (("crank", A, B), ("rod", B, C), ("rocker", D, C)):
        m.add(fb.Body(name, mass=1, inertia=(0.01,) * 3, position=tuple((np.array(p) + q) / 2)))
    for name, i, j, p in (("a", "ground", "crank", A), ("b", "crank", "rod", B), ("c", "rod", "rocker", C)):
        m.add(fb.Revolute(name, i, j, at=p, axis=(0, 0, 1)))
    m.add(fb.Revolute("d", "ground", "rocker", at=D, axis=(0, 0, 1)))
    m.add(*(fb.JointFriction(f"rub {k}", k, static=0.2, kinetic=0.1, radius=0.02) for k in "abcd"))
    return m


@pytest.mark.parametrize("made", [door, four_bar])
def test_joint_coordinates_have_no_answer_of_their_own(made):
    """There the tree joint would carry all; rows share by their size, which is what is taken and told."""
    with pytest.raises(
        fb.AnalysisError, match=r"rub .* follow reactions that the redundant constraints of .* leave undetermined"
    ):
        made().simulate(0.1, coordinates="joint")
    r = made().simulate(0.1, outputs=2)
    assert r.health.coordinates.startswith("absolute: JointFriction")
    for friction in made().forces:
        if friction.name.startswith("rub"):
            told = [w for w in r.health.warnings if repr(friction.name) in w]
            assert len(told) == 1 and "redundant constraints leave undetermined" in told[0]


def test_the_choice_is_the_one_that_decides():
    """It breaks away where the torque is all that the loads told hold, and slides by all that they make then."""
    runs = [door(order).simulate(3.0, outputs=31, rtol=1e-10) for order in (("low", "high"), ("high", "low"))]
    for r in runs:
        (slip,) = r.events.of("slip")
        at = np.searchsorted(r.t, slip.t) - 1
        held = sum(r[f"rub {k}"].friction for k in HINGES)
        assert held[: at + 1] == pytest.approx(-2 * r.t[: at + 1], abs=1e-9)
        assert np.abs(r["low"].rate[: at + 1]).max() < 1e-12
        load = [np.hypot.reduce(r[k].force[at, :2]) + abs(r[k].force[at, 2]) for k in HINGES]
        assert 2 * slip.t == pytest.approx(STATIC * RADIUS * sum(load), rel=1e-6)
        assert r.energy.balance == pytest.approx(np.zeros(len(r.t)), abs=1e-7)
    assert runs[0].events[0].t == pytest.approx(runs[1].events[0].t, rel=1e-6)
    assert runs[0]["low.angle"] == pytest.approx(runs[1]["low.angle"], abs=1e-6)
