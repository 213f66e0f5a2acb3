"""Numbers, quantities ("30 deg") and expressions ("2*k") as users write them.

Expressions are trees of known operations (`expression_parser`), evaluated here on numbers, arrays and symbols, and
compiled to bytecode in `laws`. Laws may call tables by name, and a Python function may replace a law. Named parameters
may be numbers, quantities, or expressions of each other in any order.
"""

from __future__ import annotations

import keyword
import operator
import sys
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from numbers import Complex, Integral, Real
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import ExpressionError, ModelError, UnitError
from ..math import scalar
from .expression_parser import (
    CONSTANTS,
    DEFINED,
    DEFINITIONS,
    FUNCTIONS,
    SyntaxNode,
    apply_function,
    called_table,
    did_you_mean,
    function_arguments,
    function_tree,
    parse_text,
    refuse_expression,
)
from .messages import shortened_list
from .units import is_unit, quantity_remedy, refuse_attached, split_quantity, to_si

if TYPE_CHECKING:
    from .table import Table


MAX_NAMES = 600  # characters of the known names in a message


@dataclass(frozen=True)
class Expression:
    """A formula of named quantities, such as "speed*t + sin(2*pi*t)"; equal if the text is equal."""

    text: str
    tree: SyntaxNode = field(repr=False, compare=False)
    function: Callable[..., Any] | None = field(default=None, repr=False, hash=False)
    where: str = field(default="", repr=False, compare=False)  # the law's owner, for messages

    @classmethod
    def parse(
        cls, text: str, tables: Collection[str] = (), curves: bool = False, names: Collection[str] = ()
    ) -> Expression:
        """Parse an expression; ``tables`` are names that it may call like functions, ``curves``: names may have dots.

        Those of ``names`` may have dots in any case.

        Raises
        ------
        ExpressionError
            If the text is not an expression of the known operators, functions, tables and constants.
        """
        known: Mapping[str, Any] = tables if isinstance(tables, Mapping) else dict.fromkeys(tables)
        called = ((name, getattr(table, "arguments", ("x",))) for name, table in known.items())
        dotted = frozenset(k for k in names if "." in k) if "." in text and not curves else frozenset[str]()
        return _parsed(text, frozenset(called), curves, dotted)

    @classmethod
    def of_function(cls, function: Callable[..., Any], where: str = "") -> Expression:
        """Return a law made of a Python function, whose arguments are passed by name.

        Raises
        ------
        ExpressionError
            If its arguments have no fixed names, or there are too many.
        """
        return cls(*function_tree(function), function, where)

    @classmethod
    def constant(cls, value: float) -> Expression:
        """Return the expression of one number."""
        return cls(repr(float(value)), SyntaxNode("number", value=float(value)))

    @cached_property
    def names(self) -> frozenset[str]:
        """Names of parameters, inputs and sensors used; for a function including optional ones."""
        return frozenset(node.value for node in self.tree.walk() if node.kind == "name")

    @cached_property
    def _quantities(self) -> tuple[tuple[str, str], ...]:
        """Number and unit of each quantity in it, such as ``(60 rpm)``."""
        nodes = (n for n in self.tree.walk() if n.kind == "number" and self.function is None)
        parts = (split_quantity(self.text[n.start : n.stop]) for n in nodes)
        return tuple(p for p in parts if p is not None and p[1])

    @cached_property
    def tables(self) -> frozenset[str]:
        """Names of the tables called."""
        return frozenset(called_table(node)[0] for node in self.tree.walk() if node.kind == "table")

    def require(self, known: Collection[str]) -> None:
        """Raise `ExpressionError`, with the place and the nearest known names, if an unknown name is used."""
        for part in self._quantities:
            try:
                refuse_attached(*part, {*known, *CONSTANTS}, None)
            except UnitError as error:
                raise ExpressionError(f"'{self}': {error}") from None
        if all(name in known for name in self.names):
            return
        nodes = self.tree.walk() if self.function is None else function_arguments(self.tree, known)
        node = next((n for n in nodes if n.kind == "name" and n.value not in known), None)
        if node is None:
            return
        name = node.value
        guess = did_you_mean(name, [*known, *FUNCTIONS])
        if name == "t":
            cure = "time t is known only in laws of drivers and forces"
        elif guess:
            cure = guess.strip()
        elif self.function is not None:
            cure = "the names of a function's arguments select its inputs: use known ones, or give a default"
        elif is_unit(name):
            cure = f"a unit follows a single number, as in '2 {name}', in a formula within parentheses"
        else:
            cure = f"define a parameter '{name}', or correct the name"
        listed = f"known names: {shortened_list(sorted(known), MAX_NAMES) or 'none'}; {cure}"
        refuse_expression(self.text, node.start, node.stop, f"unknown name '{name}'", listed)

    def evaluate(self, env: Mapping[str, Any], tables: Mapping[str, Table] | None = None) -> Any:
        """The value for the names in `env`: numbers (real or complex), arrays, or SymPy symbols; and the tables called.

        Out of a function's domain the value is nan or inf, not an error. Raises `ExpressionError` for unknown names.
        Exceptions of a Python function are passed on.
        """
        self.require(env.keys())
        self.require_tables(tables or {})
        return _evaluate(self.tree, env, tables or {})

    def require_tables(self, known: Collection[str]) -> None:
        """Raise `ExpressionError` if a table that it calls does not exist."""
        for name in sorted(self.tables - set(known)) if self.tables else ():
            raise ExpressionError(f"'{self}': there is no table '{name}'; add the Table before the law that calls it")

    def require_derivatives(self) -> None:
        """Raise `ExpressionError` if the law has no exact derivatives."""
        if self.function is not None:
            who = f"{self.where}: " if self.where else ""
            raise ExpressionError(
                f"{who}'{self}' is a Python function, and a driver's law needs its derivatives: "
                f"give an expression or a Table"
            )

    def __str__(self) -> str:
        return self.text


