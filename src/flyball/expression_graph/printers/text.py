"""Expressions as plain text: ``m2*(l1^2 + lc2^2 + 2*l1*lc2*cos(q2))``."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ..graph import NUMBER, POWER, SYMBOL, Node
from ..simplification.factors import ExactNumber
from .formula_layout import Layout, Power, Term, number_text, wrap_fragments

NAMES = {"absolute": "abs", "minimum": "min", "maximum": "max", "rounded": "round"}


def text(x: Any, names: Mapping[int, str] | None = None) -> str:
    """One expression.

    Parameters
    ----------
    x : Node or number
    names : mapping of int to str, optional
        Names of nodes that are not written out, by node index.
    """
    return TextPrinter(names).expression(x)


class TextPrinter:
    """Printer of expressions as text."""

    def __init__(self, names: Mapping[int, str] | None = None) -> None:
        self.layout = Layout(names)

    def expression(self, x: Any, top: bool = False) -> str:
        """A sum; ``top``: written out even if it has a name."""
        if not isinstance(x, Node):
            return number(x)
        return self.signed(self.layout.sum(x, top), top)

    def signed(self, terms: Sequence[Term], top: bool = False) -> str:
        """Terms with their signs."""
        out = ""
        for k, term in enumerate(terms):
            sign = (" - " if term.negative else " + ") if k else ("-" if term.negative else "")
            out += sign + self.term(term, top)
        return out

    def lines(self, x: Any, width: int = 96) -> list[str]:
        """A sum, broken before signs where a line would be longer than ``width``."""
        return broken_lines(self.expression(x, True), width)

    def products(self, products: Sequence[tuple[Any, Node]]) -> str:
        """A sum of expressions times symbols, in the order given."""
        return self.signed([self.layout.term(symbol.graph.node(c * symbol)) for c, symbol in products])

    def term(self, term: Term, top: bool = False) -> str:
        """One term without its sign."""
        above = [self.power(p, top) for p in term.above]
        below = [self.power(p) for p in term.below]
        x = term.number
        if isinstance(x, ExactNumber):
            up = [str(x.numerator)] if x.numerator != 1 else []
            up += [f"sqrt({x.root})"] if x.root > 1 else []
            up += ["pi"] if x.pi else []
            above = up + above
            below = ([str(x.denominator)] if x.denominator != 1 else []) + below
        else:
            above = [number_text(x), *above]
        line = "*".join(above) or "1"
        if not below:
            return line
        return f"{line}/{below[0]}" if len(below) == 1 else f"{line}/({'*'.join(below)})"

    def power(self, power: Power, top: bool = False) -> str:
        """A factor."""
        x, n = power
        inner = self.factor(x, top)
        if n == 1:
            return inner
        return f"({inner})^{n}" if x.op == POWER and x.index not in self.layout.names else f"{inner}^{n}"

    def factor(self, x: Node, top: bool = False) -> str:
        """A factor without its exponent, in parentheses if it is a sum."""
        named = self.layout.names.get(x.index)
        if named is not None and not (top and x.op not in (NUMBER, SYMBOL)):
            return named
        if x.op == SYMBOL:
            return str(x.data.name)
        if x.op == "add":
            return f"({self.expression(x)})"
        if x.op == POWER:
            base, exponent = (self.expression(y) for y in x.args)
            return f"{base if x.args[0].op == SYMBOL else f'({base})'}^({exponent})"
        if x.op == "choose":
            c, a, b = (self.expression(y) for y in x.args)
            return f"({a} if {c} > 0 else {b})"
        name = x.data.printed_name if x.op == "call" else NAMES.get(x.op, x.op)
        return f"{name}({', '.join(self.expression(y) for y in x.args)})"


def broken_lines(line: str, width: int) -> list[str]:
    """Break a line before signs into parts of at most ``width`` characters."""
    return [line.strip() for line in wrap_fragments(re.split(r"(?= [-+=] )", line), width)]


def number(x: Any) -> str:
    """A number that is not a node."""
    return number_text(float(x))


def matrix(rows: np.ndarray | Sequence[Sequence[Any]], names: Mapping[int, str] | None = None) -> str:
    """A matrix with aligned columns; zeros are dots."""
    printer = TextPrinter(names)
    cells = [["." if x == 0.0 else printer.expression(x) for x in row] for row in rows]
    widths = [max(map(len, column)) for column in zip(*cells, strict=True)]
    return "\n".join("[ " + "  ".join(c.ljust(w) for c, w in zip(row, widths, strict=True)) + " ]" for row in cells)
