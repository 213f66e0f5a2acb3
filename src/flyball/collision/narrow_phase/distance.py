"""Signed distance of two convex shapes, in space and in the plane, and the contacts of a generic convex pair.

Separate cores: GJK (Gilbert, Johnson and Keerthi 1988). A direction n, from 1 to 2, separates the cores by
``s(n) = -max over 1 of n.x + min over 2 of n.x``; the distance is the largest s. Every step has s of its direction, a
lower bound, and a point of the difference of both cores whose length is an upper bound. The search ends when the
bounds meet, when a step makes no progress (rounding), or after `MAX_STEPS`. The nearest point of a simplex: Ericson,
*Real-Time Collision Detection* (2005), 5.1; in the plane of a triangle it is computed along the normal, which keeps
its direction accurate close to the origin. Corners are rows of the scratch, coordinates in columns 0 to 2, the newest
last.

If cores touch or overlap, the separation along a direction n is improved iteratively: shape 2 is moved away along n
until there is a clear gap; the nearest points then give a direction that separates at least as well (the origin is
projected on the difference of both from a point beyond its surface; equality is a local optimum). A few such steps
solve shallow overlaps to rounding, for curved shapes too.

For deep overlaps the initial direction is that of the expanding polytope algorithm, EPA (Van den Bergen 2001). A
polytope inside the difference of the cores is expanded where it is nearest to the origin. Its nearest face bounds the
depth from below, the support along any face's normal from above; when both bounds meet, the depth is the smallest
one. The polytope is a closed set of directed edges in spite of rounding: faces that are visible from the new corner
are removed, and their edges without counterpart form new faces.
"""

from __future__ import annotations

from math import inf

from ...compiler.formulas import formula
from ...math.scalar import absolute, sqrt
from ...math.vec import add, cross, dot, load3, mm, mtv, mv, neg, norm, scale, store3, sub, transpose
from ..shape_kinds import FIELD
from ..shapes.polygon import support as polygon_support
from ..shapes.registry import radius, support
from .manifold import contact_frame, manifold
from .primitives import FIELD_TRIANGLE, SIMPLEX


@formula
def core_support(G, i, scratch, d):
    """Point of the core of shape i farthest along d, in its axes."""
    kind = G.shape.kind[i]
    if kind != FIELD:
        return support(kind, G, i, d)
    best = load3(scratch, FIELD_TRIANGLE, 0)
    for k in range(1, 3):
        x = load3(scratch, FIELD_TRIANGLE + k, 0)
        if dot(d, x) > dot(d, best):
            best = x
    return best


DEGENERATE = 1e-26  # squared sine below which three points are on a line, four in a plane


@formula
def nearest_on_line(a, b):
    """Nearest point to the origin of the segment from a to b, and the weights of both."""
    e = sub(b, a)
    ee = dot(e, e)
    t = -dot(a, e)
    if t <= 0.0 or ee == 0.0:
        return a, (1.0, 0.0, 0.0)
    if t >= ee:
        return b, (0.0, 1.0, 0.0)
    t /= ee
    return add(a, scale(t, e)), (1.0 - t, t, 0.0)


@formula
def nearest_on_edges(a, b, c):
    """Nearest point to the origin of three edges, and the weights of the corners."""
    v, w = nearest_on_line(a, b)
    for k in range(2):
        x, u = nearest_on_line(a if k == 0 else b, c)
        if dot(x, x) < dot(v, v):
            v, w = x, ((u[0], 0.0, u[1]) if k == 0 else (0.0, u[0], u[1]))
    return v, w


@formula
def nearest_on_triangle(a, b, c):
    """Nearest point to the origin of a triangle, and the weights of its corners."""
    ab, ac = sub(b, a), sub(c, a)
    n = cross(ab, ac)
    nn = dot(n, n)
    if nn > DEGENERATE * dot(ab, ab) * dot(ac, ac):
        # signed areas, over the triangle's times nn, of the parts towards the origin
        u, v, w = dot(n, cross(b, c)), dot(n, cross(c, a)), dot(n, cross(a, b))
        if u > 0.0 and v > 0.0 and w > 0.0:
            s = 1.0 / (u + v + w)
            return scale(dot(n, a) / nn, n), (u * s, v * s, w * s)
    return nearest_on_edges(a, b, c)


