"""Racks, couplers, screws and wheels: closed forms, over many turns."""

import numpy as np
import pytest

import flyball as fb
from tests.layers import both_layers

pytestmark = both_layers

G = 9.81
TILT = 0.3


@pytest.mark.parametrize("radius", [0.08, -0.08])
@pytest.mark.parametrize("swapped", [False, True])
def test_rack_and_pinion(radius, swapped):
    """(m + J / r^2) a = F, over many turns; the pinion follows the coordinate as it is written down."""
    m = fb.Mechanism("rack", gravity=(0, 0, -G))
    m.add(fb.Body("bar", mass=2.0, inertia=(0.1, 0.2, 0.15), position=(0, 0.3, 0.1)))
    m.add(fb.Body("wheel", mass=1.0, inertia=(0.01, 0.012, 0.004), position=(0.5, 0, 0)))
    m.add(fb.Prismatic("slide", "ground", "bar", at=(0, 0.3, 0.1), axis=(1, 0, 0), displacement=0.2))
    ends = ("wheel", "ground") if swapped else ("ground", "wheel")
    m.add(fb.Revolute("hinge", *ends, at=(0.5, 0, 0), axis=(0, 0, 1), angle=-0.4))
    m.add(fb.RackAndPinion("mesh", rack="slide", pinion="hinge", radius=radius))
    m.add(fb.PointForce("push", "bar", force=(7.0, 0, 0)))
    r = m.simulate(2.0, outputs=21, rtol=1e-8)
    a = 7.0 / (2.0 + 0.004 / radius**2)
    assert r["slide"].acceleration == pytest.approx(np.full(21, a), rel=1e-9)
    assert r["slide"].displacement == pytest.approx(0.2 + 0.5 * a * r.t**2, rel=1e-8)
    assert r["hinge"].angle == pytest.approx(-0.4 + 0.5 * a * r.t**2 / radius, rel=1e-8)
    assert abs(r["hinge"].angle[-1]) > 4.0 * np.pi
    turned = r["wheel"].angular_velocity[:, 2] * (-1.0 if swapped else 1.0)
    assert turned == pytest.approx(a * r.t / radius, abs=1e-8)
    assert r["mesh"].effort("slide.displacement") == pytest.approx(np.full(21, 2.0 * a - 7.0), rel=1e-9)
    assert r["mesh"].effort("hinge.angle") == pytest.approx(0.004 * r["hinge"].acceleration, rel=1e-9)


def three_slides():
    m = fb.Mechanism("slides", planar=True)
    for k, name in enumerate("abc"):
        m.add(fb.Body(name, mass=1.0 + k, inertia=0.1, position=(0, k)))
        m.add(fb.Translational(f"s{name}", "ground", name, at=(0, k), axis=(1, 0), displacement=0.1 * k))
    m.add(fb.PointForce("push", "a", force=(3.0, 0)))
    return m


@pytest.mark.parametrize("value", [None, 2.0])
def test_coupler_of_three_coordinates(value):
    """A weighted sum stays what it is: as drawn, or as given; Lagrange's equations with one multiplier."""
    m = three_slides()
    weights = np.array([2.0, -1.0, 0.5])
    coordinates = [f"s{k}.displacement" for k in "abc"]
    m.add(fb.Coupler("k", coordinates=coordinates, weights=weights, value=value))
    r = m.simulate(1.0, outputs=5)
    x = np.array([r[f"s{k}"].displacement for k in "abc"])
    drawn = weights @ (0.0, 0.1, 0.2)
    assert weights @ x == pytest.approx(np.full(5, drawn if value is None else value), abs=1e-12)
    mass = np.array([1.0, 2.0, 3.0])
    lam = -weights[0] * 3.0 / (weights**2 / mass).sum()
    a = (np.array([3.0, 0.0, 0.0]) + lam * weights) / mass
    for k, name in enumerate("abc"):
        assert r[f"s{name}"].acceleration == pytest.approx(np.full(5, a[k]), rel=1e-10)
        assert r["k"].effort(coordinates[k]) == pytest.approx(np.full(5, lam * weights[k]), rel=1e-10)


def test_coupler_holds_points_and_bodies_as_drawn():
    """World coordinates and angles of bodies are not zero as drawn: what counts is the sum that they have there."""
    m = fb.Mechanism("points", planar=True, gravity=(0, -G))
    m.add(fb.Body("a", mass=1.0, inertia=0.1, position=(1, 2), angle=0.5))
    m.add(fb.Body("b", mass=2.0, inertia=0.1, position=(4, 5), angle=9.0, angular_velocity=2.0))
    m.add(fb.Frame("tip", "b", position=(0.3, 0), angle=1.0))
    m.add(fb.Coupler("x", coordinates=("a.x", "tip.y"), weights=(1.0, 2.0)))
    m.add(fb.Coupler("turn", coordinates=("a.angle", "tip.angle"), weights=(1.0, 2.0)))
    m.add(fb.Coupler("told", coordinates=("a.y", "b.x"), weights=(1.0, 1.0), value=6.0))
    r = m.simulate(2.0, outputs=9, rtol=1e-8)
    assert r.model.assemble().moved == {}
    tip = 5.0 + 0.3 * np.sin(9.0)
    assert r["a.x"] + 2.0 * r["tip.y"] == pytest.approx(np.full(9, 1.0 + 2.0 * tip), abs=1e-12)
    assert r["a.angle"] + 2.0 * r["tip.angle"] == pytest.approx(np.full(9, 20.5), abs=1e-12)
    assert r["a.y"] + r["b.x"] == pytest.approx(np.full(9, 6.0), abs=1e-12)
    assert r["b"].angle[0] == pytest.approx(9.0)
    assert r.health.energy_drift < 1e-7


