"""Distance of two convex cores by their support functions (Gilbert, Johnson and Keerthi 1988).

A direction n, from 1 to 2, separates the cores by ``s(n) = -max over 1 of n.x + min over 2 of n.x``; the
distance is the largest s. Every step has s of its direction, a lower bound, and a point of the difference of
both cores whose length is an upper bound. The search ends when the bounds meet, when a step makes no progress
(rounding), or after `MAX_STEPS`.

The nearest point of a simplex: Ericson, *Real-Time Collision Detection* (2005), 5.1; in the plane of a triangle
it is computed along the normal, which keeps its direction accurate close to the origin. Corners are rows of the
scratch, coordinates in columns 0 to 2, the newest last.
"""

from __future__ import annotations

from ...compiler.formulas import formula
from ...math.scalar import sqrt
from ...math.vec import add, cross, dot, load3, mtv, mv, neg, scale, store3, sub
from ..shape_kinds import FIELD
from ..shapes.registry import support
from .primitives import FIELD_TRIANGLE


@formula
def core_support(G, i, scratch, d):
    """Point of the core of shape i farthest along d, in its axes."""
    kind = G.shape.kind[i]
    if kind != FIELD:
        return support(kind, G, i, d)
    best = load3(scratch, FIELD_TRIANGLE, 0)
    for k in range(1, 3):
        x = load3(scratch, FIELD_TRIANGLE + k, 0)
        if dot(d, x) > dot(d, best):
            best = x
    return best


DEGENERATE = 1e-26  # squared sine below which three points are on a line, four in a plane


@formula
def nearest_on_line(a, b):
    """Nearest point to the origin of the segment from a to b, and the weights of both."""
    e = sub(b, a)
    ee = dot(e, e)
    t = -dot(a, e)
    if t <= 0.0 or ee == 0.0:
        return a, (1.0, 0.0, 0.0)
    if t >= ee:
        return b, (0.0, 1.0, 0.0)
    t /= ee
    return add(a, scale(t, e)), (1.0 - t, t, 0.0)


@formula
def nearest_on_edges(a, b, c):
    """Nearest point to the origin of three edges, and the weights of the corners."""
    v, w = nearest_on_line(a, b)
    for k in range(2):
        x, u = nearest_on_line(a if k == 0 else b, c)
        if dot(x, x) < dot(v, v):
            v, w = x, ((u[0], 0.0, u[1]) if k == 0 else (0.0, u[0], u[1]))
    return v, w


@formula
def nearest_on_triangle(a, b, c):
    """Nearest point to the origin of a triangle, and the weights of its corners."""
    ab, ac = sub(b, a), sub(c, a)
    n = cross(ab, ac)
    nn = dot(n, n)
    if nn > DEGENERATE * dot(ab, ab) * dot(ac, ac):
        # signed areas, over the triangle's times nn, of the parts towards the origin
        u, v, w = dot(n, cross(b, c)), dot(n, cross(c, a)), dot(n, cross(a, b))
        if u > 0.0 and v > 0.0 and w > 0.0:
            s = 1.0 / (u + v + w)
            return scale(dot(n, a) / nn, n), (u * s, v * s, w * s)
    return nearest_on_edges(a, b, c)


@formula
def nearest_on_tetrahedron(scratch, at):
    """Nearest point to the origin of a tetrahedron, weights of its corners, and whether the origin is inside.

    The origin must be on the inner side of the face opposite to the newest corner.
    """
    v, w, least, inside = (0.0, 0.0, 0.0), (0.25, 0.25, 0.25, 0.25), -1.0, True
    c = load3(scratch, at + 3, 0)
    for k in range(3):
        i, j, m = k, (k + 1) % 3, (k + 2) % 3
        a, b, d = load3(scratch, at + i, 0), load3(scratch, at + j, 0), load3(scratch, at + m, 0)
        ca, cb, cd = sub(a, c), sub(b, c), sub(d, c)
        n = cross(ca, cb)
        height, origin = dot(n, cd), -dot(n, c)
        thin = height * height <= DEGENERATE * dot(n, n) * dot(cd, cd)
        if not thin and (height > 0.0) == (origin > 0.0):
            continue
        inside = False
        x, u = nearest_on_triangle(a, b, c)
        xx = dot(x, x)
        if least < 0.0 or xx < least:
            least, v = xx, x
            w0 = u[0] if i == 0 else (u[1] if j == 0 else 0.0)
            w1 = u[0] if i == 1 else (u[1] if j == 1 else 0.0)
            w2 = u[0] if i == 2 else (u[1] if j == 2 else 0.0)
            w = (w0, w1, w2, u[2])
    return v, w, inside