@lru_cache(maxsize=8192)
def _parsed(
    text: str, tables: frozenset[tuple[str, tuple[str, ...]]], curves: bool, dotted: frozenset[str]
) -> Expression:
    """Parse a text (cached: it is read when an element is added, and again for each analysis)."""
    return Expression(*parse_text(text, dict(tables), curves, dotted))


def number(
    value: Any, env: Mapping[str, Any], dimension: str | None, where: str, names: Collection[str] | None = None
) -> Any:
    """Turn what a user wrote into a number in SI units.

    Parameters
    ----------
    value
        A number (taken as SI), a quantity ("5 mm"), or an expression of the parameters ("2*length").
    env
        Values of the parameters; complex values or symbols give a complex or symbolic result.
    dimension
        SI unit wanted, e.g. "m", "rad", "N*m*s/rad", "1"; None for any. An expression is taken as being in it.
    where
        What the number is, for messages: "mass of body 'crank'".
    names
        Names that a user could mean where they stand behind a unit, if not those of `env`.

    Raises
    ------
    UnitError, ExpressionError, ModelError
        With a message that begins with `where`.
    """
    try:
        result = _number(value, env, dimension, env if names is None else names)
    except ModelError as error:
        raise type(error)(f"{where}: {error}") from None
    if type(result) is float and result - result == 0.0:
        return result
    if isinstance(result, Complex) and not (result - result == 0):
        advice = "check for division by zero and roots or logarithms of negative numbers"
        problem = f"'{value}' gives {result}" if isinstance(value, str | Expression) else f"the value is {value}"
        raise ModelError(f"{where}: {problem}, a finite number is wanted; {advice}")
    if isinstance(result, complex) and isinstance(value, str | Expression):
        # complex numbers have roots and logarithms of negative numbers, which the real function has not
        real = {name: x.real if isinstance(x, complex) else x for name, x in env.items()}
        return complex(number(value, real, dimension, where), result.imag)
    return result


def law_expression(
    value: Any,
    dimension: str | None,
    where: str,
    tables: Collection[str] = (),
    names: Collection[str] = (),
    curves: bool = False,
) -> Expression:
    """Convert a law as written by a user to an expression.

    It may be a number, a quantity ("120 rpm"), a formula of t that may call ``tables``, or a Python function. ``names``
    are those that the law may use besides t; ``curves``: whether it may use curves of parts, such as A.angle.
    """
    try:
        if isinstance(value, Expression):
            return value
        if isinstance(value, str) and split_quantity(value) is None:
            return Expression.parse(value, tables, curves, names)
        if callable(value):
            return Expression.of_function(value, where)
    except ModelError as error:
        raise type(error)(f"{where}: {error}") from None
    return Expression.constant(number(value, {}, dimension, where, {"t", *names, *tables}))


