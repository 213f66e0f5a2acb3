"""Distances in the plane: of a point and a convex polygon, of two polygons."""

from __future__ import annotations

from math import inf

from ...compiler.formulas import formula
from ...math.scalar import sqrt
from ...math.vec import add, load3, mm, mtv, mv, neg, scale, sub, transpose
from ..tables import COUNT, FIRST
from .shapes.polygon import support


@formula
def outward(G, a, b):
    """Unit normal of the side from vertex a to vertex b, and its length; 0 where both are one point."""
    x, y = G.vertex[b, 0] - G.vertex[a, 0], G.vertex[b, 1] - G.vertex[a, 1]
    length = sqrt(x * x + y * y)
    if not length > 0.0:
        return (0.0, 0.0, 0.0), 0.0
    return (y / length, -x / length, 0.0), length


@formula
def nearest_side(G, i, c):
    """Signed distance of a point from a polygon's core, unit vector from the core to it, nearest point of the core."""
    first, count = G.shape_i[i, FIRST], G.shape_i[i, COUNT]
    x, y, least = G.vertex[first, 0], G.vertex[first, 1], inf
    depth, n = -inf, (1.0, 0.0, 0.0)
    a = first + count - 1
    for b in range(first, first + count):
        m, length = outward(G, a, b)
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
def along_sides(G, i, j, p, R):
    """Largest separation along a side's normal of polygon i, that normal; j at p, R in i's axes."""
    first, count = G.shape_i[i, FIRST], G.shape_i[i, COUNT]
    far, n, a = -inf, (1.0, 0.0, 0.0), first + count - 1
    for b in range(first, first + count):
        m, length = outward(G, a, b)
        if length > 0.0:
            q = add(p, mv(R, support(G, j, mtv(R, neg(m)))))
            s = m[0] * (q[0] - G.vertex[a, 0]) + m[1] * (q[1] - G.vertex[a, 1])
            if s > far:
                far, n = s, m
        a = b
    return far, n


@formula
def nearest_corner(G, i, j, p, R):
    """Distance of the corner of polygon j that is nearest to polygon i, unit vector to it, both nearest points."""
    first = G.shape_i[j, FIRST]
    far, n, x, y = inf, (1.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    for k in range(first, first + G.shape_i[j, COUNT]):
        c = add(p, mv(R, load3(G.vertex, k, 0)))
        length, d, q = nearest_side(G, i, c)
        if length < far:
            far, n, x, y = length, d, q, c
    return far, n, x, y


@formula
def sides_apart(G, i, j, A, B, prefer):
    """Largest separation of the cores of two polygons at A and B along a side's normal, and that, from i to j."""
    C = mm(transpose(A[1]), B[1])
    far, n = along_sides(G, i, j, mtv(A[1], sub(B[0], A[0])), C)
    n = mv(A[1], n)
    s, m = along_sides(G, j, i, mtv(B[1], sub(A[0], B[0])), transpose(C))
    return (far, n) if s <= far + prefer else (s, neg(mv(B[1], m)))


@formula
def corners_apart(G, i, j, A, B, prefer):
    """Distance of the cores of two polygons that do not overlap, unit normal from i to j, a point midway between."""
    C = mm(transpose(A[1]), B[1])
    far, d, x, y = nearest_corner(G, i, j, mtv(A[1], sub(B[0], A[0])), C)
    s, m, u, v = nearest_corner(G, j, i, mtv(B[1], sub(A[0], B[0])), transpose(C))
    if s < far - prefer:
        return s, neg(mv(B[1], m)), add(B[0], mv(B[1], scale(0.5, add(u, v))))
    return far, mv(A[1], d), add(A[0], mv(A[1], scale(0.5, add(x, y))))
