"""Principal moments and axes, and the report of all masses."""

from __future__ import annotations

import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.spatial.transform import Rotation

import flyball as fb
from flyball.model.inertia import principal

turns = arrays(float, 3, elements=st.floats(-3, 3)).map(lambda r: Rotation.from_rotvec(r).as_matrix())
kinds = st.sampled_from([(1, 2, 2.5), (1, 1, 1.5), (1, 2, 2), (1, 1, 1), (0, 1, 1), (0, 0, 0), (1, 1 + 1e-6, 1.5)])


@given(R=turns, w=kinds, size=st.sampled_from([1e-9, 1.0, 1e6]))
def test_principal_axes(R: np.ndarray, w: tuple, size: float) -> None:
    """They diagonalise, ascend, are right-handed and have the sign that the description promises."""
    J = R @ np.diag(w) @ R.T * size
    J = (J + J.T) / 2
    moments, axes = principal(J)
    assert moments == pytest.approx(np.array(w) * size, abs=1e-12 * size)
    assert axes.T @ axes == pytest.approx(np.eye(3), abs=1e-12)
    assert np.linalg.det(axes) == pytest.approx(1.0)
    assert axes @ np.diag(moments) @ axes.T == pytest.approx(J, abs=1e-8 * size)
    for k in (0, 1):
        a = axes[:, k]
        assert a[np.abs(a) > np.abs(a).max() - 1e-8].max() > 0


def test_axes_that_are_not_unique_are_those_of_the_body() -> None:
    assert np.array_equal(principal(np.diag([2.0, 2.0, 2.0]))[1], np.eye(3))
    assert principal(np.diag([2.0, 2.0, 3.0]))[1] == pytest.approx(np.eye(3))
    assert principal(np.diag([3.0, 2.0, 2.0]))[1] == pytest.approx(np.array([[0, 0, 1], [1, 0, 0], [0, 1, 0]]))
    assert principal(np.diag([2.0, 2.0, 0.5]))[1] == pytest.approx(np.array([[0, 1, 0], [0, 0, 1], [1, 0, 0]]))
    R = Rotation.from_rotvec((0, 0.5, 0)).as_matrix()  # a disc tilted about y keeps y
    assert principal(R @ np.diag([2.0, 2.0, 3.0]) @ R.T)[1] == pytest.approx(R)


def test_off_the_diagonal_are_minus_the_products_of_inertia() -> None:
    """Two point masses m at +-(1, 1, 0): sum of m x y is 2 m, so Ixy is -2 m; the least moment is about their line."""
    m = 3.0
    a = fb.Body("a", mass=2 * m, inertia=((2 * m, -2 * m, 0), (-2 * m, 2 * m, 0), (0, 0, 4 * m)))
    mechanism = fb.Mechanism("m")
    mechanism.add(a)
    b = mechanism.mass_properties(drawn=True)["a"]
    assert b.moments == pytest.approx([0, 4 * m, 4 * m], abs=1e-14)
    assert b.axes[:, 0] == pytest.approx([0.5**0.5, 0.5**0.5, 0])
    small = 0.001
    balls = [fb.Sphere(radius=small, mass=m, position=p) for p in ((1, 1, 0), (-1, -1, 0))]
    mechanism.add(fb.Body("balls", shape=balls))
    assert mechanism.mass_properties(drawn=True)["balls"].inertia[0, 1] == pytest.approx(-2 * m)


def machine() -> fb.Mechanism:
    m = fb.Mechanism("machine", gravity=(0, 0, -9.81))
    tilt = (0, 0, "30 deg")
    m.add(fb.Body("block", density=1000, shape=fb.Box(edges=(0.1, 0.2, 0.3)), position=(1, 0, 0)))
    m.add(fb.Body("bar", mass=2, shape=fb.Box(edges=(0.3, 0.1, 0.2), orientation=tilt), position=(0, 1, 0)))
    m.add(fb.Body("point", mass=1, inertia=0, position=(0, 0, 2), orientation=(0.1, 0.2, 0.3), com=(0, 0, 0.5)))
    m.add(fb.Fixed("weld", "block", "bar", at=(0, 0, 0)), fb.Fixed("hold", "ground", "point", at=(0, 0, 2)))
    return m


