"""Tasks of the `time_loop` for implicit methods of the equations of motion, and parts shared by fixed-step methods.

A method is ``attempt(callbacks, S, K, c, h)`` (the step to c.y.proposed and c.K[1]: status, error, suggested
change), ``between(K, x, h, d, v, z)`` (increments, velocities, integrals within it), ``enter(K, c, t, h, error,
asked)`` (accepts it) and ``refuse(K, c)`` (chooses the next try). Its callbacks are ``residual`` (see
`radau_stages`); ``linearise(t, k, S, K, c)``, which fills row k of the Jacobian entries at stage k, or at the start
of the step; ``compose(y, d, v, z, out, S)``, which forms a state from increments; ``arrive`` (which writes the
multipliers to ``K.found``) and ``inspect``.

Methods of order 2 interpolate within a step by cubics through the values and rates at its ends. Rows STEP_START
and END_ROW of ``v``, ``z``, ``rate`` hold the values, ``d`` the increments at the end, ``ends`` the
accelerations at both ends, ``turns`` the first of three components of each increment that is a rotation. These
increments are Cayley vectors, axis times 2 tan(angle / 2), which polynomials approximate badly for large angles. A
rotation is therefore interpolated by a rotation at the mean of the angular velocities of its ends, followed by a cubic
for the small remainder. Steady rotations are exact, including full revolutions.
"""

from __future__ import annotations

from ...compiler.formulas import formula
from ...math.rotation import cayley_quaternion, cayley_rate, cayley_step, rotation_change
from ...math.scalar import cos, sin, sqrt
from ...math.vec import add, dot, quaternion_product, scale, sub
from .explicit_runge_kutta import reset_rejections
from .implicit_workspace import STEP_START
from .radau_stages import radau_defect
from .time_loop import (
    ACCEPT_STEP,
    AT_END,
    AT_START,
    BEGIN_SEGMENT,
    CHECK_MISSED_CHANGE,
    FORCES_JUMPED,
    INSPECT_END,
    INTERPOLATE,
    NOT_FINITE,
    REJECT_STEP,
    STEP_FAILED,
    TRY_STEP,
    set_rejected_width,
    step_end_time,
)

MIN_STEP_FRACTION = 1e-3  # part of the fixed step below which no width is tried
NOT_REJECTED = 6.0  # value of max_growth that marks that the last step was not rejected


@formula
def integrate_by_trapezoids(c, h):
    """Compute integrals over the motion at the end of the step by the trapezoidal rule."""
    for n in range(c.integrals.shape[0]):
        i = c.integrals[n]
        c.y.proposed[i] = c.y.current[i] + 0.5 * h * (c.K[0, i] + c.K[1, i])


@formula
def accept_fixed_step(c, t):
    """Make the end of the step the current state."""
    for i in range(c.y.shape[1]):
        c.y.current[i] = c.y.proposed[i]
        c.K[0, i] = c.K[1, i]
    c.real.h = c.real.step
    c.real.t = t
    c.real.max_growth = NOT_REJECTED
    c.count.accepted += 1


@formula
def halve_fixed_step(K, c):
    """Halve the width if slopes of laws may be infinite. Returns 0, or 1 if there is no width to try."""
    h = 0.5 * c.real.tried
    if K.count.infinite_slopes == 0 or h < MIN_STEP_FRACTION * c.real.step:
        return 1
    set_rejected_width(c, h)
    K.count.fresh = -1
    return 0


END_ROW = 2  # row of the end of a step
START_ACCELERATION, END_ACCELERATION = range(2)  # rows of ends
SMALL_HALF_ANGLE = 1e-4  # half rotation angle [rad] below which the sine is replaced by its series


@formula
def interpolate_hermite(K, x, h, d, v, z):
    """Interpolate increments, velocities and integrals at t + x h.

    A constant quantity is returned exactly, to the last digit; the position on an outline decides on the edge.
    """
    y = 1.0 - x
    out, end, back = h * x * y * y, x * x * (3.0 - 2.0 * x), -h * x * x * y
    for i in range(d.shape[0]):
        v0 = K.v[STEP_START, i]
        d[i] = out * v0 + end * K.d[END_ROW, i] + back * K.v[END_ROW, i]
        v[i] = (
            v0 + out * K.ends[START_ACCELERATION, i] + end * (K.v[END_ROW, i] - v0) + back * K.ends[END_ACCELERATION, i]
        )
    for n in range(K.turns.shape[0]):
        interpolate_rotation(K, x, h, d, K.turns[n])
    for i in range(z.shape[0]):
        z0 = K.z[STEP_START, i]
        z[i] = z0 + out * K.rate[STEP_START, i] + end * (K.z[END_ROW, i] - z0) + back * K.rate[END_ROW, i]


@formula
def interpolate_rotation(K, x, h, d, i):
    """Interpolate the rotation whose components begin at i, at t + x h.

    It is exp(x h w) cay(c): w is the mean angular velocity, and c goes from zero at the start to the remainder at the
    end. The rates of c follow from the differences of the angular velocities: w0 - w at the start, w1 - R(c)^T w at the
    end.
    """
    first = (K.v[STEP_START, i], K.v[STEP_START, i + 1], K.v[STEP_START, i + 2])
    last = (K.v[END_ROW, i], K.v[END_ROW, i + 1], K.v[END_ROW, i + 2])
    mean = scale(0.5, add(first, last))
    left = cayley_step(
        quaternion_product(
            rotation_quaternion(mean, -h),
            cayley_quaternion((K.d[END_ROW, i], K.d[END_ROW, i + 1], K.d[END_ROW, i + 2])),
        )
    )
    left_rate = cayley_rate(left, sub(sub(last, mean), rotation_change(left, mean)))
    y = 1.0 - x
    c = add(scale(h * x * y * y, sub(first, mean)), scale(-h * x * x * y, left_rate))
    c = add(c, scale(x * x * (3.0 - 2.0 * x), left))
    there = cayley_step(quaternion_product(rotation_quaternion(mean, x * h), cayley_quaternion(c)))
    for k in range(3):
        d[i + k] = there[k]


