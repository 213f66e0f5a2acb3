"""A height field: heights over a grid, two triangles per cell, solid below. It is fixed.

Parameters: number of heights along x and along y, and the width of a cell along x and along y; the first height
is over the origin, height (i, j) over (i dx, j dy). Heights are in `Geometry.vertex` from row ``first`` on, three
per row, those with the same i consecutively. The diagonal of a cell goes from (i, j) to (i + 1, j + 1).

A shape is tested against one triangle at a time, the current triangle. It is in the scratch at `FIELD_TRIANGLE`, its
number in the row after. Contacts are gathered over many triangles, merged if they are alike, and reduced.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ...compiler.formulas import formula
from ...errors import ModelError
from ...math.vec import cross, dot, load3, store3, sub
from ..narrow_phase.primitives import FIELD_TRIANGLE, MAX_CONTACTS
from ..shape_kinds import FIELD

KIND = FIELD
FEATURE_PERIOD = 65536.0  # numbers of triangles are taken modulo this number


@formula
def grid(G, i):
    """Numbers of heights along x and y, widths of a cell."""
    return int(G.dimensions.par[i, 0]), int(G.dimensions.par[i, 1]), G.dimensions.par[i, 2], G.dimensions.par[i, 3]


@formula
def grid_point(G, f, i, j):
    """Return the point of the surface over grid point (i, j)."""
    k = i * int(G.dimensions.par[f, 1]) + j
    z = G.vertex[G.shape.first[f] + k // 3, k % 3]
    return (i * G.dimensions.par[f, 2], j * G.dimensions.par[f, 3], z)


@formula
def height(G, f, x, y):
    """Height of the surface over (x, y); far below outside the grid."""
    nx, ny, dx, dy = grid(G, f)
    u, v = x / dx, y / dy
    if not (0.0 <= u <= nx - 1.0 and 0.0 <= v <= ny - 1.0):
        return -1e300
    i, j = min(int(u), nx - 2), min(int(v), ny - 2)
    u -= i
    v -= j
    a, c = grid_point(G, f, i, j)[2], grid_point(G, f, i + 1, j + 1)[2]
    if u >= v:
        b = grid_point(G, f, i + 1, j)[2]
        return a + u * (b - a) + v * (c - b)
    b = grid_point(G, f, i, j + 1)[2]
    return a + v * (b - a) + u * (c - b)


@formula
def support(G, i, d):
    """Return the grid point farthest along d."""
    nx, ny, dx, dy = grid(G, i)
    best = grid_point(G, i, 0, 0)
    for a in range(nx):
        for b in range(ny):
            x = grid_point(G, i, a, b)
            if dot(d, x) > dot(d, best):
                best = x
    return best


@formula
def face(G, i, d, scratch, at):
    """Write the current triangle."""
    for k in range(3):
        store3(scratch, at + k, 0, load3(scratch, FIELD_TRIANGLE + k, 0))
    return 3, int(scratch[FIELD_TRIANGLE + 3, 0] % FEATURE_PERIOD)


FIRST_GATHERED = 8  # first row of gathered contacts, behind those of a manifold
MAX_GATHERED = 24  # maximum contacts of a field and a shape; of more, the most different ones are kept
FOLD_TOLERANCE = 1e-6  # smallest sine of the angle at a convex edge
SAME_CONTACT = 1e-4  # relative to the cell width; closer contacts with the same normal are merged


@formula
def across_edge(upper, k):
    """Grid point, relative to the cell's, opposite to edge k (from corner k on) of the lower or upper triangle."""
    if upper:
        return ((1, 0), (1, 2), (-1, 0))[k]
    return ((0, -1), (2, 1), (0, 1))[k]


@formula
def triangle_corner(upper, k):
    """Grid point, relative to the cell's, of corner k."""
    if upper:
        return ((0, 0), (1, 1), (0, 1))[k]
    return ((0, 0), (1, 0), (1, 1))[k]


