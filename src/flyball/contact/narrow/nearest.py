"""Gap of two convex shapes with their rounding, where they are nearest: from the separation of their cores."""

from __future__ import annotations

from ...compiler.formulas import formula
from ...math.vec import add, dot, mm, mtv, mv, scale, sub, transpose
from ..tables import KIND
from .any_shape import radius
from .room import NEAREST
from .separation import separation


@formula
def closest(G, i, j, A, B, reach, room):
    """Signed gap, unit normal from i to j, point midway between the surfaces; above ``reach`` some gap above it."""
    r, s = radius(G.shape_i[i, KIND], G, i), radius(G.shape_i[j, KIND], G, j)
    p = mtv(A[1], sub(B[0], A[0]))
    start = p if dot(p, p) > 0.0 else (1.0, 0.0, 0.0)
    far, d, a = separation(G, i, j, p, mm(transpose(A[1]), B[1]), start, reach + r + s, room, NEAREST)
    middle = add(a, scale(0.5 * (far + r - s), d))
    return far - r - s, mv(A[1], d), add(A[0], mv(A[1], middle))
