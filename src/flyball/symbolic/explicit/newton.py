"""Numbers for what is defined by equations: Newton's method from where the mechanism was last, on the drawn branch.

The way from there is cut where Newton's method does not follow it, and the sign of the Jacobian's determinant is kept:
where it changes the branch ends (a dead centre), and no other is taken.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ...errors import AnalysisError, SingularityError
from ...graph.derivative import jacobian
from ...graph.node import Node
from ...graph.values import evaluate, symbols
from .definition import Definition

STEPS = 30
CLOSED = 1e-13  # change of the unknowns, relative to their size
NEAR = 0.5  # rad or m: a longer step of the unknowns is cut
SHORTEST = 1e-6  # part of the way


class Implicit:
    """Unknowns of one definition as a function of what its equations hold.

    Parameters
    ----------
    definition : Definition
    start : mapping
        Numbers of all symbols where the branch is known.
    """

    def __init__(self, definition: Definition, start: Mapping[str, float]) -> None:
        self.unknowns = [x.data.name for x in definition.symbols]
        self._nodes = [*definition.residuals, *jacobian(definition.residuals, definition.symbols).ravel()]
        self._given = [x.data.name for x in symbols(self._nodes) if x.data.name not in self.unknowns]
        self._own = {x.data.name: x.value for x in symbols(self._nodes) if not x.moving}
        at = {n: float(start.get(n, self._own.get(n, 0.0))) for n in self._given}
        self._w = np.array([start.get(n, 0.0) for n in self.unknowns])
        found = self._newton(at, self._w)
        if found is None:
            raise AnalysisError(f"no {', '.join(self.unknowns)} fulfil their equations at the start")
        self._at, (self._w, self._sign) = at, found
        if self._sign == 0.0:
            raise SingularityError(f"{', '.join(self.unknowns)} are not determined at the start: it is singular")
        self._first = self._at, self._w

    def __call__(self, values: Mapping[str, Any]) -> dict[str, float]:
        """Their values.

        Raises
        ------
        SingularityError
            If the branch ends before.
        """
        there = {n: float(values.get(n, self._own.get(n, 0.0))) for n in self._given}
        w = self._follow(there, self._at, self._w)
        if w is None:
            w = self._follow(there, *self._first)
        if w is None:
            known = ", ".join(f"{n} = {x:.6g}" for n, x in there.items() if n not in self._own)
            raise SingularityError(
                f"{', '.join(self.unknowns)} cannot be followed to {known}: the mechanism does not close there, or "
                "there is a singular position on the way"
            )
        self._at, self._w = there, w
        return dict(zip(self.unknowns, w.tolist(), strict=True))

    def _follow(self, there: dict[str, float], at: dict[str, float], w: np.ndarray) -> np.ndarray | None:
        done, part = 0.0, 1.0
        while done < 1.0:
            to = min(done + part, 1.0)
            way = there if to == 1.0 else {n: at[n] + to * (there[n] - at[n]) for n in there}
            found = self._newton(way, w)
            if found is not None and found[1] == self._sign and np.abs(found[0] - w).max() <= NEAR:
                w, done, part = found[0], to, 2.0 * part
            else:
                part *= 0.5
                if part < SHORTEST:
                    return None
        return w

    def _newton(self, at: Mapping[str, float], w: np.ndarray) -> tuple[np.ndarray, float] | None:
        n = len(w)
        w = w.copy()
        last = np.inf
        for _ in range(STEPS):
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
            if size <= CLOSED or (size <= 1e-9 and size >= 0.25 * last):
                return w, float(np.linalg.slogdet(J)[0])
            last = size
        return None


def unknown(nodes: Sequence[Any], definitions: Sequence[Definition]) -> list[Node]:
    """Symbols of these definitions that expressions hold."""
    held = {x.index for x in symbols(nodes)}
    return [w for d in definitions for w in d.symbols if w.index in held]
