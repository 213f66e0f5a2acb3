"""Contact manifold of two facing faces: one is clipped by the other; at most four points remain.

Both faces are expressed in a frame whose third axis is the normal n from shape 1 to shape 2: a corner has a
position (x, y) and a height z. Over each point of the overlap the gap is the difference of the heights, so faces
need not be perpendicular to the normal: the edge of a box over the edge of another gives the point where they
cross, and further points only if these are close too.

Clipping: Sutherland and Hodgman 1974. A corner stores the number of the edge that starts there: the face's own
edges are 0, 1, ..., those of the other face follow from `MAX_CORNERS` on. The two edges that meet in a point
are its feature.
"""

from __future__ import annotations

from math import inf

from ...compiler.formulas import formula
from ...math.scalar import sqrt
from ...math.vec import add, axes_across, dot, mtv, neg, scale, store3
from ..shapes.registry import face, radius
from .primitives import CLIPPED_1, CLIPPED_2, FACE_1, FACE_2, MAX_CORNERS

X, Y, Z, EDGE, DEPTH = range(5)  # columns: position, height, edge to the next corner, gap
CLIP_TOLERANCE = 1e-6  # relative to the edge; corners closer beyond it stay: equal boxes on each other
STEEPEST = 0.1  # smallest cosine of the tilt of a face or line against the plane perpendicular to the normal
POINT_TOLERANCE = 1e-9  # relative to a line; a shorter part is a point
PARALLEL_ANGLE = 3e-3  # angle [rad] below which lines are treated as parallel


@formula
def face_slope(scratch, at, count):
    """Slopes of a face's height along x and y, and the cosine of its tilt (0: too steep); Newell's normal."""
    x = y = z = 0.0
    a = at + count - 1
    for b in range(at, at + count):
        x += (scratch[a, Y] - scratch[b, Y]) * (scratch[a, Z] + scratch[b, Z])
        y += (scratch[a, Z] - scratch[b, Z]) * (scratch[a, X] + scratch[b, X])
        z += (scratch[a, X] - scratch[b, X]) * (scratch[a, Y] + scratch[b, Y])
        a = b
    length = sqrt(x * x + y * y + z * z)
    if abs(z) <= STEEPEST * length:
        return 0.0, 0.0, 0.0
    return -x / z, -y / z, abs(z) / length


@formula
def interpolate_corner(scratch, a, b, t, to, edge):
    """Write the point at part t of the line from corner a to corner b."""
    for c in range(3):
        scratch[to, c] = scratch[a, c] + t * (scratch[b, c] - scratch[a, c])
    scratch[to, EDGE] = edge


@formula
def clip_by_edge(scratch, at, count, a, b, turn, edge, to):
    """Clip a face by the edge from a to b; returns the number of corners, written from ``to`` on."""
    x, y = scratch[a, X], scratch[a, Y]
    ex, ey = turn * (scratch[b, X] - x), turn * (scratch[b, Y] - y)
    least = -CLIP_TOLERANCE * (ex * ex + ey * ey)
    kept = 0
    p = at + count - 1
    dp = ex * (scratch[p, Y] - y) - ey * (scratch[p, X] - x)
    for k in range(at, at + count):
        dk = ex * (scratch[k, Y] - y) - ey * (scratch[k, X] - x)
        if dp >= least and dk < least:  # leaves the inner side
            if dp > 0.0:
                interpolate_corner(scratch, p, k, dp / (dp - dk), to + kept, edge)
                kept += 1
            elif kept > 0:
                scratch[to + kept - 1, EDGE] = edge
        if dk >= least:
            if dp < least and dk > 0.0:  # enters the inner side
                interpolate_corner(scratch, p, k, dp / (dp - dk), to + kept, scratch[p, EDGE])
                kept += 1
            interpolate_corner(scratch, k, k, 0.0, to + kept, scratch[k, EDGE])
            kept += 1
        p, dp = k, dk
    return kept


@formula
def clip_face(scratch, at, count, tool, corners, turn):
    """Clip a face by all edges of another with orientation ``turn`` (1: counter-clockwise): place, corners."""
    a = tool + corners - 1
    to = CLIPPED_1
    for b in range(tool, tool + corners):
        if count == 0:
            break
        count = clip_by_edge(scratch, at, count, a, b, turn, MAX_CORNERS + a - tool, to)
        at, to, a = to, CLIPPED_1 + CLIPPED_2 - to, b
    return at, count


@formula
def write_segment(scratch, at, first, last):
    """Write a part of a line from `CLIPPED_1` on; returns the number of corners: two, one if short, or none."""
    if first > last:
        return 0
    interpolate_corner(scratch, at, at + 1, first, CLIPPED_1, 0.0)
    interpolate_corner(scratch, at, at + 1, last, CLIPPED_1 + 1, 1.0)
    return 2 if last - first > POINT_TOLERANCE else 1


