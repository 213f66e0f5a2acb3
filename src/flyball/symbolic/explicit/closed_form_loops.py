"""Kinematic loops solved in closed form, recognised by the form of their equations.

Rules are applied until no equation is left or no rule fits. No rule depends on the type of mechanism:

    one unknown in an equation                               solved (linear, a cosine and a sine, quadratic)
    an unknown that occurs linearly, with a known factor     substituted into the other equations
    a slide in two equations, along a known direction        eliminated from both
    angles that occur only as a sum                          measured from the first: e(v) e(w) = e(v + w)
    two equations of two angles, or of an angle and a slide  dyads (Assur groups of two links)

The dyads close in circles and straight lines (Artobolevsky 1951; Angeles and Bai 2022):

    RRR   p + P e(w) + N e(v) = 0         |p + P e(w)|^2 = |N|^2
    RPR   (s N + L) e(w) + k = 0          |s N + L|^2 = |k|^2

e(w) = (cos w, sin w). N, P, L rotate and scale (or reflect): their columns have equal length and are perpendicular. The
branch is that of the reference configuration. Angles are continued without jumps through the whole range of motion.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ...expression_graph.graph import (
    NUMBER,
    Graph,
    Node,
    Symbol,
    directional_derivatives,
    evaluate,
    nodes_in_order,
    substitute,
    symbols_of,
)
from ...math.scalar import atan2, cos, rounded, sin, sqrt
from .definitions import Definition, Probe

Affine = tuple[Any, list[tuple[Any, Any]]]
"""Constant, and the coefficients of cosine and sine of each angle."""


class FormMismatch(Exception):
    """An equation does not have the form that a rule solves."""


def at_zero(x: Node, w: Node) -> Any:
    """The expression with a symbol set to zero."""
    return substitute([x], [(w, 0.0)])[0]


def contains_symbol(x: Any, w: Node) -> bool:
    """Whether a symbol occurs in an expression."""
    return isinstance(x, Node) and any(s is w for s in symbols_of([x]))


def depends_on(x: Any, w: Node, probe: Probe) -> bool:
    """Whether the value of an expression depends on a symbol."""
    return contains_symbol(x, w) and not probe.zero(directional_derivatives([x], [(w, 1.0)])[0], probe.size(x))


def split_angles(x: Node, angles: Sequence[Node]) -> tuple[Node, list[tuple[Node, Node]]]:
    """Rewrite an expression in cosines and sines of single angles, with symbols for these; returns both.

    Raises
    ------
    FormMismatch
        If an angle occurs elsewhere.
    """
    g = x.graph
    atoms = [(_atom(g, "cos", w), _atom(g, "sin", w)) for w in angles]
    new = []
    for y in nodes_in_order([x]):
        if y.op in ("sin", "cos") and any(contains_symbol(y, w) for w in angles):
            c, s = _turned(y.args[0], angles, atoms)
            new.append((y, c if y.op == "cos" else s))
    (out,) = substitute([x], new)
    out = g.node(out)
    if any(contains_symbol(out, w) for w in angles):
        raise FormMismatch
    return out, atoms


def _atom(g: Graph, what: str, w: Node) -> Node:
    return g.symbol(Symbol(f"{what} {w.data.name}", "atom"))


def _turned(argument: Node, angles: Sequence[Node], atoms: list[tuple[Node, Node]]) -> tuple[Any, Any]:
    """Cosine and sine of a sum of unknown angles and known terms."""
    (rest,) = substitute([argument], [(w, 0.0) for w in angles])
    c, s = cos(rest), sin(rest)
    for w, (cw, sw) in zip(angles, atoms, strict=True):
        turn = directional_derivatives([argument], [(w, 1.0)])[0]
        turn = turn.value if isinstance(turn, Node) and turn.op == NUMBER else turn
        if isinstance(turn, Node) or turn not in (0.0, 1.0, -1.0):
            raise FormMismatch
        if turn:
            c, s = c * cw - turn * s * sw, s * cw + turn * c * sw
    return c, s


def harmonic_form(x: Node, angles: Sequence[Node], probe: Probe) -> Affine:
    """Coefficients of an equation of the form k + sum of a cos w + b sin w.

    Raises
    ------
    FormMismatch
        If it has another form.
    """
    form, atoms = split_angles(x, angles)

    def at(which: int, c: float, s: float) -> Any:
        values = [(c, s) if k == which else (1.0, 0.0) for k in range(len(angles))]
        pairs = [(n, y) for (a, b), (c, s) in zip(atoms, values, strict=True) for n, y in ((a, c), (b, s))]
        return substitute([form], pairs)[0]

    size = probe.size(x)
    k = at(-1, 1.0, 0.0)
    factors = []
    for n in range(len(angles)):
        there, back, up = at(n, 1.0, 0.0), at(n, -1.0, 0.0), at(n, 0.0, 1.0)
        a, middle = 0.5 * (there - back), 0.5 * (there + back)
        factors.append((probe.zero_if_negligible(a, size), probe.zero_if_negligible(up - middle, size)))
        k = k - factors[-1][0]
    k = probe.zero_if_negligible(k, size)
    told = k
    for w, (a, b) in zip(angles, factors, strict=True):
        told = told + a * cos(w) + b * sin(w)
    if not probe.zero(x - told, size):
        raise FormMismatch
    return k, factors


DEAD_CENTRE = 1e-9  # discriminant below this part of its cancelling terms: the branches meet


class SolvedUnknown:
    """A formula for an unknown.

    Attributes
    ----------
    value : Node
    how : str
        Form of the equation, and the branch.
    never : list of Node
        Expressions that must not vanish or become negative.
    radius : Node or number, optional
        sqrt(x^2 + y^2) of atan2(y, x), if known.
    """

    radius: Any = None

    def __init__(self, value: Any, how: str, never: list[Any] | None = None) -> None:
        self.value, self.how, self.never = value, how, never or []


def solve_single(x: Node, w: Node, probe: Probe) -> SolvedUnknown:
    """Solve one equation for its only unknown.

    Raises
    ------
    FormMismatch
        If there is no formula for it.
    """
    for rule in (linear_unknown, harmonic_unknown, quadratic_unknown):
        try:
            return rule(x, w, probe)
        except FormMismatch:
            pass
    raise FormMismatch


def linear_unknown(x: Node, w: Node, probe: Probe) -> SolvedUnknown:
    """Solve a w + b = 0."""
    slope = directional_derivatives([x], [(w, 1.0)])[0]
    if probe.zero(slope, probe.size(x)) or depends_on(slope, w, probe):
        raise FormMismatch
    return solve_linear(x, probe.simplest(at_zero(slope, w) if contains_symbol(slope, w) else slope), w)


def solve_linear(x: Node, slope: Any, w: Node) -> SolvedUnknown:
    """Solve a linear equation with the known slope a."""
    return SolvedUnknown(-at_zero(x, w) / slope, "linear", [slope] if isinstance(slope, Node) else [])


def harmonic_unknown(x: Node, w: Node, probe: Probe) -> SolvedUnknown:
    """Solve A cos w + B sin w + C = 0: w = atan2(B, A) + s atan2(sqrt(A^2 + B^2 - C^2), -C), s = 1 or -1."""
    k, ((a, b),) = harmonic_form(rationalised(x, w), [w], probe)
    return solve_harmonic((a, b, k), w, probe)


def solve_harmonic(abc: tuple[Any, Any, Any], w: Node, probe: Probe) -> SolvedUnknown:
    """Solve it from its coefficients."""
    A, B, C = abc
    if A == 0.0 and B == 0.0:
        raise FormMismatch
    drawn = probe.start[w.data.name]
    if C == 0.0:
        found = atan2(-1.0 * A, B)
        at = probe.at_start(found)
        opposite = math.cos(at - drawn) < 0.0
        value = atan2(A, -1.0 * B) if opposite else found
        return SolvedUnknown(value, "A cos w + B sin w = 0", [A * A + B * B])
    D = A * A + B * B - C * C
    if not probe.at_start(D) > DEAD_CENTRE * probe.at_start(C * C):
        raise FormMismatch
    far, turn = atan2(B, A), atan2(sqrt(D), -1.0 * C)
    plus = probe.at_start(far) + probe.at_start(turn) - drawn
    minus = probe.at_start(far) - probe.at_start(turn) - drawn
    sign = 1.0 if math.cos(plus) > math.cos(minus) else -1.0
    return SolvedUnknown(far + sign * turn, f"A cos w + B sin w + C = 0, branch {'+' if sign > 0 else '-'}", [D])


def quadratic_unknown(x: Node, w: Node, probe: Probe) -> SolvedUnknown:
    """Solve A w^2 + B w + C = 0 for a length w."""
    x = rationalised(x, w)
    slope = directional_derivatives([x], [(w, 1.0)])[0]
    bend = directional_derivatives([slope], [(w, 1.0)])[0]
    if probe.zero(bend) or depends_on(bend, w, probe):
        raise FormMismatch
    a = at_zero(bend, w) * 0.5 if isinstance(bend, Node) else 0.5 * bend
    return solve_quadratic((a, at_zero(slope, w), at_zero(x, w)), w, probe)


def solve_quadratic(abc: tuple[Any, Any, Any], w: Node, probe: Probe) -> SolvedUnknown:
    """Solve it from its coefficients."""
    a, b, c = (w.graph.node(y) for y in abc)
    if probe.zero(a):
        raise FormMismatch
    b = w.graph.node(probe.zero_if_negligible(b, probe.size(a)))
    D = 0.25 * b * b - a * c
    if not probe.at_start(D) > DEAD_CENTRE * abs(probe.at_start(a * c)):
        raise FormMismatch
    drawn = probe.start[w.data.name]
    values = [(-0.5 * b + sign * sqrt(D)) / a for sign in (1.0, -1.0)]
    away = [abs(probe.at_start(y) - drawn) for y in values]
    best = away.index(min(away))
    return SolvedUnknown(values[best], f"quadratic, branch {'+-'[best]}", [D])


def rationalised(x: Node, w: Node) -> Node:
    """Rewrite an equation sqrt(P) = R, with R independent of w, as P - R^2 = 0; others are returned unchanged."""
    terms = [x]
    inside: list[tuple[float, Node]] = []
    rest: Any = 0.0
    while terms:
        y = terms.pop()
        if not contains_symbol(y, w):
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


UnknownPair = tuple[Node, Node]
Matrix = np.ndarray


def eliminate_slide(x: UnknownPair, d: Sequence[Any], s: Node) -> tuple[Any, SolvedUnknown]:
    """Eliminate s from two equations p + d s = 0 with a known d.

    Returns
    -------
    (Node, Solution)
        d_2 p_1 - d_1 p_2 = 0; s = -(d . p) / (d . d).
    """
    p = [at_zero(e, s) for e in x]
    square = d[0] * d[0] + d[1] * d[1]
    return d[1] * p[0] - d[0] * p[1], SolvedUnknown(
        -(d[0] * p[0] + d[1] * p[1]) / square, "along a direction", [square] if isinstance(square, Node) else []
    )


def rrr_dyad(x: UnknownPair, w: tuple[Node, Node], probe: Probe) -> list[SolvedUnknown]:
    """Solve two equations for two angles (RRR dyad).

    Returns
    -------
    list of Solution
        For the first angle, and for the second, which depends on the first.
    """
    read = [harmonic_form(e, w, probe) for e in x]
    p = np.array([k for k, _ in read], object)
    P, N = (np.array([factors[n] for _, factors in read], object) for n in range(2))
    square, reach = _turning(N, probe), _turning(P, probe)
    if square == 0.0 or reach == 0.0:
        raise FormMismatch
    A, B = (2.0 * (P[0, n] * p[0] + P[1, n] * p[1]) for n in range(2))
    C = p[0] * p[0] + p[1] * p[1] + reach - square
    first = solve_harmonic((A, B, C), w[0], probe)
    first.how = f"dyad of two turning links: {first.how}"
    c, s = cos(w[0]), sin(w[0])
    r = [p[n] + P[n, 0] * c + P[n, 1] * s for n in range(2)]
    e = [-1.0 * (N[0, n] * r[0] + N[1, n] * r[1]) for n in range(2)]
    second = SolvedUnknown(atan2(e[1], e[0]), "direction of the other link")
    second.radius = square  # |e| = |N| |r|, and |r| = |N|
    return [first, second]


def rpr_dyad(x: UnknownPair, w: tuple[Node, Node], probe: Probe) -> list[SolvedUnknown]:
    """Solve two equations for an angle w[0] and a slide w[1] on the link that turns by it (RPR dyad).

    Returns
    -------
    list of Solution
        For the slide, then for the angle.
    """
    angle, s = w
    slopes = [directional_derivatives([e], [(s, 1.0)])[0] for e in x]
    if any(depends_on(d, s, probe) for d in slopes):
        raise FormMismatch
    along = [harmonic_form(at_zero(x[0].graph.node(d), s), [angle], probe) for d in slopes]
    still = [harmonic_form(at_zero(e, s), [angle], probe) for e in x]
    if any(not probe.zero(k, probe.size(e)) for (k, _), e in zip(along, x, strict=True)):
        raise FormMismatch
    N, L = (np.array([factors[0] for _, factors in read], object) for read in (along, still))
    k = [k for k, _ in still]
    nn, ll, mixed = _turning(N, probe), _turning(L, probe), _mixed(N, L, probe)
    if nn == 0.0:
        raise FormMismatch
    reach = k[0] * k[0] + k[1] * k[1]
    first = solve_quadratic((nn, 2.0 * mixed, ll - reach), s, probe)
    first.how = f"slide on a turning link: {first.how}"
    T = s * N + L
    e = [-1.0 * (T[0, n] * k[0] + T[1, n] * k[1]) for n in range(2)]
    second = SolvedUnknown(atan2(e[1], e[0]), "direction of the slide")
    second.radius = reach  # |e| = |T| |k|, and |T| = |k|
    return [first, second]


def _turning(N: Matrix, probe: Probe) -> Any:
    """Squared scale factor of N, which must be a rotation or reflection times a factor."""
    a, b = N[0, 0] * N[0, 0] + N[1, 0] * N[1, 0], N[0, 1] * N[0, 1] + N[1, 1] * N[1, 1]
    if not probe.same(a, b, probe.size(a)) or not probe.zero(N[0, 0] * N[0, 1] + N[1, 0] * N[1, 1], probe.size(a)):
        raise FormMismatch
    return min(a, b, key=lambda y: y.index if isinstance(y, Node) else -1)


def _mixed(N: Matrix, L: Matrix, probe: Probe) -> Any:
    """Half of N^T L + L^T N, which must be a multiple of the identity."""
    a, b = (N[0, n] * L[0, n] + N[1, n] * L[1, n] for n in range(2))
    across = N[0, 0] * L[0, 1] + N[1, 0] * L[1, 1] + L[0, 0] * N[0, 1] + L[1, 0] * N[1, 1]
    size = max(probe.size(a), probe.size(b))
    if not probe.same(a, b, size) or not probe.zero(across, size):
        raise FormMismatch
    return a


MAX_UNKNOWNS = 60  # largest number of unknowns for which formulas are searched
MAX_ROUNDS = 4  # rule applications per unknown
MAX_OPERATIONS = 20000  # largest number of expressions in the equations


class LoopSolver:
    """Solver that applies the rules: remaining equations and unknowns, and the definitions found.

    Attributes
    ----------
    equations, unknowns, known : list of Node
    found : list of Definition
        Definitions in an order in which each depends on earlier ones only.
    later : list of Definition
        Definitions computed from the others; each depends on later ones only.
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
        # sums already substituted, so that a substitution is not reversed
        self._substituted_sums: set[str] = set()
        self._slopes: dict[tuple[int, int], Any] = {}

    def run(self) -> None:
        """Apply rules until none fits."""
        rules = (self._follow_known, self._one, self._linear_in_two, self._linear, self._combine_angles, self._pair)
        self._remove_absent_unknowns()
        for _ in range(MAX_ROUNDS * len(self.unknowns)):
            if not any(rule() for rule in rules):
                break
            self._remove_absent_unknowns()

    def held(self, x: Node) -> list[Node]:
        """Unknowns that an equation depends on."""
        return [w for w in self.unknowns if self._depends(x, w)]

    def _depends(self, x: Node, w: Node) -> bool:
        key = x.index, w.index
        if key not in self._changes:
            self._changes[key] = depends_on(x, w, self.probe)
        return self._changes[key]

    def _remove_absent_unknowns(self) -> None:
        """Remove unknowns from equations that do not depend on them."""
        for k, x in enumerate(self.equations):
            none = [w for w in self.unknowns if contains_symbol(x, w) and not self._depends(x, w)]
            if none:
                self.equations[k] = x.graph.node(substitute([x], [(w, 0.0) for w in none])[0])

    def _slope(self, x: Node, w: Node) -> Any:
        """Coefficient of an unknown that occurs linearly."""
        slope = self.probe.simplest(directional_derivatives([x], [(w, 1.0)])[0])
        return substitute([slope], [(y, 0.0) for y in self.unknowns])[0] if isinstance(slope, Node) else slope

    # -- rules: each returns whether it changed something

    def _one(self) -> bool:
        for x in self.equations:
            held = self.held(x)
            if len(held) == 1:
                try:
                    self._solved([x], held, [solve_single(x, held[0], self.probe)])
                except FormMismatch:
                    continue
                return True
        return False

    def _linear_in_two(self) -> bool:
        """Solve for a slide along a known moving direction from two equations; one alone may be singular."""
        for w in self.unknowns:
            holding = [x for x in self.equations if self._depends(x, w)]
            if len(holding) != 2 or not all(self._linearly(x, w) for x in holding):
                continue
            slopes = [self._slope(x, w) for x in holding]
            if any(not getattr(d, "moving", False) for d in slopes):
                continue
            new, solution = eliminate_slide((holding[0], holding[1]), slopes, w)
            self._postpone(w, solution)
            self.equations = [x for x in self.equations if x not in holding] + [w.graph.node(new)]
            return True
        return False

    def _linear(self) -> bool:
        """Solve for an unknown that occurs linearly, preferably with a constant coefficient."""
        for moving in (False, True):
            for w, x in itertools.product(self.unknowns, self.equations):
                if not self._depends(x, w) or not self._linearly(x, w):
                    continue
                solution = solve_linear(x, self._slope(x, w), w)
                if moving or not any(getattr(y, "moving", False) for y in solution.never):
                    self.equations.remove(x)
                    self._postpone(w, solution)
                    self.equations = [w.graph.node(y) for y in substitute(self.equations, [(w, solution.value)])]
                    return True
        return False

    def _linearly(self, x: Node, w: Node) -> bool:
        """Whether w occurs linearly, with a coefficient that does not depend on unknowns."""
        slope = directional_derivatives([x], [(w, 1.0)])[0]
        return not isinstance(slope, Node) or not any(self._depends(slope, y) for y in self.unknowns)

    def _combine_angles(self) -> bool:
        """Combine successive angles: if E_vw = E_ww, the equation E depends on w only through v + w."""
        return self._follows(itertools.permutations(self.unknowns, 2))

    def _follow_known(self) -> bool:
        """Combine an angle with a known one: the sum is an angle from ground, with a shorter formula."""
        return self._follows(itertools.product(reversed(self.known), self.unknowns))

    def _follows(self, pairs: Iterable[tuple[Node, Node]]) -> bool:
        for v, w in pairs:
            both = [x for x in self.equations if self._depends(x, v) and self._depends(x, w)]
            if not any(self._bends(x, v, w)[1] for x in both):
                continue
            for sign in (1.0, -1.0):
                if self._name(v, w, sign) not in self._substituted_sums and all(
                    self._sums(x, v, w, sign) for x in both
                ):
                    self._substitute_sum(v, w, sign)
                    return True
        return False

    def _bends(self, x: Node, v: Node, w: Node) -> tuple[Any, bool]:
        """Second derivative of an equation by two unknowns, and whether it is nonzero."""
        a, b = (v, w) if v.index < w.index else (w, v)
        key = x.index, a.index, b.index
        if key not in self._bent:
            if (x.index, a.index) not in self._slopes:
                self._slopes[x.index, a.index] = directional_derivatives([x], [(a, 1.0)])[0]
            bend = directional_derivatives([self._slopes[x.index, a.index]], [(b, 1.0)])[0]
            self._bent[key] = bend, not self.probe.zero(bend, self.probe.size(x))
        return self._bent[key]

    def _sums(self, x: Node, v: Node, w: Node, sign: float) -> bool:
        return self.probe.zero(self._bends(x, v, w)[0] - sign * self._bends(x, w, w)[0], self.probe.size(x))

    @staticmethod
    def _name(v: Node, w: Node, sign: float) -> str:
        return f"({v.data.name} + {w.data.name})" if sign > 0 else f"({w.data.name} - {v.data.name})"

    def _substitute_sum(self, v: Node, w: Node, sign: float) -> None:
        """Substitute v + w (or w - v) for w."""
        g = w.graph
        name = self._name(v, w, sign)
        self._substituted_sums.add(name)
        both = g.symbol(Symbol(name, "dependent", name, "rad"))
        start = self.probe.start
        self.probe.set_initial(both.data.name, start[w.data.name] + sign * start[v.data.name])
        self.unknowns[self.unknowns.index(w)] = both
        value = both - sign * v
        self.later.append(Definition((w,), (value,), (), "counted from the link before"))
        self.equations = [g.node(y) for y in substitute(self.equations, [(w, value)])]

    def _pair(self) -> bool:
        groups: dict[tuple[Node, ...], list[Node]] = {}
        for x in self.equations:
            groups.setdefault(tuple(self.held(x)), []).append(x)
        for held, equations in groups.items():
            if len(held) != 2 or len(equations) != 2:
                continue
            both = equations[0], equations[1]
            for rule, (v, w) in itertools.product((rrr_dyad, rpr_dyad), itertools.permutations(held)):
                try:
                    solutions = rule(both, (v, w), self.probe)
                except FormMismatch:
                    continue
                self._solved(equations, [v, w] if rule is rrr_dyad else [w, v], solutions)
                return True
        return False

    def _solved(self, equations: Sequence[Node], unknowns: Sequence[Node], solutions: Sequence[SolvedUnknown]) -> None:
        for w, solution in zip(unknowns, solutions, strict=True):
            self.found.append(Definition((w,), (solution.value,), (), solution.how, solution.radius))
            self.never += [(w.data.name, y) for y in solution.never]
        self.equations = [x for x in self.equations if not any(x is y for y in equations)]
        self.unknowns = [w for w in self.unknowns if not any(w is y for y in unknowns)]
        self.known += unknowns

    def _postpone(self, w: Node, solution: SolvedUnknown) -> None:
        self.later.append(Definition((w,), (solution.value,), (), solution.how))
        self.never += [(w.data.name, y) for y in solution.never]
        self.unknowns.remove(w)


