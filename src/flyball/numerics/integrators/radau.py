"""Steps of Radau IIA of order 5 for constrained equations of motion, stabilised index 2.

Step control after Hairer and Wanner, *Solving Ordinary Differential Equations II* (1996), section IV.8, with
Gustafsson's predictive control.

If one Jacobian is not enough for a step, Newton's method solves all three stages at once with the Jacobian
of each. When a mechanism passes a singular position within a step, the smallest singular value of its constraint rows
changes sign from one stage to the next; with the Jacobian of the step's start the iteration then diverges from the
solution.
"""

from __future__ import annotations

from ...compiler.formulas import formula
from ...math.scalar import sqrt
from ..sparse_factorisation import lu_factor, lu_solve, sparse_product
from .explicit_runge_kutta import reset_rejections, undo_last_step
from .implicit_method import MAX_WIDTH_GROWTH
from .implicit_method import halve_fixed_step as narrower
from .implicit_workspace import STEP_START
from .radau_stages import (
    GAMMA,
    MAX_ITERATIONS,
    RADAU_A_INVERSE,
    RADAU_C,
    STAGES,
    confirm_convergence,
    correct_stages,
    factor_matrices,
    predict_stages,
    radau_error,
    set_step_start,
    shift_proximal_point,
    soften_redundant_rows,
    solve_stages,
    stage_rates,
    update_integrals,
    update_jacobian,
)
from .time_loop import (
    INSPECTED_END,
    INSPECTED_END_RATE,
    INSPECTED_START,
    INSPECTED_START_RATE,
    set_rejected_width,
)

MAX_COUPLED_ITERATIONS = 12
COUPLED_REFINEMENTS = 6  # refinements of each solve
MAX_COUPLED_GROWTH = 10.0  # largest ratio of successive corrections
UNSCALED, REGULARISATION = -1, -2  # multiplier codes in `whole_scatter`, besides columns of A^-1 / h


@formula
def fill_coupled_matrix(K, h):
    """Assemble the matrix of all stages."""
    A = K.whole_A
    for i in range(A.shape[0]):
        A[i] = 0.0
    for e in range(K.whole_scatter.shape[0]):
        x = K.J[K.whole_scatter[e, 1], K.whole_scatter[e, 2]]
        by = K.whole_scatter[e, 3]
        if by >= 0:
            x *= RADAU_A_INVERSE[K.whole_scatter[e, 1]][by] / h
        elif by == REGULARISATION:
            x *= h / GAMMA
        A[K.whole_scatter[e, 0]] += x


@formula
def solve_coupled(K, h):
    """Solve for the right-hand side in K.whole_x[0], refined against the matrix without its regularisation."""
    x = K.whole_x
    n = x.shape[1]
    for i in range(n):
        x[1, i] = x[0, i]
    lu_solve(K.whole_P, K.whole_L, K.whole_U, K.whole_D, x[0])
    for _ in range(COUPLED_REFINEMENTS if K.count.shared == 0 else 0):
        sparse_product(K.whole_P, K.whole_A, x[0], x[2])
        for e in range(K.whole_scatter.shape[0]):
            if K.whole_scatter[e, 3] == REGULARISATION:
                i = K.whole_P.Aj[K.whole_scatter[e, 0]]
                x[2, i] -= h / GAMMA * K.J[K.whole_scatter[e, 1], K.whole_scatter[e, 2]] * x[0, i]
        for i in range(n):
            x[2, i] = x[1, i] - x[2, i]
        lu_solve(K.whole_P, K.whole_L, K.whole_U, K.whole_D, x[2])
        for i in range(n):
            x[0, i] += x[2, i]


