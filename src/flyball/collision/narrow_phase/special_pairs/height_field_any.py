"""A height field and any convex shape.

The shape is tested against each triangle under its bounds. Two kinds of contact are distinguished, so that
shapes do not catch on edges between coplanar triangles:

- a corner of the shape (or its lowest point) is over a triangle, as seen along the triangle's normal: the
  contact normal is the triangle's. The field has no lateral surfaces: deep points are pushed up. A corner whose
  vertical way out is shorter than that along the normal belongs to another triangle.
- a convex edge or corner of the field touches the shape: nearest points, and the normal must be one that the
  field has there.
"""

from __future__ import annotations

from ....compiler.formulas import formula
from ....math.scalar import sqrt
from ....math.vec import add, dot, load3, mm, mtv, mv, neg, scale, store3, sub, transpose
from ...shape_kinds import FIELD, POLYGON
from ...shapes.height_field import (
    FIRST_GATHERED,
    FOLD_TOLERANCE,
    SAME_CONTACT,
    gather_contact,
    grid,
    has_convex_edge,
    height,
    is_field_normal,
    is_on_convex_edge,
    is_over_triangle,
    load_triangle,
    reduce_contacts,
)
from ...shapes.registry import SHAPES, face, radius, support
from ..distance import core_separation
from ..manifold import NEAREST_FEATURE, manifold
from ..primitives import FACE_2, FIELD_TRIANGLE, MAX_CORNERS, SIMPLEX

SOLIDS = tuple(s.kind for s in SHAPES if s.kind not in (FIELD, POLYGON))  # all convex kinds of spatial mechanisms
PAIRS = tuple((min(k, FIELD), max(k, FIELD)) for k in SOLIDS)
IDENTITY = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)
FEATURES_PER_FACE = 4.0 * MAX_CORNERS
NEAREST_POINT_FEATURE = 2.0**45
SPARE_ROW = FIRST_GATHERED - 1


@formula
def extent(G, s, p, R, r, axis):
    """Range that a shape covers along an axis of the field."""
    d = (1.0 if axis == 0 else 0.0, 1.0 if axis == 1 else 0.0, 1.0 if axis == 2 else 0.0)
    kind, local = G.shape.kind[s], mtv(R, d)
    low = add(p, mv(R, support(kind, G, s, neg(local))))
    high = add(p, mv(R, support(kind, G, s, local)))
    return low[axis] - r, high[axis] + r


@formula
def add_surface_point(G, f, point, n, limits, scratch, count):
    """Add a contact if a surface point touches; ``point``: position, gap along n, feature. Returns the count."""
    x, gap, name = point
    reach, near = limits
    if gap > reach or not is_over_triangle(x, n, scratch):
        return count
    if gap < 0.0 and height(G, f, x[0], x[1]) - x[2] < -gap * (1.0 - 1e-9) - 1e-3 * near:
        return count
    return gather_contact(scratch, count, sub(x, scale(0.5 * gap, n)), n, gap, name, near)


@formula
def corner_contacts(G, f, s, P, n, r, limits, scratch, count):
    """Add contacts of the corners of the side that faces the triangle with unit normal n, and of the lowest point."""
    p, R = P
    kind = G.shape.kind[s]
    down = mtv(R, neg(n))
    a = load3(scratch, FIELD_TRIANGLE, 0)
    lowest = sub(add(p, mv(R, support(kind, G, s, down))), scale(r, n))
    gap = dot(n, sub(lowest, a))
    if gap > limits[0]:
        return count
    corners, number = face(kind, G, s, down, scratch, FACE_2)
    for k in range(corners if corners > 1 else 0):
        x = sub(add(p, mv(R, load3(scratch, FACE_2 + k, 0))), scale(r, n))
        name = -2.0 - (number * FEATURES_PER_FACE + k)
        count = add_surface_point(G, f, (x, dot(n, sub(x, a)), name), n, limits, scratch, count)
    return add_surface_point(G, f, (lowest, gap, -2.0 - (FEATURES_PER_FACE - 1.0)), n, limits, scratch, count)


