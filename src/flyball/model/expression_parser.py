"""The parser of expressions: text such as ``"5*sin(t)"`` to a tree of known operations.

The grammar is Python's own; nothing is executed. A formula may contain a quantity between parentheses or commas: ``"(60
rpm)*t"``, ``"sin(30 deg)"``. A Python function may replace a formula: its arguments are passed by name.
"""

from __future__ import annotations

import ast
import difflib
import inspect
import math
import re
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from numbers import Real
from types import MappingProxyType
from typing import Any, NamedTuple, NoReturn

import numpy as np

from ..errors import ExpressionError, ModelError, UnitError
from .units import split_quantity, to_si

CONSTANTS = {"pi": math.pi, "e": math.e}

# functions a user may call, and the names of their arguments
FUNCTIONS = {
    **{
        name: ("x",)
        for name in [
            "sin",
            "cos",
            "tan",
            "asin",
            "acos",
            "atan",
            "sinh",
            "cosh",
            "tanh",
            "exp",
            "log",
            "sqrt",
            "abs",
            "sign",
        ]
    },
    "atan2": ("y", "x"),
    "min": ("a", "b", "..."),
    "max": ("a", "b", "..."),
    "where": ("condition", "a", "b"),
    "step": ("x", "x0", "y0", "x1", "y1"),
    "step5": ("x", "x0", "y0", "x1", "y1"),
    "trapezoid": ("x", "x0", "y0", "x1", "y1", "fraction"),
}

_BINARY = {ast.Add: "+", ast.Sub: "-", ast.Mult: "*", ast.Div: "/", ast.Pow: "**"}
_COMPARE = {ast.Lt: ("<", False), ast.LtE: ("<=", False), ast.Gt: ("<", True), ast.GtE: ("<=", True)}
_CONDITIONS = ("<", "<=", "and", "or", "not")
_MAX_DEPTH = 200
_ENCLOSED = re.compile(r"(?<=[(,])[^(),<>]*(?=[),])")  # text between parentheses or commas
_WORDS = re.compile(r"\b(if|else|and|or|not|is|for|lambda)\b")


DEFINITIONS, DEFINED = "definitions", "defined"
"""Kinds of nodes for parts that occur more than once: definitions and, last, the expression that uses them; and a use.

The value of a use is the number of its definition, among the innermost definitions around it.
"""


@dataclass(frozen=True)
class SyntaxNode:
    """One operation of an expression: operator, operands, and its start and end in the text."""

    kind: str
    args: tuple[SyntaxNode, ...] = ()
    value: Any = None
    start: int = 0
    stop: int = 0

    def walk(self) -> Iterator[SyntaxNode]:
        """Yield this node and all nodes below it, each before its operands."""
        waiting = [self]
        while waiting:
            node = waiting.pop()
            yield node
            waiting.extend(reversed(node.args))

    def with_args(self, args: tuple[SyntaxNode, ...]) -> SyntaxNode:
        """Return this operation with other operands; itself if they are the same objects."""
        if all(a is b for a, b in zip(args, self.args, strict=True)):
            return self
        return SyntaxNode(self.kind, args, self.value, self.start, self.stop)


def called_table(node: SyntaxNode) -> tuple[str, int]:
    """Name of the table that a node of kind "table" calls, and of which order the derivative: "curve'" is the first."""
    name = str(node.value).rstrip("'")
    return name, len(node.value) - len(name)


def is_closed(node: SyntaxNode) -> bool:
    """Whether a part of a tree uses no definitions from outside."""
    return node.kind == DEFINITIONS or (node.kind != DEFINED and all(is_closed(arg) for arg in node.args))


def tree_text(node: SyntaxNode) -> str:
    """A tree as text, for messages."""
    if node.kind == "number":
        return f"{node.value:.6g}"
    if node.kind == "name":
        return str(node.value)
    if node.kind in (DEFINITIONS, DEFINED):
        return "(...)"
    args = [tree_text(arg) for arg in node.args]
    infix = (*_CONDITIONS, *_BINARY.values())
    if node.kind in ("neg", "not"):
        return f"{'-' if node.kind == 'neg' else 'not '}{args[0]}"
    if node.kind in infix:
        blank = "" if node.kind in ("*", "/", "**") else " "
        return f"({f'{blank}{node.kind}{blank}'.join(args)})"
    bare = [text[1:-1] if arg.kind in infix else text for text, arg in zip(args, node.args, strict=True)]
    return f"{node.value if node.kind == 'table' else node.kind}({', '.join(bare)})"


