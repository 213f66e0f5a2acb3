"""Impacts: jumps of velocities, and the end of series of bounces.

Impulses x along the rows that take part, u+ = A x + u-, follow the rule of each row: a unilateral row can only push, a
locked row holds, friction is bounded by the impulse of its load. Restitution is by Poisson's law: an inelastic impact,
then impulses of at least e times those of the impact (Pfeiffer and Glocker 1996, section 8.3). Energy never grows: the
expansion is reduced to what the energy lost in the inelastic impact allows.

A flight that starts with the rate u against the acceleration -a has the height u^2 / (2 a) and lasts 2 u / a. Each
flight is shorter than the one before by a ratio r, so all remaining flights last T / (1 - r). A series shorter than
rounding is over.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ...engine.calls import MOTION
from ...engine.mode_complementarity import SUDDEN_IMPULSES, ModeProblem
from ...numerics.complementarity.dense_problem import BILATERAL, SOLUTION_FOUND, UNILATERAL, DenseProblem
from .instant_problem import InstantProblem, ProblemRow

REST_RATE = 1e-12  # part of its terms below which a rate after the jump counts as zero


@dataclass
class VelocityJump:
    """The effects of a velocity jump.

    Attributes
    ----------
    impulse : dict
        Switch -> impulse along its quantity.
    closing : dict
        Switch -> its rates before and after closing.
    lost, given : float
        Energy [J] dissipated by impacts, and supplied by applied impulses.
    passed : float
        Sum of the energies [J] that impulses took and returned, of which ``lost`` is the difference.
    jammed : tuple of int
        Switches that stopped without a collision.
    rows, along : ndarray
        Impulses of all rows, followed by those of drivers that prescribe coordinates; change of the velocities, (nv,).
    """

    impulse: dict[int, float] = field(default_factory=dict)
    closing: dict[int, tuple[float, float]] = field(default_factory=dict)
    lost: float = 0.0
    given: float = 0.0
    passed: float = 0.0
    rows: np.ndarray = field(default_factory=lambda: np.zeros(0))
    along: np.ndarray = field(default_factory=lambda: np.zeros(0))
    external_impulses: tuple[Any, ...] = ()
    at_rest: frozenset[int] = frozenset()  # switches whose quantities are at rest afterwards
    ended: int = SOLUTION_FOUND
    jammed: tuple[int, ...] = ()


def violates_rule(n: InstantProblem, parts: list[ProblemRow], rate: np.ndarray) -> bool:
    """Return whether a rate violates the rule of a row."""
    for p in parts:
        u, still = p.sign * rate[p.switch], n.still[p.switch]
        if (p.rule == UNILATERAL and u < -still) or (p.rule == BILATERAL and abs(u) > still):
            return True
    return False


def apply_impulses(n: InstantProblem, parts: list[ProblemRow], kick: np.ndarray | None) -> VelocityJump:
    """Change the velocities of the motion by the impulses of these rows; see the module."""
    B, P, _ = n.problem(parts)
    out = no_jump(n)
    before = B.sign * n.rate[B.which]
    drive = np.zeros_like(out.along)
    if kick is not None:
        before = before + external_impulse_response(n, kick, out, B, drive)
    P.grain[:] = n.still[B.which]
    B.loaded[:] = out.rows[: len(B.loaded)]  # joint impulses due to the applied impulse alone
    unmoved = (P.A.diagonal() == 0.0) & (np.abs(before) <= P.grain)  # no impulse moves it and its rate is rounding
    P.b[:] = np.where(unmoved, 0.0, before)
    out.ended = n.balance(B, P, SUDDEN_IMPULSES)
    x, u = P.x.copy(), P.u.copy()
    if out.ended != SOLUTION_FOUND:
        return out
    if len(parts):
        x, u = with_restitution(n, B, P, parts, before, (x, u))
    return apply_velocities(n, (B, P), parts, (before, x, u), out, drive)


def apply_velocities(
    n: InstantProblem,
    solved: tuple[ModeProblem, DenseProblem],
    parts: list[ProblemRow],
    found: tuple[np.ndarray, np.ndarray, np.ndarray],
    out: VelocityJump,
    drive: np.ndarray,
) -> VelocityJump:
    """Apply impulses x, which change the rows' rates from ``before`` to u, to the velocities of the motion."""
    B, P = solved
    before, x, u = found
    out.lost = -float(x @ (before + u)) / 2.0
    out.passed = float(np.abs(x) @ (np.abs(before) + np.abs(u))) / 2.0
    out.rows += x @ B.L
    out.along += x @ B.Y
    drive += x @ B.E
    for p, xi, b, a in zip(parts, x.tolist(), before.tolist(), u.tolist(), strict=True):
        out.impulse[p.switch] = out.impulse.get(p.switch, 0.0) + p.sign * xi
        if (p.rule == UNILATERAL and b < -n.still[p.switch]) or (p.rule == BILATERAL and abs(b) > n.still[p.switch]):
            out.closing[p.switch] = (b, a)
    size = np.abs(P.A) @ np.abs(x) + np.abs(before)
    out.at_rest = frozenset(B.which[np.abs(u) <= REST_RATE * size + n.still[B.which]].tolist())
    account_for_drivers(n, out, drive)
    n.here.v[:] += out.along
    return out


