"""Laws as bytecode: values, exact time derivatives, parameters as numbers in a table."""

import math

import numpy as np
import pytest
import sympy
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from flyball.laws.bytecode import BY_MOTION, evaluate, evaluate_jet, is_entire
from flyball.laws.compilation import compile_law
from flyball.model.expressions import FUNCTIONS, Expression
from tests.compiled import compiled

PARAMETERS = {"a": 0.7, "b": 1.3, "zero": 0.0, "n": 3.0}
H = 1e-30
NOTHING = np.zeros((3, 0))  # no sensors


@compiled
def compiled_value(code, const, at, stack, x, sensed):
    return evaluate(code, const, at, stack, x, sensed)


@compiled
def compiled_jet(code, const, at, stack, t, sensed, seed):
    return evaluate_jet(code, const, at, stack, t, sensed, seed)


class Law:
    """One compiled law with its tables, real and complex."""

    def __init__(self, text, inputs=("t",)):
        self.formula = Expression.parse(text)
        code, const = [], list(PARAMETERS.values())
        self.at, self.depth = compile_law(self.formula, inputs, list(PARAMETERS), code, const)
        self.code, self.const = np.array(code), np.array(const)

    def tables(self, dtype):
        # A stack of exactly the depth announced: plain Python would fail on one row less.
        return self.code, self.const.astype(dtype), self.at, np.zeros((self.depth, 3), dtype)

    def value(self, *x, how=compiled_value):
        return how(*self.tables(type(x[0])), x, NOTHING.astype(type(x[0])))

    def jet(self, t, how=compiled_jet):
        return np.array(how(*self.tables(type(t)), t, NOTHING.astype(type(t)), BY_MOTION))


SMOOTH = [
    "3",
    "t",
    "-t",
    "a*t + b",
    "a - t*t",
    "t/(1 + t*t)",
    "1/t",
    "sin(a*t)",
    "cos(t**2)",
    "tan(t/3)",
    "asin(t/4)",
    "acos(t/4)",
    "atan(a*t)",
    "sinh(t)",
    "cosh(t)",
    "tanh(t)",
    "exp(-a*t)",
    "log(t + 1)",
    "sqrt(t**2 + a)",
    "t**3",
    "t**-2",
    "t**0.5",
    "(1 + t)**(1/3)",
    "t**n",
    "t**a",
    "2**t",
    "t**t",
    "(a + t)**(b*t)",
    "atan2(sin(t), 1 + t)",
    "a*sin(2*pi*t/b)*exp(-t)",
]
KINKED = [
    "abs(sin(3*t))",
    "sign(t - 1)*t**2",
    "min(t, 1, t**2)",
    "max(sin(t), cos(t))",
    "where(t < 1, t**2, 2*t - 1)",
    "where(0.5 <= t < 1 or not t < 2, t**3, sin(t))",
    "where(t > 1 and t >= 1.5, t, -t)",
    "step(t, 0.2, 1, 1.8, 3)",
    "step5(t, 0.2, 1, 1.8, b)",
    "trapezoid(t, 0.2, 1, 1.8, b, 0.3)",
    "trapezoid(t, 2, a, 0.5, 1, 0.1*a/a)",
    "step(t, 2, a, 0.5, 1)",
]
TIMES = [0.31, 0.83, 1.7, 2.2]


def by_sympy(law, t):
    """Value and derivatives of a smooth law from SymPy with 30 digits."""
    s = sympy.Symbol("t", positive=True)
    f = sympy.sympify(law.formula.evaluate({"t": s, **PARAMETERS}))
    return np.array([complex(f.diff(s, k).evalf(30, subs={s: sympy.Float(t, 30)})) for k in range(3)])


def test_every_function_is_tried():
    assert all(any(f"{name}(" in text for text in SMOOTH + KINKED) for name in FUNCTIONS)


