"""Solver of the small dense complementarity problem: exchange of states, then Lemke's pivoting.

Pivoting is used if the exchange of states does not end. Bilateral rows and those that slide in a known direction
are eliminated first. A unilateral row is one unknown, friction is four: its impulse in both directions, its sliding
velocity (Stewart and Trinkle 1996), and the amount by which the linear friction bound is negative. Ties are broken
lexicographically (Cottle, Pang and Stone 1992, section 4.9), so constants within rounding must be set to zero. Along
a chain of bodies constants decrease by many powers of ten, and their rounding would decide which is the
smallest.

The law of slipping friction discs is nonlinear. It is linearised at the current velocities, and the whole problem is
solved again (Newton's method with the other rows' rules retained: Josephy 1979).
"""

from __future__ import annotations

from ...compiler.formulas import formula
from ...compiler.kernels import kernel
from ...math.scalar import exp, log, sqrt
from .dense_problem import (
    AT_HIGH,
    AT_LOW,
    AT_REST,
    BILATERAL,
    DISC_SLIPS,
    FRICTION_DISC,
    FRICTION_DISC_2,
    FRICTION_LINE,
    HOLD_IMPOSSIBLE,
    LAST_LOG_RATIO,
    LAST_MISS,
    NO_IMPULSE,
    NO_SOLUTION,
    OUTCOME,
    PASS_COUNT,
    PIVOT_COUNT,
    REFINED_IMPULSE,
    ROW_SCALE,
    SCALED_BIAS,
    SCALED_CONST,
    SLIDES_AS_GIVEN,
    SLIDING,
    SLIP_DIRECTION,
    SLIP_RATIO,
    SOFTENED_IMPULSE,
    SOFTENING,
    SOLUTION_FOUND,
    UNILATERAL,
    DenseProblem,
    exchange_states,
    row_rounding,
    scale_problem,
    scaled_reach,
    scaled_velocity,
    solve_states,
)

PIVOT_TOLERANCE = 1e-11
TIE_TOLERANCE = 1e-13
CONSTANT_ROUNDING = 1e-14  # relative to the largest constant at the start; smaller constants count as zero
MAX_PIVOTS = 50  # maximum pivots per unknown


@formula
def solve_by_pivoting(P):
    """Find the states by pivoting. Returns whether that succeeded."""
    m = number_unknowns(P)
    if not reduce_problem(P):
        return False
    fill_tableau(P, m)
    if not pivot_to_solution(P, m):
        return False
    read_states(P, m)
    return True


@formula
def number_unknowns(P):
    """Assign numbers to the unknowns, the first of each row in ``at``; returns their count."""
    n, m = P.b.shape[0], 0
    for i in range(n):
        P.pivoting.at[i] = m
        if P.rule[i] == UNILATERAL:
            m += 1
        elif is_friction(P.rule[i]):
            m += 4
    return m


@formula
def reduce_problem(P):
    """Express x and reach of every row by the impulses of unknown rows, in Q: their coefficients, and a constant."""
    n = P.b.shape[0]
    for i in range(n):
        for j in range(n + 1):
            P.pivoting.Q[0, i, j] = P.pivoting.Q[1, i, j] = 0.0
        rule = P.rule[i]
        if rule == BILATERAL:
            for j in range(n):
                P.pivoting.Q[0, i, j] = P.N[i, j]
            P.pivoting.Q[0, i, i] += SOFTENING
            P.pivoting.Q[0, i, n] = P.row[SCALED_BIAS, i]
        elif rule == SLIDING:
            for j in range(n):
                P.pivoting.Q[0, i, j] = P.bound_sign[i] * P.scaled_gain[i, j]
            P.pivoting.Q[0, i, i] += 1.0
            P.pivoting.Q[0, i, n] = P.bound_sign[i] * P.row[SCALED_CONST, i]
    if not eliminate_rows(P):
        return False
    for i in range(n):
        of = i - 1 if P.rule[i] == FRICTION_DISC_2 else i
        for j in range(n + 1):
            P.pivoting.Q[1, i, j] = P.scaled_gain[of, j] if j < n and not is_eliminated(P.rule[j]) else 0.0
        P.pivoting.Q[1, i, n] = P.row[SCALED_CONST, of]
        for k in range(n):
            if is_eliminated(P.rule[k]):
                for j in range(n + 1):
                    P.pivoting.Q[1, i, j] += P.scaled_gain[of, k] * P.pivoting.Q[0, k, j]
    return True


