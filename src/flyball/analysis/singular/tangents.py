"""Directions in which curves leave a point where quadratic forms vanish: real common zeros of u^T F''[n, n].

Source: H. B. Keller, Numerical Solution of Bifurcation and Nonlinear Eigenvalue Problems (1977), the algebraic
bifurcation equations; of a corank of one they are one binary quadratic form.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

NOTHING = 1e-7  # forms are of unit size where steps are: below this part they vanish
STARTS = 400
NEWTON = 60
MANY = 12  # multiple zeros beyond which they are taken for a continuum


class Directions(NamedTuple):
    """Unit vectors, one of each pair of opposites, on which forms vanish."""

    single: list[np.ndarray]  # simple zeros: a curve leaves along each of them
    several: list[np.ndarray]  # multiple zeros, up to some: the next order has a say
    endless: bool = False  # whether the multiple ones are a continuum

    @property
    def decided(self) -> bool:
        """Whether the forms say all."""
        return not self.several and not self.endless


def directions(forms: np.ndarray, size: float) -> Directions:
    """Common zeros of quadratic forms (m, k, k), symmetric, from derivatives of a given size."""
    k = forms.shape[1]
    if k == 1:
        return Directions([np.ones(1)], [])
    limit = NOTHING * max(size, 1e-300)
    if not len(forms) or np.abs(forms).max() < limit:
        return Directions([], list(np.eye(k)))
    return _binary(forms, limit) if k == 2 else _several(forms, limit)


def _binary(forms: np.ndarray, limit: float) -> Directions:
    M = np.column_stack([forms[:, 0, 0], 2.0 * forms[:, 0, 1], forms[:, 1, 1]])  # times (x x, x y, y y)
    _, s, Vt = np.linalg.svd(M)
    independent = int((s > limit).sum())
    if independent == 3:
        return Directions([], [])
    if independent == 2:
        xx, xy, yy = Vt[2] * (1.0 if Vt[2, 0] + Vt[2, 2] > 0.0 else -1.0)
        if abs(xx * yy - xy * xy) > 1e-6 or xx < -1e-6 or yy < -1e-6:
            return Directions([], [])
        n = np.array([xx, xy]) if xx > yy else np.array([xy, yy])
        return Directions([n / np.linalg.norm(n)], [])
    A, B, C = Vt[0]
    w, E = np.linalg.eigh(np.array([[A, 0.5 * B], [0.5 * B, C]]))
    if min(abs(w)) < 1e-6 * max(abs(w)):
        return Directions([], [E[:, np.argmin(abs(w))]])
    if w[0] * w[1] > 0.0:
        return Directions([], [])
    c, s = np.sqrt(w[1]), np.sqrt(-w[0])
    return Directions([(c * E[:, 0] + sign * s * E[:, 1]) / np.hypot(c, s) for sign in (1.0, -1.0)], [])


def _several(forms: np.ndarray, limit: float) -> Directions:
    """Newton's method on the sphere from many starts; zeros that lie on curves, or are multiple, decide nothing."""
    k = forms.shape[1]
    random = np.random.default_rng(0)
    single: list[np.ndarray] = []
    several: list[np.ndarray] = []
    for n in random.normal(size=(STARTS, k)):
        n = _newton(forms, n / np.linalg.norm(n))
        if np.abs((forms @ n) @ n).max() > 1e-3 * limit:
            continue
        slopes = np.linalg.svd(np.vstack([2.0 * forms @ n, n]), compute_uv=False)
        regular = len(slopes) == k and slopes[-1] > 1e-3
        found, apart = (single, 1e-6) if regular else (several, 0.02)
        if not any(min(np.linalg.norm(n - x), np.linalg.norm(n + x)) < apart for x in found):
            found.append(n)
        if len(several) > MANY:
            break
    return Directions(single, several[:MANY], len(several) > MANY)


def _newton(forms: np.ndarray, n: np.ndarray) -> np.ndarray:
    for _ in range(NEWTON):
        J = np.vstack([2.0 * forms @ n, n])
        d = -np.linalg.lstsq(J, np.r_[(forms @ n) @ n, 0.0], rcond=1e-10)[0]
        n = n + d * min(1.0, 0.3 / max(float(np.linalg.norm(d)), 1e-300))
        n = n / np.linalg.norm(n)
        if np.linalg.norm(d) < 1e-15:
            break
    return n