SAMPLE_COUNT = 1441  # on two revolutions
# Largest deviation of an angle from its mean, apart from its revolutions, that counts as continuous.
MAX_JUMP = 0.98 * math.pi
FULL_TURN = 2.0 * math.pi


def follow_whole_turns(
    definitions: Sequence[Definition], known: Sequence[Node], start: Mapping[str, float]
) -> list[Definition]:
    """Add whole turns to formulas of angles that jump.

    Parameters
    ----------
    definitions : sequence of Definition
        Definitions in an order of evaluation.
    known : sequence of Node
        Given coordinates.
    start : mapping
        Values of all symbols in the reference configuration.
    """
    values: dict[str, Any] = dict(start)
    if len(known) == 1:
        way = np.linspace(-FULL_TURN, FULL_TURN, SAMPLE_COUNT)
        values[known[0].data.name] = start[known[0].data.name] + way
    else:
        rng = np.random.default_rng(2)
        way = rng.uniform(-math.pi, math.pi, SAMPLE_COUNT)
        for x in known:
            values[x.data.name] = start[x.data.name] + rng.uniform(-math.pi, math.pi, SAMPLE_COUNT)
    out: list[Definition] = []
    for d in definitions:
        if not d.closed:
            # Definitions that depend on implicit ones are not processed.
            return [*out, *definitions[len(out) :]]
        new = []
        for w, y in zip(d.symbols, d.values, strict=True):
            with np.errstate(all="ignore"):
                found = np.broadcast_to(np.asarray(evaluate([y], values)[0], float), len(way))
            if _is_angle(y):
                y, found = _followed_angle((w, y, found), known, way, start)
            if w not in known:
                values[w.data.name] = found
            new.append(y)
        out.append(replace(d, values=tuple(new)))
    return out


