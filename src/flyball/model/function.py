"""Python functions as laws: their arguments' names say what they are given."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Collection
from numbers import Real
from typing import Any, NamedTuple, NoReturn

import numpy as np

from ..errors import ExpressionError
from .grammar import Node

MOST = 6  # arguments that a function may take

_OPEN = {inspect.Parameter.VAR_POSITIONAL: "*", inspect.Parameter.VAR_KEYWORD: "**"}


def function_tree(function: Callable[..., Any]) -> tuple[str, Node]:
    """Stand-in text and tree of a function: a node "function" whose arguments are names.

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
        _refuse(name, "does not tell the names of its arguments", "wrap it: def law(t): ...")
    text = f"<{name}("
    args: list[Node] = []
    for p in parameters:
        if p.kind in _OPEN:
            _refuse(name, f"takes any number of arguments ({_OPEN[p.kind]}{p.name})", "name those that it needs")
        only = p.kind is inspect.Parameter.KEYWORD_ONLY
        if only and p.default is p.empty:
            _refuse(name, f"takes '{p.name}' by keyword only", "remove the * before it")
        text += ", " if args else ""
        node = Node("name", (), p.name, len(text), len(text) + len(p.name))
        text += p.name
        if p.default is not p.empty:
            node = Node("keyword" if only else "optional", (node,), p.default, node.start, node.stop)
        args.append(node)
    if sum(node.kind == "name" for node in args) > MOST:
        _refuse(name, f"takes {len(args)} arguments", f"a law may take {MOST} at most: put constants into the function")
    text += ")>"
    return text, Node("function", tuple(args), function, 0, len(text))


def arguments(node: Node, known: Collection[str]) -> list[Node]:
    """What a function is given where these names are known: names, and defaults that stand before one of them.

    Raises
    ------
    ExpressionError
        If they are too many, or cannot be given by place.
    """
    name = function_name(node.value)
    given: list[Node] = []
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
            given[k] = Node("number", (), float(arg.value), arg.start, arg.stop)
    if len(given) > MOST:
        _refuse(
            name, f"takes {len(given)} arguments", f"a law may take {MOST} at most: put constants into the function"
        )
    return given


class Call(NamedTuple):
    """What a node "called" calls, with its arguments' names for messages: a function as a part of an expression."""

    function: Callable[..., Any]
    names: tuple[str, ...]
    text: str
    where: str


def called(node: Node, known: Collection[str], text: str, where: str) -> Node:
    """A function as a part of an expression: its arguments are nodes as any other's.

    Parameters
    ----------
    node : Node
        The function's.
    known : collection of str
        Names that it may be given.
    text, where : str
        What it is, and what it is the law of, for messages.
    """
    given = tuple(arguments(node, known))
    names = tuple("" if x.kind == "number" else x.value for x in given)
    return Node("called", given, Call(node.value, names, text, where), node.start, node.stop)


def function_name(function: Any) -> str:
    """Name of a function for messages; a lambda is called lambda."""
    function = getattr(function, "func", function)  # functools.partial
    name = str(getattr(function, "__name__", type(function).__name__))
    return "lambda" if name == "<lambda>" else name


def apply(function: Callable[..., Any], *args: Any) -> Any:
    """Value of a function on numbers; of arrays element by element, as it is written for numbers."""
    args = tuple(float(a) if isinstance(a, int) else a for a in args)
    if not any(isinstance(a, np.ndarray) for a in args):
        return function(*args)
    out = np.array([function(*row) for row in zip(*(a.flat for a in np.broadcast_arrays(*args)), strict=True)])
    return out.reshape(np.broadcast_shapes(*map(np.shape, args)))


def _refuse(name: str, problem: str, remedy: str) -> NoReturn:
    raise ExpressionError(f"the function '{name}' {problem}; {remedy}")
