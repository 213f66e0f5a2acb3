"""Switches whose guards were found beyond zero, where a step's end was looked at and no passing had been seen."""

from __future__ import annotations

import numpy as np

from ....equations.watched import Loop
from ....tables.system import G_CORNER
from .here import Here
from .looked import DISTANCES

HARDLY = 0.5  # of its rate at a stop, at the begin of the step: it began to move in between


def astray(here: Here, loop: Loop) -> frozenset[int]:
    """Switches that went where they should not be, unseen: stops crept past, corners on the other side.

    At the step's begin such a stop hardly moved; what did hits it. On which side a law is then, what decides says.
    """
    S, out = here.c.system, set()
    for g in loop.fired if loop.desk.count.away else ():
        kind, s = int(S.guards.kind[g]), int(S.guards.of[g])
        if kind == G_CORNER:
            out.add(s)
        elif kind in DISTANCES:
            before, now = np.abs(loop.desk.moving[:, 1, S.switches.measured[s]])
            if before <= HARDLY * now:
                out.add(s)
    return frozenset(out)
