"""Variational equations: the motion and its derivatives with respect to parameters, integrated together.

    dq' = dv + N dq,  [M G^T; G 0] [dvdot; -dlam] = -[dr; da];  dc' = ds;  works change with the powers

dr, da and ds are the changes of the equations of motion, the constraints and the rates of the controller states c along
(dq, dv, dc, dp), by a complex step of the
residual; the solve uses the motion's own factor. Joint friction depends on the reactions, so dr has a part F dlam: the
columns of F are found by a complex step of each multiplier that loads a joint, and taken into account by as many
additional unknowns (Woodbury).

After every step motion and changes are projected on their constraints. The steps suit both, to the same tolerance.
(Direct differentiation: Haug and Ehle 1982; Chang and Nikravesh 1985. That the changes may be projected like this, see
Serban and Freeman 1996.) The state is (q, v, all (dq, dv), c, all dc, w, all dw) with
the controller states c and the other states w. This loop does not contain the right-hand side:
it calls the kernels of the engine and of the residual by address.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..compiler.formulas import call, formula
from ..compiler.kernels import kernel
from ..compiler.struct_layout import Float1, Float2, Int1
from ..math.scalar import absolute
from ..numerics.integrators.butcher_tableaux import Tableau
from ..numerics.integrators.explicit_runge_kutta import run_explicit_task
from ..numerics.integrators.time_loop import StepState, advance, finish_step, no_segment_start
from ..tables.table_definitions import ComplexSystem, ComplexWork, System, Work
from .calls import (
    ARRIVE,
    CONSTRAINT_GAPS,
    ENGINE,
    MOTION,
    OUTPUT,
    OWN,
    R_,
    REPORT,
    RESIDUAL_DRIVEN,
    RESIDUAL_STEPS,
    S_,
    SOLVE,
    TANGENT,
    W_,
    OutputBuffer,
    ResidualBatch,
    call_engine,
    engine_inspect,
)
from .kinematics import quaternion_at

COMPLEX_STEP = 1e-40  # relative to the parameter
# places in the argument tuple of the loop, behind those of the engine's call
RESIDUAL, SC_, WC_, BATCH = range(6, 10)
# entries of SensitivityPlan.size
NQ, NZ, COUNT, POWERS, CONTROLS = range(5)


class SensitivityPlan(NamedTuple):
    """Table entries that each parameter changes, and workspace."""

    size: Int1  # (5,) coordinates, states, parameters; whether powers replace works; controller states
    first: Int1  # (n + 1,) first entry of each parameter
    entry: Int1  # (entries,): index in the tables
    step: Float1  # (entries,): imaginary step of the entry
    tables: Float1  # the complex tables, concatenated; real and imaginary parts alternate
    found: Float2  # (n, nv + nr + nv): changes of accelerations, multipliers, efforts
    effort: Float1  # (nv,) of the motion itself
    rate: Float1  # rates of the state, for rows of output
    rates: Float1  # (nz,): changes of the rates of the states with one parameter
    zero: Float1  # (nv,)
    still: Float1  # (nc,): zeros
    pressing: Int1  # (m,) rows whose multipliers load some friction
    friction_response: Float2  # (m, nv + nr + nv): response to the change of friction per unit of each multiplier
    friction_power: Float2  # (m, nz): the same of the powers
    share: Float2  # (m, m + 1): scratch


@formula
def set_parameter_step(P, k, on):
    """Add the step of parameter k to the complex tables, or remove it."""
    for e in range(P.first[k], P.first[k + 1]):
        P.tables[P.entry[e]] = P.step[e] if on else 0.0


@formula
def set_reference_state(A, P, t, state):
    """Use the state at which the engine was last evaluated as the base of complex steps."""
    W, B = A[W_], A[BATCH]
    B.t[0] = complex(t, 0.0)
    for i in range(state.shape[0]):
        B.state[i] = complex(state[i], 0.0)
    for d in range(P.effort.shape[0]):
        B.vdot[d] = complex(W.velocities.solved[d], 0.0)
        P.effort[d] = W.velocities.effort[d]
    for k in range(B.lam.shape[0]):
        B.lam[k] = complex(W.rows.multiplier[k], 0.0)


@formula
def complex_step_residual(A, dq, dv, dc, task):
    """Residuals with a complex step of positions, velocities, controller states, and of the entries in the tables."""
    B = A[BATCH]
    nv = dq.shape[0]
    for d in range(nv):
        B.steps[0, d] = complex(0.0, COMPLEX_STEP * dq[d])
        B.steps[0, nv + d] = complex(0.0, COMPLEX_STEP * dv[d])
    for c in range(dc.shape[0]):
        B.steps[0, 3 * nv + 1 + c] = complex(0.0, COMPLEX_STEP * dc[c])
    if nv > 0:
        B.out[0, 0] = complex(np.nan, np.nan)  # entries that are not computed are nan
    call(A[RESIDUAL], A[SC_], A[WC_], B, B, B, task)


@formula
def solve_by_engine(A):
    """Solve with the motion's factor; the right-hand sides are in the first two rows of the output buffer."""
    call(A[ENGINE], A[S_], A[W_], A[R_], A[OWN], A[OUTPUT], SOLVE)


