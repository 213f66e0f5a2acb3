"""The massless link with two hinges: against the same link with a little mass, and against Hooke's joint."""

import numpy as np
import pytest

import flyball as fb
from tests.layers import both_layers

pytestmark = both_layers

ONE, TWO = (0.1, 0.0, 0.2), (0.25, -0.1, 0.35)
FIRST, SECOND = (0.2, 1.0, 0.1), (1.0, -0.3, 0.5)


def bodies(m):
    m.add(fb.Body("a", mass=2.0, inertia=(0.05, 0.09, 0.07), position=(-0.1, 0.1, 0.1), angular_velocity=(1, -2, 0.5)))
    m.add(
        fb.Body(
            "b",
            mass=1.5,
            inertia=(0.03, 0.05, 0.06),
            position=(0.5, 0.0, 0.5),
            orientation=(0.2, -0.3, 0.4),
            velocity=(0.3, 0.1, -0.2),
        )
    )
    m.add(fb.Spherical("hang", "ground", "a", at=(-0.3, 0.2, 0.1)))
    return m


def linked(mass):
    """With a link body of a little mass, or with the joint that is the limit."""
    m = bodies(fb.Mechanism("link", gravity=(0, 0, -9.81)))
    if mass:
        middle = tuple((np.array(ONE) + TWO) / 2)
        m.add(fb.Body("link", mass=mass, inertia=(0.02 * mass,) * 3, position=middle))
        m.add(fb.Revolute("one", "a", "link", at=ONE, axis=FIRST), fb.Revolute("two", "link", "b", at=TWO, axis=SECOND))
    else:
        m.add(fb.GeneralUniversal("U", "a", "b", at=(ONE, TWO), axes=(FIRST, SECOND)))
    return m


def test_it_is_the_limit_of_a_light_link():
    """Motion, both angles and the reaction come as near as the link is light, in proportion."""
    exact = linked(0.0).simulate(0.8, outputs=41, rtol=1e-10, atol=1e-12)
    gaps = []
    for mass in (1e-4, 1e-5):
        r = linked(mass).simulate(0.8, outputs=41, rtol=1e-10, atol=1e-12)
        parts = [
            (r["b"].position, exact["b"].position),
            (r["b"].rotation, exact["b"].rotation),
            (r["one"].angle, exact["U"].angle_1),
            (r["two"].angle, exact["U"].angle_2),
            (r["one"].rate, exact["U"].angle_1_rate),
            (r["two"].acceleration, exact["U"].angle_2_acceleration),
            (r["two"].force, exact["U"].force),
        ]
        gaps.append([np.abs(x - y).max() for x, y in parts])
    gaps = np.array(gaps)
    assert (gaps[1] < np.array([1e-4, 1e-3, 1e-3, 1e-3, 1e-2, 0.2, 0.1])).all(), gaps
    assert gaps[1] == pytest.approx(0.1 * gaps[0], rel=0.1)


def test_with_square_axes_that_meet_it_is_a_universal_joint():
    """The same motion and coordinates, and the same force and torque."""
    results = []
    axes = ((0, 1, 0), (1, 0, 0.5))
    for joint in (
        fb.Universal("U", "a", "b", at=ONE, axes=axes, angle_1=0.4),
        fb.GeneralUniversal("U", "a", "b", at=(ONE, ONE), axes=axes, angle_1=0.4),
    ):
        m = bodies(fb.Mechanism("hooke", gravity=(0, 0, -9.81)))
        m.add(joint)
        results.append(m.simulate(1.0, outputs=51, rtol=1e-10, atol=1e-12))
    one, two = results
    for name in ("angle_1", "angle_2", "angle_1_rate", "angle_2_acceleration"):
        assert getattr(two["U"], name) == pytest.approx(getattr(one["U"], name), abs=1e-6)
    assert two["b"].position == pytest.approx(one["b"].position, abs=1e-7)
    for x, y in zip(one["U"].reaction(), two["U"].reaction(), strict=True):
        assert y == pytest.approx(x, abs=1e-5)


def test_axes_that_meet_away_from_the_points_are_no_special_case():
    """Points anywhere along the axes describe the same joint."""
    results = []
    for s in (0.0, 0.7):
        m = bodies(fb.Mechanism("same", gravity=(0, 0, -9.81)))
        points = (np.add(ONE, s * np.array(FIRST)), np.add(TWO, -0.4 * s * np.array(SECOND)))
        m.add(fb.GeneralUniversal("U", "a", "b", at=points, axes=(FIRST, SECOND)))
        results.append(m.simulate(0.6, outputs=13, rtol=1e-10, atol=1e-12))
    assert results[1]["b"].position == pytest.approx(results[0]["b"].position, abs=1e-8)
    assert results[1]["U"].angle_2 == pytest.approx(results[0]["U"].angle_2, abs=1e-8)
    assert results[1]["U"].force == pytest.approx(results[0]["U"].force, abs=1e-6)