def add_impulses(n: InstantProblem, out: VelocityJump, B: ModeProblem, x: np.ndarray) -> None:
    """Add further impulses to those of a jump; the velocities include them already."""
    S, nr = n.S, len(n.S.rows.law)
    out.rows[:nr] += x @ B.L
    out.rows[nr:] += (x @ B.E)[S.tree.v[S.tree.law >= 0]]
    for s, more in zip(B.which.tolist(), x.tolist(), strict=True):
        out.rows[S.switches.row[s]] += more
        out.impulse[s] = out.impulse.get(s, 0.0) + more


def no_jump(n: InstantProblem) -> VelocityJump:
    """Return a jump without effect."""
    return VelocityJump(rows=np.zeros(len(n.S.rows.law)), along=np.zeros(n.here.structure.nv))


def external_impulse_response(
    n: InstantProblem, kick: np.ndarray, out: VelocityJump, B: ModeProblem, drive: np.ndarray
) -> np.ndarray:
    """Return the change of the rows' rates by an applied generalised impulse alone; add its effects to ``out``."""
    dv, rows, effort = n.response(kick)
    v = n.here.v
    out.given = float(kick @ (v + 0.5 * dv))
    out.along += dv
    out.rows += rows
    drive += effort
    return B.sign * (n.gradients(B.which) @ dv) if len(B.which) else np.zeros(0)


def with_restitution(
    n: InstantProblem,
    B: ModeProblem,
    P: DenseProblem,
    parts: list[ProblemRow],
    before: np.ndarray,
    hit: tuple[np.ndarray, np.ndarray],
) -> tuple[np.ndarray, np.ndarray]:
    """Return impulses and velocities with restitution added."""
    x, u = hit
    bounces = [n.kinds[p.switch].keeps_bounds and p.switch not in n.here.missed_crossings for p in parts]
    bounce = np.where(bounces, n.S.switch_numbers.restitution[[p.switch for p in parts]], 0.0)
    least = np.where((P.rule == UNILATERAL) & (x > 0.0), bounce * x, 0.0)
    if not least.any():
        return x, u
    more, speed = poisson_expansion(n, B, P, least, u)
    # energy after the part s of the expansion: E + a s + b s^2
    E, a, b = 0.5 * float(x @ (before + u)), float(more @ (before + u) + x @ speed) / 2.0, float(more @ speed) / 2.0
    s = 1.0
    if E + a + b > 0.0 and b > 0.0:
        s = min(1.0, max(0.0, (-a + np.sqrt(max(a * a - 4.0 * b * E, 0.0))) / (2.0 * b)))
    return x + s * more, u + s * speed


