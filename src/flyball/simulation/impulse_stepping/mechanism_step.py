"""The jointed mechanism in a step: smooth velocities, impulses, projection onto the constraints, energy.

Positions advance half a step with the initial velocities. There everything is evaluated at the mean of initial and
final velocities: the step is symmetric in time and therefore of second order. The mean is found by Anderson mixing
(1965; Walker and Ni 2011); stiff springs and dampers are solved together with the masses.

Impulses are computed at the joints' positions at half the step. At the end of the step bodies are projected onto the
constraints in the metric of the masses, which dissipates energy and never supplies any. That energy is accounted as
numerical.
"""

from __future__ import annotations

from ...collision.tables import ContactTable, Movers
from ...compiler.formulas import call, formula
from ...compiler.kernels import vectorised_kernel
from ...engine.calls import ARRIVE, MOTION, POSITION, SOLVE
from ...engine.kinematics import retract
from ...engine.rows import row_times
from ...math.scalar import sqrt
from ...math.vec import dot, load3, load9, mtv, mv, store3, store9
from ...numerics.complementarity.contact_problem import ContactProblem, ContactSolution
from ...tables.table_definitions import SCHUR
from .mechanism_rows import (
    account_lines,
    add_spring_response,
    correct_spring_lengths,
    find_implicit_springs,
    impulse_response,
    keep_stops_only,
    mechanism_contact_rows,
    save_spring_biases,
    save_spring_lengths,
    spring_impulse,
    spring_rate,
    update_friction_loads,
    with_spring_response,
)
from .stepping_tables import (
    NOT_CONVERGED,
    TASK_APPLY_IMPULSES,
    TASK_BEGIN,
    TASK_CONSISTENT,
    TASK_FINAL_VELOCITIES,
    TASK_FINISH,
    TASK_FREE_VELOCITIES,
    TASK_IMPACT_IMPULSES,
    TASK_MEAN_VELOCITIES,
    TASK_POSES,
    TASK_ROWS,
    TASK_START,
    MechanismTables,
)


@formula
def kinetic_energy(A):
    """Return the kinetic energy at the state of the mechanism, with the kinematics in the engine's workspace."""
    total = 0.0
    for b in range(A.S.tree.parent.shape[0]):
        v = load3(A.W.bodies.velocity, b, 0)
        w = mtv(load9(A.W.bodies.rotation, b, 0), load3(A.W.bodies.angular_velocity, b, 0))
        total += 0.5 * A.S.bodies.mass[b] * dot(v, v) + 0.5 * dot(w, mv(load9(A.S.bodies.inertia, b, 0), w))
        for d in range(A.S.tree.v[b], A.S.tree.v[b] + A.S.tree.nv[b]):
            u = A.clock.y.current[A.S.sizes.coordinates + d]
            total += 0.5 * A.S.rotor_inertia[d] * u * u
    return total


@formula
def gravity_sum(A, vectors):
    """Return the sum of m g . x over the bodies, with x their positions or velocities."""
    total = 0.0
    for b in range(A.S.tree.parent.shape[0]):
        x = load3(vectors, b, 0)
        total += A.S.bodies.mass[b] * (A.S.gravity[0] * x[0] + A.S.gravity[1] * x[1] + A.S.gravity[2] * x[2])
    return total


@formula
def add_reaction_work(A, lam, v):
    """Account for the work of joint impulses at velocities v, beyond that of prescribed rates."""
    for r in range(A.S.rows.law.shape[0]):
        A.real.joint_loss -= lam[r] * (row_times(A.S, A.W, r, v) - A.W.rows.nu[r])


@formula
def save_gravity_work(A, h):
    """Store gravity's work over the step at the mean velocities, as for the works of impulses."""
    A.real.gravity_work = h * gravity_sum(A, A.W.bodies.velocity)


@formula
def close_energy_account(A):
    """Account for the energy taken by the projection onto the joints, at the end of a step with contact impulses."""
    now = -gravity_sum(A, A.W.bodies.position)
    if A.real.kinetic >= 0.0:
        A.real.joint_loss += A.real.kinetic - kinetic_energy(A) - (now - A.real.potential) - A.real.gravity_work
    A.real.potential = now


