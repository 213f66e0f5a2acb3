"""Velocities that change at once: what closes, what is locked, what is kicked, all together.

Impulses x along the rows that take part, u+ = A x + u-, each by its rule: what pushes does not pull, what is locked
holds, friction carries no more than the impulse of its own load lets it. Restitution by Poisson's law: an inelastic
impact, then impulses of at least e times those (Pfeiffer and Glocker 1996, section 8.3); or by Newton's, u+ >= -e u-.
Neither may make energy: what goes beyond the inelastic impact goes only as far as there is energy for it.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ....equations.instant import BLOWS, Bench
from ....numerics.cone.dense.problem import FOUND, HOLDS, PUSHES, Dense
from .instant import STOPS, Instant, Part

REST = 1e-12  # of the terms of a rate after the jump: none


@dataclass
class Jump:
    """What a jump did.

    Attributes
    ----------
    impulse : dict
        Switch -> impulse along its quantity.
    closing : dict
        Switch -> rate at which it closed, and that at which it goes on.
    lost, given : float
        Energy [J] that the impacts took, and that kicks gave.
    passed : float
        Energy [J] that the impulses took and gave back, in sum: ``lost`` is a difference of it.
    jammed : tuple of int
        Switches that stopped without a collision.
    rows, along : ndarray
        Impulses of all rows, then of drivers that prescribe coordinates; and change of the velocities, (nv,).
    """

    impulse: dict[int, float] = field(default_factory=dict)
    closing: dict[int, tuple[float, float]] = field(default_factory=dict)
    lost: float = 0.0
    given: float = 0.0
    passed: float = 0.0
    rows: np.ndarray = field(default_factory=lambda: np.zeros(0))
    along: np.ndarray = field(default_factory=lambda: np.zeros(0))
    blows: tuple[Any, ...] = ()
    even: frozenset[int] = frozenset()  # switches whose quantities are at rest afterwards
    ended: int = FOUND
    jammed: tuple[int, ...] = ()


def must_jump(n: Instant, parts: list[Part], rate: np.ndarray) -> bool:
    """Whether a rate is against a rule."""
    for p in parts:
        u, still = p.sign * rate[p.switch], n.still[p.switch]
        if (p.rule == PUSHES and u < -still) or (p.rule == HOLDS and abs(u) > still):
            return True
    return False


def jump(n: Instant, parts: list[Part], kick: np.ndarray | None) -> Jump:
    """Change the velocities of the motion as the rules of these rows ask; see the module."""
    B, P, _ = n.problem(parts)
    out = nothing(n)
    before = B.sign * n.rate[B.which]
    drive = np.zeros_like(out.along)
    if kick is not None:
        before = before + kicked(n, kick, out, B, drive)
    P.grain[:] = n.still[B.which]
    B.loaded[:] = out.rows[: len(B.loaded)]  # what the kick alone asks of joints
    unmoved = (P.A.diagonal() == 0.0) & (np.abs(before) <= P.grain)  # by impulses: its rate is rounding
    P.b[:] = np.where(unmoved, 0.0, before)
    out.ended = n.balance(B, P, BLOWS)
    x, u = P.x.copy(), P.u.copy()
    if out.ended != FOUND:
        return out
    if len(parts):
        x, u = expanded(n, B, P, parts, before, (x, u))
    return finish(n, (B, P), parts, (before, x, u), out, drive)


def finish(
    n: Instant,
    solved: tuple[Bench, Dense],
    parts: list[Part],
    found: tuple[np.ndarray, np.ndarray, np.ndarray],
    out: Jump,
    drive: np.ndarray,
) -> Jump:
    """Velocities of the motion after impulses x, which take the rows' rates from ``before`` to u."""
    B, P = solved
    before, x, u = found
    out.lost = -float(x @ (before + u)) / 2.0
    out.passed = float(np.abs(x) @ (np.abs(before) + np.abs(u))) / 2.0
    out.rows += x @ B.L
    out.along += x @ B.Y
    drive += x @ B.E
    for p, xi, b, a in zip(parts, x.tolist(), before.tolist(), u.tolist(), strict=True):
        out.impulse[p.switch] = out.impulse.get(p.switch, 0.0) + p.sign * xi
        if (p.rule == PUSHES and b < -n.still[p.switch]) or (p.rule == HOLDS and abs(b) > n.still[p.switch]):
            out.closing[p.switch] = (b, a)
    size = np.abs(P.A) @ np.abs(x) + np.abs(before)
    out.even = frozenset(B.which[np.abs(u) <= REST * size + n.still[B.which]].tolist())
    driven(n, out, drive)
    n.here.v[:] += out.along
    return out


