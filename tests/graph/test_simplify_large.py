"""Large expressions: parts get names, nothing swells, values stay."""

import numpy as np
import pytest

from flyball.expression_graph.graph import Graph, evaluate, nodes_in_order
from flyball.expression_graph.printers.formula_layout import wrap_fragments
from flyball.expression_graph.printers.text import TextPrinter, text
from flyball.expression_graph.simplification.factors import symbol_count
from flyball.expression_graph.simplification.simplify import (
    extract_common_subexpressions,
    simplified,
    simplified_with_symbols,
)
from flyball.math.scalar import cos, sin, sqrt


def put_in(nodes, definitions, at):
    """Values with the symbols' definitions put in."""
    known = dict(at)
    for x, y in definitions:
        known[x.data.name] = evaluate([y], known)[0]
    return evaluate(nodes, known)


def nested(depth):
    """A product of sums of products ...: few operations, 3^depth terms."""
    g = Graph()
    x = [g.symbol(f"x{k}") for k in range(depth + 2)]
    y = x[0]
    for k in range(depth):
        y = (y + x[k + 1]) * (y - sin(x[k + 2])) + cos(y)
    return g, x, y


@pytest.mark.parametrize("depth", [3, 6, 12])
def test_what_would_swell_has_names(depth):
    g, x, y = nested(depth)
    (found,), definitions = simplified_with_symbols([y])
    assert symbol_count([found, *(d for _, d in definitions)]) < 30.0 * (depth + 2)
    at = {s.data.name: v for s, v in zip(x, np.random.default_rng(depth).uniform(-0.1, 0.1, len(x)), strict=True)}
    assert put_in([found], definitions, at)[0] == pytest.approx(evaluate([y], at)[0], rel=1e-11)


def test_simplifying_many_operations_stays_quick_and_true():
    """A product of 25 rotations about changing axes: 3^25 terms if multiplied out."""
    g, R = Graph(), np.eye(3).astype(object)
    names = [f"a{k}" for k in range(25)]
    for k, n in enumerate(names):
        c, s = cos(g.symbol(n)), sin(g.symbol(n))
        turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]], object)
        R = R @ np.roll(np.roll(turn, k % 3, axis=0), k % 3, axis=1)
    found = simplified(R)
    assert len(nodes_in_order(found.ravel().tolist())) < 1500
    at = dict(zip(names, np.random.default_rng(0).uniform(-3.0, 3.0, 25), strict=True))
    np.testing.assert_allclose(evaluate(list(found.ravel()), at), evaluate(list(R.ravel()), at), atol=1e-11)


def test_names_are_given_to_what_recurs_and_to_no_symbol_that_is_there():
    g = Graph()
    w, x, y = g.symbol("w_1"), g.symbol("x"), g.symbol("y")
    s = sqrt((x + y) ** 2 + (x - w) ** 2)
    found, definitions = extract_common_subexpressions([s * x, s * y + 1.0, w / s], gain=8.0)
    assert [d[0].data.name for d in definitions] == ["c_1"]
    assert [text(f) for f in found] == ["x*c_1", "1 + y*c_1", "w_1/c_1"]
    assert extract_common_subexpressions([x + y, x * y]) == ([x + y, x * y], [])


def test_lines_are_broken_where_few_parentheses_are_open():
    g = Graph()
    a = [g.symbol(f"alpha{k}") for k in range(12)]
    x = a[0] * (a[1] + a[2] * (a[3] + a[4]) + a[5]) + a[6] * (a[7] + a[8] + a[9] + a[10])
    lines = TextPrinter().lines(x, 50)
    assert lines == [
        "alpha0*(alpha1 + alpha5 + alpha2*(alpha3 + alpha4))",
        "+ alpha6*(alpha7 + alpha8 + alpha9 + alpha10)",
    ] or all(len(line) <= 50 for line in lines)
    assert "".join(wrap_fragments(["ab", " + (c", " + d)", " + e"], 6)) == "ab + (c + d) + e"