@formula
def nearest_on_tetrahedron(scratch, at):
    """Nearest point to the origin of a tetrahedron, weights of its corners, and whether the origin is inside.

    The origin must be on the inner side of the face opposite to the newest corner.
    """
    v, w, least, inside = (0.0, 0.0, 0.0), (0.25, 0.25, 0.25, 0.25), -1.0, True
    c = load3(scratch, at + 3, 0)
    for k in range(3):
        i, j, m = k, (k + 1) % 3, (k + 2) % 3
        a, b, d = load3(scratch, at + i, 0), load3(scratch, at + j, 0), load3(scratch, at + m, 0)
        ca, cb, cd = sub(a, c), sub(b, c), sub(d, c)
        n = cross(ca, cb)
        height, origin = dot(n, cd), -dot(n, c)
        thin = height * height <= DEGENERATE * dot(n, n) * dot(cd, cd)
        if not thin and (height > 0.0) == (origin > 0.0):
            continue
        inside = False
        x, u = nearest_on_triangle(a, b, c)
        xx = dot(x, x)
        if least < 0.0 or xx < least:
            least, v = xx, x
            w0 = u[0] if i == 0 else (u[1] if j == 0 else 0.0)
            w1 = u[0] if i == 1 else (u[1] if j == 1 else 0.0)
            w2 = u[0] if i == 2 else (u[1] if j == 2 else 0.0)
            w = (w0, w1, w2, u[2])
    return v, w, inside


@formula
def nearest_on_simplex(scratch, at, count):
    """Nearest point of the first ``count`` rows from ``at``, weights of four rows, whether the origin is inside."""
    a = load3(scratch, at, 0)
    if count == 4:
        return nearest_on_tetrahedron(scratch, at)
    if count == 1:
        return a, (1.0, 0.0, 0.0, 0.0), False
    b = load3(scratch, at + 1, 0)
    if count == 2:
        v, w = nearest_on_line(a, b)
    else:
        v, w = nearest_on_triangle(a, b, load3(scratch, at + 2, 0))
    return v, (w[0], w[1], w[2], 0.0), False


MAX_STEPS = 128  # maximum number of steps
BOUND_TOLERANCE = 1e-14  # relative to the size; difference of bounds at convergence
SMALLEST_DISTANCE = 1e-7  # relative to the size; below it the direction of the nearest points is inaccurate
SEPARATE, BEYOND_REACH, OVERLAPPING = range(3)  # found; farther apart than requested; touching or overlapping


@formula
def difference_support(G, i, j, p, R, scratch, d):
    """Farthest points along d of core 1, and of the difference 1 - 2."""
    a = core_support(G, i, scratch, d)
    b = core_support(G, j, scratch, neg(mtv(R, d)))
    return a, sub(a, add(p, mv(R, b)))


@formula
def drop_unused_corners(scratch, at, count, w):
    """Remove the corners without weight; returns the number of remaining ones."""
    n = 0
    for k in range(count):
        if w[k] > 0.0:
            for c in range(6):
                scratch[at + n, c] = scratch[at + k, c]
            scratch[at + n, 6] = w[k]
            n += 1
    return n


@formula
def core_distance(G, i, j, p, R, start, far, scratch, at):
    """Status, separation, its direction from 1 to 2, size of the difference, number of corners of the simplex.

    Parameters
    ----------
    i, j : int
        The shapes.
    p, R
        Pose of shape 2 in the axes of shape 1, in which everything is expressed.
    start : tuple
        Initial direction from 1 to 2, not all zeros.
    far : float
        Separation [m] at which the search stops: a larger one is not computed.
    scratch, at
        Scratch: rows ``at`` to ``at + 4`` hold corners of the simplex: the difference, the point of core 1, the weight.

    Notes
    -----
    If the cores overlap the separation is the largest s found (negative), a bound of the depth from above.
    """
    d, best, along, size, count, vv = start, -1e300, start, 0.0, 0, 1e300
    for _step in range(MAX_STEPS):
        length = sqrt(dot(d, d))
        if not length > 0.0:
            return OVERLAPPING, best, along, size, count
        a, x = difference_support(G, i, j, p, R, scratch, d)
        bound = -dot(d, x) / length
        if bound > best:
            best, along = bound, scale(1.0 / length, d)
            if bound > far:
                return BEYOND_REACH, best, along, size, count
        size = max(size, sqrt(dot(x, x)))
        if count > 0 and length - best <= BOUND_TOLERANCE * size:
            break
        store3(scratch, at + count, 0, x)
        store3(scratch, at + count, 3, a)
        v, w, inside = nearest_on_simplex(scratch, at, count + 1)
        new = dot(v, v)
        if inside:
            count = drop_unused_corners(scratch, at, 4, w)
            return OVERLAPPING, best, along, size, count
        if count > 0 and not new < vv:
            break
        count = drop_unused_corners(scratch, at, count + 1, w)
        vv = new
        d = neg(v)
        if vv <= (1e-15 * size) ** 2:
            return OVERLAPPING, best, along, size, count
    return (SEPARATE if vv > (SMALLEST_DISTANCE * size) ** 2 else OVERLAPPING), best, along, size, count


