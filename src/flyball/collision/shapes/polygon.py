"""A convex polygon in z = 0, or a line segment, with a rounding radius; for planar mechanisms."""

from __future__ import annotations

from ...compiler.formulas import formula
from ...math.scalar import sqrt
from ...math.vec import load3, store3
from ..shape_kinds import POLYGON

KIND = POLYGON


@formula
def support(G, i, d):
    """Return the farthest corner."""
    first = best = G.shape.first[i]
    far = G.vertex[best, 0] * d[0] + G.vertex[best, 1] * d[1]
    for k in range(first + 1, first + G.shape.count[i]):
        s = G.vertex[k, 0] * d[0] + G.vertex[k, 1] * d[1]
        if s > far:
            best, far = k, s
    return load3(G.vertex, best, 0)


@formula
def facing_edge(G, i, d):
    """Edge whose outward normal is nearest to d: first corner, second corner (rows of the vertices)."""
    first, count = G.shape.first[i], G.shape.count[i]
    best, far, a = first, -2.0, first + count - 1
    for b in range(first, first + count):
        x, y = G.vertex[b, 0] - G.vertex[a, 0], G.vertex[b, 1] - G.vertex[a, 1]
        length = sqrt(x * x + y * y)
        s = (y * d[0] - x * d[1]) / length if length > 0.0 else -2.0
        if s > far:
            best, far = a, s
        a = b
    return best, first + (best - first + 1) % count


@formula
def face(G, i, d, scratch, at):
    """Write the side that faces d best."""
    a, b = facing_edge(G, i, d)
    store3(scratch, at, 0, load3(G.vertex, a, 0))
    if a == b:
        return 1, 0
    store3(scratch, at + 1, 0, load3(G.vertex, b, 0))
    return 2, a - G.shape.first[i]


@formula
def radius(G, i):
    """Return the rounding radius."""
    return G.dimensions.par[i, 0]
