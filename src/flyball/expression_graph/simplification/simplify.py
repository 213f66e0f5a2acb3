"""The shortest equivalent expression, found by expansion into sums of terms; symbols for common subexpressions.

Symbols also stand for long expressions inside others. Sines and cosines of arctangents become algebraic expressions:

    w = atan2(y, x):   cos w = x / r,   sin w = y / r,   r^2 = x^2 + y^2

Sums of angles follow from the addition theorems; whole turns are dropped. For reading only: a parameter keeps the sign
of its own value, so that sqrt(l^2) = l for a length.
"""

from __future__ import annotations

import math
from collections import Counter, defaultdict
from collections.abc import Iterable, Sequence
from typing import Any, cast

import numpy as np

from ...math.scalar import cos, sin, sqrt
from ..graph import ADD, CALL, DIVIDE, MULTIPLY, NUMBER, SYMBOL, Graph, Node, Symbol, nodes_in_order
from .factors import Factorizer, Term, factors_of, reading_cost, symbol_count, terms_of_sum
from .terms import (
    CONSTANT_ATOM,
    CONSTANT_TERM,
    COS,
    SIN,
    Angle,
    Powers,
    Terms,
    add_term,
    combined_phases,
    contracted_waves,
    double_angles,
    inverse_powers,
    powers_product,
    product_of_terms,
    ratio_of_terms,
    scaled_terms,
    shortened_by_unit_norms,
    sum_of_terms,
    wave,
    wave_node,
    without_squares,
)

FEW_TERMS = 12  # terms of a sum in large expressions
# Work (products of terms and similar) after which expressions count as large.
WORK_BUDGET = 100_000


