"""Stops, plays, ropes, latches, brakes and clutches at rest: which way they hold, and their curves."""

from __future__ import annotations

import numpy as np
import pytest

import flyball as fb

G = 9.81
ANGLES = ("A.angle", "B.angle")


def two_links(part, g: float = -G) -> fb.Mechanism:
    """A hanging link, and a sprung one beside it."""
    m = fb.Mechanism("links", planar=True, gravity=(0, g))
    m.add(fb.Body("a", mass=1, inertia=0.1, com=(0.5, 0)), fb.Revolute("A", "ground", "a", at=(0, 0)))
    m.add(fb.Body("b", mass=1, inertia=0.1, position=(2, 0)), fb.Revolute("B", "ground", "b", at=(2, 0)))
    m.add(fb.TorsionalSpringDamper("s", joint="B", stiffness=50, damping=5))
    m.add(fb.TorsionalSpringDamper("damper", joint="A", stiffness=0.0, damping=2))
    m.add(part)
    return m


PARTS = {
    "lower stop": fb.Limit("x", "A.angle", lower=-0.5),
    "two stops": fb.Limit("x", "A.angle", upper=0.0, lower=-0.3),
    "play": fb.Backlash("x", ANGLES, gap=0.1),
    "play of a sum": fb.Backlash("x", ANGLES, weights=(2, 1), gap=0.1),
    "open play": fb.Backlash("x", ANGLES, gap=4.0),
    "rope": fb.Rope("x", ["ground", "a"], at=[(0.3, 1), (1, 0)]),
    "one way up": fb.OneWay("x", "A.angle"),
    "one way down": fb.OneWay("x", "A.angle", direction=-1),
    "ratchet": fb.Ratchet("x", "A.angle", pitch=0.2),
    "brake": fb.Brake("x", "A.angle", capacity=100),
    "clutch": fb.Clutch("x", *ANGLES, capacity=100),
    "brake of a sum": fb.Brake("x", ANGLES, weights=(-2, 1), capacity=100),
    "pin": fb.ShearPin("x", "A.angle", strength=100),
}


@pytest.mark.parametrize("name", PARTS)
def test_curves_at_rest_are_those_at_the_end_of_a_motion(name):
    part = PARTS[name]
    m = two_links(part)
    run = m.simulate(25.0)
    rest = m.equilibrium(start=run)
    for what in part.outputs:
        assert rest[f"x.{what}"] == pytest.approx(run[f"x.{what}"][-1], abs=2e-5), what


@pytest.mark.parametrize("kind", [fb.OneWay, fb.Ratchet])
@pytest.mark.parametrize("direction", [1, -1])
def test_a_latch_holds_one_way_only(kind, direction):
    """A latch that lets the link rise holds its weight; one that lets it fall does not."""
    options = {"pitch": 0.2} if kind is fb.Ratchet else {}
    held = two_links(kind("x", "A.angle", direction=direction, **options), g=-direction * G).equilibrium()
    assert held["A.angle"] == pytest.approx(0.0, abs=1e-12)
    assert held["x.force"] == pytest.approx(direction * 0.5 * G, rel=1e-12)
    falls = two_links(kind("x", "A.angle", direction=direction, **options), g=direction * G)
    with pytest.raises(fb.NotConverged, match="pull"):
        falls.equilibrium()


@pytest.mark.parametrize(("capacity", "holds"), [(2.46, True), (2.44, False)])
def test_a_brake_along_a_weighted_sum_bears_its_capacity_times_the_weight(capacity, holds):
    """The brake acts along 2 A + 0 B: its capacity times 2 is the moment of the weight, 4.905 N m."""
    m = two_links(fb.Brake("x", ANGLES, weights=(2, 1e-9), capacity=capacity))
    rest = m.equilibrium()
    (brake,) = rest.touching
    if not holds:  # it sinks to where the brake does hold it
        assert np.cos(rest["A.angle"]) <= 2 * capacity / (0.5 * G) * (1 + 1e-6)
        return
    assert brake.tangential == pytest.approx(0.25 * G, rel=1e-6)
    assert brake.used == pytest.approx(0.25 * G / capacity, rel=1e-6)
    assert np.isclose(brake.normal, capacity)
