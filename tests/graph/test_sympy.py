"""SymPy's expressions of nodes have their values, and come back as nodes of the same values."""

import math
from fractions import Fraction

import numpy as np
import pytest
import sympy
from scipy.interpolate import CubicSpline

from flyball.errors import ModelError
from flyball.expression_graph.graph import Graph, Symbol, directional_derivatives, evaluate
from flyball.expression_graph.printers.sympy import SympyPrinter, fraction
from flyball.math import scalar
from flyball.math.spline import pack_spline
from flyball.math.vec import quaternion_matrix

AT = {"x": 0.7, "y": -0.4}


def expressions(x, y):
    made = [
        getattr(scalar, n)(x * y + 0.3) for n in ("sin", "cos", "tan", "asin", "acos", "atan", "sinh", "cosh", "tanh")
    ]
    made += [
        scalar.exp(y) / x,
        scalar.log(x) - y,
        scalar.sqrt(x * x + y * y) ** 3,
        x ** (2.0 * y),
        x**-3 * y / (1.0 + x),
    ]
    made += [scalar.atan2(y, x), scalar.absolute(y), scalar.sign(y), scalar.rounded(4.0 * x), scalar.minimum(x, y)]
    return [
        *made,
        scalar.maximum(x, y),
        scalar.choose(y, x, 2.0 * x * y),
        scalar.choose(x * y, y, scalar.choose(x, -y, 1.0)),
    ]


def test_there_and_back():
    g = Graph()
    x, y = g.symbol("x"), g.symbol("y")
    nodes = expressions(x, y)
    printer = SympyPrinter()
    there = printer(nodes)
    exact = evaluate(nodes, AT)
    values = {printer(n): AT[n.data.name] for n in (x, y)}
    np.testing.assert_allclose([float(e.subs(values)) for e in there], exact, rtol=1e-14)
    np.testing.assert_allclose(evaluate(printer.back(there, g), AT), exact, rtol=1e-14)
    slopes = [sympy.diff(e, printer(x)) for e in there if not e.has(sympy.floor, sympy.sign, sympy.Min, sympy.Max)]
    own = [
        s
        for e, s in zip(there, directional_derivatives(nodes, [(x, 1.0)]))
        if not e.has(sympy.floor, sympy.sign, sympy.Min, sympy.Max)
    ]
    np.testing.assert_allclose(evaluate(printer.back(slopes, g), AT), np.array(evaluate(own, AT), float), rtol=1e-13)
    other = Graph()
    assert printer.back([sympy.simplify(printer(x * y))], other) == [other.symbol("x") * other.symbol("y")]


def test_a_cases_ends_are_kept():
    g = Graph()
    x = g.symbol("x")
    s = sympy.Symbol("s")
    for relation in (s > 1, s >= 1, s < 1, s <= 1):
        (node,) = SympyPrinter().back([sympy.Piecewise((1, relation), (0, True))], g, {s: x})
        for at in (0.0, 1.0, 2.0):
            assert evaluate([node], {"x": at}) == [float(bool(relation.subs(s, at)))]


def test_numbers_become_exact_where_they_are_meant_so():
    printer = SympyPrinter()
    meant = {9.81: "981/100", 1 / 3: "1/3", 0.1 * 0.1: "1/100", math.pi / 180: "pi/180", -2.5: "-5/2", 7850.0: "7850"}
    for x, text in meant.items():
        assert str(printer.number(x)) == text
        assert float(printer.number(x)) == pytest.approx(x, rel=1e-15)
    for x in (0.123456789012345, 1.23456789e-5 / 7, math.e):
        assert printer.number(x).is_Float and float(printer.number(x)) == x
    assert fraction(2.5e-7) == Fraction(1, 4_000_000)
    assert SympyPrinter(fractions=False).number(0.25).is_Float


def test_symbols_are_real_and_masses_positive():
    g = Graph()
    m, c = g.symbol(Symbol("m", "parameter", unit="kg"), 2.0), g.symbol(Symbol("c", "parameter", unit="m"), 2.0)
    printer = SympyPrinter()
    assert printer(scalar.sqrt(m * m * c * c)) == printer(m) * sympy.Abs(printer(c))
    assert SympyPrinter(positive=["c"])(scalar.sqrt(c * c)).is_Symbol


def table(g, x):
    points = np.linspace(-1.0, 2.0, 7)
    cubic = CubicSpline(points, np.sin(points))
    data = pack_spline(points, np.sin(points), cubic.c[::-1].T, "line")
    return g.table([float(v) for v in data], 0, x), cubic


def test_tables_by_name_and_by_piece():
    g = Graph()
    x = g.symbol("x")
    orders, cubic = table(g, x * x)
    for n, node in enumerate(orders):
        exact = float(cubic(0.49, n))
        assert evaluate([node], AT)[0] == pytest.approx(exact, rel=1e-13)
        printer = SympyPrinter()
        named = printer(node)
        assert named.atoms(sympy.core.function.AppliedUndef)
        assert evaluate(printer.back([named], g), AT)[0] == pytest.approx(exact, rel=1e-13)
        pieces = SympyPrinter("piecewise", fractions=False)
        assert float(pieces(node).subs(pieces(x), 0.7)) == pytest.approx(exact, rel=1e-12)
    printer = SympyPrinter()
    slope = sympy.diff(printer(orders[0]), printer(x))
    assert evaluate(printer.back([slope], g), AT)[0] == pytest.approx(1.4 * cubic(0.49, 1), rel=1e-13)


def test_functions_of_one_name_are_two():
    g = Graph()
    x = g.symbol("x")
    first, second = (lambda x: x + 1.0), (lambda x: x - 1.0)
    difference = x.called(first, x) - x.called(second, x)
    printer = SympyPrinter()
    made = printer(difference)
    assert made != 0
    assert evaluate(printer.back([made], g), AT) == [2.0]


def test_matrices():
    g = Graph()
    q = [g.symbol(n) for n in "wxyz"]
    R = np.array(quaternion_matrix(*q), object).reshape(3, 3)
    M = SympyPrinter()(R)
    assert M.shape == (3, 3)
    assert sympy.expand((M.T * M - M * M.T).applyfunc(sympy.expand)).is_zero_matrix


def test_what_is_not_known_is_named():
    g = Graph()
    with pytest.raises(ModelError, match="the symbol a is not known"):
        SympyPrinter().back([sympy.Symbol("a") + 1], g)
    with pytest.raises(ModelError, match="gamma"):
        SympyPrinter().back([sympy.gamma(sympy.Symbol("a"))], g, {"a": 1.0 * g.symbol("x")})
    with pytest.raises(ModelError, match="tables='spline'"):
        SympyPrinter(tables="spline")
