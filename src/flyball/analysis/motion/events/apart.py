"""Overlaps of rounding size at the start: bodies are put side by side, as assembly closes joints."""

from __future__ import annotations

import numpy as np

from ....constraints.modes import STOP
from ....tables.system import HELD
from .instant import Instant

SLIGHT = 1e-5  # of the mechanism's length, or of a radian: as positions are rounded in a description
TOLD = 1e-7  # of the same: worth a word


def put_apart(n: Instant) -> None:
    """Take overlaps up to `SLIGHT` away, of contacts, stops and ropes; velocities stay."""
    over = {}
    for s in np.flatnonzero(n.kind == STOP).tolist():
        lower, upper = n.W.modes.lower[s], n.W.modes.upper[s]
        for side, beyond in ((lower, lower - n.x[s]), (upper, n.x[s] - upper)):
            if n.near[s] < beyond <= SLIGHT * n.unit[s]:
                over[s] = side, beyond
    if not over:
        return
    y, modes, hold = n.here.y.copy(), n.W.modes.mode.copy(), n.W.modes.hold.copy()
    for s, (side, _) in over.items():
        n.W.modes.mode[s], n.W.modes.hold[s] = HELD, side
    n.arrive()
    n.W.modes.mode[:], n.W.modes.hold[:] = modes, hold
    n.here.v[:] = y[n.here.structure.nq : n.here.structure.nq + n.here.structure.nv]
    n.arrive()  # velocities on the rows of joints, where they are now
    n.look()
    n.restored()
    told = {s: x for s, (_, x) in over.items() if x > TOLD * n.unit[s]}
    if told:
        most = max(told, key=lambda s: told[s])
        n.here.doubts.append(
            f"the start overlaps by up to {told[most]:.2g} ({n.name(most)}); what is there was moved by as much"
        )
