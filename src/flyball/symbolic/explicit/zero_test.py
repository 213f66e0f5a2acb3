"""Whether expressions are equal or zero, decided by their values at random points.

An expression that is zero at several random points is zero (Schwartz 1980, Zippel 1979, for polynomials; all
expressions here are polynomials in sines and cosines of the coordinates). The size of the cancelling terms separates
zero from rounding.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ...expression_graph.evaluation import evaluate
from ...expression_graph.graph import CALL, NUMBER, OPERATIONS, SYMBOL, Node
from .definitions import new_nodes

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
