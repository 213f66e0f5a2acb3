"""Explicit Runge-Kutta pairs as a method of the `time_loop`: adaptive steps, dense output, rejected steps.

One step, its error and its dense output; step control after Hairer, Norsett and Wanner, *Solving Ordinary
Differential Equations I* (1993), section II.4. Callbacks: ``derivative(t, y, dy, S, W)``; ``arrive(t, y, dy, S,
W)``, which also projects y; ``tangent(y, e, S, W)``, which projects an error; ``inspect(t, h, span, k, seen, S,
W)``, which reports where in a step laws change without being seen at its stages.

A rejected step is followed by a shorter one, unless its error is rounding. Near a singular position of a
mechanism rounding errors grow without bound, and shorter steps approach that position. Then the previous step is
undone and ended elsewhere, or the position is passed by a wide step.
"""

from __future__ import annotations

from ...compiler.formulas import formula
from ...math.scalar import sqrt
from .time_loop import (
    ACCEPT_STEP,
    AT_END,
    AT_START,
    BEGIN_SEGMENT,
    CHECK_MISSED_CHANGE,
    DISTANT_SIZE_WEIGHT,
    INSPECT_END,
    INSPECTED_END,
    INSPECTED_END_RATE,
    INSPECTED_START,
    INSPECTED_START_RATE,
    INTEGRAL_TOLERANCE_FACTOR,
    INTERPOLATE,
    NOT_FINITE,
    REJECT_STEP,
    STEP_FAILED,
    TRY_STEP,
    set_rejected_width,
    step_end_time,
)

UNKNOWN_ERROR = 1e300  # error of a step that was not tried, or is nan
MIN_FIRST_STEP, SMALL_FIRST_STEP = 1e-7, 1e-6  # smallest first step, and that of small states: parts of the largest
FIRST_STEP_PART = 0.01  # part of the time in which the state changes by its own size
NEGLIGIBLE_NORM = 1e-5  # size of a state, or of its change over the largest step, in units of the tolerance
NO_CHANGE = 1e-15  # change of a state, in units of the tolerance, that is none


@formula
def stage_state(y, K, weights, stages, h, out):
    """Compute ``out`` = y + h sum_j weights[j] K[j]."""
    n = y.shape[0]
    for i in range(n):
        out[i] = 0.0
    for j in range(stages):
        w = h * weights[j]
        if w != 0.0:
            for i in range(n):
                out[i] += w * K[j, i]
    for i in range(n):
        out[i] += y[i]


@formula
def component_tolerance(c, i, size):
    """Tolerance of component i for a value of that size.

    For the first c.count.positions components, the part beyond their unit counts little: accuracy must not decrease
    because a wheel has turned a hundred times, or because the origin is far away.
    """
    unit = c.y.unit[i]
    if i < c.count.positions:
        size = max(min(size, unit), DISTANT_SIZE_WEIGHT * size)
    return c.real.atol * unit + c.real.rtol * size


@formula
def scaled_norm(c, a, y, n):
    """Root mean square of a in units of the tolerance, over the first n components."""
    s = 0.0
    for i in range(n):
        e = a[i] / component_tolerance(c, i, y[i] if y[i] > 0.0 else -y[i])
        s += e * e
    return sqrt(s / max(n, 1))


