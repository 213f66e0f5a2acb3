"""Compilation of expressions to bytecode, and laws restricted to one side of their nonsmooth points.

Where ``sign(u)`` decides, a law reads a number instead, 1 or -1, which changes only after u has crossed zero. The law
thus continues smoothly beyond the nonsmooth point, and a step may end on it. A value between -1 and 1 holds the motion
on u = 0 (Filippov, *Differential Equations with Discontinuous Righthand Sides*, 1988).

Such a law is affine in each of these numbers, also beyond 1 and -1. If no number between 1 and -1 would hold the
motion, the one that would is found outside, which shows that the motion leaves the surface.

A branch is continued beyond its nonsmooth point only within the domain of the functions in it (`DOMAINS`). Where the
law as written is defined, but the argument of the continued branch is not in the domain, the function keeps its value
at the boundary of the domain; at a pole the law is as written. So ``max(-x, 0)**1.5`` is 0 on the continued side. A law
that leaves its domain as written is nan.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import replace
from functools import reduce
from types import MappingProxyType
from typing import Any

from ..errors import ExpressionError
from ..model.expression_parser import DEFINED, DEFINITIONS, FunctionCall, SyntaxNode, call_node
from ..model.expressions import Expression, fold_constants
from . import bytecode
from .python_functions import CalledFunction, compile_function

SIDE, BETWEEN_SIDES = "side", "between sides"
LARGEST_WHOLE_POWER = 64
CornerLookup = Callable[[SyntaxNode], tuple[int, float]]
"""Slot of the number to be read, and its sign, for the node that decides at a corner."""
_TRUTHS = ("<", "<=", "and", "or", "not")
_DECISIONS = frozenset(("abs", "sign", "min", "max", "where", "table", *_TRUTHS))
DOMAINS: dict[str, tuple[tuple[str, float], ...]] = {
    "sqrt": (("<", 0.0),),
    "**": (("<", 0.0),),
    "log": (("<", sys.float_info.min),),
    "asin": (("<", -1.0), (">", 1.0)),
    "acos": (("<", -1.0), (">", 1.0)),
}
"""Functions that are not defined for all numbers, with the bounds of their arguments."""


def on_one_side(
    node: SyntaxNode, moving: Collection[str], corners: CornerLookup, conditions: SyntaxNode | None = None
) -> SyntaxNode:
    """Expression tree in which a side replaces each decision by an input or sensor.

    Parameters
    ----------
    node : SyntaxNode
        Tree of a law.
    moving : collection of str
        Names of inputs and sensors.
    corners : callable
        Returns the slot of each corner's side.
    conditions : SyntaxNode, optional
        Condition under which the law as written takes this part of it; by default always.
    """
    if not _moves(node, moving):
        return node
    if node.kind in _TRUTHS:
        return _truth(node, moving, corners)
    if smooth := _smooth_factors(node):
        made = _with_factors(node, smooth, lambda x: on_one_side(x, moving, corners, conditions))
        return _affine_in_shared(made) if node.kind == "*" else made
    if node.kind == "where":
        condition, a, b = node.args
        if not _moves(condition, moving):
            a, b = on_one_side(a, moving, corners, conditions), on_one_side(b, moving, corners, conditions)
            return _new_node(node, "where", condition, a, b)
        yes, no = _both(conditions, condition), _both(conditions, _new_node(condition, "not", condition))
        a, b = on_one_side(a, moving, corners, yes), on_one_side(b, moving, corners, no)
        branches = _without_poles(a, b, no, moving), _without_poles(b, a, yes, moving)
        return _between(node, _truth(condition, moving, corners), *branches)
    if node.kind == "abs" and node.args[0].kind == "atan2":  # |atan2(y, x)| = atan2(|y|, x), which does not jump
        y, x = node.args[0].args
        return on_one_side(_new_node(node, "atan2", _new_node(node, "abs", y), x), moving, corners, conditions)
    args = tuple(on_one_side(arg, moving, corners, conditions) for arg in node.args)
    if node.kind in ("abs", "sign") and _moves(node.args[0], moving):
        if _changes_by_signs_only(args, moving):
            return _affine(_new_node(node, node.kind, *args))
        side = _side(node, args[0], corners)
        return side if node.kind == "sign" else _new_node(node, "*", side, args[0])
    if node.kind in ("min", "max"):
        out = args[0]
        for k, arg in enumerate(args[1:]):
            if _moves(arg, moving) or any(_moves(x, moving) for x in node.args[: k + 1]):
                if _changes_by_signs_only((out, arg), moving):
                    out = _affine(_new_node(node, node.kind, out, arg))
                    continue
                side = _side(node, node_difference(out, arg), corners)
                out = _between(node, side, *((out, arg) if node.kind == "max" else (arg, out)))
            else:
                out = _new_node(node, node.kind, out, arg)
        return out
    if node.kind == "table" and _moves(node.args[0], moving):
        corners(SyntaxNode("table", args, node.value, node.start, node.stop))  # continuous: it only needs a guard
    made = _in_domain(SyntaxNode(node.kind, args, node.value, node.start, node.stop), node, moving, conditions)
    return _affine_in_shared(made) if node.kind == "*" else made


def _in_domain(
    node: SyntaxNode, written: SyntaxNode, moving: Collection[str], conditions: SyntaxNode | None
) -> SyntaxNode:
    """Function that keeps its value at the boundary of its domain where only a continued branch has left that.

    ``written`` is the function in the law as written. Where that is evaluated, and outside its domain, the result is
    nan.
    """
    bounds = DOMAINS.get(node.kind, ())
    if not bounds or not _moves(node.args[0], moving) or (node.kind == "**" and is_small_integer(node.args[1])):
        return node
    x, *others = node.args
    sided = any(n.kind == SIDE for n in x.walk())
    out = node
    for order, limit in bounds if sided or conditions else ():
        bound = _new_node(node, "number", value=limit)
        outside = [_new_node(node, "<", *pair) for pair in ((x, bound), (written.args[0], bound))]
        if order == ">":
            outside = [replace(n, args=n.args[::-1]) for n in outside]
        wrong = _both(conditions, outside[1])
        continued = _both(outside[0], _new_node(node, "not", wrong))
        out = _new_node(node, "where", continued, _new_node(node, node.kind, bound, *others), out)
    return out


def _without_poles(branch: SyntaxNode, other: SyntaxNode, elsewhere: SyntaxNode, moving: Collection[str]) -> SyntaxNode:
    """A branch, replaced by the other one where a divisor in it is zero and the law as written takes the other one.

    A step may end right on the corner of ``where(x > 0, sin(x)/x, 1)``.
    """
    out = branch
    for n in branch.walk():
        inverse = n.kind == "**" and is_small_integer(n.args[1]) and n.args[1].value < 0
        if (n.kind == "/" or inverse) and _moves(x := n.args[n.kind == "/"], moving):
            zero = _new_node(n, "number", value=0.0)
            nothing = _both(_new_node(n, "<=", x, zero), _new_node(n, "<=", zero, x))
            out = _new_node(n, "where", _both(elsewhere, nothing), other, out)
    return out


def is_small_integer(node: SyntaxNode) -> bool:
    """Whether an exponent is a literal small integer."""
    return node.kind == "number" and node.value == int(node.value) and abs(node.value) <= LARGEST_WHOLE_POWER


def may_be_steep(tree: SyntaxNode, still: Collection[str]) -> bool:
    """Whether a law has a root, a power below 1, an arc sine or an arc cosine of anything but the names ``still``.

    At an end of the domain the slope of these functions is infinite.
    """
    return any(
        n.kind in ("sqrt", "asin", "acos")
        or (n.kind == "**" and not (n.args[1].kind == "number" and not 0.0 < n.args[1].value < 1.0))
        for n in tree.walk()
        if n.args and any(x.kind == "name" and x.value not in still for x in n.args[0].walk())
    )


def _both(a: SyntaxNode | None, b: SyntaxNode) -> SyntaxNode:
    return b if a is None else _new_node(b, "and", a, b)


def node_difference(a: SyntaxNode, b: SyntaxNode) -> SyntaxNode:
    """Difference a - b."""
    if b.kind == "number" and b.value == 0:
        return a
    return SyntaxNode("neg", (b,)) if a.kind == "number" and a.value == 0 else SyntaxNode("-", (a, b))


def _truth(node: SyntaxNode, moving: Collection[str], corners: CornerLookup) -> SyntaxNode:
    """1 where a condition holds, -1 where not."""
    if not _moves(node, moving):
        return _new_node(node, "where", node, SyntaxNode("number", value=1.0), SyntaxNode("number", value=-1.0))
    if node.kind in ("<", "<="):
        a, b = (on_one_side(arg, moving, corners) for arg in node.args)
        if _changes_by_signs_only((a, b), moving):
            return _affine(_new_node(node, "sign", node_difference(b, a)))
        return _side(node, node_difference(b, a), corners)
    first, *others = [_truth(arg, moving, corners) for arg in node.args]
    if node.kind == "not":
        return _new_node(node, "neg", first)
    for other in others:  # not the minimum or maximum of two: a side beyond 1 must have an effect through the other
        known = SyntaxNode("number", value=-1.0 if node.kind == "and" else 1.0)
        first = _between(node, first, *((other, known) if node.kind == "and" else (known, other)))
    return first


def _changes_by_signs_only(args: Iterable[SyntaxNode], moving: Collection[str]) -> bool:
    """Whether these expressions vary with sides only, not with time, inputs or sensors."""
    nodes = [n for arg in args for n in arg.walk()]
    return any(n.kind == SIDE for n in nodes) and not any(
        n.kind == "name" and (n.value == "t" or n.value in moving) for n in nodes
    )


def _between(like: SyntaxNode, way: SyntaxNode, a: SyntaxNode, b: SyntaxNode) -> SyntaxNode:
    """Expression a where ``way`` is 1, b where it is -1, interpolated in between.

    The result is affine in every side, also in nested expressions.
    """
    if way.kind == SIDE or (way.kind == "neg" and way.args[0].kind == SIDE):
        at, value = (way.value, 1.0) if way.kind == SIDE else (way.args[0].value, -1.0)
        return _new_node(like, BETWEEN_SIDES, way, _with_side(a, at, value), _with_side(b, at, -value))
    return _affine_in_shared(_new_node(like, BETWEEN_SIDES, way, a, b))


def _affine_in_shared(node: SyntaxNode) -> SyntaxNode:
    """The node, made affine in sides that occur in two or more of its arguments: their products would not be affine."""
    sides = [dict.fromkeys(n.value for n in arg.walk() if n.kind == SIDE) for arg in node.args]
    for at in dict.fromkeys(x for k, found in enumerate(sides) for x in found if any(x in y for y in sides[:k])):
        way = SyntaxNode(SIDE, (), at, node.start, node.stop)
        node = _new_node(node, BETWEEN_SIDES, way, _with_side(node, at, 1.0), _with_side(node, at, -1.0))
    return node


def _affine(node: SyntaxNode) -> SyntaxNode:
    """An expression of sides only, as interpolation between its values at the sides 1 and -1."""
    at = next((n.value for n in node.walk() if n.kind == SIDE), None)
    if at is None:
        return node
    values = (_affine(_with_side(node, at, value)) for value in (1.0, -1.0))
    return _new_node(node, BETWEEN_SIDES, SyntaxNode(SIDE, (), at, node.start, node.stop), *values)


def _with_side(node: SyntaxNode, at: int, value: float) -> SyntaxNode:
    """A node with a number in place of one side."""
    if node.kind == SIDE and node.value == at:
        return SyntaxNode("number", value=value)
    return node.with_args(tuple(_with_side(arg, at, value) for arg in node.args))


def _side(node: SyntaxNode, u: SyntaxNode, corners: CornerLookup) -> SyntaxNode:
    """Side of u = 0 that the law is on."""
    if u.kind == "neg":
        return _new_node(node, "neg", _side(node, u.args[0], corners))
    at, way = corners(u)
    side = SyntaxNode(SIDE, (), at, node.start, node.stop)
    return side if way > 0.0 else _new_node(node, "neg", side)


def _smooth_factors(node: SyntaxNode) -> list[tuple[Any, ...]]:
    """Keys of factors of a product that stay as written: together, neither they nor their slope jumps.

    These are ``abs(u)`` beside u, and ``sign(u)`` beside a positive power of ``abs(u)`` (the flow through an orifice),
    where u itself has no corner.
    """
    factors = _factors(node) if node.kind == "*" else []
    meant = [node_key(x) for x in factors]
    powers = [x for x in factors if x.kind == "sqrt" or (x.kind == "**" and _positive(x.args[1]))]
    found = []
    for x in factors:
        if x.kind == "abs" and not _decides(x.args[0]) and node_key(x.args[0]) in meant:
            found.append(node_key(x))
        if x.kind == "sign" and not _decides(x.args[0]):
            size = ("abs", None, node_key(x.args[0]))
            found += [y for p in powers if _is_power_of(p, size) for y in (node_key(x), node_key(p))]
    return found


def _is_power_of(power: SyntaxNode, size: tuple[Any, ...]) -> bool:
    """Whether the base of a power is this absolute value, possibly times factors without corners."""
    factors = _factors(power.args[0])
    return any(node_key(x) == size for x in factors) and not any(_decides(x) for x in factors if node_key(x) != size)


def _with_factors(
    node: SyntaxNode, unchanged: Collection[tuple[Any, ...]], change: Callable[[SyntaxNode], SyntaxNode]
) -> SyntaxNode:
    """A product with ``change`` applied to all factors but the unchanged ones."""
    if node.kind in ("*", "neg"):
        return _new_node(node, node.kind, *(_with_factors(x, unchanged, change) for x in node.args))
    return node if node_key(node) in unchanged else change(node)


def _decides(node: SyntaxNode) -> bool:
    """Whether there is a corner or a jump in an expression."""
    return any(n.kind in _DECISIONS for n in node.walk())


def _positive(node: SyntaxNode) -> bool:
    return node.kind == "number" and node.value > 0


def _factors(node: SyntaxNode) -> list[SyntaxNode]:
    """Factors of a product, without signs."""
    if node.kind == "*":
        return [x for arg in node.args for x in _factors(arg)]
    return _factors(node.args[0]) if node.kind == "neg" else [node]


def node_key(node: SyntaxNode) -> tuple[Any, ...]:
    """Key of a node, independent of its position in the text."""
    return (node.kind, node.value, *map(node_key, node.args))


def _moves(node: SyntaxNode, moving: Collection[str]) -> bool:
    return any(n.kind == SIDE or (n.kind == "name" and n.value in moving) for n in node.walk())


def _new_node(like: SyntaxNode, kind: str, *args: SyntaxNode, value: float | None = None) -> SyntaxNode:
    return SyntaxNode(kind, args, value, like.start, like.stop)


_FUNCTIONS = ("neg", "sin", "cos", "tan", "asin", "acos", "atan", "sinh", "cosh", "tanh", "exp", "log", "sqrt", "abs")
_UNARY = {name: bytecode.NEGATE + k for k, name in enumerate((*_FUNCTIONS, "sign", "cubic", "quintic", "not"))}
_BINARY = {
    **{
        "+": bytecode.ADD,
        "-": bytecode.SUBTRACT,
        "*": bytecode.MULTIPLY,
        "/": bytecode.DIVIDE,
        "**": bytecode.POWER,
        "atan2": bytecode.ATAN2,
    },
    **{
        "min": bytecode.MINIMUM,
        "max": bytecode.MAXIMUM,
        "<": bytecode.LESS,
        "<=": bytecode.LESS_EQUAL,
        "and": bytecode.MINIMUM,
        "or": bytecode.MAXIMUM,
    },
}
SEARCHED_CONSTANTS = 64  # constants among which a literal is searched
_NONE: Mapping[str, int] = MappingProxyType({})


def compile_law(
    expression: Expression,
    inputs: Sequence[str],
    parameters: Sequence[str],
    code: list[int],
    const: list[float],
    *,
    sensors: Mapping[str, int] = _NONE,
    tables: Mapping[str, int] = _NONE,
    functions: list[CalledFunction] | None = None,
    derivatives: bool = False,
    corners: CornerLookup | None = None,
) -> tuple[int, int]:
    """Append the program of a law to the shared tables.

    Parameters
    ----------
    expression
        The law, of the names in `inputs`, `parameters` and `sensors`.
    inputs
        Names of the measured quantities; the first is always "t", time [s].
    parameters
        Names of the parameters; their values are the first entries of `const`, in this order.
    code, const
        Tables that are appended to. A literal that is in `const` already is used again.
    sensors
        Names of sensors, and the columns of `sensed` that hold them.
    tables
        Names of the tables that laws may call, and where the `data()` of each begins in `const`.
    functions
        List that a law which is a Python function is appended to. Keep it as long as the code, which contains
        addresses.
    derivatives
        Whether the law is read by `evaluate_jet`.
    corners
        For a corner decided by inputs or sensors, returns the slot of the side that the law is on. Without it a law
        decides by itself.

    Returns
    -------
    at, depth
        Start of the program in `code`, and the rows of stack it needs.

    Raises
    ------
    ExpressionError
        If a name is not known or means two things, a constant part is not finite, or a function has no derivatives.
    """
    if not inputs or inputs[0] != "t" or len(const) < len(parameters):
        raise ValueError("the first input is 't', and const starts with one value for each parameter")
    _refuse_ambiguous_names(expression, inputs, parameters, sensors)
    tree = _required_tree(expression, [*inputs, *sensors, *parameters], tables, derivatives)
    tree = _with_code(tree, code, functions)
    writer = _ProgramWriter(expression, inputs, parameters, const, sensors, tables)
    tree = _folded(expression, tree, writer.varying)
    if derivatives:
        tree = _single_powers(tree, writer.varying)
    if corners is not None:
        tree = on_one_side(tree, frozenset((*inputs[1:], *sensors)), corners)
    writer.write(tree)
    return writer.append(code)


def _required_tree(expression: Expression, known: Sequence[str], tables: Mapping[str, int], derivatives: bool) -> Any:
    """Tree of a law whose names, tables and derivatives exist; a Python function is a call with all names."""
    expression.require(known)
    expression.require_tables(tables)
    if derivatives:
        expression.require_derivatives()
    if expression.function is None:
        return expression.tree
    return call_node(expression.tree, known, expression.text, expression.where)


def compile_decision(
    law: Expression,
    tree: SyntaxNode,
    parameters: Sequence[str],
    code: list[int],
    const: list[float],
    sensors: Mapping[str, int],
    tables: Mapping[str, int],
) -> tuple[int, int]:
    """Append the program of a corner's deciding expression, of time and sensors, as `compile_law` does."""
    writer = _ProgramWriter(law, ("t",), parameters, const, sensors, tables)
    writer.write(tree)
    return writer.append(code)


