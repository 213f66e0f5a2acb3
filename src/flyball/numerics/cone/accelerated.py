"""Accelerated projected gradients: the loop that APGD as published and the lean one share.

Nesterov 1983; Mazhar, Heyn, Negrut and Tasora 2015, algorithm 1: theta' = (-theta^2 + theta sqrt(theta^2 + 4)) / 2,
beta = theta (1 - theta) / (theta^2 + theta'); back-tracking while the quadratic bound at y fails; restart where the
gradient, with its constant term, points along the last change. N y is put together from products already made, so an
iteration takes one product. What is kept of all iterates is the one whose step was the smallest, as a velocity.
"""

from __future__ import annotations

from ...compiler.formulas import formula
from ...math.scalar import sqrt
from .passes import act, backward, forward
from .problem import CONVERGED, CUT
from .start import begin, tell, unused

LARGEST = 1e30  # of L: beyond it nothing is to be gained by smaller steps


@formula
def accelerated(P, X, W, O, first, way):
    """Iterate; way: whether the metric is 1, by what L grows and shrinks, how far the bound may be missed."""
    plain, grow, shrink, missed = way
    many = begin(P, X, W, O, plain)
    L = first if first > 0.0 else start_of(P, X, W, O, many)
    cur, prev, new, best = 0, 0, 1, 0
    ucur, uprev, unew = 4, 4, 5
    theta, beta, least, used, O.count.ended = 1.0, 0.0, -1.0, 0, CUT
    while used < O.count.most:
        used += 1
        ids = cur, prev, ucur, uprev, new
        dd, rise, worst = forward(P, X, W, O, many, ids, (beta, 1.0 / L, O.count.coulomb))
        curved = backward(P, X, W, O, many, ids, unew, beta)[0]
        if curved > L * dd * missed and L < LARGEST:
            L = max(grow * L, curved / dd if not plain else 0.0)
            continue
        rate = L * sqrt(worst)
        if least < 0.0 or rate < least:
            best, least = new, rate
        if O.count.history:
            tell(P, X, W, O, many, best, used, False)
        if rate <= O.real.enough:
            O.count.ended = CONVERGED
            break
        after = 0.5 * (-theta * theta + theta * sqrt(theta * theta + 4.0))
        beta = theta * (1.0 - theta) / (theta * theta + after)
        theta = after
        if rise > 0.0:
            theta, beta = 1.0, 0.0
        prev, cur, uprev, ucur = cur, new, ucur, unew
        new, unew = unused(cur, prev, best, 0), unused(ucur, uprev, 7, 4)
        L *= shrink
    tell(P, X, W, O, many, best, used, True)
    return used


@formula
def start_of(P, X, W, O, many):
    """L0 = |N (p - 1)| / |p - 1|, as published; of contacts."""
    n, up, down = many[0] + many[1] + many[2] + many[3] + many[4], 0.0, 0.0
    for s in range(n):
        for k in range(3):
            W.rows[1, s, k] = W.rows[0, s, k] - 1.0
    act(P, X, W, O, many, 1)
    backward(P, X, W, O, many, (0, 0, 4, 4, 1), 5, 0.0)
    for s in range(n):
        for k in range(3):
            up, down = up + W.rows[5, s, k] * W.rows[5, s, k], down + W.rows[1, s, k] * W.rows[1, s, k]
    return sqrt(up / down) if up > 0.0 else 1.0
