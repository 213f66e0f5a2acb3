"""The rattleback against its own equations in the body's axes, its two modes of rocking, and its reversal."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from tests.layers import both_layers, cached
from tests.mechanisms import G, example

pytestmark = both_layers

A, B, C, DROP = 0.20, 0.03, 0.02, 0.01
ALONG, ACROSS, HEIGHT = A * A / C, B * B / C, C - DROP  # radii of curvature, and of the centre of mass over its foot
INERTIA = np.array([[2e-4, -2e-5, 0], [-2e-5, 1.6e-3, 0], [0, 0, 1.7e-3]])
WHEEL = np.array([0, 0, ALONG - HEIGHT])  # from the centre of mass to the centre of the wheel
AXLE = np.array([0.0, 1, 0])


def cross(a, b):
    """NumPy's takes ten times as long for two vectors, and this is asked a million times."""
    (a1, a2, a3), (b1, b2, b3) = a.tolist(), b.tolist()
    return np.array([a2 * b3 - a3 * b2, a3 * b1 - a1 * b3, a1 * b2 - a2 * b1])


def contact(n, rate):
    """From the centre of mass to the contact for the upward normal n, both in body axes, and the rate of that vector."""
    c, c1 = n @ AXLE, rate @ AXLE
    s = np.sqrt(1 - c * c)
    e = (n - c * AXLE) / s
    e1 = (rate - c1 * AXLE) / s + e * c * c1 / s**2
    return WHEEL - (ALONG - ACROSS) * e - ACROSS * n, -(ALONG - ACROSS) * e1 - ACROSS * rate


def rates(_, y):
    """Of angular velocity w and normal n: with r to the contact, rolling gives v = r x w for the centre of mass.

    J w' + w x J w = r x F and F = m (v' + w x v + g n), m = 1 (Kane and Levinson 1982; Garcia and Hubbard 1988).
    """
    w, n = y[:3], y[3:]
    n1 = cross(n, w)
    r, r1 = contact(n, n1)
    known = cross(r1, w) + cross(w, cross(r, w)) + G * n
    x, y, z = r.tolist()
    X = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])  # X u = r x u
    return np.concatenate([np.linalg.solve(INERTIA - X @ X, cross(r, known) - cross(w, INERTIA @ w)), n1])


@cached
def motion(spin, t_end=8.0):
    chosen = {"spin": spin}
    return example("rattleback.toml").simulate(t_end, rtol=1e-12, atol=1e-14, outputs=161, parameters=chosen)


def axes(r):
    return r["stone"].rotation


@pytest.mark.parametrize("spin", [-5.0, 5.0])
def test_equations_in_body_axes(spin):
    """The same motion from six differential equations in the body's axes, written down for this stone alone."""
    r = motion(spin)
    roll = np.radians(0.5)
    start = np.r_[0, spin * np.sin(roll), spin * np.cos(roll), 0, np.sin(roll), np.cos(roll)]
    y = solve_ivp(rates, (0, 8), start, "DOP853", r.t, rtol=1e-12, atol=1e-14).y.T
    w = np.einsum("nji,nj->ni", axes(r), r["stone"].angular_velocity)
    assert np.abs(y[:, 4]).max() > (0.07 if spin < 0 else 0.009)  # it does rock
    early = r.t < 4  # while the rocking grows, so do errors
    assert w[early] == pytest.approx(y[early, :3], abs=1e-7)
    assert w == pytest.approx(y[:, :3], abs=1e-5)
    assert axes(r)[:, 2] == pytest.approx(y[:, 3:], abs=1e-7)


def test_energy_and_contact():
    """Rolling takes no energy, and the table only ever pushes."""
    r = motion(-5.0)
    assert r.energy.drift < 1e-9
    assert r["table"].force[:, 2].min() > 1.0


def test_modes_of_rocking():
    """At rest it rocks in two modes: (J + m h^2) q'' + m g diag(across - h, along - h) q = 0 about the foot."""
    tilt = 1e-5
    chosen = {"spin": 0.0, "roll": tilt}
    r = example("rattleback.toml").simulate(1.0, rtol=1e-11, atol=1e-15, outputs=201, parameters=chosen)
    inertia = INERTIA[:2, :2] + HEIGHT**2 * np.eye(2)
    stiffness = G * np.diag([ACROSS - HEIGHT, ALONG - HEIGHT])
    squares, modes = np.linalg.eig(np.linalg.solve(inertia, stiffness))
    assert np.sort(np.sqrt(squares)) == pytest.approx([33.83, 107.21], abs=0.01)  # rolling and pitching [rad/s]
    share = np.linalg.solve(modes, [tilt, 0.0])
    q = (modes * share) @ np.cos(np.sqrt(squares)[:, None] * r.t)
    R = axes(r)
    assert np.ptp(q[1]) > 4e-8  # the pitch comes from the skewed axes alone
    assert R[:, 2, 1] == pytest.approx(q[0], abs=1e-10)
    assert -R[:, 2, 0] == pytest.approx(q[1], abs=1e-10)


def test_it_turns_back():
    """Spun clockwise it rattles and has turned back within 7 s; spun the other way it still spins on after 8 s.

    Without friction the other sense reverses too, much later, through the slow rolling mode (Garcia and Hubbard 1988).
    """
    wrong, right = motion(-5.0)["stone.omega_z"], motion(5.0, 40.0)
    assert wrong[0] == pytest.approx(-5.0, abs=1e-14)
    assert (wrong[:41] < -4).all()  # 2 s
    assert (wrong[140:] > 1).all()  # 7 s on
    assert wrong.max() > 4
    assert (right["stone.omega_z"][right.t < 8] > 4.9).all()
    assert right.t[np.argmax(right["stone.omega_z"] < 0)] > 20
