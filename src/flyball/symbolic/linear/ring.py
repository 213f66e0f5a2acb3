"""Polynomials in s and in the parameters: expressions taken into a ring in which sums and products are exact.

What is no polynomial (sines, roots, functions that are known by name) becomes a generator of its own; sines and cosines
of sums are expanded, and squares that stand for something else (sin^2, roots) are replaced.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ...errors import ModelError
from ...graph.node import Graph, Node
from ...graph.printers.sympy import SHORT, SympyPrinter, fraction
from ...graph.values import reached
from .solve import number

MOST = 4000  # operations in the entries of a matrix
JUNK = 1e-12  # part of the largest term of a polynomial below which one with a long number is rounding


class Ring:
    """The polynomials that the entries of some matrices are made of.

    Parameters
    ----------
    matrices : sequence of ndarray
        Of nodes or numbers.
    what : str
        Whose they are, for messages.
    positive : collection of str
        Parameters that are greater than zero, so that a root of their square is theirs.

    Raises
    ------
    ModelError
        If they are too large, with the size met.
    """

    def __init__(self, matrices: Sequence[np.ndarray], what: str, positive: Sequence[str]) -> None:
        flat = [x for X in matrices for x in X.ravel()]
        count = len(reached(flat))
        if count > MOST:
            raise ModelError(
                f"the linear equations of {what} have {count} operations in their coefficients, and transfer functions "
                f"with symbols are found up to {MOST}: ask for numbers (linearize), or give numbers for parameters"
            )
        self.graph = next((x.graph for x in flat if isinstance(x, Node)), None) or Graph()  # where expressions live
        self.printer = SympyPrinter(positive=positive)
        self.sympy = sp = self.printer.sympy
        self.s = sp.Symbol("s")
        self.own: dict[Any, float] = {}  # values of symbols
        texts = [self._tidy(self.printer(x)) for x in flat]
        self.own = {k: number(x) for k, x in self.printer.symbols.items()}
        self.ring, self.relations, elements = self._elements(texts)
        self.matrices = []
        at = 0
        for X in matrices:
            self.matrices.append(np.array([*elements[at : at + X.size], None], object)[:-1].reshape(X.shape))
            at += X.size

    def _tidy(self, x: Any) -> Any:
        """Numbers as roots where they are, roots of squares taken, sines of sums expanded."""
        sp = self.sympy
        x = sp.sympify(x)
        if x.has(sp.Float):
            x = x.xreplace({f: self._exact(f) for f in x.atoms(sp.Float)})
        if x.has(sp.sin, sp.cos, sp.tan):
            x = sp.expand_trig(x.rewrite(sp.tan, sp.sin) if x.has(sp.tan) else x)
        return x.replace(lambda e: e.is_Pow and e.exp.is_Rational and e.exp.q == 2, self._root)

    def _root(self, x: Any) -> Any:
        """An odd power of a root: of a base in which sines and cosines are one where they can be."""
        sp = self.sympy
        return sp.sqrt(sp.factor(sp.trigsimp(sp.together(x.base)))) ** (2 * x.exp)

    def _exact(self, x: Any) -> Any:
        """A number as the root of a short fraction, if it is one; else by its digits."""
        sp = self.sympy
        value = float(x)
        square = fraction(value * value)
        if square is not None and square.denominator <= SHORT:
            root = sp.sqrt(sp.Rational(square.numerator, square.denominator))
            return root if value > 0.0 else -root
        return sp.Rational(repr(value))

    def _elements(self, texts: Sequence[Any]) -> tuple[Any, list[Any], list[Any]]:
        """The field of fractions, what squares stand for, and the entries as its elements."""
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
        """Generators besides symbols: roots first, then functions."""
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
        """Generators, those first that stand for more."""
        sp = self.sympy
        kernels = self._kernels(texts)
        symbols = {y for x in texts for y in x.free_symbols} | {y for k in kernels for y in k.free_symbols}
        numbers_ = [sp.pi] if any(x.has(sp.pi) for x in (*texts, *kernels)) else []
        return [self.s, *kernels, *sorted(symbols, key=lambda y: y.name), *numbers_]

    def _squares(self, texts: Sequence[Any]) -> list[tuple[Any, Any]]:
        """(generator, what its square is): roots, and sines."""
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
        """A polynomial without squares of generators that stand for something else."""
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
        """The same polynomial with even powers of cosines, or of sines, of each angle."""
        out = [p]
        for sine, square in self.relations:
            if square.denom != 1 or max((m[0] for m in square.numer.itermonoms()), default=0):
                continue
            cosine = self._cosine(sine)
            if cosine is not None:
                out += [self._with_sines(x, sine, cosine) for x in out]
        return out

    def _cosine(self, sine: Any) -> int | None:
        """Which generator is the cosine of the same angle."""
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
        """A row of fractions as polynomials: times what clears their denominators."""
        common = self.ring.one
        for x in row:
            common = common.lcm(x.denom)
        return [self.reduced(x.numer * common.exquo(x.denom)) for x in row]

    def value(self, generator: Any) -> float:
        """Of a generator, with the parameters' own values."""
        (node,) = self.printer.back([generator], self.graph)
        return number(node)

    def number(self, p: Any) -> float:
        """Of a polynomial without s, with the parameters' own values."""
        (node,) = self.printer.back([p.as_expr()], self.graph)
        return number(node)

    def by_powers(self, p: Any) -> list[Any]:
        """Coefficients of s, the highest power first; each without its rounding."""
        degree = max((m[0] for m in p.itermonoms()), default=0)
        parts = [self.ring.zero for _ in range(degree + 1)]
        for m, c in p.iterterms():
            parts[degree - m[0]] += self.ring.from_dict({(0, *m[1:]): c})
        return [self._sound(x) for x in parts]

    def _sound(self, p: Any) -> Any:
        """Without terms that rounding left: with long numbers that are nothing beside the others.

        Nothing with the parameters' own values (one, where that is zero) either: a coefficient of other parameters has
        another unit.
        """
        long = [c for c in p.itercoeffs() if c.denominator > SHORT**2]
        if not long:
            return p
        values = [1.0 if self.ring.gens.index(g) == 0 else self.value(g.as_expr()) or 1.0 for g in self.ring.gens]
        size = {m: abs(float(c) * float(np.prod(np.power(values, m)))) for m, c in p.iterterms()}
        largest, most = max(size.values()), max(abs(float(c)) for c in p.itercoeffs())
        kept = {
            m: c
            for m, c in p.iterterms()
            if c.denominator <= SHORT**2 or size[m] > JUNK * largest or abs(float(c)) > JUNK * most
        }
        return self.ring.from_dict(kept)
