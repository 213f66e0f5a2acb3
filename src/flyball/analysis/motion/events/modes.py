"""Modes: who holds, slides, lets go, by the accelerations that follow.

One small problem for all; what friction at rest cannot hold slides with what it carries in motion, and with that all is
decided again, since another force acts then on the rest.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ....constraints.modes import BY_RATE, FRICTION
from ....equations.friction import FORGOTTEN
from ....equations.instant import FORCES
from ....numerics.cone.dense.problem import DRIVEN, EVEN, FOUND, GRIPS, LOW, OUT, PUSHES
from ....tables.specs import Structure
from ....tables.system import G_HOLDS, G_PULL, HELD, LOAD, OFF
from .idle import take_over, tied
from .instant import DECIDED, IMMOVABLE, STOPS, Instant, Part
from .parts import of_accelerations
from .shares import give_way, rests, slides, write_group
from .slips import loose, slide_on, write_slips

TIED = 1e-7  # of the accelerations that an acceleration is the difference of: as good as none
CASCADE = 20  # times that others are asked again after some began to slide


@dataclass
class Decided:
    """Modes at an instant: rows that took part, and the problem as it was solved.

    ``sizes`` has of each switch the forces that its own is the difference of; ``taken_up``: all of them hold, by shares
    that are clearly within their bounds; ``least``: of each switch the force that rounding of accelerations makes.
    """

    parts: list[Part]
    ended: int
    x: np.ndarray
    u: np.ndarray
    state: np.ndarray
    lean: np.ndarray
    reach: np.ndarray
    sizes: dict[int, float]
    least: dict[int, float]
    A: np.ndarray
    gain: np.ndarray
    taken_up: bool = False


def decide(n: Instant, at: dict[int, tuple[float, ...]], still: np.ndarray, fired: np.ndarray) -> Decided:
    """Modes by one problem of accelerations, into the motion; ``n`` has looked there.

    What a guard says has reached the end of what it holds lets go where that is against no rule: not for the sake of
    rounding, and not where redundancy leaves open who carries what, should it be held on to.
    """
    found = solved(n, of_accelerations(n, at, still))
    parts = found.parts
    let_go = _loose(n, found, fired) if found.ended == FOUND else {}
    if (
        let_go and n.shares and (others := solved(n, parts, company=True)).taken_up
    ):  # what touches can carry more from here on
        found, let_go = others, {}
    if found.ended == FOUND:
        let_go |= give_way(n, parts, fired)
    while let_go:
        other = solved(n, [let_go.get(i, p) for i, p in enumerate(parts)])
        back = [i for i in let_go if other.ended != FOUND or _against(n, other, i)]
        if not back:
            found = other
        let_go = {i: p for i, p in let_go.items() if i not in back} if back else {}
    if found.ended == FOUND:
        take_over(n, found)
        n.here.tied, n.here.still, n.here.least = tied(n, found), kept_still(n, found), found.least
        write(n, found, still)
    return found


def _loose(n: Instant, found: Decided, fired: np.ndarray) -> dict[int, Part]:
    """Rows that hold and whose guards fired, as they are when they do not; friction that carries nothing holds on."""
    ends = {s: kind for kind, s, _ in (n.guarded[g] for g in fired) if kind in (G_PULL, G_HOLDS)}
    out = loose(n, found.parts, (found.x, found.state, found.reach, np.full(len(found.x), np.inf)), fired)
    asked = {(G_PULL, PUSHES), (G_HOLDS, GRIPS)}
    for i, p in enumerate(found.parts):
        idle = p.rule == GRIPS and max(abs(found.x[i]), found.reach[i]) <= found.least[p.switch]
        if found.state[i] == EVEN and (ends.get(p.switch, -1), p.rule) in asked and not idle:
            out[i] = _let_go(p, found.x[i])
    return out


def _against(n: Instant, found: Decided, i: int) -> bool:
    """Whether row i, which was let go, moves against its rule; of rows that slip together whether both do."""
    p = found.parts[i]
    least = TIED * found.sizes[p.switch] * found.A[i, i] + n.tiny[p.switch]
    if p.rule != DRIVEN:
        return bool(found.u[i] < -least)
    own = [k for k, q in enumerate(found.parts) if k == i or (p.of >= 0 and q.of == p.of and q.rule == DRIVEN)]
    return bool(found.u[own] @ [found.parts[k].lean for k in own] < -least)


def _let_go(p: Part, x: float) -> Part:
    """The same row when it does not hold any more."""
    if p.rule == PUSHES:
        return p._replace(rule=OUT)
    way = -1.0 if x > 0.0 else 1.0
    return p._replace(rule=DRIVEN, way=way, lean=way)


def solved(n: Instant, parts: list[Part], *, company: bool = False) -> Decided:
    """The problem solved; what begins to slide slides with what it carries then.

    ``company``: all that touches holds if it can, though less would do.
    """
    B, P, _ = n.problem(parts)
    free = [i for i in range(len(parts)) if P.rule[i] != GRIPS or P.A[i, i] > 0.0]
    if len(free) < len(parts):  # nothing free moves it, so its row cannot hold it
        parts = [parts[i]._replace(of=free.index(parts[i].of) if parts[i].of >= 0 else -1) for i in free]
        B, P, _ = n.problem(parts)
    ended, resting = FOUND, np.zeros(len(parts), bool)
    for _ in range(CASCADE):
        ended = n.balance(B, P, FORCES)
        resting = rests(n, parts, P, None if company else ended)
        if resting.any() and (P.state[resting] == EVEN).all():
            ended = FOUND
        if ended != FOUND and (sliding := slides(n, parts, P)):
            parts = [sliding.get(i, p) for i, p in enumerate(parts)]
            B, P, _ = n.problem(parts)
            continue
        slips = np.flatnonzero((P.rule == GRIPS) & (P.state != EVEN) & ~resting).tolist()
        if ended != FOUND or not (slide_on(n, parts, P, resting) or slips):
            P.state[resting] = EVEN
            break
        for i in slips:
            P.rule[i], P.lean[i] = DRIVEN, 1.0 if P.state[i] == LOW else -1.0
            B.way[i] = P.lean[i] if parts[i].way != 0.0 else 0.0
    x = P.x.copy()
    terms = (np.abs(P.b) + np.abs(P.A) @ np.abs(x)) / np.maximum(P.A.diagonal(), 1e-300)
    rounding = P.grain * np.minimum(1.0 / np.maximum(P.A.diagonal(), 1e-300), n.inertia[B.which])
    sizes, least = ({p.switch: float(z) for p, z in zip(parts, of, strict=True)} for of in (terms, rounding))
    return Decided(
        parts, ended, x, P.u.copy(), P.state.copy(), P.lean.copy(), P.reach.copy(), sizes, least, P.A.copy(),
        P.gain.copy(), company and bool(resting.any()),
    )  # fmt: skip


def elements(n: Instant, parts: list[Part]) -> list[str]:
    """Titles of the elements that rows are of."""
    return list(dict.fromkeys(n.here.structure.switches[p.switch].element.title for p in parts))


def come_to_rest(n: Instant, found: Decided) -> None:
    """Take the rounding from the rates of what holds."""
    room = n.rooms[len(found.parts)]
    B, P = room.B, room.P
    held = [i for i, p in enumerate(found.parts) if found.state[i] == EVEN and n.rate[p.switch] != 0.0]
    if held:
        rates = B.sign[held] * n.rate[B.which[held]]
        A = P.A[np.ix_(held, held)]
        x = -rates / A[0] if len(held) == 1 and A[0, 0] > 0.0 else np.linalg.lstsq(A, -rates, rcond=1e-12)[0]
        n.here.v[:] += x @ B.Y[held]


def write(n: Instant, found: Decided, still: np.ndarray) -> None:
    """Modes, ways and places to hold into the motion."""
    W, ways, taking = n.W, n.ways(), {p.switch for p in found.parts}
    for s, kind in enumerate(n.kinds):
        if kind in DECIDED and n.m[s] >= 0:
            W.modes.mode[s] = OFF
            ways[s] = np.sign(n.rate[s]) if kind == FRICTION and not still[s] else 0.0
            if kind == FRICTION and still[s] and s not in taking:
                ways[s] = BY_RATE
    for i, p in enumerate(found.parts):
        s, kind = p.switch, n.kind[p.switch]
        if found.state[i] == EVEN:
            W.modes.mode[s] = HELD
            W.modes.hold[s] = n.hold[s] if n.mode[s] == HELD else n.x[s]
            if kind in STOPS:
                W.modes.hold[s] = (W.modes.lower if p.sign > 0.0 else W.modes.upper)[s]
            ways[s] = p.sign if p.rule == PUSHES else 0.0
        elif kind == FRICTION:
            ways[s] = found.lean[i]
    write_slips(n, found.parts, (found.state, found.x, found.u, found.lean))
    write_group(n, found.parts, (found.state, found.A, found.gain, found.x, found.reach))
    if len(n.S.load_terms.load):
        W.counts.load_updates = FORGOTTEN
        W.sensed[LOAD, 2 * len(n.here.structure.measured) : n.first] = 0.0  # of two solutions the one from no load


# Rates that events name and that what holds keeps at zero: what is seen of these is the rounding of what holds.


SAME = 1e-11  # of its own response: it moves with what holds


def kept_still(n: Instant, found: Decided) -> tuple[int, ...]:
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
