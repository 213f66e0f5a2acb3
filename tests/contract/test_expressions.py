"""Numbers as users write them: quantities with units, expressions, parameters."""

import dataclasses
import math
import pickle
from fractions import Fraction

import numpy as np
import pytest
import sympy

from flyball.model.expressions import (
    FUNCTIONS,
    Expression,
    is_number_text,
    law_expression,
    number,
    resolve_parameters,
)
from flyball.model.units import to_si

QUANTITIES = [
    ("30 deg", "rad", math.pi / 6),
    ("30°", "rad", math.pi / 6),
    ("0.5 turn", "rad", math.pi),
    ("5 mm", "m", 0.005),
    ("- 5 mm", "m", -0.005),
    ("1 in", "m", 0.0254),
    ("5e-3m", "m", 0.005),
    ("120 rpm", "rad/s", 4 * math.pi),
    ("2 rev/s", "rad/s", 4 * math.pi),
    ("10 deg/s^2", "rad/s^2", math.pi / 18),
    ("2 kN/m", "N/m", 2000.0),
    ("3 kg*cm^2", "kg*m^2", 3e-4),
    ("3 kg cm²", "kg*m^2", 3e-4),
    ("7.85 g/cm^3", "kg/m^3", 7850.0),
    ("5 Nm", "N*m", 5.0),
    ("5 N·mm", "N*m", 0.005),
    ("2 kNm/rad", "N*m/rad", 2000.0),
    ("2 N*m", "N*m/rad", 2.0),
    ("1 N*m/deg", "N*m/rad", 180 / math.pi),
    ("0.1 N*m*s/rad", "N*m*s/rad", 0.1),
    ("30 1/s", "1/s", 30.0),
    ("20 ms", "s", 0.02),
    ("50 %", "1", 0.5),
    ("50 %", "", 0.5),
    ("0.5", "m", 0.5),
    (" .5e1 ", "rad", 5.0),
    ("5 mm", None, 0.005),
    ("250 g", None, 0.25),
    ("293 K", "K", 293.0),
]


@pytest.mark.parametrize(("text", "dimension", "expected"), QUANTITIES)
def test_quantities(text, dimension, expected):
    assert to_si(text, dimension) == pytest.approx(expected, rel=1e-14)
    assert number(text, {}, dimension, "x") == to_si(text, dimension)
    assert is_number_text(text)


VALUES = {"k": 3.0, "speed": 120.0, "length": 0.25, "x": 0.4}
FORMULAS = [
    ("2*k", 6.0),
    ("speed*pi/30", 4 * math.pi),
    ("-k**2", -9.0),
    ("2**-1", 0.5),
    ("2**3**2", 512.0),
    ("(1 + k)*(2 - k)/4", -1.0),
    ("+e", math.e),
    ("1/2", 0.5),
    ("sin(x)**2 + cos(x)**2", 1.0),
    ("tan(x) - sin(x)/cos(x)", 0.0),
    ("asin(sin(x)) + acos(cos(x)) + atan(tan(x))", 1.2),
    ("atan2(-1, -1)", -0.75 * math.pi),
    ("cosh(x)**2 - sinh(x)**2 + tanh(0)", 1.0),
    ("log(exp(k))", 3.0),
    ("sqrt(k*k)", 3.0),
    ("abs(-k) + sign(-k)", 2.0),
    ("min(k, 2, 5) + max(1, k)", 5.0),
    ("where(k > 2, 1, 0)", 1.0),
    ("where(0 <= x < 0.4, 1, 0)", 0.0),
    ("where(x < 1 and not k < 1 or x > 7, 1, 0)", 1.0),
    ("step(x, 0, 1, 0.8, 3)", 2.0),
    ("step(x, 0.5, 1, 0.8, 3)", 1.0),
    ("step(x, 0, 1, 0.1, 3)", 3.0),
    ("step5(x, 0, 1, 0.8, 3)", 2.0),
    ("trapezoid(x, 0, 1, 0.8, 3, 0.25)", 2.0),
    ("trapezoid(x, 0, 1, 1.6, 3, 0.25)", 1 + 2 / 6),
    ("trapezoid(x, 0, 1, 0.1, 3, 0.5)", 3.0),
    ("  length\n  * 4 ", 1.0),
]


