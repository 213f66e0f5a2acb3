"""Laws with common subexpressions that are computed once."""

from __future__ import annotations

import numpy as np
import pytest

from flyball.expression_graph.graph import Graph
from flyball.expression_graph.tracing import law_tree
from flyball.laws.breakpoints import find_corners
from flyball.laws.bytecode import BY_MOTION, COPY, evaluate, evaluate_jet
from flyball.laws.compilation import compile_law
from flyball.laws.interval_evaluation import evaluate_over_time, read_steps
from flyball.model.expression_parser import DEFINITIONS
from flyball.model.expressions import Expression

A = 1.7


def formula(t, a, x):
    """Shares sums within sums, several levels deep."""
    u = t * a + x
    v = u * u + 1.0 / u
    w = (v + u) * (v - t)
    return w * w + v / (w + 20.0)


def compiled(tree):
    code, const = [], [A]
    at, depth = compile_law(Expression("law", tree), ("t", "x"), ["a"], code, const)
    return np.array(code), np.array(const), at, np.zeros((depth, 3))


def shared():
    g = Graph()
    return law_tree(formula(g.symbol("t"), g.symbol("a", A), g.symbol("x")))


def nested():
    """The law inside the definitions of another, which is used twice."""
    g = Graph()
    inner = shared()
    outer = law_tree(formula(g.symbol("t"), g.symbol("a", A), g.symbol("y")))

    def replaced(node):
        if node.kind == "name" and node.value == "y":
            return inner
        return type(node)(node.kind, tuple(replaced(a) for a in node.args), node.value)

    return replaced(outer)


@pytest.mark.parametrize("made", [shared, nested])
def test_values_and_derivatives_are_those_of_the_formula(made):
    tree = made()
    assert tree.kind == DEFINITIONS
    code, const, at, stack = compiled(tree)
    assert COPY in code[at + 2 :: 2]

    def value(t, x):
        inner = formula(t, A, x)
        return inner if made is shared else formula(t, A, inner)

    t, x = 0.4, 0.3
    nothing = np.zeros((3, 1))
    assert evaluate(code, const, at, stack, (t, x), nothing) == pytest.approx(value(t, x), rel=1e-13)
    assert Expression("law", tree).evaluate({"t": t, "x": x, "a": A}) == pytest.approx(value(t, x), rel=1e-13)
    many = np.linspace(0.1, 1, 7)
    over = evaluate_over_time(read_steps(code, at), const, (many, many**2), (np.zeros((0, 7)), np.zeros((0, 7))))
    assert over == pytest.approx(value(many, many**2), rel=1e-13)
    h = 1e-20
    by_step = value(t + 1j * h, x).imag / h
    z = evaluate(code, const.astype(complex), at, stack.astype(complex), (t + 1j * h, x + 0j), nothing.astype(complex))
    assert z.imag / h == pytest.approx(by_step, rel=1e-12)


def test_jets_and_steps_by_time():
    g = Graph()
    u = g.symbol("t") * g.symbol("a", A) + 1.0
    tree = law_tree(u * u * g.function("sin", u) + g.function("absolute", u - 2.0))
    code, const, at, stack = compiled(tree)
    t = 0.4
    jet = evaluate_jet(code, const, at, stack, t, np.zeros((3, 1)), BY_MOTION)
    w = t * A + 1
    expected = (
        w * w * np.sin(w) + abs(w - 2),
        A * (2 * w * np.sin(w) + w * w * np.cos(w) - 1),
        A * A * (2 * np.sin(w) + 4 * w * np.cos(w) - w * w * np.sin(w)),
    )
    assert jet == pytest.approx(expected, rel=1e-13)
    assert len(find_corners(read_steps(code, at), const)) == 1
