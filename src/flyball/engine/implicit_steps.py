"""Steps of implicit methods, called by address: stage residuals, Jacobians, ends of steps.

Stage residuals are the engine's own; Jacobians come from the same formulas by complex steps (`stage_residual`). Ends of
steps and rows of output are projected and solved as in explicit methods.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..compiler.formulas import call, formula
from ..compiler.kernels import kernel
from ..compiler.struct_layout import Float1, Int1, Int2
from ..constraints.switches.switch_kind import STEADY
from ..math.rotation import cayley_rate
from ..numerics.integrators.implicit_method import restore_start_rates, run_implicit_task
from ..numerics.integrators.implicit_workspace import STEP_START, RadauStepWorkspace
from ..numerics.integrators.radau import accept_radau_step as enter_radau
from ..numerics.integrators.radau import attempt_radau_step, reject_radau_step
from ..numerics.integrators.radau_stages import interpolate_radau as between_radau
from ..numerics.integrators.time_loop import BEGIN_SEGMENT
from ..tables.table_definitions import ComplexSystem, ComplexWork, System, Work
from .calls import (
    GUARD_VALUES,
    INERTIAL_TERMS,
    OUTPUT,
    OWN,
    POSITION,
    RESIDUAL,
    RESIDUAL_STEPS,
    RESIDUAL_TERMS,
    S_,
    W_,
    ResidualBatch,
    call_engine,
    engine_inspect,
)
from .calls import engine_arrive as arrive_there
from .element_dispatch import progress
from .integration_loop import EngineArguments, RunState, store_guards_within
from .kinematics import retract
from .rows import direction_column

COMPLEX_STEP = 1e-40
MAX_INCREMENT_SQUARE = 12.0  # square of an increment 2 tan(angle / 2): a step rotates by a third of a turn at most
RESIDUALS, SC_, WC_, STATE_BATCH, ACCELERATION_BATCH, MULTIPLIER_BATCH, PLAN, RUN, BETWEEN = range(7, 16)
# entries of JacobianPlan.first: where each group of Jacobian entries begins
PICKED, PICKED_MASS, ROWS, ROWS_METRIC, ROWS_HELD, SIZES, TURNS, PRESSES, END = range(9)


class JacobianPlan(NamedTuple):
    """Sources of the Jacobian's entries."""

    first: Int1  # (END + 1,)
    pick: Int2  # (n, 3): derivatives by positions and velocities: entry, step, index in the residuals; summed
    mass: Int2  # (n, 3): the same for accelerations
    metric: Float1  # (nv,): D
    holonomic: Int1  # (nr,): whether a row restrains positions
    valued: Int1  # (nr,): whether it does so in its present mode
    turns: Int1  # first angular velocity of each quaternion
    pressing: Int1  # rows whose multipliers load some friction
    fixed: Int1  # (1,): whether the mass matrix is constant
    negative: Int1  # entries whose negatives follow all others and a -1
    light: Float1  # (nv,): inertia added to the Jacobian for bodies without inertia, else 0
    inertia_entry: Int1  # (nv,): entries of the diagonal inertia of each velocity


class ImplicitWorkspace(NamedTuple):
    """Workspace of an implicit method's steps."""

    WC: ComplexWork
    moved: ResidualBatch  # with steps of positions and velocities
    pushed: ResidualBatch  # with steps of accelerations
    pressed: ResidualBatch  # without steps
    plan: JacobianPlan
    step: RadauStepWorkspace  # workspace of the method


class ImplicitArguments(NamedTuple):
    """Arguments of an implicit method's steps."""

    SC: ComplexSystem
    workspace: ImplicitWorkspace


@formula
def compose_state(y, d, v, z, out, A):
    """State with the positions of y incremented by d, and velocities v."""
    nq = A[S_].sizes.coordinates
    nv = v.shape[0]
    for i in range(nq):
        out[i] = y[i]
    retract(A[S_], out[:nq], d)
    for i in range(nv):
        out[nq + i] = v[i]
    for i in range(z.shape[0]):
        out[nq + nv + i] = z[i]