@pytest.mark.parametrize("text", SMOOTH)
def test_jets_are_sympy_derivatives(text):
    law = Law(text)
    for t in TIMES[:2]:
        np.testing.assert_allclose(law.jet(t), by_sympy(law, t).real, rtol=1e-11, atol=1e-12)


@pytest.mark.parametrize("text", SMOOTH + KINKED)
@pytest.mark.parametrize("t", TIMES)
def test_complex_step_is_the_jet(text, t):
    law = Law(text)
    f, f1, f2 = law.jet(t)
    assert f == pytest.approx(law.formula.evaluate({"t": t, **PARAMETERS}), rel=1e-13)
    assert law.value(t) == pytest.approx(f, rel=1e-15)
    assert law.value(complex(t, H)) == pytest.approx(complex(f, H * f1), rel=1e-12)
    complex_jet = law.jet(complex(t, H))
    np.testing.assert_allclose(complex_jet.real, (f, f1, f2), rtol=1e-12, atol=1e-13)
    np.testing.assert_allclose(complex_jet.imag[:2] / H, (f1, f2), rtol=1e-11, atol=1e-12)


@pytest.mark.parametrize("text", SMOOTH + KINKED)
def test_compiled_is_plain(text):
    law = Law(text)
    for t in (0.83, complex(0.83, H)):
        np.testing.assert_allclose(law.jet(t), law.jet(t, how=evaluate_jet), rtol=1e-13, atol=1e-14)
        assert law.value(t) == pytest.approx(law.value(t, how=evaluate), rel=1e-14)


def texts():
    leaves = st.sampled_from(["t", "t", "a", "b", "2", "0.5", "3"])

    def grow(inner):
        one = st.sampled_from(["sin", "cos", "tanh", "atan", "exp", "sqrt", "log", "sinh", "-", "tan", "asin"])
        two = st.tuples(inner, st.sampled_from(["+", "-", "*", "/"]), inner).map(lambda p: f"({p[0]} {p[1]} {p[2]})")
        power = st.tuples(inner, st.sampled_from(["2", "-1", "3", "0.5", "n", "a"])).map(lambda p: f"({p[0]})**{p[1]}")
        return st.tuples(one, inner).map(lambda p: f"{p[0]}({p[1]})") | two | power

    return st.recursive(leaves, grow, max_leaves=5)


@settings(max_examples=40, deadline=None, derandomize=True, database=None)
@given(texts(), st.sampled_from(TIMES))
def test_random_laws_are_sympy_derivatives(text, t):
    formula = Expression.parse(text)
    parts = [Expression(text, node).evaluate({"t": t, **PARAMETERS}) for node in formula.tree.walk()]
    assume(all(abs(part) < 1e3 for part in parts))
    try:
        law = Law(text)
    except ValueError:  # a constant part that is not finite, refused
        assume(False)
    expected = by_sympy(law, t)
    assume(np.all(np.isfinite(expected)) and np.all(abs(expected) < 1e5))
    np.testing.assert_allclose(law.jet(t), expected.real, rtol=1e-8, atol=1e-8)


@pytest.mark.parametrize(
    ("text", "jet"),
    [
        ("t**2", (0, 0, 2)),
        ("t**1", (0, 1, 0)),
        ("t**0", (1, 0, 0)),
        ("t**n", (0, 0, 0)),
        ("t**(n - 1)", (0, 0, 2)),
        ("t**(n - 2)", (0, 1, 0)),
        ("t**zero", (1, 0, 0)),
        ("t**2.5", (0, 0, 0)),
        ("sqrt(zero)*t + zero**0.5", (0, 0, 0)),
        ("t + atan2(zero, zero)", (0, 1, 0)),
        ("abs(t)", (0, 1, 0)),
        ("1/t", (math.inf, -math.inf, None)),
        ("log(t)", (-math.inf, math.inf, None)),
        ("sqrt(t)", (0, math.inf, None)),
        ("sqrt(t - 1)", (math.nan, math.nan, math.nan)),
    ],
)
def test_jets_at_zero(text, jet):
    for how in (compiled_jet, evaluate_jet):
        with np.errstate(all="ignore"):
            got = Law(text).jet(0.0, how=how)
        for found, expected in zip(got, jet, strict=True):
            assert (expected is None and not math.isfinite(found)) or found == pytest.approx(expected, nan_ok=True)


