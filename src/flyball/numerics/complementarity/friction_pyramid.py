"""The linear complementarity problem: a friction pyramid with d edges in place of the cone, by sweeps or by pivoting.

Stewart and Trinkle 1996, Anitescu and Potra 1997: the tangential impulse is a sum of nonnegative impulses in d
directions, together at most mu p_n, with maximum dissipation. Equivalently, a step against the velocity is projected on
a regular d-gon: the sweeps of `pyramid` (Gauss-Seidel).

`lcp` solves small problems exactly: w = M z + q, w >= 0, z >= 0, w . z = 0, by Lemke's method (1965; Cottle, Pang and
Stone 1992, algorithm 4.4.5). Ties are broken lexicographically, so that it cannot cycle. Unknowns z are the normal
impulse, the impulses along the edges and the sliding speed of each contact; of each line the impulse above its lower
bound, and the speed at its upper bound.
"""

from __future__ import annotations

import math

import numpy as np

from ...compiler.formulas import formula
from ...compiler.kernels import kernel
from ...math.scalar import atan2, cos, sin
from .cone_projection import least_normal_impulse
from .contact_operator import (
    apply_contact_impulse,
    apply_line_impulse,
    biased_velocity,
    contact_range,
    contact_velocity,
    diagonal_block,
    finish_solve,
    larger_or_nan,
    line_range,
    line_velocity,
    node_range,
    residuals,
)
from .contact_problem import (
    CONVERGED,
    LIMIT_REACHED,
    SOLVE_FAILED,
    STORAGE_TOO_SMALL,
    ContactProblem,
    ContactSolution,
    ContactWorkspace,
    FactorStorage,
    SolverSettings,
)
from .gauss_seidel import sweep_lines
from .packed_contacts import (
    copy_nodes,
    count_contact_kinds,
    pack_contacts,
)

ALL_FRICTIONAL = 2  # no contact counts as one of spheres


@formula
def project_on_polygon(d, r, x, y):
    """Project (x, y) on the regular polygon with d corners at distance r, the first along x."""
    half = math.pi / d
    side = math.floor(atan2(y, x) / (2.0 * half))  # the corners are at angles 2 half side, 2 half (side + 1)
    middle = (2.0 * side + 1.0) * half
    c, s = cos(middle), sin(middle)
    out, along = c * x + s * y, c * y - s * x
    if out <= r * cos(half):
        return x, y
    most = r * sin(half)
    out, along = r * cos(half), min(max(along, -most), most)
    return c * out - s * along, s * out + c * along


@formula
def pyramid_sliding_friction(d, angle):
    """Sliding friction on a pyramid relative to that on the cone: components against the velocity, and across it.

    Parameters
    ----------
    d : int
        Number of edges of the pyramid.
    angle : float
        Direction of the velocity [rad], from an edge.

    Returns
    -------
    tuple of float
        It acts along the edge nearest to the direction opposite to the velocity; on the cone: (1, 0).
    """
    part = 2.0 * math.pi / d
    off = angle - part * math.floor(angle / part + 0.5)
    return cos(off), -sin(off)


@formula
def update_pyramid(P, X, W, c, at, d):
    """Update one contact: the normal impulse, then the tangential one; returns the largest change of a velocity."""
    k = W.frictional
    u, p = contact_velocity(P, W.node_state, X.wide, c), k.impulse[at, 0]
    n = max(p - (u[0] + k.bias[at, 0] + k.soft[at] * p) * k.inverse_nn[at], k.least[at])
    x = k.impulse[at, 1] - k.sliding_step[at] * (u[1] + k.bias[at, 1] + k.ns[at] * (n - p))
    y = k.impulse[at, 2] - k.sliding_step[at] * (u[2] + k.bias[at, 2] + k.nt[at] * (n - p))
    x, y = project_on_polygon(d, k.mu[at] * n, x, y)
    change = n - p, x - k.impulse[at, 1], y - k.impulse[at, 2]
    k.impulse[at, 0], k.impulse[at, 1], k.impulse[at, 2] = n, x, y
    X.p[c, 0], X.p[c, 1], X.p[c, 2] = n, x, y
    apply_contact_impulse(P, W.node_state, X.wide, c, change)
    moved = abs(change[0]) + abs(change[1]) + abs(change[2])
    return moved / k.inverse_nn[at] if moved > 0.0 else 0.0


