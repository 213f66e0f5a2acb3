"""Formulas written out again: a tree as a text that is read to the same tree, names replaced."""

from __future__ import annotations

from collections.abc import Mapping

from ..errors import ModelError
from .function import function_name
from .grammar import Node

_BETWEEN = ("+", "-", "*", "/", "**", "<", "<=", "and", "or")


def text_of(node: Node, names: Mapping[str, str]) -> str:
    """The text of a formula, with other names where ``names`` has some.

    Raises
    ------
    ModelError
        If a Python function is called in it.
    """
    if node.kind == "number":
        return f"({float(node.value)!r})"
    if node.kind == "name":
        return names.get(node.value, node.value)
    args = [text_of(arg, names) for arg in node.args]
    if node.kind == "neg":
        return f"(-{args[0]})"
    if node.kind == "not":
        return f"(not {args[0]})"
    if node.kind in _BETWEEN:
        return f"({f' {node.kind} '.join(args)})"
    if node.kind == "table":
        return f"{node.value}({args[0]})"
    if node.kind in ("function", "called"):
        where, what = (f"{node.value.where}: ", node.value.function) if node.kind == "called" else ("", node.value)
        raise ModelError(
            f"{where}the Python function '{function_name(what)}' has no derivatives that are known; write it as an "
            f"expression or a Table"
        )
    return f"{node.kind}({', '.join(args)})"
