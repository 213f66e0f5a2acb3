"""Building blocks of the narrow phase: scratch layout, contacts of spheres, segments, corners of discs.

The scratch is an array (SCRATCH_ROWS, 8). Contacts of the pair come first: point (3), unit normal from 1 to 2
(3), gap, feature (a whole number). The rest is workspace: corners of two faces, the clipped face, the simplex
and polytope of the search for the nearest points.
"""

from __future__ import annotations

from ...compiler.formulas import formula
from ...math.scalar import sqrt
from ...math.vec import add, dot, scale, store3, sub

MAX_CONTACTS = 128  # maximum contacts of a pair
MAX_CORNERS = 32  # maximum corners of a face
FACE_1 = MAX_CONTACTS
FACE_2 = FACE_1 + MAX_CORNERS
CLIPPED_1 = FACE_2 + MAX_CORNERS
CLIPPED_2 = CLIPPED_1 + 3 * MAX_CORNERS
SIMPLEX = CLIPPED_2 + 3 * MAX_CORNERS  # simplex and polytope
FIELD_TRIANGLE = SIMPLEX + 400  # corners of the current triangle of a height field
SCRATCH_ROWS = SIMPLEX + 512


@formula
def write_point(p, n, gap, name, scratch, k):
    """Write a contact."""
    store3(scratch, k, 0, p)
    store3(scratch, k, 3, n)
    scratch[k, 6], scratch[k, 7] = gap, name


@formula
def unit_vector_between(a, b):
    """Return the unit vector from a to b, and their distance; the x axis if they coincide or nearly so."""
    d = sub(b, a)
    length = sqrt(dot(d, d))
    if length < 1e-150:
        return (1.0, 0.0, 0.0), 0.0
    return scale(1.0 / length, d), length


@formula
def sphere_contact(a, r, b, s, reach, scratch, k, name):
    """Write the contact of spheres at a and b with radii r and s to row k, if within reach; returns 1 or 0."""
    n, length = unit_vector_between(a, b)
    gap = length - r - s
    if not gap <= reach:
        return 0
    write_point(add(a, scale(r + 0.5 * gap, n)), n, gap, name, scratch, k)
    return 1


@formula
def clamp_unit(t):
    """Clamp t to [0, 1]."""
    return max(0.0, min(1.0, t))


@formula
def nearest_parameter(p, a, u):
    """Parameter (0 to 1) of the point of the segment from a to a + u nearest to p."""
    uu = dot(u, u)
    return clamp_unit(dot(sub(p, a), u) / uu) if uu > 0.0 else 0.0


@formula
def nearest_parameters(a, u, b, v):
    """Parameters of the nearest points of the segments a + s u, b + t v (Ericson 2005, 5.1.9)."""
    w = sub(a, b)
    uu, vv, uv = dot(u, u), dot(v, v), dot(u, v)
    uw, vw = dot(u, w), dot(v, w)
    if not uu > 0.0:
        return 0.0, (clamp_unit(vw / vv) if vv > 0.0 else 0.0)
    if not vv > 0.0:
        return clamp_unit(-uw / uu), 0.0
    square = uu * vv - uv * uv
    s = clamp_unit((uv * vw - uw * vv) / square) if square > 1e-14 * uu * vv else 0.0
    t = (uv * s + vw) / vv
    if t < 0.0:
        return clamp_unit(-uw / uu), 0.0
    if t > 1.0:
        return clamp_unit((uv - uw) / uu), 1.0
    return s, t


DISC_CORNERS = 8
UPRIGHT_ANGLE = 1e-4  # tilt [rad] below which the corners are fixed in the shape
SQRT_HALF = sqrt(0.5)


@formula
def lateral_direction(d):
    """Return the unit vector (x, y) of the lateral part of d, and its length; the x axis if it is zero."""
    s = sqrt(d[0] * d[0] + d[1] * d[1])
    return ((d[0] / s, d[1] / s) if s > 0.0 else (1.0, 0.0)), s


@formula
def disc_corners(r, z, up, d, scratch, at):
    """Corners of the disc of radius r at height z that faces up (1) or down (-1); returns their number.

    If d is tilted, the first corner is the point of the disc farthest along d, so that a tilted disc touches exactly
    with its rim.
    """
    (x, y), s = lateral_direction(d)
    if s < UPRIGHT_ANGLE:
        x, y = 1.0, 0.0
    x, y = r * x, r * y
    for k in range(DISC_CORNERS):
        scratch[at + k, 0], scratch[at + k, 1], scratch[at + k, 2] = x, y, z
        x, y = SQRT_HALF * (x - up * y), SQRT_HALF * (y + up * x)
    return DISC_CORNERS