def parse_text(
    text: str,
    tables: Mapping[str, Sequence[str]] = MappingProxyType({}),
    curves: bool = False,
    dotted: Collection[str] = (),
) -> tuple[str, SyntaxNode]:
    """Return the text on one line, and its tree; `ExpressionError` if it is not a formula.

    ``tables``: arguments of tables by name; ``curves``: whether names may have dots, such as A.angle; ``dotted``: names
    that have some in any case.
    """
    text = "".join(" " if c.isspace() else c for c in text).strip()
    if not text:
        raise ExpressionError("the expression is empty; write a number, a quantity such as '5 mm', or a formula")
    try:
        masked, quantities = _masked(text)
        return text, _Reader(text, masked, quantities, tables, curves, dotted).read(ast.parse(masked, mode="eval").body)
    except SyntaxError as error:
        start = (error.offset or 1) - 1
        refuse_expression(text, start, start + 1, f"cannot read the expression ({error.msg})", _remedy(text))
    except (RecursionError, MemoryError, ValueError) as error:
        if isinstance(error, ModelError):
            raise
        raise ExpressionError(f"'{text[:60]}...' is nested too deep; split it into parameters") from None


def _masked(text: str) -> tuple[str, dict[str, tuple[float, int]]]:
    """Replace each quantity in the text by a name that no user can have meant; return also its value and length."""
    quantities: dict[str, tuple[float, int]] = {}
    spare = (c for c in map(chr, range(0x4E00, 0x9FA0)) if c not in text)

    def replacement(match: re.Match[str]) -> str:
        inner = match[0].strip()
        parts = split_quantity(inner)
        if parts is None or not parts[1] or _WORDS.search(inner):
            return match[0]
        start = match.start() + match[0].index(inner)
        try:
            value = to_si(inner, None)
        except UnitError as error:
            refuse_expression(text, start, start + len(inner), str(error), f"for a product write {parts[0]}*{parts[1]}")
        name = next(spare)
        quantities[name] = value, len(inner)
        return match[0].replace(inner, name.ljust(len(inner)))

    return _ENCLOSED.sub(replacement, text), quantities


NAME = re.compile(r"(?<![\w.])[^\W\d]\w*(?:\.[^\W\d]\w*)*")
"""A name in a formula: ``k``, ``left.k``."""


def replace_names(text: str, replacement: Callable[[str], str]) -> str:
    """Return a formula with its names replaced; units of quantities in parentheses are no names."""
    quantities = [
        match.span()
        for match in _ENCLOSED.finditer(text)
        if (parts := split_quantity(match[0].strip())) and parts[1] and not _WORDS.search(match[0])
    ]
    return NAME.sub(lambda m: m[0] if any(a <= m.start() < b for a, b in quantities) else replacement(m[0]), text)


