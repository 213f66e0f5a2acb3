"""Alternating directions with a sparse factor: one factor serves many iterations.

min 1/2 |e|^2 + g(z) over z = u0 + G e, with multipliers p (the impulses) and penalties 1 / R (`smooth.py`): e from
(1 + sum G' R^-1 G) e = sum G' (p + (z - u0) / R), p from the nearest admissible impulse to p - u / R, z from what that
leaves (Boyd et al. 2011; for contact Tasora, Mangoni, Benatti and Garziera 2021). The penalty follows the two
residuals, and only then the matrix is factored anew. With Coulomb's law De Saxce's additions are renewed where
the convex problem that they make is nearly solved.
"""

from __future__ import annotations

from ...compiler.formulas import by_address, formula
from ...compiler.kernels import kernel
from .blocks import factor, solve
from .fill import fill_rows, hand_back, make_safe, residual, set_own, set_slips, span_of
from .gather import BLOCKS, ROWS
from .layout import prepare, rows_of
from .problem import (
    BROKEN,
    CONVERGED,
    CUT,
    Choices,
    Factor,
    Problem,
    Scratch,
    State,
)
from .prox import DY, HELD, IDLE, KIND, METRIC, OWN, ROOT_N, ROOT_T, WIDE, Q, U, nearest, set_metric, slipped
from .smooth import add_impulse, add_row, clear_matrix, from_held, product

FIRST, LEAST, MOST_RHO = 0.1, 1e-6, 1e3  # R in parts of the mobility
# iterations to the first look at the penalty, and how much longer it is to the next, so that it settles; ratio of
# residuals that is too much; change of R
EVERY, LONGER, UNEQUAL, CHANGE = 10, 1.2, 5.0, 5.0
DONE_WITH = 0.2  # of the residual is left of the convex problem: on to the next one
SPLIT = DY  # column of z


@formula
def factored(R, rho):
    """Factor the matrix for R = rho times the mobility of every row."""
    x, n = R.row, R.size[BLOCKS]
    set_metric(R, rho)
    clear_matrix(R)
    for row in range(R.size[ROWS]):
        if x[WIDE * row + KIND] != IDLE:
            a = 1.0 / x[WIDE * row + METRIC]
            add_row(R, row, (a, 0.0, 0.0, a, 0.0, a, 0.0, 0.0), True)
    return factor(n, R.graph[6 * (n + 1) : 7 * (n + 1)], R.Li, R.D, R.L, True)


@formula
def velocities(R):
    """e of the iteration."""
    x, n = R.row, R.size[BLOCKS]
    for k in range(6 * n):
        R.blocks[k] = 0.0
    for row in range(R.size[ROWS]):
        o = WIDE * row
        if x[o + KIND] != IDLE:
            a = 1.0 / x[o + METRIC]
            p = x[o + HELD] + a * (x[o + SPLIT] - x[o + U] - slipped(x, o))
            q = x[o + HELD + 1] + a * (x[o + SPLIT + 1] - x[o + U + 1])
            r = x[o + HELD + 2] + a * (x[o + SPLIT + 2] - x[o + U + 2])
            add_impulse(R, row, 0, p, q, r)
    solve(n, R.graph[6 * (n + 1) : 7 * (n + 1)], R.Li, R.D, R.L, R.blocks[: 6 * n])


@formula
def impulses(R):
    """Impulses and z of the iteration. Returns the largest u - z and the largest change of z [m/s]."""
    x, apart, moved = R.row, 0.0, 0.0
    for row in range(R.size[ROWS]):
        o = WIDE * row
        g, r = product(R, row, 0), x[o + METRIC]
        u = g[0] + x[o + U] + slipped(x, o), g[1] + x[o + U + 1], g[2] + x[o + U + 2]
        a, b, c = x[o + HELD], x[o + HELD + 1], x[o + HELD + 2]
        n, t = x[o + ROOT_N], x[o + ROOT_T]
        p = nearest(x, o, (r * a - u[0]) / n, (r * b - u[1]) / t, (r * c - u[2]) / t)
        a, b, c = r * (p[0] / n - a), r * (p[1] / t - b), r * (p[2] / t - c)
        apart = max(apart, abs(a), abs(b), abs(c))
        z = u[0] + a, u[1] + b, u[2] + c
        for s in range(3):
            moved = max(moved, abs(z[s] - x[o + SPLIT + s]))
            x[o + SPLIT + s], x[o + Q + s] = z[s], p[s]
        x[o + HELD], x[o + HELD + 1], x[o + HELD + 2] = p[0] / n, p[1] / t, p[2] / t
    return apart, moved


@formula
def iterate(R, O, coulomb):
    """Iterations until the residual is small enough. Returns how it ended, and the residual."""
    rho, worst, wait, look = FIRST, 0.0, 1.0 * EVERY, EVERY
    for row in range(R.size[ROWS]):
        for s in range(3):
            R.row[WIDE * row + SPLIT + s] = R.row[WIDE * row + OWN + s]
    if not factored(R, rho):
        return BROKEN, worst
    set_slips(R, coulomb)
    for k in range(O.count.most):
        velocities(R)
        apart, moved = impulses(R)
        from_held(R)
        set_own(R)
        worst, O.real.force_residual = residual(R, coulomb)
        O.count.used = k + 1
        if worst != worst:
            return BROKEN, worst
        if worst <= O.real.enough:
            return CONVERGED, worst
        if max(apart, moved) < DONE_WITH * worst:
            set_slips(R, coulomb)
            wait = 1.0 * EVERY
        if k >= look:
            old, wait = rho, wait * LONGER
            look = k + int(wait)
            if apart > UNEQUAL * moved:
                rho = max(rho / CHANGE, LEAST)
            elif moved > UNEQUAL * apart:
                rho = min(rho * CHANGE, MOST_RHO)
            if rho != old and not factored(R, rho):
                return BROKEN, worst
    return CUT, worst


@formula
def admm_solve(P, X, O, F):
    """See `admm`."""
    span = span_of(P, O)
    O.count.used = 0
    if P.turn.shape[0] > 0 and O.count.coulomb == 0:
        O.count.ended = BROKEN
        return 0
    if not prepare(P, span, F, O):
        return 0
    R = by_address(rows_of(P, F, F.places[:16]))
    fill_rows(P, X, R, span)
    from_held(R)
    set_own(R)
    coulomb = 1.0 * O.count.coulomb
    worst, O.real.force_residual = residual(R, coulomb)
    ended = CONVERGED
    if not worst <= O.real.enough:
        ended, worst = iterate(R, O, coulomb)
    O.count.ended, O.real.residual = ended, worst
    if ended == BROKEN:
        return O.count.used
    if ended == CUT:
        make_safe(R)
    hand_back(P, X, R, span)
    return O.count.used


@kernel
def admm(P: Problem, X: State, W: Scratch, O: Choices, F: Factor, task: int) -> int:
    """Alternating directions; returns iterations. For what stands in `Choices.count[ENDED]` see `newton.newton`."""
    return admm_solve(P, X, O, F)
