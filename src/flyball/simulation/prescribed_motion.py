"""Mechanisms whose drivers leave no freedom: works as integrals of powers, and checks of stops and friction.

The compiled loop (`engine/`) gives positions, velocities, accelerations and powers at each time. Powers are
integrated by the polynomial through eight neighbouring times. Where the polynomials through six or seven give
different values, times are added.

A prescribed motion has no rows for stops or stick friction, since the drivers determine the motion. A motion that
passes a stop is refused.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from ..assembly.assembled_state import Assembly
from ..assembly.compiled_mechanism import compile_mechanism
from ..constraints.switches.switch_kind import SwitchKind
from ..engine.entry_point import FOLLOW, run_task
from ..errors import ModelError
from ..mobility.null_spaces import jacobian_rank
from ..numerics.integrators import time_loop as ex
from ..numerics.integrators.butcher_tableaux import tableau
from ..results.result import Result
from ..tables.constraint_rows import SwitchSpec
from .initial_state import InitialState

MOST_STARTS = 4  # cached answers of `leaves_no_freedom` for one set of values
NODES, FEWER = 8, (7, 6)  # nodes, and those of the error estimate; an odd number too, whose windows lie differently
REFINEMENTS = 40
MOST_CALLS = 1_000_000
CLUSTERED = 1e-3  # distance of neighbouring nodes below which they are clustered, relative to half the window's width
RANK_TOLERANCE = 1e-10  # relative singular value of the weight equations below which it counts as zero
SHORTEST_INTERVAL = 1e-12  # shortest interval that is refined, relative to the span; over less the power has jumped


def leaves_no_freedom(start: InitialState) -> bool:
    """Return whether drivers prescribe every velocity, and position constraints alone determine all positions.

    This is False with controllers, whose states have to be integrated.
    """
    s = start.base.compiled.structure
    if s.controls or not s.model.drivers or s.nv > len(s.rows) or not all(r.holonomic for r in s.rows):
        return False
    a = start.base
    x, key = a.compiled.values, (float(a.t).hex(), a.y.tobytes())
    return x.cache.get("held", key, MOST_STARTS, lambda: _rank_of_rows(a) == s.nv)


def _rank_of_rows(a: Assembly) -> int:
    a.compiled.at(a.t, a.q, a.v)
    return jacobian_rank(a.compiled)


def at_outputs(clock: ex.StepState, rows: np.ndarray) -> np.ndarray:
    """Return the rows (n, width) of task FOLLOW at output times; powers stand in the columns of works."""
    return np.ascontiguousarray(rows[np.isin(rows[:, 0], clock.times)])


def deferred_works(start: InitialState, clock: ex.StepState, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the works of a prescribed motion, computed on first access.

    Parameters
    ----------
    start : InitialState
        With the works at the start of the motion.
    clock : StepState
        As the loop has left it.
    rows : ndarray (n, width)
        All rows that the loop has written, with powers in place of works.

    Returns
    -------
    states : ndarray (n outputs, nz)
    final : ndarray
        The state vector at the end.
    """
    at = 1 + clock.integrals
    s = start.assembly.compiled.structure
    states, final = at_outputs(clock, rows)[:, 1 + s.nq + s.nv :][:, : len(s.states)].copy(), clock.y.current.copy()
    if len(rows) and len(at):
        works = start.y[clock.integrals] + _works(start.assembly, clock, rows)
        states[:, clock.integrals - s.nq - s.nv] = works[np.isin(rows[:, 0], clock.times)]
        final[clock.integrals] = works[-1]
    return states, final


def _works(a: Assembly, clock: ex.StepState, rows: np.ndarray) -> np.ndarray:
    """Return the works at the times of the rows, zero at the first."""
    known, P = refined_nodes(a, clock, rows, lambda some: some[:, 1 + clock.integrals])
    return cumulative_integrals(known[:, 0], P)[np.searchsorted(known[:, 0], rows[:, 0])]


