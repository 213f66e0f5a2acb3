"""What stops a motion that grows beyond all bounds, or takes too many steps, is named: a state, a step, a controller."""

from __future__ import annotations

import re

import numpy as np
import pytest

import flyball as fb
from flyball.numerics.integrators.butcher_tableaux import tableau
from flyball.simulation.initial_state import find_initial_state
from flyball.simulation.law_faults import longest_stable
from tests.control.slide import slide


def damped(damping: float = 1000.0) -> fb.Mechanism:
    """A rod of 1 kg and 1 m at its end: its rate decays at damping / (1/3)."""
    m = fb.Mechanism("s", planar=True, gravity=(0, -9.81))
    m.add(fb.Body("b", mass=1, inertia=1 / 12, position=(0.5, 0)), fb.Revolute("A", "ground", "b", at=(0, 0)))
    m.add(fb.TorsionalSpringDamper("d", "A", damping=damping))
    return m


def said(ask) -> str:
    with pytest.raises(fb.SimulationError) as caught:
        ask()
    return str(caught.value)


@pytest.mark.parametrize("method", ["dop853", "rk45"])
def test_a_fixed_step_that_is_too_long_is_told_with_the_longest_stable_one(method):
    text = said(lambda: damped().simulate(20, step=0.1, method=method))
    assert f"a step of 0.1 s is too long for {method}" in text
    assert "3e+03 1/s" in text
    assert "divides by zero" not in text
    longest = float(re.search(r"steps up to (\S+) s", text)[1])
    assert abs(damped().simulate(0.5, step=0.95 * longest, method=method)["A.rate"][-1]) < 0.02
    wide = damped().simulate(0.06, step=1.2 * longest, method=method)
    assert abs(wide["A.rate"][-1]) > 1.0


def test_the_longest_stable_step_is_that_of_the_stability_region():
    """Hairer and Wanner (1996), section IV.2: 3.31 on the negative real axis for Dormand and Prince's method of order 5."""
    start = find_initial_state(damped().snapshot(), 0.0, None, None, "auto", switches=True).assembly
    longest, rate = longest_stable(start, tableau("rk45"), np.ones(len(start.y)))
    assert rate == pytest.approx(3000.0, rel=1e-5)
    assert longest * rate == pytest.approx(3.31, abs=0.01)


def test_a_step_that_is_short_enough_is_not_blamed():
    m = slide(fb.PID("pid", setpoint=1, measured="A.displacement", kp=-1e3))
    text = said(lambda: m.simulate(100, step=0.01))
    assert "too long" not in text
    assert "the motion grows without bound: by t = " in text
    assert "a velocity of joint 'A' is" in text


@pytest.mark.parametrize("method", ["dop853", "radau"])
def test_an_unstable_loop_is_told_by_what_grows(method):
    m = slide(fb.PID("pid", setpoint=1, measured="A.displacement", kp=-1e3))
    text = said(lambda: m.simulate(100, method=method, rtol=1e-4))
    assert "the motion grows without bound" in text
    assert "joint 'A'" in text
    grows = slide(fb.State("x", rate="50*x", initial=1.0), force="0*x")
    assert "controller state 'x.value' is" in said(lambda: grows.simulate(100, method=method, rtol=1e-4))


@pytest.mark.parametrize("method", ["dop853", "radau"])
@pytest.mark.parametrize(("rate", "end"), [("x**2", 1.0), ("exp(x)", np.exp(-1.0))])
def test_a_state_that_has_no_value_from_a_time_on_is_named(rate, end, method):
    """x' = x^2 from 1 ends at 1 s, x' = exp(x) at 1/e s."""
    text = said(lambda: slide(fb.State("x", rate=rate, initial=1.0), force="0*x").simulate(2, method=method))
    assert "controller state 'x.value' is" in text
    assert "has no value from there on" in text
    assert "lock" not in text
    assert float(re.search(r"at t = (\S+) s controller", text)[1]) == pytest.approx(end, rel=1e-5)


def often(period, **more) -> fb.Mechanism:
    return slide(fb.PID("pid", setpoint=1, measured="A.displacement", kp=10, period=period, **more))


def test_a_period_that_is_too_short_is_told_before_and_after():
    with pytest.raises(fb.ModelError, match=r"PID 'pid' has a period of 1e-09 s: .* sampled 1e\+09 times.*max_steps"):
        often(1e-9).simulate(1)
    with pytest.raises(fb.ModelError, match="is sampled 999 times"):
        often(1e-3).simulate(1, max_steps=998)
    m = often(1e-6)
    m.add(fb.Event("never", "A.displacement > 1e9", do=[fb.Stop()]))  # it might end the motion before
    text = said(lambda: m.simulate(10, max_steps=3000))
    assert "max_steps = 3000 steps were taken up to t = 0.003 s. PID 'pid' has a period of 1e-06 s" in text
    assert "from t = 0.003 s to the end at 10 s it is sampled 1e+07 times" in text
    assert "stiffness" not in text


def test_a_controller_that_never_acts_is_told():
    run = often(0.01, offset=5).simulate(1, outputs=3)
    assert any("PID 'pid' is never sampled: its first instant is at offset = 5 s" in w for w in run.health.warnings)
    assert not run["pid.output"].any()
    assert not any("never" in w for w in often(0.01, offset=0.5).simulate(1, outputs=3).health.warnings)


@pytest.mark.parametrize("method", ["auto", "radau"])
@pytest.mark.parametrize("coordinates", ["joint", "absolute"])
@pytest.mark.parametrize("guided", [False, True])
def test_two_magnets_that_collide_are_told_by_the_law_that_has_no_bound(guided, coordinates, method):
    """They meet after pi/2 sqrt(m d**3 / (4 c)): Kepler's third law, for half a degenerate ellipse from d = 1 m at rest."""
    m = fb.Mechanism("magnets", planar=True)
    for name, x in (("a", -0.5), ("b", 0.5)):
        m.add(fb.Body(name, mass=1, inertia=1, position=(x, 0)))
        if guided:
            m.add(fb.Prismatic(f"along {name}", "ground", name, at=(x, 0), axis=(1, 0)))
    m.add(fb.SpringDamper("pull", "a", "b", at=((-0.5, 0), (0.5, 0)), force="1/length**2"))
    with pytest.raises(fb.SimulationError) as caught:
        m.simulate(3.0, coordinates=coordinates, method=method)
    text = str(caught.value)
    assert caught.value.t == pytest.approx(np.pi / 4, rel=1e-6)
    assert "the law of SpringDamper 'pull' gives" in text
    assert "1/(r**2 + a**2)" in text
    assert "law of its rate" not in text
    assert "may lock" not in text


@pytest.mark.parametrize("coordinates", ["joint", "absolute"])
def test_an_attraction_towards_the_world_is_told_by_its_law(coordinates):
    """From x = 1 m at rest under 1/x**2 a unit mass arrives after pi / sqrt(8)."""
    m = fb.Mechanism("magnet", planar=True)
    m.add(fb.Body("a", mass=1, inertia=1, position=(1, 0)))
    m.add(fb.Prismatic("P", "ground", "a", at=(0, 0), axis=(1, 0), displacement=1))
    m.add(fb.Actuator("pull", "P.displacement", force="-1/value**2"))
    with pytest.raises(fb.SimulationError, match=r"the law of Actuator 'pull' gives .* grows without bound") as caught:
        m.simulate(3.0, coordinates=coordinates)
    assert caught.value.t == pytest.approx(np.pi / 8**0.5, rel=1e-6)
