"""What a user reads when a Python function or a table cannot be the law that it is given as."""

import functools
import math

import pytest

import flyball as fb
from flyball.errors import ExpressionError, ModelError, UnitError
from flyball.laws.compilation import compile_law
from flyball.model.expressions import Expression, law_expression
from flyball.model.table import Table


def any_number(*args):
    return 0.0


def any_names(t, **more):
    return 0.0


def by_keyword(t, *, gain):
    return 0.0


def by_keyword_if_wanted(t, *, k=2.0):
    return 0.0


def seven(a, b, c, d, e, f, g):
    return 0.0


def misspelt(t, lenght):
    return 0.0


def text_first(mode="soft", t=0.0):
    return 0.0


@pytest.mark.parametrize(
    ("law", "says"),
    [
        (any_number, ["'any_number'", "any number of arguments (*args)", "name those that it needs"]),
        (any_names, ["'any_names'", "(**more)"]),
        (by_keyword, ["'by_keyword'", "'gain' by keyword only", "remove the *"]),
        (seven, ["'seven' takes 7 arguments", "6 at most"]),
        (min, ["'min' does not expose the names", "def law(t)"]),
        (dict, ["'dict' is a class", "give a function"]),
        (functools.partial(seven, 1.0), ["unknown name 'b'", "<seven(b, c, d, e, f, g)>"]),
        (
            misspelt,
            ["unknown name 'lenght'", "<misspelt(t, lenght)>\n                 ^^^^^^\n", "did you mean 'length'"],
        ),
        (math.sin, ["unknown name 'x'", "<sin(x)>", "known names: k, length, t", "give a default"]),
        (by_keyword_if_wanted, ["'by_keyword_if_wanted'", "'k' by keyword only"]),
        (text_first, ["'text_first'", "'mode'", "default that is no number", "behind the arguments"]),
    ],
)
def test_functions_that_are_no_laws(law, says):
    with pytest.raises(ExpressionError) as error:
        compile_law(law_expression(law, "N", "force of Actuator 'a'"), ("t", "length"), ["k"], [], [1.0], functions=[])
    assert all(word in str(error.value) for word in says), str(error.value)


def test_derivatives_of_functions():
    law = law_expression(misspelt, "rad", "law of Driver 'crank'")
    with pytest.raises(
        ExpressionError, match=r"law of Driver 'crank': .*needs its derivatives: give an expression or a"
    ):
        compile_law(law, ("t", "lenght"), [], [], [], functions=[], derivatives=True)
    with pytest.raises(ValueError, match="needs a list to be kept in"):
        compile_law(law, ("t", "lenght"), [], [], [])


def test_only_laws_may_be_functions():
    with pytest.raises(ModelError, match="Body 'b': field 'mass' must be a number or a text, got <function"):
        fb.Body("b", mass=misspelt)
    with pytest.raises(ModelError, match="Driver 'm': field 'law' must be a number or a text or a function, got None"):
        fb.Driver("m", "A.angle", None)


def test_a_model_file_holds_no_functions():
    m = fb.Mechanism("m", planar=True)
    m.add(fb.Body("b", mass=1, inertia=1), fb.Revolute("A", "ground", "b", at=(0, 0)))
    m.add(fb.Motor("drive", "A", torque=lambda t, rate: t - rate))
    with pytest.raises(
        ModelError, match="Motor 'drive': torque is the Python function 'lambda', and a model file"
    ) as e:
        m.save("unused.toml")
    assert "use an expression or a Table" in str(e.value)


@pytest.mark.parametrize(
    ("fields", "says"),
    [
        ({"x": (1,), "y": (1,)}, ["1 point makes no curve", "two points"]),
        ({"x": (1, 2, 3), "y": (1, 2)}, ["x has 3 numbers and y has 2", "pairs"]),
        ({"x": (1, 3, 2), "y": (1, 2, 3)}, ["x[2] = 2 comes after x[1] = 3", "sort the points"]),
        ({"x": (1, 2, 2), "y": (1, 2, 3)}, ["x[2] = 2 comes after x[1] = 2", "leave out repeated"]),
        ({"x": (1, 2), "y": (1, math.nan)}, ["y[1] is nan", "finite"]),
        ({"x": (1, math.inf), "y": (1, 2)}, ["x[1] is inf", "finite"]),
        ({"x": (0, 5e-324), "y": (1, 2)}, ["x[0] and x[1] are too close"]),
        ({"x": (0, 1), "y": (1, 2), "beyond": "repeat"}, ["y[0] = 1 and y[1] = 2", "closes the period"]),
        ({"x": (0, 1), "y": (1, 2), "beyond": "zero"}, ["'beyond'", "'hold'", "'zero'"]),
        ({"x": (0, 1), "y": (1, 2), "interpolation": "spline"}, ["'interpolation'", "'monotone'", "'spline'"]),
        ({"x": ("5 mm", 1), "y": (1, 2)}, ["field 'x' must be a number"]),
        ({"x": (0, 1), "y": (1, 2), "x_unit": "furlog"}, ["x_unit", "unknown unit 'furlog'"]),
        ({"x": (0, 1), "y": (1, 2), "y_unit": "degC"}, ["y_unit", "offset"]),
        ({"x": (0, 1)}, ["field 'y' is missing"]),
    ],
)
def test_tables(fields, says):
    with pytest.raises(ModelError) as error:
        Table("curve", **fields).check(None)
    assert str(error.value).startswith("Table 'curve': ")
    assert all(word in str(error.value) for word in says), str(error.value)
    assert isinstance(error.value, UnitError) == ("_unit" in says[0])


@pytest.mark.parametrize("name", ["my curve", "2nd", "sin", "pi", "t", "lambda"])
def test_names_of_tables(name):
    with pytest.raises(ModelError, match=f"Table '{name}'"):
        Table(name, x=(0, 1), y=(0, 1)).check(None)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("2*spring", ["'spring' is a table", "    2*spring\n      ^^^^^^\n", "give its argument: spring(x)"]),
        ("spring(1, 2)", ["2 given", "write spring(x)"]),
        ("spring(x=1)", ["write spring(x), without names"]),
        ("sprung(t)", ["unknown function 'sprung'", "did you mean 'spring'", "tables: damper, spring"]),
        ("spring(t < 1)", ["a comparison is no number"]),
    ],
)
def test_calls_of_tables(text, says):
    with pytest.raises(ExpressionError) as error:
        Expression.parse(text, ("spring", "damper"))
    assert all(word in str(error.value) for word in says), str(error.value)
