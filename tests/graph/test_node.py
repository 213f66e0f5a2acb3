"""Expressions as numbers: what is made once, what is dropped, values and derivatives of formulas that run on them."""

import math

import numpy as np
import pytest
import sympy

from flyball.expression_graph.graph import (
    Graph,
    Symbol,
    UndeterminedDecision,
    directional_derivatives,
    evaluate,
    jacobian,
    nodes_in_order,
    substitute,
    symbols_of,
)
from flyball.math import scalar
from flyball.math.vec import mm, quaternion_matrix


def test_equal_expressions_are_one_node():
    g = Graph()
    x, y = g.symbol("x"), g.symbol("y")
    assert x * y + x is x + y * x
    assert x - x == 0.0 and 2.0 * x - x is x and x * 0.0 == 0.0 and x / x == 1.0
    assert scalar.sin(-x) is -scalar.sin(x)
    assert scalar.sin(g.number(0.5)) == math.sin(0.5)


def test_a_formula_on_expressions_gives_its_numbers_and_derivatives():
    g = Graph()
    names = "wxyz"
    q = [g.symbol(n) for n in names]
    R = mm(quaternion_matrix(*q), quaternion_matrix(*q))
    at = dict(zip(names, (0.3, -0.5, 0.1, 0.8), strict=True))
    expected = mm(quaternion_matrix(*at.values()), quaternion_matrix(*at.values()))
    np.testing.assert_allclose(evaluate(R, at), expected, rtol=1e-15)
    J = jacobian(R, q)
    for k, n in enumerate(names):
        stepped = at | {n: at[n] + 1e-30j}
        exact = np.array(mm(quaternion_matrix(*stepped.values()), quaternion_matrix(*stepped.values()))).imag / 1e-30
        np.testing.assert_allclose(np.array(evaluate(list(J[:, k]), at), float), exact, rtol=1e-13, atol=1e-13)


@pytest.mark.parametrize(
    "name", ["sqrt", "sin", "cos", "tan", "asin", "acos", "atan", "exp", "log", "sinh", "cosh", "tanh"]
)
def test_derivatives_are_those_of_sympy(name):
    g = Graph()
    x = g.symbol("x")
    slope = directional_derivatives([getattr(scalar, name)(x * x)], [(x, 1.0)])[0]
    s = sympy.Symbol("x")
    exact = sympy.diff(getattr(sympy, name)(s * s), s).subs(s, 0.6)
    assert evaluate([slope], {"x": 0.6})[0] == pytest.approx(float(exact), rel=1e-13)


def test_what_moves_decides_nothing():
    g = Graph()
    x, length = g.symbol("x"), g.symbol("length", 2.0)
    assert (length * length).real == 4.0 and length > 1.0
    with pytest.raises(UndeterminedDecision, match="moves"):
        _ = (x * length).real > 0.0
    assert evaluate([scalar.choose(x - 1.0, x, length)], {"x": 3.0})[0] == 3.0
    assert symbols_of([x * length + 1.0]) == [x, length]


def test_parts_are_replaced():
    g = Graph()
    x, y = g.symbol("x"), g.symbol("y")
    (found,) = substitute([scalar.sin(x * y) + x], [(x, 2.0)])
    assert found is scalar.sin(2.0 * y) + 2.0
    assert len(nodes_in_order([found])) == 5


def test_a_name_stands_for_one_thing():
    g = Graph()
    g.symbol(Symbol("a", "coordinate"))
    with pytest.raises(ValueError, match="'a' is a symbol for something else"):
        g.symbol(Symbol("a", "velocity"))


def test_tables_keep_their_names_and_derivatives_have_primes():
    from flyball.expression_graph.graph import directional_derivatives
    from flyball.expression_graph.printers.latex import latex
    from flyball.expression_graph.printers.text import text
    from flyball.model.table import Table

    g = Graph()
    x = g.symbol("x")
    g.functions.names[0] = "lift"
    value, slope, bend = g.table(Table("lift", x=(0.0, 1.0, 2.0, 3.0), y=(0.0, 2.0, 1.0, 0.5)).data(), 0, x)
    assert [text(value), text(slope), text(bend)] == ["lift(x)", "lift'(x)", "lift''(x)"]
    assert latex(slope) == r"\operatorname{lift}'(x)"
    assert directional_derivatives([value, slope], [(x, 1.0)]) == [slope, bend]