@formula
def point_of_simplex(scratch, at, count):
    """Point of core 1 for the nearest point of the simplex."""
    x = (0.0, 0.0, 0.0)
    for k in range(count):
        x = add(x, scale(scratch[at + k, 6], load3(scratch, at + k, 3)))
    return x


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


@formula
def edge_normal(G, a, b):
    """Return the unit normal of the side from vertex a to vertex b, and its length; 0 if both coincide."""
    x, y = G.vertex[b, 0] - G.vertex[a, 0], G.vertex[b, 1] - G.vertex[a, 1]
    length = sqrt(x * x + y * y)
    if not length > 0.0:
        return (0.0, 0.0, 0.0), 0.0
    return (y / length, -x / length, 0.0), length


@formula
def point_polygon_distance(G, i, c):
    """Signed distance of a point from a polygon's core, unit vector from the core to it, nearest point of the core."""
    first, count = G.shape.first[i], G.shape.count[i]
    x, y, least = G.vertex[first, 0], G.vertex[first, 1], inf
    depth, n = -inf, (1.0, 0.0, 0.0)
    a = first + count - 1
    for b in range(first, first + count):
        m, length = edge_normal(G, a, b)
        u, v = c[0] - G.vertex[a, 0], c[1] - G.vertex[a, 1]
        if length > 0.0:
            above = m[0] * u + m[1] * v
            if above > depth:
                depth, n = above, m
            t = max(0.0, min(length, m[0] * v - m[1] * u))
            px, py = G.vertex[a, 0] - t * m[1], G.vertex[a, 1] + t * m[0]
        else:
            px, py = G.vertex[a, 0], G.vertex[a, 1]
        square = (c[0] - px) * (c[0] - px) + (c[1] - py) * (c[1] - py)
        if square < least:
            least, x, y = square, px, py
        a = b
    if -inf < depth <= 0.0:
        return depth, n, (c[0] - depth * n[0], c[1] - depth * n[1], 0.0)
    length = sqrt(least)
    if length < 1e-150:
        return 0.0, n, (x, y, 0.0)
    return length, ((c[0] - x) / length, (c[1] - y) / length, 0.0), (x, y, 0.0)


@formula
def edge_separation(G, i, j, p, R):
    """Largest separation along a side's normal of polygon i, and that normal; j has pose (p, R) in i's axes."""
    first, count = G.shape.first[i], G.shape.count[i]
    far, n, a = -inf, (1.0, 0.0, 0.0), first + count - 1
    for b in range(first, first + count):
        m, length = edge_normal(G, a, b)
        if length > 0.0:
            q = add(p, mv(R, polygon_support(G, j, mtv(R, neg(m)))))
            s = m[0] * (q[0] - G.vertex[a, 0]) + m[1] * (q[1] - G.vertex[a, 1])
            if s > far:
                far, n = s, m
        a = b
    return far, n