def fold_constants(node: SyntaxNode, text: str) -> SyntaxNode:
    """Replace constant parts of the tree by their value; `ExpressionError` if one is not finite."""
    args = tuple(fold_constants(arg, text) for arg in node.args)
    steps = ("step", "step5", "trapezoid")
    if node.kind == "trapezoid" and args[5].kind == "number" and not 0.0 < args[5].value <= 0.5:
        remedy = "the fraction of the way from x0 to x1 on which the slope grows: above 0, at most 0.5"
        refuse_expression(text, args[5].start, args[5].stop, f"{args[5].value:g} is no fraction here", remedy)
    if node.kind in steps and args[1].kind == args[3].kind == "number" and args[1].value == args[3].value:
        value = float(args[1].value)
        wider = f"give x1 another value than x0 = {value:g}; a jump is where(x < {value:g}, y0, y1)"
        refuse_expression(text, node.start, node.stop, "this step has no width", wider)
    if node.kind in _UNFOLDED or any(arg.kind != "number" for arg in args):
        return node.with_args(args)
    value = float(OPERATIONS[node.kind](*(float(arg.value) for arg in args)))
    if value - value != 0.0:
        problem = f"this part is {value}, which is not a finite number"
        refuse_expression(text, node.start, node.stop, problem, "check divisions by zero, roots, and the ends of steps")
    return SyntaxNode("number", (), value, node.start, node.stop)


def is_number_text(text: str) -> bool:
    """Return whether a text is a number, with or without a unit, rather than an expression."""
    return split_quantity(text) is not None


def _number(value: Any, env: Mapping[str, Any], dimension: str | None, names: Collection[str]) -> Any:
    if type(value) is float:  # the most frequent case first: checks of abstract types are slow
        return value
    if type(value) is str:
        return _of_text(value, env, dimension, names)
    if isinstance(value, bool | np.bool_):
        raise ModelError(f"{value} is true or false, a number is wanted; write 1 or 0 if you mean that")
    if isinstance(value, Real):
        try:
            return float(value)
        except OverflowError:
            raise ModelError(f"{_short(value)} is too large; the largest number is {sys.float_info.max:.3g}") from None
    if isinstance(value, Complex):
        return complex(value)
    if isinstance(value, Expression):
        return _evaluated(value, env)
    if hasattr(value, "called"):  # an expression in place of a number: see `math/scalar.py`
        return value
    if not isinstance(value, str):
        raise ModelError(
            f"{value!r} ({type(value).__name__}) is not a number; write a number, a quantity such as '5 mm', "
            "or an expression of parameters"
        )
    return _of_text(value, env, dimension, names)


def _short(value: Any) -> str:
    """Return a number as text, or its first digits and their count."""
    try:
        text = str(value)
    except ValueError:  # Python does not print integers of so many digits
        return "this whole number"
    return text if len(text) <= 30 else f"{text[:10]}... ({len(text)} digits)"


def _evaluated(x: Expression, env: Mapping[str, Any]) -> Any:
    result = x.evaluate(env)
    return result if type(result) is float or not isinstance(result, Integral) else float(result)


def _of_text(value: str, env: Mapping[str, Any], dimension: str | None, names: Collection[str]) -> Any:
    parts = split_quantity(value)
    if parts is None:
        expression = Expression.parse(value, names=names)
        if expression.tree.kind == "name":
            check_dimension(expression.tree.value, env, dimension)
        return _evaluated(expression, env)
    names = {*names, *CONSTANTS}
    if parts[1]:
        refuse_attached(*parts, names, dimension)
    try:
        return to_si(value, dimension)
    except UnitError as error:
        raise UnitError(f"{error}{quantity_remedy(*parts)}") from None


