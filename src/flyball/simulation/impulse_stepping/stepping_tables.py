"""Tables of impulse time stepping: free bodies, contact history, state of the run, the mechanism.

Movers are numbered: first the free bodies, each a node of the cone problem with the same number, then bodies of the
mechanism. All vectors are in world axes unless stated otherwise. The mechanism is a `System` of the bodies that have
joints, drivers or forces. Each connected part of it (not by way of ground) is a group of the cone problem with
contiguous velocities: group g has those from ``group[g]`` to ``group[g + 1]``.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ...compiler.struct_layout import Float1, Float2, Int1, Int2, Record, RecordLayout, Struct, struct_layout
from ...engine.calls import OutputBuffer
from ...numerics.integrators.butcher_tableaux import Tableau
from ...numerics.integrators.time_loop import StepState
from ...tables.table_definitions import System, Work

# columns of FreeBodies.body: mass, its inverse, inertia and its inverse about the mass centre in body axes (each xx yy
# zz xy xz yz), 1 if the inertia is the same about every axis
FREE_MASS, FREE_PER_MASS, FREE_INERTIA, FREE_INVERSE, FREE_ROUND = 0, 1, 2, 8, 14
ANGLE = 6  # column of FreeBodies.move after velocities: rotation [rad] about z since the start, if inertia is isotropic
# columns of ContactHistory.kept: impulse in world axes; 1 if sliding, 0 if sticking, -1 without force; whether it has
# an impact, the impact's impulse in world axes, and the velocities before it; of compliant contacts: stiffness (0:
# rigid), overlap and its rate at the start of the step, implicit share s, overlap of the law and gap at the end, part
# of the overlap that stores elastic energy; torque impulse in world axes; relative angular velocity before an impact;
# part of the bias that is no velocity of a surface or gap; relative velocity at the start of the step, in world axes;
# whether it is persistent: 0 no, PRESSES (it pressed in the step before and is at rest along the normal), MIDDLE_WANTED
# (its rows are also needed in the middle of the step), MIDDLE_FOUND (they were found, and its bias is that of the mean)
HISTORY_IMPULSE, HISTORY_SLIDING, HISTORY_HIT, HISTORY_IMPACT_IMPULSE, HISTORY_IMPACT_VELOCITY = 0, 3, 4, 5, 8
(
    HISTORY_STIFFNESS,
    HISTORY_OVERLAP,
    HISTORY_OVERLAP_RATE,
    HISTORY_SHARE,
    HISTORY_LAW_OVERLAP,
    HISTORY_END_GAP,
    HISTORY_SPRING_OVERLAP,
) = range(11, 18)
HISTORY_TORQUE, HISTORY_IMPACT_SPIN, HISTORY_MIDDLE_BIAS, HISTORY_START_VELOCITY, HISTORY_PERSISTS = 18, 21, 24, 27, 30
HISTORY_COLUMNS = 31  # columns
PRESSES, MIDDLE_WANTED, MIDDLE_FOUND = 1.0, 2.0, 3.0  # ContactHistory.kept[:, HISTORY_PERSISTS]
# entries of RunState.real: time, step; gravity; speed below which nothing bounces; negligible overlap [m]; allowed
# residual [m/s] of velocities and of positions; residual over the step [m/s^2] above which an unconverged solve is
# reported
TIME, STEP, GRAVITY, NO_BOUNCE_BELOW, NO_OVERLAP_BELOW, VELOCITY_TOLERANCE, POSITION_TOLERANCE, REPORTED_RESIDUAL = (
    0,
    1,
    2,
    5,
    6,
    7,
    8,
    9,
)
# ... and sums: work lost in friction and in impacts, work supplied by moving surfaces; largest overlap and residuals,
# time of the largest residual, overlap at the start
(
    LOST_FRICTION,
    LOST_IMPACT,
    GIVEN_BY_SURFACES,
    WORST_OVERLAP,
    WORST_RESIDUAL,
    WORST_FORCE,
    WORST_AT,
    OVERLAP_AT_START,
) = range(10, 18)
STORED_ENERGY, STORED_AT_START = 18, 19  # energy in compliant contacts: now, and at the start
LAST_STEP = 20  # the step before, 0 if there was none
NUMERICAL = 21  # energy lost numerically: rows that change within a step, displacements out of overlaps, damping
LONGEST_STEP = 22  # the undivided step
LAST_RESIDUAL = 23  # residual [m/s] of the last solve for velocities
REALS = 24
# entries of RunState.count: steps still to take, steps taken; largest number of iterations for velocities and
# positions; law of restitution; iterations done, unconverged solves, largest number of contacts; number of impacts, and
# of those with reduced expansion; whether impacts are sequential; whether there may be compliant contacts, and whether
# a step that is too long for their impacts is divided; steps whose impacts did not end
(
    STEPS_LEFT,
    STEPS_TAKEN,
    VELOCITY_ITERATIONS,
    POSITION_ITERATIONS,
    RESTITUTION_LAW,
    ITERATIONS,
    UNCONVERGED,
    MOST_CONTACTS,
    IMPACTS,
    REDUCED_EXPANSIONS,
    SEQUENTIAL,
    COMPLIANT,
) = range(12)
DIVIDES_STEPS, ENDLESS_IMPACTS = 12, 13
COUNTS = 16
# entries of RunState.door: addresses of the contact search, of the solvers of velocities, positions, impacts, and of
# the mechanism (0: there is none)
ADDRESS_SEARCH, ADDRESS_VELOCITIES, ADDRESS_POSITIONS, ADDRESS_IMPACTS, ADDRESS_MECHANISM = range(5)
NO_RESTITUTION, POISSON, NEWTON, MOREAU = range(4)  # RunState.count[RESTITUTION_LAW]


class FreeBodies(NamedTuple):
    """Bodies on which only gravity and contact act."""

    body: Float2  # (n, 16)
    turn: Float2  # (n, 4): unit quaternion, body axes to the world
    before: Float2  # (n, 8): velocities at the start of the step
    move: Float2  # (n, 8): displacement velocities
    start: Float2  # (movers, 18): poses of all movers at the start of the step, and twists


class ContactHistory(NamedTuple):
    """Stored data of each contact; one for each of the two tables of contacts."""

    kept: Float2  # (capacity, HISTORY_COLUMNS)


class RunState(NamedTuple):
    """Time, options and sums of a run."""

    real: Float1  # (REALS,)
    count: Int1  # type: ignore[assignment]  # (COUNTS,)
    door: Int1  # (8,)


# tasks of `mechanism_step.mechanism_kernel`, in the order of a step (``wide`` is `ContactState.wide`):
# START: evaluate the start of a motion. FREE_VELOCITIES: velocities without impulses, from those before the step in
# ``wide``; movers' twists follow. BEGIN: write them to ``wide``. ROWS: rows of contacts. APPLY_IMPULSES: read the
# solved velocities from ``wide`` and write consistent ones there. MEAN_VELOCITIES: write the mean velocities to
# ``wide``, and set single rows for the position solve. FINISH: move by these and the displacements in ``wide``.
# FINAL_VELOCITIES: write the velocities at the end to ``wide``. Also IMPACT_IMPULSES: account for the impulses of
# impacts before the step. POSES: write the poses last evaluated. CONSISTENT: make velocities in ``wide`` before an
# impact consistent with the joints at the rows' positions
(
    TASK_START,
    TASK_FREE_VELOCITIES,
    TASK_BEGIN,
    TASK_ROWS,
    TASK_APPLY_IMPULSES,
    TASK_MEAN_VELOCITIES,
    TASK_FINISH,
    TASK_FINAL_VELOCITIES,
    TASK_IMPACT_IMPULSES,
    TASK_POSES,
    TASK_CONSISTENT,
) = range(11)
# rows of MechanismTables.wide: velocities at the start of the step; the present iterate of their change without
# contact impulses, that change from the evaluation at half of it, and the drivers' efforts there; generalised impulses
# of contacts and single rows, and the change by them; velocities at the end; displacement (also scratch)
V_BEFORE, V_CHANGE, V_SMOOTH, EFFORTS, GENERALISED_IMPULSE, V_IMPULSIVE, V_AFTER, STEP_DISPLACEMENT = range(8)
# columns of MechanismTables.spring_x: stiffness, damping, implicit share b, addition to the mass matrix, scratch,
# number of the force, its number of directions, the direction, length along it; bias acceleration
(
    SPRING_K,
    SPRING_C,
    SPRING_SHARE,
    SPRING_ADDED_MASS,
    SPRING_SOLUTION,
    SPRING_FORCE,
    SPRING_DIRECTIONS,
    SPRING_DIRECTION,
    SPRING_LENGTH,
    SPRING_BIAS,
) = range(10)
# columns of MechanismTables.job: start of its J and Y, number of rows, next job of the group
JOB_AT, JOB_ROWS, JOB_NEXT = range(3)
# columns of MechanismTables.line, the single rows: kind (joint friction, stop, rope), measured quantity, force that it
# replaces
LINE_KIND, LINE_QUANTITY, LINE_FORCE = range(3)
LINE_FRICTION, LINE_STOP, LINE_ROPE = range(3)
# columns of MechanismTables.line_x: bounds and restitution of a stop; stiffness, damping and free length of a rope;
# arm (in the first column) and joint load of friction; the force of the step
LINE_LOWER, LINE_UPPER, LINE_RESTITUTION, ROPE_K, ROPE_C, ROPE_LENGTH, FRICTION_LOAD, LINE_REACTION = range(8)
# columns of MechanismTables.active: number of the single row + 1, negative for an upper stop; group; start of its row
LINE_OF, LINE_GROUP, LINE_AT = range(3)
# status: tables too small (task ROWS); the engine failed; velocities did not converge; step too long for compliant
# contacts
TABLES_FULL, NO_SOLUTION, NOT_CONVERGED, STEP_TOO_LONG = 100, 101, 102, 103


class MechanismReals(Record, kind="Float"):
    """Time and energies of the mechanism within a step."""

    time: float
    step: float
    lost: float  # energy lost at stops
    overrun: float  # distance (< 0) by which a stop would be overrun
    potential: float  # potential energy of gravity
    gravity_work: float  # work of gravity over the step at the mean velocities
    kinetic: float  # kinetic energy before the projection onto the joints; -1 without contact impulses
    astray: float  # energy lost numerically at joints


class MechanismCounts(Record, kind="Int"):
    """Sizes and counters of the mechanism."""

    first: int  # first mover of the mechanism
    springs: int  # number of springs treated implicitly
    evaluated: int
    unsettled: int  # steps whose velocities did not converge
    needed: int  # numbers that J and Y must hold
    jobs: int  # rows that ``job`` must hold
    begun: int  # whether a step has begun
    accept_unsettled: int  # whether the step is accepted with velocities that did not converge


class MechanismTables(NamedTuple):
    """The jointed mechanism: tables, the engine's workspaces, and those of the step."""

    S: System
    W: Work
    R: Tableau
    clock: StepState
    output: OutputBuffer  # (4, width)
    slopes: OutputBuffer  # (forces, SLOPE_WIDTH)
    door: Int1  # (1,): the engine's address
    real: MechanismReals  # type: ignore[assignment]
    count: MechanismCounts  # type: ignore[assignment]
    mover: Int2  # (movers, 2): row of the body table, group
    group: Int1  # (ng + 1,)
    wide: Float2  # (8, nv)
    lam: Float2  # (3, nr): multipliers without contact; reaction impulses to contacts and single rows in the step;
    # those to impacts before it
    spring_x: Float2  # (springs, 10)
    spring_J: Float2  # (springs, nv)
    spring_Y: Float2  # (springs, nv)
    stiff: Float2  # (springs, springs): Cholesky factor
    mixing: Float2  # (MIXING_ROWS, nv)
    weight: Float2  # (MIXED_GUESSES + 1, MIXED_GUESSES + 1)
    line: Int2  # (lines, 3)
    line_x: Float2  # (lines, 8)
    active: Int2  # (2 lines, 3)
    job: Int2  # (2 contacts + lines, 3)
    queue: Int1  # (ng,): the next job of each group
    pose: Float2  # (movers, 12): before the projection onto the joints


def _empty_tables(layout: Struct) -> Any:
    """Return a named tuple of empty arrays."""
    parts: list[Any] = []
    for _, x in layout.fields:
        if isinstance(x, Struct):
            parts.append(_empty_tables(x))
        else:
            parts.append(x.of.blank() if isinstance(x, RecordLayout) else np.zeros((0,) * x.ndim, x.dtype))
    return layout.of(*parts)


def no_mechanism() -> MechanismTables:
    """Return empty tables of the types of a mechanism, for which the step loop is compiled."""
    return _empty_tables(struct_layout(MechanismTables))._replace(group=np.zeros(1, np.int64))