def _is_angle(y: Any) -> bool:
    """Whether a formula is a sum with an arctangent."""
    if not isinstance(y, Node):
        return False
    return y.op == "atan2" or (y.op in ("add", "multiply") and any(_is_angle(z) for z in y.args))


def _followed_angle(
    what: tuple[Node, Any, np.ndarray], known: Sequence[Node], way: np.ndarray, start: Mapping[str, float]
) -> tuple[Any, np.ndarray]:
    """The formula with whole turns added where needed, and its values."""
    w, y, found = what
    drawn = start[w.data.name]
    if len(known) != 1:
        if not np.nanmax(np.abs(found - drawn), initial=0.0) > math.pi:
            return y, found
        return y + FULL_TURN * rounded((drawn - y) / FULL_TURN), found + FULL_TURN * np.round(
            (drawn - found) / FULL_TURN
        )
    u = known[0]
    first, last = _range(found)
    there = found[first:last]
    if not np.abs(np.diff(there)).max(initial=0.0) > math.pi:
        return y, found
    smooth = np.unwrap(there)
    middle = len(way) // 2
    smooth += drawn - smooth[middle - first]
    half = (len(way) - 1) // 2
    turns = round((smooth[half] - smooth[0]) / FULL_TURN) if last - first == len(way) else 0
    beside = smooth - turns * way[first:last]
    centre = 0.5 * (beside.max() + beside.min())
    if beside.max() - centre > MAX_JUMP:
        return y, found
    near = turns * (u - start[u.data.name]) + centre if turns else centre
    out = found.copy()
    out[first:last] = smooth
    return y + FULL_TURN * rounded((near - y) / FULL_TURN), out


def _range(found: np.ndarray) -> tuple[int, int]:
    """Range around the middle in which the mechanism can be assembled."""
    middle = len(found) // 2
    gone = np.flatnonzero(~np.isfinite(found))
    before, behind = gone[gone < middle], gone[gone > middle]
    return (int(before[-1]) + 1 if len(before) else 0), (int(behind[0]) if len(behind) else len(found))
