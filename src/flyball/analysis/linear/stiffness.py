"""The constrained stiffness at rest, direction by direction.

Every coordinate is judged in units of the stiffness that acts on it, so that nothing stiff elsewhere hides a soft
direction; such a change of units changes no sign (Sylvester's law of inertia). Stiffness that rounding may have made is
none.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .balance import acting, stiffness_rounding
from .free import Free
from .rest import Rest

NEUTRAL = 1e-8  # stiffness below this part of what acts is none


@dataclass
class Stiffness:
    """The constrained stiffness at a place, direction by direction.

    ``matrix`` (f, f), ``along`` (nv, f) in scaled velocities, ``parts`` (f,) of what acts, and whether it is that of a
    ``potential``.
    """

    matrix: np.ndarray
    along: np.ndarray
    parts: np.ndarray
    potential: bool


def stiffness(x: Rest, f: Free) -> Stiffness:
    """The stiffness of the freedoms at a place."""
    e = x.equations
    K = f.Zv.T @ e.by_position[e.at["r"]] @ f.Zv
    Z = f.Zv / x.scale[:, None]
    blur = np.max([np.abs(f.Zv.T @ d @ f.Zv) for d in stiffness_rounding(e)], axis=0)
    unit = np.abs(K).sum(axis=1) + blur.sum(axis=1)
    unit = 1.0 / np.sqrt(np.where(unit > 0.0, unit, 1.0))
    own, blur = (unit[:, None] * X * unit for X in (K, blur))
    w, V = np.linalg.eigh(0.5 * (own + own.T))
    along = Z @ (unit[:, None] * V)
    size = np.abs(along)
    acts = np.einsum("ik,ik->k", size, abs(x.K) @ size) + (x.scale * acting(e)) @ size**2
    real = np.abs(w) > np.einsum("ik,ij,jk->k", np.abs(V), blur, np.abs(V))
    parts = np.where(real, w / np.where(acts > 0.0, acts, 1.0), 0.0)
    potential = bool((np.abs(own - own.T) <= NEUTRAL + 2.0 * blur).all())
    return Stiffness(K, along / np.linalg.norm(along, axis=0), parts, potential)
