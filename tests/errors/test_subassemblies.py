"""Copies of mechanisms that are refused: the message names the part, the rule and a remedy, and nothing is added."""

import re

import pytest

import flyball as fb
from flyball.model.model_files import loads
from flyball.model.snapshot import picklable_state

GRAVITY = (0, 0, -9.81)


def part(*elements, planar=False, **settings) -> fb.Mechanism:
    m = fb.Mechanism("part", planar=planar, gravity=GRAVITY[: 2 if planar else 3], **settings)
    if planar:
        m.add(fb.Body("bar", mass=1, inertia=1), fb.Revolute("A", "ground", "bar", at=(0, 0)))
    else:
        m.add(fb.Body("bar", mass=1, inertia=(1, 1, 1)), fb.Spherical("A", "ground", "bar", at=(0, 0, 0)))
    m.add(*elements)
    return m


def law(t, side):
    return t * side


CASES = {
    "no prefix": (part(), {}, "prefix is None; give one word"),
    "no word": (part(), {"prefix": "a b"}, "prefix is 'a b'; give one word"),
    "reserved": (part(), {"prefix": "ground"}, "prefix 'ground' is taken by flyball"),
    "of a part": (part(), {"prefix": "base"}, "prefix 'base' is taken by Body 'base'; give another word"),
    "no body": (part(), {"prefix": "p", "on": "bass"}, r"no body named 'bass' \(did you mean 'base'\?\)"),
    "unknown parameter": (
        part(parameters={"stiffness": 1}), {"prefix": "p", "parameters": {"stifness": 2}},
        r"it has no parameter 'stifness' \(did you mean 'stiffness'\?\)",
    ),
    "unknown name": (part(parameters={"k": 1}), {"prefix": "p", "parameters": {"k": "2*q"}}, "unknown name 'q'"),
    "plane": (part(planar=True), {"prefix": "p"}, "it is planar, and that is spatial"),
    "gravity": (fb.Mechanism("p", gravity=(0, -9.81, 0)), {"prefix": "p"}, "one mechanism has one gravity"),
    "mirror": (part(), {"prefix": "p", "mirror": "w"}, "mirror is 'w'; give the coordinate that changes its sign: x, y, z"),
    "angle": (part(), {"prefix": "p", "angle": 1}, "give orientation=, not angle="),
    "at": (part(), {"prefix": "p", "at": (1, 2)}, "at has 3 components"),
    "turned by a parameter": (
        part(), {"prefix": "p", "orientation": ("q", 0, 0)}, "a rotation does not follow parameters"
    ),
    "roll": (
        part(fb.Limit("stop", "A.roll", upper=1)), {"prefix": "p", "orientation": (0.3, 0, 0.2)},
        "Limit 'stop' of 'part' cannot be turned in 'p': 'A.roll' has no counterpart there",
    ),
    "function": (
        part(fb.Sensor("side", "bar.y"), fb.PointForce("push", "bar", force=(0, law, 0))), {"prefix": "p"},
        "PointForce 'push' of 'part' cannot be placed in 'p': its law is the Python function 'law' of 'side'",
    ),
    "energy": (part(fb.Sensor("sum", "energy.total")), {"prefix": "p"}, "energies are those of the whole mechanism"),
    "ground": (
        part(fb.Ground("floor", shape=fb.Plane())), {"prefix": "p", "on": "base"},
        "Ground 'floor' of 'part' cannot be placed in 'p': parts of ground cannot move with 'base'",
    ),
    "landscape": (
        part(fb.Body("hill", mass=1, inertia=(1, 1, 1), shape=fb.HeightField(heights=[[0, 1], [1, 0]], dx=1))),
        {"prefix": "p", "mirror": "x"}, "Body 'hill' of 'part' cannot be reflected in 'p'.*has no mirror image",
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", CASES)
def test_a_copy_is_refused_and_nothing_is_added(case):
    given, how, message = CASES[case]
    m = fb.Mechanism("whole", gravity=GRAVITY, parameters={"known": 1})
    m.add(fb.Body("base", mass=1, inertia=(1, 1, 1)))
    before = picklable_state(vars(m.copy()))
    with pytest.raises(fb.ModelError, match=message):
        m.add(given, **how)
    assert picklable_state(vars(m)) == before


def test_groups_and_parts_have_different_names():
    m = fb.Mechanism("m", gravity=GRAVITY)
    m.add(part(), prefix="left")
    for name in ("left", "left.bar.pin"):
        with pytest.raises(fb.ModelError, match="would be the name of a part and of a group of parts"):
            m.add(fb.Body(name, mass=1, inertia=(1, 1, 1)))
    with pytest.raises(fb.ModelError, match="'left' is a group of parts; name one: left"):
        m["left"]
    with pytest.raises(fb.ModelError, match="are for one mechanism"):
        m.add(fb.Body("b", mass=1, inertia=(1, 1, 1)), prefix="x")


FILES = {
    "neither": ('[[assemblies]]\nprefix = "a"', "[[assemblies]] 1 'a' (line 2): give file=, or of="),
    "no definition": ('[[assemblies]]\nprefix = "a"\nof = "b"', "there is no definition 'b'"),
    "field": ('[[assemblies]]\nprefix = "a"\nmirrors = "x"', "unknown field 'mirrors' (did you mean 'mirror'?)"),
    "count": ('[[bodies]]\nname = "a"\nrepeat = 0', "repeat is 0; give a whole number from 1"),
    "braces": ('[[bodies]]\nname = "a{k}"\nrepeat = 2', "unknown name 'k'"),
}


@pytest.mark.parametrize("case", FILES)
def test_wrong_tables_are_refused(case):
    text, message = FILES[case]
    with pytest.raises(fb.ModelError, match=re.escape(message)):
        loads('name = "m"\n' + text, fb.Mechanism)
