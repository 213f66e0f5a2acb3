"""Equations of angles: E = k + sum of a cos w + b sin w, recognised by value and read off at right angles."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from ....graph.derivative import replaced, tangents
from ....graph.node import Graph, Node, Symbol
from ....graph.operations import NUMBER
from ....graph.values import reached, symbols
from ....math.scalar import cos, sin
from ..probe import Probe

Affine = tuple[Any, list[tuple[Any, Any]]]
"""Constant, and the factors of cosine and sine of each angle."""


class NotOfThisForm(Exception):
    """An equation is not what a rule solves."""


def without(x: Node, w: Node) -> Any:
    """An expression where a symbol is zero."""
    return replaced([x], [(w, 0.0)])[0]


def holds(x: Any, w: Node) -> bool:
    """Whether a symbol stands in an expression."""
    return isinstance(x, Node) and any(s is w for s in symbols([x]))


def depends(x: Any, w: Node, probe: Probe) -> bool:
    """Whether an expression changes with a symbol."""
    return holds(x, w) and not probe.zero(tangents([x], [(w, 1.0)])[0], probe.size(x))


def split(x: Node, angles: Sequence[Node]) -> tuple[Node, list[tuple[Node, Node]]]:
    """An expression in cosines and sines of angles by themselves: symbols for these are returned with it.

    Raises
    ------
    NotOfThisForm
        If an angle stands elsewhere.
    """
    g = x.graph
    atoms = [(_atom(g, "cos", w), _atom(g, "sin", w)) for w in angles]
    new = []
    for y in reached([x]):
        if y.op in ("sin", "cos") and any(holds(y, w) for w in angles):
            c, s = _turned(y.args[0], angles, atoms)
            new.append((y, c if y.op == "cos" else s))
    (out,) = replaced([x], new)
    out = g.node(out)
    if any(holds(out, w) for w in angles):
        raise NotOfThisForm
    return out, atoms


def _atom(g: Graph, what: str, w: Node) -> Node:
    return g.symbol(Symbol(f"{what} {w.data.name}", "atom"))


def _turned(argument: Node, angles: Sequence[Node], atoms: list[tuple[Node, Node]]) -> tuple[Any, Any]:
    """Cosine and sine of a sum of angles and of what is known."""
    (rest,) = replaced([argument], [(w, 0.0) for w in angles])
    c, s = cos(rest), sin(rest)
    for w, (cw, sw) in zip(angles, atoms, strict=True):
        turn = tangents([argument], [(w, 1.0)])[0]
        turn = turn.value if isinstance(turn, Node) and turn.op == NUMBER else turn
        if isinstance(turn, Node) or turn not in (0.0, 1.0, -1.0):
            raise NotOfThisForm
        if turn:
            c, s = c * cw - turn * s * sw, s * cw + turn * c * sw
    return c, s


def affine(x: Node, angles: Sequence[Node], probe: Probe) -> Affine:
    """Read an equation as k + sum of a cos w + b sin w.

    Raises
    ------
    NotOfThisForm
        If it is another.
    """
    form, atoms = split(x, angles)

    def at(which: int, c: float, s: float) -> Any:
        values = [(c, s) if k == which else (1.0, 0.0) for k in range(len(angles))]
        pairs = [(n, y) for (a, b), (c, s) in zip(atoms, values, strict=True) for n, y in ((a, c), (b, s))]
        return replaced([form], pairs)[0]

    size = probe.size(x)
    k = at(-1, 1.0, 0.0)
    factors = []
    for n in range(len(angles)):
        there, back, up = at(n, 1.0, 0.0), at(n, -1.0, 0.0), at(n, 0.0, 1.0)
        a, middle = 0.5 * (there - back), 0.5 * (there + back)
        factors.append((probe.without_nothing(a, size), probe.without_nothing(up - middle, size)))
        k = k - factors[-1][0]
    k = probe.without_nothing(k, size)
    told = k
    for w, (a, b) in zip(angles, factors, strict=True):
        told = told + a * cos(w) + b * sin(w)
    if not probe.zero(x - told, size):
        raise NotOfThisForm
    return k, factors