@formula
def correct_coupled_stages(K, h):
    """Correct all stage values once. Returns the size of the correction in units of the tolerance."""
    nv, nr, nx = K.d.shape[1], K.lam.shape[1], K.tol_x.shape[0]
    n = 2 * nv + 2 * nr + nx
    perm = K.whole_P.perm
    for k in range(STAGES):
        for i in range(n):
            K.whole_x[0, perm[k * n + i]] = -K.out[k, i]
    solve_coupled(K, h)
    s = 0.0
    for k in range(STAGES):
        for i in range(nv):
            x, y = K.whole_x[0, perm[k * n + i]], K.whole_x[0, perm[k * n + nv + i]]
            K.d[k, i] += x
            K.v[k, i] += y
            x /= K.tol[0, i]
            y /= K.tol[1, i]
            s += x * x + y * y
        for i in range(nr):
            K.lam[k, i] += K.whole_x[0, perm[k * n + 2 * nv + i]]
            K.mu[k, i] += K.whole_x[0, perm[k * n + 2 * nv + nr + i]]
        for i in range(nx):
            x = K.whole_x[0, perm[k * n + 2 * nv + 2 * nr + i]]
            K.z[k, i] += x
            x /= K.tol_x[i]
            s += x * x
    return sqrt(s / max(6 * nv + 3 * nx, 1))


@formula
def iterate_coupled_newton(callbacks, S, K, c, h):
    """Run Newton's iteration for all stages together. Returns a status, and the size of the first correction."""
    residual, linearise = callbacks
    last, moved = 1e300, 0.0
    for n in range(MAX_COUPLED_ITERATIONS):
        stage_rates(K, h)
        for k in range(STAGES):
            t = c.real.t + RADAU_C[k] * h
            if residual(t, k, S, K, c) != 0 or linearise(t, k, S, K, c) != 0:
                return 1, moved
        soften_redundant_rows(K, h)
        fill_coupled_matrix(K, h)
        if lu_factor(K.whole_P, K.whole_A, K.whole_L, K.whole_U, K.whole_D, K.whole_Y) != 0:
            return 1, moved
        K.real.correction = size = correct_coupled_stages(K, h)
        K.count.whole += 1
        moved = size if n == 0 else moved
        if not size < 1e300 or (n > 1 and size > MAX_COUPLED_GROWTH * last):
            return 1, moved
        if size <= K.real.newton or (n > 0 and size * size / last <= K.real.newton and size < 0.1 * last):
            return 0, moved
        if n > 2 and 0.5 * last < size <= K.real.rounding_size:
            return 0, moved
        last = size
    return 1, moved


@formula
def solve_coupled_stages(callbacks, S, K, c, h):
    """Find the stage values. Returns a status."""
    more = shift_proximal_point(K, 0)
    status, moved = iterate_coupled_newton(callbacks, S, K, c, h)
    pass_ = 0
    while status == 0 and more and (pass_ == 0 or moved > K.real.newton):
        pass_ += 1
        more = shift_proximal_point(K, pass_)
        status, moved = iterate_coupled_newton(callbacks, S, K, c, h)
    return update_integrals(callbacks[0], S, K, c, h) if status == 0 else status


RADAU_SAFETY = 0.9
MIN_WIDTH_RATIO = 0.2  # smallest ratio of successive widths
SINGULAR_WIDTH_RATIO = 1e-3  # part of the widest recent step below which steps approach a singularity
EXPECTED_ERROR_FALL, MUCH_NARROWER = (
    0.5,
    0.1,
)  # a true error falls at least by the first factor in a step narrower by the second
ACCEPTED_ROUNDING = 10.0  # error from rounding that is accepted if no other width succeeds
MAX_ROUNDING = 1e-5  # relative error of a step above which it is not accepted as rounding
RETRY_WIDTH_FACTOR = 1.24  # factor on half the width of an undone step: two such steps end beyond the original end
RETRY_REFINEMENTS = 1  # refinements of solves after a failed step
STEP_SINGULAR = 3


@formula
def start_as_stage(K, c):
    """Initialise row STEP_START as a stage: zero increment, current acceleration."""
    nv = K.v.shape[1]
    nq = c.y.shape[1] - nv - K.z.shape[1]
    for i in range(nv):
        K.d[STEP_START, i] = 0.0
        K.a[STEP_START, i] = c.K[0, nq + i]


