"""Projected Jacobi with mass splitting: all contacts at once, each against its own part of the bodies.

A body of n contacts is taken as n bodies of an n-th of its mass (Tonge, Benevolenski and Voroshilov 2012): a step of
diagonal block / n is then safe, whatever the problem, and the objective falls in every iteration. Slow, and the only
one here that needs no order of contacts.
"""

from __future__ import annotations

from ...compiler.formulas import formula
from ...compiler.kernels import kernel
from ...math.scalar import sqrt
from .pack import B_IN, B_IT, BALL, IN, SLIDE
from .passes import backward, forward
from .problem import (
    CONVERGED,
    CUT,
    NONE,
    Choices,
    Factor,
    Problem,
    Scratch,
    State,
)
from .residual import contacts_of, lines_of
from .start import begin, place_of, tell
from .steps import METRIC, STEPS


@formula
def count_contacts(P, W, O):
    """How many contacts, and lines, each node and group has: in W.nodes[0, i, 0] and at W.wide[0, first of group]."""
    first, last = contacts_of(P, O)
    start, end = lines_of(P, O)
    for again in range(2):  # first zero, then count
        for c in range(first, last):
            for side in range(2):
                i = P.at[c, side]
                if i >= 0:
                    W.nodes[0, i, 0] = W.nodes[0, i, 0] + 1.0 if again else 0.0
                elif i < NONE:
                    W.wide[0, P.group[-2 - i]] = W.wide[0, P.group[-2 - i]] + 1.0 if again else 0.0
        for k in range(start, end):
            g = P.group[P.line_at[k, 0]]
            W.wide[0, g] = W.wide[0, g] + 1.0 if again else 0.0


@formula
def shared_by(P, W, c):
    """Most contacts of a side of contact c."""
    n = 1.0
    for side in range(2):
        i = P.at[c, side]
        if i >= 0:
            n = max(n, W.nodes[0, i, 0])
        elif i < NONE:
            n = max(n, W.wide[0, P.group[-2 - i]])
    return n


@formula
def split(P, W, O, many):
    """Shorten the steps of all contacts and lines."""
    count_contacts(P, W, O)
    for s in range(many[0] + many[1] + many[2] + many[3] + many[4]):
        at, n = place_of(many, s), shared_by(P, W, W.sides[s, 2])
        if s < many[BALL]:
            W.pack[at + B_IN] /= n
            W.pack[at + B_IT] /= n
        else:
            W.pack[at + IN] /= n
            W.pack[at + SLIDE] /= n
        if P.turn.shape[0] > 0:
            W.rows[STEPS, s, 0] /= n
            W.rows[STEPS, s, 1] /= n
    first, last = lines_of(P, O)
    for k in range(first, last):
        W.lines[METRIC, k] *= W.wide[0, P.group[P.line_at[k, 0]]]


@kernel
def jacobi(P: Problem, X: State, W: Scratch, O: Choices, F: Factor, task: int) -> int:
    """Iterations until a step changes velocities by less than `ENOUGH`, at most `MOST`; how many there were."""
    many = begin(P, X, W, O, False)
    split(P, W, O, many)
    cur, new, used, O.count.ended = 0, 1, 0, CUT
    while used < O.count.most:
        used += 1
        ids = cur, cur, 4 + cur, 4 + cur, new
        _, _, worst = forward(P, X, W, O, many, ids, (0.0, 1.0, O.count.coulomb))
        backward(P, X, W, O, many, ids, 4 + new, 0.0)
        cur, new = new, cur
        if O.count.history:
            tell(P, X, W, O, many, cur, used, False)
        if sqrt(worst) <= O.real.enough:
            O.count.ended = CONVERGED
            break
    tell(P, X, W, O, many, cur, used, True)
    return used
