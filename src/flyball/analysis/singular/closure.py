"""The closure equations of a driven mechanism, F(x) = (g(q), c(q) - a) = 0 of x = (q, a), near any of their points.

The driver's law has given way to the parameter a, the value of its coordinate c. Steps d = (velocities, a) are made
without dimension: lengths are divided by the mechanism's, angles are in radians, and so are rows. F is a function of
the step d from a point, F(x + d), on flat space; its first two derivatives at d = 0 are what the compiled system gives:
J = [G | -e], and F''[d, d] = -gamma at the velocity d, since a velocity that stays constant is a straight step to
second order. Higher ones come from F itself along a polynomial of d, sampled and fitted to rounding.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ...equations.tree import retract
from ...tables.system import PLANAR
from ..compiled import Compiled
from ..steps import tangent_step

CLOSED = 1e-11  # what Newton's method may leave of F
PASSES = 30
WIDE = 0.3  # the largest part of a sampled step [1]
SAMPLES = 17
NONE = 1e-11  # a singular value below this part of the largest is none


class Place(NamedTuple):
    """A point of the curve: coordinates, the driver's coordinate in its own unit, turns and places on curves."""

    q: np.ndarray
    a: float
    z: np.ndarray


@dataclass(frozen=True)
class Rank:
    """Singular value decomposition of J: U diag(values) V^T, all columns."""

    U: np.ndarray
    values: np.ndarray  # as many as J has columns; missing rows count as zero
    V: np.ndarray

    def below(self, limit: float) -> int:
        """How many dimensions the kernel has, values below ``limit`` counted as zero."""
        return int((self.values < limit).sum())


