"""Small motions of mechanisms with controllers: plant and controller closed by the ``control`` library."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import expm

import flyball as fb
from tests.control.slide import slide

KP, KI, KD, TF = 80.0, 60.0, 12.0, 0.02


def pid(**fields):
    given = {"setpoint": "r", "measured": "A.displacement", "kp": KP, "ki": KI, "kd": KD, "filter": TF}
    return fb.PID("pid", **(given | fields))


@pytest.mark.parametrize("coordinates", ["joint", "absolute"])
def test_closed_loop_of_a_pid(coordinates):
    ct = pytest.importorskip("control")
    m = slide(pid(), r=0.0)
    lin = m.linearize(["r", "drive"], ["A.displacement", "pid.output", "pid"[:3] + ".error"], coordinates=coordinates)
    assert set(lin.states) >= {"pid.integral", "pid.slow"}
    s = ct.tf("s")
    P, C, D = 1 / (s**2 + 2 * s + 10), KP + KI / s, KD * s / (1 + TF * s)
    loop = 1 + P * (C + D)
    w = np.array([0.1, 1.0, 7.0, 60.0])

    def at(G):
        return np.array([complex(ct.evalfr(G, 1j * x)) for x in w])

    assert lin.response(w, "r", "A.displacement") == pytest.approx(at(P * C / loop), rel=1e-9)
    assert lin.response(w, "r", "pid.output") == pytest.approx(at(C / loop), rel=1e-9)
    assert lin.response(w, "r", "pid.error") == pytest.approx(1 - at(P * C / loop), rel=1e-9)
    assert lin.response(w, "drive", "A.displacement") == pytest.approx(at(P / loop), rel=1e-9)
    poles = np.roots(np.polyadd(np.polymul([1, 2, 10], [TF, 1, 0]), np.polymul([KP * TF + KD, KP + KI * TF, KI], [1])))
    assert np.sort_complex(lin.eigenvalues) == pytest.approx(np.sort_complex(poles), rel=1e-9)


def test_motor_driven_pendulum_about_where_it_was_held():
    """The PID holds a pendulum at 0.7 rad against gravity: its integral is not zero there."""
    ct = pytest.importorskip("control")
    m = fb.Mechanism("pendulum", planar=True, gravity=(0, -9.81), parameters={"r": 0.7})
    m.add(fb.Body("rod", mass=2.0, inertia=0.1, position=(0, -0.5)))
    m.add(fb.Revolute("A", "ground", "rod", at=(0, 0)))
    m.add(fb.PID("pid", setpoint="r", measured="A.angle", kp=60, ki=40, kd=20, filter=0.05))
    m.add(fb.Motor("motor", "A", torque="pid"))
    run = m.simulate(60, rtol=1e-10, atol=1e-12)
    assert run["A.angle"][-1] == pytest.approx(0.7, abs=1e-9)
    assert run["pid.integral"][-1] == pytest.approx(2 * 9.81 * 0.5 * np.sin(0.7), abs=1e-6)
    lin = m.linearize(["r"], ["A.angle"], about=run)
    s = ct.tf("s")
    P = 1 / ((0.1 + 2 * 0.25) * s**2 + 2 * 9.81 * 0.5 * np.cos(0.7))
    C, D = 60 + 40 / s, 20 * s / (1 + 0.05 * s)
    G = ct.minreal(P * C / (1 + P * (C + D)), verbose=False)
    w = np.array([0.2, 2.0, 20.0])
    assert lin.response(w) == pytest.approx([complex(ct.evalfr(G, 1j * x)) for x in w], rel=1e-7)
    assert lin.point["pid.integral"][0] == run["pid.integral"][-1]
    # the motion after a small step of the set point is that of the linear model
    t = np.linspace(0, 2, 9)
    after = m.simulate(62, outputs=60 + t, start=run, parameters={"r": 0.7 + 1e-4}, rtol=1e-11, atol=1e-14)
    y = ct.step_response(lin.to_control(), t)[1]
    assert after["A.angle"] - 0.7 == pytest.approx(1e-4 * y, abs=2e-8)


def test_gains_of_states_of_the_plant():
    """A state feedback without states of its own: the eigenvalues that it was placed for."""
    ct = pytest.importorskip("control")
    plant = slide(fb.Lag("idle", of="0", time=0.25), force="0.0*idle").linearize(["drive"])
    assert np.sort_complex(plant.eigenvalues) == pytest.approx([-4, -1 - 3j, -1 + 3j], abs=1e-9)
    K = ct.place([[0, 1], [-10, -2]], [[0], [1]], [-4, -5])
    m = slide(fb.StateSpace("K", inputs=["A.displacement", "A.displacement_rate"], D=-K), force="K")
    assert np.sort(m.linearize().eigenvalues.real) == pytest.approx([-5, -4], rel=1e-9)
    assert pytest.approx(-K, rel=1e-9) == m.linearize(outputs=["K.output"]).C


def test_weight_does_not_act_on_controllers():
    m = fb.Mechanism("falling", planar=True, gravity=("g", 0), parameters={"g": 3.0})
    m.add(fb.Body("cart", mass=1.0, inertia=1.0))
    m.add(fb.Prismatic("A", "ground", "cart", at=(0, 0), axis=(1, 0)))
    m.add(fb.CoordinateSpring("spring", coordinate="A.displacement", stiffness=100, rest=-0.03))
    m.add(fb.Lag("lag", of="A.displacement_rate", time=0.2))
    m.add(fb.Actuator("drive", coordinate="A.displacement", force="-5*lag"))
    lin = m.linearize(["g"], ["A.displacement"])
    assert lin.states[-1] == "lag.value"
    assert lin.B[-1] == pytest.approx([0.0], abs=1e-12)
    assert lin.response([0.0])[0] == pytest.approx(0.01, rel=1e-9)


def test_what_is_not_at_rest_is_refused():
    m = slide(fb.Integrator("sum", of="1"), force="0.0*sum")
    with pytest.raises(fb.AnalysisError, match="sum"):
        m.linearize()


def test_equilibrium_has_what_the_integral_must_carry():
    """The PID holds the pendulum at its set point; the integral is the weight's torque. Without enough damping it sways."""
    m = fb.Mechanism("pendulum", planar=True, gravity=(0, -9.81), parameters={"r": 0.7, "kd": 20.0})
    m.add(fb.Body("rod", mass=2.0, inertia=0.1, position=(0, -0.5)))
    m.add(fb.Revolute("A", "ground", "rod", at=(0, 0)))
    m.add(fb.PID("pid", setpoint="r", measured="A.angle", kp=60, ki=40, kd="kd", filter=0.05))
    m.add(fb.Motor("motor", "A", torque="pid"))
    e = m.equilibrium()
    assert e["A.angle"] == pytest.approx(0.7, abs=1e-9)
    assert e["pid.integral"] == pytest.approx(2 * 9.81 * 0.5 * np.sin(0.7), abs=1e-7)
    assert e["motor.torque"] == pytest.approx(2 * 9.81 * 0.5 * np.sin(0.7), abs=1e-7)
    assert e.stability == "stable"
    lin = m.linearize(["r"], ["A.angle"], about=e)
    assert lin.response([0.0])[0] == pytest.approx(1.0, rel=1e-9)
    assert lin.eigenvalues.real.max() < 0
    assert (
        m.equilibrium(parameters={"kd": 0.0}).stability == "unstable"
    )  # ki/kp beyond the damping: third-order flutter
    rest = m.simulate(1, start=e.result, rtol=1e-9)
    assert np.abs(rest["A.angle"] - 0.7).max() < 1e-9


