"""What stands behind a number and a unit: never silently a unit where it could be a name."""

import math
import re
import warnings

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import flyball as fb
from flyball.errors import ExpressionError, ModelError, UnitError
from flyball.model.expressions import law_expression, number, resolve_parameters
from flyball.model.units import KINDS, to_si

NAMES = ["t", "x", "v", "h", "s", "m", "g", "k", "a", "b", "c", "d", "l", "u", "K", "N", "R", "T", "deg", "mm", "rate"]
UNITS = ["N", "mm", "m", "m/s", "m/s^2", "rpm", "deg", "kN/m", "kg", "N*m", "1/s", "rad/s", "J"]
SI = {"N": 1, "mm": 1e-3, "m": 1, "m/s": 1, "m/s^2": 1, "rpm": math.pi / 30, "deg": math.pi / 180, "kN/m": 1e3}
SI |= {"kg": 1, "N*m": 1, "1/s": 1, "rad/s": 1, "J": 1}


def value(text: str, dimension: str | None, names: dict[str, float]) -> float:
    law = law_expression(text, dimension, "law", names=names)
    law.require({"t", *names})
    return law.evaluate({"t": 2.0, **names})


@pytest.mark.parametrize(
    ("text", "dimension", "remedy"),
    [
        ("60 rpm*t", "rad", "(60 rpm)*t"),
        ("2 m/s^2*t", "N", "(2 m/s^2)*t"),  # as tonnes it would fit
        ("2 m/s^2 t", "N", "(2 m/s^2)*t"),
        ("5 t*m/s^2", "N", "5*t*m/s^2"),
        ("2 N*sin(t)", "N", "(2 N)*sin(t)"),
        ("60rpm*(t-1)", "rad", "(60 rpm)*(t-1)"),
        ("3 m/s*s", "m", "(3 m/s)*s"),
        ("30 deg*pi", "rad", "(30 deg)*pi"),
        ("2 k", None, "2*k"),  # no multiple of Boltzmann's constant
        ("2 N/k", None, "(2 N)/k"),
    ],
)
def test_a_name_behind_a_unit_is_refused_with_the_product_that_was_meant(text, dimension, remedy):
    names = {"s": 7.0, "k": 3.0}
    with pytest.raises(UnitError, match=re.escape(f"write '{remedy}'")):
        value(text, dimension, names)
    if text != "5 t*m/s^2":
        assert math.isfinite(value(remedy, dimension, names))
    with pytest.raises(ExpressionError):
        value(f"1 + ({text})", dimension, names)


def test_usual_units_stay_what_they_are_beside_such_names():
    beside = {"m": 3.0, "g": 9.81, "s": 2.0, "N": 5.0, "h": 1.0}
    for text, dimension, si in (
        ("250 g", "kg", 0.25),
        ("250 g", None, 0.25),
        ("5 N*m", "N*m", 5.0),
        ("5 kN*m", None, 5000.0),
        ("5 N*m", "N*m/rad", 5.0),
        ("20 mm/s", "m/s", 0.02),
        ("3 kg*m^2", "kg*m^2", 3.0),
        ("2 kg*m/s^2", "N", 2.0),
        ("2 h", "s", 7200.0),
    ):
        assert number(text, beside, dimension, "x") == pytest.approx(si)
        assert value(text, dimension, beside) == pytest.approx(si)
    assert resolve_parameters({"m": "2 kg", "torque": "5 N*m"})["torque"] == 5.0
    with pytest.raises(UnitError, match=r"parameter 'p'.*'k' is a name here"):
        resolve_parameters({"k": 2, "p": "2 k"})
    with pytest.raises(UnitError, match="unknown unit 'k'"):
        resolve_parameters({"p": "2 k"})


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("(60 rpm)*t", 4 * math.pi),
        ("sin(30 deg)", 0.5),
        ("step(t, 1 s, 0, 3000 ms, 30 deg)", math.pi / 12),
        ("x*(2 kN/m) + max(-5 mm, 1 cm)", 6000.01),
        ("where(t < (3 s), (5 mm), 0)", 0.005),
        ("(-5 mm)/(2)", -0.0025),
        ("(5 N)*m", 20.0),
    ],
)
def test_quantities_in_formulas_stand_in_parentheses(text, expected):
    assert value(text, None, {"x": 3.0, "m": 4.0}) == pytest.approx(expected)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("(2 foo)*t", ["unknown unit 'foo'", "    (2 foo)*t\n     ^^^^^\n"]),
        ("2*30 deg", ["in parentheses, here (30 deg)"]),
        ("2**", ["in parentheses, as in (60 rpm)*t"]),
        ("é*(2 foo)", ["    é*(2 foo)\n       ^^^^^\n"]),
        ("(5 N)*q + (3 m)", ["unknown name 'q'", "    (5 N)*q + (3 m)\n          ^\n"]),
        ("2 N + 3 N", ["a quantity must be in parentheses"]),
    ],
)
def test_wrong_quantities_in_formulas(text, says):
    with pytest.raises(ModelError) as error:
        value(text, "N", {"é": 1.0})
    assert all(word in str(error.value) for word in says), str(error.value)


