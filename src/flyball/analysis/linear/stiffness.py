"""The constrained stiffness at rest, direction by direction.

Every coordinate is judged in units of the stiffness that acts on it, so that nothing stiff elsewhere hides a soft
direction; such a change of units changes no sign (Sylvester's law of inertia). Stiffness that rounding may have made is
none.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from ...numerics.rank import null_space
from .balance import acting, stiffness_rounding
from .free import Free
from .rest import Rest

NEUTRAL = 1e-8  # stiffness below this part of what acts is none


@dataclass
class Stiffness:
    """The constrained stiffness at a place, direction by direction.

    ``matrix`` (f, f), ``along`` (nv, f) in scaled velocities, ``parts`` (f,) of what acts, and whether it is that of a
    ``potential``; ``within`` is `across`.
    """

    matrix: np.ndarray
    along: np.ndarray
    parts: np.ndarray
    potential: bool
    within: Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]] = field(repr=False)

    def across(self, normals: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """``along`` and ``parts`` of the motions that some normals (m, nv), in scaled velocities, say nothing of."""
        return self.within(normals)


def stiffness(x: Rest, f: Free) -> Stiffness:
    """The stiffness of the freedoms at a place."""
    e = x.equations
    K = f.Zv.T @ e.by_position[e.at["r"]] @ f.Zv
    Z = f.Zv / x.scale[:, None]
    blur = np.max([np.abs(f.Zv.T @ d @ f.Zv) for d in stiffness_rounding(e)], axis=0)
    unit = np.abs(K).sum(axis=1) + blur.sum(axis=1)
    unit = 1.0 / np.sqrt(np.where(unit > 0.0, unit, 1.0))
    own, blur = (unit[:, None] * X * unit for X in (K, blur))
    acts_by = x.scale * acting(e)

    def within(normals: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        B = null_space(normals @ Z * unit) if len(normals) else np.eye(len(own))
        w, V = np.linalg.eigh(0.5 * B.T @ (own + own.T) @ B)
        V = B @ V
        along = Z @ (unit[:, None] * V)
        size = np.abs(along)
        acts = np.einsum("ik,ik->k", size, abs(x.K) @ size) + acts_by @ size**2
        real = np.abs(w) > (np.abs(V) * (blur @ np.abs(V))).sum(axis=0)
        parts = np.where(real, w / np.where(acts > 0.0, acts, 1.0), 0.0)
        return along / np.linalg.norm(along, axis=0), parts

    potential = bool((np.abs(own - own.T) <= NEUTRAL + 2.0 * blur).all())
    return Stiffness(K, *within(np.zeros((0, len(Z)))), potential, within)
