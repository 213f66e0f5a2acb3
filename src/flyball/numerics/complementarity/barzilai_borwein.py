"""Spectral projected gradient: steps of Barzilai and Borwein 1988 in the metric of diagonal blocks.

The line search requires a value below the largest of the last five objectives, not descent in every iteration
(Grippo, Lampariello and Lucidi 1986; Birgin, Martinez and Raydan 2000); for contacts: Heyn, Anitescu, Tasora
and Negrut 2013. The two step lengths alternate. The result is the iterate with the smallest step, measured as a
velocity.
"""

from __future__ import annotations

from ...compiler.formulas import formula
from ...compiler.kernels import kernel
from ...math.scalar import sqrt
from .contact_operator import line_range
from .contact_problem import (
    CONVERGED,
    LIMIT_REACHED,
    SOLVE_FAILED,
    ContactProblem,
    ContactSolution,
    ContactWorkspace,
    FactorStorage,
    SolverSettings,
)
from .gradient_steps import TORQUE_OFFSET, apply_operator, begin_iterations, gradient_step, unused_index, write_result

SUFFICIENT_DECREASE = 1e-4  # part of the decrease predicted by the slope
MIN_STEP, MAX_STEP = 1e-3, 1e3  # bounds of the step; 1 is that of Gauss-Seidel


@formula
def shorten_step(P, W, O, many, cur, new, part):
    """Shorten the step from cur to new, and the change of N p, to a part."""
    for s in range(many[0] + many[1] + many[2] + many[3] + many[4]):
        for k in range(3):
            W.rows[new, s, k] = W.rows[cur, s, k] + part * (W.rows[new, s, k] - W.rows[cur, s, k])
            W.rows[4 + new, s, k] = W.rows[4 + cur, s, k] + part * (W.rows[4 + new, s, k] - W.rows[4 + cur, s, k])
            if P.turn.shape[0] > 0:
                for a, b in (
                    (TORQUE_OFFSET + cur, TORQUE_OFFSET + new),
                    (TORQUE_OFFSET + 4 + cur, TORQUE_OFFSET + 4 + new),
                ):
                    W.rows[b, s, k] = W.rows[a, s, k] + part * (W.rows[b, s, k] - W.rows[a, s, k])
    first, last = line_range(P, O)
    for k in range(first, last):
        for a, b in ((cur, new), (4 + cur, 4 + new)):
            W.lines[b, k] = W.lines[a, k] + part * (W.lines[b, k] - W.lines[a, k])


@formula
def line_search(f, slope, curved, highest):
    """Longest of 1, 1/2, 1/4 ... at which f + t slope + t^2 curved / 2 is low enough."""
    t = 1.0
    while f + t * slope + 0.5 * t * t * curved > highest + SUFFICIENT_DECREASE * t * slope and t > 1e-10:
        t *= 0.5
    return t


@formula
def spectral_step(dd, curved, square, odd):
    """One of the two step lengths: d' M d / d' N d or d' N d / |N d|^2."""
    up, down = (dd, curved) if odd else (curved, square)
    return min(max(up / down, MIN_STEP), MAX_STEP) if down > 0.0 and up > 0.0 else 1.0


@kernel
def barzilai_borwein(
    P: ContactProblem, X: ContactSolution, W: ContactWorkspace, O: SolverSettings, F: FactorStorage, task: int
) -> int:
    """Iterate until a step changes velocities by less than O.real.enough, or O.count.most times. Returns iterations.

    Only for the convex form: the line search needs an objective, and Coulomb's law has none. With Coulomb's law it ends
    with `SOLVE_FAILED` and changes nothing.
    """
    if O.count.coulomb:
        O.count.ended, O.count.used = SOLVE_FAILED, 0
        return 0
    many = begin_iterations(P, X, W, O, False)
    cur, new, best, used, O.count.ended = 0, 1, 0, 0, LIMIT_REACHED
    size, f, least = 1.0, 0.0, -1.0
    a0, a1, a2, a3 = 0.0, 0.0, 0.0, 0.0
    while used < O.count.most:
        used += 1
        ids = cur, cur, 4 + cur, 4 + cur, new
        dd, slope, worst = gradient_step(P, X, W, O, many, ids, (0.0, size, 0))
        curved, square = apply_operator(P, X, W, O, many, ids, 4 + new, 0.0)
        rate = sqrt(worst) / min(size, 1.0)  # at least that of a step of 1
        t = line_search(f, slope, curved, max(max(f, a0), max(max(a1, a2), a3)))
        if t < 1.0:
            shorten_step(P, W, O, many, cur, new, t)
        a0, a1, a2, a3 = f, a0, a1, a2
        f += t * slope + 0.5 * t * t * curved
        if least < 0.0 or rate < least:
            best, least = cur, rate
        cur, new, size = new, unused_index(new, best, new, 0), spectral_step(dd, curved, square, used % 2 == 1)
        if least <= O.real.enough:
            O.count.ended = CONVERGED
            break
    write_result(P, X, W, O, many, best, used)
    return used
