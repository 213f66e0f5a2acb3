"""A box and any convex shape: the faces of the box are tested first.

In most contacts of boxes the other shape is over the inside of a face, and the shortest way out of the box is known
without a search. Let q be the other core's deepest point below a face with normal n, d its depth and m its distance
from the face's border. If q is above the face, that is the distance. If it is below, a supporting plane tilted by t
against the face is at least d cos t + m sin t >= min(d, m) away while t <= pi/2. For larger tilts, with f = pi - t, it
is at least m sin f - d cos f away, and also D cos f - L sin f, where x is the core's farthest point in the opposite
direction, D the length of the way out there, and L the distance of x from q along the face. One of the two is at
least d if 2 d (m + L) <= D m.
"""

from __future__ import annotations

from math import inf

from ....compiler.formulas import formula
from ....math.scalar import sqrt
from ....math.vec import add, col, dot, load3, mtv, mv, scale, sub
from ...shape_kinds import BOX
from ...shapes.registry import radius, support
from ..distance import generic_pair
from ..manifold import manifold

KINDS = (BOX, None)


@formula
def is_shortest(G, i, j, B, found, inside, r):
    """Whether the way out of the box along the normal in ``found`` is certainly the shortest."""
    far, n, q, h = found
    if far + r > 0.0:
        return True
    x = sub(add(B[0], mv(B[1], support(G.shape.kind[j], G, j, mtv(B[1], n)))), q)
    up = dot(n, x)
    D = up + 2.0 * (h + r) + far
    aside = sqrt(max(0.0, dot(x, x) - up * up))
    return -far <= inside and -2.0 * far * (inside + aside) <= D * inside


@formula
def collide(G, i, j, A, B, reach, scratch):
    """Write up to four contacts."""
    kind = G.shape.kind[j]
    h, r = load3(G.dimensions.par, i, 0), radius(kind, G, j)
    far, n, q = -inf, (0.0, 0.0, 0.0), B[0]
    k = 0
    for c in range(3):
        e = col(A[1], c)
        e = e if dot(e, B[0]) >= 0.0 else scale(-1.0, e)
        x = add(B[0], mv(B[1], support(kind, G, j, mtv(B[1], scale(-1.0, e)))))
        s = dot(e, x) - h[c] - r
        if s > reach:
            return 0
        if s > far:
            far, n, q, k = s, e, x, c
    y = mtv(A[1], q)
    u, v = (k + 1) % 3, (k + 2) % 3
    inside = min(h[u] - abs(y[u]), h[v] - abs(y[v]))
    if inside >= 0.0 and is_shortest(G, i, j, B, (far, n, q, h[k]), inside, r):
        return manifold(G, i, j, A, B, n, (far, add(q, scale(-0.5 * far - r, n))), reach, scratch)
    return generic_pair(G, i, j, A, B, reach, scratch)