@formula
def is_eliminated(rule):
    """Whether rows of this rule are equations only."""
    return rule == BILATERAL or rule == SLIDING


@formula
def is_friction(rule):
    """Whether rows of this rule are friction; at first a pair counts as two rows, a square in place of its disc."""
    return rule == FRICTION_LINE or rule == FRICTION_DISC or rule == FRICTION_DISC_2


@formula
def eliminate_rows(P):
    """Solve rows of Q[0] with equations for x = (coefficients of the others, constant), by Gauss-Jordan elimination."""
    n = P.b.shape[0]
    for i in range(n):
        P.swap[i] = -1  # unknown for which the equation of row i was solved
    for k in range(n):
        if not is_eliminated(P.rule[k]):
            continue
        best, size = -1, 0.0
        for i in range(n):
            if is_eliminated(P.rule[i]) and P.swap[i] < 0 and abs(P.pivoting.Q[0, i, k]) > size:
                best, size = i, abs(P.pivoting.Q[0, i, k])
        if best < 0:
            return False
        P.swap[best] = k
        d = P.pivoting.Q[0, best, k]
        for j in range(n + 1):
            P.pivoting.Q[0, best, j] /= d
        for i in range(n):
            f = P.pivoting.Q[0, i, k]
            if i != best and is_eliminated(P.rule[i]) and f != 0.0:
                for j in range(n + 1):
                    P.pivoting.Q[0, i, j] -= f * P.pivoting.Q[0, best, j]
    for i in range(n):  # rows sorted by their unknowns, with the sign changed; Q[1] is scratch here
        if P.swap[i] >= 0:
            k = P.swap[i]
            for j in range(n + 1):
                P.pivoting.Q[1, k, j] = 0.0 if j < n and is_eliminated(P.rule[j]) else -P.pivoting.Q[0, i, j]
    for k in range(n):
        for j in range(n + 1):
            P.pivoting.Q[0, k, j] = P.pivoting.Q[1, k, j] if is_eliminated(P.rule[k]) else 0.0
        if P.rule[k] == UNILATERAL or is_friction(P.rule[k]):
            P.pivoting.Q[0, k, k] = 1.0
    return True


@formula
def fill_tableau(P, m):
    """Fill the tableau of w = M z + z0 + q, with columns w, z, z0, q."""
    n = P.b.shape[0]
    T = P.pivoting.T
    for a in range(m):
        P.pivoting.basis[a] = a
        for c in range(2 * m + 2):
            T[a, c] = 0.0
        T[a, a], T[a, 2 * m] = 1.0, -1.0
    for i in range(n):
        rule, a = P.rule[i], P.pivoting.at[i]
        if rule == UNILATERAL:
            add_impulse_terms(P, m, a, i, (1.0, 0.0))
        elif is_friction(rule):
            add_impulse_terms(P, m, a, i, (1.0, 0.0))
            add_impulse_terms(P, m, a + 1, i, (-1.0, 0.0))
            add_impulse_terms(P, m, a + 2, i, (0.0, 1.0))
            T[a, m + a + 2] -= 1.0  # + slip
            T[a + 1, m + a + 2] -= 1.0
            T[a + 2, m + a] += 1.0  # reach - up - down
            T[a + 2, m + a + 1] += 1.0
            add_impulse_terms(P, m, a + 3, i, (0.0, 1.0))
            T[a + 2, m + a + 3] -= 1.0  # + the missing amount, in reach and in its nonnegative part
            T[a + 3, m + a + 3] -= 1.0


