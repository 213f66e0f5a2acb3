"""The compiled step loop: contact search, impacts, velocities, displacements without overlap.

Joints are closed at the end of a step by the smallest displacement in the metric of the masses. This moves light links
and their contacts. Displacements are then computed again with the resulting gaps, as long as that halves the overlap.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...collision.contact_search import MIDWAY, NEW_VELOCITIES
from ...collision.contact_search import STEP as STEP_ON
from ...collision.tables import (
    DONE,
    FULL_CONTACTS,
    ContactTable,
    Geometry,
    Movers,
    Search,
)
from ...compiler.formulas import call, formula
from ...compiler.kernels import kernel
from ...math.vec import add, cross, dot, load3, load9, mm, store3, sub, transpose
from ...numerics.complementarity.contact_operator import apply_contact_impulse, contact_velocity
from ...numerics.complementarity.contact_problem import (
    BLOCK_KERNEL,
    CONVERGED,
    ContactProblem,
    ContactSolution,
    ContactWorkspace,
    SolverSettings,
)
from ...numerics.complementarity.solver_choice import SMALL_ISLAND_SOLVER, IslandSolver, prepare_solver
from ...numerics.thread_team import call_chunks
from ...tables.table_definitions import Surfaces
from .contact_constraints import (
    account_contacts,
    bias_persistent_contacts,
    fill_rows,
    find_persistent_contacts,
    had_impact,
    middle_rows,
    move_half_step,
    movers_of_contact,
    restore_poses,
    save_start,
    static_friction_of_sticking,
    warm_start,
)
from .contact_laws import (
    FEW_LAW_ITERATIONS,
    IMPACT_ROUNDS,
    LAW_ITERATIONS,
    clear_impact_impulses,
    find_compliant_contacts,
    find_impacts,
    law_is_met,
    linearise_compliant_rows,
    resolve_impacts,
    restore_free_velocities,
    start_compliant_rows,
    store_elastic_energy,
)
from .free_bodies import (
    clear_velocities,
    displace_bodies,
    divide_space,
    mean_velocities,
    start_from_free_velocities,
    velocities_without_contact,
)
from .stepping_tables import (
    MIDDLE_FOUND,
    NO_SOLUTION,
    PARTS,
    STEP_TOO_LONG,
    TABLES_FULL,
    TASK_APPLY_IMPULSES,
    TASK_BEGIN,
    TASK_CONSISTENT,
    TASK_FINISH,
    TASK_FREE_VELOCITIES,
    TASK_IMPACT_IMPULSES,
    TASK_MEAN_VELOCITIES,
    TASK_POSES,
    TASK_ROWS,
    FreeBodies,
    MechanismTables,
    SteppingState,
    StoredContacts,
)
from .stepping_tables import TASK_FINAL_VELOCITIES as VELOCITIES_AFTER


class StepSolvers(NamedTuple):
    """Workspaces of the solver of each problem."""

    velocities: IslandSolver
    positions: IslandSolver
    impacts: IslandSolver


def bind_solvers(
    name: str,
    problems: tuple[ContactProblem, ContactProblem, ContactProblem],
    X: ContactSolution,
    W: ContactWorkspace,
    O: SolverSettings,
    state: SteppingState,
    team: np.ndarray,
) -> StepSolvers:
    """Bind a solver for velocities, positions and impacts; its addresses are stored in ``state.addresses``."""
    found = [prepare_solver(name, P, X, W, O, team) for P in problems]
    team[CONTACT_KERNEL] = contact_kernel.address
    to = state.addresses
    to.velocities, to.positions, to.impacts = (one.kernel.address for one in found)
    return StepSolvers(*(one.F for one in found))


def solver_counts(F: StepSolvers) -> np.ndarray:
    """Return the counts of solvers chosen for the velocity problem; empty where the choice is fixed."""
    return F.velocities.statistics if F.velocities.doors[SMALL_ISLAND_SOLVER] else np.zeros(0, np.int64)


LIFT_PASSES = 16
USEFUL_PASS = 0.5  # a pass that leaves a greater part of the overlap is the last one
OVERLAP_FACTOR = 1e3  # overlap that a pass may leave, relative to the negligible one; at least that of its tolerance


@formula
def shift_by_joints(A, M, mover, axis, arm):
    """Return the displacement of a point of a mover along an axis by the projection onto the joints."""
    k = mover - A.count.first
    if k < 0:
        return 0.0
    turn = mm(load9(M.pose, mover, 3), transpose(load9(A.pose, k, 3)))
    spin = (0.5 * (turn[7] - turn[5]), 0.5 * (turn[2] - turn[6]), 0.5 * (turn[3] - turn[1]))
    way = add(sub(load3(M.pose, mover, 0), load3(A.pose, k, 0)), cross(spin, arm))
    return dot(axis, way)


@formula
def change_of_gap(G, A, M, C, P, c):
    """Return the change of the gap of contact c by the projection onto the joints."""
    n = load3(P.frame, c, 0)
    a, b = G.shape.mover[C.at.shape_1[c]], G.shape.mover[C.at.shape_2[c]]
    return shift_by_joints(A, M, b, n, load3(P.arm, c, 3)) - shift_by_joints(A, M, a, n, load3(P.arm, c, 0))


@formula
def overlap_after_joints(G, A, M, C, P, Q, Y, aim, state):
    """Return the largest overlap of contacts now if it counts, or 0.

    Then the gaps in ``Q`` are set to ``aim`` plus the change by the projection. ``aim`` has in column 0 the velocity
    that leaves no gap, with which ``Y`` was computed.
    """
    if not A.real.kinetic >= 0.0:
        return 0.0
    h, worst = state.times.step, 0.0
    for c in range(C.count.found):
        change = change_of_gap(G, A, M, C, P, c)
        if change != 0.0:
            worst = min(worst, h * (aim[c, 0] + contact_velocity(P, Y.v, Y.wide, c)[0]) + change)
    if worst >= -max(OVERLAP_FACTOR * state.tolerances.overlap, h * state.tolerances.position):
        return 0.0
    for c in range(C.count.found):
        Q.bias[c, 0] = aim[c, 0] + change_of_gap(G, A, M, C, P, c) / h
    Q.size[0] = C.count.found
    return -worst


@formula
def solve_cone_problem(address, P, X, W, O, F, state, most, enough):
    """Call a solver and count its iterations; return its status."""
    O.count.most = most
    O.real.enough = enough
    state.counts.iterations += call(address, P, X, W, O, F, 0)
    return O.count.ended


@formula
def call_mechanism(A, M, C, P, X, state, task):
    """Run a task of the mechanism, if there is one; see `mechanism_step.run_task`."""
    if state.addresses.mechanism == 0:
        return DONE
    return call(state.addresses.mechanism, A, M, C, P, X, task)


FILL_ROWS, FIND_PERSISTENT, WARM_START, ACCOUNT = range(4)  # works on contacts one by one
CONTACT_KERNEL = BLOCK_KERNEL + 1  # place of the address of `contact_kernel` in the team of threads


@kernel
def contact_kernel(
    G: Geometry,
    M: Movers,
    C: ContactTable,
    D: ContactTable,
    P: ContactProblem,
    Q: ContactProblem,
    R: ContactProblem,
    X: ContactSolution,
    Y: ContactSolution,
    N: FreeBodies,
    L: Surfaces,
    state: SteppingState,
    T: StoredContacts,
    U: StoredContacts,
    task: int,
) -> int:
    """Do work task // PARTS on part task % PARTS of the contacts."""
    work, part, parts = task // PARTS, task % PARTS, parts_of_contacts(P)
    contacts = C.count.found * part // parts, C.count.found * (part + 1) // parts
    now, before = T.memory, U.memory
    if work == FILL_ROWS:
        fill_rows(G, M, C, P, L, state, contacts)
    elif work == FIND_PERSISTENT:
        state.parts.wanted[part] = find_persistent_contacts(G, M, C, D, N, P, X, L, state, now, before, contacts)
    elif work == WARM_START:
        warm_start(C, P, X, now, before, contacts)
        static_friction_of_sticking(G, C, P, L, X, state, now, contacts)
    else:
        account_contacts(C, P, Q, R, X, Y, state, now, part, contacts)
    return 0