@formula
def pyramid_residuals(P, X, W, O, worst):
    """Residuals for `finish_solve`: the residual is the change in the last sweep, the objective is exact."""
    _, _, linear, square = residuals(P, X, O, (W.node_state, X.wide, W.free, W.free_wide))
    first, last = contact_range(P, O)
    most, step = 0.0, 0.0
    for c in range(first, last):
        most = max(most, abs(X.p[c, 0]))
        step = max(step, W.rows[1, c, 0])
    return worst, worst * step / most if most > 0.0 else worst * step, linear, square


@formula
def prepare_pyramids(P, X, W, O):
    """Pack contacts, and apply the initial impulses; returns the number of contacts."""
    first, last = contact_range(P, O)
    copy_nodes(P, X, W, node_range(P, O))
    for k in range(X.wide.shape[0]):
        W.free_wide[k] = X.wide[k]
    pack_contacts(P, X, W, 1, first, count_contact_kinds(P, W, first, last, ALL_FRICTIONAL))
    begin, end = line_range(P, O)
    for k in range(begin, end):
        apply_line_impulse(P, X.wide, k, X.line[k])
    return last - first


@kernel
def pyramid(
    P: ContactProblem, X: ContactSolution, W: ContactWorkspace, O: SolverSettings, F: FactorStorage, task: int
) -> int:
    """Sweep until velocities change by less than O.real.enough, or O.count.most times. Returns sweeps.

    Coulomb's law on a pyramid of O.count.directions edges, at least three; without rolling friction. Otherwise it
    ends with `SOLVE_FAILED` and changes nothing.
    """
    used, O.count.ended = 0, LIMIT_REACHED
    if P.turn.shape[0] > 0 or O.count.directions < 3 or not O.count.coulomb:
        O.count.ended, O.count.used = SOLVE_FAILED, 0
        return 0
    n = prepare_pyramids(P, X, W, O)
    worst = 0.0
    while used < O.count.most:
        turned, worst = used % 2 == 1, 0.0
        for e in range(n):
            s = n - 1 - e if turned else e
            worst = larger_or_nan(worst, update_pyramid(P, X, W, W.contact_nodes[s, 2], s, O.count.directions))
        worst = larger_or_nan(worst, sweep_lines(P, X, O, turned))
        used += 1
        if worst <= O.real.enough:
            O.count.ended = CONVERGED
            break
    O.count.used = used
    finish_solve(P, X, W, O, pyramid_residuals(P, X, W, O, worst))
    return used


# Lemke's pivoting. FactorStorage.numbers: the tableau, n rows with the columns w, z, z0, q; then `FIELDS` numbers for
# each unknown. FactorStorage.places: the basis; then kind and contact or line of each unknown.
MAX_UNKNOWNS = 600  # a solve of this size takes a second
DIRECTION, VALUE, FIELDS = 0, 3, 4  # of an impulse along the contact's frame; result
NORMAL, EDGE, SLIDING_SPEED, LINE, UPPER_BOUND = range(5)  # kinds of unknowns
PIVOT_TOLERANCE = 1e-11  # relative to the largest entry of the column; smaller pivots count as zero
TIE_TOLERANCE = 1e-10  # relative difference of ratios that are equal
CANCELLED = 1e-13  # a difference of two numbers smaller than this part of them is zero: rounding would decide ties
ARTIFICIAL_ROUNDING = 1e-12  # of z0, relative to the largest entry of q: it is zero then, and need not leave
PIVOTS_PER_UNKNOWN = 50  # largest number of pivots; usually there are about as many as unknowns
UNBOUNDED = 1e299  # bounds of lines from here on are infinite
FAILED_RESIDUAL = math.inf