@formula
def add_impulse_terms(P, m, a, i, what):
    """Add (u, reach) . what of row i to row a of the tableau."""
    n = P.b.shape[0]
    for j in range(n + 1):
        value = what[1] * P.pivoting.Q[1, i, j]
        if what[0] != 0.0:
            for k in range(n):
                soft = SOFTENING if k == i else 0.0
                value += what[0] * (P.N[i, k] + soft) * P.pivoting.Q[0, k, j]
            if j == n:
                value += what[0] * P.row[SCALED_BIAS, i]
        if j == n:
            P.pivoting.T[a, 2 * m + 1] += value
        elif P.rule[j] == UNILATERAL:
            P.pivoting.T[a, m + P.pivoting.at[j]] -= value
        elif is_friction(P.rule[j]):
            P.pivoting.T[a, m + P.pivoting.at[j]] -= value
            P.pivoting.T[a, m + P.pivoting.at[j] + 1] += value


@formula
def pivot_to_solution(P, m):
    """Pivot until z0 leaves the basis. Returns whether it does."""
    T = P.pivoting.T
    least, most = 0.0, 0.0
    for a in range(m):
        most = max(most, abs(T[a, 2 * m + 1]))
    nothing = CONSTANT_ROUNDING * most
    clear_rounding(P, m, nothing)
    for a in range(m):
        least = min(least, T[a, 2 * m + 1])
    if least >= 0.0:
        return True
    enter = 2 * m
    row = leaving_row(P, m, enter, True)
    for _ in range(MAX_PIVOTS * (m + 1)):
        P.info[PIVOT_COUNT] += 1
        leave = P.pivoting.basis[row]
        pivot_on(P, m, row, enter)
        clear_rounding(P, m, nothing)
        P.pivoting.basis[row] = enter
        if leave == 2 * m:
            return True
        enter = leave + m if leave < m else leave - m
        row = leaving_row(P, m, enter, False)
        if row < 0:
            return False
    return False


@formula
def leaving_row(P, m, enter, start):
    """Row with the lexicographically smallest (q, inverse of the basis) over the entering column; -1: a ray."""
    T = P.pivoting.T
    largest = 1.0
    for a in range(m):
        largest = max(largest, abs(T[a, enter]))
    best = -1
    for a in range(m):
        if not start and not T[a, enter] > PIVOT_TOLERANCE * largest:
            continue
        if best < 0 or stands_before(P, m, (a, best), enter, start):
            best = a
    if best >= 0 and not start:  # z0 leaves if possible
        for a in range(m):
            if P.pivoting.basis[a] == 2 * m and T[a, enter] > PIVOT_TOLERANCE * largest:
                q, p = T[a, 2 * m + 1] / T[a, enter], T[best, 2 * m + 1] / T[best, enter]
                if q <= p + TIE_TOLERANCE * (abs(p) + abs(q)):
                    return a
    return best


@formula
def stands_before(P, m, two, enter, start):
    """Whether the first of two rows is lexicographically smaller."""
    T = P.pivoting.T
    a, b = two
    da = 1.0 if start else T[a, enter]
    db = 1.0 if start else T[b, enter]
    for c in range(-1, m):
        k = 2 * m + 1 if c < 0 else c
        x, y = T[a, k] / da, T[b, k] / db
        if abs(x - y) > TIE_TOLERANCE * (abs(x) + abs(y)):
            return x < y
    return False


@formula
def pivot_on(P, m, row, enter):
    """Make the entering column a unit vector."""
    T = P.pivoting.T
    d = T[row, enter]
    for c in range(2 * m + 2):
        T[row, c] /= d
    for a in range(m):
        f = T[a, enter]
        if a != row and f != 0.0:
            for c in range(2 * m + 2):
                T[a, c] -= f * T[row, c]


