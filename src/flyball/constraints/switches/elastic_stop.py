"""Elastic stops: a force, without a row, that pushes back beyond two bounds and never pulls."""

from __future__ import annotations

import numpy as np

from .switch_kind import FROZEN, G_PRESS_LOWER, G_PRESS_UPPER, SLOW_ACCELERATION, Instant, SwitchKind

UNDECIDED_SIDE = 0.0  # direction of an elastic switch whose force follows from its position
ELASTIC = SwitchKind(
    guards=(G_PRESS_LOWER, G_PRESS_UPPER), bounded=True, elastic=True, closing=("close", "is pressed"),
    opening=("open", "lets go"), states=("pressed", "open"),
)  # fmt: skip
"""An elastic stop, play or rope."""


def pressed_side(n: Instant, s: int, old: float, triggered: set[int]) -> float:
    """Return 1 if the lower side is pressed, -1: the upper, 0: none; `UNDECIDED_SIDE` less `FROZEN` if undecided.

    A side whose guard is in ``triggered`` is pressed if it was open according to ``old``, and open if it was pressed.
    """
    k, c = n.S.switch_numbers.stiffness[s], n.S.switch_numbers.damping[s]
    now = 0.0
    bounds = n.W.modes.lower, n.W.modes.upper
    for side, bound, guard in zip((1.0, -1.0), bounds, (G_PRESS_LOWER, G_PRESS_UPPER), strict=True):
        depth, rate = side * (bound[s] - n.x[s]), -side * n.rate[s]
        if not np.isfinite(depth):
            continue
        if guard in triggered:
            on = old != side
        elif abs(depth) > n.near[s]:
            on = depth > 0.0 and k * depth + c * rate > 0.0
        elif abs(rate) > n.still[s]:
            on = rate > 0.0
        else:
            n.ways()[s] = FROZEN
            rise = -side * n.acceleration(s)
            if abs(rise) <= SLOW_ACCELERATION * n.unit[s] * n.characteristic_rate**2:
                return UNDECIDED_SIDE - FROZEN
            on = rise > 0.0
        now = side if on else now
    return now
