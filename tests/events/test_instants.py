"""Events of mechanisms against closed forms: when, how often, and that nothing else about the motion changes."""

from __future__ import annotations

import re

import numpy as np
import pytest
from scipy.special import ellipj, ellipk

import flyball as fb
from flyball.errors import SimulationError
from flyball.simulation import simulate as simulating
from tests.layers import LAYERS

G = 9.81


def pendulum(*events):
    """A point mass of 1 kg on a rod of 1 m, let go from the horizontal; ``A.angle`` counts from there."""
    m = fb.Mechanism("pendulum", planar=True, gravity=(0, -G))
    m.add(fb.Body("bob", mass=1.0, inertia=0.0, position=(1, 0)))
    m.add(fb.Revolute("A", "ground", "bob", at=(0, 0)))
    for e in events:
        m.add(e)
    return m


def ball(*events, height=1.0):
    """A ball on a vertical guide; ``S.displacement`` counts from its start."""
    m = fb.Mechanism("ball", planar=True, gravity=(0, -G))
    m.add(fb.Body("ball", mass=2.0, inertia=0.1, position=(0, height)))
    m.add(fb.Prismatic("S", "ground", "ball", at=(0, 0), axis=(0, 1)))
    for e in events:
        m.add(e)
    return m


def note(when, direction="either"):
    return fb.Event("there", when=when, direction=direction, do=[])


def times(run):
    return np.array([e.t for e in run.events])


@pytest.mark.parametrize("coordinates", LAYERS)
def test_a_pendulum_passes_its_lowest_point_when_elliptic_integrals_say(coordinates):
    """From the horizontal, k = sin 45 deg: a quarter of a period is K(k^2) / omega."""
    run = pendulum(note("A.angle + pi/2")).simulate(10.0, rtol=1e-12, atol=1e-14, outputs=11, coordinates=coordinates)
    quarter = ellipk(0.5) / np.sqrt(G)
    wanted = quarter * np.arange(1.0, 10.0 / quarter, 2.0)
    assert len(run.events) == len(wanted) == 8
    assert np.abs(times(run) - wanted).max() < 1e-10


@pytest.mark.parametrize("coordinates", LAYERS)
def test_and_any_other_angle(coordinates):
    """sin(phi/2) = k sn(K - omega t): from the horizontal to 0.3 rad before the lowest point, and beyond."""
    run = pendulum(note("A.angle + pi/2 - 0.3", "falling")).simulate(
        2.0, rtol=1e-12, atol=1e-14, outputs=3, coordinates=coordinates
    )
    t = times(run)
    sn = ellipj(ellipk(0.5) - np.sqrt(G) * t, 0.5)[0]
    assert len(t) == 1
    assert 2.0 * np.arcsin(np.sqrt(0.5) * sn) == pytest.approx(0.3, abs=1e-10)


@pytest.mark.parametrize("coordinates", LAYERS)
def test_outputs_do_not_change_with_events_that_change_nothing(coordinates):
    plain = pendulum().simulate(5.0, rtol=1e-10, outputs=101, coordinates=coordinates)
    run = pendulum(note("A.angle + pi/2")).simulate(5.0, rtol=1e-10, outputs=101, coordinates=coordinates)
    assert np.array_equal(run.t, plain.t)
    assert np.abs(run["A"].angle - plain["A"].angle).max() < 1e-7
    assert np.abs(run["A"].angle_acceleration - plain["A"].angle_acceleration).max() < 1e-6


@pytest.mark.parametrize("coordinates", LAYERS)
def test_a_stop_ends_the_run_on_the_event(coordinates):
    run = ball(fb.Event("floor", when="S.displacement + 1", direction="falling", do=[fb.Stop()])).simulate(
        3.0, coordinates=coordinates
    )
    t1 = np.sqrt(2.0 / G)
    assert run.t[-1] == pytest.approx(t1, abs=1e-13)
    assert run["ball"].y[-1] == pytest.approx(0.0, abs=1e-12)
    assert run["ball"].vy[-1] == pytest.approx(-G * t1, rel=1e-12)
    assert (np.diff(run.t) > 0.0).all()


@pytest.mark.parametrize("of", ["sin(400*pi*t + 0.3)", "sin(400*pi*S.displacement + 0.3)"])
def test_four_hundred_changes_in_a_second(of):
    m = fb.Mechanism("fast", planar=True)
    m.add(fb.Body("b", mass=1.0, inertia=0.1, velocity=(1.0, 0.0)))
    m.add(fb.Prismatic("S", "ground", "b", at=(0, 0), axis=(1, 0)), note(of))
    t = times(m.simulate(1.0, outputs=2))
    assert len(t) == 400
    assert np.abs(t - (np.arange(1, 401) * np.pi - 0.3) / (400.0 * np.pi)).max() < 1e-12