def refined_nodes(
    a: Assembly, clock: ex.StepState, rows: np.ndarray, powers: Callable[[np.ndarray], np.ndarray]
) -> tuple[np.ndarray, np.ndarray]:
    """Return the rows, with rows added between them until the integrals of ``powers`` are accurate, and the powers (n,
    k).
    """
    known, P = rows, powers(rows)
    shortest = SHORTEST_INTERVAL * (rows[-1, 0] - rows[0, 0])
    for _ in range(REFINEMENTS):
        pieces, error = _interval_integrals(known[:, 0], P)
        allowed = ex.INTEGRAL_TOLERANCE_FACTOR * clock.real.rtol * (clock.real.energy_size + np.abs(pieces).sum())
        uneven = _largest_errors(np.where(np.diff(known[:, 0]) > shortest, error, 0.0), allowed)
        more = _midpoint_rows(a, clock, known, uneven) if len(uneven) else known[:0]
        if not len(more):
            break
        known, P = np.vstack([known, more]), np.vstack([P, powers(more)])
        first = np.unique(known[:, 0], return_index=True)[1]
        known, P = known[first], P[first]
    return known, P


def cumulative_integrals(t: np.ndarray, P: np.ndarray) -> np.ndarray:
    """Return the integrals (n, k) of powers (n, k) over time, zero at the first time."""
    pieces = _quadrature(t, P, min(NODES, len(t))) if len(t) > 1 else np.zeros((0, P.shape[1]))
    return np.vstack([np.zeros(P.shape[1]), np.cumsum(pieces, axis=0)])


def _largest_errors(error: np.ndarray, allowed: float) -> np.ndarray:
    """Return the fewest intervals without whose errors at most half of the allowed error is left; none if it is
    allowed.
    """
    if error.sum() <= allowed:
        return np.zeros(0, np.int64)
    order = np.argsort(-error)
    left = error.sum() - np.cumsum(error[order])
    return np.sort(order[: 1 + np.argmax(left <= 0.5 * allowed)])