@formula
def parts_of_contacts(P):
    """Return the number of parts into which contacts are divided."""
    return PARTS if P.half_slab.shape[0] > 0 else 1


@formula
def work_on_contacts(G, M, C, D, P, Q, R, X, Y, F, N, L, state, T, U, work):
    """Do a work on all contacts, on all threads; return the number of parts."""
    team, parts = F.velocities.team, parts_of_contacts(P)
    call_chunks(team, team[CONTACT_KERNEL], (G, M, C, D, P, Q, R, X, Y, N, L, state, T, U), work * PARTS, parts)
    return parts


@formula
def fill_all_rows(G, M, C, D, P, Q, R, X, Y, F, N, L, state, T, U):
    """Fill the contact problem except impulses and masses; its sizes too."""
    P.size[0] = C.count.found
    P.island[0], P.island[1] = 0, C.count.found
    work_on_contacts(G, M, C, D, P, Q, R, X, Y, F, N, L, state, T, U, FILL_ROWS)


@formula
def free_velocities_of_all(A, M, C, P, X, N, state):
    """Compute the velocities of all bodies at the end of the step without contact."""
    velocities_without_contact(N, M, P, X, state)
    A.real.time, A.real.step = state.times.now, state.times.step
    return call_mechanism(A, M, C, P, X, state, TASK_FREE_VELOCITIES)


