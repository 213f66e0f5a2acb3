"""Resolution of an instant: actions, jumps of velocities and modes, repeated until no rule is violated.

Elastic stops and ratchets need no complementarity problem. Where friction grows with the load that it causes,
rigid-body equations may have no solution for the accelerations, or several (Painleve 1895). Of several the one is
taken that continues the modes before. With none, velocities jump without a collision; the impulses are the limit of a
time step that tends to zero (Stewart 2000, SIAM Review 42).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...constraints.switches.elastic_stop import pressed_side
from ...constraints.switches.switch_kind import (
    DISC,
    FORCE_GUARDS,
    FROZEN,
    G_CORNER,
    G_REVERSES,
    G_SHARED,
    G_SLIDES,
    G_TURNS,
    HELD,
    OFF,
    PRESS_GUARDS,
    RATE_GUARDS,
)
from ...engine.mode_complementarity import STEP_IMPULSES, SUDDEN_IMPULSES, TERM_ROUNDING
from ...model.contact_point import Touch
from ...numerics.complementarity.dense_problem import AT_REST, FRICTION_LINE, NO_IMPULSE, NO_SOLUTION, SOLUTION_FOUND
from ..diagnosis import body_names
from .context import EventContext
from .event_actions import perform_actions, perform_initial_actions
from .event_messages import (
    endless_instant,
    guard_titles,
    no_admissible_forces,
    no_admissible_impulses,
    passed_bound,
    record_initial_breaks,
    record_jump,
    record_mode_changes,
    start_beyond_bound,
)
from .impacts import (
    VelocityJump,
    apply_impulses,
    apply_velocities,
    coming_to_rest,
    no_jump,
    note_bounces,
    settle_down,
    violates_rule,
)
from .instant_problem import (
    InstantProblem,
    ProblemRow,
    closed_bounds,
    instant_problem,
    rows_of_velocities,
    stop_slips,
    switches_at_rest,
)
from .mode_selection import ModeDecision, decide_modes, element_titles, remove_residual_rates
from .nonsmooth_laws import Corners


def update_elastic_stops(n: InstantProblem, fired: np.ndarray, previous: np.ndarray) -> None:
    """Set which sides of elastic stops are pressed; ``n`` is evaluated there.

    A side whose guard triggered is pressed if it was open according to ``previous``, and open if it was pressed.
    """
    for s in n.of(lambda kind: kind.elastic):
        triggered = {k for k, of, _ in (n.guarded[g] for g in fired) if of == s}
        n.ways()[s] = FROZEN + pressed_side(n, s, float(previous[s]) - FROZEN, triggered)


DIFFERENT_SOLUTION = 1e-6  # relative difference of accelerations of another solution
NULL_EIGENVALUE = 1e-9  # relative eigenvalue below which rows are linearly dependent
LIMIT_STEP = 1e-9  # relative velocity change by forces in the time step that tends to zero
IMPULSE_FACTOR = 1e3  # ratio to the impulse of forces in that step above which an impulse is a velocity jump


def report_indeterminacy(n: InstantProblem, found: ModeDecision) -> None:
    """Add remarks on what is undetermined at this instant, once per element in a motion."""
    if not found.gain.any():
        return
    if (said := _several_solutions(n, found)) and not any(x.endswith(said) for x in n.here.doubts):
        n.here.doubts.append(f"at t = {n.here.t:.6g} s {said}")
    if (said := _undetermined_friction(n, found)) and said not in n.here.doubts:
        n.here.doubts.append(said)


def report_distribution(n: InstantProblem, guards: Sequence[int]) -> None:
    """Add a remark on elements that hold only by a force distribution other than the computed one."""
    group = np.flatnonzero(n.W.modes.shared).tolist()
    own = [x for g in guards for x in (group if n.guarded[g][0] == G_SHARED else [n.guarded[g][1]])]
    which = [n.here.structure.switches[s].element for s in dict.fromkeys(own)]
    who = " and ".join(
        dict.fromkeys(f"{e.title} of {body_names(e)}" if isinstance(e, Touch) else e.title for e in which)
    )
    said = (
        f"{who} would slip with the forces of least sum of squares, and sticks with others: rigid bodies at rest do "
        "not determine how contacts share their load, so the time of slipping can be wrong. Impulse time stepping "
        "(method='impulse') chooses the forces anew in each step"
    )
    if said not in n.here.doubts:
        n.here.doubts.append(said)


def _several_solutions(n: InstantProblem, found: ModeDecision) -> str:
    """Return a remark if the problem solved last has other solutions, searched from the opposite modes."""
    P = n.workspaces[len(found.parts)].P
    size = max(
        np.abs(P.b).max(), P.grain.max() / TERM_ROUNDING
    )  # at a take-off accelerations are differences of larger terms
    for state in (NO_IMPULSE, AT_REST):
        P.state[:] = state
        if n.again(P) == SOLUTION_FOUND and np.abs(P.u - found.u).max() > DIFFERENT_SOLUTION * size:
            who = " and ".join(element_titles(n, found.parts))
            return (
                f"rigid bodies with friction have several solutions (Painleve's paradox) at {who}; the one that "
                "continues the previous modes is used"
            )
    return ""


def _undetermined_friction(n: InstantProblem, found: ModeDecision) -> str:
    """Return a remark on friction limits that depend on reactions which redundancy leaves undetermined."""
    held = np.flatnonzero(found.state == AT_REST)
    grips = [i for i in held.tolist() if found.parts[i].rule == FRICTION_LINE and found.gain[i].any()]
    if len(held) < 2 or not grips:
        return ""
    d = np.sqrt(found.A.diagonal()[held])
    d[d == 0.0] = 1.0
    size, Z = np.linalg.eigh(found.A[np.ix_(held, held)] / np.outer(d, d))
    Z = Z[:, size < NULL_EIGENVALUE * size.max()] / d[:, None]
    open_ = [
        i
        for i in grips
        if (np.abs(found.gain[i][held] @ Z) > DIFFERENT_SOLUTION * np.abs(found.gain[i][held]).max()).any()
    ]
    if not open_ or _friction_is_needless(n, found, open_):
        return ""
    who = " and ".join(element_titles(n, [found.parts[i] for i in open_]))
    return (
        f"whether {who} sticks is not determined: its limit depends on reactions that redundancy leaves undetermined; "
        "those with the least sum of squares, weighted by the mass that each moves, are used"
    )


def _friction_is_needless(n: InstantProblem, found: ModeDecision, rows: list[int]) -> bool:
    """Return whether these are contact points that stay at rest without friction too, as a ball in a groove."""
    if any(n.kinds[found.parts[i].switch].forces != DISC for i in rows):
        return False
    P = n.workspaces[len(found.parts)].P
    P.const[rows], P.gain[rows], P.state[:] = 0.0, 0.0, found.state
    size = max(np.abs(P.b).max(), P.grain.max() / TERM_ROUNDING)
    return n.again(P) == SOLUTION_FOUND and bool(np.abs(P.u - found.u).max() <= DIFFERENT_SOLUTION * size)


def jump_without_collision(n: InstantProblem, parts: list[ProblemRow], held: float) -> VelocityJump | None:
    """Return the velocity jump without a collision for rows without solution for the accelerations; None if there is
    none.

    ``held`` is the largest friction limit.
    """
    B, P, _ = n.problem(parts)
    forces, before = P.b.copy(), B.sign * n.rate[B.which]
    size = np.abs(before).max(initial=0.0)
    if not size > 0.0:
        return None
    scale = np.sqrt(np.maximum(P.A.diagonal(), 1e-300))
    finite = max(np.abs(forces).max(), (P.A.diagonal() * held).max())
    B.step[0] = LIMIT_STEP * size / max(finite, 1e-300)
    P.b[:] = before + B.step[0] * forces
    B.loaded[:] *= B.step[0]
    if n.balance(B, P, STEP_IMPULSES) != SOLUTION_FOUND:
        return None
    if not (scale * np.abs(P.x)).max() > IMPULSE_FACTOR * B.step[0] * finite / scale.max():
        return None
    P.b[:], B.loaded[:] = before, 0.0
    if n.balance(B, P, SUDDEN_IMPULSES) != SOLUTION_FOUND:
        return None
    out = no_jump(n)
    out.jammed = tuple(p.switch for p in parts)
    return apply_velocities(n, (B, P), parts, (before, P.x.copy(), P.u.copy()), out, np.zeros_like(out.along))


MOST_ROUNDS = 100
MOST_REPEATS = 5  # repeated decisions of sliding directions for the same modes
BROKEN_FORCE = 1e-8  # part of its terms beyond which a force violates its bound
VIOLATED_START = 1e-9  # violation that is refused at the start, relative to length or a radian (rates: times the rate)
PENETRATED = 1e-7  # penetration of an open stop that is refused, relative to the same


def resolve_start(here: EventContext) -> None:
    """Resolve the start of the motion: applied impulses, closed stops, sticking and sliding friction.

    Raises
    ------
    ModelError
        If a limit is violated at the start.
    """
    s = here.structure
    if here.start.before is None and not (s.switches or s.events or s.model.events):
        return
    acts = perform_initial_actions(here)
    if len(here.c.system.switches.row) or here.external_impulse is not None:
        n = instant_problem(here)
        corners = Corners(n)
        corners.begin()
        n.evaluate_switches()
        n.restore_modes()
        remove_slight_overlaps(n)
        refuse_violated(n)
        resolve_jumps_and_corners(n, corners, np.zeros(0, np.int64), record=False)
        record_initial_breaks(n)
    acts.record_events(["start"])
    _resolve_chain(here, acts.passed())


def resolve_event(here: EventContext, fired: Sequence[int]) -> None:
    """Resolve the instant at which guards triggered.

    Parameters
    ----------
    here : EventContext
    fired : sequence of int
        Rows of `System.guards`.

    Raises
    ------
    SimulationError
        If no consistent forces or impulses exist, or the resolution does not end.
    """
    _resolve_chain(here, np.array(fired, np.int64))


def _resolve_chain(here: EventContext, fired: np.ndarray) -> None:
    """Resolve events, jumps and modes repeatedly, as long as actions make expressions of events cross zero."""
    for _ in range(MOST_ROUNDS if len(fired) else 0):
        acts = perform_actions(here, fired.tolist())
        if len(here.c.system.switches.row) or here.external_impulse is not None:
            n = instant_problem(here)
            resolve_jumps_and_corners(n, Corners(n), fired)
        acts.record_events(["start"])
        fired = acts.passed()
        here.settled_keys.clear()  # events caused by these actions count as later
        if not len(fired) or here.stopped:
            return
    if len(fired):
        raise endless_instant(here.t, guard_titles(instant_problem(here), fired.tolist()), MOST_ROUNDS)


def resolve_jumps_and_corners(n: InstantProblem, corners: Corners, fired: np.ndarray, record: bool = True) -> None:
    """Resolve jumps and modes alternately with the sides of laws' corners, until they agree."""
    corners.fired(fired)
    by_rows = [g for g in fired.tolist() if n.guarded[g][0] != G_CORNER]
    if not len(fired) or by_rows:
        resolve_modes(n, np.array(by_rows, np.int64), record)
    let_go = np.array([g for g in by_rows if n.guarded[g][0] in FORCE_GUARDS], np.int64)
    for _ in range(MOST_ROUNDS):
        if not corners.settle() or not n.decided:
            return
        resolve_modes(n, let_go, record)
    raise endless_instant(n.here.t, [n.name(s) for s in sorted(corners.at)], MOST_ROUNDS)


