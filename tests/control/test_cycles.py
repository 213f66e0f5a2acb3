"""Small motions with sampled controllers, from instant to instant: the ``control`` library's, and the motions themselves."""

from __future__ import annotations

import numpy as np
import pytest

import flyball as fb
from tests.control.slide import TIGHT, slide

T = 0.01
KP, KI, KD, TF = 80.0, 60.0, 12.0, 0.02


def pid(**fields):
    given = {"setpoint": "r", "measured": "A.displacement", "kp": KP, "ki": KI, "kd": KD, "filter": TF, "period": T}
    return fb.PID("pid", **(given | fields))


@pytest.mark.parametrize("coordinates", ["joint", "absolute"])
def test_closed_loop_of_a_sampled_pid(coordinates):
    ct = pytest.importorskip("control")
    lin = slide(pid(), r=0.0).linearize(["r"], ["A.displacement", "pid"], coordinates=coordinates)
    assert lin.period == T
    P = ct.tf(ct.c2d(ct.ss([[0, 1], [-10, -2]], [[0], [1]], [[1, 0]], [[0]]), T))
    z = ct.tf("z")
    z.dt = T
    C, D = KP + KI * T / (z - 1), KD / (TF + T) * (z - 1) / (z - TF / (TF + T))
    w = np.array([0.3, 7.0, 100.0])

    def at(G):
        return np.array([complex(ct.evalfr(G, x)) for x in np.exp(1j * w * T)])

    p, c, d = at(P), at(C), at(D)
    assert lin.response(w, "r", "A.displacement") == pytest.approx(p * c / (1 + p * (c + d)), rel=1e-8)
    assert lin.response(w, "r", "pid") == pytest.approx(c / (1 + p * (c + d)), rel=1e-8)
    poles = np.sort_complex(ct.poles(ct.feedback(P, C + D)))
    found = lin.eigenvalues[np.abs(lin.eigenvalues) > 1e-6]  # the measured value of before is a delay: a pole at zero
    assert np.sort_complex(found) == pytest.approx(poles[np.abs(poles) > 1e-6], rel=1e-6)
    system = lin.to_control()
    assert system.dt == T
    assert np.sort(np.abs(ct.poles(system)))[-1] == pytest.approx(np.abs(found).max(), rel=1e-9)


def several():
    return slide(
        fb.Lag("sensor", of="A.displacement", time=0.03),
        fb.StateSpace("inner", inputs=["outer - sensor"], A=0.3, B=0.5, C=20, D=30, period=0.02),
        fb.PID("outer", setpoint="r", measured="A.displacement", kp=0.4, ki=2, period=0.06),
        fb.StateSpace("late", inputs=["inner"], D=0.1, period=0.02, offset=0.005),
        force="inner + late",
        r=0.0,
    )


def test_several_rates_and_offsets():
    """A linear mechanism: its motion after a step of the input is that of the equations, cycle by cycle."""
    m = several()
    lin = m.linearize(["r"], ["A.displacement", "inner", "sensor"])
    assert lin.period == pytest.approx(0.06, abs=1e-15)
    assert "late.output" in lin.states  # held from the cycle before; what is taken anew at its begin is no state
    assert "inner.output" not in lin.states
    n = 20
    r = m.simulate((n - 0.5) * 0.06, outputs=0.06 * np.arange(n), parameters={"r": 1.0}, **TIGHT)
    x, u = np.zeros(len(lin.states)), np.ones(1)
    for k in range(n):
        y = lin.C @ x + lin.D @ u
        found = [r["A.displacement"][k], r["inner.output"][k], r["sensor.output"][k]]
        assert y == pytest.approx(found, abs=1e-9)
        x = lin.A @ x + lin.B @ u


def pendulum(**fields):
    m = fb.Mechanism("pendulum", planar=True, gravity=(0, -9.81), parameters={"r": 0.7, "k": 60.0})
    m.add(fb.Body("rod", mass=2.0, inertia=0.1, position=(0, -0.5)))
    m.add(fb.Revolute("A", "ground", "rod", at=(0, 0)))
    m.add(fb.PID("pid", setpoint="r", measured="A.angle", kp="k", ki=40, kd=20, filter=0.05, period=0.02, **fields))
    m.add(fb.Motor("motor", "A", torque="pid"))
    return m


def test_equilibrium():
    """The integral is the weight's torque; whether it is stable is told by the multipliers, and by the motion."""
    m = pendulum()
    e = m.equilibrium()
    weight = 2 * 9.81 * 0.5 * np.sin(0.7)
    assert (e["A.angle"], e["pid.integral"]) == pytest.approx((0.7, weight), abs=1e-7)
    assert e.stability == "stable"
    assert np.abs(m.linearize(about=e).eigenvalues).max() < 1
    stiff = {"k": 6000.0}
    e = m.equilibrium(parameters=stiff)
    assert e.stability == "unstable"
    most = np.abs(m.linearize(about=e).eigenvalues).max()
    assert most > 1
    r = m.simulate(1.5, start=e.result, parameters=stiff | {"r": 0.7 + 1e-9}, outputs=[0.0, 0.5, 1.0, 1.5])
    assert np.abs(r["A.angle"][3] - 0.7) > 10 * np.abs(r["A.angle"][1] - 0.7)


def test_what_does_not_rest_from_instant_to_instant():
    with pytest.raises(fb.ModelError, match=r"'pid\.setpoint' is 0, and 0\.01 when it is sampled next"):
        slide(fb.PID("pid", setpoint="0.01", measured="A.displacement", kp=KP, period=T)).linearize()
    m = slide(
        fb.State("a", next="0.5*a", period=0.1), fb.State("b", next="0.5*b", period=0.1 * np.sqrt(2)), force="a + b"
    )
    with pytest.raises(fb.ModelError, match="no common multiple"):
        m.linearize()
