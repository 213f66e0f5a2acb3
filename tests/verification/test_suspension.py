"""The double wishbone: its pose at any bump travel against the same geometry solved by itself with SciPy."""

import numpy as np
import pytest
from scipy.optimize import fsolve
from scipy.spatial.transform import Rotation

from tests.layers import both_layers, cached
from tests.mechanisms import example

pytestmark = both_layers

LOWER_PIVOT, LOWER_AXIS, LOWER_BALL = np.array([[0, 0.35, 0.20], [1, 0, 0], [0, 0.72, 0.18]])
UPPER_PIVOT, UPPER_AXIS, UPPER_BALL = np.array([[0, 0.42, 0.40], [1, 0, 0.1], [-0.01, 0.68, 0.42]])
INNER, OUTER = np.array([[-0.12, 0.37, 0.24], [-0.12, 0.70, 0.23]])
HUB = np.array([0, 0.78, 0.30])
STRUT_TOP, STRUT_FOOT = np.array([[0, 0.44, 0.62], [0, 0.58, 0.187]])


def swung(point, pivot, axis, angle):
    axis = axis / np.linalg.norm(axis)
    return pivot + Rotation.from_rotvec(angle * axis).apply(point - pivot)


def solved(height):
    """Angles of the arms, pose of the upright (rotation vector, shift of its hub) for a height of the hub."""

    def gaps(x):
        R, hub = Rotation.from_rotvec(x[2:5]), x[5:]

        def moved(p):
            return hub + R.apply(p - HUB)

        return np.r_[
            moved(LOWER_BALL) - swung(LOWER_BALL, LOWER_PIVOT, LOWER_AXIS, x[0]),
            moved(UPPER_BALL) - swung(UPPER_BALL, UPPER_PIVOT, UPPER_AXIS, x[1]),
            [np.linalg.norm(moved(OUTER) - INNER) - np.linalg.norm(OUTER - INNER), hub[2] - height],
        ]

    x = fsolve(gaps, np.r_[np.zeros(5), HUB], xtol=1e-12)
    assert np.abs(gaps(x)).max() < 1e-12
    return x


@cached
def bump():
    return example("double_wishbone.toml").simulate(2.0, rtol=1e-10, atol=1e-12, outputs=81)


def test_freedoms():
    """Gruebler: 4 bodies, 24 - 5 - 5 - 3 - 3 - 1 - 5 = 2, bump travel and the wheel's turning; the driver takes one."""
    m = example("double_wishbone.toml")
    assert (m.check().gruebler, m.check().freedoms) == (1, 1)
    m.drivers.clear()
    assert (m.check().gruebler, m.check().freedoms) == (2, 2)


def test_camber_toe_and_track():
    """Pose of upright and wheel over the travel of 60 mm either way."""
    r = bump()
    spindle = r["upright"].rotation[:, :, 1]
    for k in range(81):
        x = solved(0.30 + 0.06 * np.sin(np.pi * r.t[k]))
        R = Rotation.from_rotvec(x[2:5]).as_matrix()
        assert r["lower pivot.angle"][k] == pytest.approx(x[0], abs=1e-10)
        assert r["upper pivot.angle"][k] == pytest.approx(x[1], abs=1e-10)
        assert r["upright"].rotation[k] == pytest.approx(R, abs=1e-10)
        assert r["wheel"].position[k] == pytest.approx(x[5:], abs=1e-10)
        assert r["wheel"].rotation[k, :, 1] == pytest.approx(R[:, 1], abs=1e-10)
    camber = np.degrees(np.arcsin(spindle[:, 2]))
    top = np.argmax(r["hub.z"])
    assert camber[top] > 1.0  # the wheel's top leans inward as it rises: the short upper arm
    assert abs(np.degrees(np.arctan2(spindle[top, 0], spindle[top, 1]))) < 1.0


def test_strut():
    """Its length and rate from the lower arm's angle; what the damper takes, driver, spring and weights balance."""
    r = bump()
    for k in range(0, 81, 8):
        foot = swung(STRUT_FOOT, LOWER_PIVOT, LOWER_AXIS, r["lower pivot.angle"][k])
        assert r["strut.length"][k] == pytest.approx(np.linalg.norm(foot - STRUT_TOP), abs=1e-11)
    force = 40e3 * (r["strut.length"] - 0.56) + 2e3 * r["strut.rate"]
    assert r["strut.force"] == pytest.approx(force, abs=1e-8)
    assert r.energy.drift < 1e-8
    assert r["rig"].work[-1] > 1.0  # over a whole cycle it makes up for the damper


def test_wheel_keeps_spinning():
    """It turns freely about the spindle: as seen from the upright only by as much as that itself turns about it."""
    r = bump()
    along = np.einsum("ni,ni->n", r["wheel"].angular_velocity, r["upright"].rotation[:, :, 1])
    assert along == pytest.approx(np.full(81, along[0]), abs=1e-9)
    assert r["bearing.rate"][0] == pytest.approx(40.0, abs=1e-12)