@formula
def clear_rounding(P, m, nothing):
    """Set constants within rounding to zero."""
    for a in range(m):
        if abs(P.pivoting.T[a, 2 * m + 1]) <= nothing:
            P.pivoting.T[a, 2 * m + 1] = 0.0


@formula
def unknown_value(P, m, z):
    """Value of an unknown."""
    for a in range(m):
        if P.pivoting.basis[a] == m + z:
            return P.pivoting.T[a, 2 * m + 1]
    return 0.0


@formula
def read_states(P, m):
    """Read the states from the unknowns."""
    for i in range(P.b.shape[0]):
        rule, a = P.rule[i], P.pivoting.at[i]
        if rule == UNILATERAL:
            P.state[i] = AT_REST if unknown_value(P, m, a) > 0.0 else NO_IMPULSE
        elif is_friction(rule):
            if unknown_value(P, m, a + 3) > 0.0:
                P.state[i] = NO_IMPULSE
            elif unknown_value(P, m, a + 2) > 0.0:
                P.state[i] = AT_HIGH if unknown_value(P, m, a) > unknown_value(P, m, a + 1) else AT_LOW
            else:
                P.state[i] = AT_REST
        elif rule == SLIDING:
            P.state[i] = SLIDES_AS_GIVEN
        else:
            P.state[i] = AT_REST if rule == BILATERAL else NO_IMPULSE
    for i in range(P.b.shape[0]):
        if P.rule[i] == FRICTION_DISC and not (P.state[i] == AT_REST and P.state[i + 1] == AT_REST):
            a, b = P.pivoting.at[i], P.pivoting.at[i + 1]
            p, q = (
                unknown_value(P, m, a) - unknown_value(P, m, a + 1),
                unknown_value(P, m, b) - unknown_value(P, m, b + 1),
            )
            size, slip = sqrt(p * p + q * q), unknown_value(P, m, a + 2) + unknown_value(P, m, b + 2)
            P.state[i] = P.state[i + 1] = DISC_SLIPS
            P.row[SLIP_DIRECTION, i], P.row[SLIP_DIRECTION, i + 1] = (
                (-p / size, -q / size) if size > 0.0 else (1.0, 0.0)
            )
            P.row[SLIP_RATIO, i] = size / slip if slip > 0.0 else 1.0


MAX_REST_VELOCITY = 1e-6  # relative to the largest velocity; a row with a larger one cannot rest
DIRECTION_TOLERANCE = 1e-13
MAX_DIRECTION_PASSES = 60  # iterations of slip directions
MAX_SLOW_SLIP_PASSES = 200  # iterations of `solve_slow_slip`
REACH_TOLERANCE = 1e-12  # relative to the friction bound of a pair: converged
MAX_MISS = 1e-6  # relative to the bound, or for its direction: failed; redundancy leaves rounding of 1e-7
MIN_LOG_SLOPE = 1e-6  # smallest slope of the logarithm of the impulse over that of k
MAX_LOG_STEP = 3.0  # largest step of the logarithm of k
REST_RATIO = 1e8  # a pair with a larger k, at unit mass, is at rest


@formula
def admit_states(P):
    """Make the states admissible for the rules."""
    for i in range(P.b.shape[0]):
        rule, state = P.rule[i], P.state[i]
        if rule == BILATERAL or rule == FRICTION_DISC or rule == FRICTION_DISC_2:
            P.state[i] = AT_REST
        elif rule == SLIDING:
            P.state[i] = SLIDES_AS_GIVEN
        elif rule == UNILATERAL:
            P.state[i] = AT_REST if state == AT_REST else NO_IMPULSE
        elif rule == FRICTION_LINE:
            P.state[i] = state if state == AT_LOW or state == AT_HIGH else AT_REST
        else:
            P.state[i] = NO_IMPULSE