@formula
def clip_segment(scratch, at, tool, corners, turn):
    """Clip a line by all edges of a face: place, two corners or none; its ends keep their features."""
    first, last = 0.0, 1.0
    a = tool + corners - 1
    for b in range(tool, tool + corners):
        x, y = scratch[a, X], scratch[a, Y]
        ex, ey = turn * (scratch[b, X] - x), turn * (scratch[b, Y] - y)
        least = -CLIP_TOLERANCE * (ex * ex + ey * ey)
        d0 = ex * (scratch[at, Y] - y) - ey * (scratch[at, X] - x)
        d1 = ex * (scratch[at + 1, Y] - y) - ey * (scratch[at + 1, X] - x)
        if d0 < least and d1 < least:
            return CLIPPED_1, 0
        if d0 < least:
            first = max(first, d0 / (d0 - d1))
        elif d1 < least:
            last = min(last, d0 / (d0 - d1))
        a = b
    return CLIPPED_1, write_segment(scratch, at, first, last)


@formula
def segment_overlap(scratch, at, other):
    """Overlap of two nearly parallel lines, and the slopes of the other one's height: corners, slopes."""
    x, y = scratch[at + 1, X] - scratch[at, X], scratch[at + 1, Y] - scratch[at, Y]
    u, v = scratch[other + 1, X] - scratch[other, X], scratch[other + 1, Y] - scratch[other, Y]
    z, w = scratch[at + 1, Z] - scratch[at, Z], scratch[other + 1, Z] - scratch[other, Z]
    xx, uu = x * x + y * y, u * u + v * v
    if xx <= STEEPEST * STEEPEST * z * z or uu <= STEEPEST * STEEPEST * w * w:
        return 0, 0.0, 0.0
    across = x * v - y * u
    if across * across >= PARALLEL_ANGLE * PARALLEL_ANGLE * xx * uu:  # crossing, or one is a point
        return 0, 0.0, 0.0
    s0 = ((scratch[other, X] - scratch[at, X]) * x + (scratch[other, Y] - scratch[at, Y]) * y) / xx
    s1 = s0 + (x * u + y * v) / xx
    first, last = max(0.0, min(s0, s1)), min(1.0, max(s0, s1))
    return write_segment(scratch, at, first, last), w / uu * u, w / uu * v


SAME_POINT = 1e-6  # relative to the smaller shape; smaller differences of gaps and positions count as none
NEAREST_FEATURE = -1.0  # feature of the point where the shapes are nearest, if it is not on the faces
FACE_FEATURES = 4096.0  # range of features of one pair of faces
FACE_PAIRS = 65536.0


@formula
def contact_frame(n):
    """Two unit vectors perpendicular to the unit vector n, and n."""
    u, v = axes_across(n)
    return u, v, n


@formula
def face_in_frame(G, i, P, d, frame, scratch, at):
    """Write the face of shape i at P that faces d in the frame; returns the number of corners, and its number."""
    p, R = P
    count, number = face(G.shape.kind[i], G, i, mtv(R, d), scratch, at)
    u, v, n = mtv(R, frame[0]), mtv(R, frame[1]), mtv(R, frame[2])
    x, y, z = dot(frame[0], p), dot(frame[1], p), dot(frame[2], p)
    for k in range(at, at + count):
        c = (scratch[k, 0], scratch[k, 1], scratch[k, 2])
        store3(scratch, k, 0, (x + dot(u, c), y + dot(v, c), z + dot(n, c)))
        scratch[k, EDGE] = k - at
    return count, number


@formula
def face_overlap(scratch, m1, m2):
    """Overlap of two faces: place, corners, the other face's first corner and slopes, its side."""
    if m2 > 2:
        a, b, cosine = face_slope(scratch, FACE_2, m2)
        other, side = FACE_2, 1.0
        if m1 > 2:
            at, count = clip_face(scratch, FACE_1, m1, FACE_2, m2, -1.0)
        else:
            at, count = clip_segment(scratch, FACE_1, FACE_2, m2, -1.0)
        count = count if cosine > 0.0 else 0
    elif m1 > 2:
        a, b, cosine = face_slope(scratch, FACE_1, m1)
        other, side = FACE_1, -1.0
        at, count = clip_segment(scratch, FACE_2, FACE_1, m1, 1.0)
        count = count if cosine > 0.0 else 0
    else:
        other, side, at = FACE_2, 1.0, CLIPPED_1
        count, a, b = segment_overlap(scratch, FACE_1, FACE_2)
    return at, count, other, a, b, side


@formula
def corners_coincide(scratch, a, b, same):
    """Whether two corners are at the same position within ``same``."""
    x, y = scratch[a, X] - scratch[b, X], scratch[a, Y] - scratch[b, Y]
    return x * x + y * y <= same * same


