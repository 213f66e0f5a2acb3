"""Signed distance of two convex shapes, in space and in the plane, and the contacts of a generic convex pair.

Separate cores: GJK. If cores touch or overlap, the separation along a direction n is improved iteratively:
shape 2 is moved away along n until there is a clear gap; the nearest points then give a direction that
separates at least as well (the origin is projected on the difference of both from a point beyond its surface;
equality is a local optimum). A few such steps solve shallow overlaps to rounding, for curved shapes too; for
deep overlaps the polytope of `epa` gives the initial direction.
"""

from __future__ import annotations

from math import inf

from ...compiler.formulas import formula
from ...math.scalar import sqrt
from ...math.vec import add, dot, load3, mm, mtv, mv, neg, norm, scale, store3, sub, transpose
from ..shapes.polygon import support
from ..shapes.registry import radius
from .epa import POLYTOPE_ROWS as POLYTOPE
from .epa import penetration_depth
from .gjk import BEYOND_REACH, OVERLAPPING, SEPARATE, core_distance, difference_support, point_of_simplex
from .manifold import contact_frame, manifold
from .primitives import SIMPLEX


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
            q = add(p, mv(R, support(G, j, mtv(R, neg(m)))))
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
DISTANCE_ROWS = 8 + POLYTOPE  # of scratch


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
