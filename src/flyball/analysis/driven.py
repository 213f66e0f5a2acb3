"""Mechanisms whose drivers leave no freedom: their motion is kinematics, and works are integrals of what it takes.

The compiled loop (``system/follow.py``) gives positions, velocities, accelerations and powers at every time that it
stops at. The powers are integrated by the polynomial through eight neighbouring times; where six say something else,
times are added.
"""

from __future__ import annotations

import numpy as np

from ..numerics.integrators import explicit as ex
from ..numerics.integrators.tableaux import tableau
from .assemble import Assembly
from .entry import FOLLOW, motion_kernel
from .mobility import mobility
from .start import Start

NODES, FEWER = 8, 6
ROUNDS = 40
SHORT = 1e-12  # part of the span: a power that is still uneven over less has jumped


def leaves_no_freedom(start: Start) -> bool:
    """Whether drivers prescribe every velocity, and rows on positions alone say where everything is."""
    s = start.base.compiled.structure
    if not s.model.drivers or s.nv > len(s.rows) or not all(r.holonomic for r in s.rows):
        return False
    return mobility(s.model, start.base).freedoms == 0


def integrate_powers(a: Assembly, clock: ex.Clock, rows: np.ndarray) -> np.ndarray:
    """Put works where the rows of ``follow`` have powers, in place; keep those at output times.

    Parameters
    ----------
    a : Assembly
    clock : Clock
        As the loop has left it; its state at the end gets its works too.
    rows : ndarray (n, width)
    """
    at = 1 + clock.accounts
    begin = clock.y[0, clock.accounts] if len(rows) == 0 else None
    if begin is None and len(at):
        works = _works(a, clock, rows)
        rows[:, at] = works
        clock.y[0, clock.accounts] = works[-1]
    wanted = np.isin(rows[:, 0], clock.times)
    return np.ascontiguousarray(rows[wanted])


def _works(a: Assembly, clock: ex.Clock, rows: np.ndarray) -> np.ndarray:
    """Works at the times of the rows."""
    at = 1 + clock.accounts
    t, P = rows[:, 0], rows[:, at]
    nodes, powers = t, P
    states = {float(row[0]): row for row in rows}
    span = max(t[-1] - t[0], 1e-300)
    for _ in range(ROUNDS):
        pieces, error = _pieces(nodes, powers)
        h = np.diff(nodes)
        allowed = ex.LOOSER * clock.real[ex.RTOL] * (clock.real[ex.LEDGER] + np.abs(pieces).sum())
        uneven = (error > allowed * np.sqrt(h / span)) & (h > SHORT * span)
        if not uneven.any():
            break
        more = [_between(a, clock, states, nodes[k], nodes[k + 1]) for k in np.flatnonzero(uneven)]
        more = [row for row in more if row is not None]
        if not more:
            break
        states |= {float(row[0]): row for row in more}
        nodes = np.array(sorted(states))
        powers = np.array([states[x][at] for x in nodes.tolist()])
    pieces, _ = _pieces(nodes, powers)
    works = np.vstack([np.zeros(len(at)), np.cumsum(pieces, axis=0)])
    return works[np.searchsorted(nodes, t)]


def _pieces(t: np.ndarray, P: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Integrals over every interval, (n - 1, accounts), and how much they differ from those with fewer nodes."""
    best, other = (_quadrature(t, P, min(m, len(t))) for m in (NODES, FEWER))
    if len(t) <= FEWER:
        other = np.diff(t)[:, None] * 0.5 * (P[1:] + P[:-1])
    return best, np.abs(best - other).sum(axis=1)


def _quadrature(t: np.ndarray, P: np.ndarray, m: int) -> np.ndarray:
    """Integrals over every interval of the polynomials through the m nearest nodes."""
    n = len(t) - 1
    first = np.clip(np.arange(n) - m // 2 + 1, 0, len(t) - m)
    window = first[:, None] + np.arange(m)
    middle, half = 0.5 * (t[1:] + t[:-1]), 0.5 * (t[window[:, -1]] - t[window[:, 0]])
    x = (t[window] - middle[:, None]) / half[:, None]
    ends = np.stack([t[:-1] - middle, t[1:] - middle], axis=1) / half[:, None]
    powers = np.arange(m)
    moments = (ends[:, 1:] ** (powers + 1) - ends[:, :1] ** (powers + 1)) / (powers + 1)
    weights = np.linalg.solve(x[:, None, :] ** powers[:, None], moments[..., None])[..., 0] * half[:, None]
    return np.einsum("im,imk->ik", weights, P[window])


def _between(a: Assembly, clock: ex.Clock, states: dict, t0: float, t1: float) -> np.ndarray | None:
    """A row half way between two neighbours; nothing where the motion does not lead there."""
    S, W = a.compiled.values.system, a.compiled.work
    row = states[float(t0)]
    own = ex.Clock(
        clock.real.copy(),
        clock.count.copy(),
        np.array([0.5 * (t0 + t1)]),
        clock.y.copy(),
        clock.K.copy(),
        clock.accounts,
    )
    own.y[0] = row[1 : 1 + clock.y.shape[1]]
    own.real[[ex.T, ex.T_END]] = t0, own.times[0]
    own.count[[ex.STARTED, ex.NEXT]] = 0
    own.count[ex.QUOTA] = 1000
    out = np.zeros((50, len(row)))
    used = motion_kernel(S, W, tableau("rk45"), own, out, FOLLOW)
    return out[used - 1].copy() if own.count[ex.STATUS] == ex.DONE else None
