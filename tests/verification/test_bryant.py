"""The same motions in Bryant angles: an independent formulation, integrated by SciPy, against the quaternions of flyball.

The equations stand here, explicitly: eta are the angles about x, the new y and the newer z, w = H(eta) etadot is the
angular velocity in body axes, I wdot = torque - w x I w, and etaddot = H^-1 (wdot - Hdot etadot).
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import flyball as fb
from flyball import rotations
from tests.layers import both_layers

pytestmark = both_layers

G = np.array([0.0, 0.0, -9.81])
TIGHT = {"rtol": 1e-12, "atol": 1e-13}


def bryant_motion(eta, w, inertia, torque, times):
    """Angles and body angular velocities over time from explicit second-order equations in Bryant angles."""

    inverse = np.linalg.inv(inertia)

    def right_hand_side(t, y):
        eta, rates = y[:3], y[3:]
        w = rotations.euler_angular_velocity(eta, rates)
        R = rotations.matrix(rotations.from_bryant(eta))
        alpha = inverse @ (torque(R) - np.cross(w, inertia @ w))
        return np.r_[rates, rotations.euler_accelerations(eta, rates, alpha)]

    start = np.r_[eta, rotations.euler_rates(eta, w)]
    y = solve_ivp(right_hand_side, (times[0], times[-1]), start, "DOP853", t_eval=times, **TIGHT).y.T
    return y[:, :3], rotations.euler_angular_velocity(y[:, :3], y[:, 3:])


def same_motion(result, name, eta, w):
    """Orientation, as matrices and as angles, and angular velocity, in body axes and in the world's, agree to 1e-8."""
    body = result[name]
    R = rotations.matrix(rotations.from_bryant(eta))
    assert np.abs(eta[:, 1]).max() < 1.3  # Bryant angles are singular at pi/2
    assert body.rotation == pytest.approx(R, abs=1e-8)
    assert rotations.bryant(body.quaternion, continuous=True) == pytest.approx(eta, abs=1e-8)
    assert body.angular_velocity == pytest.approx(rotations.apply(R, w), abs=1e-8 * np.abs(w).max())
    assert rotations.apply(rotations.inverse(body.quaternion), body.angular_velocity) == pytest.approx(
        w, abs=1e-8 * np.abs(w).max()
    )


def test_fast_asymmetric_top():
    """Three different principal moments, the mass centre off the axes of inertia, 80 rad/s, 2 s."""
    mass, arm = 2.0, np.array([0.01, -0.015, 0.08])  # from the pivot to the mass centre, body axes
    central = np.diag([0.012, 0.017, 0.009])
    eta, w = np.array([0.35, -0.2, 0.6]), np.array([0.5, -1.0, 80.0])
    about_pivot = central + mass * (arm @ arm * np.eye(3) - np.outer(arm, arm))
    times = np.linspace(0, 2, 201)
    angles, velocity = bryant_motion(eta, w, about_pivot, lambda R: np.cross(arm, R.T @ (mass * G)), times)

    R = rotations.matrix(rotations.from_bryant(eta))
    m = fb.Mechanism("asymmetric top", gravity=G)
    m.add(
        fb.Body(
            "top",
            mass=mass,
            inertia=tuple(np.diag(central)),
            position=R @ arm,
            orientation=tuple(eta),
            velocity=R @ np.cross(w, arm),
            angular_velocity=R @ w,
        )
    )
    m.add(fb.Spherical("pivot", "ground", "top", at=(0, 0, 0)))
    r = m.simulate(2.0, outputs=times, **TIGHT)
    assert np.ptp(angles[:, 2]) > 40 * np.pi  # it spins
    assert np.ptp(angles[:, 0]) > 0.5  # and precesses
    same_motion(r, "top", angles, velocity)
    p = rotations.apply(r["top"].quaternion, arm)
    assert r["top"].position == pytest.approx(p, abs=1e-11)


def test_free_asymmetric_body():
    """No torque: it nods about the axis of its largest moment for 5 s, its angular momentum stays."""
    inertia = np.diag([0.6, 1.1, 1.4])
    eta, w = np.array([-0.4, 0.3, 0.2]), np.array([0.9, -0.6, 6.0])
    times = np.linspace(0, 5, 251)
    angles, velocity = bryant_motion(eta, w, inertia, lambda R: np.zeros(3), times)

    m = fb.Mechanism("free body")
    R = rotations.matrix(rotations.from_bryant(eta))
    m.add(fb.Body("b", mass=3.0, inertia=tuple(np.diag(inertia)), orientation=tuple(eta), angular_velocity=R @ w))
    r = m.simulate(5.0, outputs=times, **TIGHT)
    same_motion(r, "b", angles, velocity)
    momentum = rotations.apply(rotations.from_bryant(angles), velocity @ inertia)
    assert momentum == pytest.approx(np.tile(R @ inertia @ w, (251, 1)), abs=1e-9)
