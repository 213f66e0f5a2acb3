"""Definitions of dependent quantities: formulas, or equations that Newton's method solves; test of equality by values.

The path from the last position is subdivided where Newton's method does not converge. The sign of the Jacobian's
determinant must not change: where it does, the branch ends (a dead centre), and no other branch is taken.

An expression that is zero at several random points is zero (Schwartz 1980, Zippel 1979, for polynomials; all
expressions here are polynomials in sines and cosines of the coordinates). The size of the cancelling terms separates
zero from rounding.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...derivatives.linearized_equations import product
from ...errors import AnalysisError, SingularityError
from ...expression_graph.graph import CALL, NUMBER, OPERATIONS, SYMBOL, Node, evaluate, jacobian, symbols_of
from .linear_systems import Determinants, solve_blocks

RANDOM_POINTS = 5
ZERO_TOLERANCE = 1e-11  # values below this part of the cancelling terms are rounding
# Random relative change of parameters: an identity must not depend on their own values.
PARAMETER_VARIATION = 1e-3


class Probe:
    """Random values of all symbols, near initial ones."""

    def __init__(self, start: Mapping[str, float], seed: int = 0) -> None:
        self.start = start
        self._random = np.random.default_rng(seed)
        self._known: dict[int, Any] = {}

    def values(self, nodes: Sequence[Any]) -> np.ndarray:
        """Values of expressions, (expressions, points)."""
        known = self._known
        for x in new_nodes(nodes, known):
            if x.op == NUMBER:
                known[x.index] = x.value
            elif x.op == SYMBOL:
                known[x.index] = self._of(x)
            else:
                args = [known[a.index] for a in x.args]
                known[x.index] = x.data(*args) if x.op == CALL else OPERATIONS[x.op](*args)
        found = [known[x.index] if isinstance(x, Node) else x for x in nodes]
        return np.array([np.broadcast_to(np.asarray(x, float), RANDOM_POINTS) for x in found]).reshape(
            len(nodes), RANDOM_POINTS
        )

    def _of(self, x: Node) -> np.ndarray:
        around = self._random.uniform(-1.0, 1.0, RANDOM_POINTS)
        if not x.moving:
            return x.value * (1.0 + PARAMETER_VARIATION * around) if x.value else PARAMETER_VARIATION * around
        return self.start.get(x.data.name, 0.0) + around

    def zero(self, x: Any, size: float = 0.0) -> bool:
        """Whether an expression is zero, compared with ``size`` and with the terms of its sum."""
        if not isinstance(x, Node) or x.op == NUMBER:
            return abs(float(x)) <= ZERO_TOLERANCE * size
        with np.errstate(all="ignore"):
            value = np.abs(self.values([x])[0]).max()
            return bool(value <= ZERO_TOLERANCE * max(size, self._terms(x)))

    def _terms(self, x: Node) -> float:
        """Largest term of a sum."""
        found, to_see = [], [x]
        while to_see:
            y = to_see.pop()
            if y.op == "add":
                to_see.extend(y.args)
            else:
                found.append(y)
        return float(np.abs(self.values(found)).max()) if len(found) > 1 else 0.0

    def size(self, x: Any) -> float:
        """Largest value of an expression or of the terms of its sum."""
        if not isinstance(x, Node):
            return abs(float(x))
        with np.errstate(all="ignore"):
            return max(float(np.abs(self.values([x])).max()), self._terms(x))

    def zero_if_negligible(self, x: Any, size: float) -> Any:
        """The expression, or 0 if it is zero compared with ``size``."""
        return 0.0 if self.zero(x, size) else x

    def simplest(self, x: Any) -> Any:
        """The expression, or a number if it equals an integer everywhere."""
        if not isinstance(x, Node):
            return x
        found = self.values([x])[0]
        whole = round(float(found[0])) if np.isfinite(found[0]) else 0
        return float(whole) if whole and np.abs(found - whole).max() <= ZERO_TOLERANCE * abs(whole) else x

    def set_initial(self, name: str, value: float) -> None:
        """Set the initial value of another symbol."""
        self.start = {**self.start, name: value}

    def at_start(self, x: Any) -> float:
        """Initial value, with the parameters' own values."""
        return float(evaluate([x], self.start)[0])

    def same(self, x: Any, y: Any, size: float = 0.0) -> bool:
        """Whether two expressions are equal."""
        return x is y or self.zero(x - y, size)

    def cleaned(self, A: np.ndarray) -> np.ndarray:
        """The matrix with 0 for entries that are zero compared with the largest of their row."""
        out = A.copy()
        flat = [x if isinstance(x, Node) else float(x) for x in A.ravel()]
        with np.errstate(all="ignore"):
            size = np.abs(self.values(flat)).max(axis=1, initial=0.0).reshape(A.shape)
        nothing = (
            size <= ZERO_TOLERANCE * size.max(axis=1, initial=0.0, keepdims=True) if A.size else np.zeros(A.shape, bool)
        )
        out[nothing] = 0.0
        return out


