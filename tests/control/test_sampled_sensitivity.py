"""Sensitivities of motions over the instants of sampled controllers: difference equations, and differences of motions."""

from __future__ import annotations

import numpy as np
import pytest

import flyball as fb
from tests.control.slide import slide
from tests.mechanisms import example

STRICT = {"rtol": 1e-11, "atol": 1e-13}


def mass_on_a_rail(*controllers, **parameters):
    m = fb.Mechanism("rail", planar=True, parameters=parameters)
    m.add(fb.Body("cart", mass="mass", inertia=1, position=("x0", 0)))
    m.add(fb.Prismatic("A", "ground", "cart", at=(0, 0), axis=(1, 0)))
    m.add(*controllers, fb.Actuator("drive", "A.displacement", force="pd"))
    return m


def test_a_mass_under_sampled_state_feedback():
    """x_(k+1) = F x_k + b u_k/m, u_k = kp (r - x) - kd v, and the derivatives of this recursion."""
    h, n = 0.1, 20
    P = {"kp": 4.0, "kd": 2.0, "mass": 1.5, "r": 0.7, "x0": 0.2}
    pd = fb.StateSpace("pd", inputs=["r - A.displacement", "A.displacement_rate"], D=[["kp", "-kd"]], period=h)
    m = mass_on_a_rail(pd, **P)
    s = m.sensitivity(
        ["cart.x", "cart.vx", "pd.output"], list(P), analysis="motion", t_end=n * h, outputs=n + 1, **STRICT
    )

    def recursion(kp, kd, mass, r, x0):
        x, v, rows = x0, 0.0 * x0, []
        for _ in range(n + 1):
            u = kp * (r - (x - x0)) - kd * v  # the displacement is counted from the drawing
            rows.append((x, v, u))
            x, v = x + h * v + 0.5 * h * h * u / mass, v + h * u / mass
        return np.array(rows)

    own = np.s_[:-1]  # at the end nothing is sampled
    np.testing.assert_allclose(s.values[own], recursion(**P)[own], atol=1e-10)
    for k, name in enumerate(P):
        exact = recursion(**P | {name: P[name] + 1e-30j}).imag / 1e-30
        np.testing.assert_allclose(s.derivatives[own, :, k], exact[own], atol=1e-9)
        assert np.abs(exact).max() > 0.05


def test_integral_limits_and_filter():
    """A PID that is at both limits, and returns: the derivative is that of the active branch."""
    pid = fb.PID(
        "pid", setpoint="r", measured="A.displacement", kp="kp", ki=12, kd=1, filter=0.05, period=0.05,
        lower=-1, upper="top",
    )  # fmt: skip
    m = slide(pid, kp=30.0, r=0.5, top=8.0)
    s = m.sensitivity(
        ["A.displacement", "pid.output", "pid.integral", "drive.work"], ["kp", "r", "top"], analysis="motion", t_end=2,
        verify=True,
    )  # fmt: skip
    out = s["pid.output", "top"]
    assert (out == 1.0).any() and (np.abs(out) < 1.0).any()  # at the limit, and beside it
    assert s.difference < 1e-6


@pytest.mark.parametrize("coordinates", ["joint", "absolute"])
def test_controllers_at_several_rates(coordinates):
    """An outer and an inner loop, states that update at once, and a continuous filter, on a pendulum."""
    m = fb.Mechanism("pendulum", planar=True, gravity=(0, -9.81), parameters={"J": 0.3, "g1": 5.0, "g2": 2.0, "T": 0.1})
    m.add(fb.Body("rod", mass=2, inertia="J", position=(0.5, 0)), fb.Revolute("A", "ground", "rod", at=(0, 0)))
    m.add(
        fb.Sensor("turned", "A.angle"),
        fb.Lag("slow", of="A.angle", time="T"),
        fb.StateSpace("outer", inputs=["0.4*sin(2*t) - slow"], D=[["g1"]], period=0.1),
        fb.StateSpace("inner", inputs=["outer - A.angle_rate"], A=[[0.5]], B=[[0.2]], C=[[1]], D=[["g2"]], period=0.02),
        fb.State("a", next="0.9*a + 0.1*b + T", period=0.04),
        fb.State("b", next="0.5*b - 0.3*a + A.angle", period=0.04, offset=0.0),
        fb.Motor("motor", "A", torque="inner + a + 9.81*cos(turned)"),
    )
    s = m.sensitivity(
        ["A.angle", "inner.x", "outer.output", "b.value", "slow.output"], ["J", "g1", "g2", "T"], analysis="motion", t_end=1,
        coordinates=coordinates, verify=True,
    )  # fmt: skip
    assert s.difference < 1e-6
    assert (np.abs(s.derivatives).max(axis=0).max(axis=0) > 1e-3).all()


def test_a_closed_loop_in_space():
    m = example("spatial_four_bar.toml")
    m.parameters["kc"] = 0.01
    m.add(
        fb.StateSpace("brake", inputs=["A.angle_rate"], D=[["-kc"]], period=0.05),
        fb.Motor("motor", "A", torque="brake"),
    )
    s = m.sensitivity(["A.angle", "brake.output"], ["kc"], analysis="motion", t_end=0.5, verify=True)
    assert s.difference < 1e-5


def test_optimising_a_sampled_loop():
    """Gains that follow a motion made with other gains are those gains."""
    pd = fb.StateSpace("pd", inputs=["0.5 - A.displacement", "A.displacement_rate"], D=[["kp", "-kd"]], period=0.1)
    m = slide(pd, force="pd", kp=30.0, kd=2.0)
    aim = m.simulate(1, outputs=11, **STRICT)["A.displacement"]
    m.parameters.update(kp=20.0, kd=1.0)
    found = m.optimize(
        ["A.displacement"],
        {"kp": (10, 50), "kd": (0.5, 5)},
        target=aim[:, None],
        analysis="motion",
        t_end=1,
        outputs=11,
    )
    assert found.parameters["kp"] == pytest.approx(30, rel=1e-5)
    assert found.parameters["kd"] == pytest.approx(2, rel=1e-4)


def test_instants_that_move_are_refused():
    m = slide(fb.StateSpace("pd", inputs=["A.displacement"], D=[["-k"]], period="h"), force="pd", k=2.0, h=0.1)
    m.sensitivity(["A.displacement"], ["k"], analysis="motion", t_end=0.3)
    with pytest.raises(fb.ModelError, match=r"StateSpace 'pd': its instants depend on 'h'.*take differences"):
        m.sensitivity(["A.displacement"], ["h"], analysis="motion", t_end=0.3)


def test_of_a_motion_that_drivers_prescribe():
    """The held value is -k times the displacement at the last instant; the driver's effort balances it."""
    m = slide(fb.StateSpace("pd", inputs=["A.displacement"], D=[["-k"]], period=0.1), force="pd", k=2.0)
    m.add(fb.Driver("d", "A.displacement", law="0.1*sin(t)"))
    s = m.sensitivity(["pd.output", "d.effort"], ["k"], analysis="motion", t_end=0.35, outputs=8)
    held = 0.1 * np.sin(0.1 * np.floor(s.t / 0.1 + 1e-9))
    np.testing.assert_allclose(s["pd.output", "k"], -held, atol=1e-10)
    np.testing.assert_allclose(s["d.effort", "k"], held, atol=1e-10)
