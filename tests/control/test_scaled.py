"""Where mechanisms rest with their controllers, and how they move there, does not depend on what units states are in."""

from __future__ import annotations

import numpy as np
import pytest

import flyball as fb
from tests.control.slide import slide

WEIGHT = 2 * 9.81 * 0.5 * np.sin(0.7)
EVERY = (1e-9, 1e-5, 1e5, 1e9)


def held(integral=1.0, slow=1.0, length=1.0, mass=1.0, time=1.0):
    """A pendulum held at 0.7 rad by a PID behind a lag, all of it in other units."""
    torque = mass * (length / time) ** 2
    m = fb.Mechanism("pendulum", planar=True, gravity=(0, -9.81 * length / time**2), parameters={"r": 0.7})
    m.add(fb.Body("rod", mass=2 * mass, inertia=0.1 * mass * length**2, position=(0, -0.5 * length)))
    m.add(fb.Revolute("A", "ground", "rod", at=(0, 0)))
    m.add(
        fb.Integrator("sum", of="r - A.angle", gain=40 * integral * torque / time),
        fb.State("slow", rate=f"({slow}*A.angle - slow)/{0.05 * time}"),
        fb.Lag(
            "act",
            of=f"sum/{integral} + {60 * torque}*(r - A.angle) - {400 * torque}*(A.angle - slow/{slow})",
            time=0.01 * time,
        ),
    )
    m.add(fb.Motor("motor", "A", torque="act"))
    return m


def poles():
    """Of the same: det(s I - A) of angle, speed, sum, slow, act."""
    k = 2 * 9.81 * 0.5 * np.cos(0.7)
    A = np.zeros((5, 5))
    A[0, 1] = 1
    A[1, [0, 4]] = -k / 0.6, 1 / 0.6
    A[2, 0] = -40
    A[3, [0, 3]] = 20, -20
    A[4, [0, 2, 3, 4]] = -46000, 100, 40000, -100
    return np.sort_complex(np.linalg.eigvals(A))


@pytest.mark.parametrize(
    "units",
    [{what: by} for what in ("integral", "slow", "mass", "time") for by in EVERY]
    + [{"length": by} for by in (1e-6, 1e-3, 1e3, 1e6)]
    + [{"integral": 1e9, "slow": 1e-9, "length": 1e-3, "mass": 1e-6, "time": 1e-4}],
    ids=str,
)
def test_a_loop_in_other_units(units):
    m = held(**units)
    e = m.equilibrium()
    torque = units.get("mass", 1.0) * (units.get("length", 1.0) / units.get("time", 1.0)) ** 2
    found = e["A.angle"], e["sum.value"] / units.get("integral", 1.0) / torque, e["slow.value"] / units.get("slow", 1.0)
    assert found == pytest.approx((0.7, WEIGHT, 0.7), rel=1e-12)
    assert e["act.value"] / torque == pytest.approx(WEIGHT, rel=1e-12)
    assert e.stability == "stable"
    w = np.sort_complex(m.linearize(about=e).eigenvalues) * units.get("time", 1.0)
    assert w == pytest.approx(poles(), rel=1e-10)
    listed = m.modes(about=e).eigenvalues * units.get("time", 1.0)
    assert listed == pytest.approx(sorted(poles()[poles().imag >= 0], key=abs), rel=1e-10)


@pytest.mark.parametrize("by", EVERY)
def test_states_that_only_other_states_see(by):
    """a = by x / 3, b = a / 2, x = 1.5 m: the integral carries 15 N and b / by = 0.25 N."""
    m = slide(
        fb.State("a", rate=f"-3*a + {by}*A.displacement"),
        fb.State("b", rate="-2*b + a"),
        fb.Integrator("i", of="1.5 - A.displacement"),
        force=f"i - b/{by}",
    )
    e = m.equilibrium()
    found = e["A.displacement"], e["a.value"] / by, e["b.value"] / by, e["i.value"]
    assert found == pytest.approx((1.5, 0.5, 0.25, 15.25), rel=1e-12)
    w = np.sort_complex(m.linearize(outputs=["b.value"], about=e).eigenvalues)
    A = [[0, 1, 0, 0, 0], [-10, -2, 0, -1, 1], [1, 0, -3, 0, 0], [0, 0, 1, -2, 0], [-1, 0, 0, 0, 0]]
    assert w == pytest.approx(np.sort_complex(np.linalg.eigvals(A)), rel=1e-10)
    small = m.linearize(["drive"], ["a.value"], about=e)
    assert small.response([0.0])[0].real == pytest.approx(0.0, abs=1e-9 * by)  # the integral takes a force away


@pytest.mark.parametrize("by", EVERY)
def test_states_that_have_nothing_to_do_with_the_mechanism(by):
    m = slide(fb.Lag("idle", of=f"{3 * by}", time=1e-3), fb.Lag("after", of="idle", time=2.0), force="0.0*idle")
    e = m.equilibrium()
    assert (e["idle.value"], e["after.value"]) == pytest.approx((3 * by, 3 * by), rel=1e-12)
    assert e.stability == "stable"


@pytest.mark.parametrize("time", [1e-9, 1e-6, 1e-3, 1.0, 1e3, 1e6])
def test_filters_and_lags_of_any_length(time):
    """A PI behind a lag on a mass on a spring: x is the set point, the integral k x, and its poles those of a cubic."""
    m = slide(
        fb.PID("pid", setpoint="1", measured="A.displacement", kp=5, ki=2),
        fb.Lag("act", of="pid", time=time),
        force="act",
    )
    e = m.equilibrium()
    assert (e["A.displacement"], e["pid.integral"], e["act.value"]) == pytest.approx((1, 10, 10), rel=1e-10)
    p = np.polyadd(np.polymul([1, 2, 10, 0], [time, 1]), [5, 2])
    w = np.roots(p)
    for _ in range(3):
        w = w - np.polyval(p, w) / np.polyval(np.polyder(p), w)
    assert e.stability == ("stable" if w.real.max() < 0 else "unstable")
    assert np.sort(m.linearize(about=e).eigenvalues.real)[-3:] == pytest.approx(np.sort(w.real)[-3:], rel=1e-6)


@pytest.mark.parametrize("by", EVERY)
def test_sampled_loops_in_other_units(by):
    m = slide(
        fb.State("sum", next=f"sum + {0.2 * by}*(1 - A.displacement)", period=0.02),
        fb.StateSpace("gain", inputs=["sum"], D=1 / by, period=0.02),
        force="gain",
    )
    e = m.equilibrium()
    assert (e["A.displacement"], e["sum.value"] / by, e["gain.output"]) == pytest.approx((1, 10, 10), rel=1e-11)
    assert e.stability == "stable"
    twin = slide(
        fb.State("sum", next="sum + 0.2*(1 - A.displacement)", period=0.02),
        fb.StateSpace("gain", inputs=["sum"], D=1, period=0.02),
        force="gain",
    )
    w, same = (np.sort_complex(x.linearize(about=x.equilibrium()).eigenvalues) for x in (m, twin))
    assert w == pytest.approx(same, rel=1e-9, abs=1e-12)
    later = m.linearize(about=m.simulate(0.1, start=e.result))
    assert np.sort_complex(later.eigenvalues) == pytest.approx(same, rel=1e-7, abs=1e-9)
