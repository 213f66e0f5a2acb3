"""What a user reads when a number, a unit or a formula is wrong."""

import math

import numpy as np
import pytest

from flyball.errors import ExpressionError, FlyballError, ModelError, UnitError
from flyball.laws.compilation import compile_law
from flyball.model.expressions import Expression, law_expression, number, resolve_parameters
from flyball.model.units import to_si

WHERE = "mass of body 'crank'"
ENV = {"length": 2.0, "k": 3.0, "x": 1.0}


def test_errors_are_model_errors_and_value_errors():
    assert issubclass(UnitError, ModelError)
    assert issubclass(ExpressionError, ModelError)
    assert issubclass(ModelError, FlyballError)
    assert issubclass(ModelError, ValueError)


@pytest.mark.parametrize(
    ("text", "dimension", "says"),
    [
        ("30 m", "rad", ["'30 m'", "an angle [rad]", "'m' (meter)", "'30 deg'"]),
        ("5 deg", "m", ["'5 deg'", "a length [m]", "'deg' (radian)", "'5 mm'"]),
        ("5 deg", "", ["a plain number [1]", "'0.5'"]),
        ("5 rad", "1", ["a plain number [1]", "'0.5'"]),
        ("50 Hz", "rad/s", ["an angular speed [rad/s]", "count no angle", "'120 rpm'"]),
        ("2 1/s", "rad/s", ["count no angle", "rev/s"]),
        ("2 N*m*rad", "N*m", ["the angle does not fit", "'3 N*m'"]),
        ("2 kg", "N", ["a force [N]", "(kilogram)", "'2 kN'"]),
        ("2 kg", "kg*m/s", ["a quantity [kg*m/s]", "'2 kg*m/s'"]),
        ("20 degC", "K", ["'degC' has an offset", "to K"]),
        ("68 degF", None, ["offset"]),
        ("3 dB", "1", ["logarithmic"]),
        ("2 foo", "m", ["unknown unit 'foo'", "'5 mm'"]),
        ("5 KG", "kg", ["unknown unit 'KG'", "did you mean 'kg'"]),
        ("2 RPM", "rad/s", ["did you mean 'rpm'"]),
        ("2 m*2", "m", ["cannot read the unit 'm*2'", "'5 mm'"]),
        ("1 m**9**9**9", None, ["is not a unit", "'5 mm'"]),
        ("1 m^999", "m", ["is not a unit"]),
        ("1 __import__('os')", "m", ["is not a number with a unit"]),
        ("1 m@2", "m", ["is not a unit"]),
        ("1e999 m", "m", ["not a finite number", "'5 mm'"]),
        ("many m", "m", ["'many m' is not a number with a unit"]),
    ],
)
def test_units(text, dimension, says):
    with pytest.raises(UnitError) as error:
        to_si(text, dimension)
    assert all(word in str(error.value) for word in says), str(error.value)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("x^2", ["operator '^'", "    x^2\n     ^\n", "x**2"]),
        ("é + x^2", ["    é + x^2\n         ^\n"]),
        ("x % 2", ["operator '%'", "+ - * / **"]),
        ("x // 2", ["operator '//'", "      ^^\n"]),
        ("~x", ["'~x'", "allowed"]),
        ("foo(3)", ["unknown function 'foo'", "    ^^^\n", "foo*(...)", "known functions: abs, "]),
        ("2 + sine(x)", ["unknown function 'sine'", "        ^^^^\n", "did you mean 'sin'"]),
        ("sin", ["'sin' is a function", "sin(x)"]),
        ("atan2(1)", ["1 given", "atan2(y, x)"]),
        ("min(1)", ["1 given", "min(a, b, ...)"]),
        ("sin(x=1)", ["sin(x), without names"]),
        ("x < 1", ["a comparison is no number", "where(condition, a, b)"]),
        ("1 + (x < 1)", ["a comparison is no number"]),
        ("where(x, 1, 2)", ["not a condition", "where(t < 1, a, b)"]),
        ("where(x == 1, 1, 2)", ["only <, <=, > and >=", "range"]),
        ("1 if x else 2", ["where(condition, a, b)"]),
        ("x.real", ["'x.real' is not allowed"]),
        ("x[0]", ["'x[0]' is not allowed"]),
        ("(lambda: 1)()", ["unknown function"]),
        ("__import__('os')", ["unknown function '__import__'"]),
        ("'a'", ["'a' is not a finite real number"]),
        ("2j", ["2j is not a finite real number"]),
        ("1e400", ["not a finite real number"]),
        ("True", ["True is not a finite real number"]),
        ("2*", ["cannot read the expression", "    2*\n"]),
        ("", ["empty", "'5 mm'"]),
        ("2x*3", ["cannot read", "2*x"]),
        ("k*30 deg", ["cannot read", "must be in parentheses"]),
        ("lambda", ["cannot read"]),
        ("(" * 300, ["cannot read"]),
        ("-" * 3000 + "1", ["nested too deep", "split"]),
        ("1+" * 1000 + "1", ["nested too deep"]),
    ],
)
def test_expressions(text, says):
    with pytest.raises(ExpressionError) as error:
        Expression.parse(text)
    assert all(word in str(error.value) for word in says), str(error.value)
    assert len(str(error.value)) < 500


