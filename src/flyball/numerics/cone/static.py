"""Forces in cones that balance given ones: A x = b with x in a product of cones, by Douglas and Rachford's splitting.

Two projections take turns, on the solutions of the linear equations and on the cones; where both meet, the iteration
ends at a point of both (Bauschke and Moursi 2017). It starts from the smallest solution, which is the answer where that
lies in the cones.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

MOST = 20_000
NONE = 1e-11  # singular values below this part of the largest are none
ENOUGH = 1e-13  # a step below this part of the forces ends the iteration
CHECKED = 50  # iterations between looks at whether the answer is there


@dataclass(frozen=True)
class Cones:
    """Where the unknowns may be.

    Attributes
    ----------
    free : int
        The first unknowns, which may be anything.
    sign : ndarray (m,)
        Of the next unknowns: +1 not negative, -1 not positive.
    friction : ndarray (n,)
        The others are triples (normal, two tangential): normal >= 0, tangential <= friction * normal.
    most : ndarray (l,)
        Behind those: unknowns that are at most so large, either way.
    """

    free: int
    sign: np.ndarray
    friction: np.ndarray
    most: np.ndarray = field(default_factory=lambda: np.zeros(0))

    def projected(self, x: np.ndarray) -> np.ndarray:
        """The nearest point within the cones."""
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
class Balance:
    """What was found.

    Attributes
    ----------
    x : ndarray
        Solves the equations as well as anything can.
    outside : float
        How far it is from the cones, in parts of its largest number.
    left : ndarray
        What is left of the equations by the nearest point within the cones.
    unique : bool
        Whether the equations leave nothing open.
    """

    x: np.ndarray
    outside: float
    left: np.ndarray
    unique: bool


def balance(A: np.ndarray, b: np.ndarray, cones: Cones) -> Balance:
    """Find x in the cones with A x = b.

    Parameters
    ----------
    A : ndarray (m, n)
    b : ndarray (m,)
    cones : Cones
    """
    U, d, Vt = np.linalg.svd(A, full_matrices=False)
    k = int((d > NONE * d.max(initial=0.0)).sum())
    back = Vt[:k].T @ (U[:, :k] / d[:k]).T

    def balanced(y: np.ndarray) -> np.ndarray:
        return y - back @ (A @ y - b)

    z = balanced(back @ b)
    size = np.abs(z).max(initial=0.0)
    inside = cones.projected(z)
    for i in range(MOST):
        other = balanced(2.0 * inside - z)
        step = other - inside
        z = z + step
        inside = cones.projected(z)
        if i % CHECKED == 0 and np.abs(step).max(initial=0.0) <= ENOUGH * size:
            break
    x = balanced(inside)
    outside = np.abs(x - cones.projected(x)).max(initial=0.0) / max(size, 1e-300)
    return Balance(x, float(outside), b - A @ cones.projected(x), k == A.shape[1])