@formula
def rotation_quaternion(w, time):
    """Quaternion of a rotation at a constant angular velocity for a time."""
    half = 0.5 * time * sqrt(dot(w, w))
    by = sin(half) / half if abs(half) > SMALL_HALF_ANGLE else 1.0 - half * half / 6.0
    e = scale(0.5 * time * by, w)
    return (cos(half), e[0], e[1], e[2])


REUSE_RATE = 1e-3  # contraction ratio below which the Jacobian is reused
MAX_WIDTH_GROWTH = 8.0  # largest factor by which the width changes
FIRST_STEP_FRACTION = 1e-4  # first step, as a part of the time span
MAX_START_CORRECTION = 1e-5  # relative correction of the initial state by its projection above which the start fails


@formula
def begin_implicit(arrive, inspect, S, K, c):
    """Project the state at the start of a segment on its constraints, and evaluate its derivative. Returns a status.

    If only forces have jumped (`FORCES_JUMPED`), the Jacobian and its factors are reused, as between steps.
    """
    y = c.y.proposed
    for i in range(y.shape[0]):
        y[i] = c.y.current[i]
    status, moved = arrive(c.real.t, y, c.K[0], S, K)
    if status != 0 or moved > MAX_START_CORRECTION:
        return STEP_FAILED
    for i in range(y.shape[0]):
        c.y.current[i] = y[i]
        if not c.K[0, i] - c.K[0, i] == 0.0:
            return NOT_FINITE
    inspect(c.real.t, 0.0, c.real.span, AT_START, c.inspection, S, K)
    for i in range(K.found.shape[0]):
        K.lam[STEP_START, i] = K.found[i]
    K.count.before = 0
    K.real.last_error = 0.0
    c.real.max_growth = MAX_WIDTH_GROWTH
    if c.count.started != FORCES_JUMPED:
        K.count.fresh = 0
        K.real.width = 0.0
        K.real.rate, K.real.theta = 1.0, REUSE_RATE
        c.real.largest_error = 1.0
        c.real.wide = 0.0  # previous steps do not show which width is narrow now
    c.real.before = c.real.t
    c.real.rounding_found_at = c.real.back = c.real.t - c.real.span
    if c.real.h <= 0.0:
        c.real.h = FIRST_STEP_FRACTION * c.real.span
    reset_rejections(c)
    return 0


@formula
def missed_implicit_change(residual, inspect, S, K, c):
    """Whether laws change within the step without being seen at its stages; as `explicit_runge_kutta.missed_change`."""
    h = c.real.tried
    inspect(c.real.t, h, c.real.span, AT_END, c.inspection, S, K)
    k, x, share = inspect(c.real.t, h, c.real.span, 0, c.inspection, S, K)
    while k > 0:
        if share > 1.0:
            return 1
        if c.real.step == 0.0 and not radau_defect(residual, S, K, c, h, x) * share <= 1.0:
            return 1
        k, x, share = inspect(c.real.t, h, c.real.span, k, c.inspection, S, K)
    return 0


@formula
def restore_start_rates(K, c):
    """Restore the rates of integrals at the start of the step, which other evaluations may have overwritten."""
    at = c.y.shape[1] - K.z.shape[1]
    for i in range(K.z.shape[1]):
        K.rate[STEP_START, i] = c.K[0, at + i]


@formula
def interpolate_implicit(between, compose, S, K, c):
    """Interpolate the state at a part of the step."""
    z = c.y.saved[: K.z.shape[1]]
    restore_start_rates(K, c)
    between(K, c.real.part, c.real.tried, K.d[STEP_START], K.a[STEP_START], z)
    compose(c.y.current, K.d[STEP_START], K.a[STEP_START], z, c.y.interpolated, S)
    c.count.extended = 1
    return 0


@formula
def run_implicit_task(method, callbacks, S, K, c, task):
    """Perform a task of the `time_loop`."""
    attempt, between, enter, refuse = method
    residual, compose, arrive, inspect = callbacks[0], callbacks[2], callbacks[3], callbacks[4]
    if task == TRY_STEP:
        c.count.extended = 0
        status, c.real.error, K.real.result = attempt(callbacks, S, K, c, c.real.tried)
        return status
    if task == INTERPOLATE:
        return interpolate_implicit(between, compose, S, K, c)
    if task == ACCEPT_STEP:
        c.real.before = c.real.t
        enter(K, c, step_end_time(c), c.real.tried, c.real.error, K.real.result)
        return 0
    if task == REJECT_STEP:
        return refuse(K, c)
    if task == CHECK_MISSED_CHANGE:
        return missed_implicit_change(residual, inspect, S, K, c)
    if task == INSPECT_END:
        inspect(c.real.t, c.real.tried, c.real.span, AT_END, c.inspection, S, K)
        return 0
    if task == BEGIN_SEGMENT:
        return begin_implicit(arrive, inspect, S, K, c)
    return 0
