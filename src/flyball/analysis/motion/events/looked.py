"""What the watched loop saw, and how closely it looked."""

from __future__ import annotations

import numpy as np

from ....equations.watched import Loop
from ....numerics.integrators.watching import CHECKS, LOOKS, NODES, STEPS
from ....tables.system import G_LOWER, G_UPPER, GUARD_KIND, GUARD_OF, SWITCH_MEASURED, System

PLACES = NODES - 1 + CHECKS  # of a step at which guards are looked at, at least
DISTANCES = (G_LOWER, G_UPPER)  # guards of what is open
HARDLY = 0.5  # of its rate at a stop, at the begin of the step: it began to move in between


def crept(loop: Loop, S: System) -> frozenset[int]:
    """Stops that what stood at them has crept past: at the step's begin it hardly moved; what did hits them."""
    out = set()
    for g in loop.fired:
        kind, s = S.guard_i[g, [GUARD_KIND, GUARD_OF]].tolist()
        if kind in DISTANCES:
            before, now = np.abs(loop.desk.moving[:, 1, S.switch_i[s, SWITCH_MEASURED]])
            if before <= HARDLY * now:
                out.add(s)
    return frozenset(out)


def told(loop: Loop) -> str:
    """How closely a motion was looked for events: what may have come and gone in between was not seen."""
    count = loop.desk.count
    guards, steps = len(loop.desk.way), max(int(count[STEPS]), 1)
    what = "1 guard" if guards == 1 else f"{guards} guards"
    return (
        f"{what} at {count[LOOKS] / steps:.0f} places a step on average, {PLACES} at least: what passes zero and comes "
        f"back between two of them is not seen"
    )
