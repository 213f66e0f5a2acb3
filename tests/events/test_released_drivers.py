"""Drivers that events release and engage again: free motions in between, and impulses of engagement."""

import numpy as np
import pytest

import flyball as fb
from flyball.errors import ModelError
from flyball.model.model_files import dumps, loads
from tests.layers import both_layers

G, LENGTH, MASS, INERTIA = 9.81, 0.3, 2.0, 0.02
ABOUT_PIVOT = INERTIA + MASS * LENGTH**2
SPEED = 6.0


def crank(*more, law=f"{SPEED}*t", coordinate="A.angle", rate=None):
    """A pendulum that hangs at an angle of zero; it is driven, or starts at a rate."""
    m = fb.Mechanism("crank", planar=True, gravity=(0, -G), parameters={"t0": 0})
    m.add(fb.Body("arm", mass=MASS, inertia=INERTIA, position=(0, -LENGTH)))
    m.add(fb.Revolute("A", "ground", "arm", at=(0, 0)))
    m.add(*(x for x in more if isinstance(x, fb.Sensor)), fb.Driver("motor", coordinate, law))
    m.add(*(x for x in more if not isinstance(x, fb.Sensor)))
    if rate is not None:
        m.add(fb.Initial("A.angle", rate=rate))
    return m


def energy(angle, rate):
    return 0.5 * ABOUT_PIVOT * rate**2 - MASS * G * LENGTH * np.cos(angle)


RELEASE = fb.Event("free", "A.angle > 90 deg", do=[fb.Release("motor")], times=1)


@both_layers
@pytest.mark.parametrize(("coordinate", "law"), [("A.angle", f"{SPEED}*t"), ("A.angle_rate", f"{SPEED}")])
def test_a_released_crank_moves_on_freely(coordinate, law):
    """As a pendulum that starts at 90 degrees with the rate of the driver; without effort, and with constant energy."""
    rate = {} if coordinate == "A.angle" else {"rate": SPEED}
    r = crank(RELEASE, coordinate=coordinate, law=law, **rate).simulate(1.5, outputs=301)
    at = r.events["free"][0].t
    assert at == pytest.approx(np.pi / 2 / SPEED, rel=1e-9)
    driven = r.t < at
    assert r["A.angle"][driven] == pytest.approx(SPEED * r.t[driven], abs=1e-9)
    assert r["motor.effort"][driven] == pytest.approx(MASS * G * LENGTH * np.sin(SPEED * r.t[driven]), abs=1e-8)
    assert np.all(r["motor.effort"][~driven] == 0.0)
    start = energy(np.pi / 2, SPEED)
    assert energy(r["A.angle"], r["A.angle_rate"])[~driven] == pytest.approx(start, rel=1e-6)
    assert r["motor.work"][-1] == pytest.approx(MASS * G * LENGTH, rel=1e-8)
    assert np.abs(r["energy.balance"]).max() < 1e-5
    alone = fb.Mechanism("alone", planar=True, gravity=(0, -G))
    alone.add(fb.Body("arm", mass=MASS, inertia=INERTIA, position=(LENGTH, 0)))
    alone.add(fb.Revolute("A", "ground", "arm", at=(0, 0)), fb.Initial("A.angle", rate=SPEED))
    free = alone.simulate(1.5 - at)
    assert r["A.angle"][-1] == pytest.approx(np.pi / 2 + free["A.angle"][-1], abs=2e-6)
    assert r["A.angle_rate"][-1] == pytest.approx(free["A.angle_rate"][-1], abs=2e-6)


@both_layers
@pytest.mark.parametrize(("coordinate", "law"), [("A.angle", f"{SPEED}*t"), ("A.angle_rate", f"{SPEED}")])
def test_a_driver_engages_again_by_an_impulse(coordinate, law):
    """J (omega - rate) along the angle, which loses J (omega - rate)^2 / 2; its law goes on from the present angle."""
    again = fb.Event("again", "t > 1", do=[fb.Lock("motor")])
    rate = {} if coordinate == "A.angle" else {"rate": SPEED}
    r = crank(RELEASE, again, coordinate=coordinate, law=law, **rate).simulate(1.5, outputs=301)
    hit = r.events["again"][0]
    before = hit.before["A.rate"]
    assert abs(before - SPEED) > 1.0
    assert hit.after["A.rate"] == pytest.approx(SPEED, rel=1e-9)
    assert hit.impulses["motor"] == pytest.approx(ABOUT_PIVOT * (SPEED - before), rel=1e-8)
    assert hit.lost == pytest.approx(0.5 * ABOUT_PIVOT * (SPEED - before) ** 2, rel=1e-8)
    driven = r.t > 1.0
    from_there = hit.after["A.angle"] + SPEED * (r.t - 1.0)
    assert r["A.angle"][driven] == pytest.approx(from_there[driven], abs=1e-8)
    assert r["motor.effort"][driven] == pytest.approx(MASS * G * LENGTH * np.sin(from_there[driven]), abs=1e-7)
    assert np.abs(r["energy.balance"]).max() < 1e-5
    assert r.health.success