def has_corners(law: Expression, inputs: Sequence[str], sensors: Collection[str]) -> bool:
    """Whether a law has corners or jumps where inputs (except time) or sensors decide."""
    if calls_python(law):
        return False
    found: list[SyntaxNode] = []

    def corner(u: SyntaxNode) -> tuple[int, float]:
        found.append(u)
        return -1, 1.0

    on_one_side(_expand(law.tree, {*inputs, *sensors}), frozenset((*inputs[1:], *sensors)), corner)
    return bool(found)


def calls_python(law: Expression) -> bool:
    """Whether a law is, or calls, a Python function, whose corners are unknown."""
    return law.function is not None or any(n.kind == "called" for n in law.tree.walk())


def _folded(expression: Expression, tree: SyntaxNode, varying: Collection[str]) -> SyntaxNode:
    """The law in simpler operations, with its constant parts evaluated."""
    try:
        return fold_constants(_expand(tree, varying), expression.text)
    except ExpressionError as error:
        raise ExpressionError(f"{expression.where}: {error}" if expression.where else str(error)) from None


def _single_powers(node: SyntaxNode, varying: Collection[str]) -> SyntaxNode:
    """Merge powers of one base in products if some exponent is not an integer: u**2 sqrt(u) becomes u**2.5.

    At u = 0 the result then has the derivatives of the merged power, while those of a factor may be infinite.
    """
    node = node.with_args(tuple(_single_powers(arg, varying) for arg in node.args))
    if node.kind != "*" and not (node.kind == "**" and is_small_integer(node.args[1])):
        return node
    groups: dict[Any, tuple[SyntaxNode, float, bool]] = {}
    for u, exponent, broken in _powers(node):
        _, known, also = groups.get(node_key(u), (u, 0.0, False))
        groups[node_key(u)] = u, known + exponent, broken or also
    every = list(groups.values())
    if not any(broken and e > 0.0 and not _constant(u, varying) for u, e, broken in every):
        return node
    factors = [_power(node, u, e, broken) for u, e, broken in every]
    return reduce(lambda a, b: replace(node, kind="*", args=(a, b), value=None), factors)


