"""One set of states: its linear equations, and which rows break their rules.

A's diagonal is scaled to ones and softened by a little, which makes what holds unique where A is singular: of all
impulses those with the least sum of squares. States are decided on the softened problem, where the decision has one
answer; values are refined until the softening is out of them (the proximal point method, Rockafellar 1976).
"""

from __future__ import annotations

from ....compiler.formulas import formula
from ....math.scalar import sqrt
from .problem import (
    BIAS,
    CONST,
    DRIVEN,
    EVEN,
    FIRST,
    FREE,
    GRIPS,
    HIGH,
    KEEN,
    LED,
    LOW,
    PUSHES,
    REST,
    SCALE,
    SLIPS,
    STEP,
    TURNS,
    WAY,
    WITH,
)

SOFT = 1e-9  # of the scaled diagonal
NOTHING = 1e-12  # of the terms of a sum: its rounding
REFINED = 50
FINE = 1e-15  # of the terms of a row: solved
SINGULAR = 1e-15  # of the largest entry of its column: no pivot


@formula
def scaled(P):
    """The problem with ones on the diagonal, into N, gained and rows of P."""
    n = P.b.shape[0]
    for i in range(n):
        d = P.A[i, i]
        if P.rule[i] == TURNS:
            d = 0.5 * (d + P.A[i + 1, i + 1])
        elif P.rule[i] == WITH:
            d = 0.5 * (d + P.A[i - 1, i - 1])
        P.row[SCALE, i] = sqrt(d) if d > 0.0 else 1.0
        P.row[WAY, i] = P.row[KEEN, i] = 0.0
    for i in range(n):
        s = P.row[SCALE, i]
        P.row[BIAS, i] = P.b[i] / s
        P.row[CONST, i] = P.const[i] * s
        for j in range(n):
            P.N[i, j] = P.A[i, j] / (s * P.row[SCALE, j])
            P.gained[i, j] = P.gain[i, j] * s / P.row[SCALE, j]


@formula
def equations(P):
    """The matrix K of the states, and its factor by rows. Returns whether it has one."""
    n = P.b.shape[0]
    for i in range(n):
        of_reach, state = 0.0, P.state[i]
        if state == SLIPS:
            slipping(P, i)
            continue
        if state == LOW:
            of_reach = 1.0
        elif state == HIGH:
            of_reach = -1.0
        elif state == LED:
            of_reach = P.lean[i]
        for j in range(n):
            P.K[i, j] = P.N[i, j] if state == EVEN else of_reach * P.gained[i, j]
        P.K[i, i] += SOFT if state == EVEN else 1.0
    return factored(P)


@formula
def slipping(P, i):
    """The equation of a row of a pair that slips: x + d reach + k (u - d d.u) = 0, k = reach / |u| (Newton's method).

    d is the way in which it slips.
    """
    first = i if P.rule[i] == TURNS else i - 1
    d, k = P.row[WAY, i], P.row[KEEN, first]
    for j in range(P.b.shape[0]):
        across = P.N[i, j] - d * (P.row[WAY, first] * P.N[first, j] + P.row[WAY, first + 1] * P.N[first + 1, j])
        P.K[i, j] = d * P.gained[first, j] + k * across
    P.K[i, i] += 1.0


@formula
def factored(P):
    """LU with partial pivoting, in place."""
    n = P.b.shape[0]
    for k in range(n):
        best, size = k, 0.0
        for i in range(k, n):
            if abs(P.K[i, k]) > size:
                best, size = i, abs(P.K[i, k])
        P.swap[k] = best
        if not size > SINGULAR:
            return False
        if best != k:
            for j in range(n):
                P.K[k, j], P.K[best, j] = P.K[best, j], P.K[k, j]
        for i in range(k + 1, n):
            f = P.K[i, k] / P.K[k, k]
            P.K[i, k] = f
            if f != 0.0:
                for j in range(k + 1, n):
                    P.K[i, j] -= f * P.K[k, j]
    return True


@formula
def substituted(P, r):
    """Solve with the factor, in place."""
    n = P.b.shape[0]
    for k in range(n):
        best = P.swap[k]
        if best != k:
            r[k], r[best] = r[best], r[k]
    for i in range(n):
        for j in range(i):
            r[i] -= P.K[i, j] * r[j]
    for i in range(n - 1, -1, -1):
        for j in range(i + 1, n):
            r[i] -= P.K[i, j] * r[j]
        r[i] /= P.K[i, i]


@formula
def solved(P):
    """Impulses of the states: of the softened problem into row FIRST, of the problem itself into row REST."""
    n = P.b.shape[0]
    if not equations(P):
        return False
    x, r = P.row[REST], P.row[STEP]
    for i in range(n):
        x[i] = 0.0
    for turn in range(1 + REFINED):
        done = turn > 0
        for i in range(n):
            r[i] = missing(P, x, i)
            done = done and abs(r[i]) <= FINE * terms(P, x, i)
        if done:  # more would only add up rounding where A is singular
            break
        substituted(P, r)
        for i in range(n):
            x[i] += r[i]
            if turn == 0:
                P.row[FIRST, i] = x[i]
    return True


