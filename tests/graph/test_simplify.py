"""Expressions made short have the same value, and known ones are as short as in books."""

import math

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from flyball.expression_graph.graph import Graph, evaluate, nodes_in_order
from flyball.expression_graph.printers.text import text
from flyball.expression_graph.simplification.factors import exact_number, without_rounding
from flyball.expression_graph.simplification.simplify import ArctangentSubstitution, simplified
from flyball.math import scalar

NAMES = ("a", "b", "x", "y", "u", "v")
LEAVES = st.sampled_from([*NAMES, *NAMES, 0.0, 1.0, -1.0, 2.0, 0.5, 3.0, 1.0 / 3.0, math.pi / 2.0, 0.7])
ONE = ("sin", "cos", "sin", "cos", "sqrt", "absolute", "exp", "tan", "atan", "square", "cube")
TWO = ("+", "+", "-", "*", "*", "*", "/", "minimum", "atan2")


def trees(inner):
    return st.one_of(
        st.tuples(st.sampled_from(TWO), inner, inner),
        st.tuples(st.sampled_from(TWO), inner, inner),
        st.tuples(st.sampled_from(ONE), inner),
        st.tuples(st.just("choose"), inner, inner, inner),
    )


def made(g, tree):
    """The expression of a tree."""
    if isinstance(tree, float):
        return g.number(tree)
    if isinstance(tree, str):
        return g.symbol(tree, 0.4 if tree in "ab" else None)
    op, *args = (tree[0], *[made(g, x) for x in tree[1:]])
    if op in "+-*/":
        return {"+": g.add, "-": g.subtract, "*": g.multiply, "/": g.divide}[op](*args)
    if op in ("square", "cube"):
        return g.power(args[0], 2 if op == "square" else 3)
    return g.function(op, *args)


def close(x, y, at):
    """Whether two expressions agree, as far as rounding lets the first say."""
    with np.errstate(all="ignore"):
        first = complex(evaluate([x], at)[0])
        if not np.isfinite(first) or abs(first) > 1e6:
            return True
        rng = np.random.default_rng(0)
        near = [evaluate([x], {k: v * (1.0 + 1e-11 * rng.standard_normal()) for k, v in at.items()})[0] for _ in "abcd"]
        second = evaluate([y], at)[0]
        unsure = max(abs(n - first) for n in near)
        if not np.isfinite(unsure) or unsure > 1e-6:  # at a jump
            return True
        return abs(second - first) <= 1e-11 * (1.0 + abs(first)) + 50.0 * unsure


@settings(max_examples=300, deadline=None, suppress_health_check=list(HealthCheck))
@given(st.recursive(LEAVES, trees, max_leaves=24), st.integers(0, 2**32))
def test_values_stay(tree, seed):
    g = Graph()
    x = made(g, tree)
    (y,) = simplified([x])
    (z,) = simplified([x], most=3)
    rng = np.random.default_rng(seed)
    for _ in range(3):
        at = dict(zip(NAMES, rng.uniform(-2.0, 2.0, len(NAMES)), strict=True))
        assert close(x, y, at), (text(x), text(y), at)
        assert close(x, z, at), (text(x), text(z), at)


def test_infinity_is_not_multiplied_out():
    """Infinity times a sum whose terms have different signs is infinite, not nan; the arctangent of it is finite."""
    g = Graph()
    x, a, b = (g.symbol(n) for n in "xab")
    for far in (g.divide(a + b, 0.0), (g.number(np.inf) + x) * (a + b), g.divide(a + b, x - x) * a):
        angle = g.function("atan2", x, far)
        (y,) = simplified([angle + a * (a + b)])
        at = {"x": 1.0, "a": 2.0, "b": -1.0}
        assert evaluate([y], at)[0] == pytest.approx(evaluate([angle], at)[0] + 2.0)


def short(make, *names):
    g = Graph()
    return text(simplified([make(*[g.symbol(n) for n in names])])[0])


sin, cos, sqrt = scalar.sin, scalar.cos, scalar.sqrt


