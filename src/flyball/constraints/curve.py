"""Distance of M's origin from a smooth curve in F's x-y plane, counted along F's z: a cam and its follower.

With s the parameter of the curve point c(s) nearest to M's origin and n its normal there, delta = n.(p - c). The row is
par[3] delta - par[6], where par[3] is the side of the curve (+1 or -1) and par[6] the radius of the follower's roller.
The gradient of delta is n, exactly, since the nearest point does not change it to first order. ``hint`` is a parameter
nearby; par[1] and par[2] are the positions of the splines x(s) and y(s) in ``data``. If par[5] is greater than par[4],
the curve ends at these parameters: beyond them the row is nan, while the search for the nearest point may continue on
the straight extension.

For the curvature terms see Shigley and Uicker, *Theory of Machines and Mechanisms* (1995), chapter 6, or any text on
offset curves.
"""

from __future__ import annotations

import math

from ..compiler.formulas import formula
from ..math.scalar import choose, maximum, minimum, sqrt
from ..math.spline import GRACE, spline
from ..math.vec import cross, dot, mtv, mv, scale, sub

KIND = 8
POINTS = "M"
PASSES = 8


@formula
def point(par, s, data):
    """Return the curve at s with first and second derivatives: (x, x', x'', y, y', y'')."""
    x, x1, x2 = spline(data, int(par[1].real), s)
    y, y1, y2 = spline(data, int(par[2].real), s)
    return x, x1, x2, y, y1, y2


@formula
def offset(par, F, M, s, data):
    """Return the vector from the curve point at s to M's origin, in F's x-y plane, and the derivative c'."""
    x, x1, _, y, y1, _ = point(par, s, data)
    p = mtv(F[1], sub(M[0], F[0]))
    o = 0.0 * x
    return (p[0] - x, p[1] - y, o), (x1, y1, o)


@formula
def foot(par, F, M, hint, data):
    """The parameter of the curve point nearest to M's origin by Newton's method from ``hint``: (p - c).c' = 0."""
    p = mtv(F[1], sub(M[0], F[0]))
    s = hint + 0.0 * p[0]
    for _ in range(PASSES):
        x, x1, x2, y, y1, y2 = point(par, s, data)
        dx = p[0] - x
        dy = p[1] - y
        speed = x1 * x1 + y1 * y1
        # near the curve's centre of curvature Newton's method would diverge: the slope is bounded below by a part of
        # |c'|^2
        s = s + (dx * x1 + dy * y1) / maximum(speed - dx * x2 - dy * y2, 0.1 * speed)
    return s


@formula
def local(par, F, M, s, data):
    """Return, at the nearest point, normal and tangent in the world, delta, curvature, and |c'|."""
    x, x1, x2, y, y1, y2 = point(par, s, data)
    speed = sqrt(x1 * x1 + y1 * y1)
    p = mtv(F[1], sub(M[0], F[0]))
    o = 0.0 * speed
    n = (y1 / speed, -x1 / speed, o)
    delta = n[0] * (p[0] - x) + n[1] * (p[1] - y)
    curvature = (x1 * y2 - y1 * x2) / (speed * speed * speed)
    return mv(F[1], n), mv(F[1], (x1 / speed, y1 / speed, o)), delta, curvature, speed


@formula
def progress(par, F, M, s, data):
    """Return the rates of s and of the arc length at the nearest point."""
    _, t, delta, curvature, speed = local(par, F, M, s, data)
    along = dot(t, sub(sub(M[3], F[3]), cross(F[2], sub(M[0], F[0]))))
    length = along / (1.0 + curvature * delta)
    return length / speed, length


@formula
def row(par, F, M, hint, data):
    """Value, force on M at its origin (minus that on F), torques on M and F about their origins, acceleration bias.

    deltadot = n.u + w_F.(n x d); besides the terms of an axis fixed in F, the bias contains curvature u_t^2 / (1 +
    curvature delta).
    """
    s = foot(par, F, M, hint, data)
    n, t, delta, curvature, _ = local(par, F, M, s, data)
    n = scale(par[3], n)
    d = sub(M[0], F[0])
    u = sub(M[3], F[3])
    arm = cross(n, d)
    n1 = cross(F[2], n)
    along = dot(t, sub(u, cross(F[2], d)))
    bias = dot(n, sub(M[5], F[5])) + dot(F[4], arm) + 2.0 * dot(n1, u) + dot(cross(F[2], n1), d)
    bias = bias + par[3] * curvature * along * along / (1.0 + curvature * delta)
    o = 0.0 * along
    width = par[5] - par[4]
    inside = choose(width, minimum(s - par[4], par[5] - s) + GRACE * width, o + 1.0)
    ended = choose(inside, o, o + math.nan)
    return par[3] * delta - par[6] + ended, n, (o, o, o), arm, bias + ended