@formula
def solve_velocities(G, A, C, D, P, Q, R, X, Y, W, O, F, N, M, L, state, T, U):
    """Solve the cone problem for the velocities at the end of the step, and record its residual.

    Returns DONE, or STEP_TOO_LONG for compliant contacts, before anything is solved.
    """
    now, before = T.memory, U.memory
    work_on_contacts(G, M, C, D, P, Q, R, X, Y, F, N, L, state, T, U, WARM_START)
    yielding = state.options.compliant != 0 and find_compliant_contacts(G, C, P, L, X, state, now, before)
    start_from_free_velocities(N, M, X)
    call_mechanism(A, M, C, P, X, state, TASK_BEGIN)
    if yielding and start_compliant_rows(G, C, P, L, X, state, now, before):
        return STEP_TOO_LONG
    ended = solve_cone_problem(
        state.addresses.velocities,
        P,
        X,
        W,
        O,
        F.velocities,
        state,
        state.options.velocity_iterations,
        state.tolerances.velocity,
    )
    for n in range(LAW_ITERATIONS if yielding else 0):
        if law_is_met(linearise_compliant_rows(G, C, P, L, X, state, now), O.real.residual, state) or (
            ended != CONVERGED and n == FEW_LAW_ITERATIONS
        ):
            break
        restore_free_velocities(N, M, X)
        call_mechanism(A, M, C, P, X, state, TASK_BEGIN)
        ended = solve_cone_problem(
            state.addresses.velocities,
            P,
            X,
            W,
            O,
            F.velocities,
            state,
            state.options.velocity_iterations,
            state.tolerances.velocity,
        )
    if ended != CONVERGED and O.real.residual > state.tolerances.reported * state.times.step:
        state.counts.unconverged += 1
    state.worst.last_residual = O.real.residual
    if O.real.residual > state.worst.residual:
        state.worst.residual = O.real.residual
        state.worst.time = state.times.now + state.times.step
    state.worst.force_residual = max(state.worst.force_residual, O.real.force_residual)
    call_mechanism(A, M, C, P, X, state, TASK_APPLY_IMPULSES)
    return DONE


