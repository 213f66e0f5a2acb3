"""Rates that events name and that what holds keeps at zero: what is seen of these is the rounding of what holds."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ....numerics.cone.dense.problem import EVEN
from .instant import IMMOVABLE, Instant

if TYPE_CHECKING:
    from ....tables.specs import Structure
    from .modes import Decided

SAME = 1e-11  # of its own response: it moves with what holds


def still(n: Instant, found: Decided) -> tuple[int, ...]:
    """Measured quantities whose rates events name, that could move and that what holds now keeps still.

    What cannot move by anything here, as a slider at its dead centre, is none of them, nor is what a driver moves.
    """
    held = [i for i in range(len(found.parts)) if found.state[i] == EVEN and found.A[i, i] > 0.0]
    named = _named(n) if held else []
    if not named:
        return ()
    B, _, _ = n.problem(found.parts)
    axes = n.S.tree.v[n.S.tree.law >= 0]
    rows = n.S.rows.work >= 0
    A, out = found.A[np.ix_(held, held)], []
    drives = np.hstack([B.E[held][:, axes], B.L[held][:, rows]])
    nr, mass = len(n.S.rows.law), n.inertia.max()
    for m in named:
        w, at = np.zeros(n.here.structure.nv), slice(n.S.row_start[nr + m], n.S.row_start[nr + m + 1])
        np.add.at(w, n.S.column[at], n.W.G[at])
        a, lam, effort = n.response(w)
        own, cross = float(w @ a), B.Y[held] @ w
        if own * mass < IMMOVABLE:
            continue
        c = np.linalg.lstsq(A, cross, rcond=1e-12)[0]
        drive = np.r_[effort[axes], lam[rows]]
        size = max(np.abs(drives).max(initial=0.0), np.abs(drive).max(initial=0.0))
        if abs(own - c @ cross) <= SAME * own and (np.abs(drive - c @ drives) <= SAME * size).all():
            out.append(m)
    return tuple(out)


def _named(n: Instant) -> list[int]:
    """Measured quantities whose rates expressions of events name."""
    s = n.here.structure
    found: list[int] = s.kept.get("rates of events", 0, 1, lambda: _named_in(s))
    return found


def _named_in(s: Structure) -> list[int]:
    nm, found = len(s.measured), set()
    for e in s.events.values():
        for name in s.model.law(e.law, e.of, f"when of {e.title}").names:
            m = s.slots.get(name, -1)
            if nm <= m < 2 * nm:
                found.add(m - nm)
    return sorted(found)
