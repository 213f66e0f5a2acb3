"""Before and after the iterations of first-order solvers: contacts laid out, the warm start; the answer."""

from __future__ import annotations

from ...compiler.formulas import formula
from .diagonal import diagonal_turning
from .ending import finish
from .operator import diagonal_of_line, push, push_line, push_turning, seen, seen_line, seen_turning
from .pack import (
    B_BIAS,
    B_IN,
    B_IT,
    B_P,
    B_RATIO,
    B_T,
    BALL,
    BIAS,
    IMPULSE,
    IN,
    RATIO,
    ROUGH,
    SLIDE,
    WIDTH_BALL,
    count_kinds,
    local_steps,
    pack,
    take_nodes,
)
from .passes import backward
from .problem import BIAS as LINE_BIAS
from .residual import contacts_of, lines_of, nodes_of, residuals
from .steps import METRIC, STEPS, TORQUE, B, write
from .sweeps import rough_velocity, sliding


@formula
def place_of(many, s):
    """Where the numbers of visit s begin."""
    return WIDTH_BALL * s if s < many[BALL] else WIDTH_BALL * many[BALL] + 32 * (s - many[BALL])


@formula
def begin(P, X, W, O, plain):
    """Lay contacts out; impulses in vector 0, N p in vector 4, b in its own; how many contacts there are of each kind.

    The metric is 1 if ``plain``.
    """
    first, last = contacts_of(P, O)
    take_nodes(P, X, W, nodes_of(P, O))
    for k in range(X.wide.shape[0]):
        W.free_wide[k] = X.wide[k]
    many = count_kinds(P, W, first, last, 1)
    pack(P, X, W, 0, first, many)
    for s in range(last - first):
        load(P, X, W, many, s)
        if P.turn.shape[0] > 0:
            steps = local_steps(diagonal_turning(P, W.sides[s, 2]), 0.0, 0)
            W.rows[STEPS, s, 0], W.rows[STEPS, s, 1] = (1.0, 1.0) if plain else (steps[0], steps[6])
        if plain:
            at = place_of(many, s)
            if s < many[BALL]:
                W.pack[at + B_IN], W.pack[at + B_IT], W.pack[at + B_RATIO] = 1.0, 1.0, 1.0
            elif W.pack[at + IN] > 0.0:  # else nothing moves
                W.pack[at + IN], W.pack[at + SLIDE], W.pack[at + RATIO] = 1.0, 1.0, 1.0
    start, end = lines_of(P, O)
    for k in range(start, end):
        W.lines[0, k] = X.line[k]
        W.lines[B, k] = seen_line(P, W.free_wide, k) + P.line_x[k, LINE_BIAS]
        W.lines[METRIC, k] = 1.0 if plain else diagonal_of_line(P, k)
        push_line(P, X.wide, k, X.line[k])
    subtract(P, X, W, O)
    backward(P, X, W, O, many, (0, 0, 0, 0, 0), 4, 0.0)
    O.count.written = 0
    return many


@formula
def load(P, X, W, many, s):
    """Impulses and b of visit s."""
    k, at, i, j, c, v = W.pack, place_of(many, s), W.sides[s, 0], W.sides[s, 1], W.sides[s, 2], W.free
    if s < many[BALL]:
        a, b, d, n = k[at], k[at + 1], k[at + 2], k[at + B_P]
        write(W, 0, s, (n * a + k[at + B_T], n * b + k[at + B_T + 1], n * d + k[at + B_T + 2]))
        u = sliding(k, v, i, j, at, (v[j, 0] - v[i, 0], v[j, 1] - v[i, 1], v[j, 2] - v[i, 2], 0.0))
        n = k[at + B_BIAS]
        write(W, B, s, (u[0] + n * a, u[1] + n * b, u[2] + n * d))
        return
    write(W, 0, s, (k[at + IMPULSE], k[at + IMPULSE + 1], k[at + IMPULSE + 2]))
    u = rough_velocity(k, v, i, j, at) if s < many[BALL] + many[ROUGH] else seen(P, v, W.free_wide, c)
    write(W, B, s, (u[0] + k[at + BIAS], u[1] + k[at + BIAS + 1], u[2] + k[at + BIAS + 2]))
    if P.turn.shape[0] > 0:
        write(W, TORQUE, s, (X.torque[c, 0], X.torque[c, 1], X.torque[c, 2]))
        write(W, TORQUE + B, s, seen_turning(P, v, W.free_wide, c))


@formula
def subtract(P, X, W, O):
    """Leave the velocities that impulses make in W.own and X.wide."""
    first, last = nodes_of(P, O)
    for e in range(first, last):
        i = P.member[e]
        for k in range(6):
            W.own[i, k] -= W.free[i, k]
    for k in range(X.wide.shape[0]):
        X.wide[k] -= W.free_wide[k]


@formula
def tell(P, X, W, O, many, best, used, last):
    """The impulses of a vector into X, velocities with them; a row of the history or, at last, the answer."""
    first, end = nodes_of(P, O)
    for e in range(first, end):
        for k in range(6):
            W.own[P.member[e], k] = W.free[P.member[e], k]
    for k in range(X.wide.shape[0]):
        X.wide[k] = W.free_wide[k]
    for s in range(many[0] + many[1] + many[2] + many[3] + many[4]):
        c, x, y, z = W.sides[s, 2], W.rows[best, s, 0], W.rows[best, s, 1], W.rows[best, s, 2]
        for k in range(3):
            X.p[c, k] = W.rows[best, s, k]
            if s < many[BALL]:
                X.p[c, k] = P.frame[c, 3 * k] * x + P.frame[c, 3 * k + 1] * y + P.frame[c, 3 * k + 2] * z
        push(P, W.own, X.wide, c, (X.p[c, 0], X.p[c, 1], X.p[c, 2]))
        if P.turn.shape[0] > 0:
            for k in range(3):
                X.torque[c, k] = W.rows[TORQUE + best, s, k]
            push_turning(P, W.own, X.wide, c, (X.torque[c, 0], X.torque[c, 1], X.torque[c, 2]))
    first, end = lines_of(P, O)
    for k in range(first, end):
        X.line[k] = W.lines[best, k]
        push_line(P, X.wide, k, X.line[k])
    O.count.used = used
    finish(P, X, W, O, residuals(P, X, O, (W.own, X.wide, W.free, W.free_wide)), used, last)


@formula
def unused(a, b, c, first):
    """The first of the numbers from ``first`` on that is none of three."""
    for k in range(4):
        if first + k != a and first + k != b and first + k != c:
            return first + k
    return first
