"""Expressions of SymPy's as expressions of a graph."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

from ...errors import ModelError
from ...math import scalar
from ..node import Graph, Node

if TYPE_CHECKING:
    from .sympy import SympyPrinter

ONE: dict[str, Callable[..., Any]] = {
    "sin": scalar.sin, "cos": scalar.cos, "tan": scalar.tan, "asin": scalar.asin, "acos": scalar.acos,
    "atan": scalar.atan, "exp": scalar.exp, "log": scalar.log, "sinh": scalar.sinh, "cosh": scalar.cosh,
    "tanh": scalar.tanh, "atan2": scalar.atan2, "Abs": scalar.absolute, "sign": scalar.sign,
    "floor": lambda x: scalar.rounded(x - 0.5),
    "sec": lambda x: 1.0 / scalar.cos(x), "csc": lambda x: 1.0 / scalar.sin(x),
    "cot": lambda x: scalar.cos(x) / scalar.sin(x), "acot": lambda x: scalar.atan(1.0 / x),
    "coth": lambda x: 1.0 / scalar.tanh(x),
    "Heaviside": lambda x, half=0.5: scalar.choose(x, 1.0, scalar.choose(-x, 0.0, half)),
}  # fmt: skip
"""SymPy's functions by their names."""


class Back:
    """One way back from SymPy."""

    def __init__(self, printer: SympyPrinter, graph: Graph, symbols: dict[Any, Any]) -> None:
        self.printer, self.graph, self.sympy = printer, graph, printer.sympy
        self.named = {str(s): x for s, x in symbols.items()}
        self._known: dict[Any, Node] = {}

    def nodes(self, expressions: list[Any]) -> list[Node]:
        """Nodes of expressions, each of which is looked at once."""
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
                self._known[x] = self.graph.node(self._made(x))
        return [self._known[x] for x in wanted]

    def _parts(self, x: Any) -> list[Any]:
        """What has to be known before an expression can be made."""
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

    def _made(self, x: Any) -> Any:
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
            return folded(scalar.minimum if name == "Min" else scalar.maximum, args)
        if name not in ONE:
            raise ModelError(f"SymPy's {name} in {x} has no counterpart here: rewrite it in elementary functions")
        return ONE[name](*args)

    def _symbol(self, x: Any) -> Any:
        if x.name in self.named:
            return self.named[x.name]
        if x not in self.printer.symbols:
            raise ModelError(f"the symbol {x} is not known: say what it stands for, symbols={{{x.name!r}: ...}}")
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
            found = chosen(type(condition).__name__, less, here, found)
        return found

    def _slope(self, x: Any) -> Any:
        """Derivatives of a function that is known by name, by its first argument."""
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


def chosen(relation: str, less: Any, a: Any, b: Any) -> Any:
    """A where ``less`` (left minus right) fulfils a relation, else b."""
    if relation == "StrictGreaterThan":
        return scalar.choose(less, a, b)
    if relation == "StrictLessThan":
        return scalar.choose(-less, a, b)
    if relation == "GreaterThan":
        return scalar.choose(-less, b, a)
    if relation == "LessThan":
        return scalar.choose(less, b, a)
    raise ModelError(f"a case that asks for {relation} has no counterpart here: use >, <, >= or <=")


def sum_of(args: Sequence[Any]) -> Any:
    """Sum, from the left."""
    return folded(lambda a, b: a + b, args)


def folded(f: Callable[[Any, Any], Any], args: Sequence[Any]) -> Any:
    """F(f(a, b), c) ..."""
    found = args[0]
    for a in args[1:]:
        found = f(found, a)
    return found
