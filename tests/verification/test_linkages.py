"""Linkages against closed forms and independent solutions of their loop equations."""

import numpy as np
import pytest
from scipy.optimize import brentq

import flyball as fb
from tests.layers import both_layers, cached
from tests.mechanisms import G, bricard, example, spatial_four_bar

pytestmark = both_layers

R, L = 0.2, 0.5  # crank and rod of the example slider-crank
SPEED = 95.5 * 2 * np.pi / 60


@cached
def slider_crank():
    return example("slider_crank.toml").simulate(2.0, rtol=1e-10, atol=1e-12, outputs=401)


def kinetic_and_potential(a):
    """Energies of the slider-crank at crank angle a and constant speed, spring included; a may be complex."""
    w = SPEED
    s, c = np.sin(a), np.cos(a)
    sb = -R / L * s  # sine of the rod's angle
    cb = np.sqrt(1 - sb * sb)
    b1 = -R / L * c * w / cb
    x1 = -R * w * s - L * b1 * sb
    u, v = -R * w * s - L / 2 * b1 * sb, R * w * c + L / 2 * b1 * cb
    x = R * c + L * cb
    T = 0.5 * (R**2 / 12 + R**2 / 4) * w**2 + 0.75 * (u * u + v * v) + 0.5 * 1.5 * L**2 / 12 * b1**2 + 0.5 * x1 * x1
    V = G * R / 2 * s + 1.5 * G * (R * s + L / 2 * sb) + 100 * (1.2 - x - 0.5) ** 2
    return T, V, x1


def test_slider_crank_position_velocity_acceleration():
    """Driven at constant speed: x = r cos a + sqrt(l^2 - r^2 sin^2 a) and its derivatives (closed form)."""
    r = slider_crank()
    a = SPEED * r.t
    s, c = np.sin(a), np.cos(a)
    root = np.sqrt(L**2 - (R * s) ** 2)
    n = R**2 * s * c / root
    x2 = -R * c - (R**2 * (c * c - s * s)) / root - n * n / root
    assert r["slider.x"] == pytest.approx(R * c + root, abs=1e-12)
    assert r["slider.vx"] == pytest.approx(SPEED * (-R * s - n), abs=1e-10)
    assert r["slider.ax"] == pytest.approx(SPEED**2 * x2, abs=1e-8)
    assert r["A"].angle == pytest.approx(a, abs=1e-12)
    assert r["D"].displacement == pytest.approx(R * c + root - (R + L), abs=1e-12)
    assert r["B"].angle == pytest.approx(-np.arcsin(R / L * s) - a, abs=1e-12)
    assert r.health.freedoms == 0
    assert r.energy.drift < 1e-6


def test_slider_crank_motor_torque():
    """The motor gives what kinetic, potential and spring energy gain and the damper takes (balance of powers)."""
    r = slider_crank()
    a = SPEED * r.t
    T, V, x1 = kinetic_and_potential(a + 1e-30j)
    gain = SPEED * (T + V).imag / 1e-30
    x1 = x1.real
    assert r["motor"].effort == pytest.approx((gain + 1.0 * x1 * x1) / SPEED, abs=1e-8)
    assert r.energy.kinetic == pytest.approx(T.real, abs=1e-10)
    assert r.energy.potential == pytest.approx(V.real, abs=1e-10)


def rocker_angle(a):
    """Rocker of the spatial four-bar at crank angle a: the coupler keeps its length (loop closed by root finding)."""
    joint = np.array([0.2, 0.5, 0.0])
    length2 = (0.05**2 + 0.5**2) + 0.35**2

    def gap(f):
        B = 0.15 * np.array([np.cos(a), np.sin(a), 0])
        C = joint + 0.35 * np.array([0, -np.sin(f), np.cos(f)])
        return (C - B) @ (C - B) - length2

    return brentq(gap, -0.75, 0.75, xtol=1e-15)