@settings(max_examples=400, deadline=None, derandomize=True, database=None)
@given(
    st.sampled_from(UNITS),
    st.sampled_from(NAMES),
    st.sampled_from(["*", "/", " ", " * ", "**", "^", "·"]),
    st.sampled_from([None, *KINDS]),
)
def test_no_name_is_silently_a_unit(unit, name, operation, dimension):
    """Refused; or the name belongs to the unit that is asked for, and the value is that of the whole unit."""
    text = f"3 {unit}{operation}{name}"
    names = {n: 7.0 for n in NAMES if n != "t"}
    try:
        found = value(text, dimension, names)
    except ModelError:
        pass
    else:
        assert name in ("m", "s", "K", "N"), text
        assert found == to_si(text, dimension)
    if operation in "*/":
        product = value(f"(3 {unit}){operation}{name}", dimension, names)
        other = 2.0 if name == "t" else 7.0
        assert product == pytest.approx(3 * SI[unit] * other if operation == "*" else 3 * SI[unit] / other)


def test_a_force_that_grows_with_time_grows():
    """Once a constant 2000 N: x = F' t^3 / 6 m."""
    m = fb.Mechanism("cart", planar=True)
    m.add(fb.Body("b", mass=2, inertia=1), fb.Prismatic("P", "ground", "b", at=(0, 0), axis=(1, 0)))
    with pytest.raises(fb.UnitError, match=r"force of Actuator 'A'.*write '\(2 m/s\^2\)\*t'"):
        m.add(fb.Actuator("A", "P.displacement", force="2 m/s^2*t"))
    m.add(fb.Actuator("A", "P.displacement", force="(2 N)*t"))
    assert m.simulate(3.0, outputs=2)["P"].displacement[-1] == pytest.approx(4.5, rel=1e-9)


@pytest.mark.parametrize("text", ["95.5 rpm*t", "5 rpm t", "9.81 m/s^2*t", "2*(60 rpm*t)", "3 t*rpm", "2 N*t"])
def test_time_behind_a_unit_is_no_tonne_in_a_parameter(text):
    with pytest.raises(fb.ModelError, match=r"parameter 'speed': .*'t' after a unit is time.*write '.*t.*' there"):
        fb.Mechanism("a", planar=True, parameters={"speed": text}).environment()


@pytest.mark.parametrize(
    ("text", "value"), [("5 t", 5000.0), ("1 t/m^3", 1000.0), ("2 t*m^2", 2000.0), ("2*(5 t)", 1e4), ("2 N*s", 2.0)]
)
def test_tonnes_and_units_that_look_like_names_stay_what_they_are(text, value):
    assert fb.Mechanism("a", planar=True, parameters={"x": text}).environment()["x"] == value


def test_time_behind_a_unit_is_no_tonne_in_a_field():
    with pytest.raises(fb.UnitError, match=r"mass of Body 'b': '5 kg\*t': 't' after a unit is time"):
        fb.Mechanism("a", planar=True).add(fb.Body("b", mass="5 kg*t", inertia=1.0))


def _with_parameters(**values):
    m = fb.Mechanism("a", planar=True, parameters=values)
    m.add(fb.Body("b", mass=1, inertia=1), fb.Revolute("A", "ground", "b", at=(0, 0)))
    return m


@pytest.mark.parametrize(
    ("text", "add", "message"),
    [
        ("50 cm", lambda: fb.Body("c", mass="L", inertia=1), "mass of Body 'c': the parameter 'L' is '50 cm': expected a"),
        ("30 deg", lambda: fb.Body("c", mass=1, inertia=1, position=("L", 0)), "position of Body 'c'.*expected a length"),
        ("2 N/mm", lambda: fb.Body("c", mass=1, inertia=1, shape=fb.Box(edges=("L", 1, 1))), "edges of Box.*a length"),
        ("3 N", lambda: fb.Motor("M", "A", torque="L"), "torque of Motor 'M': the parameter 'L' is '3 N': expected a torque"),
    ],
)  # fmt: skip
def test_a_parameter_of_another_kind_is_refused(text, add, message):
    """A bare name of a parameter that was written with a unit; formulas such as 2*L are in SI, as before."""
    with pytest.raises(fb.UnitError, match=message):
        _with_parameters(L=text).add(add())


def test_a_changed_parameter_of_another_kind_is_refused():
    m = _with_parameters(M=0.4)
    m.add(fb.Body("c", mass="M", inertia=1))
    m.simulate(0.01, outputs=2, parameters={"M": "400 g"})
    m.simulate(0.01, outputs=2, parameters={"M": 5.0})
    with pytest.raises(fb.UnitError, match="mass of Body 'c': the parameter 'M' is '5 m': expected a mass"):
        m.simulate(0.01, outputs=2, parameters={"M": "5 m"})
    m.parameters["M"] = "5 N"
    with pytest.raises(fb.UnitError, match="mass of Body 'c'"):
        m.simulate(0.01, outputs=2)


def test_whole_numbers_of_many_turns_are_asked_about():
    with pytest.warns(fb.ModelWarning, match=r"value 30 is in rad, 4.8 turns; write '30 deg'"):
        _with_parameters().add(fb.Initial("A.angle", value=30))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for value in (3, 4 * np.pi, "30 rad", "30 deg", 31.4159):
            _with_parameters().add(fb.Initial("A.angle", value=value))
