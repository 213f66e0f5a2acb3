"""Workspace of the contact search: data kept between steps, and scratch.

Shapes have *slots*: first the bounded ones in the order of their grid cells, then the unbounded ones (*wide*).
Frequently read arrays are indexed by slot, so that neighbours in space are neighbours in memory.

Every bounded shape has an *envelope*: a capsule that contains the shape for a while. A pair is listed if the two
envelopes overlap. The list stays valid as long as every shape, with its motion over `AHEAD` seconds, is
within its envelope. A shape that has left its envelope (or rotated too far) gets a new one, and only its pairs
are listed again. Envelopes are stored in a *frame* that moves with the movers if these move together, so
that a falling pile lists the same pairs as one at rest.
"""

from __future__ import annotations

from typing import NamedTuple

from ...compiler.struct_layout import Float1, Float2, Int1, Int2, Short2

# entries of Search.real, after MARGIN, SKIN, AHEAD of `tables`: position of the frame, its displacement with the next
# search, its velocity, its lag; typical radius; largest gap requested from the narrow phase; sum of the displacements
# in midway searches since the last search
FRAME_ORIGIN, FRAME_STEP, FRAME_VELOCITY, FRAME_LAG, TYPICAL_RADIUS, QUERY_REACH, DISPLACEMENT = 3, 6, 9, 12, 15, 16, 17
REALS = 20
# entries of Search.count: bounded and wide slots; whether the list of pairs is valid; half of `seen` that is read;
# number of the search whose contacts it refers to; pairs, pairs after the last rebuild; levels; address of the narrow
# phase and its two shapes; whether classes represent all groups
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
# slots outside their envelopes; whether the frame moves; pairs in the hash table; totals over all searches: pairs of
# envelopes compared, envelopes renewed, rebuilds of the list, pairs examined
MOVED_SLOTS, FRAME_MOVES, TABLE_PAIRS, PAIRS_COMPARED, ENVELOPES_RENEWED, REBUILDS, PAIRS_EXAMINED = range(12, 19)
COUNTS = 24
# columns of Search.hold: centre (in the mover's axes), radius, half edges of a box about it (along the shape's axes)
BOUND_CENTRE, BOUND_RADIUS, BOX_HALF = 0, 3, 4
# columns of Search.slot
SLOT_SHAPE, SLOT_MOVER, SLOT_LEVEL, SLOT_FORM, SLOT_CLASS = range(5)
IS_SPHERE, IS_PLANE, IS_GENERIC = range(3)  # Search.slot[SLOT_FORM]: sphere, plane, shapes for the narrow phase
SPHERE_SPHERE, PLANE_SPHERE, SPHERE_PLANE, GENERIC_PAIR = range(4)  # Search.pair[:, 2]
# columns of Search.now: centre, radius, velocity of the centre, speed of the surface by rotation
CENTRE, SPHERE_RADIUS, VELOCITY, TURNING_SPEED = 0, 3, 4, 7
# columns of Search.envelope: middle of the capsule (in the frame), half of its axis, its radius, radius of a bounding
# sphere
MIDDLE, HALF_LINE, ENVELOPE_RADIUS, ENVELOPE_BOUND = 0, 3, 6, 7
# columns of Search.wide: origin, normal, velocities; origin in the frame and normal when its pairs were listed, and
# allowed displacement since
PLANE_ORIGIN, PLANE_NORMAL, PLANE_VELOCITY, PLANE_SPIN, REFERENCE_ORIGIN, REFERENCE_NORMAL, SLACK = (
    0,
    3,
    6,
    9,
    12,
    15,
    18,
)
# columns of Search.level_i: class, first place in `head`, number of places (a power of two) minus 1, cells in a row and
# in a layer, shapes; columns of level_x: edge of a cell, 1 / edge, corner
LEVEL_CLASS, LEVEL_FIRST, LEVEL_MASK, ROW_STRIDE, LAYER_STRIDE, LEVEL_SHAPES = range(6)
CELL_EDGE, INVERSE_EDGE, GRID_CORNER = 0, 1, 2
RAW_ENVELOPE, RAW_BOUND = 8, 16  # columns of Search.raw, after those of Search.now
SIZE_LEVELS = 24  # maximum number of levels of a class; sizes of a level differ by a factor of two
MAX_CLASSES = 12  # maximum number of classes


class Search(NamedTuple):
    """Workspace of the contact search; created by `contact_finder.search_workspace`."""

    real: Float1  # (REALS,)
    count: Int1  # type: ignore[assignment]  # (COUNTS,)
    hold: Float2  # (ns, 8): by shape
    shape_class: Int1  # (ns,): classes of shapes; shapes of one class collide with the same classes
    meets: Int2  # (classes, classes): 1 if the classes collide
    slot: Int2  # (ns, 5)
    now: Float2  # (ns, 8): by slot
    envelope: Float2  # (ns, 8): by slot
    axes: Float2  # (ns, 9): axes of shapes other than spheres in world axes, by slot
    turn: Float2  # (ns, 9): the same when the envelope was computed
    wide: Float2  # (wide, 20)
    raw: Float2  # (ns, 18): columns of now and envelope, and the largest bound of the envelope, by shape
    key: Int1  # (ns,): cells, by slot
    link: Int1  # (ns,): next slot in the same bucket of `head`, or -1
    head: Int1  # first slot of a bucket, or -1
    level_i: Int2  # (levels, 6)
    level_x: Float2  # (levels, 8)
    sums: Float2  # (classes * SIZE_LEVELS, 10): sums over the shapes of one size
    pair: Short2  # (capacity, 3): slots, that of the smaller shape number first; type of the pair
    seen: Short2  # (2, capacity): the pair's first contact of the last search, or -1; and of this one
    mark: Int1  # (ns,): by slot, 1 if it has left its envelope
    moved: Int1  # (ns,): those slots
    names: Int1  # (places,): hash table of pairs
    firsts: Int1  # (places,): their first contacts
    taken: Int1  # (places / 2,): places in use
    room: Float2  # (SCRATCH_ROWS, 8): of the narrow phase
    kept: Float2  # (2, 12): stored poses of a pair that is advanced