def lcp_storage() -> FactorStorage:
    """Allocate the storage of the largest problem that `lcp` solves."""
    n = MAX_UNKNOWNS
    return FactorStorage(np.zeros(n * (2 * n + 2) + FIELDS * n), np.zeros(3 * n, np.int64))


@formula
def is_finite(x):
    """Whether a bound is finite."""
    return abs(x) < UNBOUNDED


@formula
def movable(P, c):
    """Whether an impulse of contact c changes its velocity."""
    return diagonal_block(P, c)[0] + P.soft[c] > 0.0


@formula
def count_unknowns(P, O):
    """Number of unknowns of the selected contacts and lines."""
    first, last = contact_range(P, O)
    begin, end = line_range(P, O)
    n = 0
    for c in range(first, last):
        if movable(P, c):
            n += 2 + O.count.directions if P.mu[c] > 0.0 else 1
    for k in range(begin, end):
        low, high = P.line_law.lower[k], P.line_law.upper[k]
        if low < high:
            n += 2 if is_finite(low) == is_finite(high) else 1
    return n


@formula
def set_unknown(F, n, i, kind, of, x, y, z):
    """Describe unknown i; returns the number of the next."""
    F.places[n + 2 * i], F.places[n + 2 * i + 1] = kind, of
    at = n * (2 * n + 2) + FIELDS * i
    F.numbers[at], F.numbers[at + 1], F.numbers[at + 2] = x, y, z
    return i + 1


@formula
def describe_unknowns(P, X, O, F, n):
    """Describe all unknowns, and set impulses at their lower bounds as the base of the problem."""
    first, last = contact_range(P, O)
    begin, end = line_range(P, O)
    i, d = 0, O.count.directions
    for c in range(first, last):
        X.p[c, 0], X.p[c, 1], X.p[c, 2] = least_normal_impulse(P, c), 0.0, 0.0
        if movable(P, c):
            i = set_unknown(F, n, i, NORMAL, c, 1.0, 0.0, 0.0)
            for e in range(d if P.mu[c] > 0.0 else 0):
                angle = 2.0 * math.pi * e / d
                i = set_unknown(F, n, i, EDGE, c, 0.0, cos(angle), sin(angle))
            if P.mu[c] > 0.0:
                i = set_unknown(F, n, i, SLIDING_SPEED, c, 0.0, 0.0, 0.0)
    for k in range(begin, end):
        low, high = P.line_law.lower[k], P.line_law.upper[k]
        X.line[k] = low if is_finite(low) else high if is_finite(high) else 0.0
        if low < high:
            if is_finite(low) or not is_finite(high):
                i = set_unknown(F, n, i, LINE, k, 1.0, 0.0, 0.0)
            if not is_finite(low):
                i = set_unknown(F, n, i, LINE, k, -1.0, 0.0, 0.0)
            if is_finite(low) and is_finite(high):
                i = set_unknown(F, n, i, UPPER_BOUND, k, 0.0, 0.0, 0.0)


@formula
def apply_unknown(P, v, wide, F, n, i, size):
    """Change velocities by the impulse of unknown i times ``size``."""
    kind, of, at = F.places[n + 2 * i], F.places[n + 2 * i + 1], n * (2 * n + 2) + FIELDS * i
    if kind == NORMAL or kind == EDGE:
        x, y, z = size * F.numbers[at], size * F.numbers[at + 1], size * F.numbers[at + 2]
        apply_contact_impulse(P, v, wide, of, (x, y, z))
    elif kind == LINE:
        apply_line_impulse(P, wide, of, size * F.numbers[at])