def _powers(node: SyntaxNode) -> list[tuple[SyntaxNode, float, bool]]:
    """Factors of a product: (base, exponent, whether the base must not be negative)."""
    if node.kind == "*":
        return [x for arg in node.args for x in _powers(arg)]
    if node.kind == "sqrt":
        return [(node.args[0], 0.5, True)]
    if node.kind == "**" and node.args[1].kind == "number":
        base, exponent = node.args[0], float(node.args[1].value)
        if not is_small_integer(node.args[1]):
            return [(base, exponent, True)]
        inner = _powers(base) if base.kind in ("sqrt", "**") else [(base, 1.0, False)]
        return [(u, e * exponent, broken) for u, e, broken in inner]
    return [(node, 1.0, False)]


def _power(like: SyntaxNode, u: SyntaxNode, exponent: float, broken: bool) -> SyntaxNode:
    """A power; with ``broken``, nan for negative bases."""
    if exponent == 1.0 and not broken:
        return u
    number = replace(like, kind="number", args=(), value=exponent)
    power = replace(like, kind="**", args=(u, number), value=None)
    if not broken or exponent != int(exponent):
        return power
    zero = replace(number, value=0.0)
    known = replace(power, kind="<=", args=(zero, u))
    return replace(power, kind="where", args=(known, power, replace(power, kind="sqrt", args=(u,))))


