"""The small problem solved: states tried first, then pivoting, then values without the softening.

The law of pairs that slip is not linear: it is made so at the velocities now, and all is solved again (Newton's method
where everything else has its own rules: Josephy 1979).
"""

from __future__ import annotations

from ....compiler.formulas import formula
from ....compiler.kernels import kernel
from ....math.scalar import exp, log, sqrt
from .pivots import pivoted
from .problem import (
    BEFORE,
    BIAS,
    DRIVEN,
    ENDED,
    EVEN,
    FIRST,
    FOUND,
    FREE,
    GRIPS,
    HIGH,
    HOLDS,
    KEEN,
    LED,
    LOW,
    MISSED,
    NONE_FOUND,
    NOT_HELD,
    PASSES,
    PIVOTS,
    PUSHES,
    REST,
    SCALE,
    SLIPS,
    TURNS,
    WAY,
    WITH,
    Dense,
)
from .sets import exchanged, reaching, rounding, scaled, solved, velocity

NOT_EVEN = 1e-6  # of the largest velocity that there would be: what holds and is left with more cannot hold
ALIGNED = 1e-13
TRIES = 60  # of the ways of pairs
BRAKED = 200  # the same by the other way
CLOSE = 1e-12  # of what a pair can hold: found
ROUGH = 1e-6  # of what a pair can hold, or of its way: missed; redundancy leaves rounding of 1e-7
FLAT = 1e-6  # least slope of the logarithm of what it carries over that of k
FAR = 3.0  # longest step of the logarithm of k
STUCK = 1e8  # as large a k, of a mass of one, as is at rest


@formula
def admitted(P):
    """States that go with the rules."""
    for i in range(P.b.shape[0]):
        rule, state = P.rule[i], P.state[i]
        if rule == HOLDS or rule == TURNS or rule == WITH:
            P.state[i] = EVEN
        elif rule == DRIVEN:
            P.state[i] = LED
        elif rule == PUSHES:
            P.state[i] = EVEN if state == EVEN else FREE
        elif rule == GRIPS:
            P.state[i] = state if state == LOW or state == HIGH else EVEN
        else:
            P.state[i] = FREE


@formula
def found(P):
    """States and impulses of the problem as it is scaled and turned. Returns how it ended."""
    n = P.b.shape[0]
    if not exchanged(P, FIRST, 10 + 3 * n):
        if not pivoted(P):
            return NONE_FOUND
        exchanged(P, FIRST, 10 + n)  # pivots are as good as rounding lets them be
    for i in range(n):
        P.at[i] = P.state[i]
    if not exchanged(P, REST, 10 + n):
        for i in range(n):
            P.state[i] = P.at[i]
        if not solved(P):
            return NONE_FOUND
    idle = 0
    for i in range(n):  # what carries nothing and need not, does not hold
        if P.rule[i] == PUSHES and P.state[i] == EVEN and abs(P.row[REST, i]) <= rounding(P, P.row[REST], i):
            P.state[i] = FREE
            idle += 1
    if idle > 0 and not solved(P):  # the others by themselves: where all is rounding its share is not less than theirs
        return NONE_FOUND
    for i in range(n):  # friction that can hold nothing: as it slides
        if P.rule[i] == GRIPS and P.state[i] == FREE:
            P.state[i] = LOW if velocity(P, P.row[REST], i) > 0.0 else HIGH
        elif P.rule[i] == DRIVEN:
            P.state[i] = LED
    most = 0.0
    for i in range(n):
        most = max(most, driving(P, P.row[REST], i))
    for i in range(n):
        least = NOT_EVEN * most + P.grain[i] / P.row[SCALE, i]
        if P.state[i] == EVEN and abs(velocity(P, P.row[REST], i)) > least:
            return NOT_HELD
    return FOUND


@formula
def driving(P, x, i):
    """How large the terms of row i are together, without impulses of what holds: where it cannot these say nothing."""
    size = abs(P.row[BIAS, i])
    for j in range(x.shape[0]):
        if P.state[j] != EVEN:
            size += abs(P.N[i, j] * x[j])
    return size


