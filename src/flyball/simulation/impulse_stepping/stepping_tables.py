"""Tables of impulse time stepping: free bodies, contact history, state of the run, the mechanism.

Movers are numbered: first the free bodies, each a node of the cone problem with the same number, then bodies of
the mechanism. All vectors are along the world's axes unless said otherwise. The mechanism is a `System` of the
bodies that have joints, drivers or forces. Each connected part of it (not by way of ground) is a group of the cone
problem, whose velocities are neighbours; group g has those from ``group[g]`` to ``group[g + 1]``.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ...compiler.struct_layout import Float1, Float2, Int1, Int2, Record, RecordLayout, Struct, struct_layout
from ...engine.calls import OutputBuffer
from ...numerics.integrators.butcher_tableaux import Tableau
from ...numerics.integrators.time_loop import StepState
from ...tables.table_definitions import System, Work

# columns of Free.body: mass, its inverse, inertia and its inverse about the mass centre in body axes (each xx yy zz xy
# xz yz), 1 if the inertia is the same about every axis
FREE_MASS, FREE_PER_MASS, FREE_INERTIA, FREE_INVERSE, FREE_ROUND = 0, 1, 2, 8, 14
ANGLE = 6  # column of Free.move, behind velocities: angle [rad] about z turned since the start, of what is round
# columns of Tracks.kept: impulse in the world; 1 if it slides, 0 if it sticks, -1 without force; whether it is hit in
# an impact, impulse of that in the world, and its velocities before; of contacts that give way: stiffness (0: hard),
# overlap and its rate at the start of the step, share of its end in the law, overlap of the law and gap at
# the end, overlap that is its spring's; impulse of its torque in the world; relative angular
# velocity before an impact; part of its bias that is no velocity of a surface or gap; relative velocity at the start of
# the step, in the world; whether it goes on: 0, pressed, and at rest along the normal, in the step before (PRESSES), or
# besides with rows wanted in the middle of the step (WANTED), which are found, and make it a mean (MIDDLE)
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
PRESSES, MIDDLE_WANTED, MIDDLE_FOUND = 1.0, 2.0, 3.0  # Tracks.kept[:, GOES_ON]
# entries of Pace.real: time, step; gravity; speed below which nothing bounces; overlap [m] that is
# none; residual [m/s] that is enough for velocities and for positions; residual over the step [m/s^2] above which a
# solve that was cut is told
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
# ... and sums: work lost in friction, in impacts, given by surfaces that move; worst overlap and residuals seen, time
# of the worst residual, overlap at the start
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
STORED_ENERGY, STORED_AT_START = 18, 19  # energy in contacts that give way: now, and at the start
LAST_STEP = 20  # the step before, 0 if there was none
NUMERICAL = 21  # energy that the method took: rows that change within a step, displacements out of overlaps, damping
LONGEST_STEP = 22  # the step before it is divided
LAST_RESIDUAL = 23  # residual [m/s] of the last solve for velocities
REALS = 24
# entries of Pace.count: steps still to take, steps taken; most iterations for velocities and positions; law of
# restitution; iterations done, solves cut off, most contacts; how many impacts, in how many of them expansion was cut;
# whether they are one after the other; whether there may be contacts that give way, and whether a step that is too
# long for their impacts is divided; steps whose impacts did not end
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
# places in Pace.door: addresses of the search, of the solvers of velocities, positions, impacts, and of the mechanism
# (0: there is none)
ADDRESS_SEARCH, ADDRESS_VELOCITIES, ADDRESS_POSITIONS, ADDRESS_IMPACTS, ADDRESS_MECHANISM = range(5)
NO_RESTITUTION, POISSON, NEWTON, MOREAU = range(4)  # Pace.count[LAW]


class FreeBodies(NamedTuple):
    """Bodies on nothing but gravity and contact."""

    body: Float2  # (n, 16)
    turn: Float2  # (n, 4): unit quaternion, body axes to the world
    before: Float2  # (n, 8): velocities at the start of the step
    move: Float2  # (n, 8): velocities that bodies are displaced with
    start: Float2  # (movers, 18): poses of all movers at the start of the step, and twists


class ContactHistory(NamedTuple):
    """What is remembered of each contact; one for each of the two tables of contacts."""

    kept: Float2  # (capacity, TRACKS)


class RunState(NamedTuple):
    """Time, choices and sums of a run."""

    real: Float1  # (REALS,)
    count: Int1  # type: ignore[assignment]  # (COUNTS,)
    door: Int1  # (8,)


# what may be asked at the door (`mechanism_step.mechanism_kernel`), in the order of a step: the start of a motion; velocities without
# impulses, from those before the step in State.wide (movers' twists follow); those put there; rows of contacts into the
# problem; velocities found taken from State.wide, and put there as joints allow; the mean velocities put there, lines
# being made those of the second solve; the way gone with these and others beside them in State.wide; velocities at its
# end put there. Besides, impacts over before the step whose impulses stand in a state; poses as last evaluated;
# velocities in State.wide before an impact made those that joints allow where rows are
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
# rows of Joined.wide: velocities at the start of the step; their change without impulses of contact, as far as known,
# and what the evaluation at half the change makes of it, and of the drivers' efforts; generalised impulses of contacts
# and the rest, and what they change; velocities at the end; the way, scratch
V_BEFORE, V_CHANGE, V_SMOOTH, EFFORTS, GENERALISED_IMPULSE, V_IMPULSIVE, V_AFTER, STEP_DISPLACEMENT = range(8)
# columns of Joined.spring_x: stiffness, damping, share of the end of the step, what it adds to the masses, scratch,
# the force that it is of, its directions, which one it is, where it is along that;
# its bias acceleration
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
# columns of Joined.job: what is answered, where its J and Y begin, how many rows, the next one of the group
JOB_AT, JOB_ROWS, JOB_NEXT = range(3)
# columns of Joined.line, single rows that are there to act: what it is (friction in a joint, stop, rope), the quantity,
# the force that it stands for
LINE_KIND, LINE_QUANTITY, LINE_FORCE = range(3)
LINE_FRICTION, LINE_STOP, LINE_ROPE = range(3)
# columns of Joined.line_x: where a stop is, and by what it bounces off; of a rope stiffness, damping, free length; of
# friction (in the first) the arm, and the load of the joint; the force of the step
LINE_LOWER, LINE_UPPER, LINE_RESTITUTION, ROPE_K, ROPE_C, ROPE_LENGTH, FRICTION_LOAD, LINE_REACTION = range(8)
# columns of Joined.active: line of the step, + 1 and negative for an upper stop; its group; where its row begins
LINE_OF, LINE_GROUP, LINE_AT = range(3)
# what ROWS may return; what the loop says where the engine has a status; velocities that do not settle;
# a step in which contacts that give way are not resolved
TABLES_FULL, NO_SOLUTION, NOT_CONVERGED, STEP_TOO_LONG = 100, 101, 102, 103


class MechanismReals(Record, kind="Float"):
    """Time and energies of the mechanism within a step."""

    time: float
    step: float
    lost: float  # energy lost at stops
    overrun: float  # by how far (< 0) a stop would be overrun
    potential: float  # gravity's potential energy,
    gravity_work: float  # and its work over the step at the mean velocities
    kinetic: float  # energy before the mechanism was put onto its joints; -1 where nothing is hit
    astray: float  # energy that the method takes at joints


class MechanismCounts(Record, kind="Int"):
    """Sizes and counters of the mechanism."""

    first: int  # the first mover that is of the mechanism
    springs: int  # taken implicitly
    evaluated: int
    unsettled: int  # steps whose velocities did not settle
    needed: int  # numbers that J and Y must hold
    jobs: int  # rows that ``job`` must hold
    begun: int  # whether a step has begun
    accept_unsettled: int  # whether it is to be taken with velocities that did not settle


class MechanismTables(NamedTuple):
    """The mechanism: tables, the engine's rooms, and those of the step."""

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
    lam: Float2  # (3, nr): multipliers without contact; impulses of contacts and the rest over the step; those of
    # impacts before it
    spring_x: Float2  # (springs, 10)
    spring_J: Float2  # (springs, nv)
    spring_Y: Float2  # (springs, nv)
    stiff: Float2  # (springs, springs): Cholesky factor
    mixing: Float2  # (MIXING, nv)
    weight: Float2  # (MIXED + 1, MIXED + 1)
    line: Int2  # (lines, 3)
    line_x: Float2  # (lines, 8)
    active: Int2  # (2 lines, 3)
    job: Int2  # (2 contacts + lines, 3)
    queue: Int1  # (ng,): the next job of each group
    pose: Float2  # (movers, 12): before they were put onto the joints


def _empty_tables(layout: Struct) -> Any:
    """A named tuple of arrays without entries."""
    parts: list[Any] = []
    for _, x in layout.fields:
        if isinstance(x, Struct):
            parts.append(_empty_tables(x))
        else:
            parts.append(x.of.blank() if isinstance(x, RecordLayout) else np.zeros((0,) * x.ndim, x.dtype))
    return layout.of(*parts)


def no_mechanism() -> MechanismTables:
    """Tables of no mechanism, of the types of all others: what the loop of steps is compiled for."""
    return _empty_tables(struct_layout(MechanismTables))._replace(group=np.zeros(1, np.int64))
