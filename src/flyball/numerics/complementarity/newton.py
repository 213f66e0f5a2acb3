"""Newton's method on velocities with the method of multipliers.

It is of second order, for few bodies and any ratio of masses. The contact problem is the limit of problems with a
compliance R, min 1/2 |e|^2 + sum of envelopes (`proximal_rows`). This function is convex, once differentiable and
piecewise smooth. Newton's method with the exact Hessian of the current piece, factored in 6 x 6 blocks, and an
exact line search along the step converges in few steps (Todorov 2014; Castro et al. 2022 in velocities with finite
compliance). The impulses then become the multipliers (p0 = p, the method of multipliers: Rockafellar 1976), so that
contact is hard for any R, and an exact warm start needs no factorisation. R decreases as the multipliers converge.
Coulomb's law: De Saxce's term mu |u_t| of the normal velocity is updated with the multipliers (Cadoux 2009).
"""

from __future__ import annotations

from ...compiler.formulas import by_address, formula
from ...compiler.kernels import kernel
from ...math.scalar import sqrt
from .contact_problem import (
    CONVERGED,
    LIMIT_REACHED,
    SOLVE_FAILED,
    STALLED,
    ContactProblem,
    ContactSolution,
    ContactWorkspace,
    FactorStorage,
    SolverSettings,
)
from .island_rows import BLOCKS, CONTACTS, ROWS, factor_blocks, island_rows, prepare_island, solve_blocks
from .proximal_rows import (
    CONTACT,
    COULOMB_CONTACT,
    FREE_VELOCITY,
    FRICTION,
    MOBILITY,
    MULTIPLIER,
    NORMAL_SCALE,
    REGULARISATION,
    ROW_NUMBERS,
    ROW_VELOCITY,
    SCALED_IMPULSE,
    SCALED_TARGET,
    TANGENT_SCALE,
    TARGET_CHANGE,
    add_impulse,
    assemble_hessian,
    de_saxce_velocity,
    fill_rows,
    island_span,
    make_dissipative,
    nearest_impulse,
    row_product,
    rows_residual,
    set_added_velocities,
    set_impulses,
    set_kind,
    set_metric,
    set_row_velocities,
    set_target_changes,
    set_targets,
    slope_along_step,
    velocities_of_multipliers,
    write_back_rows,
)

# compliance relative to the mobility: far from the solution, near it, minimum, without friction
MAX_RHO, SMALL_RHO, MIN_RHO, FRICTIONLESS_RHO = 0.1, 1e-3, 1e-9, 1e-6  # bounds of R / mobility
RHO_DECREASE, RHO_DECREASE_NEAR, NEAR_RESIDUAL = (
    0.1,
    0.01,
    1e-3,
)  # factors of R when impulses converge slowly, far and near; residual over velocities that is near
RHO_INCREASE = 3.0  # factor of the compliance when Newton's method on Coulomb's law fails
RHO_MARGIN, MAX_STEPS_AT_RHO = 1.0, 12  # see `next_rho`; steps at one compliance, after which it was too small
SLOW_CHANGE = 0.05  # ratio of successive changes of impulses above which the compliance decreases
LINE_SEARCH_TOLERANCE = 0.1  # remaining part of the slope along a step at which the line search ends
MAX_LINE_SEARCHES, MAX_HALVINGS = 30, 4
VELOCITY_ROUNDING = 1e-13  # residual that rounding leaves, relative to the largest velocity that an impulse causes


@formula
def newton_direction(R, symmetric):
    """Compute the Newton step, its e . step, |step|^2 and gradient . step. First value False if factoring failed."""
    n = R.size[BLOCKS]
    b, g, s = R.blocks, 6 * n, 12 * n
    assemble_hessian(R, symmetric)
    Lp = R.graph[6 * (n + 1) : 7 * (n + 1)]
    if not factor_blocks(n, Lp, R.Li, R.D, R.L, symmetric):
        return False, 0.0, 0.0, 0.0
    for k in range(g):
        b[s + k] = -b[g + k]
    solve_blocks(n, Lp, R.Li, R.D, R.L, b[s : s + g])
    first, second, down = 0.0, 0.0, 0.0
    for k in range(g):
        first += b[k] * b[s + k]
        second += b[s + k] * b[s + k]
        down += b[g + k] * b[s + k]
    return True, first, second, down


@formula
def exact_line_search(R, first, second, down):
    """Find the part of a step with minimum objective; the slope is continuous, increasing and piecewise smooth."""
    low, high, a = 0.0, 1e300, 1.0
    at_low, at_high = down, 0.0
    for _ in range(MAX_LINE_SEARCHES):
        here = slope_along_step(R, a, first, second)
        if abs(here) <= -LINE_SEARCH_TOLERANCE * down:
            return a
        if here < 0.0:
            low, at_low = a, here
            if high > 1e299:
                a *= 2.0
                continue
        else:
            high, at_high = a, here
        a = low - at_low * (high - low) / (at_high - at_low)
        a = min(max(a, low + 0.1 * (high - low)), high - 0.1 * (high - low))
    return a