def test_the_report_adds_up() -> None:
    """Total mass, mass centre and inertia against sums over the bodies as they lie in the world."""
    r = machine().mass_properties(drawn=True)
    assert r["block"].mass == pytest.approx(6)
    assert r["block"].volume == pytest.approx(0.006)
    assert r["block"].gyration == pytest.approx(np.sqrt(np.array([0.05, 0.10, 0.13]) / 12))
    assert r["block"].axes == pytest.approx(np.array([[0, 0, 1], [0, 1, 0], [1, 0, 0]]) * (1, 1, -1))
    assert r["bar"].axes[:, 0] == pytest.approx([np.cos(np.pi / 6), 0.5, 0])
    R = Rotation.from_euler("XYZ", (0.1, 0.2, 0.3)).as_matrix()
    p = {"block": (1, 0, 0), "bar": (0, 1, 0), "point": (0, 0, 2) + R @ (0, 0, 0.5)}
    for name, where in p.items():
        assert r[name].position == pytest.approx(where)
    assert r["point"].com == pytest.approx([0, 0, 0.5])
    com = (6 * np.array(p["block"]) + 2 * np.array(p["bar"]) + p["point"]) / 9
    assert r.total.mass == pytest.approx(9)
    assert r.total.position == pytest.approx(com)
    J = np.zeros((3, 3))
    for name, b in r.bodies.items():
        d = p[name] - com
        J += b.inertia + b.mass * (d @ d * np.eye(3) - np.outer(d, d))
    assert r.total.inertia == pytest.approx(J)
    assert r.total.volume is None  # the point has none
    with pytest.raises(fb.ModelError, match=r"has no body named 'blok' \(did you mean 'block'\?\)"):
        r["blok"]


def test_the_report_reads_well() -> None:
    r = machine().mass_properties(drawn=True)
    lines = str(r).splitlines()
    assert lines[0].split("  ")[0] == ""
    assert "principal moments [kg m^2]" in lines[0]
    assert lines[1].startswith("block  ")
    assert "z, y, x" in lines[1]
    assert "0.006" in lines[1]
    assert lines[4].startswith("all together  9 ")
    assert "principal axes of bar: (0.86603, 0.5, 0), (0, 0, 1), (0.5, -0.86603, 0)" in str(r)
    data = json.loads(json.dumps(r.as_dict()))
    assert data["bodies"]["bar"]["moments"] == pytest.approx(r["bar"].moments)


def test_planar_report() -> None:
    m = fb.Mechanism("flat", planar=True)
    m.add(fb.Body("a", mass=1, inertia=0.5, position=(0, 1), com=(1, 0), angle="90 deg"))
    m.add(fb.Body("b", density=2, shape=fb.Cylinder(radius=1, length=1), position=(4, 0)))
    r = m.mass_properties(drawn=True)
    assert r["a"].position == pytest.approx([0, 2])
    assert r["a"].inertia == 0.5
    assert r["b"].moments == pytest.approx([np.pi])
    assert r["b"].gyration == pytest.approx([0.5**0.5])
    mass = 1 + 2 * np.pi
    c = (np.array([0, 2]) + 2 * np.pi * np.array([4, 0])) / mass
    assert r.total.position == pytest.approx(c)
    far = [np.array([0, 2]) - c, np.array([4, 0]) - c]
    assert r.total.inertia == pytest.approx(0.5 + np.pi + far[0] @ far[0] + 2 * np.pi * far[1] @ far[1])
    assert "moment about z" in str(r)
    assert "axes" not in str(r)


def test_where_the_mechanism_is_put_together() -> None:
    """The total is that of the closed mechanism; as drawn it is where the guess has it."""
    m = fb.Mechanism("m", planar=True)
    m.add(fb.Body("b", mass=1, inertia=1, position=(1.0, 0.5)), fb.Frame("pin", "b", position=(-1, 0)))
    m.add(fb.Frame("base", "ground"), fb.Revolute("A", "base", "pin"), fb.Initial("A.angle", value="90 deg"))
    assert m.mass_properties(drawn=True).total.position == pytest.approx([1, 0.5])
    assert m.mass_properties().total.position == pytest.approx([0, 1], abs=1e-9)


def test_check_says_which_axes() -> None:
    text = str(machine().check())
    assert "body block" in text
    assert "inertia 0.025, 0.05, 0.065 kg m^2 about z, y, x" in text
    (line,) = (x for x in text.splitlines() if x.startswith("body bar"))
    assert "principal moments " in line
    assert "about (0.86603, 0.5, 0), (0, 0, 1), (0.5, -0.86603, 0)" in line
    assert "inertia 0 kg m^2 about every axis" in text  # the point mass
    x, y, z = (
        (6 + 0.5 * np.sin(0.2)) / 9,
        (2 - 0.5 * np.sin(0.1) * np.cos(0.2)) / 9,
        (2 + 0.5 * np.cos(0.1) * np.cos(0.2)) / 9,
    )
    assert f"all together  9 kg, centre of mass at ({x:.4g}, {y:.4g}, {z:.4g}) m" in text


def test_check_warns_of_a_body_that_only_stays_as_drawn() -> None:
    m = fb.Mechanism("m", gravity=(0, 0, -9.81))
    m.add(fb.Body("base", mass=1, inertia=(1, 1, 1), as_drawn=True))
    assert "as_drawn keeps assembly from moving it, it does not weld it to ground" in str(m.check())