def _evaluate(node: SyntaxNode, env: Mapping[str, Any], tables: Mapping[str, Table]) -> Any:
    if node.kind == "number":
        return node.value
    if node.kind == "name":
        return env[node.value]
    if node.kind == DEFINED:
        return env[DEFINED][node.value]
    if node.kind == DEFINITIONS:
        inner = {**env, DEFINED: []}
        for definition in node.args[:-1]:
            inner[DEFINED].append(_evaluate(definition, inner, tables))
        return _evaluate(node.args[-1], inner, tables)
    args = [
        _evaluate(arg, env, tables) for arg in (function_arguments(node, env) if node.kind == "function" else node.args)
    ]
    if node.kind == "table":
        name, order = called_table(node)
        return tables[name].values(args[0])[order] if order else tables[name].value(*args)
    if node.kind in ("function", "called"):
        return apply_function(node.value.function if node.kind == "called" else node.value, *args)
    return OPERATIONS[node.kind](*args)


def _fold(function: Any) -> Any:
    def folded(*args: Any) -> Any:
        value = args[0]
        for arg in args[1:]:
            value = function(value, arg)
        return value

    return folded


def _real(x: Any) -> Any:
    return x.real if isinstance(x, Complex | np.ndarray) else x


def _where(condition: Any, a: Any, b: Any) -> Any:
    if isinstance(condition, bool | np.bool_):
        return a if condition else b
    if isinstance(condition, np.ndarray):
        return np.where(condition, a, b)
    if hasattr(condition, "called"):  # 1 or 0
        return scalar.choose(condition - 0.5, a, b)
    import sympy

    return sympy.Piecewise((a, condition), (b, True))


def _less(a: Any, b: Any) -> Any:
    either = next((x for x in (a, b) if hasattr(x, "called")), None)
    return _real(a) < _real(b) if either is None else scalar.choose(b - a, 1.0, 0.0)


def _at_most(a: Any, b: Any) -> Any:
    either = next((x for x in (a, b) if hasattr(x, "called")), None)
    return _real(a) <= _real(b) if either is None else 1.0 - scalar.choose(a - b, 1.0, 0.0)


def _step(shape: Any) -> Any:
    def step(x: Any, x0: Any, y0: Any, x1: Any, y1: Any) -> Any:
        s = scalar.minimum(scalar.maximum(scalar.divide(x - x0, x1 - x0), 0.0), 1.0)
        return y0 + (y1 - y0) * shape(s)

    return step


def _trapezoid(x: Any, x0: Any, y0: Any, x1: Any, y1: Any, fraction: Any) -> Any:
    s = scalar.minimum(scalar.maximum(scalar.divide(x - x0, x1 - x0), 0.0), 1.0)
    late, end = (scalar.maximum(s - b, 0.0) for b in (fraction, 1.0 - fraction))
    b = scalar.choose(fraction - 0.5, 0.0, fraction)
    return y0 + (y1 - y0) * scalar.divide(s * s - late * late - end * end, 2.0 * b * (1.0 - b))


OPERATIONS = {
    **{name: getattr(scalar, name) for name, arguments in FUNCTIONS.items() if hasattr(scalar, name)},
    "abs": scalar.absolute,
    "min": _fold(scalar.minimum),
    "max": _fold(scalar.maximum),
    "where": _where,
    "step": _step(scalar.cubic_rise),
    "step5": _step(scalar.quintic_rise),
    "trapezoid": _trapezoid,
    "cubic": scalar.cubic_rise,
    "quintic": scalar.quintic_rise,
    "+": operator.add,
    "-": operator.sub,
    "*": operator.mul,
    "/": scalar.divide,
    "**": scalar.power,
    "neg": operator.neg,
    "<": _less,
    "<=": _at_most,
    "and": _fold(operator.and_),
    "or": _fold(operator.or_),
    "not": lambda a: not a if isinstance(a, bool) else ~a,
}
_UNFOLDED = frozenset(
    {"number", "name", "where", "<", "<=", "and", "or", "not", "table", "function", "called", DEFINITIONS, DEFINED}
)


class ParameterValues(dict[str, Any]):
    """Values of parameters in SI units; ``written`` has the quantities with a unit as they were written."""

    written: Mapping[str, str]


def _with_units(values: Mapping[str, Any], written: Mapping[str, Any]) -> ParameterValues:
    out = ParameterValues(values)
    pairs = ((k, x, split_quantity(x)) for k, x in written.items() if isinstance(x, str))
    out.written = {k: x for k, x, parts in pairs if parts is not None and parts[1]}
    return out