@dataclass(frozen=True)
class Definition:
    """Definition of symbols in terms of symbols that are known before.

    Attributes
    ----------
    symbols : tuple of Node
    values : tuple of Node
        Formulas; if empty, ``residuals`` determine the symbols.
    residuals : tuple of Node
        Expressions that vanish; as many as symbols.
    how : str
        Form of the equation, and the branch.
    radius : Node or number, optional
        sqrt(x^2 + y^2) of a formula atan2(y, x), if known.
    """

    symbols: tuple[Node, ...]
    values: tuple[Any, ...] = ()
    residuals: tuple[Any, ...] = ()
    how: str = ""
    radius: Any = None

    @property
    def closed(self) -> bool:
        """Whether there are formulas."""
        return bool(self.values)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the defined symbols."""
        return tuple(x.data.name for x in self.symbols)


class FormulaSubstitution:
    """Substitutes formulas for symbols in expressions; each node of the graph is processed once.

    Parameters
    ----------
    definitions : sequence of Definition
        Each depends on earlier ones only.

    Attributes
    ----------
    implicit : list of Definition
        Definitions without formulas, with all formulas substituted in their equations.
    """

    def __init__(self, definitions: Sequence[Definition]) -> None:
        self._known: dict[int, Node] = {}
        self.implicit: list[Definition] = []
        for d in definitions:
            if d.closed:
                found = self([d.symbols[0].graph.node(y) for y in d.values])
                self._known |= {s.index: y for s, y in zip(d.symbols, found, strict=True)}
            else:
                gaps = self([d.symbols[0].graph.node(y) for y in d.residuals])
                self.implicit.append(Definition(d.symbols, (), tuple(gaps), d.how))

    def __call__(self, nodes: Sequence[Any]) -> list[Any]:
        """Substitute all symbols that have a formula."""
        for x in new_nodes(nodes, self._known):
            args = tuple(self._known[a.index] for a in x.args)
            same = all(a is b for a, b in zip(args, x.args, strict=True))
            self._known[x.index] = x if same else x.graph.rebuilt(x, args)
        return [self._known[x.index] if isinstance(x, Node) else x for x in nodes]


def new_nodes(nodes: Sequence[Any], known: Mapping[int, Any]) -> list[Node]:
    """Nodes of expressions that are not in ``known``, in an order of evaluation."""
    found: dict[int, Node] = {}
    to_see = [x for x in nodes if isinstance(x, Node)]
    while to_see:
        x = to_see.pop()
        if x.index not in found and x.index not in known:
            found[x.index] = x
            to_see.extend(x.args)
    return [found[k] for k in sorted(found)]


def implicit_rates(
    definitions: Sequence[Definition], by: Sequence[Node], dets: Determinants
) -> list[tuple[Node, list[Any]]]:
    """Derivatives of symbols without formulas: dw/du = -(dr/dw)^-1 dr/du, one after the other.

    Parameters
    ----------
    definitions : sequence of Definition
        Definitions without formulas: see `FormulaSubstitution`.
    by : sequence of Node
        Symbols.

    Returns
    -------
    list of (symbol, derivatives by each of these)
    """
    found: list[tuple[Node, list[Any]]] = []
    for d in definitions:
        own, others = jacobian(d.residuals, d.symbols), jacobian(d.residuals, by)
        if found:
            before = jacobian(d.residuals, [w for w, _ in found])
            others = others + product(before, np.array([row for _, row in found], object))
        X = solve_blocks(own, others, dets)
        found += [(w, [-y for y in row]) for w, row in zip(d.symbols, X, strict=True)]
    return found


MAX_STEPS = 30
CLOSURE_TOLERANCE = 1e-13  # change of the unknowns, relative to their size
NEAR_SOLUTION = 0.5  # longest step of the unknowns [rad or m]
SHORTEST_STEP = 1e-6  # relative to the path


class ImplicitSolver:
    """Newton solver for the unknowns of one definition as functions of its other symbols.

    Parameters
    ----------
    definition : Definition
    start : mapping
        Values of all symbols at a known point of the branch.
    """

    def __init__(self, definition: Definition, start: Mapping[str, float]) -> None:
        self.unknowns = [x.data.name for x in definition.symbols]
        self._nodes = [*definition.residuals, *jacobian(definition.residuals, definition.symbols).ravel()]
        self._given = [x.data.name for x in symbols_of(self._nodes) if x.data.name not in self.unknowns]
        self._own = {x.data.name: x.value for x in symbols_of(self._nodes) if not x.moving}
        at = {n: float(start.get(n, self._own.get(n, 0.0))) for n in self._given}
        self._w = np.array([start.get(n, 0.0) for n in self.unknowns])
        found = self._newton(at, self._w)
        if found is None:
            raise AnalysisError(f"no {', '.join(self.unknowns)} satisfy their equations at the start")
        self._at, (self._w, self._sign) = at, found
        if self._sign == 0.0:
            raise SingularityError(f"{', '.join(self.unknowns)} are not determined at the start: it is singular")
        self._first = self._at, self._w

    def __call__(self, values: Mapping[str, Any]) -> dict[str, float]:
        """Values of the unknowns.

        Raises
        ------
        SingularityError
            If the branch ends on the way.
        """
        there = {n: float(values.get(n, self._own.get(n, 0.0))) for n in self._given}
        w = self._follow(there, self._at, self._w)
        if w is None:
            w = self._follow(there, *self._first)
        if w is None:
            known = ", ".join(f"{n} = {x:.6g}" for n, x in there.items() if n not in self._own)
            raise SingularityError(
                f"{', '.join(self.unknowns)} cannot be followed to {known}: the mechanism does not close there, or "
                "passes a singular position"
            )
        self._at, self._w = there, w
        return dict(zip(self.unknowns, w.tolist(), strict=True))

    def _follow(self, there: dict[str, float], at: dict[str, float], w: np.ndarray) -> np.ndarray | None:
        done, part = 0.0, 1.0
        while done < 1.0:
            to = min(done + part, 1.0)
            way = there if to == 1.0 else {n: at[n] + to * (there[n] - at[n]) for n in there}
            found = self._newton(way, w)
            if found is not None and found[1] == self._sign and np.abs(found[0] - w).max() <= NEAR_SOLUTION:
                w, done, part = found[0], to, 2.0 * part
            else:
                part *= 0.5
                if part < SHORTEST_STEP:
                    return None
        return w

    def _newton(self, at: Mapping[str, float], w: np.ndarray) -> tuple[np.ndarray, float] | None:
        n = len(w)
        w = w.copy()
        last = np.inf
        for _ in range(MAX_STEPS):
            found = evaluate(self._nodes, {**at, **dict(zip(self.unknowns, w.tolist(), strict=True))})
            r, J = np.array(found[:n], float), np.array(found[n:], float).reshape(n, n)
            if not (np.isfinite(r).all() and np.isfinite(J).all()):
                return None
            try:
                step = np.linalg.solve(J, r)
            except np.linalg.LinAlgError:
                return None
            w -= step
            size = float(np.abs(step).max() / (1.0 + np.abs(w).max()))
            if size <= CLOSURE_TOLERANCE or (size <= 1e-9 and size >= 0.25 * last):
                return w, float(np.linalg.slogdet(J)[0])
            last = size
        return None
