"""Wrong laws, tables and Python functions of elements are refused by name."""

import pytest

import flyball as fb
from tests.errors.test_new_elements import SQUARE, Z, plane, space

LAWS = {
    "reaction": ("A.fx", "known only after the accelerations are; laws can use positions, angles, lengths"),
    "acceleration": ("arm.ax", "known only after the accelerations are"),
    "energy": ("energy.kinetic", "known only after the accelerations are"),
    "spring's force": ("spring.force", "known only after the accelerations are"),
}


@pytest.mark.parametrize("what", LAWS)
def test_a_law_cannot_use_what_depends_on_accelerations(what):
    of, message = LAWS[what]
    m = plane()
    m.add(fb.Sensor("s", of))
    with pytest.raises(fb.ModelError, match=f"force of Actuator 'k': sensor 's' measures '{of}', which is {message}"):
        m.add(fb.Actuator("k", "S.displacement", force="2*s"))


def test_a_driver_follows_no_rate_nor_itself():
    m = plane()
    m.add(fb.Sensor("turn", "A.rate"), fb.Sensor("place", "S.displacement"))
    with pytest.raises(fb.ModelError, match=r"law of Driver 'k': sensor 'turn' measures 'A.rate', a rate;.*controller"):
        m.add(fb.Driver("k", "S.displacement", "turn"))
    with pytest.raises(fb.ModelError, match=r"Driver 'k': its law names sensor 'place'.*cannot follow what it drives"):
        m.add(fb.Driver("k", "S.displacement", "place + 1"))


def test_a_name_with_two_meanings_is_refused_where_it_is_used():
    m = plane()
    m.add(fb.Sensor("value", "A.angle"))
    with pytest.raises(fb.ModelError, match=r"force of Actuator 'k': 'value' is an input.*and also a sensor; rename"):
        m.add(fb.Actuator("k", "S.displacement", force="value"))


def test_misused_tables():
    m = plane()
    m.add(fb.Table("lift", x=[0, 1], y=[0, 1]))
    for law, message in {
        "3*lift": r"'lift' is a table(.|\n)*give its argument: lift\(x\)",
        "lift(t, 2)": r"wrong arguments: 2 given(.|\n)*write lift\(x\)",
        "lift()": "wrong arguments: 0 given",
    }.items():
        with pytest.raises(fb.ExpressionError, match=f"force of Actuator 'k': {message}"):
            m.add(fb.Actuator("k", "S.displacement", force=law))
    m.add(fb.Table("kinked", x=[0, 0.5, 1], y=[0, 1, 0], interpolation="linear"))
    m.add(fb.Driver("D", "S.displacement", "kinked(t)"))
    with pytest.raises(
        fb.SimulationError, match=r"Driver 'D' cannot be followed beyond t = 0.5 s.*jumps in its rate, f"
    ):
        m.simulate(1.0)


PYTHON = {
    "unknown argument": (lambda t, lenght: t, r"unknown name 'lenght'(.|\n)*arguments select its inputs"),
    "any arguments": (lambda *a: a, r"takes any number of arguments \(\*a\); name those"),
    "a class": (float, "'float' is a class; give a function"),
    "too many": (lambda t, value, rate, r, a=1, b=2, c=3, *, d: t, "'d' by keyword only; remove the"),
}


@pytest.mark.parametrize("what", PYTHON)
def test_python_functions_that_are_no_laws(what):
    law, message = PYTHON[what]
    with pytest.raises(fb.ModelError, match=f"force of Actuator 'k': (.|\n)*{message}"):
        plane().add(fb.Actuator("k", "S.displacement", force=law))


def test_a_driver_takes_no_python_function():
    with pytest.raises(
        fb.ModelError, match=r"law of Driver 'k' is the Python function 'lambda', which gives no derivatives.*Table"
    ):
        plane().add(fb.Driver("k", "A.angle", lambda t: t))


def test_fields_given_by_place_that_go_by_name():
    with pytest.raises(fb.ModelError, match="Actuator 'k': give field 'force' by its name: force="):
        fb.Actuator("k", "S.displacement", "3*t")


def test_sensors_name_curves_that_results_have():
    """What a sensor may name is what the result shows, part by part."""
    from flyball.model.quantities import quantities

    m = plane()
    m.add(fb.GearPair("G", "A", "W", teeth=(1, 2)), fb.Driver("D", "S.displacement", "0.1*t"), fb.IMU("imu", "eye"))
    m.add(fb.Sensor("s", "A.angle"), fb.Motor("M", "A", torque=1), fb.JointFriction("F", "S", static=0.1))
    m.add(fb.Cam("C", "cart", "ground", points=[(2 + x, y) for x, y in SQUARE], at=(3, 0)))
    m.joints.remove(m["C"])
    r = m.simulate(0.1, outputs=3)
    for e in m.elements():
        assert list(r[e.name].channels()) == [k for k, x in quantities(m, e.name).items() if x.curve], e.name
    assert list(r.energy.channels()) == [k for k, x in quantities(m, "energy").items() if x.curve]
    m = space()
    m.add(fb.Cylindrical("cyl", "a", "d", at=(0, 0, 0), axis=Z), fb.IMU("imu", "b"))
    r = m.simulate(0.1, outputs=3)
    for e in m.elements():
        assert list(r[e.name].channels()) == [k for k, x in quantities(m, e.name).items() if x.curve], e.name


@pytest.mark.parametrize(
    ("table", "kind", "right"), [("forces", "Ratchet", "limits"), ("joints", "GearPair", "couplings")]
)
def test_a_type_in_the_wrong_table_is_told_the_right_one(tmp_path, table, kind, right):
    path = tmp_path / "wrong.toml"
    path.write_text(f'name = "wrong"\n[[{table}]]\ntype = "{kind}"\nname = "x"\n', encoding="utf-8")
    with pytest.raises(fb.ModelError, match=rf"'x' .*a {kind} belongs in a table \[\[{right}\]\]"):
        fb.load(path)
