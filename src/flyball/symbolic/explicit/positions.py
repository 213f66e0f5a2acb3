"""Dependent coordinates from the constraints on positions: by formulas where there are some, else by equations."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from ...graph.derivative import jacobian
from ...graph.node import Node
from ...graph.values import evaluate, reached, symbols
from ...tracing.trace import Traced
from .blocks import blocks
from .definition import Definition, Formulas
from .loops.pool import LARGEST, LONGEST, Pool
from .loops.turns import continued
from .partition import positions
from .place import Place
from .probe import Probe
from .solve import pattern

AGREES = 1e-9  # part of what is added up in an equation, by which formulas may miss it
AWAY = 0.02  # part of a radian or metre by which that is tried
TRIALS = 6


@dataclass
class Solved:
    """Dependent coordinates.

    Attributes
    ----------
    definitions : list of Definition
        In an order in which each stands on those before.
    never : list of (name, Node)
        What must not vanish, or become negative, for a formula to hold.
    notes : list of str
        Why there are coordinates without formulas, in words.
    """

    definitions: list[Definition]
    never: list[tuple[str, Any]] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)


def solved_positions(
    x: Traced, place: Place, what: tuple[list[int], list[int]], places: Sequence[tuple[Node, Any]] = ()
) -> Solved:
    """Definitions of dependent coordinates.

    Parameters
    ----------
    x : Traced
    place : Place
    what : (list of int, list of int)
        Constraints, and the coordinates q that they determine; what makes quaternions units is added.
    places : sequence of (Node, Node)
        Places on curves, and what vanishes there.
    """
    (rows, unknown), c = what, place.c
    g = [x.graph.node(y) for y in c.g[rows]]
    for q, v in positions(x.structure):
        if len(q) > len(v) and q[0] in unknown:
            g.append(x.graph.node(sum((x.q[k] * x.q[k] for k in q), -1.0)))
    w = [*(x.q[k] for k in unknown), *(s for s, _ in places)]
    g += [x.graph.node(y) for _, y in places]
    elements = [c.elements[k] for k in rows]
    count = len(reached(g))
    if len(w) > LARGEST or count > LONGEST:
        note = f"{len(w)} dependent coordinates in equations of {count} expressions: too many to look for formulas"
        note += f" (up to {LARGEST} in {LONGEST})"
        return Solved(_implicit(g, w, place.probe), [], [note] if w else [])
    pool = Pool(g, w, [s for k, s in enumerate(x.q) if k not in unknown], Probe(place.values))
    pool.run()
    left = _implicit(pool.equations, pool.unknowns, pool.probe)
    order = [*pool.found, *left, *reversed(pool.later)]
    turned = [_drawn(d, pool.probe) for d in order]
    if None in turned or not _agree(g, [d for d in turned if d is not None], place):
        note = "formulas were found that do not hold: please report this mechanism"
        return Solved(_implicit(g, w, place.probe), [], [note])
    known = _given(x, unknown)
    done = continued([d for d in turned if d is not None], known, pool.probe.start)
    return Solved(done, pool.never, [_why(d, elements) for d in left])


def _given(x: Traced, unknown: Sequence[int]) -> list[Node]:
    """Coordinates that are not asked for; where drivers move all, the coordinate that a driver gives."""
    known = [s for k, s in enumerate(x.q) if k not in unknown]
    return known or [x.q[x.system.tree.q[b]] for b in x.structure.prescribed.values()]


def _implicit(g: Sequence[Node], w: Sequence[Node], probe: Probe) -> list[Definition]:
    """Blocks that Newton's method solves."""
    J = probe.cleaned(jacobian(g, w))
    order = blocks(pattern(J)) if len(w) else []
    if order is None:
        order = [(list(range(len(g))), list(range(len(w))))]
    return [Definition(tuple(w[k] for k in b), (), tuple(g[k] for k in a)) for a, b in order]


def _why(d: Definition, elements: Sequence[str]) -> str:
    n = len(d.symbols)
    of = ", ".join(dict.fromkeys(elements))
    if n == 1:
        return f"{d.names[0]}: no formula for its equation of {of}; Newton's method solves it"
    return f"{', '.join(d.names)}: no formulas, {n} equations of {of} hold them together; Newton's method solves them"


def _drawn(d: Definition, probe: Probe) -> Definition | None:
    """The same with the whole turns that the drawn position has; None if the formula is not true there."""
    values = []
    for w, y in zip(d.symbols, d.values, strict=False):
        missing = probe.start[w.data.name] - probe.at_start(y)
        turns = round(missing / (2.0 * math.pi))
        if not abs(missing - 2.0 * math.pi * turns) <= 1e-7 * (1.0 + abs(missing)):
            return None
        values.append(y + 2.0 * math.pi * turns if turns else y)
    return replace(d, values=tuple(values))


def _agree(g: Sequence[Node], definitions: Sequence[Definition], place: Place) -> bool:
    """Whether formulas fulfil the equations at random positions near the drawn one."""
    others = {w.data.name for d in definitions if not d.closed for w in d.symbols}
    if others:  # where equations are left, these are tested by themselves
        return True
    if not definitions:
        return True
    nodes = Formulas(definitions)(g)
    rng = np.random.default_rng(1)
    values: dict[str, Any] = dict(place.values)
    for s in symbols(nodes):
        if s.moving:
            name = s.data.name
            values[name] = values.get(name, 0.0) + AWAY * rng.uniform(-1.0, 1.0, TRIALS)
    with np.errstate(all="ignore"):
        found = np.array([np.broadcast_to(y, TRIALS) for y in evaluate(nodes, values)], float)
    there = np.isfinite(found).all(axis=0)
    return bool(there.any() and np.abs(found[:, there]).max(initial=0.0) <= AGREES * max(1.0, place.length))
