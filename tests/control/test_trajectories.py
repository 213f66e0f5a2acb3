"""Trajectories as laws: trapezoidal velocity, splines through waypoints with their derivatives."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

import flyball as fb
from tests.control.robots import ARM, arm


def turntable(law: str, **parameters: float) -> fb.Mechanism:
    m = fb.Mechanism("turntable", planar=True, parameters=parameters)
    m.add(fb.Body("plate", mass=1, inertia=0.5), fb.Revolute("A", "ground", "plate", at=(0, 0)))
    m.add(fb.Driver("motor", "A.angle", law))
    return m


def trapezoidal(t, t0, y0, t1, y1, b):
    """Position, velocity, acceleration by cases."""
    T = (t1 - t0) * b
    speed = (y1 - y0) / ((t1 - t0) * (1 - b))
    cases = [t <= t0, t < t0 + T, t <= t1 - T, t < t1]
    position = [
        y0 + 0 * t,
        y0 + speed * (t - t0) ** 2 / (2 * T),
        y0 + speed * (t - t0 - T / 2),
        y1 - speed * (t1 - t) ** 2 / (2 * T),
    ]
    velocity = [0 * t, speed * (t - t0) / T, speed + 0 * t, speed * (t1 - t) / T]
    acceleration = [0 * t, speed / T + 0 * t, 0 * t, -speed / T + 0 * t]
    return [np.select(cases, x, e) for x, e in ((position, y1), (velocity, 0), (acceleration, 0))]


@pytest.mark.parametrize("fraction", [0.5, 0.3, 0.05])
def test_trapezoid_prescribes_a_trapezoidal_velocity(fraction):
    m = turntable("trapezoid(t, 0.2, -0.5, 1.5, 2, b)", b=fraction)
    run = m.simulate(2, outputs=401)
    inside = np.abs(run.t[:, None] - [0.2, 0.2 + 1.3 * fraction, 1.5 - 1.3 * fraction, 1.5]).min(axis=1) > 1e-6
    expected = trapezoidal(run.t, 0.2, -0.5, 1.5, 2.0, fraction)
    assert run["A.angle"] == pytest.approx(expected[0], abs=1e-9)
    assert run["A.rate"] == pytest.approx(expected[1], abs=1e-8)
    assert run["motor.effort"][inside] == pytest.approx(0.5 * expected[2][inside], abs=1e-7)


@pytest.mark.parametrize("fraction", ["0", "0.6", "-0.1"])
def test_a_fraction_that_is_none_is_refused(fraction):
    with pytest.raises(fb.ModelError, match=r"is no fraction here(?s:.*)above 0, at most 0.5"):
        turntable(f"trapezoid(t, 0, 0, 1, 1, {fraction})")


def test_a_fraction_by_a_parameter_that_is_none_has_no_value():
    with pytest.raises(fb.FlyballError):
        turntable("trapezoid(t, 0, 0, 1, 1, b)", b=0.7).simulate(1)


@pytest.mark.parametrize(
    "law", ["path(t)", "2*path(0.5*t) + sin(path(t))*t", "path(t)**2*trapezoid(t, 0, 0, 2, 1, 0.2)"]
)
def test_computed_torque_follows_a_spline_through_waypoints_without_error(law):
    """Only the exact first and second derivatives leave no error."""
    x = np.linspace(0, 2.5, 9)
    y = np.cos(3 * x) * x
    spline = CubicSpline(x, y)
    env = {"path": spline, "t": 0.0, "sin": np.sin, "trapezoid": lambda t, *_: 0.0}
    start = eval(law, {"__builtins__": {}}, env)
    h = 1e-6
    rate = (eval(law, {"__builtins__": {}}, env | {"t": h}) - start) / h if "trapezoid" not in law else 0.0
    c = fb.ComputedTorque("c", coordinates=ARM, reference=[law, 0], kp=100, kd=20)
    m = arm(c, fb.Table("path", x=x, y=y), fb.Initial("shoulder.angle", value=start, rate=rate))
    run = m.simulate(2, rtol=1e-10, atol=1e-12)
    assert np.abs(run["c.shoulder_error"]).max() < 1e-5
    assert np.abs(run["c.shoulder_error"][run.t > 1.9]).max() < 1e-8
    if law == "path(t)":
        assert run["c.shoulder_acceleration"][run.t > 1.9] == pytest.approx(spline(run.t[run.t > 1.9], 2), abs=1e-5)


def test_a_table_that_ends_is_named():
    c = fb.ComputedTorque("c", coordinates=ARM, reference=["path(t)", 0], kp=100, kd=20)
    m = arm(c, fb.Table("path", x=[0, 1, 2, 3], y=[0, 1, 2, 0]))
    with pytest.raises(fb.ModelError, match=r"Table 'path' is evaluated at.*extend from 0 to 3"):
        m.simulate(4)
    with pytest.raises(fb.ModelError, match=r"'line', whose derivative.*give reference_rate"):
        arm(fb.ComputedTorque("c", coordinates=ARM, reference=["line(t)", 0], kp=1, kd=1), fb.Table("line", x=[0, 1], y=[0, 1], interpolation="linear"))  # fmt: skip
