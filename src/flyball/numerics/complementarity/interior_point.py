"""The margin of indeterminate forces within their cones, by an interior-point method.

It is the largest s with q - w s >= |(a, b)| in every cone. q, a, b are affine in the parameters y that redundancy
leaves undetermined. s > 0: there are forces strictly within all bounds; s < 0: there are none; s passes zero at the
instant at which a contact starts to slip or separate. The solver follows the central path of the logarithmic barriers
of second-order cones (Boyd and Vandenberghe, *Convex Optimization*, 2004, sections 11.3 and 11.6); the unknowns are y
and s.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...compiler.formulas import formula
from ...compiler.kernels import kernel
from ...compiler.struct_layout import Float1, Float2, Float3, Int1
from ...math.scalar import sqrt

CONE_COUNT, UNKNOWN_COUNT = range(2)  # entries of ConeProgram.count: cones in use, unknowns
PATH_POINTS = 7  # points of the path: at the last one s is within about 1e-7 of the optimum
PATH_FACTOR = 20.0  # ratio of the barrier parameter between two points of the path
MAX_NEWTON_STEPS = 25  # maximum steps to a point of the path
DECREMENT_TOLERANCE = 1e-3  # Newton decrement at a point
MAX_MARGIN = 1.0  # upper bound of s, and
MAX_LENGTH = 1e3  # upper bound of |y|, relative to the largest number
BACKTRACKING = 0.5
MAX_BACKTRACKS = 40


class ConeProgram(NamedTuple):
    """Cones (cells) and workspace.

    ``D[c, i, 0]`` are q, a, b (i = 0, 1, 2) of cell c at y = 0, ``D[c, i, 1:]`` their derivatives by y.
    """

    count: Int1  # type: ignore[assignment]  # (2,)
    D: Float3  # (cells, 3, 1 + n): each divided by the w of its cell
    y: Float1  # (n + 1,): the optimal y, and s
    now: Float2  # (cells, 3): q - s, a, b there
    slope: Float2  # (2, n + 1)
    step: Float1  # (n + 1,)
    H: Float2  # (n + 1, n + 1)


def allocate_cone_program(cells: int, n: int) -> ConeProgram:
    """Allocate a cone program of this size."""
    z = np.zeros
    return ConeProgram(
        z(2, np.int64), z((cells, 3, 1 + n)), z(n + 1), z((cells, 3)), z((2, n + 1)), z(n + 1), z((n + 1, n + 1))
    )


@formula
def largest_margin(Q):
    """Compute the largest s, in the unit of the cells; the optimum within 1e-7 is in ``Q.y`` and ``Q.now``."""
    m, k = Q.count[CONE_COUNT], Q.count[UNKNOWN_COUNT]
    size = 0.0
    for c in range(m):
        for i in range(3):
            size = max(size, abs(Q.D[c, i, 0]))
    for j in range(k + 1):
        Q.y[j] = 0.0
    if not size > 0.0:
        return 0.0
    least = MAX_MARGIN
    for c in range(m):
        for i in range(3):
            Q.D[c, i, 0] /= size
        least = min(least, Q.D[c, 0, 0] - sqrt(Q.D[c, 1, 0] ** 2 + Q.D[c, 2, 0] ** 2))
    Q.y[k] = least - 1.0
    s = follow_central_path(Q)
    evaluate_cones(Q)
    for c in range(m):
        for i in range(3):
            Q.D[c, i, 0] *= size
            Q.now[c, i] *= size
    for j in range(k + 1):
        Q.y[j] *= size
    return s * size


@formula
def follow_central_path(Q):
    """Follow the central path. Returns s extrapolated to its end: s is linear in 1 / hard to first order."""
    k, hard, before, last = Q.count[UNKNOWN_COUNT], 1.0, 0.0, 0.0
    for stage in range(PATH_POINTS):
        left = 1.0
        for _ in range(MAX_NEWTON_STEPS):
            left = newton_step(Q, hard)
            if left <= DECREMENT_TOLERANCE:
                break
        if stage > 1 and not 0.0 < left <= DECREMENT_TOLERANCE:  # slopes are only rounding
            break
        before, last = last, Q.y[k]
        hard *= PATH_FACTOR
    return last + (last - before) / (PATH_FACTOR - 1.0)


@formula
def evaluate_cones(Q):
    """Evaluate q - s, a, b at y. Returns whether y is within all cones."""
    m, k = Q.count[CONE_COUNT], Q.count[UNKNOWN_COUNT]
    inside = Q.y[k] < MAX_MARGIN
    square = 0.0
    for j in range(k):
        square += Q.y[j] * Q.y[j]
    inside = inside and square < MAX_LENGTH * MAX_LENGTH
    for c in range(m):
        for i in range(3):
            s = Q.D[c, i, 0]
            for j in range(k):
                s += Q.D[c, i, 1 + j] * Q.y[j]
            Q.now[c, i] = s
        Q.now[c, 0] -= Q.y[k]
        q, a, b = Q.now[c, 0], Q.now[c, 1], Q.now[c, 2]
        inside = inside and q > sqrt(a * a + b * b)
    return inside


@formula
def barrier_gradient(Q, hard, row):
    """Write the gradient of -hard s and the barriers at the point evaluated last to a row of ``Q.slope``."""
    m, k = Q.count[CONE_COUNT], Q.count[UNKNOWN_COUNT]
    g = Q.slope[row]
    square = MAX_LENGTH * MAX_LENGTH
    for j in range(k):
        square -= Q.y[j] * Q.y[j]
    for j in range(k):
        g[j] = 2.0 * Q.y[j] / square
    g[k] = 1.0 / (MAX_MARGIN - Q.y[k]) - hard
    for c in range(m):
        q, a, b = Q.now[c, 0], Q.now[c, 1], Q.now[c, 2]
        inverse = 2.0 / cone_value(q, a, b)
        for j in range(k):
            g[j] -= inverse * (q * Q.D[c, 0, 1 + j] - a * Q.D[c, 1, 1 + j] - b * Q.D[c, 2, 1 + j])
        g[k] += inverse * q


@formula
def cone_value(q, a, b):
    """q^2 - a^2 - b^2, without cancellation near the cone."""
    size = sqrt(a * a + b * b)
    return (q - size) * (q + size)


@formula
def barrier_hessian(Q):
    """Write the lower half of the second derivatives to ``Q.H``."""
    m, k = Q.count[CONE_COUNT], Q.count[UNKNOWN_COUNT]
    H = Q.H
    square = MAX_LENGTH * MAX_LENGTH
    for j in range(k):
        square -= Q.y[j] * Q.y[j]
    for i in range(k):
        for j in range(i + 1):
            H[i, j] = 4.0 * Q.y[i] * Q.y[j] / (square * square)
        H[i, i] += 2.0 / square
    for j in range(k):
        H[k, j] = 0.0
    H[k, k] = 1.0 / (MAX_MARGIN - Q.y[k]) ** 2
    for c in range(m):
        q, a, b = Q.now[c, 0], Q.now[c, 1], Q.now[c, 2]
        inverse = 2.0 / cone_value(q, a, b)
        for i in range(k + 1):
            qi, ai, bi = (Q.D[c, 0, 1 + i], Q.D[c, 1, 1 + i], Q.D[c, 2, 1 + i]) if i < k else (-1.0, 0.0, 0.0)
            di = inverse * (q * qi - a * ai - b * bi)
            for j in range(i + 1):
                qj, aj, bj = (Q.D[c, 0, 1 + j], Q.D[c, 1, 1 + j], Q.D[c, 2, 1 + j]) if j < k else (-1.0, 0.0, 0.0)
                H[i, j] += di * inverse * (q * qj - a * aj - b * bj) - inverse * (qi * qj - ai * aj - bi * bj)


@formula
def newton_step(Q, hard):
    """Take one Newton step towards the point of the path. Returns the decrement; 0 if no step makes progress."""
    k = Q.count[UNKNOWN_COUNT]
    evaluate_cones(Q)
    barrier_gradient(Q, hard, 0)
    barrier_hessian(Q)
    if not solve_newton_step(Q):
        return 0.0
    along = 0.0
    for j in range(k + 1):
        along += Q.slope[0, j] * Q.step[j]
    if not along < 0.0:
        return 0.0
    part, last = 1.0, 0.0
    for _ in range(MAX_BACKTRACKS):
        for j in range(k + 1):
            Q.y[j] += (part - last) * Q.step[j]
        last = part
        if evaluate_cones(Q):
            barrier_gradient(Q, hard, 1)
            there = 0.0
            for j in range(k + 1):
                there += Q.slope[1, j] * Q.step[j]
            if there <= -BACKTRACKING * along:
                return sqrt(-along)
        part *= BACKTRACKING
    for j in range(k + 1):
        Q.y[j] -= last * Q.step[j]
    return 0.0


@formula
def solve_newton_step(Q):
    """Compute the step -H^-1 slope by Cholesky factorisation in place. Returns whether that is possible."""
    n = Q.count[UNKNOWN_COUNT] + 1
    H, x = Q.H, Q.step
    for i in range(n):
        for j in range(i + 1):
            s = H[i, j]
            for l in range(j):
                s -= H[i, l] * H[j, l]
            if i == j:
                if not s > 0.0:
                    return False
                H[i, i] = sqrt(s)
            else:
                H[i, j] = s / H[j, j]
    for i in range(n):
        s = -Q.slope[0, i]
        for l in range(i):
            s -= H[i, l] * x[l]
        x[i] = s / H[i, i]
    for i in range(n - 1, -1, -1):
        s = x[i]
        for l in range(i + 1, n):
            s -= H[l, i] * x[l]
        x[i] = s / H[i, i]
    return True


@kernel
def largest_margin_kernel(Q: ConeProgram) -> float:
    """Entry point of `largest_margin` for Python."""
    return largest_margin(Q)
