"""One triangle of a height field among its neighbours, and the contacts gathered over many of them."""

from __future__ import annotations

from ...compiler.formulas import formula
from ...math.vec import cross, dot, load3, put3, sub
from .room import LIMIT, PIECE
from .shapes.field import grid, knot

KEPT = 8  # first row of the contacts gathered: a manifold is written before it
MOST = 24  # contacts of a field and a shape at most, where there are more the ones most different
BENT = 1e-6  # sine of the angle by which an edge must be bent outwards to be one
ALIKE = 1e-4  # of the reach of the patch: contacts nearer to each other, with the same normal, are one


@formula
def neighbour(upper, k):
    """Grid point, from the cell's, across edge k (from corner k to the next) of the lower or upper triangle."""
    if upper:
        return ((1, 0), (1, 2), (-1, 0))[k]
    return ((0, -1), (2, 1), (0, 1))[k]


@formula
def corner(upper, k):
    """Grid point, from the cell's, of corner k."""
    if upper:
        return ((0, 0), (1, 1), (0, 1))[k]
    return ((0, 0), (1, 0), (1, 1))[k]


@formula
def inside(G, f, i, j):
    """Whether there is such a grid point."""
    nx, ny, dx, dy = grid(G, f)
    return 0 <= i < nx and 0 <= j < ny


@formula
def lay(G, f, i, j, upper, room):
    """Put the triangle into the scratch; its upward normal, not of unit length."""
    nx, ny, dx, dy = grid(G, f)
    for k in range(3):
        u, v = corner(upper, k)
        put3(room, PIECE + k, 0, knot(G, f, i + u, j + v))
    room[PIECE + 3, 0] = 2.0 * (i * ny + j) + (1.0 if upper else 0.0)
    a = load3(room, PIECE, 0)
    return cross(sub(load3(room, PIECE + 1, 0), a), sub(load3(room, PIECE + 2, 0), a))


@formula
def below(G, f, i, j, x, n, width):
    """Whether grid point (i, j), if there is one, is not beyond the plane through x with the normal n."""
    return not inside(G, f, i, j) or dot(n, sub(knot(G, f, i, j), x)) <= BENT * width


@formula
def bent(G, f, i, j, upper, n, k, room):
    """Whether edge k of the triangle with the unit normal n is bent outwards, or the field ends there."""
    nx, ny, dx, dy = grid(G, f)
    u, v = neighbour(upper, k)
    if not inside(G, f, i + u, j + v):
        return True
    return dot(n, sub(knot(G, f, i + u, j + v), load3(room, PIECE + k, 0))) < -BENT * (dx + dy)


@formula
def ridged(G, f, i, j, upper, n, room):
    """Whether any edge of the triangle is."""
    found = False
    for k in range(3):
        found = found or bent(G, f, i, j, upper, n, k, room)
    return found


@formula
def on_ridge(G, f, i, j, upper, n, x, room):
    """Whether x, in the plane of the triangle, lies on such an edge."""
    for k in range(3):
        a, b = load3(room, PIECE + k, 0), load3(room, PIECE + (k + 1) % 3, 0)
        across = cross(n, sub(b, a))
        if dot(across, sub(x, a)) ** 2 <= BENT**2 * dot(across, across) ** 2 and bent(G, f, i, j, upper, n, k, room):
            return True
    return False


@formula
def holds(G, f, i, j, upper, n, room):
    """Whether n is a normal of the field itself where the triangle in the scratch reaches farthest along n.

    True for a side; at an edge if the triangle across is below, at a corner if all six neighbours are.
    """
    nx, ny, dx, dy = grid(G, f)
    width = dx + dy
    top = -1e300
    for k in range(3):
        top = max(top, dot(n, load3(room, PIECE + k, 0)))
    count, last, low = 0, 0, 0
    for k in range(3):
        if dot(n, load3(room, PIECE + k, 0)) >= top - BENT * width:
            count += 1
            last = k
        else:
            low = k
    if count == 3:
        return n[2] > 0.0
    if count == 2:
        u, v = neighbour(upper, (low + 1) % 3)
        return n[2] > 0.0 and below(G, f, i + u, j + v, load3(room, PIECE + last, 0), n, width)
    u, v = corner(upper, last)
    x = load3(room, PIECE + last, 0)
    for k in range(6):
        s, t = ((1, 0), (1, 1), (0, 1), (-1, 0), (-1, -1), (0, -1))[k]
        if not below(G, f, i + u + s, j + v + t, x, n, width):
            return False
    return n[2] > 0.0


@formula
def over(x, n, room):
    """Whether x is over the triangle in the scratch as seen along its normal n (of any length)."""
    for k in range(3):
        a, b = load3(room, PIECE + k, 0), load3(room, PIECE + (k + 1) % 3, 0)
        if dot(n, cross(sub(b, a), sub(x, a))) < -1e-9 * dot(n, n):
            return False
    return True


@formula
def gather(room, count, x, n, gap, name, near):
    """Add a contact unless there is one like it, which the deeper of both then stands for; how many there are."""
    for k in range(KEPT, KEPT + count):
        off = sub(load3(room, k, 0), x)
        if dot(off, off) <= near * near and dot(load3(room, k, 3), n) > 1.0 - BENT:
            if gap < room[k, 6] - BENT * near:
                put3(room, k, 0, x)
                room[k, 6], room[k, 7] = gap, name
            return count
    if count == LIMIT - KEPT:
        count = thin_out(room, KEPT, count, near)
    k = KEPT + count
    put3(room, k, 0, x)
    put3(room, k, 3, n)
    room[k, 6], room[k, 7] = gap, name
    return count + 1


@formula
def unlike(room, a, b, near):
    """How different two contacts are: the square of a length [m]."""
    off = sub(load3(room, a, 0), load3(room, b, 0))
    turn = sub(load3(room, a, 3), load3(room, b, 3))
    return dot(off, off) + dot(turn, turn) * (near / ALIKE) ** 2


@formula
def thin_out(room, at, count, near):
    """Keep `MOST` contacts: the deepest, then always the one most unlike those kept; how many remain."""
    if count <= MOST:
        return count
    for kept in range(MOST):
        best, most = at + kept, -1e300
        for k in range(at + kept, at + count):
            value = -room[k, 6]
            if kept > 0:
                value = 1e300
                for s in range(at, at + kept):
                    value = min(value, unlike(room, k, s, near))
            if value > most * (1.0 + 1e-9 if most > 0.0 else 1.0):
                best, most = k, value
        for c in range(8):
            room[best, c], room[at + kept, c] = room[at + kept, c], room[best, c]
    return MOST
