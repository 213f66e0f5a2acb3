"""Polynomials in s and in the parameters: exact sums and products, determinants, common factors, signs.

What is not a polynomial (sines, roots, functions known by name) becomes a generator. Sines and cosines of sums are
expanded, and squares with a known value (sin^2, roots) are replaced. Determinants are expanded by minors, each computed
once.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ...errors import ModelError
from ...expression_graph.graph import Graph, Node, nodes_in_order
from ...expression_graph.printers.sympy import MAX_DENOMINATOR, SympyPrinter, fraction
from ..explicit.linear_systems import nominal_value

MAX_TERMS_OF_ENTRY = 4000  # largest number of operations in the entries of a matrix
# Terms with a long number below this part of the largest term of a polynomial are rounding.
ROUNDING_TOLERANCE = 1e-12


class PolynomialRing:
    """Polynomial ring of the entries of some matrices.

    Parameters
    ----------
    matrices : sequence of ndarray
        Matrices of nodes or numbers.
    what : str
        Owner of the matrices, for messages.
    positive : collection of str
        Positive parameters, for which the root of the square is the parameter.

    Raises
    ------
    ModelError
        If they are too large, with the size met.
    """

    def __init__(self, matrices: Sequence[np.ndarray], what: str, positive: Sequence[str]) -> None:
        flat = [x for X in matrices for x in X.ravel()]
        count = len(nodes_in_order(flat))
        if count > MAX_TERMS_OF_ENTRY:
            raise ModelError(
                f"the linear equations of {what} have {count} operations in their coefficients, and transfer "
                f"functions with symbols are found up to {MAX_TERMS_OF_ENTRY}: use numbers (linearize), or give "
                "numbers for parameters"
            )
        self.graph = next((x.graph for x in flat if isinstance(x, Node)), None) or Graph()  # graph of the expressions
        self.printer = SympyPrinter(positive=positive)
        self.sympy = sp = self.printer.sympy
        self.s = sp.Symbol("s")
        self.own: dict[Any, float] = {}  # values of symbols
        texts = [self._tidy(self.printer(x)) for x in flat]
        self.own = {k: nominal_value(x) for k, x in self.printer.symbols.items()}
        self.ring, self.relations, elements = self._elements(texts)
        self.matrices = []
        at = 0
        for X in matrices:
            self.matrices.append(np.array([*elements[at : at + X.size], None], object)[:-1].reshape(X.shape))
            at += X.size

    def _tidy(self, x: Any) -> Any:
        """Write numbers as roots where they are, take roots of squares, expand sines of sums."""
        sp = self.sympy
        x = sp.sympify(x)
        if x.has(sp.Float):
            x = x.xreplace({f: self._exact(f) for f in x.atoms(sp.Float)})
        if x.has(sp.sin, sp.cos, sp.tan):
            x = sp.expand_trig(x.rewrite(sp.tan, sp.sin) if x.has(sp.tan) else x)
        return x.replace(lambda e: e.is_Pow and e.exp.is_Rational and e.exp.q == 2, self._root)

    def _root(self, x: Any) -> Any:
        """Odd power of a root, with sines and cosines in the base unified where possible."""
        sp = self.sympy
        return sp.sqrt(sp.factor(sp.trigsimp(sp.together(x.base)))) ** (2 * x.exp)

    def _exact(self, x: Any) -> Any:
        """A number as the root of a short fraction, if it is one; else as a decimal."""
        sp = self.sympy
        value = float(x)
        square = fraction(value * value)
        if square is not None and square.denominator <= MAX_DENOMINATOR:
            root = sp.sqrt(sp.Rational(square.numerator, square.denominator))
            return root if value > 0.0 else -root
        return sp.Rational(repr(value))

    def _elements(self, texts: Sequence[Any]) -> tuple[Any, list[Any], list[Any]]:
        """The field of fractions, replacements for squares, and the entries as field elements."""
        sp = self.sympy
        squares = self._squares(texts)
        extra = [x for pair in squares for x in pair]
        field, found = sp.polys.fields.sfield([*texts, *extra, self.s], *self._order([*texts, *extra]), domain="QQ")
        at = len(texts)
        relations = []
        for k in range(len(squares)):
            left, right = found[at + 2 * k], found[at + 2 * k + 1]
            relations.append((left.numer, right))
        self.field = field
        self.s_element = found[-1]
        return field.ring, relations, found[:at]

    def _kernels(self, texts: Sequence[Any]) -> list[Any]:
        """Generators other than symbols: roots first, then functions."""
        sp = self.sympy
        roots: dict[Any, None] = {}
        functions: dict[Any, None] = {}
        for x in texts:
            for e in sp.preorder_traversal(x):
                if e.is_Pow and e.exp.is_Rational and not e.exp.is_Integer:
                    roots[sp.Pow(e.base, sp.Rational(1, e.exp.q))] = None
                elif isinstance(e, sp.Function) or e.func in (sp.Derivative, sp.Subs, sp.Piecewise):
                    functions[e] = None
        for e in list(functions):
            if isinstance(e, sp.sin | sp.cos):
                functions[sp.sin(e.args[0])] = functions[sp.cos(e.args[0])] = None
        by_name = lambda e: (not isinstance(e, sp.sin), sp.default_sort_key(e))  # noqa: E731
        deepest = sorted(roots, key=lambda e: (-e.count_ops(), sp.default_sort_key(e)))
        return [*deepest, *sorted(functions, key=by_name)]

    def _order(self, texts: Sequence[Any]) -> list[Any]:
        """Generators in order; composed ones first."""
        sp = self.sympy
        kernels = self._kernels(texts)
        symbols = {y for x in texts for y in x.free_symbols} | {y for k in kernels for y in k.free_symbols}
        numbers_ = [sp.pi] if any(x.has(sp.pi) for x in (*texts, *kernels)) else []
        return [self.s, *kernels, *sorted(symbols, key=lambda y: y.name), *numbers_]

    def _squares(self, texts: Sequence[Any]) -> list[tuple[Any, Any]]:
        """(generator, value of its square) of roots and sines."""
        sp = self.sympy
        out = []
        for e in self._kernels(texts):
            if e.is_Pow and e.exp == sp.Rational(1, 2):
                out.append((e, e.base))
            elif isinstance(e, sp.sin):
                out.append((e, 1 - sp.cos(e.args[0]) ** 2))
        return out

    # -- polynomials

    def reduced(self, p: Any) -> Any:
        """Replace squares of generators that have a known value."""
        for generator, square in self.relations:
            k = self.ring.gens.index(generator)
            top = max((m[k] for m in p.itermonoms()), default=0)
            if top < 2:
                continue
            if square.denom != 1:
                raise ModelError(f"a root of a fraction, {generator.as_expr()}, is in the coefficients")
            out = self.ring.zero
            for m, c in p.iterterms():
                rest = (*m[:k], m[k] % 2, *m[k + 1 :])
                out += self.ring.from_dict({rest: c}) * square.numer ** (m[k] // 2)
            p = out
        return p

    def forms(self, p: Any) -> list[Any]:
        """Equal polynomials with even powers of cosines, or of sines, for each angle."""
        out = [p]
        for sine, square in self.relations:
            if square.denom != 1 or max((m[0] for m in square.numer.itermonoms()), default=0):
                continue
            cosine = self._cosine(sine)
            if cosine is not None:
                out += [self._with_sines(x, sine, cosine) for x in out]
        return out

    def _cosine(self, sine: Any) -> int | None:
        """Index of the generator that is the cosine of the same angle; None if there is none."""
        x = sine.as_expr()
        if not isinstance(x, self.sympy.sin):
            return None
        wanted = self.sympy.cos(x.args[0])
        return next((k for k, g in enumerate(self.ring.gens) if g.as_expr() == wanted), None)

    def _with_sines(self, p: Any, sine: Any, k: int) -> Any:
        out, one = self.ring.zero, self.ring.one - sine**2
        for m, c in p.iterterms():
            out += self.ring.from_dict({(*m[:k], m[k] % 2, *m[k + 1 :]): c}) * one ** (m[k] // 2)
        return out

    def cleared(self, row: Sequence[Any]) -> list[Any]:
        """A row of fractions as polynomials, multiplied by their common denominator."""
        common = self.ring.one
        for x in row:
            common = common.lcm(x.denom)
        return [self.reduced(x.numer * common.exquo(x.denom)) for x in row]

    def value(self, generator: Any) -> float:
        """Value of a generator with the parameters' own values."""
        (node,) = self.printer.back([generator], self.graph)
        return nominal_value(node)

    def number(self, p: Any) -> float:
        """Value of a polynomial without s, with the parameters' own values."""
        (node,) = self.printer.back([p.as_expr()], self.graph)
        return nominal_value(node)

    def by_powers(self, p: Any) -> list[Any]:
        """Coefficients of the powers of s, the highest first, without rounding terms."""
        degree = max((m[0] for m in p.itermonoms()), default=0)
        parts = [self.ring.zero for _ in range(degree + 1)]
        for m, c in p.iterterms():
            parts[degree - m[0]] += self.ring.from_dict({(0, *m[1:]): c})
        return [self._sound(x) for x in parts]

    def _sound(self, p: Any) -> Any:
        """Remove rounding terms: those with long numbers that are small compared with the others.

        They must also be negligible with the parameters' own values (1 for zeros), since coefficients of different
        parameters have different units.
        """
        long = [c for c in p.itercoeffs() if c.denominator > MAX_DENOMINATOR**2]
        if not long:
            return p
        values = [1.0 if self.ring.gens.index(g) == 0 else self.value(g.as_expr()) or 1.0 for g in self.ring.gens]
        size = {m: abs(float(c) * float(np.prod(np.power(values, m)))) for m, c in p.iterterms()}
        largest, most = max(size.values()), max(abs(float(c)) for c in p.itercoeffs())
        kept = {
            m: c
            for m, c in p.iterterms()
            if c.denominator <= MAX_DENOMINATOR**2
            or size[m] > ROUNDING_TOLERANCE * largest
            or abs(float(c)) > ROUNDING_TOLERANCE * most
        }
        return self.ring.from_dict(kept)


