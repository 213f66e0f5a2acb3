"""A sharp corner M on a face of a box F: its height above the face, sliding velocity, and distance from the face's end.

The half edges par[0:3], the radius par[3], the tangent par[4] and the height par[6] are those of `ball_on_box`; par[5]
is the angle, in M's x-y plane, of the direction from the corner into M's body. At the end of a face the pose does not
determine the face: ``hint`` is its number, which stays constant during a step.
"""

from __future__ import annotations

from ..compiler.formulas import formula
from ..math.scalar import absolute, cos, sin
from ..math.vec import cross, dot, mtv, mv, sub
from .ball_on_box import face, gap_row, outward, slip
from .displacement import row as along

KIND_HEIGHT = 14
KIND_SLIDE = 15
KIND_MARGIN = 16
KIND_APART = 17
SINGLE = True
HEIGHT_TOLERANCE = 1e-9  # relative to its distance from the middle: smaller differences of height count as equal


@formula
def height_above_face(par, p, n):
    """Return the height of p above the face with the normal n."""
    return dot(n, p) - (par[0] * n[0] * n[0] + par[1] * n[1] * n[1] + par[2] * n[2] * n[2])


@formula
def equal_heights(p):
    """Return the tolerance within which heights count as equal."""
    return HEIGHT_TOLERANCE * (absolute(p[0]) + absolute(p[1]) + absolute(p[2])).real


@formula
def foot(par, F, M, hint, data):
    """Return the face that the corner lies farthest beyond, or nearest below.

    If two faces are equally near, as when the corner passes over an edge, it is the one in front of which M's body
    lies.
    """
    p = mtv(F[1], sub(M[0], F[0]))
    o = 0.0 * p[0]
    body = mtv(F[1], mv(M[1], (cos(par[5]) + o, sin(par[5]) + o, o)))
    best = height_above_face(par, p, outward(face(par, p), o)).real - equal_heights(p)
    found, most = 0, -2.0
    for i in range(6):
        n = outward(i, o)
        if height_above_face(par, p, n).real >= best and dot(n, body).real > most:
            found, most = i, dot(n, body).real
    return o + found


@formula
def progress(par, F, M, s, data):
    """Return zero rates: faces do not change during a step."""
    return 0.0 * s, 0.0 * s


@formula
def height_row(par, F, M, hint, data):
    """Value, force on M at its origin (minus that on F), torques on M and F about their origins, acceleration bias."""
    o = 0.0 * par[0]
    n = outward(int(hint.real), o)
    high = par[6] - height_above_face(par, (o, o, o), n)
    return along((n[0], n[1], n[2], par[3], par[4], par[5], high, par[7]), F, M, hint, data)


@formula
def slide_row(par, F, M, hint, data):
    """No value, the wrench of slip, its bias. See `ball_on_box.slip`."""
    n = mv(F[1], outward(int(hint.real), 0.0 * par[0]))
    return slip(par, F, M, n, cross(F[2], n))


@formula
def margin_row(par, F, M, hint, data):
    """Return the distance of the corner from the end of its face: its depth below the nearest other face."""
    p = mtv(F[1], sub(M[0], F[0]))
    o = 0.0 * p[0]
    here, other, best = int(hint.real), 0, -1e300
    for i in range(6):
        high = height_above_face(par, p, outward(i, o)).real
        if i != here and high > best:
            other, best = i, high
    n = outward(other, o)
    deep = height_above_face(par, (o, o, o), n)
    return along((-n[0], -n[1], -n[2], par[3], par[4], par[5], deep, par[7]), F, M, hint, data)


@formula
def distance_row(par, F, M, hint, data):
    """Return the distance from the box for any position of the corner; above its face, the height."""
    p = mtv(F[1], sub(M[0], F[0]))
    o = 0.0 * p[0]
    high = height_above_face(par, p, outward(int(hint.real), o)).real
    if high >= height_above_face(par, p, outward(face(par, p), o)).real - equal_heights(p):
        return height_row(par, F, M, hint, data)
    return gap_row(par, F, M, hint, data)


ROWS = {KIND_HEIGHT: height_row, KIND_SLIDE: slide_row, KIND_MARGIN: margin_row, KIND_APART: distance_row}