@formula
def gradient_square(R, a):
    """|e - sum G' p|^2 at the part a of the step."""
    x, n = R.row, 6 * R.size[BLOCKS]
    for k in range(n):
        R.blocks[3 * n + k] = R.blocks[k] + a * R.blocks[2 * n + k]
    for row in range(R.size[ROWS]):
        o = ROW_NUMBERS * row
        p = nearest_impulse(
            x,
            o,
            x[o + SCALED_TARGET] + a * x[o + TARGET_CHANGE],
            x[o + SCALED_TARGET + 1] + a * x[o + TARGET_CHANGE + 1],
            x[o + SCALED_TARGET + 2] + a * x[o + TARGET_CHANGE + 2],
        )
        if p[0] != 0.0:
            add_impulse(
                R, row, 3 * n, -p[0] / x[o + NORMAL_SCALE], -p[1] / x[o + TANGENT_SCALE], -p[2] / x[o + TANGENT_SCALE]
            )
    s = 0.0
    for k in range(n):
        s += R.blocks[3 * n + k] * R.blocks[3 * n + k]
    return s


@formula
def halved_step_length(R):
    """Find a part of a step that reduces the equations' residual, if it is no gradient; 0 if none does."""
    n = 6 * R.size[BLOCKS]
    now, a = 0.0, 1.0
    for k in range(n):
        now += R.blocks[n + k] * R.blocks[n + k]
    for _ in range(MAX_HALVINGS):
        if gradient_square(R, a) < (1.0 - 0.5 * a) * now:
            return a
        a *= 0.5
    return 0.0


@formula
def take_step(R, a):
    """Move e and the scaled y by the part a of the step.

    y is not recomputed from e: if a heavy body stands on light ones, velocities are differences of large numbers, and
    their rounding divided by R would affect every impulse. Updated in this way, the rounding enters once and is
    corrected.
    """
    x, n = R.row, 6 * R.size[BLOCKS]
    for k in range(n):
        R.blocks[k] += a * R.blocks[2 * n + k]
    for row in range(R.size[ROWS]):
        o = ROW_NUMBERS * row
        for k in range(3):
            x[o + SCALED_TARGET + k] += a * x[o + TARGET_CHANGE + k]


@formula
def convergence_measures(R, coulomb):
    """Measures for the impulses at y: residuals, velocity error of the gradient, compliance times change [m/s].

    Writes the velocities that these impulses cause to column ROW_VELOCITY of the rows.
    """
    x, g = R.row, 6 * R.size[BLOCKS]
    near, change = 0.0, 0.0
    for row in range(R.size[ROWS]):
        o = ROW_NUMBERS * row
        a, b, c = row_product(R, row, g)
        r, p, q = x[o + REGULARISATION], x[o + NORMAL_SCALE], x[o + TANGENT_SCALE]
        x[o + ROW_VELOCITY] = r * x[o + MULTIPLIER] - p * x[o + SCALED_TARGET] - de_saxce_velocity(x, o) - a
        x[o + ROW_VELOCITY + 1] = r * x[o + MULTIPLIER + 1] - q * x[o + SCALED_TARGET + 1] - b
        x[o + ROW_VELOCITY + 2] = r * x[o + MULTIPLIER + 2] - q * x[o + SCALED_TARGET + 2] - c
        near = max(near, a * a + b * b + c * c)
        a, b, c = (
            x[o + SCALED_IMPULSE] / p - x[o + MULTIPLIER],
            x[o + SCALED_IMPULSE + 1] / q - x[o + MULTIPLIER + 1],
            x[o + SCALED_IMPULSE + 2] / q - x[o + MULTIPLIER + 2],
        )
        change = max(change, r * r * (a * a + b * b + c * c))
    return rows_residual(R, coulomb), sqrt(near), sqrt(change)


@formula
def update_multipliers(R, coulomb):
    """Set the multipliers to the impulses at y."""
    x, n = R.row, 6 * R.size[BLOCKS]
    for row in range(R.size[ROWS]):
        o = ROW_NUMBERS * row
        x[o + MULTIPLIER] = x[o + SCALED_IMPULSE] / x[o + NORMAL_SCALE]
        x[o + MULTIPLIER + 1], x[o + MULTIPLIER + 2] = (
            x[o + SCALED_IMPULSE + 1] / x[o + TANGENT_SCALE],
            x[o + SCALED_IMPULSE + 2] / x[o + TANGENT_SCALE],
        )
    set_added_velocities(R, coulomb)
    for k in range(n):
        R.blocks[k] -= R.blocks[n + k]


@formula
def largest_velocity(R):
    """Largest velocity without impulses, or caused by a multiplier in its own row [m/s]."""
    s = 0.0
    for row in range(R.size[ROWS]):
        o = ROW_NUMBERS * row
        for k in range(3):
            s = max(s, abs(R.row[o + FREE_VELOCITY + k]), R.row[o + MOBILITY] * abs(R.row[o + MULTIPLIER + k]))
    return s


@formula
def tolerance(R, O):
    """Residual at which the iteration ends: the requested one, or an acceptable one that is mostly rounding [m/s]."""
    return max(O.real.enough, min(O.real.acceptable, VELOCITY_ROUNDING * largest_velocity(R)))


