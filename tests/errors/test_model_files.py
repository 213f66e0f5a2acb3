"""What a wrong model file is answered: the file, the place in it, the rule and what was meant."""

from __future__ import annotations

import contextlib
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

import flyball as fb
from flyball.model.model_files import loads
from flyball.model.snapshot import CATEGORIES

BODY = '[[bodies]]\nname = "crank"\nmass = 1\ninertia = [1, 1, 1]\n'


def message(text: str) -> str:
    with pytest.raises(fb.ModelError) as caught:
        loads(text, fb.Mechanism, "m.toml")
    return str(caught.value)


def test_a_missing_file(tmp_path: Path) -> None:
    (tmp_path / "crank.toml").touch()
    with pytest.raises(fb.ModelError, match=r"there is no file '.*crnk\.toml' \(did you mean 'crank\.toml'\?\)"):
        fb.load(tmp_path / "crnk.toml")
    with pytest.raises(fb.ModelError, match="cannot read"):
        fb.load(tmp_path)
    (tmp_path / "x.toml").write_bytes(b'name = "\xff"')
    with pytest.raises(fb.ModelError, match=r"x\.toml: not a text in UTF-8 \(byte 8\)"):
        fb.load(tmp_path / "x.toml")


def test_malformed_toml_is_shown_with_its_line() -> None:
    assert message('name = "m"\nmass 1.0\n') == (
        "m.toml, line 2: Expected '=' after a key in a key/value pair\n     2 | mass 1.0\n              ^"
    )
    assert message("a = [1,\n\n").startswith("m.toml, line 1: ")
    assert "nested too deep" in message("a = " + "[" * 5000)
    assert message("a = " + "1" * 5000).startswith("m.toml: ")


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        ("bodys = 1", ["m.toml: unknown key 'bodys' (did you mean 'bodies'?)"]),
        ("[[joint]]\nname = 'A'", ["unknown table 'joint' (did you mean 'joints'?)"]),
        ("bodies = 3", ["'bodies' must be tables, each headed [[bodies]]"]),
        ("planar = 'yes'", ["'planar' must be true or false, got 'yes'"]),
        ("name = 3", ["m.toml: the name of a mechanism is a text, not 3"]),
        ("gravity = 9.81", ["m.toml: gravity of 'mechanism' is a vector, for instance (0, 0, -9.81), not 9.81"]),
        ("gravity = [0, -9.81]", ["gravity of 'mechanism': expected 3 components, got 2"]),
        ("gravity = [0, 0, true]", ["a truth value is not a number"]),
        ("parameters = 1", ["'parameters' must be a table"]),
        ("[parameters]\na = true", ["[parameters] 'a' must be a number or a text with a unit, got True"]),
        ("[parameters]\na = '1 furlog'", ["m.toml: parameter 'a'", "unknown unit 'furlog'"]),
        (BODY + BODY, ["m.toml: [[bodies]] 2 'crank' (line 5): Body 'crank': the name is taken by Body 'crank'"]),
        ("[[bodies]]\nmass = 1", ["[[bodies]] 1 (line 1): it has no name"]),
        ("[[bodies]]\nname = 'b'\nmas = 1", ["'b' (line 1)", "unknown field 'mas' (did you mean 'mass'?)"]),
        ("[[bodies]]\nname = 'b'\nmass = '1 m'", ["mass of Body 'b': '1 m': expected a mass [kg], found 'm'"]),
        ("[[bodies]]\nname = 'b'\nmass = 1979-05-27", ["field 'mass' must be a number or a text"]),
        ("[[bodies]]\nname = 'b'\nmass = nan\ninertia = [1, 1, 1]", ["mass of Body 'b': the value is nan"]),
        ("[[bodies]]\nname = 'b'\norientation = 5", ["field 'orientation': give a quaternion"]),
        ("[[bodies]]\nname = 'b'\nmass = 1\ninertia = [[1, 2], [3]]", ["three principal moments or a 3x3 matrix"]),
        ("[[bodies]]\nname = 'b'\nshape = { type = 'Bux' }", ["unknown shape type 'Bux'; there are "]),
        ("[[bodies]]\nname = 'b'\ndensity = 1\nshape = { type = 'Box', edges = [1, 0, 1] }", ["Box: edges must be"]),
        (
            BODY + "[[joints]]\nname = 'A'\ntype = 'Revolut'",
            [
                "m.toml: [[joints]] 1 'A' (line 5): unknown type 'Revolut' (did you mean 'Revolute'?); joints are Cam, Cyl"
            ],
        ),
        (BODY + "[[joints]]\nname = 'A'\ntype = 'Hinge'", ["unknown type 'Hinge' (did you mean 'Revolute'?); joints"]),
        (BODY + "[[forces]]\nname = 'f'", ["[[forces]] 1 'f' (line 5): it has no type; forces are Actuator, Brake"]),
        (
            BODY + "[[joints]]\ntype = 'Spherical'\nname = 'S'\nbody_i = 'ground'\nbody_j = 'crnk'\nat = [0, 0, 0]",
            [
                "m.toml: [[joints]] 1 'S' (line 5): Spherical 'S': body_j: there is no body or frame named 'crnk' (did you mean 'crank'?)"
            ],
        ),
        ("[[drivers]]\nname = 'd'\ncoordinate = 3\nlaw = 2", ["field 'coordinate' must be a text, got 3"]),
        ("[[initial]]\nname = 'A.angle'\nvalue = 1", ["there is no joint named 'A'"]),
    ],
)
def test_a_wrong_model_is_answered_with_its_place(text: str, parts: list[str]) -> None:
    said = message(text)
    assert said.startswith("m.toml: ")
    for part in parts:
        assert part in said


