"""Wrong descriptions are refused when they are made, with names, values and a remedy."""

from __future__ import annotations

import pickle

import numpy as np
import pytest

import flyball as fb
from flyball.simulation.simulate import output_times
from flyball.tables.structure import structure


def planar(**options: object) -> fb.Mechanism:
    m = fb.Mechanism("m", planar=True, **options)
    m.add(fb.Body("crank", mass=1, inertia=0.1), fb.Body("rod", mass=1, inertia=0.1, position=(1, 0)))
    return m


def spatial() -> fb.Mechanism:
    m = fb.Mechanism("m")
    m.add(fb.Body("a", mass=1, inertia=(1, 1, 1)), fb.Body("b", mass=1, inertia=(1, 1, 1)))
    return m


PLANAR = [
    (
        fb.Revolute,
        ("A", "ground", "crnk"),
        {"at": (0, 0)},
        r"Revolute 'A': body_j: there is no body or frame named 'crnk' \(did you mean 'crank'\?\)",
    ),
    (
        fb.Revolute,
        ("A", "crank", "crank"),
        {"at": (0, 0)},
        "both its ends are on 'crank'; it must join two different bodies",
    ),
    (fb.Revolute, ("A", "ground", "ground"), {"at": (0, 0)}, "both its ends are on 'ground'"),
    (fb.Revolute, ("A", "ground", "crank"), {}, "give its position: at=... in world coordinates, or name frames"),
    (
        fb.Revolute,
        ("A", "ground", "crank"),
        {"at": (0, 0, 1)},
        "the mechanism is planar, its third component must be 0, not 1",
    ),
    (fb.Revolute, ("A", "ground", "crank"), {"at": (0,)}, "expected 2 components, got 1"),
    (
        fb.Revolute,
        ("A", "ground", "crank"),
        {"at": (0, 0), "axis": (1, 0, 0)},
        "its axis is the normal; leave axis out",
    ),
    (
        fb.Revolute,
        ("crank", "ground", "crank"),
        {"at": (0, 0)},
        "the name is taken by Body 'crank'; names must be unique",
    ),
    (fb.Revolute, ("ground", "ground", "crank"), {"at": (0, 0)}, "the name 'ground' is reserved"),
    (fb.Revolute, ("A..b", "ground", "crank"), {"at": (0, 0)}, r"'A\.\.b' is no good name"),
    (
        fb.Revolute,
        ("A", "ground", "crank"),
        {"at": (0, 0), "angl": 1},
        r"unknown field 'angl' \(did you mean 'angle'\?\)",
    ),
    (
        fb.Revolute,
        ("A", "ground", "crank"),
        {"at": (0, 0), "angle": "5 mm"},
        r"angle of Revolute 'A': '5 mm': expected an angle",
    ),
    (
        fb.Translational,
        ("D", "ground", "crank"),
        {"at": (0, 0), "axis": (0, 0)},
        r"axis of Translational 'D': \(0\.0, 0\.0\) has no length",
    ),
    (fb.Translational, ("D", "ground", "crank"), {"at": (0, 0)}, "give its axis in world coordinates"),
    (fb.Spherical, ("S", "ground", "crank"), {"at": (0, 0)}, "Spherical has no meaning in a planar mechanism"),
    (
        fb.Distance,
        ("L", "ground", "crank"),
        {"at": ((0, 0), (1, 0)), "length": 0},
        "length is 0 m; it must be greater than 0",
    ),
    (fb.Body, ("b",), {"mass": 0, "inertia": 1}, "mass is 0 kg; a mass must be greater than 0"),
    (fb.Body, ("b",), {"mass": -1, "inertia": 1}, "mass is -1 kg; a mass must be greater than 0. Check its sign"),
    (fb.Body, ("b",), {"mass": float("nan"), "inertia": 1}, "mass of Body 'b': the value is nan"),
    (fb.Body, ("b",), {"mass": 1, "inertia": np.inf}, "inertia of Body 'b': the value is inf"),
    (fb.Body, ("b",), {"mass": 1, "inertia": -1}, "inertia is -1 kg m\\^2; it must be zero or greater"),
    (fb.Body, ("b",), {"mass": 1, "inertia": (1, 1, 1)}, "in a planar mechanism inertia is one number"),
    (fb.Body, ("b",), {"mass": 1}, "its inertia is missing; give inertia=0.01"),
    (fb.Body, ("b",), {"inertia": 1}, "its mass is missing"),
    (fb.Body, ("b",), {"mass": "1 N", "inertia": 1}, "'1 N': expected a mass"),
    (fb.Body, ("b",), {"mass": "rho*2", "inertia": 1}, "unknown name 'rho'"),
    (fb.Body, ("b",), {"mass": "sine(2)", "inertia": 1}, "unknown function 'sine'"),
    (fb.Body, ("b",), {"mass": True, "inertia": 1}, "a truth value is not a number"),
    (
        fb.Body,
        ("b",),
        {"mass": 1, "inertia": 1, "orientation": (1, 0, 0, 0)},
        "in a planar mechanism give angle=, not orientation=",
    ),
    (fb.Body, ("b",), {"mass": 1, "inertia": 1, "angular_velocity": (0, 0, 1)}, "angular_velocity must be one number"),
    (fb.Frame, ("f", "crnk"), {}, "there is no body named 'crnk'"),
    (fb.Motor, ("mo", "A"), {"torque": 1}, "there is no joint named 'A'"),
    (fb.PointForce, ("p", "ground"), {"force": (1, 0)}, "a force on ground moves nothing"),
    (
        fb.SpringDamper,
        ("s", "ground", "crank"),
        {"at": ((0, 0), (1, 0)), "stiffness": -1},
        "stiffness is -1 N/m; it must be zero or greater",
    ),
    (fb.Driver, ("d", "A.angle", "t"), {}, "there is no joint named 'A'"),
    (fb.Driver, ("d", "crank.z", "t"), {}, "'crank' has the coordinates x, y, angle, not 'z'"),
    (fb.Initial, ("crank",), {"value": 1}, "has the coordinates x, y, angle, not ''"),
]