def test_spatial_four_bar_closes():
    """Its rocker, over a turn of the driven crank, is that of the loop equation solved by itself."""
    r = spatial_four_bar(driven=True).simulate(2 * np.pi / 12, outputs=61)
    exact = np.array([rocker_angle(12 * t) for t in r.t])
    assert np.ptp(exact) > 0.5
    assert r["D"].angle == pytest.approx(exact, abs=1e-10)
    h = 1e-4
    rates = [12 * (rocker_angle(12 * t + h) - rocker_angle(12 * t - h)) / (2 * h) for t in r.t]
    assert r["D"].rate == pytest.approx(rates, abs=1e-6)
    assert r.health.freedoms == 0
    assert r.health.redundant == ()


def test_spatial_four_bar_runs_free():
    """Undriven it has one freedom, keeps its energy, and its rocker still obeys the loop equation."""
    r = spatial_four_bar().simulate(1.0, rtol=1e-9, outputs=101)
    assert r.health.freedoms == 1
    exact = np.array([rocker_angle(a) for a in r["A"].angle])
    assert r["D"].angle == pytest.approx(exact, abs=1e-9)
    assert r["A"].rate[0] == pytest.approx(12.0, abs=1e-12)
    assert r.energy.drift < 1e-7
    assert r.health.violation < 1e-11


def test_bricard():
    """IFToMM A04: movable although Gruebler counts 0; rank 29 of 30 rows, every hinge part of the redundancy."""
    m = bricard()
    found = m.check()
    assert (found.gruebler, found.freedoms, found.redundancy) == (0, 1, 1)
    assert set(found.redundant) == {f"R{i}" for i in range(1, 7)}
    r = m.simulate(5.0, rtol=1e-9, atol=1e-11, outputs=101)
    assert r.health.violation < 1e-9
    assert r.energy.drift < 1e-6
    assert np.ptp(r["rod 3.x"]) > 0.5  # it moves
    ends = r["rod 1"].position + 0.5 * r["rod 1"].rotation[:, :, 0]
    assert np.linalg.norm(ends, axis=1) == pytest.approx(np.ones(101), abs=1e-9)


def hooke(beta):
    """Two shafts at the angle beta, joined by a universal joint; the first is driven at 3 rad/s."""
    second = np.array([np.cos(beta), np.sin(beta), 0])
    m = fb.Mechanism("Hooke's joint")
    m.add(fb.Body("in", mass=1, inertia=(0.1, 0.2, 0.2), position=(-1, 0, 0)))
    m.add(fb.Body("out", mass=1, inertia=(0.1, 0.2, 0.2), position=second, orientation=(0, 0, beta)))
    m.add(fb.Revolute("A", "ground", "in", at=(-1, 0, 0), axis=(1, 0, 0)))
    m.add(fb.Universal("U", "in", "out", at=(0, 0, 0), axes=((0, 0, 1), (-np.sin(beta), np.cos(beta), 0))))
    m.add(fb.Revolute("B", "ground", "out", at=second, axis=second))
    m.add(fb.Driver("motor", "A.angle", "3*t"))
    return m


def about(axis, a, b):
    """Signed angles about the axes from a to b, row by row."""
    return np.arctan2(np.einsum("ni,ni->n", axis, np.cross(a, b)), np.einsum("ni,ni->n", a, b))


def test_hookes_joint():
    """Closed form with the first yoke's axis normal to the shafts' plane at 0: tan out = cos(beta) tan in."""
    beta = np.radians(35)
    cb = np.cos(beta)
    r = hooke(beta).simulate(8.0, outputs=161)
    a = 3 * r.t
    s, c = np.sin(a), np.cos(a)
    assert r["B"].angle == pytest.approx(np.unwrap(np.arctan2(s * cb, c)), abs=1e-9)
    assert r["B"].angle[-1] > 20  # whole turns are counted
    rate = 3 * cb / (c * c + (cb * s) ** 2)
    assert r["B"].rate == pytest.approx(rate, abs=1e-9)
    acceleration = 3 * cb * 3 * 2 * s * c * (1 - cb * cb) / (c * c + (cb * s) ** 2) ** 2
    assert r["B"].acceleration == pytest.approx(acceleration, abs=1e-8)
    assert r["motor"].effort == pytest.approx(0.1 * acceleration * rate / 3, abs=1e-8)  # power in = power out