def add(n: Instant, out: Jump, B: Bench, x: np.ndarray) -> None:
    """Count further impulses along the rows of a problem to those of a jump; velocities have them already."""
    S, nr = n.S, len(n.S.rows.law)
    out.rows[:nr] += x @ B.L
    out.rows[nr:] += (x @ B.E)[S.tree.v[S.tree.law >= 0]]
    for s, more in zip(B.which.tolist(), x.tolist(), strict=True):
        out.rows[S.switches.row[s]] += more
        out.impulse[s] = out.impulse.get(s, 0.0) + more


def nothing(n: Instant) -> Jump:
    """No jump."""
    return Jump(rows=np.zeros(len(n.S.rows.law)), along=np.zeros(n.here.structure.nv))


def kicked(n: Instant, kick: np.ndarray, out: Jump, B: Bench, drive: np.ndarray) -> np.ndarray:
    """Change of the rows' rates by a generalised impulse alone; what it does goes to ``out``."""
    dv, rows, effort = n.response(kick)
    v = n.here.v
    out.given = float(kick @ (v + 0.5 * dv))
    out.along += dv
    out.rows += rows
    drive += effort
    return B.sign * (n.gradients(B.which) @ dv) if len(B.which) else np.zeros(0)


def expanded(
    n: Instant, B: Bench, P: Dense, parts: list[Part], before: np.ndarray, hit: tuple[np.ndarray, np.ndarray]
) -> tuple[np.ndarray, np.ndarray]:
    """Impulses and velocities with what restitution gives back."""
    x, u = hit
    bounces = [n.kind[p.switch] in STOPS and p.switch not in n.here.astray for p in parts]
    bounce = np.where(bounces, n.S.switch_numbers.restitution[[p.switch for p in parts]], 0.0)
    least = np.where((P.rule == PUSHES) & (x > 0.0), bounce * x, 0.0)
    if not least.any():
        return x, u
    more, speed = by_impulses(n, B, P, least, u)
    # energy on the way s from the inelastic impact: E + a s + b s^2
    E, a, b = 0.5 * float(x @ (before + u)), float(more @ (before + u) + x @ speed) / 2.0, float(more @ speed) / 2.0
    s = 1.0
    if E + a + b > 0.0 and b > 0.0:
        s = min(1.0, max(0.0, (-a + np.sqrt(max(a * a - 4.0 * b * E, 0.0))) / (2.0 * b)))
    return x + s * more, u + s * speed


def by_impulses(n: Instant, B: Bench, P: Dense, least: np.ndarray, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Poisson: further impulses of at least so much."""
    gain = P.gain.copy()
    fixed = np.where(B.way == 0.0, gain @ least, 0.0)
    P.const[:] = np.where(B.way == 0.0, fixed, 0.0)
    P.b[:] = u + P.A @ least
    B.loaded[:] = least @ B.L
    n.balance(B, P, BLOWS)
    return P.x + least, P.u - u


def driven(n: Instant, out: Jump, drive: np.ndarray) -> None:
    """What drivers do: their impulses, which go behind those of the rows, times the rates that they prescribe."""
    S, W, y, rows = n.S, n.W, n.here.y, out.rows
    for s, x in out.impulse.items():
        rows[S.switches.row[s]] = x
    z = y[n.here.structure.nq + n.here.structure.nv :]
    for k in np.flatnonzero(S.rows.work >= 0).tolist():
        z[S.rows.work[k]] += rows[k] * W.rows.nu[k]
    efforts: list[float] = []
    for b in np.flatnonzero(S.tree.law >= 0).tolist():
        d = S.tree.v[b]
        z[S.tree.work[b]] += drive[d] * n.here.v[d]
        efforts.append(drive[d])
    out.rows = np.r_[rows, efforts]