@formula
def correct_with_end_jacobian(callbacks, S, K, c, h):
    """Correct the stages once with the Jacobian of the last one. Returns a status, and the size of the correction."""
    residual, linearise = callbacks
    if update_jacobian(linearise, c.real.t + h, STAGES - 1, S, K, c) != 0 or factor_matrices(K, h) != 0:
        return STEP_SINGULAR, 0.0
    stage_rates(K, h)
    for k in range(STAGES):
        if residual(c.real.t + RADAU_C[k] * h, k, S, K, c) != 0:
            return STEP_SINGULAR, 0.0
    soften_redundant_rows(K, h)
    return 0, correct_stages(K, h)


@formula
def attempt_radau_step(callbacks, S, K, c, h):
    """Try one step of width h to c.y.proposed. Returns (status, error, iterations or factor of the width)."""
    residual, linearise, compose, arrive = callbacks[:4]
    set_step_start(c, K)
    start_as_stage(K, c)
    predict_stages(K, h)
    outdated = K.count.infinite_slopes == 1 or (
        K.count.fresh == 0 and (c.count.step_status != 0 or K.real.theta > K.real.reuse_rate)
    )
    if c.real.max_growth <= 1.0 and outdated:
        K.count.fresh = -1
    if K.count.fresh < 1 and not (K.count.fresh == 0 and K.real.width > 0.0):
        if update_jacobian(linearise, c.real.t, STEP_START, S, K, c) != 0:
            return STEP_SINGULAR, 0.0, 0.5
        K.count.fresh = 1
    if K.real.width != h and factor_matrices(K, h) != 0:
        return STEP_SINGULAR, 0.0, 0.5
    status, asked = solve_stages(residual, S, K, c, h)
    if status != 0 and K.count.fresh == 1:
        predict_stages(K, h)
        status = solve_coupled_stages((residual, linearise), S, K, c, h)
        if status == 0:
            asked = float(MAX_ITERATIONS)
            K.real.theta = 1.0
    if status == 0 and K.count.infinite_slopes == 1:
        status = confirm_convergence(correct_with_end_jacobian, (residual, linearise), S, K, c, h)
        asked = 0.5 if status != 0 else asked
        if status == 0:  # the Jacobian is now that of the end: `accept_radau_step` reuses it, another try does not
            K.count.fresh = -1
            status = update_integrals(residual, S, K, c, h)
    if status != 0:
        return status, 0.0, asked
    compose(c.y.current, K.d[2], K.v[2], K.z[2], c.y.proposed, S)
    error = 0.0
    if c.real.step == 0.0:
        status, error = radau_error(residual, S, K, c, h)
        if status != 0 or not error < 1e300:
            return STEP_SINGULAR, 0.0, 0.5
        if error > max(1.0, c.real.accepted_error):
            return 0, error, asked
    status, _ = arrive(c.real.t + h, c.y.proposed, c.K[1], S, K)
    return status, error, asked if status == 0 else 0.5


@formula
def width_for_error(h, error, iterations):
    """Width suggested by an error, smaller after many iterations; returns it and the safety factor."""
    safe = min(RADAU_SAFETY, RADAU_SAFETY * (1.0 + 2.0 * MAX_ITERATIONS) / (iterations + 2.0 * MAX_ITERATIONS))
    return h / max(1.0 / MAX_WIDTH_GROWTH, min(1.0 / MIN_WIDTH_RATIO, error**0.25 / safe)), safe


@formula
def reject_radau_step(K, c):
    """Choose a narrower step, with a new Jacobian at its start. Returns 0, or 1 if there is none to try."""
    h, error, asked = c.real.tried, c.real.error, K.real.result
    if K.count.shared == 0 and (c.count.step_status != 0 or c.real.max_growth <= 1.0):
        K.count.refine = RETRY_REFINEMENTS
    if c.count.step_status != 0:
        if c.real.step > 0.0 and K.count.fresh == 1:
            return narrower(K, c)
        if c.real.step > 0.0:
            set_rejected_width(c, h)
            return 0
        set_rejected_width(c, asked * h)
        escape_singular_position(K, c)
        return 0
    goes_on = K.count.before == 1 or c.real.back == c.real.t
    set_rejected_width(c, width_for_error(h, error, asked)[0] if goes_on else 0.1 * h)
    if goes_on:  # after a jump, faster motion makes steps as wide as before unlikely
        accept_rounding_error(K, c, h, error)
        if c.real.accepted_error > 0.0:
            escape_singular_position(K, c)
    return 0


