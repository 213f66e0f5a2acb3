"""A height field: heights over a grid, two triangles a cell, solid below. It stands still.

Parameters: how many heights along x and along y, and the width of a cell along x and along y; the first height is over
the origin, height (i, j) over (i dx, j dy). Heights stand from ``FIRST`` on in `Geometry.vertex`, three a row, those
with the same i together. The diagonal of a cell goes from (i, j) to (i + 1, j + 1).

What touches it meets one triangle at a time, which stands in the scratch at `PIECE`, its number in the row after.
"""

from __future__ import annotations

from ....compiler.formulas import formula
from ....math.vec import dot, load3, put3
from ...kinds import FIELD
from ...tables import FIRST, PAR
from ..room import PIECE

KIND = FIELD
NAMES = 65536.0  # numbers of triangles repeat after as many


@formula
def grid(G, i):
    """Numbers of heights along x and y, widths of a cell."""
    return int(G.shape_x[i, PAR]), int(G.shape_x[i, PAR + 1]), G.shape_x[i, PAR + 2], G.shape_x[i, PAR + 3]


@formula
def knot(G, f, i, j):
    """The point of the surface over grid point (i, j)."""
    k = i * int(G.shape_x[f, PAR + 1]) + j
    z = G.vertex[G.shape_i[f, FIRST] + k // 3, k % 3]
    return (i * G.shape_x[f, PAR + 2], j * G.shape_x[f, PAR + 3], z)


@formula
def height(G, f, x, y):
    """Height of the surface over (x, y); far below where there is none."""
    nx, ny, dx, dy = grid(G, f)
    u, v = x / dx, y / dy
    if not (0.0 <= u <= nx - 1.0 and 0.0 <= v <= ny - 1.0):
        return -1e300
    i, j = min(int(u), nx - 2), min(int(v), ny - 2)
    u -= i
    v -= j
    a, c = knot(G, f, i, j)[2], knot(G, f, i + 1, j + 1)[2]
    if u >= v:
        b = knot(G, f, i + 1, j)[2]
        return a + u * (b - a) + v * (c - b)
    b = knot(G, f, i, j + 1)[2]
    return a + v * (b - a) + u * (c - b)


@formula
def support(G, i, d):
    """The knot that is farthest along d."""
    nx, ny, dx, dy = grid(G, i)
    best = knot(G, i, 0, 0)
    for a in range(nx):
        for b in range(ny):
            x = knot(G, i, a, b)
            if dot(d, x) > dot(d, best):
                best = x
    return best


@formula
def face(G, i, d, room, at):
    """The triangle at work."""
    for k in range(3):
        put3(room, at + k, 0, load3(room, PIECE + k, 0))
    return 3, int(room[PIECE + 3, 0] % NAMES)