@pytest.mark.parametrize(
    ("make", "expected"),
    [
        (lambda a, b, m: m * sin(a) * sin(a) + m * cos(a) ** 2, "m"),
        (lambda a, b, m: cos(a) * cos(b) - sin(a) * sin(b), "cos(a + b)"),
        (lambda a, b, m: m * sin(a) * cos(b) - m * cos(a) * sin(b), "m*sin(a - b)"),
        (lambda a, b, m: cos(a) * cos(b) * m, "m*cos(a)*cos(b)"),
        (lambda a, b, m: m - m * cos(a) ** 2, "m*sin(a)^2"),
        (lambda a, b, m: cos(a) ** 2 - sin(a) ** 2, "cos(2*a)"),
        (lambda a, b, m: m * (a + b) - m * a - b * m, "0"),
        (lambda a, b, m: (a * a + 2.0 * a * b + b * b) * m, "m*(a + b)^2"),
        (lambda a, b, m: (a + b) ** 2 - a**2, "b*(2*a + b)"),
        (lambda a, b, m: (a * m + b * m) / m, "a + b"),
        (lambda a, b, m: m * sin(a) / sin(a), "m"),
        (lambda a, b, m: sqrt(m * m * sin(a) ** 2 + m * m * cos(a) ** 2), "abs(m)"),
        (lambda a, b, m: sqrt(a * a + b * b) ** 2, "a^2 + b^2"),
        (lambda a, b, m: cos(a + math.pi / 2.0) + sin(b + math.pi), "-sin(a) - sin(b)"),
        (lambda a, b, m: m * a * a / 12.0 + m * b * b * (2.0 / 3.0), "m*(a^2 + 8*b^2)/12"),
        (lambda a, b, m: math.sqrt(2.0) / 2.0 * m * a, "sqrt(2)*a*m/2"),
        (lambda a, b, m: (a * a - b * b) / (a - b), "(a^2 - b^2)/(a - b)"),  # a = b stays undefined
    ],
)
def test_known_identities(make, expected):
    assert short(make, "a", "b", "m") == expected


def test_a_unit_quaternion_is_told():
    g = Graph()
    w, x, y, z = q = [g.symbol(n) for n in "wxyz"]
    r = w * w + x * x - y * y - z * z
    assert text(simplified([r], units=[q])[0]) in ("1 - 2*y^2 - 2*z^2", "1 - 2*(y^2 + z^2)", "2*(w^2 + x^2) - 1")
    assert text(simplified([r + 2.0 * (y * y + z * z)], units=[q])[0]) == "1"
    assert simplified([r + 2.0 * (y * y + z * z)])[0] != 1.0


def test_what_is_kept_is_not_looked_into():
    g = Graph()
    a, b, m = (g.symbol(n) for n in "abm")
    s = a + b
    (found,) = simplified([s * s - m * s + sin(s) ** 2 + cos(s) ** 2], keep=[s])
    assert text(found, {s.index: "s"}) == "1 + s^2 - m*s"


def test_numbers_and_shapes_stay():
    g = Graph()
    x = g.symbol("x")
    array = np.array([[x + x - 2.0 * x, 0.0], [1.0, sin(x) ** 2 + cos(x) ** 2]], object)
    found = simplified(array)
    assert found.shape == (2, 2)
    assert [[found[i, j] == v for j, v in enumerate(row)] for i, row in enumerate([[0, 0], [1, 1]])] == [[True] * 2] * 2
    assert simplified([]) == []