@pytest.mark.parametrize(("text", "expected"), FORMULAS)
def test_formulas(text, expected):
    formula = Expression.parse(text)
    assert formula.evaluate(VALUES) == pytest.approx(expected, abs=1e-14)
    assert number(text, VALUES, "m", "x") == pytest.approx(expected, abs=1e-14)
    assert formula.names <= set(VALUES)
    assert not is_number_text(text)
    over_time = formula.evaluate({name: np.full(3, value) for name, value in VALUES.items()})
    np.testing.assert_allclose(np.broadcast_to(over_time, 3), expected, atol=1e-14)
    symbols = {name: sympy.Symbol(name, real=True) for name in VALUES}
    symbolic = sympy.sympify(formula.evaluate(symbols))
    assert float(symbolic.subs({s: VALUES[n] for n, s in symbols.items()})) == pytest.approx(expected, abs=1e-13)


@pytest.mark.parametrize(("text", "expected"), FORMULAS)
def test_formulas_with_complex_numbers(text, expected):
    value = Expression.parse(text).evaluate({name: complex(value, 1e-30) for name, value in VALUES.items()})
    assert value.real == pytest.approx(expected, abs=1e-14)


def test_every_function_is_tried_above():
    assert all(any(f"{name}(" in text for text, _ in FORMULAS) for name in FUNCTIONS)


def test_expression_is_a_value():
    a = Expression.parse("2*k + sin(t)")
    assert a == Expression.parse("2*k + sin(t)")
    assert hash(a) == hash(Expression.parse("2*k + sin(t)"))
    assert a != Expression.parse("2*k")
    assert str(a) == "2*k + sin(t)"
    assert a.names == {"k", "t"}
    assert pickle.loads(pickle.dumps(a)).evaluate({"k": 1.0, "t": 0.0}) == 2.0
    with pytest.raises(dataclasses.FrozenInstanceError):
        a.text = "3"


def test_out_of_domain_is_nan_not_an_error():
    assert math.isnan(Expression.parse("sqrt(-k)").evaluate(VALUES))
    assert math.isnan(Expression.parse("(-k)**0.5").evaluate(VALUES))
    assert Expression.parse("1/(k - k)").evaluate(VALUES) == math.inf
    assert Expression.parse("9**9**9**9").evaluate({}) == math.inf


@pytest.mark.parametrize(
    "value", [3, 3.0, np.float64(3), np.int64(3), np.float32(3), Fraction(3), "3", "3.0", "k", "3*1"]
)
def test_numbers_of_many_kinds(value):
    result = number(value, VALUES, "m", "x")
    assert type(result) is float
    assert result == 3.0


def test_complex_parameters_pass_through():
    assert number("2*k", {"k": 1 + 1e-30j}, "m", "x") == 2 + 2e-30j
    assert number(1 + 1e-30j, {}, "m", "x") == 1 + 1e-30j
    assert resolve_parameters({"a": "b**2", "b": 3 + 1e-30j}) == pytest.approx({"a": 9 + 6e-30j, "b": 3 + 1e-30j})


def test_parameters_in_any_order():
    given = {"c": "a + b", "a": "2*b", "b": "5 mm", "d": 7, "angle": "30 deg", "f": "c/a"}
    values = resolve_parameters(given)
    assert list(values) == list(given)
    assert values == pytest.approx({"c": 0.015, "a": 0.01, "b": 0.005, "d": 7.0, "angle": math.pi / 6, "f": 1.5})
    chain = {f"p{k}": f"p{k + 1} + 1" for k in range(500)} | {"p500": 0}
    assert resolve_parameters(chain)["p0"] == 500.0


def test_laws_are_numbers_quantities_or_formulas():
    assert law_expression("120 rpm", "rad/s", "law").evaluate({}) == pytest.approx(4 * math.pi)
    assert law_expression(2, "rad/s", "law").evaluate({}) == 2.0
    assert law_expression("2*t", "rad/s", "law").names == {"t"}
    formula = Expression.parse("t")
    assert law_expression(formula, "rad/s", "law") is formula


@pytest.mark.parametrize("text", ["1e6*t", "-2.5E3*max(t, 0)", "1e-3*(t - 1)", "4e2/t"])
def test_formulas_may_begin_with_an_exponent(text):
    """A number written with an exponent is not a quantity with an unknown unit."""
    t = 1.75
    assert law_expression(text, "N*m", "law").evaluate({"t": t}) == eval(text, {"t": t, "max": max})
