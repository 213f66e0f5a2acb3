"""A variational (symplectic) integrator on Lie groups with constraints, of order 2, at fixed steps.

The discrete Lagrangian h l(d / h) - h (V(q0) + V(q1)) / 2 of increments d, q1 = q0 (+) d, with forces by
Lagrange and d'Alembert (Marsden and West 2001; of rotations: Lee, Leok and McClamroch 2007; Kobilarov and
Marsden 2011), and velocities on the constraints at the ends of steps, as in RATTLE (Andersen 1983; Reich 1996):

    p0 + h/2 (f0 + G0^T lam) = T(d)^-T M d / h,  p1- = T(-d)^-T M d / h,  g(t1, q1) = 0
    M v1 = p1- + h/2 (f1 + G1^T lam'),  G1 v1 = nu1

It is for very long motions: it is symplectic, it conserves the momenta that belong to symmetries, and its energy
error stays bounded. Forces that depend on velocities are iterated. Callbacks: compose, arrive, inspect as for
`implicit_method`, and

    weigh(v, p, S), speed(p, v, S)  momenta from velocities, and velocities from momenta
    fly(p, h, d, p1, S) -> status   free motion with momenta p, and the momenta on arrival
    push(t, y, lam, f, S)           forces
    place(t, y, g, S) -> worst      position residuals, and the largest of them
    relax(g, lam, S)                multipliers of an impulse along the rows that removes g in a unit of time
    pull(rows, lam, by, p, S)       adds by G^T lam to momenta
    rows_to(rows, S)                stores G as last evaluated
"""

from __future__ import annotations

from ...compiler.formulas import formula
from .implicit_method import (
    END_ACCELERATION,
    END_ROW,
    START_ACCELERATION,
    begin_implicit,
    integrate_by_trapezoids,
    interpolate_hermite,
    interpolate_implicit,
)
from .implicit_method import accept_fixed_step as enter_step
from .implicit_workspace import STEP_START
from .time_loop import (
    ACCEPT_STEP,
    AT_END,
    BEGIN_SEGMENT,
    CHECK_MISSED_CHANGE,
    INSPECT_END,
    INTERPOLATE,
    REJECT_STEP,
    TRY_STEP,
    step_end_time,
)

FREE_MOMENTA, ARRIVAL_MOMENTA, START_MOMENTA, END_MOMENTA = range(4)  # rows of p
AT_STEP_START, AT_STEP_END, TRIAL_FORCES = range(3)  # rows of f; of rows: the first two
MAX_ITERATIONS = 30  # of each iteration
CONVERGED_CHANGE = 4e-15  # change of forces, relative to the momenta, below which the iteration has converged
ROUNDING_CHANGE = 1e-9  # the same, below which a change that stops decreasing is rounding
STALL_RATIO = 0.7  # ratio of successive violations above which the iteration is stopped by rounding
POSITIONS_FAILED, FORCES_FAILED = 1, 2


@formula
def prepare_start(callbacks, S, K, c):
    """Evaluate forces and constraint rows at the start of a segment."""
    weigh, push, rows_to = callbacks[3], callbacks[6], callbacks[10]
    weigh(K.v[STEP_START], K.p[START_MOMENTA], S)
    push(c.real.t, c.y.current, K.lam[STEP_START], K.f[AT_STEP_START], S)
    rows_to(K.rows[AT_STEP_START], S)


@formula
def attempt_variational_step(callbacks, S, K, c, h):
    """Try one step of width h to c.y.proposed, with derivatives there in c.K[1]. Returns a status."""
    nv, nz = K.v.shape[1], K.z.shape[1]
    at = c.y.shape[1] - nz - nv
    for i in range(nv):
        K.v[STEP_START, i] = c.y.current[at + i]
    if K.count.before == 0:
        prepare_start(callbacks, S, K, c)
    for i in range(nz):
        K.z[STEP_START, i], K.rate[STEP_START, i] = c.y.current[at + nv + i], c.K[0, at + nv + i]
        K.z[END_ROW, i] = K.z[STEP_START, i] + h * K.rate[STEP_START, i]
    status = solve_positions(callbacks, S, K, c, h)
    if status == 0:
        status = solve_velocities(callbacks, S, K, c, h)
    if status != 0:
        return status
    integrate_by_trapezoids(c, h)
    store_end_rates(K, c, 1)
    for i in range(nz):
        K.z[END_ROW, i] = c.y.proposed[at + nv + i]
    return 0