MIXED_GUESSES = 5  # evaluations that are mixed to the next iterate
MOST_EVALUATIONS = 40
VELOCITY_CHANGE_TOLERANCE = 1e-10  # allowed error of the last iterate, relative to the velocities or their change
# rows of MechanismTables.mixing: residuals of the stored iterates, the iterates; present residual, half the step
MISSED_ROWS, GUESS_ROWS, RESIDUAL_ROW, HALF_STEP_ROW, MIXING_ROWS = (
    0,
    MIXED_GUESSES,
    2 * MIXED_GUESSES,
    2 * MIXED_GUESSES + 1,
    2 * MIXED_GUESSES + 2,
)
DEPENDENT_COLUMN = 1e-12  # remainder of a column, relative to it, below which it is linearly dependent


@formula
def free_velocities(A):
    """Advance half a step, and solve there for the change of velocities without contact. Returns a status."""
    nq, nv = A.S.sizes.coordinates, A.velocities.before.shape[0]
    y, h = A.clock.y, A.real.step
    before, change, half = A.velocities.before, A.velocities.change, A.mixing[HALF_STEP_ROW]
    for d in range(nv):
        before[d] = y[0, nq + d]
        change[d] = 0.0
        half[d] = 0.5 * h * before[d]
    retract(A.S, y[0, :nq], half)
    A.clock.real.t = A.real.time + 0.5 * h
    for n in range(MOST_EVALUATIONS):
        for d in range(nv):
            y[0, nq + d] = before[d] + 0.5 * change[d]
        status = evaluate_motion(A, n > 0)
        A.count.evaluated += 1
        if status != 0:
            return status
        save_evaluation(A, h)
        if n == 0:
            find_implicit_springs(A, h)
            save_spring_lengths(A)
        save_spring_biases(A)
        change_residual(A, h)
        if change_converged(A):
            return 0
        if n < MOST_EVALUATIONS - 1:
            next_guess(A, n)
    A.count.unsettled += 1
    return 0 if A.count.accept_unsettled != 0 else NOT_CONVERGED


@formula
def evaluate_motion(A, factored):
    """Evaluate accelerations; ``factored``: at the positions of the last evaluation, whose factor is used again."""
    A.W.options.factored = 1.0 if factored else 0.0
    status = call(A.door[0], A.S, A.W, A.R, A.clock, A.output, MOTION)
    A.W.options.factored = 0.0
    return status


@formula
def save_evaluation(A, h):
    """Store the results of the evaluation (h vdot, multipliers, driver efforts), which later solves overwrite."""
    nq = A.S.sizes.coordinates
    for d in range(A.velocities.before.shape[0]):
        A.velocities.smooth[d] = h * A.clock.K[0, nq + d]
        A.velocities.effort[d] = A.W.velocities.effort[d]
    for r in range(A.reactions.smooth.shape[0]):
        A.reactions.smooth[r] = A.W.rows.multiplier[r]


@formula
def change_residual(A, h):
    """Compute the residual of the fixed-point equation for the change of velocities."""
    now, change = A.mixing[RESIDUAL_ROW], A.velocities.change
    for d in range(now.shape[0]):
        now[d] = A.velocities.smooth[d] - change[d]
    for i in range(A.count.springs):
        s = spring_impulse(A, h, i, A.velocities.before, change)
        add_spring_response(A, i, -s, now)
    with_spring_response(A, now)


@formula
def change_converged(A):
    """Return whether the change of velocities has converged."""
    size, worst = 0.0, 0.0
    for d in range(A.velocities.before.shape[0]):
        unit = A.S.velocity_units[d]
        size = max(size, (abs(A.velocities.before[d]) + abs(A.velocities.change[d])) / unit)
        worst = max(worst, abs(A.mixing[RESIDUAL_ROW, d]) / unit)
    return worst <= VELOCITY_CHANGE_TOLERANCE * size


