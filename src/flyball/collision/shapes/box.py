"""A box."""

from __future__ import annotations

from ...compiler.formulas import formula
from ...math.vec import load3
from ..shape_kinds import BOX

KIND = BOX


@formula
def support(G, i, d):
    """Return the farthest corner."""
    h = load3(G.dimensions.par, i, 0)
    return (h[0] if d[0] >= 0 else -h[0], h[1] if d[1] >= 0 else -h[1], h[2] if d[2] >= 0 else -h[2])


@formula
def face(G, i, d, scratch, at):
    """Write the side that faces d best."""
    x, y, z = abs(d[0]), abs(d[1]), abs(d[2])
    n = 0 if x >= y and x >= z else (1 if y >= z else 2)
    u, v = (n + 1) % 3, (n + 2) % 3
    side = 1.0 if d[n] >= 0 else -1.0
    a, b = G.dimensions.par[i, u], G.dimensions.par[i, v] * side
    for k in range(4):
        scratch[at + k, n] = side * G.dimensions.par[i, n]
        scratch[at + k, u] = a if k == 0 or k == 3 else -a
        scratch[at + k, v] = b if k < 2 else -b
    return 4, 2 * n + (1 if side > 0 else 0)
