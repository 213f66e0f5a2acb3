"""How eigenvalues of closed loops change with gains, masses and set points: by their characteristic polynomials."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import expm

import flyball as fb
from tests.control.slide import pendulum, slide


def by_polynomial(p, dp, w):
    """How the root w of p changes where the coefficients change by dp."""
    return -np.polyval(dp, w) / np.polyval(np.polyder(p), w)


def test_gains_of_a_pi():
    """s^3 + 2 s^2 + (10 + kp) s + ki."""
    m = slide(fb.PID("pid", setpoint="0", measured="A.displacement", kp="kp", ki="ki"), kp=5.0, ki=20.0)
    s = m.sensitivity(to=["kp", "ki"], analysis="modes", verify=True)
    p = [1, 2, 15, 20]
    assert np.sort_complex(s.values[0]) == pytest.approx(np.sort_complex(np.roots(p)), rel=1e-9)
    for w, row in zip(s.values[0], s.derivatives[0], strict=True):
        assert row == pytest.approx([by_polynomial(p, dp, w) for dp in ([1, 0], [1])], rel=1e-8)
    assert s.verification == pytest.approx(s.derivatives, rel=1e-5)
    assert s.units == ("1/s",) * 3


def test_about_where_it_rests():
    """A pendulum held at r: the set point turns the weight's stiffness, w cos(r)."""
    s = pendulum(40).sensitivity(to=["r"], analysis="modes", about="equilibrium")
    k, lag = 60 + 9.81 * np.cos(0.7), [0.05, 1]
    p = np.polyadd(np.polymul(lag, [0.6, 0, k, 40]), [20, 0, 0])
    dp = -9.81 * np.sin(0.7) * np.polymul(lag, [1, 0])
    assert np.sort_complex(s.values[0]) == pytest.approx(np.sort_complex(np.roots(p)), rel=1e-8)
    assert s.derivatives[0, :, 0] == pytest.approx([by_polynomial(p, dp, w) for w in s.values[0]], rel=1e-6)


def test_multipliers_of_a_sampled_gain():
    """u_k = -k x_k over 0.1 s: of expm(A T) - k b [1 0], by dz = y^T db x / y^T x, exactly."""
    m = slide(fb.PID("pid", setpoint="0", measured="A.displacement", kp="k", period=0.1), k=30.0)
    s = m.sensitivity(to=["k"], analysis="modes")
    E = expm(0.1 * np.array([[0, 1, 0], [-10, -2, 1], [0, 0, 0.0]]))
    b = E[:2, 2:] @ [[1, 0]]
    w, x = np.linalg.eig(E[:2, :2] - 30 * b)
    y = np.linalg.inv(x)
    exact = dict(zip(w.tolist(), np.diag(y @ -b @ x).tolist(), strict=True))
    assert s.units == ("", "")
    for z, dz in zip(s.values[0], s.derivatives[0, :, 0], strict=True):
        near = min(exact, key=lambda k: abs(k - z))
        assert z == pytest.approx(near, rel=1e-9)
        assert dz == pytest.approx(exact[near], rel=1e-8)


def test_gains_are_found_that_place_poles():
    """The PI for which s^3 + 2 s^2 + (10 + kp) s + ki has given roots."""
    wanted = np.roots([1, 2, 15, 20])
    wanted = wanted[np.lexsort((wanted.imag, np.abs(wanted)))]
    m = slide(fb.PID("pid", setpoint="0", measured="A.displacement", kp="kp", ki="ki"), kp=4.0, ki=15.0)
    best = m.optimize([], ["kp", "ki"], target=wanted, analysis="modes", progress=False)
    assert best.parameters == pytest.approx({"kp": 5.0, "ki": 20.0}, rel=1e-6)


def test_of_a_loop_at_its_equilibrium():
    """A four-bar linkage: other coordinates may be as independent at another value of the gain."""
    m = fb.Mechanism("fourbar", planar=True, gravity=(0, -9.81), parameters={"r": 0.1, "kp": 40.0})
    for name, x, y in (("a", 0, 0.5), ("b", 1, 1), ("c", 2, 0.5)):
        m.add(fb.Body(name, mass=1, inertia=0.1, position=(x, y)))
    m.add(fb.Revolute("A", "ground", "a", at=(0, 0)), fb.Revolute("B", "a", "b", at=(0, 1)))
    m.add(fb.Revolute("C", "b", "c", at=(2, 1)), fb.Revolute("D", "c", "ground", at=(2, 0)))
    m.add(fb.TorsionalSpringDamper("spring", "A", stiffness=5, damping=0.4))
    m.add(fb.PID("pid", setpoint="r", measured="A.angle", kp="kp", ki=20, kd=5, filter=0.05))
    m.add(fb.Lag("lag", of="pid", time=0.02), fb.Motor("motor", "A", torque="lag"))
    s = m.sensitivity(to=["r", "kp"], analysis="modes", about="equilibrium", verify=True)
    assert s.verification == pytest.approx(s.derivatives, rel=1e-5, abs=1e-6)