class Closure:
    """F, its derivatives, and Newton's method; the last component of every step is the driver's."""

    def __init__(self, c: Compiled, rows: int, drive: int) -> None:
        s = c.structure
        self.c, self.rows, self.drive = c, rows, drive
        length = c.values.length
        self.scale = c.sizes
        units = {t.row: t.formula.measure for t in s.terms if not t.measured}
        self.row_scale = np.array([1.0 / length if units[k] == "m" else 1.0 for k in range(len(s.rows))])
        self.used = np.r_[np.arange(rows), drive]
        self.turning = bool(s.rows[drive].wrap)
        self.unit = 1.0 if self.turning or units[drive] != "m" else length  # of the driver's coordinate

    @property
    def columns(self) -> int:
        """Number of components of a step."""
        return len(self.scale) + 1

    def moved(self, x: Place, d: np.ndarray) -> Place:
        """The point a step d away."""
        q = x.q.copy()
        retract(self.c.values.system, q, d[:-1] * self.scale)
        return Place(q, x.a + float(d[-1]) * self.unit, x.z)

    def at(self, x: Place) -> Place:
        """The point with its turns and places brought up to date."""
        return self.evaluated(x, np.zeros(len(self.scale)))

    def evaluated(self, x: Place, v: np.ndarray) -> Place:
        """The same with kinematics and rows at the velocities v left in the compiled system."""
        self.c.z = x.z.copy()
        self.c.at(0.0, x.q, v)
        return Place(x.q, x.a, self.c.z.copy())

    def residual(self, x: Place, v: np.ndarray | None = None) -> np.ndarray:
        """F at a point."""
        self.evaluated(x, np.zeros(len(self.scale)) if v is None else v)
        F = self.c.work.rows.value[self.used] * self.row_scale[self.used]
        gap = self.c.work.rows.value[self.drive] - x.a
        F[-1] = (np.arctan2(np.sin(gap), np.cos(gap)) if self.turning else gap) / self.unit
        return F

    def jacobian(self, x: Place) -> np.ndarray:
        """J = [G | -e] at a point."""
        self.at(x)
        G = self.c.jacobian()[self.used] * self.row_scale[self.used][:, None] * self.scale
        G[-1] *= 1.0 / self.unit / self.row_scale[self.drive]
        J = np.zeros((len(self.used), self.columns))
        J[:, :-1] = G
        J[-1, -1] = -1.0
        return J

    def rank(self, x: Place) -> Rank:
        """Singular values and vectors of J at a point."""
        J = self.jacobian(x)
        U, s, Vt = np.linalg.svd(J, full_matrices=True)
        values = np.zeros(self.columns)
        values[: len(s)] = s
        return Rank(U, values, Vt.T)

    def second(self, x: Place, d: np.ndarray) -> np.ndarray:
        """F''[d, d], exactly: minus gamma at the velocity d."""
        self.evaluated(x, d[:-1] * self.scale)
        out = -self.c.work.rows.gamma[self.used] * self.row_scale[self.used]
        out[-1] *= 1.0 / self.unit / self.row_scale[self.drive]
        return out

    def mixed(self, x: Place, d: np.ndarray, e: np.ndarray) -> np.ndarray:
        """F''[d, e], by polarisation."""
        return 0.25 * (self.second(x, d + e) - self.second(x, d - e))

    def along(self, x: Place, coefficients: list[np.ndarray]) -> np.ndarray:
        """Taylor coefficients (SAMPLES, rows) of F along the curve d(s) = sum of coefficients[k] s^(k+1) from x."""
        size = max(np.abs(c).max() ** (1.0 / (k + 1)) for k, c in enumerate(coefficients))
        h = WIDE / max(size, 1e-12)
        nodes = np.cos(np.pi * (np.arange(SAMPLES) + 0.5) / SAMPLES)
        powers = np.arange(1, len(coefficients) + 1)
        F = [self.residual(self.moved(x, np.array(coefficients).T @ (h * u) ** powers)) for u in nodes]
        series = np.polynomial.chebyshev.chebfit(nodes, np.array(F), SAMPLES - 1)
        return _to_powers(SAMPLES) @ series / h ** np.arange(SAMPLES)[:, None]

    def close(self, x: Place, kept: int | None = None) -> tuple[Place, Rank, float] | None:
        """The nearest point of the curve, by Newton's method: it, its rank, and how far it was; None if there is none.

        ``kept`` singular values count (all but one if not told), so that what redundancy leaves out is left out.
        """
        kept = self.columns - 1 if kept is None else kept
        total = 0.0
        last = np.inf
        for _ in range(PASSES):
            r = self.rank(x)
            F = self.residual(x)
            n = min(kept, int((r.values > NONE * r.values[0]).sum()))
            d = -r.V[:, :n] @ ((r.U[:, :n].T @ F) / r.values[:n])
            size = float(np.abs(d).max())
            if not np.isfinite(size) or size > 0.5:
                return None
            x = self.at(self.moved(x, d))
            total += float(np.linalg.norm(d))
            if size < 1e-14 or (size < 1e-9 and size > 0.3 * last):
                break
            last = size
        if np.abs(self.residual(x)).max() > CLOSED:
            return None
        return x, self.rank(x), total

    def way(self, x: Place, y: Place) -> np.ndarray:
        """The step from x to y; whole turns do not count."""
        S = self.c.values.system
        d = np.append(tangent_step(self.c, x.q, y.q), y.a - x.a)
        for b in range(len(S.tree.parent)):
            if S.tree.joint[b] == PLANAR:
                turn = S.tree.v[b] + 2
                d[turn] = np.arctan2(np.sin(d[turn]), np.cos(d[turn]))
        d[:-1] /= self.scale
        if self.turning:
            d[-1] = np.arctan2(np.sin(d[-1]), np.cos(d[-1]))
        d[-1] /= self.unit
        return d


def _to_powers(n: int) -> np.ndarray:
    """Coefficients of powers from those of Chebyshev polynomials, (n, n)."""
    T = np.zeros((n, n))
    T[0, 0] = T[1, 1] = 1.0
    for k in range(2, n):
        T[1:, k] = 2.0 * T[:-1, k - 1]
        T[:, k] -= T[:, k - 2]
    return T
