"""Arrays of collision detection: shapes, the bodies that carry them, and the contacts found.

A *mover* is a body that carries shapes: a pose and a velocity. Fixed shapes have mover -1. Planar mechanisms
stay at z = 0; their shapes have kinds of their own, whose normals lie in the plane.

Constants name the columns of each array.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..compiler.struct_layout import CodeTables1, Float2, Int1, Int2

# columns of Geometry.shape_i
KIND, MOVER, FIRST, COUNT, FACE_FIRST, FACE_COUNT, MEMBER, MASK, MATERIAL = range(9)
# columns of Geometry.shape_x
PLACE, AXES, PAR, RADIUS = 0, 3, 12, 20
# columns of Contacts.at
SHAPE_1, SHAPE_2, FEATURE, BEFORE = range(4)
# columns of Contacts.x
POINT, NORMAL, GAP, APART = 0, 3, 6, 7
# entries of Contacts.count
FOUND, STATUS, REBUILT, PAIRS, NUMBER = range(5)
# status of a search; FULL_*: enlarge that table and call again with the same state
DONE, FULL_CONTACTS, FULL_PAIRS, NOT_FINITE = range(4)
# entries of Search.real: largest gap of a contact; displacement, relative to the radius, after which the pairs of a
# shape are listed again; time until the next search (shapes that may touch within it have a contact)
MARGIN, SKIN, AHEAD = range(3)


class Geometry(NamedTuple):
    """The shapes; constant during a run."""

    shape_i: Int2  # (ns, 9): kind, mover or -1, first vertex and count, first face and count, groups to which
    # it belongs and groups with which it collides (bits; both shapes must select a group of the other), material
    shape_x: Float2  # (ns, 24): its origin relative to its mover's and its axes, in the mover's axes; parameters of
    # its kind (at 12); radius of a bounding sphere about its origin (inf for unbounded shapes)
    vertex: Float2  # (nv, 3): of hulls, polygons and height fields, in the shape's axes
    face: Int1  # (nf,): faces of hulls: number of corners, then corners counter-clockwise seen from outside, ...
    apart: Int2  # (nx, 2): pairs of movers (smaller first; -1: fixed) that never touch, sorted
    code: CodeTables1 = np.zeros(0, np.int64)  # (ns,): code table of user-defined shapes; 0 for others


class Movers(NamedTuple):
    """Poses and velocities of the movers, in world axes."""

    pose: Float2  # (n, 12): position [m], rotation (by rows; from the mover's axes to the world's)
    twist: Float2  # (n, 6): velocity [m/s] of its origin, angular velocity [rad/s]


class Contacts(NamedTuple):
    """Contacts at one time. Two of these are used alternately, to match contacts with those of the last search."""

    count: Int1  # type: ignore[assignment]  # (8,): number of contacts, status, number of rebuilds of the pair list,
    # number of pairs, number of the search
    at: Int2  # (capacity, 4): shape 1, shape 2, feature (identifies the contacts of a pair, constant from step
    # to step), index of the same contact in the last search or -1. Contacts of a pair are consecutive.
    x: Float2  # (capacity, 10): point [m] midway between the surfaces, unit normal from 1 to 2, gap [m] (< 0:
    # overlap), half the distance of that point on the two shapes until they touch (subtracted on 1), all in world axes