class _Reader:
    """Converts Python's syntax tree into nodes and refuses everything that is not a formula."""

    def __init__(
        self,
        text: str,
        masked: str,
        quantities: dict[str, tuple[float, int]],
        tables: Mapping[str, Sequence[str]],
        curves: bool = False,
        dotted: Collection[str] = (),
    ) -> None:
        self.text = text
        self.masked = masked  # text as Python parses it, with unchanged length
        self.quantities = quantities
        self.tables, self.curves, self.dotted = tables, curves, dotted
        self.depth = 0

    def read(self, node: ast.AST, *, condition: bool = False) -> SyntaxNode:
        self.depth += 1
        if self.depth > _MAX_DEPTH:
            raise ExpressionError(f"'{self.text[:60]}...' is nested too deep; split it into parameters")
        read = getattr(self, f"read_{type(node).__name__}", None)
        if read is None:
            what = f"'{ast.unparse(node)}' is not allowed in an expression"
            choice = "for a choice write where(condition, a, b)" if isinstance(node, ast.IfExp) else _ALLOWED
            self.refuse(node, what, choice)
        made = read(node)
        self.depth -= 1
        if condition != (made.kind in _CONDITIONS):
            if condition:
                self.refuse(node, "the first argument of where is not a condition", "compare, as in where(t < 1, a, b)")
            self.refuse(node, "a comparison is no number", "use it as the condition of where(condition, a, b)")
        return made

    def syntax_node(self, node: ast.AST, kind: str, args: Iterable[SyntaxNode] = (), value: Any = None) -> SyntaxNode:
        return SyntaxNode(kind, tuple(args), value, *self.span(node))

    def span(self, node: Any) -> tuple[int, int]:
        """Return the position of a node, in characters (Python counts bytes)."""
        data = self.masked.encode()
        start, stop = node.col_offset, node.end_col_offset
        return len(data[:start].decode()), len(data[:stop].decode())

    def refuse(self, node: ast.AST, problem: str, remedy: str) -> NoReturn:
        refuse_expression(self.text, *self.span(node), problem, remedy)

    def read_Constant(self, node: ast.Constant) -> SyntaxNode:
        value = node.value
        if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) < 1e300:
            self.refuse(node, f"{value!r} is not a finite real number", _ALLOWED)
        exact = isinstance(value, int) and value < 2**53
        return self.syntax_node(node, "number", value=value if exact else float(value))

    def read_Name(self, node: ast.Name) -> SyntaxNode:
        if node.id in self.quantities:
            value, length = self.quantities[node.id]
            start, _ = self.span(node)
            return SyntaxNode("number", (), value, start, start + length)
        if node.id in FUNCTIONS:
            example = f"{node.id}({', '.join(FUNCTIONS[node.id])})"
            self.refuse(node, f"'{node.id}' is a function", f"give its arguments: {example}")
        if node.id in self.tables:
            call = f"{node.id}({', '.join(self.tables[node.id])})"
            self.refuse(node, f"'{node.id}' is a table", f"give its argument: {call}")
        if node.id in CONSTANTS:
            return self.syntax_node(node, "number", value=CONSTANTS[node.id])
        return self.syntax_node(node, "name", value=node.id)

    def read_Attribute(self, node: ast.Attribute) -> SyntaxNode:
        """Convert a name with dots: a curve of a part, such as A.angle; a sensor or a parameter of a group."""
        owner: ast.AST = node
        while isinstance(owner, ast.Attribute):
            owner = owner.value
        named = isinstance(owner, ast.Name) and owner.id not in self.quantities
        text = ast.unparse(node)
        if text in self.tables:
            self.refuse(node, f"'{text}' is a table", f"give its argument: {text}(x)")
        if not (named and (self.curves or text in self.dotted)):
            sensor = f"laws use curves by sensors: add fb.Sensor('name', '{text}') and write its name"
            self.refuse(node, f"'{text}' is not allowed in an expression", sensor if named else _ALLOWED)
        return self.syntax_node(node, "name", value=text)

    def read_UnaryOp(self, node: ast.UnaryOp) -> SyntaxNode:
        if isinstance(node.op, ast.Not):
            return self.syntax_node(node, "not", [self.read(node.operand, condition=True)])
        if isinstance(node.op, ast.UAdd):
            return self.read(node.operand)
        if not isinstance(node.op, ast.USub):
            self.refuse(node, f"the operator of '{ast.unparse(node)}' is not known", _ALLOWED)
        return self.syntax_node(node, "neg", [self.read(node.operand)])

    def read_BinOp(self, node: ast.BinOp) -> SyntaxNode:
        if type(node.op) not in _BINARY:
            between = self.span(node.left)[1], self.span(node.right)[0]
            symbol = self.text[slice(*between)].strip(" ()")
            remedy = "powers are written with **, as in x**2" if isinstance(node.op, ast.BitXor) else _ALLOWED
            start = self.text.index(symbol, between[0])
            refuse_expression(self.text, start, start + len(symbol), f"the operator '{symbol}' is not known", remedy)
        return self.syntax_node(node, _BINARY[type(node.op)], [self.read(node.left), self.read(node.right)])

    def read_Compare(self, node: ast.Compare) -> SyntaxNode:
        terms = [self.read(term) for term in (node.left, *node.comparators)]
        parts = []
        for op, a, b in zip(node.ops, terms, terms[1:], strict=False):
            if type(op) not in _COMPARE:
                self.refuse(node, "only <, <=, > and >= can compare", "numbers are seldom exactly equal: use a range")
            kind, swapped = _COMPARE[type(op)]
            parts.append(self.syntax_node(node, kind, (b, a) if swapped else (a, b)))
        return parts[0] if len(parts) == 1 else self.syntax_node(node, "and", parts)

    def read_BoolOp(self, node: ast.BoolOp) -> SyntaxNode:
        parts = [self.read(value, condition=True) for value in node.values]
        return self.syntax_node(node, "and" if isinstance(node.op, ast.And) else "or", parts)

    def read_Call(self, node: ast.Call) -> SyntaxNode:
        name = node.func.id if isinstance(node.func, ast.Name) else ast.unparse(node.func)
        is_table = name in self.tables and name not in FUNCTIONS
        if name not in FUNCTIONS and not is_table:
            known = [*FUNCTIONS, *self.tables]
            guess = did_you_mean(name, known)
            product = "" if guess else f"a product is written {name}*(...); "
            listed = f"known functions: {', '.join(sorted(FUNCTIONS))}"
            listed += f"; tables: {', '.join(sorted(self.tables))}" if self.tables else ""
            self.refuse(node.func, f"unknown function '{name}'", f"{guess}{product}{listed}")
        wanted, given = self.tables[name] if is_table else FUNCTIONS[name], len(node.args)
        if node.keywords or (given < 2 if wanted[-1] == "..." else given != len(wanted)):
            call = f"{name}({', '.join(wanted)})"
            self.refuse(node, f"wrong arguments: {given} given", f"write {call}, without names")
        if is_table:
            return self.syntax_node(node, "table", [self.read(a) for a in node.args], name)
        return self.syntax_node(
            node, name, [self.read(a, condition=name == "where" and i == 0) for i, a in enumerate(node.args)]
        )