@formula
def velocity_along(P, v, wide, F, n, i):
    """Velocity along the impulse of unknown i; 0 for others."""
    kind, of, at = F.places[n + 2 * i], F.places[n + 2 * i + 1], n * (2 * n + 2) + FIELDS * i
    if kind == NORMAL or kind == EDGE:
        u = contact_velocity(P, v, wide, of)
        return F.numbers[at] * u[0] + F.numbers[at + 1] * u[1] + F.numbers[at + 2] * u[2]
    if kind == LINE:
        return F.numbers[at] * line_velocity(P, wide, of)
    return 0.0


@formula
def compliance(P, F, n, i, j):
    """Velocity along unknown i by the compliance of the impulse of unknown j."""
    kind, of = F.places[n + 2 * i], F.places[n + 2 * i + 1]
    if kind != F.places[n + 2 * j] or of != F.places[n + 2 * j + 1]:
        return 0.0
    at = n * (2 * n + 2)
    if kind == NORMAL:
        return P.soft[of]
    if kind == LINE:
        return P.line_law.soft[of] * F.numbers[at + FIELDS * i] * F.numbers[at + FIELDS * j]
    return 0.0


@formula
def coupling(F, n, mu, i, j):
    """Entry of M outside of the impulses: sliding speeds at edges, bounds of friction, upper bounds of lines."""
    kind, other = F.places[n + 2 * i], F.places[n + 2 * j]
    if F.places[n + 2 * i + 1] != F.places[n + 2 * j + 1]:
        return 0.0
    if (kind == EDGE and other == SLIDING_SPEED) or (kind == LINE and other == UPPER_BOUND):
        return 1.0
    if (kind == SLIDING_SPEED and other == EDGE) or (kind == UPPER_BOUND and other == LINE):
        return -1.0
    return mu[F.places[n + 2 * i + 1]] if kind == SLIDING_SPEED and other == NORMAL else 0.0


@formula
def clear_island(P, W, O):
    """Set the scratch velocities of the selected nodes and of all groups to zero."""
    begin, end = node_range(P, O)
    for e in range(begin, end):
        for s in range(6):
            W.nodes[0, P.member[e], s] = 0.0
    for s in range(W.wide.shape[1]):
        W.wide[0, s] = 0.0


@formula
def fill_tableau(P, X, W, O, F, n):
    """Write w - M z - z0 = q to the tableau; returns the size of M that scales impulses to velocities."""
    width, trace, count = 2 * n + 2, 0.0, 0
    for j in range(n):
        clear_island(P, W, O)
        apply_unknown(P, W.nodes[0], W.wide[0], F, n, j, 1.0)
        for i in range(n):
            F.numbers[i * width + n + j] = velocity_along(P, W.nodes[0], W.wide[0], F, n, i) + compliance(P, F, n, i, j)
        if F.numbers[j * width + n + j] > 0.0:
            trace += F.numbers[j * width + n + j]
            count += 1
    size = trace / count if count > 0 else 1.0
    for i in range(n):
        for j in range(n):
            F.numbers[i * width + j] = 1.0 if i == j else 0.0
            F.numbers[i * width + n + j] = -F.numbers[i * width + n + j] / size - coupling(F, n, P.mu, i, j)
        F.numbers[i * width + 2 * n] = -1.0
        F.numbers[i * width + 2 * n + 1] = right_side(P, X, F, n, i, size)
        F.places[i] = i
    return size


@formula
def right_side(P, X, F, n, i, size):
    """Entry of q: the velocity with all impulses at their lower bounds; the friction and the range that they allow."""
    kind, of, at = F.places[n + 2 * i], F.places[n + 2 * i + 1], n * (2 * n + 2) + FIELDS * i
    if kind == SLIDING_SPEED:
        return size * P.mu[of] * least_normal_impulse(P, of)
    if kind == UPPER_BOUND:
        return size * (P.line_law.upper[of] - P.line_law.lower[of])
    if kind == LINE:
        u = line_velocity(P, X.wide, of) + P.line_law.bias[of] + P.line_law.soft[of] * X.line[of]
        return F.numbers[at] * u
    x, y, z = biased_velocity(P, X, of, contact_velocity(P, X.v, X.wide, of))
    return F.numbers[at] * x + F.numbers[at + 1] * y + F.numbers[at + 2] * z


