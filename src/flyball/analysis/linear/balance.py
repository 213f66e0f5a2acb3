"""When forces balance: each equation of motion is judged by its own terms.

Nothing stiff or heavy elsewhere hides what is left of it.
"""

from __future__ import annotations

import numpy as np

from .derivatives import Equations

ROUNDING = 3e-15  # of positions: what stiffness makes of it is no force
NOTHING = 1e-9  # acceleration [m/s^2] that is none


def acting(e: Equations) -> np.ndarray:
    """What acts in every equation of motion: the total force, and each constraint's, (nv,)."""
    x, at = e.state, e.at
    G = e.by_velocity[at["n"]]
    M = e.by_acceleration[at["r"]]
    force = e.residual[at["r"]] - M @ x.vdot + G.T @ x.lam
    return np.abs(force) + abs(G).T @ np.abs(x.lam) + np.abs(x.effort)


def allowed(e: Equations, part: float) -> np.ndarray:
    """What may be left of every equation of motion: a part of what acts in it, and rounding, (nv,)."""
    at, size = e.at, e.state.c.sizes
    stiff = abs(e.by_position[at["r"]]) @ size
    inertia = e.by_acceleration[at["r"]].diagonal() * size / e.state.c.values.length
    return part * acting(e) + ROUNDING * stiff + NOTHING * inertia