def _constant(node: SyntaxNode, varying: Collection[str]) -> bool:
    return not any(n.kind in (SIDE, DEFINED) or (n.kind == "name" and n.value in varying) for n in node.walk())


def _refuse_ambiguous_names(
    expression: Expression, inputs: Collection[str], parameters: Collection[str], sensors: Collection[str]
) -> None:
    """Refuse names that mean two things."""
    input_, parameter, sensor = (inputs, "an input of this law"), (parameters, "a parameter"), (sensors, "a sensor")
    for (names, what), (others, also) in ((input_, parameter), (input_, sensor), (parameter, sensor)):
        for name in sorted(expression.names & set(names) & set(others)):
            raise ExpressionError(f"'{expression}': '{name}' is {what} and also {also}; rename the {also[2:]}")


def _with_code(tree: SyntaxNode, code: list[int], functions: list[CalledFunction] | None) -> SyntaxNode:
    """The tree with code positions of function calls in place of the functions."""
    args = tuple(_with_code(arg, code, functions) for arg in tree.args)
    if tree.kind != "called":
        return tree.with_args(args)
    return SyntaxNode("function", args, _function(tree.value, code, functions), tree.start, tree.stop)


def _function(request: FunctionCall, code: list[int], functions: list[CalledFunction] | None) -> int:
    """Append the data of a function call to the code; returns its position."""
    if functions is None:
        raise ValueError("a law that is a Python function needs a list to be kept in")
    made = compile_function(request)
    code += [made.address, len(functions), len(request.names)]
    functions.append(CalledFunction(made, request.names, request.text, request.where))
    return len(code) - 3