@pytest.mark.parametrize(
    ("make", "at"),
    [
        (lambda x, y, z: 1e9 * x * x + 1e-5 * x * y + 1e9 * x * z + 1e-5 * y * z, (1e-9, 1e5, 2e-9)),
        (lambda x, y, z: 4.0 * x * x + 1e-13 * x * y + 4.0 * x * z + 1e-13 * y * z, (1e-9, 1e5, 2e-9)),
        (lambda x, y, z: x * x + 2.0 * x * y + (1.0 + 5e-14) * y * y, (1.0, -1.0, 0.0)),
        (lambda x, y, z: x * x - y * y + 1e-15 * x * y, (1.0, 1.0, 0.0)),
        (lambda x, y, z: cos(2.0 * x) - (1.0 + 1e-13) * cos(2.0 * y), (0.3, 0.3, 0.0)),
    ],
)
def test_coefficients_of_other_atoms_are_not_compared(make, at):
    g = Graph()
    symbols = [g.symbol(n) for n in "xyz"]
    x = make(*symbols)
    values = dict(zip("xyz", at, strict=True))
    assert evaluate(simplified([x]), values)[0] == pytest.approx(evaluate([x], values)[0], rel=0.2, abs=0.0)


@pytest.mark.parametrize("number", [math.inf, math.nan])
def test_what_is_no_number_stays(number):
    g = Graph()
    x = g.symbol("x")
    for made in (sin(number * x), cos(x + number), number * cos(x) + number * sin(x), number * x * x + x):
        assert len(simplified([made])) == 1


@pytest.mark.parametrize(
    "make",
    [
        lambda x, d: cos(x + (math.pi / 2.0 + d)),
        lambda x, d: sin(x + (math.pi + d)),
        lambda x, d: sin(2.0 * x - d),
        lambda x, d: -d * cos(x) + sin(x),
    ],
)
@pytest.mark.parametrize("off", [1e-13, -1e-13])
def test_an_angle_near_a_right_one_is_none(make, off):
    """At x = 0 each of them is -sin d, which is nothing where d has been taken for rounding."""
    g = Graph()
    (found,) = simplified([make(g.symbol("x"), off)])
    assert evaluate([found], {"x": 0.0})[0] == pytest.approx(-off, rel=1e-2, abs=0.0)


@pytest.mark.parametrize("number", [math.pi / 2.0, 2.0 * math.pi / 3.0, 1.0 / 3.0, math.sqrt(2.0) / 2.0])
def test_numbers_are_known_to_rounding_only(number):
    assert exact_number(number) is not None
    for x in (number + 1e-13, number - 1e-13):
        assert exact_number(x) is None
        assert without_rounding(x) == x


@pytest.mark.parametrize(
    "angle",
    [
        lambda u, w, v, z: v,  # w = atan2(b, a) twice
        lambda u, w, v, z: 2.0 * z,
        lambda u, w, v, z: 3.0 * z - u,
        lambda u, w, v, z: v + z,
        lambda u, w, v, z: 2.0 * (w + u) + 1.0,
        lambda u, w, v, z: 2.0 * (z + 1.0),
        lambda u, w, v, z: -1.5 * v + 2.0 * w + 0.25,
        lambda u, w, v, z: 2.0 * (u - 0.5 * w),
        lambda u, w, v, z: w + scalar.rounded(u),
        lambda u, w, v, z: w + 2.0 * math.pi * scalar.rounded(u),
    ],
)
@pytest.mark.parametrize("at", [(0.7, -1.3, 0.4), (-0.2, 0.9, 2.0)])
def test_arctangents_in_angles_that_are_sums_and_multiples(angle, at):
    """With w = atan2(b, a), v = 2 w + u / 2 and z = u - w: the values of cosine and sine, and no arctangent is left."""
    g = Graph()
    a, b, u, w, v, z = (g.symbol(n) for n in "abuwvz")
    algebra = ArctangentSubstitution([(w, scalar.atan2(b, a), None), (v, 2.0 * w + 0.5 * u, None), (z, u - w, None)])
    found = algebra([cos(angle(u, w, v, z)), sin(angle(u, w, v, z))])
    assert not any(n.op == "atan2" for n in nodes_in_order(found))
    x, y, s = at
    turn = math.atan2(y, x)
    value = angle(s, turn, 2.0 * turn + 0.5 * s, s - turn)
    assert evaluate(found, {"a": x, "b": y, "u": s}) == pytest.approx([math.cos(value), math.sin(value)], abs=1e-14)
