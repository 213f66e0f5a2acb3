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
# what a search may return: FULL_* says what to enlarge before it is called again at the same state
DONE, FULL_CONTACTS, FULL_PAIRS, NOT_FINITE = range(4)
# entries of Search.real: largest gap that is a contact; how far shapes may go, in radii, before their
# pairs are looked for again; time that movers move on for before the next search (what may meet within it is a contact
# too)
MARGIN, SKIN, AHEAD = range(3)


class Geometry(NamedTuple):
    """Shapes. Nothing in it changes during a run."""

    shape_i: Int2  # (ns, 9): kind, mover or -1, first vertex and count, first face and count, groups that it is
    # of and groups that it meets (bits; two meet if each meets a group of the other), material
    shape_x: Float2  # (ns, 24): its origin from its mover's and its axes, in the mover's axes; parameters of its
    # kind (at 12); radius of a sphere about its origin that holds it (inf for what is unbounded)
    vertex: Float2  # (nv, 3): of hulls and the like, in the shape's axes
    face: Int1  # (nf,): their faces: count of corners, then the corners counter-clockwise from outside, and so on
    apart: Int2  # (nx, 2): pairs of movers (the smaller first; -1 what stands still) that never touch, sorted
    code: CodeTables1 = np.zeros(0, np.int64)  # (ns,): code table of a shape of a user's own; 0 of others


class Movers(NamedTuple):
    """How what carries the shapes is placed and moves, along the world's axes."""

    pose: Float2  # (n, 12): position [m], rotation (rows; takes mover's components to the world's)
    twist: Float2  # (n, 6): velocity [m/s] of its origin, angular velocity [rad/s]


class Contacts(NamedTuple):
    """Contacts at one time; two of these are used in turn, so that a contact can be found again in the one before."""

    count: Int1  # type: ignore[assignment]  # (8,): how many, status, how often pairs were looked for afresh, how
    # many pairs there are, number of the search
    at: Int2  # (capacity, 4): shape 1, shape 2, feature (tells the contacts of a pair apart, and lasts from step
    # to step), place of the same contact in the contacts before or -1. Those of a pair stand together.
    x: Float2  # (capacity, 10): point [m] midway between the surfaces, unit normal from 1 to 2, gap [m] (< 0:
    # overlap), half of what that point is apart on the two shapes until they touch (less on 1), all in the world
