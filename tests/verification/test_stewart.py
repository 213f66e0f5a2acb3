"""The Stewart platform: counts of freedoms, its pose as told, and forward kinematics solved by itself with SciPy."""

import numpy as np
import pytest
from scipy.optimize import fsolve
from scipy.spatial.transform import Rotation

from tests.layers import both_layers
from tests.mechanisms import example

pytestmark = both_layers


def hinges(radius, degrees):
    a = np.radians(degrees)
    return radius * np.column_stack([np.cos(a), np.sin(a), 0 * a])


BASE = hinges(0.9, [-12, 12, 108, 132, 228, 252])
PLATE = hinges(0.5, [312, 48, 72, 168, 192, 288])
UP = np.array([0.0, 0, 1])
DRAWN = np.linalg.norm(PLATE + UP - BASE, axis=1)


def test_freedoms():
    """Gruebler: 13 bodies, 6 universal (4), 6 prismatic (5), 6 spherical joints (3): 78 - 72 = 6, as the rank says."""
    m = example("stewart.py")
    assert len(m.bodies) == 13
    found = m.check()
    assert (found.gruebler, found.freedoms, found.redundancy) == (0, 0, 0)
    m.drivers.clear()
    found = m.check()
    assert (found.gruebler, found.freedoms, found.redundancy) == (6, 6, 0)


def test_inverse_kinematics_moves_it_as_told():
    """With the legs' lengths from the closed form the platform makes just the motion that they were worked out for."""
    r = example("stewart.py").simulate(6.0, rtol=1e-10, atol=1e-12, outputs=121)
    t = r.t
    told = np.stack([0.15 * np.sin(t), 0.1 * np.sin(2 * t), 1 + 0.12 * (1 - np.cos(t))], axis=1)
    yaw = Rotation.from_rotvec(np.outer(0.25 * np.sin(t), UP)).as_matrix()
    assert r["platform"].position == pytest.approx(told, abs=1e-11)
    assert r["platform"].rotation == pytest.approx(yaw, abs=1e-11)
    rate = np.stack([0.15 * np.cos(t), 0.2 * np.cos(2 * t), 0.12 * np.sin(t)], axis=1)
    assert r["platform"].velocity == pytest.approx(rate, abs=1e-10)
    speed_up = np.stack([-0.15 * np.sin(t), -0.4 * np.sin(2 * t), 0.12 * np.cos(t)], axis=1)
    assert r["platform"].acceleration == pytest.approx(speed_up, abs=1e-9)
    assert r["platform"].angular_velocity[:, 2] == pytest.approx(0.25 * np.cos(t), abs=1e-10)
    assert r.energy.drift < 1e-8


def forward(lengths, guess):
    """Pose (rotation vector, position) of the platform for six leg lengths."""

    def gaps(x):
        tops = x[3:] + Rotation.from_rotvec(x[:3]).apply(PLATE)
        return np.linalg.norm(tops - BASE, axis=1) - lengths

    x = fsolve(gaps, guess, xtol=1e-12)
    assert np.abs(gaps(x)).max() < 1e-12
    return x


def test_forward_kinematics():
    """Six legs that move each by its own law: the pose follows from the lengths alone, which has no closed form."""
    sizes, rates = np.array([0.1, 0.12, -0.08, 0.15, 0.05, -0.1]), np.array([1.0, 1.3, 0.8, 1.7, 2.1, 0.6])
    laws = tuple(f"{a}*sin({w}*t)" for a, w in zip(sizes, rates, strict=True))
    r = example("stewart.py", laws=laws).simulate(5.0, rtol=1e-10, atol=1e-12, outputs=101)
    x = np.r_[np.zeros(3), UP]
    widest = 0.0
    for k in range(101):
        x = forward(DRAWN + sizes * np.sin(rates * r.t[k]), x)
        assert r["platform"].position[k] == pytest.approx(x[3:], abs=1e-10)
        assert r["platform"].rotation[k] == pytest.approx(Rotation.from_rotvec(x[:3]).as_matrix(), abs=1e-10)
        widest = max(widest, np.linalg.norm(x[:3]))
    assert widest > 0.2


def test_legs_carry_the_load():
    """At every instant the six balls give the platform its weight and its acceleration (Newton and Euler)."""
    r = example("stewart.py").simulate(6.0, rtol=1e-10, atol=1e-12, outputs=61)
    mass, com = r.values.bodies["platform"].mass, r.values.bodies["platform"].com
    R = r["platform"].rotation
    force = sum(r[f"ball {k}"].force for k in range(1, 7))
    w, w1 = r["platform"].angular_velocity, r["platform"].angular_acceleration
    arm = R @ com
    centre = r["platform"].acceleration + np.cross(w1, arm) + np.cross(w, np.cross(w, arm))
    assert force == pytest.approx(mass * (centre + [0, 0, 9.81]), abs=1e-7)
