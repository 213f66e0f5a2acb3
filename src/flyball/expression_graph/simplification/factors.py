"""Factorisation of a sum of terms, as a node: the most frequent factor first; length of an expression to read.

Quadratic forms with numeric coefficients become squares and products of sums: a^2 + 2 a b + b^2 = (a + b)^2. Short
fractions, roots and multiples of pi are recognised.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Container, Iterable
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from typing import Any

from ..graph import ADD, DIVIDE, MULTIPLY, NUMBER, SYMBOL, Graph, Node

ROUNDING_FACTOR = 4.0 * 2.0**-52  # relative rounding error of a number
LARGEST = 100_000  # larger numerators are written as decimals
DENOMINATORS = 720
ROOTS = (2, 3, 5, 6, 7, 10)


@dataclass(frozen=True)
class ExactNumber:
    """A number as a fraction times the root of a small number, or times pi."""

    numerator: int
    denominator: int
    root: int = 1
    pi: bool = False


@lru_cache(maxsize=65536)
def fraction(x: float, largest: int = DENOMINATORS) -> Fraction | None:
    """The short fraction that a number equals; None if there is none."""
    if not math.isfinite(x) or abs(x) > LARGEST:
        return None
    found = Fraction(x).limit_denominator(largest)
    if found == 0 or abs(found.numerator) > LARGEST or abs(float(found) - x) > ROUNDING_FACTOR * abs(x):
        return None
    return found


@lru_cache(maxsize=65536)
def exact_number(x: float) -> ExactNumber | None:
    """Exact form of a number for display; None if a decimal is better."""
    found = fraction(x)
    if found is not None:
        q = found.denominator
        decimal = len(f"{abs(x):.12g}".replace(".", "").lstrip("0")) <= 4 and float(f"{x:.12g}") == x
        if q == 1 or q <= 12 or (not decimal and q <= DENOMINATORS and abs(found.numerator) < 1000):
            return ExactNumber(found.numerator, q)
        return None
    over_pi = fraction(x / math.pi, 48)
    if over_pi is not None and abs(over_pi.numerator) <= 48:
        return ExactNumber(over_pi.numerator, over_pi.denominator, pi=True)
    for root in ROOTS:
        over_root = fraction(x / math.sqrt(root), 24)
        if over_root is not None and abs(over_root.numerator) <= 48:
            return ExactNumber(over_root.numerator, over_root.denominator, root)
    return None


@lru_cache(maxsize=65536)
def without_rounding(x: float) -> float:
    """Remove accumulated rounding from a number that is clearly a short one."""
    if x == 0.0 or not math.isfinite(x):
        return x
    found = fraction(x, 48)
    if found is not None:
        return float(found)
    short = float(f"{x:.14g}")
    return short if abs(short - x) <= ROUNDING_FACTOR * abs(x) else x


LARGEST_COST = 1e9


def reading_cost(x: Node, costs: dict[int, float]) -> float:
    """Number of symbols, numbers and functions in an expression; ``costs`` is a cache."""
    to_see = [x]
    while to_see:
        y = to_see[-1]
        if y.index in costs:
            to_see.pop()
            continue
        missing = [a for a in y.args if a.index not in costs]
        if missing:
            to_see += missing
            continue
        costs[y.index] = min(_node_cost(y, [costs[a.index] for a in y.args]), LARGEST_COST)
        to_see.pop()
    return costs[x.index]


def symbol_count(nodes: Iterable[Any]) -> float:
    """Total reading length of several expressions."""
    costs: dict[int, float] = {}
    return sum(reading_cost(x, costs) for x in nodes if isinstance(x, Node))


def _node_cost(y: Node, args: list[float]) -> float:
    if y.op == NUMBER:
        return 0.0 if abs(y.value) == 1.0 else 1.0 if exact_number(y.value) else 1.4
    if y.op == SYMBOL:
        return 1.0
    if y.op == ADD:
        return sum(args) + 0.05 + sum(1.0 for a in y.args if a.op == NUMBER and abs(a.value) == 1.0)
    if y.op == MULTIPLY:
        if y.args[0] is y.args[1]:
            return args[0] + 0.4
        return sum(args) + sum(0.5 for a in y.args if a.op == ADD)
    if y.op == DIVIDE:
        return sum(args) + 0.3 + (1.0 if y.args[0].op == NUMBER and y.args[0].value == 1.0 else 0.0)
    return sum(args) + 1.0


QuadraticTerm = tuple[float, dict[int, int]]
EQUAL_TOLERANCE = 1e-12  # a difference of two numbers below this part of them may be zero, if the product confirms it
ROUNDING_TOLERANCE = 2e-15  # relative difference allowed between a coefficient and that of the product
CONSTANT_ATOM = -1  # atom of terms without powers


def quadratic_as_product(terms: list[QuadraticTerm]) -> tuple[list[QuadraticTerm], list[QuadraticTerm]] | None:
    """Two sums whose product is the given sum, if all its terms are of second order; None if there are none.

    As a polynomial in one of the atoms the sum is a x^2 + b x + c. Its factors are real sums if b^2 - 4 a c is the
    square of a sum.
    """
    if len(terms) < 3 or len(terms) > 36:
        return None
    form: dict[tuple[int, int], float] = {}
    for c, p in terms:
        if any(n < 0 for n in p.values()) or sum(p.values()) > 2:
            return None
        i, j = sorted([k for k, n in p.items() for _ in range(n)] + [CONSTANT_ATOM] * (2 - sum(p.values())))
        form[i, j] = form.get((i, j), 0.0) + c
    atoms = sorted({k for pair in form for k in pair})
    if len(atoms) > 8:
        return None
    found = next((f for k in reversed(atoms) if (f := _solve_for_atom(form, atoms, k)) is not None), None)
    if found is None:
        return None
    if not _is_product(form, *found):
        return None
    first, second = ([(c, {k: 1} if k != CONSTANT_ATOM else {}) for k, c in s.items() if c != 0.0] for s in found)
    return (first, second) if len(first) > 1 or len(second) > 1 else None


LinearForm = dict[int, float]


def _solve_for_atom(
    form: dict[tuple[int, int], float], atoms: list[int], k: int
) -> tuple[LinearForm, LinearForm] | None:
    """Factors of the form as a polynomial in atom k."""
    a = form.get((k, k), 0.0)
    if a == 0.0:
        return None
    rest = [i for i in atoms if i != k]
    b = {i: form.get((min(i, k), max(i, k)), 0.0) for i in rest}
    square: dict[tuple[int, int], float] = {}
    for n, i in enumerate(rest):
        for j in rest[n:]:
            cross = b[i] * b[j] * (1.0 if i == j else 2.0)
            less = 4.0 * a * form.get((i, j), 0.0)
            d = cross - less
            square[i, j] = 0.0 if abs(d) <= EQUAL_TOLERANCE * (abs(cross) + abs(less)) else d
    root = _square_root_form(square, rest)
    if root is None:
        return None
    first, second = {k: a}, {k: 1.0}
    for i in rest:
        first[i], second[i] = _atom_coefficients(a, b[i], root[i], form.get((i, i), 0.0))
    return _with_smaller_numbers(first, second)


def _atom_coefficients(a: float, b: float, root: float, c: float) -> tuple[float, float]:
    """Coefficients of an atom in both sums, with the product c; the smaller one is computed from the larger."""
    size = abs(b) + abs(root)
    if abs(b + root) >= abs(b - root):
        first = 0.5 * (b + root)
        return first, 0.5 * (b - root) / a if c == 0.0 and abs(
            b - root
        ) > EQUAL_TOLERANCE * size else c / first if first else 0.0
    second = 0.5 * (b - root) / a
    return 0.5 * (b + root) if c == 0.0 and abs(b + root) > EQUAL_TOLERANCE * size else c / second, second


def _is_product(form: dict[tuple[int, int], float], first: LinearForm, second: LinearForm) -> bool:
    """Whether the product of two sums is the form, each coefficient within its own rounding.

    Coefficients of different atoms are not compared: they have different units.
    """
    atoms = sorted(first.keys() | second.keys())
    for n, i in enumerate(atoms):
        for j in atoms[n:]:
            parts = [first.get(i, 0.0) * second.get(j, 0.0)] + (
                [first.get(j, 0.0) * second.get(i, 0.0)] if i != j else []
            )
            wanted = form.get((i, j), 0.0)
            size = abs(wanted) if wanted else sum(map(abs, parts))
            if not abs(sum(parts) - wanted) <= ROUNDING_TOLERANCE * size:
                return False
    return True


def _square_root_form(square: dict[tuple[int, int], float], atoms: list[int]) -> LinearForm | None:
    """The sum whose square is the form; None if there is none."""
    if any(square[i, i] < 0.0 for i in atoms):
        return None
    lead = next((i for i in atoms if square[i, i] > 0.0), None)
    if lead is None:
        return None if any(square.values()) else dict.fromkeys(atoms, 0.0)
    size = math.sqrt(square[lead, lead])
    line = {i: (square[min(i, lead), max(i, lead)] / (1.0 if i == lead else 2.0)) / size for i in atoms}
    for n, i in enumerate(atoms):
        for j in atoms[n:]:
            made = line[i] * line[j] * (1.0 if i == j else 2.0)
            if abs(made - square[i, j]) > 1e-11 * (abs(made) + abs(square[i, j])):
                return None
    return line


def _with_smaller_numbers(first: LinearForm, second: LinearForm) -> tuple[LinearForm, LinearForm]:
    """Move a common numeric factor from one sum to the other where that leaves integers."""
    smallest = min(abs(c) for c in second.values() if c)
    if smallest < 1.0:
        first, second = {i: c * smallest for i, c in first.items()}, {i: c / smallest for i, c in second.items()}
    return first, second


Term = tuple[float, dict[int, int]]
"""A number times powers of nodes, by their index."""


class Factorizer:
    """Converts terms to factored nodes."""

    def __init__(self, graph: Graph, costs: dict[int, float]) -> None:
        self.graph, self.costs = graph, costs

    def weight(self, powers: dict[int, int]) -> float:
        """Length of a product to read."""
        return sum(reading_cost(self.graph.nodes[k], self.costs) + 0.4 * (abs(n) - 1) for k, n in powers.items())

    def product(self, c: float, powers: dict[int, int]) -> Node:
        """Node for a number times powers."""
        above: Any = without_rounding(c)
        below: Any = 1.0
        for k in sorted(powers):
            n = powers[k]
            if n > 0:
                above = self.graph.node(above) * self.graph.power(self.graph.nodes[k], n)
            else:
                below = self.graph.node(below) * self.graph.power(self.graph.nodes[k], -n)
        return self.graph.divide(above, below)

    def __call__(self, terms: list[Term]) -> Node:
        """Node for a sum of terms."""
        if not terms:
            return self.graph.number(0.0)
        if len(terms) == 1:
            return self.product(*terms[0])
        powers = common_powers([p for _, p in terms])
        c = numeric_content([c for c, _ in terms])
        c = 1.0 if c == -1.0 and not powers else c
        rest = [(d / c, powers_quotient(p, powers)) for d, p in terms]
        return self.graph.multiply(self.product(c, powers), self.split(rest))

    def split(self, terms: list[Term]) -> Node:
        """Node for a sum without a common factor: a product of two sums, or partly factored."""
        factors = quadratic_as_product(terms)
        if factors is not None:
            first, second = (self.summed(x) for x in factors)
            return self.graph.multiply(first, second)
        best, saving = None, 0.0
        holding: dict[tuple[int, bool], list[int]] = defaultdict(list)
        for i, (_, p) in enumerate(terms):
            for k, n in p.items():
                holding[k, n > 0].append(i)
        for _, members in sorted(holding.items()):
            if len(members) > 1:
                found = self.saved([terms[i] for i in members])
                if (found, len(members)) > (saving + 1e-9, 0) or (
                    best and abs(found - saving) < 1e-9 and len(members) > len(best)
                ):
                    best, saving = members, found
        if not best:
            return self.summed(terms)
        chosen = set(best)
        inner = self([terms[i] for i in best])
        total = self.graph.add(inner, self([t for i, t in enumerate(terms) if i not in chosen]))
        return self.again(total)

    def again(self, x: Node) -> Node:
        """Extract a common factor that is itself a sum."""
        terms = terms_of_sum(x)
        powers = common_powers([p for _, p in terms])
        if not powers or len(terms) < 2:
            return x
        rest = [(c, powers_quotient(p, powers)) for c, p in terms]
        return self.graph.multiply(self.product(1.0, powers), self(rest))

    def saved(self, terms: list[Term]) -> float:
        """Symbols saved by extracting the common factor of a sum."""
        powers = common_powers([p for _, p in terms])
        alone = sum(1.0 for c, p in terms if p == powers)
        again = any(k in powers for _, p in terms for k in powers_quotient(p, powers))  # l (l + 2 r) reads no better
        return (len(terms) - 1) * self.weight(powers) - alone - (2.6 if again else 0.9)

    def summed(self, terms: list[Term]) -> Node:
        """Node for a sum without factoring."""
        total: Any = 0.0
        for c, p in terms:
            total = self.graph.node(total) + self.product(c, p)
        return self.graph.node(total)


def factors_of(x: Node, barriers: Container[int] = ()) -> Term:
    """A node as a number times powers of nodes that are no products; ``barriers`` are not expanded."""
    c: float = 1.0
    powers: dict[int, int] = {}
    to_see = [(x, 1)]
    while to_see:
        y, n = to_see.pop()
        if y.op == NUMBER:
            c *= y.value if n > 0 else 1.0 / y.value
        elif y.op in (MULTIPLY, DIVIDE) and y.index not in barriers:
            to_see += [(y.args[0], n), (y.args[1], n if y.op == MULTIPLY else -n)]
        else:
            powers[y.index] = powers.get(y.index, 0) + n
    return c, {k: n for k, n in powers.items() if n}


def terms_of_sum(x: Node, barriers: Container[int] = ()) -> list[Term]:
    """Terms of a sum without expansion."""
    out: list[Term] = []
    to_see = [(x, 1.0)]
    while to_see:
        y, sign = to_see.pop()
        minus = y.op == MULTIPLY and y.args[0].op == NUMBER and y.args[0].value == -1.0 and y.args[1].op == ADD
        if y.index in barriers or not (y.op == ADD or minus):
            c, powers = factors_of(y, barriers)
            out.append((sign * c, powers))
        elif minus:
            to_see.append((y.args[1], -sign))
        else:
            to_see += [(a, sign) for a in y.args]
    return out


def common_powers(powers: list[dict[int, int]]) -> dict[int, int]:
    """Powers that all products have."""
    found = dict(powers[0])
    for p in powers[1:]:
        for k in list(found):
            n = p.get(k, 0)
            if n * found[k] <= 0:
                del found[k]
            else:
                found[k] = min(n, found[k], key=abs)
        if not found:
            break
    return found


def powers_quotient(p: dict[int, int], by: dict[int, int]) -> dict[int, int]:
    """Powers without those of ``by``."""
    out = {k: n - by.get(k, 0) for k, n in p.items()}
    return {k: n for k, n in out.items() if n}


def numeric_content(numbers: list[float]) -> float:
    """Common numeric factor: the smallest number, if all are integer multiples of it and that shortens the sum."""
    smallest = min(map(abs, numbers))
    sign = -1.0 if all(x < 0.0 for x in numbers) else 1.0
    parts = [fraction(x, 48) for x in numbers]
    if all(parts) and not all(p.denominator == 1 for p in parts if p):
        under = math.lcm(*[p.denominator for p in parts if p])
        over = math.gcd(*[int(p * under) for p in parts if p])
        if under <= 48:
            smallest = over / under
    ratios = [x / smallest for x in numbers]
    whole = all(abs(r) <= 16.5 and abs(r - round(r)) <= 1e-12 * abs(r) for r in ratios)
    if not whole or smallest == 1.0:
        return sign
    before = sum(number_cost(x) for x in numbers)
    after = number_cost(smallest) + sum(number_cost(round(r)) for r in ratios)
    return sign * smallest if after < before else sign


def number_cost(x: float) -> int:
    """Length of a number to read: 0 for one, 2 for a fraction."""
    return 0 if abs(x) == 1.0 else 1 if x == round(x) else 2
