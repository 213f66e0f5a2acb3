"""What needs no problem to be solved: elastic stops that are pressed or let go, ratchets that turn round.

An elastic stop is pressed at a side where it is d > 0 deep in it and its push k d + c ddot is positive. Between events
its force is frozen (`constraints.modes.FROZEN`), so what decides here is how d goes on from a zero: by its rate, by its
acceleration where it has none. Where it has neither the force is left to look where it is by itself.
"""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from ....constraints.modes import ELASTIC, FROZEN, RATCHET, TURN
from ....equations.tasks import MOTION
from ....tables.system import (
    BIAS,
    G_PRESS_LOWER,
    G_PRESS_UPPER,
    OFF,
)
from .instant import Instant

SLOW = 1e-9  # of the mechanism's length (of a radian), at its own rate: an acceleration that is none
TOOTH = 1e-9  # of the pitch: as good as at a tooth
BY_ITSELF = 0.0  # way of an elastic switch whose force looks where it is


def teeth(n: Instant, still: np.ndarray) -> None:
    """Ratchets that do not hold: going on, or back to the last tooth that was passed; ``still``: those at rest."""
    for s in n.of(RATCHET):
        first, n.W.modes.upper[s] = n.W.modes.upper[s] < np.inf, np.inf
        if n.mode[s] != OFF:
            n.W.modes.lower[s] = n.hold[s]  # of a motion that goes on, too
        elif n.rate[s] > 0.0 and not still[s]:
            _goes_on(n, s)
        elif first or n.way[s] >= 0.0:
            tooth, pitch = n.S.switch_numbers.tooth[s], n.S.switch_numbers.pitch[s]
            n.W.modes.lower[s] = tooth + pitch * np.floor((n.x[s] - tooth) / pitch + TOOTH)
            n.ways()[s] = n.way[s] = -1.0


def turned(n: Instant, hit: Collection[int]) -> None:
    """Ratchets whose tooth let go, or threw back what it was ``hit`` by, go on, and those that begin to; modes are
    decided.
    """
    for s in n.of(RATCHET):
        if n.W.modes.mode[s] != OFF:
            continue
        slow = abs(n.rate[s]) <= 2.0 * TURN * n.unit[s] * n.tempo
        if n.mode[s] != OFF or s in hit or (slow and _acceleration(n, s) > SLOW * n.unit[s] * n.tempo**2):
            _goes_on(n, s)
        else:
            n.ways()[s] = n.way[s]


def _goes_on(n: Instant, s: int) -> None:
    """No tooth is in the way until it turns round."""
    n.ways()[s] = n.way[s] = 1.0
    n.W.modes.lower[s] = -np.inf


def _acceleration(n: Instant, s: int) -> float:
    """Second derivative of a quantity with the modes as they stand."""
    n.ask(MOTION)
    nq = n.S.sizes.coordinates
    vdot = n.desk.K[0, nq : nq + n.here.structure.nv]
    return float(n.gradients(np.array([s]))[0] @ vdot + n.W.sensed[BIAS, n.m[s]])


def pressed(n: Instant, fired: np.ndarray, ways: np.ndarray) -> None:
    """Which sides of elastic stops are pressed now; ``n`` has looked there.

    What fired is pressed if it was open by the ``ways`` before the instant, and the other way round.
    """
    for s in n.of(ELASTIC):
        hit = {k for k, of, _ in (n.guarded[g] for g in fired) if of == s}
        n.ways()[s] = FROZEN + _side(n, s, float(ways[s]) - FROZEN, hit)


def _side(n: Instant, s: int, old: float, hit: set[int]) -> float:
    """1 if pressed at the lower side, -1 at the upper, 0 if open; `BY_ITSELF` less `FROZEN` where nothing tells."""
    k, c = n.S.switch_numbers.stiffness[s], n.S.switch_numbers.damping[s]
    now = 0.0
    bounds = n.W.modes.lower, n.W.modes.upper
    for side, bound, guard in zip((1.0, -1.0), bounds, (G_PRESS_LOWER, G_PRESS_UPPER), strict=True):
        depth, rate = side * (bound[s] - n.x[s]), -side * n.rate[s]
        if not np.isfinite(depth):
            continue
        if guard in hit:
            on = old != side
        elif abs(depth) > n.near[s]:
            on = depth > 0.0 and k * depth + c * rate > 0.0
        elif abs(rate) > n.still[s]:
            on = rate > 0.0
        else:
            n.ways()[s] = FROZEN
            rise = -side * _acceleration(n, s)
            if abs(rise) <= SLOW * n.unit[s] * n.tempo**2:
                return BY_ITSELF - FROZEN
            on = rise > 0.0
        now = side if on else now
    return now