def refuse_violated(n: InstantProblem) -> None:
    """Refuse a start beyond a limit."""
    for s, kind in enumerate(n.kinds):
        if kind.start_violation(n, s) > VIOLATED_START * n.unit[s]:
            raise start_beyond_bound(n, s)


def refuse_penetration(n: InstantProblem) -> None:
    """Refuse to continue where an open stop or contact is past its bound by more than a closed one may be."""
    for s, kind in enumerate(n.kinds):
        past = kind.penetration(n, s)
        if n.mode[s] == OFF and past > PENETRATED * n.unit[s] + n.W.options.position_tolerance:
            raise passed_bound(n, s, past)


def resolve_modes(n: InstantProblem, fired: np.ndarray, record: bool = True) -> None:
    """Resolve jumps and modes at the instant until no rule is violated; modes at the start are not recorded."""
    here = n.here
    before, modes, ways = here.y.copy(), n.W.modes.mode.copy(), n.ways().copy()
    since = before  # the last jump that was recorded
    hits: dict[int, bool] = {}
    calm: list[int] = []
    gone: list[int] = []  # guards of rows that were released because they could not hold
    again = 0
    for _ in range(MOST_ROUNDS):
        n.evaluate_switches()
        refuse_penetration(n)
        stop_slips(n, fired)
        still = switches_at_rest(n, fired)
        still[calm] = True
        for s, kind in enumerate(n.kinds):
            kind.prepare(n, s, bool(still[s]))
        at = closed_bounds(n, fired)
        rate = n.rate.copy()
        jumped = jump_if_needed(n, at, still)
        if jumped is None:
            still |= n.mode != OFF
        else:
            hits |= {s: s in jumped.at_rest for s in jumped.closing if s not in here.missed_crossings}
            fired = guards_still_valid(n, fired, rate)
            still = switches_at_rest(n, fired)
            still[list(jumped.at_rest)] = True
        update_elastic_stops(n, fired, ways)
        found = modes_or_jump(n, at, still, fired, jumped)
        if isinstance(
            found, VelocityJump
        ):  # no solution for the accelerations: velocities have jumped, all is evaluated again
            record_jump(n, found, since)
            since = here.y.copy()
            n.reevaluate_switches()
            fired, calm = guards_still_valid(n, fired, rate), list(found.at_rest)
            continue
        for s, kind in enumerate(n.kinds):
            kind.finish(n, s, hits)
        remove_residual_rates(n, found)
        n.project()
        if jumped is not None and (
            jumped.external_impulses or jumped.given or not jumped.closing.keys() <= here.missed_crossings
        ):
            record_jump(n, jumped, since)
            since = here.y.copy()
        guards = n.guards()
        if again < MOST_REPEATS and slides_against_direction(n, guards):
            n.reevaluate_switches()
            again += 1
            continue
        against = broken_guards(n, found, guards)
        new = [g for g in against if g not in gone]
        if not new:
            if against:  # it was released and holds again, by another distribution than that of least squares
                report_distribution(n, against)
            if record:
                record_mode_changes(n, (modes, ways), before, hits)
            return
        fired, gone = np.array([*fired, *new], np.int64), [*gone, *new]
    raise endless_instant(here.t, guard_titles(n, fired.tolist()), MOST_ROUNDS)


