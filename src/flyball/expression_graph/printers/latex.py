r"""Expressions in LaTeX: ``m_{2} \left(l_{1}^{2} + 2 l_{1} l_{c2} \cos q_{2}\right)``."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ..graph import ADD, NUMBER, POWER, SYMBOL, Node
from ..simplification.factors import ExactNumber
from .formula_layout import Layout, Power, Term, latex_escaped, latex_symbol, number_text

OPERATORS = {
    "sin": r"\sin", "cos": r"\cos", "tan": r"\tan", "asin": r"\arcsin", "acos": r"\arccos", "atan": r"\arctan",
    "exp": r"\exp", "log": r"\ln", "sinh": r"\sinh", "cosh": r"\cosh", "tanh": r"\tanh", "minimum": r"\min",
    "maximum": r"\max", "atan2": r"\operatorname{atan2}", "sign": r"\operatorname{sgn}",
    "rounded": r"\operatorname{round}",
}  # fmt: skip


# From so many characters of LaTeX on, a sum may be broken even in a fraction or high parentheses.
LONG = 160
WORD = re.compile(r"\\(?:text|mathrm)\{[^}]{2}")
BREAK = "\x1f"
"""Mark of a possible line break: before terms of a sum outside of fractions, roots and high parentheses."""


def latex(x: Any, names: Mapping[int, str] | None = None) -> str:
    """One expression in LaTeX math mode.

    Parameters
    ----------
    x : Node or number
    names : mapping of int to str, optional
        LaTeX names of nodes that are not written out, by node index.
    """
    return LatexPrinter(names).expression(x).replace(BREAK, "")


class LatexPrinter:
    """Printer of expressions in LaTeX."""

    def __init__(self, names: Mapping[int, str] | None = None) -> None:
        self.layout = Layout(names)

    def expression(self, x: Any, top: bool = False) -> str:
        """A sum with marks of possible breaks; ``top``: written out even if it has a name."""
        if not isinstance(x, Node):
            return number(float(x))
        if x.op == "choose" and (top or x.index not in self.layout.names):
            return self.cases(x).replace(BREAK, "")
        return self.signed(self.layout.sum(x, top), top)

    def products(self, products: Sequence[tuple[Any, Node]]) -> str:
        """A sum of expressions times symbols, in the order given."""
        return self.signed([self.layout.term(symbol.graph.node(c * symbol)) for c, symbol in products])

    def signed(self, terms: Sequence[Term], top: bool = False) -> str:
        """Terms with their signs."""
        out = ""
        for k, term in enumerate(terms):
            sign = (" - " if term.negative else " + ") if k else ("-" if term.negative else "")
            out += (BREAK if k else "") + sign + self.term(term, top)
        return out

    def term(self, term: Term, top: bool = False) -> str:
        """One term without its sign."""
        up, down = _numeric(term.number)
        alone = bool(term.below)  # a sum that is a whole side of a fraction has no parentheses
        above = [self.side(p, alone and len(term.above) == 1 and not up, top) for p in term.above]
        below = [self.side(p, alone and len(term.below) == 1 and not down) for p in term.below]
        if term.below and BREAK in juxtaposed(above) and len(juxtaposed(above)) > LONG:
            above = [self.power(p, top) for p in term.above]
            return rf"\frac{{{juxtaposed(up) or '1'}}}{{{juxtaposed(down + below)}}} {juxtaposed(above)}"
        if term.below:
            return rf"\frac{{{juxtaposed(up + above) or '1'}}}{{{juxtaposed(down + below)}}}".replace(BREAK, "")
        front = [rf"\frac{{{' '.join(up) or '1'}}}{{{down[0]}}}"] if down else up
        return juxtaposed(front + above) or "1"

    def side(self, power: Power, single: bool, top: bool = False) -> str:
        """A factor in the numerator or denominator."""
        x, n = power
        if single and n == 1 and x.op == ADD and x.index not in self.layout.names:
            return self.expression(x)
        return self.power(power, top)

    def power(self, power: Power, top: bool = False) -> str:
        """A factor."""
        x, n = power
        named = self.layout.names.get(x.index)
        if named is not None and not (top and x.op not in (NUMBER, SYMBOL)):
            return named if n == 1 else f"{_braced(named)}^{{{n}}}"
        if x.op == SYMBOL:
            return latex_symbol(x.data) if n == 1 else f"{_braced(latex_symbol(x.data))}^{{{n}}}"
        if x.op in OPERATORS:
            return self.function(OPERATORS[x.op] + (f"^{{{n}}}" if n != 1 else ""), x)
        inner = self.factor(x)
        inner = inner if x.op == ADD else inner.replace(BREAK, "")
        if n == 1:
            return inner
        return f"{self.parentheses(inner) if x.op == POWER else inner}^{{{n}}}"

    def function(self, operator: str, x: Node) -> str:
        """A function; without parentheses if its argument is one symbol."""
        if len(x.args) == 1 and (x.args[0].op == SYMBOL or x.args[0].index in self.layout.names):
            return f"{operator} {self.expression(x.args[0])}"
        return f"{operator}{self.parentheses(', '.join(map(self.delimited, x.args)))}".replace(BREAK, "")

    def factor(self, x: Node) -> str:
        """Any other factor without its exponent."""
        if x.op == "sqrt":
            return rf"\sqrt{{{self.expression(x.args[0])}}}"
        if x.op == "absolute":
            return rf"\left|{self.expression(x.args[0])}\right|"
        if x.op == POWER:
            base, exponent = x.args
            symbol = base.op == SYMBOL and base.index not in self.layout.names
            inner = _braced(latex_symbol(base.data)) if symbol else self.parentheses(self.expression(base))
            return f"{inner}^{{{self.expression(exponent)}}}"
        if x.op == "choose":
            return self.parentheses(self.cases(x))
        if x.op == "call":
            primes = "'" * x.data.details.get("order", 0)
            return rf"\operatorname{{{latex_escaped(x.data.name)}}}{primes}" + self.parentheses(
                ", ".join(map(self.delimited, x.args))
            )
        return self.parentheses(self.expression(x))

    def delimited(self, x: Node) -> str:
        """An expression that stands next to others, in parentheses if necessary."""
        return self.power((x, 1)) if x.op == "choose" else self.expression(x)

    def cases(self, x: Node) -> str:
        """Cases of a condition; they have no closing delimiter."""
        c, a, b = map(self.delimited, x.args)
        return rf"\begin{{cases}} {a} & {c} > 0 \\ {b} & \text{{otherwise}} \end{{cases}}"

    @staticmethod
    def parentheses(inner: str) -> str:
        """Parentheses with the height of their content."""
        high = any(mark in inner for mark in (r"\frac", r"\sqrt", r"\begin", r"\left"))
        if not high:
            return f"({inner})"
        if BREAK in inner and len(inner) > LONG:  # of fixed height, so that lines can be broken inside
            return rf"\Bigl({inner}\Bigr)"
        return rf"\left({inner}\right)".replace(BREAK, "")


def _numeric(x: ExactNumber | float) -> tuple[list[str], list[str]]:
    """A number as factors of numerator and denominator."""
    if not isinstance(x, ExactNumber):
        return [number(x)], []
    up = [str(x.numerator)] if x.numerator != 1 else []
    up += [rf"\sqrt{{{x.root}}}"] if x.root > 1 else []
    up += [r"\pi"] if x.pi else []
    return up, [str(x.denominator)] if x.denominator != 1 else []


def juxtaposed(factors: Sequence[str]) -> str:
    """Factors side by side; words are separated."""
    out = ""
    for k, factor in enumerate(factors):
        word = WORD.match(factor) or (k and WORD.match(factors[k - 1]))
        out += (r" \, " if word and k else " " if k else "") + factor
    return out


def _braced(latex: str) -> str:
    """A name in braces if necessary, ready for an exponent."""
    return f"({latex})" if "^" in latex else latex


def number(x: float) -> str:
    """A decimal, with a power of ten where it has one."""
    if not math.isfinite(x):
        return r"\mathrm{NaN}" if x != x else r"-\infty" if x < 0.0 else r"\infty"
    mantissa, _, exponent = number_text(x).partition("e")
    front = "" if mantissa == "1" else "-" if mantissa == "-1" else rf"{mantissa} \cdot "
    return f"{front}10^{{{int(exponent)}}}" if exponent else mantissa


def matrix(rows: np.ndarray | Sequence[Sequence[Any]], names: Mapping[int, str] | None = None) -> str:
    """A matrix; zeros are dots."""
    printer = LatexPrinter(names)
    cells = [[r"\cdot" if x == 0.0 else printer.expression(x).replace(BREAK, "") for x in row] for row in rows]
    columns = max((len(row) for row in cells), default=0)
    body = " \\\\\n".join(" & ".join(row) for row in cells)
    return rf"\left[\begin{{array}}{{{'c' * columns}}}" + f"\n{body}\n" + r"\end{array}\right]"