@formula
def stage_residual(t, k, A, K, c):
    """Write the residual of stage k to its row, and the rates of integrals. Returns a status."""
    status = stabilised_residual(t, k, A, K, c)
    out = K.out[k]
    increment_rates(A[PLAN], K.d[k], out)
    for i in range(K.v.shape[1]):
        out[i] = K.dd[k, i] - out[i]
    if status == 0:
        integral_rates(A, K, k)
    return status


@formula
def stabilised_residual(t, k, A, K, c):
    """As `stage_residual`, but the first rows hold v + D G^T mu, the velocities that the increments follow.

    The last rows are x' - f, x being states of controllers. With index 3 only positions are held on the constraints,
    and mu is zero. Returns a status.
    """
    S, W, P, own, rows = A[S_], A[W_], A[PLAN], A[OWN], A[OUTPUT].rows
    nv, nr = K.v.shape[1], K.lam.shape[1]
    own.real.t = t
    compose_state(c.y.current, K.d[k], K.v[k], K.z[k], own.y[0], A)
    for i in range(nv):
        rows[1, i] = K.a[k, i]
    for i in range(nr):
        rows[2, i] = K.lam[k, i]
    call_engine(A, RESIDUAL)
    out = K.out[k]
    bad = 0.0
    for i in range(nv):
        out[i] = K.v[k, i]
        out[nv + i] = rows[0, i]
        bad += rows[0, i] - rows[0, i]
    for r in range(nr):
        out[2 * nv + r] = rows[0, nv + nr + r]
        out[2 * nv + nr + r] = rows[0, nv + r] if P.valued[r] == 1 else K.mu[k, r]
        bad += rows[0, nv + r] - rows[0, nv + r]
        if P.valued[r] == 1 and K.count.index_3 == 1:
            out[2 * nv + r], out[2 * nv + nr + r] = rows[0, nv + r], K.mu[k, r]
        elif P.valued[r] == 1 and K.mu[k, r] != 0.0:
            for e in range(S.row_start[r], S.row_start[r + 1]):
                i = S.column[e]
                out[i] += P.metric[i] * W.G[e] * K.mu[k, r]
    for n in range(K.tol_x.shape[0]):
        out[2 * nv + 2 * nr + n] = K.xd[k, n] - W.trial.rate[n]
        bad += W.trial.rate[n] - W.trial.rate[n]
    return 0 if bad == 0.0 and not turned_too_far(P, K.d[k]) else 1


@formula
def turned_too_far(P, d):
    """Whether a quaternion rotates by more than a step allows: near half a turn its increment is unbounded."""
    for n in range(P.turns.shape[0]):
        i = P.turns[n]
        if d[i] * d[i] + d[i + 1] * d[i + 1] + d[i + 2] * d[i + 2] > MAX_INCREMENT_SQUARE:
            return True
    return False


@formula
def increment_rates(P, d, w):
    """Convert velocities w to rates of increments, in place."""
    for n in range(P.turns.shape[0]):
        i = P.turns[n]
        out = cayley_rate((d[i], d[i + 1], d[i + 2]), (w[i], w[i + 1], w[i + 2]))
        for k in range(3):
            w[i + k] = out[k]


@formula
def integral_rates(A, K, k):
    """Rates of the integrals at the stage last evaluated."""
    if K.z.shape[1] == 0:
        return
    S, W = A[S_], A[W_]
    rate = K.rate[k]
    for n in range(S.control_laws.shape[0]):
        rate[n] = W.trial.rate[n]
    for f in range(S.forces.F.shape[0]):
        i = S.forces.work[f]
        if i >= 0:
            rate[i] = W.trial.rate[i]
    if S.gravity_laws[3] >= 0:
        rate[S.gravity_laws[3]] = W.trial.rate[S.gravity_laws[3]]
    for r in range(S.rows.law.shape[0]):
        if S.rows.work[r] >= 0:
            rate[S.rows.work[r]] = K.lam[k, r] * W.rows.nu[r]
    progress(S, W, K.z[k], rate)