def test_sensitivity_of_a_motion_is_that_of_the_exponential():
    """Of a PID's gain, of what its integral begins with, and of a lag's time: by complex steps of the exact solution."""
    m = slide(
        fb.PID("pid", setpoint="1", measured="A.displacement", kp="kp", ki=60, kd=12, filter="tf", initial="i0 + 1"),
        kp=80.0,
        tf=0.02,
        i0=0.5,
    )
    of, to = ["A.displacement", "pid.output", "pid.integral"], ["kp", "tf", "i0"]
    s = m.sensitivity(of, to, analysis="motion", t_end=0.4, outputs=5)

    def exact(kp, tf, i0):
        # (x, v, I, slow, 1)
        u = np.array([-kp - 12 / tf, 0, 1, -12 / tf, kp], complex)
        A = np.array(
            [[0, 1, 0, 0, 0], [-10, -2, 0, 0, 0], [-60, 0, 0, 0, 60], [-1 / tf, 0, 0, -1 / tf, 0], [0] * 5], complex
        )
        A[1] += u
        y = np.array([expm(A * t) @ np.array([0, 0, i0 + 1, 0, 1], complex) for t in s.t])
        return np.stack([y[:, 0], y @ u, y[:, 2]], axis=1)

    at = np.array([80.0, 0.02, 0.5])
    for k, name in enumerate(to):
        step = 1e-20 * at[k]
        d = exact(*(at + 1j * step * (np.arange(3) == k))).imag / step
        for i, what in enumerate(of):
            assert s[what, name] == pytest.approx(d[:, i], rel=1e-6, abs=1e-6 * np.abs(d[:, i]).max())
    assert s.values[:, 1] == pytest.approx(exact(*at)[:, 1].real, rel=1e-7, abs=1e-7)