@formula
def solve_positions(G, A, M, C, D, P, Q, R, X, Y, W, O, F, N, L, state, T, U):
    """Compute the displacements that leave no overlap, and close the gaps of persistent contacts, from mean velocities.

    min 1/2 d' M d over d with gap + h n . (u(v+ + move) + u(d)) >= 0: the cone problem without friction. The works of
    impulses are accounted for here, since the mean velocities are available.
    """
    now = T.memory
    mean_velocities(N, X, Y)
    call_mechanism(A, M, C, P, Y, state, TASK_MEAN_VELOCITIES)
    deepest = A.real.overrun if state.addresses.mechanism != 0 else 0.0
    s, parts = state.sums, state.parts
    for k in range(work_on_contacts(G, M, C, D, P, Q, R, X, Y, F, N, L, state, T, U, ACCOUNT)):
        s.friction_loss += parts.friction_loss[k]
        s.impact_loss += parts.impact_loss[k]
        s.surface_work += parts.surface_work[k]
        s.numerical_loss += parts.numerical_loss[k]
        deepest = min(deepest, parts.deepest[k])
        state.worst.overlap = min(state.worst.overlap, parts.overlap[k])
    if state.counts.steps_taken == 0:
        state.worst.overlap_at_start = state.worst.overlap
    clear_velocities(Y)
    if deepest < -state.tolerances.overlap:
        preload_displacements(C, P, X, Y, now)
        Q.size[0] = C.count.found
        solve_cone_problem(
            state.addresses.positions,
            Q,
            Y,
            W,
            O,
            F.positions,
            state,
            state.options.position_iterations,
            state.tolerances.position,
        )
    if state.options.compliant != 0:
        store_elastic_energy(G, C, P, L, X, Y, state, now)


@formula
def preload_displacements(C, P, X, Y, now):
    """Start displacements of persistent contacts from their impulses, so that gaps close as far as these contacts
    press.
    """
    for c in range(C.count.found):
        if now.persistence[c] == MIDDLE_FOUND:
            apply_contact_impulse(P, Y.v, Y.wide, c, (-X.p[c, 0], 0.0, 0.0))
            Y.p[c, 0] = X.p[c, 0]


@formula
def finish_on_joints(G, A, M, C, P, Q, R, X, Y, W, O, F, state, now):
    """End the mechanism's step on its joints, and repeat displacements where that made contacts overlap. Returns a
    status.
    """
    last = 1e300
    for n in range(LIFT_PASSES + 1):
        if call_mechanism(A, M, C, P, Y, state, TASK_FINISH) != DONE:
            return NO_SOLUTION
        if state.addresses.mechanism == 0 or state.options.compliant != 0 or n == LIFT_PASSES:
            break
        overlap = overlap_after_joints(G, A, M, C, P, Q, Y, R.bias, state)
        if not 0.0 < overlap < USEFUL_PASS * last:
            break
        last = overlap
        clear_velocities(Y)
        preload_displacements(C, P, X, Y, now)
        solve_cone_problem(
            state.addresses.positions,
            Q,
            Y,
            W,
            O,
            F.positions,
            state,
            state.options.position_iterations,
            state.tolerances.position,
        )
    return DONE


@formula
def energies_and_counts(A, state):
    """Return the energies exchanged by contacts, stops and joints so far, numerical losses, and counts of impacts."""
    s, n = state.sums, state.counts
    energies = (s.impact_loss, s.friction_loss, s.surface_work, s.numerical_loss, A.real.lost, A.real.joint_loss)
    return energies, (n.impacts, n.reduced_expansions, n.endless_impacts)


@formula
def restore_start(N, M, A, X, state, sums):
    """Restore poses, velocities, energies and counts at the start of the step, before its impacts."""
    restore_poses(N, M)
    for k in range(N.body.shape[0]):
        for i in range(6):
            X.v[k, i] = N.start[k, 12 + i]
    for d in range(X.wide.shape[0]):
        X.wide[d] = A.clock.y[1, A.S.sizes.coordinates + d]
    for r in range(A.reactions.smooth.shape[0]):
        A.reactions.impact[r] = 0.0
    s, n = state.sums, state.counts
    energies, counts = sums
    s.impact_loss, s.friction_loss, s.surface_work, s.numerical_loss, A.real.lost, A.real.joint_loss = energies
    n.impacts, n.reduced_expansions, n.endless_impacts = counts


