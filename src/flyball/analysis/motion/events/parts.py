"""Who takes part: rows of the small problem, of velocities in a jump or of accelerations where modes are decided."""

from __future__ import annotations

import numpy as np

from ....constraints.modes import FRICTION, LOCK, ONE_WAY, STATIC
from ....numerics.cone.dense.problem import DRIVEN, EVEN, FREE, GRIPS, HOLDS, PUSHES
from ....tables.system import (
    G_BACK,
    G_LOWER,
    G_SLIDES,
    G_UPPER,
    OFF,
)
from .instant import STOPS, Instant, Part
from .slips import astray, ended
from .slips import parts_of as slips_at

SIDES = {G_LOWER: 1.0, G_UPPER: -1.0}


def sides(n: Instant, fired: np.ndarray) -> dict[int, tuple[float, ...]]:
    """Of every stop the sides that it is at: +1 the lower one, -1 the upper one."""
    hit = {(s, SIDES[k]) for k, s, _ in (n.guarded[g] for g in fired) if k in SIDES}
    out = {}
    gone = astray(n)
    for s in n.of(*STOPS):
        if s in gone:
            continue
        gaps = {1.0: n.x[s] - n.W.modes.lower[s], -1.0: n.W.modes.upper[s] - n.x[s]}
        held = n.way[s] if n.mode[s] != OFF else 0.0
        at = tuple(w for w, gap in gaps.items() if gap < np.inf and (gap <= n.near[s] or (s, w) in hit or w == held))
        if at:
            out[s] = at
    return out


def at_rest(n: Instant, fired: np.ndarray) -> np.ndarray:
    """Whether the rate of each switch is none, (ns,)."""
    still = np.abs(n.rate) <= n.still
    still[list(n.fired(fired, G_SLIDES, G_BACK))] = True
    ended(n, fired, still)
    return still


def of_velocities(n: Instant, at: dict[int, tuple[float, ...]], still: np.ndarray) -> list[Part]:
    """Rows that impulses may act along."""
    out = []
    for s, kind in enumerate(n.kinds):
        if kind in STOPS and s in at:
            out += _stop(s, at[s])
            out += slips_at(n, s, len(out) - 1, still, led=False)
        elif kind == ONE_WAY:
            out.append(Part(s, PUSHES, state=EVEN))
        elif kind == LOCK and n.m[s] >= 0 and n.mode[s] != OFF:
            out.append(Part(s, HOLDS))
        elif kind == FRICTION and n.S.forces.load[n.force[s]] >= 0:
            held = bool(still[s]) or n.mode[s] != OFF
            out.append(
                Part(s, GRIPS, 1.0, STATIC if held else _sign(n.rate[s]), 0.0 if held else n.rate[s], state=EVEN)
            )
    return out


def of_accelerations(n: Instant, at: dict[int, tuple[float, ...]], still: np.ndarray) -> list[Part]:
    """Rows that forces may act along: of those that move apart, or slide, only friction that follows its load."""
    out = []
    for s, kind in enumerate(n.kinds):
        if kind in STOPS and s in at and still[s]:
            out += _stop(s, at[s], EVEN if n.mode[s] != OFF else FREE)
            out += slips_at(n, s, len(out) - 1, still, led=True)
        elif kind == ONE_WAY and still[s]:
            out.append(Part(s, PUSHES, state=EVEN if n.mode[s] != OFF else FREE))
        elif kind == LOCK and n.m[s] >= 0 and n.mode[s] != OFF:
            out.append(Part(s, HOLDS))
        elif kind == FRICTION:
            if still[s]:
                out.append(Part(s, GRIPS, way=STATIC, state=EVEN))
            elif n.S.forces.load[n.force[s]] >= 0:
                sign = _sign(n.rate[s])
                out.append(Part(s, DRIVEN, way=sign, rate=float(n.rate[s]), lean=sign))
    return out


def _stop(s: int, at: tuple[float, ...], state: int = EVEN) -> list[Part]:
    """One that is at both sides holds."""
    return [Part(s, HOLDS)] if len(at) > 1 else [Part(s, PUSHES, at[0], state=state)]


def _sign(x: float) -> float:
    return 1.0 if x > 0.0 else -1.0