def cancel_common_factors(ring: PolynomialRing, num: Any, den: Any) -> tuple[Any, Any, Any]:
    """Cancel common factors: (numerator, denominator, common factor in s as a SymPy expression)."""
    common = num.gcd(den) if num else den
    num, den = num.exquo(common), den.exquo(common)
    _, s_part = common.as_expr(), ring.sympy.Integer(1)
    for factor, k in common.factor_list()[1]:
        if any(m[0] for m in factor.itermonoms()):
            s_part *= factor.as_expr() ** k
    return num, den, s_part


def readable_coefficients(ring: PolynomialRing, p: Any) -> list[Any]:
    """Coefficients of the powers of s, the highest first, factored, as SymPy expressions."""
    return [readable_polynomial(ring, x) for x in ring.by_powers(p)]


def readable_polynomial(ring: PolynomialRing, p: Any) -> Any:
    """A polynomial as a factored SymPy expression, in the form with sines or cosines that has fewer terms."""
    sp = ring.sympy
    forms = [ring.ring.one * x for x in ring.forms(p)]
    fewest = min(forms, key=lambda x: (len(x.factor_list()[1][-1][0]) if x.factor_list()[1] else 0, len(x)))
    found = sp.factor_terms(_factored_product(sp, fewest))
    for e in {e.args[0] for e in found.atoms(sp.sin, sp.cos)}:
        c, s = sp.cos(e), sp.sin(e)
        for a, b in ((c, s), (s, c)):
            found = found.subs((a - 1) * (a + 1), -(b**2))
    return _short_fractions(sp, found)


