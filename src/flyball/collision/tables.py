"""Arrays of collision detection: shapes, the bodies that carry them, the contacts found, the workspace of the search.

A *mover* is a body that carries shapes: a pose and a velocity. Fixed shapes have mover -1. Planar mechanisms
stay at z = 0; their shapes have kinds of their own, whose normals lie in the plane.

The workspace holds data kept between steps, and scratch. Shapes have *slots*: first the bounded ones in the order of
their grid cells, then the unbounded ones (*wide*). Frequently read arrays are indexed by slot, so that neighbours in
space are neighbours in memory.

Every bounded shape has an *envelope*: a capsule that contains the shape for a while. A pair is listed if the two
envelopes overlap. The list stays valid as long as every shape, with its motion until the next search, is
within its envelope. A shape that has left its envelope (or rotated too far) gets a new one, and only its pairs
are listed again. Envelopes are stored in a *frame* that moves with the movers if these move together, so
that a falling pile lists the same pairs as one at rest.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..compiler.struct_layout import (
    CodeTables1,
    Column,
    Float1,
    Float2,
    Int1,
    Int2,
    Record,
    Short2,
    Vector3,
    Vector8,
    Vector9,
)

# status of a search; FULL_*: enlarge that table and call again with the same state
DONE, FULL_CONTACTS, FULL_PAIRS, NOT_FINITE = range(4)


class Shapes(Record, kind="Int", rows=True):
    """Structure of each shape."""

    kind: Column
    mover: Column  # or -1
    first: Column  # vertex
    count: Column  # of vertices
    face_first: Column
    face_count: Column
    member: Column  # groups to which it belongs (bits)
    mask: Column  # groups with which it collides; both shapes must select a group of the other
    material: Column


class Dimensions(Record, kind="Float", rows=True):
    """Numbers of each shape."""

    place: Vector3  # of its origin relative to its mover's, in the mover's axes
    axes: Vector9  # in the mover's axes
    par: Vector8  # parameters of its kind
    radius: Column  # of a bounding sphere about its origin (inf for unbounded shapes)


class Geometry(NamedTuple):
    """The shapes; constant during a run."""

    shape: Shapes
    dimensions: Dimensions
    vertex: Float2  # (nv, 3): of hulls, polygons and height fields, in the shape's axes
    face: Int1  # (nf,): faces of hulls: number of corners, then corners counter-clockwise seen from outside, ...
    excluded_pairs: Int2  # (nx, 2): pairs of movers (smaller first; -1: fixed) that never touch, sorted
    code: CodeTables1 = np.zeros(0, np.int64)  # (ns,): code table of user-defined shapes; 0 for others


class Movers(NamedTuple):
    """Poses and velocities of the movers, in world axes."""

    pose: Float2  # (n, 12): position [m], rotation (by rows; from the mover's axes to the world's)
    twist: Float2  # (n, 6): velocity [m/s] of its origin, angular velocity [rad/s]


class ContactCounts(Record, kind="Int"):
    """Counts of a search."""

    found: int  # contacts (of a full table: the required number; NOT_FINITE: the mover)
    status: int
    rebuilt: int  # number of rebuilds of the pair list
    pairs: int
    number: int  # of the search


class ContactShapes(Record, kind="Int", rows=True):
    """Identity of each contact."""

    shape_1: Column
    shape_2: Column
    feature: Column  # identifies the contacts of a pair, constant from step to step
    before: Column  # index of the same contact in the last search, or -1


class ContactPoints(Record, kind="Float", rows=True):
    """Place of each contact, in world axes."""

    point: Vector3  # midway between the surfaces [m]
    normal: Vector3  # unit normal from 1 to 2
    gap: Column  # [m] (< 0: overlap)
    half_separation: Vector3  # half the distance of that point on the two shapes until they touch (subtracted on 1)


class ContactTable(NamedTuple):
    """Contacts at one time. Two of these are used alternately, to match contacts with those of the last search."""

    count: ContactCounts  # type: ignore[assignment]
    at: ContactShapes  # contacts of a pair are consecutive
    x: ContactPoints


def no_contacts(capacity: int) -> ContactTable:
    """Create an empty table of contacts."""
    C = ContactTable(ContactCounts.blank(), ContactShapes.blank(capacity), ContactPoints.blank(capacity))
    C.at[:] = -1
    return C


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
