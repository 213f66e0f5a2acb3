"""Angles as a reader writes them: without the bookkeeping of whole turns that numbers need.

The engine measures an angle by atan2 and adds the whole turns that bring it next to a remembered one. Of the remembered
angles most are known in closed form: where an angle is a coordinate, and in the plane, where it is a difference of the
bodies' angles. What the whole turns make of an arc tangent is then that form itself. The others, angles in space that
are no coordinates, become the arc tangent, in (-pi, pi].
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from ..equations.tree import column
from ..graph.node import Graph, Node
from ..graph.operations import ADD, MULTIPLY, NUMBER
from ..graph.values import reached
from ..math.scalar import atan2
from ..model.body import Body, Frame
from ..model.joint import Joint
from ..tables.forest import step_of
from ..tables.system import System
from ..tables.values import Values

TURN = 2.0 * math.pi


def counted(x: Values, S: System) -> tuple[System, list[int]]:
    """The tables with every angle counted, those of drivers too, and no row compared modulo a turn.

    Returns
    -------
    System, list of int
        For each state added behind the structure's own: the term that leans on it.
    """
    s = x.structure
    hint, parameters = S.terms.hint.copy(), S.term_parameters.copy()
    more: list[int] = []
    for k, t in enumerate(s.terms):
        if t.formula.of_kind.turns and hint[k] < 0:
            hint[k] = len(s.states) + len(more)
            parameters[k, 0] = 1.0
            more.append(k)
    rows = S.rows._replace(wrapped=np.zeros_like(S.rows.wrapped))
    return S._replace(rows=rows, terms=S.terms._replace(hint=hint), term_parameters=parameters), more


class Angles:
    """Closed forms of measured angles, in the coordinates q (engine's own, as expressions)."""

    def __init__(self, x: Values, q: Sequence[Any], W: Any) -> None:
        self.x, self.q = x, q
        self._since = self._turned(W) if x.structure.model.planar else {}

    def of(self, owner: Any, what: str, F: int, M: int) -> Any:
        """The angle of frame M to frame F that a term of that owner measures; None if it has no closed form."""
        s, S = self.x.structure, self.x.system
        if isinstance(owner, Joint):
            row = step_of(s, owner.name, what)
            if row is not None:
                return owner.coordinates[what].sign * self.q[S.tree.q[row]]
        if not s.model.planar:
            return None
        here, there = (self._heading(k) + self._since[int(S.frame_body[k])] for k in (F, M))
        if isinstance(owner, Body | Frame):
            return there
        drawn_here, drawn_there = (self._heading(k) + self._drawn(int(S.frame_body[k])) for k in (F, M))
        whole = math.floor((_real(drawn_there) - _real(drawn_here)) / TURN + 0.5)
        return there - here - TURN * whole

    def _turned(self, W: Any) -> dict[int, Any]:
        """Angle of every body of a planar mechanism: where it is drawn, and what coordinates have turned it since."""
        S, x = self.x.system, self.x
        since: list[Any] = []
        for b in range(len(S.tree.parent)):
            total = since[S.tree.parent[b]] if S.tree.parent[b] >= 0 else 0.0
            for i in range(S.tree.nv[b]):
                at = S.tree.q[b] + i
                total = total + column(S, W, b, i)[0][2] * (self.q[at] - x.q[at])
            since.append(total)
        out: dict[int, Any] = {-1: 0.0}
        for name, b in x.structure.place.items():
            if b >= 0:
                out[b] = x.bodies[name].angle + since[b]
        return out

    def _drawn(self, b: int) -> Any:
        names = {at: name for name, at in self.x.structure.place.items()}
        return 0.0 if b < 0 else self.x.bodies[names[b]].angle

    def _heading(self, frame: int) -> Any:
        """The way that a frame's x axis points in its body."""
        R = self.x.system.frames.rotation[frame]
        return atan2(R[3], R[0])


def _real(x: Any) -> float:
    return float(x.real)


class Cleaned:
    """Expressions without the counting of turns, and with other nodes in place of some.

    Parameters
    ----------
    graph : Graph
    new : mapping from nodes to what stands in their place
    unknown : nodes of remembered angles that have no closed form
    """

    def __init__(self, graph: Graph, new: Sequence[tuple[Node, Any]], unknown: Sequence[Node]) -> None:
        self.graph = graph
        self._known: dict[int, Node] = {x.index: graph.node(y) for x, y in new}
        self._unknown = {x.index for x in unknown}

    def __call__(self, array: np.ndarray) -> np.ndarray:
        """The same array, cleaned."""
        out = np.empty(array.shape, object)
        flat = array.ravel().tolist()
        for x in reached(flat):
            if x.index not in self._known:
                self._known[x.index] = self._made(x)
        out.ravel()[:] = [self._known[x.index] if isinstance(x, Node) else x for x in flat]
        return out

    def _made(self, x: Node) -> Node:
        args = tuple(self._known[a.index] for a in x.args)
        if x.op == "rounded" and not x.moving:  # whole turns as drawn
            return self.graph.number(x.value)
        if x.op == ADD:
            found = _unwrapped(*args) or _unwrapped(args[1], args[0])
            if found is not None:
                theta, near = found
                lost = any(s.index in self._unknown for s in reached([near]))
                return theta if lost else near
        return x if all(a is b for a, b in zip(args, x.args, strict=True)) else self.graph.rebuilt(x, args)


def _unwrapped(theta: Node, turns: Node) -> tuple[Node, Node] | None:
    """Of theta + 2 pi rounded((near - theta) / 2 pi): theta and near."""
    factor, inner = _factored(turns)
    if inner.op != "rounded" or abs(factor - TURN) > 1e-12:
        return None
    share, way = _factored(inner.args[0])
    if abs(share * TURN - 1.0) < 1e-12:
        if way.op != ADD:
            return None
        for near, other in (way.args, way.args[::-1]):
            if other is -theta:
                return theta, near
    if abs(share * TURN + 1.0) < 1e-12 and way is theta:
        return theta, theta.graph.number(0.0)
    return None


def _factored(x: Node) -> tuple[float, Node]:
    if x.op == MULTIPLY and x.args[0].op == NUMBER:
        return x.args[0].value, x.args[1]
    return 1.0, x