@formula
def next_guess(A, n):
    """Compute the next change of velocities by Anderson mixing: the combination of iterates with least residual."""
    mixing, C, change = A.mixing, A.weight, A.velocities.change
    now = mixing[RESIDUAL_ROW]
    kept = min(n, MIXED_GUESSES)
    for i in range(kept):  # normal equations of |now - sum w_i (now - missed_i)|
        for j in range(i + 1):
            C[i, j] = 0.0
        C[i, MIXED_GUESSES] = 0.0
        for d in range(now.shape[0]):
            a = (now[d] - mixing[MISSED_ROWS + i, d]) / (A.S.velocity_units[d] * A.S.velocity_units[d])
            C[i, MIXED_GUESSES] += a * now[d]
            for j in range(i + 1):
                C[i, j] += a * (now[d] - mixing[MISSED_ROWS + j, d])
    solve_weights(C, kept)
    slot = n % MIXED_GUESSES
    for d in range(now.shape[0]):
        to = change[d] + now[d]
        for i in range(kept):
            to -= C[i, MIXED_GUESSES] * (change[d] - mixing[GUESS_ROWS + i, d] + now[d] - mixing[MISSED_ROWS + i, d])
        mixing[GUESS_ROWS + slot, d] = change[d]
        mixing[MISSED_ROWS + slot, d] = now[d]
        change[d] = to


@formula
def solve_weights(C, n):
    """Solve n normal equations by Cholesky factorization, in place; linearly dependent columns get weight zero."""
    for i in range(n):
        whole = C[i, i]
        for j in range(i + 1):
            s = C[i, j]
            for k in range(j):
                s -= C[i, k] * C[j, k]
            if j < i:
                C[i, j] = s / C[j, j] if C[j, j] > 0.0 else 0.0
            else:
                C[i, i] = sqrt(s) if s > DEPENDENT_COLUMN * whole else 0.0
        s = C[i, MIXED_GUESSES]
        for k in range(i):
            s -= C[i, k] * C[k, MIXED_GUESSES]
        C[i, MIXED_GUESSES] = s / C[i, i] if C[i, i] > 0.0 else 0.0
    for i in range(n - 1, -1, -1):
        s = C[i, MIXED_GUESSES]
        for k in range(i + 1, n):
            s -= C[k, i] * C[k, MIXED_GUESSES]
        C[i, MIXED_GUESSES] = s / C[i, i] if C[i, i] > 0.0 else 0.0


NO_VELOCITY_CHANGE = 1e-12  # negligible change of velocities, relative to them


@formula
def run_task(A, M, C, P, X, task):
    """Run one task of `mechanism_kernel`."""
    if task == TASK_START:
        return start_mechanism(A, M, X)
    if task == TASK_FREE_VELOCITIES:
        return free_step(A, M, X)
    if task == TASK_BEGIN:
        for d in range(A.velocities.before.shape[0]):
            X.wide[d] = A.velocities.before[d] + A.velocities.change[d]
        for k in range(P.size[3]):
            X.line[k] = 0.0
        return 0
    if task == TASK_ROWS:
        return mechanism_contact_rows(A, M, C, P)
    if task == TASK_APPLY_IMPULSES:
        apply_step_impulses(A, P, X)
        return 0
    if task == TASK_MEAN_VELOCITIES:
        for i in range(A.S.sizes.coordinates):  # at half the step, from where TASK_FINISH continues
            A.clock.y[2, i] = A.clock.y.current[i]
        for d in range(A.velocities.before.shape[0]):
            X.wide[d] = 0.5 * (A.velocities.before[d] + A.velocities.after[d])
        keep_stops_only(A, P, X)
        return 0
    if task == TASK_FINISH:
        return finish_step(A, M, X)
    if task == TASK_POSES:
        write_body_states(A, M, True)
        return 0
    if task == TASK_CONSISTENT:
        make_consistent(A, X)
        return 0
    if task == TASK_IMPACT_IMPULSES:
        for d in range(A.velocities.before.shape[0]):
            A.velocities.impulse[d] = 0.0
        contact_impulses(A, P, X, A.velocities.impulse)
        impulse_response(A, A.velocities.impulse, A.velocities.impulsive)
        for d in range(A.velocities.before.shape[0]):
            A.velocities.displacement[d] = 0.5 * (A.velocities.before[d] + X.wide[d])
        add_reaction_work(A, A.output.rows[3], A.velocities.displacement)
        for r in range(A.reactions.smooth.shape[0]):
            A.reactions.impact[r] += A.output.rows[3, r]
    if task == TASK_FINAL_VELOCITIES:
        A.real.time += A.real.step
        A.count.step_started = 0
        close_energy_account(A)
        for d in range(A.velocities.before.shape[0]):
            X.wide[d] = A.clock.y.current[A.S.sizes.coordinates + d]
    return 0