@formula
def iterate_newton(R, O, coulomb, law, steps):
    """Take Newton steps at fixed multipliers: (outcome, residual, change of the multipliers, steps)."""
    enough, last = tolerance(R, O), steps + MAX_STEPS_AT_RHO
    while True:
        set_impulses(R)
        (worst, O.real.force_residual), near, change = convergence_measures(R, coulomb)
        if worst != worst:
            return SOLVE_FAILED, worst, change, steps
        if worst <= enough or near <= max(0.1 * change, 0.1 * enough):
            return CONVERGED, worst, change, steps
        if steps >= O.count.most:
            return LIMIT_REACHED, worst, change, steps
        if steps >= last:
            return STALLED, worst, change, steps
        steps += 1
        good, first, second, down = newton_direction(R, not law)
        if not good:
            return STALLED if law else SOLVE_FAILED, worst, change, steps
        set_target_changes(R)
        a = halved_step_length(R) if law else exact_line_search(R, first, second, down)
        if law and a == 0.0:
            return STALLED, worst, change, steps
        take_step(R, a)


@formula
def has_friction(R):
    """Whether any contact has friction; otherwise the problem is piecewise quadratic, for any compliance."""
    f = 0.0
    for row in range(R.size[CONTACTS]):
        f = max(f, R.row[ROW_NUMBERS * row + FRICTION])
    return f > 0.0


@formula
def next_rho(rho, slow, near):
    """Compliance of the next problem; ``near``: residual over the largest velocity."""
    if slow:  # lower bound: a velocity as large as the residual must not change impulses by 100 %
        rho = max(
            (RHO_DECREASE if near > NEAR_RESIDUAL else RHO_DECREASE_NEAR) * rho, min(rho, RHO_MARGIN * near), MIN_RHO
        )
    return min(rho, max(near, SMALL_RHO))


@formula
def iterate_multipliers(R, O, coulomb, worst):
    """Iterate the multipliers to the tolerance. Returns the outcome and the residual.

    Coulomb's law alternates convex problems with fixed De Saxce terms, and Newton's method on the law itself.
    """
    steps, before, law, best, force = 0, 1e300, False, 1e300, 0.0
    rho = min(max(worst / largest_velocity(R), SMALL_RHO), MAX_RHO) if has_friction(R) else FRICTIONLESS_RHO
    set_added_velocities(R, coulomb)
    for _ in range(4 * O.count.most + 20):
        set_metric(R, rho)
        if law:
            set_kind(R, CONTACT, COULOMB_CONTACT)
        set_targets(R)
        ended, worst, change, steps = iterate_newton(R, O, coulomb, law, steps)
        O.count.used = steps
        if law:
            set_kind(R, COULOMB_CONTACT, CONTACT)
            if ended != CONVERGED or not worst < best:  # no improvement: continue from the state before
                if ended == LIMIT_REACHED:
                    O.real.force_residual = force
                    return LIMIT_REACHED, best
                velocities_of_multipliers(R)
                law, before, rho = False, 1e300, min(RHO_INCREASE * rho, MAX_RHO)
                continue
        update_multipliers(R, coulomb)
        if ended == LIMIT_REACHED or ended == SOLVE_FAILED or worst <= tolerance(R, O):
            return ended, worst
        best, force, law = worst, O.real.force_residual, coulomb > 0.0
        if ended == STALLED:
            rho, before = min(10.0 * rho, MAX_RHO), 1e300
        else:
            rho, before = next_rho(rho, change > SLOW_CHANGE * before, worst / largest_velocity(R)), change
    return STALLED, worst


@formula
def newton_solve(P, X, O, F):
    """See `newton`."""
    span = island_span(P, O)
    if P.turn.shape[0] > 0 and O.count.coulomb == 0:
        O.count.ended = SOLVE_FAILED
        return 0
    if not prepare_island(P, span, F, O):
        return 0
    R = by_address(island_rows(P, F, F.places[:16]))
    fill_rows(P, X, R, span)
    velocities_of_multipliers(R)
    coulomb = 1.0 * O.count.coulomb
    set_row_velocities(R)
    worst, O.real.force_residual = rows_residual(R, coulomb)
    O.count.used = 0
    ended = CONVERGED
    if not worst <= O.real.enough:
        ended, worst = iterate_multipliers(R, O, coulomb, worst)
        if ended == LIMIT_REACHED:
            make_dissipative(R)
    O.count.ended, O.real.residual = ended, worst
    if ended != SOLVE_FAILED:
        write_back_rows(P, X, R, span)
    return O.count.used


@kernel
def newton(
    P: ContactProblem, X: ContactSolution, W: ContactWorkspace, O: SolverSettings, F: FactorStorage, task: int
) -> int:
    """Newton's method; returns the number of factorisations.

    Outcomes in O.count.ended: STORAGE_TOO_SMALL: enlarge `FactorStorage` and call again; SOLVE_FAILED: not finite, or
    the convex form with rolling friction, which is not supported. In both cases nothing was changed.
    """
    return newton_solve(P, X, O, F)
