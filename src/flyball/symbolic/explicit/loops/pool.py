"""Equations with unknowns, taken apart by rules until nothing is left, or no rule fits.

    one unknown in an equation                               solved (`single`)
    an unknown that stands linearly, by what is known        put into the other equations, found afterwards
    a slide in two equations, along a known direction        taken out of both (`pairs.slide`)
    angles that follow one another                           counted from the first: e(v) e(w) = e(v + w)
    two equations of two angles, or of an angle and a slide  dyads (`pairs`)

Nothing asks which mechanism it is.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import Any

from ....graph.derivative import replaced, tangents
from ....graph.node import Node, Symbol
from ..definition import Definition
from ..probe import Probe
from .circle import NotOfThisForm, depends, holds
from .pairs import dyad, slide, sliding
from .single import Solution, linear, single

LARGEST = 60  # unknowns up to which formulas are looked for
LONGEST = 20000  # expressions that the equations may be made of


class Pool:
    """Equations and unknowns that are left, and what has been found.

    Attributes
    ----------
    equations, unknowns : list of Node
    found : list of Definition
        In an order in which each stands on those before.
    later : list of Definition
        Found from the others; in an order in which each stands on those behind.
    """

    def __init__(self, equations: Sequence[Node], unknowns: Sequence[Node], probe: Probe) -> None:
        self.equations, self.unknowns, self.probe = list(equations), list(unknowns), probe
        self.found: list[Definition] = []
        self.later: list[Definition] = []
        self.never: list[tuple[str, Any]] = []

    def run(self) -> None:
        """Apply rules until none fits."""
        rules = (self._one, self._linear_in_two, self._linear, self._follow, self._pair)
        while self.unknowns and any(rule() for rule in rules):
            pass

    def held(self, x: Node) -> list[Node]:
        """Unknowns that an equation changes with."""
        return [w for w in self.unknowns if depends(x, w, self.probe)]

    # -- rules: each says whether it did something

    def _one(self) -> bool:
        for x in self.equations:
            held = self.held(x)
            if len(held) == 1:
                try:
                    self._solved([x], held, [single(x, held[0], self.probe)])
                except NotOfThisForm:
                    continue
                return True
        return False

    def _linear_in_two(self) -> bool:
        """A slide along a direction that is known but moves: each of two equations alone may fail to tell it."""
        for w in self.unknowns:
            holding = [x for x in self.equations if depends(x, w, self.probe)]
            if len(holding) != 2 or not all(self._linearly(x, w) for x in holding):
                continue
            slopes = [self.probe.simplest(tangents([x], [(w, 1.0)])[0]) for x in holding]
            if any(not getattr(d, "moving", False) for d in slopes):
                continue
            new, solution = slide((holding[0], holding[1]), w, self.probe)
            self._put_off(w, solution)
            self.equations = [x for x in self.equations if x not in holding] + [w.graph.node(new)]
            return True
        return False

    def _linear(self) -> bool:
        """An unknown that stands linearly, with a factor that does not move rather than with one that does."""
        for moving in (False, True):
            for w, x in itertools.product(self.unknowns, self.equations):
                if not depends(x, w, self.probe) or not self._linearly(x, w):
                    continue
                solution = linear(x, w, self.probe)
                if moving or not any(getattr(y, "moving", False) for y in solution.never):
                    self.equations.remove(x)
                    self._put_off(w, solution)
                    self.equations = [w.graph.node(y) for y in replaced(self.equations, [(w, solution.value)])]
                    return True
        return False

    def _linearly(self, x: Node, w: Node) -> bool:
        """Whether w stands linearly, with a factor that nothing unknown changes."""
        slope = tangents([x], [(w, 1.0)])[0]
        return not isinstance(slope, Node) or not any(depends(slope, y, self.probe) for y in self.unknowns)

    def _follow(self) -> bool:
        """Angles that follow one another: E_vw = E_ww says that E knows w only in v + w."""
        for v, w in itertools.permutations(self.unknowns, 2):
            both = [x for x in self.equations if holds(x, v) and holds(x, w)]
            bent = [self._bends(x, v, w) for x in both]
            if not any(cross for _, cross, _ in bent):
                continue
            for sign in (1.0, -1.0):
                if all(self.probe.zero(vw - sign * ww, size) for size, _, (vw, ww) in bent):
                    self._counted(v, w, sign)
                    return True
        return False

    def _bends(self, x: Node, v: Node, w: Node) -> tuple[float, bool, tuple[Any, Any]]:
        (by_w,) = tangents([x], [(w, 1.0)])
        vw, ww = (tangents([by_w], [(y, 1.0)])[0] for y in (v, w))
        size = self.probe.size(x)
        return size, not self.probe.zero(vw, size), (vw, ww)

    def _counted(self, v: Node, w: Node, sign: float) -> None:
        """Put v + w (or w - v) in place of w."""
        g = w.graph
        name = f"{v.data.name} + {w.data.name}" if sign > 0 else f"{w.data.name} - {v.data.name}"
        both = g.symbol(Symbol(f"({name})", "dependent", f"({name})", "rad"))
        start = self.probe.start
        self.probe.know(both.data.name, start[w.data.name] + sign * start[v.data.name])
        self.unknowns[self.unknowns.index(w)] = both
        value = both - sign * v
        self.later.append(Definition((w,), (value,), (), "counted from the link before"))
        self.equations = [g.node(y) for y in replaced(self.equations, [(w, value)])]

    def _pair(self) -> bool:
        groups: dict[tuple[Node, ...], list[Node]] = {}
        for x in self.equations:
            groups.setdefault(tuple(self.held(x)), []).append(x)
        for held, equations in groups.items():
            if len(held) != 2 or len(equations) != 2:
                continue
            both = equations[0], equations[1]
            for rule, (v, w) in itertools.product((dyad, sliding), itertools.permutations(held)):
                try:
                    solutions = rule(both, (v, w), self.probe)
                except NotOfThisForm:
                    continue
                self._solved(equations, [v, w] if rule is dyad else [w, v], solutions)
                return True
        return False

    def _solved(self, equations: Sequence[Node], unknowns: Sequence[Node], solutions: Sequence[Solution]) -> None:
        for w, solution in zip(unknowns, solutions, strict=True):
            self.found.append(Definition((w,), (solution.value,), (), solution.how))
            self.never += [(w.data.name, y) for y in solution.never]
        self.equations = [x for x in self.equations if not any(x is y for y in equations)]
        self.unknowns = [w for w in self.unknowns if not any(w is y for y in unknowns)]

    def _put_off(self, w: Node, solution: Solution) -> None:
        self.later.append(Definition((w,), (solution.value,), (), solution.how))
        self.never += [(w.data.name, y) for y in solution.never]
        self.unknowns.remove(w)