def slides_against_direction(n: InstantProblem, guards: np.ndarray) -> bool:
    """Return whether a row slides against its direction: the end of a series of bounces also changes other rates."""
    sliding = ((g, s) for g, (kind, s, _) in enumerate(n.guarded) if kind in (G_SLIDES, G_REVERSES, G_TURNS))
    return any(guards[g] < -n.still[s] for g, s in sliding)


def guards_still_valid(n: InstantProblem, fired: np.ndarray, rate: np.ndarray) -> np.ndarray:
    """Return the triggered guards without guards of rates that a jump has changed."""
    other = np.abs(n.rate - rate) > n.still
    return np.array(
        [
            g
            for g in fired.tolist()
            if n.guarded[g][0] not in (*RATE_GUARDS, *PRESS_GUARDS) or not other[n.guarded[g][1]]
        ],
        np.int64,
    )


def jump_if_needed(n: InstantProblem, at: dict[int, tuple[float, ...]], still: np.ndarray) -> VelocityJump | None:
    """Return the jump of velocities, or None if there is none; ``n`` is evaluated afterwards."""
    here = n.here
    parts = rows_of_velocities(n, at, still)
    kick, here.external_impulse = here.external_impulse, None
    blows, here.external_impulses = tuple(here.external_impulses), []
    if kick is None and not violates_rule(n, parts, n.rate):
        n.engage_drivers()
        return None
    jumped = apply_impulses(n, parts, kick)
    jumped.external_impulses = blows
    if jumped.ended != SOLUTION_FOUND:
        n.restore_modes()
        raise no_admissible_impulses(n, parts)
    here.lost, here.given, here.fresh = here.lost + jumped.lost, here.given + jumped.given, True
    n.engage_drivers()
    n.reevaluate_switches()
    note_bounces(n, jumped)
    return jumped


