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


def arm(*parts, position=(0.3, 0.0), **options) -> fb.Mechanism:
    m = fb.Mechanism("arm", planar=True, gravity=(0, -G), **options)
    m.add(fb.Body("arm", mass=1, inertia=0.02, position=position), fb.Revolute("A", "ground", "arm", at=(0, 0)))
    m.add(*parts)
    return m


SPRING = fb.CoordinateSpring("s", "A.angle", stiffness=2, damping=1)


@pytest.mark.parametrize(
    "parts",
    [
        (fb.Rope("x", ("ground", "arm"), at=((0.3, 1), (0.3, 0)), length=1.1),),
        (fb.Ratchet("x", "A.angle", pitch="20 deg"), fb.Initial("A.angle", value=0.1)),
    ],
)
def test_what_is_slack_as_drawn_is_not_passed(parts):
    m = arm(SPRING, *parts)
    with pytest.raises(fb.NotConverged, match="x would open or close"):
        m.equilibrium()
    run = m.simulate(30.0)
    assert m.equilibrium(start=run)["A.angle"] == pytest.approx(run["A.angle"][-1], abs=1e-6)


@pytest.mark.parametrize(
    "part",
    [
        fb.Brake("x", "A.angle", capacity="800*pedal"),
        fb.JointFriction("x", "A", static=0.0, kinetic=0.0, radius=0.1),
    ],
)
def test_a_brake_that_is_not_applied_holds_nothing(part):
    m = arm(part, position=(0, 0.3), parameters={"pedal": 0.0})
    rest = m.equilibrium()
    assert rest.stability == "unstable"
    assert not rest.touching
    growth = np.sqrt(0.3 * G / (0.02 + 0.09))
    for about in (rest, m.simulate(0.5)):
        assert m.modes(about=about).omega.max() == pytest.approx(growth, rel=1e-6)


@pytest.mark.parametrize("kind", [fb.Limit, fb.OneWay])
def test_a_stop_without_load_is_about_to_open(kind):
    stop = kind("x", "A.angle", **({"lower": 0.0} if kind is fb.Limit else {}))
    m = arm(stop, position=(0, 0.3))
    m.add(fb.Body("w", mass=1, inertia=0.02, position=(1, -0.1)), fb.Revolute("B", "ground", "w", at=(1, 0)))
    m.add(fb.CoordinateSpring("s", "B.angle", stiffness=3, rest=0.1))
    rest = m.equilibrium()
    assert rest.stability == "marginal"
    assert rest.touching[0].state == "about to open"


def test_a_broken_pin_holds_no_more():
    m = arm(fb.ShearPin("pin", "A.angle", strength=2), SPRING)
    rest = m.equilibrium(start=m.simulate(30.0))
    assert rest.broken == ("pin",)
    alone = arm(SPRING)
    there = alone.equilibrium()
    assert rest["A.angle"] == pytest.approx(there["A.angle"], rel=1e-9)
    assert m.modes(about=rest).omega == pytest.approx(alone.modes(about=there).omega, rel=1e-9)


@pytest.mark.parametrize("name", [n for n in PARTS if n != "one way down"])
def test_motions_start_in_the_equilibrium(name):
    m = two_links(PARTS[name])
    rest = m.equilibrium(start=m.simulate(25.0))
    run = m.simulate(0.5, start=rest)
    assert np.ptp(run["A.angle"]) < 1e-9
    assert run["A.angle"][0] == pytest.approx(rest["A.angle"], abs=1e-12)