@formula
def first_step_width(derivative, S, W, R, c):
    """Estimate a first step width from the sizes of y, y' and y'' (Hairer, Norsett and Wanner, section II.4).

    The width has a lower bound, because a state that begins at rest near zero is small without changing fast. Rates
    are taken per time in which the state changes by its own size: the width does not depend on the unit of time.
    """
    n = c.count.controlled
    y = c.y.current
    d0 = scaled_norm(c, y, y, n)
    d1 = scaled_norm(c, c.K[0], y, n)
    h0 = SMALL_FIRST_STEP * c.real.h_max
    if not (d0 < NEGLIGIBLE_NORM or d1 * c.real.h_max < NEGLIGIBLE_NORM):
        h0 = FIRST_STEP_PART * d0 / d1
    h0 = min(max(h0, MIN_FIRST_STEP * c.real.h_max), c.real.h_max)
    for i in range(y.shape[0]):
        c.y.proposed[i] = y[i] + h0 * c.K[0, i]
    if derivative(c.real.t + h0, c.y.proposed, c.K[1], S, W) != 0:
        return 1e-3 * h0
    for i in range(n):
        c.y.interpolated[i] = (c.K[1, i] - c.K[0, i]) / h0
    d2 = scaled_norm(c, c.y.interpolated, y, n)
    wide = h0 / FIRST_STEP_PART
    m = max(d1, d2 * wide) * wide
    if m <= NO_CHANGE:
        return max(SMALL_FIRST_STEP * c.real.h_max, 1e-3 * h0)
    return wide * min(1.0, (FIRST_STEP_PART / m) ** (1.0 / R.order_i[0]))


@formula
def attempt_explicit_step(derivative, arrive, tangent, S, W, R, c, h):
    """Try one step of width h to c.y.proposed. Returns (status, error in units of the tolerance; 0 if it is fixed)."""
    y = c.y.current
    new = c.y.proposed
    stages = R.order_i[1]
    t = c.real.t
    for i in range(1, stages):
        stage_state(y, c.K, R.A[i], i, h, new)
        status = derivative(t + R.c[i] * h, new, c.K[i], S, W)
        if status != 0:
            return status, 0.0
    stage_state(y, c.K, R.A[stages], stages, h, new)
    status, moved = arrive(t + h, new, c.K[stages], S, W)
    if status != 0:
        return status, 0.0
    moved /= c.real.rtol + c.real.atol
    moved = max(moved, integral_error(R, c, h))
    error = step_error(tangent, S, W, R, c, h, False)
    if error > 1.0 and c.real.accepted_error > 0.0:
        error = step_error(tangent, S, W, R, c, h, True)
    error = moved if error <= moved else error  # a nan error remains, and the step is rejected
    return 0, 0.0 if c.real.step > 0.0 and error < UNKNOWN_ERROR else error


@formula
def step_error(tangent, S, W, R, c, h, projected):
    """Error of the step in units of the tolerance; ``projected``: after projection on the constraints."""
    e5 = error_square_sum(tangent, S, W, R, c, 0, projected)
    e3 = error_square_sum(tangent, S, W, R, c, 1, projected)
    return 0.0 if e5 == 0.0 and e3 == 0.0 else h * e5 / sqrt((e5 + 0.01 * e3) * max(c.count.controlled, 1))


@formula
def error_square_sum(tangent, S, W, R, c, k, projected):
    """Sum of squares of one of the two error estimates, per second, in units of the tolerance."""
    y, new, e = c.y.current, c.y.proposed, c.y.interpolated
    n = c.count.controlled
    for i in range(n):
        e[i] = 0.0
    for j in range(R.order_i[1] + 1):
        w = R.E[k, j]
        if w != 0.0:
            for i in range(n):
                e[i] += w * c.K[j, i]
    if projected:
        tangent(new, e, S, W)
    s = 0.0
    for i in range(n):
        s += (e[i] / component_tolerance(c, i, max(abs(y[i]), abs(new[i])))) ** 2
    return s


@formula
def integral_tolerance(c):
    """Tolerance of the integrals (works): relative to the sum of their sizes and c.real.energy_size."""
    size = c.real.energy_size
    for k in range(c.integrals.shape[0]):
        size += abs(c.y.proposed[c.integrals[k]])
    return INTEGRAL_TOLERANCE_FACTOR * c.real.rtol * size


