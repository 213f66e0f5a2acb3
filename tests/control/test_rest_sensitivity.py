"""How places at rest with controllers change with parameters: the implicit function theorem over their states, too."""

from __future__ import annotations

import numpy as np
import pytest

import flyball as fb
from tests.control.slide import slide


def pendulum(**fields):
    """Held at r by a PID: the integral carries w sin(r), w = m g l."""
    m = fb.Mechanism(
        "pendulum", planar=True, gravity=(0, "-g"), parameters={"r": 0.7, "mass": 2.0, "g": 9.81, "b": 3.0}
    )
    m.add(fb.Body("rod", mass="mass", inertia=0.1, position=(0, -0.5)))
    m.add(fb.Revolute("A", "ground", "rod", at=(0, 0)))
    given = {"kp": 60, "ki": 40, "kd": 20, "filter": 0.05} | fields
    m.add(fb.PID("pid", setpoint="r", measured="A.angle", bias="b", **given))
    m.add(fb.Motor("motor", "A", torque="pid"))
    return m


@pytest.mark.parametrize("period", [None, 0.02])
def test_what_an_integral_carries(period):
    of = ["A.angle", "pid.integral", "pid.output", "motor.torque", "pid.error"]
    s = pendulum(period=period).sensitivity(of, ["r", "mass", "g", "b"], analysis="equilibrium")
    w = 2 * 9.81 * 0.5
    turn, load = w * np.cos(0.7), w * np.sin(0.7)
    exact = [
        [1, 0, 0, 0],
        [turn, load / 2, load / 9.81, -1],
        [turn, load / 2, load / 9.81, 0],
        [turn, load / 2, load / 9.81, 0],
        [0, 0, 0, 0],
    ]
    for row, name in zip(exact, of, strict=True):
        assert [s[name, p] for p in ("r", "mass", "g", "b")] == pytest.approx(row, rel=1e-9, abs=1e-11)
    assert s.values[0] == pytest.approx([0.7, load - 3, load, load, 0], rel=1e-9, abs=1e-11)


def test_without_an_integral_the_place_gives_way():
    """kp (r - x) + b = w sin(x); differences of the search itself say so too."""
    m = pendulum(ki=0.0)
    s = m.sensitivity(["A.angle", "pid.slow"], ["r", "b"], analysis="equilibrium", verify=True)
    x = s.values[0, 0]
    assert 60 * (0.7 - x) + 3 == pytest.approx(9.81 * np.sin(x), abs=1e-10)
    slope = 60 + 9.81 * np.cos(x)
    assert [s["A.angle", p] for p in ("r", "b")] == pytest.approx([60 / slope, 1 / slope], rel=1e-9)
    assert [s["pid.slow", p] for p in ("r", "b")] == pytest.approx([-60 / slope, -1 / slope], rel=1e-9)
    assert s.verification == pytest.approx(s.derivatives, rel=1e-5, abs=1e-9)


@pytest.mark.parametrize("by", [1e-9, 1.0, 1e9])
def test_in_any_units(by):
    m = slide(fb.Integrator("sum", of="r - A.displacement", gain=by), force=f"sum/{by} - 2*value", r=1.0)
    s = m.sensitivity(["A.displacement", "sum.value"], ["r"], analysis="equilibrium")
    assert [s[name, "r"] for name in s.of] == pytest.approx([1, 12 * by], rel=1e-9)


def test_a_state_that_nothing_determines():
    m = slide(fb.Integrator("idle", of="0*A.displacement"), force="-r*value + 0*idle", r=1.0)
    with pytest.raises(fb.SingularityError, match=r"is not determined along 'idle\.value'"):
        m.sensitivity(["A.displacement"], ["r"], analysis="equilibrium")
