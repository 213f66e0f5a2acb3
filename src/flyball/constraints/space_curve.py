"""A point on a curve fixed in F: two conditions across the curve, and the position along it.

The curve c(s) and two directions a(s), b(s) across it are splines on the same breaks, in F's axes; ``data`` holds their
nine components one after the other, from par[1] on, and par[2] is the place of the second. With s the parameter of the
curve point nearest to M's origin p, and d = p - c(s), the conditions are a.d = 0 and b.d = 0, and the coordinate is s.
From (p - c).c' = 0 follow the rates of s:

    s' = c'.v / h,  s'' = (2 s' c''.d' - s'^2 c'.c'') / h at p'' = 0,  h = c'.c' - d.c'',  d' = v - s' c'

where v is the velocity of p seen from F. (The term c'''.d s'^2 / h of s'' is left out: it is zero on the curve.) If
par[5] is greater than par[4], the curve ends at these parameters: beyond them the conditions are nan.
"""

from __future__ import annotations

import math

from ..compiler.formulas import formula
from ..math.scalar import choose, maximum, minimum
from ..math.spline import GRACE, spline
from ..math.vec import add, dot, mtv, scale, sub
from .displacement import point_row, seen_from

KIND = 21
POINTS = "M"
PASSES = 8
CURVE = 0  # vectors in ``data``: the curve, then the two directions across it


@formula
def vector(par, which, s, data):
    """Return the curve, or a direction across it, at s, with first and second derivative."""
    width = int(par[2].real) - int(par[1].real)
    at = int(par[1].real) + 3 * which * width
    x, x1, x2 = spline(data, at, s)
    y, y1, y2 = spline(data, at + width, s)
    z, z1, z2 = spline(data, at + 2 * width, s)
    return (x, y, z), (x1, y1, z1), (x2, y2, z2)


@formula
def offset(par, F, M, s, data):
    """Return the vector from the curve point at s to M's origin, along F's axes, and the derivative c'."""
    c, c1, _ = vector(par, CURVE, s, data)
    return sub(mtv(F[1], sub(M[0], F[0])), c), c1


@formula
def foot(par, F, M, hint, data):
    """The parameter of the curve point nearest to M's origin by Newton's method from ``hint``: (p - c).c' = 0."""
    p = mtv(F[1], sub(M[0], F[0]))
    s = hint + 0.0 * p[0]
    for _ in range(PASSES):
        c, c1, c2 = vector(par, CURVE, s, data)
        d = sub(p, c)
        speed = dot(c1, c1)
        # near a centre of curvature Newton's method would diverge: the slope is bounded below by a part of |c'|^2
        s = s + dot(d, c1) / maximum(speed - dot(d, c2), 0.1 * speed)
    return s


@formula
def motion(par, F, M, s, data):
    """Return d, s' and s'' (at p'' = 0), d', h, and the curve's derivatives."""
    c, c1, c2 = vector(par, CURVE, s, data)
    r, v = seen_from(F, M)
    d = sub(r, c)
    h = dot(c1, c1) - dot(d, c2)
    rate = dot(c1, v) / h
    along = sub(v, scale(rate, c1))
    second = (2.0 * rate * dot(c2, along) - rate * rate * dot(c1, c2)) / h
    return d, rate, second, along, h, c1, c2


@formula
def progress(par, F, M, s, data):
    """Return the rate of s, twice: it is the arc length."""
    _, rate, _, _, _, _, _ = motion(par, F, M, s, data)
    return rate, rate


@formula
def row(par, F, M, hint, data):
    """A condition across the curve, a.d = 0 with gradient a + (a'.d - a.c') c' / h; or the coordinate s, with c' / h.

    par[0] is 1 or 2 for the two conditions, 0 for the coordinate.
    """
    s = foot(par, F, M, hint, data)
    d, rate, second, along, h, c1, c2 = motion(par, F, M, s, data)
    which = int(par[0].real)
    if which == CURVE:
        return point_row(F, M, s - par[6], scale(1.0 / h, c1), second)
    a, a1, a2 = vector(par, which, s, data)
    gradient = add(a, scale((dot(a1, d) - dot(a, c1)) / h, c1))
    turning = rate * rate * dot(a2, d) + second * dot(a1, d) + 2.0 * rate * dot(a1, along)
    curvature = turning - rate * rate * dot(a, c2) - second * dot(a, c1)
    o = 0.0 * rate
    width = par[5] - par[4]
    inside = choose(width, minimum(s - par[4], par[5] - s) + GRACE * width, o + 1.0)
    ended = choose(inside, o, o + math.nan)
    return point_row(F, M, dot(a, d) - par[6] + ended, gradient, curvature + ended)
