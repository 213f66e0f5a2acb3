"""Penetration depth of two convex cores by the expanding polytope algorithm (Van den Bergen 2001).

A polytope inside the difference of the cores is expanded where it is nearest to the origin. Its nearest face
bounds the depth from below, the support along any face's normal from above; when both bounds meet, the depth is the
smallest one. The polytope is a closed set of directed edges in spite of rounding: faces that are visible from the new
corner are removed, and their edges without counterpart form new faces.
"""

from __future__ import annotations

from ...compiler.formulas import formula
from ...math.scalar import absolute, sqrt
from ...math.vec import cross, dot, load3, neg, scale, store3, sub
from .gjk import difference_support

POLYTOPE_CORNERS = 96  # maximum corners of the polytope
POLYTOPE_FACES = 2 * POLYTOPE_CORNERS
HORIZON_EDGES = 96  # maximum edges of the horizon of a new corner
POLYTOPE_ROWS = POLYTOPE_CORNERS + POLYTOPE_FACES + HORIZON_EDGES  # of scratch
THIN = 1e-12  # relative to the size; smaller thickness or progress counts as zero
NEAR = 1e-7  # relative accuracy of the depth
A, B, C, DISTANCE, NX = 0, 1, 2, 3, 4  # columns of a face


@formula
def write_face(scratch, at, f, a, b, c):
    """Write face f (corners counter-clockwise seen from outside). A face without area is never the nearest."""
    x = load3(scratch, at + a, 0)
    ab, ac = sub(load3(scratch, at + b, 0), x), sub(load3(scratch, at + c, 0), x)
    n = cross(ab, ac)
    nn = dot(n, n)
    k = at + POLYTOPE_CORNERS + f
    scratch[k, A], scratch[k, B], scratch[k, C], scratch[k, DISTANCE] = a, b, c, 1e300
    store3(scratch, k, NX, n)
    if nn > 1e-28 * dot(ab, ab) * dot(ac, ac):
        n = scale(1.0 / sqrt(nn), n)
        store3(scratch, k, NX, n)
        scratch[k, DISTANCE] = dot(n, x)


@formula
def perpendicular_direction(scratch, at, count, turn):
    """Direction perpendicular to the first ``count`` (1 to 3) corners; ``turn`` 0 to 5 selects one."""
    if count == 1:
        s = 1.0 if turn < 3 else -1.0
        return (s if turn % 3 == 0 else 0.0, s if turn % 3 == 1 else 0.0, s if turn % 3 == 2 else 0.0)
    a = load3(scratch, at, 0)
    e = sub(load3(scratch, at + 1, 0), a)
    if count == 3:
        n = cross(e, sub(load3(scratch, at + 2, 0), a))
        return n if turn % 2 == 0 else neg(n)
    x, y, z = absolute(e[0]), absolute(e[1]), absolute(e[2])
    least = (x <= y and x <= z, y < x and y <= z)
    u = cross(e, (1.0 if least[0] else 0.0, 1.0 if least[1] else 0.0, 0.0 if least[0] or least[1] else 1.0))
    e = scale(1.0 / sqrt(dot(e, e)), e)
    w = cross(e, u)
    c, s = ((1.0, 0.0), (0.5, 0.75**0.5), (-0.5, 0.75**0.5))[turn % 3]
    s = s if turn < 3 else -s
    c = c if turn < 3 else -c
    return (c * u[0] + s * w[0], c * u[1] + s * w[1], c * u[2] + s * w[2])


@formula
def complete_tetrahedron(G, i, j, p, R, scratch, at, count, size, best, along):
    """Add corners until there are four; returns their number, and the best separation and direction found."""
    while count < 4:
        thick, taken = THIN * size, (0.0, 0.0, 0.0)
        for turn in range(6 if count < 3 else 2):
            d = perpendicular_direction(scratch, at, count, turn)
            length = sqrt(dot(d, d))
            if not length > 0.0:
                return count, best, along
            d = scale(1.0 / length, d)
            a, x = difference_support(G, i, j, p, R, scratch, d)
            if -dot(d, x) > best:
                best, along = -dot(d, x), d
            off = sub(x, load3(scratch, at, 0))
            if count > 1:
                off = scale(dot(off, d), d)
            if sqrt(dot(off, off)) > thick:
                thick, taken = sqrt(dot(off, off)), x
        if not thick > THIN * size:
            return count, best, along
        store3(scratch, at + count, 0, taken)
        count += 1
    return count, best, along