def poisson_expansion(
    n: InstantProblem, B: ModeProblem, P: DenseProblem, least: np.ndarray, u: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the expansion impulses by Poisson's law, at least ``least``, and the change of the rates."""
    gain = P.gain.copy()
    fixed = np.where(B.way == 0.0, gain @ least, 0.0)
    P.const[:] = np.where(B.way == 0.0, fixed, 0.0)
    P.b[:] = u + P.A @ least
    B.loaded[:] = least @ B.L
    n.balance(B, P, SUDDEN_IMPULSES)
    return P.x + least, P.u - u


def account_for_drivers(n: InstantProblem, out: VelocityJump, drive: np.ndarray) -> None:
    """Append the impulses of drivers to those of the rows, and add their works at the prescribed rates."""
    S, y, rows = n.S, n.here.y, out.rows
    for s, x in out.impulse.items():
        rows[S.switches.row[s]] = x
    prescribed = n.W.rows.nu.copy()
    prescribed[[S.switches.row[s] for s in n.engaging]] = list(n.here.engaging.values())
    z = y[n.here.structure.nq + n.here.structure.nv :]
    for k in np.flatnonzero(S.rows.work >= 0).tolist():
        z[S.rows.work[k]] += rows[k] * prescribed[k]
    efforts: list[float] = []
    for b in np.flatnonzero(S.tree.law >= 0).tolist():
        d = S.tree.v[b]
        z[S.tree.work[b]] += drive[d] * n.here.v[d]
        efforts.append(drive[d])
    out.rows = np.r_[rows, efforts]


LOW_FLIGHT = 1e-13  # height of a negligible flight, relative to the mechanism's length or a radian
ORIGIN_ROUNDING = 2e-14  # the same relative to the distance from the origin: rounding of positions


@dataclass
class BounceSeries:
    """Series of bounces of one stop: number, times of the last one and the one before, time at which the series is
    over.
    """

    count: int = 0
    last: float = -np.inf
    before: float = -np.inf
    over: float = np.nan


def note_bounces(n: InstantProblem, jumped: VelocityJump) -> None:
    """Count the impacts of this jump in the series of their stops."""
    t = n.here.t
    for s in jumped.closing.keys() - n.here.missed_crossings:
        b = n.here.bounces.setdefault(s, BounceSeries())
        if t - b.last > 1.5 * (b.last - b.before):
            b.count = 0  # another series
        b.count, b.before, b.last, b.over = b.count + 1, b.last, t, np.nan


def coming_to_rest(n: InstantProblem, at: dict[int, tuple[float, ...]], still: np.ndarray) -> np.ndarray:
    """Return the switches whose next flights are negligible, (ns,); modes are written, and rates are those at
    take-off.
    """
    over = np.zeros(len(n.kinds), bool)
    leaving = [s for s, side in at.items() if not still[s] and len(side) == 1]
    if not leaving:
        return over
    n.run_engine(MOTION)
    nq = n.S.sizes.coordinates
    a = n.gradients(np.array(leaving)) @ n.state.K[0, nq : nq + n.here.structure.nv] + n.W.sensed.bias[n.m[leaving]]
    far = ORIGIN_ROUNDING * np.abs(n.W.frames.position).max(initial=0.0)
    for s, acceleration in zip(leaving, a.tolist(), strict=True):
        u, back = at[s][0] * n.rate[s], -at[s][0] * acceleration
        if u > 0.0 and back > 0.0 and u * u <= 2.0 * back * max(LOW_FLIGHT * n.unit[s], far * (n.units[s] == "m")):
            over[s] = True
            if s not in n.here.bounces:  # it did not close before and opens by rounding only
                continue
            b, flight = n.here.bounces[s], 2.0 * u / back
            past = n.here.t - (b.before if b.last == n.here.t else b.last)
            b.over = n.here.t + (flight / (1.0 - flight / past) if flight < past < np.inf else flight)
    return over


def settle_down(n: InstantProblem, over: list[int], still: np.ndarray, jumped: VelocityJump | None) -> None:
    """Set the rates of switches that bounce no more to zero; mark friction that moved by these alone as at rest in
    ``still``.

    ``jumped`` is the impact of the instant, if there was one: it was the last.
    """
    B, P, _ = n.problem([ProblemRow(s, BILATERAL) for s in over])
    x = -np.linalg.lstsq(P.A, n.rate[over], rcond=1e-12)[0]
    n.here.v[:] += x @ B.Y
    if jumped is not None:
        add_impulses(n, jumped, B, x)
    n.reevaluate_switches()
    still |= np.abs(n.rate) <= n.still
