"""Alternating directions (ADMM) with a sparse factor: one factor serves many iterations.

min 1/2 |e|^2 + g(z) over z = u0 + G e, with multipliers p (the impulses) and penalties 1 / R (`proximal_rows`):
e from (1 + sum G' R^-1 G) e = sum G' (p + (z - u0) / R), p from the nearest admissible impulse to p - u / R, z
from the rest (Boyd et al. 2011; for contact Tasora, Mangoni, Benatti and Garziera 2021). The penalty follows
the two residuals, and the matrix is factored again only when it changes. With Coulomb's law De Saxce's terms are
updated when the current convex problem is nearly solved.
"""

from __future__ import annotations

from ...compiler.formulas import by_address, formula
from ...compiler.kernels import kernel
from .contact_problem import (
    CONVERGED,
    LIMIT_REACHED,
    SOLVE_FAILED,
    ContactProblem,
    ContactSolution,
    ContactWorkspace,
    FactorStorage,
    SolverSettings,
)
from .island_rows import BLOCKS, ROWS, factor_blocks, island_rows, prepare_island, solve_blocks
from .proximal_rows import (
    FREE_VELOCITY,
    IDLE,
    KIND,
    MULTIPLIER,
    NORMAL_SCALE,
    REGULARISATION,
    ROW_NUMBERS,
    ROW_VELOCITY,
    SCALED_IMPULSE,
    TANGENT_SCALE,
    TARGET_CHANGE,
    add_impulse,
    add_row_to_matrix,
    de_saxce_velocity,
    fill_rows,
    island_span,
    make_dissipative,
    nearest_impulse,
    row_product,
    rows_residual,
    set_added_velocities,
    set_metric,
    set_row_velocities,
    set_unit_matrix,
    velocities_of_multipliers,
    write_back_rows,
)

FIRST_RHO, MIN_RHO, MAX_RHO = 0.1, 1e-6, 1e3  # R relative to the mobility
# iterations before the first check of the penalty, growth of the interval to the next, so that it settles; ratio of
# residuals that changes R; factor of R
FIRST_CHECK, CHECK_GROWTH, RESIDUAL_RATIO, RHO_CHANGE = 10, 1.2, 5.0, 5.0
CONVEX_TOLERANCE = (
    0.2  # accuracy of the convex problem, relative to the residual, at which De Saxce's terms are updated
)
SPLIT_VELOCITY = TARGET_CHANGE  # column of z


@formula
def factor_for_rho(R, rho):
    """Factor the matrix for R = rho times the mobility of every row."""
    x, n = R.row, R.size[BLOCKS]
    set_metric(R, rho)
    set_unit_matrix(R)
    for row in range(R.size[ROWS]):
        if x[ROW_NUMBERS * row + KIND] != IDLE:
            a = 1.0 / x[ROW_NUMBERS * row + REGULARISATION]
            add_row_to_matrix(R, row, (a, 0.0, 0.0, a, 0.0, a, 0.0, 0.0), True)
    return factor_blocks(n, R.graph[6 * (n + 1) : 7 * (n + 1)], R.Li, R.D, R.L, True)


@formula
def solve_velocities(R):
    """Compute e of the iteration."""
    x, n = R.row, R.size[BLOCKS]
    for k in range(6 * n):
        R.blocks[k] = 0.0
    for row in range(R.size[ROWS]):
        o = ROW_NUMBERS * row
        if x[o + KIND] != IDLE:
            a = 1.0 / x[o + REGULARISATION]
            p = x[o + MULTIPLIER] + a * (x[o + SPLIT_VELOCITY] - x[o + FREE_VELOCITY] - de_saxce_velocity(x, o))
            q = x[o + MULTIPLIER + 1] + a * (x[o + SPLIT_VELOCITY + 1] - x[o + FREE_VELOCITY + 1])
            r = x[o + MULTIPLIER + 2] + a * (x[o + SPLIT_VELOCITY + 2] - x[o + FREE_VELOCITY + 2])
            add_impulse(R, row, 0, p, q, r)
    solve_blocks(n, R.graph[6 * (n + 1) : 7 * (n + 1)], R.Li, R.D, R.L, R.blocks[: 6 * n])