SPATIAL = [
    (fb.Body, ("c",), {"mass": 1, "inertia": (1, 1, 2.1)}, "break the triangle inequality"),
    (fb.Body, ("c",), {"mass": 1, "inertia": (-1, 1, 1)}, "negative principal moment"),
    (fb.Body, ("c",), {"mass": 1, "inertia": 1}, "three principal moments or a 3x3 matrix"),
    (fb.Body, ("c",), {"mass": 1, "inertia": np.arange(9.0).reshape(3, 3)}, "not symmetric"),
    (
        fb.Body,
        ("c",),
        {"mass": 1, "inertia": (1, 1, 1), "angle": 1},
        "in a spatial mechanism give orientation=, not angle=",
    ),
    (fb.Body, ("c",), {"mass": 1, "inertia": (1, 1, 1), "orientation": (0, 0, 0, 0)}, "a quaternion must not be zero"),
    (fb.Body, ("c",), {"mass": 1, "inertia": (1, 1, 1), "position": (0, 0)}, "expected 3 components, got 2"),
    (fb.Body, ("c",), {"shape": fb.Sphere(radius=-1), "density": 1}, "radius is -1 m; it must be greater than 0"),
    (fb.Revolute, ("A", "ground", "a"), {"at": (0, 0, 0)}, "give its axis in world coordinates"),
    (fb.Revolute, ("A", "ground", "a"), {"at": (0, 0, 0), "axis": (0, 0, 0)}, "a direction must not be zero"),
    (fb.Revolute, ("A", "ground", "a"), {"at": (0, 0, float("nan")), "axis": (0, 0, 1)}, "the value is nan"),
    (
        fb.Translational,
        ("D", "ground", "a"),
        {"at": (0, 0, 0), "axis": (1, 0, 0)},
        "is for planar mechanisms; in space use Prismatic",
    ),
    (fb.Universal, ("U", "a", "b"), {"at": (0, 0, 0)}, "give its two axes"),
    (
        fb.Universal,
        ("U", "a", "b"),
        {"at": (0, 0, 0), "axes": ((0, 0, 1),)},
        r"'axes' must be a list of 2, got \(\(0, 0",
    ),
    (
        fb.Universal,
        ("U", "a", "b"),
        {"at": (0, 0, 0), "axes": ((1, 0, 0), (1, 1, 0))},
        "must be at right angles, these are at 45 deg",
    ),
]


