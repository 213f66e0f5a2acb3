"""Spheres and capsules with capsules: distances of points and line segments."""

from __future__ import annotations

from math import inf

from ....compiler.formulas import formula
from ....math.vec import add, col, cross, dot, neg, scale, sub
from ...shape_kinds import CAPSULE, SPHERE
from ..primitives import nearest_parameter, nearest_parameters, sphere_contact, unit_vector_between, write_point

PAIRS = ((SPHERE, CAPSULE), (CAPSULE, CAPSULE))
PARALLEL = 0.1  # sine of the angle below which contacts at the ends of the segments are computed
SHORTEST = 1e-3  # relative to the radii; a shorter overlap is one point
SAME_SIDE = 0.9  # smallest cosine between the normals at an end and at the nearest points
SAME_GAP = 1e-5  # relative to the radii; smaller differences of gaps count as none


@formula
def axis_segment(G, i, P):
    """Axis segment of a capsule: lower end, vector to the upper end."""
    z = col(P[1], 2)
    h = 0.0 if G.shape.kind[i] == SPHERE else G.dimensions.par[i, 1]
    return sub(P[0], scale(h, z)), scale(2.0 * h, z)


@formula
def perpendicular(u, v):
    """Return a unit vector perpendicular to u and v; to the longer one if parallel; the x axis if both vanish."""
    w = cross(u, v)
    uu, vv = dot(u, u), dot(v, v)
    if not dot(w, w) > 1e-18 * uu * vv:
        u = u if uu >= vv else v
        w = cross(u, (1.0, 0.0, 0.0))
        if dot(w, w) <= 0.1 * dot(u, u):
            w = cross(u, (0.0, 1.0, 0.0))
    return unit_vector_between((0.0, 0.0, 0.0), w)[0]


@formula
def nearest_contact(first, second, p, q, reach, scratch, k):
    """Write the contact at parameters p, q of two segments (start, vector, radius); returns gap and normal."""
    a, u, r = first
    b, v, s = second
    x, y = add(a, scale(p, u)), add(b, scale(q, v))
    n, length = unit_vector_between(x, y)
    if length < 1e-12 * (r + s):
        n = perpendicular(u, v)
        way = sub(add(b, scale(0.5, v)), add(a, scale(0.5, u)))
        n = n if dot(n, way) >= 0.0 else neg(n)
    gap = length - r - s
    if gap <= reach:
        write_point(add(x, scale(r + 0.5 * gap, n)), n, gap, 0.0, scratch, k)
    return gap, n


@formula
def end_contacts(first, second, n, reach, scratch):
    """Write contacts at both ends of the overlap of two segments, as of spheres there: number, smallest gap."""
    a, u, r = first
    b, v, s = second
    t0, t1 = nearest_parameter(b, a, u), nearest_parameter(add(b, v), a, u)
    count, least = 0, inf
    if abs(t1 - t0) * abs(t1 - t0) * dot(u, u) > SHORTEST * SHORTEST * (r + s) * (r + s):
        for k in range(2):
            x = add(a, scale(min(t0, t1) if k == 0 else max(t0, t1), u))
            y = add(b, scale(nearest_parameter(x, b, v), v))
            if sphere_contact(x, r, y, s, reach, scratch, count, 1.0 + k) == 1:
                if dot(n, (scratch[count, 3], scratch[count, 4], scratch[count, 5])) < SAME_SIDE:
                    return 0, inf
                least = min(least, scratch[count, 6])
                count += 1
    return count, least


@formula
def collide(G, i, j, A, B, reach, scratch):
    """Write the contact at the nearest points, and for nearly parallel segments those at the ends of the overlap."""
    a, u = axis_segment(G, i, A)
    b, v = axis_segment(G, j, B)
    first, second = (a, u, G.dimensions.par[i, 0]), (b, v, G.dimensions.par[j, 0])
    p, q = nearest_parameters(a, u, b, v)
    gap, n = nearest_contact(first, second, p, q, reach, scratch, 0)
    if not gap <= reach:
        return 0
    w = cross(u, v)
    if dot(w, w) >= PARALLEL * PARALLEL * dot(u, u) * dot(v, v):
        return 1
    count, least = end_contacts(first, second, n, reach, scratch)
    if count == 0 or gap < least - SAME_GAP * (first[2] + second[2]):
        nearest_contact(first, second, p, q, reach, scratch, count)
        count += 1
    return count