@formula
def edge_contacts(G, f, s, P, cell, n, r, limits, scratch, count):
    """Add contacts at an edge or corner of the triangle; a normal that the field lacks yields the spare contact."""
    i, j, upper = cell
    reach, near = limits
    gap, m, a = core_separation(G, f, s, P[0], P[1], n, reach + r, scratch, SIMPLEX)
    gap -= r
    if gap > reach:
        return count
    if not is_field_normal(G, f, i, j, upper, m, scratch):
        if gap < scratch[SPARE_ROW, 6]:
            store3(scratch, SPARE_ROW, 0, a)
            store3(scratch, SPARE_ROW, 3, n)
            scratch[SPARE_ROW, 6], scratch[SPARE_ROW, 7] = gap, NEAREST_POINT_FEATURE + scratch[FIELD_TRIANGLE + 3, 0]
        return count
    middle = add(a, scale(0.5 * gap, m))
    found = manifold(G, f, s, ((0.0, 0.0, 0.0), IDENTITY), P, m, (gap, middle), reach, scratch)
    flush = dot(m, n) > 1.0 - FOLD_TOLERANCE * FOLD_TOLERANCE
    for k in range(found):
        if flush and not is_on_convex_edge(G, f, i, j, upper, n, load3(scratch, k, 0), scratch):
            continue  # a corner of the shape, or an edge between coplanar triangles
        name = scratch[k, 7]
        if name == NEAREST_FEATURE:
            name = NEAREST_POINT_FEATURE + scratch[FIELD_TRIANGLE + 3, 0]
        count = gather_contact(scratch, count, load3(scratch, k, 0), load3(scratch, k, 3), scratch[k, 6], name, near)
    return count


@formula
def add_spare_contact(scratch, count, near):
    """Add the spare contact, along the triangle's normal, if no other contact shows that the shape is in the field."""
    for k in range(FIRST_GATHERED, FIRST_GATHERED + count):
        if scratch[k, 6] < 0.0:
            return count
    if not scratch[SPARE_ROW, 6] < 0.0:
        return count
    x, n = load3(scratch, SPARE_ROW, 0), load3(scratch, SPARE_ROW, 3)
    return gather_contact(scratch, count, x, n, scratch[SPARE_ROW, 6], scratch[SPARE_ROW, 7], near)


@formula
def gather_contacts(G, f, s, P, r, reach, scratch, near):
    """Gather contacts with all triangles under the shape; returns their number."""
    nx, ny, dx, dy = grid(G, f)
    x0, x1 = extent(G, s, P[0], P[1], r + reach, 0)
    y0, y1 = extent(G, s, P[0], P[1], r + reach, 1)
    z0, _ = extent(G, s, P[0], P[1], r + reach, 2)
    count = 0
    scratch[SPARE_ROW, 6] = 0.0
    if not (x1 >= 0.0 and y1 >= 0.0 and x0 <= (nx - 1) * dx and y0 <= (ny - 1) * dy):
        return 0
    for i in range(int(max(x0, 0.0) / dx), int(min(x1 / dx, nx - 2.0)) + 1):
        for j in range(int(max(y0, 0.0) / dy), int(min(y1 / dy, ny - 2.0)) + 1):
            for upper in range(2):
                n = load_triangle(G, f, i, j, upper == 1, scratch)
                n = scale(1.0 / sqrt(dot(n, n)), n)
                if max(scratch[FIELD_TRIANGLE, 2], scratch[FIELD_TRIANGLE + 1, 2], scratch[FIELD_TRIANGLE + 2, 2]) < z0:
                    continue
                count = corner_contacts(G, f, s, P, n, r, (reach, near), scratch, count)
                if has_convex_edge(G, f, i, j, upper == 1, n, scratch):
                    count = edge_contacts(G, f, s, P, (i, j, upper == 1), n, r, (reach, near), scratch, count)
    return add_spare_contact(scratch, count, near)


@formula
def collide(G, i, j, A, B, reach, scratch):
    """Find contacts in the field's axes, reduce them, and convert them to world axes."""
    turned = G.shape.kind[j] == FIELD
    f, s = (j, i) if turned else (i, j)
    p, Q = B if turned else A
    q, S = A if turned else B
    P = (mtv(Q, sub(q, p)), mm(transpose(Q), S))
    nx, ny, dx, dy = grid(G, f)
    r = radius(G.shape.kind[s], G, s)
    near = SAME_CONTACT * min(dx, dy)
    count = reduce_contacts(scratch, FIRST_GATHERED, gather_contacts(G, f, s, P, r, reach, scratch, near), near)
    for k in range(count):
        n = mv(Q, load3(scratch, FIRST_GATHERED + k, 3))
        store3(scratch, k, 0, add(p, mv(Q, load3(scratch, FIRST_GATHERED + k, 0))))
        store3(scratch, k, 3, neg(n) if turned else n)
        scratch[k, 6], scratch[k, 7] = scratch[FIRST_GATHERED + k, 6], scratch[FIRST_GATHERED + k, 7]
    return count