@formula
def is_less(T, width, n, i, j, a, b):
    """Whether row i over a is lexicographically less than row j over b: q first, then the inverse of the basis."""
    for s in range(n + 1):
        k = 2 * n + 1 if s == 0 else s - 1
        x, y = T[i * width + k] / a, T[j * width + k] / b
        if abs(x - y) > TIE_TOLERANCE * max(abs(x), abs(y)):
            return x < y
    return False


@formula
def leaving_row(F, n, enter):
    """Row that leaves the basis, -1 on a ray; that of z0 where it may."""
    T, width = F.numbers, 2 * n + 2
    largest, best, artificial = 1.0, -1, -1
    for i in range(n):
        largest = max(largest, abs(T[i * width + enter]))
    for i in range(n):
        a = T[i * width + enter]
        if a <= PIVOT_TOLERANCE * largest:
            continue
        if F.places[i] == 2 * n:
            artificial = i
        if best < 0 or is_less(T, width, n, i, best, a, T[best * width + enter]):
            best = i
    if best >= 0 and artificial >= 0 and artificial != best:
        x = T[artificial * width + 2 * n + 1] / T[artificial * width + enter]
        y = T[best * width + 2 * n + 1] / T[best * width + enter]
        if x - y <= TIE_TOLERANCE * abs(x):
            return artificial
    return best


@formula
def pivot(F, n, row, enter):
    """Exchange the basic unknown of a row."""
    T, width = F.numbers, 2 * n + 2
    by = 1.0 / T[row * width + enter]
    for k in range(width):
        T[row * width + k] *= by
    for i in range(n):
        x = T[i * width + enter]
        if i != row and x != 0.0:
            for k in range(width):
                old, change = T[i * width + k], x * T[row * width + k]
                new = old - change
                T[i * width + k] = new if abs(new) > CANCELLED * (abs(old) + abs(change)) else 0.0
    F.places[row] = enter


@formula
def pivot_to_solution(F, n):
    """Pivot until z0 leaves. Returns the number of pivots, negative if there is no solution."""
    T, width = F.numbers, 2 * n + 2
    row, largest = -1, 0.0
    for i in range(n):
        largest = max(largest, abs(T[i * width + 2 * n + 1]))
        if T[i * width + 2 * n + 1] < 0.0 and (row < 0 or is_less(T, width, n, i, row, 1.0, 1.0)):
            row = i
    if row < 0:
        return 0
    enter, used, most, artificial = 2 * n, 0, PIVOTS_PER_UNKNOWN * (n + 1), row
    while row >= 0 and used < most:
        leave = F.places[row]
        pivot(F, n, row, enter)
        used += 1
        if leave == 2 * n or T[artificial * width + 2 * n + 1] <= ARTIFICIAL_ROUNDING * largest:
            return used
        enter = leave + n if leave < n else leave - n  # the complement
        row = leaving_row(F, n, enter)
    return -used - 1


@formula
def write_pivoted(P, X, F, n, size):
    """Write impulses and velocities of the solution in the basis."""
    width, first = 2 * n + 2, n * (2 * n + 2)
    for i in range(n):
        F.numbers[first + FIELDS * i + VALUE] = 0.0
    for r in range(n):
        i = F.places[r] - n
        if 0 <= i < n:
            F.numbers[first + FIELDS * i + VALUE] = max(F.numbers[r * width + width - 1], 0.0)
    for i in range(n):
        kind, of, at = F.places[n + 2 * i], F.places[n + 2 * i + 1], first + FIELDS * i
        p = F.numbers[at + VALUE] / size
        apply_unknown(P, X.v, X.wide, F, n, i, p)
        if kind == NORMAL or kind == EDGE:
            for s in range(3):
                X.p[of, s] += p * F.numbers[at + s]
        elif kind == LINE:
            X.line[of] += p * F.numbers[at]