def test_universal_joint_angles():
    """Both angles of the cross, from the directions of its axes; their rates from their differences."""
    beta = np.radians(35)
    r = hooke(beta).simulate(2.0, outputs=2001)
    a, o = 3 * r.t, r["B"].angle
    zero, one = 0 * a, 1 + 0 * a
    first = np.stack([zero, -np.sin(a), np.cos(a)], axis=1)
    b, z = np.array([-np.sin(beta), np.cos(beta), 0]), np.array([0.0, 0, 1])
    second = np.outer(np.cos(o), b) + np.outer(np.sin(o), z)
    carried_b = np.stack([b[0] * one, b[1] * np.cos(a), b[1] * np.sin(a)], axis=1)  # b, turning with the first shaft
    carried_z = np.outer(np.cos(o), z) - np.outer(np.sin(o), b)  # z, turning with the second
    u = r["U"]
    assert u.angle_1 == pytest.approx(about(first, carried_b, second), abs=1e-9)
    assert u.angle_2 == pytest.approx(about(second, first, carried_z), abs=1e-9)
    for angle, rate, acceleration in (
        (u.angle_1, u.angle_1_rate, u.angle_1_acceleration),
        (u.angle_2, u.angle_2_rate, u.angle_2_acceleration),
    ):
        h = 2 * (r.t[1] - r.t[0])
        assert rate[1:-1] == pytest.approx((angle[2:] - angle[:-2]) / h, abs=2e-5)
        assert acceleration[1:-1] == pytest.approx((rate[2:] - rate[:-2]) / h, abs=1e-4)


def test_a_driver_follows_its_law_exactly():
    """A crank driven by sin(2 t): angle, rate and acceleration are the law and its two derivatives."""
    m = fb.Mechanism("driven", planar=True, gravity=(0, -G), parameters={"w": 2.0})
    m.add(fb.Body("crank", mass=2.0, inertia=0.1, position=(0.3, 0)), fb.Revolute("A", "ground", "crank", at=(0, 0)))
    m.add(fb.Driver("motor", "A.angle", "sin(w*t)"))
    r = m.simulate(5.0, outputs=101)
    s, c = np.sin(2 * r.t), np.cos(2 * r.t)
    assert r["A"].angle == pytest.approx(s, abs=1e-10)
    assert r["A"].rate == pytest.approx(2 * c, abs=1e-10)
    assert r["A"].acceleration == pytest.approx(-4 * s, abs=1e-10)
    torque = (0.1 + 2 * 0.09) * -4 * s + 2 * G * 0.3 * np.cos(s)
    assert r["motor"].effort == pytest.approx(torque, abs=1e-9)


@pytest.mark.parametrize(
    "law", ["step(t, 0, 0, 1, 0.1)", "step5(t, -0.2, 0, 1, 0.1)", "0.05*(1 - cos(t))**2", "0.1*exp(-t)*sin(3*t)"]
)
def test_driven_slides_follow_their_laws(law):
    """The displacement of a driven slide, against the law evaluated by NumPy and differences of it."""
    m = fb.Mechanism("slide")
    m.add(fb.Body("block", mass=2.0, inertia=(1, 1, 1), position=(0, 0, 1)))
    m.add(fb.Prismatic("P", "ground", "block", at=(0, 0, 0), axis=(1, 2, 2)), fb.Driver("motor", "P.displacement", law))
    r = m.simulate(0.8, outputs=81)

    def f(t):
        def rise(shape):
            return lambda t, t0, a, t1, b: a + (b - a) * shape((t - t0) / (t1 - t0))

        rises = {
            "step": rise(lambda x: x * x * (3 - 2 * x)),
            "step5": rise(lambda x: x**3 * (10 - 15 * x + 6 * x * x)),
        }
        return eval(law, {"cos": np.cos, "sin": np.sin, "exp": np.exp, "t": t, **rises})

    h = 1e-4
    assert r["P"].displacement == pytest.approx(f(r.t), abs=1e-11)
    assert r["P"].rate == pytest.approx((f(r.t + h) - f(r.t - h)) / (2 * h), abs=1e-7)
    second = (f(r.t + h) - 2 * f(r.t) + f(r.t - h)) / h**2
    assert r["motor"].effort == pytest.approx(2.0 * second, abs=1e-6)
    assert r["block"].position == pytest.approx((0, 0, 1) + np.outer(f(r.t), [1 / 3, 2 / 3, 2 / 3]), abs=1e-11)