@formula
def project_change(A, P, k, dq, dv):
    """Project changes of positions and velocities on the linearised constraints, in place."""
    S, WC, B, rows = A[S_], A[WC_], A[BATCH], A[OUTPUT].rows
    nv, nr, nq = dq.shape[0], S.rows.law.shape[0], P.size[NQ]
    set_parameter_step(P, k, True)
    for what in range(2):
        complex_step_residual(A, dq, dv, P.still, CONSTRAINT_GAPS)
        for b in range(S.tree.parent.shape[0]):
            if S.tree.law[b] >= 0:
                dq[S.tree.v[b]] = WC.trial.state[S.tree.q[b]].imag / COMPLEX_STEP
                dv[S.tree.v[b]] = WC.trial.state[nq + S.tree.v[b]].imag / COMPLEX_STEP
        if nr > 0:
            for d in range(nv):
                rows[0, d] = 0.0
            for r in range(nr):
                rows[1, r] = -B.out[0, nv + what * nr + r].imag / COMPLEX_STEP
            solve_by_engine(A)
            for d in range(nv):
                if what == 0:
                    dq[d] += rows[2, d]
                else:
                    dv[d] += rows[2, d]
    set_parameter_step(P, k, False)


@formula
def state_change(A, P, k, dq, dv, dc, rate, powers):
    """Rates (2 nv,) of the changes of positions and velocities with parameter k, and changes (nz,) of states' rates.

    ``dc`` are the changes of the controller states. Changes of accelerations, multipliers and efforts go to
    ``P.found[k]``.
    """
    S, W, WC = A[S_], A[W_], A[WC_]
    nv, nr = dq.shape[0], S.rows.law.shape[0]
    found = P.found[k]
    set_parameter_step(P, k, True)
    complex_step_residual(A, dq, dv, dc, RESIDUAL_DRIVEN)
    set_parameter_step(P, k, False)
    solve_change(A, P, found, 1.0)
    for i in range(powers.shape[0]):
        powers[i] = WC.trial.rate[i].imag / COMPLEX_STEP if i < dc.shape[0] else 0.0
    for f in range(S.forces.F.shape[0]):
        if S.forces.work[f] >= 0:
            powers[S.forces.work[f]] = WC.trial.rate[S.forces.work[f]].imag / COMPLEX_STEP
    if S.gravity_laws[3] >= 0:
        powers[S.gravity_laws[3]] = WC.trial.rate[S.gravity_laws[3]].imag / COMPLEX_STEP
    if P.pressing.shape[0] > 0:
        add_friction_feedback(P, found, powers, nv)
    for r in range(nr):
        if S.rows.work[r] >= 0:
            nu = WC.rows.nu[r]
            powers[S.rows.work[r]] = found[nv + r] * nu.real + W.rows.multiplier[r] * nu.imag / COMPLEX_STEP
    for b in range(S.tree.parent.shape[0]):
        if S.tree.law[b] >= 0:
            d = S.tree.v[b]
            found[d] = WC.velocities.prescribed[d].imag / COMPLEX_STEP
            powers[S.tree.work[b]] = found[nv + nr + d] * A[BATCH].state[P.size[NQ] + d].real + P.effort[d] * dv[d]
    for d in range(nv):
        rate[d] = dv[d]
        rate[nv + d] = found[d]
    add_rotation_terms(S, A[BATCH].state, P.size[NQ], dq, rate)


@formula
def solve_change(A, P, found, sign):
    """Accelerations, multipliers and efforts that cancel the residuals along the last complex step."""
    S, W, B, rows = A[S_], A[W_], A[BATCH], A[OUTPUT].rows
    nv, nr = P.zero.shape[0], S.rows.law.shape[0]
    for d in range(nv):
        rows[0, d] = -B.out[0, d].imag / COMPLEX_STEP
    for r in range(nr):
        rows[1, r] = -B.out[0, nv + 2 * nr + r].imag / COMPLEX_STEP * sign
    solve_by_engine(A)
    for d in range(nv):
        found[d] = rows[2, d]
        found[nv + nr + d] = W.velocities.effort[d]
    for r in range(nr):
        found[nv + r] = rows[3, r]