@formula
def integral_error(R, c, h):
    """Error of the integrals in units of their tolerance.

    If a driver prescribes the coordinates, their errors do not show abrupt changes of forces; the works do.
    """
    n = c.integrals.shape[0]
    s = integral_tolerance(c)
    e5 = 0.0
    e3 = 0.0
    for k in range(n):
        i = c.integrals[k]
        a = 0.0
        b = 0.0
        for j in range(R.order_i[1] + 1):
            a += R.E[0, j] * c.K[j, i]
            b += R.E[1, j] * c.K[j, i]
        e5 += (a / s) ** 2
        e3 += (b / s) ** 2
    if e5 == 0.0 and e3 == 0.0:
        return 0.0
    return h * e5 / sqrt((e5 + 0.01 * e3) * n)


@formula
def dense_output(R, c, x, h, out):
    """Dense output at t + x h."""
    n = out.shape[0]
    for i in range(n):
        out[i] = 0.0
    for j in range(R.order_i[2]):
        w = 0.0
        for p in range(R.P.shape[1] - 1, -1, -1):
            w = (w + R.P[j, p]) * x
        w *= h
        if w != 0.0:
            for i in range(n):
                out[i] += w * c.K[j, i]
    for i in range(n):
        out[i] += c.y.current[i]


@formula
def dense_output_error(R, c, h):
    """Error of the dense output within the step, in units of the tolerance; 0 if the error of the step bounds it.

    Uses only the stages computed by `evaluate_dense_stages`, without further evaluations.
    """
    n, m = c.count.controlled, c.integrals.shape[0]
    s = integral_tolerance(c)
    e = less = a = a_less = 0.0
    for i in range(n):
        size = component_tolerance(c, i, max(abs(c.y.current[i]), abs(c.y.proposed[i])))
        e += (dense_output_residual(R, c, 0, i) / size) ** 2
        less += (dense_output_residual(R, c, 1, i) / size) ** 2
    for k in range(m):
        a += (dense_output_residual(R, c, 0, c.integrals[k]) / s) ** 2
        a_less += (dense_output_residual(R, c, 1, c.integrals[k]) / s) ** 2
    of_state = e / (e + less) * sqrt(e / n) if e > 0.0 else 0.0
    of_accounts = a / (a + a_less) * sqrt(a / m) if a > 0.0 else 0.0
    return h * max(of_state, of_accounts)


@formula
def stiffness_estimate(R, c, h):
    """Estimate the step width times the largest eigenvalue from the last two stages, which are both at its end.

    First stiffness criterion of Hairer and Wanner's dop853.f. Exact for y' = lambda y.
    """
    last = R.order_i[1]
    a = b = 0.0
    for i in range(c.count.controlled):
        size = component_tolerance(c, i, max(abs(c.y.current[i]), abs(c.y.proposed[i])))
        d = 0.0
        for j in range(last):
            d += (R.A[last, j] - R.A[last - 1, j]) * c.K[j, i]
        a += ((c.K[last, i] - c.K[last - 1, i]) / size) ** 2
        b += (d / size) ** 2
    return sqrt(a / b) if b > 0.0 else 0.0


@formula
def dense_output_residual(R, c, k, i):
    """One of the two weighted sums over stages for the error of the dense output of component i, per second."""
    e = 0.0
    for j in range(R.order_i[2]):
        e += R.D[k, j] * c.K[j, i]
    return e


@formula
def evaluate_dense_stages(derivative, S, W, R, c, h):
    """Evaluate the stages that only dense output needs. Returns a status."""
    for k in range(R.order_i[1] + 1, R.order_i[2]):
        stage_state(c.y.current, c.K, R.A[k], k, h, c.y.interpolated)
        status = derivative(c.real.t + R.c[k] * h, c.y.interpolated, c.K[k], S, W)
        if status != 0:
            return status
    return 0


