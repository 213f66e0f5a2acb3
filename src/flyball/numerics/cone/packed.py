"""What is left of a contact as `pack` laid it out: as `residual` says, in a fraction of its time.

Each returns the square of the impulse that is lacking, its step, the square of the impulse, and what it adds to b' p
and to p' N p.
"""

from __future__ import annotations

from ...compiler.formulas import formula
from ...math.scalar import sqrt
from .pack import (
    B_BIAS,
    B_IN,
    B_IT,
    B_LEAST,
    B_MU,
    B_P,
    B_SOFT,
    B_T,
    BALL,
    BIAS,
    IMPULSE,
    KINDS,
    LEAST,
    MU,
    ROUGH,
    S_BIAS,
    S_IN,
    S_LEAST,
    S_P,
    S_SOFT,
    SMOOTH,
    SMOOTH_BALL,
    SOFT,
    width,
)
from .projection import projected_above
from .residual import NOTHING, of_lines, of_one, summary, worse
from .sweeps import rough_velocity, sliding, smooth_velocity


@formula
def centres(k, v, i, j, at):
    """Relative velocity of the centres of balls and its normal part."""
    a, b, c = v[j, 0] - v[i, 0], v[j, 1] - v[i, 1], v[j, 2] - v[i, 2]
    return a, b, c, k[at] * a + k[at + 1] * b + k[at + 2] * c


@formula
def pressed(p, u, before, step, least):
    """Of a normal impulse alone; u without bias in it, step: its inverse diagonal, bias and compliance; of `of_*`."""
    inverse, bias, soft = step
    q = p - (u + bias + soft * p) * inverse
    d = (least if q < least else q) - p  # nan stays nan
    return d * d, inverse, p * p, p * (before + bias), p * (u - before + soft * p)


@formula
def of_smooth_ball(k, v, free, i, j, at):
    """Balls without friction."""
    u, before = centres(k, v, i, j, at)[3], centres(k, free, i, j, at)[3]
    return pressed(k[at + B_P], u, before, (k[at + B_IN], k[at + B_BIAS], k[at + B_SOFT]), k[at + B_LEAST])


@formula
def of_smooth(k, v, free, i, j, at):
    """Any nodes without friction."""
    u, before = smooth_velocity(k, v, i, j, at), smooth_velocity(k, free, i, j, at)
    return pressed(k[at + S_P], u, before, (k[at + S_IN], k[at + S_BIAS], k[at + S_SOFT]), k[at + S_LEAST])


@formula
def of_ball(k, v, free, i, j, at, coulomb):
    """Balls."""
    d, f = centres(k, v, i, j, at), centres(k, free, i, j, at)
    x, y, z = sliding(k, v, i, j, at, d)
    e, g, h = sliding(k, free, i, j, at, f)
    p, a, b, c, mu = k[at + B_P], k[at + B_T], k[at + B_T + 1], k[at + B_T + 2], k[at + B_MU]
    linear = p * (f[3] + k[at + B_BIAS]) + a * e + b * g + c * h
    square = p * (d[3] - f[3] + k[at + B_SOFT] * p) + a * (x - e) + b * (y - g) + c * (z - h)
    size = p * p + a * a + b * b + c * c
    s = 3.0 * k[at + B_IN] * k[at + B_IT] / (k[at + B_IT] + 2.0 * k[at + B_IN])
    u = d[3] + k[at + B_BIAS] + k[at + B_SOFT] * p + coulomb * mu * sqrt(x * x + y * y + z * z)
    e, g, h = a - s * x, b - s * y, c - s * z
    r = sqrt(e * e + g * g + h * h)
    q, slip, _ = projected_above(mu, k[at + B_LEAST], p - s * u, r, 0.0)
    part = slip / r if r > 0.0 else 0.0
    e, g, h, q = part * e - a, part * g - b, part * h - c, q - p
    return e * e + g * g + h * h + q * q, s, size, linear, square


@formula
def of_rough(k, v, free, i, j, at, s, coulomb):
    """Any nodes; s: the step."""
    u, f = rough_velocity(k, v, i, j, at), rough_velocity(k, free, i, j, at)
    p, a, b, mu = k[at + IMPULSE], k[at + IMPULSE + 1], k[at + IMPULSE + 2], k[at + MU]
    x, y, z = k[at + BIAS], k[at + BIAS + 1], k[at + BIAS + 2]
    linear = p * (f[0] + x) + a * (f[1] + y) + b * (f[2] + z)
    square = p * (u[0] - f[0] + k[at + SOFT] * p) + a * (u[1] - f[1]) + b * (u[2] - f[2])
    size = p * p + a * a + b * b
    e, g = u[1] + y, u[2] + z
    n = p - s * (u[0] + x + k[at + SOFT] * p + coulomb * mu * sqrt(e * e + g * g))
    n, e, g = projected_above(mu, k[at + LEAST], n, a - s * e, b - s * g)
    n, e, g = n - p, e - a, g - b
    return n * n + e * e + g * g, s, size, linear, square


@formula
def of_packed(P, X, W, O, kind, s, at):
    """Of the contact at visit s, of a kind."""
    i, j, c = W.sides[s, 0], W.sides[s, 1], W.sides[s, 2]
    if kind == SMOOTH_BALL:
        return of_smooth_ball(W.pack, W.own, W.free, i, j, at)
    if kind == BALL:
        return of_ball(W.pack, W.own, W.free, i, j, at, O.count.coulomb)
    if kind == SMOOTH:
        return of_smooth(W.pack, W.own, W.free, i, j, at)
    if kind == ROUGH:
        return of_rough(W.pack, W.own, W.free, i, j, at, W.rows[1, c, 0], O.count.coulomb)
    return of_one(P, X, O, (W.own, X.wide, X.v, W.free_wide), c)


@formula
def remaining(P, X, W, O, many):
    """As `residuals`, of what `pack` laid out; impulses are in X too."""
    sofar, begin, at = NOTHING, 0, 0
    for kind in range(KINDS):
        for s in range(begin, begin + many[kind]):
            sofar = worse(sofar, of_packed(P, X, W, O, kind, s, at))
            at += width(kind)
        begin += many[kind]
    return summary(of_lines(P, X, O, X.wide, W.free_wide, sofar))
