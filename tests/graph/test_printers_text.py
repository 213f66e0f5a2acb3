"""Expressions as text and LaTeX: precedence, fractions, powers, names."""

import math
from xml.etree import ElementTree

import numpy as np
import pytest
import sympy
from sympy.parsing.sympy_parser import parse_expr

from flyball.expression_graph.graph import Graph, Symbol, evaluate
from flyball.expression_graph.printers import latex as latex_printer
from flyball.expression_graph.printers import text as text_printer
from flyball.expression_graph.printers.formula_layout import latex_name
from flyball.expression_graph.printers.latex import latex
from flyball.expression_graph.printers.mathml import formula, mathml
from flyball.expression_graph.printers.text import text
from flyball.math.scalar import atan2, choose, cos, sin, sqrt


def expressions():
    g = Graph()
    m = g.symbol(Symbol("m_1", "parameter", unit="kg"), 2.0)
    r, x = g.symbol("r", 0.3), g.symbol("x")
    v = g.symbol(Symbol("hinge.rate", "velocity", r"\dot\varphi"))
    return g, m, r, x, v


CASES = [
    (lambda m, r, x, v: 0.5 * m * v * v, "m_1*hinge.rate^2/2", r"\frac{1}{2} m_{1} \dot\varphi^{2}"),
    (lambda m, r, x, v: (x + r) * (x - r) / (2.0 * m), "(r + x)*(x - r)/(2*m_1)", r"\frac{(r + x) (x - r)}{2 m_{1}}"),
    (lambda m, r, x, v: -(x + r) - m, "-m_1 - r - x", "-m_{1} - r - x"),
    (lambda m, r, x, v: m * sin(x) ** 2 * cos(x + r), "m_1*sin(x)^2*cos(r + x)", r"m_{1} \sin^{2} x \cos(r + x)"),
    (lambda m, r, x, v: sqrt(x * x + r * r) / x**3, "sqrt(r^2 + x^2)/x^3", r"\frac{\sqrt{r^{2} + x^{2}}}{x^{3}}"),
    (lambda m, r, x, v: (1.0 / (x + r)) ** 2, "1/(r + x)^2", r"\frac{1}{(r + x)^{2}}"),
    (lambda m, r, x, v: math.pi / 4.0 * x, "pi*x/4", r"\frac{\pi}{4} x"),
    (lambda m, r, x, v: 9.81 * m - 1e-7 * x, "9.81*m_1 - 1e-07*x", r"9.81 m_{1} - 10^{-7} x"),
    (lambda m, r, x, v: choose(x, r, -x), "(r if x > 0 else -x)",
     r"\begin{cases} r & x > 0 \\ -x & \text{otherwise} \end{cases}"),
    (lambda m, r, x, v: (x**1.5) * (x**1.5), "(x^(3/2))^2", r"\left(x^{\frac{3}{2}}\right)^{2}"),
    (lambda m, r, x, v: m / ((x + r) ** v) ** 3, "m_1/((r + x)^(hinge.rate))^3",
     r"\frac{m_{1}}{((r + x)^{\dot\varphi})^{3}}"),
    (lambda m, r, x, v: m * choose(x, r, x) ** 2, "m_1*(r if x > 0 else x)^2",
     r"m_{1} \left(\begin{cases} r & x > 0 \\ x & \text{otherwise} \end{cases}\right)^{2}"),
    (lambda m, r, x, v: choose(x, r, x) + m, "m_1 + (r if x > 0 else x)",
     r"m_{1} + \left(\begin{cases} r & x > 0 \\ x & \text{otherwise} \end{cases}\right)"),
    (lambda m, r, x, v: 1.0000000000001 * x, "1.0000000000001*x", "1.0000000000001 x"),
    (lambda m, r, x, v: atan2(x, r), "atan2(x, r)", r"\operatorname{atan2}(x, r)"),
    (lambda m, r, x, v: 1.0 - cos(x), "1 - cos(x)", r"1 - \cos x"),
    (lambda m, r, x, v: abs(x / 3.0 + r), "abs(r + x/3)", r"\left|r + \frac{1}{3} x\right|"),
]  # fmt: skip


@pytest.mark.parametrize(("make", "plain", "typeset"), CASES)
def test_written(make, plain, typeset):
    g, *symbols = expressions()
    x = make(*symbols)
    assert text(x) == plain
    assert latex(x) == typeset


@pytest.mark.parametrize(("make", "plain", "typeset"), CASES)
def test_powers_in_mathml_have_a_base_and_an_exponent(make, plain, typeset):
    g, *symbols = expressions()
    page = ElementTree.fromstring(mathml(make(*symbols)))
    assert all(len(e) == 2 for e in page.iter() if e.tag in ("msup", "msub", "mfrac"))
    assert all(len(e) == 3 for e in page.iter("msubsup"))


def test_a_prime_and_an_exponent_are_one_element():
    (power,) = ElementTree.fromstring(formula("f'^{2}"))
    assert power.tag == "msup"
    assert len(power) == 2


@pytest.mark.parametrize(("make", "plain", "typeset"), [c for c in CASES if " if " not in c[1]])
def test_text_is_read_back_as_the_same_value(make, plain, typeset):
    g, *symbols = expressions()
    x = make(*symbols)
    known = {"m_1": 1.7, "r": 0.4, "x": 0.9, "hinge.rate": -1.3}
    read = parse_expr(text(x).replace("^", "**").replace("hinge.rate", "rate").replace("abs", "Abs"))
    at = {sympy.Symbol(k.rpartition(".")[2]): v for k, v in known.items()}
    assert float(read.subs(at)) == pytest.approx(evaluate([x], known)[0], rel=1e-12)


@pytest.mark.parametrize(
    ("given", "expected"),
    [
        ("m_1", "m_{1}"),
        ("l2", "l_{2}"),
        ("lc1", "l_{c1}"),
        ("alpha", r"\alpha"),
        ("phi0", r"\varphi_{0}"),
        ("J_wheel", r"J_{\mathrm{wheel}}"),
        ("mass", r"\mathrm{mass}"),
        ("k_2_x", "k_{2,x}"),
        ("mu_s", r"\mu_{s}"),
        ("a%b", r"\mathrm{a\%b}"),
    ],
)
def test_names(given, expected):
    assert latex_name(given) == expected


def test_named_parts_and_matrices():
    g, m, r, x, v = expressions()
    s = x * x + r * r
    y = m * sqrt(s) + s * s
    assert text(y, {s.index: "w1"}) == "w1^2 + m_1*sqrt(w1)"
    assert latex(y, {s.index: "w_{1}"}) == r"w_{1}^{2} + m_{1} \sqrt{w_{1}}"
    M = np.array([[m, 0.0], [0.0, m * x]], object)
    assert text_printer.matrix(M) == "[ m_1  .     ]\n[ .    m_1*x ]"
    assert latex_printer.matrix(M).count(r"\cdot") == 2


def test_long_sums_are_broken_before_their_terms():
    g = Graph()
    total = sum((g.symbol(f"a{k}") * g.symbol(f"b{k}") for k in range(30)), 0.0)
    lines = text_printer.TextPrinter().lines(total, 40)
    assert max(map(len, lines)) <= 40
    assert " ".join(lines) == text(total)


@pytest.mark.parametrize(("accent", "sign"), [("dot", "˙"), ("ddot", "¨")])
def test_rates_in_mathml_carry_their_points(accent, sign):
    page = ElementTree.fromstring(formula(rf"\{accent}{{x}}"))
    over = page.find(".//{*}mover")
    assert [child.text for child in over] == ["x", sign]
