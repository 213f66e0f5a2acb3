"""Conversion of expressions to SymPy and back, for reading and for SymPy's algebra, not for numerical work.

The conversion back supports results of SymPy's algebra, differentiation and simplification: rational and trigonometric
expressions, roots, powers, cases, and functions that were passed by name.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from fractions import Fraction
from typing import Any

import numpy as np

from ...errors import ModelError, import_optional
from ...math import scalar
from ...math.spline import spline_expression
from ..graph import ADD, CALL, DIVIDE, MULTIPLY, NUMBER, POWER, SYMBOL, Function, Graph, Node, nodes_in_order
from .routines import Identifiers

SYMPY_FUNCTIONS: dict[str, Callable[..., Any]] = {
    "sin": scalar.sin, "cos": scalar.cos, "tan": scalar.tan, "asin": scalar.asin, "acos": scalar.acos,
    "atan": scalar.atan, "exp": scalar.exp, "log": scalar.log, "sinh": scalar.sinh, "cosh": scalar.cosh,
    "tanh": scalar.tanh, "atan2": scalar.atan2, "Abs": scalar.absolute, "sign": scalar.sign,
    "floor": lambda x: scalar.rounded(x - 0.5),
    "sec": lambda x: 1.0 / scalar.cos(x), "csc": lambda x: 1.0 / scalar.sin(x),
    "cot": lambda x: scalar.cos(x) / scalar.sin(x), "acot": lambda x: scalar.atan(1.0 / x),
    "coth": lambda x: 1.0 / scalar.tanh(x),
    "Heaviside": lambda x, half=0.5: scalar.choose(x, 1.0, scalar.choose(-x, 0.0, half)),
}  # fmt: skip
"""SymPy's functions by name."""


class SympyReader:
    """One conversion from SymPy to nodes."""

    def __init__(self, printer: SympyPrinter, graph: Graph, symbols: dict[Any, Any]) -> None:
        self.printer, self.graph, self.sympy = printer, graph, printer.sympy
        self.named = {str(s): x for s, x in symbols.items()}
        self._known: dict[Any, Node] = {}

    def nodes(self, expressions: list[Any]) -> list[Node]:
        """Nodes of expressions; each subexpression is converted once."""
        wanted = [self.sympy.sympify(x) for x in expressions]
        to_do = list(wanted)
        while to_do:
            x = to_do[-1]
            missing = [] if x in self._known else [a for a in self._parts(x) if a not in self._known]
            if missing:
                to_do += missing
                continue
            to_do.pop()
            if x not in self._known:
                self._known[x] = self.graph.node(self._constructed(x))
        return [self._known[x] for x in wanted]

    def _parts(self, x: Any) -> list[Any]:
        """Subexpressions that must be converted first."""
        sp = self.sympy
        if x.is_number and x.is_real and not x.args:
            return []
        if isinstance(x, sp.Piecewise):
            found = []
            for value, condition in x.args:
                found += [value] if condition in (True, False) else [value, condition.lhs, condition.rhs]
            return found
        if isinstance(x, sp.Derivative):
            return list(x.expr.args)
        if isinstance(x, sp.Subs):
            return [*x.point, *[a for a in x.expr.expr.args if a not in x.variables]]
        return list(x.args)

    def _constructed(self, x: Any) -> Any:
        sp, known = self.sympy, self._known
        if x.is_Symbol:
            return self._symbol(x)
        if not x.args or x.is_Rational or x.is_Float:
            return float(x)
        if x.is_Add:
            return sum_of([known[a] for a in x.args])
        if x.is_Mul:
            return self._product(x)
        if x.is_Pow:
            return self._power(x)
        if isinstance(x, sp.Piecewise):
            return self._cases(x)
        if isinstance(x, sp.Derivative | sp.Subs):
            return self._slope(x)
        args = [known[a] for a in x.args]
        name = type(x).__name__
        if name in self.printer.functions and isinstance(x, sp.core.function.AppliedUndef):
            return self.graph.call(self.printer.functions[name], *args)
        if name in ("Min", "Max"):
            return nested(scalar.minimum if name == "Min" else scalar.maximum, args)
        if name not in SYMPY_FUNCTIONS:
            raise ModelError(f"SymPy's {name} in {x} has no counterpart here: rewrite it in elementary functions")
        return SYMPY_FUNCTIONS[name](*args)

    def _symbol(self, x: Any) -> Any:
        if x.name in self.named:
            return self.named[x.name]
        if x not in self.printer.symbols:
            raise ModelError(f"the symbol {x} is not known: give its meaning, symbols={{{x.name!r}: ...}}")
        found = self.printer.symbols[x]
        return found if found.graph is self.graph else self.graph.rebuilt(found, ())

    def _product(self, x: Any) -> Any:
        above: Any = 1.0
        below: Any = 1.0
        for a in x.args:
            if a.is_Pow and a.exp.is_number and a.exp.is_negative:
                below = below * self.graph.power(self._known[a.base], float(-a.exp))
            else:
                above = above * self._known[a]
        return above / below

    def _power(self, x: Any) -> Any:
        if x.base == self.sympy.E:
            return scalar.exp(self._known[x.exp])
        base = self._known[x.base]
        if x.exp.is_Rational and x.exp.q == 2:
            root = self.graph.power(scalar.sqrt(base), float(abs(x.exp.p)))
            return root if x.exp.p > 0 else 1.0 / root
        return base ** self._known[x.exp]

    def _cases(self, x: Any) -> Any:
        """Cases as choices, the last first."""
        found: Any = math.nan
        for value, condition in reversed(x.args):
            here = self._known[value]
            if condition in (True, False):
                found = here if condition else found
                continue
            less = self._known[condition.lhs] - self._known[condition.rhs]
            found = choose_by_relation(type(condition).__name__, less, here, found)
        return found

    def _slope(self, x: Any) -> Any:
        """Derivatives, by the first argument, of a function of which only the name is known."""
        call, args = x, list(x.args)
        at: dict[Any, Any] = {}
        if isinstance(x, self.sympy.Subs):
            at = {v: self._known[p] for v, p in zip(x.variables, x.point, strict=True)}
            call = x.expr
        function = self.printer.functions.get(type(call.expr).__name__)
        if function is None or not isinstance(call, self.sympy.Derivative):
            raise ModelError(f"the derivative {x} is not known here")
        for by, count in call.variable_count:
            for _ in range(int(count)):
                function = function.derivative(call.expr.args.index(by))
        args = [at[a] if a in at else self._known[a] for a in call.expr.args]
        return self.graph.call(function, *args)