@formula
def solve_scaled(P):
    """Solve for states and impulses with the current scaling and slip directions. Returns the outcome."""
    n = P.b.shape[0]
    if not exchange_states(P, SOFTENED_IMPULSE, 10 + 3 * n):
        if not solve_by_pivoting(P):
            return NO_SOLUTION
        exchange_states(P, SOFTENED_IMPULSE, 10 + n)  # removes rounding errors of pivoting
    for i in range(n):
        P.pivoting.at[i] = P.state[i]
    if not exchange_states(P, REFINED_IMPULSE, 10 + n):
        for i in range(n):
            P.state[i] = P.pivoting.at[i]
        if not solve_states(P):
            return NO_SOLUTION
    idle = 0
    for i in range(n):  # a row without impulse that needs none does not rest
        if (
            P.rule[i] == UNILATERAL
            and P.state[i] == AT_REST
            and abs(P.row[REFINED_IMPULSE, i]) <= row_rounding(P, P.row[REFINED_IMPULSE], i)
        ):
            P.state[i] = NO_IMPULSE
            idle += 1
    if idle > 0 and not solve_states(P):  # solve the others alone: if all is rounding, its share is as large as theirs
        return NO_SOLUTION
    for i in range(n):  # friction with zero bound: slides
        if P.rule[i] == FRICTION_LINE and P.state[i] == NO_IMPULSE:
            P.state[i] = AT_LOW if scaled_velocity(P, P.row[REFINED_IMPULSE], i) > 0.0 else AT_HIGH
        elif P.rule[i] == SLIDING:
            P.state[i] = SLIDES_AS_GIVEN
    most = 0.0
    for i in range(n):
        most = max(most, driving_size(P, P.row[REFINED_IMPULSE], i))
    for i in range(n):
        least = MAX_REST_VELOCITY * most + P.grain[i] / P.row[ROW_SCALE, i]
        if P.state[i] == AT_REST and abs(scaled_velocity(P, P.row[REFINED_IMPULSE], i)) > least:
            return HOLD_IMPOSSIBLE
    return SOLUTION_FOUND


@formula
def driving_size(P, x, i):
    """Sum of the absolute terms of row i without impulses of rows at rest, which are wrong if rest is impossible."""
    size = abs(P.row[SCALED_BIAS, i])
    for j in range(x.shape[0]):
        if P.state[j] != AT_REST:
            size += abs(P.N[i, j] * x[j])
    return size


@formula
def update_slip_directions(P):
    """Update the slip directions of pairs from the velocities. Returns the largest change."""
    x, most = P.row[REFINED_IMPULSE], 0.0
    for i in range(P.b.shape[0]):
        if P.rule[i] != FRICTION_DISC or P.state[i] != DISC_SLIPS:
            continue
        u, v = scaled_velocity(P, x, i), scaled_velocity(P, x, i + 1)
        size, reach = sqrt(u * u + v * v), max(scaled_reach(P, x, i), 0.0)
        if not size > row_rounding(P, x, i) + row_rounding(P, x, i + 1):
            continue
        most = max(most, abs(u / size - P.row[SLIP_DIRECTION, i]), abs(v / size - P.row[SLIP_DIRECTION, i + 1]))
        P.row[SLIP_DIRECTION, i], P.row[SLIP_DIRECTION, i + 1], P.row[SLIP_RATIO, i] = u / size, v / size, reach / size
    return most


@formula
def solve_slow_slip(P):
    """Solve with slowly slipping pairs, whose directions Newton's method does not find: x = -k u, |x| = reach.

    |x| grows with k (as in the trust-region subproblem, More and Sorensen 1983), so k is found by the secant method. A
    pair with |x| below its bound for every k is at rest. In that case redundancy leaves its impulse undetermined, and
    only the minimum-norm impulse exceeded the bound.
    """
    most = 0.0
    for i in range(P.b.shape[0]):
        P.row[SLIP_RATIO, i] = 1.0
    for turn in range(MAX_SLOW_SLIP_PASSES):
        for i in range(P.b.shape[0]):
            P.row[SLIP_DIRECTION, i] = 0.0
        P.info[PASS_COUNT] += 1
        P.info[OUTCOME] = solve_scaled(P)
        if P.info[OUTCOME] == NO_SOLUTION:
            return
        most = 0.0
        for i in range(P.b.shape[0]):
            if P.rule[i] == FRICTION_DISC and P.state[i] == DISC_SLIPS:
                most = max(most, update_slip_ratio(P, i, turn))
        if most <= REACH_TOLERANCE:
            break
    if most > MAX_MISS:
        P.info[OUTCOME] = NO_SOLUTION
    for i in range(P.b.shape[0]):
        if P.rule[i] == FRICTION_DISC and P.state[i] == DISC_SLIPS and P.row[SLIP_RATIO, i] >= REST_RATIO:
            P.state[i] = P.state[i + 1] = AT_REST


