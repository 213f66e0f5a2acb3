"""Model files come back exactly as they were saved."""

from __future__ import annotations

import math
import struct
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

import flyball as fb
from flyball.model.element import Element, written_fields
from flyball.model.model_files import dumps, loads

numbers = st.floats(-1e9, 1e9, allow_nan=False)
positive = st.floats(1e-9, 1e9)
texts = st.text(st.characters(exclude_categories=["Cs"]), min_size=1).filter(
    lambda s: s == s.strip() and "." not in s and s not in ("ground", "energy", "t", "time")
)


def planar() -> fb.Mechanism:
    m = fb.Mechanism(
        "slider crank", planar=True, gravity=(0, "-9.81 m/s^2"), parameters={"k": "2 kN/m", "r": 0.1 + 0.2}
    )
    m.add(fb.Body("crank", mass=1, inertia="10 g*m^2", com=(0.1, 0), angle="30 deg", color="#ff8800", as_drawn=True))
    m.add(fb.Body("slider", mass=1 / 3, inertia=0, position=(1, -0.0)))
    m.add(fb.Body("tip", shape=[fb.Box(edges=(1, 2, 3)), fb.Sphere(radius="5 mm")], density=7.85e3))
    m.add(fb.Frame("eye", "crank", position=("r", "2*r"), angle=math.pi))
    m.add(fb.Revolute("A", "ground", "crank", at=(0, 0), angle="10 deg"))
    m.add(fb.Translational("D", "ground", "slider", at=(1, 0), axis=(1, 0)))
    m.add(fb.Distance("rod", "eye", "slider", length=1.0000000000000002))
    m.add(fb.SpringDamper("spring", "slider", "tip", at=((1, 0), (2, 0)), stiffness="k", force="3*sin(t)"))
    m.add(fb.Motor("motor", "A", torque="5 - rate"), fb.PointForce("push", "tip", force=(1, "t"), axes="body"))
    m.add(fb.Driver("drive", "slider.x", "1 + 0.1*t"), fb.Initial("A.angle", value="20 deg", rate=-1))
    return m


def spatial() -> fb.Mechanism:
    m = fb.Mechanism("arm", gravity=(0, 0, -9.81))
    J = ((1.0, 0.1, 0.0), (0.1, 1.0, 0.0), (0.0, 0.0, 1.5))
    m.add(fb.Body("a", mass=2, inertia=J, orientation=("30 deg", 0, 0), angular_velocity=(0.1, 0.2, 0.3)))
    m.add(fb.Body("b", mass=2, shape=fb.Cone(radius=1, height=2, position=(0, 0, 1), orientation=(0, 1, 0, 0))))
    m.add(fb.Universal("U", "a", "b", at=(0, 0, 1), axes=((1, 0, 0), (0, 1, 0)), angle_2="5 deg"))
    m.add(fb.Spherical("S", "ground", "a", at=(0, 0, 0)))
    return m


@pytest.mark.parametrize("make", [planar, spatial])
def test_a_saved_mechanism_comes_back(make, tmp_path: Path) -> None:
    m = make()
    m.save(tmp_path / "m.toml")
    back = fb.load(tmp_path / "m.toml")
    assert isinstance(back, fb.Mechanism)
    assert back == m
    assert dumps(back) == dumps(m) == (tmp_path / "m.toml").read_text(encoding="utf-8")


def test_the_file_reads_well() -> None:
    text = dumps(planar())
    assert text.startswith(
        'name = "slider crank"\nplanar = true\ngravity = [0, "-9.81 m/s^2"]\n\n[parameters]\nk = "2 kN/m"\n'
    )
    assert '[[joints]]\ntype = "Revolute"\nname = "A"\nbody_i = "ground"\nbody_j = "crank"\nat = [0.0, 0.0]\n' in text
    assert 'shape = [{type = "Box", edges = [1.0, 2.0, 3.0]}, {type = "Sphere", radius = "5 mm"}]' in text
    assert 'force = "3*sin(t)"' in text


def test_many_shapes_stand_one_a_line() -> None:
    m = fb.Mechanism("m")
    m.add(fb.Body("b", density=1, shape=[fb.Box(edges=(k, 1, 1), position=(k, 0, 0)) for k in (1, 2, 3)]))
    assert dumps(m).count("\n    {type =") == 3
    assert loads(dumps(m), fb.Mechanism) == m


def bits(x: float) -> bytes:
    return struct.pack("<d", x)


@given(x=numbers, y=numbers, mass=positive, name=texts, color=st.from_regex(r"\A#[0-9a-fA-F]{6}\Z"))
def test_numbers_and_names_survive_bit_for_bit(x: float, y: float, mass: float, name: str, color: str) -> None:
    m = fb.Mechanism(name, planar=True, gravity=(x, y), parameters={"p": y})
    m.add(fb.Body(name, mass=mass, inertia=mass, position=(x, y), angle=x, color=color))
    back = loads(dumps(m), fb.Mechanism)
    assert back == m
    for a, b in ((back.bodies[0], m.bodies[0]),):
        assert [*map(bits, (*a.position, a.mass, a.angle))] == [*map(bits, (*b.position, b.mass, b.angle))]
    assert [*map(bits, (*back.gravity, back.parameters["p"]))] == [*map(bits, (x, y, y))]


def test_every_kind_of_joint_and_force_is_found_by_its_name() -> None:
    known = {k for k, c in Element.registry.items() if c.category in ("joints", "forces") and hasattr(fb, k)}
    assert {"Revolute", "Prismatic", "Distance", "SpringDamper", "Motor"} <= known
    for kind in known & {"Revolute", "Fixed"}:
        m = loads(
            f'planar = true\n[[bodies]]\nname = "b"\nmass = 1\ninertia = 1\n'
            f'[[joints]]\ntype = "{kind}"\nname = "J"\nbody_i = "ground"\nbody_j = "b"\nat = [0, 0]',
            fb.Mechanism,
        )
        assert type(m["J"]).__name__ == kind


def test_defaults_are_left_out() -> None:
    assert written_fields(fb.Body("b", mass=1.0, inertia=2.0)) == {"name": "b", "mass": 1.0, "inertia": 2.0}


def test_what_has_no_place_in_a_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(fb.ModelError, match="cannot write"):
        planar().save(tmp_path / "no" / "such" / "folder.toml")
    with pytest.raises(fb.ModelError, match="a text contains"):
        dumps(fb.Mechanism("\ud800"))


def test_a_description_is_not_saved_as_a_program(tmp_path):
    """It would be run as one when it is loaded."""
    with pytest.raises(fb.ModelError, match=r"ending '\.py' is not known here; it must be \.toml"):
        fb.Mechanism("crane").save(tmp_path / "crane.py")
