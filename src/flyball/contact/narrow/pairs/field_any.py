"""A height field and any convex shape.

The shape is held against each triangle under its bounds. Two ways to touch are kept apart, so that nothing catches on
an edge between triangles that continue each other:

- a corner of the shape (or its lowest point) is over a triangle, as seen along the triangle's normal: the normal is the
  triangle's. Sides of the field below its surface do not exist: what is deep is pushed up. A corner that would come out
  straight up by less than along the normal belongs to another triangle.
- an edge or corner of the field that is bent outwards meets the shape: nearest points, and the normal must be one that
  the field has there.
"""

from __future__ import annotations

from ....compiler.formulas import formula
from ....math.scalar import sqrt
from ....math.vec import add, dot, load3, mm, mtv, mv, neg, put3, scale, sub, transpose
from ...kinds import FIELD, POLYGON
from ...tables import KIND
from ..any_shape import face, radius, support
from ..manifold import NEAREST_NAME, manifold
from ..patch import ALIKE, BENT, KEPT, gather, holds, lay, on_ridge, over, ridged, thin_out
from ..room import CORNERS, FACE_2, NEAREST, PIECE
from ..separation import separation
from ..shapes.field import grid, height
from ..shapes.registry import SHAPES

SOLIDS = tuple(s.kind for s in SHAPES if s.kind not in (FIELD, POLYGON))  # every convex kind in space
PAIRS = tuple((min(k, FIELD), max(k, FIELD)) for k in SOLIDS)
ONE = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)
PLACES = 4.0 * CORNERS
LATER = 2.0**45
SPARE = KEPT - 1


@formula
def extent(G, s, p, R, r, axis):
    """From where to where a shape reaches along an axis of the field."""
    d = (1.0 if axis == 0 else 0.0, 1.0 if axis == 1 else 0.0, 1.0 if axis == 2 else 0.0)
    kind, local = G.shape_i[s, KIND], mtv(R, d)
    low = add(p, mv(R, support(kind, G, s, neg(local))))
    high = add(p, mv(R, support(kind, G, s, local)))
    return low[axis] - r, high[axis] + r


@formula
def resting(G, f, point, n, limits, room, count):
    """Keep a point of the surface, if it touches: where, gap along the unit normal n over the triangle, name."""
    x, gap, name = point
    reach, near = limits
    if gap > reach or not over(x, n, room):
        return count
    if gap < 0.0 and height(G, f, x[0], x[1]) - x[2] < -gap * (1.0 - 1e-9) - 1e-3 * near:
        return count
    return gather(room, count, sub(x, scale(0.5 * gap, n)), n, gap, name, near)


@formula
def corners(G, f, s, P, n, r, limits, room, count):
    """The corners of the side that looks down on the triangle with the unit normal n, and the lowest point."""
    p, R = P
    kind = G.shape_i[s, KIND]
    down = mtv(R, neg(n))
    a = load3(room, PIECE, 0)
    lowest = sub(add(p, mv(R, support(kind, G, s, down))), scale(r, n))
    gap = dot(n, sub(lowest, a))
    if gap > limits[0]:
        return count
    corners, number = face(kind, G, s, down, room, FACE_2)
    for k in range(corners if corners > 1 else 0):
        x = sub(add(p, mv(R, load3(room, FACE_2 + k, 0))), scale(r, n))
        name = -2.0 - (number * PLACES + k)
        count = resting(G, f, (x, dot(n, sub(x, a)), name), n, limits, room, count)
    return resting(G, f, (lowest, gap, -2.0 - (PLACES - 1.0)), n, limits, room, count)


