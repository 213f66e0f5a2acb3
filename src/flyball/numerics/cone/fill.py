"""Numbers of an island's rows from problem and state, and back: what solvers with a factor begin and end with."""

from __future__ import annotations

from ...compiler.formulas import formula
from ...math.scalar import sqrt
from .gather import BEFORE_TURNING, BLOCKS, CONTACTS, ROWS, what
from .operator import push, push_line, push_turning, seen, seen_line, seen_turning
from .problem import BIAS, HIGH, LOW, SOFT
from .projection import least_of, projected_above
from .prox import (
    CONE,
    CONTACT,
    COULOMB_CONTACT,
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
    OWN,
    ROOT_N,
    ROOT_T,
    SLIP,
    TURNING,
    WIDE,
    Q,
    U,
    nearest,
)
from .residual import contacts_of, lines_of
from .smooth import from_held, product


@formula
def span_of(P, O):
    """First contact, the one after the last, and the same of lines, of the island that is meant."""
    first, last = contacts_of(P, O)
    line, end = lines_of(P, O)
    return first, last, line, end


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
    x = R.row
    for row in range(R.size[ROWS]):
        o = WIDE * row
        c, k = what(span, row)
        if k >= 0:
            fill_line(P, X, x, o, k)
        elif k == -2:
            fill_turning(P, X, x, o, c)
        else:
            fill_contact(P, X, x, o, c)
        x[o + MOBILITY] = mobility(R, row, x[o + KIND])
        if not x[o + MOBILITY] > 0.0:
            x[o + KIND], x[o + MOBILITY] = IDLE, 1.0
        x[o + METRIC] = x[o + ROOT_N] = x[o + ROOT_T] = 1.0
        if k == -2:
            set_bounds(R, row, HELD)
        p = nearest(x, o, x[o + HELD], x[o + HELD + 1], x[o + HELD + 2])
        for s in range(3):
            x[o + HELD + s] = x[o + Q + s] = p[s]


@formula
def set_bounds(R, row, at):
    """Bounds of rolling and spinning friction from the normal impulse in column ``at`` of the contact."""
    o, c = WIDE * row, WIDE * (row - R.size[BEFORE_TURNING])
    n = R.row[c + at]
    if at == Q:
        n /= R.row[c + ROOT_N]
    R.row[o + LEAST] = R.row[o + FRICTION] * n * R.row[o + ROOT_N]
    R.row[o + HIGHEST] = R.row[o + SLIP] * n * R.row[o + ROOT_N]


@formula
def fill_turning(P, X, x, o, c):
    """Numbers of the rolling and spinning friction of a contact."""
    u = seen_turning(P, X.v, X.wide, c)
    for k in range(3):
        x[o + U + k], x[o + HELD + k] = u[k], X.torque[c, k]
    x[o + KIND], x[o + GIVE] = TURNING, 0.0
    x[o + FRICTION] = x[o + CONE] = P.turn[c, 0]
    x[o + SLIP] = P.turn[c, 1]


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
    x[o + LEAST] = least_of(P, c)


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
    for row in range(R.size[ROWS]):
        o = WIDE * row + HELD
        p = R.row[o], R.row[o + 1], R.row[o + 2]
        c, k = what(span, row)
        if k >= 0:
            X.line[k] = p[0]
            push_line(P, X.wide, k, p[0])
        elif k == -2:
            X.torque[c, 0], X.torque[c, 1], X.torque[c, 2] = p
            push_turning(P, X.v, X.wide, c, p)
        else:
            X.p[c, 0], X.p[c, 1], X.p[c, 2] = p
            if p[0] != 0.0 or p[1] != 0.0 or p[2] != 0.0:
                push(P, X.v, X.wide, c, p)


@formula
def lack(x, o, n, s, t, u, v, w):
    """How far the impulse (n, s, t) of a row with velocities u, v, w is from p = nearest(p - u / mobility)."""
    m, r = x[o + MOBILITY] + x[o + GIVE], x[o + ROOT_N]
    u += x[o + GIVE] * n
    if x[o + KIND] == CONTACT or x[o + KIND] == COULOMB_CONTACT:
        p = projected_above(x[o + FRICTION], x[o + LEAST] / r, n - u / m, s - v / m, t - w / m)
    else:
        a, b, c = nearest(x, o, r * (n - u / m), r * (s - v / m), r * (t - w / m))
        p = a / r, b / r, c / r
    a, b, c = p[0] - n, p[1] - s, p[2] - t
    return sqrt(a * a + b * b + c * c)


