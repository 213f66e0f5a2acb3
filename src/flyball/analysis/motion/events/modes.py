"""Modes: who holds, slides, lets go, by the accelerations that follow.

One small problem for all; what friction at rest cannot hold slides with what it carries in motion, and with that all is
decided again, since another force acts then on the rest.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ....constraints.modes import FRICTION
from ....equations.friction import FORGOTTEN
from ....numerics.cone.dense.problem import DRIVEN, EVEN, FOUND, GRIPS, LOW, OUT, PUSHES
from ....tables.system import G_HOLDS, G_PULL, HELD, HOLD, LEARNT, LOWER, MODE, OFF, UPPER
from .instant import DECIDED, STOPS, Instant, Part
from .parts import of_accelerations
from .slips import loose, slide_on, write_slips

TIED = 1e-7  # of the forces that a force is the difference of: as good as none
CASCADE = 20  # times that others are asked again after some began to slide


@dataclass
class Decided:
    """Modes at an instant: rows that took part, and the problem as it was solved.

    ``sizes`` has of each switch the forces that its own is the difference of.
    """

    parts: list[Part]
    ended: int
    x: np.ndarray
    u: np.ndarray
    state: np.ndarray
    lean: np.ndarray
    reach: np.ndarray
    sizes: dict[int, float]
    status: int = 0


def decide(n: Instant, at: dict[int, tuple[float, ...]], still: np.ndarray, fired: np.ndarray) -> Decided:
    """Modes by one problem of accelerations, into the motion; ``n`` has looked there.

    What a guard says has just reached the end of what it holds is not held on to for the sake of rounding.
    """
    parts = of_accelerations(n, at, still)
    found = solved(n, parts)
    if found.ended == FOUND and (let_go := _loose(n, found, fired)):
        other = solved(n, [let_go.get(i, p) for i, p in enumerate(parts)])
        found = other if other.ended == FOUND else found
    if found.ended == FOUND:
        write(n, found, still)
    return found


def _loose(n: Instant, found: Decided, fired: np.ndarray) -> dict[int, Part]:
    """Rows that hold at the very end of what they can, by guards that fired, as they are when they do not."""
    ends = {int(s): int(kind) for kind, s, _ in n.S.guard_i[fired] if int(kind) in (G_PULL, G_HOLDS)}
    little = np.array([TIED * found.sizes[p.switch] for p in found.parts])
    out = loose(n, found.parts, (found.x, found.state, found.reach, little), fired)
    for i, p in enumerate(found.parts):
        kind = ends.get(p.switch)
        least = little[i]
        if kind is None or found.state[i] != EVEN:
            continue
        if (kind == G_PULL and p.rule == PUSHES and found.x[i] <= least) or (
            kind == G_HOLDS and p.rule == GRIPS and abs(found.x[i]) >= found.reach[i] - least
        ):
            out[i] = _let_go(p, found.x[i])
    return out


def _let_go(p: Part, x: float) -> Part:
    """The same row when it does not hold any more."""
    if p.rule == PUSHES:
        return p._replace(rule=OUT)
    way = -1.0 if x > 0.0 else 1.0
    return p._replace(rule=DRIVEN, way=way, lean=way)


def solved(n: Instant, parts: list[Part]) -> Decided:
    """The problem solved; what begins to slide slides with what it carries then."""
    B, P, status = n.problem(parts)
    ended = FOUND
    for _ in range(CASCADE):
        ended = n.balance(B, P, False)
        slips = np.flatnonzero((P.rule == GRIPS) & (P.state != EVEN))
        if ended != FOUND or not (slide_on(n, parts, P) or len(slips)):
            break
        for i in slips.tolist():
            P.rule[i], P.lean[i] = DRIVEN, 1.0 if P.state[i] == LOW else -1.0
            B.way[i] = P.lean[i] if parts[i].way != 0.0 else 0.0
    x = P.x.copy()
    terms = (np.abs(P.b) + np.abs(P.A) @ np.abs(x)) / np.maximum(P.A.diagonal(), 1e-300)
    sizes = {p.switch: float(z) for p, z in zip(parts, terms, strict=True)}
    return Decided(parts, ended, x, P.u.copy(), P.state.copy(), P.lean.copy(), P.reach.copy(), sizes, status)


def write(n: Instant, found: Decided, still: np.ndarray) -> None:
    """Modes, ways and places to hold into the motion."""
    W, ways = n.W, n.ways()
    for s, kind in enumerate(n.kind.tolist()):
        if kind in DECIDED and n.m[s] >= 0:
            W.switch[MODE, s] = OFF
            ways[s] = np.sign(n.rate[s]) if kind == FRICTION and not still[s] else 0.0
    for i, p in enumerate(found.parts):
        s, kind = p.switch, n.kind[p.switch]
        if found.state[i] == EVEN:
            W.switch[MODE, s] = HELD
            W.switch[HOLD, s] = n.hold[s] if n.mode[s] == HELD else n.x[s]
            if kind in STOPS:
                W.switch[HOLD, s] = W.switch[LOWER if p.sign > 0.0 else UPPER, s]
            ways[s] = p.sign if p.rule == PUSHES else 0.0
        elif kind == FRICTION:
            ways[s] = found.lean[i]
    write_slips(n, found.parts, (found.state, found.x, found.u, found.lean))
    if len(n.S.load_i):
        W.info[LEARNT] = FORGOTTEN