@formula
def equation_defect(derivative, S, W, R, c, h, x):
    """Residual of the equations for the dense output at t + x h, times h, in units of the tolerance.

    Huge if the equations cannot be evaluated there.
    """
    n = c.count.controlled
    at = c.y.interpolated
    gap = c.K[R.order_i[2]]
    dense_output(R, c, x, h, at)
    if derivative(c.real.t + x * h, at, gap, S, W) != 0:
        return 1e300
    for j in range(R.order_i[2]):
        w = 0.0
        for p in range(R.P.shape[1] - 1, -1, -1):
            w = w * x + (p + 1.0) * R.P[j, p]
        if w != 0.0:
            for i in range(n):
                gap[i] -= w * c.K[j, i]
    s = 0.0
    for i in range(n):
        s += (gap[i] / component_tolerance(c, i, max(abs(c.y.current[i]), abs(at[i])))) ** 2
    return h * sqrt(s / max(n, 1))


STEP_SAFETY = 0.85
STATE_ROUNDING = 1e-14  # relative size of accumulated rounding in a state
ROUNDING_ERROR_CHANGE = (
    0.1  # relative change of an error, when the last digits of the state change, above which it is rounding
)
MAX_ROUNDING_ERROR = 1e-7  # relative error of a step above which it is not accepted as rounding
WIDE_STEP_DECAY = 0.8  # decay of the reference width of wide steps, per narrower step
WIDTH_LIMIT_GROWTH = 0.005  # relative growth of the temporary width limit, times the steps since it was set
ACCEPTED_ROUNDING_ERROR = 10.0  # error from rounding that is accepted before a step is undone


@formula
def reset_rejections(c):
    """Reset the record of rejected steps after an accepted one."""
    c.real.last = c.real.best = UNKNOWN_ERROR
    c.real.accepted_error = 0.0


@formula
def accept_explicit_step(R, c, t, h, error):
    """Make the proposed state the current one, and choose the width of the next step."""
    for i in range(c.y.shape[1]):
        c.y.previous[i] = c.y.current[i]
        c.y.previous_rate[i] = c.K[0, i]
        c.y.current[i] = c.y.proposed[i]
        c.K[0, i] = c.K[R.order_i[1], i]
    for i in range(c.inspection.shape[1]):
        c.inspection[INSPECTED_START, i] = c.inspection[INSPECTED_END, i]
        c.inspection[INSPECTED_START_RATE, i] = c.inspection[INSPECTED_END_RATE, i]
    c.real.before = c.real.t
    if error > c.real.largest_error:
        c.real.largest_error = error
        c.real.largest_error_at = c.real.t
    if c.real.max_growth > 1.0:
        c.real.wide = max(h, WIDE_STEP_DECAY * c.real.wide)
    grow = c.real.max_growth
    c.real.h = h * (min(grow, max(0.2, STEP_SAFETY * error ** (-1.0 / R.order_i[0]))) if error > 0.0 else grow)
    if c.real.interpolation_limit > 0.0:
        c.real.h = min(c.real.h, c.real.interpolation_limit)
        c.real.interpolation_limit *= 1.0 + WIDTH_LIMIT_GROWTH * (
            c.count.accepted + 1 - c.real.interpolation_limit_since
        )
    if c.real.step > 0.0:
        c.real.h = c.real.step
    c.real.t = t
    c.real.max_growth = 6.0
    c.count.accepted += 1
    reset_rejections(c)


@formula
def reject_explicit_step(derivative, arrive, tangent, S, W, R, c, h, status, error):
    """Choose the next try after a step with that status and error; a failed fixed step ends the integration."""
    if c.real.step > 0.0:
        set_rejected_width(c, 0.0)
        return
    if status != 0 or not error < UNKNOWN_ERROR:
        set_rejected_width(c, 0.25 * h)
        return
    set_rejected_width(c, h * max(0.2, STEP_SAFETY * error ** (-1.0 / R.order_i[0])))
    first = c.real.last == UNKNOWN_ERROR
    c.real.last = error
    if error < c.real.best:
        c.real.best = error
        c.real.best_h = h
    if c.real.accepted_error > 0.0:
        if h > c.real.best_h:
            c.real.h = c.real.best_h
        return
    wide = c.real.t - c.real.before > 0.5 * c.real.wide
    small = c.real.best * c.real.rtol < MAX_ROUNDING_ERROR
    back = wide and small and c.real.best > ACCEPTED_ROUNDING_ERROR and c.real.back < c.real.before
    if first or not small or not error_is_rounding(derivative, arrive, tangent, S, W, R, c, h, error):
        return
    c.real.rounding_found_at = c.real.t
    if back:
        undo_last_step(c)
    else:
        c.real.accepted_error = max(ACCEPTED_ROUNDING_ERROR, 2.0 * c.real.best)
        c.real.h = max(c.real.wide, c.real.best_h)