@formula
def store_end_rates(K, c, end):
    """Store rates for interpolation: velocities in c.y.proposed, rates in rows 0 and ``end`` of c.K."""
    nv, nz = K.v.shape[1], K.z.shape[1]
    at = c.y.shape[1] - nz - nv
    for i in range(nv):
        K.v[END_ROW, i] = c.y.proposed[at + i]
        K.ends[START_ACCELERATION, i], K.ends[END_ACCELERATION, i] = c.K[0, at + i], c.K[end, at + i]
    for i in range(nz):
        K.rate[STEP_START, i], K.rate[END_ROW, i] = c.K[0, at + nv + i], c.K[end, at + nv + i]


@formula
def solve_positions(callbacks, S, K, c, h):
    """Find positions at the end of the step that satisfy the constraints, and the momenta there. Returns a status."""
    compose, fly = callbacks[0], callbacks[5]
    place, relax, pull = callbacks[7], callbacks[8], callbacks[9]
    nr = K.lam.shape[1]
    for i in range(K.v.shape[1]):
        K.p[FREE_MOMENTA, i] = K.p[START_MOMENTA, i] + 0.5 * h * K.f[AT_STEP_START, i]
    pull(K.rows[AT_STEP_START], K.lam[STEP_START], 0.5 * h, K.p[FREE_MOMENTA], S)
    last = 1e300
    for n in range(MAX_ITERATIONS):
        if fly(K.p[FREE_MOMENTA], h, K.d[END_ROW], K.p[ARRIVAL_MOMENTA], S) != 0:
            return POSITIONS_FAILED
        compose(c.y.current, K.d[END_ROW], K.v[STEP_START], K.z[END_ROW], c.y.proposed, S)
        if nr == 0:
            return 0
        worst = place(c.real.t + h, c.y.proposed, K.g, S)
        if worst <= K.real.newton or (worst > STALL_RATIO * last and worst <= K.real.rounding_size):
            return 0
        if not worst < 1e3:
            return POSITIONS_FAILED
        at = n % K.steps.shape[0]
        relax(K.g, K.steps[at], S)
        if not broyden_step(K.steps, at):
            return POSITIONS_FAILED
        pull(K.rows[AT_STEP_START], K.steps[at], 1.0 / h, K.p[FREE_MOMENTA], S)
        K.count.iterations += 1
        last = worst
    return POSITIONS_FAILED


@formula
def broyden_step(steps, n):
    """Turn the step of a simple iteration in row n into Broyden's, using those before (Kelley 1995, algorithm brsol).

    The simple iteration uses the constraint rows of the step's start, which rotate until its end, most of all when a
    body spins. Returns whether the step exists.
    """
    z = steps[n]
    nr = z.shape[0]
    for j in range(n):
        s = steps[j]
        size = along = 0.0
        for r in range(nr):
            size += s[r] * s[r]
            along += s[r] * z[r]
        if not size > 0.0:
            return False
        if j == n - 1:
            by = 1.0 / (1.0 - along / size)
            for r in range(nr):
                z[r] *= by
        else:
            for r in range(nr):
                z[r] += steps[j + 1, r] * along / size
    return True


