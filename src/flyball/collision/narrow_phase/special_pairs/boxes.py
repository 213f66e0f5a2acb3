"""Two boxes: separating axes.

The 15 axes (faces of either box, cross products of edges) are tested in the first box's axes (Gottschalk, Lin,
Manocha 1996). For overlapping boxes the largest separation is the smallest separating translation. For separate
boxes it is the distance, if their faces are over each other along that axis; otherwise the nearest points are
computed.
"""

from __future__ import annotations

from math import inf

from ....compiler.formulas import formula
from ....math.scalar import sqrt
from ....math.vec import cross, dot, load3, mm, mtv, mv, neg, scale, transpose
from ...shape_kinds import BOX
from ..distance import signed_distance
from ..manifold import manifold, smallest_contact_gap

KINDS = (BOX, BOX)
PREFER = 1e-6  # tolerance by which sides are preferred to edges, and the first box's sides to the second's
PARALLEL = 1e-12  # squared sine of the angle below which two edges define no axis


@formula
def face_separation(best, C, c, half_a, half_b, first, prefer):
    """Largest separation along the sides of one box; c from it to the other, rows of C are its axes in the other's."""
    far, axis = best
    for k in range(3):
        reach = half_a[k] + abs(C[3 * k]) * half_b[0] + abs(C[3 * k + 1]) * half_b[1] + abs(C[3 * k + 2]) * half_b[2]
        s = abs(c[k]) - reach
        if s > far + prefer:
            far, axis = s, first + k
    return far, axis


@formula
def edge_separation(best, C, c, a, b, prefer):
    """Largest separation along cross products of edges, axis 6 + 3 k + m."""
    far, axis = best
    for k in range(3):
        u, v = (k + 1) % 3, (k + 2) % 3
        for m in range(3):
            w = C[3 * k + m]
            square = 1.0 - w * w
            if square > PARALLEL:
                p, q = (m + 1) % 3, (m + 2) % 3
                # A_k x B_m has the components -C[v, m], C[u, m] along A's axes u, v
                s = abs(c[v] * C[3 * u + m] - c[u] * C[3 * v + m])
                s -= a[u] * abs(C[3 * v + m]) + a[v] * abs(C[3 * u + m])
                s -= b[p] * abs(C[3 * k + q]) + b[q] * abs(C[3 * k + p])
                s /= sqrt(square)
                if s > far + prefer:
                    far, axis = s, 6 + 3 * k + m
    return far, axis


@formula
def axis_vector(axis, C, c):
    """Return the unit vector of an axis in the first box's axes, towards the second box."""
    if axis < 3:
        n = (1.0 if axis == 0 else 0.0, 1.0 if axis == 1 else 0.0, 1.0 if axis == 2 else 0.0)
    elif axis < 6:
        n = (C[axis - 3], C[axis], C[axis + 3])
    else:
        k, m = (axis - 6) // 3, axis % 3
        e = (1.0 if k == 0 else 0.0, 1.0 if k == 1 else 0.0, 1.0 if k == 2 else 0.0)
        n = cross(e, (C[m], C[3 + m], C[6 + m]))
        n = scale(1.0 / sqrt(dot(n, n)), n)
    return n if dot(n, c) >= 0.0 else neg(n)


@formula
def collide(G, i, j, A, B, reach, scratch):
    """Write up to four contacts."""
    a, b = load3(G.dimensions.par, i, 0), load3(G.dimensions.par, j, 0)
    c = mtv(A[1], B[0])
    C = mm(transpose(A[1]), B[1])
    prefer = PREFER * (min(a[0], min(a[1], a[2])) + min(b[0], min(b[1], b[2])))
    best = face_separation((-inf, 0), C, c, a, b, 0, 0.0)
    if best[0] > reach:
        return 0
    best = face_separation(best, transpose(C), mtv(C, c), b, a, 3, prefer)
    if best[0] > reach:
        return 0
    far, axis = edge_separation(best, C, c, a, b, prefer)
    if far > reach:
        return 0
    n = mv(A[1], axis_vector(axis, C, c))
    count = manifold(G, i, j, A, B, n, (inf, n), reach, scratch)
    if count > 0 and (far <= 0.0 or smallest_contact_gap(scratch, count) <= far + prefer):
        return count
    gap, n, p = signed_distance(G, i, j, A, B, reach, scratch)
    if not gap <= reach:
        return 0
    return manifold(G, i, j, A, B, n, (gap, p), reach, scratch)
