"""Workspace of the contact search: what it keeps between steps, and scratch.

Shapes stand in *slots*, first the bounded ones in the order of their grid cells, then the unbounded ones
(*wide*). Arrays that are read often are indexed by slot, so that neighbours in space are neighbours in memory.

Every bounded shape has an *envelope*: a capsule that contains the shape for a while. A pair is listed where two
envelopes overlap, and the list stays valid as long as every shape, with its motion over `AHEAD` seconds, is
within its envelope. A shape that has left its envelope (or turned too far) gets a new one, and only its pairs
are searched again. Envelopes are stored in a *frame* that moves with all movers where these move together, so
that a falling pile lists the same pairs as one at rest.
"""

from __future__ import annotations

from typing import NamedTuple

from ...compiler.struct_layout import Float1, Float2, Int1, Int2, Short2

# entries of Search.real, after MARGIN, SKIN, AHEAD of `tables`: where the frame is, by how much it goes on with the
# next search, its velocity, how far it lags behind; a usual radius; largest gap that the narrow phase is asked about;
# sum of the displacements that searches midway have seen since the last search
FRAME_ORIGIN, FRAME_STEP, FRAME_VELOCITY, FRAME_LAG, TYPICAL_RADIUS, QUERY_REACH, DISPLACEMENT = 3, 6, 9, 12, 15, 16, 17
REALS = 20
# entries of Search.count: bounded and wide slots; whether the list of pairs is true; which half of `seen` is read;
# number of the search whose contacts it speaks of; pairs, pairs when all were looked for; levels; address of the narrow
# phase and the two shapes that it is asked about; whether classes tell all about groups
(
    BOUNDED,
    WIDE,
    LIST_VALID,
    CURRENT_HALF,
    SEARCHES,
    PAIRS_IN_LIST,
    PAIRS_AT_REBUILD,
    LEVELS,
    NARROW_PHASE,
    QUERY_SHAPE_1,
    QUERY_SHAPE_2,
    CLASSES_EXACT,
) = range(12)
# shapes that have left their envelopes; whether the frame moves; pairs in the table; and of all searches so far: pairs
# of envelopes compared, envelopes made anew, how often all were, pairs looked at
MOVED_SLOTS, FRAME_MOVES, TABLE_PAIRS, PAIRS_COMPARED, ENVELOPES_RENEWED, REBUILDS, PAIRS_EXAMINED = range(12, 19)
COUNTS = 24
# columns of Search.hold: centre (in the mover's axes), radius, half edges of a box about it (along the shape's axes)
BOUND_CENTRE, BOUND_RADIUS, BOX_HALF = 0, 3, 4
# columns of Search.slot
SLOT_SHAPE, SLOT_MOVER, SLOT_LEVEL, SLOT_FORM, SLOT_CLASS = range(5)
IS_SPHERE, IS_PLANE, IS_GENERIC = range(3)  # Search.slot[FORM]: sphere, plane, what the narrow phase is asked about
SPHERE_SPHERE, PLANE_SPHERE, SPHERE_PLANE, GENERIC_PAIR = range(4)  # Search.pair[:, 2]
# columns of Search.now: centre, radius, its velocity, speed of the surface by turning
CENTRE, SPHERE_RADIUS, VELOCITY, TURNING_SPEED = 0, 3, 4, 7
# columns of Search.fat: middle of the capsule (in the frame), half of its line, its radius, radius of a ball that
# holds it
MIDDLE, HALF_LINE, ENVELOPE_RADIUS, ENVELOPE_BOUND = 0, 3, 6, 7
# columns of Search.wide: origin, normal, velocities; origin in the frame and normal when its pairs were looked for, and
# how far it may have gone since
PLANE_ORIGIN, PLANE_NORMAL, PLANE_VELOCITY, PLANE_SPIN, REFERENCE_ORIGIN, REFERENCE_NORMAL, SLACK = (
    0,
    3,
    6,
    9,
    12,
    15,
    18,
)
# columns of Search.level_i: class, first place in `head`, places (a power of two) less 1, cells in a row and in a
# layer, shapes; columns of level_x: edge of a cell, 1 / edge, corner
LEVEL_CLASS, LEVEL_FIRST, LEVEL_MASK, ROW_STRIDE, LAYER_STRIDE, LEVEL_SHAPES = range(6)
CELL_EDGE, INVERSE_EDGE, GRID_CORNER = 0, 1, 2
RAW_ENVELOPE, RAW_BOUND = 8, 16  # columns of Search.raw, after those of Search.now
SIZE_LEVELS = 24  # levels of a class at most: shapes of a level differ by a factor of two
MAX_CLASSES = 12  # at most


class Search(NamedTuple):
    """All of it; `contact_finder.ContactFinder` makes it."""

    real: Float1  # (REALS,)
    count: Int1  # type: ignore[assignment]  # (COUNTS,)
    hold: Float2  # (ns, 8): by shape
    shape_class: Int1  # (ns,): classes of shapes; those of one class meet the same classes
    meets: Int2  # (classes, classes)
    slot: Int2  # (ns, 5)
    now: Float2  # (ns, 8): by slot
    envelope: Float2  # (ns, 8): by slot
    axes: Float2  # (ns, 9): axes in the world of what is no sphere, by slot
    turn: Float2  # (ns, 9): these when the envelope was made
    wide: Float2  # (wide, 20)
    raw: Float2  # (ns, 18): now, fat, and how large it may become, by shape
    key: Int1  # (ns,): cells, by slot
    link: Int1  # (ns,): next slot at the same place of `head`, or -1
    head: Int1  # first slot at a place, or -1
    level_i: Int2  # (levels, 6)
    level_x: Float2  # (levels, 8)
    sums: Float2  # (classes * SIZES, 10): of the shapes of one size
    pair: Short2  # (capacity, 3): slots, that of the smaller shape first; in which way they are looked at
    seen: Short2  # (2, capacity): the pair's first contact of the last search, or -1; and of this one
    mark: Int1  # (ns,): by slot, whether it has left its envelope
    moved: Int1  # (ns,): slots that have
    names: Int1  # (places,): a table of pairs, by hashing
    firsts: Int1  # (places,): their first contacts
    taken: Int1  # (places / 2,): places that are not empty
    room: Float2  # (ROOM, 8): of the narrow phase
    kept: Float2  # (2, 12): poses of a pair that is carried on
