"""Spectral projected gradient: steps of Barzilai and Borwein 1988 in the metric of diagonal blocks.

The line search asks for less than the largest of the last five objectives, not for descent in every iteration (Grippo,
Lampariello and Lucidi 1986; Birgin, Martinez and Raydan 2000); for contacts: Heyn, Anitescu, Tasora and Negrut 2013.
The two lengths of step are taken in turn. What is kept of all iterates is the one whose step was the smallest, as a
velocity.
"""

from __future__ import annotations

from ...compiler.formulas import formula
from ...compiler.kernels import kernel
from ...math.scalar import sqrt
from .passes import backward, forward
from .problem import (
    BROKEN,
    CONVERGED,
    CUT,
    Choices,
    Factor,
    Problem,
    Scratch,
    State,
)
from .residual import lines_of
from .start import begin, tell, unused
from .steps import TORQUE

ENOUGH_FALL = 1e-4  # of what the slope promises
SHORTEST, LONGEST = 1e-3, 1e3  # of the steps, where 1 is that of Gauss-Seidel


@formula
def shortened(P, W, O, many, cur, new, part):
    """Only a part of the way from cur to new, and of their N p."""
    for s in range(many[0] + many[1] + many[2] + many[3] + many[4]):
        for k in range(3):
            W.rows[new, s, k] = W.rows[cur, s, k] + part * (W.rows[new, s, k] - W.rows[cur, s, k])
            W.rows[4 + new, s, k] = W.rows[4 + cur, s, k] + part * (W.rows[4 + new, s, k] - W.rows[4 + cur, s, k])
            if P.turn.shape[0] > 0:
                for a, b in ((TORQUE + cur, TORQUE + new), (TORQUE + 4 + cur, TORQUE + 4 + new)):
                    W.rows[b, s, k] = W.rows[a, s, k] + part * (W.rows[b, s, k] - W.rows[a, s, k])
    first, last = lines_of(P, O)
    for k in range(first, last):
        for a, b in ((cur, new), (4 + cur, 4 + new)):
            W.lines[b, k] = W.lines[a, k] + part * (W.lines[b, k] - W.lines[a, k])


@formula
def searched(f, slope, curved, highest):
    """The longest of 1, 1/2, 1/4 ... at which f + t slope + t^2 curved / 2 is low enough."""
    t = 1.0
    while f + t * slope + 0.5 * t * t * curved > highest + ENOUGH_FALL * t * slope and t > 1e-10:
        t *= 0.5
    return t


@formula
def next_step(dd, curved, square, odd):
    """One of the two lengths: d' M d / d' N d or d' N d / |N d|^2."""
    up, down = (dd, curved) if odd else (curved, square)
    return min(max(up / down, SHORTEST), LONGEST) if down > 0.0 and up > 0.0 else 1.0


@kernel
def barzilai_borwein(P: Problem, X: State, W: Scratch, O: Choices, F: Factor, task: int) -> int:
    """Iterations until a step would change velocities by less than `ENOUGH`, at most `MOST`; how many there were.

    Of the convex form: the line search needs an objective, and Coulomb's law has none. Asked for it, it ends `BROKEN`
    with everything as it was.
    """
    if O.count.coulomb:
        O.count.ended, O.count.used = BROKEN, 0
        return 0
    many = begin(P, X, W, O, False)
    cur, new, best, used, O.count.ended = 0, 1, 0, 0, CUT
    size, f, least = 1.0, 0.0, -1.0
    a0, a1, a2, a3 = 0.0, 0.0, 0.0, 0.0
    while used < O.count.most:
        used += 1
        ids = cur, cur, 4 + cur, 4 + cur, new
        dd, slope, worst = forward(P, X, W, O, many, ids, (0.0, size, 0))
        curved, square = backward(P, X, W, O, many, ids, 4 + new, 0.0)
        rate = sqrt(worst) / min(size, 1.0)  # not less than that of a step of 1
        t = searched(f, slope, curved, max(max(f, a0), max(max(a1, a2), a3)))
        if t < 1.0:
            shortened(P, W, O, many, cur, new, t)
        a0, a1, a2, a3 = f, a0, a1, a2
        f += t * slope + 0.5 * t * t * curved
        if least < 0.0 or rate < least:
            best, least = cur, rate
        cur, new, size = new, unused(new, best, new, 0), next_step(dd, curved, square, used % 2 == 1)
        if O.count.history:
            tell(P, X, W, O, many, best, used, False)
        if least <= O.real.enough:
            O.count.ended = CONVERGED
            break
    tell(P, X, W, O, many, best, used, True)
    return used
