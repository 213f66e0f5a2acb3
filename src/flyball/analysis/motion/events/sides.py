"""What needs no jump at an instant: elastic stops that are pressed or let go, ratchets that turn round.

An elastic stop is pressed at a side where it is d > 0 deep in it and its push k d + c ddot is positive. Between events
its force is frozen (`constraints.modes.FROZEN`), so what decides here is how d goes on from a zero: by its rate, by its
acceleration where it has none. Where it has neither the force is left to look where it is by itself.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ....constraints.modes import ELASTIC, FROZEN, RATCHET
from ....equations.rows import way_of
from ....equations.tasks import MOTION
from ....tables.system import (
    BIAS,
    G_PRESS_LOWER,
    G_PRESS_UPPER,
    GUARD_KIND,
    GUARD_OF,
    LOWER,
    MODE,
    OFF,
    RATE,
    SWITCH_DAMPING,
    SWITCH_KIND,
    SWITCH_MEASURED,
    SWITCH_PITCH,
    SWITCH_STIFFNESS,
    SWITCH_TOOTH,
    UPPER,
    VALUE,
)
from .here import Here

NEAR = 1e-9  # of the mechanism's length (of a radian): a depth that is none
SLOW = 1e-9  # of the mechanism's length (of a radian) a second: a rate that is none
WORDS = {1.0: "pressed at its lower side", -1.0: "pressed at its upper side", 0.0: "let go"}
ROPE = {-1.0: "taut", 0.0: "slack"}
UNKNOWN = -FROZEN  # the force looks where it is


def side_modes(here: Here, fired: Sequence[int] | None = None) -> list[tuple[int, str]]:
    """Set the sides of elastic stops and the teeth of ratchets as they are at this instant.

    Parameters
    ----------
    here : Here
    fired : sequence of int, optional
        Guards that went through zero now; None: all is to be found, as at the start.

    Returns
    -------
    list of (switch, words)
        What is other than it was.
    """
    S, W = here.c.system, here.c.work
    out: list[tuple[int, str]] = []
    if not np.isin(S.switch_i[:, SWITCH_KIND], (ELASTIC, RATCHET)).any():
        return out
    here.c.at(here.t, here.q, here.v)
    sensed = W.sensed.copy()
    for s, kind in enumerate(S.switch_i[:, SWITCH_KIND].tolist()):
        if kind == ELASTIC:
            out += _elastic(here, s, sensed, fired)
        elif kind == RATCHET and W.switch[MODE, s] == OFF:
            out += _ratchet(here, s, sensed, fired is None)
    return out


def way(here: Here, s: int) -> float:
    """The way of a switch."""
    return float(here.c.work.sensed[VALUE, way_of(here.c.system, here.c.work, s)])


def turn(here: Here, s: int, to: float) -> None:
    """Set the way of a switch."""
    here.c.work.sensed[VALUE, way_of(here.c.system, here.c.work, s)] = to


def _unit(here: Here, s: int) -> float:
    """What counts as a large value of the quantity of a switch: the mechanism's length, or a radian."""
    m = int(here.c.system.switch_i[s, SWITCH_MEASURED])
    terms = [t for t in here.structure.terms if t.measured and t.row - len(here.structure.rows) == m]
    return here.c.values.length if any(t.formula.measure == "m" for t in terms) else 1.0


def _elastic(here: Here, s: int, sensed: np.ndarray, fired: Sequence[int] | None) -> list[tuple[int, str]]:
    """Which side is pressed now."""
    S, W = here.c.system, here.c.work
    k, c = S.switch_x[s, SWITCH_STIFFNESS], S.switch_x[s, SWITCH_DAMPING]
    m, old = int(S.switch_i[s, SWITCH_MEASURED]), way(here, s) - FROZEN
    now = 0.0
    for side, row, kind in ((1.0, LOWER, G_PRESS_LOWER), (-1.0, UPPER, G_PRESS_UPPER)):
        depth, rate = side * (W.switch[row, s] - sensed[VALUE, m]), -side * sensed[RATE, m]
        if not np.isfinite(depth):
            continue
        hit = fired is not None and any(S.guard_i[g, GUARD_OF] == s and S.guard_i[g, GUARD_KIND] == kind for g in fired)
        pressed = old != side if hit else depth > 0.0 and k * depth + c * rate > 0.0
        unit = _unit(here, s)
        if not hit and abs(depth) <= NEAR * unit:
            pressed = rate > 0.0
            if abs(rate) <= SLOW * unit:
                rise = -side * _acceleration(here, s)
                if abs(rise) <= SLOW * unit:
                    turn(here, s, FROZEN + UNKNOWN)
                    return []
                pressed = rise > 0.0
        now = side if pressed else now
    turn(here, s, FROZEN + now)
    if now == old or (old == UNKNOWN and now == 0.0):
        return []
    words = ROPE if here.structure.switches[s].switch.path else WORDS
    return [(s, words[now])]


def _acceleration(here: Here, s: int) -> float:
    """Second derivative of the quantity of a switch if it is open."""
    S, W = here.c.system, here.c.work
    before = way(here, s)
    turn(here, s, FROZEN)
    _, dy = here.c.at(here.t, here.q, here.v, MOTION)
    turn(here, s, before)
    m = int(S.switch_i[s, SWITCH_MEASURED])
    nq, r = here.structure.nq, len(S.row_i) + m
    at = slice(S.row_p[r], S.row_p[r + 1])
    return float(W.G[at] @ dy[nq + S.col_i[at]] + W.sensed[BIAS, m])


def _ratchet(here: Here, s: int, sensed: np.ndarray, first: bool) -> list[tuple[int, str]]:
    """Going on, or back to the last tooth that was passed."""
    S, W = here.c.system, here.c.work
    tooth, pitch = S.switch_x[s, SWITCH_TOOTH], S.switch_x[s, SWITCH_PITCH]
    m, old = int(S.switch_i[s, SWITCH_MEASURED]), way(here, s)
    x, rate, unit = sensed[VALUE, m], sensed[RATE, m], _unit(here, s)
    now = 1.0 if rate > SLOW * unit else -1.0 if rate < -SLOW * unit else np.sign(_acceleration(here, s)) or 1.0
    if now == old and not first:
        return []
    turn(here, s, now)
    W.switch[LOWER, s], W.switch[UPPER, s] = -np.inf, np.inf
    if now < 0.0:
        W.switch[LOWER, s] = tooth + pitch * np.floor((x - tooth) / pitch + NEAR)
    return [] if first else [(s, "goes on" if now > 0.0 else "goes back to its last tooth")]


def let_go(here: Here, s: int) -> None:
    """A ratchet that its tooth let go of goes on."""
    turn(here, s, 1.0)
    here.c.work.switch[LOWER, s] = -np.inf
