"""Accelerated projected gradient descent (APGD): as published, and in the metric of the diagonal blocks.

Nesterov 1983; Mazhar, Heyn, Negrut and Tasora 2015, algorithm 1: theta' = (-theta^2 + theta sqrt(theta^2 + 4))
/ 2, beta = theta (1 - theta) / (theta^2 + theta'); back-tracking while the quadratic bound at y fails; restart
if the gradient, with its constant term, points along the last change. N y is combined from earlier products,
so an iteration takes one product. The result is the iterate with the smallest step, measured as a velocity.
"""

from __future__ import annotations

from ...compiler.formulas import formula
from ...compiler.kernels import kernel
from ...math.scalar import sqrt
from .contact_problem import (
    CONVERGED,
    LIMIT_REACHED,
    ContactProblem,
    ContactSolution,
    ContactWorkspace,
    FactorStorage,
    SolverSettings,
)
from .gradient_steps import apply_operator, apply_vector, begin_iterations, gradient_step, unused_index, write_result

MAX_LIPSCHITZ = 1e30  # largest L; beyond it smaller steps gain nothing


@formula
def accelerated_gradient(P, X, W, O, first, way):
    """Iterate; way: whether the metric is 1, factors by which L grows and shrinks, tolerance factor of the bound."""
    plain, grow, shrink, missed = way
    many = begin_iterations(P, X, W, O, plain)
    L = first if first > 0.0 else initial_lipschitz(P, X, W, O, many)
    cur, prev, new, best = 0, 0, 1, 0
    ucur, uprev, unew = 4, 4, 5
    theta, beta, least, used, O.count.ended = 1.0, 0.0, -1.0, 0, LIMIT_REACHED
    while used < O.count.most:
        used += 1
        ids = cur, prev, ucur, uprev, new
        dd, rise, worst = gradient_step(P, X, W, O, many, ids, (beta, 1.0 / L, O.count.coulomb))
        curved = apply_operator(P, X, W, O, many, ids, unew, beta)[0]
        if curved > L * dd * missed and L < MAX_LIPSCHITZ:
            L = max(grow * L, curved / dd if not plain else 0.0)
            continue
        rate = L * sqrt(worst)
        if least < 0.0 or rate < least:
            best, least = new, rate
        if rate <= O.real.enough:
            O.count.ended = CONVERGED
            break
        after = 0.5 * (-theta * theta + theta * sqrt(theta * theta + 4.0))
        beta = theta * (1.0 - theta) / (theta * theta + after)
        theta = after
        if rise > 0.0:
            theta, beta = 1.0, 0.0
        prev, cur, uprev, ucur = cur, new, ucur, unew
        new, unew = unused_index(cur, prev, best, 0), unused_index(ucur, uprev, 7, 4)
        L *= shrink
    write_result(P, X, W, O, many, best, used)
    return used


@formula
def initial_lipschitz(P, X, W, O, many):
    """L0 = |N (p - 1)| / |p - 1|, as published; over the contacts."""
    n, up, down = many[0] + many[1] + many[2] + many[3] + many[4], 0.0, 0.0
    for s in range(n):
        for k in range(3):
            W.rows[1, s, k] = W.rows[0, s, k] - 1.0
    apply_vector(P, X, W, O, many, 1)
    apply_operator(P, X, W, O, many, (0, 0, 4, 4, 1), 5, 0.0)
    for s in range(n):
        for k in range(3):
            up, down = up + W.rows[5, s, k] * W.rows[5, s, k], down + W.rows[1, s, k] * W.rows[1, s, k]
    return sqrt(up / down) if up > 0.0 else 1.0


@kernel
def apgd(
    P: ContactProblem, X: ContactSolution, W: ContactWorkspace, O: SolverSettings, F: FactorStorage, task: int
) -> int:
    """Iterate until a step changes velocities by less than O.real.enough, or O.count.most times. Returns iterations."""
    return accelerated_gradient(P, X, W, O, -1.0, (True, 2.0, 0.9, 1.0 + 1e-9))


@kernel
def scaled_apgd(
    P: ContactProblem, X: ContactSolution, W: ContactWorkspace, O: SolverSettings, F: FactorStorage, task: int
) -> int:
    """Iterate in the metric of the diagonal blocks; arguments and result as `apgd`.

    L starts at 1, since the metric is that of the blocks. The bound may be violated by a fiftieth, which is rounding
    near the solution.
    """
    return accelerated_gradient(P, X, W, O, 1.0, (False, 1.3, 0.998, 1.02))
