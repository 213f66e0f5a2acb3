"""Contact geometry of a wheel, a surface of revolution, on a rail, a cylinder along its track or a roller.

Local axes have the origin on the rail beneath the wheel's centre: t along the track, l from the middle of the track to
the rail, n upwards. The rail's profile is the height z(y) along n over y along l. The wheel's profile is the height
w(s) of its surface at its lowest place over s, measured along its axis away from the flange: its radius there is
r = r_0 - w(s). A roller is a rail bent downwards about an axis along l, with curvature kappa; kappa = 0 for track.

The circle of the wheel at s touches a cylinder along t where its normal has no component along t: at the angle at which
its radial direction e fulfils e.t = r' a.t, a being the direction of the wheel's axis. On a roller
e.t = a.t (r' - kappa s) / (1 + kappa r), to first order in the yaw angle. These points of all circles are the trace of
the wheel (Wang Kaiwen, *The track of wheel contact points and the calculation of wheel/rail geometric contact
parameters*, J. Southwest Jiaotong University 1, 1984). The surfaces touch where its depth below the rail is greatest.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from ..compiler.formulas import formula
from ..math.scalar import atan2, cos, maximum, minimum, rounded, sin, sqrt
from ..math.spline import BREAKS, spline
from ..math.vec import add, col, cross, dot, norm, scale, sub

# numbers of the element, in the order of the formulas' parameters
DATA, WHEEL_WIDTH, RAIL_WIDTH, RADIUS, BEND, SIDE, FIRST, LAST, MODULUS, SHEAR, FRICTION, DAMPING, STANDSTILL = range(
    13
)
CURVATURE, CANT = 13, 14  # of the track, to its left; sine and cosine of the cant
REFINEMENTS = 4  # steps of Newton's method
REACH = 6e-3  # [m] by which they may move a place
LEAST_CURVATURE = 1e-3  # [1/m] of the difference of the profiles, for Newton's method
MARGIN = 1e-3  # [m] of the depth, by which a contact that is surely open is known before its place is computed
TRAVEL = 0.03  # [m] by which a wheel may move across the rail, and its profile pass the ends of the rail's
SHIFT = 1e-3  # [m] between two rows of the table of places
TILT, TILTS = 0.02, 4  # [rad] between two rolls of the wheelset in it, and their number on either side
SAMPLES = 161  # places on the wheel's profile at which the depth is compared
APART = 5e-3  # [m] between two contacts; nearer local maxima of the depth are one


@formula
def horizontal_axes(par, F):
    """Return the direction of the track at its beginning, the horizontal one to its left, and the vertical one."""
    left, up = col(F[1], 1), col(F[1], 2)
    s, c = par[CANT], par[CANT + 1]
    return col(F[1], 0), sub(scale(c, left), scale(s, up)), add(scale(s, left), scale(c, up))


@formula
def track_place(par, F, M):
    """Return the distance along the track [m], the rate at which the wheel's centre passes it, and the heading [rad].

    The heading is the angle about the vertical by which the track has turned. In a curve the distance is counted up to
    half a turn.
    """
    k = par[CURVATURE]
    ahead, left, _ = horizontal_axes(par, F)
    d = sub(M[0], F[0])
    u = sub(sub(M[3], F[3]), cross(F[2], d))
    x, y = dot(ahead, d), dot(left, d)
    if k.real == 0.0:
        return x, dot(ahead, u), 0.0 * x
    inward = 1.0 - k * y
    heading = atan2(k * x, inward)
    return heading / k, (dot(ahead, u) * inward + k * x * dot(left, u)) / (k * k * x * x + inward * inward), heading


@formula
def curved_axes(par, F, M):
    """Return `rail_axes` of a rail in a curve: those of F turned about the vertical, at the place beneath the wheel."""
    ahead, left, up = horizontal_axes(par, F)
    _, _, heading = track_place(par, F, M)
    d = sub(M[0], F[0])
    c, s, half = cos(heading), sin(heading), sin(0.5 * heading)
    x, y, z = dot(ahead, d), dot(left, d), dot(up, d)
    y = y * c - x * s + 2.0 * half * half / par[CURVATURE]
    t, h = add(scale(c, ahead), scale(s, left)), sub(scale(c, left), scale(s, ahead))
    sine, cosine = par[CANT], par[CANT + 1]
    side = par[SIDE]
    l, n = scale(side, add(scale(cosine, h), scale(sine, up))), sub(scale(cosine, up), scale(sine, h))
    return t, l, n, side * (y * cosine + z * sine), z * cosine - y * sine


@formula
def rail_axes(par, F, M):
    """Return the local axes t, l, n in the world, and the wheel's centre along l and n from their origin.

    A straight rail's axes are those of F. Those of a roller, whose centre F is, have n towards the wheel's centre.
    """
    if par[CURVATURE].real != 0.0:
        return curved_axes(par, F, M)
    d = sub(M[0], F[0])
    l = scale(par[SIDE], col(F[1], 1))
    if par[BEND].real == 0.0:
        t, n = col(F[1], 0), col(F[1], 2)
        return t, l, n, dot(d, l), dot(d, n)
    y = dot(d, l)
    away = sub(d, scale(y, l))
    distance = norm(away)
    n = scale(1.0 / distance, away)
    return scale(par[SIDE], cross(l, n)), l, n, y, distance - 1.0 / par[BEND]


@formula
def trace_point(par, axis, centre, s, w, slope):
    """Return the point of the wheel's trace at s from the origin of the local axes, and the radial direction there.

    ``axis`` is the direction of the wheel's axis, ``centre`` its centre along l and n; w and slope are those of its
    profile at s.
    """
    a, b, c = axis
    r = par[RADIUS] - w
    square = 1.0 - a * a
    leaning = -a * (slope + par[BEND] * s) / ((1.0 + par[BEND] * r) * square)
    down = sqrt((1.0 - leaning * leaning * square) / square)
    e = (leaning * square, down * c - leaning * a * b, -down * b - leaning * a * c)
    return (s * a + r * e[0], centre[0] + s * b + r * e[1], centre[1] + s * c + r * e[2]), e


@formula
def height(bend, x, z):
    """Return the height of a point above a rail's crown, and its gradient along t and n."""
    up = 1.0 + bend * z
    root = sqrt(bend * bend * x * x + up * up)
    return (bend * (x * x + z * z) + 2.0 * z) / (root + 1.0), bend * x / root, up / root