@formula
def solve_velocities(callbacks, S, K, c, h):
    """Find the velocities at the end of the step, with forces that may depend on them. Returns a status."""
    arrive, weigh, speed, push, rows_to = callbacks[1], callbacks[3], callbacks[4], callbacks[6], callbacks[10]
    nv = K.v.shape[1]
    at = c.y.shape[1] - K.z.shape[1] - nv
    speed(K.p[ARRIVAL_MOMENTA], c.y.proposed[at : at + nv], S)
    push(c.real.t + h, c.y.proposed, K.lam[STEP_START], K.f[TRIAL_FORCES], S)
    last = 1e300
    for n in range(MAX_ITERATIONS):
        size = 0.0
        for i in range(nv):
            K.p[FREE_MOMENTA, i] = K.p[ARRIVAL_MOMENTA, i] + 0.5 * h * K.f[TRIAL_FORCES, i]
            size = max(size, abs(K.p[FREE_MOMENTA, i]), 0.5 * h * abs(K.f[TRIAL_FORCES, i]))
        speed(K.p[FREE_MOMENTA], c.y.proposed[at : at + nv], S)
        store_end_rates(K, c, 0 if n == 0 else 1)
        status, _ = arrive(c.real.t + h, c.y.proposed, c.K[1], S, K)
        if status != 0:
            return status
        push(c.real.t + h, c.y.proposed, K.found, K.f[AT_STEP_END], S)
        change = 0.0
        for i in range(nv):
            x = 0.5 * h * abs(K.f[AT_STEP_END, i] - K.f[TRIAL_FORCES, i])
            if not x <= change:
                change = x
        if change <= CONVERGED_CHANGE * size or (change > STALL_RATIO * last and change <= ROUNDING_CHANGE * size):
            rows_to(K.rows[AT_STEP_END], S)
            for i in range(nv):  # momenta are carried on; only the constraints' change is converted, to limit rounding
                K.p[ARRIVAL_MOMENTA, i] = c.y.proposed[at + i] - K.v[END_ROW, i]
            weigh(K.p[ARRIVAL_MOMENTA], K.p[END_MOMENTA], S)
            for i in range(nv):
                K.p[END_MOMENTA, i] += K.p[FREE_MOMENTA, i]
            return 0
        if not change < 1e300:
            return FORCES_FAILED
        at_once = n % K.pushes.shape[0]
        for i in range(nv):
            K.pushes[at_once, i] = K.f[AT_STEP_END, i] - K.f[TRIAL_FORCES, i]
        if not broyden_step(K.pushes, at_once):
            return FORCES_FAILED
        for i in range(nv):
            K.f[TRIAL_FORCES, i] += K.pushes[at_once, i]
        last = change
    return FORCES_FAILED


@formula
def accept_variational_step(K, c):
    """Make the end of the step the current state, and store what the next step needs."""
    for i in range(K.v.shape[1]):
        K.f[AT_STEP_START, i] = K.f[AT_STEP_END, i]
        K.p[START_MOMENTA, i] = K.p[END_MOMENTA, i]
    for e in range(K.rows.shape[1]):
        K.rows[AT_STEP_START, e] = K.rows[AT_STEP_END, e]
    for r in range(K.lam.shape[1]):
        K.lam[STEP_START, r] = K.found[r]
    K.count.before = 1
    c.real.before = c.real.t
    enter_step(c, step_end_time(c))


@formula
def run_variational_task(callbacks, S, K, c, task):
    """Perform a task of the `time_loop`, as `implicit_method.run_implicit_task`."""
    compose, arrive, inspect = callbacks[0], callbacks[1], callbacks[2]
    if task == TRY_STEP:
        c.count.extended, c.real.error = 0, 0.0
        return attempt_variational_step(callbacks, S, K, c, c.real.tried)
    if task == INTERPOLATE:
        return interpolate_implicit(interpolate_hermite, compose, S, K, c)
    if task == ACCEPT_STEP:
        accept_variational_step(K, c)
        return 0
    if task == REJECT_STEP:
        return 1
    if task == CHECK_MISSED_CHANGE or task == INSPECT_END:
        inspect(c.real.t, c.real.tried, c.real.span, AT_END, c.inspection, S, K)
        return 0
    if task == BEGIN_SEGMENT:
        return begin_implicit(arrive, inspect, S, K, c)
    return 0
