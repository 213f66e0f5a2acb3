"""Laws on one side of their corners: what decides by the state is a sign that is told, so that the law is smooth.

Where ``sign(u)`` decides, a law reads a number instead, 1 or -1, which changes only when u has passed zero; so the law
goes on smoothly beyond the corner, and a step may end on it. Between -1 and 1 stands what holds the motion on u = 0
(Filippov, *Differential Equations with Discontinuous Righthand Sides*, 1988).

What is made of sides is affine in each of them, and goes on so beyond 1 and -1: there the side is looked for that would
hold the motion where none does any more, by which it is seen that it leaves.

A branch is continued beyond its corner only within the domain of the functions in it (`DOMAINS`): where the law as
written is defined, but the argument of the branch continued is not in the domain, the function keeps its value at the
domain's boundary, and at a pole the law is as written. So ``max(-x, 0)**1.5`` is 0 beyond its corner on either side. A
law that leaves its domain as written is nan, as ever.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Collection, Iterable
from dataclasses import replace
from typing import Any

from ..model.grammar import Node

SIDE, BETWEEN_SIDES = "side", "between sides"
LARGEST_WHOLE_POWER = 64
Corners = Callable[[Node], tuple[int, float]]
"""Of what decides (a node) the place of the number to be read, and its sign."""
_TRUTHS = ("<", "<=", "and", "or", "not")
_DECISIONS = frozenset(("abs", "sign", "min", "max", "where", "table", *_TRUTHS))
DOMAINS: dict[str, tuple[tuple[str, float], ...]] = {
    "sqrt": (("<", 0.0),),
    "**": (("<", 0.0),),
    "log": (("<", sys.float_info.min),),
    "asin": (("<", -1.0), (">", 1.0)),
    "acos": (("<", -1.0), (">", 1.0)),
}
"""Functions that are not defined for all numbers, and where not: below or above which arguments."""


def on_one_side(node: Node, moving: Collection[str], corners: Corners, taken: Node | None = None) -> Node:
    """The tree with a side in place of each decision by what moves.

    Parameters
    ----------
    node : Node
        Tree of a law.
    moving : collection of str
        Names of inputs and sensors.
    corners : callable
        Where the side of each corner is found.
    taken : Node, optional
        Condition under which the law as written takes this part of it; without it, always.
    """
    if not _moves(node, moving):
        return node
    if node.kind in _TRUTHS:
        return _truth(node, moving, corners)
    if smooth := _smooth_factors(node):
        made = _with_factors(node, smooth, lambda x: on_one_side(x, moving, corners, taken))
        return _affine_in_shared(made) if node.kind == "*" else made
    if node.kind == "where":
        condition, a, b = node.args
        if not _moves(condition, moving):
            a, b = on_one_side(a, moving, corners, taken), on_one_side(b, moving, corners, taken)
            return _made(node, "where", condition, a, b)
        yes, no = _both(taken, condition), _both(taken, _made(condition, "not", condition))
        a, b = on_one_side(a, moving, corners, yes), on_one_side(b, moving, corners, no)
        branches = _without_poles(a, b, no, moving), _without_poles(b, a, yes, moving)
        return _between(node, _truth(condition, moving, corners), *branches)
    if node.kind == "abs" and node.args[0].kind == "atan2":  # |atan2(y, x)| = atan2(|y|, x), which does not jump
        y, x = node.args[0].args
        return on_one_side(_made(node, "atan2", _made(node, "abs", y), x), moving, corners, taken)
    args = tuple(on_one_side(arg, moving, corners, taken) for arg in node.args)
    if node.kind in ("abs", "sign") and _moves(node.args[0], moving):
        if _of_sides_alone(args, moving):
            return _affine(_made(node, node.kind, *args))
        side = _side(node, args[0], corners)
        return side if node.kind == "sign" else _made(node, "*", side, args[0])
    if node.kind in ("min", "max"):
        out = args[0]
        for k, arg in enumerate(args[1:]):
            if _moves(arg, moving) or any(_moves(x, moving) for x in node.args[: k + 1]):
                if _of_sides_alone((out, arg), moving):
                    out = _affine(_made(node, node.kind, out, arg))
                    continue
                side = _side(node, difference(out, arg), corners)
                out = _between(node, side, *((out, arg) if node.kind == "max" else (arg, out)))
            else:
                out = _made(node, node.kind, out, arg)
        return out
    if node.kind == "table" and _moves(node.args[0], moving):
        corners(Node("table", args, node.value, node.start, node.stop))  # continuous: it only has to be watched
    made = _in_domain(Node(node.kind, args, node.value, node.start, node.stop), node, moving, taken)
    return _affine_in_shared(made) if node.kind == "*" else made


def _in_domain(node: Node, written: Node, moving: Collection[str], taken: Node | None) -> Node:
    """A function that keeps its value at the boundary of its domain where only a branch continued has left that.

    ``written`` is the function in the law as written. Where that is evaluated, and outside its domain, it is nan.
    """
    bounds = DOMAINS.get(node.kind, ())
    if not bounds or not _moves(node.args[0], moving) or (node.kind == "**" and whole(node.args[1])):
        return node
    x, *others = node.args
    sided = any(n.kind == SIDE for n in x.walk())
    out = node
    for order, limit in bounds if sided or taken else ():
        bound = _made(node, "number", value=limit)
        outside = [_made(node, "<", *pair) for pair in ((x, bound), (written.args[0], bound))]
        if order == ">":
            outside = [replace(n, args=n.args[::-1]) for n in outside]
        wrong = _both(taken, outside[1])
        continued = _both(outside[0], _made(node, "not", wrong))
        out = _made(node, "where", continued, _made(node, node.kind, bound, *others), out)
    return out


def _without_poles(branch: Node, other: Node, elsewhere: Node, moving: Collection[str]) -> Node:
    """A branch that is the other one where a divisor in it is zero and the law as written takes the other one.

    A step may end right on the corner of ``where(x > 0, sin(x)/x, 1)``.
    """
    out = branch
    for n in branch.walk():
        inverse = n.kind == "**" and whole(n.args[1]) and n.args[1].value < 0
        if (n.kind == "/" or inverse) and _moves(x := n.args[n.kind == "/"], moving):
            zero = _made(n, "number", value=0.0)
            nothing = _both(_made(n, "<=", x, zero), _made(n, "<=", zero, x))
            out = _made(n, "where", _both(elsewhere, nothing), other, out)
    return out


def whole(node: Node) -> bool:
    """Whether an exponent is a small whole number, written out."""
    return node.kind == "number" and node.value == int(node.value) and abs(node.value) <= LARGEST_WHOLE_POWER


def may_be_steep(tree: Node, still: Collection[str]) -> bool:
    """Whether a law has a root, a power below 1, an arc sine or an arc cosine of anything but the names ``still``.

    At an end of the domain the slope of these functions is infinite.
    """
    return any(
        n.kind in ("sqrt", "asin", "acos")
        or (n.kind == "**" and not (n.args[1].kind == "number" and not 0.0 < n.args[1].value < 1.0))
        for n in tree.walk()
        if n.args and any(x.kind == "name" and x.value not in still for x in n.args[0].walk())
    )


def _both(a: Node | None, b: Node) -> Node:
    return b if a is None else _made(b, "and", a, b)


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
        if _of_sides_alone((a, b), moving):
            return _affine(_made(node, "sign", difference(b, a)))
        return _side(node, difference(b, a), corners)
    first, *others = [_truth(arg, moving, corners) for arg in node.args]
    if node.kind == "not":
        return _made(node, "neg", first)
    for other in others:  # not the lesser, or larger, of two: a side beyond 1 is to be seen through the other
        known = Node("number", value=-1.0 if node.kind == "and" else 1.0)
        first = _between(node, first, *((other, known) if node.kind == "and" else (known, other)))
    return first


def _of_sides_alone(args: Iterable[Node], moving: Collection[str]) -> bool:
    """Whether these move by sides, and by nothing else, time included."""
    nodes = [n for arg in args for n in arg.walk()]
    return any(n.kind == SIDE for n in nodes) and not any(
        n.kind == "name" and (n.value == "t" or n.value in moving) for n in nodes
    )


def _between(like: Node, way: Node, a: Node, b: Node) -> Node:
    """A where ``way`` is 1, b where it is -1, and what is between: affine in every side, in however many parts."""
    if way.kind == SIDE or (way.kind == "neg" and way.args[0].kind == SIDE):
        at, value = (way.value, 1.0) if way.kind == SIDE else (way.args[0].value, -1.0)
        return _made(like, BETWEEN_SIDES, way, _with_side(a, at, value), _with_side(b, at, -value))
    return _affine_in_shared(_made(like, BETWEEN_SIDES, way, a, b))


def _affine_in_shared(node: Node) -> Node:
    """The node, affine in the sides that stand in two or more of its arguments: products of them would be no more."""
    sides = [dict.fromkeys(n.value for n in arg.walk() if n.kind == SIDE) for arg in node.args]
    for at in dict.fromkeys(x for k, found in enumerate(sides) for x in found if any(x in y for y in sides[:k])):
        way = Node(SIDE, (), at, node.start, node.stop)
        node = _made(node, BETWEEN_SIDES, way, _with_side(node, at, 1.0), _with_side(node, at, -1.0))
    return node


def _affine(node: Node) -> Node:
    """What is made of sides alone, between its values for sides of 1 and -1."""
    at = next((n.value for n in node.walk() if n.kind == SIDE), None)
    if at is None:
        return node
    values = (_affine(_with_side(node, at, value)) for value in (1.0, -1.0))
    return _made(node, BETWEEN_SIDES, Node(SIDE, (), at, node.start, node.stop), *values)


def _with_side(node: Node, at: int, value: float) -> Node:
    """A node with a number in place of one side."""
    if node.kind == SIDE and node.value == at:
        return Node("number", value=value)
    return replace(node, args=tuple(_with_side(arg, at, value) for arg in node.args)) if node.args else node


def _side(node: Node, u: Node, corners: Corners) -> Node:
    """The side of u = 0 that the law is on."""
    if u.kind == "neg":
        return _made(node, "neg", _side(node, u.args[0], corners))
    at, way = corners(u)
    side = Node(SIDE, (), at, node.start, node.stop)
    return side if way > 0.0 else _made(node, "neg", side)


def _smooth_factors(node: Node) -> list[tuple[Any, ...]]:
    """Factors of a product that stay as written, by what they mean: together they and their slope do not jump.

    These are ``abs(u)`` beside u, and ``sign(u)`` beside a positive power of ``abs(u)`` (the flow through an orifice),
    where u makes no decision itself.
    """
    factors = _factors(node) if node.kind == "*" else []
    meant = [meaning(x) for x in factors]
    powers = [x for x in factors if x.kind == "sqrt" or (x.kind == "**" and _positive(x.args[1]))]
    found = []
    for x in factors:
        if x.kind == "abs" and not _decides(x.args[0]) and meaning(x.args[0]) in meant:
            found.append(meaning(x))
        if x.kind == "sign" and not _decides(x.args[0]):
            size = ("abs", None, meaning(x.args[0]))
            found += [y for p in powers if _is_power_of(p, size) for y in (meaning(x), meaning(p))]
    return found


def _is_power_of(power: Node, size: tuple[Any, ...]) -> bool:
    """Whether the base of a power is this absolute value, perhaps times what makes no decision."""
    factors = _factors(power.args[0])
    return any(meaning(x) == size for x in factors) and not any(_decides(x) for x in factors if meaning(x) != size)


def _with_factors(node: Node, kept: Collection[tuple[Any, ...]], change: Callable[[Node], Node]) -> Node:
    """A product with all its factors changed but those that are kept."""
    if node.kind in ("*", "neg"):
        return _made(node, node.kind, *(_with_factors(x, kept, change) for x in node.args))
    return node if meaning(node) in kept else change(node)


def _decides(node: Node) -> bool:
    """Whether there is a corner or a jump in it."""
    return any(n.kind in _DECISIONS for n in node.walk())


def _positive(node: Node) -> bool:
    return node.kind == "number" and node.value > 0


def _factors(node: Node) -> list[Node]:
    """What is multiplied, signs left out."""
    if node.kind == "*":
        return [x for arg in node.args for x in _factors(arg)]
    return _factors(node.args[0]) if node.kind == "neg" else [node]


def meaning(node: Node) -> tuple[Any, ...]:
    """A node without its place in the text."""
    return (node.kind, node.value, *map(meaning, node.args))


def _moves(node: Node, moving: Collection[str]) -> bool:
    return any(n.kind == SIDE or (n.kind == "name" and n.value in moving) for n in node.walk())


def _made(like: Node, kind: str, *args: Node, value: float | None = None) -> Node:
    return Node(kind, args, value, like.start, like.stop)
