"""The small dense complementarity problem of a few rows, and its active-set method.

u = A x + b, and each row has a rule that relates its impulse x and its velocity u. The same applies to forces and
accelerations. Rules:

    INACTIVE           x = 0
    BILATERAL          u = 0
    UNILATERAL         x >= 0, u >= 0, x u = 0
    FRICTION_LINE      |x| <= reach; u = 0 within, u opposite to x at the bound
    SLIDING            x = -lean reach: slides in a known direction
    FRICTION_DISC      with the row behind it (FRICTION_DISC_2): the same of |(x1, x2)| <= reach

reach = const + gain x is the bound of friction, never less than zero. The bound of a row may depend on the impulses of
others; if these are loads linearised elsewhere, the linear function can become negative. Rows have any units; A's
diagonal gives the scale. Where A is singular, impulses of rows at rest are those with minimum sum of A_ii x_i^2.

The active-set method solves the linear equations of one set of states, finds the rows that violate their rules, and
exchanges states. A's diagonal is scaled to ones and increased by a small softening, which makes impulses unique where
A is singular. States are decided on the softened problem, which has one solution; the values are refined
until the effect of the softening is removed (the proximal point method, Rockafellar 1976).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...compiler.formulas import formula
from ...compiler.struct_layout import Float1, Float2, Float3, Int1
from ...math.scalar import sqrt

INACTIVE, BILATERAL, UNILATERAL, FRICTION_LINE, SLIDING, FRICTION_DISC, FRICTION_DISC_2 = range(7)
# states of rows: no impulse; at rest; at the lower or upper bound; sliding as given by `lean`;
# a pair that slips
NO_IMPULSE, AT_REST, AT_LOW, AT_HIGH, SLIDES_AS_GIVEN, DISC_SLIPS = range(6)
# entries of DenseProblem.info; outcomes
OUTCOME, PASS_COUNT, PIVOT_COUNT = range(3)
SOLUTION_FOUND, NO_SOLUTION, HOLD_IMPOSSIBLE = range(3)  # HOLD_IMPOSSIBLE: rows that must rest cannot
# rows of DenseProblem.row
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


class PivotTableau(NamedTuple):
    """Scratch of Lemke's pivoting."""

    T: Float2  # (m, 2 m + 2): tableau
    basis: Int1  # (m,)
    at: Int1  # (n + 1,): first unknown of each row in the tableau
    Q: Float3  # (2, n, n + 1): x and reach as linear functions of the unknowns


class DenseProblem(NamedTuple):
    """Data, results and scratch of a dense problem."""

    A: Float2  # (n, n)
    b: Float1  # (n,)
    grain: Float1  # (n,): rounding error of b
    rule: Int1  # (n,)
    const: Float1  # (n,)
    gain: Float2  # (n, n)
    bound_sign: Float1  # (n,)
    state: Int1  # (n,): initial guess, and result
    x: Float1  # (n,)
    u: Float1  # (n,)
    reach: Float1  # (n,)
    info: Int1  # (3,)
    N: Float2  # (n, n): A, scaled
    scaled_gain: Float2  # (n, n): gain, scaled
    K: Float2  # (n, n): equations of a set of states; its factor
    swap: Int1  # (n,): row exchanges of its pivoting
    row: Float2  # (10, n)
    pivoting: PivotTableau


def allocate_dense(n: int) -> DenseProblem:
    """Allocate a problem of n inactive rows."""
    m = 4 * n
    z, i = np.zeros, np.int64
    return DenseProblem(
        z((n, n)), z(n), z(n), z(n, i), z(n), z((n, n)), z(n), z(n, i), z(n), z(n), z(n), z(3, i),
        z((n, n)), z((n, n)), z((n, n)), z(n, i), z((10, n)),
        PivotTableau(z((m, 2 * m + 2)), z(m, i), z(n + 1, i), z((2, n, n + 1))),
    )  # fmt: skip


SOFTENING = 1e-9  # added to the scaled diagonal
TERM_ROUNDING = 1e-12  # rounding of a sum, relative to its terms
MAX_REFINEMENTS = 50
SOLVED_TOLERANCE = 1e-15  # residual of a solved row, relative to its terms
SINGULAR_PIVOT = 1e-15  # relative to the largest entry of its column; smaller pivots count as zero


@formula
def scale_problem(P):
    """Scale the problem to ones on the diagonal; writes N, scaled_gain and rows of P.row."""
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
    """Assemble the matrix K of the states and factor it. Returns whether that is possible."""
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
            of_reach = P.bound_sign[i]
        for j in range(n):
            P.K[i, j] = P.N[i, j] if state == AT_REST else of_reach * P.scaled_gain[i, j]
        P.K[i, i] += SOFTENING if state == AT_REST else 1.0
    return factor_equations(P)


@formula
def assemble_slip_equation(P, i):
    """Assemble the equation of a row of a slipping pair: x + d reach + k (u - d d.u) = 0, k = reach / |u|.

    d is the slip direction. The equation is linearised at the current velocities (Newton's method).
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
    """Factor K by LU with partial pivoting, in place."""
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
    """Solve for the impulses of the states: with softening (SOFTENED_IMPULSE) and refined (REFINED_IMPULSE)."""
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
        if done:  # further refinement would only accumulate rounding where A is singular
            break
        substitute(P, r)
        for i in range(n):
            x[i] += r[i]
            if turn == 0:
                P.row[SOFTENED_IMPULSE, i] = x[i]
    return True


@formula
def equation_residual(P, x, i):
    """Residual of the equation of row i."""
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
    return (-reach if state == AT_LOW else -P.bound_sign[i] * reach) - x[i]


@formula
def scaled_velocity(P, x, i):
    """Scaled velocity u of row i."""
    u = P.row[SCALED_BIAS, i]
    for j in range(x.shape[0]):
        u += P.N[i, j] * x[j]
    return u


@formula
def scaled_reach(P, x, i):
    """Scaled friction bound of row i."""
    c = P.row[SCALED_CONST, i]
    for j in range(x.shape[0]):
        c += P.scaled_gain[i, j] * x[j]
    return c


@formula
def term_size(P, x, i):
    """Sum of the absolute terms of row i."""
    size = abs(P.row[SCALED_BIAS, i]) + abs(x[i])
    for j in range(x.shape[0]):
        size += abs(P.N[i, j] * x[j])
    return size


@formula
def row_rounding(P, x, i):
    """Return the rounding error of row i."""
    return TERM_ROUNDING * term_size(P, x, i) + P.grain[i] / P.row[ROW_SCALE, i]


@formula
def required_state(P, x, i):
    """State of row i that its rule requires; unchanged if the rule is fulfilled."""
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
    """As `required_state`, for the pair i, i + 1."""
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
    """Initialise the slip direction of a pair: opposite to the impulse that would keep it at rest."""
    size = sqrt(x[i] * x[i] + x[i + 1] * x[i + 1])
    reach = min(max(scaled_reach(P, x, i), 0.0), size)
    P.row[SLIP_DIRECTION, i], P.row[SLIP_DIRECTION, i + 1] = -x[i] / size, -x[i + 1] / size
    P.row[SLIP_RATIO, i] = reach / (size - reach) if reach < size else 1.0


@formula
def exchange_states(P, which, most):
    """Exchange states of rows that violate their rules until none is left. Returns whether that succeeded.

    All at once while their number decreases, else only the last one, which cannot cycle if A is positive definite and
    friction bounds are constant (Judice and Pires 1994).
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
    """Set the required states of all rows, or of one."""
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
