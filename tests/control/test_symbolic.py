"""Symbolic equations of mechanisms with controllers: closed forms, and the numbers of `linearize` and `simulate`."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import flyball as fb
from flyball.symbolic.linear.linear_equations import linear_equations
from tests.control.slide import TIGHT, pendulum, slide
from tests.mechanisms import example

sp = pytest.importorskip("sympy")


def servo() -> fb.Mechanism:
    """A motor with integral, proportional and rate feedback on an inertia J."""
    m = fb.Mechanism("servo", planar=True, parameters={"J": 0.2, "kp": 3.0, "ki": 1.0, "kd": 0.5, "r": 0.0})
    m.add(fb.Body("rotor", mass=1.0, inertia="J"), fb.Revolute("A", "ground", "rotor", at=(0, 0)))
    m.add(fb.PID("pid", setpoint="r", measured="A.angle", kp="kp", ki="ki", bias="-kd*A.angle_rate"))
    m.add(fb.Motor("motor", "A", torque="pid"))
    return m


def test_characteristic_polynomial_of_a_servo():
    L = servo().symbolic(inputs=["r"]).linear(["A.angle"])
    J, kp, ki, kd = sp.symbols("J kp ki kd", positive=True)
    s = L.transfer_function().s
    G = L.transfer_function().expression
    assert sp.simplify(G - (kp * s + ki) / (J * s**3 + kd * s**2 + kp * s + ki)) == 0
    (condition,) = L.routh().conditions
    assert sp.simplify(condition.lhs - condition.rhs - (kd * kp - J * ki)) == 0
    assert L.routh().holds()
    assert not L.routh().holds(ki=8.0)
    assert L.mass is None  # three states are no equation M a'' + D a' + K a = 0


CONTROLLERS = {
    "lag": [fb.Lag("c", of="A.displacement", time="T", lead=0.3, gain="2")],
    "integrator": [fb.Integrator("c", of="-A.displacement")],
    "state space": [
        fb.StateSpace("c", inputs=["A.displacement"], A=[[-1, 0], [1, -2]], B=[[1], [2]], C=[[1, 1]], D=0.3)
    ],
    "transfer": [fb.Transfer("c", of="A.displacement", num=[-3, 1], den=[0.1, 1, 2])],
    "state": [fb.State("c", rate="-c + T*A.displacement_rate - A.displacement")],
    "series": [
        fb.Lag("b", of="A.displacement", time="T"),
        fb.PID("c", setpoint="0", measured="b", kp=3, ki=2, kd=1, filter=0.02),
    ],
    "limited": [fb.PID("c", setpoint="0", measured="A.displacement", kp=3, ki=2, lower=-1, upper=2)],
    "clamped": [
        fb.PID("c", setpoint="0", measured="A.displacement", kp=3, ki=2, lower=-1, upper=2, anti_windup="clamping")
    ],
}


@pytest.mark.parametrize("layer", ["joint", "absolute"])
@pytest.mark.parametrize("name", CONTROLLERS)
def test_every_controller(name, layer):
    """States, matrices, frequency responses and eigenvalues are those of the numeric linear model."""
    m = slide(*CONTROLLERS[name], force="c", T=0.1)
    inputs, outputs = ["drive", "T"], ["A.displacement", "c.output"]
    L = linear_equations(m, inputs, outputs, coordinates=layer)
    for T in (0.1, 0.3):
        N = slide(*CONTROLLERS[name], force="c", T=T).linearize(inputs, outputs, coordinates=layer)
        assert (L.states, L.matrices.state_units) == (N.states, N.state_units)
        for k, X in L.values(T=T).items():
            assert pytest.approx(getattr(N, k), rel=1e-10, abs=1e-10) == X
        w = np.array([0.1, 1.0, 7.0, 60.0])
        for y in outputs:
            assert L.transfer_function("drive", y).response_at(w, T=T) == pytest.approx(
                N.response(w, "drive", y), rel=1e-8
            )
        assert L.routh().holds(T=T) == (N.eigenvalues.real.max() < 0.0)


def test_states_that_balance():
    """At any angle r the integral is the weight's torque, and the filter's state is the angle."""
    m = pendulum(40.0)
    L = linear_equations(m, ["r"], ["A.angle"], at={"A.angle": "r"}, balanced_by=["pid.integral", "pid.slow"])
    for r in (0.3, 0.7):
        assert L.balance(r=r) == pytest.approx({"pid.integral": 9.81 * np.sin(r), "pid.slow": -r}, rel=1e-12)
        N = m.linearize(["r"], ["A.angle"], about=m.equilibrium(parameters={"r": r}), coordinates="joint")
        assert L.values(r=r)["A"] == pytest.approx(N.A, abs=1e-7)
    same = linear_equations(m, at={"A.angle": "r", "pid.integral": "9.81*sin(r)", "pid.slow": "-r"})
    assert same.values(r=0.3)["A"] == pytest.approx(L.values(r=0.3)["A"], rel=1e-12)
    about = linear_equations(m, at=m.equilibrium())
    assert about.values()["A"] == pytest.approx(m.linearize(about=m.equilibrium(), coordinates="joint").A, abs=1e-9)
    with pytest.raises(fb.ModelError, match=r"'pid\.slow' changes by -14 in a second.*parameter or controller state"):
        linear_equations(m, at={"A.angle": "r", "pid.integral": "9.81*sin(r) + 280"})


def test_what_does_not_rest_is_refused():
    with pytest.raises(fb.ModelError, match=r"in no equilibrium there: 'sum\.value' changes by 1 in a second"):
        linear_equations(slide(fb.Integrator("sum", of="1"), force="0.0*sum"))


def test_a_steady_motion_under_control():
    """A flyball governor with an integral, at speed: eigenvalues for other gains."""
    L = example("governor_pi.py", ki=8.0).symbolic().linear(["shaft.angle_rate"])
    for kp in (20.0, 30.0):
        N = example("governor_pi.py", ki=8.0, kp=kp).linearize(coordinates="joint")
        assert L.states == N.states
        assert np.sort_complex(L.eigenvalues(kp=kp)) == pytest.approx(np.sort_complex(N.eigenvalues), abs=1e-10)


def test_sampled_controllers_are_refused():
    m = slide(fb.Lag("lag", of="1", time=1, period=0.1), force="lag")
    for ask in (m.symbolic, m.export, lambda: linear_equations(m)):
        with pytest.raises(fb.ModelError, match="has Lag 'lag', sampled, and symbolic is about continuous time"):
            ask()


def test_nonlinear_state_space_and_code():
    """States of controllers in x' = f(x, u, t), and as argument of exported functions: the motion is that of simulate."""
    pid = fb.PID("pid", setpoint="1", measured="A.displacement", kp="kp", ki=60, kd=12, filter=0.02, lower=-5, upper=30)
    m = slide(pid, kp=80.0)
    run = m.simulate(1, outputs=5, **TIGHT)
    x = m.symbolic().state_space(["pid.output"])
    assert x.states == ("A.displacement", "A.displacement'", "pid.integral", "pid.slow")
    wanted = np.array([run[k] for k in ("A.displacement", "A.displacement_rate", "pid.integral", "pid.slow")])
    found = solve_ivp(x, (0, 1), x.start, t_eval=run.t, rtol=1e-11, atol=1e-12, max_step=0.01)
    assert found.y == pytest.approx(wanted, abs=1e-8)
    assert x.evaluate(found.y[:, -1])[1] == pytest.approx(run["pid.output"][-1:], abs=1e-6)
    code = m.export(language="python", functions=["right_hand_side"])
    assert code.names["z"] == ("pid.integral", "pid.slow")
    given = [code.start[k] for k in "qvzp"]
    _, vdot, _, zdot = code["right_hand_side"](0.0, *given)
    assert np.r_[vdot, zdot] == pytest.approx(x(0.0, x.start)[1:])
