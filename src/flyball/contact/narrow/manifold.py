"""Contacts of two faces: one is cut by the other as seen along the normal, and at most four points are kept.

Both faces are drawn in a frame whose third axis is the normal n from shape 1 to shape 2: a corner has a place (x, y)
and a height z. Over each point of what the two have in common the gap is the difference of the heights, so faces need
not be square to the normal: the edge of a box over the edge of another gives the point where they cross, and further
ones only where these are near too.
"""

from __future__ import annotations

from math import inf

from ...compiler.formulas import formula
from ...math.vec import add, axes_across, dot, mtv, neg, put3, scale
from ..tables import KIND, RADIUS
from .any_shape import face, radius
from .cut import DEPTH, EDGE, X, Y, Z, along_line, cut_face, cut_line, slope
from .room import CORNERS, CUT_1, FACE_1, FACE_2

SAME = 1e-6  # gaps and places that differ by less, as part of the smaller shape, are the same
NEAREST_NAME = -1.0  # feature of the point where the shapes are nearest, if the faces do not hold it
FACES = 4096.0  # names of points of one pair of faces
PAIRS_OF_FACES = 65536.0


@formula
def axes_of(n):
    """Two unit vectors square to the unit vector n, and n."""
    u, v = axes_across(n)
    return u, v, n


@formula
def drawn(G, i, P, d, frame, room, at):
    """Put the face of shape i at P that faces d into the frame: how many corners, its number."""
    p, R = P
    count, number = face(G.shape_i[i, KIND], G, i, mtv(R, d), room, at)
    u, v, n = mtv(R, frame[0]), mtv(R, frame[1]), mtv(R, frame[2])
    x, y, z = dot(frame[0], p), dot(frame[1], p), dot(frame[2], p)
    for k in range(at, at + count):
        c = (room[k, 0], room[k, 1], room[k, 2])
        put3(room, k, 0, (x + dot(u, c), y + dot(v, c), z + dot(n, c)))
        room[k, EDGE] = k - at
    return count, number


@formula
def common(room, m1, m2):
    """What two faces have in common: where it stands, corners, the other face's first corner and slopes, its side."""
    if m2 > 2:
        a, b, cosine = slope(room, FACE_2, m2)
        other, side = FACE_2, 1.0
        if m1 > 2:
            at, count = cut_face(room, FACE_1, m1, FACE_2, m2, -1.0)
        else:
            at, count = cut_line(room, FACE_1, FACE_2, m2, -1.0)
        count = count if cosine > 0.0 else 0
    elif m1 > 2:
        a, b, cosine = slope(room, FACE_1, m1)
        other, side = FACE_1, -1.0
        at, count = cut_line(room, FACE_2, FACE_1, m1, 1.0)
        count = count if cosine > 0.0 else 0
    else:
        other, side, at = FACE_2, 1.0, CUT_1
        count, a, b = along_line(room, FACE_1, FACE_2)
    return at, count, other, a, b, side


@formula
def near(room, a, b, same):
    """Whether two corners are as good as one."""
    x, y = room[a, X] - room[b, X], room[a, Y] - room[b, Y]
    return x * x + y * y <= same * same


@formula
def gaps(room, at, count, rounding, limits, plane, first_name):
    """Gaps of the corners against a face; those within reach move up: how many, the smallest."""
    other, a, b, side = plane
    r1, r2 = rounding
    reach, same = limits
    x, y, z = room[other, X], room[other, Y], room[other, Z]
    kept, least = 0, inf
    edge = room[at + count - 1, EDGE]
    for k in range(at, at + count):
        height = z + a * (room[k, X] - x) + b * (room[k, Y] - y)
        gap = side * (height - room[k, Z]) - r1 - r2
        name = first_name + edge * (2 * CORNERS) + room[k, EDGE]
        edge = room[k, EDGE]
        if gap <= reach and not (kept > 0 and (near(room, at + kept - 1, k, same) or near(room, at, k, same))):
            to = at + kept
            room[to, X], room[to, Y] = room[k, X], room[k, Y]
            room[to, Z] = 0.5 * (height + room[k, Z] + r1 - r2)
            room[to, EDGE], room[to, DEPTH] = name, gap
            kept += 1
            least = min(least, gap)
    return kept, least


@formula
def farther(best, value):
    """Whether a point is farther than the best so far; where they are equal but for rounding the first one stays."""
    return value > best + 1e-6 * abs(best)


@formula
def swap(room, a, b):
    """Exchange two corners."""
    for c in range(5):
        room[a, c], room[b, c] = room[b, c], room[a, c]


@formula
def fewer(room, at, count, same):
    """The deepest, the one farthest from it, and the farthest to either side of these come first: how many remain."""
    best = at
    for k in range(at + 1, at + count):
        if room[k, DEPTH] < room[best, DEPTH] - same:
            best = k
    swap(room, at, best)
    x, y = room[at, X], room[at, Y]
    best, far = at + 1, 0.0
    for k in range(at + 1, at + count):
        u, v = room[k, X] - x, room[k, Y] - y
        if farther(far, u * u + v * v):
            best, far = k, u * u + v * v
    swap(room, at + 1, best)
    u, v = room[at + 1, X] - x, room[at + 1, Y] - y
    for to, turn in ((at + 2, 1.0), (at + 3, -1.0)):
        best, far = to, 0.0
        for k in range(to, at + count):
            area = turn * (u * (room[k, Y] - y) - v * (room[k, X] - x))
            if farther(far, area):
                best, far = k, area
        swap(room, to, best)
    return 4


@formula
def tell(room, at, count, frame):
    """Write corners out as contacts."""
    for k in range(count):
        c = at + k
        p = add(scale(room[c, X], frame[0]), add(scale(room[c, Y], frame[1]), scale(room[c, Z], frame[2])))
        put3(room, k, 0, p)
        put3(room, k, 3, frame[2])
        room[k, 6], room[k, 7] = room[c, DEPTH], room[c, EDGE]


@formula
def smallest(room, count):
    """The smallest gap of the contacts told."""
    least = inf
    for k in range(count):
        least = min(least, room[k, 6])
    return least


@formula
def manifold(G, i, j, A, B, n, nearest, reach, room):
    """Contacts of shapes i at A and j at B along the unit normal n from i to j: how many.

    ``nearest`` is the smallest gap and the point midway between the surfaces there; it is a contact of its own where
    the faces do not hold a point as deep. A gap of inf: nothing is known of it.
    """
    frame = axes_of(n)
    m1, number_1 = drawn(G, i, A, n, frame, room, FACE_1)
    m2 = number_2 = 0
    if m1 > 1:
        m2, number_2 = drawn(G, j, B, neg(n), frame, room, FACE_2)
    r1, r2 = radius(G.shape_i[i, KIND], G, i), radius(G.shape_i[j, KIND], G, j)
    same = SAME * min(G.shape_x[i, RADIUS], G.shape_x[j, RADIUS])
    at, count, least = CUT_1, 0, inf
    if m2 > 1:
        at, count, other, a, b, side = common(room, m1, m2)
        if count:
            name = FACES * (number_1 + PAIRS_OF_FACES * number_2)
            count, least = gaps(room, at, count, (r1, r2), (reach, same), (other, a, b, side), name)
    gap, p = nearest
    if gap <= reach and gap < least - same:
        put3(room, at + count, 0, (dot(frame[0], p), dot(frame[1], p), dot(n, p)))
        room[at + count, EDGE], room[at + count, DEPTH] = NEAREST_NAME, gap
        count += 1
    if count > 4:
        count = fewer(room, at, count, same)
    tell(room, at, count, frame)
    return count
