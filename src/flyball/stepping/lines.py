"""Single rows on the mechanism: stops of coordinates, ropes, friction in joints; each an impulse along one quantity.

- A stop: velocity and impulse are complementary, as at a contact; it bounces off by Newton's law.
- A rope pulls or is slack within one step, and is taken implicitly as springs are (`implicit.py`).
- Friction is bounded by its own law, at the load that the reactions of the last step tell: what sticks, sticks.
"""

from __future__ import annotations

from ..compiler.formulas import formula
from ..equations.friction import dry, held_at_rest, reaction_loads
from ..numerics.cone.problem import BIAS, HIGH, LOW, SOFT
from ..tables.system import BIAS as BEND_OF
from ..tables.system import RETURNED, VALUE
from .joined import (
    CHANGE,
    FRICTION,
    LEAST,
    LINE_AT,
    LINE_GROUP,
    LINE_OF,
    MEASURED,
    MOST_AT,
    OF_FORCE,
    PRESSED,
    PULLED,
    REBOUND,
    ROPE,
    ROPE_C,
    ROPE_K,
    SHORTEST,
    STOP,
    V_AFTER,
    V_BEFORE,
    WHAT,
)

AT_REST = 1e-9  # part of what friction slows down within a step below which a rate is none
AHEAD = 4.0  # a stop is a line where what it stops may reach it within as many steps
INFINITE = 1e300


@formula
def line_groups(A, k):
    """Group of the quantity that line k acts along; -1 if nothing moves it."""
    r = A.S.rows.law.shape[0] + A.line[k, MEASURED]
    for e in range(A.S.row_start[r], A.S.row_start[r + 1]):
        for g in range(A.queue.shape[0]):
            if A.group[g] <= A.S.column[e] < A.group[g + 1]:
                return g
    return -1


@formula
def rate_of(A, k, v):
    """Rate of the quantity of line k with velocities v."""
    s = 0.0
    r = A.S.rows.law.shape[0] + A.line[k, MEASURED]
    for e in range(A.S.row_start[r], A.S.row_start[r + 1]):
        s += A.W.G[e] * v[A.S.column[e]]
    return s


@formula
def gap_of(A, k, side):
    """How far the quantity of a stop was from it when the step began; side 1 is the lower stop, -1 the upper."""
    x = A.W.sensed[VALUE, A.line[k, MEASURED]] - 0.5 * A.real.step * rate_of(A, k, A.wide[V_BEFORE])
    return x - A.line_x[k, LEAST] if side > 0 else A.line_x[k, MOST_AT] - x


@formula
def acts(A, k, side):
    """Whether line k acts in this step: of two stops always the nearer one, since impacts elsewhere may lead there."""
    if A.line[k, WHAT] != STOP:
        return side > 0
    r, dr = rate_of(A, k, A.wide[V_BEFORE]), rate_of(A, k, A.wide[CHANGE])
    if gap_of(A, k, side) < gap_of(A, k, -side):
        return True
    return gap_of(A, k, side) < AHEAD * A.real.step * (abs(r) + abs(dr)) + 1e-9


@formula
def line_rows(A, P, used, jobs, room):
    """Rows of the lines that act, behind those of the contacts, if ``room``. Returns (numbers, jobs, lines)."""
    n = 0
    for k in range(A.line.shape[0]):
        g = line_groups(A, k)
        if g < 0:
            continue
        for turn in range(2):
            side = 1 - 2 * turn
            if not acts(A, k, side):
                continue
            size = A.group[g + 1] - A.group[g]
            if room:
                A.active[n, LINE_OF], A.active[n, LINE_GROUP], A.active[n, LINE_AT] = side * (k + 1), g, used
                one_row(A, P, k, g, (used, size, side))
            used += size
            jobs += 1
            n += 1
    return used, jobs, n


@formula
def one_row(A, P, k, g, where):
    """The gradient of the quantity of line k, reversed for an upper stop."""
    at, size, side = where
    for d in range(size):
        P.J[at + d] = 0.0
    r = A.S.rows.law.shape[0] + A.line[k, MEASURED]
    for e in range(A.S.row_start[r], A.S.row_start[r + 1]):
        P.J[at + A.S.column[e] - A.group[g]] += side * A.W.G[e]


@formula
def line_laws(A, P, n):
    """Biases, compliances and bounds of the lines, whose responses are known."""
    h = A.real.step
    P.size[3] = n
    for i in range(n):
        k = abs(A.active[i, LINE_OF]) - 1
        side = 1 if A.active[i, LINE_OF] > 0 else -1
        x = P.line_x[i]
        P.line_at[i, 0], P.line_at[i, 1] = A.active[i, LINE_GROUP], A.active[i, LINE_AT]
        x[BIAS], x[SOFT], x[LOW], x[HIGH] = 0.0, 0.0, 0.0, INFINITE
        rate = side * rate_of(A, k, A.wide[V_BEFORE])
        if A.line[k, WHAT] == STOP:
            gap = gap_of(A, k, side)
            hit = rate < 0.0 and gap + h * rate <= 0.0
            x[BIAS] = A.line_x[k, REBOUND] * rate if hit else max(gap, 0.0) / h
        elif A.line[k, WHAT] == ROPE:
            rope_law(A, P, i, k, x)
        else:
            friction_law(A, P, i, k, x)