def test_a_driver_engages_while_it_pulls_at_a_taut_rope():
    """One problem of impulses: both masses get the prescribed rate v, by (m_a + m_b) v; half of its work is lost."""
    m = fb.Mechanism("tow", planar=True, gravity=(0, 0))
    for name, x, mass in (("a", 0.0, 2.0), ("b", 1.0, 3.0)):
        m.add(fb.Body(name, mass=mass, inertia=0.1, position=(x, 0)))
        m.add(fb.Prismatic(f"guide_{name}", "ground", name, at=(x, 0), axis=(1, 0)))
    m.add(fb.Rope("rope", ("a", "b"), at=((0, 0), (1, 0))), fb.Driver("D", "guide_a.displacement", "-5*t**2"))
    m.add(fb.Event("off", "start", do=[fb.Release("D")]), fb.Event("on", "t > 0.2", do=[fb.Lock("D")]))
    r = m.simulate(0.3)
    hit = r.events["on"][0]
    assert (hit.after["a.vx"], hit.after["b.vx"]) == pytest.approx((-2.0, -2.0), rel=1e-9)
    assert hit.impulses["D"] == pytest.approx(-5 * 2.0, rel=1e-9)
    assert hit.impulses["rope"] == pytest.approx(-3 * 2.0, rel=1e-9)
    assert hit.lost == pytest.approx(0.5 * 5 * 2.0**2, rel=1e-9)
    late = r.t > 0.2
    assert r["b.x"][late] == pytest.approx((1.2 - 5 * r.t**2)[late], abs=1e-9)
    assert r["D.effort"][late] == pytest.approx(-5 * 10.0, rel=1e-9)
    assert np.abs(r["energy.balance"]).max() < 1e-9


def test_a_law_that_begins_anew():
    """A parameter holds the time of engagement: the law begins there, at rest, without an impulse."""
    free = fb.Event("free", "start", do=[fb.Release("motor")])
    turn = fb.Event("again", "A.angle_rate", direction="falling", do=[fb.Set("t0", "t"), fb.Lock("motor")], times=1)
    m = crank(free, turn, law="1 - cos(3*(t - t0))", rate=0.0)
    m.add(fb.Event("kick", "start", do=[fb.Impulse("A.angle", 0.3)]))
    r = m.simulate(2.0, outputs=401)
    hit = r.events["again"][0]
    assert hit.lost == pytest.approx(0.0, abs=1e-12)
    late = r.t >= hit.t
    angle = r["A.angle"][late]
    assert angle == pytest.approx(hit.after["A.angle"] + 1 - np.cos(3 * (r.t[late] - hit.t)), abs=1e-8)


def test_an_overloaded_drive_lets_go():
    m = crank(fb.Event("overload", "motor.effort > 4", do=[fb.Release("motor")]))
    r = m.simulate(0.5)
    angle = np.arcsin(4 / (MASS * G * LENGTH))
    assert r.events["overload"][0].t == pytest.approx(angle / SPEED, rel=1e-8)
    assert r["motor.effort"][-1] == 0.0


def test_motors_files_and_continued_motions():
    m = fb.Mechanism("m", planar=True, gravity=(0, -G))
    m.add(
        fb.Body("arm", mass=MASS, inertia=INERTIA, position=(0, -LENGTH)), fb.Revolute("A", "ground", "arm", at=(0, 0))
    )
    m.add(fb.Motor("motor", "A", speed="4"), fb.Initial("A.angle", rate=4))
    m.add(fb.Event("off", "t > 0.25", do=[fb.Release("motor")]), fb.Event("on", "t > 0.75", do=[fb.Lock("motor")]))
    assert loads(dumps(m), fb.Mechanism, "m.toml") == m
    whole = m.simulate(1.0)
    assert whole["motor_drive.effort"][(whole.t > 0.26) & (whole.t < 0.74)] == pytest.approx(0.0, abs=0.0)
    one = m.simulate(0.5)
    two = m.simulate(1.0, start=one)
    assert two["A.angle"][-1] == pytest.approx(whole["A.angle"][-1], abs=1e-8)
    part = m.simulate(0.9)
    assert m.simulate(1.0, start=part)["A.angle"][-1] == pytest.approx(whole["A.angle"][-1], abs=1e-8)


@pytest.mark.parametrize("method", ["radau", "dop853"])
def test_a_spatial_drive(method):
    m = fb.Mechanism("m", gravity=(0, 0, 0))
    m.add(
        fb.Body("disk", mass=1, inertia=(0.1, 0.1, 0.2)),
        fb.Revolute("A", "ground", "disk", at=(0, 0, 0), axis=(0, 0, 1)),
    )
    m.add(fb.Driver("D", "A.angle", "3*t**2"), fb.Event("off", "t > 1", do=[fb.Release("D")]))
    m.add(fb.Event("on", "t > 2", do=[fb.Lock("D")]))
    r = m.simulate(3.0, method=method)
    assert r.events["on"][0].impulses["D"] == pytest.approx(0.2 * 6, rel=1e-6)
    assert r["A.angle"][-1] == pytest.approx(3 + 6 + 3 * 9 - 3 * 4, abs=1e-6)


def test_refused():
    m = crank(fb.Sensor("seen", "arm.x"), law="0.1*seen + t")
    with pytest.raises(ModelError, match="reads seen, and events switch drivers of positions only"):
        m.add(fb.Event("e", "t > 1", do=[fb.Release("motor")]))
    with pytest.raises(ModelError, match="has Event 'free', and kinematics supports no events"):
        crank(RELEASE).kinematics(1.0)
    with pytest.raises(ModelError, match="has Event 'free'"):
        crank(RELEASE).equilibrium()
