"""What is zero of events' expressions where the watched loop stops, and where a motion goes on from another."""

from __future__ import annotations

import numpy as np

from ....equations.watched import Loop
from ....numerics.integrators.watching import END, FIRED, GRAIN_END, MARK, UNKNOWN
from ....tables.system import G_CORNER
from .actions import at_the_seam
from .here import Here
from .instant import instant_of
from .looked import DISTANCES


def as_fired(here: Here, loop: Loop) -> None:
    """Keep what is zero of events' expressions where a step ended on events, and what they were of those that fired."""
    events, desk = here.structure.events, loop.desk
    here.nothing = {g: float(desk.g[MARK, g]) for g in events}
    here.zero |= {events[g].name: float(desk.g[FIRED, g]) for g in loop.fired if g in events}


def as_grains(here: Here, loop: Loop) -> None:
    """Keep what is rounding of events' expressions where a step ended on a time at which forces jump."""
    here.nothing = {g: float(loop.desk.real.strayed * loop.desk.g[GRAIN_END, g]) for g in here.structure.events}


def as_left(here: Here, loop: Loop) -> None:
    """Keep the sides that events' expressions were on that are zero to rounding where the motion ends."""
    desk, here.sides = loop.desk, {}
    for g, e in here.structure.events.items():
        near = abs(desk.g[END, g]) <= desk.real.strayed * desk.g[GRAIN_END, g]
        if near and abs(desk.side[g]) == 1.0:
            here.sides[e.name] = float(desk.side[g])


def resume(here: Here, loop: Loop) -> None:
    """Sides of events where a motion goes on: what happened at the very end of the one before has just happened.

    What did not is ahead, however near: on the side that it was on before it was rounding. What has been taken off
    zero since is where it is, as within a motion.
    """
    desk, told = loop.desk, at_the_seam(here)
    values = instant_of(here).guards()
    for g, e in here.structure.events.items():
        desk.side[g] = 0.0 if e.name in told else here.sides.get(e.name) or np.sign(values[g]) or UNKNOWN
        desk.g[END, g], desk.g[FIRED, g] = values[g], here.zero.get(e.name, 0.0)


# Switches whose guards were found beyond zero, where a step's end was looked at and no passing had been seen.


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