class Expander:
    """Expands nodes of one graph into sums of terms; each node once.

    Parameters
    ----------
    parent : Simplifier
        Simplifies what is no sum of terms: arguments of functions, denominators, sums that are too long.
    most : int
        Largest number of terms of a sum.
    """

    def __init__(self, parent: Simplifier, most: int) -> None:
        self.parent, self.graph, self.most = parent, parent.graph, most
        self.known: dict[int, Terms] = {}
        self.spent = 0

    def __call__(self, x: Node) -> Terms:
        """Terms of a node; its arguments are expanded first."""
        found = self.known.get(x.index)
        if found is None:
            found = self.known[x.index] = self._terms(x)
        return found

    def _terms(self, x: Node) -> Terms:
        if x.index in self.parent.barriers or x.op == SYMBOL:
            return self.atom(x)
        if x.op == NUMBER:
            return {CONSTANT_TERM: x.value} if x.value != 0.0 else {}
        if x.op == ADD:
            return self._sum(x)
        if x.op == MULTIPLY:
            return self._product(self(x.args[0]), self(x.args[1]))
        if x.op == DIVIDE:
            return self._quotient(x)
        if x.op in ("cos", "sin"):
            return self._wave(x)
        if x.op in ("sqrt", "absolute"):
            return self._root(x)
        return self.atom(self.parent.inside(x))

    def spend(self, work: int) -> None:
        """Count work; above the budget, sums are kept shorter."""
        self.spent += work
        if self.spent > WORK_BUDGET:
            self.most = min(self.most, FEW_TERMS)

    def atom(self, x: Node) -> Terms:
        """A node as one atom."""
        return {(((x.index, 1),), ()): 1.0}

    def factor(self, terms: Terms) -> Terms:
        """A sum as one term: its factors are atoms."""
        if len(terms) <= 1:
            return terms
        c, powers = factors_of(self.parent.short(terms), self.parent.barriers)
        return {(tuple(sorted(powers.items())), ()): c}

    def _sum(self, x: Node) -> Terms:
        a, b = self(x.args[0]), self(x.args[1])
        if len(a) + len(b) > 4 * self.most:
            a, b = sorted((a, b), key=len)
            b = self.factor(b)
            a = self.factor(a) if len(a) > self.most else a
        return sum_of_terms(a, b)

    def _product(self, a: Terms, b: Terms) -> Terms:
        self.spend(len(a) * len(b))
        if len(a) * len(b) > 4 * self.most:
            a, b = sorted((a, b), key=len)
            b = self.factor(b)
            a = self.factor(a) if len(a) > self.most else a
        found = self.roots_squared(product_of_terms(a, b))
        return without_squares(found, self.parent.units) if self.parent.units else found

    def roots_squared(self, terms: Terms) -> Terms:
        """Replace squares of roots and of absolute values by their arguments."""
        out: Terms = {}
        for (powers, waves), c in terms.items():
            rest: Terms = {(powers, waves): c}
            for k, n in powers:
                if (
                    abs(n) > 1
                    and (root := self.graph.nodes[k]).op in ("sqrt", "absolute")
                    and k not in self.parent.barriers
                ):
                    inner = self(root.args[0])
                    inner = inner if len(inner) <= 8 and n > 0 else self.factor(inner)
                    even = n - n % 2 if n > 0 else n + n % 2
                    gone: Terms = {(((k, -even),), ()): 1.0}
                    if n < 0:
                        if len(inner) != 1 or next(iter(inner))[1]:
                            continue
                        ((p, _), d) = next(iter(inner.items()))
                        inner = {(inverse_powers(p), ()): 1.0 / d}
                    rest = product_of_terms(rest, gone)
                    for _ in range(abs(even) // 2 if root.op == "sqrt" else abs(even)):
                        rest = product_of_terms(rest, inner)
            out = sum_of_terms(out, rest)
        return out

    def _quotient(self, x: Node) -> Terms:
        a, b = self(x.args[0]), self(x.args[1])
        if not b:  # kept as it is: 1 / 0
            return self.atom(self.parent.inside(x))
        same = ratio_of_terms(a, b)
        if same is not None:
            return self.roots_squared({(same[0], ()): same[1]})
        if len(b) > 1:
            b = self.factor(b)
        ((powers, waves), c) = next(iter(b.items()))
        under: Powers = inverse_powers(powers)
        out: Terms = {}
        for (p, w), d in a.items():
            if w and w == waves:
                out = sum_of_terms(out, {(powers_product(p, under), ()): d / c})
            else:
                more = tuple((wave_node(self.graph, u).index, -1) for u in waves)
                out = sum_of_terms(out, {(powers_product(powers_product(p, under), tuple(sorted(more))), w): d / c})
        return self.roots_squared(out)

    def angle(self, x: Node) -> Angle | None:
        """An angle as a sum of atoms with factors; None if it has too many terms."""
        terms = self(x)
        if len(terms) > 8:
            return None
        found: dict[int, float] = {}
        for (powers, waves), c in terms.items():
            if powers == () and waves == ():
                found[CONSTANT_ATOM] = found.get(CONSTANT_ATOM, 0.0) + c
                continue
            single = len(powers) == 1 and powers[0][1] == 1 and not waves
            one = self.graph.nodes[powers[0][0]] if single else self.parent.short({(powers, waves): 1.0})
            inner = self._wrapped(one) if c % 1.0 == 0.0 else None
            for k, d in inner or ((one.index, 1.0),):
                found[k] = found.get(k, 0.0) + c * d
        return tuple(sorted((k, c) for k, c in found.items() if c))

    def _wrapped(self, x: Node) -> Angle | None:
        """The angle u of atan2(sin u, cos u), which differs from it by whole turns."""
        if x.op != "atan2" or x.index in self.parent.barriers:
            return None
        y, z = (self(a) for a in x.args)
        if len(y) != 1 or len(z) != 1:
            return None
        ((p, u), c), ((r, w), d) = next(iter(y.items())), next(iter(z.items()))
        if p or r or d != 1.0 or not u or not w or u[0][0] != SIN or w != ((COS, u[0][1]),) or abs(c) != 1.0:
            return None
        return tuple((k, c * e) for k, e in u[0][1])

    def _wave(self, x: Node) -> Terms:
        angle = self.angle(x.args[0])
        if angle is None or not all(math.isfinite(c) for _, c in angle):
            return self.atom(self.parent.inside(x))
        kind = COS if x.op == "cos" else SIN
        found = dict(angle)
        quarter, c = right_angles(found.get(CONSTANT_ATOM, 0.0)), 1.0
        if quarter:  # a multiple of a right angle is the constant term
            del found[CONSTANT_ATOM]
            steps = (quarter + (0 if kind == SIN else 1)) % 4  # sin(x + n pi/2)
            kind, c = (SIN, COS, SIN, COS)[steps], (1.0, 1.0, -1.0, -1.0)[steps]
        return shifted_wave(kind, found, found.pop(CONSTANT_ATOM, 0.0), c)

    def _root(self, x: Node) -> Terms:
        terms = self(x.args[0])
        if len(terms) == 1:
            ((powers, waves), c) = next(iter(terms.items()))
            if not waves and c > 0.0 and (x.op == "absolute" or not any(n % 2 for _, n in powers)):
                out: Terms = {((), ()): c if x.op == "absolute" else math.sqrt(c)}
                for k, n in powers:
                    size = self.graph.function("absolute", self.graph.nodes[k])
                    n = n if x.op == "absolute" else n // 2
                    out = product_of_terms(out, {(((k if n % 2 == 0 else size.index, n),), ()): 1.0})
                return out
        if not terms:
            return {}
        number, inner = factors_of(self.parent.shorter(x.args[0], self.parent.short(terms)), self.parent.barriers)
        if number < 0.0 and x.op == "sqrt":
            return self.atom(self.parent.inside(x))
        if x.op == "absolute":
            return scaled_terms(
                self.atom(self.graph.function(x.op, self.parent.gathered.product(1.0, inner))), abs(number)
            )
        rest = {k: n % 2 if n > 0 else -(n % 2) for k, n in inner.items()}
        found: Terms = {CONSTANT_TERM: math.sqrt(number)}
        for k, n in inner.items():
            half = (n - rest[k]) // 2
            size = self.graph.nodes[k] if half % 2 == 0 else self.graph.function("absolute", self.graph.nodes[k])
            found = product_of_terms(found, {(((size.index, half),) if half else (), ()): 1.0})
        under = {k: n for k, n in rest.items() if n}
        if not under:
            return found
        return product_of_terms(found, self.atom(self.graph.function("sqrt", self.parent.gathered.product(1.0, under))))


def shifted_wave(kind: int, angle: dict[int, float], phase: float, c: float) -> Terms:
    """c times cosine or sine of an angle plus a number: cos(u + p) = cos p cos u - sin p sin u."""
    out: Terms = {}
    parts = [(kind, math.cos(phase))]
    if phase:
        parts.append((1 - kind, math.sin(phase) if kind == SIN else -math.sin(phase)))
    for k, factor in parts:
        waves, sign = wave(k, angle)
        if sign * factor:
            add_term(out, ((), waves), c * factor * sign)
    return out


def right_angles(constant: float) -> int:
    """Number of right angles in a constant, if it is a multiple of them."""
    n = round(constant / (math.pi / 2.0))
    return n if n and abs(constant - n * math.pi / 2.0) <= 4.0 * 2.0**-52 * abs(constant) else 0


MAX_TERMS = 60  # largest number of terms of an expanded sum
MANY_OPERATIONS = 2500  # from so many operations on only short sums are expanded
# Longer expressions are not simplified: they are too long to read.
UNREADABLE_COST = 3000.0
MAX_INNER_TERMS = 16  # largest number of terms of a part that is simplified by itself
SHORT_COST = 6.0  # expressions up to this length are not simplified further


def simplified(
    nodes: Sequence[Any] | np.ndarray, units: Iterable[Sequence[Node]] = (), keep: Iterable[Node] = (), most: int = 0
) -> Any:
    """Expressions of the same value that are shorter to read, in the same graph.

    Parameters
    ----------
    nodes : sequence or array of Node or number
    units : sequence of sequences of Node
        Symbols whose squares add up to one, such as the four of a unit quaternion.
    keep : sequence of Node
        Expressions that are treated like symbols.
    most : int, optional
        Largest number of terms of expanded sums; by default fewer where expressions are large.

    Returns
    -------
    list of Node, or array of the shape given
        Numbers among the expressions stay numbers.
    """
    flat = list(nodes.ravel()) if isinstance(nodes, np.ndarray) else list(nodes)
    graph = next((x.graph for x in flat if isinstance(x, Node)), None)
    if graph is not None:
        made = Simplifier(graph, flat, units, keep, most)
        flat = [made(x) if isinstance(x, Node) else x for x in flat]
    if not isinstance(nodes, np.ndarray):
        return flat
    out = np.empty(nodes.shape, object)
    out.ravel()[:] = flat
    return out


class Barriers:
    """Indices of nodes that are not expanded: those to keep, and operations on infinity or NaN.

    The laws of algebra do not hold for these values: infinity times a sum is not the sum of infinity times its terms.
    """

    def __init__(self, graph: Graph, preserved: set[int]) -> None:
        self.graph, self.kept = graph, preserved

    def __contains__(self, k: object) -> bool:
        return k in self.kept or any(
            a.op == NUMBER and not math.isfinite(a.value) for a in self.graph.nodes[cast(int, k)].args
        )


class Simplifier:
    """Simplifier of expressions of one graph, with a cache.

    Parameters
    ----------
    graph : Graph
    nodes : sequence of Node or number
        Their number of operations determines how far sums are expanded.
    units, keep, most
        As for `simplified`.
    """

    def __init__(
        self, graph: Graph, nodes: Sequence[Any], units: Iterable[Sequence[Node]], keep: Iterable[Node], most: int
    ) -> None:
        self.graph = graph
        self.units = [tuple(x.index for x in unit) for unit in units]
        self.barriers = Barriers(graph, {x.index for x in keep})
        self.costs: dict[int, float] = {}
        size = len(nodes_in_order(nodes))
        self.expander = Expander(self, most or (MAX_TERMS if size < MANY_OPERATIONS else FEW_TERMS))
        self.gathered = Factorizer(graph, self.costs)
        self._short: dict[Any, Node] = {}
        self._best: dict[int, Node] = {}  # results for parts
        self._whole: dict[int, Node] = {}  # results for whole expressions

    def __call__(self, x: Node) -> Node:
        """The shortest expression found."""
        for y in nodes_in_order([x]):
            if y.index not in self._best:
                self._best[y.index] = self._shortest(y) if len(self.expander(y)) <= MAX_INNER_TERMS else self._parts(y)
        if x.index not in self._whole:
            self._whole[x.index] = self._shortest(x)
        return self._whole[x.index]

    def cost(self, x: Node) -> float:
        """Length of an expression to read."""
        return reading_cost(x, self.costs)

    def _shortest(self, x: Node) -> Node:
        if x.op in (NUMBER, SYMBOL) or x.index in self.barriers:
            return x
        found = self.short(self.expander(x))
        if x.op in (ADD, MULTIPLY, DIVIDE) and self.cost(found) > SHORT_COST:
            parts = self._parts(x)
            if x.op == ADD:
                other = self.gathered(merge_equal_terms(terms_of_sum(parts, self.barriers)))
                parts = min(other, parts, key=self.cost)
            if min(self.cost(found), self.cost(parts)) > UNREADABLE_COST:
                return parts
            found = min(found, parts, key=self.cost)
        return found

    def _parts(self, x: Node) -> Node:
        """The same operation on simplified arguments."""
        return self.graph.rebuilt(x, tuple(self._best[a.index] for a in x.args))

    def shorter(self, x: Node, other: Node) -> Node:
        """The shorter of the best known form of ``x`` and another expression of the same value."""
        return min(other, self._best.get(x.index, other), key=self.cost)

    def inside(self, x: Node) -> Node:
        """A function of simplified arguments."""
        args = tuple(self._best[a.index] if a.index in self._best else self(a) for a in x.args)
        return x if x.op == CALL and args == x.args else self.graph.rebuilt(x, args)

    def short(self, terms: Terms) -> Node:
        """Node for a sum of terms, with sums of angles or products of waves, whichever is shorter."""
        key = frozenset(terms.items())
        found = self._short.get(key)
        if found is None:
            self.expander.spend(len(terms) ** 2 // 4)
            terms = combined_phases(shortened_by_unit_norms(terms, self.units))
            found = self._constructed([(c, p, w) for (p, w), c in sorted(terms.items())])
            if sum(1 for _, w in terms if w) > 1 or (len(terms) > 1 and any(w for _, w in terms)):
                for other in (contracted_waves(terms), double_angles(terms)):
                    found = min(found, self._constructed(other), key=self.cost)
            self._short[key] = found
        return found

    def _constructed(self, products: list[Any]) -> Node:
        terms: list[Term] = []
        for c, powers, waves in products:
            found = dict(powers)
            for w in waves:
                k = wave_node(self.graph, w).index
                found[k] = found.get(k, 0) + 1
            terms.append((c, {k: n for k, n in found.items() if n}))
        made = self.gathered(merge_equal_terms(terms))
        if len(terms) < 4:
            return made
        again = self.gathered(
            merge_equal_terms(terms_of_sum(made, self.barriers))
        )  # sums that several terms have got for a factor
        return min(made, again, key=self.cost)


def merge_equal_terms(terms: list[Term]) -> list[Term]:
    """Merge equal terms."""
    found: dict[Any, tuple[float, dict[int, int]]] = {}
    for c, p in terms:
        key = tuple(sorted(p.items()))
        before = found.get(key)
        total = c + (before[0] if before else 0.0)
        if before and abs(total) <= 1e-14 * max(abs(c), abs(before[0])):
            del found[key]
        else:
            found[key] = (total, p)
    return list(found.values())


FULL_TURN = 2.0 * math.pi
MAX_ANGLE_OPERATIONS = 300  # up to so many operations the cosine and sine of an angle are simplified
MAX_FACTOR = 3  # largest factor of an angle in a sum

ArctangentWave = tuple[Any, Any, list[Node]]
"""Cosine and sine of an angle, each times factors, and the squares of these factors."""


class ArctangentSubstitution:
    """Replaces sines and cosines of arctangents and substitutes formulas; each node is processed once.

    Parameters
    ----------
    definitions : sequence of (Node, Node, Node or None)
        Symbol, its formula in earlier symbols, and, if it is atan2(y, x), sqrt(x^2 + y^2) if known.
    """

    def __init__(self, definitions: Iterable[tuple[Node, Any, Any]] = ()) -> None:
        self._known: dict[int, Node] = {}
        self._angles: dict[int, dict[Node, float]] = {}
        self._waves: dict[int, ArctangentWave] = {}
        for w, value, radius in definitions:
            y = w.graph.node(value)
            parts = self._parts(y)
            if all(a.op in (SYMBOL, NUMBER, "atan2") for a in parts):
                self._angles[w.index] = parts
            if radius is not None and y.op == "atan2":
                a, b, r = self([y.args[1], y.args[0], w.graph.node(radius)])
                c, s = fast_simplification([w.graph.node(a / r), w.graph.node(b / r)])
                self._waves[y.index] = (c, s, [])
            self._known[w.index] = self([without_whole_turns(y)])[0]

    def __call__(self, nodes: Sequence[Any]) -> list[Any]:
        """Substitute all symbols that have a formula."""
        for x in nodes_in_order(nodes):
            if x.index not in self._known:
                self._known[x.index] = self._constructed(x)
        return [self._known[x.index] if isinstance(x, Node) else x for x in nodes]

    def _constructed(self, x: Node) -> Node:
        if x.op in ("sin", "cos"):
            found = self._wave(x.args[0])
            if found is not None:
                return found[0] if x.op == "cos" else found[1]
        args = tuple(self._known[a.index] for a in x.args)
        same = all(a is b for a, b in zip(args, x.args, strict=True))
        return x if same else x.graph.rebuilt(x, args)

    def _parts(self, x: Node) -> dict[Node, float]:
        """An angle as a sum of symbols and arctangents with factors, without whole turns."""
        found: dict[Node, float] = {}
        to_see = [(x, 1.0)]
        while to_see:
            y, c = to_see.pop()
            if y.op == ADD:
                to_see += [(a, c) for a in y.args]
            elif y.op == MULTIPLY and y.args[0].op == NUMBER:
                to_see.append((y.args[1], c * y.args[0].value))
            elif y.index in self._angles:
                to_see += [(a, c * n) for a, n in self._angles[y.index].items()]
            elif y.op == NUMBER:
                one = y.graph.number(1.0)
                found[one] = found.get(one, 0.0) + c * y.value
            elif not (y.op == "rounded" and abs(abs(c) / FULL_TURN - round(abs(c) / FULL_TURN)) < 1e-12):
                found[y] = found.get(y, 0.0) + c
        return {y: c for y, c in found.items() if c}

    def _wave(self, angle: Node) -> tuple[Node, Node] | None:
        """Cosine and sine of an angle that contains arctangents; None if it contains none."""
        parts = self._parts(angle)
        arcs = [(y, c) for y, c in parts.items() if y.op == "atan2"]
        if not arcs or any(c != round(c) or abs(c) > MAX_FACTOR for _, c in arcs):
            return None
        g = angle.graph
        rest: Any = 0.0
        for y, c in parts.items():
            if y.op != "atan2":
                rest = rest + c * self([y])[0]
        c, s = (cos(rest), sin(rest)) if isinstance(rest, Node) else (math.cos(rest), math.sin(rest))
        squares: list[Node] = []
        for y, n in arcs:
            a, b, r = self._of(y)
            for _ in range(abs(int(n))):
                c, s = (c * a - s * b, s * a + c * b) if n > 0 else (c * a + s * b, s * a - c * b)
                squares += r
        under: Any = 1.0
        for square, k in Counter(squares).items():
            under = under * square ** (k // 2) * (sqrt(square) if k % 2 else 1.0)
        made = fast_simplification([g.node(c / under), g.node(s / under)])
        return made[0], made[1]

    def _of(self, y: Node) -> ArctangentWave:
        """Cosine and sine of an arctangent."""
        if y.index not in self._waves:
            b, a = fast_simplification(self(y.args))
            self._waves[y.index] = (a, b, fast_simplification([a * a + b * b]))
        return self._waves[y.index]


def without_whole_turns(y: Node) -> Node:
    """An angle without its term that counts whole turns."""
    if y.op == ADD:
        a, b = y.args
        for one, other in ((a, b), (b, a)):
            if one.op == MULTIPLY and one.args[0] == FULL_TURN and one.args[1].op == "rounded":
                return other
    return y


def fast_simplification(nodes: Sequence[Node]) -> list[Node]:
    """Simplify if that is quick; absolute values of parameters are resolved by the sign of their values."""
    if len(nodes_in_order(nodes)) > MAX_ANGLE_OPERATIONS:
        return list(nodes)
    return without_absolute_values(simplified(list(nodes)))


def without_absolute_values(nodes: Sequence[Any]) -> list[Any]:
    """Resolve absolute values of expressions of parameters by the sign of their values."""
    known: dict[int, Node] = {}
    for x in nodes_in_order(nodes):
        args = tuple(known[a.index] for a in x.args)
        if x.op == "absolute" and not x.moving and x.args[0].op != NUMBER and x.value != 0.0:
            known[x.index] = args[0] if x.args[0].value > 0.0 else -args[0]
        else:
            same = all(a is b for a, b in zip(args, x.args, strict=True))
            known[x.index] = x if same else x.graph.rebuilt(x, args)
    return [known[x.index] if isinstance(x, Node) else x for x in nodes]


MIN_GAIN = 12.0  # a subexpression gets a name if that saves so many symbols
LONG_COST = 60.0  # a factor or argument with so many symbols gets a name
WRITTEN_OUT_COST = 4.0  # expressions up to this length are written out

Definitions = list[tuple[Node, Node]]
"""Symbols and their definitions, in an order of evaluation."""


def extract_common_subexpressions(
    nodes: Sequence[Any], gain: float = MIN_GAIN, long: float = LONG_COST
) -> tuple[list[Any], Definitions]:
    """Replace long parts that occur more than once by symbols.

    Parameters
    ----------
    nodes : sequence of Node or number
    gain, long : float
        Symbols that a name must save; length above which a factor or an argument gets a name even if it occurs once.

    Returns
    -------
    list, list of (Node, Node)
        The expressions, and the definitions of the symbols.
    """
    order = [x for x in nodes_in_order(nodes) if x.op not in (NUMBER, SYMBOL)]
    uses, inside = _uses(order)
    lengths: dict[int, float] = {}
    made: dict[int, Node] = {}
    definitions: Definitions = []
    letter = _symbol_letter(order[0].graph) if order else ""
    for x in order:
        args = tuple(made.get(a.index, a) for a in x.args)
        new = made[x.index] = x if args == x.args else x.graph.rebuilt(x, args)
        length = reading_cost(new, lengths)
        saved = (uses[x.index] - 1) * (length - 1.0)
        scaled = x.op == MULTIPLY and x.args[0].op == NUMBER
        if length > WRITTEN_OUT_COST and not scaled and (saved > gain or (length > long and x.index in inside)):
            name = f"{letter}_{len(definitions) + 1}"
            index = f"{letter[0]}_{{{letter[1:]}{len(definitions) + 1}}}"
            symbol = Symbol(name, "shared" if x.moving else "constant", index)
            made[x.index] = x.graph.symbol(symbol, None if x.moving else x.value)
            definitions.append((made[x.index], new))
    return [made.get(x.index, x) if isinstance(x, Node) else x for x in nodes], definitions


def _symbol_letter(graph: Graph) -> str:
    """Letter of the symbols (w_1, w_2, ...) that no numbered symbol of the graph uses."""
    taken = {x.data.name.partition("_")[0] for x in graph if x.op == SYMBOL and "_" in x.data.name}
    return next(x for x in (*"wchkb", *(f"w{n}" for n in range(len(taken) + 1))) if x not in taken)


def _uses(order: Sequence[Node]) -> tuple[dict[int, int], set[int]]:
    """Number of uses of each operation; and the sums that occur in something other than a sum."""
    uses: dict[int, int] = defaultdict(int)
    inside: set[int] = set()
    for x in order:
        scaled = x.op == MULTIPLY and x.args[0].op == NUMBER
        for a in x.args:
            uses[a.index] += 1
            if x.op != ADD and not scaled and a.op == ADD:
                inside.add(a.index)
    return uses, inside


MAX_OPERATIONS = 600  # up to so many operations expressions are simplified before parts get names
READABLE_COST = 2500.0  # that result is kept up to so many symbols in all expressions


def simplified_with_symbols(
    nodes: Sequence[Any], units: Sequence[Sequence[Node]] = ()
) -> tuple[list[Any], Definitions]:
    """Short expressions of the same value, with symbols for common subexpressions and their definitions.

    Small expressions are simplified as a whole. In large ones common subexpressions get names first, and each piece is
    simplified by itself: the time is proportional to the number of operations, and the result does not grow.

    Parameters
    ----------
    nodes : sequence of Node or number
    units : sequence of sequences of Node
        As for `simplified`.

    Returns
    -------
    list, list of (Node, Node)
        The expressions, and symbols with their definitions, in an order of evaluation.
    """
    if len(nodes_in_order(nodes)) <= MAX_OPERATIONS:
        found = simplified(nodes, units)
        if symbol_count(found) <= READABLE_COST:
            return extract_common_subexpressions(found)
    rest, definitions = extract_common_subexpressions(nodes)
    short = simplified([*rest, *(y for _, y in definitions)], units)
    count = len(rest)
    return short[:count], [(x, y) for (x, _), y in zip(definitions, short[count:], strict=True)]