@formula
def corner_gaps(scratch, at, count, rounding, limits, plane, first_name):
    """Compute gaps of the corners to a face; those within reach move up. Returns their number, the smallest gap."""
    other, a, b, side = plane
    r1, r2 = rounding
    reach, same = limits
    x, y, z = scratch[other, X], scratch[other, Y], scratch[other, Z]
    kept, least = 0, inf
    edge = scratch[at + count - 1, EDGE]
    for k in range(at, at + count):
        height = z + a * (scratch[k, X] - x) + b * (scratch[k, Y] - y)
        gap = side * (height - scratch[k, Z]) - r1 - r2
        name = first_name + edge * (2 * MAX_CORNERS) + scratch[k, EDGE]
        edge = scratch[k, EDGE]
        if gap <= reach and not (
            kept > 0 and (corners_coincide(scratch, at + kept - 1, k, same) or corners_coincide(scratch, at, k, same))
        ):
            to = at + kept
            scratch[to, X], scratch[to, Y] = scratch[k, X], scratch[k, Y]
            scratch[to, Z] = 0.5 * (height + scratch[k, Z] + r1 - r2)
            scratch[to, EDGE], scratch[to, DEPTH] = name, gap
            kept += 1
            least = min(least, gap)
    return kept, least


@formula
def is_farther(best, value):
    """Whether a value exceeds the best so far by more than rounding; equal values keep the first point."""
    return value > best + 1e-6 * abs(best)


@formula
def swap_corners(scratch, a, b):
    """Exchange two corners."""
    for c in range(5):
        scratch[a, c], scratch[b, c] = scratch[b, c], scratch[a, c]


@formula
def reduce_to_four(scratch, at, count, same):
    """Move four corners to the front: the deepest, the farthest from it, the farthest to either side. Returns four."""
    best = at
    for k in range(at + 1, at + count):
        if scratch[k, DEPTH] < scratch[best, DEPTH] - same:
            best = k
    swap_corners(scratch, at, best)
    x, y = scratch[at, X], scratch[at, Y]
    best, far = at + 1, 0.0
    for k in range(at + 1, at + count):
        u, v = scratch[k, X] - x, scratch[k, Y] - y
        if is_farther(far, u * u + v * v):
            best, far = k, u * u + v * v
    swap_corners(scratch, at + 1, best)
    u, v = scratch[at + 1, X] - x, scratch[at + 1, Y] - y
    for to, turn in ((at + 2, 1.0), (at + 3, -1.0)):
        best, far = to, 0.0
        for k in range(to, at + count):
            area = turn * (u * (scratch[k, Y] - y) - v * (scratch[k, X] - x))
            if is_farther(far, area):
                best, far = k, area
        swap_corners(scratch, to, best)
    return 4


@formula
def write_contacts(scratch, at, count, frame):
    """Write corners as contacts."""
    for k in range(count):
        c = at + k
        p = add(scale(scratch[c, X], frame[0]), add(scale(scratch[c, Y], frame[1]), scale(scratch[c, Z], frame[2])))
        store3(scratch, k, 0, p)
        store3(scratch, k, 3, frame[2])
        scratch[k, 6], scratch[k, 7] = scratch[c, DEPTH], scratch[c, EDGE]


@formula
def smallest_contact_gap(scratch, count):
    """Smallest gap of the contacts in the first rows."""
    least = inf
    for k in range(count):
        least = min(least, scratch[k, 6])
    return least


@formula
def manifold(G, i, j, A, B, n, nearest, reach, scratch):
    """Write contacts of shapes i at A and j at B along the unit normal n from i to j; returns their number.

    ``nearest``: the smallest gap and the point midway between the surfaces there. It becomes a contact of its own if
    the faces have no point as deep. A gap of inf means that it is unknown.
    """
    frame = contact_frame(n)
    m1, number_1 = face_in_frame(G, i, A, n, frame, scratch, FACE_1)
    m2 = number_2 = 0
    if m1 > 1:
        m2, number_2 = face_in_frame(G, j, B, neg(n), frame, scratch, FACE_2)
    r1, r2 = radius(G.shape.kind[i], G, i), radius(G.shape.kind[j], G, j)
    same = SAME_POINT * min(G.dimensions.radius[i], G.dimensions.radius[j])
    at, count, least = CLIPPED_1, 0, inf
    if m2 > 1:
        at, count, other, a, b, side = face_overlap(scratch, m1, m2)
        if count:
            name = FACE_FEATURES * (number_1 + FACE_PAIRS * number_2)
            count, least = corner_gaps(scratch, at, count, (r1, r2), (reach, same), (other, a, b, side), name)
    gap, p = nearest
    if gap <= reach and gap < least - same:
        store3(scratch, at + count, 0, (dot(frame[0], p), dot(frame[1], p), dot(n, p)))
        scratch[at + count, EDGE], scratch[at + count, DEPTH] = NEAREST_FEATURE, gap
        count += 1
    if count > 4:
        count = reduce_to_four(scratch, at, count, same)
    write_contacts(scratch, at, count, frame)
    return count
