"""What joints hold together, in a step by impulses: the tables of the mechanism, and rooms to work in.

The mechanism is a `System` of its own, of the bodies that have joints, drivers or forces, behind the engine's door.
Each part of it that is connected (not by way of ground) is a group of the cone problem, whose velocities are
neighbours; group g has those from ``group[g]`` to ``group[g + 1]``.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ..compiler.layout import Float2, Int1, Int2, Record, RecordLayout, Struct, struct
from ..equations.tasks import Sheet
from ..numerics.integrators.clock import Clock
from ..numerics.integrators.tableaux import Tableau
from ..tables.system import System, Work

# what may be asked at the door (`joints.joined`), in the order of a step: the start of a motion; velocities without
# impulses, from those before the step in State.wide (movers' twists follow); those put there; rows of contacts into the
# problem; velocities found taken from State.wide, and put there as joints allow; the mean velocities put there, lines
# being made those of the second solve; the way gone with these and others beside them in State.wide; velocities at its
# end put there. Besides, impacts over before the step whose impulses stand in a state; poses as last evaluated;
# velocities in State.wide before an impact made those that joints allow where rows are
START, FREE, BEGIN, ROWS, KEEP, MEAN, FINISH, VELOCITIES, KICKED, POSES, CONSISTENT = range(11)
# rows of Joined.wide: velocities at the start of the step; their change without impulses of contact, as far as known,
# and what the evaluation at half the change makes of it, and of the drivers' efforts; generalised impulses of contacts
# and the rest, and what they change; velocities at the end; the way, scratch
V_BEFORE, CHANGE, SMOOTH, EFFORTS, IMPULSE, STRUCK, V_AFTER, WAY = range(8)
# columns of Joined.spring_x: stiffness, damping, share of the end of the step, what it adds to the masses, scratch,
# the force that it is of, its directions, which one it is, where it is along that;
# its bias acceleration
SPRING_K, SPRING_C, SHARE, ADDED, SOLVED, SPRING_OF, OF_MANY, OF_DIRECTION, REACH, BEND = range(10)
# columns of Joined.job: what is answered, where its J and Y begin, how many rows, the next one of the group
JOB_AT, JOB_ROWS, JOB_NEXT = range(3)
# columns of Joined.line, single rows that are there to act: what it is (friction in a joint, stop, rope), the quantity,
# the force that it stands for
WHAT, MEASURED, OF_FORCE = range(3)
FRICTION, STOP, ROPE = range(3)
# columns of Joined.line_x: where a stop is, and by what it bounces off; of a rope stiffness, damping, free length; of
# friction (in the first) the arm, and the load of the joint; the force of the step
LEAST, MOST_AT, REBOUND, ROPE_K, ROPE_C, SHORTEST, PRESSED, PULLED = range(8)
# columns of Joined.active: line of the step, + 1 and negative for an upper stop; its group; where its row begins
LINE_OF, LINE_GROUP, LINE_AT = range(3)
# what ROWS may return; what the loop says where the engine has a status; velocities that do not settle;
# a step in which contacts that give way are not resolved
NO_ROOM, NO_WAY, NOT_SETTLED, TOO_LONG = 100, 101, 102, 103


class JoinedReals(Record, kind="Float"):
    """Time and energies of the mechanism within a step."""

    time: float
    step: float
    lost: float  # energy lost at stops
    overrun: float  # by how far (< 0) a stop would be overrun
    potential: float  # gravity's potential energy,
    weighed: float  # and its work over the step at the mean velocities
    kinetic: float  # energy before the mechanism was put onto its joints; -1 where nothing is hit
    astray: float  # energy that the method takes at joints


class JoinedCounts(Record, kind="Int"):
    """Sizes and counters of the mechanism."""

    first: int  # the first mover that is of the mechanism
    springs: int  # taken implicitly
    evaluated: int
    unsettled: int  # steps whose velocities did not settle
    needed: int  # numbers that J and Y must hold
    jobs: int  # rows that ``job`` must hold
    begun: int  # whether a step has begun
    anyhow: int  # whether it is to be taken with velocities that did not settle


class Joined(NamedTuple):
    """The mechanism: tables, the engine's rooms, and those of the step."""

    S: System
    W: Work
    R: Tableau
    clock: Clock
    sheet: Sheet  # (4, width)
    slopes: Sheet  # (forces, SLOPE_WIDTH)
    door: Int1  # (1,): the engine's address
    real: JoinedReals  # type: ignore[assignment]
    count: JoinedCounts  # type: ignore[assignment]
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


def _empty(layout: Struct) -> Any:
    """A named tuple of arrays without entries."""
    parts: list[Any] = []
    for _, x in layout.fields:
        if isinstance(x, Struct):
            parts.append(_empty(x))
        else:
            parts.append(x.of.blank() if isinstance(x, RecordLayout) else np.zeros((0,) * x.ndim, x.dtype))
    return layout.of(*parts)


def no_mechanism() -> Joined:
    """Tables of no mechanism, of the types of all others: what the loop of steps is compiled for."""
    return _empty(struct(Joined))._replace(group=np.zeros(1, np.int64))