@formula
def dilation(R, row, coulomb):
    """What is added to the normal velocity of a contact (velocities in column OWN), so that the cone makes the law.

    Coulomb's: mu |u_t| (De Saxce and Feng 1998). The convex form: of rolling and spinning, which are cut at bounds that
    the normal impulse has, what makes them parts of its cone.
    """
    x, o, o2 = R.row, WIDE * row + OWN, WIDE * (row + R.size[BEFORE_TURNING]) + OWN
    if coulomb > 0.0:
        return x[WIDE * row + FRICTION] * sqrt(x[o + 1] * x[o + 1] + x[o + 2] * x[o + 2])
    if R.size[BEFORE_TURNING] == R.size[ROWS]:
        return 0.0
    rolling = x[WIDE * (row + R.size[BEFORE_TURNING]) + FRICTION] * sqrt(x[o2 + 1] * x[o2 + 1] + x[o2 + 2] * x[o2 + 2])
    return -rolling - x[WIDE * (row + R.size[BEFORE_TURNING]) + SLIP] * abs(x[o2])


@formula
def residual(R, coulomb):
    """Residual [m/s] and force residual [1] of the impulses in column Q (scaled), velocities in column OWN.

    The impulse that is lacking is a velocity by the row's mobility, and a number by the largest impulse; torques are
    counted as the impulses that make as much energy.
    """
    x, worst, lacking, largest = R.row, 0.0, 0.0, 0.0
    for row in range(R.size[ROWS]):
        o = WIDE * row
        more, part = dilation(R, row, coulomb) if row < R.size[CONTACTS] else 0.0, 1.0
        if row >= R.size[BEFORE_TURNING]:
            set_bounds(R, row, Q)
        n, s, t = x[o + Q] / x[o + ROOT_N], x[o + Q + 1] / x[o + ROOT_T], x[o + Q + 2] / x[o + ROOT_T]
        d = lack(x, o, n, s, t, x[o + OWN] + more, x[o + OWN + 1], x[o + OWN + 2])
        if row >= R.size[BEFORE_TURNING]:
            set_bounds(R, row, HELD)
            c = WIDE * (row - R.size[BEFORE_TURNING])
            part = sqrt(x[o + MOBILITY] / x[c + MOBILITY])
        lacking, largest = max(lacking, part * d), max(largest, part * sqrt(n * n + s * s + t * t))
        d *= x[o + MOBILITY] + x[o + GIVE]
        worst = d if d > worst or d != d else worst
    return worst, lacking / largest if largest > 0.0 else lacking


@formula
def set_own(R):
    """Velocities at e of every row into column OWN."""
    for row in range(R.size[ROWS]):
        o = WIDE * row
        u = product(R, row, 0)
        for k in range(3):
            R.row[o + OWN + k] = u[k] + R.row[o + U + k]


@formula
def push_of(R):
    """|e|^2."""
    s = 0.0
    for k in range(6 * R.size[BLOCKS]):
        s += R.blocks[k] * R.blocks[k]
    return s


@formula
def make_safe(R):
    """Scale impulses so that they take energy: least 1/2 p' N p + b' p along them."""
    from_held(R)
    square, linear = push_of(R), 0.0
    for row in range(R.size[ROWS]):
        o = WIDE * row
        for k in range(3):
            linear += R.row[o + U + k] * R.row[o + HELD + k]
    a = -linear / square if square > 0.0 else 1.0
    a = min(max(a, 0.0), 1.0)
    for row in range(R.size[ROWS]):
        for k in range(3):
            R.row[WIDE * row + HELD + k] *= a


@formula
def set_slips(R, coulomb):
    """What is added to normal velocities, and bounds of rolling and spinning, of what is held on to."""
    for row in range(R.size[CONTACTS]):
        R.row[WIDE * row + SLIP] = dilation(R, row, coulomb)
    for row in range(R.size[BEFORE_TURNING], R.size[ROWS]):
        set_bounds(R, row, HELD)