@formula
def accept_rounding_error(K, c, h, error):
    """Accept an error as rounding if much narrower steps do not reduce it; the widest of them is then taken.

    This happens near a singular position, where rounding grows as steps get narrower. The largest accepted error is
    reported (c.real.largest_error).
    """
    if error < EXPECTED_ERROR_FALL * c.real.best:
        c.real.best = error
        c.real.best_h = h
    elif (
        h < MUCH_NARROWER * c.real.best_h and c.real.best * K.real.rtol < MAX_ROUNDING and c.real.accepted_error == 0.0
    ):
        c.real.accepted_error = 2.0 * c.real.best
        c.real.h = c.real.best_h
        c.real.rounding_found_at = c.real.t


@formula
def escape_singular_position(K, c):
    """Leave the neighbourhood of a singular position, if ever narrower steps fail because the last one ended too close.

    The last step is undone and ended elsewhere. If that does not help, a wide step is tried, which ends beyond the
    position, then others, each somewhat narrower and with a larger accepted error.
    """
    if not (c.real.h < SINGULAR_WIDTH_RATIO * c.real.wide and c.real.accepted_error * K.real.rtol < MAX_ROUNDING):
        return
    if (
        c.real.accepted_error == 0.0
        and c.real.t - c.real.before > SINGULAR_WIDTH_RATIO * c.real.wide
        and c.real.back < c.real.before
    ):
        undo_last_step(c)
        c.real.h *= RETRY_WIDTH_FACTOR
        K.count.before, K.count.fresh = 0, -1
        return
    c.real.accepted_error = max(ACCEPTED_ROUNDING, ACCEPTED_ROUNDING * c.real.accepted_error)
    c.real.h = c.real.wide * (ACCEPTED_ROUNDING / c.real.accepted_error) ** 0.15
    c.real.rounding_found_at = c.real.t


@formula
def accept_radau_step(K, c, t, h, error, iterations):
    """Make the end of the step the current state, and choose the width of the next one."""
    for i in range(c.y.shape[1]):
        c.y.previous[i], c.y.previous_rate[i] = c.y.current[i], c.K[0, i]
        c.y.current[i] = c.y.proposed[i]
        c.K[0, i] = c.K[1, i]
    for i in range(K.v.shape[1]):
        for k in range(4):
            K.previous_v[k, i] = K.v[k, i]
    for i in range(K.tol_x.shape[0]):
        for k in range(4):
            K.previous_x[k, i] = K.z[k, i]
    for i in range(K.lam.shape[1]):
        for k in range(3):
            K.previous_lam[k, i] = K.lam[k, i]
        K.lam[STEP_START, i] = K.lam[2, i]
    if error > c.real.largest_error:
        c.real.largest_error = error
        c.real.largest_error_at = c.real.t
    wide, safe = width_for_error(h, error, iterations)
    if K.real.last_error > 0.0 and error > 0.0:
        f = (h / K.real.last_h) * (K.real.last_error / (error * error)) ** 0.25 * safe
        wide = min(wide, h * max(MIN_WIDTH_RATIO, min(MAX_WIDTH_GROWTH, f)))
    if c.real.max_growth <= 1.0:
        wide = min(wide, h)
    else:
        K.count.refine = 0
    if c.real.accepted_error > 0.0:
        wide = max(h, c.real.wide)
    reset_rejections(c)
    for i in range(c.inspection.shape[1]):
        c.inspection[INSPECTED_START, i] = c.inspection[INSPECTED_END, i]
        c.inspection[INSPECTED_START_RATE, i] = c.inspection[INSPECTED_END_RATE, i]
    K.real.last_h = h
    K.real.last_error = max(1e-2, error)
    K.count.before = 1
    K.count.fresh = 0 if K.real.theta <= K.real.reuse_rate else -1
    if K.count.fresh == 0 and h <= wide <= K.real.stays * h:
        wide = h
    c.real.wide = max(h, 0.8 * c.real.wide)
    c.real.h = wide if c.real.step == 0.0 else c.real.step
    c.real.t = t
    c.real.max_growth = MAX_WIDTH_GROWTH
    c.count.accepted += 1
