"""The point of a simplex nearest to the origin, with every case that rounding makes decided by distance.

Corners are rows of the narrow phase's scratch, coordinates in columns 0 to 2; the newest stands last.
Ericson, *Real-Time Collision Detection* (2005), 5.1; the nearest point in the plane of a triangle is taken along its
normal, which keeps its direction where it is close to the origin.
"""

from __future__ import annotations

from ...compiler.formulas import formula
from ...math.vec import add, cross, dot, load3, scale, sub

FLAT = 1e-26  # square of a sine below which three points are on a line, four in a plane


@formula
def on_line(a, b):
    """Nearest point of the line from a to b and the weights of both."""
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
def on_edges(a, b, c):
    """Nearest point of the three edges."""
    v, w = on_line(a, b)
    for k in range(2):
        x, u = on_line(a if k == 0 else b, c)
        if dot(x, x) < dot(v, v):
            v, w = x, ((u[0], 0.0, u[1]) if k == 0 else (0.0, u[0], u[1]))
    return v, w


@formula
def on_triangle(a, b, c):
    """Nearest point of a triangle and the weights of its corners."""
    ab, ac = sub(b, a), sub(c, a)
    n = cross(ab, ac)
    nn = dot(n, n)
    if nn > FLAT * dot(ab, ab) * dot(ac, ac):
        # signed areas, over the triangle's times nn, of the parts towards the origin
        u, v, w = dot(n, cross(b, c)), dot(n, cross(c, a)), dot(n, cross(a, b))
        if u > 0.0 and v > 0.0 and w > 0.0:
            s = 1.0 / (u + v + w)
            return scale(dot(n, a) / nn, n), (u * s, v * s, w * s)
    return on_edges(a, b, c)


@formula
def on_tetrahedron(room, at):
    """Nearest point of a tetrahedron, weights of its corners, and whether the origin is inside.

    The origin is known to be on the inner side of the face that the newest corner does not belong to.
    """
    v, w, least, inside = (0.0, 0.0, 0.0), (0.25, 0.25, 0.25, 0.25), -1.0, True
    c = load3(room, at + 3, 0)
    for k in range(3):
        i, j, m = k, (k + 1) % 3, (k + 2) % 3
        a, b, d = load3(room, at + i, 0), load3(room, at + j, 0), load3(room, at + m, 0)
        ca, cb, cd = sub(a, c), sub(b, c), sub(d, c)
        n = cross(ca, cb)
        height, origin = dot(n, cd), -dot(n, c)
        thin = height * height <= FLAT * dot(n, n) * dot(cd, cd)
        if not thin and (height > 0.0) == (origin > 0.0):
            continue
        inside = False
        x, u = on_triangle(a, b, c)
        xx = dot(x, x)
        if least < 0.0 or xx < least:
            least, v = xx, x
            w0 = u[0] if i == 0 else (u[1] if j == 0 else 0.0)
            w1 = u[0] if i == 1 else (u[1] if j == 1 else 0.0)
            w2 = u[0] if i == 2 else (u[1] if j == 2 else 0.0)
            w = (w0, w1, w2, u[2])
    return v, w, inside


@formula
def on_simplex(room, at, count):
    """Nearest point of the first ``count`` rows from ``at``, the weights of four rows, whether the origin is inside."""
    a = load3(room, at, 0)
    if count == 4:
        return on_tetrahedron(room, at)
    if count == 1:
        return a, (1.0, 0.0, 0.0, 0.0), False
    b = load3(room, at + 1, 0)
    if count == 2:
        v, w = on_line(a, b)
    else:
        v, w = on_triangle(a, b, load3(room, at + 2, 0))
    return v, (w[0], w[1], w[2], 0.0), False