@formula
def ridge(G, f, s, P, cell, n, r, limits, room, count):
    """Contacts at an edge or corner of the triangle; where these overlap in no way the field has, one to spare."""
    i, j, upper = cell
    reach, near = limits
    gap, m, a = separation(G, f, s, P[0], P[1], n, reach + r, room, NEAREST)
    gap -= r
    if gap > reach:
        return count
    if not holds(G, f, i, j, upper, m, room):
        if gap < room[SPARE, 6]:
            put3(room, SPARE, 0, a)
            put3(room, SPARE, 3, n)
            room[SPARE, 6], room[SPARE, 7] = gap, LATER + room[PIECE + 3, 0]
        return count
    middle = add(a, scale(0.5 * gap, m))
    found = manifold(G, f, s, ((0.0, 0.0, 0.0), ONE), P, m, (gap, middle), reach, room)
    flush = dot(m, n) > 1.0 - BENT * BENT
    for k in range(found):
        if flush and not on_ridge(G, f, i, j, upper, n, load3(room, k, 0), room):
            continue  # a corner of the shape, or on an edge between triangles in one plane
        name = room[k, 7]
        if name == NEAREST_NAME:
            name = LATER + room[PIECE + 3, 0]
        count = gather(room, count, load3(room, k, 0), load3(room, k, 3), room[k, 6], name, near)
    return count


@formula
def last(room, count, near):
    """Take the contact to spare if the shape is in the field and nothing else says so: out along the triangle."""
    for k in range(KEPT, KEPT + count):
        if room[k, 6] < 0.0:
            return count
    if not room[SPARE, 6] < 0.0:
        return count
    x, n = load3(room, SPARE, 0), load3(room, SPARE, 3)
    return gather(room, count, x, n, room[SPARE, 6], room[SPARE, 7], near)


@formula
def under(G, f, s, P, r, reach, room, near):
    """Gather contacts with all triangles under the shape: how many."""
    nx, ny, dx, dy = grid(G, f)
    x0, x1 = extent(G, s, P[0], P[1], r + reach, 0)
    y0, y1 = extent(G, s, P[0], P[1], r + reach, 1)
    z0, _ = extent(G, s, P[0], P[1], r + reach, 2)
    count = 0
    room[SPARE, 6] = 0.0
    if not (x1 >= 0.0 and y1 >= 0.0 and x0 <= (nx - 1) * dx and y0 <= (ny - 1) * dy):
        return 0
    for i in range(int(max(x0, 0.0) / dx), int(min(x1 / dx, nx - 2.0)) + 1):
        for j in range(int(max(y0, 0.0) / dy), int(min(y1 / dy, ny - 2.0)) + 1):
            for upper in range(2):
                n = lay(G, f, i, j, upper == 1, room)
                n = scale(1.0 / sqrt(dot(n, n)), n)
                if max(room[PIECE, 2], room[PIECE + 1, 2], room[PIECE + 2, 2]) < z0:
                    continue
                count = corners(G, f, s, P, n, r, (reach, near), room, count)
                if ridged(G, f, i, j, upper == 1, n, room):
                    count = ridge(G, f, s, P, (i, j, upper == 1), n, r, (reach, near), room, count)
    return last(room, count, near)


@formula
def collide(G, i, j, A, B, reach, room):
    """Contacts in the field's axes, thinned out, then told in the world's."""
    turned = G.shape_i[j, KIND] == FIELD
    f, s = (j, i) if turned else (i, j)
    p, Q = B if turned else A
    q, S = A if turned else B
    P = (mtv(Q, sub(q, p)), mm(transpose(Q), S))
    nx, ny, dx, dy = grid(G, f)
    r = radius(G.shape_i[s, KIND], G, s)
    near = ALIKE * min(dx, dy)
    count = thin_out(room, KEPT, under(G, f, s, P, r, reach, room, near), near)
    for k in range(count):
        n = mv(Q, load3(room, KEPT + k, 3))
        put3(room, k, 0, add(p, mv(Q, load3(room, KEPT + k, 0))))
        put3(room, k, 3, neg(n) if turned else n)
        room[k, 6], room[k, 7] = room[KEPT + k, 6], room[KEPT + k, 7]
    return count