@formula
def stage_jacobian(t, k, A, K, c):
    """Entries of the Jacobian at stage k, or at the state at which the step begins. Returns a status."""
    S, W, P, own = A[S_], A[W_], A[PLAN], A[OWN]
    own.real.t = t
    compose_state(c.y.current, K.d[k], K.v[k], K.z[k], own.y[0], A)
    set_batch_state(own.y[0], k, A, A[STATE_BATCH], K)
    call_engine(A, POSITION)
    store_row_entries(S, W, K, P, k)
    first, last = P.first[PICKED_MASS], P.first[ROWS]
    status = complex_step_entries(A, A[STATE_BATCH], RESIDUAL_TERMS, P.pick, K.J[k, P.first[PICKED] : first])
    if P.fixed[0] == 0 or K.count.jacobians == 0:
        set_batch_state(own.y[0], k, A, A[ACCELERATION_BATCH], K)
        status += complex_step_entries(A, A[ACCELERATION_BATCH], INERTIAL_TERMS, P.mass, K.J[k, first:last])
        for i in range(P.light.shape[0]):
            K.J[k, P.inertia_entry[i]] += P.light[i]
    elif k != STEP_START:
        for e in range(first, last):
            K.J[k, e] = K.J[STEP_START, e]
    for n in range(P.turns.shape[0]):  # - d(T(d) w)/dd at d = 0, column by column
        i = P.turns[n]
        p, q, r = 0.5 * K.v[k, i], 0.5 * K.v[k, i + 1], 0.5 * K.v[k, i + 2]
        J = K.J[k, P.first[TURNS] + 9 * n : P.first[TURNS] + 9 * n + 9]
        J[0], J[1], J[2] = 0.0, r, -q
        J[3], J[4], J[5] = -r, 0.0, p
        J[6], J[7], J[8] = q, -p, 0.0
    for n in range(P.pressing.shape[0]):
        status += multiplier_derivatives(A, K, k, n)
    return status


@formula
def store_row_entries(S, W, K, P, k):
    """Entries of the rows, of the rows times the stabilisation metric, and natural sizes of rows.

    The sizes are those of the engine's own solve at its last factorisation. Redundant rows then share forces as they do
    there, and rows of rounding errors only have sizes large enough to carry no force.
    """
    J = K.J[k]
    for r in range(S.rows.law.shape[0]):
        for e in range(S.row_start[r], S.row_start[r + 1]):
            g = W.G[e]
            J[P.first[ROWS] + e] = g
            J[P.first[ROWS_METRIC] + e] = -P.metric[S.column[e]] * g * P.valued[r]
            J[P.first[ROWS_HELD] + e] = g * P.valued[r]
        size = W.rows.diagonal[r]
        J[P.first[SIZES] + r] = K.real.soft * (size if size > 0.0 else 1.0)
    for n in range(P.negative.shape[0]):
        J[P.first[END] + 1 + n] = -J[P.negative[n]]


@formula
def set_batch_state(y, k, A, B, K):
    """Set the base state of a residual batch to y with the accelerations and multipliers of stage k."""
    B.t[0] = complex(A[OWN].real.t, 0.0)
    for i in range(B.state.shape[0]):
        B.state[i] = complex(y[i], 0.0)
    for i in range(K.v.shape[1]):
        B.vdot[i] = complex(K.a[k, i], 0.0)
    for r in range(K.lam.shape[1]):
        B.lam[r] = complex(K.lam[k, r], 0.0)
    for n in range(B.out.shape[0]):
        B.out[n, 0] = complex(np.nan, np.nan)  # entries that are not computed are nan


@formula
def complex_step_entries(A, B, task, pick, numbers):
    """Entries of the Jacobian by the steps in a residual batch. Returns a status."""
    call(A[RESIDUALS], A[SC_], A[WC_], B, B, B, task)
    for e in range(numbers.shape[0]):
        numbers[e] = 0.0
    for e in range(pick.shape[0]):
        numbers[pick[e, 0]] += B.out[pick[e, 1], pick[e, 2]].imag
    bad = 0.0
    for e in range(numbers.shape[0]):
        numbers[e] /= COMPLEX_STEP
        bad += numbers[e] - numbers[e]
    return 0 if bad == 0.0 else 1