def test_coupler_with_a_value_counts_whole_turns():
    """A body drawn turned by 9 rad has that angle in the sum, not what is left of it after a turn."""
    m = fb.Mechanism("turns", planar=True)
    m.add(fb.Body("a", mass=1.0, inertia=0.1, angle=0.5), fb.Body("b", mass=1.0, inertia=0.1, angle=9.0))
    m.add(fb.Coupler("k", coordinates=("a.angle", "b.angle"), weights=(1.0, 1.0), value=9.5))
    a = m.assemble()
    assert a.q[[2, 5]] == pytest.approx([0.5, 9.0], abs=1e-12)


def test_initial_angle_of_a_body_counts_whole_turns():
    m = fb.Mechanism("turns", planar=True)
    m.add(fb.Body("a", mass=1.0, inertia=0.1, angle=0.5), fb.Initial("a.angle", value=20.0 * np.pi + 0.1, rate=1.0))
    r = m.simulate(1.0, outputs=2)
    assert r["a"].angle == pytest.approx([20.0 * np.pi + 0.1, 20.0 * np.pi + 1.1], rel=1e-12)


@pytest.mark.parametrize("lead", [0.02, -0.02])
def test_screw_over_many_turns(lead):
    """A nut falls down its thread: a = g cos(tilt) / (1 + J (2 pi / lead)^2 / m), one lead for each turn."""
    axis = np.array([np.sin(TILT), 0.0, np.cos(TILT)])
    m = fb.Mechanism("screw", gravity=(0, 0, -G))
    m.add(nut())
    m.add(fb.Screw("thread", "ground", "nut", at=(0, 0, 0), axis=tuple(axis), lead=lead, angle=0.3, displacement=0.5))
    r = m.simulate(4.0, outputs=41)
    a = -G * np.cos(TILT) / (1.0 + 2e-5 * (2.0 * np.pi / lead) ** 2 / 2.0)
    way = 0.5 * a * r.t**2
    assert r["thread"].displacement - 0.5 == pytest.approx(way, rel=1e-7, abs=1e-9)
    assert r["thread"].angle - 0.3 == pytest.approx(2.0 * np.pi * way / lead, rel=1e-7, abs=1e-6)
    assert r["thread"].angle_acceleration == pytest.approx(np.full(41, 2.0 * np.pi * a / lead), rel=1e-8)
    assert abs(r["thread"].angle[-1]) > 100.0 * 2.0 * np.pi
    assert r["nut"].position @ axis == pytest.approx(way, rel=1e-7, abs=1e-9)


def nut():
    """A body whose moment of inertia is 2e-5 kg m^2 about any axis."""
    return fb.Body("nut", mass=2.0, inertia=(2e-5, 2e-5, 2e-5))


@pytest.mark.parametrize(
    "told", [{"name": "thread.angle", "value": 20.0 * np.pi}, {"name": "thread.displacement", "value": 0.2}]
)
def test_screw_starts_beyond_a_turn(told):
    """Told an angle of ten turns it has come ten leads, and the other way round."""
    m = fb.Mechanism("screw")
    m.add(nut())
    m.add(fb.Screw("thread", "ground", "nut", at=(0, 0, 0), axis=(0, 0, 1), lead=0.02))
    m.add(fb.Initial(rate=3.0, **told) if told["name"].endswith("angle") else fb.Initial(**told))
    r = m.simulate(0.1, outputs=2)
    assert r["thread"].angle[0] == pytest.approx(20.0 * np.pi, abs=1e-9)
    assert r["thread"].displacement[0] == pytest.approx(0.2, abs=1e-12)
    assert r["nut"].position[0, 2] == pytest.approx(0.2, abs=1e-12)


@pytest.mark.parametrize("height", [0.05, -0.05])
def test_wheel_on_a_line_over_a_hundred_turns(height):
    """Down a slope, over it or hanging under it: a = g sin(slope) / (1 + J / (m h^2)), x = -h angle."""
    e, up = np.array([np.cos(TILT), -np.sin(TILT)]), np.array([np.sin(TILT), np.cos(TILT)])
    m = fb.Mechanism("wheel", planar=True, gravity=(0, -G))
    centre = height * up
    m.add(fb.Body("wheel", mass=2.0, inertia=0.004, position=tuple(centre), angle=0.9))
    m.add(
        fb.WheelOnLine(
            "W", "ground", "wheel", at=(0, 0), axis=tuple(e), centre=tuple(centre), angle=0.2, displacement=1.0
        )
    )
    r = m.simulate(7.0, outputs=51)
    a = G * np.sin(TILT) / (1.0 + 0.004 / (2.0 * height**2))
    way = 0.5 * a * r.t**2
    assert r["W"].displacement == pytest.approx(1.0 + way, rel=1e-8)
    assert r["W"].angle == pytest.approx(0.2 - way / height, rel=1e-8)
    assert abs(r["W"].angle[-1]) > 100.0 * 2.0 * np.pi
    assert r["wheel"].position == pytest.approx(centre + way[:, None] * e, abs=1e-7)
    grip = r["W"].force @ e  # what turns the wheel: J alpha = h times the grip
    assert 0.004 * r["W"].angle_acceleration == pytest.approx(height * grip, rel=1e-8)
    assert r["W"].force @ up == pytest.approx(np.full(51, 2.0 * G * np.cos(TILT)), rel=1e-9)