@formula
def undo_last_step(c):
    """Return to the start of the last accepted step, in order to end it elsewhere."""
    c.count.accepted -= 1
    c.real.h = 0.5 * (c.real.t - c.real.before)
    c.real.t = c.real.back = c.real.before
    for i in range(c.y.shape[1]):
        c.y.current[i] = c.y.previous[i]
        c.K[0, i] = c.y.previous_rate[i]
    reset_rejections(c)


@formula
def error_is_rounding(derivative, arrive, tangent, S, W, R, c, h, error):
    """Whether the error of a step is mostly rounding: it changes when the last digits of the state are perturbed."""
    y, kept = c.y.current, c.y.saved
    for i in range(y.shape[0]):
        kept[i] = y[i]
        c.y.saved_rate[i] = c.K[0, i]
        if i < c.count.controlled:
            y[i] += (STATE_ROUNDING if i % 2 == 0 else -STATE_ROUNDING) * max(abs(y[i]), c.y.unit[i])
    status, _ = arrive(c.real.t, y, c.K[0], S, W)
    other = error
    if status == 0:
        status, other = attempt_explicit_step(derivative, arrive, tangent, S, W, R, c, h)
    for i in range(y.shape[0]):
        y[i] = kept[i]
        c.K[0, i] = c.y.saved_rate[i]
    return status != 0 or not abs(other - error) < ROUNDING_ERROR_CHANGE * max(other, error)


STABILITY_LIMITED_FACTOR = (
    4.0  # allowed error of the dense output, relative to that of the step (at least 1), where stability limits the step
)
ACCURACY_LIMITED_FACTOR = 8.0  # the same where accuracy limits the step; reached occasionally
STABILITY_BOUND = 3.5  # h |lambda| above which stability may limit steps
REPEATED_WITHIN = 20  # steps between two failures of interpolation within which later widths are limited
DENSE_STAGES_KNOWN, DENSE_OUTPUT_GOOD = (
    1,
    2,
)  # values of c.count.extended: stages of dense output are evaluated; it is accurate


@formula
def begin_explicit(derivative, inspect, S, W, R, c):
    """Compute the first derivative and the first step width. Returns a status."""
    if derivative(c.real.t, c.y.current, c.K[0], S, W) != 0:
        return STEP_FAILED
    inspect(c.real.t, 0.0, c.real.span, AT_START, c.inspection, S, W)
    for i in range(c.y.shape[1]):
        if not c.K[0, i] - c.K[0, i] == 0.0:
            return NOT_FINITE
    if c.real.h <= 0.0:
        c.real.h = first_step_width(derivative, S, W, R, c)
    c.real.max_growth = 6.0
    c.real.largest_error = 1.0
    c.real.before = c.real.back = c.real.t
    c.real.rounding_found_at = c.real.t - c.real.span
    reset_rejections(c)
    return 0


@formula
def interpolate_explicit(derivative, S, W, R, c):
    """Evaluate the dense output at a part of the step. Returns a status."""
    if c.count.extended == 0 and evaluate_dense_stages(derivative, S, W, R, c, c.real.tried) != 0:
        return 1
    if c.count.extended != DENSE_OUTPUT_GOOD:
        c.count.extended = DENSE_STAGES_KNOWN
        if not dense_output_is_accurate(R, c):
            return 1
        c.count.extended = DENSE_OUTPUT_GOOD
    dense_output(R, c, c.real.part, c.real.tried, c.y.interpolated)
    return 0