@pytest.mark.parametrize(
    ("value", "kind", "says"),
    [
        (
            "2*lenght",
            ExpressionError,
            ["    2*lenght\n      ^^^^^^\n", "known names: k, length, x", "did you mean 'length'"],
        ),
        ("2*qqq", ExpressionError, ["unknown name 'qqq'", "define a parameter 'qqq'"]),
        ("t + 1", ExpressionError, ["unknown name 't'", "only in laws"]),
        ("2*mm", ExpressionError, ["a unit follows a single number, as in '2 mm'"]),
        ("2 k", UnitError, ["'2 k'", "'k' is a name", "write '2*k'"]),
        ("2x", UnitError, ["'x' is a name", "write '2*x'"]),
        ("3 s", UnitError, ["a length [m]", "(second)"]),
        (True, ModelError, ["True is true or false"]),
        (np.True_, ModelError, ["true or false"]),
        (math.nan, ModelError, ["nan", "finite"]),
        (-math.inf, ModelError, ["-inf", "finite"]),
        (complex(math.nan, 0), ModelError, ["finite"]),
        ("1/(k - k)", ModelError, ["'1/(k - k)' gives inf", "division by zero"]),
        ("sqrt(-k)", ModelError, ["'sqrt(-k)' gives nan", "roots"]),
        (None, ModelError, ["None (NoneType) is not a number", "'5 mm'"]),
        ([1], ModelError, ["[1] (list) is not a number"]),
    ],
)
def test_numbers(value, kind, says):
    with pytest.raises(kind) as error:
        number(value, ENV, "m", WHERE)
    assert str(error.value).startswith(WHERE + ": ")
    assert all(word in str(error.value) for word in says), str(error.value)


@pytest.mark.parametrize(
    ("parameters", "kind", "says"),
    [
        ({"a": "b", "b": "c*2", "c": "a+1"}, ExpressionError, ["circle: a -> b -> c -> a", "give one of them a value"]),
        ({"z": "a", "a": "a + 1"}, ExpressionError, ["circle: a -> a"]),
        ({"t": 1}, ExpressionError, ["parameter 't'", "time", "rename", "'t_0'"]),
        ({"pi": 1}, ExpressionError, ["parameter 'pi'", "a constant", "rename"]),
        ({"sin": 1}, ExpressionError, ["parameter 'sin'", "a function", "rename"]),
        ({"lambda": 1}, ExpressionError, ["parameter 'lambda'", "a word of the expression language"]),
        ({"a b": 1}, ExpressionError, ["parameter 'a b'", "not a plain name", "'spring_rate'"]),
        ({1: 1}, ExpressionError, ["parameter 1", "not a plain name"]),
        (
            {"a": "legnth", "length": 1},
            ExpressionError,
            ["parameter 'a'", "unknown name 'legnth'", "did you mean 'length'"],
        ),
        ({"a": "5 foo"}, UnitError, ["parameter 'a'", "unknown unit 'foo'"]),
        ({"a": True}, ModelError, ["parameter 'a'", "true or false"]),
        ({"a": "1/b", "b": 0}, ModelError, ["parameter 'a'", "'1/b' gives inf", "division by zero"]),
        ({"a": "2*"}, ExpressionError, ["parameter 'a'", "cannot read"]),
    ],
)
def test_parameters(parameters, kind, says):
    with pytest.raises(kind) as error:
        resolve_parameters(parameters)
    assert all(word in str(error.value) for word in says), str(error.value)


def test_laws():
    def compiled(text, inputs=("t", "length"), parameters=("k",)):
        return compile_law(Expression.parse(text), inputs, parameters, [], [1.0])

    with pytest.raises(
        ExpressionError, match=r"(?s)unknown name 'lengh'.*known names: k, length, t.*did you mean 'length'"
    ):
        compiled("2*lengh")
    with pytest.raises(ExpressionError, match="'k' is an input of this law and also a parameter; rename the parameter"):
        compiled("2*k", inputs=("t", "k"))
    with pytest.raises(ExpressionError, match=r"(?s)this part is inf.*\n        \^\^\^\n.*divisions by zero"):
        compiled("t + 1/0")
    with pytest.raises(ExpressionError, match=r"(?s)not a finite number.*ends of steps"):
        compiled("step(t, 1, 0, 1, 2)".replace("t,", "0.5,", 1))
    with pytest.raises(ValueError, match="first input is 't'"):
        compiled("k", inputs=("x",))
    with pytest.raises(UnitError, match=r"law of driver 'crank': '3 s': expected an angular speed"):
        law_expression("3 s", "rad/s", "law of driver 'crank'")
    with pytest.raises(ExpressionError, match=r"(?s)law of driver 'crank': unknown function 'sine'"):
        law_expression("sine(t)", "rad/s", "law of driver 'crank'")