@formula
def slipped(P):
    """The ways of pairs that slip, by their velocities now. Returns by how much they turned at most."""
    x, most = P.row[REST], 0.0
    for i in range(P.b.shape[0]):
        if P.rule[i] != TURNS or P.state[i] != SLIPS:
            continue
        u, v = velocity(P, x, i), velocity(P, x, i + 1)
        size, reach = sqrt(u * u + v * v), max(reaching(P, x, i), 0.0)
        if not size > rounding(P, x, i) + rounding(P, x, i + 1):
            continue
        most = max(most, abs(u / size - P.row[WAY, i]), abs(v / size - P.row[WAY, i + 1]))
        P.row[WAY, i], P.row[WAY, i + 1], P.row[KEEN, i] = u / size, v / size, reach / size
    return most


@formula
def brake(P):
    """Pairs that hardly slip, whose ways Newton's method does not find: x = -k u, with k so that |x| is the reach.

    |x| grows with k (as in the subproblem of a trust region, More and Sorensen 1983), so k is found by secants. What
    carries less with any k is at rest: where redundancy leaves open what it carries, only the least sum of squares
    was more than it can hold.
    """
    most = 0.0
    for i in range(P.b.shape[0]):
        P.row[KEEN, i] = 1.0
    for turn in range(BRAKED):
        for i in range(P.b.shape[0]):
            P.row[WAY, i] = 0.0
        P.info[PASSES] += 1
        P.info[ENDED] = found(P)
        if P.info[ENDED] == NONE_FOUND:
            return
        most = 0.0
        for i in range(P.b.shape[0]):
            if P.rule[i] == TURNS and P.state[i] == SLIPS:
                most = max(most, tightened(P, i, turn))
        if most <= CLOSE:
            break
    if most > ROUGH:
        P.info[ENDED] = NONE_FOUND
    for i in range(P.b.shape[0]):
        if P.rule[i] == TURNS and P.state[i] == SLIPS and P.row[KEEN, i] >= STUCK:
            P.state[i] = P.state[i + 1] = EVEN


@formula
def tightened(P, i, turn):
    """Another k of the pair i, i + 1. Returns by what part its |x| missed the reach."""
    x = P.row[REST]
    size, reach = sqrt(x[i] * x[i] + x[i + 1] * x[i + 1]), reaching(P, x, i)
    if not (size > 0.0 and reach > 0.0):  # nothing holds it
        P.row[KEEN, i] *= 0.5
        return 0.0 if size <= rounding(P, x, i) + rounding(P, x, i + 1) else 1.0
    if size < reach and P.row[KEEN, i] >= STUCK:
        return 0.0
    k, miss = log(P.row[KEEN, i]), log(size / reach)
    slope = 1.0
    if turn > 0 and k != P.row[BEFORE, i]:
        slope = (miss - P.row[MISSED, i]) / (k - P.row[BEFORE, i])
        slope = slope if abs(slope) > FLAT else 1.0
    P.row[BEFORE, i], P.row[MISSED, i] = k, miss
    P.row[KEEN, i] = exp(k - min(max(miss / slope, -FAR), FAR))
    return abs(miss)


@formula
def written(P):
    """Impulses, velocities and reaches in the units of the problem."""
    n = P.b.shape[0]
    x = P.row[REST]
    for i in range(n):
        P.reach[i] = reaching(P, x, i - 1 if P.rule[i] == WITH else i) / P.row[SCALE, i]
        P.x[i] = x[i] / P.row[SCALE, i]
    for i in range(n):
        u = P.b[i]
        for j in range(n):
            u += P.A[i, j] * P.x[j]
        P.u[i] = u


@formula
def settle(P):
    """Solve in place; how it ended stands in ``P.info``."""
    P.info[PASSES] = P.info[PIVOTS] = 0
    scaled(P)
    admitted(P)
    turned = 0.0
    for _ in range(TRIES):
        P.info[PASSES] += 1
        P.info[ENDED] = found(P)
        turned = slipped(P) if P.info[ENDED] != NONE_FOUND else 0.0
        if turned <= ALIGNED:
            break
    if turned > ROUGH:
        brake(P)
    written(P)


@kernel
def settle_kernel(P: Dense) -> None:
    """`settle`, called from Python."""
    settle(P)


def solve(P: Dense) -> int:
    """Impulses, velocities and states of all rows, in place, from the states that stand there.

    Parameters
    ----------
    P : Dense
        The problem; see `problem`.

    Returns
    -------
    int
        FOUND; NONE_FOUND: no impulses fulfil all rules (or none were found); NOT_HELD: rows that hold cannot.
    """
    settle_kernel(P)
    return int(P.info[ENDED])
