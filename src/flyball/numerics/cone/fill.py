"""Numbers of an island's rows from problem and state, and back: what solvers with a factor begin and end with."""

from __future__ import annotations

from ...compiler.jit import formula
from ...math.scalar import sqrt
from .gather import BLOCKS, ROWS
from .operator import push, push_line, seen, seen_line
from .problem import BIAS, HIGH, ISLAND, LOW, SOFT
from .prox import (
    CONE,
    CONTACT,
    FRICTION,
    GIVE,
    HELD,
    HIGHEST,
    IDLE,
    KIND,
    LEAST,
    LINE,
    METRIC,
    MOBILITY,
    ROOT_N,
    ROOT_T,
    SLIP,
    WIDE,
    U,
    nearest,
    on_cone,
)
from .smooth import product


@formula
def span_of(P, O):
    """First contact, the one after the last, and the same of lines, of the island that is meant."""
    k = O.count[ISLAND]
    if k < 0:
        return 0, P.size[0], 0, P.size[3]
    return P.island[k], P.island[k + 1], P.line_p[k], P.line_p[k + 1]


@formula
def mobility(R, row, kind):
    """Mean of what the row's velocities change by for their own unit impulses."""
    s = 0.0
    for k in range(18 * R.entry_p[row], 18 * R.entry_p[row + 1]):
        s += R.G[k] * R.G[k]
    return s / 3.0 if kind == CONTACT else s


@formula
def fill_rows(P, X, R, span):
    """Numbers of every row; impulses to begin with are those of the state, made admissible. Metric is 1."""
    contacts = span[1] - span[0]
    for row in range(R.size[ROWS]):
        o = WIDE * row
        if row < contacts:
            fill_contact(P, X, R.row, o, span[0] + row)
        else:
            fill_line(P, X, R.row, o, span[2] + row - contacts)
        R.row[o + MOBILITY] = mobility(R, row, R.row[o + KIND])
        if not R.row[o + MOBILITY] > 0.0:
            R.row[o + KIND], R.row[o + MOBILITY] = IDLE, 1.0
        for k in range(METRIC, METRIC + 1):
            R.row[o + k] = 1.0
        R.row[o + ROOT_N] = R.row[o + ROOT_T] = 1.0
        x = nearest(R.row, o, R.row[o + HELD], R.row[o + HELD + 1], R.row[o + HELD + 2])
        R.row[o + HELD], R.row[o + HELD + 1], R.row[o + HELD + 2] = x


@formula
def fill_contact(P, X, x, o, c):
    """Numbers of a contact."""
    u = seen(P, X.v, X.wide, c)
    for k in range(3):
        x[o + U + k] = u[k] + P.bias[c, k]
        x[o + HELD + k] = X.p[c, k]
    x[o + KIND], x[o + SLIP] = CONTACT, 0.0
    x[o + FRICTION] = x[o + CONE] = P.mu[c]
    x[o + GIVE], x[o + HIGHEST] = P.soft[c], 0.0
    x[o + LEAST] = P.least[c] if P.least.shape[0] > 0 else 0.0


@formula
def fill_line(P, X, x, o, k):
    """Numbers of a line."""
    x[o + U], x[o + U + 1], x[o + U + 2] = seen_line(P, X.wide, k) + P.line_x[k, BIAS], 0.0, 0.0
    x[o + HELD], x[o + HELD + 1], x[o + HELD + 2] = X.line[k], 0.0, 0.0
    x[o + KIND], x[o + SLIP] = LINE, 0.0
    x[o + FRICTION] = x[o + CONE] = 0.0
    x[o + GIVE], x[o + LEAST], x[o + HIGHEST] = P.line_x[k, SOFT], P.line_x[k, LOW], P.line_x[k, HIGH]


@formula
def hand_back(P, X, R, span):
    """Impulses held on to become the state's, and its velocities those with them."""
    contacts = span[1] - span[0]
    for row in range(R.size[ROWS]):
        o = WIDE * row + HELD
        p = R.row[o], R.row[o + 1], R.row[o + 2]
        if row < contacts:
            c = span[0] + row
            X.p[c, 0], X.p[c, 1], X.p[c, 2] = p
            if p[0] != 0.0 or p[1] != 0.0 or p[2] != 0.0:
                push(P, X.v, X.wide, c, p)
        else:
            k = span[2] + row - contacts
            X.line[k] = p[0]
            push_line(P, X.wide, k, p[0])


@formula
def lack(x, o, n, s, t, u, v, w):
    """How far the impulse (n, s, t) of a row with velocities u, v, w is from p = nearest(p - u / mobility) [m/s]."""
    m, r = x[o + MOBILITY], x[o + ROOT_N]
    u += x[o + GIVE] * n
    m += x[o + GIVE]
    if x[o + KIND] == IDLE:
        return 0.0
    if x[o + KIND] == LINE:
        p = min(max(n - u / m, x[o + LEAST] / r), x[o + HIGHEST] / r), 0.0, 0.0
    else:
        p = on_cone(x[o + FRICTION], x[o + LEAST] / r, n - u / m, s - v / m, t - w / m)
    a, b, c = p[0] - n, p[1] - s, p[2] - t
    return m * sqrt(a * a + b * b + c * c)


@formula
def dilation(x, o, coulomb, v, w):
    """De Saxce's addition to the normal velocity."""
    return coulomb * x[o + FRICTION] * sqrt(v * v + w * w)


@formula
def gap_of_impulses(R, at, coulomb):
    """Residual [m/s] of impulses in column ``at`` whose velocities e are those in Rows.blocks; they are admissible."""
    x, worst, largest = R.row, 0.0, 0.0
    for row in range(R.size[ROWS]):
        o = WIDE * row
        n, s, t = x[o + at], x[o + at + 1], x[o + at + 2]
        u, v, w = product(R, row, 0)
        u, v, w = u + x[o + U], v + x[o + U + 1], w + x[o + U + 2]
        d = lack(x, o, n, s, t, u + dilation(x, o, coulomb, v, w), v, w)
        worst = d if d > worst or d != d else worst
        largest = max(largest, n * n + s * s + t * t)
    return worst, sqrt(largest)


@formula
def push_of(R):
    """|e|^2."""
    s = 0.0
    for k in range(6 * R.size[BLOCKS]):
        s += R.blocks[k] * R.blocks[k]
    return s
