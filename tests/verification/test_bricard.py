"""Bricard's mechanism: what makes it movable, its closure in closed form, and its motion by a quadrature.

The linkage is Bricard's trihedral one with threefold symmetry and hinges at right angles. Its closure condition is that
of Chen, You and Tarnai, Threefold-symmetric Bricard linkages for deployable structures (Int. J. Solids Struct. 42,
2005), for a twist of 90 degrees; with angles counted from the cube it reads sin a sin b + sin a + sin b = 0. That it
closes the loop is checked here as well.
"""

import numpy as np
import pytest
from scipy.integrate import quad

from tests.layers import both_layers, cached
from tests.mechanisms import G, example

pytestmark = both_layers

POINTS = np.array([(0, 0, 0), (1, 0, 0), (1, 0, -1), (1, -1, -1), (0, -1, -1), (0, -1, 0)], float)
AXES = np.array([(0, 0, 1), (0, -1, 0), (1, 0, 0), (0, 0, 1), (0, -1, 0), (1, 0, 0)], float)


@cached
def motion():
    return example("bricard.toml").simulate(10.0, rtol=1e-12, atol=1e-14, outputs=1001)


def test_one_constraint_too_many_and_yet_a_freedom():
    """IFToMM A04: Gruebler counts 0; of 30 rows 29 count, and every hinge takes part in the dependency."""
    found = example("bricard.toml").check()
    assert (found.gruebler, found.freedoms, found.redundancy) == (0, 1, 1)
    assert set(found.redundant) == {f"R{i}" for i in range(1, 7)}
    assert set(found.undetermined) == set(found.redundant)


def test_energy_is_kept():
    """IFToMM A04 asks for the deviation of the mechanical energy over 10 s, which should be nothing."""
    assert motion().energy.drift < 1e-9
    assert motion().health.violation < 1e-14


def test_hinges_obey_the_closure_condition():
    """Every other hinge turns alike, and the two angles obey the published condition, while they turn by half a turn."""
    r = motion()
    a, b = r["R1.angle"], r["R2.angle"]
    for k in (3, 5):
        assert r[f"R{k}.angle"] == pytest.approx(a, abs=1e-13)
        assert r[f"R{k + 1}.angle"] == pytest.approx(b, abs=1e-13)
    assert np.sin(a) * np.sin(b) + np.sin(a) + np.sin(b) == pytest.approx(0 * a, abs=1e-13)
    assert b.min() == pytest.approx(-np.pi / 6, abs=1e-6)  # reached at a = 90 degrees
    assert a.max() == pytest.approx(np.pi, abs=1e-4)  # there it is a cube again, as high as at the start


def turn(axis, angle):
    """Rotation matrix about an axis; the angle may be complex."""
    x, y, z = axis
    K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * K @ K


def rods(a):
    """Centre and rotation of each rod for the angle a of the first hinge, by the product of exponentials."""
    b = -np.arcsin(np.sin(a) / (1 + np.sin(a)))
    R, p = np.eye(3), np.zeros(3)
    for k in range(5):
        step = turn(AXES[k], b if k % 2 else a)
        p = p + R @ (POINTS[k] - step @ POINTS[k])
        R = R @ step
        yield p + R @ (POINTS[k] + POINTS[k + 1]) / 2, R


@pytest.mark.parametrize("a", np.linspace(0.0, np.pi, 7))
def test_closed_form_closes(a):
    """The fifth rod ends in the sixth hinge: its point and its axis stay where they are."""
    c, R = list(rods(a))[-1]
    assert c + R @ (POINTS[5] - POINTS[4]) / 2 == pytest.approx(POINTS[5], abs=1e-15)
    assert R @ AXES[5] == pytest.approx(AXES[5], abs=1e-15)


def inertia_and_height(a):
    """Moment of inertia of the whole as seen from the first hinge, and the sum of the heights (rods of 1 kg)."""
    total, height = 0.0, 0.0
    for k, (c, R) in enumerate(rods(a + 1e-30j)):
        d = POINTS[k + 1] - POINTS[k]
        J = (1.01 / 12) * np.eye(3) - (0.99 / 12) * np.outer(d, d)  # a square rod of 1 x 0.1 x 0.1 m
        W = (R.imag / 1e-30) @ R.real.T
        w = R.real.T @ np.array([W[2, 1], W[0, 2], W[1, 0]])
        v = c.imag / 1e-30
        total += v @ v + w @ J @ w
        height += c[2].real
    return total, height


def time_to(a):
    """Time from rest at 0 to the angle a, by energy: dt = sqrt(I / (2 (V(0) - V(a)))) da, with a = pi (1 - cos u) / 2."""
    start = inertia_and_height(0.0)[1]

    def rate(u):
        x = np.pi * (1 - np.cos(u)) / 2
        total, height = inertia_and_height(x)
        return np.sqrt(total / (2 * G * (start - height))) * np.pi * np.sin(u) / 2

    return quad(rate, 0, np.arccos(1 - 2 * a / np.pi), epsabs=1e-12, epsrel=1e-12)[0]


def test_motion_follows_from_energy_alone():
    """Each angle is reached when the quadrature over the closed-form kinematics says so."""
    r = motion()
    rising = np.flatnonzero(np.diff(r["R1.angle"]) < 0)[0]
    for k in np.linspace(0.1, 0.95, 8) * rising:
        k = int(k)
        assert time_to(r["R1.angle"][k]) == pytest.approx(r.t[k], abs=2e-9)


def test_points_follow_from_the_angle():
    """Positions of all rods, from the angle of the first hinge through the closed form."""
    r = motion()
    for k in range(0, 1001, 50):
        for i, (c, R) in enumerate(rods(r["R1.angle"][k])):
            if abs(r["R1.angle"][k]) > 0.5:  # near the cube the angle fixes the others by its square root only
                assert r[f"rod {i + 1}"].position[k] == pytest.approx(c, abs=1e-11)
                assert r[f"rod {i + 1}"].rotation[k] == pytest.approx(R, abs=1e-11)
