"""Forces or impulses of stops, friction and other switches at an instant, as a small complementarity problem.

With all of them off, the motion continues with velocities v and accelerations a. A force along row i changes the
accelerations by the response Y_i and the multipliers of all other rows by L_i. So u = A x + b, A = D Y, b = D a + bias
(of impulses: b = D v). The limit of a friction follows from its own law, evaluated with the load that these multipliers
give; loads that depend on x are found together with it, with the law linearised at each iteration (Newton's method).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..compiler.formulas import call, formula
from ..compiler.kernels import kernel
from ..compiler.struct_layout import Float1, Float2, Int1
from ..math.scalar import magnitude, sqrt
from ..numerics.complementarity.dense_problem import NO_SOLUTION, OUTCOME, SOLUTION_FOUND, DenseProblem
from ..numerics.complementarity.dense_solver import solve_dense
from ..numerics.integrators.butcher_tableaux import Tableau
from ..numerics.integrators.time_loop import StepState
from ..tables.table_definitions import System, Work
from .calls import MOTION, SOLVE, OutputBuffer
from .element_dispatch import effort, force_kind
from .loads import force_law, force_row, reaction_loads

IMPULSES, TRIES = range(2)  # entries of ModeProblem.asks: meaning of x; number of solves
FORCES, SUDDEN_IMPULSES, STEP_IMPULSES = range(
    3
)  # meaning of x: forces, instantaneous impulses, or impulses over a short time step
MAX_NEWTON = 20  # Newton iterations in a row
# relaxed iterations where Newton's method fails: first number, and largest; doubled each time
FIRST_RELAXED, MAX_RELAXED = 10, 1000
IMPULSE_TOLERANCE = 1e-13  # relative to the largest impulse, or to the one that would stop the motion
RELAXATION = 0.2  # fraction of a full step
IMPULSE_STEP = 1e-6  # relative step of an impulse for the derivative of the loads
TERM_ROUNDING = 1e-13  # rounding of a quantity's acceleration, relative to its terms
UNBOUNDED_REACH = 1e30  # larger than any impulse
LARGE_LOAD = 1e8  # factor on a load, beside which the load-independent part of friction is negligible


FREE_MOTION, SOLVE_MODES, RESUME_SOLVE, STORE_RATES = range(4)  # tasks of `mode_kernel`
RATE_ROUNDING = 1e-11  # rounding of a rate, relative to its terms
VELOCITY_ROUNDING = 1e-14  # rounding of a rate, relative to the fastest velocity, whatever the terms


class EngineCall(NamedTuple):
    """Arguments of a call of the engine."""

    address: Int1  # (1,): of the engine
    R: Tableau
    clock: StepState  # time, and state in its first row
    output: OutputBuffer


class ModeProblem(NamedTuple):
    """Rows of the small problem, their switches, and the response of the mechanism to each."""

    which: Int1  # (n,): switch of each row
    sign: Float1  # (n,): +1, or -1 where the row is reversed, as for a force on an upper bound
    way: Float1  # (n,): friction mode: STATIC, or the direction of sliding; 0: the limit is fixed in the problem
    rate: Float1  # (n,): rate at which it slides
    Y: Float2  # (n, nv): accelerations due to a unit force
    L: Float2  # (n, nr): multipliers
    E: Float2  # (n, nv): efforts of prescribed coordinates
    free: Float1  # (nv,): accelerations with everything off
    loaded: Float1  # (nr,): multipliers with everything off, or of the impulses before
    asks: Int1  # (2,)
    step: Float1  # (1,): the time step
    previous: Float1  # (n,): impulses of the previous iteration
    now: Float1  # (n,): friction limits at them


def empty_mode_problem(n: int, nv: int, nr: int) -> ModeProblem:
    """Zeroed problem of n rows."""
    z = np.zeros
    i = np.int64
    return ModeProblem(
        z(n, i), z(n), z(n), z(n), z((n, nv)), z((n, nr)), z((n, nv)), z(nv), z(nr), z(2, i), z(1), z(n), z(n)
    )


@formula
def store_free_motion(address, S, W, R, clock, output, B, P):
    """Compute the motion with everything off and the response of every row: A, b of the problem. Returns a status."""
    status = call(address, S, W, R, clock, output, MOTION)
    for d in range(W.velocities.solved.shape[0]):
        B.free[d] = W.velocities.solved[d]
    for k in range(S.rows.law.shape[0]):
        B.loaded[k] = W.rows.multiplier[k]
    if status != 0:
        return status
    for i in range(B.which.shape[0]):
        store_row_response(address, S, W, R, clock, output, B, i)
    for i in range(B.which.shape[0]):
        m = S.switches.measured[B.which[i]]
        size = magnitude(W.sensed.bias[m])
        P.b[i] = B.sign[i] * (W.sensed.bias[m] + gradient_times(S, W, m, B.free))
        r = S.rows.law.shape[0] + m
        for e in range(S.row_start[r], S.row_start[r + 1]):
            size += magnitude(W.G[e] * B.free[S.column[e]])
        P.grain[i] = TERM_ROUNDING * size
        for j in range(B.which.shape[0]):
            P.A[i, j] = B.sign[i] * gradient_times(S, W, m, B.Y[j])
    for i in range(B.which.shape[0]):  # symmetric except for rounding
        for j in range(i):
            P.A[i, j] = P.A[j, i] = 0.5 * (P.A[i, j] + P.A[j, i])
    return 0


@formula
def gradient_times(S, W, m, a):
    """Gradient of measured quantity m times a."""
    s = 0.0
    r = S.rows.law.shape[0] + m
    for e in range(S.row_start[r], S.row_start[r + 1]):
        s += W.G[e] * a[S.column[e]]
    return s


@formula
def store_row_response(address, S, W, R, clock, output, B, i):
    """Response of row i."""
    nv, nr = W.velocities.solved.shape[0], S.rows.law.shape[0]
    out = output.rows
    for d in range(out.shape[1]):
        out[0, d] = out[1, d] = 0.0
    r = nr + S.switches.measured[B.which[i]]
    for e in range(S.row_start[r], S.row_start[r + 1]):
        out[0, S.column[e]] += B.sign[i] * W.G[e]
    call(address, S, W, R, clock, output, SOLVE)
    for d in range(nv):
        B.Y[i, d], B.E[i, d] = out[2, d], W.velocities.effort[d]
    for k in range(nr):
        B.L[i, k] = out[3, k]


@formula
def friction_reach(S, W, t, B, i, load):
    """Limit of the friction of row i under a load, or its sliding force; for impulses only the part due to the load."""
    k = S.switches.force[B.which[i]]
    x = W.sensed.value[S.forces.F[k]]
    first = force_law(S, W, k, 0, (t, x, B.rate[i]))
    kind, par = force_kind(S, k), force_row(S.force_parameters, k)
    if B.asks[IMPULSES] == STEP_IMPULSES:
        load = load / B.step[0]
    elif B.asks[IMPULSES] != 0:
        most = effort(kind, par, x, B.rate[i], (first, 0.0, B.way[i]), LARGE_LOAD * load)
        return magnitude(most - effort(kind, par, x, B.rate[i], (first, 0.0, B.way[i]), 0.0)) / LARGE_LOAD
    most = effort(kind, par, x, B.rate[i], (first, 0.0, B.way[i]), load)
    reach = magnitude(most - effort(kind, par, x, B.rate[i], (first, 0.0, 0.0), load))
    return reach * B.step[0] if B.asks[IMPULSES] == STEP_IMPULSES else reach


@formula
def friction_load(S, W, i, B):
    """Load of row i's friction from the multipliers in W; 0 if none."""
    k = S.switches.force[B.which[i]]
    n = S.forces.load[k]
    return W.sensed.returned[n] if n >= 0 else 0.0