@formula
def make_consistent(A, X):
    """Make velocities before an impact consistent with the joints at half the step, where the rows are.

    The velocities at the start of the step are inconsistent there, since joints rotate within half the step. Contact
    impulses along immovable directions would not remove that part, and would grow without bound where friction jams.
    """
    rows = A.output.rows
    for d in range(A.velocities.before.shape[0]):
        rows[0, d] = 0.0
    for r in range(A.S.rows.law.shape[0]):
        rows[1, r] = A.W.rows.nu[r] - row_times(A.S, A.W, r, X.wide)
    call(A.door[0], A.S, A.W, A.R, A.clock, A.output, SOLVE)
    for d in range(A.velocities.before.shape[0]):
        A.velocities.displacement[d] = X.wide[d] + 0.5 * rows[2, d]
        X.wide[d] += rows[2, d]
        A.velocities.before[d] = X.wide[d]
    for r in range(A.S.rows.law.shape[0]):
        A.real.joint_loss -= rows[3, r] * row_times(A.S, A.W, r, A.velocities.displacement)


@formula
def start_mechanism(A, M, X):
    """Evaluate the start of the motion, which must be on the constraints: accelerations, multipliers, efforts."""
    A.count.step_started = 0
    A.clock.real.t = A.real.time
    status = call(A.door[0], A.S, A.W, A.R, A.clock, A.output, MOTION)
    save_evaluation(A, A.real.step)
    nq = A.S.sizes.coordinates
    for d in range(A.velocities.before.shape[0]):
        X.wide[d] = A.velocities.before[d] = A.velocities.after[d] = A.clock.y.current[nq + d]
        A.velocities.impulsive[d] = 0.0
    for r in range(A.reactions.smooth.shape[0]):
        A.reactions.impulse[r] = A.reactions.impact[r] = 0.0
    update_friction_loads(A)
    write_body_states(A, M, True)
    A.real.kinetic = -1.0
    close_energy_account(A)
    return status


@formula
def free_step(A, M, X):
    """Compute the velocities without contact from those in ``X.wide``; a repeated call restarts at the same state."""
    y, nq = A.clock.y, A.S.sizes.coordinates
    if A.count.step_started == 0:
        for i in range(y.shape[1]):
            y[1, i] = y[0, i]
        for r in range(A.reactions.smooth.shape[0]):
            A.reactions.impact[r] = 0.0
        A.count.step_started = 1
    for i in range(y.shape[1]):
        y[0, i] = y[1, i]
    for d in range(A.velocities.before.shape[0]):
        y[0, nq + d] = X.wide[d]
    status = free_velocities(A)
    write_body_states(A, M, False)
    return status


@formula
def write_body_states(A, M, poses):
    """Write the bodies' velocities, and poses if requested, for the contact search, as last evaluated."""
    for k in range(A.mover.shape[0]):
        b, to = A.mover[k, 0], A.count.first + k
        if poses:
            store3(M.pose, to, 0, load3(A.W.bodies.position, b, 0))
            store9(M.pose, to, 3, load9(A.W.bodies.rotation, b, 0))
        store3(M.twist, to, 0, load3(A.W.bodies.velocity, b, 0))
        store3(M.twist, to, 3, load3(A.W.bodies.angular_velocity, b, 0))