@formula
def nearest_vertex(G, i, j, p, R):
    """Distance of the corner of polygon j nearest to polygon i, unit vector to it, both nearest points."""
    first = G.shape.first[j]
    far, n, x, y = inf, (1.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    for k in range(first, first + G.shape.count[j]):
        c = add(p, mv(R, load3(G.vertex, k, 0)))
        length, d, q = point_polygon_distance(G, i, c)
        if length < far:
            far, n, x, y = length, d, q, c
    return far, n, x, y


@formula
def polygon_separation(G, i, j, A, B, prefer):
    """Largest separation of the cores of two polygons at A and B along a side's normal, and the normal from i to j."""
    C = mm(transpose(A[1]), B[1])
    far, n = edge_separation(G, i, j, mtv(A[1], sub(B[0], A[0])), C)
    n = mv(A[1], n)
    s, m = edge_separation(G, j, i, mtv(B[1], sub(A[0], B[0])), transpose(C))
    return (far, n) if s <= far + prefer else (s, neg(mv(B[1], m)))


@formula
def polygon_distance(G, i, j, A, B, prefer):
    """Distance of the cores of two separate polygons, unit normal from i to j, a point midway between."""
    C = mm(transpose(A[1]), B[1])
    far, d, x, y = nearest_vertex(G, i, j, mtv(A[1], sub(B[0], A[0])), C)
    s, m, u, v = nearest_vertex(G, j, i, mtv(B[1], sub(A[0], B[0])), transpose(C))
    if s < far - prefer:
        return s, neg(mv(B[1], m)), add(B[0], mv(B[1], scale(0.5, add(u, v))))
    return far, mv(A[1], d), add(A[0], mv(A[1], scale(0.5, add(x, y))))


OFFSET = 0.03  # relative to the size; gap that is made
MAX_LOOKS = 48  # maximum number of iterations
SMALLEST_OFFSET = 1e-6  # relative to the size; smallest gap
NO_PROGRESS = 1e-13  # relative to the size; smaller improvements end the iteration
SHALLOW = 1e-8  # relative to the size; for smaller depths no other direction is tried
MAX_DOUBLINGS = 10  # maximum number of doublings
PROBE_ANGLE = 1e-3  # angle [rad] of trial directions
LOOKS_BEFORE_EPA = 4  # iterations before the polytope is used
DISTANCE_ROWS = 8 + POLYTOPE_ROWS  # of scratch


@formula
def extend_step(G, i, j, p, R, scratch, s, n, d):
    """Continue a step from n to d, with separation s, in doubled steps while the separation grows."""
    step = sub(d, n)
    best = d
    for _k in range(MAX_DOUBLINGS):
        step = scale(2.0, step)
        e = add(n, step)
        e = scale(1.0 / norm(e), e)
        a, x = difference_support(G, i, j, p, R, scratch, e)
        if not -dot(x, e) > s:
            break
        s, best = -dot(x, e), e
    return s, best


@formula
def probe_neighbours(G, i, j, p, R, scratch, s, n):
    """Compare n, with separation s, with directions beside it, to leave saddle points; returns the better one."""
    best = n
    for k in range(4):
        u = contact_frame(n)[k // 2]
        d = add(n, scale(PROBE_ANGLE if k % 2 == 0 else -PROBE_ANGLE, u))
        d = scale(1.0 / norm(d), d)
        a, x = difference_support(G, i, j, p, R, scratch, d)
        if -dot(x, d) > s:
            return extend_step(G, i, j, p, R, scratch, -dot(x, d), n, d)
    return s, best


@formula
def core_separation(G, i, j, p, R, start, far, scratch, at):
    """Separation of the cores, direction from 1 to 2, point of core 1; all in the axes of shape 1.

    Above ``far`` the separation is only a lower bound, and the point is invalid. The nearest point of core 2 is the
    point of core 1 plus separation times direction. ``start``, not all zeros, is an initial direction.
    """
    best, n, size, corners, asked = -1e300, start, 0.0, 0, False
    a, away, limit = p, 0.0, far
    for look in range(MAX_LOOKS):
        q = add(p, scale(away, n))
        status, s, d, length, count = core_distance(G, i, j, q, R, n, limit, scratch, at)
        if look == 0 and status == BEYOND_REACH:
            return s, d, a
        a = point_of_simplex(scratch, at, count)
        if look == 0 and status == SEPARATE:
            return s, d, a
        if look == 0:
            size, corners, limit = length, count, 1e300
            for k in range(count):
                store3(scratch, at + 8 + k, 0, load3(scratch, at + k, 0))
        s -= away * dot(n, d)
        better = status != OVERLAPPING and s > best + NO_PROGRESS * size
        if look == 0:
            best, n = s, d
        elif better:
            best, n = extend_step(G, i, j, p, R, scratch, s, n, d)
        if look > 0 and (not better or (look == LOOKS_BEFORE_EPA and not asked)):
            if -best <= SHALLOW * size:
                return best, n, a
            s, d = best, n
            if not asked:
                s, d = penetration_depth(G, i, j, p, R, scratch, at + 8, corners, size, best, n)
                asked = True
            if not better and s <= best + NO_PROGRESS * size:
                s, d = probe_neighbours(G, i, j, p, R, scratch, best, n)
                if s <= best + NO_PROGRESS * size:
                    return best, n, a
            best, n = s, d
        away = min(OFFSET * size, max(SMALLEST_OFFSET * size, -best)) - best
    return best, n, a


@formula
def signed_distance(G, i, j, A, B, reach, scratch):
    """Signed gap, unit normal from i to j, point midway between the surfaces; above ``reach`` some gap above it."""
    r, s = radius(G.shape.kind[i], G, i), radius(G.shape.kind[j], G, j)
    p = mtv(A[1], sub(B[0], A[0]))
    start = p if dot(p, p) > 0.0 else (1.0, 0.0, 0.0)
    far, d, a = core_separation(G, i, j, p, mm(transpose(A[1]), B[1]), start, reach + r + s, scratch, SIMPLEX)
    middle = add(a, scale(0.5 * (far + r - s), d))
    return far - r - s, mv(A[1], d), add(A[0], mv(A[1], middle))


@formula
def generic_pair(G, i, j, A, B, reach, scratch):
    """Contacts of a generic pair: the nearest points, then the facing faces; see `special_pairs.registry`."""
    gap, n, p = signed_distance(G, i, j, A, B, reach, scratch)
    if not gap <= reach:
        return 0
    return manifold(G, i, j, A, B, n, (gap, p), reach, scratch)
