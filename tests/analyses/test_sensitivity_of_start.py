"""How the start of a mechanism that no driver holds changes with a parameter."""

from __future__ import annotations

import numpy as np
import pytest

import flyball as fb
from tests.analyses.made import G


def cranks(size: float, **more) -> fb.Mechanism:
    """Two upright cranks and a bar between their ends, longer by a parameter that is zero."""
    m = fb.Mechanism("cranks", planar=True, gravity=(0, -G), parameters={"off": 0.0})
    m.add(fb.Body("a", mass=1, inertia=size * size, position=(0, 0.5 * size)))
    m.add(fb.Body("c", mass=1, inertia=size * size, position=(size, 0.5 * size), **more))
    m.add(fb.Revolute("A", "ground", "a", at=(0, 0)))
    m.add(fb.Revolute("D", "ground", "c", at=(size, 0)))
    m.add(fb.Distance("bar", "a", "c", at=((0, size), (size, size)), length=f"{size}+off"))
    return m


@pytest.mark.parametrize("size", [1e-3, 1.0, 1e3])
def test_a_parameter_that_is_zero_in_a_mechanism_of_any_size(size):
    """Assembly shares the bar's lengthening between both cranks; a driver on one leaves it to the other."""
    found = cranks(size).sensitivity(["c.angle", "a.angle"], ["off"], verify=True)
    assert found.derivatives[0, :, 0] * size == pytest.approx([-0.5, 0.5], rel=1e-9)
    assert found.difference < 1e-5
    m = cranks(size)
    m.add(fb.Driver("drive", "A.angle", "0*t"))
    assert m.sensitivity(["c.angle"], ["off"])["c.angle", "off"] * size == pytest.approx(-1, rel=1e-9)


@pytest.mark.parametrize("size", [1e-3, 1.0])
def test_one_that_stays_as_drawn_or_is_told_its_angle(size):
    m = cranks(size, as_drawn=True)
    assert m.sensitivity(["a.angle"], ["off"])["a.angle", "off"] * size == pytest.approx(1, rel=1e-8)
    m = cranks(size)
    m.add(fb.Initial("D.angle", value=0.0))
    assert m.sensitivity(["a.angle"], ["off"])["a.angle", "off"] * size == pytest.approx(1, rel=1e-8)


def test_an_orientation_that_is_a_parameter():
    """A free body drawn turned about x, that spins about its own z: where a point of it is, and how fast it goes."""
    m = fb.Mechanism("top", parameters={"tilt": 0.3, "spin": 2.0})
    m.add(
        fb.Body(
            "top", mass=1, inertia=(1, 1, 2), position=(0, 0, 0), orientation=("tilt", 0, 0),
            angular_velocity=("0", "-spin*sin(tilt)", "spin*cos(tilt)"),
        )
    )  # fmt: skip
    m.add(fb.Frame("tip", "top", position=(0, 0, 1)))
    m.add(fb.Frame("rim", "top", position=(1, 0, 0)))
    found = m.sensitivity(["tip.y", "tip.z", "rim.vy"], ["tilt", "spin"])
    c, s = np.cos(0.3), np.sin(0.3)
    assert found.values[0] == pytest.approx([-s, c, 2 * c])
    assert found.derivatives[0] == pytest.approx(np.array([[-c, 0], [-s, 0], [-2 * s, c]]), abs=1e-9)


@pytest.mark.parametrize("axis", ["first", "second", "third"])
def test_an_orientation_about_three_axes(axis):
    """Turned about x, y and z by angles of its own: where a point of the body goes with each of them."""
    angles = {"first": 0.4, "second": -0.7, "third": 1.1}
    m = fb.Mechanism("turned", parameters=angles)
    m.add(fb.Body("b", mass=1, inertia=(1, 2, 3), orientation=tuple(angles)))
    m.add(fb.Frame("tip", "b", position=(0.3, -0.5, 1.2)))
    found = m.sensitivity(["tip.x", "tip.y", "tip.z"], [axis])

    def tip(step):
        turned = [a + step * (name == axis) for name, a in angles.items()]
        (cx, cy, cz), (sx, sy, sz) = np.cos(turned), np.sin(turned)
        X = np.array([[1, 0, 0], [0, cx, -sx], [0, sx, cx]])
        Y = np.array([[cy, 0, sy], [0, 1, 0], [-sy, 0, cy]])
        Z = np.array([[cz, -sz, 0], [sz, cz, 0], [0, 0, 1]])
        return X @ Y @ Z @ [0.3, -0.5, 1.2]  # Bryant angles

    assert found.values[0] == pytest.approx(tip(0.0), abs=1e-12)
    assert found.derivatives[0, :, 0] == pytest.approx(tip(1e-30j).imag / 1e-30, abs=1e-12)


def test_velocities_that_assembly_makes_consistent():
    """A rod on a hinge, drawn with a velocity of its centre that the hinge does not allow altogether."""
    m = fb.Mechanism("rod", planar=True, parameters={"v": 1.0, "mass": 2.0, "x": 0.5})
    m.add(fb.Body("rod", mass="mass", inertia=0.3, position=("x", 0), velocity=("v", "v"), angular_velocity=0))
    m.add(fb.Revolute("A", "ground", "rod", at=(0, 0)))
    found = m.sensitivity(["rod.vy", "rod.vx"], ["v", "mass", "x"], verify=True)
    total = 2.0 * 0.25 + 0.3  # w = m x v / (m x^2 + J), the motion nearest in kinetic energy
    assert found["rod.vy", "v"] == pytest.approx(0.5 / total, rel=1e-9)
    assert found["rod.vy", "mass"] == pytest.approx(0.25 * (1 / total - 2.0 * 0.25 / total**2), rel=1e-8)
    assert found["rod.vx", "v"] == pytest.approx(0, abs=1e-10)
    assert found.difference < 1e-5


def test_velocities_that_follow_from_given_ones():
    """The same rod with nothing said of its turn: the velocity across it is kept, whatever it weighs."""
    m = fb.Mechanism("rod", planar=True, parameters={"v": 1.0, "mass": 2.0, "x": 0.5})
    m.add(fb.Body("rod", mass="mass", inertia=0.3, position=("x", 0), velocity=(0, "v")))
    m.add(fb.Revolute("A", "ground", "rod", at=(0, 0)))
    found = m.sensitivity(["rod.vy", "rod.omega"], ["v", "mass", "x"], verify=True)
    assert found.values[0] == pytest.approx([1.0, 2.0], rel=1e-14)
    assert found.derivatives[0] == pytest.approx(np.array([[1, 0, 0], [2, 0, -4]]), rel=1e-9, abs=1e-10)
    m.add(fb.Body("tail", mass=1, inertia=0.1, position=("2*x", 0), angular_velocity="-v"))
    m.add(fb.Revolute("B", "rod", "tail", at=("1.5*x", 0)))
    found = m.sensitivity(["tail.vy", "tail.omega"], ["v", "x"], verify=True)
    assert found.values[0] == pytest.approx([1.25, -1], rel=1e-12)  # 1.5 v of the joint, less v x / 2
    assert found.derivatives[0] == pytest.approx(np.array([[1.25, -0.5], [-1, 0]]), rel=1e-8, abs=1e-8)
