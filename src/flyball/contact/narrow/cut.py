"""One face cut by another, as seen along the normal of contact; corners are rows (x, y, height, edge, ...) of the room.

(Sutherland and Hodgman 1974.) A corner keeps the number of the edge that leaves it: the face's own edges are 0, 1, ...,
those of the other face follow from `CORNERS` on. The two edges that meet in a point are its name.
"""

from __future__ import annotations

from ...compiler.formulas import formula
from ...math.scalar import sqrt
from .room import CORNERS, CUT_1, CUT_2

X, Y, Z, EDGE, DEPTH = range(5)  # columns: place, height, edge to the next corner, gap
KEEP = 1e-6  # part of an edge's length that corners may be beyond it and stay: equal boxes on each other
STEEP = 0.1  # a face or line is not used where the cosine of its lean against the plane square to the normal is less
POINT = 1e-9  # parts of a line that are as good as a point
PARALLEL = 3e-3  # lines are as one where they differ by less [rad]


@formula
def slope(room, at, count):
    """How a face's height grows along x and y, and the cosine of its lean (0: too steep); Newell's normal."""
    x = y = z = 0.0
    a = at + count - 1
    for b in range(at, at + count):
        x += (room[a, Y] - room[b, Y]) * (room[a, Z] + room[b, Z])
        y += (room[a, Z] - room[b, Z]) * (room[a, X] + room[b, X])
        z += (room[a, X] - room[b, X]) * (room[a, Y] + room[b, Y])
        a = b
    length = sqrt(x * x + y * y + z * z)
    if abs(z) <= STEEP * length:
        return 0.0, 0.0, 0.0
    return -x / z, -y / z, abs(z) / length


@formula
def between(room, a, b, t, to, edge):
    """Write the point that part t of the way from corner a to corner b."""
    for c in range(3):
        room[to, c] = room[a, c] + t * (room[b, c] - room[a, c])
    room[to, EDGE] = edge


@formula
def cut_off(room, at, count, a, b, turn, edge, to):
    """What of a face is on the inner side of the edge from a to b: how many corners, written from ``to`` on."""
    x, y = room[a, X], room[a, Y]
    ex, ey = turn * (room[b, X] - x), turn * (room[b, Y] - y)
    least = -KEEP * (ex * ex + ey * ey)
    kept = 0
    p = at + count - 1
    dp = ex * (room[p, Y] - y) - ey * (room[p, X] - x)
    for k in range(at, at + count):
        dk = ex * (room[k, Y] - y) - ey * (room[k, X] - x)
        if dp >= least and dk < least:  # going out
            if dp > 0.0:
                between(room, p, k, dp / (dp - dk), to + kept, edge)
                kept += 1
            elif kept > 0:
                room[to + kept - 1, EDGE] = edge
        if dk >= least:
            if dp < least and dk > 0.0:  # coming in
                between(room, p, k, dp / (dp - dk), to + kept, room[p, EDGE])
                kept += 1
            between(room, k, k, 0.0, to + kept, room[k, EDGE])
            kept += 1
        p, dp = k, dk
    return kept


@formula
def cut_face(room, at, count, tool, corners, turn):
    """A face cut by all edges of another, which goes round by ``turn`` (1: counter-clockwise): where it is, corners."""
    a = tool + corners - 1
    to = CUT_1
    for b in range(tool, tool + corners):
        if count == 0:
            break
        count = cut_off(room, at, count, a, b, turn, CORNERS + a - tool, to)
        at, to, a = to, CUT_1 + CUT_2 - to, b
    return at, count


@formula
def part(room, at, first, last):
    """Write a part of a line from ``CUT_1`` on: two corners, one where it is as good as a point, none."""
    if first > last:
        return 0
    between(room, at, at + 1, first, CUT_1, 0.0)
    between(room, at, at + 1, last, CUT_1 + 1, 1.0)
    return 2 if last - first > POINT else 1


@formula
def cut_line(room, at, tool, corners, turn):
    """A line cut by all edges of a face: where it is, two corners or none; its ends keep their names."""
    first, last = 0.0, 1.0
    a = tool + corners - 1
    for b in range(tool, tool + corners):
        x, y = room[a, X], room[a, Y]
        ex, ey = turn * (room[b, X] - x), turn * (room[b, Y] - y)
        least = -KEEP * (ex * ex + ey * ey)
        d0 = ex * (room[at, Y] - y) - ey * (room[at, X] - x)
        d1 = ex * (room[at + 1, Y] - y) - ey * (room[at + 1, X] - x)
        if d0 < least and d1 < least:
            return CUT_1, 0
        if d0 < least:
            first = max(first, d0 / (d0 - d1))
        elif d1 < least:
            last = min(last, d0 / (d0 - d1))
        a = b
    return CUT_1, part(room, at, first, last)


@formula
def along_line(room, at, other):
    """What two nearly parallel lines have side by side, and how the other's height grows there: corners, slopes."""
    x, y = room[at + 1, X] - room[at, X], room[at + 1, Y] - room[at, Y]
    u, v = room[other + 1, X] - room[other, X], room[other + 1, Y] - room[other, Y]
    z, w = room[at + 1, Z] - room[at, Z], room[other + 1, Z] - room[other, Z]
    xx, uu = x * x + y * y, u * u + v * v
    if xx <= STEEP * STEEP * z * z or uu <= STEEP * STEEP * w * w:
        return 0, 0.0, 0.0
    across = x * v - y * u
    if across * across >= PARALLEL * PARALLEL * xx * uu:  # crossing, or one is a point
        return 0, 0.0, 0.0
    s0 = ((room[other, X] - room[at, X]) * x + (room[other, Y] - room[at, Y]) * y) / xx
    s1 = s0 + (x * u + y * v) / xx
    first, last = max(0.0, min(s0, s1)), min(1.0, max(s0, s1))
    return part(room, at, first, last), w / uu * u, w / uu * v