@formula
def nearest_on_simplex(scratch, at, count):
    """Nearest point of the first ``count`` rows from ``at``, weights of four rows, whether the origin is inside."""
    a = load3(scratch, at, 0)
    if count == 4:
        return nearest_on_tetrahedron(scratch, at)
    if count == 1:
        return a, (1.0, 0.0, 0.0, 0.0), False
    b = load3(scratch, at + 1, 0)
    if count == 2:
        v, w = nearest_on_line(a, b)
    else:
        v, w = nearest_on_triangle(a, b, load3(scratch, at + 2, 0))
    return v, (w[0], w[1], w[2], 0.0), False


MAX_STEPS = 128  # maximum number of steps
BOUND_TOLERANCE = 1e-14  # relative to the size; difference of bounds at convergence
SMALLEST_DISTANCE = 1e-7  # relative to the size; below it the direction of the nearest points is inaccurate
SEPARATE, BEYOND_REACH, OVERLAPPING = range(3)  # found; farther apart than requested; touching or overlapping


@formula
def difference_support(G, i, j, p, R, scratch, d):
    """Farthest points along d of core 1, and of the difference 1 - 2."""
    a = core_support(G, i, scratch, d)
    b = core_support(G, j, scratch, neg(mtv(R, d)))
    return a, sub(a, add(p, mv(R, b)))


@formula
def drop_unused_corners(scratch, at, count, w):
    """Remove the corners without weight; returns the number of remaining ones."""
    n = 0
    for k in range(count):
        if w[k] > 0.0:
            for c in range(6):
                scratch[at + n, c] = scratch[at + k, c]
            scratch[at + n, 6] = w[k]
            n += 1
    return n


@formula
def core_distance(G, i, j, p, R, start, far, scratch, at):
    """Status, separation, its direction from 1 to 2, size of the difference, number of corners of the simplex.

    Parameters
    ----------
    i, j : int
        The shapes.
    p, R
        Pose of shape 2 in the axes of shape 1, in which everything is expressed.
    start : tuple
        Initial direction from 1 to 2, not all zeros.
    far : float
        Separation [m] at which the search stops: a larger one is not computed.
    scratch, at
        Scratch: rows ``at`` to ``at + 4`` hold corners of the simplex: the difference, the point of core 1, the weight.

    Notes
    -----
    If the cores overlap the separation is the largest s found (negative), a bound of the depth from above.
    """
    d, best, along, size, count, vv = start, -1e300, start, 0.0, 0, 1e300
    for _step in range(MAX_STEPS):
        length = sqrt(dot(d, d))
        if not length > 0.0:
            return OVERLAPPING, best, along, size, count
        a, x = difference_support(G, i, j, p, R, scratch, d)
        bound = -dot(d, x) / length
        if bound > best:
            best, along = bound, scale(1.0 / length, d)
            if bound > far:
                return BEYOND_REACH, best, along, size, count
        size = max(size, sqrt(dot(x, x)))
        if count > 0 and length - best <= BOUND_TOLERANCE * size:
            break
        store3(scratch, at + count, 0, x)
        store3(scratch, at + count, 3, a)
        v, w, inside = nearest_on_simplex(scratch, at, count + 1)
        new = dot(v, v)
        if inside:
            count = drop_unused_corners(scratch, at, 4, w)
            return OVERLAPPING, best, along, size, count
        if count > 0 and not new < vv:
            break
        count = drop_unused_corners(scratch, at, count + 1, w)
        vv = new
        d = neg(v)
        if vv <= (1e-15 * size) ** 2:
            return OVERLAPPING, best, along, size, count
    return (SEPARATE if vv > (SMALLEST_DISTANCE * size) ** 2 else OVERLAPPING), best, along, size, count


@formula
def point_of_simplex(scratch, at, count):
    """Point of core 1 for the nearest point of the simplex."""
    x = (0.0, 0.0, 0.0)
    for k in range(count):
        x = add(x, scale(scratch[at + k, 6], load3(scratch, at + k, 3)))
    return x
