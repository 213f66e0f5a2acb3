"""Slips of places of contact in the small problem: what sticks or slides at a gap that is closed, by its own force.

In the plane a slip is one row that GRIPS, in space two that are TURNS and WITH; what they hold is mu times the force of
the gap. What slides with a speed slides a known way: DRIVEN.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ....constraints.modes import EDGE, SLIP, STOP
from ....equations.sliding import FIRST, FRESH, OVER
from ....numerics.cone.dense.problem import DRIVEN, EVEN, GRIPS, HOLDS, SLIPS, TURNS, WITH, Dense
from ....tables.system import (
    G_CONE,
    G_TURNS,
    HELD,
    OFF,
)
from .instant import Instant, Part

ALMOST = 0.9  # of the speed at which a slip goes the way of its velocity alone
SLOW = 1e3  # times what is still: slower where the end of a slip in space was found, it is over


def slips_of(n: Instant, gap: int) -> list[int]:
    """Slips of the place of a gap: none, one or two in a row."""
    return [s for s in n.of(SLIP) if n.S.switches.other[s] == gap]


def astray(n: Instant) -> set[int]:
    """Gaps of corners that leave their face: at its end, and going on."""
    leaving = (n.x <= n.near) & ((n.rate < -n.still) | (n.x < -n.near))
    return {int(n.S.switches.other[s]) for s in n.of(EDGE) if leaving[s]}


def ended(n: Instant, fired: np.ndarray, still: np.ndarray) -> None:
    """Whether slips are over, into ``still``: of a pair both or none."""
    done = n.fired(fired, G_TURNS)
    for s in n.of(SLIP):
        other = int(n.S.switches.partner[s])
        if other < 0:
            still[s] |= s in done
        elif s < other:
            slow = np.hypot(n.rate[s], n.rate[other]) <= SLOW * (n.still[s] + n.still[other])
            still[[s, other]] = (still[s] and still[other]) or (slow and s in done and not _goes_on(n, [s, other]))


def stop_slips(n: Instant, fired: np.ndarray) -> None:
    """Take what is left of their speed from slips in space that are over: what follows slides by its acceleration.

    What was closed stays so; all else is looked at again.
    """
    over = []
    for s in sorted(n.fired(fired, G_TURNS)):
        pair = [s, int(n.S.switches.partner[s])]
        speed, still = np.linalg.norm(n.rate[pair]), n.still[pair].sum()
        if n.kind[s] == SLIP and pair[1] >= 0 and still < speed <= SLOW * still and not _goes_on(n, pair):
            over += pair
    if not over:
        return
    gaps = np.flatnonzero((n.kind == STOP) & (n.mode != OFF)).tolist()
    B, P, _ = n.problem([Part(s, HOLDS) for s in (*over, *gaps)])
    rates = np.zeros(len(B.which))
    rates[: len(over)] = n.rate[over]
    n.here.v[:] -= np.linalg.lstsq(P.A, rates, rcond=1e-12)[0] @ B.Y
    n.look_again()


def _goes_on(n: Instant, pair: list[int]) -> bool:
    """Whether a slip that has just begun still goes its way: it is slow since it was at rest."""
    fresh = len(pair) > 1 and n.way[pair] @ n.way[pair] > FRESH and n.way[pair] @ n.rate[pair] > 0.0
    return bool(fresh and np.linalg.norm(n.rate[pair]) < ALMOST * OVER * FIRST * n.here.c.values.length)


def _heading(n: Instant, own: list[int]) -> np.ndarray:
    """Direction in which a place slides, as the motion has it (`equations.sliding.heading`)."""
    u = n.rate[own]
    if _goes_on(n, own):
        first = FIRST * n.here.c.values.length
        u = u + first * np.exp(-(u @ u) / first**2) * n.way[own] / FRESH
    return np.asarray(u / np.linalg.norm(u))


def parts_of(n: Instant, gap: int, at: int, still: np.ndarray, *, led: bool) -> list[Part]:
    """Rows of the slips of a gap, which is row ``at``.

    What slides does so its known way if ``led``; else it is asked where to, as in an impact.
    """
    own = slips_of(n, gap)
    if not own:
        return []
    held = bool(still[own].all())
    numbers = n.S.switch_numbers
    mu = float((numbers.static_friction if held else numbers.kinetic_friction)[own[0]])
    if held or not led:
        rules = (GRIPS,) if len(own) == 1 else (TURNS, WITH)
        return [Part(s, rule, state=EVEN, gain=mu, of=at) for s, rule in zip(own, rules, strict=True)]
    d = _heading(n, own)
    return [Part(s, DRIVEN, lean=float(x), gain=mu, of=at) for s, x in zip(own, d, strict=True)]


def slide_on(n: Instant, parts: Sequence[Part], P: Dense, resting: np.ndarray) -> bool:
    """Let what begins to slip hold what it carries in motion, not what others keep at rest.

    Returns whether that is another problem.
    """
    other = False
    for i, p in enumerate(parts):
        if n.kind[p.switch] == SLIP and P.rule[i] != WITH and P.state[i] != EVEN and not resting[i]:
            mu = float(n.S.switch_numbers.kinetic_friction[p.switch])
            other |= P.gain[i, p.of] != mu
            P.gain[i, p.of] = mu
    return other


def loose(n: Instant, parts: Sequence[Part], found: tuple[np.ndarray, ...], fired: np.ndarray) -> dict[int, Part]:
    """Rows that stick at the very end of what they hold, by guards that fired, as what slides.

    ``found`` are forces, states, reaches, and forces that are nothing.
    """
    x, state, reach, least = found
    ends = n.fired(fired, G_CONE)
    out = {}
    for i, p in enumerate(parts):
        own = [i] if p.rule == GRIPS else [i, i + 1]
        if p.switch not in ends or p.rule not in (GRIPS, TURNS) or n.kind[p.switch] != SLIP or state[i] != EVEN:
            continue
        size = float(np.linalg.norm(x[own]))
        if size >= reach[i] - least[i]:
            mu = float(n.S.switch_numbers.kinetic_friction[p.switch])
            for k in own:
                out[k] = parts[k]._replace(rule=DRIVEN, lean=-float(x[k]) / size if size else 0.0, gain=mu)
    return out


def write_slips(n: Instant, parts: Sequence[Part], found: tuple[np.ndarray, ...]) -> None:
    """Modes and ways of all slips: they stick or slide where the gap is closed.

    ``found`` are states, forces, rates, and ways that are known.
    """
    state, x, u, lean = found
    W, ways = n.W, n.ways()
    slips = n.of(SLIP)
    W.modes.mode[slips], W.modes.hold[slips] = OFF, 0.0
    for i, p in enumerate(parts):
        own = slips_of(n, int(n.S.switches.other[p.switch])) if n.kind[p.switch] == SLIP else [-1]
        if p.switch != own[0] or state[p.of] != EVEN:
            continue
        rows = np.arange(i, i + len(own))
        if (state[rows] == EVEN).all():
            W.modes.mode[own], ways[own] = HELD, 0.0
            continue
        d = lean[rows]
        if state[i] == SLIPS:  # the way it accelerates; against its friction, where that is none
            d = u[rows] if np.linalg.norm(u[rows]) > 0.0 else -x[rows]
            d = d / np.linalg.norm(d)
        if n.mode[own[0]] == OFF and _goes_on(n, own):
            ways[own] = n.way[own]
            continue
        ways[own] = FRESH * d if len(own) > 1 and _begins(n, own, d, u[rows]) else d


def _begins(n: Instant, own: list[int], d: np.ndarray, u: np.ndarray) -> bool:
    """Whether a slip in space has hardly any speed yet and gets faster the way d."""
    speed = np.linalg.norm(n.rate[own])
    return bool(speed <= n.still[own].sum() or (speed < FIRST * n.here.c.values.length and u @ d > 0.0))
