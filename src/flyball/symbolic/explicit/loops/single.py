"""One equation for one unknown: linear, a cosine and a sine, a quadratic; the branch is that of the drawn position."""

from __future__ import annotations

import math
from typing import Any

from ....graph.derivative import tangents
from ....graph.node import Node
from ....math.scalar import atan2, sqrt
from ..probe import Probe
from .circle import NotOfThisForm, affine, depends, holds, without

DEAD = 1e-9  # part of what cancels in a discriminant, below which the branches meet


class Solution:
    """A formula for an unknown.

    Attributes
    ----------
    value : Node
    how : str
        Form of the equation and branch.
    never : list of Node
        What must not vanish or become negative.
    radius : Node or number, optional
        sqrt(x^2 + y^2) of atan2(y, x), where that is known.
    """

    radius: Any = None

    def __init__(self, value: Any, how: str, never: list[Any] | None = None) -> None:
        self.value, self.how, self.never = value, how, never or []


def single(x: Node, w: Node, probe: Probe) -> Solution:
    """Solve one equation for its only unknown.

    Raises
    ------
    NotOfThisForm
        If no formula is known for it.
    """
    for rule in (linear, harmonic, quadratic):
        try:
            return rule(x, w, probe)
        except NotOfThisForm:
            pass
    raise NotOfThisForm


def linear(x: Node, w: Node, probe: Probe) -> Solution:
    """A w + b = 0."""
    slope = tangents([x], [(w, 1.0)])[0]
    if probe.zero(slope, probe.size(x)) or depends(slope, w, probe):
        raise NotOfThisForm
    return divided(x, probe.simplest(without(slope, w) if holds(slope, w) else slope), w)


def divided(x: Node, slope: Any, w: Node) -> Solution:
    """The same with a in hand."""
    return Solution(-without(x, w) / slope, "linear", [slope] if isinstance(slope, Node) else [])


def harmonic(x: Node, w: Node, probe: Probe) -> Solution:
    """A cos w + B sin w + C = 0: w = atan2(B, A) + s atan2(sqrt(A^2 + B^2 - C^2), -C), s = 1 or -1."""
    k, ((a, b),) = affine(polynomial(x, w), [w], probe)
    return of_harmonic((a, b, k), w, probe)


def of_harmonic(abc: tuple[Any, Any, Any], w: Node, probe: Probe) -> Solution:
    """The same from its coefficients."""
    A, B, C = abc
    if A == 0.0 and B == 0.0:
        raise NotOfThisForm
    drawn = probe.start[w.data.name]
    if C == 0.0:
        found = atan2(-1.0 * A, B)
        at = probe.at_start(found)
        opposite = math.cos(at - drawn) < 0.0
        value = atan2(A, -1.0 * B) if opposite else found
        return Solution(value, "A cos w + B sin w = 0", [A * A + B * B])
    D = A * A + B * B - C * C
    if not probe.at_start(D) > DEAD * probe.at_start(C * C):
        raise NotOfThisForm
    far, turn = atan2(B, A), atan2(sqrt(D), -1.0 * C)
    plus = probe.at_start(far) + probe.at_start(turn) - drawn
    minus = probe.at_start(far) - probe.at_start(turn) - drawn
    sign = 1.0 if math.cos(plus) > math.cos(minus) else -1.0
    return Solution(far + sign * turn, f"A cos w + B sin w + C = 0, branch {'+' if sign > 0 else '-'}", [D])


def quadratic(x: Node, w: Node, probe: Probe) -> Solution:
    """A w^2 + B w + C = 0 of a length w."""
    x = polynomial(x, w)
    slope = tangents([x], [(w, 1.0)])[0]
    bend = tangents([slope], [(w, 1.0)])[0]
    if probe.zero(bend) or depends(bend, w, probe):
        raise NotOfThisForm
    a = without(bend, w) * 0.5 if isinstance(bend, Node) else 0.5 * bend
    return of_quadratic((a, without(slope, w), without(x, w)), w, probe)


def of_quadratic(abc: tuple[Any, Any, Any], w: Node, probe: Probe) -> Solution:
    """The same from its coefficients."""
    a, b, c = (w.graph.node(y) for y in abc)
    if probe.zero(a):
        raise NotOfThisForm
    b = w.graph.node(probe.without_nothing(b, probe.size(a)))
    D = 0.25 * b * b - a * c
    if not probe.at_start(D) > DEAD * abs(probe.at_start(a * c)):
        raise NotOfThisForm
    drawn = probe.start[w.data.name]
    values = [(-0.5 * b + sign * sqrt(D)) / a for sign in (1.0, -1.0)]
    away = [abs(probe.at_start(y) - drawn) for y in values]
    best = away.index(min(away))
    return Solution(values[best], f"quadratic, branch {'+-'[best]}", [D])


def polynomial(x: Node, w: Node) -> Node:
    """An equation sqrt(P) = R, in which R does not hold w, as P - R^2 = 0; others as they are."""
    terms = [x]
    inside: list[tuple[float, Node]] = []
    rest: Any = 0.0
    while terms:
        y = terms.pop()
        if not holds(y, w):
            rest = rest + y
        elif y.op == "add":
            terms.extend(y.args)
        else:
            factor, y = (y.args[0].value, y.args[1]) if y.op == "multiply" and y.args[0].op == "number" else (1.0, y)
            inside.append((factor, y))
    if len(inside) == 1 and inside[0][1].op == "sqrt":
        factor, root = inside[0]
        return x.graph.node(factor * factor * root.args[0] - rest * rest)
    return x
