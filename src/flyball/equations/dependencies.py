"""Constraints that depend on one another at many states: positions through the engine's door, one sparse factor each.

Rows are divided by their size and velocities counted in lengths, as everywhere where the rank of G is asked for. In
absolute coordinates only: the factor's pattern is that of G M^-1 G^T.
"""

from __future__ import annotations

import numpy as np

from ..compiler.formulas import call, formula
from ..compiler.kernels import kernel
from ..compiler.layout import Float1, Float2, Float3
from ..numerics.integrators.clock import Clock, ClockCounts, ClockReals
from ..numerics.integrators.tableaux import Tableau, tableau
from ..numerics.ldl import ldl_factor
from ..numerics.weakest import strongest, weakest
from ..tables.system import System, Work
from .engine import POSITION, engine
from .tasks import Sheet

ADDED = 1e-13  # to the diagonal, where rows of unit length have 1


@formula
def unit_rows(S, W, scale):
    """Rows of unit size in W.H, of velocities counted in lengths; what they were divided by in `W.rows.diagonal`."""
    for k in range(S.rows.law.shape[0]):
        s = 0.0
        for e in range(S.row_start[k], S.row_start[k + 1]):
            W.H[e] = W.G[e] * scale[S.column[e]]
            s += W.H[e] * W.H[e]
        s = s**0.5 if s > 0.0 else 1.0
        for e in range(S.row_start[k], S.row_start[k + 1]):
            W.H[e] /= s
        W.rows.diagonal[k] = s


@formula
def factor_square(S, W):
    """Factor H H^T and a little on its diagonal; as `ldl_factor`."""
    for e in range(W.A.shape[0]):
        W.A[e] = 0.0
    for e in range(S.pairs.first.shape[0]):
        i, j = S.pairs.first[e], S.pairs.second[e]
        for k in range(S.pairs.length[e]):
            W.A[S.pairs.place[e]] += W.H[i + k] * W.H[j + k]
    for k in range(S.rows.law.shape[0]):
        W.A[S.ldl.Ap[S.ldl.perm[k] + 1] - 1] += ADDED
    return ldl_factor(S.ldl, W.A, W.L, W.D[0], W.D[1])


@formula
def each(address, S, W, R, clock, sheet, states, scale, block, kept, out):
    """See `dependencies_kernel`."""
    last = block.shape[0] - 2
    for n in range(states.shape[0]):
        clock.real.t = states[n, 0]
        for i in range(clock.y.shape[1]):
            if states[n, 1 + i] == states[n, 1 + i]:  # what is not told goes on from the state before
                clock.y[0, i] = states[n, 1 + i]
        call(address, S, W, R, clock, sheet, POSITION)
        unit_rows(S, W, scale)
        if factor_square(S, W) != 0:
            for i in range(3):
                out[n, i] = np.nan
            continue
        out[n, 0] = strongest(S.row_start, S.column, W.H, block[last + 1], W.velocities.scratch_1)
        X = block[: last + 1]
        out[n, 1], out[n, 2] = weakest(
            S.ldl, W.L, W.D[0], S.row_start, S.column, W.H, X, W.velocities.scratch_1, W.D[2]
        )
        for i in range(last):
            for k in range(S.rows.law.shape[0]):
                kept[n, k, i] = X[i, k] / W.rows.diagonal[k]


@kernel
def dependencies_kernel(
    address: int,
    S: System,
    W: Work,
    R: Tableau,
    clock: Clock,
    sheet: Sheet,
    states: Float2,
    scale: Float1,
    block: Float2,
    kept: Float3,
    out: Float2,
) -> None:
    """The weakest combinations of rows at every state; ``block`` ends with a vector for the largest singular value."""
    each(address, S, W, R, clock, sheet, states, scale, block, kept, out)


def dependencies(
    S: System, W: Work, states: np.ndarray, scale: np.ndarray, count: int
) -> tuple[np.ndarray, np.ndarray]:
    """The weakest combinations of the rows at many states, of which as many as ``count`` are to be dependencies.

    Parameters
    ----------
    S, W : System, Work
        In absolute coordinates, with rows.
    states : ndarray (n, 1 + ny)
        Times and states; nan: turns and places that are those nearest to the ones before.
    scale : ndarray (nv,)
        What velocities are counted in.
    count : int

    Returns
    -------
    multipliers : ndarray (n, nr, count)
        What should act on nothing.
    sizes : ndarray (n, 3)
        The largest singular value of the rows of unit size; the least of those that are not to be dependencies; the
        largest of those that are. nan where the rows are.
    """
    n, nr = len(states), len(S.rows.law)
    ny = states.shape[1] - 1
    real, y = ClockReals.blank(), np.zeros((1, ny))
    clock = Clock(real, ClockCounts.blank(), np.zeros(0), y, np.zeros((1, ny)), np.zeros(0, np.int64))
    block = np.random.default_rng(0).standard_normal((count + 2, nr))
    kept, out = np.zeros((n, nr, count)), np.zeros((n, 3))
    sheet, R = Sheet(np.zeros((0, 0))), tableau("rk45")
    dependencies_kernel(engine.address, S, W, R, clock, sheet, states, scale, block, kept, out)
    return kept, out