@formula
def depth_at(par, axis, centre, s, data):
    """Return the vertical depth of the wheel's trace at s below the rail, and its first two derivatives by s."""
    wheel = int(par[DATA].real)
    rail = wheel + int(par[WHEEL_WIDTH].real)
    w, w1, w2 = spline(data, wheel, s)
    (x, y, z), e = trace_point(par, axis, centre, s, w, w1)
    up, along, above = height(par[BEND], x, z)
    f, f1, f2 = spline(data, rail, y)
    dy = axis[1] - w1 * e[1]
    first = f1 * dy - along * (axis[0] - w1 * e[0]) - above * (axis[2] - w1 * e[2])
    second = f2 * dy * dy + w2 * (above * e[2] - f1 * e[1])
    return f - up, first, second


@formula
def greatest_depth(par, axis, centre, guess, data):
    """Return a number that is greater than the local maximum of the depth near a place, from a parabola there."""
    depth, first, second = depth_at(par, axis, centre, guess, data)
    return depth - 0.5 * first * first / minimum(second, -LEAST_CURVATURE + 0.0 * second) + MARGIN


@formula
def refined_place(par, axis, centre, guess, data):
    """Return the place of the local maximum of the depth near a place, by Newton's method."""
    s = guess
    for _ in range(REFINEMENTS):
        _, first, second = depth_at(par, axis, centre, s, data)
        s = s - first / minimum(second, -LEAST_CURVATURE + 0.0 * second)
        s = maximum(minimum(s, guess + REACH), guess - REACH)
    return s


