"""Bodies that spin: tops and free flight against closed forms and published digits."""

import numpy as np
import pytest
from scipy.special import ellipj, ellipk

import flyball as fb
from tests.layers import both_layers
from tests.mechanisms import example, free_body

pytestmark = both_layers

# the benchmark's published or closed-form values, heavy top of Geradin and Cardona: converged values, MATLAB's published to 5 digits
TOP = {
    0.1: (0.42129666, 0.89457197, -0.14916470),
    0.2: (0.60555056, 0.59895768, -0.52398303),
    1.0: (0.17334396, 0.64008859, -0.74849079),
    2.0: (-0.15041682, -0.72416559, -0.67302227),
}
TURN = (-0.70827915, 0.43878109, 0.54572840, 0.08939975)  # quaternion at 0.2 s
MATLAB = (-0.70828, 0.43878, 0.54573, 0.0894)  # the same as published (Exudyn, TestModels/heavyTop.py)


def body_axes(r, name):
    """Angular velocity in body axes."""
    return np.einsum("nji,nj->ni", r[name].rotation, r[name].angular_velocity)


def momentum(r, name, inertia):
    """Angular momentum about the mass centre, world axes."""
    return np.einsum("nij,nj->ni", r[name].rotation, body_axes(r, name) * inertia)


def test_heavy_top():
    """1e-8 up to 2 s, with the quaternion published at 0.2 s and the energy kept."""
    r = example("heavy_top.toml").simulate(2.0, rtol=1e-11, atol=1e-12, outputs=21)
    for t, exact in TOP.items():
        assert r["top"].position[round(10 * t)] == pytest.approx(exact, abs=1e-8)
    e = r["top"].quaternion[2]
    assert e * np.sign(e[0] * TURN[0]) == pytest.approx(TURN, abs=1e-8)
    assert e * np.sign(e[0] * TURN[0]) == pytest.approx(MATLAB, abs=1e-5)
    assert r.energy.kinetic[0] == pytest.approx(5435.696790866, rel=1e-9)
    assert r.energy.drift < 1e-6
    assert r.health.violation < 1e-12


def top(nutation_rate, spin, tilt=np.pi / 3, A=0.02, C=0.01, mgl=0.981):
    """A top on its tip with moments A about the tip and C about its axis, precessing about the vertical."""
    mass, arm = 1.0, 0.1
    assert mgl == pytest.approx(mass * 9.81 * arm)
    axis = np.array([np.sin(tilt), 0, np.cos(tilt)])
    w = nutation_rate * np.array([0, 0, 1.0]) + (spin - nutation_rate * np.cos(tilt)) * axis
    m = fb.Mechanism("top", gravity=(0, 0, -9.81))
    m.add(
        fb.Body(
            "top",
            mass=mass,
            inertia=(A, A, C),
            inertia_about=(0, 0, -arm),
            position=arm * axis,
            orientation=(0, tilt, 0),
            velocity=np.cross(w, arm * axis),
            angular_velocity=w,
        )
    )
    m.add(fb.Spherical("tip", "ground", "top", at=(0, 0, 0)))
    return m


@pytest.mark.parametrize("rate", [1.682161099406, 58.317838900594])
def test_steady_precession(rate):
    """A cos(tilt) W^2 - C n W + m g l = 0: slow and fast precession keep the tilt (A .02, C .01, mgl .981, n 60)."""
    assert 0.02 * 0.5 * rate**2 - 0.01 * 60 * rate + 0.981 == pytest.approx(0, abs=1e-9)
    r = top(rate, 60.0).simulate(2.0, rtol=1e-12, atol=1e-13, outputs=401)
    p = r["top"].position / 0.1
    turned = np.unwrap(np.arctan2(p[:, 1], p[:, 0]))
    assert turned[-1] / 2.0 == pytest.approx(rate, abs=2e-8)
    assert p[:, 2] == pytest.approx(np.full(401, 0.5), abs=1e-8)
    exact = np.sin(np.pi / 3) * np.stack([np.cos(rate * r.t), np.sin(rate * r.t)], axis=1)
    assert p[:, :2] == pytest.approx(exact, abs=1e-7)


@pytest.mark.parametrize(("part", "sleeps"), [(1.05, True), (0.95, False)])
def test_sleeping_top(part, sleeps):
    """Upright it sleeps above n = 2 sqrt(A m g l) / C = 28.014 rad/s, and falls below (closed form)."""
    r = top(0.0, part * 28.014282071829, tilt=1e-4).simulate(6.0, rtol=1e-9)
    tilt = np.arccos(np.clip(10 * r["top"].position[:, 2], -1, 1))
    assert (tilt.max() < 1e-3) == sleeps
    assert sleeps or tilt.max() > 0.1


def growth(spin, tilt=1e-6):
    """Square of the rate at which a small tilt of the upright top grows; negative where it only swings to and fro.

    Of the tilt z = x + i y linear theory gives A z'' - i C n z' - m g l z = 0, so that three values at even distances
    h follow z3 = p z2 + q z1 with p = 2 cosh(s h) e^(i C n h / 2 A), q = -e^(i C n h / A).
    """
    r = top(0.0, spin, tilt=tilt).simulate(1.2, rtol=1e-12, atol=1e-15, outputs=61)
    z = (r["top"].position[:, 0] + 1j * r["top"].position[:, 1]) / 0.1
    p, q = np.linalg.lstsq(np.stack([z[1:-1], z[:-2]], axis=1), z[2:], rcond=None)[0]
    return ((np.arccosh(p / (2 * np.sqrt(-q))) / r.t[1]) ** 2).real


