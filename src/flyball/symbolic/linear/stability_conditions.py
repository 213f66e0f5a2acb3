"""Routh and Hurwitz conditions of stability as inequalities in the parameters.

The conditions are those of Lienard and Chipart (1914; Gantmacher, Theory of Matrices, vol. 2, XV, section 13). With
a_0 > 0 in a_0 s^n + ... + a_n all roots have negative real parts if and only if every second coefficient from a_n
down is positive (or a_n, and every second from a_n-1 down) and every second Hurwitz determinant, from the last but one
down. The characteristic polynomial is factored first: each factor must fulfil its own conditions.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ...expression_graph.graph import Node, evaluate
from .operating_point import Validity
from .polynomials import PolynomialRing, SignAnalysis, determinant, inequality_sides, readable_coefficients
from .transfer_functions import checked_values


@dataclass
class StabilityConditions:
    """Conditions for negative real parts of all eigenvalues, as inequalities in the parameters.

    Attributes
    ----------
    name : str
    conditions : tuple of sympy relations
        All must hold. Positive factors are left out; ``sympy.false`` if no parameters make it stable (no
        damping).
    positive : tuple of sympy.Expr
        Quantities assumed to be positive.
    factors : tuple of tuple of sympy.Expr
        Coefficients of the factors of the characteristic polynomial, the highest power first.
    zeros : int
        Number of eigenvalues that are zero for all parameters and left out: coordinates on which nothing depends.
    parameters : dict
        Name -> value.
    balanced_by : dict
        Parameter -> expression of the others, solved from the conditions of equilibrium.
    """

    name: str
    conditions: tuple[Any, ...]
    positive: tuple[Any, ...]
    factors: tuple[tuple[Any, ...], ...]
    zeros: int
    parameters: dict[str, float]
    balanced_by: dict[str, Node] = field(default_factory=dict)
    nodes: list[list[Node]] = field(default_factory=list, repr=False)  # coefficients of the factors
    described: list[Node] = field(default_factory=list, repr=False)  # left-hand sides of the conditions
    validity: Validity = field(default=Validity(), repr=False)

    def holds(self, **parameters: float) -> bool:
        """Whether it is stable with the parameters' own values, or others; identically zero eigenvalues are ignored.

        Raises
        ------
        ModelError
            If a parameter is unknown or determined by equilibrium, or the point is no equilibrium with it.
        """
        values = checked_values(self, parameters)
        return all(is_hurwitz(np.array(evaluate(a, values), float)) for a in self.nodes)

    def left_sides(self, **parameters: float) -> list[float]:
        """Values of the expressions that must be positive."""
        return [float(x) for x in evaluate(self.described, checked_values(self, parameters))]

    def lines(self) -> list[tuple[str, str]]:
        """Labels and texts of the report."""
        out = [("stable if", str(c)) for c in self.conditions] or [("stable", "always")]
        if any(c == False for c in self.conditions):  # noqa: E712 - SymPy's
            out = [("stable", "never: some motions are undamped or unstable")]
        if self.positive:
            out.append(("with", f"{', '.join(map(str, self.positive))} > 0"))
        if self.zeros:
            out.append(("aside", f"{self.zeros} eigenvalue{'s' * (self.zeros > 1)} zero for all parameters"))
        return out

    def latex(self) -> str:
        """The conditions as LaTeX, one a line."""
        from sympy import latex

        return r" \\ ".join(latex(c) for c in self.conditions)

    def _repr_latex_(self) -> str:
        return rf"$\displaystyle \begin{{gathered}} {self.latex()} \end{{gathered}}$"

    def __repr__(self) -> str:
        return "\n".join(f"{a}: {b}" for a, b in self.lines())


def is_hurwitz(a: np.ndarray) -> bool:
    """Whether all roots of a polynomial have negative real parts, by Routh's array."""
    a = a / a[0]
    rows = [a[0::2].astype(float), np.zeros(len(a[0::2]))]
    rows[1][: len(a[1::2])] = a[1::2]
    for _ in range(len(a) - 1):
        if not rows[1][0] > 0.0:
            return False
        f = rows[0][0] / rows[1][0]
        rows = [rows[1], np.r_[rows[0][1:] - f * rows[1][1:], 0.0]]
    return True


