"""The small dense complementarity problem of a few rows, and its active-set method.

u = A x + b, and each row has a rule that its impulse x and its velocity u fulfil together. The same stands for
accelerations and forces. Rules:

    INACTIVE           x = 0
    BILATERAL          u = 0
    UNILATERAL         x >= 0, u >= 0, x u = 0
    FRICTION_LINE      |x| <= reach; u = 0 within, u against x at the bound
    SLIDING            x = -lean reach: slides in a known direction
    FRICTION_DISC      with the row behind it (FRICTION_DISC_2): the same of |(x1, x2)| <= reach

reach = const + gain x, of friction never less than zero: what a row can hold may depend on what others carry,
and where that is a load linearised elsewhere, the line passes below zero. Rows are of any units; A's diagonal
says what is large. Where A is singular, impulses of rows that hold are those of the least sum of A_ii x_i^2.

The active-set method: the linear equations of one set of states, the rows that violate their rules, exchanges
of states. A's diagonal is scaled to ones and softened by a little, which makes impulses unique where A is
singular. States are decided on the softened problem, where the decision has one answer; values are refined
until the softening is removed (the proximal point method, Rockafellar 1976).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...compiler.formulas import formula
from ...compiler.struct_layout import Float1, Float2, Float3, Int1
from ...math.scalar import sqrt

INACTIVE, BILATERAL, UNILATERAL, FRICTION_LINE, SLIDING, FRICTION_DISC, FRICTION_DISC_2 = range(7)
# states that are found: no impulse; at rest; at one end or the other of what it holds; as DRIVEN says;
# a pair that slips
NO_IMPULSE, AT_REST, AT_LOW, AT_HIGH, SLIDES_AS_GIVEN, DISC_SLIPS = range(6)
# entries of Dense.info; how it ended
OUTCOME, PASS_COUNT, PIVOT_COUNT = range(3)
SOLUTION_FOUND, NO_SOLUTION, HOLD_IMPOSSIBLE = range(3)  # NOT_HELD: rows that must hold cannot
# rows of Dense.row
(
    ROW_SCALE,
    SCALED_BIAS,
    SCALED_CONST,
    SOFTENED_IMPULSE,
    REFINED_IMPULSE,
    CORRECTION,
    SLIP_DIRECTION,
    SLIP_RATIO,
    LAST_LOG_RATIO,
    LAST_MISS,
) = range(10)


class DenseProblem(NamedTuple):
    """What is asked, what is found, and scratch."""

    A: Float2  # (n, n)
    b: Float1  # (n,)
    grain: Float1  # (n,): rounding of b
    rule: Int1  # (n,)
    const: Float1  # (n,)
    gain: Float2  # (n, n)
    lean: Float1  # (n,)
    state: Int1  # (n,): what is tried first, and what is found
    x: Float1  # (n,)
    u: Float1  # (n,)
    reach: Float1  # (n,)
    info: Int1  # (3,)
    N: Float2  # (n, n): A, scaled
    scaled_gain: Float2  # (n, n): the same of the gain
    K: Float2  # (n, n): equations of a set of states; its factor
    swap: Int1  # (n,): order of its pivots
    row: Float2  # (10, n)
    T: Float2  # (m, 2 m + 2): pivoting
    basis: Int1  # (m,)
    at: Int1  # (n + 1,): first unknown of each row in it
    Q: Float3  # (2, n, n + 1): x and reach by what pivoting looks for


def allocate_dense(n: int) -> DenseProblem:
    """Room for n rows, all OUT."""
    m = 4 * n
    z, i = np.zeros, np.int64
    return DenseProblem(
        z((n, n)), z(n), z(n), z(n, i), z(n), z((n, n)), z(n), z(n, i), z(n), z(n), z(n), z(3, i),
        z((n, n)), z((n, n)), z((n, n)), z(n, i), z((10, n)), z((m, 2 * m + 2)), z(m, i), z(n + 1, i), z((2, n, n + 1)),
    )  # fmt: skip


SOFTENING = 1e-9  # of the scaled diagonal
TERM_ROUNDING = 1e-12  # of the terms of a sum: its rounding
MAX_REFINEMENTS = 50
SOLVED_TOLERANCE = 1e-15  # of the terms of a row: solved
SINGULAR_PIVOT = 1e-15  # of the largest entry of its column: no pivot


@formula
def scale_problem(P):
    """The problem with ones on the diagonal, into N, gained and rows of P."""
    n = P.b.shape[0]
    for i in range(n):
        d = P.A[i, i]
        if P.rule[i] == FRICTION_DISC:
            d = 0.5 * (d + P.A[i + 1, i + 1])
        elif P.rule[i] == FRICTION_DISC_2:
            d = 0.5 * (d + P.A[i - 1, i - 1])
        P.row[ROW_SCALE, i] = sqrt(d) if d > 0.0 else 1.0
        P.row[SLIP_DIRECTION, i] = P.row[SLIP_RATIO, i] = 0.0
    for i in range(n):
        s = P.row[ROW_SCALE, i]
        P.row[SCALED_BIAS, i] = P.b[i] / s
        P.row[SCALED_CONST, i] = P.const[i] * s
        for j in range(n):
            P.N[i, j] = P.A[i, j] / (s * P.row[ROW_SCALE, j])
            P.scaled_gain[i, j] = P.gain[i, j] * s / P.row[ROW_SCALE, j]


@formula
def assemble_equations(P):
    """The matrix K of the states, and its factor by rows. Returns whether it has one."""
    n = P.b.shape[0]
    for i in range(n):
        of_reach, state = 0.0, P.state[i]
        if state == DISC_SLIPS:
            assemble_slip_equation(P, i)
            continue
        if state == AT_LOW:
            of_reach = 1.0
        elif state == AT_HIGH:
            of_reach = -1.0
        elif state == SLIDES_AS_GIVEN:
            of_reach = P.lean[i]
        for j in range(n):
            P.K[i, j] = P.N[i, j] if state == AT_REST else of_reach * P.scaled_gain[i, j]
        P.K[i, i] += SOFTENING if state == AT_REST else 1.0
    return factor_equations(P)


@formula
def assemble_slip_equation(P, i):
    """The equation of a row of a pair that slips: x + d reach + k (u - d d.u) = 0, k = reach / |u| (Newton's method).

    d is the way in which it slips.
    """
    first = i if P.rule[i] == FRICTION_DISC else i - 1
    d, k = P.row[SLIP_DIRECTION, i], P.row[SLIP_RATIO, first]
    for j in range(P.b.shape[0]):
        across = P.N[i, j] - d * (
            P.row[SLIP_DIRECTION, first] * P.N[first, j] + P.row[SLIP_DIRECTION, first + 1] * P.N[first + 1, j]
        )
        P.K[i, j] = d * P.scaled_gain[first, j] + k * across
    P.K[i, i] += 1.0


@formula
def factor_equations(P):
    """LU with partial pivoting, in place."""
    n = P.b.shape[0]
    for k in range(n):
        best, size = k, 0.0
        for i in range(k, n):
            if abs(P.K[i, k]) > size:
                best, size = i, abs(P.K[i, k])
        P.swap[k] = best
        if not size > SINGULAR_PIVOT:
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
def substitute(P, r):
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
def solve_states(P):
    """Impulses of the states: of the softened problem into row FIRST, of the problem itself into row REST."""
    n = P.b.shape[0]
    if not assemble_equations(P):
        return False
    x, r = P.row[REFINED_IMPULSE], P.row[CORRECTION]
    for i in range(n):
        x[i] = 0.0
    for turn in range(1 + MAX_REFINEMENTS):
        done = turn > 0
        for i in range(n):
            r[i] = equation_residual(P, x, i)
            done = done and abs(r[i]) <= SOLVED_TOLERANCE * term_size(P, x, i)
        if done:  # more would only add up rounding where A is singular
            break
        substitute(P, r)
        for i in range(n):
            x[i] += r[i]
            if turn == 0:
                P.row[SOFTENED_IMPULSE, i] = x[i]
    return True


@formula
def equation_residual(P, x, i):
    """What the equation of row i lacks."""
    state = P.state[i]
    if state == NO_IMPULSE:
        return -x[i]
    if state == AT_REST:
        return -scaled_velocity(P, x, i)
    if state == DISC_SLIPS:
        first = i if P.rule[i] == FRICTION_DISC else i - 1
        d = P.row[SLIP_DIRECTION, i]
        along = P.row[SLIP_DIRECTION, first] * scaled_velocity(P, x, first) + P.row[
            SLIP_DIRECTION, first + 1
        ] * scaled_velocity(P, x, first + 1)
        return -d * scaled_reach(P, x, first) - P.row[SLIP_RATIO, first] * (scaled_velocity(P, x, i) - d * along) - x[i]
    reach = scaled_reach(P, x, i)
    if state == AT_HIGH:
        return reach - x[i]
    return (-reach if state == AT_LOW else -P.lean[i] * reach) - x[i]


@formula
def scaled_velocity(P, x, i):
    """U of row i, scaled."""
    u = P.row[SCALED_BIAS, i]
    for j in range(x.shape[0]):
        u += P.N[i, j] * x[j]
    return u


@formula
def scaled_reach(P, x, i):
    """What row i can hold, scaled."""
    c = P.row[SCALED_CONST, i]
    for j in range(x.shape[0]):
        c += P.scaled_gain[i, j] * x[j]
    return c


@formula
def term_size(P, x, i):
    """How large the terms of row i are, together."""
    size = abs(P.row[SCALED_BIAS, i]) + abs(x[i])
    for j in range(x.shape[0]):
        size += abs(P.N[i, j] * x[j])
    return size


@formula
def row_rounding(P, x, i):
    """What is nothing beside the terms of row i."""
    return TERM_ROUNDING * term_size(P, x, i) + P.grain[i] / P.row[ROW_SCALE, i]


@formula
def required_state(P, x, i):
    """The state of row i that its rule asks for, where its own breaks it; else its own."""
    state, rule = P.state[i], P.rule[i]
    if rule == UNILATERAL:
        if state == AT_REST:
            return NO_IMPULSE if x[i] < -row_rounding(P, x, i) else AT_REST
        return AT_REST if scaled_velocity(P, x, i) < -row_rounding(P, x, i) else NO_IMPULSE
    if rule == FRICTION_DISC:
        return required_disc_state(P, x, i)
    if rule == FRICTION_DISC_2:
        return required_disc_state(P, x, i - 1)
    if rule == SLIDING:
        reach, least = scaled_reach(P, x, i), row_rounding(P, x, i)
        return NO_IMPULSE if reach < -least else SLIDES_AS_GIVEN if reach > least else state
    if rule == FRICTION_LINE:
        reach, least = scaled_reach(P, x, i), row_rounding(P, x, i)
        if state == AT_REST:
            if abs(x[i]) > max(reach, 0.0) + least:
                return AT_HIGH if x[i] > 0.0 else AT_LOW
            return AT_REST
        if reach < -least:
            return NO_IMPULSE
        if state == NO_IMPULSE:
            return AT_REST if reach > least else NO_IMPULSE
        way = 1.0 if state == AT_HIGH else -1.0
        return AT_REST if way * scaled_velocity(P, x, i) > least else state
    return state


@formula
def required_disc_state(P, x, i):
    """The same of the pair i, i + 1."""
    if P.state[i] == AT_REST:
        size = sqrt(x[i] * x[i] + x[i + 1] * x[i + 1])
        least = row_rounding(P, x, i) + row_rounding(P, x, i + 1) + TERM_ROUNDING * size
        return DISC_SLIPS if size > max(scaled_reach(P, x, i), 0.0) + least else AT_REST
    along = P.row[SLIP_DIRECTION, i] * scaled_velocity(P, x, i) + P.row[SLIP_DIRECTION, i + 1] * scaled_velocity(
        P, x, i + 1
    )
    return AT_REST if along < -row_rounding(P, x, i) - row_rounding(P, x, i + 1) else DISC_SLIPS


@formula
def start_slip(P, x, i):
    """The way in which a pair slips that cannot hold: against what it would have to carry."""
    size = sqrt(x[i] * x[i] + x[i + 1] * x[i + 1])
    reach = min(max(scaled_reach(P, x, i), 0.0), size)
    P.row[SLIP_DIRECTION, i], P.row[SLIP_DIRECTION, i + 1] = -x[i] / size, -x[i + 1] / size
    P.row[SLIP_RATIO, i] = reach / (size - reach) if reach < size else 1.0


@formula
def exchange_states(P, which, most):
    """Other states for the rows that break their rules, again and again. Returns whether none is left.

    All at once while that makes them fewer, else the last one alone, which cannot run in circles where A is positive
    definite and reaches are given (Judice and Pires 1994).
    """
    n = P.b.shape[0]
    fewest, patience = n + 1, 3
    for _ in range(most):
        if not solve_states(P):
            return False
        x = P.row[which]
        count, last = 0, -1
        for i in range(n):
            if required_state(P, x, i) != P.state[i]:
                count, last = count + 1, i
        if count == 0:
            return True
        if count < fewest:
            fewest, patience = count, 3
        else:
            patience -= 1
        change_states(P, x, last if patience < 0 else -1)
    return False


@formula
def change_states(P, x, only):
    """Better states for all rows, or for one."""
    for i in range(P.b.shape[0]):
        alone = (
            i == only
            or (P.rule[i] == FRICTION_DISC and i + 1 == only)
            or (P.rule[i] == FRICTION_DISC_2 and i - 1 == only)
        )
        P.row[CORRECTION, i] = required_state(P, x, i) if only < 0 or alone else P.state[i]
        if P.rule[i] == FRICTION_DISC and P.row[CORRECTION, i] == DISC_SLIPS and P.state[i] != DISC_SLIPS:
            start_slip(P, x, i)
    for i in range(P.b.shape[0]):
        P.state[i] = int(P.row[CORRECTION, i])