@formula
def friction_law(A, P, i, k, x):
    """Between -h F and h F. What moves no faster than rounding would have it is at rest, and held by more."""
    h = A.real.step
    g, at = A.active[i, LINE_GROUP], A.active[i, LINE_AT]
    w = 0.0
    for d in range(A.group[g + 1] - A.group[g]):
        w += P.J[at + d] * P.Y[at + d]
    t, arm, load = A.real.time + 0.5 * h, A.line_x[k, LEAST], A.line_x[k, PRESSED]
    rate = rate_of(A, k, A.wide[V_BEFORE])
    held = h * held_at_rest(A.S, A.W, A.line[k, OF_FORCE], t, arm, load)
    if abs(rate) > AT_REST * held * w:
        held = h * dry(A.S, A.W, A.line[k, OF_FORCE], t, rate, arm, load)
    x[LOW], x[HIGH] = -held, held


@formula
def rope_law(A, P, i, k, x):
    """-s = h (K (x - x0) + C r), at the place and the rate that `implicit` takes springs at; it never pushes."""
    h = A.real.step
    K, C = A.line_x[k, ROPE_K], A.line_x[k, ROPE_C]
    g, at = A.active[i, LINE_GROUP], A.active[i, LINE_AT]
    w = 0.0
    for d in range(A.group[g + 1] - A.group[g]):
        w += P.J[at + d] * P.Y[at + d]
    z = 0.25 * h * (h * K + C) * w
    b = z * z / (1.0 + z * z)
    added = h * h * K * (0.25 + 0.75 * b) + h * C * (0.5 + 0.5 * b)
    bend = h * A.W.sensed[BEND_OF, A.line[k, MEASURED]]
    r = rate_of(A, k, A.wide[V_BEFORE]) - 0.5 * bend
    stretch = A.W.sensed[VALUE, A.line[k, MEASURED]] - A.line_x[k, SHORTEST] - 0.125 * b * h * bend
    force = h * K * (stretch - 0.25 * (1.0 - b) * h * r) + 0.5 * h * C * (1.0 - b) * r
    x[BIAS], x[SOFT], x[LOW], x[HIGH] = 0.5 * bend + force / added, 1.0 / added, -INFINITE, 0.0


@formula
def lines_done(A, P, X):
    """Works of the lines, and the loads of joints with friction for the next step."""
    for i in range(P.size[3]):
        k = abs(A.active[i, LINE_OF]) - 1
        side = 1.0 if A.active[i, LINE_OF] > 0 else -1.0
        work = X.line[i] * side * 0.5 * (rate_of(A, k, A.wide[V_BEFORE]) + rate_of(A, k, A.wide[V_AFTER]))
        if A.line[k, WHAT] == STOP:
            A.real.lost -= work
        else:
            f = A.line[k, OF_FORCE]
            if A.S.forces.work[f] >= 0:
                z = A.S.sizes.coordinates + A.wide.shape[1] + A.S.forces.work[f]
                A.clock.K[0, z] += work / A.real.step
            A.line_x[k, PULLED] = X.line[i] * side / A.real.step
    press(A)


@formula
def press(A):
    """Loads of joints with friction, from the reactions of the step."""
    if A.S.load_terms.load.shape[0] == 0:
        return
    for r in range(A.lam.shape[1]):
        A.W.rows.multiplier[r] = A.lam[0, r] + (A.lam[1, r] + A.lam[2, r]) / A.real.step
    reaction_loads(A.S, A.W)
    for k in range(A.line.shape[0]):
        if A.line[k, WHAT] == FRICTION and A.S.forces.load[A.line[k, OF_FORCE]] >= 0:
            A.line_x[k, PRESSED] = A.W.sensed[RETURNED, A.S.forces.load[A.line[k, OF_FORCE]]]


@formula
def stops_only(A, P, X):
    """For the second solve: stops let pass what they are overrun by, and nothing else acts."""
    A.real.overrun = 0.0
    for i in range(P.size[3]):
        k = abs(A.active[i, LINE_OF]) - 1
        side = 1 if A.active[i, LINE_OF] > 0 else -1
        x = P.line_x[i]
        X.line[i] = 0.0
        x[SOFT] = x[LOW] = x[HIGH] = 0.0
        if A.line[k, WHAT] == STOP:
            mean = 0.5 * (rate_of(A, k, A.wide[V_BEFORE]) + rate_of(A, k, A.wide[V_AFTER]))
            gap = gap_of(A, k, side) + A.real.step * side * mean
            A.real.overrun = min(A.real.overrun, gap)
            x[BIAS], x[HIGH] = gap / A.real.step, INFINITE