def _factored_product(sp: Any, p: Any) -> Any:
    """Factored polynomial; each factor has a positive first term."""
    constant, factors = p.factor_list()
    out = []
    for f, k in factors:
        if k % 2 and sum(1 if c > 0 else -1 for c in f.itercoeffs()) < 0:
            f, constant = -f, -constant
        out.append(f.as_expr() ** k)
    number = sp.Rational(int(constant.numerator), int(constant.denominator))
    return sp.Mul(number, *out)


def _short_fractions(sp: Any, x: Any) -> Any:
    """Long fractions as decimals."""
    long = {k for k in x.atoms(sp.Rational) if k.q > 1000 or abs(k.p) > 10**6}
    return x.xreplace({k: sp.Float(float(k), 17) for k in long})


def scale_fraction(ring: PolynomialRing, num: Any, den: Any) -> tuple[Any, Any]:
    """Remove the common rational factor and make the denominator's highest coefficient positive."""
    first = ring.by_powers(den)[0]
    lead = first.LC
    sign = 1 if ring.number(first) > 0.0 else -1
    whole = _content([*num.itercoeffs(), *den.itercoeffs()])
    by = sign / (whole if whole else abs(lead))
    return num.mul_ground(by), den.mul_ground(by)


def _content(numbers: Sequence[Any]) -> Any:
    """Greatest common divisor of fractions that makes them short integers; 0 if there is none."""
    from math import gcd, lcm

    above, below = 0, 1
    for c in numbers:
        above, below = gcd(above, int(c.numerator)), lcm(below, int(c.denominator))
    largest = max((abs(int(c.numerator)) * below // int(c.denominator) for c in numbers), default=0)
    if not above or largest // above > 10**4:
        return 0
    return type(next(iter(numbers)))(above) / below


MAX_ORDER = 24  # largest number of rows
MAX_TERMS = 20_000  # largest number of terms of a polynomial


def determinant(rows: Sequence[Sequence[Any]], ring: Any, what: str) -> Any:
    """Determinant of a matrix of polynomials.

    Expanded by rows, those with few entries first; repeated minors are computed once. Without division no coefficient
    grows beyond those of the minors.

    Parameters
    ----------
    rows : sequence (n) of sequences (n) of polynomials
    ring : PolynomialRing
    what : str
        Owner of the matrix, for messages.

    Raises
    ------
    ModelError
        If it is too large, with the size met.
    """
    n = len(rows)
    if n > MAX_ORDER:
        raise ModelError(
            f"the linear equations of {what} are {n} with their constraints, and transfer functions with symbols are "
            f"found up to {MAX_ORDER}: use numbers (linearize)"
        )
    order = sorted(range(n), key=lambda k: sum(bool(x) for x in rows[k]))
    sparse = [[(j, x) for j, x in enumerate(rows[k]) if x] for k in order]
    known: dict[int, Any] = {}

    def minor(k: int, used: int) -> Any:
        if k == n:
            return ring.ring.one
        found = known.get(used)
        if found is None:
            found = ring.ring.zero
            for j, x in sparse[k]:
                if not used >> j & 1:
                    rest = minor(k + 1, used | 1 << j)
                    if rest:
                        free_before = j - (used & ((1 << j) - 1)).bit_count()
                        found += -x * rest if free_before % 2 else x * rest
            found = known[used] = ring.reduced(found)
            if len(found) > MAX_TERMS:
                raise ModelError(
                    f"the determinant of the linear equations of {what} has minors of {len(found)} terms, and "
                    f"transfer functions with symbols are found up to {MAX_TERMS}: give numbers for some parameters, "
                    "or use numbers (linearize)"
                )
        return found

    value = minor(0, 0)
    return -value if is_odd_permutation(order) else value


def is_odd_permutation(order: Sequence[int]) -> bool:
    """Whether a permutation is odd."""
    seen: set[int] = set()
    swaps = 0
    for start in range(len(order)):
        k, length = start, 0
        while k not in seen:
            seen.add(k)
            k = order[k]
            length += 1
        swaps += max(length - 1, 0)
    return swaps % 2 == 1


class SignAnalysis:
    """Detection of polynomials that are positive because all their terms are."""

    def __init__(self, ring: PolynomialRing, positive: Sequence[str] | None) -> None:
        self.ring, sp = ring, ring.sympy
        self.known = []
        for g in ring.ring.gens[1:]:
            x = g.as_expr()
            own = positive is None or str(x) in positive or (x.is_Pow and x.exp == sp.Rational(1, 2))
            self.known.append(bool(own and (x == sp.pi or ring.value(x) > 0.0)))
        self.used: dict[Any, None] = {}

    def split(self, p: Any) -> tuple[int, list[Any]]:
        """(sign, factors of unknown sign) of a polynomial; (0, []) of zero."""
        if not p:
            return 0, []
        constant, factors = p.factor_list()
        sign, rest = 1 if constant > 0 else -1, []
        for f, k in factors:
            own = self.sign(f)
            if own:
                sign *= own**k
            elif k % 2:
                rest.append(f)
            else:
                rest.append(f * f)
        return sign, rest

    def known_of(self, p: Any) -> int:
        """1 or -1 if the product of the factors is known to be positive or negative; else 0."""
        sign, rest = self.split(p)
        return 0 if rest else sign

    def sign(self, p: Any) -> int:
        """1 or -1 if all terms have this sign, with sines or with cosines of the same angle; else 0."""
        if self._within_one(p):
            return 1 if p.evaluate([(g, 0) for g in self.ring.ring.gens]) > 0 else -1
        for x in self.ring.forms(p):
            found = self._of_terms(x)
            if found:
                return found
        return 0

    def _of_terms(self, p: Any) -> int:
        signs = {1 if c > 0 else -1 for c in p.itercoeffs()}
        used = {k for m in p.itermonoms() for k, e in enumerate(m[1:]) if e % 2}
        if len(signs) > 1 or not all(self.known[k] for k in used):
            return 0
        if all(any(e and not e % 2 and not self.known[k] for k, e in enumerate(m[1:])) for m in p.itermonoms()):
            return 0  # only squares of factors that may be zero
        self.used |= {self.ring.ring.gens[k + 1].as_expr(): None for k in used}
        return signs.pop()

    def _within_one(self, p: Any) -> bool:
        """Whether p is 1 + cos or 1 - cos, or the negative, of an angle whose sine is not zero."""
        sp, x = self.ring.sympy, p.as_expr()
        angles = [c for c in x.atoms(sp.cos) if sp.expand(x - c) in (1, -1) or sp.expand(x + c) in (1, -1)]
        gens = [g.as_expr() for g in self.ring.ring.gens[1:]]
        for c in angles:
            sine = sp.sin(c.args[0])
            if sine in gens and self.known[gens.index(sine)]:
                self.used[sine] = None
                return True
        return False


def inequality_sides(ring: PolynomialRing, signs: SignAnalysis, p: Any) -> tuple[Any, Any]:
    """Write p > 0 as (left, right) with left > right, both positive if their signs are known; else (p, 0)."""
    gens = ring.ring.gens
    for k in range(1, len(gens)):
        if max(m[k] for m in p.itermonoms()) == 1:
            own = ring.ring.from_dict({m: c for m, c in p.iterterms() if m[k]})
            rest = p - own
            a, b = signs.known_of(own), signs.known_of(rest)
            if a * b < 0:
                left, right = (own, -rest) if a > 0 else (rest, -own)
                return readable_polynomial(ring, left), readable_polynomial(ring, right)
    return readable_polynomial(ring, p), ring.sympy.Integer(0)
