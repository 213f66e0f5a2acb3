"""Freewheels and ratchets, against closed forms."""

from __future__ import annotations

import numpy as np
import pytest

import flyball as fb
from tests.events.one_sided import LAYERS, run, times, wheels

layers = pytest.mark.parametrize("coordinates", LAYERS)


@layers
def test_a_freewheel_coasts(coordinates):
    """Driven by T (1 - t): together until the torque is gone, then the hub slows down and the wheel goes on for good."""
    J1, J2, T = 0.3, 0.5, 2.0
    m = wheels(J1, J2, torques=("2.0*(1 - t)", None))
    m.add(fb.OneWay("freewheel", "B.angle", relative_to="A.angle"))
    r = run(m, 2.0, coordinates)
    t = r.t
    together = T * (t - t**2 / 2) / (J1 + J2)
    coasting = T * 0.5 / (J1 + J2)
    assert r["B"].rate == pytest.approx(np.where(t < 1, together, coasting), abs=1e-9)
    assert r["A"].rate == pytest.approx(np.where(t < 1, together, coasting - T * (t - 1) ** 2 / 2 / J1), abs=1e-9)
    assert r["freewheel"].force == pytest.approx(np.where(t < 1, J2 * T * (1 - t) / (J1 + J2), 0), abs=1e-8)
    assert times(r, "freewheel") == pytest.approx([1.0], abs=1e-8)
    assert (r["freewheel"].closed == np.where(t < 1 - 1e-9, 1.0, 0.0)).all()


@layers
def test_a_freewheel_takes_hold(coordinates):
    """The hub catches up with the wheel at J1 w / T; from then on they turn together, without a jerk."""
    J1, J2, T, w = 0.3, 0.5, 2.0, 4.0
    m = wheels(J1, J2, rates=(0.0, w), torques=(T, None))
    m.add(fb.OneWay("freewheel", "B.angle", relative_to="A.angle"))
    r = run(m, 1.0, coordinates)
    on = J1 * w / T
    assert times(r, "freewheel") == pytest.approx([on], abs=1e-8)
    assert r["A"].rate == pytest.approx(np.where(r.t < on, T * r.t / J1, w + T * (r.t - on) / (J1 + J2)), abs=1e-8)
    assert r["freewheel"].force[-1] == pytest.approx(J2 * T / (J1 + J2), rel=1e-9)
    slip = r["B"].angle - r["A"].angle
    assert np.ptp(slip[r.t > on]) < 1e-11
    assert np.abs(r.energy.balance).max() < 1e-8


@pytest.mark.parametrize(("direction", "way"), [(1, r"B.angle - A.angle"), (-1, r"- B.angle \+ A.angle")])
def test_a_freewheel_that_begins_the_wrong_way_is_refused(direction, way):
    m = wheels(0.3, 0.5, rates=(4.0 * direction, 1.0 * direction))
    m.add(fb.OneWay("freewheel", "B.angle", relative_to="A.angle", direction=direction))
    said = rf"OneWay 'freewheel': the motion starts beyond it: the rate of {way} is -3 rad/s"
    with pytest.raises(fb.ModelError, match=said):
        m.simulate(0.5)


@layers
def test_a_backstop_holds(coordinates):
    """A load on a drum that may only go up does not move at all, and the backstop carries it."""
    m = wheels(0.4, torques=(-3.0,))
    m.add(fb.OneWay("backstop", "A.angle"))
    r = run(m, 1.0, coordinates)
    assert np.abs(r["A"].angle).max() < 1e-12
    assert r["backstop"].force == pytest.approx(3.0, rel=1e-9)
    assert (r["backstop"].closed == 1.0).all()


@layers
@pytest.mark.parametrize("way", [1.0, -1.0])
def test_a_ratchet_holds_a_load(coordinates, way):
    """Up by w^2 / 2 a, back to the last tooth that was passed; there it stops dead and holds."""
    J, T, w = 0.4, 3.0, 8.0
    m = wheels(J, rates=(way * w,), torques=(-way * T,))
    m.add(fb.Ratchet("pawl", "A.angle", teeth=12, direction=way))
    a, pitch = T / J, 2 * np.pi / 12
    top = w**2 / (2 * a)
    tooth = pitch * np.floor(top / pitch)
    lands = w / a + np.sqrt(2 * (top - tooth) / a)
    r = run(m, 3.0, coordinates)
    rests = r.t > lands
    assert way * r["A"].angle[rests] == pytest.approx(tooth, abs=1e-9)
    assert way * r["pawl"].force[-1] == pytest.approx(T, rel=1e-9)
    assert r["pawl"].closed[-1] == 1.0
    assert times(r, "pawl")[-1] == pytest.approx(lands, abs=1e-8)
    assert sum(e.lost for e in r.events) == pytest.approx(T * (top - tooth), rel=1e-8)
    assert np.abs(r.energy.balance).max() < 1e-8