@formula
def search_again(G, M, C, H, B, Z, state, now):
    """Search for contacts with the velocities after impacts. Returns a status.

    A contact that had an impact and has disappeared, or has another normal or point, is kept: its impulse acts where it
    did.
    """
    status, most = call(state.addresses.search, G, M, H, C, B, NEW_VELOCITIES), H.at.shape[0]
    n = H.count.found
    if status != DONE:
        C.count.found = n
        return status
    C.count.number = H.count.number
    for k in range(n):
        o = H.at.before[k]
        same = o >= 0 and not (had_impact(now, o) and contact_moved(C, o, H, k))
        store3(Z.p, k, 0, load3(now.impact_impulse, o, 0) if same else (0.0, 0.0, 0.0))
        if same:
            now.hit[o] = -1.0
        if o >= 0:
            H.at.before[k] = C.at.before[o]
    for o in range(C.count.found):
        if had_impact(now, o) and now.hit[o] >= 0.0:
            if n < most:
                store3(Z.p, n, 0, load3(now.impact_impulse, o, 0))
                copy_contact(C, o, H, n)
                H.at.before[n] = -1
            n += 1
    if n > most:
        C.count.found = n
        return FULL_CONTACTS
    for k in range(n):
        copy_contact(H, k, C, k)
        store3(now.impact_impulse, k, 0, load3(Z.p, k, 0))
    C.count.found = n
    return DONE


@formula
def contact_moved(C, o, H, k):
    """Return whether contact k of H has another normal or point than contact o of C."""
    return load3(C.x.normal, o, 0) != load3(H.x.normal, k, 0) or load3(C.x.point, o, 0) != load3(H.x.point, k, 0)


@formula
def copy_contact(C, c, H, k):
    """Copy contact c of C to contact k of H."""
    for i in range(C.at.shape[1]):
        H.at[k, i] = C.at[c, i]
    for i in range(C.x.shape[1]):
        H.x[k, i] = C.x[c, i]


@formula
def resolve_all_impacts(G, A, M, C, D, H, B, P, Q, R, X, Y, Z, E, W, O, F, N, L, state, T, U):
    """Resolve impacts repeatedly, since one impact may cause others nearby. Returns a status."""
    now = T.memory
    clear_impact_impulses(C, now)
    for _ in range(IMPACT_ROUNDS):
        if not find_impacts(G, C, P.at, P.bias, R, X, L, state, now):
            return DONE
        if state.addresses.mechanism != 0:
            call_mechanism(A, M, C, P, X, state, TASK_CONSISTENT)
            find_impacts(G, C, P.at, P.bias, R, X, L, state, now)
        resolve_impacts(G, C, P.bias, R, Z, E, X, W, O, F, L, state, now)
        call_mechanism(A, M, C, P, Z, state, TASK_IMPACT_IMPULSES)
        if free_velocities_of_all(A, M, C, P, X, N, state) != DONE:
            return NO_SOLUTION
        status = search_again(G, M, C, H, B, Z, state, now)
        if status != DONE:
            return status
        fill_all_rows(G, M, C, D, P, Q, R, X, Y, F, N, L, state, T, U)
        if call_mechanism(A, M, C, P, X, state, TASK_ROWS) != DONE:
            return TABLES_FULL
    state.counts.endless_impacts += 1
    return DONE


@formula
def continue_contacts(G, A, M, C, D, H, B, P, Q, R, X, Y, F, N, L, state, T, U):
    """Set the rows of persistent contacts in the middle of the step; see `contact_constraints`. Returns a status."""
    now, before, wanted = T.memory, U.memory, 0.0
    for k in range(work_on_contacts(G, M, C, D, P, Q, R, X, Y, F, N, L, state, T, U, FIND_PERSISTENT)):
        wanted += state.parts.wanted[k]
    if wanted == 0.0:
        return DONE
    move_half_step(N, M, X, state.times.step)
    call_mechanism(A, M, C, P, X, state, TASK_POSES)
    status = call(state.addresses.search, G, M, H, C, B, MIDWAY)
    found = status == DONE and middle_rows(G, M, C, H, P, L, now)
    restore_poses(N, M)
    if status != DONE:
        C.count.found = H.count.found
        return status
    if found:
        for c in range(C.count.found):
            P.at[c, 0], P.at[c, 1] = movers_of_contact(G, C, c)
        call_mechanism(A, M, C, P, X, state, TASK_ROWS)
        bias_persistent_contacts(G, M, C, P, X, now, before)
    return DONE