@formula
def multiplier_derivatives(A, K, k, n):
    """Derivatives of the equations of motion with respect to a multiplier that loads friction. Returns a status."""
    P, B, nv = A[PLAN], A[MULTIPLIER_BATCH], K.v.shape[1]
    r = P.pressing[n]
    set_batch_state(A[OWN].y[0], k, A, B, K)
    B.lam[r] = complex(K.lam[k, r], COMPLEX_STEP)
    call(A[RESIDUALS], A[SC_], A[WC_], B, B, B, RESIDUAL_STEPS)
    bad = 0.0
    for i in range(nv):
        x = B.out[0, i].imag / COMPLEX_STEP
        K.J[k, P.first[PRESSES] + n * nv + i] = x
        bad += x - x
    return 0 if bad == 0.0 else 1


@formula
def project_with_multipliers(t, y, dy, A, K):
    """Project y on the constraints, in place, and evaluate there; the multipliers go to ``K.found``.

    Returns (status, distance moved).
    """
    status, moved = arrive_there(t, y, dy, A, K)
    if status == 0:
        for r in range(K.found.shape[0]):
            K.found[r] = A[W_].rows.multiplier[r]
    return status, moved


@formula
def project_step_end(t, y, dy, A, K):
    """`project_with_multipliers`, after storing the guards within the step."""
    own, c, watch = A[OWN], A[RUN].clock, A[RUN].watch
    h, begin = c.real.tried, c.real.t
    restore_start_rates(K, c)
    for j in range(watch.compared_stages.shape[0] if watch.way.shape[0] > 0 and c.count.started == 1 else 0):
        x = watch.compared_places[j]
        z = c.y.saved[: K.z.shape[1]]
        A[BETWEEN](K, x, h, K.d[STEP_START], K.a[STEP_START], z)
        compose_state(c.y.current, K.d[STEP_START], K.a[STEP_START], z, own.y[0], A)
        own.real.t = begin + x * h
        if call_engine(A, GUARD_VALUES) != 0:
            return 1, 0.0
        store_guards_within(A, watch, j)
    return project_with_multipliers(t, y, dy, A, K)


@formula
def copy_modes(A):
    """Copy to the residuals the present modes and directions, and which rows restrain positions.

    They do not change within a step.
    """
    S, W, WC, P = A[S_], A[W_], A[WC_], A[PLAN]
    for s in range(S.switches.row.shape[0]):
        WC.modes.mode[s], WC.modes.hold[s] = complex(W.modes.mode[s], 0.0), complex(W.modes.hold[s], 0.0)
        m = direction_column(S, W, s)
        WC.sensed.value[m] = complex(W.sensed.value[m], 0.0)
        r = S.switches.row[s]
        if r >= 0:
            P.valued[r] = 0 if W.modes.mode[s] == STEADY else P.holonomic[r]


@formula
def perform_implicit(method, callbacks, S, W, M, engine_arguments, run_state, task):
    """Run a task of an implicit method."""
    A = (
        engine_arguments.doors[0], S, W, engine_arguments.R, engine_arguments.clock, engine_arguments.output,
        run_state.group, engine_arguments.doors[1], M.SC, M.workspace.WC, M.workspace.moved, M.workspace.pushed,
        M.workspace.pressed, M.workspace.plan, run_state, method[1],
    )  # fmt: skip
    if task == BEGIN_SEGMENT:
        copy_modes(A)
    return run_implicit_task(method, callbacks, A, M.workspace.step, run_state.clock, task)


@formula
def by_radau(S, W, M, engine_arguments, run_state, task):
    """Run a task of Radau IIA of order 5."""
    method = (attempt_radau_step, between_radau, enter_radau, reject_radau_step)
    return perform_implicit(
        method,
        (stage_residual, stage_jacobian, compose_state, project_step_end, engine_inspect, arrive_there),
        S,
        W,
        M,
        engine_arguments,
        run_state,
        task,
    )


@kernel
def radau_steps(
    S: System, W: Work, M: ImplicitArguments, engine_arguments: EngineArguments, run_state: RunState, task: int
) -> int:
    """`by_radau` as a kernel."""
    return by_radau(S, W, M, engine_arguments, run_state, task)