def modes_or_jump(
    n: InstantProblem,
    at: dict[int, tuple[float, ...]],
    still: np.ndarray,
    fired: np.ndarray,
    jumped: VelocityJump | None,
) -> ModeDecision | VelocityJump:
    """Decide the modes; end series of bounces that have become shorter than rounding.

    Where there is no solution for the accelerations, velocities may jump without a collision.
    """
    found = decide_modes(n, at, still, fired)
    if found.ended == SOLUTION_FOUND and (over := coming_to_rest(n, at, still)).any():
        still |= over
        settle_down(n, np.flatnonzero(over).tolist(), still, jumped)
        found = decide_modes(n, at, still, fired)
    if found.ended == SOLUTION_FOUND:
        report_indeterminacy(n, found)
        return found
    blow = (
        jump_without_collision(n, rows_of_velocities(n, at, still), np.abs(found.reach).max(initial=0.0))
        if found.ended == NO_SOLUTION
        else None
    )
    if blow is None:
        n.restore_modes()
        raise no_admissible_forces(n, found)
    n.here.lost, n.here.fresh = n.here.lost + blow.lost, True
    return blow


def broken_guards(n: InstantProblem, found: ModeDecision, guards: np.ndarray) -> list[int]:
    """Return the guards of active rows that are violated beyond rounding."""
    out = [
        k
        for k, (kind, s, _) in enumerate(n.guarded)
        if kind in FORCE_GUARDS and s in found.sizes and guards[k] < -BROKEN_FORCE * found.sizes[s] - found.least[s]
    ]
    last = len(guards) - 1
    if n.shares and guards[last] < -BROKEN_FORCE * n.here.group.size[0]:
        out.append(last)
    return out