class _ProgramWriter:
    """Writer of the program of one law."""

    def __init__(
        self,
        expression: Expression,
        inputs: Sequence[str],
        parameters: Sequence[str],
        const: list[float],
        sensors: Mapping[str, int],
        tables: Mapping[str, int],
    ) -> None:
        self.expression = expression
        self.varying = {name: (bytecode.INPUT, k) for k, name in enumerate(inputs)}
        self.varying |= {name: (bytecode.SENSOR, k) for name, k in sensors.items()}
        self.parameters = {name: k for k, name in enumerate(parameters)}
        self.const = const
        self.tables = tables
        self.program: list[int] = []
        self.depth = self.deepest = 0
        self.defined: list[int] = []  # rows of the stack that hold the definitions around the present node
        self.constants: dict[int, bool] = {}  # id of a node of the tree that is written -> whether it is constant

    def constant(self, node: SyntaxNode) -> bool:
        """Whether a part of the tree that is written is constant; each part is examined once."""
        if id(node) not in self.constants:
            varies = node.kind in (SIDE, DEFINED) or (node.kind == "name" and node.value in self.varying)
            self.constants[id(node)] = not varies and all([self.constant(arg) for arg in node.args])
        return self.constants[id(node)]

    def emit(self, operation: int, operand: int, grown: int) -> None:
        self.program += [operation, operand]
        self.depth += grown
        self.deepest = max(self.deepest, self.depth)

    def write(self, node: SyntaxNode, frozen: bool = False) -> None:
        """Write a node after its arguments; `frozen`: a constant part around it is already marked."""
        constant = frozen or self.constant(node)
        if node.kind == "number":
            return self.emit(bytecode.CONSTANT, self.slot(float(node.value)), 1)
        if node.kind == SIDE:
            return self.emit(bytecode.SENSOR, node.value, 1)
        if node.kind == DEFINITIONS:
            return self.write_definitions(node)
        if node.kind == DEFINED:
            return self.emit(bytecode.COPY, self.defined[node.value], 1)
        if node.kind == "name" and node.value in self.varying:
            return self.emit(*self.varying[node.value], 1)
        if node.kind == "name":
            return self.emit(bytecode.CONSTANT, self.parameters[node.value], 1)
        self.write_operation(node, constant)
        if constant and not frozen:
            # Parts without an input or a sensor have no derivatives, even where a function's own slope is infinite.
            self.emit(bytecode.FREEZE, 0, 0)

    def write_definitions(self, node: SyntaxNode) -> None:
        around, self.defined = self.defined, []
        *definitions, body = node.args
        for definition in definitions:
            self.write(definition)
            self.defined.append(self.depth - 1)
        self.write(body)
        self.emit(bytecode.KEEP, len(definitions), -len(definitions))
        self.defined = around

    def write_operation(self, node: SyntaxNode, constant: bool) -> None:
        for arg in node.args:
            if not (node.kind == "**" and arg is node.args[1] and is_small_integer(arg)):
                self.write(arg, constant)
        if node.kind == "**" and is_small_integer(node.args[1]):
            self.emit(bytecode.WHOLE_POWER, int(node.args[1].value), 0)
        elif node.kind in _UNARY:
            self.emit(bytecode.CALL, _UNARY[node.kind], 0)
        elif node.kind == "table":
            self.emit(bytecode.TABLE, self.tables[node.value], 0)
        elif node.kind == "function":
            self.emit(bytecode.FUNCTION, node.value, 1 - len(node.args))
        elif node.kind == "where":
            self.emit(bytecode.WHERE, 0, -2)
        elif node.kind == BETWEEN_SIDES:
            self.emit(bytecode.BLEND, 0, -2)
        else:
            for _ in node.args[1:]:
                self.emit(_BINARY[node.kind], 0, -1)

    def append(self, code: list[int]) -> tuple[int, int]:
        """Append the program to the code; returns its start, and the rows of stack it needs."""
        at = len(code)
        code += [len(self.program) // 2, self.deepest, *self.program]
        return at, self.deepest

    def slot(self, literal: float) -> int:
        """Index of a literal in the table of constants; appended if it is not among the last ones."""
        for k in range(max(len(self.parameters), len(self.const) - SEARCHED_CONSTANTS), len(self.const)):
            if self.const[k] == literal and math.copysign(1.0, self.const[k]) == math.copysign(1.0, literal):
                return k
        self.const.append(literal)
        return len(self.const) - 1


_SHAPES = {"step": "cubic", "step5": "quintic"}


def _trapezoid(s: SyntaxNode, fraction: SyntaxNode) -> SyntaxNode:
    """Rise from 0 to 1 with a trapezoidal slope: (s^2 - max(s - b, 0)^2 - max(s - 1 + b, 0)^2) / (2 b (1 - b)).

    It has no value where b exceeds 1/2.
    """

    def number(x: float) -> SyntaxNode:
        return SyntaxNode("number", (), x, fraction.start, fraction.stop)

    def operation(kind: str, *args: SyntaxNode) -> SyntaxNode:
        return SyntaxNode(kind, args, None, fraction.start, fraction.stop)

    def square(x: SyntaxNode) -> SyntaxNode:
        return operation("**", x, number(2))

    rest = operation("-", number(1.0), fraction)
    late, end = (square(operation("max", operation("-", s, b), number(0.0))) for b in (fraction, rest))
    b = operation("where", operation("<=", fraction, number(0.5)), fraction, number(0.0))
    size = operation("*", number(2.0), operation("*", b, rest))
    return operation("/", operation("-", operation("-", square(s), late), end), size)


def _expand(node: SyntaxNode, varying: Collection[str]) -> SyntaxNode:
    """Rewrite steps and powers with a varying exponent in terms of simpler operations."""

    def syntax_node(kind: str, *args: SyntaxNode) -> SyntaxNode:
        return SyntaxNode(kind, args, None, node.start, node.stop)

    args = tuple(_expand(arg, varying) for arg in node.args)
    if node.kind in _SHAPES or node.kind == "trapezoid":
        x, x0, y0, x1, y1 = args[:5]
        s = syntax_node("/", syntax_node("-", x, x0), syntax_node("-", x1, x0))
        s = syntax_node("min", syntax_node("max", s, SyntaxNode("number", value=0.0)), SyntaxNode("number", value=1.0))
        shape = syntax_node(_SHAPES[node.kind], s) if node.kind in _SHAPES else _trapezoid(s, args[5])
        return syntax_node("+", y0, syntax_node("*", syntax_node("-", y1, y0), shape))
    if node.kind == "**" and any(n.kind == "name" and n.value in varying for n in args[1].walk()):
        return syntax_node("exp", syntax_node("*", syntax_node("log", args[0]), args[1]))
    return SyntaxNode(node.kind, args, node.value, node.start, node.stop)
