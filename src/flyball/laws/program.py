"""Expressions written as programs for the readers in ``laws``: what `compile_law` appends to the shared tables."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from functools import reduce
from types import MappingProxyType
from typing import Any

from ..errors import ExpressionError
from ..model.expressions import Expression, folded
from ..model.function import Call, called
from ..model.grammar import Node
from .functions import Called
from .native import native
from .opcodes import (
    ADD,
    ATAN2,
    BLEND,
    CALL,
    CONSTANT,
    DIVIDE,
    FREEZE,
    FUNCTION,
    INPUT,
    LESS,
    LESS_EQUAL,
    MAXIMUM,
    MINIMUM,
    MULTIPLY,
    NEGATE,
    POWER,
    SENSOR,
    SUBTRACT,
    TABLE,
    WHERE,
    WHOLE_POWER,
)
from .sides import BETWEEN_SIDES, SIDE, Corners, meaning, on_one_side, whole

_FUNCTIONS = ("neg", "sin", "cos", "tan", "asin", "acos", "atan", "sinh", "cosh", "tanh", "exp", "log", "sqrt", "abs")
_UNARY = {name: NEGATE + k for k, name in enumerate((*_FUNCTIONS, "sign", "cubic", "quintic", "not"))}
_BINARY = {
    **{"+": ADD, "-": SUBTRACT, "*": MULTIPLY, "/": DIVIDE, "**": POWER, "atan2": ATAN2},
    **{"min": MINIMUM, "max": MAXIMUM, "<": LESS, "<=": LESS_EQUAL, "and": MINIMUM, "or": MAXIMUM},
}
AMONG = 64  # constants in which a literal is looked for
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
    functions: list[Called] | None = None,
    derivatives: bool = False,
    corners: Corners | None = None,
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
        List that a law which is a Python function is appended to. Keep it as long as the code: addresses stand there.
    derivatives
        Whether the law is read by `evaluate_jet`.
    corners
        Given what decides at a corner by inputs or sensors, says where the side is found that the law is on. Without it
        a law decides by itself.

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
        raise ValueError("the first input is 't', and const begins with one value for each parameter")
    _refuse_twins(expression, inputs, parameters, sensors)
    known = [*inputs, *sensors, *parameters]
    expression.require(known)
    expression.require_tables(tables)
    if derivatives:
        expression.require_derivatives()
    tree = expression.tree
    if expression.function is not None:
        tree = called(tree, known, expression.text, expression.where)
    tree = _with_code(tree, code, functions)
    writer = _Writer(expression, inputs, parameters, const, sensors, tables)
    tree = _folded(expression, tree, writer.varying)
    if derivatives:
        tree = _single_powers(tree, writer.varying)
    if corners is not None:
        tree = on_one_side(tree, frozenset((*inputs[1:], *sensors)), corners)
    writer.write(tree)
    return writer.append(code)


def compile_side(
    law: Expression,
    tree: Node,
    parameters: Sequence[str],
    code: list[int],
    const: list[float],
    sensors: Mapping[str, int],
    tables: Mapping[str, int],
) -> tuple[int, int]:
    """Append the program of what decides at a corner of a law, of time and sensors, as `compile_law` does."""
    writer = _Writer(law, ("t",), parameters, const, sensors, tables)
    writer.write(tree)
    return writer.append(code)


def bends(law: Expression, inputs: Sequence[str], sensors: Collection[str]) -> bool:
    """Whether a law has corners, or jumps, where inputs (time apart) or sensors decide."""
    if calls(law):
        return False
    found: list[Node] = []

    def corner(u: Node) -> tuple[int, float]:
        found.append(u)
        return -1, 1.0

    on_one_side(_expand(law.tree, {*inputs, *sensors}), frozenset((*inputs[1:], *sensors)), corner)
    return bool(found)


def calls(law: Expression) -> bool:
    """Whether a law is, or calls, a Python function: its corners nobody knows."""
    return law.function is not None or any(n.kind == "called" for n in law.tree.walk())


def _folded(expression: Expression, tree: Node, varying: Collection[str]) -> Node:
    """The law in simpler operations, its constant parts as numbers."""
    try:
        return folded(_expand(tree, varying), expression.text)
    except ExpressionError as error:
        raise ExpressionError(f"{expression.where}: {error}" if expression.where else str(error)) from None


def _single_powers(node: Node, varying: Collection[str]) -> Node:
    """The tree with one power in place of products of powers of one base, some of them broken: u**2 sqrt(u) is u**2.5.

    Where u is zero its derivatives are those of a power, while those of a factor may be infinite.
    """
    node = replace(node, args=tuple(_single_powers(arg, varying) for arg in node.args)) if node.args else node
    if node.kind != "*" and not (node.kind == "**" and whole(node.args[1])):
        return node
    groups: dict[Any, tuple[Node, float, bool]] = {}
    for u, exponent, broken in _powers(node):
        _, known, also = groups.get(meaning(u), (u, 0.0, False))
        groups[meaning(u)] = u, known + exponent, broken or also
    every = list(groups.values())
    if not any(broken and e > 0.0 and not _constant(u, varying) for u, e, broken in every):
        return node
    factors = [_power(node, u, e, broken) for u, e, broken in every]
    return reduce(lambda a, b: replace(node, kind="*", args=(a, b), value=None), factors)


def _powers(node: Node) -> list[tuple[Node, float, bool]]:
    """What is multiplied: bases, exponents, and whether the base must not be negative."""
    if node.kind == "*":
        return [x for arg in node.args for x in _powers(arg)]
    if node.kind == "sqrt":
        return [(node.args[0], 0.5, True)]
    if node.kind == "**" and node.args[1].kind == "number":
        base, exponent = node.args[0], float(node.args[1].value)
        if not whole(node.args[1]):
            return [(base, exponent, True)]
        inner = _powers(base) if base.kind in ("sqrt", "**") else [(base, 1.0, False)]
        return [(u, e * exponent, broken) for u, e, broken in inner]
    return [(node, 1.0, False)]


def _power(like: Node, u: Node, exponent: float, broken: bool) -> Node:
    """A power; with ``broken``, of numbers that are not negative only."""
    if exponent == 1.0 and not broken:
        return u
    number = replace(like, kind="number", args=(), value=exponent)
    power = replace(like, kind="**", args=(u, number), value=None)
    if not broken or exponent != int(exponent):
        return power
    zero = replace(number, value=0.0)
    known = replace(power, kind="<=", args=(zero, u))
    return replace(power, kind="where", args=(known, power, replace(power, kind="sqrt", args=(u,))))


def _constant(node: Node, varying: Collection[str]) -> bool:
    return not any(n.kind == SIDE or (n.kind == "name" and n.value in varying) for n in node.walk())


def _refuse_twins(
    expression: Expression, inputs: Collection[str], parameters: Collection[str], sensors: Collection[str]
) -> None:
    """Refuse names that mean two things."""
    input_, parameter, sensor = (inputs, "an input of this law"), (parameters, "a parameter"), (sensors, "a sensor")
    for (names, what), (others, also) in ((input_, parameter), (input_, sensor), (parameter, sensor)):
        for name in sorted(expression.names & set(names) & set(others)):
            raise ExpressionError(f"'{expression}': '{name}' is {what} and also {also}; rename the {also[2:]}")


def _with_code(tree: Node, code: list[int], functions: list[Called] | None) -> Node:
    """The tree with the places of what calls of functions need in place of the functions."""
    args = tuple(_with_code(arg, code, functions) for arg in tree.args)
    if tree.kind != "called":
        return replace(tree, args=args) if args else tree
    return Node("function", args, _function(tree.value, code, functions), tree.start, tree.stop)


def _function(asked: Call, code: list[int], functions: list[Called] | None) -> int:
    """Append what a call of a function needs to the code; where it stands there."""
    if functions is None:
        raise ValueError("a law that is a Python function needs a list to be kept in")
    made = native(asked)
    code += [made.address, len(functions), len(asked.names)]
    functions.append(Called(made, asked.names, asked.text, asked.where))
    return len(code) - 3


class _Writer:
    """Writes the program of one law."""

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
        self.varying = {name: (INPUT, k) for k, name in enumerate(inputs)}
        self.varying |= {name: (SENSOR, k) for name, k in sensors.items()}
        self.parameters = {name: k for k, name in enumerate(parameters)}
        self.const = const
        self.tables = tables
        self.program: list[int] = []
        self.depth = self.deepest = 0

    def emit(self, operation: int, operand: int, grown: int) -> None:
        self.program += [operation, operand]
        self.depth += grown
        self.deepest = max(self.deepest, self.depth)

    def write(self, node: Node, frozen: bool = False) -> None:
        """Write a node after its arguments; `frozen` means that a constant part around it is already marked."""
        constant = frozen or _constant(node, self.varying)
        if node.kind == "number":
            return self.emit(CONSTANT, self.slot(float(node.value)), 1)
        if node.kind == SIDE:
            return self.emit(SENSOR, node.value, 1)
        if node.kind == "name" and node.value in self.varying:
            return self.emit(*self.varying[node.value], 1)
        if node.kind == "name":
            return self.emit(CONSTANT, self.parameters[node.value], 1)
        self.write_operation(node, constant)
        if constant and not frozen:
            # Parts without an input or a sensor have no derivatives, not even where a function's own slope is infinite.
            self.emit(FREEZE, 0, 0)

    def write_operation(self, node: Node, constant: bool) -> None:
        for arg in node.args:
            if not (node.kind == "**" and arg is node.args[1] and whole(arg)):
                self.write(arg, constant)
        if node.kind == "**" and whole(node.args[1]):
            self.emit(WHOLE_POWER, int(node.args[1].value), 0)
        elif node.kind in _UNARY:
            self.emit(CALL, _UNARY[node.kind], 0)
        elif node.kind == "table":
            self.emit(TABLE, self.tables[node.value], 0)
        elif node.kind == "function":
            self.emit(FUNCTION, node.value, 1 - len(node.args))
        elif node.kind == "where":
            self.emit(WHERE, 0, -2)
        elif node.kind == BETWEEN_SIDES:
            self.emit(BLEND, 0, -2)
        else:
            for _ in node.args[1:]:
                self.emit(_BINARY[node.kind], 0, -1)

    def append(self, code: list[int]) -> tuple[int, int]:
        """Append the program to the code: where it begins, and the rows of stack it needs."""
        at = len(code)
        code += [len(self.program) // 2, self.deepest, *self.program]
        return at, self.deepest

    def slot(self, literal: float) -> int:
        """Place of a literal in the table of constants; a new one if it is not among the last ones."""
        for k in range(max(len(self.parameters), len(self.const) - AMONG), len(self.const)):
            if self.const[k] == literal and math.copysign(1.0, self.const[k]) == math.copysign(1.0, literal):
                return k
        self.const.append(literal)
        return len(self.const) - 1


_SHAPES = {"step": "cubic", "step5": "quintic"}


def _expand(node: Node, varying: Collection[str]) -> Node:
    """Write steps and powers with a varying exponent in terms of simpler operations."""

    def made(kind: str, *args: Node) -> Node:
        return Node(kind, args, None, node.start, node.stop)

    args = tuple(_expand(arg, varying) for arg in node.args)
    if node.kind in _SHAPES:
        x, x0, y0, x1, y1 = args
        s = made("/", made("-", x, x0), made("-", x1, x0))
        s = made("min", made("max", s, Node("number", value=0.0)), Node("number", value=1.0))
        shape = made(_SHAPES[node.kind], s)
        return made("+", y0, made("*", made("-", y1, y0), shape))
    if node.kind == "**" and any(n.kind == "name" and n.value in varying for n in args[1].walk()):
        return made("exp", made("*", made("log", args[0]), args[1]))
    return Node(node.kind, args, node.value, node.start, node.stop)