def test_modes_are_those_of_the_closed_loop():
    """Two masses on slides, a spring between them, a PD with a lag: eigenvalues of the linear model, shapes of bodies."""
    m = fb.Mechanism("two", planar=True)
    for n in "ab":
        m.add(fb.Body(n, mass=1.0, inertia=1.0), fb.Prismatic(n.upper(), "ground", n, at=(0, 0), axis=(1, 0)))
    m.add(fb.CoordinateSpring("weak", "A.displacement", stiffness=10))
    m.add(fb.Sensor("a_at", "A.displacement"), fb.Sensor("b_at", "B.displacement"))
    m.add(fb.Lag("slow", of="B.displacement", time=0.1))
    m.add(fb.Actuator("left", coordinate="A.displacement", force="50*(b_at - a_at) - 20*slow"))
    m.add(fb.Actuator("right", coordinate="B.displacement", force="50*(a_at - b_at)"))
    found = m.modes()
    A = np.zeros((5, 5))  # a, b, a', b', slow
    A[:2, 2:4] = np.eye(2)
    A[2], A[3], A[4] = (-60, 50, 0, 0, -20), (50, -50, 0, 0, 0), (0, 10, 0, 0, -10)
    w, v = np.linalg.eig(A)
    assert found.eigenvalues == pytest.approx(sorted(w[w.imag >= 0], key=abs), rel=1e-9)
    assert m.linearize().eigenvalues.size == 5
    assert all(name.startswith(("A.", "B.")) for name in found.names)
    for k, one in enumerate(found.eigenvalues):
        exact = v[:2, np.argmin(np.abs(w - one))]
        ratio = found.shapes[:, k] / exact
        assert ratio == pytest.approx([ratio[0]] * 2, rel=1e-7)
    with pytest.raises(fb.ModelError, match="PID 'pid', sampled, and modes is about continuous time"):
        slide(pid(period=0.01), r=0.0).modes()


def test_modes_in_a_study_are_those_of_the_closed_loop_where_it_rests():
    """Its characteristic polynomial s (s^2 + 2 s + 10 + kp) + ki with a stiffness that grows by 3 c x^2."""
    m = slide(
        fb.PID("pid", setpoint="r", measured="A.displacement", kp="kp", ki=20), force="pid - 40*value**3", kp=1.0, r=0.5
    )
    of = ["frequency[0]", "omega[1]", "stable"]
    found = m.study({"kp": [1.0, 30.0, 90.0]}, of, analysis="modes", about="equilibrium")
    for k, kp in enumerate((1.0, 30.0, 90.0)):
        roots = np.roots([1, 2, 10 + kp + 3 * 40 * 0.5**2, 20])
        slow, fast = sorted(roots[roots.imag >= 0], key=abs)
        one = m.modes(about=m.equilibrium(parameters={"kp": kp}), parameters={"kp": kp})
        assert one.eigenvalues == pytest.approx([slow, fast], rel=1e-6)
        assert np.asarray(found["omega[1]"])[k] == pytest.approx(one.omega[1], rel=1e-9)
        assert np.asarray(found["omega[1]"])[k] == pytest.approx(abs(fast), rel=1e-6)
        assert np.asarray(found["frequency[0]"])[k] == pytest.approx(one.frequency[0], rel=1e-9)
        assert np.asarray(found["stable"])[k] == 1.0
    with pytest.raises(fb.ModelError, match="PID 'pid', sampled, and modes is about continuous time"):
        slide(pid(period=0.01), r=0.0).study({"r": [0.0, 1.0]}, of, analysis="modes")


def test_the_descriptor_form_says_the_same():
    m = slide(pid(), fb.Lag("act", of="pid", time=0.05), force="act", r=0.0)
    lin = m.linearize(["r", "drive"], ["A.displacement", "pid", "act.value", "drive.force"])
    w = np.array([0.3, 3.0, 30.0])
    for i, into in enumerate(lin.inputs):
        for k, out in enumerate(lin.outputs):
            assert lin.descriptor.response(w, i, k) == pytest.approx(lin.response(w, into, out), rel=1e-10, abs=1e-12)


def test_a_steady_rotation_that_a_pi_keeps():
    """The same eigenvalues in both layers; the angle of the rotation itself is a zero."""
    m = fb.Mechanism("spin", gravity=(0, 0, -9.81))
    m.add(
        fb.Body("base", mass=3, inertia=(0.1, 0.1, 0.2)),
        fb.Body("rod", mass=1, inertia=(0.05, 0.05, 0.01), position=(0.3, 0, -0.3)),
    )
    m.add(fb.Revolute("A", "ground", "base", at=(0, 0, 0), axis=(0, 0, 1)))
    m.add(
        fb.Revolute("B", "base", "rod", at=(0, 0, 0), axis=(0, 1, 0)), fb.TorsionalSpringDamper("d", "B", damping=2.0)
    )
    m.add(fb.PID("pid", setpoint="6", measured="A.angle_rate", kp=5, ki=9), fb.Motor("motor", "A", torque="pid"))
    run = m.simulate(60, outputs=2, rtol=1e-11, atol=1e-12)
    both = [m.linearize(about=run, coordinates=layer) for layer in ("absolute", "joint")]
    assert both[0].eigenvalues == pytest.approx(both[1].eigenvalues, rel=1e-9, abs=1e-9)
    assert both[0].turning == pytest.approx([0, 0, 6], rel=1e-9)
    assert both[0].eigenvalues[0] == 0.0
    assert m.modes(about=run, coordinates="absolute").stable
