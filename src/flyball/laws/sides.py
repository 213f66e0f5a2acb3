"""Laws on one side of their corners: what decides by the state is a sign that is told, so that the law is smooth.

Where ``sign(u)`` decides, a law reads a number instead, 1 or -1, which changes only when u has passed zero; so the law
goes on smoothly beyond the corner, and a step may end on it. Between -1 and 1 stands what holds the motion on u = 0
(Filippov, *Differential Equations with Discontinuous Righthand Sides*, 1988).
"""

from __future__ import annotations

from collections.abc import Callable, Collection
from typing import Any

from ..model.grammar import Node

SIDE, BETWEEN_SIDES = "side", "between sides"
Corners = Callable[[Node], tuple[int, float]]
"""Of what decides (a node) the place of the number to be read, and its sign."""
_TRUTHS = ("<", "<=", "and", "or", "not")


def on_one_side(node: Node, moving: Collection[str], corners: Corners) -> Node:
    """The tree with a side in place of each decision by what moves; ``moving`` are names of inputs and sensors."""
    if not _moves(node, moving):
        return node
    if node.kind in _TRUTHS:
        return _truth(node, moving, corners)
    if _smooth_square(node):  # u |u|: its slope has no jump
        return node
    if node.kind == "where":
        condition, a, b = node.args
        a, b = on_one_side(a, moving, corners), on_one_side(b, moving, corners)
        if not _moves(condition, moving):
            return _made(node, "where", condition, a, b)
        return _made(node, BETWEEN_SIDES, _truth(condition, moving, corners), a, b)
    args = tuple(on_one_side(arg, moving, corners) for arg in node.args)
    if node.kind in ("abs", "sign") and _moves(node.args[0], moving):
        side = _side(node, args[0], corners)
        return side if node.kind == "sign" else _made(node, "*", side, args[0])
    if node.kind in ("min", "max"):
        out = args[0]
        for k, arg in enumerate(args[1:]):
            if _moves(arg, moving) or any(_moves(x, moving) for x in node.args[: k + 1]):
                side = _side(node, difference(out, arg), corners)
                out = _made(node, BETWEEN_SIDES, side, *((out, arg) if node.kind == "max" else (arg, out)))
            else:
                out = _made(node, node.kind, out, arg)
        return out
    if node.kind == "table" and _moves(node.args[0], moving):
        corners(Node("table", args, node.value, node.start, node.stop))  # continuous: it only has to be watched
    return Node(node.kind, args, node.value, node.start, node.stop)


def difference(a: Node, b: Node) -> Node:
    """A - b."""
    if b.kind == "number" and b.value == 0:
        return a
    return Node("neg", (b,)) if a.kind == "number" and a.value == 0 else Node("-", (a, b))


def _truth(node: Node, moving: Collection[str], corners: Corners) -> Node:
    """1 where a condition holds, -1 where not."""
    if not _moves(node, moving):
        return _made(node, "where", node, Node("number", value=1.0), Node("number", value=-1.0))
    if node.kind in ("<", "<="):
        a, b = (on_one_side(arg, moving, corners) for arg in node.args)
        return _side(node, difference(b, a), corners)
    parts = [_truth(arg, moving, corners) for arg in node.args]
    if node.kind == "not":
        return _made(node, "neg", parts[0])
    return _made(node, "min" if node.kind == "and" else "max", *parts)


def _side(node: Node, u: Node, corners: Corners) -> Node:
    """The side of u = 0 that the law is on."""
    if not any(n.kind == "name" for n in u.walk()):  # it is made of sides alone
        return _made(node, "sign", u)
    if u.kind == "neg":
        return _made(node, "neg", _side(node, u.args[0], corners))
    at, way = corners(u)
    side = Node(SIDE, (), at, node.start, node.stop)
    return side if way > 0.0 else _made(node, "neg", side)


def _smooth_square(node: Node) -> bool:
    if node.kind != "*":
        return False
    a, b = node.args
    return any(v.kind == "abs" and any(_same(v.args[0], x) for x in _factors(u)) for u, v in ((a, b), (b, a)))


def _factors(node: Node) -> list[Node]:
    """What is multiplied, signs left out."""
    if node.kind == "*":
        return [x for arg in node.args for x in _factors(arg)]
    return _factors(node.args[0]) if node.kind == "neg" else [node]


def _same(a: Node, b: Node) -> bool:
    return meaning(a) == meaning(b)


def meaning(node: Node) -> tuple[Any, ...]:
    """A node without its place in the text."""
    return (node.kind, node.value, *map(meaning, node.args))


def _moves(node: Node, moving: Collection[str]) -> bool:
    return any(n.kind == SIDE or (n.kind == "name" and n.value in moving) for n in node.walk())


def _made(like: Node, kind: str, *args: Node) -> Node:
    return Node(kind, args, None, like.start, like.stop)
