"""Bounces that come ever faster: where their series has become shorter than rounding, what bounced is at rest.

A flight that begins with the rate u and is brought back by the acceleration -a is u^2 / 2 a high and lasts 2 u / a.
Each is shorter than the one before by a ratio r, so all that are left last T / (1 - r), T being the one that begins.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ....equations.tasks import MOTION
from ....numerics.cone.dense.problem import HOLDS
from ....tables.system import BIAS
from .instant import Instant, Part
from .jump import Jump, add

LOW = 1e-13  # of the mechanism's length or a radian: a flight that is none
ROUNDED = 2e-14  # of how far the mechanism is from the origin: the same, since places there are known no better


@dataclass
class Bounces:
    """Those of one stop: how many there were, when the last one and the one before it were, when they are over."""

    count: int = 0
    last: float = -np.inf
    before: float = -np.inf
    over: float = np.nan


def note_bounces(n: Instant, jumped: Jump) -> None:
    """Count what closed and goes on apart, or lets something else go."""
    t = n.here.t
    for s in jumped.closing.keys() - n.here.astray:
        b = n.here.bounces.setdefault(s, Bounces())
        if t - b.last > 1.5 * (b.last - b.before):
            b.count = 0  # another series
        b.count, b.before, b.last, b.over = b.count + 1, b.last, t, np.nan


def coming_to_rest(n: Instant, at: dict[int, tuple[float, ...]], still: np.ndarray) -> np.ndarray:
    """Switches whose flights are none, (ns,); the modes are written, and their rates are those that they start with."""
    over = np.zeros(len(n.kind), bool)
    leaving = [s for s, side in at.items() if not still[s] and len(side) == 1]
    if not leaving:
        return over
    n.ask(MOTION)
    nq = n.S.sizes.coordinates
    a = n.gradients(np.array(leaving)) @ n.desk.K[0, nq : nq + n.here.structure.nv] + n.W.sensed[BIAS, n.m[leaving]]
    far = ROUNDED * np.abs(n.W.FK[:, :3]).max(initial=0.0)
    for s, acceleration in zip(leaving, a.tolist(), strict=True):
        u, back = at[s][0] * n.rate[s], -at[s][0] * acceleration
        if u > 0.0 and back > 0.0 and u * u <= 2.0 * back * max(LOW * n.unit[s], far * (n.units[s] == "m")):
            over[s] = True
            if s not in n.here.bounces:  # it did not close before: let go by rounding only
                continue
            b, flight = n.here.bounces[s], 2.0 * u / back
            past = n.here.t - (b.before if b.last == n.here.t else b.last)
            b.over = n.here.t + (flight / (1.0 - flight / past) if flight < past < np.inf else flight)
    return over


def settle_down(n: Instant, over: list[int], still: np.ndarray, jumped: Jump | None) -> None:
    """Take their rates from what bounces no more; friction that moved by these alone is at rest, into ``still``.

    ``jumped`` is the impact of the instant, if there was one: it was the last.
    """
    B, P, _ = n.problem([Part(s, HOLDS) for s in over])
    x = -np.linalg.lstsq(P.A, n.rate[over], rcond=1e-12)[0]
    n.here.v[:] += x @ B.Y
    if jumped is not None:
        add(n, jumped, B, x)
    n.look_again()
    still |= np.abs(n.rate) <= n.still
