"""Constraints as numbers at the start of a mechanism and near it."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ...analysis.linear.free import compared, gaps
from ...graph.values import evaluate, evaluated
from ...numerics.rank import TOLERANCE, null_space, parts, rank
from ...tables.names import velocity_names
from ...tracing.trace import Traced
from .constraints import Constraints
from .partition import Free, positions, singular
from .probe import Probe

STEP = 1e-2  # part of a radian, or of the mechanism's length, that it is moved by to see whether its rank is the usual
PASSES = 20
CLOSED = 1e-10  # of the mechanism's length


class Place:
    """Numbers at the start.

    Parameters
    ----------
    x : Traced
    c : Constraints
    start : mapping
        Numbers of time, coordinates and velocities by the names of their symbols; others are zero.
    """

    def __init__(self, x: Traced, c: Constraints, start: Mapping[str, float]) -> None:
        self.x, self.c = x, c
        others = {s.data.name: 0.0 for s in (*x.z, *x.lam, *x.loads)}
        self.values: dict[str, float] = others | {name: float(y) for name, y in start.items()}
        self.probe = Probe(self.values)
        length = float(getattr(x.system.scales.length, "value", x.system.scales.length))
        units = [n.unit for n in velocity_names(x.structure)]
        self.length = length
        self.scale = np.array([1.0 if u == "m" else 1.0 / length for u in units])
        self.G = self.jacobian(self.values)

    def jacobian(self, values: Mapping[str, float]) -> np.ndarray:
        """G there, with plain zeros for rounding."""
        G = np.array(evaluated(self.c.G, values), float).reshape(self.c.G.shape)
        size = np.abs(G * self.scale).max(axis=1, initial=0.0, keepdims=True)
        G[np.abs(G * self.scale) <= 1e-13 * size] = 0.0
        return G

    def refuse_singular(self, f: Free) -> None:
        """Refuse a start where the constraints lose rank.

        Raises
        ------
        SingularityError
            Naming the elements whose constraints depend on one another here and not nearby.
        """
        which = np.flatnonzero(self.c.holonomic)
        if not f.chosen or not len(which):
            return
        here = rank(compared(self.G[which], self.scale))
        rng = np.random.default_rng(0)
        for _ in range(2):
            G = self._nearby(rng, which)
            if G is not None and rank(compared(G, self.scale)) > here:
                raise singular(self._lost(self.G[which], G, which), self.values[self.x.t.data.name])

    def _nearby(self, rng: np.random.Generator, which: np.ndarray) -> np.ndarray | None:
        """Constraints on positions at the closed position near a random step away; None if none is found."""
        null = null_space(compared(self.G[which], self.scale))
        a = null @ rng.standard_normal(null.shape[1])
        step = STEP * self.scale * self.length * a / np.abs(a).max()
        values = dict(self.values)
        for _ in range(PASSES):
            self._moved(values, step)
            G = self.jacobian(values)[which]
            g = gaps(np.array(evaluate(list(self.c.g[which]), values), float), G, self.scale)
            if np.abs(g).max(initial=0.0) < CLOSED * self.length:
                return G
            step = -self.scale * np.linalg.lstsq(compared(G, self.scale), g, rcond=TOLERANCE)[0]
        return None

    def _moved(self, values: dict[str, float], step: np.ndarray) -> None:
        """Coordinates moved along the velocities; quaternions of unit length."""
        T = np.array(evaluated(self.x.T, values), float).reshape(self.x.T.shape)
        dq = T @ step
        names = [s.data.name for s in self.x.q]
        for q, v in positions(self.x.structure):
            moved = np.array([values[names[k]] + dq[k] for k in q])
            if len(q) > len(v):
                moved /= np.linalg.norm(moved)
            values |= {names[k]: float(y) for k, y in zip(q, moved, strict=True)}

    def _lost(self, here: np.ndarray, there: np.ndarray, which: np.ndarray) -> list[str]:
        """Elements whose rows take part in dependencies that are not there nearby."""
        y, span = parts(compared(here, self.scale)).dependencies, parts(compared(there, self.scale)).span
        part = np.abs(y @ (y.T @ span)).max(axis=1)
        found = [self.c.elements[k] for k, p in zip(which, part, strict=True) if p > 1e-3]
        return list(dict.fromkeys(found))