def stability_conditions(
    ring: PolynomialRing,
    p: Any,
    name: str,
    parameters: tuple[dict[str, float], dict[str, Node]],
    positive: Sequence[str] | None,
) -> StabilityConditions:
    """Conditions for negative real parts of all roots of a polynomial in s, except zero roots.

    Parameters
    ----------
    ring : PolynomialRing
    p : polynomial
    name : str
    parameters : (dict, dict)
        Values of the parameters, and expressions of those determined by equilibrium.
    positive : sequence of str, optional
        Positive parameters; by default all that are positive now.
    """
    signs = SignAnalysis(ring, positive)
    zeros, factors = 0, []
    for f, k in p.factor_list()[1]:
        degree = max(m[0] for m in f.itermonoms())
        if degree == 1 and f == ring.ring.gens[0]:
            zeros = k
        elif degree:
            factors.append(f if ring.number(ring.by_powers(f)[0]) > 0.0 else -f)
    found: dict[Any, None] = {}
    for f in factors:
        for x in _conditions(ring, signs, ring.by_powers(f), name):
            found[x] = None
    sp = ring.sympy
    graph = ring.graph
    told = [readable_coefficients(ring, f) for f in factors]
    relations = [sp.false if not x else sp.Gt(*inequality_sides(ring, signs, x)) for x in found]
    relations = [x for x in relations if x is not sp.true]
    left = [sp.Integer(0) if x is sp.false else x.lhs - x.rhs for x in relations]
    return StabilityConditions(
        name,
        tuple(relations),
        tuple(sorted(signs.used, key=str)),
        tuple(map(tuple, told)),
        zeros,
        *parameters,
        [ring.printer.back(x, graph) for x in told],
        ring.printer.back(left, graph),
    )


def _conditions(ring: PolynomialRing, signs: SignAnalysis, a: list[Any], name: str) -> list[Any]:
    """Polynomials that must be positive."""
    n = len(a) - 1
    minors = [_minor(ring, a, k, name) for k in range(n - 1, 1, -2)]
    choices = []
    for first in (n - 2, n - 1):
        wanted = [a[0], a[n], *(a[k] for k in range(first, 0, -2)), *minors]
        if n - 1 == 1 or (n - 1) % 2:  # the first of Hurwitz's determinants is a_1
            wanted.append(a[1])
        left: dict[Any, None] = {}
        for x in wanted:
            left |= dict.fromkeys(_required_conditions(ring, signs, x))
        choices.append(list(left))
    return min(choices, key=lambda x: (len(x), sum(map(len, x))))


def _required_conditions(ring: PolynomialRing, signs: SignAnalysis, x: Any) -> list[Any]:
    """Factors that must be positive for a polynomial to be positive; zero if it never is."""
    sign, rest = signs.split(x)
    if sign == 0 or (sign < 0 and not rest):
        return [ring.ring.zero]
    if not rest:
        return []
    out = ring.ring.one
    for f in rest:
        out = out * f
    out = ring.reduced(out if sign > 0 else -out)
    return [out.mul_ground(1 / abs(out.content() if has_short_numbers(out) else out.LC))]


def has_short_numbers(p: Any) -> bool:
    """Whether the numbers in a polynomial are short."""
    return all(len(str(c.numerator)) + len(str(c.denominator)) < 12 for c in p.itercoeffs())


def _minor(ring: PolynomialRing, a: list[Any], k: int, name: str) -> Any:
    """Hurwitz determinant of k rows."""
    zero = ring.ring.zero
    rows = [[a[2 * (j + 1) - (i + 1)] if 0 <= 2 * (j + 1) - (i + 1) < len(a) else zero for j in range(k)]
            for i in range(k)]  # fmt: skip
    return determinant(rows, ring, name)