values = st.recursive(
    st.one_of(st.integers(-2, 3), st.sampled_from([0.5, True, "b", "1 m", "2*x", "", "ground", "Revolute", "Box"])),
    lambda inner: (
        st.lists(inner, max_size=4) | st.dictionaries(st.sampled_from(["type", "name", "edges"]), inner, max_size=2)
    ),
    max_leaves=6,
)
fields = st.sampled_from(
    [
        "name",
        "type",
        "mass",
        "inertia",
        "position",
        "orientation",
        "angle",
        "shape",
        "com",
        "body",
        "body_i",
        "body_j",
        "at",
        "axis",
        "axes",
        "joint",
        "torque",
        "force",
        "coordinate",
        "law",
        "value",
        "rate",
        "stiffness",
        "angular_velocity",
        "inertia_axes",
    ]
)


@given(
    category=st.sampled_from(CATEGORIES),
    table=st.dictionaries(fields, values, max_size=6),
    kind=st.sampled_from(["Revolute", "Distance", "Universal", "SpringDamper", "PointForce", "PointTorque", "Motor"]),
    planar=st.booleans(),
)
def test_nothing_but_a_model_error_ever_comes_out(category: str, table: dict, kind: str, planar: bool) -> None:
    from flyball.model.model_files import _value

    body = {"name": "b", "mass": 1, "inertia": 1 if planar else [1, 1, 1]}
    table = {"name": "x"} | ({"type": kind} if category in ("joints", "forces") else {}) | table
    text = f"planar = {_value(planar)}\n"
    for header, fields in (("bodies", body), (category, table)):
        text += f"[[{header}]]\n" + "".join(f"{k} = {_value(v)}\n" for k, v in fields.items())
    with contextlib.suppress(fb.ModelError):
        loads(text, fb.Mechanism, "m.toml")


MODEL = 'import flyball as fb\n{} = fb.Mechanism("made", planar=True)\n'


@pytest.mark.parametrize("ways", ["m", "mechanism", "def"])
def test_a_python_file_is_loaded_as_the_command_does(ways: str, tmp_path: Path, capsys) -> None:
    text = MODEL.format("m" if ways == "m" else "mechanism")
    if ways == "def":
        text = 'import flyball as fb\nprint("made")\ndef mechanism():\n    return fb.Mechanism("made")\n'
    (tmp_path / "model.py").write_text(text)
    assert fb.load(tmp_path / "model.py").name == "made"
    assert fb.load(str(tmp_path / "model.py")).name == "made"
    assert capsys.readouterr().out == ""


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("x = 1\n", "defines no mechanism: name one m or mechanism"),
        ("x = 1\n1/0\n", r"model\.py, line 2: ZeroDivisionError"),
        ("def f(:\n", r"model\.py, line 1: SyntaxError"),
        (MODEL.format("m") + "m.add(fb.Body('b', mass=-1, inertia=1))\n", r"model\.py, line 3: Body 'b': mass is -1"),
        ("raise SystemExit(3)\n", r"model\.py, line 1: SystemExit"),
    ],
)
def test_a_wrong_python_file_is_answered_with_its_line(text: str, says: str, tmp_path: Path) -> None:
    (tmp_path / "model.py").write_text(text)
    with pytest.raises(fb.ModelError, match=says):
        fb.load(tmp_path / "model.py")


@pytest.mark.parametrize("path", [None, 5, 1j, [], object()])
@pytest.mark.parametrize("load", [fb.load, fb.load_result])
def test_what_is_no_path(load, path) -> None:
    with pytest.raises(fb.ModelError, match="file is a text or a path, not"):
        load(path)


def test_a_misspelt_python_file(tmp_path: Path) -> None:
    (tmp_path / "model.py").write_text("")
    with pytest.raises(fb.ModelError, match=r"no file '.*modle\.py' \(did you mean 'model\.py'"):
        fb.load(tmp_path / "modle.py")
