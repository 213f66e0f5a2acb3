"""Tables of impulse time stepping: free bodies, contact history, state of the run, the mechanism.

Movers are numbered: first the free bodies, each a node of the cone problem with the same number, then bodies of the
mechanism. All vectors are in world axes unless stated otherwise. The mechanism is a `System` of the bodies that have
joints, drivers or forces. Each connected part of it (not by way of ground) is a group of the cone problem with
contiguous velocities: group g has those from ``group[g]`` to ``group[g + 1]``.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ...compiler.struct_layout import (
    Column,
    Float1,
    Float2,
    Int1,
    Int2,
    Record,
    RecordLayout,
    Struct,
    Vector3,
    Vector6,
    struct_layout,
)
from ...engine.calls import OutputBuffer
from ...numerics.integrators.butcher_tableaux import Tableau
from ...numerics.integrators.time_loop import StepState
from ...tables.table_definitions import System, Work

PRESSES, MIDDLE_WANTED, MIDDLE_FOUND = 1.0, 2.0, 3.0  # ContactMemory.persistence
NO_RESTITUTION, POISSON, NEWTON, MOREAU = range(4)  # RunOptions.restitution_law


class FreeBodyNumbers(Record, kind="Float", rows=True):
    """Masses of the free bodies; about the mass centre, in body axes (xx yy zz xy xz yz)."""

    mass: Column
    inverse_mass: Column
    inertia: Vector6
    inverse_inertia: Vector6
    isotropic: Column  # 1 if the inertia is the same about every axis


class FreeBodies(NamedTuple):
    """Bodies on which only gravity and contact act."""

    body: FreeBodyNumbers
    turn: Float2  # (n, 4): unit quaternion, body axes to the world
    before: Float2  # (n, 6): velocities at the start of the step
    move: Float2  # (n, 6): displacement velocities
    angle: Float1  # (n,): rotation [rad] about z since the start, if the inertia is isotropic
    start: Float2  # (movers, 18): poses of all movers at the start of the step, and twists


class ContactMemory(Record, kind="Float", rows=True):
    """Data of each contact that the next step reads; vectors in world axes."""

    impulse: Vector3
    sliding: Column  # 1 if sliding, 0 if sticking, -1 without force
    hit: Column  # whether it has an impact
    impact_impulse: Vector3
    impact_velocity: Vector3  # before the impact
    stiffness: Column  # of compliant contacts; 0: rigid
    overlap: Column  # at the start of the step
    overlap_rate: Column
    implicit_share: Column
    law_overlap: Column  # of the law, at the end
    end_gap: Column
    spring_overlap: Column  # part of the overlap that stores elastic energy
    torque: Vector3  # impulse
    impact_spin: Vector3  # relative angular velocity before an impact
    middle_bias: Vector3  # part of the bias that is no velocity of a surface or gap
    start_velocity: Vector3  # relative velocity at the start of the step
    persistence: Column  # 0 no, PRESSES (it pressed in the step before and is at rest along the normal), MIDDLE_WANTED
    # (its rows are also needed in the middle of the step), MIDDLE_FOUND (they were found, its bias is that of the mean)


class StoredContacts(NamedTuple):
    """Stored data of each contact; one for each of the two tables of contacts."""

    memory: ContactMemory


class RunTimes(Record, kind="Float"):
    """Times of a run [s]."""

    now: float
    step: float
    last_step: float  # the step before, 0 if there was none
    longest_step: float  # the undivided step


class RunTolerances(Record, kind="Float"):
    """What counts as nothing."""

    rebound_speed: float  # speed below which nothing bounces [m/s]
    overlap: float  # negligible overlap [m]
    velocity: float  # allowed residual of velocities [m/s]
    position: float  # allowed residual of displacements over a step [m/s]
    reported: float  # residual over the step above which an unconverged solve is reported [m/s^2]


class RunSums(Record, kind="Float"):
    """Energies since the start [J], in the order of `results.energy.EXCHANGE_SIGNS`."""

    friction_loss: float
    impact_loss: float
    surface_work: float  # supplied by moving surfaces
    numerical_loss: float  # rows that change within a step, displacements out of overlaps, damping
    elastic_energy: float  # now stored in compliant contacts
    elastic_at_start: float  # stored there at the start


class RunExtremes(Record, kind="Float"):
    """Largest errors of a run."""

    overlap: float  # gap (< 0) [m]
    overlap_at_start: float  # [m]
    residual: float  # of velocities [m/s]
    force_residual: float
    time: float  # of the largest residual [s]
    last_residual: float  # of the last solve for velocities [m/s]


class PartSums(Record, kind="Float", rows=True):
    """Results of the parts into which the contacts of a step are divided, which threads may compute at once."""

    friction_loss: Column  # energies as in `RunSums`
    impact_loss: Column
    surface_work: Column
    numerical_loss: Column
    deepest: Column  # smallest gap (< 0) at the end of the step [m]
    overlap: Column  # smallest gap (< 0) at its start [m]
    wanted: Column  # whether rows in the middle of the step are wanted


PARTS = 16  # of the contacts of a step, if they are divided


class RunOptions(Record, kind="Int"):
    """Options of a run."""

    velocity_iterations: int  # largest number
    position_iterations: int
    restitution_law: int
    sequential: int  # whether impacts are sequential
    compliant: int  # whether there may be compliant contacts
    divides_steps: int  # whether a step that is too long for their impacts is divided


class RunCounts(Record, kind="Int"):
    """Counters of a run."""

    steps_left: int
    steps_taken: int
    iterations: int
    unconverged: int  # solves
    most_contacts: int
    impacts: int
    reduced_expansions: int
    endless_impacts: int  # steps whose impacts did not end
    first_struck: int  # first mover of a mechanism that had an impact before the step


class RunAddresses(Record, kind="Int"):
    """Addresses of kernels."""

    search: int
    velocities: int
    positions: int
    impacts: int
    mechanism: int  # 0: there is none


class SteppingState(NamedTuple):
    """Times, options and sums of a run."""

    gravity: Float1  # (3,) [m/s^2]
    times: RunTimes
    tolerances: RunTolerances
    sums: RunSums
    parts: PartSums
    worst: RunExtremes
    options: RunOptions
    counts: RunCounts
    addresses: RunAddresses


def initial_run_state(gravity: np.ndarray) -> SteppingState:
    """Return the state of a run in which nothing is set but gravity."""
    return SteppingState(
        np.array(gravity, float), RunTimes.blank(), RunTolerances.blank(), RunSums.blank(), PartSums.blank(PARTS),
        RunExtremes.blank(), RunOptions.blank(), RunCounts.blank(), RunAddresses.blank(),
    )  # fmt: skip


# tasks of `mechanism_step.mechanism_kernel`, in the order of a step (``wide`` is `ContactSolution.wide`):
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
LINE_FRICTION, LINE_STOP, LINE_ROPE = range(3)  # SingleRows.kind
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
    joint_loss: float  # energy lost numerically at joints


class MechanismCounts(Record, kind="Int"):
    """Sizes and counters of the mechanism."""

    first: int  # first mover of the mechanism
    springs: int  # number of springs treated implicitly
    evaluated: int
    unsettled: int  # steps whose velocities did not converge
    needed: int  # numbers that J and Y must hold
    jobs: int  # rows that ``job`` must hold
    step_started: int  # whether a step has begun
    accept_unsettled: int  # whether the step is accepted with velocities that did not converge


class MechanismVelocities(NamedTuple):
    """Velocities of the mechanism [(nv,)]."""

    before: Float1  # at the start of the step
    change: Float1  # present iterate of their change without contact impulses
    smooth: Float1  # that change from the evaluation at half of it
    effort: Float1  # of drivers there
    impulse: Float1  # generalised impulses of contacts and single rows
    impulsive: Float1  # change by them
    after: Float1  # at the end
    displacement: Float1  # also scratch


class MechanismReactions(NamedTuple):
    """Multipliers of the constraint rows [(nr,)]."""

    smooth: Float1  # without contact
    impulse: Float1  # reaction impulses to contacts and single rows in the step
    impact: Float1  # to impacts before it


class Springs(Record, kind="Float", rows=True):
    """Springs treated implicitly."""

    stiffness: Column
    damping: Column
    implicit_share: Column
    added_mass: Column  # addition to the mass matrix
    solution: Column  # scratch
    force: Column  # its number
    directions: Column  # their number
    direction: Column
    length: Column  # along the direction
    bias: Column  # acceleration
    first: Column  # velocities of its group: the first one
    end: Column  # and the one after the last


class SingleRows(Record, kind="Int", rows=True):
    """Single rows: joint friction, stops, ropes."""

    kind: Column
    quantity: Column  # measured
    force: Column  # that it replaces


class SingleRowLaws(Record, kind="Float", rows=True):
    """Laws of the single rows."""

    lower: Column  # bounds of a stop
    upper: Column
    restitution: Column
    stiffness: Column  # of a rope
    damping: Column
    length: Column  # free length
    arm: Column  # of friction
    load: Column  # joint load of friction
    reaction: Column  # force of the step


class ActiveRows(Record, kind="Int", rows=True):
    """Single rows that act in the step."""

    line: Column  # number of the single row + 1, negative for an upper stop
    group: Column
    first: Column  # start of its row


class Jobs(Record, kind="Int", rows=True):
    """Rows whose responses are computed together."""

    first: Column  # start of its J and Y
    rows: Column  # their number
    next: Column  # job of the group


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
    velocities: MechanismVelocities
    reactions: MechanismReactions
    springs: Springs
    spring_J: Float2  # (springs, nv)
    spring_Y: Float2  # (springs, nv)
    stiff: Float2  # (springs, springs): Cholesky factor
    mixing: Float2  # (MIXING_ROWS, nv)
    weight: Float2  # (MIXED_GUESSES + 1, MIXED_GUESSES + 1)
    line: SingleRows
    line_law: SingleRowLaws
    active: ActiveRows  # (2 lines)
    job: Jobs  # (2 contacts + lines)
    queue: Int1  # (ng,): the next job of each group
    queued_row: Int1  # (ng,): the next row of that job
    column: Int2  # (ng, COLUMNS): start of the row of each group whose response is in a column of ``response``, or -1
    response: Float2  # (nv, COLUMNS): responses that are computed together
    response_impulse: Float2  # (nr, COLUMNS): impulses of the joints in them
    spring_response: Float2  # (springs, COLUMNS): impulses of the springs in them
    loaded: Int1  # (bodies,): whether an impulse acts on a body in some column
    pose: Float2  # (movers, 12): before the projection onto the joints


def _empty_tables(layout: Struct) -> Any:
    """Return a named tuple of empty arrays."""
    parts: list[Any] = []
    for _, x in layout.fields:
        if isinstance(x, Struct):
            parts.append(_empty_tables(x))
        else:
            parts.append(
                x.of.blank(*[0] * (x.array.ndim - 1))
                if isinstance(x, RecordLayout)
                else np.zeros((0,) * x.ndim, x.dtype)
            )
    return layout.of(*parts)


def no_mechanism() -> MechanismTables:
    """Return empty tables of the types of a mechanism, for which the step loop is compiled."""
    return _empty_tables(struct_layout(MechanismTables))._replace(group=np.zeros(1, np.int64))
