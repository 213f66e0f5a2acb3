"""Springs that begin at zero length, limits with equal ends, springs in series with friction: closed forms."""

import numpy as np
import pytest

import flyball as fb

G = 9.81
M, K = 2.0, 100.0
OMEGA = np.sqrt(K / M)


def hanging(velocity=(0, 0), **spring):
    m = fb.Mechanism("hanging", planar=True, gravity=(0, -G))
    m.add(fb.Body("b", mass=M, inertia=0.1, velocity=velocity))
    m.add(fb.SpringDamper("s", "ground", "b", at=((0, 0), (0, 0)), **({"stiffness": K} | spring)))
    return m


@pytest.mark.parametrize("method", ["auto", "radau"])
@pytest.mark.parametrize("spring", [{}, {"length": 0}, {"force": "10*length", "stiffness": K - 10}])
def test_from_zero_length(method, spring):
    r = hanging(**spring).simulate(1.0, outputs=11, method=method, rtol=1e-9)
    assert r["b.y"] == pytest.approx(G / OMEGA**2 * (np.cos(OMEGA * r.t) - 1), abs=1e-7)


def test_a_free_length_and_a_velocity_that_moves_the_points_apart():
    """The spring pushes in the direction of the velocity: y = l0 + g-free oscillation from (0, v)."""
    m = hanging(velocity=(0, 0.5), length=0.3)
    m.gravity = (0, 0)
    r = m.simulate(0.4, outputs=9, rtol=1e-10)
    exact = 0.3 * (1 - np.cos(OMEGA * r.t)) + 0.5 / OMEGA * np.sin(OMEGA * r.t)
    assert r["b.y"] == pytest.approx(exact, abs=1e-8)
    with pytest.raises(fb.SimulationError, match=r"coincide at rest, where a force .* has no direction"):
        hanging(length=0.3).simulate(0.1)


def test_a_force_that_grows_from_zero():
    """A tension 5 t: the point falls first, and the tension is upwards; M y'' = -M g + 5 t."""
    r = hanging(stiffness=0.0, force="5*t").simulate(1.0, outputs=6, rtol=1e-9)
    assert r["b.y"] == pytest.approx(-G * r.t**2 / 2 + 5 * r.t**3 / (6 * M), abs=1e-6)


@pytest.mark.parametrize("coordinates", ["absolute", "joint"])
def test_equal_ends_lock(coordinates):
    """The force of the limit is what holds the rod, in both directions, without an event."""
    m = fb.Mechanism("rod", planar=True, gravity=(0, -G))
    m.add(fb.Body("rod", mass=2.0, inertia=0.1, position=(0.5, 0)), fb.Revolute("A", "ground", "rod", at=(0, 0)))
    m.add(fb.Limit("lock", "A.angle", lower="0 deg", upper=0), fb.PointTorque("T", "rod", torque="20*sin(5*t)"))
    r = m.simulate(2.0, outputs=21, coordinates=coordinates)
    assert r["A.angle"] == pytest.approx(np.zeros(21), abs=1e-12)
    assert r["lock.force"] == pytest.approx(2.0 * G * 0.5 - 20 * np.sin(5 * r.t), abs=1e-9)
    assert len(r.events) == 0


def cyclic(rate):
    m = fb.Mechanism("hinge", planar=True)
    m.add(fb.Body("arm", mass=2.0, inertia=0.1), fb.Revolute("A", "ground", "arm", at=(0, 0)))
    m.add(fb.Driver("drive", "A.angle", "0.2*sin(3*t)"))
    m.add(fb.State("bent", rate=rate), fb.Actuator("hinge", "A.angle", force="-100*bent"))
    return m.simulate(2 * 2 * np.pi / 3, outputs=4001, rtol=1e-8)


def test_spring_in_series_with_friction():
    """Jenkins' element: each cycle of amplitude X dissipates 4 F (X - F / k); it is elastic after a reversal."""
    r = cyclic("where(abs(bent) < 5/100 or bent*A.rate < 0, A.rate, 0)")
    x, f, cycle = r["A.angle"], r["hinge.force"], slice(2000, 4001)
    assert np.trapezoid(f[cycle], x[cycle]) == pytest.approx(-4 * 5 * (0.2 - 0.05), rel=1e-4)
    assert [f.min(), f.max()] == pytest.approx([-5, 5], rel=1e-6)
    elastic = (r.t > np.pi / 6) & (x > 0.2 - 0.1)
    elastic &= r.t < np.pi / 2
    assert f[elastic] == pytest.approx(-5 + 100 * (0.2 - x[elastic]), abs=1e-4)


def test_dahl():
    """Without corners: loading from rest, the force is -F (1 - exp(-k x / F))."""
    r = cyclic("A.rate - abs(A.rate)*bent/0.05")
    first = r.t < np.pi / 6
    assert r["hinge.force"][first] == pytest.approx(-5 * (1 - np.exp(-r["A.angle"][first] / 0.05)), abs=1e-5)