@formula
def is_grid_point(G, f, i, j):
    """Whether there is such a grid point."""
    nx, ny, dx, dy = grid(G, f)
    return 0 <= i < nx and 0 <= j < ny


@formula
def load_triangle(G, f, i, j, upper, scratch):
    """Load a triangle into the scratch; returns its upward normal, not of unit length."""
    nx, ny, dx, dy = grid(G, f)
    for k in range(3):
        u, v = triangle_corner(upper, k)
        store3(scratch, FIELD_TRIANGLE + k, 0, grid_point(G, f, i + u, j + v))
    scratch[FIELD_TRIANGLE + 3, 0] = 2.0 * (i * ny + j) + (1.0 if upper else 0.0)
    a = load3(scratch, FIELD_TRIANGLE, 0)
    return cross(sub(load3(scratch, FIELD_TRIANGLE + 1, 0), a), sub(load3(scratch, FIELD_TRIANGLE + 2, 0), a))


@formula
def is_below_plane(G, f, i, j, x, n, width):
    """Whether grid point (i, j) is outside the grid, or not above the plane through x with the normal n."""
    return not is_grid_point(G, f, i, j) or dot(n, sub(grid_point(G, f, i, j), x)) <= FOLD_TOLERANCE * width


@formula
def is_convex_edge(G, f, i, j, upper, n, k, scratch):
    """Whether edge k of the triangle with the unit normal n is convex, or at the border of the field."""
    nx, ny, dx, dy = grid(G, f)
    u, v = across_edge(upper, k)
    if not is_grid_point(G, f, i + u, j + v):
        return True
    return dot(n, sub(grid_point(G, f, i + u, j + v), load3(scratch, FIELD_TRIANGLE + k, 0))) < -FOLD_TOLERANCE * (
        dx + dy
    )


@formula
def has_convex_edge(G, f, i, j, upper, n, scratch):
    """Whether any edge of the triangle is convex."""
    found = False
    for k in range(3):
        found = found or is_convex_edge(G, f, i, j, upper, n, k, scratch)
    return found


@formula
def is_on_convex_edge(G, f, i, j, upper, n, x, scratch):
    """Whether x, in the plane of the triangle, lies on a convex edge."""
    for k in range(3):
        a, b = load3(scratch, FIELD_TRIANGLE + k, 0), load3(scratch, FIELD_TRIANGLE + (k + 1) % 3, 0)
        across = cross(n, sub(b, a))
        if dot(across, sub(x, a)) ** 2 <= FOLD_TOLERANCE**2 * dot(across, across) ** 2 and is_convex_edge(
            G, f, i, j, upper, n, k, scratch
        ):
            return True
    return False


@formula
def is_field_normal(G, f, i, j, upper, n, scratch):
    """Whether n is a normal of the field at the part of the current triangle that is farthest along n.

    True for a face; at an edge if the triangle across is below, at a corner if all six neighbours are.
    """
    nx, ny, dx, dy = grid(G, f)
    width = dx + dy
    top = -1e300
    for k in range(3):
        top = max(top, dot(n, load3(scratch, FIELD_TRIANGLE + k, 0)))
    count, last, low = 0, 0, 0
    for k in range(3):
        if dot(n, load3(scratch, FIELD_TRIANGLE + k, 0)) >= top - FOLD_TOLERANCE * width:
            count += 1
            last = k
        else:
            low = k
    if count == 3:
        return n[2] > 0.0
    if count == 2:
        u, v = across_edge(upper, (low + 1) % 3)
        return n[2] > 0.0 and is_below_plane(G, f, i + u, j + v, load3(scratch, FIELD_TRIANGLE + last, 0), n, width)
    u, v = triangle_corner(upper, last)
    x = load3(scratch, FIELD_TRIANGLE + last, 0)
    for k in range(6):
        s, t = ((1, 0), (1, 1), (0, 1), (-1, 0), (-1, -1), (0, -1))[k]
        if not is_below_plane(G, f, i + u + s, j + v + t, x, n, width):
            return False
    return n[2] > 0.0


