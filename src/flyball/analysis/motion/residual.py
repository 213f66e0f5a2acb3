"""How well the accelerations of a motion fulfil G vdot = gamma, seen from outside the solve."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ...tables.system import G_VALUE, GAMMA, NU
from ..compiled import Compiled, compiled

if TYPE_CHECKING:
    from ...results.result import Result

MOST = 100  # output times that are looked at


def acceleration_violation(result: Result) -> float:
    """Largest |G vdot - gamma| at up to `MOST` output times, relative to the terms that make it up.

    With Baumgarte's stabilization gamma is what that makes of it. The terms are |G| |vdot|, |gamma|, and what the
    reactions alone would make of a row: |G| M^-1 |G^T lam|.
    """
    n = len(result.t)
    if not n or not len(result.values.structure.rows):
        return 0.0
    c = compiled(result.model, parameters=result.values.told, tree=result.values.structure.tree)
    R = c.inverse_mass_root(np.ones(c.structure.nv)) if not c.structure.tree else None
    picked = np.unique(np.linspace(0, n - 1, min(n, MOST)).astype(int)).tolist()
    return max(_at(result, c, R, k) for k in picked)


def _at(result: Result, c: Compiled, R, k: int) -> float:
    c.z = result.states[k].copy()
    c.at(result.t[k], result.q[k].copy(), result.v[k].copy())
    G, gamma, x = c.sparse_jacobian(), c.work.row[GAMMA], result.vdot[k]
    o = result.health.options
    if o.get("stabilization") == "baumgarte":
        gamma = gamma - 2 * o["alpha"] * (G @ result.v[k] - c.work.row[NU]) - o["beta"] ** 2 * c.work.row[G_VALUE]
    size = abs(G) @ np.abs(x) + np.abs(gamma)
    if R is not None:
        B = abs(G @ R)
        size = size + B @ (B.T @ np.abs(result.multipliers[k]))
    return float(np.abs(G @ x - gamma).max() / max(size.max(), 1e-300))
