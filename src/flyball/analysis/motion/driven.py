"""Mechanisms whose drivers leave no freedom: their motion is kinematics, and works are integrals of what it takes.

The compiled loop (``equations/follow.py``) gives positions, velocities, accelerations and powers at every time that it
stops at. The powers are integrated by the polynomial through eight neighbouring times; where six or seven say something
else, times are added, first where they differ most.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ...equations.engine import FOLLOW, motion_kernel
from ...numerics.integrators import clock as ex
from ...numerics.integrators.tableaux import tableau
from ..assembly.start import Assembly
from ..freedom.jacobian import rank_of
from .start import Start

MOST = 4  # starts of the same numbers of which it is kept whether drivers hold them
NODES, FEWER = 8, (7, 6)  # an odd number too: at a jump its windows do not lie like those of eight
ROUNDS = 40
CALLS = 1_000_000
CROWDED = 1e-3  # distance of neighbouring nodes, as part of half of all eight's width
BLURRED = 1e-10  # singular values of the equations of weights below this part of the largest are rounding
SHORT = 1e-12  # part of the span: a power that is still uneven over less has jumped


def leaves_no_freedom(start: Start) -> bool:
    """Whether drivers prescribe every velocity, and rows on positions alone say where everything is.

    Controllers have states of their own, which are integrated.
    """
    s = start.base.compiled.structure
    if s.controls or not s.model.drivers or s.nv > len(s.rows) or not all(r.holonomic for r in s.rows):
        return False
    a = start.base
    x, key = a.compiled.values, (float(a.t).hex(), a.y.tobytes())
    return x.kept.get("held", key, MOST, lambda: _rank(a) == s.nv)


def _rank(a: Assembly) -> int:
    a.compiled.at(a.t, a.q, a.v)
    return rank_of(a.compiled)


def at_outputs(clock: ex.Clock, rows: np.ndarray) -> np.ndarray:
    """The rows (n, width) of ``follow`` at output times; powers stand where works belong."""
    return np.ascontiguousarray(rows[np.isin(rows[:, 0], clock.times)])


def owed_works(start: Start, clock: ex.Clock, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The works that a followed motion has done, found when they are first asked for.

    Parameters
    ----------
    start : Start
        With the works that the motion begins with.
    clock : Clock
        As the loop has left it.
    rows : ndarray (n, width)
        All that the loop has written, powers in place of works.

    Returns
    -------
    states : ndarray (n outputs, nz)
    final : ndarray
        The state vector at the end.
    """
    at = 1 + clock.accounts
    s = start.assembly.compiled.structure
    states, final = at_outputs(clock, rows)[:, 1 + s.nq + s.nv :][:, : len(s.states)].copy(), clock.y[0].copy()
    if len(rows) and len(at):
        works = start.y[clock.accounts] + _works(start.assembly, clock, rows)
        states[:, clock.accounts - s.nq - s.nv] = works[np.isin(rows[:, 0], clock.times)]
        final[clock.accounts] = works[-1]
    return states, final


def _works(a: Assembly, clock: ex.Clock, rows: np.ndarray) -> np.ndarray:
    """Works at the times of the rows, from none at the first."""
    known, P = nodes(a, clock, rows, lambda some: some[:, 1 + clock.accounts])
    return integrals(known[:, 0], P)[np.searchsorted(known[:, 0], rows[:, 0])]


def nodes(
    a: Assembly, clock: ex.Clock, rows: np.ndarray, powers: Callable[[np.ndarray], np.ndarray]
) -> tuple[np.ndarray, np.ndarray]:
    """The rows, and as many between them as the integrals of what ``powers`` makes of rows take; with these, (n, k)."""
    known, P = rows, powers(rows)
    shortest = SHORT * (rows[-1, 0] - rows[0, 0])
    for _ in range(ROUNDS):
        pieces, error = _pieces(known[:, 0], P)
        allowed = ex.LOOSER * clock.real[ex.RTOL] * (clock.real[ex.LEDGER] + np.abs(pieces).sum())
        uneven = _largest(np.where(np.diff(known[:, 0]) > shortest, error, 0.0), allowed)
        more = _halfway(a, clock, known, uneven) if len(uneven) else known[:0]
        if not len(more):
            break
        known, P = np.vstack([known, more]), np.vstack([P, powers(more)])
        first = np.unique(known[:, 0], return_index=True)[1]
        known, P = known[first], P[first]
    return known, P