@formula
def apply_step_impulses(A, P, X):
    """Compute the velocities after the step from the impulses, and the reactions of joints and drivers.

    They follow from one solve with all impulses: joints are satisfied to rounding, whatever the residual of the cone
    solver.
    """
    nv, h = A.velocities.before.shape[0], A.real.step
    before, total = A.velocities.before, A.velocities.impulse
    for d in range(nv):
        total[d] = 0.0
        A.velocities.displacement[d] = X.wide[d] - before[d] - A.velocities.change[d]
    contact_impulses(A, P, X, total)
    for i in range(A.count.springs):
        s = spring_impulse(A, h, i, before, A.velocities.change)
        s += A.springs.added_mass[i] * spring_rate(A, i, A.velocities.displacement)
        for d in range(int(A.springs.first[i]), int(A.springs.end[i])):
            total[d] -= s * A.spring_J[i, d]
    impulse_response(A, total, A.velocities.impulsive)
    for r in range(A.reactions.smooth.shape[0]):
        A.reactions.impulse[r] = A.output.rows[3, r]
    for d in range(nv):
        A.velocities.effort[d] += A.W.velocities.effort[d] / h
        A.velocities.after[d] = before[d] + A.velocities.smooth[d] + A.velocities.impulsive[d]
        A.velocities.impulsive[d] = (
            A.velocities.after[d] - before[d] - A.velocities.change[d]
        )  # by contacts and single rows
    for d in range(nv):
        A.velocities.displacement[d] = 0.5 * (before[d] + A.velocities.after[d])
    add_reaction_work(A, A.reactions.impulse, A.velocities.displacement)
    account_works(A, h)
    account_lines(A, P, X)
    correct_velocity_forces(A, h)
    for d in range(nv):
        X.wide[d] = A.velocities.after[d]


@formula
def velocities_changed(A):
    """Return whether contacts or single rows changed the velocities."""
    size, change = 0.0, 0.0
    for d in range(A.velocities.before.shape[0]):
        unit = A.S.velocity_units[d]
        size = max(size, (abs(A.velocities.before[d]) + abs(A.velocities.after[d])) / unit)
        change = max(change, abs(A.velocities.impulsive[d]) / unit)
    return change > NO_VELOCITY_CHANGE * size


@formula
def evaluate_at_mean(A, part):
    """Evaluate again at half the step, at the mean velocities with a part of the change by impulses."""
    nq = A.S.sizes.coordinates
    for d in range(A.velocities.before.shape[0]):
        mean = A.velocities.before[d] + 0.5 * A.velocities.change[d]
        A.clock.y.current[nq + d] = mean + part * A.velocities.impulsive[d]
    return evaluate_motion(A, True)


@formula
def correct_velocity_forces(A, h):
    """Recompute velocity-dependent forces of the second half of the step with velocities after impulses (joint
    coordinates).

    Coriolis terms compensate the change of the mass matrix along the motion. With the velocities before, impulses would
    supply energy. In absolute coordinates the projection at the end of the step has this effect.
    """
    y, z = A.clock.y, A.S.sizes.coordinates + A.velocities.before.shape[0]
    if A.S.sizes.solver == SCHUR or not velocities_changed(A):
        return
    for i in range(z, y.shape[1]):
        y[2, i] = A.clock.K[0, i]
    if evaluate_at_mean(A, 1.0) == 0:
        for d in range(A.velocities.before.shape[0]):
            vdot = A.clock.K[0, A.S.sizes.coordinates + d]
            A.velocities.after[d] += 0.5 * (h * vdot - A.velocities.smooth[d])
        for i in range(A.count.springs):  # their dampers use the velocities after impulses already
            s = 0.5 * h * A.springs.damping[i] * spring_rate(A, i, A.velocities.impulsive)
            add_spring_response(A, i, s, A.velocities.after)
    for i in range(z, y.shape[1]):
        A.clock.K[0, i] = y[2, i]


@formula
def contact_impulses(A, P, X, total):
    """Add the generalised impulses of all contacts and single rows."""
    for c in range(P.size[0]):
        for side in range(2):
            at = P.block[c, side]
            if P.at[c, side] <= -2 and at >= 0:
                g = -2 - P.at[c, side]
                a = A.group[g]
                n = A.group[g + 1] - a
                sign = 1.0 if side == 1 else -1.0
                for i in range(6 if P.turn.shape[0] > 0 else 3):
                    s = sign * (X.p[c, i] if i < 3 else X.torque[c, i - 3])
                    for j in range(n):
                        d = P.columns[at + j]
                        if d < 0:
                            break
                        total[a + d] += s * P.J[at + i * n + d]
    for k in range(P.size[3]):
        g, at = P.line_at[k, 0], P.line_at[k, 1]
        for d in range(A.group[g + 1] - A.group[g]):
            total[A.group[g] + d] += X.line[k] * P.J[at + d]