@formula
def complementarity_error(P, X, F, n, size):
    """Largest |min(w, z)| as a velocity [m/s], and the largest z in the same unit."""
    first, worst, largest = n * (2 * n + 2), 0.0, 0.0
    for i in range(n):
        kind, of, at = F.places[n + 2 * i], F.places[n + 2 * i + 1], first + FIELDS * i
        w = right_side(P, X, F, n, i, size)
        if kind == UPPER_BOUND:
            w = size * (P.line_law.upper[of] - X.line[of])
        elif kind == SLIDING_SPEED:
            w = size * P.mu[of] * X.p[of, 0]
        for j in range(n):
            if kind != UPPER_BOUND and F.places[n + 2 * j] != NORMAL:
                w += coupling(F, n, P.mu, i, j) * F.numbers[first + FIELDS * j + VALUE]
        worst = larger_or_nan(worst, abs(min(w, F.numbers[at + VALUE])))
        largest = max(largest, F.numbers[at + VALUE])
    return worst, largest


@formula
def without_impulses(P, X, O, status):
    """End a solve without impulses."""
    first, last = contact_range(P, O)
    begin, end = line_range(P, O)
    for c in range(first, last):
        X.p[c, 0], X.p[c, 1], X.p[c, 2] = 0.0, 0.0, 0.0
    for k in range(begin, end):
        X.line[k] = 0.0
    O.count.ended, O.count.used = status, 0
    O.real.residual = O.real.force_residual = FAILED_RESIDUAL
    return 0


@kernel
def lcp(
    P: ContactProblem, X: ContactSolution, W: ContactWorkspace, O: SolverSettings, F: FactorStorage, task: int
) -> int:
    """Solve the selected contacts and lines by Lemke's pivoting; returns the number of pivots.

    Coulomb's law on a pyramid of O.count.directions edges, at least three; without rolling friction. Otherwise, and if
    pivoting ends on a ray, it ends with `SOLVE_FAILED`; with more than `MAX_UNKNOWNS` with `STORAGE_TOO_SMALL` and
    their number in O.count.needed_numbers. It then applies no impulses.
    """
    if P.turn.shape[0] > 0 or O.count.directions < 3 or not O.count.coulomb:
        return without_impulses(P, X, O, SOLVE_FAILED)
    n = count_unknowns(P, O)
    if n > MAX_UNKNOWNS or 3 * n > F.places.shape[0] or n * (2 * n + 2 + FIELDS) > F.numbers.shape[0]:
        O.count.needed_numbers = max(O.count.needed_numbers, n)
        return without_impulses(P, X, O, STORAGE_TOO_SMALL)
    begin, end = node_range(P, O)
    describe_unknowns(P, X, O, F, n)
    for e in range(begin, end):  # kept for a solve that fails
        for s in range(6):
            W.nodes[1, P.member[e], s] = X.v[P.member[e], s]
    for s in range(X.wide.shape[0]):
        W.wide[1, s] = X.wide[s]
    first, last = contact_range(P, O)
    for c in range(first, last):
        apply_contact_impulse(P, X.v, X.wide, c, (X.p[c, 0], 0.0, 0.0))
    from_line, to_line = line_range(P, O)
    for k in range(from_line, to_line):
        apply_line_impulse(P, X.wide, k, X.line[k])
    size = fill_tableau(P, X, W, O, F, n)
    used = pivot_to_solution(F, n)
    if used < 0:
        for e in range(begin, end):
            for s in range(6):
                X.v[P.member[e], s] = W.nodes[1, P.member[e], s]
        for s in range(X.wide.shape[0]):
            X.wide[s] = W.wide[1, s]
        return without_impulses(P, X, O, SOLVE_FAILED)
    write_pivoted(P, X, F, n, size)
    worst, largest = complementarity_error(P, X, F, n, size)
    O.count.ended, O.count.used = CONVERGED, used
    O.real.residual, O.real.force_residual = worst, worst / largest if largest > 0.0 else worst
    return used
