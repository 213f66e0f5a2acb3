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
from collections.abc import Iterable, Sequence
from typing import Any

from ....graph.derivative import replaced, tangents
from ....graph.node import Node, Symbol
from ..definition import Definition
from ..probe import Probe
from .circle import NotOfThisForm, depends, holds
from .pairs import dyad, slide, sliding
from .single import Solution, divided, single

LARGEST = 60  # unknowns up to which formulas are looked for
ROUNDS = 4  # rules for each unknown: more lead nowhere
LONGEST = 20000  # expressions that the equations may be made of


class Pool:
    """Equations and unknowns that are left, and what has been found.

    Attributes
    ----------
    equations, unknowns, known : list of Node
    found : list of Definition
        In an order in which each stands on those before.
    later : list of Definition
        Found from the others; in an order in which each stands on those behind.
    """

    def __init__(
        self, equations: Sequence[Node], unknowns: Sequence[Node], known: Sequence[Node], probe: Probe
    ) -> None:
        self.equations, self.unknowns, self.probe = list(equations), list(unknowns), probe
        self.known = list(known)
        self.found: list[Definition] = []
        self.later: list[Definition] = []
        self.never: list[tuple[str, Any]] = []
        self._changes: dict[tuple[int, int], bool] = {}
        self._bent: dict[tuple[int, int, int], tuple[Any, bool]] = {}
        self._counted_before: set[str] = set()  # what is counted from where once is not counted back again
        self._slopes: dict[tuple[int, int], Any] = {}

    def run(self) -> None:
        """Apply rules until none fits."""
        rules = (self._follow_known, self._one, self._linear_in_two, self._linear, self._follow, self._pair)
        self._plain()
        for _ in range(ROUNDS * len(self.unknowns)):
            if not any(rule() for rule in rules):
                break
            self._plain()

    def held(self, x: Node) -> list[Node]:
        """Unknowns that an equation changes with."""
        return [w for w in self.unknowns if self._depends(x, w)]

    def _depends(self, x: Node, w: Node) -> bool:
        key = x.index, w.index
        if key not in self._changes:
            self._changes[key] = depends(x, w, self.probe)
        return self._changes[key]

    def _plain(self) -> None:
        """Take unknowns out of equations that do not change with them."""
        for k, x in enumerate(self.equations):
            none = [w for w in self.unknowns if holds(x, w) and not self._depends(x, w)]
            if none:
                self.equations[k] = x.graph.node(replaced([x], [(w, 0.0) for w in none])[0])

    def _slope(self, x: Node, w: Node) -> Any:
        """What stands before an unknown that stands linearly."""
        slope = self.probe.simplest(tangents([x], [(w, 1.0)])[0])
        return replaced([slope], [(y, 0.0) for y in self.unknowns])[0] if isinstance(slope, Node) else slope

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
            holding = [x for x in self.equations if self._depends(x, w)]
            if len(holding) != 2 or not all(self._linearly(x, w) for x in holding):
                continue
            slopes = [self._slope(x, w) for x in holding]
            if any(not getattr(d, "moving", False) for d in slopes):
                continue
            new, solution = slide((holding[0], holding[1]), slopes, w)
            self._put_off(w, solution)
            self.equations = [x for x in self.equations if x not in holding] + [w.graph.node(new)]
            return True
        return False

    def _linear(self) -> bool:
        """An unknown that stands linearly, with a factor that does not move rather than with one that does."""
        for moving in (False, True):
            for w, x in itertools.product(self.unknowns, self.equations):
                if not self._depends(x, w) or not self._linearly(x, w):
                    continue
                solution = divided(x, self._slope(x, w), w)
                if moving or not any(getattr(y, "moving", False) for y in solution.never):
                    self.equations.remove(x)
                    self._put_off(w, solution)
                    self.equations = [w.graph.node(y) for y in replaced(self.equations, [(w, solution.value)])]
                    return True
        return False

    def _linearly(self, x: Node, w: Node) -> bool:
        """Whether w stands linearly, with a factor that nothing unknown changes."""
        slope = tangents([x], [(w, 1.0)])[0]
        return not isinstance(slope, Node) or not any(self._depends(slope, y) for y in self.unknowns)

    def _follow(self) -> bool:
        """Angles that follow one another: E_vw = E_ww says that E knows w only in v + w."""
        return self._follows(itertools.permutations(self.unknowns, 2))

    def _follow_known(self) -> bool:
        """The same after a known angle: the sum is an angle from ground, which has the shorter formula."""
        return self._follows(itertools.product(reversed(self.known), self.unknowns))

    def _follows(self, pairs: Iterable[tuple[Node, Node]]) -> bool:
        for v, w in pairs:
            both = [x for x in self.equations if self._depends(x, v) and self._depends(x, w)]
            if not any(self._bends(x, v, w)[1] for x in both):
                continue
            for sign in (1.0, -1.0):
                if self._name(v, w, sign) not in self._counted_before and all(self._sums(x, v, w, sign) for x in both):
                    self._counted(v, w, sign)
                    return True
        return False

    def _bends(self, x: Node, v: Node, w: Node) -> tuple[Any, bool]:
        """Second derivative of an equation by two unknowns, and whether it is something."""
        a, b = (v, w) if v.index < w.index else (w, v)
        key = x.index, a.index, b.index
        if key not in self._bent:
            if (x.index, a.index) not in self._slopes:
                self._slopes[x.index, a.index] = tangents([x], [(a, 1.0)])[0]
            bend = tangents([self._slopes[x.index, a.index]], [(b, 1.0)])[0]
            self._bent[key] = bend, not self.probe.zero(bend, self.probe.size(x))
        return self._bent[key]

    def _sums(self, x: Node, v: Node, w: Node, sign: float) -> bool:
        return self.probe.zero(self._bends(x, v, w)[0] - sign * self._bends(x, w, w)[0], self.probe.size(x))

    @staticmethod
    def _name(v: Node, w: Node, sign: float) -> str:
        return f"({v.data.name} + {w.data.name})" if sign > 0 else f"({w.data.name} - {v.data.name})"

    def _counted(self, v: Node, w: Node, sign: float) -> None:
        """Put v + w (or w - v) in place of w."""
        g = w.graph
        name = self._name(v, w, sign)
        self._counted_before.add(name)
        both = g.symbol(Symbol(name, "dependent", name, "rad"))
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
            self.found.append(Definition((w,), (solution.value,), (), solution.how, solution.radius))
            self.never += [(w.data.name, y) for y in solution.never]
        self.equations = [x for x in self.equations if not any(x is y for y in equations)]
        self.unknowns = [w for w in self.unknowns if not any(w is y for y in unknowns)]
        self.known += unknowns

    def _put_off(self, w: Node, solution: Solution) -> None:
        self.later.append(Definition((w,), (solution.value,), (), solution.how))
        self.never += [(w.data.name, y) for y in solution.never]
        self.unknowns.remove(w)