_ALLOWED = "allowed are numbers, names, + - * / **, parentheses and functions such as sin(x)"


def refuse_expression(text: str, start: int, stop: int, problem: str, remedy: str) -> NoReturn:
    """Raise `ExpressionError` with the text (only the relevant part of a long one) and a caret under the position."""
    first, last = max(0, start - 60), max(start, 60) + 40
    shown = ("..." if first else "") + text[first:last].rstrip() + ("..." if last < len(text) else "")
    start, stop = (x - first + (3 if first else 0) for x in (start, min(stop, last)))
    pointer = " " * start + "^" * max(1, stop - start)
    raise ExpressionError(f"{problem}\n    {shown}\n    {pointer}\n{remedy}")


_BARE = re.compile(r"(?<![\w.])\d[\d.]*(?:[eE][+-]?\d+)?\s+[^\W\d][\w/*^]*")  # a number and a word


def _remedy(text: str) -> str:
    if bare := _BARE.search(text):
        return f"{_ALLOWED}; a quantity in a formula must be in parentheses, here ({bare[0]})"
    if any(a.isdigit() and b.isalpha() for a, b in pairwise(text)):
        return "write every multiplication, as in 2*x; a quantity in a formula must be in parentheses: 2*(5 mm)"
    return _ALLOWED + "; a quantity in a formula must be in parentheses, as in (60 rpm)*t"


def did_you_mean(name: str, known: Iterable[str]) -> str:
    """Return the question with the nearest known names, or nothing."""
    close = difflib.get_close_matches(name, list(known), n=2, cutoff=0.6)
    return f"did you mean {' or '.join(repr(c) for c in close)}? " if close else ""


MAX_ARGUMENTS = 6  # largest number of arguments of a function

_OPEN = {inspect.Parameter.VAR_POSITIONAL: "*", inspect.Parameter.VAR_KEYWORD: "**"}


