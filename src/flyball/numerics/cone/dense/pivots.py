"""Lemke's pivoting on the small problem, where exchanging states does not end.

Rows that hold and those that are driven are taken out first. What pushes is one unknown, friction is four: its
impulse up and down, how fast it slides (Stewart and Trinkle 1996), and by how much the line of its reach is below zero.
Ties are broken lexicographically (Cottle, Pang and Stone 1992, section 4.9), so that what is rounding has to be zero:
along a chain of bodies constants fall by many powers of ten, and their rounding would decide which is the least.
"""

from __future__ import annotations

from ....compiler.formulas import formula
from ....math.scalar import sqrt
from .problem import (
    BIAS,
    CONST,
    DRIVEN,
    EVEN,
    FREE,
    GRIPS,
    HIGH,
    HOLDS,
    KEEN,
    LED,
    LOW,
    PIVOTS,
    PUSHES,
    SLIPS,
    TURNS,
    WAY,
    WITH,
)
from .sets import SOFT

NO_PIVOT = 1e-11
TIE = 1e-13
ROUNDING = 1e-14  # of the largest constant at the start: what is left of a constant is none
MANY = 50  # pivots for each unknown


@formula
def pivoted(P):
    """States by pivoting. Returns whether there are any."""
    m = unknowns(P)
    if not reduced(P):
        return False
    tableau(P, m)
    if not lemke(P, m):
        return False
    read(P, m)
    return True


@formula
def unknowns(P):
    """How many there are; the first of each row into ``at``; ``at[n]`` is the first slip."""
    n, m = P.b.shape[0], 0
    for i in range(n):
        P.at[i] = m
        if P.rule[i] == PUSHES:
            m += 1
        elif grips(P.rule[i]):
            m += 4
    return m


@formula
def reduced(P):
    """x and reach of every row by the impulses of those that are sought, into Q: columns of these, and a constant."""
    n = P.b.shape[0]
    for i in range(n):
        for j in range(n + 1):
            P.Q[0, i, j] = P.Q[1, i, j] = 0.0
        rule = P.rule[i]
        if rule == HOLDS:
            for j in range(n):
                P.Q[0, i, j] = P.N[i, j]
            P.Q[0, i, i] += SOFT
            P.Q[0, i, n] = P.row[BIAS, i]
        elif rule == DRIVEN:
            for j in range(n):
                P.Q[0, i, j] = P.lean[i] * P.gained[i, j]
            P.Q[0, i, i] += 1.0
            P.Q[0, i, n] = P.lean[i] * P.row[CONST, i]
    if not eliminated(P):
        return False
    for i in range(n):
        of = i - 1 if P.rule[i] == WITH else i
        for j in range(n + 1):
            P.Q[1, i, j] = P.gained[of, j] if j < n and not taken_out(P.rule[j]) else 0.0
        P.Q[1, i, n] = P.row[CONST, of]
        for k in range(n):
            if taken_out(P.rule[k]):
                for j in range(n + 1):
                    P.Q[1, i, j] += P.gained[of, k] * P.Q[0, k, j]
    return True


@formula
def taken_out(rule):
    """Whether rows of this rule have equations alone."""
    return rule == HOLDS or rule == DRIVEN


@formula
def grips(rule):
    """Whether rows of this rule are friction; a pair is taken for two, a square for its circle, to begin with."""
    return rule == GRIPS or rule == TURNS or rule == WITH


@formula
def eliminated(P):
    """Rows of Q[0] with equations become x = (coefficients of the others, constant); Gauss and Jordan."""
    n = P.b.shape[0]
    for i in range(n):
        P.swap[i] = -1  # the unknown that the equation of row i was solved for
    for k in range(n):
        if not taken_out(P.rule[k]):
            continue
        best, size = -1, 0.0
        for i in range(n):
            if taken_out(P.rule[i]) and P.swap[i] < 0 and abs(P.Q[0, i, k]) > size:
                best, size = i, abs(P.Q[0, i, k])
        if best < 0:
            return False
        P.swap[best] = k
        d = P.Q[0, best, k]
        for j in range(n + 1):
            P.Q[0, best, j] /= d
        for i in range(n):
            f = P.Q[0, i, k]
            if i != best and taken_out(P.rule[i]) and f != 0.0:
                for j in range(n + 1):
                    P.Q[0, i, j] -= f * P.Q[0, best, j]
    for i in range(n):  # rows in the order of their unknowns, moved to the other side; Q[1] is scratch here
        if P.swap[i] >= 0:
            k = P.swap[i]
            for j in range(n + 1):
                P.Q[1, k, j] = 0.0 if j < n and taken_out(P.rule[j]) else -P.Q[0, i, j]
    for k in range(n):
        for j in range(n + 1):
            P.Q[0, k, j] = P.Q[1, k, j] if taken_out(P.rule[k]) else 0.0
        if P.rule[k] == PUSHES or grips(P.rule[k]):
            P.Q[0, k, k] = 1.0
    return True


@formula
def tableau(P, m):
    """Columns: w, z, z0, q; of w = M z + z0 + q."""
    n = P.b.shape[0]
    T = P.T
    for a in range(m):
        P.basis[a] = a
        for c in range(2 * m + 2):
            T[a, c] = 0.0
        T[a, a], T[a, 2 * m] = 1.0, -1.0
    for i in range(n):
        rule, a = P.rule[i], P.at[i]
        if rule == PUSHES:
            impulses(P, m, a, i, (1.0, 0.0))
        elif grips(rule):
            impulses(P, m, a, i, (1.0, 0.0))
            impulses(P, m, a + 1, i, (-1.0, 0.0))
            impulses(P, m, a + 2, i, (0.0, 1.0))
            T[a, m + a + 2] -= 1.0  # + slip
            T[a + 1, m + a + 2] -= 1.0
            T[a + 2, m + a] += 1.0  # reach - up - down
            T[a + 2, m + a + 1] += 1.0
            impulses(P, m, a + 3, i, (0.0, 1.0))
            T[a + 2, m + a + 3] -= 1.0  # + what it lacks, in reach and in what is not negative of it
            T[a + 3, m + a + 3] -= 1.0


