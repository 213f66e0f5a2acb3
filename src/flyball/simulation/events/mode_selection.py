"""Mode selection: which rows hold, slide or open, from one complementarity problem of accelerations.

Friction that cannot stick slides with its kinetic force, and the other rows are decided again. Weakly active rows, at
their bound with neither force nor acceleration, are decided by the problem at a slightly later time.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...constraints.switches.switch_kind import (
    FORCE_GUARDS,
    G_BACK,
    G_HOLDS,
    G_LOWER,
    G_PULL,
    G_UPPER,
    HELD,
    INTERVAL,
    OFF,
    ONE_SIDED,
    ProblemRow,
)
from ...engine.calls import MOTION
from ...engine.integration_loop import GuardedLoop
from ...engine.loads import SLOPES_UNKNOWN
from ...engine.mode_complementarity import FORCES, ModeProblem
from ...numerics.complementarity.dense_problem import (
    AT_LOW,
    AT_REST,
    FRICTION_LINE,
    INACTIVE,
    SLIDING,
    SOLUTION_FOUND,
    UNILATERAL,
)
from ...tables.structure_definition import Structure
from .context import RELEASED, EventContext
from .force_distribution import held_at_rest, released_by_group, sliding_without_solution, write_sharing_group
from .instant_problem import (
    IMMOVABLE_MOBILITY,
    InstantProblem,
    instant_problem,
    reference_rate,
    rows_of_accelerations,
    sliding_at_cone,
    use_kinetic_friction,
    write_slips,
)

NO_ACCELERATION = 1e-7  # part of its terms below which an acceleration counts as zero
CLEAR_FORCE = 10.0  # factor of rounding above which a force is clearly nonzero
LOOKAHEAD_FACTORS = (1.0, 1e2, 1e4)  # later times that are tried, relative to the first
LOOKAHEAD_OF_STEP, LOOKAHEAD_OF_SPAN = 1e-6, 1e-9  # first lookahead, relative to the last step, or to the duration
DEPENDENT_ROW = 1e-11  # part of a row's own response below which it depends on other rows


def weakly_active(n: InstantProblem, found: ModeDecision) -> list[int]:
    """Return the one-sided rows at their bound that carry no force and do not open either."""
    led = {p.of for p in found.parts}
    return [
        i
        for i, p in enumerate(found.parts)
        if p.rule in (UNILATERAL, INACTIVE)
        and n.kinds[p.switch].forces == ONE_SIDED
        and found.state[i] != AT_REST
        and i not in led
        and found.A[i, i] > 0.0
        and abs(found.u[i])
        <= NO_ACCELERATION * found.sizes[p.switch] * found.A[i, i] + n.negligible_acceleration[p.switch]
    ]


def activate_pressing_rows(n: InstantProblem, found: ModeDecision) -> None:
    """Activate, with no force yet, the weakly active rows that push a moment later."""
    rows = weakly_active(n, found)
    if not rows:
        return
    found.parts = found.parts.copy()
    parts = [p._replace(rule=UNILATERAL) if p.rule == INACTIVE else p for p in found.parts]
    here, y, t = n.here, n.here.y.copy(), n.here.t
    B, _, _ = n.problem(parts)
    a = B.free + found.x @ B.Y
    n.run_engine(MOTION)
    nq, nv = len(here.q), len(a)
    q_dot = n.state.K[0, :nq].copy()
    span, step = here.clock.real.span, here.clock.real.h
    first = LOOKAHEAD_OF_STEP * step if 0.0 < step < span else LOOKAHEAD_OF_SPAN * span
    open_ = set(rows)
    for part in LOOKAHEAD_FACTORS:
        later = part * first
        here.y[:nq], here.y[nq : nq + nv] = y[:nq] + later * q_dot, y[nq : nq + nv] + later * a
        here.clock.real.t = t + later
        B, P, status = n.problem(parts)
        if status != 0 or n.balance(B, P, FORCES) != SOLUTION_FOUND:
            break
        for i in sorted(open_):
            if P.state[i] == AT_REST and P.x[i] * P.A[i, i] > CLEAR_FORCE * P.grain[i]:
                found.state[i] = AT_REST
                found.parts[i] = parts[i]  # it pushes, and its guard is evaluated
            if abs(P.u[i]) > CLEAR_FORCE * P.grain[i] or found.state[i] == AT_REST:
                open_.discard(i)
    here.y[:], here.clock.real.t = y, t
    n.problem(found.parts)


def rows_tied_to_bound(n: InstantProblem, found: ModeDecision) -> frozenset[tuple[int, int]]:
    """Return the guards, as (kind, switch), of rows at their bounds that other active rows keep there."""
    out: set[tuple[int, int]] = set()
    held = [i for i in range(len(found.parts)) if found.state[i] == AT_REST and found.A[i, i] > 0.0]
    rows = weakly_active(n, found)
    if not rows or not held:
        return frozenset()
    room = n.workspaces[len(found.parts)]
    A = found.A[np.ix_(held, held)]
    for i in rows:
        p = found.parts[i]
        c = np.linalg.lstsq(A, found.A[held, i], rcond=1e-12)[0]
        rest = found.A[i, i] - c @ found.A[held, i]
        if abs(rest) <= DEPENDENT_ROW * found.A[i, i] and not _moved_by_drivers(n, room.B, i, (held, c)):
            out.add((G_BACK if not n.kinds[p.switch].bounded else G_LOWER if p.sign > 0.0 else G_UPPER, p.switch))
    return frozenset(out)


def _moved_by_drivers(n: InstantProblem, B: ModeProblem, i: int, others: tuple[list[int], np.ndarray]) -> bool:
    """Return whether row i, less the active rows, does work on what drivers prescribe: then the drivers move it."""
    held, c = others
    axes = n.S.tree.v[n.S.tree.law >= 0]
    rows = n.S.rows.work >= 0
    for part in (B.E[:, axes], B.L[:, rows]):
        size = max(np.abs(part[i]).max(initial=0.0), np.abs(part[held]).max(initial=0.0))
        if np.abs(part[i] - c @ part[held]).max(initial=0.0) > DEPENDENT_ROW * size:
            return True
    return False


def write_rounding_levels(here: EventContext, loop: GuardedLoop) -> None:
    """Write into the loop which forces are rounding, and which guards are tied to their bounds by other rows.

    For quantities held at zero rate, a negligible rate is written as well.
    """
    loop.guard_state.tied[:] = loop.guard_state.still[:] = loop.guard_state.least[:] = 0.0
    if here.still:
        at = list(here.still)
        loop.guard_state.still[at] = here.c.system.units[at] * reference_rate(here)
    if here.tied or here.least:
        n = instant_problem(here)
        for g, (kind, s, _) in enumerate(n.guarded):
            if kind in FORCE_GUARDS:
                loop.guard_state.least[g] = here.least.get(s, 0.0)
            if (kind, s) in here.tied:
                loop.guard_state.tied[g] = n.unit[s] * (n.pace if kind == G_BACK else 1.0)


ACCELERATION_TOLERANCE = 1e-7  # part of its terms below which an acceleration counts as zero
MOST_PASSES = 20  # largest number of solves after rows began to slide


@dataclass
class ModeDecision:
    """Modes at an instant: the rows that took part, and the solved problem.

    ``sizes``: for each switch the sum of the force terms whose difference its force is. ``least``: for each switch the
    force caused by rounding of accelerations. ``all_rows_hold``: all rows hold, by a distribution clearly within their
    bounds.
    """

    parts: list[ProblemRow]
    ended: int
    x: np.ndarray
    u: np.ndarray
    state: np.ndarray
    direction: np.ndarray
    reach: np.ndarray
    sizes: dict[int, float]
    least: dict[int, float]
    A: np.ndarray
    gain: np.ndarray
    all_rows_hold: bool = False


def decide_modes(
    n: InstantProblem, at: dict[int, tuple[float, ...]], still: np.ndarray, fired: np.ndarray
) -> ModeDecision:
    """Decide the modes by one problem of accelerations and write them into the motion; ``n`` is evaluated there.

    A row whose guard has reached its limit is released if that violates no rule: not because of rounding, and not where
    redundancy leaves the distribution of forces undetermined and the row can still be held.
    """
    found = solve_rows(n, rows_of_accelerations(n, at, still))
    parts = found.parts
    let_go = _rows_at_limit(n, found, fired) if found.ended == SOLUTION_FOUND else {}
    if (
        let_go and n.shares and (others := solve_rows(n, parts, all_hold=True)).all_rows_hold
    ):  # closed contacts can carry more from here on
        found, let_go = others, {}
    if found.ended == SOLUTION_FOUND:
        let_go |= released_by_group(n, parts, fired)
    while let_go:
        other = solve_rows(n, [let_go.get(i, p) for i, p in enumerate(parts)])
        back = [i for i in let_go if other.ended != SOLUTION_FOUND or _violates_rule(n, other, i)]
        if not back:
            found = other
        let_go = {i: p for i, p in let_go.items() if i not in back} if back else {}
    if found.ended == SOLUTION_FOUND:
        activate_pressing_rows(n, found)
        n.here.tied, n.here.still, n.here.least = rows_tied_to_bound(n, found), held_rates(n, found), found.least
        write_modes(n, found, still)
    return found


def _rows_at_limit(n: InstantProblem, found: ModeDecision, fired: np.ndarray) -> dict[int, ProblemRow]:
    """Return active rows whose guards triggered, as released rows; friction that carries nothing stays active."""
    ends = {s: kind for kind, s, _ in (n.guarded[g] for g in fired) if kind in (G_PULL, G_HOLDS)}
    out = sliding_at_cone(n, found.parts, (found.x, found.state, found.reach, np.full(len(found.x), np.inf)), fired)
    asked = {(G_PULL, UNILATERAL), (G_HOLDS, FRICTION_LINE)}
    for i, p in enumerate(found.parts):
        idle = p.rule == FRICTION_LINE and max(abs(found.x[i]), found.reach[i]) <= found.least[p.switch]
        if found.state[i] == AT_REST and (ends.get(p.switch, -1), p.rule) in asked and not idle:
            out[i] = _released_row(p, found.x[i])
    return out


def _violates_rule(n: InstantProblem, found: ModeDecision, i: int) -> bool:
    """Return whether the released row i moves against its rule; of two slip rows they are tested together."""
    p = found.parts[i]
    least = ACCELERATION_TOLERANCE * found.sizes[p.switch] * found.A[i, i] + n.negligible_acceleration[p.switch]
    if p.rule != SLIDING:
        return bool(found.u[i] < -least)
    own = [k for k, q in enumerate(found.parts) if k == i or (p.of >= 0 and q.of == p.of and q.rule == SLIDING)]
    return bool(found.u[own] @ [found.parts[k].direction for k in own] < -least)


def _released_row(p: ProblemRow, x: float) -> ProblemRow:
    """Return the row as it is after its release."""
    if p.rule == UNILATERAL:
        return p._replace(rule=INACTIVE)
    return p.sliding(-1.0 if x > 0.0 else 1.0)


def solve_rows(n: InstantProblem, parts: list[ProblemRow], *, all_hold: bool = False) -> ModeDecision:
    """Solve the problem; rows that begin to slide carry their kinetic friction.

    ``all_hold``: all closed rows hold if they can, even if fewer would suffice.
    """
    B, P, _ = n.problem(parts)
    free = [i for i in range(len(parts)) if P.rule[i] != FRICTION_LINE or P.A[i, i] > 0.0]
    if len(free) < len(parts):  # no freedom moves it, so its row cannot hold it
        parts = [parts[i]._replace(of=free.index(parts[i].of) if parts[i].of >= 0 else -1) for i in free]
        B, P, _ = n.problem(parts)
    ended, resting = SOLUTION_FOUND, np.zeros(len(parts), bool)
    for _ in range(MOST_PASSES):
        ended = n.balance(B, P, FORCES)
        resting = held_at_rest(n, parts, P, None if all_hold else ended)
        if resting.any() and (P.state[resting] == AT_REST).all():
            ended = SOLUTION_FOUND
        if ended != SOLUTION_FOUND and (sliding := sliding_without_solution(n, parts, P)):
            parts = [sliding.get(i, p) for i, p in enumerate(parts)]
            B, P, _ = n.problem(parts)
            continue
        slips = np.flatnonzero((P.rule == FRICTION_LINE) & (P.state != AT_REST) & ~resting).tolist()
        if ended != SOLUTION_FOUND or not (use_kinetic_friction(n, parts, P, resting) or slips):
            P.state[resting] = AT_REST
            break
        for i in slips:
            P.rule[i], P.bound_sign[i] = SLIDING, 1.0 if P.state[i] == AT_LOW else -1.0
            B.way[i] = P.bound_sign[i] if parts[i].way != 0.0 else 0.0
            P.const[i] = 0.0 if n.kinds[parts[i].switch].permanent else P.const[i]
    x = P.x.copy()
    terms = (np.abs(P.b) + np.abs(P.A) @ np.abs(x)) / np.maximum(P.A.diagonal(), 1e-300)
    rounding = P.grain * np.minimum(1.0 / np.maximum(P.A.diagonal(), 1e-300), n.inertia[B.which])
    sizes, least = ({p.switch: float(z) for p, z in zip(parts, of, strict=True)} for of in (terms, rounding))
    return ModeDecision(
        parts, ended, x, P.u.copy(), P.state.copy(), P.bound_sign.copy(), P.reach.copy(), sizes, least, P.A.copy(),
        P.gain.copy(), all_hold and bool(resting.any()),
    )  # fmt: skip


def element_titles(n: InstantProblem, parts: list[ProblemRow]) -> list[str]:
    """Return the titles of the elements of rows."""
    return list(dict.fromkeys(n.here.structure.switches[p.switch].element.title for p in parts))


def remove_residual_rates(n: InstantProblem, found: ModeDecision) -> None:
    """Remove the rounding from the rates of active rows."""
    room = n.workspaces[len(found.parts)]
    B, P = room.B, room.P
    held = [i for i, p in enumerate(found.parts) if found.state[i] == AT_REST and n.rate[p.switch] != 0.0]
    if held:
        rates = B.sign[held] * n.rate[B.which[held]]
        A = P.A[np.ix_(held, held)]
        x = -rates / A[0] if len(held) == 1 and A[0, 0] > 0.0 else np.linalg.lstsq(A, -rates, rcond=1e-12)[0]
        n.here.v[:] += x @ B.Y[held]


def write_modes(n: InstantProblem, found: ModeDecision, still: np.ndarray) -> None:
    """Write modes, switch states and held values into the motion."""
    W, ways, taking = n.W, n.ways(), {p.switch for p in found.parts}
    for s, kind in enumerate(n.kinds):
        if kind.decided and n.m[s] >= 0:
            W.modes.mode[s] = OFF
            ways[s] = kind.direction(n, s, bool(still[s]), s in taking)
    for i, p in enumerate(found.parts):
        s, kind = p.switch, n.kinds[p.switch]
        if found.state[i] == AT_REST:
            W.modes.mode[s] = HELD
            W.modes.hold[s] = n.hold[s] if n.mode[s] == HELD else n.x[s]
            if kind.keeps_bounds:
                W.modes.hold[s] = (W.modes.lower if p.sign > 0.0 else W.modes.upper)[s]
            ways[s] = p.sign if p.rule == UNILATERAL else 0.0
        elif kind.forces == INTERVAL:
            ways[s] = found.direction[i]
    for s in n.of(lambda kind: kind.permanent):
        W.modes.released[s] = RELEASED if W.modes.mode[s] == OFF else 0.0
    write_slips(n, found.parts, (found.state, found.x, found.u, found.direction))
    write_sharing_group(n, found.parts, (found.state, found.A, found.gain, found.x, found.reach))
    if len(n.S.load_terms.load):
        W.counts.load_updates = SLOPES_UNKNOWN
        W.sensed.load[2 * len(n.here.structure.measured) : n.first] = 0.0  # of two solutions the one from zero load


# Rates in event expressions that active rows keep at zero: their values are rounding.


DEPENDENT_RESPONSE = 1e-11  # part of its own response below which a rate depends on the active rows


def held_rates(n: InstantProblem, found: ModeDecision) -> tuple[int, ...]:
    """Return measured quantities whose rates events name, that could move, and that active rows keep at rest.

    Quantities that nothing here can move (a slider at its dead centre) or that a driver moves are not among them.
    """
    held = [i for i in range(len(found.parts)) if found.state[i] == AT_REST and found.A[i, i] > 0.0]
    named = _rates_in_events(n) if held else []
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
        if own * mass < IMMOVABLE_MOBILITY:
            continue
        c = np.linalg.lstsq(A, cross, rcond=1e-12)[0]
        drive = np.r_[effort[axes], lam[rows]]
        size = max(np.abs(drives).max(initial=0.0), np.abs(drive).max(initial=0.0))
        if (
            abs(own - c @ cross) <= DEPENDENT_RESPONSE * own
            and (np.abs(drive - c @ drives) <= DEPENDENT_RESPONSE * size).all()
        ):
            out.append(m)
    return tuple(out)


def _rates_in_events(n: InstantProblem) -> list[int]:
    """Return measured quantities whose rates are named in event expressions."""
    s = n.here.structure
    found: list[int] = s.cache.get("rates of events", 0, 1, lambda: _find_rates_in_events(s))
    return found


def _find_rates_in_events(s: Structure) -> list[int]:
    nm, found = len(s.measured), set()
    for e in s.events.values():
        for name in s.model.law(e.law, e.of, f"when of {e.title}").names:
            m = s.slots.get(name, -1)
            if nm <= m < 2 * nm:
                found.add(m - nm)
    return sorted(found)
