"""Projected Gauss-Seidel: contacts one after the other, forward and backward in turn.

Jean and Moreau 1992 (as non-smooth contact dynamics), Tasora and Anitescu 2011 (in the convex form). What a visit does
stands in `sweeps`, how contacts are laid out for it in `pack`. A solve that is cut gives what it has, scaled down
where that would be worse than no impulse at all: p' N p / 2 + b' p is never above 0, so that no energy is made.
"""

from __future__ import annotations

from ...compiler.formulas import formula
from ...compiler.kernels import kernel
from .ending import finish
from .operator import push_line
from .pack import (
    B_P,
    B_T,
    BALL,
    IMPULSE,
    ROUGH,
    S_P,
    SMOOTH,
    SMOOTH_BALL,
    WIDTH_BALL,
    WIDTH_SMOOTH,
    count_kinds,
    pack,
    take_nodes,
)
from .packed import remaining
from .problem import (
    CONVERGED,
    CUT,
    Choices,
    Factor,
    Problem,
    Scratch,
    State,
)
from .residual import contacts_of, lines_of, nodes_of
from .sweeps import visit_ball, visit_rough, visit_smooth, visit_smooth_ball
from .sweeps_any import visit_any, visit_line


@formula
def placed(e, m, turned):
    """The e-th of m visits: from the end in a backward sweep."""
    return m - 1 - e if turned else e


@formula
def sweep_balls(W, O, many, turned):
    """All contacts of balls."""
    worst = 0.0
    for e in range(many[SMOOTH_BALL]):
        s = placed(e, many[SMOOTH_BALL], turned)
        worst = max(worst, visit_smooth_ball(W.pack, W.own, W.sides[s, 0], W.sides[s, 1], WIDTH_BALL * s))
    begin = many[SMOOTH_BALL]
    for e in range(many[BALL]):
        s = begin + placed(e, many[BALL], turned)
        worst = max(worst, visit_ball(W.pack, W.own, W.sides[s, 0], W.sides[s, 1], WIDTH_BALL * s, O.count.coulomb))
    return worst


@formula
def sweep_others(P, X, W, O, many, turned):
    """All other contacts."""
    worst, begin = 0.0, many[SMOOTH_BALL] + many[BALL]
    at = WIDTH_BALL * begin
    for e in range(many[SMOOTH]):
        s = placed(e, many[SMOOTH], turned)
        i, j = W.sides[begin + s, 0], W.sides[begin + s, 1]
        worst = max(worst, visit_smooth(W.pack, W.own, i, j, at + WIDTH_SMOOTH * s))
    begin, at = begin + many[SMOOTH], at + WIDTH_SMOOTH * many[SMOOTH]
    for e in range(many[ROUGH]):
        s = placed(e, many[ROUGH], turned)
        i, j = W.sides[begin + s, 0], W.sides[begin + s, 1]
        worst = max(worst, visit_rough(W.pack, W.own, W.inner, i, j, at + 32 * s, O.count.coulomb))
    begin, at = begin + many[ROUGH], at + 32 * many[ROUGH]
    for e in range(many[4]):
        s = placed(e, many[4], turned)
        worst = max(worst, visit_any(P, X, W, O, W.sides[begin + s, 2], at + 32 * s))
    return worst


@formula
def sweep_lines(P, X, O, turned):
    """All lines."""
    worst = 0.0
    first, last = lines_of(P, O)
    for e in range(last - first):
        worst = max(worst, visit_line(P, X, first + placed(e, last - first, turned)))
    return worst


@formula
def sweep(P, X, W, O, many, turned):
    """Visit everything once; the largest change of a velocity."""
    if turned:
        a = sweep_lines(P, X, O, turned)
        b = sweep_others(P, X, W, O, many, turned)
        return max(max(a, b), sweep_balls(W, O, many, turned))
    a = sweep_balls(W, O, many, turned)
    b = sweep_others(P, X, W, O, many, turned)
    return max(max(a, b), sweep_lines(P, X, O, turned))


@formula
def unpack(P, X, W, many):
    """Impulses back to where they belong."""
    at = 0
    for s in range(many[0] + many[1] + many[2] + many[3] + many[4]):
        c = W.sides[s, 2]
        if s < many[0] + many[1]:
            a, b, d = W.pack[at + B_T], W.pack[at + B_T + 1], W.pack[at + B_T + 2]
            X.p[c, 0] = W.pack[at + B_P]
            if s < many[0]:
                X.p[c, 1], X.p[c, 2] = 0.0, 0.0
            else:
                X.p[c, 1] = P.frame[c, 3] * a + P.frame[c, 4] * b + P.frame[c, 5] * d
                X.p[c, 2] = P.frame[c, 6] * a + P.frame[c, 7] * b + P.frame[c, 8] * d
            at += WIDTH_BALL
        elif s < many[0] + many[1] + many[2]:
            X.p[c, 0], X.p[c, 1], X.p[c, 2] = W.pack[at + S_P], 0.0, 0.0
            at += WIDTH_SMOOTH
        else:
            for k in range(3):
                X.p[c, k] = W.pack[at + IMPULSE + k]
            at += 32


@formula
def prepare(P, X, W, O):
    """Lay everything out, with the impulses that are there acting; how many contacts of each kind."""
    first, last = contacts_of(P, O)
    take_nodes(P, X, W, nodes_of(P, O))
    for k in range(X.wide.shape[0]):
        W.free_wide[k] = X.wide[k]
    many = count_kinds(P, W, first, last, 0)
    pack(P, X, W, O.count.coulomb, first, many)
    begin, end = lines_of(P, O)
    for k in range(begin, end):
        push_line(P, X.wide, k, X.line[k])
    return many


@kernel
def gauss_seidel(P: Problem, X: State, W: Scratch, O: Choices, F: Factor, task: int) -> int:
    """Sweeps until velocities change by less than `ENOUGH`, at most `MOST` of them; how many there were."""
    many = prepare(P, X, W, O)
    used, O.count.ended, O.count.written = 0, CUT, 0
    while used < O.count.most:
        worst = sweep(P, X, W, O, many, used % 2 == 1)
        used += 1
        if O.count.history:
            unpack(P, X, W, many)
            finish(P, X, W, O, remaining(P, X, W, O, many), used, False)
        if worst <= O.real.enough:
            O.count.ended = CONVERGED
            break
    O.count.used = used
    unpack(P, X, W, many)
    finish(P, X, W, O, remaining(P, X, W, O, many), used, True)
    return used
