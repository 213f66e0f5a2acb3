"""Refusals of tyres and roads, each with its element, value and remedy."""

import pytest

import flyball as fb
from tests.verification.published_tyres import MF61

FIALA = {"radius": 0.3, "stiffness": 2e5, "nominal_load": 4e3, "slip_stiffness": 8e4, "cornering_stiffness": 6e4}


def with_tyre(model=None, planar=False, road=None, **more):
    m = fb.Mechanism("one wheel", gravity=(0, 0, -9.81) if not planar else (0, -9.81), planar=planar)
    at = (0, 0.28) if planar else (0, 0, 0.28)
    m.add(fb.Body("wheel", mass=400, inertia=10 if planar else (10, 20, 10), position=at))
    m.add(*([road] if road else []))
    m.add(fb.Tyre("rubber", "road" if road else "ground", "wheel", model=model or fb.FialaTyre(**FIALA), **more))
    return m


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"planar": True}, "Tyre 'rubber': a tyre is for spatial mechanisms"),
        ({"axis": (0, 1, 0)}, "axis needs the wheel's centre"),
        ({"points": 3}, "points is 3 and patch 0 m"),
        ({"patch": 0.1}, "give one point without a patch"),
        ({"side": "left"}, "FialaTyre is symmetric, so side has no effect"),
        ({"low_speed": 0.0}, "low_speed is 0 m/s; it must be greater than 0"),
        ({"model": fb.FialaTyre(**(FIALA | {"stiffness": -1.0}))}, "FialaTyre: stiffness is -1 N/m"),
        ({"model": fb.FialaTyre(**FIALA, friction=0.0)}, "friction is 0; it must be greater"),
        ({"model": fb.MagicFormula()}, "give the path of a tyre property file|UNLOADED_RADIUS"),
        ({"model": fb.MagicFormula(coefficients={"PCX1": 1.0})}, "UNLOADED_RADIUS, FNOMIN.* missing"),
        ({"model": fb.MagicFormula(coefficients=MF61 | {"PKX9": 1.0})}, "unknown coefficient 'PKX9'"),
        ({"model": fb.MagicFormula(coefficients=MF61 | {"PKY1": 15.0})}, "PKY1 is 15; in the ISO axes"),
        ({"model": fb.MagicFormula(path="nowhere.tir")}, "nowhere.tir cannot be read"),
        ({"road": fb.Road("road", beyond="hold")}, "a plane has no edges"),
        ({"road": fb.Road("road", friction=-0.5)}, "friction is -0.5; it must be greater than 0"),
        ({"road": fb.Road("road", surface=fb.RandomRoad(roughness="Z", length=100))}, "give a class of ISO 8608"),
        ({"road": fb.Road("road", surface=fb.RoadProfile(heights=[0.0], spacing=1.0))}, "two or more finite numbers"),
        ({"road": fb.Road("road", surface=fb.OpenCRG(path="none.crg"))}, "none.crg cannot be read"),
    ],
)
def test_refused(options, message):
    with pytest.raises(fb.ModelError, match=message):
        with_tyre(**options).assemble()


def tir(tmp_path, text="", **changed):
    lines = ["[UNITS]", "LENGTH = 'meter'", "[MODEL]", "FITTYP = 61 $version"]
    lines += [f"{k} = {v} $comment" for k, v in (MF61 | changed).items()]
    path = tmp_path / "tyre.tir"
    path.write_text("\n".join(lines) + "\n" + text)
    return path


def test_files_of_tyres(tmp_path):
    m = with_tyre(fb.MagicFormula(path=tir(tmp_path, "FZMIN = 100\nFZMAX = 3000\nKPUMIN = -1.5\nKPUMAX = 1.5\n")))
    run = m.simulate(0.2)
    assert any("load is" in x and "beyond the range 100 to 3000" in x for x in run.health.warnings)
    m.save(tmp_path / "m.toml")
    assert fb.load(tmp_path / "m.toml") == m


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("LENGTH = 'mm'\n", "LENGTH = 'mm'; only files in SI units"),
        ("FITTYP = 2\n", "FITTYP = 2; it must be of the Magic Formula"),
        ("PCX1 = abc\n", "PCX1 is 'abc', which is no number"),
    ],
)
def test_wrong_files(tmp_path, text, message):
    with pytest.raises(fb.ModelError, match=message):
        with_tyre(fb.MagicFormula(path=tir(tmp_path, text))).assemble()


def test_unknown_coefficients_of_a_file_are_named(tmp_path):
    with pytest.warns(UserWarning, match="do not use: PKX7"):
        with_tyre(fb.MagicFormula(path=tir(tmp_path, "PKX7 = 1.0\n"))).assemble()


def test_inverse_dynamics_says_what_to_do():
    m = with_tyre()
    with pytest.raises(
        fb.ModelError, match=r"Tyre 'rubber', and inverse_dynamics does not support.*forces with states"
    ):
        m.inverse_dynamics([0.0])


MAP = {"speeds": (0, 300), "throttles": (0, 1), "torques": ((-10, 100), (-10, 100)), "throttle": 1}
BOX = {"ratios": (4, 2), "capacity": 500}
PATH = [(0, 0), (10, 0), (20, 0), (30, 0)]


@pytest.mark.parametrize(
    ("part", "message"),
    [
        (lambda: fb.EngineMap("e", "a", **(MAP | {"throttles": (0.1, 1)})), "begins at 0, the closed throttle"),
        (lambda: fb.EngineMap("e", "a", **MAP, idle=100, limit=104), "limit must exceed the idle speed"),
        (lambda: fb.EngineMap("my engine", "a", **MAP), "give it a name of one word"),
        (lambda: fb.EngineMap("e", "a", **(MAP | {"torques": ((1, 2),)})), "e_map.*2 rows of 2"),
        (lambda: fb.GearBox("g", "a.angle", "b.angle", **(BOX | {"ratios": (4,)})), "give two or more"),
        (lambda: fb.GearBox("g", "a.angle", "b.angle", **BOX, gear=3), "gear is 3; it must be from 0, neutral, to 2"),
        (lambda: fb.GearBox("g", "a.angle", "b.angle", **BOX, up=100, down=60), "give up more than 2 times down"),
        (lambda: fb.GearBox("g", "a.angle", "b.angle", **(BOX | {"ratios": (1, 2)}), up=9), "positive and descend"),
        (lambda: fb.SpeedDriver("d", setpoint=1, measured="a.rate", kp=0, ki=1), "kp is 0"),
        (lambda: fb.PathDriver("d", "one", path=PATH[:3], wheelbase=2), "four or more points"),
        (lambda: fb.PathDriver("d", "one", path=[*PATH, (30, 0)], wheelbase=2), "points 4 and 5 of the path are both"),
        (lambda: fb.PathDriver("d", "other", path=PATH, wheelbase=2), "no body named 'other'"),
    ],
)
def test_refused_parts_of_drivelines(part, message):
    m = fb.Mechanism("line", planar=True, gravity=(0, 0))
    for k, (name, joint) in enumerate((("one", "a"), ("two", "b"))):
        m.add(fb.Body(name, mass=1, inertia=1, position=(k, 0)), fb.Revolute(joint, "ground", name, at=(k, 0)))
    with pytest.raises(fb.ModelError, match=message):
        m.add(part())
    assert not m.forces and not m.controllers and not m.frames and not m.tables
