"""Projected Jacobi with mass splitting: all contacts at once, each against its own part of the bodies.

A body with n contacts is treated as n bodies of an n-th of its mass (Tonge, Benevolenski and Voroshilov 2012). A
step of diagonal block / n is then safe for every problem, and the objective decreases in every iteration. It
converges slowly, and is the only solver here whose result does not depend on the order of contacts.
"""

from __future__ import annotations

from ...compiler.formulas import formula
from ...compiler.kernels import kernel
from ...math.scalar import sqrt
from .contact_operator import contact_range, line_range
from .contact_problem import (
    CONVERGED,
    FIXED_SIDE,
    LIMIT_REACHED,
    ContactProblem,
    ContactSolution,
    ContactWorkspace,
    FactorStorage,
    SolverSettings,
)
from .gradient_steps import (
    LINE_METRIC,
    ROLLING_STEPS,
    apply_operator,
    begin_iterations,
    gradient_step,
    write_result,
)
from .packed_contacts import SPHERE


@formula
def count_contacts(P, W, O):
    """Count contacts and lines of each node (in W.nodes[0, i, 0]) and group (at W.wide[0, first of group])."""
    first, last = contact_range(P, O)
    start, end = line_range(P, O)
    for again in range(2):  # first zero, then count
        for c in range(first, last):
            for side in range(2):
                i = P.at[c, side]
                if i >= 0:
                    W.nodes[0, i, 0] = W.nodes[0, i, 0] + 1.0 if again else 0.0
                elif i < FIXED_SIDE:
                    W.wide[0, P.group[-2 - i]] = W.wide[0, P.group[-2 - i]] + 1.0 if again else 0.0
        for k in range(start, end):
            g = P.group[P.line_at[k, 0]]
            W.wide[0, g] = W.wide[0, g] + 1.0 if again else 0.0


@formula
def most_contacts_of_side(P, W, c):
    """Larger contact count of the two sides of contact c."""
    n = 1.0
    for side in range(2):
        i = P.at[c, side]
        if i >= 0:
            n = max(n, W.nodes[0, i, 0])
        elif i < FIXED_SIDE:
            n = max(n, W.wide[0, P.group[-2 - i]])
    return n


@formula
def split_masses(P, W, O, many):
    """Shorten the steps of all contacts and lines by the counts."""
    count_contacts(P, W, O)
    for s in range(many[0] + many[1] + many[2] + many[3] + many[4]):
        n = most_contacts_of_side(P, W, W.contact_nodes[s, 2])
        if s < many[SPHERE]:
            W.spheres.inverse_normal[s] /= n
            W.spheres.inverse_tangential[s] /= n
        else:
            W.frictional.inverse_nn[s] /= n
            W.frictional.sliding_step[s] /= n
        if P.turn.shape[0] > 0:
            W.rows[ROLLING_STEPS, s, 0] /= n
            W.rows[ROLLING_STEPS, s, 1] /= n
    first, last = line_range(P, O)
    for k in range(first, last):
        W.lines[LINE_METRIC, k] *= W.wide[0, P.group[P.line_at[k, 0]]]


@kernel
def jacobi(
    P: ContactProblem, X: ContactSolution, W: ContactWorkspace, O: SolverSettings, F: FactorStorage, task: int
) -> int:
    """Iterate until velocities change by less than O.real.enough, or O.count.most times. Returns iterations."""
    many = begin_iterations(P, X, W, O, False)
    split_masses(P, W, O, many)
    cur, new, used, O.count.ended = 0, 1, 0, LIMIT_REACHED
    while used < O.count.most:
        used += 1
        ids = cur, cur, 4 + cur, 4 + cur, new
        _, _, worst = gradient_step(P, X, W, O, many, ids, (0.0, 1.0, O.count.coulomb))
        apply_operator(P, X, W, O, many, ids, 4 + new, 0.0)
        cur, new = new, cur
        if sqrt(worst) <= O.real.enough:
            O.count.ended = CONVERGED
            break
    write_result(P, X, W, O, many, cur, used)
    return used