def function_tree(function: Callable[..., Any]) -> tuple[str, SyntaxNode]:
    """Return a substitute text and the tree of a function: a node "function" whose arguments are names.

    An argument with a default is a node "optional" around its name (or "keyword" if it can be given by keyword only),
    with the default as its value.

    Raises
    ------
    ExpressionError
        If the function's arguments have no fixed names.
    """
    name = function_name(function)
    if isinstance(function, type):
        _refuse(name, "is a class", "give a function (an object of the class, if that can be called)")
    try:
        parameters = inspect.signature(function).parameters.values()
    except (ValueError, TypeError):
        _refuse(name, "does not expose the names of its arguments", "wrap it: def law(t): ...")
    text = f"<{name}("
    args: list[SyntaxNode] = []
    for p in parameters:
        if p.kind in _OPEN:
            _refuse(name, f"takes any number of arguments ({_OPEN[p.kind]}{p.name})", "name those that it needs")
        only = p.kind is inspect.Parameter.KEYWORD_ONLY
        if only and p.default is p.empty:
            _refuse(name, f"takes '{p.name}' by keyword only", "remove the * before it")
        text += ", " if args else ""
        node = SyntaxNode("name", (), p.name, len(text), len(text) + len(p.name))
        text += p.name
        if p.default is not p.empty:
            node = SyntaxNode("keyword" if only else "optional", (node,), p.default, node.start, node.stop)
        args.append(node)
    if sum(node.kind == "name" for node in args) > MAX_ARGUMENTS:
        _refuse(
            name,
            f"takes {len(args)} arguments",
            f"a law may take {MAX_ARGUMENTS} at most: put constants into the function",
        )
    text += ")>"
    return text, SyntaxNode("function", tuple(args), function, 0, len(text))


def function_arguments(node: SyntaxNode, known: Collection[str]) -> list[SyntaxNode]:
    """Return the arguments of a function for these known names: names, and defaults in front of one of them.

    Raises
    ------
    ExpressionError
        If there are too many, or they cannot be passed by position.
    """
    name = function_name(node.value)
    given: list[SyntaxNode] = []
    last = 0
    for arg in node.args:
        inner = arg if arg.kind == "name" else arg.args[0]
        if arg.kind == "keyword":
            if inner.value in known:
                _refuse(name, f"takes '{inner.value}' by keyword only", "remove the * before it")
            continue
        left_out = arg.kind == "optional" and inner.value not in known
        given.append(arg if left_out else inner)
        last = last if left_out else len(given)
    given = given[:last]
    for k, arg in enumerate(given):
        if arg.kind == "optional":
            if not isinstance(arg.value, Real):
                what = f"has an argument '{arg.args[0].value}' that is not known here, with a default that is no number"
                _refuse(name, what, "put it behind the arguments that are known")
            given[k] = SyntaxNode("number", (), float(arg.value), arg.start, arg.stop)
    if len(given) > MAX_ARGUMENTS:
        _refuse(
            name,
            f"takes {len(given)} arguments",
            f"a law may take {MAX_ARGUMENTS} at most: put constants into the function",
        )
    return given


class FunctionCall(NamedTuple):
    """Callable of a node "called", with its arguments' names for messages: a function inside an expression."""

    function: Callable[..., Any]
    names: tuple[str, ...]
    text: str
    where: str


def call_node(node: SyntaxNode, known: Collection[str], text: str, where: str) -> SyntaxNode:
    """Return a function as a part of an expression: its arguments are ordinary nodes.

    Parameters
    ----------
    node : Node
        The function's.
    known : collection of str
        Names that may be passed to it.
    text, where : str
        The function and the law's owner, for messages.
    """
    given = tuple(function_arguments(node, known))
    names = tuple("" if x.kind == "number" else x.value for x in given)
    return SyntaxNode("called", given, FunctionCall(node.value, names, text, where), node.start, node.stop)


def function_name(function: Any) -> str:
    """Return the name of a function for messages; "lambda" for a lambda."""
    function = getattr(function, "func", function)  # functools.partial
    name = str(getattr(function, "__name__", type(function).__name__))
    return "lambda" if name == "<lambda>" else name


def apply_function(function: Callable[..., Any], *args: Any) -> Any:
    """Return the value of a function; for arrays element by element, since it is written for numbers."""
    args = tuple(float(a) if isinstance(a, int) else a for a in args)
    if not any(isinstance(a, np.ndarray) for a in args):
        return function(*args)
    out = np.array([function(*row) for row in zip(*(a.flat for a in np.broadcast_arrays(*args)), strict=True)])
    return out.reshape(np.broadcast_shapes(*map(np.shape, args)))


def _refuse(name: str, problem: str, remedy: str) -> NoReturn:
    raise ExpressionError(f"the function '{name}' {problem}; {remedy}")