@layers
def test_a_ratchet_lifts_step_by_step(coordinates):
    """T cos ft: up by 2 T / J f^2, back to the last tooth, on from there as soon as the torque turns."""
    J, T, f, pitch = 0.2, 4.0, 5.0, 0.3
    m = wheels(J, torques=(f"{T}*cos({f}*t)",))
    m.add(fb.Ratchet("pawl", "A.angle", pitch=pitch))
    a = T / (J * f * f)
    tooth = pitch * np.floor(2 * a / pitch)
    r = run(m, 2 * np.pi / f, coordinates, outputs=201)
    up = f * r.t < np.pi
    assert r["A"].angle[up] == pytest.approx(a * (1 - np.cos(f * r.t[up])), abs=1e-9)
    assert times(r, "pawl")[-1] == pytest.approx(1.5 * np.pi / f, abs=1e-8)
    on = f * r.t > 1.5 * np.pi
    assert r["A"].angle[on] == pytest.approx(tooth + a * (f * r.t[on] - 1.5 * np.pi - np.cos(f * r.t[on])), abs=1e-8)
    held = r["pawl"].closed == 1.0
    assert r["pawl"].force[held] == pytest.approx(-T * np.cos(f * r.t[held]), abs=1e-8)


@layers
def test_a_winch_in_space_counts_its_turns_and_goes_on(coordinates):
    """Nine turns up and back to the last tooth; a motion that goes on from there holds it, one that goes on midway too."""
    m = fb.Mechanism("winch")
    m.add(
        fb.Body("drum", mass=1, inertia=(0.4, 0.4, 0.4)),
        fb.Revolute("A", "ground", "drum", at=(0, 0, 0), axis=(1, 2, 2)),
    )
    m.add(fb.Initial("A.angle", rate=30), fb.Motor("load", "A", torque=-3.0), fb.Ratchet("pawl", "A.angle", teeth=12))
    pitch = 2 * np.pi / 12
    top = 30**2 / (2 * 3.0 / 0.4)
    tooth = pitch * np.floor(top / pitch)
    back = 30 / 7.5 + 0.5 * np.sqrt(2 * (top - tooth) / 7.5)  # half the time that it takes to the tooth
    for t in (back, 10.0):
        r = run(m, t, coordinates)
        for _ in range(2):
            r = run(m, float(r.t[-1]) + 2.0, coordinates, start=r)
        assert r["A"].angle[-1] == pytest.approx(tooth, abs=1e-9)
        assert r["pawl"].force[-1] == pytest.approx(3.0, rel=1e-9)


@layers
def test_a_hoist_keeps_what_its_lever_lifts(coordinates):
    """A lever's feed pawl takes the wheel along from rest on a tooth; where the lever goes back the wheel stays."""
    swing, load, J = np.radians(26), 4.0, 0.2
    m = wheels(0.1, J, torques=(None, -load))
    m.add(fb.Driver("hand", "A.angle", f"{swing}*(1 - cos(pi*t))"))
    m.add(fb.OneWay("feed", "B.angle", relative_to="A.angle"), fb.Ratchet("pawl", "B.angle", teeth=24))
    r = run(m, 4.0, coordinates, outputs=401)
    pitch = 2 * np.pi / 24
    first = pitch * np.floor(2 * swing / pitch)
    assert r["B"].angle[200] == pytest.approx(first, abs=1e-9)
    second = pitch * np.floor((first + 2 * swing) / pitch)
    assert r["B"].angle.max() == pytest.approx(first + 2 * swing, abs=1e-8)
    assert r["B"].angle[-1] == pytest.approx(second, abs=1e-9)
    assert r["pawl"].force[-2] == pytest.approx(load, rel=1e-9)  # as the last row is written the lever takes it along
    assert np.abs(r.energy.balance).max() < 1e-8


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_a_ratchet_at_rest_between_teeth_sees_which_way_it_goes(way):
    m = wheels(0.4, torques=(f"{way}*t",))
    m.add(fb.Ratchet("pawl", "A.angle", pitch=0.3, tooth=0.1))
    r = run(m, 2.0, "joint")
    free = way * r.t**3 / 6 / 0.4
    assert r["A"].angle == pytest.approx(np.maximum(free, -0.2) if way < 0 else free, abs=1e-8)


@layers
def test_a_ratchet_bounces_on_its_tooth(coordinates):
    J, T, e = 0.4, 3.0, 0.5
    m = wheels(J, rates=(2.0,), torques=(-T,))
    m.add(fb.Ratchet("pawl", "A.angle", pitch=10.0, restitution=e))
    a = T / J
    first = 2 * 2.0 / a
    wanted = first + np.r_[0.0, np.cumsum(2 * 2.0 / a * e ** np.arange(1, 4))]
    r = run(m, float(wanted[-1]) + 1e-3, coordinates)
    hits = times(r, "pawl")
    for t in wanted:
        assert np.abs(hits - t).min() < 1e-8