@formula
def dense_output_is_accurate(R, c):
    """Whether the dense output is as accurate as steps are. If not, c.real.interpolation_width is a width to try.

    Where stability limits steps, not accuracy, their ends are accurate but the dense output may not be. A step with
    output inside must then be narrower; if this repeats, the next ones too (c.real.interpolation_limit). Elsewhere the
    dense output is wrong by a few tolerances at most, and step widths are unaffected. Steps of fixed width are not
    checked.
    """
    if c.real.step > 0.0:
        return True
    h = c.real.tried
    gap = dense_output_error(R, c, h)
    if gap <= 1.0:
        return True
    limited = stiffness_estimate(R, c, h) > STABILITY_BOUND
    most = (
        max(1.0, STABILITY_LIMITED_FACTOR * c.real.error)
        if limited
        else ACCURACY_LIMITED_FACTOR * max(1.0, c.real.error)
    )
    if gap <= most:
        return True
    c.real.interpolation_width = h * max(0.2, STEP_SAFETY * (gap / most) ** (-1.0 / R.order_i[0]))
    if limited:
        now = c.count.accepted + 1
        if c.real.interpolation_limit_since > 0.0 and 0.0 < now - c.real.interpolation_limit_since <= REPEATED_WITHIN:
            c.real.interpolation_limit = STEP_SAFETY * h
        c.real.interpolation_limit_since = now
    return False


@formula
def missed_change(derivative, inspect, S, W, R, c):
    """Whether laws change significantly within the step without being seen at its stages.

    ``inspect`` names places where a law differs from the values expected from elsewhere in the step. Its effect is the
    residual of the dense output there, times the part of the step for which the deviation lasts. If it lasts for more
    than a step, the formula has switched to another branch and every width fails. Steps of fixed width only check that.
    """
    h = c.real.tried
    inspect(c.real.t, h, c.real.span, AT_END, c.inspection, S, W)
    k, x, share = inspect(c.real.t, h, c.real.span, 0, c.inspection, S, W)
    if k > 0 and c.count.extended == 0:
        if evaluate_dense_stages(derivative, S, W, R, c, h) != 0:
            return 1
        c.count.extended = DENSE_STAGES_KNOWN
    while k > 0:
        if share > 1.0:
            return 1
        if c.real.step == 0.0 and not equation_defect(derivative, S, W, R, c, h, x) * share <= 1.0:
            return 1
        k, x, share = inspect(c.real.t, h, c.real.span, k, c.inspection, S, W)
    return 0


@formula
def run_explicit_task(functions, S, W, R, c, task):
    """Perform a task of the `time_loop`; ``functions`` are derivative, arrive, tangent, inspect."""
    derivative, arrive, tangent, inspect = functions
    if task == TRY_STEP:
        c.count.extended = 0
        status, c.real.error = attempt_explicit_step(derivative, arrive, tangent, S, W, R, c, c.real.tried)
        return status
    if task == INTERPOLATE:
        return interpolate_explicit(derivative, S, W, R, c)
    if task == ACCEPT_STEP:
        accept_explicit_step(R, c, step_end_time(c), c.real.tried, c.real.error)
        return 0
    if task == REJECT_STEP:
        reject_explicit_step(derivative, arrive, tangent, S, W, R, c, c.real.tried, c.count.step_status, c.real.error)
        return 0
    if task == CHECK_MISSED_CHANGE:
        return missed_change(derivative, inspect, S, W, R, c)
    if task == INSPECT_END:
        inspect(c.real.t, c.real.tried, c.real.span, AT_END, c.inspection, S, W)
        return 0
    if task == BEGIN_SEGMENT:
        return begin_explicit(derivative, inspect, S, W, R, c)
    return 0