def _interval_integrals(t: np.ndarray, P: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the integrals over every interval, (n - 1, accounts), and their change with fewer nodes."""
    if len(t) < 2:
        return np.zeros((0, P.shape[1])), np.zeros(0)
    best = _quadrature(t, P, min(NODES, len(t)))
    others = [np.diff(t)[:, None] * 0.5 * (P[1:] + P[:-1])] if len(t) <= FEWER[0] else []
    others += [_quadrature(t, P, m) for m in FEWER if m < len(t)]
    return best, np.max([np.abs(best - other).sum(axis=1) for other in others], axis=0)


def _quadrature(t: np.ndarray, P: np.ndarray, m: int) -> np.ndarray:
    """Return the integrals over every interval of the polynomials through the m nearest nodes.

    Where nodes are clustered, the polynomial depends on the rounding of their differences. There the weights of least
    norm that integrate powers of time are used.
    """
    n = len(t) - 1
    first = np.clip(np.arange(n) - m // 2 + 1, 0, len(t) - m)
    window = first[:, None] + np.arange(m)
    middle, half = 0.5 * (t[1:] + t[:-1]), 0.5 * (t[window[:, -1]] - t[window[:, 0]])
    x = (t[window] - middle[:, None]) / half[:, None]
    ends = np.stack([t[:-1] - middle, t[1:] - middle], axis=1) / half[:, None]
    rounding = 4.0 * np.finfo(float).eps * np.abs(t[[0, -1]]).max() / half
    other = np.abs(x - x[n // 2]).max(axis=1) > rounding  # most windows of evenly spaced times are like the middle one
    other[n // 2] = True
    weights = np.empty((n, m))
    weights[other] = _quadrature_weights(x[other], ends[other])
    weights[~other] = weights[n // 2]
    return np.einsum("im,imk->ik", weights * half[:, None], P[window])


def _quadrature_weights(x: np.ndarray, ends: np.ndarray) -> np.ndarray:
    """Return the weights (n, m) of the nodes (n, m) in the integrals between ends (n, 2)."""
    n, m = x.shape
    powers = np.arange(m)
    moments = (ends[:, 1:] ** (powers + 1) - ends[:, :1] ** (powers + 1)) / (powers + 1)
    V = np.ones((n, m, m))
    np.cumprod(np.broadcast_to(x[:, None, :], (n, m - 1, m)), axis=1, out=V[:, 1:])
    weights = np.empty((n, m))
    crowded = np.diff(x, axis=1).min(axis=1) < CLUSTERED
    weights[~crowded] = np.linalg.solve(V[~crowded], moments[~crowded, :, None])[..., 0]
    weights[crowded] = np.einsum("imk,ik->im", np.linalg.pinv(V[crowded], rcond=RANK_TOLERANCE), moments[crowded])
    return weights


def _midpoint_rows(a: Assembly, clock: ex.StepState, known: np.ndarray, intervals: np.ndarray) -> np.ndarray:
    """Return rows at the middle of these intervals and where the loop stops on its way, as far as it gets."""
    first = known[intervals[0]]
    times = 0.5 * (known[intervals, 0] + known[intervals + 1, 0])
    real, count, _, y, K, accounts, seen = clock
    out = np.zeros((len(times) + 50, len(first)))
    c = a.compiled
    own = ex.StepState(real.copy(), count.copy(), times, y.copy(), K.copy(), accounts, seen)
    own.y[0] = first[1 : 1 + clock.y.shape[1]]
    own.real.t, own.real.t_end = first[0], times[-1]
    own.count.started = own.count.next = own.count.accepted = own.count.rejected = own.count.status = 0
    own.count.quota = own.count.limit = MOST_CALLS
    rows = []
    while own.count.status == ex.RUNNING:
        used = run_task(*c.buffers, tableau("rk45"), own, out, FOLLOW)
        rows.append(out[:used].copy())
    return np.concatenate(rows)[1:]


STOP_TOLERANCE = 1e-9  # allowed excess at a stop, relative to the mechanism's length, a radian, or the largest rate
CHECKS_PER_INTERVAL, MOST_CHECKS = 8, 4000  # times checked between two output times; in total
CHECK_ROUNDS = 4


def is_visible(kind: SwitchKind) -> bool:
    """Whether a motion shows that it violates the rule of a switch."""
    return kind.excess(np.zeros(1), np.zeros(1), (0.0, 0.0)) is not None


def is_checked_afterwards(kind: SwitchKind) -> bool:
    """Whether analyses of a prescribed motion support a kind of switch."""
    return kind.kinetic or is_visible(kind)


def refuse_passed(result: Result, analysis: str, again: Callable[[np.ndarray], Result]) -> None:
    """Refuse a motion that passes a stop at or between the output times; the health report gives the number of checks.

    Between two times a few more are checked, and the peaks of the cubic through values and rates at both ends.

    Parameters
    ----------
    result : Result
    analysis : str
        Its name, for the message.
    again : callable
        Returns the same motion at other times [s].

    Raises
    ------
    ModelError
        Naming the element, the time and the excess.
    """
    seen, t = _switch_history(result), result.t
    remarks = _friction_at_rest(seen)
    stops = [x.element.title for x in seen.specs if is_visible(x.switch.kind)]
    for k in range(CHECK_ROUNDS if stops else 0):
        more = _intermediate_times(t) if k == 0 else _times_of_peaks(t, seen)
        if not len(more):
            break
        looked = again(np.union1d(t, more))
        seen, t = _switch_history(looked), looked.t
    if stops:
        _refuse_passed_stops(t, seen, analysis)
        remarks.append(f"{', '.join(stops)}: not passed at {len(t)} times that were looked at, which is no proof")
    result.health.remarks = (*result.health.remarks, *remarks)


def remark_friction(result: Result) -> None:
    """Add to the health report where friction is at rest in a motion that drivers prescribe."""
    result.health.remarks = (*result.health.remarks, *_friction_at_rest(_switch_history(result)))


class SwitchHistory(NamedTuple):
    """Switch quantities along a motion: values and rates (n, times), bounds (n, 2), and the tolerance of each."""

    specs: list[SwitchSpec]
    x: np.ndarray
    rate: np.ndarray
    bounds: np.ndarray
    near: np.ndarray


def _switch_history(result: Result) -> SwitchHistory:
    old = result.values.structure
    c = compile_mechanism(result.model, parameters=result.values.parameter_values, tree=old.tree, switches=True)
    every = c.structure.switches
    which = [k for k, spec in enumerate(every) if spec.measured >= 0]
    specs = [every[k] for k in which]
    x, rate = np.zeros((2, len(specs), len(result.t)))
    c.follow(dict(zip(old.states, result.hints[0].tolist(), strict=True)) if len(result.t) else {})
    for k, t in enumerate(result.t.tolist()):
        c.at(t, result.q[k].copy(), result.v[k].copy())
        for n, spec in enumerate(specs):
            x[n, k] = c.work.sensed.value[spec.measured]
            rate[n, k] = _quantity_rate(c, spec, result.v[k])
    numbers = c.values.system.switch_numbers
    bounds = np.stack([numbers.lower[which], numbers.upper[which]], axis=1)
    return SwitchHistory(
        specs, x, rate, bounds, STOP_TOLERANCE * np.maximum(c.values.length, np.abs(rate).max(axis=1, initial=0.0))
    )


def _intermediate_times(t: np.ndarray) -> np.ndarray:
    """Return times between those of a motion."""
    n = max(1, min(CHECKS_PER_INTERVAL, MOST_CHECKS // max(len(t), 1)))
    part = np.arange(1, n + 1) / (n + 1)
    return (t[:-1, None] + np.diff(t)[:, None] * part).ravel()


def _times_of_peaks(t: np.ndarray, history: SwitchHistory) -> np.ndarray:
    """Return times at which cubics through values and rates pass a stop, or run backwards at a freewheel."""
    h, out = np.diff(t), [np.zeros(0)]
    for spec, x, rate, bounds, near in zip(*history, strict=True):
        # x + h (r s + b s^2 + a s^3), s from 0 to 1
        r, rise = rate[:-1], np.diff(x) / h
        a, b = rate[1:] + r - 2.0 * rise, 3.0 * rise - 2.0 * r - rate[1:]
        with np.errstate(all="ignore"):
            root = np.sqrt(b * b - 3.0 * a * r)
            turns = (np.array([root, -root]) - b) / (3.0 * a) if spec.switch.kind.bounded else -b / (3.0 * a)
            turns = np.where(a == 0.0, -r / (2.0 * b), turns)
        s = np.where((turns > 0.0) & (turns < 1.0), turns, 0.0)
        at, going = x[:-1] + h * s * (r + s * (b + s * a)), r + s * (2.0 * b + s * 3.0 * a)
        excess = spec.switch.kind.excess(at, going, bounds)
        if excess is not None:
            out.append((t[:-1] + h * s)[(s > 0.0) & (excess > near)])
    return np.unique(np.concatenate(out))


def _quantity_rate(c, spec: SwitchSpec, v: np.ndarray) -> float:
    """Return the rate of a switch's quantity."""
    S = c.values.system
    row = len(S.rows.law) + spec.measured
    entries = slice(S.row_start[row], S.row_start[row + 1])
    return float(c.work.G[entries] @ v[S.column[entries]])


def _refuse_passed_stops(t: np.ndarray, history: SwitchHistory, analysis: str) -> None:
    for spec, x, rate, bounds, near in zip(*history, strict=True):
        over = spec.switch.kind.excess(x, rate, bounds)
        if over is None or not (over > near).any():
            continue
        e, what = spec.element, " - ".join(spec.switch.along) or "its length"
        raise ModelError(
            f"{e.title}: the drivers take {what} past it at t = {t[np.argmax(over > near)]:.6g} s ({over.max():.4g} at "
            f"most). A prescribed motion is not stopped: change the drivers' laws, or leave it out: "
            f"m.changed({{{e.name!r}: None}}).{analysis}(...)"
        )


def _friction_at_rest(history: SwitchHistory) -> list[str]:
    """Return remarks on friction elements that are at rest at some time."""
    out = []
    for spec, rate in zip(history.specs, history.rate, strict=True):
        still = np.abs(rate) <= STOP_TOLERANCE * np.abs(rate).max(initial=0.0)
        if spec.switch.kind.kinetic and still.any():
            out.append(
                f"{spec.element.title} is taken as zero where it does not slide: its share of the driving forces "
                "there is not determined"
            )
    return out
