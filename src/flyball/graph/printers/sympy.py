"""Expressions for SymPy, and back: a convenience for reading and for what SymPy does well, not for numbers.

Back goes all that SymPy makes of what it was given by algebra, differentiation and simplification: rational and
trigonometric expressions, roots, powers, cases, and the functions that were handed over by name.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Mapping, Sequence
from fractions import Fraction
from typing import Any

import numpy as np

from ...errors import ModelError, optional
from ...math.spline import symbolic
from ..function import Function
from ..node import Graph, Node
from ..operations import ADD, CALL, DIVIDE, MULTIPLY, NUMBER, POWER, SYMBOL
from ..values import reached
from .from_sympy import Back
from .naming import Names

SHORT = 10_000  # denominators of numbers that are taken for fractions
DIGITS = 9  # of decimals that are
TURN = 720  # denominators of parts of pi
ROUNDING = 4.0  # spacings by which a number may miss the fraction that it is taken for
POSITIVE = ("kg", "kg*m^2", "kg m^2", "kg*m**2")  # units of what is greater than zero wherever it is not zero


class SympyPrinter:
    """Expressions of one graph as SymPy expressions, and these as expressions again.

    Parameters
    ----------
    tables : {"function", "piecewise"}
        Tables (splines) as functions that are known by name, or as their cubics.
    fractions : bool
        Whether numbers that are short fractions or decimals, or such parts of pi, become exact ones. They do if they
        are that number within rounding. Others are floats of 17 digits.
    positive : collection of str
        Names of further symbols that are greater than zero. Masses and moments of inertia are, where they have a value
        that is. All symbols are real.
    """

    def __init__(self, tables: str = "function", fractions: bool = True, positive: Collection[str] = ()) -> None:
        if tables not in ("function", "piecewise"):
            raise ModelError(f"tables={tables!r}: must be 'function' or 'piecewise'")
        self.sympy = optional("sympy", "symbolic")
        self.tables, self.fractions, self.positive = tables, fractions, set(positive)
        self.symbols: dict[Any, Node] = {}  # what SymPy's symbols stand for
        self.functions: dict[str, Function] = {}  # and its functions
        self._names = Names()
        self._called: dict[Function, str] = {}
        self._known: dict[int, Any] = {}

    def __call__(self, x: Any) -> Any:
        """SymPy's expression of a node or number; a list, or a ``Matrix`` of a vector or matrix of these."""
        if isinstance(x, np.ndarray):
            flat = self._expressions(x.ravel().tolist())
            rows = x.shape[0]
            return self.sympy.ImmutableDenseMatrix(rows, x.size // rows if rows else 0, flat)
        if isinstance(x, list | tuple):
            return self._expressions(x)
        return self._expressions([x])[0]

    def back(self, expressions: Iterable[Any], graph: Graph, symbols: Mapping[Any, Any] | None = None) -> list[Node]:
        """Nodes of SymPy expressions.

        Parameters
        ----------
        expressions : iterable
            Of SymPy expressions.
        graph : Graph
        symbols : mapping, optional
            From SymPy's symbols, or their names, to nodes or numbers, for those that this printer has not made.

        Raises
        ------
        ModelError
            Where a symbol or a function is not known.
        """
        return Back(self, graph, dict(symbols or {})).nodes(list(expressions))

    def _expressions(self, xs: Sequence[Any]) -> list[Any]:
        for x in reached(xs):
            if x.index not in self._known:
                self._known[x.index] = self._made(x, [self._known[a.index] for a in x.args])
        return [self._known[x.index] if isinstance(x, Node) else self.number(float(x)) for x in xs]

    def number(self, x: float) -> Any:
        """A number; exact if it is meant to be."""
        sp = self.sympy
        if not math.isfinite(x):
            return sp.nan if x != x else sp.oo if x > 0.0 else -sp.oo
        if x == math.floor(x) and abs(x) < 1e15:
            return sp.Integer(int(x))
        if self.fractions:
            f = fraction(x)
            if f is not None:
                return sp.Rational(f.numerator, f.denominator)
            f = _near(x / math.pi, TURN)
            if f is not None:
                return sp.Rational(f.numerator, f.denominator) * sp.pi
        return sp.Float(repr(x), 17)

    def _made(self, x: Node, args: list[Any]) -> Any:
        sp = self.sympy
        if x.op == NUMBER:
            return self.number(x.value)
        if x.op == SYMBOL:
            masses = x.data.unit in POSITIVE and x.value > 0.0
            made = sp.Symbol(
                x.data.name, **({"positive": True} if masses or x.data.name in self.positive else {"real": True})
            )
            self.symbols[made] = x
            return made
        if x.op == CALL:
            return self._called_by_name(x, args)
        if x.op == ADD:
            return args[0] + args[1]
        if x.op == MULTIPLY:
            return args[0] * args[1]
        if x.op == DIVIDE:
            return args[0] / args[1]
        if x.op == POWER:
            return args[0] ** args[1]
        return expression(sp, x.op, args)

    def _called_by_name(self, x: Node, args: list[Any]) -> Any:
        """A table's piece by piece, if wanted; else a function, derivatives of which are SymPy's."""
        told, order = x.data.told, 0
        if "table" in told:
            order = told["order"]
            if self.tables == "piecewise" and not told["moved"]:
                u = self.sympy.Dummy("u", real=True)
                return symbolic(told["table"], 0, u).diff(u, order).subs(u, args[0])
        value = told.get("value", x.data)
        made: Any = self.sympy.Function(self._name(value), real=True)(*args)
        if order == 0:
            return made
        if args[0].is_Symbol:
            return self.sympy.Derivative(made, (args[0], order))
        u = self.sympy.Symbol("xi", real=True)
        inner = self.sympy.Function(self._name(value), real=True)(u, *args[1:])
        return self.sympy.Subs(self.sympy.Derivative(inner, (u, order)), u, args[0])

    def _name(self, function: Function) -> str:
        if function not in self._called:
            name = self._called[function] = self._names(function.name)
            self.functions[name] = function
        return self._called[function]


def fraction(x: float) -> Fraction | None:
    """The short fraction or decimal that a number is within rounding."""
    short = _near(x, SHORT)
    if short is not None:
        return short
    digits = repr(x).split("e")[0].replace(".", "").replace("-", "").strip("0")
    return Fraction(repr(x)) if len(digits) <= DIGITS else None


def _near(x: float, denominator: int) -> Fraction | None:
    if not 1e-12 < abs(x) < 1e12:
        return None
    found = Fraction(x).limit_denominator(denominator)
    return found if abs(float(found) - x) <= ROUNDING * math.ulp(x) else None


def expression(sp: Any, name: str, args: Sequence[Any]) -> Any:
    """A function of `math/scalar.py` in SymPy."""
    if name == "absolute":
        return sp.Abs(*args)
    if name == "rounded":
        return sp.floor(args[0] + sp.Rational(1, 2))
    if name in ("minimum", "maximum"):
        return (sp.Min if name == "minimum" else sp.Max)(*args)
    if name == "choose":
        return sp.Piecewise((args[1], args[0] > 0), (args[2], True))
    return getattr(sp, name)(*args)
