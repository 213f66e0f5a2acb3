"""Dependent coordinates from the constraints on positions: by formulas where there are some, else by equations."""

from __future__ import annotations

from ...graph.derivative import jacobian
from ...tracing.trace import Traced
from .blocks import blocks
from .constraints import Constraints
from .definition import Definition
from .partition import positions
from .place import Place
from .solve import pattern


def solved_positions(x: Traced, place: Place, c: Constraints, what: tuple[list[int], list[int]]) -> list[Definition]:
    """Definitions of dependent coordinates, in an order in which each stands on those before.

    Parameters
    ----------
    x : Traced
    place : Place
    c : Constraints
    what : (list of int, list of int)
        Constraints, and the coordinates q that they determine; what makes quaternions units is added.
    """
    rows, unknown = what
    g = [x.graph.node(y) for y in c.g[rows]]
    for q, v in positions(x.structure):
        if len(q) > len(v) and q[0] in unknown:
            g.append(x.graph.node(sum((x.q[k] * x.q[k] for k in q), -1.0)))
    symbols = [x.q[k] for k in unknown]
    J = place.probe.cleaned(jacobian(g, symbols))
    out = []
    order = blocks(pattern(J))
    for equations, columns in [(list(range(len(g))), list(range(len(g))))] if order is None else order:
        out.append(Definition(tuple(symbols[k] for k in columns), (), tuple(g[k] for k in equations)))
    return out
