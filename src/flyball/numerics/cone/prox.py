"""The nearest admissible impulse in a row's own metric, and its derivative.

A row's impulses p are looked for as those with the least R_n (p_n - y_n)^2 / 2 + R_t |p_t - y_t|^2 / 2: in the scaled
impulses sqrt(R) p a plain projection on a scaled cone, |p_t| <= mu p_n, cut at p_n >= least; of a line, on an interval.
The derivative of a projection is symmetric with eigenvalues in [0, 1] (Hiriart-Urruty 1982).
"""

from __future__ import annotations

from ...compiler.jit import formula
from ...math.scalar import sqrt
from .gather import ROWS

# columns of Rows.row: velocities with bias and no impulse; scaled y; its change along a step; scaled impulse; impulse
# that is held on to; room of solvers
U, Y, DY, Q, HELD, OWN = 0, 3, 6, 9, 12, 15
# mean mobility; roots of R_n, R_t; scaled mu, least (or lowest), highest; R; compliance; De Saxce's addition; kind; mu
MOBILITY, ROOT_N, ROOT_T, CONE, LEAST, HIGHEST, METRIC, GIVE, SLIP, KIND, FRICTION = range(21, 32)
WIDE = 32
CONTACT, LINE, IDLE = 0.0, 1.0, 2.0  # kinds; idle: nothing that it acts on moves


@formula
def on_cone(mu, least, n, s, t):
    """Nearest point of |(s, t)| <= mu n, n >= least."""
    r = sqrt(s * s + t * t)
    if r <= mu * n and n >= least:
        return n, s, t
    near = (n + mu * r) / (1.0 + mu * mu) if r > mu * n else n
    if near <= least:
        near = least
        if r <= mu * least:
            return least, s, t
    a = mu * near / r if r > 0.0 else 0.0
    return near, a * s, a * t


@formula
def derivative_on_cone(mu, least, n, s, t):
    """Of `on_cone`: nn, ns, nt, ss, st, tt."""
    r = sqrt(s * s + t * t)
    if r <= mu * n and n >= least:
        return 1.0, 0.0, 0.0, 1.0, 0.0, 1.0
    near = (n + mu * r) / (1.0 + mu * mu) if r > mu * n else n
    if near <= least:
        if least > 0.0 and r <= mu * least:
            return 0.0, 0.0, 0.0, 1.0, 0.0, 1.0
        if least <= 0.0 or mu == 0.0:
            return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        a, x, y = mu * least / r, s / r, t / r
        return 0.0, 0.0, 0.0, a * y * y, -a * x * y, a * x * x
    if r == 0.0 or mu == 0.0:
        return 1.0, 0.0, 0.0, 0.0, 0.0, 0.0
    a, x, y, f = mu * near / r, s / r, t / r, 1.0 / (1.0 + mu * mu)
    return (
        f,
        f * mu * x,
        f * mu * y,
        f * mu * mu * x * x + a * y * y,
        (f * mu * mu - a) * x * y,
        f * mu * mu * y * y + a * x * x,
    )


@formula
def nearest(x, o, n, s, t):
    """Scaled impulse nearest to a scaled one, of the row that begins at o in x."""
    if x[o + KIND] == CONTACT:
        return on_cone(x[o + CONE], x[o + LEAST], n, s, t)
    if x[o + KIND] == LINE:
        return min(max(n, x[o + LEAST]), x[o + HIGHEST]), 0.0, 0.0
    return 0.0, 0.0, 0.0


@formula
def slope(x, o, n, s, t):
    """Derivative of `nearest`."""
    if x[o + KIND] == CONTACT:
        return derivative_on_cone(x[o + CONE], x[o + LEAST], n, s, t)
    free = x[o + KIND] == LINE and x[o + LEAST] < n < x[o + HIGHEST]
    return 1.0 if free else 0.0, 0.0, 0.0, 0.0, 0.0, 0.0


@formula
def set_metric(R, rho):
    """R of every row: ``rho`` times its mobility, and its compliance in the normal direction."""
    x = R.row
    for row in range(R.size[ROWS]):
        o = WIDE * row
        old = x[o + ROOT_N]
        metric = rho * x[o + MOBILITY]
        x[o + METRIC] = metric
        x[o + ROOT_N] = sqrt(metric + x[o + GIVE])
        x[o + ROOT_T] = sqrt(metric)
        x[o + CONE] = x[o + FRICTION] * x[o + ROOT_T] / x[o + ROOT_N]
        x[o + LEAST] *= x[o + ROOT_N] / old
        x[o + HIGHEST] *= x[o + ROOT_N] / old
