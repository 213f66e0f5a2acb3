"""Directions in which curves leave a point where quadratic forms vanish: real common zeros of u^T F''[n, n].

Source: H. B. Keller, Numerical Solution of Bifurcation and Nonlinear Eigenvalue Problems (1977), the algebraic
bifurcation equations; of a corank of one they are one binary quadratic form.
"""

from __future__ import annotations

import numpy as np

NOTHING = 1e-7  # forms are of unit size where steps are: below this part they vanish
STARTS = 400
NEWTON = 60


def directions(forms: np.ndarray, size: float) -> tuple[list[np.ndarray], bool]:
    """Unit vectors, one of each pair of opposites, on which all forms vanish.

    Parameters
    ----------
    forms : ndarray (m, k, k)
        Symmetric.
    size : float
        Size of the derivatives that they come from.

    Returns
    -------
    vectors : list of ndarray (k,)
    decided : bool
        Whether these are all, and single: else the next order has a say.
    """
    k = forms.shape[1]
    if k == 1:
        return [np.ones(1)], True
    limit = NOTHING * max(size, 1e-300)
    if not len(forms) or np.abs(forms).max() < limit:
        return [], False
    return _binary(forms, limit) if k == 2 else _several(forms, limit)


def _binary(forms: np.ndarray, limit: float) -> tuple[list[np.ndarray], bool]:
    M = np.column_stack([forms[:, 0, 0], 2.0 * forms[:, 0, 1], forms[:, 1, 1]])  # times (x x, x y, y y)
    _, s, Vt = np.linalg.svd(M)
    independent = int((s > limit).sum())
    if independent == 3:
        return [], True
    if independent == 2:
        xx, xy, yy = Vt[2] * (1.0 if Vt[2, 0] + Vt[2, 2] > 0.0 else -1.0)
        if abs(xx * yy - xy * xy) > 1e-6 or xx < -1e-6 or yy < -1e-6:
            return [], True
        n = np.array([xx, xy]) if xx > yy else np.array([xy, yy])
        return [n / np.linalg.norm(n)], True
    A, B, C = Vt[0]
    w, E = np.linalg.eigh(np.array([[A, 0.5 * B], [0.5 * B, C]]))
    if min(abs(w)) < 1e-6 * max(abs(w)):
        return [E[:, np.argmin(abs(w))]], False
    if w[0] * w[1] > 0.0:
        return [], True
    c, s = np.sqrt(w[1]), np.sqrt(-w[0])
    return [(c * E[:, 0] + sign * s * E[:, 1]) / np.hypot(c, s) for sign in (1.0, -1.0)], True


def _several(forms: np.ndarray, limit: float) -> tuple[list[np.ndarray], bool]:
    """Newton's method on the sphere from many starts; zeros that lie on curves, or are multiple, decide nothing."""
    k = forms.shape[1]
    random = np.random.default_rng(0)
    found: list[np.ndarray] = []
    decided = True
    for n in random.normal(size=(STARTS, k)):
        n = n / np.linalg.norm(n)
        for _ in range(NEWTON):
            J = np.vstack([2.0 * forms @ n, n])
            r = np.r_[(forms @ n) @ n, 0.0]
            d = -np.linalg.lstsq(J, r, rcond=1e-10)[0]
            n = n + d * min(1.0, 0.3 / max(np.linalg.norm(d), 1e-300))
            n = n / np.linalg.norm(n)
            if np.linalg.norm(d) < 1e-15:
                break
        if np.abs((forms @ n) @ n).max() > 1e-3 * limit:
            continue
        slopes = np.linalg.svd(np.vstack([2.0 * forms @ n, n]), compute_uv=False)
        if len(slopes) < k or slopes[k - 1] < 1e-5:
            decided = False
        if not any(min(np.linalg.norm(n - x), np.linalg.norm(n + x)) < 1e-6 for x in found):
            found.append(n)
        if not decided and len(found) > 8:
            return [], False
    return found, decided
