"""Two convex polygons in the plane."""

from __future__ import annotations

from math import inf

from ...compiler.jit import formula
from ...math.vec import add, scale
from ..kinds import POLYGON
from ..manifold import manifold
from ..polygons import apart
from ..tables import PAR, RADIUS

KINDS = (POLYGON, POLYGON)
PREFER = 1e-9  # of the size: sides come before corners, the first polygon's before the second's


@formula
def collide(G, i, j, A, B, reach, room):
    """One or two points of the sides that face each other."""
    r, s = G.shape_x[i, PAR], G.shape_x[j, PAR]
    prefer = PREFER * min(G.shape_x[i, RADIUS], G.shape_x[j, RADIUS])
    far, n, p = apart(G, i, j, A, B, prefer)
    gap = far - r - s
    if not gap <= reach:
        return 0
    n = (n[0], n[1], 0.0)
    p = add(p, scale(0.5 * (r - s), n))
    return manifold(G, i, j, A, B, n, (gap if far > 0.0 else inf, (p[0], p[1], 0.0)), reach, room)