@pytest.mark.parametrize(("kind", "args", "fields", "said"), PLANAR)
def test_in_the_plane(kind: type, args: tuple, fields: dict, said: str) -> None:
    m = planar()
    with pytest.raises(fb.ModelError, match=said):
        m.add(kind(*args, **fields))


@pytest.mark.parametrize(("kind", "args", "fields", "said"), SPATIAL)
def test_in_space(kind: type, args: tuple, fields: dict, said: str) -> None:
    m = spatial()
    with pytest.raises(fb.ModelError, match=said):
        m.add(kind(*args, **fields))


def test_a_name_is_taken_once() -> None:
    with pytest.raises(fb.ModelError, match="Body 'crank': the name is taken"):
        planar().add(fb.Body("crank", mass=1, inertia=1))
    with pytest.raises(fb.ModelError, match=r"there is an initial condition for 'crank\.x' already"):
        planar().add(fb.Initial("crank.x", value=1), fb.Initial("crank.x", value=1))


def test_only_parts_can_be_added() -> None:
    with pytest.raises(fb.ModelError, match="cannot add 3"):
        planar().add(3)
    with pytest.raises(fb.ModelError, match=r"has no part named 'crnk' \(did you mean 'crank'\?\)"):
        planar()["crnk"]


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"gravity": 9.81}, "is a vector"),
        ({"gravity": (0, 0, -9.81)}, "its third component must be 0"),
        ({"gravity": (0, "1 kg")}, "expected an acceleration"),
        ({"gravity": (0, True)}, "a truth value is not a number"),
        ({"parameters": {"a b": 1}}, "is not a plain name"),
        ({"parameters": {"a": "b", "b": "a"}}, "parameter"),
        ({"parameters": {"a": True}}, "a truth value is not a number"),
        ({"parameters": {"a": float("inf")}}, "finite"),
    ],
)
def test_settings(options: dict, said: str) -> None:
    with pytest.raises(fb.ModelError, match=said):
        fb.Mechanism("m", planar=True, **options)


def test_a_mechanism_needs_bodies() -> None:
    with pytest.raises(fb.ModelError, match="'m' has no bodies; add at least one"):
        structure(fb.Mechanism("m"))


def test_laws_know_time_and_what_they_measure_only() -> None:
    m = planar()
    m.add(fb.Revolute("A", "ground", "crank", at=(0, 0)))
    with pytest.raises(fb.ExpressionError, match=r"torque of Motor 'motor': unknown name 'length'"):
        m.add(fb.Motor("motor", "A", torque="length*t"))
    with pytest.raises(fb.ExpressionError, match=r"law of Driver 'turn': unknown name 'sped'"):
        m.add(fb.Driver("turn", "A.angle", "sped*t"))


@pytest.mark.parametrize(
    ("interval", "said"),
    [
        ((1.0, 1.0, 5), "must be later than the start time 1 s"),
        ((0.0, -1.0, 5), "the end time -1 s must be later"),
        ((0.0, float("nan"), 5), "must be finite"),
        ((0.0, 1.0, 1), "at least 2"),
        ((0.0, 1.0, [0.5, 0.2]), "ascending order"),
        ((0.0, 1.0, [0.5, 2.0]), "must lie between"),
    ],
)
def test_times(interval: tuple, said: str) -> None:
    with pytest.raises(fb.ModelError, match=said):
        output_times(*interval)


def test_errors_and_mechanisms_can_be_pickled() -> None:
    m = planar()
    assert pickle.loads(pickle.dumps(m)) == m
    with pytest.raises(fb.ModelError) as caught:
        m["nobody"]
    assert str(pickle.loads(pickle.dumps(caught.value))) == str(caught.value)