@formula
def update_impulses(R):
    """Update impulses and z. Returns the largest u - z and the largest change of z [m/s]."""
    x, apart, moved = R.row, 0.0, 0.0
    for row in range(R.size[ROWS]):
        o = ROW_NUMBERS * row
        g, r = row_product(R, row, 0), x[o + REGULARISATION]
        u = (
            g[0] + x[o + FREE_VELOCITY] + de_saxce_velocity(x, o),
            g[1] + x[o + FREE_VELOCITY + 1],
            g[2] + x[o + FREE_VELOCITY + 2],
        )
        a, b, c = x[o + MULTIPLIER], x[o + MULTIPLIER + 1], x[o + MULTIPLIER + 2]
        n, t = x[o + NORMAL_SCALE], x[o + TANGENT_SCALE]
        p = nearest_impulse(x, o, (r * a - u[0]) / n, (r * b - u[1]) / t, (r * c - u[2]) / t)
        a, b, c = r * (p[0] / n - a), r * (p[1] / t - b), r * (p[2] / t - c)
        apart = max(apart, abs(a), abs(b), abs(c))
        z = u[0] + a, u[1] + b, u[2] + c
        for s in range(3):
            moved = max(moved, abs(z[s] - x[o + SPLIT_VELOCITY + s]))
            x[o + SPLIT_VELOCITY + s], x[o + SCALED_IMPULSE + s] = z[s], p[s]
        x[o + MULTIPLIER], x[o + MULTIPLIER + 1], x[o + MULTIPLIER + 2] = p[0] / n, p[1] / t, p[2] / t
    return apart, moved


@formula
def iterate_admm(R, O, coulomb):
    """Iterate until the residual is small enough. Returns the outcome and the residual."""
    rho, worst, wait, look = FIRST_RHO, 0.0, 1.0 * FIRST_CHECK, FIRST_CHECK
    for row in range(R.size[ROWS]):
        for s in range(3):
            R.row[ROW_NUMBERS * row + SPLIT_VELOCITY + s] = R.row[ROW_NUMBERS * row + ROW_VELOCITY + s]
    if not factor_for_rho(R, rho):
        return SOLVE_FAILED, worst
    set_added_velocities(R, coulomb)
    for k in range(O.count.most):
        solve_velocities(R)
        apart, moved = update_impulses(R)
        velocities_of_multipliers(R)
        set_row_velocities(R)
        worst, O.real.force_residual = rows_residual(R, coulomb)
        O.count.used = k + 1
        if worst != worst:
            return SOLVE_FAILED, worst
        if worst <= O.real.enough:
            return CONVERGED, worst
        if max(apart, moved) < CONVEX_TOLERANCE * worst:
            set_added_velocities(R, coulomb)
            wait = 1.0 * FIRST_CHECK
        if k >= look:
            old, wait = rho, wait * CHECK_GROWTH
            look = k + int(wait)
            if apart > RESIDUAL_RATIO * moved:
                rho = max(rho / RHO_CHANGE, MIN_RHO)
            elif moved > RESIDUAL_RATIO * apart:
                rho = min(rho * RHO_CHANGE, MAX_RHO)
            if rho != old and not factor_for_rho(R, rho):
                return SOLVE_FAILED, worst
    return LIMIT_REACHED, worst


@formula
def admm_solve(P, X, O, F):
    """See `admm`."""
    span = island_span(P, O)
    O.count.used = 0
    if P.turn.shape[0] > 0 and O.count.coulomb == 0:
        O.count.ended = SOLVE_FAILED
        return 0
    if not prepare_island(P, span, F, O):
        return 0
    R = by_address(island_rows(P, F, F.places[:16]))
    fill_rows(P, X, R, span)
    velocities_of_multipliers(R)
    set_row_velocities(R)
    coulomb = 1.0 * O.count.coulomb
    worst, O.real.force_residual = rows_residual(R, coulomb)
    ended = CONVERGED
    if not worst <= O.real.enough:
        ended, worst = iterate_admm(R, O, coulomb)
    O.count.ended, O.real.residual = ended, worst
    if ended == SOLVE_FAILED:
        return O.count.used
    if ended == LIMIT_REACHED:
        make_dissipative(R)
    write_back_rows(P, X, R, span)
    return O.count.used


@kernel
def admm(
    P: ContactProblem, X: ContactSolution, W: ContactWorkspace, O: SolverSettings, F: FactorStorage, task: int
) -> int:
    """Alternating directions; returns iterations. For the outcomes in O.count.ended see `newton.newton`."""
    return admm_solve(P, X, O, F)