@formula
def impulses(P, m, a, i, what):
    """Add (u, reach) . what of row i to row a of the tableau."""
    n = P.b.shape[0]
    for j in range(n + 1):
        value = what[1] * P.Q[1, i, j]
        if what[0] != 0.0:
            for k in range(n):
                soft = SOFT if k == i else 0.0
                value += what[0] * (P.N[i, k] + soft) * P.Q[0, k, j]
            if j == n:
                value += what[0] * P.row[BIAS, i]
        if j == n:
            P.T[a, 2 * m + 1] += value
        elif P.rule[j] == PUSHES:
            P.T[a, m + P.at[j]] -= value
        elif grips(P.rule[j]):
            P.T[a, m + P.at[j]] -= value
            P.T[a, m + P.at[j] + 1] += value


@formula
def lemke(P, m):
    """Pivot until z0 is out. Returns whether it came to that."""
    T = P.T
    least, most = 0.0, 0.0
    for a in range(m):
        most = max(most, abs(T[a, 2 * m + 1]))
    nothing = ROUNDING * most
    clear(P, m, nothing)
    for a in range(m):
        least = min(least, T[a, 2 * m + 1])
    if least >= 0.0:
        return True
    enter = 2 * m
    row = leaving(P, m, enter, True)
    for _ in range(MANY * (m + 1)):
        P.info[PIVOTS] += 1
        leave = P.basis[row]
        pivot(P, m, row, enter)
        clear(P, m, nothing)
        P.basis[row] = enter
        if leave == 2 * m:
            return True
        enter = leave + m if leave < m else leave - m
        row = leaving(P, m, enter, False)
        if row < 0:
            return False
    return False


@formula
def leaving(P, m, enter, start):
    """The row of the lexicographically least (q, inverse of the basis) over the column that enters; -1: a ray."""
    T = P.T
    largest = 1.0
    for a in range(m):
        largest = max(largest, abs(T[a, enter]))
    best = -1
    for a in range(m):
        if not start and not T[a, enter] > NO_PIVOT * largest:
            continue
        if best < 0 or before(P, m, (a, best), enter, start):
            best = a
    if best >= 0 and not start:  # z0 leaves where it may
        for a in range(m):
            if P.basis[a] == 2 * m and T[a, enter] > NO_PIVOT * largest:
                q, p = T[a, 2 * m + 1] / T[a, enter], T[best, 2 * m + 1] / T[best, enter]
                if q <= p + TIE * (abs(p) + abs(q)):
                    return a
    return best


@formula
def before(P, m, two, enter, start):
    """Whether the first of two rows stands before the second."""
    T = P.T
    a, b = two
    da = 1.0 if start else T[a, enter]
    db = 1.0 if start else T[b, enter]
    for c in range(-1, m):
        k = 2 * m + 1 if c < 0 else c
        x, y = T[a, k] / da, T[b, k] / db
        if abs(x - y) > TIE * (abs(x) + abs(y)):
            return x < y
    return False


@formula
def pivot(P, m, row, enter):
    """Make the column of what enters a unit vector."""
    T = P.T
    d = T[row, enter]
    for c in range(2 * m + 2):
        T[row, c] /= d
    for a in range(m):
        f = T[a, enter]
        if a != row and f != 0.0:
            for c in range(2 * m + 2):
                T[a, c] -= f * T[row, c]


@formula
def clear(P, m, nothing):
    """Constants that are rounding become zero."""
    for a in range(m):
        if abs(P.T[a, 2 * m + 1]) <= nothing:
            P.T[a, 2 * m + 1] = 0.0


@formula
def among(P, m, z):
    """Value of an unknown."""
    for a in range(m):
        if P.basis[a] == m + z:
            return P.T[a, 2 * m + 1]
    return 0.0


@formula
def read(P, m):
    """States from the unknowns."""
    for i in range(P.b.shape[0]):
        rule, a = P.rule[i], P.at[i]
        if rule == PUSHES:
            P.state[i] = EVEN if among(P, m, a) > 0.0 else FREE
        elif grips(rule):
            if among(P, m, a + 3) > 0.0:
                P.state[i] = FREE
            elif among(P, m, a + 2) > 0.0:
                P.state[i] = HIGH if among(P, m, a) > among(P, m, a + 1) else LOW
            else:
                P.state[i] = EVEN
        elif rule == DRIVEN:
            P.state[i] = LED
        else:
            P.state[i] = EVEN if rule == HOLDS else FREE
    for i in range(P.b.shape[0]):
        if P.rule[i] == TURNS and not (P.state[i] == EVEN and P.state[i + 1] == EVEN):
            a, b = P.at[i], P.at[i + 1]
            p, q = among(P, m, a) - among(P, m, a + 1), among(P, m, b) - among(P, m, b + 1)
            size, slip = sqrt(p * p + q * q), among(P, m, a + 2) + among(P, m, b + 2)
            P.state[i] = P.state[i + 1] = SLIPS
            P.row[WAY, i], P.row[WAY, i + 1] = (-p / size, -q / size) if size > 0.0 else (1.0, 0.0)
            P.row[KEEN, i] = size / slip if slip > 0.0 else 1.0
