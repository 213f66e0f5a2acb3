"""Expressions written as programs for the readers in ``laws``: what `compile_law` appends to the shared tables."""

from __future__ import annotations

from collections.abc import Collection, Sequence

from ..errors import ExpressionError
from ..model.expressions import Expression, folded
from ..model.grammar import Node
from .opcodes import (
    ADD,
    ATAN2,
    CALL,
    CONSTANT,
    DIVIDE,
    FREEZE,
    INPUT,
    LESS,
    LESS_EQUAL,
    MAXIMUM,
    MINIMUM,
    MULTIPLY,
    NEGATE,
    POWER,
    SUBTRACT,
    WHERE,
    WHOLE_POWER,
)

_FUNCTIONS = ("neg", "sin", "cos", "tan", "asin", "acos", "atan", "sinh", "cosh", "tanh", "exp", "log", "sqrt", "abs")
_UNARY = {name: NEGATE + k for k, name in enumerate((*_FUNCTIONS, "sign", "cubic", "quintic", "not"))}
_BINARY = {
    **{"+": ADD, "-": SUBTRACT, "*": MULTIPLY, "/": DIVIDE, "**": POWER, "atan2": ATAN2},
    **{"min": MINIMUM, "max": MAXIMUM, "<": LESS, "<=": LESS_EQUAL, "and": MINIMUM, "or": MAXIMUM},
}
_LARGEST_WHOLE_POWER = 64


def compile_law(
    expression: Expression, inputs: Sequence[str], parameters: Sequence[str], code: list[int], const: list[float]
) -> tuple[int, int]:
    """Append the program of a law to the shared tables.

    Parameters
    ----------
    expression
        The law, of the names in `inputs` and `parameters`.
    inputs
        Names of the measured quantities; the first is always "t", time [s].
    parameters
        Names of the parameters; their values are the first entries of `const`, in this order.
    code, const
        Tables that are appended to. A literal that is in `const` already is used again.

    Returns
    -------
    at, depth
        Start of the program in `code`, and the rows of stack it needs.

    Raises
    ------
    ExpressionError
        If a name is not known or means both an input and a parameter, or a constant part has no finite value.
    """
    if not inputs or inputs[0] != "t" or len(const) < len(parameters):
        raise ValueError("the first input is 't', and const begins with one value for each parameter")
    twice = sorted(expression.names & set(inputs) & set(parameters))
    if twice:
        raise ExpressionError(
            f"'{expression}': '{twice[0]}' is an input of this law and also a parameter; rename the parameter"
        )
    expression.require([*inputs, *parameters])
    writer = _Writer(expression, inputs, parameters, const)
    writer.write(folded(_expand(expression.tree, inputs), expression.text))
    at = len(code)
    code += [len(writer.program) // 2, writer.deepest, *writer.program]
    return at, writer.deepest


class _Writer:
    """Writes the program of one law."""

    def __init__(
        self, expression: Expression, inputs: Sequence[str], parameters: Sequence[str], const: list[float]
    ) -> None:
        self.expression = expression
        self.inputs = {name: k for k, name in enumerate(inputs)}
        self.parameters = {name: k for k, name in enumerate(parameters)}
        self.const = const
        self.program: list[int] = []
        self.depth = self.deepest = 0

    def emit(self, operation: int, operand: int, grown: int) -> None:
        self.program += [operation, operand]
        self.depth += grown
        self.deepest = max(self.deepest, self.depth)

    def write(self, node: Node, frozen: bool = False) -> None:
        """Write a node after its arguments; `frozen` means that a constant part around it is already marked."""
        constant = frozen or not any(n.kind == "name" and n.value in self.inputs for n in node.walk())
        if node.kind == "number":
            return self.emit(CONSTANT, self.slot(float(node.value)), 1)
        if node.kind == "name" and node.value in self.inputs:
            return self.emit(INPUT, self.inputs[node.value], 1)
        if node.kind == "name":
            return self.emit(CONSTANT, self.parameters[node.value], 1)
        self.write_operation(node, constant)
        if constant and not frozen:
            # Parts without an input have no derivatives, not even where a function's own slope is infinite.
            self.emit(FREEZE, 0, 0)

    def write_operation(self, node: Node, constant: bool) -> None:
        for arg in node.args:
            if not (node.kind == "**" and arg is node.args[1] and _is_whole(arg)):
                self.write(arg, constant)
        if node.kind == "**" and _is_whole(node.args[1]):
            self.emit(WHOLE_POWER, int(node.args[1].value), 0)
        elif node.kind in _UNARY:
            self.emit(CALL, _UNARY[node.kind], 0)
        elif node.kind == "where":
            self.emit(WHERE, 0, -2)
        else:
            for _ in node.args[1:]:
                self.emit(_BINARY[node.kind], 0, -1)

    def slot(self, literal: float) -> int:
        """Place of a literal in the table of constants."""
        first = len(self.parameters)
        if literal not in self.const[first:]:
            self.const.append(literal)
        return self.const.index(literal, first)


_SHAPES = {"step": "cubic", "step5": "quintic"}


def _is_whole(node: Node) -> bool:
    """Whether an exponent is a small whole number, written out."""
    return node.kind == "number" and node.value == int(node.value) and abs(node.value) <= _LARGEST_WHOLE_POWER


def _expand(node: Node, inputs: Collection[str]) -> Node:
    """Write steps and powers with a varying exponent in terms of simpler operations."""

    def made(kind: str, *args: Node) -> Node:
        return Node(kind, args, None, node.start, node.stop)

    args = tuple(_expand(arg, inputs) for arg in node.args)
    if node.kind in _SHAPES:
        x, x0, y0, x1, y1 = args
        s = made("/", made("-", x, x0), made("-", x1, x0))
        s = made("min", made("max", s, Node("number", value=0.0)), Node("number", value=1.0))
        shape = made(_SHAPES[node.kind], s)
        return made("+", y0, made("*", made("-", y1, y0), shape))
    if node.kind == "**" and any(n.kind == "name" and n.value in inputs for n in args[1].walk()):
        return made("exp", made("*", made("log", args[0]), args[1]))
    return Node(node.kind, args, node.value, node.start, node.stop)
