"""Clutches and brakes, against closed forms: when they lock, at what speed, what that costs, when they slip again."""

import math

import numpy as np
import pytest

import flyball as fb
from tests.layers import both_layers

pytestmark = both_layers

TIGHT = {"rtol": 1e-11, "atol": 1e-12}
J1, J2, W1, W2 = 0.4, 0.9, 30.0, -5.0


def shafts(planar=True, speeds=(W1, W2), **clutch):
    """Two flywheels on one axis that turn at different speeds, and a clutch between them."""
    m = fb.Mechanism("drive", planar=planar)
    axis = {} if planar else {"axis": (0, 0, 1)}
    for k, (J, w) in enumerate(zip((J1, J2), speeds, strict=True)):
        at = (0, 0) if planar else (0, 0, float(k))
        name = f"wheel {k + 1}"
        m.add(fb.Body(name, mass=1.0, inertia=J if planar else (J, J, J), position=at))
        m.add(fb.Revolute("AB"[k], "ground", name, at=at, **axis))
        m.add(fb.Initial(f"{'AB'[k]}.angle", value=0.1 * k, rate=w))
    m.add(fb.Clutch("clutch", "A.angle", "B.angle", **clutch))
    return m


LOCKED = (J1 * W1 + J2 * W2) / (J1 + J2)
LOST = 0.5 * J1 * J2 / (J1 + J2) * (W1 - W2) ** 2


@pytest.mark.parametrize("planar", [True, False], ids=["plane", "space"])
def test_two_flywheels_come_to_one_speed(planar):
    """After (w1 - w2) / (M (1/J1 + 1/J2)), at the speed that keeps the momentum; J1 J2 (w1 - w2)^2 / 2 (J1 + J2) lost."""
    M = 6.0
    r = shafts(planar, capacity=M).simulate(4.0, outputs=41, **TIGHT)
    locks = (W1 - W2) / (M * (1 / J1 + 1 / J2))
    assert [e.t for e in r.events if e.t > 0.0] == pytest.approx([locks], abs=1e-9)
    before, late = r.t < locks, r.t > locks
    assert r["A"].rate[before] == pytest.approx(W1 - M / J1 * r.t[before], abs=1e-9)
    assert r["B"].rate[before] == pytest.approx(W2 + M / J2 * r.t[before], abs=1e-9)
    for joint in "AB":
        assert r[joint].rate[late] == pytest.approx(np.full(late.sum(), LOCKED), abs=1e-9)
    assert r["clutch"].slip[late] == pytest.approx(np.full(late.sum(), r["clutch"].slip[-1]), abs=1e-12)
    assert r["clutch"].slip[-1] == pytest.approx(0.1 - (W1 - W2) * locks / 2, abs=1e-9)
    assert r["clutch"].friction == pytest.approx(np.where(before, M, 0.0), abs=1e-9)
    assert r["clutch"].work[-1] == pytest.approx(-LOST, rel=1e-9)
    assert r.health.energy_drift < 1e-8 * LOST


def test_a_capacity_that_grows():
    """M = c t: the slip is over after sqrt(2 (w1 - w2) / c (1/J1 + 1/J2)); what is lost is the same."""
    c = 2.5
    r = shafts(capacity=f"{c}*t").simulate(6.0, outputs=13, **TIGHT)
    locks = math.sqrt(2 * (W1 - W2) / (c * (1 / J1 + 1 / J2)))
    assert [e.t for e in r.events if e.t > 0.0] == pytest.approx([locks], abs=1e-8)
    assert r["A"].rate[-1] == pytest.approx(LOCKED, abs=1e-9)
    assert r["clutch"].work[-1] == pytest.approx(-LOST, rel=1e-9)


@pytest.mark.parametrize("static", [1.0, 1.3])
def test_a_locked_clutch_slips_when_too_much_is_asked_of_it(static):
    """Locked it carries T J2 / (J1 + J2) of a torque T on the first shaft; it slips at static times its capacity."""
    M, rise = 6.0, 2.0
    m = shafts(capacity=M, static=static)
    start = 3.0
    m.add(fb.Motor("motor", "A", torque=f"{rise}*max(0, t - {start})"))
    r = m.simulate(12.0, outputs=121, **TIGHT)
    locks = (W1 - W2) / (M * (1 / J1 + 1 / J2))
    slips = start + static * M * (J1 + J2) / J2 / rise
    assert [e.t for e in r.events if e.t > 0.0] == pytest.approx([locks, slips], abs=1e-8)
    held = (r.t > start) & (r.t < slips)
    assert r["clutch"].friction[held] == pytest.approx(rise * (r.t[held] - start) * J2 / (J1 + J2), abs=1e-8)
    after = r.t > slips + 1e-9
    assert r["clutch"].friction[after] == pytest.approx(np.full(after.sum(), M), abs=1e-9)
    assert r["B"].acceleration[after] == pytest.approx(np.full(after.sum(), M / J2), abs=1e-9)


def test_an_open_clutch_carries_nothing():
    r = shafts(capacity=0).simulate(1.0, outputs=3)
    assert r["A"].rate == pytest.approx(np.full(3, W1), rel=1e-12)
    assert r["clutch"].friction == pytest.approx(np.zeros(3), abs=0)


def test_a_clutch_that_opens():
    """Locked under a load until its capacity has fallen to what it carries."""
    m = shafts(speeds=(2.0, 2.0), capacity="10 - t")
    T = 8.0
    m.add(fb.Motor("motor", "A", torque=T))
    r = m.simulate(7.0, outputs=71, **TIGHT)
    opens = 10.0 - T * J2 / (J1 + J2)
    assert [e.t for e in r.events if e.t > 0.0] == pytest.approx([opens], abs=1e-8)
    late = r.t > opens
    assert r["clutch"].friction[late] == pytest.approx(10.0 - r.t[late], abs=1e-9)
    assert r["B"].rate[-1] == pytest.approx(
        2.0 + T / (J1 + J2) * opens + (10 * (7 - opens) - (49 - opens**2) / 2) / J2, abs=1e-8
    )