def test_a_pulse_of_a_guard_that_depends_on_time_is_not_missed():
    """A hundred thousandth of the time span, within one step."""
    run = ball(note("exp(-((t - 1.2345)/1e-5)**2) - 0.5", "rising")).simulate(2.0, outputs=2)
    assert times(run) == pytest.approx([1.2345 - 1e-5 * np.sqrt(np.log(2.0))], abs=1e-12)


def test_a_narrow_pulse_gives_its_whole_impulse():
    """A Gaussian of 1 ms, and a rectangle of as much, within 10 s: 1000 N."""
    for law, impulse in (
        ("1000*exp(-((t - 5)/1e-3)**2)", np.sqrt(np.pi)),
        ("where(t < 3.3, 0, where(t < 3.301, 1000, 0))", 1.0),
    ):
        m = fb.Mechanism("pushed", planar=True)
        m.add(fb.Body("b", mass=1.0, inertia=0.1))
        m.add(fb.Prismatic("S", "ground", "b", at=(0, 0), axis=(1, 0)), fb.Actuator("F", "S.displacement", force=law))
        assert m.simulate(10.0, outputs=2)["b"].vx[-1] == pytest.approx(impulse, rel=1e-6)


def test_corners_of_laws_cost_their_own_steps_only():
    """A force that changes its sign two hundred times; in the closed form nothing of it is left."""
    m = fb.Mechanism("pushed", planar=True)
    m.add(fb.Body("b", mass=1.0, inertia=0.1))
    m.add(fb.Prismatic("S", "ground", "b", at=(0, 0), axis=(1, 0)))
    m.add(fb.Actuator("F", "S.displacement", force="where(sin(20*pi*t) > 0, 1, -1)"))
    run = m.simulate(10.0, outputs=[0.0, 0.05, 9.95, 10.0])
    assert run["b"].vx[[1, 3]] == pytest.approx([0.05, 0.0], abs=1e-9)
    assert run.health.steps < 2 * 200
    assert run.health.rejected < 100


def test_health_says_that_a_guard_is_no_proof():
    run = ball(note("S.displacement + 1")).simulate(0.2)
    assert "1 event function evaluated at" in run.health.event_detection
    average, least = map(
        int, re.search(r"about (\d+) points per step \(at least (\d+)\)", run.health.event_detection).groups()
    )
    assert average >= least
    assert "can be missed" in run.health.event_detection
    assert ("event detection", run.health.event_detection) in run.health.lines()
    assert ball().simulate(0.2).health.event_detection == ""


def test_an_interrupt_keeps_what_there_is():
    calls = []

    def stop(fraction):
        calls.append(fraction)
        if fraction > 0.3:
            raise KeyboardInterrupt

    with pytest.raises(fb.Interrupted) as ended:
        pendulum(note("A.angle + pi/2")).simulate(10.0, progress=stop, outputs=1001)
    run = ended.value.result
    assert not run.health.success
    assert "interrupted" in run.health.message
    assert 2.0 < run.t[-1] < 10.0
    assert calls == sorted(calls)


def test_too_many_steps_keep_what_there_is():
    with pytest.raises(SimulationError, match="max_steps") as caught:
        pendulum(note("A.angle + pi/2")).simulate(10.0, max_steps=30)
    assert 0.0 < caught.value.result.t[-1] < 10.0
    assert len(caught.value.result.events)


def test_motions_without_events_take_the_way_they_always_took(monkeypatch):
    """Nothing of the watched loop is asked for, or compiled, where there is nothing to watch."""

    def never(*_):
        raise AssertionError

    monkeypatch.setattr(simulating, "integrate_events", never)
    assert ball().simulate(0.1).health.success


def test_a_guard_that_jumps_with_a_law_of_time_is_seen_behind_the_jump():
    """At 1.25 s, where it jumps over zero: no step has a zero in it."""
    m = ball(note("where(t < 1.25, 1, -1)*(3 + sin(S.rate))", "falling"))
    assert times(m.simulate(2.0, outputs=2)) == pytest.approx([1.25], abs=1e-12)


def test_what_rises_and_what_falls_at_one_instant_happen_together():
    """What one condition's action undoes for the other has happened all the same: both were met at that instant."""
    m = fb.Mechanism("two", planar=True, gravity=(0, 0))
    for name, v in (("a", 1.0), ("b", -1.0)):
        m.add(fb.Body(name, mass=1, inertia=1, velocity=(v, 0)))
    m.add(fb.Event("rises", "a.x > 0.5", do=[fb.Impulse("b", (2.0, 0.0))]))
    m.add(fb.Event("falls", "b.x < -0.5", do=[fb.Impulse("a", (-2.0, 0.0))]))
    run = m.simulate(1.0)
    assert [(e.name, e.t) for e in run.events] == [("rises", pytest.approx(0.5)), ("falls", pytest.approx(0.5))]
    assert run["a"].velocity[-1][0] == pytest.approx(-1.0)
    assert run["b"].velocity[-1][0] == pytest.approx(1.0)
