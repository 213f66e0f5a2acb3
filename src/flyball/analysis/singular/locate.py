"""Singular points of a driven mechanism's curve, found to rounding.

Where the driver turns back (its component of the tangent vanishes, J keeps its rank) the root of that component along
the curve is the point. Where J loses rank, the point is where the derivatives of the bifurcation function
phi(y) = U^T F(x + N y + ...) vanish (Lyapunov and Schmidt's reduction): Newton's method on these converges also where
no determinant changes its sign, and phi itself tells a true branch point from a near miss.
"""

from __future__ import annotations

import numpy as np

from .closure import Closure, Place, Rank

LOST = 1e-7  # part of the largest singular value below which one counts as zero at a located point
PASSES = 60
REACH = 0.5  # Newton's method may not lead farther away than this [1]


def limit(r: Rank) -> float:
    """What counts as zero among singular values."""
    return LOST * float(r.values[0])


def branch_point(c: Closure, x: Place, dropped: int = 1) -> Place | None:
    """The point near x where J loses as many more dimensions of rank as told; None if there is none."""
    start = x
    best: tuple[float, Place] | None = None
    last = np.inf
    for _ in range(PASSES):
        r = c.rank(x)
        kept = c.columns - 1 - dropped
        U, V = r.U[:, kept:], r.V[:, kept:]
        if not U.shape[1]:  # fewer rows than that would leave: freedoms, no singular position
            return None
        F = c.residual(x)
        aside = -r.V[:, :kept] @ ((r.U[:, :kept].T @ F) / r.values[:kept])
        k = V.shape[1]
        loss = np.zeros((k, U.shape[1]))  # [j]: U^T J V_j
        np.fill_diagonal(loss, r.values[kept:])
        slopes = np.zeros((k, k, U.shape[1]))  # [j, l]: U^T F''[V_j, V_l]
        for j in range(k):
            for l in range(j + 1):
                slopes[j, l] = slopes[l, j] = U.T @ (c.second(x, V[:, j]) if j == l else c.mixed(x, V[:, j], V[:, l]))
        given = np.array([U.T @ c.mixed(x, V[:, j], aside) for j in range(k)]) if np.any(aside) else 0.0
        A = slopes.transpose(0, 2, 1).reshape(-1, k)
        y = -np.linalg.lstsq(A, (loss + given).ravel(), rcond=1e-11)[0]
        d = aside + V @ y
        size = float(np.linalg.norm(d))
        if not np.isfinite(size):
            return None
        d *= min(1.0, 0.1 / max(size, 1e-300))
        measure = float(np.abs(loss).max() + np.abs(F).max())
        if best is None or measure < best[0]:
            best = measure, x
        x = c.at(c.moved(x, d))
        if np.linalg.norm(c.way(start, x)) > REACH:
            return None
        if size < 1e-13 or (size < 1e-8 and size > 0.3 * last):
            break
        last = size
    x = x if best is None or _misses(c, x, dropped) <= best[0] else best[1]
    r = c.rank(x)
    true = np.abs(c.residual(x)).max() < 1e-10 and r.below(limit(r)) > dropped
    return x if true else None


def _misses(c: Closure, x: Place, dropped: int) -> float:
    r = c.rank(x)
    return float(r.values[c.columns - 1 - dropped] + np.abs(c.residual(x)).max())


def interior_least(f0: float, g0: float, f1: float, g1: float, ds: float) -> tuple[float, float] | None:
    """Place (0 to 1) and value of the least of the cubic through two values and slopes, if it lies between them."""
    a, b, c = 2 * (f0 - f1) + ds * (g0 + g1), 3 * (f1 - f0) - ds * (2 * g0 + g1), ds * g0
    for u in np.roots([3 * a, 2 * b, c] if abs(a) > 1e-14 else [2 * b, c] if abs(b) > 1e-14 else [1.0, 9.0]):
        if abs(u.imag) < 1e-12 and 0.0 < u.real < 1.0 and 6 * a * u.real + 2 * b > 0.0:
            u = float(u.real)
            return u, ((a * u + b) * u + c) * u + f0
    return None
