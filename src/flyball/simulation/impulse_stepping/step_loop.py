"""The compiled step loop: contact search, impacts, velocities, displacements without overlap.

Joints are closed at the end of a step by the smallest displacement in the metric of the masses. This moves light links
and their contacts. Displacements are then computed again with the resulting gaps, until none is negative.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...collision.broad_phase.workspace import Search
from ...collision.contact_search import MIDWAY, NEW_VELOCITIES
from ...collision.contact_search import STEP as STEP_ON
from ...collision.tables import (
    AHEAD,
    BEFORE,
    DONE,
    FOUND,
    FULL_CONTACTS,
    GAP,
    MOVER,
    NORMAL,
    NUMBER,
    POINT,
    SHAPE_1,
    SHAPE_2,
    Contacts,
    Geometry,
    Movers,
)
from ...compiler.formulas import call, formula
from ...compiler.kernels import kernel
from ...math.vec import add, cross, dot, load3, load9, mm, store3, sub, transpose
from ...numerics.complementarity.contact_operator import apply_contact_impulse, contact_velocity
from ...numerics.complementarity.contact_problem import (
    CONVERGED,
    ContactProblem,
    ContactState,
    ContactWorkspace,
    SolverSettings,
)
from ...numerics.complementarity.solver_choice import SMALL_ISLAND_SOLVER, IslandSolver, prepare_solver
from ...tables.table_definitions import Surfaces
from .compliant_contact import (
    FEW_LAW_ITERATIONS,
    LAW_ITERATIONS,
    find_compliant_contacts,
    law_is_met,
    linearise_compliant_rows,
    remaining_gap,
    restore_free_velocities,
    start_compliant_rows,
    store_elastic_energy,
)
from .contact_constraints import (
    account_contact,
    account_rolling,
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
from .free_bodies import (
    clear_velocities,
    displace_bodies,
    mean_velocities,
    start_from_free_velocities,
    velocities_without_contact,
)
from .restitution import IMPACT_ROUNDS, clear_impact_impulses, find_impacts, resolve_impacts
from .stepping_tables import (
    ADDRESS_IMPACTS,
    ADDRESS_MECHANISM,
    ADDRESS_POSITIONS,
    ADDRESS_SEARCH,
    ADDRESS_VELOCITIES,
    COMPLIANT,
    ENDLESS_IMPACTS,
    GIVEN_BY_SURFACES,
    HISTORY_HIT,
    HISTORY_IMPACT_IMPULSE,
    HISTORY_PERSISTS,
    HISTORY_STIFFNESS,
    IMPACTS,
    ITERATIONS,
    LAST_RESIDUAL,
    LAST_STEP,
    LOST_FRICTION,
    LOST_IMPACT,
    MIDDLE_FOUND,
    MOST_CONTACTS,
    NO_OVERLAP_BELOW,
    NO_SOLUTION,
    NUMERICAL,
    OVERLAP_AT_START,
    POSITION_ITERATIONS,
    POSITION_TOLERANCE,
    REDUCED_EXPANSIONS,
    REPORTED_RESIDUAL,
    STEP,
    STEP_TOO_LONG,
    STEPS_LEFT,
    STEPS_TAKEN,
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
    TIME,
    UNCONVERGED,
    VELOCITY_ITERATIONS,
    VELOCITY_TOLERANCE,
    WORST_AT,
    WORST_FORCE,
    WORST_OVERLAP,
    WORST_RESIDUAL,
    ContactHistory,
    FreeBodies,
    MechanismTables,
    RunState,
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
    X: ContactState,
    W: ContactWorkspace,
    O: SolverSettings,
    pace: RunState,
) -> StepSolvers:
    """Bind a solver for velocities, positions and impacts; its addresses are stored in ``pace.door``."""
    found = [prepare_solver(name, P, X, W, O) for P in problems]
    for place, one in zip((ADDRESS_VELOCITIES, ADDRESS_POSITIONS, ADDRESS_IMPACTS), found, strict=True):
        pace.door[place] = one.kernel.address
    return StepSolvers(*(one.F for one in found))


def solver_counts(F: StepSolvers) -> np.ndarray:
    """Return the counts of solvers chosen for the velocity problem; empty where the choice is fixed."""
    return F.velocities.told if F.velocities.doors[SMALL_ISLAND_SOLVER] else np.zeros(0, np.int64)


LIFT_PASSES = 16
OVERLAP_FACTOR = 1e3  # overlap that a pass may leave, relative to the negligible one


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
    a, b = G.shape_i[C.at[c, SHAPE_1], MOVER], G.shape_i[C.at[c, SHAPE_2], MOVER]
    return shift_by_joints(A, M, b, n, load3(P.arm, c, 3)) - shift_by_joints(A, M, a, n, load3(P.arm, c, 0))


@formula
def overlaps_after_joints(G, A, M, C, P, Q, Y, aim, pace):
    """Return whether contacts overlap now; then set the gaps in ``Q`` to ``aim`` plus the change by the projection.

    ``aim`` has in column 0 the velocity that leaves no gap, with which ``Y`` was computed.
    """
    if not A.real.kinetic >= 0.0:
        return False
    h, worst = pace.real[STEP], 0.0
    for c in range(C.count[FOUND]):
        change = change_of_gap(G, A, M, C, P, c)
        if change != 0.0:
            worst = min(worst, h * (aim[c, 0] + contact_velocity(P, Y.v, Y.wide, c)[0]) + change)
    if worst >= -OVERLAP_FACTOR * pace.real[NO_OVERLAP_BELOW]:
        return False
    for c in range(C.count[FOUND]):
        Q.bias[c, 0] = aim[c, 0] + change_of_gap(G, A, M, C, P, c) / h
    Q.size[0] = C.count[FOUND]
    return True


@formula
def solve_cone_problem(address, P, X, W, O, F, pace, most, enough):
    """Call a solver and count its iterations; return its status."""
    O.count.most = most
    O.real.enough = enough
    pace.count[ITERATIONS] += call(address, P, X, W, O, F, 0)
    return O.count.ended


@formula
def call_mechanism(A, M, C, P, X, pace, task):
    """Run a task of the mechanism, if there is one; see `mechanism_step.run_task`."""
    if pace.door[ADDRESS_MECHANISM] == 0:
        return DONE
    return call(pace.door[ADDRESS_MECHANISM], A, M, C, P, X, task)


@formula
def free_velocities_of_all(A, M, C, P, X, N, pace):
    """Compute the velocities of all bodies at the end of the step without contact."""
    velocities_without_contact(N, M, P, X, pace)
    A.real.time, A.real.step = pace.real[TIME], pace.real[STEP]
    return call_mechanism(A, M, C, P, X, pace, TASK_FREE_VELOCITIES)


@formula
def solve_velocities(G, A, C, P, X, W, O, F, N, M, L, pace, now, before):
    """Solve the cone problem for the velocities at the end of the step, and record its residual.

    Returns DONE, or STEP_TOO_LONG for compliant contacts, before anything is solved.
    """
    warm_start(C, P, X, now, before)
    static_friction_of_sticking(G, C, P, L, X, pace, now)
    yielding = pace.count[COMPLIANT] != 0 and find_compliant_contacts(G, C, P, L, X, pace, now, before)
    start_from_free_velocities(N, M, X)
    call_mechanism(A, M, C, P, X, pace, TASK_BEGIN)
    if yielding and start_compliant_rows(G, C, P, L, X, pace, now, before):
        return STEP_TOO_LONG
    ended = solve_cone_problem(
        pace.door[ADDRESS_VELOCITIES],
        P,
        X,
        W,
        O,
        F.velocities,
        pace,
        pace.count[VELOCITY_ITERATIONS],
        pace.real[VELOCITY_TOLERANCE],
    )
    for n in range(LAW_ITERATIONS if yielding else 0):
        if law_is_met(linearise_compliant_rows(G, C, P, L, X, pace, now), O.real.residual, pace) or (
            ended != CONVERGED and n == FEW_LAW_ITERATIONS
        ):
            break
        restore_free_velocities(N, M, X)
        call_mechanism(A, M, C, P, X, pace, TASK_BEGIN)
        ended = solve_cone_problem(
            pace.door[ADDRESS_VELOCITIES],
            P,
            X,
            W,
            O,
            F.velocities,
            pace,
            pace.count[VELOCITY_ITERATIONS],
            pace.real[VELOCITY_TOLERANCE],
        )
    if ended != CONVERGED and O.real.residual > pace.real[REPORTED_RESIDUAL] * pace.real[STEP]:
        pace.count[UNCONVERGED] += 1
    pace.real[LAST_RESIDUAL] = O.real.residual
    if O.real.residual > pace.real[WORST_RESIDUAL]:
        pace.real[WORST_RESIDUAL] = O.real.residual
        pace.real[WORST_AT] = pace.real[TIME] + pace.real[STEP]
    pace.real[WORST_FORCE] = max(pace.real[WORST_FORCE], O.real.force_residual)
    call_mechanism(A, M, C, P, X, pace, TASK_APPLY_IMPULSES)
    return DONE


@formula
def solve_positions(G, A, M, C, P, Q, R, X, Y, W, O, F, N, L, pace, now):
    """Compute the displacements that leave no overlap, and close the gaps of persistent contacts, from mean velocities.

    min 1/2 d' M d over d with gap + h n . (u(v+ + move) + u(d)) >= 0: the cone problem without friction. The works of
    impulses are accounted for here, since the mean velocities are available.
    """
    h = pace.real[STEP]
    mean_velocities(N, X, Y)
    call_mechanism(A, M, C, P, Y, pace, TASK_MEAN_VELOCITIES)
    deepest = A.real.overrun if pace.door[ADDRESS_MECHANISM] != 0 else 0.0
    for c in range(C.count[FOUND]):
        u = contact_velocity(P, Y.v, Y.wide, c)
        gap = C.x[c, GAP] + h * u[0]
        if now[c, HISTORY_STIFFNESS] > 0.0:
            gap = remaining_gap(now, c, gap)
        else:
            pace.real[WORST_OVERLAP] = min(pace.real[WORST_OVERLAP], C.x[c, GAP])
        deepest = min(deepest, -abs(gap) if now[c, HISTORY_PERSISTS] == MIDDLE_FOUND else gap)
        Q.bias[c, 0] = R.bias[c, 0] = gap / h
        account_contact(P, X, c, u, pace, now)
        if P.turn.shape[0] > 0:
            account_rolling(P, X, Y, c, pace, now)
        for i in range(3):
            Y.p[c, i] = 0.0
    if pace.count[STEPS_TAKEN] == 0:
        pace.real[OVERLAP_AT_START] = pace.real[WORST_OVERLAP]
    clear_velocities(Y)
    if deepest < -pace.real[NO_OVERLAP_BELOW]:
        preload_displacements(C, P, X, Y, now)
        Q.size[0] = C.count[FOUND]
        solve_cone_problem(
            pace.door[ADDRESS_POSITIONS],
            Q,
            Y,
            W,
            O,
            F.positions,
            pace,
            pace.count[POSITION_ITERATIONS],
            pace.real[POSITION_TOLERANCE],
        )
    if pace.count[COMPLIANT] != 0:
        store_elastic_energy(G, C, P, L, X, Y, pace, now)


@formula
def preload_displacements(C, P, X, Y, now):
    """Start displacements of persistent contacts from their impulses, so that gaps close as far as these contacts
    press.
    """
    for c in range(C.count[FOUND]):
        if now[c, HISTORY_PERSISTS] == MIDDLE_FOUND:
            apply_contact_impulse(P, Y.v, Y.wide, c, (-X.p[c, 0], 0.0, 0.0))
            Y.p[c, 0] = X.p[c, 0]


@formula
def finish_on_joints(G, A, M, C, P, Q, R, X, Y, W, O, F, pace, now):
    """End the mechanism's step on its joints, and repeat displacements where that made contacts overlap. Returns a
    status.
    """
    for n in range(LIFT_PASSES + 1):
        if call_mechanism(A, M, C, P, Y, pace, TASK_FINISH) != DONE:
            return NO_SOLUTION
        if pace.door[ADDRESS_MECHANISM] == 0 or pace.count[COMPLIANT] != 0 or n == LIFT_PASSES:
            break
        if not overlaps_after_joints(G, A, M, C, P, Q, Y, R.bias, pace):
            break
        clear_velocities(Y)
        preload_displacements(C, P, X, Y, now)
        solve_cone_problem(
            pace.door[ADDRESS_POSITIONS],
            Q,
            Y,
            W,
            O,
            F.positions,
            pace,
            pace.count[POSITION_ITERATIONS],
            pace.real[POSITION_TOLERANCE],
        )
    return DONE


@formula
def energies_and_counts(A, pace):
    """Return the energies exchanged by contacts, stops and joints so far, numerical losses, and counts of impacts."""
    real, count = pace.real, pace.count
    energies = (
        real[LOST_IMPACT],
        real[LOST_FRICTION],
        real[GIVEN_BY_SURFACES],
        real[NUMERICAL],
        A.real.lost,
        A.real.astray,
    )
    return energies, (count[IMPACTS], count[REDUCED_EXPANSIONS], count[ENDLESS_IMPACTS])


@formula
def restore_start(N, M, A, X, pace, sums):
    """Restore poses, velocities, energies and counts at the start of the step, before its impacts."""
    restore_poses(N, M)
    for k in range(N.body.shape[0]):
        for i in range(6):
            X.v[k, i] = N.start[k, 12 + i]
    for d in range(X.wide.shape[0]):
        X.wide[d] = A.clock.y[1, A.S.sizes.coordinates + d]
    for r in range(A.lam.shape[1]):
        A.lam[2, r] = 0.0
    real, count = pace.real, pace.count
    energies, counts = sums
    real[LOST_IMPACT], real[LOST_FRICTION], real[GIVEN_BY_SURFACES], real[NUMERICAL], A.real.lost, A.real.astray = (
        energies
    )
    count[IMPACTS], count[REDUCED_EXPANSIONS], count[ENDLESS_IMPACTS] = counts


@formula
def search_again(G, M, C, H, B, Z, pace, now):
    """Search for contacts with the velocities after impacts. Returns a status.

    A contact that had an impact and has disappeared, or has another normal or point, is kept: its impulse acts where it
    did.
    """
    status, most = call(pace.door[ADDRESS_SEARCH], G, M, H, C, B, NEW_VELOCITIES), H.at.shape[0]
    n = H.count[FOUND]
    if status != DONE:
        C.count[FOUND] = n
        return status
    C.count[NUMBER] = H.count[NUMBER]
    for k in range(n):
        o = H.at[k, BEFORE]
        same = o >= 0 and not (had_impact(now, o) and contact_moved(C, o, H, k))
        store3(Z.p, k, 0, load3(now, o, HISTORY_IMPACT_IMPULSE) if same else (0.0, 0.0, 0.0))
        if same:
            now[o, HISTORY_HIT] = -1.0
        if o >= 0:
            H.at[k, BEFORE] = C.at[o, BEFORE]
    for o in range(C.count[FOUND]):
        if had_impact(now, o) and now[o, HISTORY_HIT] >= 0.0:
            if n < most:
                store3(Z.p, n, 0, load3(now, o, HISTORY_IMPACT_IMPULSE))
                copy_contact(C, o, H, n)
                H.at[n, BEFORE] = -1
            n += 1
    if n > most:
        C.count[FOUND] = n
        return FULL_CONTACTS
    for k in range(n):
        copy_contact(H, k, C, k)
        store3(now, k, HISTORY_IMPACT_IMPULSE, load3(Z.p, k, 0))
    C.count[FOUND] = n
    return DONE


@formula
def contact_moved(C, o, H, k):
    """Return whether contact k of H has another normal or point than contact o of C."""
    return load3(C.x, o, NORMAL) != load3(H.x, k, NORMAL) or load3(C.x, o, POINT) != load3(H.x, k, POINT)


@formula
def copy_contact(C, c, H, k):
    """Copy contact c of C to contact k of H."""
    for i in range(C.at.shape[1]):
        H.at[k, i] = C.at[c, i]
    for i in range(C.x.shape[1]):
        H.x[k, i] = C.x[c, i]


@formula
def resolve_all_impacts(G, A, M, C, H, B, P, R, X, Z, E, W, O, F, N, L, pace, now):
    """Resolve impacts repeatedly, since one impact may cause others nearby. Returns a status."""
    clear_impact_impulses(C, now)
    for _ in range(IMPACT_ROUNDS):
        if not find_impacts(G, C, P.at, P.bias, R, X, L, pace, now):
            return DONE
        if pace.door[ADDRESS_MECHANISM] != 0:
            call_mechanism(A, M, C, P, X, pace, TASK_CONSISTENT)
            find_impacts(G, C, P.at, P.bias, R, X, L, pace, now)
        resolve_impacts(G, C, P.bias, R, Z, E, X, W, O, F, L, pace, now)
        call_mechanism(A, M, C, P, Z, pace, TASK_IMPACT_IMPULSES)
        if free_velocities_of_all(A, M, C, P, X, N, pace) != DONE:
            return NO_SOLUTION
        status = search_again(G, M, C, H, B, Z, pace, now)
        if status != DONE:
            return status
        fill_rows(G, M, C, P, L, pace)
        if call_mechanism(A, M, C, P, X, pace, TASK_ROWS) != DONE:
            return TABLES_FULL
    pace.count[ENDLESS_IMPACTS] += 1
    return DONE


@formula
def continue_contacts(G, A, M, C, D, H, B, N, P, X, L, pace, now, before, hit):
    """Set the rows of persistent contacts in the middle of the step; see `contact_constraints`. Returns a status.

    hit: whether there were impacts.
    """
    if not find_persistent_contacts(G, M, C, D, N, P, X, L, pace, now, before, (A.count.first, hit)):
        return DONE
    move_half_step(N, M, X, pace.real[STEP])
    call_mechanism(A, M, C, P, X, pace, TASK_POSES)
    status = call(pace.door[ADDRESS_SEARCH], G, M, H, C, B, MIDWAY)
    found = status == DONE and middle_rows(G, M, C, H, P, L, now)
    restore_poses(N, M)
    if status != DONE:
        C.count[FOUND] = H.count[FOUND]
        return status
    if found:
        for c in range(C.count[FOUND]):
            P.at[c, 0], P.at[c, 1] = movers_of_contact(G, C, c)
        call_mechanism(A, M, C, P, X, pace, TASK_ROWS)
        bias_persistent_contacts(G, M, C, P, X, now, before)
    return DONE


@formula
def take_step(G, A, M, C, D, H, B, P, Q, R, X, Y, Z, E, W, O, F, N, L, pace, now, before):
    """Take one time step; if it fails, the state at its start is restored. Returns a status."""
    save_start(N, M, X)
    sums = energies_and_counts(A, pace)
    status = attempt_step(G, A, M, C, D, H, B, P, Q, R, X, Y, Z, E, W, O, F, N, L, pace, now, before)
    if status != DONE:
        restore_start(N, M, A, X, pace, sums)
    return status


@formula
def attempt_step(G, A, M, C, D, H, B, P, Q, R, X, Y, Z, E, W, O, F, N, L, pace, now, before):
    """Compute impacts, velocities and displacements for `take_step`. Returns a status."""
    if free_velocities_of_all(A, M, C, P, X, N, pace) != DONE:
        return NO_SOLUTION
    B.real[AHEAD] = pace.real[STEP]
    status = call(pace.door[ADDRESS_SEARCH], G, M, C, D, B, STEP_ON)
    if status != DONE:
        return status
    fill_rows(G, M, C, P, L, pace)
    if call_mechanism(A, M, C, P, X, pace, TASK_ROWS) != DONE:
        return TABLES_FULL
    before_impacts = pace.count[IMPACTS]
    status = resolve_all_impacts(G, A, M, C, H, B, P, R, X, Z, E, W, O, F, N, L, pace, now)
    if status != DONE:
        return status
    status = continue_contacts(G, A, M, C, D, H, B, N, P, X, L, pace, now, before, pace.count[IMPACTS] > before_impacts)
    if status != DONE:
        return status
    status = solve_velocities(G, A, C, P, X, W, O, F, N, M, L, pace, now, before)
    if status != DONE:
        return status
    solve_positions(G, A, M, C, P, Q, R, X, Y, W, O, F, N, L, pace, now)
    if finish_on_joints(G, A, M, C, P, Q, R, X, Y, W, O, F, pace, now) != DONE:
        return NO_SOLUTION
    displace_bodies(N, M, X, Y.v, pace)
    call_mechanism(A, M, C, P, X, pace, VELOCITIES_AFTER)
    pace.real[TIME] += pace.real[STEP]
    pace.real[LAST_STEP] = pace.real[STEP]
    pace.count[STEPS_TAKEN] += 1
    pace.count[STEPS_LEFT] -= 1
    pace.count[MOST_CONTACTS] = max(pace.count[MOST_CONTACTS], C.count[FOUND])
    return DONE


@formula
def run_steps(G, A, M, C, D, H, B, P, Q, R, X, Y, Z, E, W, O, F, N, L, pace, T, U):
    """Run the steps; see `step_loop_kernel`."""
    while pace.count[STEPS_LEFT] > 0:
        if pace.count[STEPS_TAKEN] % 2 == 0:
            status = take_step(G, A, M, C, D, H, B, P, Q, R, X, Y, Z, E, W, O, F, N, L, pace, T.kept, U.kept)
        else:
            status = take_step(G, A, M, D, C, H, B, P, Q, R, X, Y, Z, E, W, O, F, N, L, pace, U.kept, T.kept)
        if status != DONE:
            return status
    return DONE


@kernel
def step_loop_kernel(
    G: Geometry,
    A: MechanismTables,
    M: Movers,
    C: Contacts,
    D: Contacts,
    H: Contacts,
    B: Search,
    P: ContactProblem,
    Q: ContactProblem,
    R: ContactProblem,
    X: ContactState,
    Y: ContactState,
    Z: ContactState,
    E: ContactState,
    W: ContactWorkspace,
    O: SolverSettings,
    F: StepSolvers,
    N: FreeBodies,
    L: Surfaces,
    pace: RunState,
    T: ContactHistory,
    U: ContactHistory,
) -> int:
    """Take ``pace.count[STEPS_LEFT]`` steps. Returns a status: of the contact search, TABLES_FULL, NO_SOLUTION or
    STEP_TOO_LONG.
    """
    return run_steps(G, A, M, C, D, H, B, P, Q, R, X, Y, Z, E, W, O, F, N, L, pace, T, U)
