"""The nearest admissible impulse in a row's own metric, and its derivative.

A row's impulses p are looked for as those with the least R_n (p_n - y_n)^2 / 2 + R_t |p_t - y_t|^2 / 2: in the scaled
impulses sqrt(R) p a plain projection on a scaled cone, |p_t| <= mu p_n, cut at p_n >= least; of a line, on an interval.
The derivative of a projection is symmetric with eigenvalues in [0, 1] (Hiriart-Urruty 1982).
"""

from __future__ import annotations

from ...compiler.formulas import formula
from ...math.scalar import sqrt
from .gather import ROWS
from .projection import projected_above

# columns of Rows.row: velocities with bias and no impulse; scaled y; its change along a step; scaled impulse; impulse
# that is held on to; room of solvers
U, Y, DY, Q, HELD, OWN = 0, 3, 6, 9, 12, 15
# mean mobility; roots of R_n, R_t; scaled mu, least (or lowest), highest; R; compliance; De Saxce's addition; kind; mu
MOBILITY, ROOT_N, ROOT_T, CONE, LEAST, HIGHEST, METRIC, GIVE, SLIP, KIND, FRICTION = range(21, 32)
WIDE = 32
# kinds; idle: nothing that it acts on moves; turning: within LEAST about the tangents, HIGHEST about the normal, which
# are FRICTION and SLIP times the normal impulse of the contact
CONTACT, LINE, IDLE, COULOMB_CONTACT, TURNING = 0.0, 1.0, 2.0, 3.0, 4.0


@formula
def derivative_on_cone(mu, least, n, s, t):
    """Of `projected_above`: nn, ns, nt, ss, st, tt, and sn, tn, here the same as ns and nt."""
    r = sqrt(s * s + t * t)
    if r <= mu * n and n >= least:
        return 1.0, 0.0, 0.0, 1.0, 0.0, 1.0, 0.0, 0.0
    near = (n + mu * r) / (1.0 + mu * mu) if r > mu * n else n
    if near <= least:
        return within(0.0, mu * least, s, t, r)
    a, x, y, f = mu * near / r, s / r, t / r, 1.0 / (1.0 + mu * mu)
    b, p, q = f * mu * mu, f * mu * x, f * mu * y
    return f, p, q, b * x * x + a * y * y, (b - a) * x * y, b * y * y + a * x * x, p, q


@formula
def within(normal, bound, s, t, r):
    """Derivative of the tangential part cut at a bound; ``normal``: what the bound changes by, along it."""
    one = 1.0 if normal > 0.0 else 0.0
    if r <= bound:
        b = 1.0 if bound > 0.0 else 0.0
        return one, 0.0, 0.0, b, 0.0, b, 0.0, 0.0
    a, x, y = bound / r, s / r, t / r
    return one, 0.0, 0.0, a * y * y, -a * x * y, a * x * x, normal * x, normal * y


@formula
def by_coulomb(mu, least, n, s, t):
    """The normal part at least ``least``, then the tangential part within mu times that (Alart and Curnier 1991)."""
    n = max(n, least)
    r = sqrt(s * s + t * t)
    a = 1.0 if r <= mu * n else mu * n / r
    return n, a * s, a * t


@formula
def derivative_by_coulomb(mu, least, n, s, t):
    """Of `by_coulomb`, as `derivative_on_cone`; not symmetric where it slides."""
    r = sqrt(s * s + t * t)
    if n > least:
        p = within(mu, mu * n, s, t, r)
        return 1.0, p[1], p[2], p[3], p[4], p[5], p[6], p[7]
    return within(0.0, mu * least, s, t, r)


@formula
def nearest(x, o, n, s, t):
    """Scaled impulse nearest to a scaled one, of the row that begins at o in x."""
    if x[o + KIND] == CONTACT:
        return projected_above(x[o + CONE], x[o + LEAST], n, s, t)
    if x[o + KIND] == COULOMB_CONTACT:
        return by_coulomb(x[o + CONE], x[o + LEAST], n, s, t)
    if x[o + KIND] == LINE:
        return min(max(n, x[o + LEAST]), x[o + HIGHEST]), 0.0, 0.0
    if x[o + KIND] == TURNING:
        a = by_coulomb(1.0, x[o + LEAST], -1.0, s, t)
        return min(max(n, -x[o + HIGHEST]), x[o + HIGHEST]), a[1], a[2]
    return 0.0, 0.0, 0.0


@formula
def slope(x, o, n, s, t):
    """Derivative of `nearest`."""
    if x[o + KIND] == CONTACT:
        return derivative_on_cone(x[o + CONE], x[o + LEAST], n, s, t)
    if x[o + KIND] == COULOMB_CONTACT:
        return derivative_by_coulomb(x[o + CONE], x[o + LEAST], n, s, t)
    if x[o + KIND] == TURNING:
        a = within(0.0, x[o + LEAST], s, t, sqrt(s * s + t * t))
        return 1.0 if abs(n) < x[o + HIGHEST] else 0.0, 0.0, 0.0, a[3], a[4], a[5], 0.0, 0.0
    free = x[o + KIND] == LINE and x[o + LEAST] < n < x[o + HIGHEST]
    return 1.0 if free else 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0


@formula
def slipped(x, o):
    """De Saxce's addition to the normal velocity, where it stands for Coulomb's law."""
    return x[o + SLIP] if x[o + KIND] == CONTACT else 0.0


@formula
def set_kind(R, old, new):
    """Contacts of one kind become another."""
    for row in range(R.size[ROWS]):
        if R.row[WIDE * row + KIND] == old:
            R.row[WIDE * row + KIND] = new


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