@formula
def add_rotation_terms(S, state, nq, dq, rate):
    """Add N dq: components of changes of rotation along rotating axes."""
    for b in range(S.tree.parent.shape[0]):
        _, w = quaternion_at(S, b)
        if w >= 0:
            x, y, z = state[nq + w].real, state[nq + w + 1].real, state[nq + w + 2].real
            rate[w] += z * dq[w + 1] - y * dq[w + 2]
            rate[w + 1] += x * dq[w + 2] - z * dq[w]
            rate[w + 2] += y * dq[w] - x * dq[w + 1]


@formula
def friction_responses(A, P):
    """Response of all unknowns to the change of friction per unit of each multiplier that loads friction."""
    S, W, WC, B = A[S_], A[W_], A[WC_], A[BATCH]
    for j in range(P.pressing.shape[0]):
        r = P.pressing[j]
        B.lam[r] = complex(W.rows.multiplier[r], COMPLEX_STEP)
        complex_step_residual(A, P.zero, P.zero, P.still, RESIDUAL_STEPS)
        B.lam[r] = complex(W.rows.multiplier[r], 0.0)
        for e in range(S.row_start[r], S.row_start[r + 1]):  # without the reaction's own effect
            B.out[0, S.column[e]] += complex(0.0, COMPLEX_STEP * W.G[e])
        solve_change(A, P, P.friction_response[j], 0.0)
        for i in range(P.friction_power.shape[1]):
            P.friction_power[j, i] = 0.0
        for f in range(S.forces.F.shape[0]):
            i = S.forces.work[f]
            if i >= 0:
                P.friction_power[j, i] = WC.trial.rate[i].imag / COMPLEX_STEP


@formula
def add_friction_feedback(P, found, powers, nv):
    """Add the response to the friction that changes with the reactions."""
    m = P.pressing.shape[0]
    for j in range(m):
        at = nv + P.pressing[j]
        for i in range(m):
            P.share[j, i] = -P.friction_response[i, at]
        P.share[j, j] += 1.0
        P.share[j, m] = found[at]
    solve_in_place(P.share)
    for j in range(m):
        x = P.share[j, m]
        for i in range(found.shape[0]):
            found[i] += x * P.friction_response[j, i]
        for i in range(powers.shape[0]):
            powers[i] += x * P.friction_power[j, i]


@formula
def solve_in_place(A):
    """Solve the equations [A | b] in place (Gauss and Jordan, with row pivots); the solution is the last column."""
    m = A.shape[0]
    for j in range(m):
        best = j
        for i in range(j + 1, m):
            if absolute(A[i, j]) > absolute(A[best, j]):
                best = i
        for i in range(j, m + 1):
            A[j, i], A[best, i] = A[best, i], A[j, i]
        for i in range(m):
            if i != j:
                x = A[i, j] / A[j, j]
                for n in range(j, m + 1):
                    A[i, n] -= x * A[j, n]
        x = A[j, j]
        for n in range(j, m + 1):
            A[j, n] /= x


@formula
def state_place(P, k, i):
    """Place of state i in the state vector: of the motion (k = 0), or of its change with parameter k - 1."""
    n, controls = P.size[COUNT], P.size[CONTROLS]
    at = P.size[NQ] + P.zero.shape[0] + 2 * P.zero.shape[0] * n
    if i < controls:
        return at + k * controls + i
    return at + (n + 1) * controls + k * (P.size[NZ] - controls) + i - controls


@formula
def copy_motion_part(x, y, P, out):
    """Copy the motion's part of a state vector (or of its rates) ``y`` to ``x``; back if ``out``."""
    own = P.size[NQ] + P.zero.shape[0]
    for i in range(x.shape[0]):
        j = i if i < own else state_place(P, 0, i - own)
        if out:
            y[j] = x[i]
        else:
            x[i] = y[j]


@formula
def change_rates(y, dy, A, P):
    """Rates of all changes at the base state of the residual batch."""
    nv = P.zero.shape[0]
    friction_responses(A, P)
    for k in range(P.size[COUNT]):
        a = P.size[NQ] + nv + 2 * nv * k
        c = state_place(P, k + 1, 0)
        dc = y[c : c + P.size[CONTROLS]]
        state_change(A, P, k, y[a : a + nv], y[a + nv : a + 2 * nv], dc, dy[a : a + 2 * nv], P.rates)
        for i in range(P.rates.shape[0]):
            dy[state_place(P, k + 1, i)] = P.rates[i]


@formula
def augmented_derivative(t, y, dy, A, P):
    """Rates of the motion at its projected state, and of its changes."""
    own = A[OWN]
    own.real.t = t
    copy_motion_part(own.y[0], y, P, False)
    status = call_engine(A, MOTION)
    if status == 0:
        copy_motion_part(own.K[0], dy, P, True)
        set_reference_state(A, P, t, A[W_].trial.state)
        change_rates(y, dy, A, P)
    return status


