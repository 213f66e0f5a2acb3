"""Workspace of the contact search: data kept between steps, and scratch.

Shapes have *slots*: first the bounded ones in the order of their grid cells, then the unbounded ones (*wide*).
Frequently read arrays are indexed by slot, so that neighbours in space are neighbours in memory.

Every bounded shape has an *envelope*: a capsule that contains the shape for a while. A pair is listed if the two
envelopes overlap. The list stays valid as long as every shape, with its motion until the next search, is
within its envelope. A shape that has left its envelope (or rotated too far) gets a new one, and only its pairs
are listed again. Envelopes are stored in a *frame* that moves with the movers if these move together, so
that a falling pile lists the same pairs as one at rest.
"""

from __future__ import annotations

from typing import NamedTuple

from ...compiler.struct_layout import Column, Float1, Float2, Int1, Int2, Record, Short2, Vector3

IS_SPHERE, IS_PLANE, IS_GENERIC = range(3)  # Slots.form: sphere, plane, shapes for the narrow phase
SPHERE_SPHERE, PLANE_SPHERE, SPHERE_PLANE, GENERIC_PAIR = range(4)  # SlotPairs.kind
SIZE_LEVELS = 24  # maximum number of levels of a class; sizes of a level differ by a factor of two
MAX_CLASSES = 12  # maximum number of classes


class SearchReals(Record, kind="Float"):
    """Options of the search, and sizes."""

    margin: float  # largest gap of a contact between shapes that do not approach [m]
    skin: float  # displacement, relative to the radius, after which the pairs of a shape are listed again
    horizon: float  # time until the next search [s]: shapes that may touch within it have a contact
    typical_radius: float  # [m]
    query_reach: float  # largest gap requested from the narrow phase [m]


class MovingFrame(Record, kind="Float"):
    """Frame in which envelopes are stored."""

    origin: Vector3
    step: Vector3  # its displacement with the next search
    velocity: Vector3
    lag: Vector3
    displacement: Vector3  # sum over all shapes in midway searches since the last search


class SearchCounts(Record, kind="Int"):
    """Sizes, state and counters of the search."""

    bounded: int  # slots
    wide: int  # slots
    list_valid: int  # whether the list of pairs is valid
    current_half: int  # half of `seen` that is read
    searches: int  # number of the search whose contacts it refers to
    pairs: int  # in the list
    pairs_at_rebuild: int
    levels: int
    narrow_phase: int  # address of the narrow phase
    query_shape_1: int  # its two shapes
    query_shape_2: int
    classes_exact: int  # whether classes represent all groups
    moved_slots: int  # outside their envelopes
    frame_moves: int  # whether the frame moves
    table_pairs: int  # in the hash table
    pairs_compared: int  # envelopes compared, in all searches
    envelopes_renewed: int
    rebuilds: int  # of the list
    pairs_examined: int


class Bounds(Record, kind="Float", rows=True):
    """Bounding sphere and box of each shape, with a common centre."""

    centre: Vector3  # in the mover's axes
    radius: Column
    half_edges: Vector3  # of the box, along the shape's axes


class Slots(Record, kind="Int", rows=True):
    """What is in each slot."""

    shape_index: Column
    mover: Column
    level: Column
    form: Column  # IS_SPHERE, ...
    collision_class: Column


class Motions(Record, kind="Float", rows=True):
    """Place and velocity of shapes."""

    centre: Vector3
    radius: Column
    velocity: Vector3  # of the centre
    turning_speed: Column  # of the surface by rotation


class Envelopes(Record, kind="Float", rows=True):
    """Capsules that contain shapes."""

    middle: Vector3  # in the frame
    half_line: Vector3  # half of the axis
    radius: Column
    bound: Column  # radius of a bounding sphere


class Planes(Record, kind="Float", rows=True):
    """Unbounded shapes; reference: when the pairs were listed."""

    origin: Vector3
    normal: Vector3
    velocity: Vector3
    spin: Vector3
    reference_origin: Vector3  # in the frame
    reference_normal: Vector3
    slack: Column  # allowed displacement since


class LevelCells(Record, kind="Int", rows=True):
    """Cells of each level of the grid."""

    collision_class: Column
    first: Column  # place in `head`
    mask: Column  # number of places (a power of two) minus 1
    row_stride: Column  # cells in a row
    layer_stride: Column
    shapes: Column  # their number


class LevelGrid(Record, kind="Float", rows=True):
    """Size and place of the cells of each level."""

    edge: Column
    inverse_edge: Column
    corner: Vector3


class SizeGroups(Record, kind="Float", rows=True):
    """Sums over the shapes of one class and size."""

    count: Column
    largest: Column  # bound of an envelope
    middle: Vector3
    square: Vector3  # of the middle
    level: Column
    largest_of_class: Column  # in the first group of a class


class SlotPairs(Record, kind="Short", rows=True):
    """Pairs of slots, that of the smaller shape number first."""

    first: Column
    second: Column
    kind: Column  # SPHERE_SPHERE, ...


class PairTable(NamedTuple):
    """Hash table of pairs."""

    names: Int1  # (places,)
    firsts: Int1  # (places,): their first contacts
    occupied: Int1  # (places / 2,): places in use


class Search(NamedTuple):
    """Workspace of the contact search; created by `contact_finder.search_workspace`."""

    real: SearchReals
    frame: MovingFrame
    count: SearchCounts  # type: ignore[assignment]
    hold: Bounds  # by shape
    shape_class: Int1  # (ns,): classes of shapes; shapes of one class collide with the same classes
    meets: Int2  # (classes, classes): 1 if the classes collide
    slot: Slots
    now: Motions  # by slot
    envelope: Envelopes  # by slot
    axes: Float2  # (ns, 9): axes of shapes other than spheres in world axes, by slot
    turn: Float2  # (ns, 9): the same when the envelope was computed
    wide: Planes
    raw_now: Motions  # by shape
    raw_envelope: Envelopes  # by shape
    raw_bound: Float1  # (ns,): largest bound of the envelope, by shape
    key: Int1  # (ns,): cells, by slot
    link: Int1  # (ns,): next slot in the same bucket of `head`, or -1
    head: Int1  # first slot of a bucket, or -1
    level_cells: LevelCells
    level_grid: LevelGrid
    sums: SizeGroups  # (classes * SIZE_LEVELS)
    pair: SlotPairs
    first_contacts: Short2  # (2, capacity): the pair's first contact of the last search, or -1; and of this one
    mark: Int1  # (ns,): by slot, 1 if it has left its envelope
    moved: Int1  # (ns,): those slots
    table: PairTable
    narrow_phase_contacts: Float2  # (SCRATCH_ROWS, 8): of the narrow phase
    stored_pose: Float2  # (2, 12): stored poses of a pair that is advanced