# Overlaps of rounding size at the start are removed by displacing bodies, as assembly closes joints.


SLIGHT_OVERLAP = 1e-5  # overlap that is removed, relative to the mechanism's length or a radian: rounded input data
REPORTED_OVERLAP = 1e-7  # overlap that is reported, relative to the same


def remove_slight_overlaps(n: InstantProblem) -> None:
    """Remove overlaps up to `SLIGHT_OVERLAP` of contacts, stops and ropes; velocities are unchanged."""
    over = {}
    for s, kind in enumerate(n.kinds):
        if not kind.penetration(n, s) > n.near[s]:
            continue
        lower, upper = n.W.modes.lower[s], n.W.modes.upper[s]
        for side, depth in ((lower, lower - n.x[s]), (upper, n.x[s] - upper)):
            if n.near[s] < depth <= SLIGHT_OVERLAP * n.unit[s]:
                over[s] = side, depth
    if not over:
        return
    y, modes, hold = n.here.y.copy(), n.W.modes.mode.copy(), n.W.modes.hold.copy()
    for s, (side, _) in over.items():
        n.W.modes.mode[s], n.W.modes.hold[s] = HELD, side
    n.project()
    n.W.modes.mode[:], n.W.modes.hold[:] = modes, hold
    n.here.v[:] = y[n.here.structure.nq : n.here.structure.nq + n.here.structure.nv]
    n.project()  # project the velocities onto the joints' rows at the new positions
    n.evaluate_switches()
    n.restore_modes()
    told = {s: x for s, (_, x) in over.items() if x > REPORTED_OVERLAP * n.unit[s]}
    if told:
        most = max(told, key=lambda s: told[s])
        n.here.doubts.append(
            f"the start overlaps by up to {told[most]:.2g} ({n.name(most)}); what is there was moved by as much"
        )
