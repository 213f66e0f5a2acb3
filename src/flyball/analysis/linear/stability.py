"""Whether an equilibrium is stable: by the constrained stiffness, and where forces have no potential by the motion.

Every coordinate is judged in units of the stiffness that acts on it, so that nothing stiff elsewhere hides a soft
direction; such a change of units changes no sign (Sylvester's law of inertia). Stiffness that rounding may have made is
none.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...results.equilibrium import MARGINAL, STABLE, UNSTABLE
from .balance import acting, connected, stiffness_rounding
from .derivatives import Equations
from .free import Free, free
from .rest import Rest

NEUTRAL = 1e-8  # stiffness below this part of what acts is none
GROWTH = 1e-4  # real parts below this part of their eigenvalue are none
ZERO = 1e-7  # eigenvalues below this part of the fastest of what is connected are none


@dataclass
class Stability:
    """What the stiffness says.

    Attributes
    ----------
    kind : str
        ``"stable"``, ``"marginal"`` or ``"unstable"``.
    free : Free
    stiffness : ndarray (f, f)
        Of the freedoms.
    direction : ndarray (nv,)
        Of least stiffness, in scaled velocities.
    least : float
        That stiffness, as part of what springs, weights and reactions do along it by themselves.
    """

    kind: str
    free: Free
    stiffness: np.ndarray
    direction: np.ndarray
    least: float


def stability(x: Rest) -> Stability:
    """Stability of an equilibrium."""
    e = x.equations
    f = free(e)
    if not f.Zv.shape[1]:
        return Stability(STABLE, f, np.zeros((0, 0)), np.zeros(len(x.scale)), np.inf)
    K = f.Zv.T @ e.by_position[e.at["r"]] @ f.Zv
    Z = f.Zv / x.scale[:, None]
    noise = [np.abs(f.Zv.T @ d @ f.Zv) for d in stiffness_rounding(e)]
    blur = np.max(noise, axis=0)
    unit = np.abs(K).sum(axis=1) + blur.sum(axis=1)
    unit = 1.0 / np.sqrt(np.where(unit > 0.0, unit, 1.0))
    own, blur = (unit[:, None] * X * unit for X in (K, blur))
    w, V = np.linalg.eigh(0.5 * (own + own.T))
    along = Z @ (unit[:, None] * V)
    sizes = np.linalg.norm(along, axis=0)
    size = np.abs(along)
    acts = np.einsum("ik,ik->k", size, abs(x.K) @ size) + (x.scale * acting(e)) @ size**2
    real = np.abs(w) > np.einsum("ik,ij,jk->k", np.abs(V), blur, np.abs(V))
    parts = np.where(real, w / np.where(acts > 0.0, acts, 1.0), 0.0)
    k = int(np.argmin(parts))
    kind = UNSTABLE if parts[k] < -NEUTRAL else MARGINAL if parts[k] <= NEUTRAL else STABLE
    if (np.abs(own - own.T) > NEUTRAL + 2.0 * blur).any():  # no potential: flutter shows in the motion
        kind = _by_motion(e, f)
    return Stability(kind, f, K, along[:, k] / sizes[k], float(parts[k]))


def _by_motion(e: Equations, f: Free) -> str:
    """Stability by the eigenvalues, damping included; parts that nothing connects one by one."""
    r = e.at["r"]
    M, D, K = (f.Zv.T @ X[r] @ f.Zv for X in (e.by_acceleration, e.by_velocity, e.by_position))
    part = connected(e)[f.chosen_v]
    growth = max(_growth(*(X[np.ix_(own, own)] for X in (M, D, K))) for own in (part == k for k in np.unique(part)))
    return UNSTABLE if growth > GROWTH else MARGINAL if growth > -GROWTH else STABLE


def _growth(M: np.ndarray, D: np.ndarray, K: np.ndarray) -> float:
    """The largest real part, of its eigenvalue; zeros of higher order, which rounding spreads, have none."""
    from scipy.linalg import eigvals

    one, none = np.eye(len(M)), np.zeros_like(M)
    w = eigvals(np.block([[none, one], [-K, -D]]), np.block([[one, none], [none, M]]))
    w = w[np.isfinite(w)]
    size = np.abs(w)
    return float(
        np.where(size > ZERO * size.max(initial=0.0), w.real / np.maximum(size, 1e-300), 0.0).max(initial=-1.0)
    )
