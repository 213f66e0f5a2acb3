"""Forces in cones that balance given loads: A x = b with x in a product of cones, by Douglas-Rachford splitting.

Two projections alternate, on the solutions of the linear equations and on the cones. If both sets intersect, the
iteration converges to a common point (Bauschke and Moursi 2017). It starts from the minimum-norm solution, which is
the result if it lies in the cones.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

MAX_ITERATIONS = 20_000
SINGULAR_TOLERANCE = 1e-11  # relative to the largest singular value; smaller ones count as zero
STEP_TOLERANCE = 1e-13  # step relative to the forces that ends the iteration
CHECK_INTERVAL = 50  # iterations between convergence checks


@dataclass(frozen=True)
class ConeProduct:
    """Admissible set of the unknowns.

    Attributes
    ----------
    free : int
        Number of leading unknowns without bounds.
    sign : ndarray (m,)
        Signs of the next unknowns: +1 nonnegative, -1 nonpositive.
    friction : ndarray (n,)
        Friction coefficients of the next unknowns, triples (normal, two tangential): normal >= 0, tangential <=
        friction * normal.
    most : ndarray (l,)
        Bounds of the absolute values of the last unknowns.
    """

    free: int
    sign: np.ndarray
    friction: np.ndarray
    most: np.ndarray = field(default_factory=lambda: np.zeros(0))

    def project(self, x: np.ndarray) -> np.ndarray:
        """Project on the cones."""
        out = x.copy()
        a, b = self.free, self.free + len(self.sign)
        out[a:b] = self.sign * np.maximum(self.sign * x[a:b], 0.0)
        c = len(x) - len(self.most)
        out[c:] = np.clip(x[c:], -self.most, self.most)
        p = x[b:c].reshape(-1, 3)
        n, t, mu = p[:, 0], np.hypot(p[:, 1], p[:, 2]), self.friction
        inside, polar = t <= mu * n, mu * t <= -n
        height = np.where(inside, n, np.where(polar, 0.0, (n + mu * t) / (1.0 + mu * mu)))
        wide = np.where(inside, t, mu * height)
        shrink = np.where(t > 0.0, wide / np.where(t > 0.0, t, 1.0), 0.0)
        out[b:c] = np.column_stack([height, shrink * p[:, 1], shrink * p[:, 2]]).ravel()
        return out


@dataclass(frozen=True)
class ForceBalance:
    """Result of `balance_forces`.

    Attributes
    ----------
    x : ndarray
        Least-squares solution of the equations.
    outside : float
        Distance from the cones, relative to its largest number.
    left : ndarray
        Residual of the equations at the projection on the cones.
    unique : bool
        Whether the equations have a unique solution.
    """

    x: np.ndarray
    outside: float
    left: np.ndarray
    unique: bool


def balance_forces(A: np.ndarray, b: np.ndarray, cones: ConeProduct) -> ForceBalance:
    """Find x in the cones with A x = b.

    Parameters
    ----------
    A : ndarray (m, n)
    b : ndarray (m,)
    cones : ConeProduct
    """
    U, d, Vt = np.linalg.svd(A, full_matrices=False)
    k = int((d > SINGULAR_TOLERANCE * d.max(initial=0.0)).sum())
    back = Vt[:k].T @ (U[:, :k] / d[:k]).T

    def balanced(y: np.ndarray) -> np.ndarray:
        return y - back @ (A @ y - b)

    z = balanced(back @ b)
    size = np.abs(z).max(initial=0.0)
    inside = cones.project(z)
    for i in range(MAX_ITERATIONS):
        other = balanced(2.0 * inside - z)
        step = other - inside
        z = z + step
        inside = cones.project(z)
        if i % CHECK_INTERVAL == 0 and np.abs(step).max(initial=0.0) <= STEP_TOLERANCE * size:
            break
    x = balanced(inside)
    outside = np.abs(x - cones.project(x)).max(initial=0.0) / max(size, 1e-300)
    return ForceBalance(x, float(outside), b - A @ cones.project(x), k == A.shape[1])