@formula
def update_slip_ratio(P, i, turn):
    """Update k of the pair i, i + 1. Returns the relative deviation of |x| from the bound."""
    x = P.row[REFINED_IMPULSE]
    size, reach = sqrt(x[i] * x[i] + x[i + 1] * x[i + 1]), scaled_reach(P, x, i)
    if not (size > 0.0 and reach > 0.0):  # no friction
        P.row[SLIP_RATIO, i] *= 0.5
        return 0.0 if size <= row_rounding(P, x, i) + row_rounding(P, x, i + 1) else 1.0
    if size < reach and P.row[SLIP_RATIO, i] >= REST_RATIO:
        return 0.0
    k, miss = log(P.row[SLIP_RATIO, i]), log(size / reach)
    slope = 1.0
    if turn > 0 and k != P.row[LAST_LOG_RATIO, i]:
        slope = (miss - P.row[LAST_MISS, i]) / (k - P.row[LAST_LOG_RATIO, i])
        slope = slope if abs(slope) > MIN_LOG_SLOPE else 1.0
    P.row[LAST_LOG_RATIO, i], P.row[LAST_MISS, i] = k, miss
    P.row[SLIP_RATIO, i] = exp(k - min(max(miss / slope, -MAX_LOG_STEP), MAX_LOG_STEP))
    return abs(miss)


@formula
def write_results(P):
    """Write impulses, velocities and friction bounds in the units of the problem."""
    n = P.b.shape[0]
    x = P.row[REFINED_IMPULSE]
    for i in range(n):
        P.reach[i] = scaled_reach(P, x, i - 1 if P.rule[i] == FRICTION_DISC_2 else i) / P.row[ROW_SCALE, i]
        P.x[i] = x[i] / P.row[ROW_SCALE, i]
    for i in range(n):
        u = P.b[i]
        for j in range(n):
            u += P.A[i, j] * P.x[j]
        P.u[i] = u


@formula
def solve_dense(P):
    """Solve in place; the outcome is in ``P.info``."""
    P.info[PASS_COUNT] = P.info[PIVOT_COUNT] = 0
    scale_problem(P)
    admit_states(P)
    turned = 0.0
    for _ in range(MAX_DIRECTION_PASSES):
        P.info[PASS_COUNT] += 1
        P.info[OUTCOME] = solve_scaled(P)
        turned = update_slip_directions(P) if P.info[OUTCOME] != NO_SOLUTION else 0.0
        if turned <= DIRECTION_TOLERANCE:
            break
    if turned > MAX_MISS:
        solve_slow_slip(P)
    write_results(P)


@kernel
def solve_dense_kernel(P: DenseProblem) -> None:
    """Entry point of `solve_dense` for Python."""
    solve_dense(P)


def solve_dense_problem(P: DenseProblem) -> int:
    """Solve for impulses, velocities and states of all rows in place, starting from the given states.

    Parameters
    ----------
    P : DenseProblem
        See `dense_problem`.

    Returns
    -------
    int
        SOLUTION_FOUND; NO_SOLUTION: no impulses fulfil all rules, or none were found; HOLD_IMPOSSIBLE: rows at rest
        cannot rest.
    """
    solve_dense_kernel(P)
    return int(P.info[OUTCOME])
