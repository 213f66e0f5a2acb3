"""Rings of signals that follow from each other at one instant: solved where each is linear in the others."""

from __future__ import annotations

from dataclasses import replace

from ..errors import ModelError
from .grammar import Node

ZERO, ONE = (Node("number", (), x) for x in (0.0, 1.0))
LEAST = 1e-9  # of 1: what is left of a loop's own gain below which it says nothing of its signal


def solved(tree: Node, name: str, whose: str, ring: str) -> Node:
    """What a signal is, by a formula of it in which its own name stands: y = a y + b gives b / (1 - a).

    Parameters
    ----------
    tree : Node
    name : str
        Of the signal.
    whose, ring : str
        The controller and the signals on the way round, for messages.

    Raises
    ------
    ModelError
        If the formula is not linear in the signal, or any signal fulfils it, or none.
    """
    parts = _linear(tree, name)
    if parts is None:
        raise ModelError(
            f"{whose}: its {name.partition('.')[2]} depends on itself at the same instant, and not linearly (limits, "
            f"products, functions): {ring}. Have one of them go through a state, as a Lag or an Integrator has, or "
            f"sample one of the controllers (period=...)"
        )
    a, b = parts
    if a.kind == "number" and abs(a.value - 1.0) <= LEAST:
        raise ModelError(
            f"{whose}: its {name.partition('.')[2]} depends on itself at the same instant with the gain 1, which "
            f"leaves it open: {ring}. Have one of them go through a state, as a Lag or an Integrator has"
        )
    return _over(b, _plus(ONE, _minus(a)))


def _folded(tree: Node) -> Node:
    """The tree with sums, products and ratios of numbers in one."""
    if not tree.args:
        return tree
    args = tuple(_folded(x) for x in tree.args)
    if tree.kind == "neg":
        return _minus(args[0])
    by = {"+": _plus, "-": lambda x, y: _plus(x, _minus(y)), "*": _times, "/": _over}.get(tree.kind)
    plain = by is not None and all(x.kind == "number" for x in args)
    return by(*args) if plain and by is not None else replace(tree, args=args)


def _linear(tree: Node, name: str) -> tuple[Node, Node] | None:
    """Factor and rest, a and b of a y + b, both without the name; None if it is not of this form."""
    if all(n.kind != "name" or n.value != name for n in tree.walk()):
        return ZERO, _folded(tree)
    if tree.kind == "name":
        return ONE, ZERO
    found = [_linear(x, name) for x in tree.args]
    if any(x is None for x in found):
        return None
    parts = [x for x in found if x is not None]
    if tree.kind == "neg":
        return _minus(parts[0][0]), _minus(parts[0][1])
    if tree.kind in ("+", "-"):
        first, last = parts
        if tree.kind == "-":
            last = _minus(last[0]), _minus(last[1])
        return _plus(first[0], last[0]), _plus(first[1], last[1])
    if tree.kind == "*":
        for (a, b), (none, by) in (parts, parts[::-1]):
            if none == ZERO:
                return _times(a, by), _times(b, by)
    if tree.kind == "/" and parts[1][0] == ZERO:
        return _over(parts[0][0], parts[1][1]), _over(parts[0][1], parts[1][1])
    if tree.kind == "where" and parts[0][0] == ZERO:
        (_, when), (a, b), (c, d) = parts
        return Node("where", (when, a, c)), Node("where", (when, b, d))
    return None


def _minus(x: Node) -> Node:
    return Node("number", (), -x.value) if x.kind == "number" else Node("neg", (x,))


def _plus(x: Node, y: Node) -> Node:
    if x.kind == y.kind == "number":
        return Node("number", (), x.value + y.value)
    return y if x == ZERO else x if y == ZERO else Node("+", (x, y))


def _times(x: Node, y: Node) -> Node:
    if x.kind == y.kind == "number":
        return Node("number", (), x.value * y.value)
    return ZERO if ZERO in (x, y) else y if x == ONE else x if y == ONE else Node("*", (x, y))


def _over(x: Node, y: Node) -> Node:
    if x.kind == y.kind == "number" and y.value != 0.0:
        return Node("number", (), x.value / y.value)
    return ZERO if x == ZERO else x if y == ONE else Node("/", (x, y))