@formula
def project_changes(t, y, dy, A, P):
    """Project all changes on their constraints, at the state that the engine has projected, and compute their rates."""
    S = A[S_]
    nv = P.zero.shape[0]
    set_reference_state(A, P, t, A[OWN].y[0])
    bound = S.rows.law.shape[0] > 0
    for b in range(S.tree.parent.shape[0]):
        bound = bound or S.tree.law[b] >= 0
    if bound:
        for k in range(P.size[COUNT]):
            a = P.size[NQ] + nv + 2 * nv * k
            project_change(A, P, k, y[a : a + nv], y[a + nv : a + 2 * nv])
    change_rates(y, dy, A, P)


@formula
def project_augmented_state(t, y, dy, A, P):
    """Project motion and changes on their constraints, in place, and evaluate there.

    Returns (status, distance that the motion moved).
    """
    own, rows = A[OWN], A[OUTPUT].rows
    own.real.t = t
    copy_motion_part(own.y[0], y, P, False)
    status = call_engine(A, ARRIVE)
    moved = rows[0, 0]
    if status == 0:
        copy_motion_part(own.y[0], y, P, True)
        copy_motion_part(own.K[0], dy, P, True)
        project_changes(t, y, dy, A, P)
    return status, moved


@formula
def project_augmented_error(y, e, A, P):
    """Remove from an error what the projection of the motion removes."""
    own = A[OWN]
    copy_motion_part(own.y[0], y, P, False)
    copy_motion_part(own.K[0], e, P, False)
    call_engine(A, TANGENT)
    copy_motion_part(own.K[0], e, P, True)


@formula
def report_augmented_state(t, y, out, A, P):
    """Write a row of output: the motion's own, then the changes with each parameter.

    The changes are those of positions, velocities, accelerations, multipliers, efforts and works (or powers).
    """
    own, rows = A[OWN], A[OUTPUT].rows
    nv, nz, n = P.zero.shape[0], P.size[NZ], P.size[COUNT]
    own.real.t = t
    copy_motion_part(own.y[0], y, P, False)
    status = call_engine(A, REPORT)
    if status != 0:
        return status
    width = out.shape[0] - n * (2 * nv + P.found.shape[1] + nz)
    for i in range(width):
        out[i] = rows[0, i]
    copy_motion_part(own.y[0], y, P, True)
    rate = P.rate
    project_changes(t, y, rate, A, P)
    at = P.size[NQ] + nv
    to = width
    for k in range(n):
        for i in range(2 * nv):
            out[to + i] = y[at + 2 * nv * k + i]
        to += 2 * nv
        for i in range(P.found.shape[1]):
            out[to + i] = P.found[k, i]
        to += P.found.shape[1]
        for i in range(nz):
            j = state_place(P, k + 1, i)
            out[to + i] = rate[j] if P.size[POWERS] == 1 else y[j]
        to += nz
    return status


@kernel
def variation_kernel(
    address: int,
    residual: int,
    S: System,
    W: Work,
    R: Tableau,
    engine_clock: StepState,
    output: OutputBuffer,
    SC: ComplexSystem,
    WC: ComplexWork,
    bench: ResidualBatch,
    plan: SensitivityPlan,
    clock: StepState,
    states: Float2,
    out: Float2,
) -> int:
    """Integrate motion and changes together, or report them at given states.

    Parameters
    ----------
    address, residual : int
        Addresses of the kernels of the engine and of the residuals.
    S, W : System, Work
        Of the motion.
    R : Tableau
    engine_clock, output : StepState, OutputBuffer
        The engine's.
    SC, WC : System, Work
        In complex numbers.
    bench : ResidualBatch
    plan : SensitivityPlan
    clock : StepState
        Of motion and changes.
    states : (n, width of the state)
        States to report, at the times of ``clock``; if there are none, the motion is integrated.
    out : (n, width)
        Rows of output.

    Returns
    -------
    int
        The number of rows written.
    """
    A = (address, S, W, R, engine_clock, output, residual, SC, WC, bench)
    if states.shape[0] == 0:
        callbacks = (
            run_explicit_task,
            (augmented_derivative, project_augmented_state, project_augmented_error, engine_inspect),
            report_augmented_state,
            no_segment_start,
            finish_step,
        )
        return advance(callbacks, A, plan, R, clock, out)
    for n in range(states.shape[0]):
        if report_augmented_state(clock.times[n], states[n], out[n], A, plan) != 0:
            return n
    return states.shape[0]