@formula
def account_works(A, h):
    """Compute the mean powers of the step in the integrator state: forces at mean velocities, drivers with all
    impulses.
    """
    S, W = A.S, A.W
    if velocities_changed(A):
        evaluate_at_mean(A, 0.5)
    save_gravity_work(A, h)
    work = A.clock.K[0, S.sizes.coordinates + A.velocities.before.shape[0] :]
    for r in range(S.rows.law.shape[0]):
        if S.rows.work[r] >= 0:
            work[S.rows.work[r]] = (A.reactions.smooth[r] + A.reactions.impulse[r] / h) * W.rows.nu[r]
    for b in range(S.tree.parent.shape[0]):
        if S.tree.law[b] >= 0:
            d = S.tree.v[b]
            mean = 0.5 * (A.velocities.before[d] + A.velocities.after[d])
            work[S.tree.work[b]] = A.velocities.effort[d] * mean
    for d in range(A.velocities.before.shape[0]):
        A.velocities.displacement[d] = A.velocities.after[d] - A.velocities.before[d]
    for i in range(A.count.springs):
        k = int(A.springs.force[i])
        if S.forces.work[k] >= 0:
            rate = spring_rate(A, i, A.velocities.before) + 0.5 * spring_rate(A, i, A.velocities.displacement)
            work[S.forces.work[k]] -= spring_impulse(A, h, i, A.velocities.before, A.velocities.displacement) / h * rate


@formula
def save_poses(A):
    """Store the poses of the movers as evaluated last."""
    for k in range(A.mover.shape[0]):
        store3(A.pose, k, 0, load3(A.W.bodies.position, A.mover[k, 0], 0))
        store9(A.pose, k, 3, load9(A.W.bodies.rotation, A.mover[k, 0], 0))


@formula
def has_displacement(displacements):
    """Return whether any displacement is nonzero."""
    found = False
    for d in range(displacements.shape[0]):
        found = found or displacements[d] != 0.0
    return found


@formula
def finish_step(A, M, X):
    """Advance with the mean velocities and the displacements in ``X.wide``, onto the constraints. Returns a status.

    It may be called again with other displacements.
    """
    S, nq, nv, h = A.S, A.S.sizes.coordinates, A.velocities.before.shape[0], A.real.step
    y, way = A.clock.y, A.velocities.displacement
    for d in range(nv):
        way[d] = 0.5 * h * A.velocities.after[d] + h * X.wide[d]
        y[0, nq + d] = A.velocities.after[d]
    for i in range(nq):
        y[0, i] = y[2, i]
    retract(S, y[0, :nq], way)
    for i in range(nq + nv, y.shape[1]):
        y[0, i] = y[1, i] + h * A.clock.K[0, i]
    A.clock.real.t = A.real.time + h
    correct_spring_lengths(A)
    A.real.kinetic = -1.0
    if velocities_changed(A) or has_displacement(X.wide):
        call(A.door[0], S, A.W, A.R, A.clock, A.output, POSITION)
        A.real.kinetic = kinetic_energy(A)
        save_poses(A)
    A.W.options.placed = 1.0
    status = call(A.door[0], S, A.W, A.R, A.clock, A.output, ARRIVE)
    A.W.options.placed = 0.0
    if status != 0:
        return status
    call(A.door[0], S, A.W, A.R, A.clock, A.output, POSITION)
    write_body_states(A, M, True)
    return 0


@vectorised_kernel
def mechanism_kernel(
    A: MechanismTables, M: Movers, C: ContactTable, P: ContactProblem, X: ContactSolution, task: int
) -> int:
    """Run a task of the jointed mechanism ``A`` with movers, contacts, problem and state of the step.

    Tasks: see `stepping_tables`. Returns 0, TABLES_FULL, or the engine's status.
    """
    return run_task(A, M, C, P, X, task)