@formula
def near_places(par, axis, centre, data):
    """Return the places s of the deepest and of a second local maximum of the depth, roughly (`place_table`).

    A place beyond `LAST` stands for none.
    """
    at = int(par[DATA].real) + int(par[WHEEL_WIDTH].real) + int(par[RAIL_WIDTH].real)
    tilt = maximum(minimum(rounded(axis[2] / TILT), TILTS + 0.0 * axis[2]), -TILTS + 0.0 * axis[2])
    y = centre[0] + par[RADIUS] * axis[2]
    y = maximum(minimum(y, TRAVEL + 0.0 * y), -TRAVEL + 0.0 * y)
    x = y + 2.0 * (TRAVEL + SHIFT) * tilt
    return spline(data, at, x)[0], spline(data, at + PLACES_WIDTH, x)[0]


@formula
def contact_place(par, axis, centre, s, data):
    """Return what the contact at s of the wheel's profile needs.

    Returns
    -------
    tuple
        Point from the origin of the local axes; normal of the rail, and direction of rolling, in local axes; depth
        along the normal; half the sums of the curvatures along and across.
    """
    wheel = int(par[DATA].real)
    w, w1, w2 = spline(data, wheel, s)
    p, _ = trace_point(par, axis, centre, s, w, w1)
    up, along, above = height(par[BEND], p[0], p[2])
    f, f1, f2 = spline(data, wheel + int(par[WHEEL_WIDTH].real), p[1])
    c = 1.0 / sqrt(1.0 + f1 * f1)
    k = 1.0 / sqrt(1.0 + w1 * w1)
    rolling = 0.5 * (k / (par[RADIUS] - w) + c * par[BEND] / (1.0 + par[BEND] * f))
    across = 0.5 * (w2 * k * k * k - f2 * c * c * c)
    return p, (c * along, -c * f1, c * above), (above, 0.0 * above, -along), c * (f - up), (rolling, across)


@formula
def beyond_profile(par, y, data):
    """Return a number greater than zero where y is beyond the ends of the rail's profile."""
    rail = int(par[DATA].real) + int(par[WHEEL_WIDTH].real)
    count = int(data[rail + 1].real)
    return maximum(data[rail + BREAKS] - y, y - data[rail + BREAKS + count - 1])


@lru_cache(maxsize=64)
def place_table(numbers: tuple[float, ...], splines: tuple[float, ...]) -> tuple[float, ...]:
    """Return the places of the two deepest local maxima of the depth as two piecewise constant splines (`near_places`).

    Their argument counts the lateral places of the wheel for one roll of the wheelset after the other. ``numbers`` are
    those of the formulas, ``splines`` the profiles of wheel and rail, as real numbers.
    """
    data = np.array(splines)
    s = np.linspace(numbers[FIRST], numbers[LAST], SAMPLES)
    y = SHIFT * np.arange(-ROWS, ROWS + 1)
    x, rows = [], []
    for k in range(-TILTS, TILTS + 1):
        tilt = k * TILT
        axis = (0.0, np.sqrt(1.0 - tilt * tilt), tilt)
        centre = (y[:, None] - numbers[RADIUS] * tilt, 0.0)
        depth = depth_at(numbers, axis, centre, s, data)[0]
        x.append(y + 2.0 * (TRAVEL + SHIFT) * k)
        rows += [_two_deepest(s, d) for d in depth]
    breaks = np.concatenate(x) - 0.5 * SHIFT
    out: list[float] = []
    for column in np.array(rows).T:
        pieces = np.column_stack([column, np.zeros((len(column), 3))])
        out += [0.0, float(len(breaks)), *breaks, *pieces[:1].ravel(), *pieces.ravel()]
    return tuple(float(v) for v in out)


def _two_deepest(s: np.ndarray, depth: np.ndarray) -> tuple[float, float]:
    """Return the places of the two greatest local maxima, as far apart as two contacts are."""
    k = 1 + np.flatnonzero((depth[1:-1] > depth[:-2]) & (depth[1:-1] >= depth[2:]))
    k = k[np.argsort(-depth[k], kind="stable")]
    none = float(s[-1] + 1.0)
    if not len(k):
        return none, none
    other = k[np.abs(s[k] - s[k[0]]) > APART]
    return float(s[k[0]]), float(s[other[0]]) if len(other) else none


ROWS = round(TRAVEL / SHIFT)
PLACES_WIDTH = 2 + 5 * (2 * ROWS + 1) * (2 * TILTS + 1) + 4
