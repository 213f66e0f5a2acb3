"""Forces and torques given in a body's own axes turn with it: thrusters in free flight, against closed forms."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from scipy.special import fresnel

import flyball as fb
from tests.layers import both_layers

pytestmark = both_layers

MASS, SPIN, THRUST = 2.0, 5.0, 3.0
TURN = Rotation.from_rotvec([0.4, -0.7, 0.3])


def cycloid(t):
    """Way of a body that spins and is pushed along its own x axis, through its mass centre: x and y."""
    k = THRUST / (MASS * SPIN**2)
    return k * np.column_stack([1 - np.cos(SPIN * t), SPIN * t - np.sin(SPIN * t)])


def test_thrust_that_turns_with_the_body():
    """m a = F (cos w t, sin w t): a cycloid (closed form); given in world axes, the parabola."""
    for axes in ("body", "world"):
        m = fb.Mechanism("puck", planar=True)
        m.add(fb.Body("puck", mass=MASS, inertia=0.3, angular_velocity=SPIN))
        m.add(fb.PointForce("thrust", "puck", force=(THRUST, 0), axes=axes))
        r = m.simulate(3.0, rtol=1e-11, atol=1e-12, outputs=31)
        parabola = np.column_stack([THRUST / (2 * MASS) * r.t**2, 0 * r.t])
        assert r["puck"].position == pytest.approx(cycloid(r.t) if axes == "body" else parabola, abs=1e-9)
        assert r["puck"].angle == pytest.approx(SPIN * r.t, abs=1e-10)
        assert r.health.energy_drift < 1e-9


def test_thrust_that_turns_with_the_body_in_space():
    """The same in space, for a body that spins about a tilted principal axis."""
    m = fb.Mechanism("satellite")
    spin = TURN.apply([0, 0, SPIN])
    m.add(fb.Body("b", mass=MASS, inertia=(0.1, 0.2, 0.25), orientation=TURN, angular_velocity=spin))
    m.add(fb.PointForce("thrust", "b", force=(THRUST, 0, 0), axes="body"))
    r = m.simulate(3.0, rtol=1e-11, atol=1e-12, outputs=31)
    way = TURN.apply(np.column_stack([cycloid(r.t), 0 * r.t]))
    assert r["b"].position == pytest.approx(way, abs=1e-9)
    assert r["b"].angular_velocity == pytest.approx(np.tile(spin, (31, 1)), abs=1e-9)


def test_thrust_beside_the_mass_centre():
    """A constant moment F h: phi = F h t^2 / 2 J, and velocities that are Fresnel's integrals (closed form)."""
    arm, J = 0.2, 0.3
    m = fb.Mechanism("puck", planar=True)
    m.add(fb.Body("puck", mass=MASS, inertia=J))
    m.add(fb.PointForce("thrust", "puck", force=(THRUST, 0), at=(0.1, -arm), axes="body"))
    r = m.simulate(4.0, rtol=1e-11, atol=1e-12, outputs=41)
    faster = THRUST * arm / J
    assert r["puck"].angle == pytest.approx(faster * r.t**2 / 2, abs=1e-9)
    s, c = fresnel(r.t * np.sqrt(faster / np.pi))
    speed = THRUST / MASS * np.sqrt(np.pi / faster) * np.column_stack([c, s])
    assert r["puck"].velocity == pytest.approx(speed, abs=1e-9)
    assert r["thrust"].work == pytest.approx(r.energy.kinetic, abs=1e-9)


def test_torque_in_body_axes():
    """On a symmetric body that spins at n: A u' = -i (A - C) n u + T for u = w1 + i w2 (Euler's equations)."""
    A, C, T = 0.2, 0.35, 0.15
    m = fb.Mechanism("satellite")
    m.add(fb.Body("b", mass=MASS, inertia=(A, A, C), orientation=TURN, angular_velocity=TURN.apply([0, 0, SPIN])))
    m.add(fb.PointTorque("torque", "b", torque=(T, 0, 0), axes="body"))
    r = m.simulate(4.0, rtol=1e-11, atol=1e-12, outputs=41)
    w = np.einsum("nji,nj->ni", r["b"].rotation, r["b"].angular_velocity)
    rate = (A - C) / A * SPIN
    u = T / A * (1 - np.exp(-1j * rate * r.t)) / (1j * rate)
    assert w == pytest.approx(np.column_stack([u.real, u.imag, np.full(41, SPIN)]), abs=1e-9)
    assert r["torque"].work == pytest.approx(r.energy.kinetic - r.energy.kinetic[0], abs=1e-9)