@formula
def update_multipliers(S, W, B, P, j, more):
    """Multipliers of all rows under the impulses of P, with ``more`` added to that of row j."""
    for k in range(S.rows.law.shape[0]):
        s = B.loaded[k]
        for i in range(B.which.shape[0]):
            s += (P.x[i] + (more if i == j else 0.0)) * B.L[i, k]
        W.rows.multiplier[k] = s
    reaction_loads(S, W)


@formula
def impulse_step(B, P, j):
    """Impulse of row j that is small relative to the size of all."""
    size = 0.0
    for i in range(B.which.shape[0]):
        d = root_diagonal(P, i)
        size = max(size, magnitude(P.x[i]) * d, magnitude(P.b[i]) / d)
    return IMPULSE_STEP * size / root_diagonal(P, j)


@formula
def root_diagonal(P, i):
    """Square root of A's diagonal entry, which scales impulses of different units; 1 where nothing moves."""
    return sqrt(P.A[i, i]) if P.A[i, i] > 0.0 else 1.0


@formula
def update_friction_reaches(S, W, t, B, P):
    """Friction limits at the impulses of P, and their derivatives. Returns whether some limit depends on them."""
    n, follows = B.which.shape[0], False
    update_multipliers(S, W, B, P, -1, 0.0)
    for i in range(n):
        if B.way[i] != 0.0:
            P.const[i] = friction_reach(S, W, t, B, i, friction_load(S, W, i, B))
            for j in range(n):
                P.gain[i, j] = 0.0
            follows = follows or S.forces.load[S.switches.force[B.which[i]]] >= 0
    if not follows:
        return False
    for i in range(n):
        B.now[i] = P.const[i]
    for j in range(n):
        step = impulse_step(B, P, j)
        if step > 0.0:
            update_multipliers(S, W, B, P, j, step)
            for i in range(n):
                if B.way[i] != 0.0:
                    P.gain[i, j] = (friction_reach(S, W, t, B, i, friction_load(S, W, i, B)) - B.now[i]) / step
                    P.const[i] -= P.gain[i, j] * P.x[j]
    return True