def test_inputs_and_depth():
    law = Law("a*(length - b) + n*rate*abs(rate) + t", inputs=("t", "length", "rate"))
    assert law.value(2.0, 1.5, -0.5) == pytest.approx(0.7 * 0.2 - 3 * 0.25 + 2)
    assert law.depth == 3
    assert Law("t + (t + (t + (t + t)))").depth == 5
    assert Law("t + t + t + t + t").depth == 2


def test_inputs_may_be_complex():
    law = Law("a*length**2", inputs=("t", "length"))
    assert law.value(0j, 1 + 1j * H).imag == pytest.approx(1.4 * H)


def test_parameters_are_numbers_in_a_table():
    law = Law("a*t + b*t**2")
    assert law.value(2.0) == pytest.approx(1.4 + 5.2)
    law.const[:2] = 10.0, 1.0
    assert law.value(2.0) == pytest.approx(24.0)


def test_many_laws_share_the_tables():
    code, const = [], [0.5]
    texts = ["k*t + 2", "2*sin(3*t)", "3", "min(k, 2)"]
    programs = [compile_law(Expression.parse(text), ("t",), ["k"], code, const) for text in texts]
    assert const == [0.5, 2.0, 3.0]
    stack = np.zeros((max(depth for _, depth in programs), 3))
    for text, (at, _) in zip(texts, programs, strict=True):
        expected = Expression.parse(text).evaluate({"k": 0.5, "t": 0.4})
        assert compiled_value(np.array(code), np.array(const), at, stack, (0.4,), NOTHING) == pytest.approx(
            expected, rel=1e-15
        )


def test_zeros_keep_their_sign():
    """Numbers in the table are used again, but atan2(0, -1) and atan2(-0, -1) lie a whole turn apart."""
    code, const = [], [-0.0, 1.0]  # no parameters: numbers of an earlier law
    at, depth = compile_law(Expression.parse("atan2(0, -t)"), ("t",), [], code, const)
    found = compiled_value(np.array(code), np.array(const), at, np.zeros((depth, 3)), (1.0,), NOTHING)
    assert found == pytest.approx(math.pi)


def test_constant_parts_are_computed_once():
    code, const = [], []
    compile_law(Expression.parse("2*pi/3*sqrt(4)*t - (1 - 1/2)"), ("t",), [], code, const)
    assert const == pytest.approx([4 * math.pi / 3, 0.5])
    assert code[0] == 5


def test_long_sums_are_fine():
    terms = [f"sin({k}*t)" for k in range(150)]
    law = Law(" + ".join(terms))
    assert law.value(0.3) == pytest.approx(sum(math.sin(0.3 * k) for k in range(150)))
    assert law.depth == 3


@pytest.mark.parametrize(
    ("law", "smooth"),
    [
        ("10*t/3 + sin(2*t)**2 - cosh(t)", True),
        ("exp(-t)*atan(t) - 2**3*t", True),
        ("1/t", False),
        ("t/(1 + t)", False),
        ("abs(t)", False),
        ("where(t > 1, 1, 0)", False),
        ("step(t, 0, 0, 1, 1)", False),
        ("sqrt(t)", False),
        ("t**(-2)", False),
        ("tan(t)", False),
    ],
)
def test_only_laws_without_jumps_and_kinks_are_entire(law, smooth):
    code, const = [], []
    at, _ = compile_law(Expression.parse(law), ("t",), (), code, const)
    assert is_entire(np.array(code), at) is smooth