@formula
def missing(P, x, i):
    """What the equation of row i lacks."""
    state = P.state[i]
    if state == FREE:
        return -x[i]
    if state == EVEN:
        return -velocity(P, x, i)
    if state == SLIPS:
        first = i if P.rule[i] == TURNS else i - 1
        d = P.row[WAY, i]
        along = P.row[WAY, first] * velocity(P, x, first) + P.row[WAY, first + 1] * velocity(P, x, first + 1)
        return -d * reaching(P, x, first) - P.row[KEEN, first] * (velocity(P, x, i) - d * along) - x[i]
    reach = reaching(P, x, i)
    if state == HIGH:
        return reach - x[i]
    return (-reach if state == LOW else -P.lean[i] * reach) - x[i]


@formula
def velocity(P, x, i):
    """U of row i, scaled."""
    u = P.row[BIAS, i]
    for j in range(x.shape[0]):
        u += P.N[i, j] * x[j]
    return u


@formula
def reaching(P, x, i):
    """What row i can hold, scaled."""
    c = P.row[CONST, i]
    for j in range(x.shape[0]):
        c += P.gained[i, j] * x[j]
    return c


@formula
def terms(P, x, i):
    """How large the terms of row i are, together."""
    size = abs(P.row[BIAS, i]) + abs(x[i])
    for j in range(x.shape[0]):
        size += abs(P.N[i, j] * x[j])
    return size


@formula
def rounding(P, x, i):
    """What is nothing beside the terms of row i."""
    return NOTHING * terms(P, x, i) + P.grain[i] / P.row[SCALE, i]


@formula
def better(P, x, i):
    """The state of row i that its rule asks for, where its own breaks it; else its own."""
    state, rule = P.state[i], P.rule[i]
    if rule == PUSHES:
        if state == EVEN:
            return FREE if x[i] < -rounding(P, x, i) else EVEN
        return EVEN if velocity(P, x, i) < -rounding(P, x, i) else FREE
    if rule == TURNS:
        return better_pair(P, x, i)
    if rule == WITH:
        return better_pair(P, x, i - 1)
    if rule == DRIVEN:
        reach, least = reaching(P, x, i), rounding(P, x, i)
        return FREE if reach < -least else LED if reach > least else state
    if rule == GRIPS:
        reach, least = reaching(P, x, i), rounding(P, x, i)
        if state == EVEN:
            if abs(x[i]) > max(reach, 0.0) + least:
                return HIGH if x[i] > 0.0 else LOW
            return EVEN
        if reach < -least:
            return FREE
        if state == FREE:
            return EVEN if reach > least else FREE
        way = 1.0 if state == HIGH else -1.0
        return EVEN if way * velocity(P, x, i) > least else state
    return state


@formula
def better_pair(P, x, i):
    """The same of the pair i, i + 1."""
    if P.state[i] == EVEN:
        size = sqrt(x[i] * x[i] + x[i + 1] * x[i + 1])
        least = rounding(P, x, i) + rounding(P, x, i + 1) + NOTHING * size
        return SLIPS if size > max(reaching(P, x, i), 0.0) + least else EVEN
    along = P.row[WAY, i] * velocity(P, x, i) + P.row[WAY, i + 1] * velocity(P, x, i + 1)
    return EVEN if along < -rounding(P, x, i) - rounding(P, x, i + 1) else SLIPS


@formula
def begin_to_slip(P, x, i):
    """The way in which a pair slips that cannot hold: against what it would have to carry."""
    size = sqrt(x[i] * x[i] + x[i + 1] * x[i + 1])
    reach = min(max(reaching(P, x, i), 0.0), size)
    P.row[WAY, i], P.row[WAY, i + 1] = -x[i] / size, -x[i + 1] / size
    P.row[KEEN, i] = reach / (size - reach) if reach < size else 1.0


@formula
def exchanged(P, which, most):
    """Other states for the rows that break their rules, again and again. Returns whether none is left.

    All at once while that makes them fewer, else the last one alone, which cannot run in circles where A is positive
    definite and reaches are given (Judice and Pires 1994).
    """
    n = P.b.shape[0]
    fewest, patience = n + 1, 3
    for _ in range(most):
        if not solved(P):
            return False
        x = P.row[which]
        count, last = 0, -1
        for i in range(n):
            if better(P, x, i) != P.state[i]:
                count, last = count + 1, i
        if count == 0:
            return True
        if count < fewest:
            fewest, patience = count, 3
        else:
            patience -= 1
        turn_states(P, x, last if patience < 0 else -1)
    return False


@formula
def turn_states(P, x, only):
    """Better states for all rows, or for one."""
    for i in range(P.b.shape[0]):
        alone = i == only or (P.rule[i] == TURNS and i + 1 == only) or (P.rule[i] == WITH and i - 1 == only)
        P.row[STEP, i] = better(P, x, i) if only < 0 or alone else P.state[i]
        if P.rule[i] == TURNS and P.row[STEP, i] == SLIPS and P.state[i] != SLIPS:
            begin_to_slip(P, x, i)
    for i in range(P.b.shape[0]):
        P.state[i] = int(P.row[STEP, i])