def integrals(t: np.ndarray, P: np.ndarray) -> np.ndarray:
    """Integrals (n, k) of powers (n, k) over time, from none at the first."""
    pieces, _ = _pieces(t, P)
    return np.vstack([np.zeros(P.shape[1]), np.cumsum(pieces, axis=0)])


def _largest(error: np.ndarray, allowed: float) -> np.ndarray:
    """The fewest whose errors, taken away, leave no more than half of what is allowed; none if all is well."""
    if error.sum() <= allowed:
        return np.zeros(0, np.int64)
    order = np.argsort(-error)
    left = error.sum() - np.cumsum(error[order])
    return np.sort(order[: 1 + np.argmax(left <= 0.5 * allowed)])


def _pieces(t: np.ndarray, P: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Integrals over every interval, (n - 1, accounts), and how much they differ from those with fewer nodes."""
    if len(t) < 2:
        return np.zeros((0, P.shape[1])), np.zeros(0)
    best = _quadrature(t, P, min(NODES, len(t)))
    others = [np.diff(t)[:, None] * 0.5 * (P[1:] + P[:-1])] if len(t) <= FEWER[0] else []
    others += [_quadrature(t, P, m) for m in FEWER if m < len(t)]
    return best, np.max([np.abs(best - other).sum(axis=1) for other in others], axis=0)


def _quadrature(t: np.ndarray, P: np.ndarray, m: int) -> np.ndarray:
    """Integrals over every interval of the polynomials through the m nearest nodes.

    Where nodes crowd, the polynomial hangs on the last digits of their differences: there the smallest weights that
    integrate powers of time do.
    """
    n = len(t) - 1
    first = np.clip(np.arange(n) - m // 2 + 1, 0, len(t) - m)
    window = first[:, None] + np.arange(m)
    middle, half = 0.5 * (t[1:] + t[:-1]), 0.5 * (t[window[:, -1]] - t[window[:, 0]])
    x = (t[window] - middle[:, None]) / half[:, None]
    ends = np.stack([t[:-1] - middle, t[1:] - middle], axis=1) / half[:, None]
    powers = np.arange(m)
    moments = (ends[:, 1:] ** (powers + 1) - ends[:, :1] ** (powers + 1)) / (powers + 1)
    V = np.ones((n, m, m))
    np.cumprod(np.broadcast_to(x[:, None, :], (n, m - 1, m)), axis=1, out=V[:, 1:])
    weights = np.empty((n, m))
    crowded = np.diff(x, axis=1).min(axis=1) < CROWDED
    weights[~crowded] = np.linalg.solve(V[~crowded], moments[~crowded, :, None])[..., 0]
    weights[crowded] = np.einsum("imk,ik->im", np.linalg.pinv(V[crowded], rcond=BLURRED), moments[crowded])
    weights *= half[:, None]
    return np.einsum("im,imk->ik", weights, P[window])


def _halfway(a: Assembly, clock: ex.Clock, known: np.ndarray, pieces: np.ndarray) -> np.ndarray:
    """Rows half way through those pieces, and where else the loop stops on its way there; as far as it gets."""
    first = known[pieces[0]]
    times = 0.5 * (known[pieces, 0] + known[pieces + 1, 0])
    real, count, _, y, K, accounts, seen = clock
    out = np.zeros((len(times) + 50, len(first)))
    c = a.compiled
    own = ex.Clock(real.copy(), count.copy(), times, y.copy(), K.copy(), accounts, seen)
    own.y[0] = first[1 : 1 + clock.y.shape[1]]
    own.real[[ex.T, ex.T_END]] = first[0], times[-1]
    own.count[[ex.STARTED, ex.NEXT, ex.ACCEPTED, ex.REJECTED, ex.STATUS]] = 0
    own.count[ex.QUOTA] = own.count[ex.LIMIT] = CALLS
    rows = []
    while own.count[ex.STATUS] == ex.RUNNING:
        used = motion_kernel(*c.buffers, tableau("rk45"), own, out, FOLLOW)
        rows.append(out[:used].copy())
    return np.concatenate(rows)[1:]