def test_a_clutch_of_displacements():
    """Two sliders coupled by a clutch: the same as of angles."""
    m = fb.Mechanism("sliders", planar=True)
    for name, mass, v in (("a", 1.0, 3.0), ("b", 2.0, 0.0)):
        m.add(fb.Body(name, mass=mass, inertia=1.0))
        m.add(fb.Translational(name.upper(), "ground", name, at=(0, 0), axis=(1, 0)))
        m.add(fb.Initial(f"{name.upper()}.displacement", value=0.0, rate=v))
    m.add(fb.Clutch("grip", "A.displacement", "B.displacement", capacity="4 N"))
    r = m.simulate(1.0, outputs=3, **TIGHT)
    assert [e.t for e in r.events if e.t > 0.0] == pytest.approx([0.5], abs=1e-10)
    assert r["B"].rate[-1] == pytest.approx(1.0, abs=1e-10)
    assert r["A"].rate[-1] - r["B"].rate[-1] == pytest.approx(0.0, abs=1e-13)


@pytest.mark.parametrize("torque", [1.0, 3.0])
def test_a_brake_holds_a_shaft_against_a_torque(torque):
    """Below its capacity nothing moves, above it turns at (T - M) / J."""
    m = fb.Mechanism("held", planar=True)
    m.add(fb.Body("wheel", mass=1.0, inertia=0.5), fb.Revolute("axle", "ground", "wheel", at=(0, 0)))
    m.add(fb.Brake("brake", "axle.angle", capacity=2.0), fb.Motor("motor", "axle", torque=torque))
    r = m.simulate(1.0, outputs=3)
    if torque < 2.0:
        assert np.abs(r["axle"].angle).max() < 1e-15
        assert r["brake"].friction == pytest.approx(np.full(3, -torque), abs=1e-12)
    else:
        assert r["axle"].rate == pytest.approx((torque - 2.0) / 0.5 * r.t, abs=1e-10)
        assert r["brake"].friction == pytest.approx(np.full(3, -2.0), abs=1e-12)


def test_a_lift_is_caught_by_its_safety_brake():
    """Falling free, it is braked where a sensor reads more than v: from there v^2 / 2 (F / m - g)."""
    G, mass, F, v = 9.81, 500.0, 9000.0, 2.0
    m = fb.Mechanism("lift", planar=True, gravity=(0, -G), parameters={"grip": 0.0})
    m.add(fb.Body("cabin", mass=mass, inertia=100.0))
    m.add(fb.Prismatic("shaft", "ground", "cabin", at=(0, 0), axis=(0, 1)))
    m.add(fb.Brake("safety", "shaft.displacement", capacity="grip"))
    m.add(fb.Event("overspeed", when=f"-shaft.rate - {v}", direction="rising", do=[fb.Set("grip", F)]))
    r = m.simulate(2.0, outputs=201, **TIGHT)
    falls, brakes = v / G, v / (F / mass - G)
    assert [e.t for e in r.events if e.t > 0.0] == pytest.approx([falls, falls + brakes], abs=1e-8)
    assert r["shaft"].displacement[-1] == pytest.approx(-(v**2) / (2 * G) - v**2 / 2 / (F / mass - G), abs=1e-8)
    assert abs(r["shaft"].rate[-1]) < 1e-14
    assert r["safety"].friction[-1] == pytest.approx(mass * G, rel=1e-9)


def test_a_capacity_that_becomes_negative_is_told_with_its_time():
    with pytest.raises(fb.SimulationError, match=r"Clutch 'clutch'.*capacity is negative") as caught:
        shafts(capacity="1 - t").simulate(3.0, outputs=31)
    assert caught.value.t == pytest.approx(1.0, abs=1e-6)
    assert len(caught.value.result.t) >= 10


def test_a_negative_capacity_is_refused_at_once():
    with pytest.raises(fb.ModelError, match=r"capacity of Clutch 'clutch' is -2 N\*m; it must be zero or greater"):
        shafts(capacity=-2)
    with pytest.raises(fb.ModelError, match=r"capacity of Clutch 'clutch' is -3 N\*m; it must be zero or greater"):
        shafts(capacity="1 - 4")


@pytest.mark.parametrize("pull", [-0.9, -0.3, 0.5])
def test_a_brake_holds_whichever_way_the_load_pulls(pull):
    """Braked to rest, by its capacity and what pulls; then it holds what pulls, though it came from the other side."""
    J, M, w = 0.5, 2.0, 12.0
    m = fb.Mechanism("held", planar=True)
    m.add(fb.Body("wheel", mass=1.0, inertia=J), fb.Revolute("axle", "ground", "wheel", at=(0, 0)))
    m.add(fb.Initial("axle.angle", rate=w))
    m.add(fb.Brake("brake", "axle.angle", capacity=M), fb.Motor("motor", "axle", torque=pull * M))
    r = m.simulate(8.0, outputs=9, **TIGHT)
    stops = w * J / (M * (1.0 - pull))
    assert [e.t for e in r.events if e.t > 0.0] == pytest.approx([stops], abs=1e-9)
    assert np.abs(r["axle"].rate[r.t > stops]).max() < 1e-14
    assert r["brake"].friction[-1] == pytest.approx(-pull * M, rel=1e-12)