@formula
def take_step(G, A, M, C, D, H, B, P, Q, R, X, Y, Z, E, W, O, F, N, L, state, T, U):
    """Take one time step; if it fails, the state at its start is restored. Returns a status."""
    save_start(N, M, X)
    sums = energies_and_counts(A, state)
    status = attempt_step(G, A, M, C, D, H, B, P, Q, R, X, Y, Z, E, W, O, F, N, L, state, T, U)
    if status != DONE:
        restore_start(N, M, A, X, state, sums)
    return status


@formula
def attempt_step(G, A, M, C, D, H, B, P, Q, R, X, Y, Z, E, W, O, F, N, L, state, T, U):
    """Compute impacts, velocities and displacements for `take_step`. Returns a status."""
    if free_velocities_of_all(A, M, C, P, X, N, state) != DONE:
        return NO_SOLUTION
    B.real.horizon = state.times.step
    status = call(state.addresses.search, G, M, C, D, B, STEP_ON)
    if status != DONE:
        return status
    divide_space(M, P.half_slab, W.slab_bins, 2 * O.count.slabs)
    fill_all_rows(G, M, C, D, P, Q, R, X, Y, F, N, L, state, T, U)
    if call_mechanism(A, M, C, P, X, state, TASK_ROWS) != DONE:
        return TABLES_FULL
    before_impacts = state.counts.impacts
    status = resolve_all_impacts(G, A, M, C, D, H, B, P, Q, R, X, Y, Z, E, W, O, F, N, L, state, T, U)
    if status != DONE:
        return status
    state.counts.first_struck = A.count.first if state.counts.impacts > before_impacts else M.pose.shape[0]
    status = continue_contacts(G, A, M, C, D, H, B, P, Q, R, X, Y, F, N, L, state, T, U)
    if status != DONE:
        return status
    status = solve_velocities(G, A, C, D, P, Q, R, X, Y, W, O, F, N, M, L, state, T, U)
    if status != DONE:
        return status
    solve_positions(G, A, M, C, D, P, Q, R, X, Y, W, O, F, N, L, state, T, U)
    if finish_on_joints(G, A, M, C, P, Q, R, X, Y, W, O, F, state, T.memory) != DONE:
        return NO_SOLUTION
    displace_bodies(N, M, X, Y.v, state)
    call_mechanism(A, M, C, P, X, state, VELOCITIES_AFTER)
    state.times.now += state.times.step
    state.times.last_step = state.times.step
    state.counts.steps_taken += 1
    state.counts.steps_left -= 1
    state.counts.most_contacts = max(state.counts.most_contacts, C.count.found)
    return DONE


@formula
def run_steps(G, A, M, C, D, H, B, P, Q, R, X, Y, Z, E, W, O, F, N, L, state, T, U):
    """Run the steps; see `step_loop_kernel`."""
    while state.counts.steps_left > 0:
        if state.counts.steps_taken % 2 == 0:
            status = take_step(G, A, M, C, D, H, B, P, Q, R, X, Y, Z, E, W, O, F, N, L, state, T, U)
        else:
            status = take_step(G, A, M, D, C, H, B, P, Q, R, X, Y, Z, E, W, O, F, N, L, state, U, T)
        if status != DONE:
            return status
    return DONE


@kernel
def step_loop_kernel(
    G: Geometry,
    A: MechanismTables,
    M: Movers,
    C: ContactTable,
    D: ContactTable,
    H: ContactTable,
    B: Search,
    P: ContactProblem,
    Q: ContactProblem,
    R: ContactProblem,
    X: ContactSolution,
    Y: ContactSolution,
    Z: ContactSolution,
    E: ContactSolution,
    W: ContactWorkspace,
    O: SolverSettings,
    F: StepSolvers,
    N: FreeBodies,
    L: Surfaces,
    state: SteppingState,
    T: StoredContacts,
    U: StoredContacts,
) -> int:
    """Take ``state.counts.steps_left`` steps. Returns a status: of the contact search, TABLES_FULL, NO_SOLUTION or
    STEP_TOO_LONG.
    """
    return run_steps(G, A, M, C, D, H, B, P, Q, R, X, Y, Z, E, W, O, F, N, L, state, T, U)
