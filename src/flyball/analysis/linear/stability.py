"""Whether an equilibrium is stable: by the constrained stiffness, and where forces have no potential by the motion."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...results.equilibrium import MARGINAL, STABLE, UNSTABLE
from .balance import connected
from .derivatives import Equations
from .free import Free, free
from .kinks import kinks, refuse_kinks
from .rest import Rest
from .sides import from_all_sides
from .stiffness import NEUTRAL, stiffness

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
        Of the freedoms; at a kink on the side where least of it is.
    direction : ndarray (nv,)
        Of least stiffness, in scaled velocities.
    least : float
        That stiffness, as part of what springs, weights and reactions do along it by themselves.
    kinks : tuple of str
        Forces with another slope on the other side of this place, in words.
    """

    kind: str
    free: Free
    stiffness: np.ndarray
    direction: np.ndarray
    least: float
    kinks: tuple[str, ...] = ()


def stability(x: Rest) -> Stability:
    """Stability of an equilibrium; where forces have kinks there, from all sides of them.

    Raises
    ------
    SingularityError
        If a force jumps there, or the sides of its kinks leave stability open.
    """
    if x.verdict is None:
        x.verdict = _judged(x)
    return x.verdict


def _judged(x: Rest) -> Stability:
    e = x.equations
    f = free(e)
    if not f.Zv.shape[1]:
        return Stability(STABLE, f, np.zeros((0, 0)), np.zeros(len(x.scale)), np.inf)
    still = 0.0 * f.Zv
    found = [k for k in kinks(e) if k.felt(f.Zv * f.scale[f.chosen_v], still)]
    if found:
        kind, s = from_all_sides(x, f, found)
        k = int(np.argmin(s.parts))
        texts = tuple(dict.fromkeys(k.text for k in found))
        return Stability(kind, f, s.matrix, s.along[:, k], float(s.parts[k]), texts)
    s = stiffness(x, f)
    k = int(np.argmin(s.parts))
    kind = UNSTABLE if s.parts[k] < -NEUTRAL else MARGINAL if s.parts[k] <= NEUTRAL else STABLE
    if not s.potential:  # flutter shows in the motion
        refuse_kinks(e, still, f.Zv)
        kind = _by_motion(e, f)
    return Stability(kind, f, s.matrix, s.along[:, k], float(s.parts[k]))


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