def choose_by_relation(relation: str, less: Any, a: Any, b: Any) -> Any:
    """Expression a where ``less`` (left minus right) fulfils a relation, else b."""
    if relation == "StrictGreaterThan":
        return scalar.choose(less, a, b)
    if relation == "StrictLessThan":
        return scalar.choose(-less, a, b)
    if relation == "GreaterThan":
        return scalar.choose(-less, b, a)
    if relation == "LessThan":
        return scalar.choose(less, b, a)
    raise ModelError(f"a case with the relation {relation} is not supported: use >, <, >= or <=")


def sum_of(args: Sequence[Any]) -> Any:
    """Sum, from the left."""
    return nested(lambda a, b: a + b, args)


def nested(f: Callable[[Any, Any], Any], args: Sequence[Any]) -> Any:
    """Nested calls f(f(a, b), c) ..."""
    found = args[0]
    for a in args[1:]:
        found = f(found, a)
    return found


MAX_DENOMINATOR = 10_000  # largest denominator of numbers recognised as fractions
MAX_DIGITS = 9  # largest number of digits of recognised decimals
MAX_ANGLE_DENOMINATOR = 720  # largest denominator of recognised fractions of pi
ROUNDING = 4.0  # tolerance of the recognition, in spacings of floating-point numbers
POSITIVE = ("kg", "kg*m^2", "kg m^2", "kg*m**2")  # units of quantities that are positive unless zero


class SympyPrinter:
    """Converter between expressions of one graph and SymPy expressions.

    Parameters
    ----------
    tables : {"function", "piecewise"}
        Tables (splines) as named functions, or as their cubics.
    fractions : bool
        Whether numbers that equal short fractions, decimals or such parts of pi within rounding become exact numbers.
        Others are floats of 17 digits.
    positive : collection of str
        Names of further positive symbols. Masses and moments of inertia with a positive value are positive. All symbols
        are real.
    """

    def __init__(self, tables: str = "function", fractions: bool = True, positive: Collection[str] = ()) -> None:
        if tables not in ("function", "piecewise"):
            raise ModelError(f"tables={tables!r}: must be 'function' or 'piecewise'")
        self.sympy = import_optional("sympy", "symbolic")
        self.tables, self.fractions, self.positive = tables, fractions, set(positive)
        self.symbols: dict[Any, Node] = {}  # SymPy symbol -> node
        self.functions: dict[str, Function] = {}  # name of a SymPy function -> function
        self._names = Identifiers()
        self._called: dict[Function, str] = {}
        self._known: dict[int, Any] = {}

    def __call__(self, x: Any) -> Any:
        """SymPy expression of a node or number; a list, or a ``Matrix`` of a vector or matrix of these."""
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
            SymPy expressions.
        graph : Graph
        symbols : mapping, optional
            SymPy symbols or their names -> nodes or numbers, for symbols that this printer has not created.

        Raises
        ------
        ModelError
            If a symbol or a function is unknown.
        """
        return SympyReader(self, graph, dict(symbols or {})).nodes(list(expressions))

    def _expressions(self, xs: Sequence[Any]) -> list[Any]:
        for x in nodes_in_order(xs):
            if x.index not in self._known:
                self._known[x.index] = self._constructed(x, [self._known[a.index] for a in x.args])
        return [self._known[x.index] if isinstance(x, Node) else self.number(float(x)) for x in xs]

    def number(self, x: float) -> Any:
        """A number; exact if it is recognised as such."""
        sp = self.sympy
        if not math.isfinite(x):
            return sp.nan if x != x else sp.oo if x > 0.0 else -sp.oo
        if x == math.floor(x) and abs(x) < 1e15:
            return sp.Integer(int(x))
        if self.fractions:
            f = fraction(x)
            if f is not None:
                return sp.Rational(f.numerator, f.denominator)
            f = _near(x / math.pi, MAX_ANGLE_DENOMINATOR)
            if f is not None:
                return sp.Rational(f.numerator, f.denominator) * sp.pi
        return sp.Float(repr(x), 17)

    def _constructed(self, x: Node, args: list[Any]) -> Any:
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
        """A table as ``Piecewise`` if requested; else a named function with SymPy derivatives."""
        told, order = x.data.details, 0
        if "table" in told:
            order = told["order"]
            if self.tables == "piecewise" and not told["moved"]:
                u = self.sympy.Dummy("u", real=True)
                return spline_expression(told["table"], 0, u).diff(u, order).subs(u, args[0])
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
    """The short fraction or decimal that a number equals within rounding; None if there is none."""
    short = _near(x, MAX_DENOMINATOR)
    if short is not None:
        return short
    digits = repr(x).split("e")[0].replace(".", "").replace("-", "").strip("0")
    return Fraction(repr(x)) if len(digits) <= MAX_DIGITS else None


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
