"""Arrays of collision detection: shapes, the bodies that carry them, and the contacts found.

A *mover* is a body that carries shapes: a pose and a velocity. Fixed shapes have mover -1. Planar mechanisms
stay at z = 0; their shapes have kinds of their own, whose normals lie in the plane.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..compiler.struct_layout import CodeTables1, Column, Float2, Int1, Int2, Record, Vector3, Vector8, Vector9

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


class Contacts(NamedTuple):
    """Contacts at one time. Two of these are used alternately, to match contacts with those of the last search."""

    count: ContactCounts  # type: ignore[assignment]
    at: ContactShapes  # contacts of a pair are consecutive
    x: ContactPoints


def no_contacts(capacity: int) -> Contacts:
    """Create an empty table of contacts."""
    C = Contacts(ContactCounts.blank(), ContactShapes.blank(capacity), ContactPoints.blank(capacity))
    C.at[:] = -1
    return C