def test_sleeping_top_threshold():
    """The spin at which growth turns into swinging, from a run on either side: n = 2 sqrt(A m g l) / C (closed form).

    The square of the rate, m g l / A - (C n / 2 A)^2, is a straight line over n^2.
    """
    critical = 28.014282071829
    below, above = 0.99 * critical, 1.01 * critical
    a, b = growth(below), growth(above)
    assert a == pytest.approx(0.981 / 0.02 - (0.01 * below / 0.04) ** 2, abs=1e-6)
    assert b == pytest.approx(0.981 / 0.02 - (0.01 * above / 0.04) ** 2, abs=1e-6)
    assert a > 0 > b
    found = np.sqrt(below**2 + (above**2 - below**2) * a / (a - b))
    assert found == pytest.approx(critical, abs=1e-7)


def test_free_body_has_its_period():
    """Jacobi's period 6.288431135196408 s for I = 1, 2, 3 and w = .1, 0, 1: it is back after one, two and eight."""
    T = 6.288431135196408
    r = free_body().simulate(8 * T, rtol=1e-13, atol=1e-14, outputs=[T / 2, T, 2 * T, 8 * T])
    w = body_axes(r, "b")
    assert w[0] == pytest.approx([-0.1, 0, 1], abs=1e-10)
    assert w[1:] == pytest.approx(np.tile([0.1, 0, 1], (3, 1)), abs=1e-10)


def test_free_body_for_a_thousand_seconds():
    """Energy and angular momentum to 1e-9 over 1000 s; the digits at 50 s (I = 1, 2, 3; w = .1, 0, 1)."""
    inertia = np.array([1.0, 2, 3])
    r = free_body(velocity=(1, 2, 3)).simulate(1000.0, rtol=1e-12, atol=1e-13, outputs=201)
    w = body_axes(r, "b")
    assert w[10] == pytest.approx((0.09531134, -0.03026132, 0.99984736), abs=1e-8)
    assert r.energy.kinetic == pytest.approx(np.full(201, r.energy.kinetic[0]), rel=1e-9)
    h = momentum(r, "b", inertia)
    assert h == pytest.approx(np.tile([0.1, 0, 3], (201, 1)), abs=3e-9)
    assert r["b"].position == pytest.approx(np.outer(r.t, [1, 2, 3]), rel=1e-9)
    assert w == pytest.approx(jacobi(r.t), abs=1e-7)


def jacobi(t):
    """Euler's free body with I = (1, 2, 3), w0 = (.1, 0, 1), by Jacobi's functions (Landau and Lifshitz, section 37)."""
    I1, I2, I3 = 1.0, 2.0, 3.0
    E2, M2 = 3.01, 0.01 + 9.0  # 2 E and M^2 > 2 E I2
    p = np.sqrt((I3 - I2) * (M2 - E2 * I1) / (I1 * I2 * I3))
    k2 = (I2 - I1) * (E2 * I3 - M2) / ((I3 - I2) * (M2 - E2 * I1))
    assert 4 * ellipk(k2) / p == pytest.approx(6.288431135196408, rel=1e-12)
    sn, cn, dn, _ = ellipj(p * np.asarray(t), k2)
    a = np.sqrt((E2 * I3 - M2) / (I1 * (I3 - I1)))
    b = np.sqrt((E2 * I3 - M2) / (I2 * (I3 - I2)))
    c = np.sqrt((M2 - E2 * I1) / (I3 * (I3 - I1)))
    return np.stack([a * cn, b * sn, c * dn], axis=1)


def test_middle_axis_is_unstable():
    """A small turn beside the middle axis grows at sqrt((I2-I1)(I3-I2)/(I1 I3)) = .57735 /s (closed form)."""
    e = 1e-6
    r = free_body(w=(e, 1.0, -e / np.sqrt(3))).simulate(5.0, rtol=1e-13, atol=1e-16, outputs=[0.0, 5.0])
    w1 = body_axes(r, "b")[:, 0]
    assert np.log(w1[1] / w1[0]) / 5 == pytest.approx(0.577350269190, abs=1e-9)


def test_t_handle_turns_over_again_and_again():
    """The tumbling T-handle: its long spin axis flips with the period that Jacobi's integrals give."""
    m = example("t_handle.toml")
    start = m.assemble()
    J = start.compiled.values.bodies["handle"].inertia
    I, V = np.linalg.eigh(J)
    w0 = V.T @ np.array([0.01, 10, 0])
    E2, M2 = I @ w0**2, I**2 @ w0**2
    a, b, c = I if E2 * I[1] < M2 else I[::-1]
    p = np.sqrt((c - b) * (M2 - E2 * a) / (a * b * c))
    k2 = (b - a) * (E2 * c - M2) / ((c - b) * (M2 - E2 * a))
    half = 2 * ellipk(k2) / p  # from one turning over to the next
    r = m.simulate(6 * half, rtol=1e-11, atol=1e-12, outputs=3001)
    w = np.einsum("nji,nj->ni", r["handle"].rotation @ V, r["handle"].angular_velocity)
    flips = np.flatnonzero(np.diff(np.sign(w[:, 1])))
    assert len(flips) == 6
    f = w[:, 1]
    zero = r.t[flips] - f[flips] * (r.t[flips + 1] - r.t[flips]) / (f[flips + 1] - f[flips])
    assert np.diff(zero) == pytest.approx(np.full(5, half), rel=1e-4)
    h = np.einsum("nij,nj->ni", r["handle"].rotation, body_axes(r, "handle") @ J)
    assert h == pytest.approx(np.tile(h[0], (3001, 1)), abs=1e-9 * np.linalg.norm(h[0]))
    assert r.energy.drift < 1e-9 * r.energy.kinetic[0]