@formula
def write_tetrahedron(scratch, at):
    """Write the four faces of the first tetrahedron, counter-clockwise seen from outside."""
    a = load3(scratch, at, 0)
    e = sub(load3(scratch, at + 3, 0), a)
    inner = dot(cross(sub(load3(scratch, at + 1, 0), a), sub(load3(scratch, at + 2, 0), a)), e) > 0.0
    b, c = (2, 1) if inner else (1, 2)
    write_face(scratch, at, 0, 0, b, c)
    write_face(scratch, at, 1, 0, 3, b)
    write_face(scratch, at, 2, b, 3, c)
    write_face(scratch, at, 3, c, 3, 0)


@formula
def add_corner(scratch, at, faces, corner, thin):
    """Add a corner to the polytope; returns the number of faces, or -1 if there are too many."""
    x = load3(scratch, at + corner, 0)
    edge = at + POLYTOPE_CORNERS + POLYTOPE_FACES
    edges, f = 0, 0
    while f < faces:
        k = at + POLYTOPE_CORNERS + f
        if scratch[k, DISTANCE] > 1e299 or dot(load3(scratch, k, NX), x) - scratch[k, DISTANCE] <= thin:
            f += 1
            continue
        for s in range(3):
            a, b = scratch[k, s], scratch[k, (s + 1) % 3]
            found = -1
            for e in range(edges):
                if scratch[edge + e, 0] == b and scratch[edge + e, 1] == a:
                    found = e
            if found >= 0:
                edges -= 1
                scratch[edge + found, 0], scratch[edge + found, 1] = scratch[edge + edges, 0], scratch[edge + edges, 1]
            elif edges == HORIZON_EDGES:
                return -1
            else:
                scratch[edge + edges, 0], scratch[edge + edges, 1] = a, b
                edges += 1
        faces -= 1
        for s in range(7):
            scratch[k, s] = scratch[at + POLYTOPE_CORNERS + faces, s]
    if faces + edges > POLYTOPE_FACES:
        return -1
    for e in range(edges):
        write_face(scratch, at, faces + e, int(scratch[edge + e, 0]), int(scratch[edge + e, 1]), corner)
    return faces + edges


@formula
def penetration_depth(G, i, j, p, R, scratch, at, count, size, best, along):
    """Separation (negative: depth) and its direction from 1 to 2, for cores whose difference contains the origin.

    Rows from ``at`` hold ``count`` (at most 4) corners of the difference, and are scratch (`POLYTOPE_ROWS`). ``best``
    and ``along`` are a separation and direction known before. The depth found exceeds the smallest by at most the
    relative error `NEAR`, if `POLYTOPE_CORNERS` suffice.
    """
    count, best, along = complete_tetrahedron(G, i, j, p, R, scratch, at, count, size, best, along)
    if count < 4:
        return best, along
    write_tetrahedron(scratch, at)
    faces = 4
    while True:
        near, low = -1, 1e299
        for f in range(faces):
            if scratch[at + POLYTOPE_CORNERS + f, DISTANCE] < low:
                near, low = f, scratch[at + POLYTOPE_CORNERS + f, DISTANCE]
        if near < 0 or -best - low <= -NEAR * best or count == POLYTOPE_CORNERS:
            return best, along
        d = load3(scratch, at + POLYTOPE_CORNERS + near, NX)
        a, x = difference_support(G, i, j, p, R, scratch, d)
        if -dot(d, x) > best:
            best, along = -dot(d, x), d
        if dot(d, x) - low <= THIN * size:
            return best, along
        store3(scratch, at + count, 0, x)
        count += 1
        faces = add_corner(scratch, at, faces, count - 1, 0.1 * THIN * size)
        if faces < 0:
            return best, along