@formula
def is_over_triangle(x, n, scratch):
    """Whether x is over the current triangle, as seen along its normal n (of any length)."""
    for k in range(3):
        a, b = load3(scratch, FIELD_TRIANGLE + k, 0), load3(scratch, FIELD_TRIANGLE + (k + 1) % 3, 0)
        if dot(n, cross(sub(b, a), sub(x, a))) < -1e-9 * dot(n, n):
            return False
    return True


@formula
def gather_contact(scratch, count, x, n, gap, name, near):
    """Add a contact, or merge it with a similar one, keeping the deeper of both; returns the number of contacts."""
    for k in range(FIRST_GATHERED, FIRST_GATHERED + count):
        off = sub(load3(scratch, k, 0), x)
        if dot(off, off) <= near * near and dot(load3(scratch, k, 3), n) > 1.0 - FOLD_TOLERANCE:
            if gap < scratch[k, 6] - FOLD_TOLERANCE * near:
                store3(scratch, k, 0, x)
                scratch[k, 6], scratch[k, 7] = gap, name
            return count
    if count == MAX_CONTACTS - FIRST_GATHERED:
        count = reduce_contacts(scratch, FIRST_GATHERED, count, near)
    k = FIRST_GATHERED + count
    store3(scratch, k, 0, x)
    store3(scratch, k, 3, n)
    scratch[k, 6], scratch[k, 7] = gap, name
    return count + 1


@formula
def contact_difference(scratch, a, b, near):
    """Difference of two contacts as the square of a length [m]."""
    off = sub(load3(scratch, a, 0), load3(scratch, b, 0))
    turn = sub(load3(scratch, a, 3), load3(scratch, b, 3))
    return dot(off, off) + dot(turn, turn) * (near / SAME_CONTACT) ** 2


@formula
def reduce_contacts(scratch, at, count, near):
    """Keep `MAX_GATHERED` contacts: the deepest, then always the most different one; returns the number kept."""
    if count <= MAX_GATHERED:
        return count
    for kept in range(MAX_GATHERED):
        best, most = at + kept, -1e300
        for k in range(at + kept, at + count):
            value = -scratch[k, 6]
            if kept > 0:
                value = 1e300
                for s in range(at, at + kept):
                    value = min(value, contact_difference(scratch, k, s, near))
            if value > most * (1.0 + 1e-9 if most > 0.0 else 1.0):
                best, most = k, value
        for c in range(8):
            scratch[best, c], scratch[at + kept, c] = scratch[at + kept, c], scratch[best, c]
    return MAX_GATHERED


def height_field_rows(heights: Any, dx: float, dy: float) -> tuple[np.ndarray, tuple[float, float, float, float]]:
    """Convert heights to rows of `Geometry.vertex` and the parameters of a height field.

    Parameters
    ----------
    heights : (nx, ny) numbers [m]
        Height (i, j) is over (i dx, j dy) of the shape's axes.
    dx, dy : float
        Width of a cell [m].

    Raises
    ------
    ModelError
        If heights are not finite numbers in two or more rows and columns, or a width is not greater than zero.
    """
    z = np.asarray(heights, dtype=float)
    if z.ndim != 2 or min(z.shape) < 2 or not np.isfinite(z).all():
        raise ModelError(f"a height field takes finite heights in two or more rows and columns, got shape {z.shape}")
    if not (0 < dx < np.inf and 0 < dy < np.inf):
        raise ModelError(f"a height field takes cells of a width greater than zero, got {dx} and {dy} m")
    rows = np.zeros(-(-z.size // 3) * 3)
    rows[: z.size] = z.ravel()
    return rows.reshape(-1, 3), (float(z.shape[0]), float(z.shape[1]), float(dx), float(dy))
