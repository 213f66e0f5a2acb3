"""Every field of every element, given something that makes no sense: the message names the element and the field."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator
from typing import Any

import pytest

import flyball as fb
from flyball import joints
from flyball.model.element import Element
from flyball.model.force import Force
from tests.contract import zoo
from tests.identities.test_complex_values import with_forces

WRONG = [math.nan, -math.inf, "1/0", "nope", "nope(2)", "3 K*s^7", "2 + 3 mm", 1j, "", b"5", (1, 2, 3, 4, 5), {"a": 1}]
WRONG += [object(), 1e160, [[[1]]], "3 m*t"]
INSIDE = [math.inf, "0/0", "nope", "3 K*s^7", None, 1j, True, (1,)]  # in place of the first number of a list


def others() -> fb.Mechanism:
    """What is neither joint nor force."""
    m = zoo.two_bodies("plane")
    m.add(fb.Revolute("A", "ground", "a", at=(0, 0)), fb.Revolute("B", "ground", "b", at=(0.5, 0), angle=0.2))
    m.add(fb.Body("c", mass=1.0, inertia=0.1, position=(1.0, 0.2)))
    m.add(fb.Translational("C", "ground", "c", at=(1, 0), axis=(1, 2), displacement=0.1))
    m.add(fb.GearPair("gears", "A", "B", teeth=(20, 31)), fb.RackAndPinion("rack", "C", "A", radius=0.05))
    m.add(fb.Coupler("sum", ("A.angle", "B.angle", "c.x"), weights=(2.0, -1.0, 3.0), value=0.7))
    m.add(fb.Frame("f", "a", position=(1, 2), angle=0.2), fb.Sensor("s", "A.angle"), fb.IMU("imu", "f"))
    m.add(fb.Table("curve", x=(0, 1, 2), y=(0, 1, 3)), fb.Driver("d", "A.angle", "2*t"))
    m.add(fb.Initial("B.angle", value=0.2, rate=1))
    m.add(fb.Limit("soft", "B.angle", lower=0.1, upper=0.3, stiffness=10.0, damping=1.0))
    m.add(fb.Backlash("play", ("B.angle", "c.x"), weights=(2.0, 1.0), gap=0.1, middle=0.2, restitution=0.5))
    m.add(fb.OneWay("wheel", "B.angle", relative_to="A.angle", direction=-1))
    m.add(fb.Ratchet("pawl", "C.displacement", pitch=0.1, tooth=0.02, restitution=0.1))
    return m


def bodies() -> fb.Mechanism:
    """A body with all that it can have, and a frame in space."""
    m = fb.Mechanism("bodies")
    m.add(
        fb.Body("full", mass=1, inertia=(1, 1, 1), inertia_about=(0, 0, 0), inertia_axes=(0, 0, 0.1), com=(0, 0, 0),
                position=(0, 0, 1), orientation=(1, 0, 0, 0), velocity=(0, 0, 0), angular_velocity=(0, 0, 0), color="red"),
        fb.Frame("f", "full", position=(1, 2, 3), orientation=(1, 0, 0, 0)),
    )  # fmt: skip
    return m


def touching(planar: bool) -> fb.Mechanism:
    """What is about contact, with all that it can have."""
    m = fb.Mechanism("touching", planar=planar)
    at, turn = ((0, 0), {"angle": 0.1}) if planar else ((0, 0, 0), {"orientation": (0, 0, 0.1)})
    m.add(fb.Material("wood", friction=(0.1, 0.2), static_friction=0.3, restitution=0.1, rolling_friction=0.1,
                      spinning_friction=0.2, grain=at[1:] + (1.0,), surface_velocity=at))  # fmt: skip
    m.add(fb.Material("steel", friction=0.3))
    m.add(fb.MaterialPair("wood", "steel", friction=0.1, static_friction=0.2, restitution=0.1, rolling_friction=0.1,
                          spinning_friction=0.2))  # fmt: skip
    m.add(fb.Ground("floor", shape=fb.Sphere(radius=1.0), position=at, material="wood", color="red", **turn))
    m.add(fb.Body("b", shape=fb.Sphere(radius=0.1), density=1, material="steel"))
    m.add(fb.Limit("stop", "b.x", lower=0, upper=1, restitution=0.5))
    m.add(fb.Contact("c", between="b", others="floor", friction=0.1, static_friction=0.2, restitution=0.1,
                     rolling_friction=0.1, spinning_friction=0.2, joined=True, exclude=[("b", "floor")]))  # fmt: skip
    return m


def one(where: str, name: str) -> Iterator[tuple[fb.Mechanism, Element]]:
    m = zoo.joined(where, name)
    yield m, m["J"]


def all_of(m: fb.Mechanism, base: type = Element) -> Iterator[tuple[fb.Mechanism, Element]]:
    yield from ((m, e) for e in m.elements() if isinstance(e, base))


def first(value: Any, wrong: Any) -> Any:
    """The value with something wrong in the place of its first number."""
    if not isinstance(value, tuple):
        return wrong
    return (first(value[0], wrong), *value[1:])


def given(value: Any) -> list[Any]:
    return WRONG + ([first(value, wrong) for wrong in INSIDE] if isinstance(value, tuple) and value else [])


CASES = {f"{where} {name}": (one, where, name) for where, name in zoo.CASES}
CASES |= {f"forces in the {w}": (lambda w: all_of(with_forces(w), Force), w) for w in ("space", "plane")}
CASES |= {f"touching in the {w}": (lambda p: all_of(touching(p)), w == "plane") for w in ("space", "plane")}
CASES |= {"others": (lambda: all_of(others()),), "bodies": (lambda: all_of(bodies()),)}
TEXTS = ("relative_to", "body", "body_i", "body_j", "bodies", "coordinate", "coordinates", "joint", "of", "frame")
NO_NUMBERS = ("name", "color", "shape", "interpolation", "beyond", "axes", "x_unit", "y_unit")
LATER = {
    ("JointFriction", "radius"),
    ("WheelOnRail", "vertical"),
    ("WheelOnRail", "lateral"),
}  # their place is refused first


def tried(m: fb.Mechanism, kind: type, fields: dict[str, Any]) -> None:
    trial = m.copy()
    trial.initial = []
    (trial.add if kind is fb.Initial else trial.replace)(kind(**fields))


@pytest.mark.parametrize("case", CASES)
def test_it_is_refused_by_element_and_field(case):
    made, *args = CASES[case]
    for m, e in made(*args):
        fields = {f.name: getattr(e, f.name) for f in dataclasses.fields(e)}
        for name, value in fields.items():
            if name in NO_NUMBERS and not isinstance(value, tuple):
                continue
            for wrong in given(value):
                what = f"{type(e).__name__} {name}={wrong!r}"
                with pytest.raises(fb.ModelError) as error:
                    tried(m, type(e), fields | {name: wrong})
                assert repr(e.name) in str(error.value), what
                assert name in str(error.value) or (type(e).__name__, name) in LATER, f"{what}: {error.value}"


def test_a_law_whose_numbers_make_no_number_is_named():
    """Once "this part is inf", by itself."""
    m = fb.Mechanism("cart", planar=True)
    m.add(fb.Body("b", mass=2, inertia=1), fb.Revolute("P", "ground", "b", at=(0, 0)))
    with pytest.raises(fb.ModelError, match=r"torque of Motor 'M': this part is inf(?s:.*)1/0"):
        m.add(fb.Motor("M", "P", torque="1/0"))
    with pytest.raises(fb.ModelError, match=r"torque of Motor 'M': this part is nan(?s:.*)sqrt"):
        m.add(fb.Motor("M", "P", torque="t + sqrt(-2)"))
    with pytest.raises(fb.ModelError, match=r"torque of Motor 'M': this step has no width(?s:.*)where\(x < 1, y0, y1"):
        m.add(fb.Motor("M", "P", torque="step(t, 1, 0, 1, 5)"))


def test_what_has_no_effect_on_a_joint_is_refused():
    for name in ("Distance", "Universal", "GeneralUniversal", "RollingBall"):
        with pytest.raises(fb.ModelError, match=rf"{name} 'J': axis has no effect"):
            zoo.two_bodies("space").add(getattr(joints, name)("J", "a", "b", **zoo.SPATIAL[name], axis=(1, 0, 0)))