@formula
def solve_mode_problem(S, W, t, B, P):
    """Solve the problem together with the friction limits that depend on its loads. The outcome is in ``P.info``.

    Newton's method, which from zero loads leads to the smallest of several solutions. Where one of its steps has no
    solution, or it cycles, relaxed fixed-point iterations follow, and Newton's method is tried again from there.
    """
    n, loads = B.which.shape[0], False
    for i in range(n):
        P.x[i] = 0.0
        loads = loads or (B.way[i] != 0.0 and S.forces.load[S.switches.force[B.which[i]]] >= 0)
    if loads and B.asks[IMPULSES] != FORCES:  # loads have no slope at zero impulses: start with unbounded friction
        for i in range(n):
            if B.way[i] != 0.0:
                P.const[i] = UNBOUNDED_REACH
        solve_dense(P)
    steps, many = 0, FIRST_RELAXED
    while many <= MAX_RELAXED:
        B.asks[TRIES] += 1
        follows = update_friction_reaches(S, W, t, B, P)
        for i in range(n):
            B.previous[i] = P.x[i]
        solve_dense(P)
        steps += 1
        if follows and (P.info[OUTCOME] == NO_SOLUTION or steps > MAX_NEWTON):
            for _ in range(many):
                relax_impulses(S, W, t, B, P)
            steps, many = 0, 2 * many
            continue
        if not follows or P.info[OUTCOME] != SOLUTION_FOUND:
            return
        change, size, least = 0.0, 0.0, 0.0
        for i in range(n):
            s = root_diagonal(P, i)
            least = max(least, P.grain[i] / s)
            change = max(change, s * magnitude(P.x[i] - B.previous[i]))
            size = max(size, s * magnitude(P.x[i]), magnitude(P.b[i]) / s)
        if change <= IMPULSE_TOLERANCE * size + least:
            return
    P.info[OUTCOME] = NO_SOLUTION


@formula
def relax_impulses(S, W, t, B, P):
    """Move part of the way to the impulses at the present friction limits (Krasnoselskii's iteration, 1955).

    With given limits the problem has a solution, whatever the friction.
    """
    update_multipliers(S, W, B, P, -1, 0.0)
    for i in range(B.which.shape[0]):
        B.previous[i] = P.x[i]
        if B.way[i] != 0.0:
            P.const[i] = friction_reach(S, W, t, B, i, friction_load(S, W, i, B))
            for j in range(B.which.shape[0]):
                P.gain[i, j] = 0.0
    solve_dense(P)
    for i in range(B.which.shape[0]):
        P.x[i] = B.previous[i] + RELAXATION * (P.x[i] - B.previous[i])


@formula
def store_switch_rates(S, W, y, B):
    """Store value, rate, and rounding of the rate, of the quantities of B's switches in ``now``, ``rate``, ``seen``."""
    nq, most = S.sizes.coordinates, 0.0
    for d in range(W.velocities.solved.shape[0]):
        most = max(most, magnitude(y[nq + d]) / S.velocity_units[d])
    for i in range(B.which.shape[0]):
        m = S.switches.measured[B.which[i]]
        B.now[i] = B.rate[i] = B.previous[i] = 0.0
        if m >= 0:
            B.now[i], B.rate[i] = W.sensed.value[m], W.sensed.rate[m]
            r = S.rows.law.shape[0] + m
            for e in range(S.row_start[r], S.row_start[r + 1]):
                d = S.column[e]
                rounding = RATE_ROUNDING * magnitude(y[nq + d]) + VELOCITY_ROUNDING * most * S.velocity_units[d]
                B.previous[i] += magnitude(W.G[e]) * rounding


@kernel
def mode_kernel(S: System, W: Work, engine_call: EngineCall, B: ModeProblem, P: DenseProblem, task: int) -> int:
    """Run a task: FREE_MOTION, SOLVE_MODES, RESUME_SOLVE (P from the states in it), STORE_RATES."""
    if task == SOLVE_MODES:
        solve_mode_problem(S, W, engine_call.clock.real.t, B, P)
        return P.info[OUTCOME]
    if task == RESUME_SOLVE:
        solve_dense(P)
        return P.info[OUTCOME]
    address = engine_call.address[0]
    if task == FREE_MOTION:
        return store_free_motion(address, S, W, engine_call.R, engine_call.clock, engine_call.output, B, P)
    status = call(address, S, W, engine_call.R, engine_call.clock, engine_call.output, MOTION)
    store_switch_rates(S, W, engine_call.clock.y.current, B)
    return status