def check_dimension(name: str, env: Mapping[str, Any], dimension: str | None, where: str = "") -> None:
    """Refuse a parameter, written with a unit, in place of a quantity of another kind.

    Raises
    ------
    UnitError
    """
    text = env.written.get(name) if isinstance(env, ParameterValues) and dimension is not None else None
    if text is not None:
        try:
            to_si(text, dimension)
        except UnitError as error:
            raise UnitError(f"{where}the parameter {name!r} is {error}") from None


def resolve_parameters(parameters: Mapping[str, Any]) -> ParameterValues:
    """The values of named parameters, which may be numbers, quantities, or expressions of each other in any order.

    Raises
    ------
    ExpressionError
        If parameters depend on each other in a circle, or a name is not allowed or not known.
    UnitError
        If a quantity has no known unit.
    """
    for name in parameters:
        _check_parameter_name(name)
    formulas: dict[str, Expression] = {}
    values: dict[str, Any] = {}
    for name, value in parameters.items():
        if isinstance(value, Expression) or (isinstance(value, str) and split_quantity(value) is None):
            formulas[name] = law_expression(value, None, f"parameter '{name}'", names=parameters)
        else:
            values[name] = number(value, {}, None, f"parameter '{name}'", parameters.keys())
    for name, formula in formulas.items():
        try:
            formula.require(parameters.keys())
        except ExpressionError as error:
            raise ExpressionError(f"parameter '{name}': {error}") from None
    for name in _in_order(formulas):
        values[name] = number(formulas[name], values, None, f"parameter '{name}'")
    return _with_units({name: values[name] for name in parameters}, parameters)


def parameter_formulas(parameters: Mapping[str, Any]) -> dict[str, Expression]:
    """Return the parameters that depend on others, each after those that it uses."""
    formulas = {
        name: law_expression(value, None, f"parameter '{name}'", names=parameters)
        for name, value in parameters.items()
        if isinstance(value, Expression) or (isinstance(value, str) and split_quantity(value) is None)
    }
    return {name: formulas[name] for name in _in_order(formulas)}


def resolve_changed(
    known: Mapping[str, Any], formulas: Mapping[str, Expression], changed: Mapping[str, Any]
) -> ParameterValues:
    """Resolve parameters again with some changed to numbers: only these and their dependents are evaluated.

    ``known`` are all values as they were, ``formulas`` those of `parameter_formulas`.
    """
    out = dict(known)
    for name, value in changed.items():
        out[name] = number(value, {}, None, f"parameter '{name}'", known.keys())
    reached = set(changed)
    for name, formula in formulas.items():
        if name not in changed and not reached.isdisjoint(formula.names):
            out[name] = number(formula, out, None, f"parameter '{name}'")
            reached.add(name)
    written = known.written if isinstance(known, ParameterValues) else {}
    return _with_units(out, {**written, **changed})


def _in_order(formulas: Mapping[str, Expression]) -> list[str]:
    """Return names sorted so that each comes after those it uses."""
    order: dict[str, None] = {}
    for first in formulas:
        path = [first]
        while path:
            missing = sorted(n for n in formulas[path[-1]].names if n in formulas and n not in order)
            if not missing:
                order[path.pop()] = None
            elif missing[0] in path:
                circle = " -> ".join([*path[path.index(missing[0]) :], missing[0]])
                raise ExpressionError(
                    f"parameters depend on each other in a circle: {circle}; give one of them a value"
                )
            else:
                path.append(missing[0])
    return list(order)


def _check_parameter_name(name: Any) -> None:
    words = name.split(".") if isinstance(name, str) else [""]
    if not all(word.isidentifier() and not keyword.iskeyword(word) for word in words):
        reason = "is a word of the expression language" if keyword.iskeyword(name) else "is not a plain name"
        raise ExpressionError(f"parameter {name!r}: {reason}; use letters, digits and _, e.g. 'spring_rate'")
    kind = "a function" if name in FUNCTIONS else "a constant" if name in CONSTANTS else "time"
    if name in FUNCTIONS or name in CONSTANTS or name == "t":
        raise ExpressionError(f"parameter '{name}': the name is taken, it means {kind}; rename it, e.g. '{name}_0'")
