"""Passes over all contacts: a step of the gradient with its impulses acting, and the velocities that they make.

See `steps` for the vectors. Velocities of products stand in W.own and X.wide.
"""

from __future__ import annotations

from ...compiler.formulas import formula
from .operator import push, push_line, push_turning, seen, seen_line, seen_turning
from .pack import (
    ARM1,
    ARM2,
    B_IN,
    B_IT,
    B_SOFT,
    BALL,
    IN,
    ROUGH,
    SLIDE,
    SOFT,
    WIDTH_BALL,
    change_balls,
)
from .problem import SOFT as LINE_SOFT
from .residual import larger, lines_of, nodes_of
from .steps import METRIC, STEPS, TORQUE, B, mixed, step_ball, step_line, step_rough, step_turning, write
from .sweeps import change, rough_velocity, sliding


@formula
def clear(P, X, W, O):
    """No velocities."""
    begin, end = nodes_of(P, O)
    for e in range(begin, end):
        for k in range(6):
            W.own[P.member[e], k] = 0.0
    for k in range(X.wide.shape[0]):
        X.wide[k] = 0.0


@formula
def forward(P, X, W, O, many, ids, par):
    """A step from y = cur + beta (cur - prev) to ``new``, and its impulses on the velocities.

    Parameters
    ----------
    many : tuple
        Contacts of each kind.
    ids : tuple
        Vectors cur, prev, their N p, and new.
    par : tuple
        beta, size of the step, whether by Coulomb's law.

    Returns
    -------
    tuple
        d' M d with d = new - y; g . (new - cur); the largest square of M d of a contact.
    """
    cur, prev, ucur, uprev, new = ids
    beta, size, coulomb = par
    k, v, dd, gs, worst = W.pack, W.own, 0.0, 0.0, 0.0
    clear(P, X, W, O)
    for s in range(many[BALL] + many[ROUGH]):
        ball = s < many[BALL]
        at = WIDTH_BALL * s if ball else WIDTH_BALL * many[BALL] + 32 * (s - many[BALL])
        y, u, b = mixed(W, cur, prev, beta, s), mixed(W, ucur, uprev, beta, s), mixed(W, B, B, 0.0, s)
        g, i, j = (u[0] + b[0], u[1] + b[1], u[2] + b[2]), W.sides[s, 0], W.sides[s, 1]
        if ball:
            x, more, square = step_ball(k, at, y, g, size, coulomb)
            change_balls(k, v, i, j, at, (0.0, x[0], x[1], x[2]))
        else:
            x, more, square = step_rough(k, at, y, g, size, coulomb)
            push_rough(k, v, W.inner, i, j, at, x)
        write(W, new, s, x)
        dd, worst = dd + more, larger(worst, square)
        gs += g[0] * (x[0] - W.rows[cur, s, 0]) + g[1] * (x[1] - W.rows[cur, s, 1]) + g[2] * (x[2] - W.rows[cur, s, 2])
    return forward_any(P, X, W, O, many, ids, par, (dd, gs, worst))


@formula
def act(P, X, W, O, many, a):
    """Vector a, without torques and lines, on the velocities."""
    clear(P, X, W, O)
    for s in range(many[BALL] + many[ROUGH]):
        i, j, x = W.sides[s, 0], W.sides[s, 1], mixed(W, a, a, 0.0, s)
        if s < many[BALL]:
            change_balls(W.pack, W.own, i, j, WIDTH_BALL * s, (0.0, x[0], x[1], x[2]))
        else:
            push_rough(W.pack, W.own, W.inner, i, j, WIDTH_BALL * many[BALL] + 32 * (s - many[BALL]), x)
    begin = begin_any(many)[0]
    for s in range(begin, begin + many[4]):
        push(P, W.own, X.wide, W.sides[s, 2], mixed(W, a, a, 0.0, s))


@formula
def push_rough(k, v, B, i, j, at, p):
    """An impulse along the frame of a rough contact."""
    x = k[at] * p[0] + k[at + 3] * p[1] + k[at + 6] * p[2]
    y = k[at + 1] * p[0] + k[at + 4] * p[1] + k[at + 7] * p[2]
    z = k[at + 2] * p[0] + k[at + 5] * p[1] + k[at + 8] * p[2]
    change(k, v, B, j, at + ARM2, x, y, z)
    change(k, v, B, i, at + ARM1, -x, -y, -z)


@formula
def begin_any(many):
    """First visit, and first number in ``pack``, of contacts of groups."""
    first = many[BALL] + many[ROUGH]
    return first, WIDTH_BALL * many[BALL] + 32 * many[ROUGH]


@formula
def forward_any(P, X, W, O, many, ids, par, sums):
    """Of contacts of groups, of turning and of lines."""
    cur, prev, ucur, uprev, new = ids
    beta, size, coulomb = par
    dd, gs, worst = sums
    begin, at = begin_any(many)
    for s in range(begin, begin + many[4]):
        c = W.sides[s, 2]
        y, u, b = mixed(W, cur, prev, beta, s), mixed(W, ucur, uprev, beta, s), mixed(W, B, B, 0.0, s)
        g = u[0] + b[0], u[1] + b[1], u[2] + b[2]
        if P.turn.shape[0] > 0:
            z, u = mixed(W, TORQUE + cur, TORQUE + prev, beta, s), mixed(W, TORQUE + ucur, TORQUE + uprev, beta, s)
            b = mixed(W, TORQUE + B, B, 0.0, s)
            h = u[0] + b[0], u[1] + b[1], u[2] + b[2]
            way = size, coulomb, W.rows[STEPS, s, 0], W.rows[STEPS, s, 1]
            x, q, more, square = step_turning(P, W.pack, c, at, (y, z), (g, h), way)
            for e in range(3):
                gs += h[e] * (q[e] - W.rows[TORQUE + cur, s, e])
            write(W, TORQUE + new, s, q)
            push_turning(P, W.own, X.wide, c, q)
        else:
            x, more, square = step_rough(W.pack, at, y, g, size, coulomb)
        write(W, new, s, x)
        push(P, W.own, X.wide, c, x)
        dd, worst, at = dd + more, larger(worst, square), at + 32
        gs += g[0] * (x[0] - W.rows[cur, s, 0]) + g[1] * (x[1] - W.rows[cur, s, 1]) + g[2] * (x[2] - W.rows[cur, s, 2])
    first, last = lines_of(P, O)
    for e in range(first, last):
        more, rise, square = step_line(P, W, e, ids, par)
        push_line(P, X.wide, e, W.lines[new, e])
        dd, gs, worst = dd + more, gs + rise, larger(worst, square)
    return dd, gs, worst


@formula
def velocity(P, X, W, s, at, ball, new):
    """N x of visit s, of vector ``new``; but for its torque."""
    k, v, i, j = W.pack, W.own, W.sides[s, 0], W.sides[s, 1]
    x = mixed(W, new, new, 0.0, s)
    if ball:
        u = sliding(k, v, i, j, at, (v[j, 0] - v[i, 0], v[j, 1] - v[i, 1], v[j, 2] - v[i, 2], 0.0))
        n = k[at + B_SOFT] * (k[at] * x[0] + k[at + 1] * x[1] + k[at + 2] * x[2])
        return u[0] + n * k[at], u[1] + n * k[at + 1], u[2] + n * k[at + 2]
    u = rough_velocity(k, v, i, j, at)
    return u[0] + k[at + SOFT] * x[0], u[1], u[2]


@formula
def inner(a, b, c):
    """(a - b) . c for vectors."""
    return (a[0] - b[0]) * c[0] + (a[1] - b[1]) * c[1] + (a[2] - b[2]) * c[2]


@formula
def backward(P, X, W, O, many, ids, unew, beta):
    """N new into ``unew``; d' N d with d = new - y, and the square of N d in the inverse metric (without turning)."""
    cur, prev, ucur, uprev, new = ids
    k, total, square = W.pack, 0.0, 0.0
    for s in range(many[BALL] + many[ROUGH]):
        ball = s < many[BALL]
        at = WIDTH_BALL * s if ball else WIDTH_BALL * many[BALL] + 32 * (s - many[BALL])
        u = velocity(P, X, W, s, at, ball, new)
        write(W, unew, s, u)
        x, y, w = mixed(W, new, new, 0.0, s), mixed(W, cur, prev, beta, s), mixed(W, ucur, uprev, beta, s)
        w = u[0] - w[0], u[1] - w[1], u[2] - w[2]
        total += inner(x, y, w)
        n = k[at] * w[0] + k[at + 1] * w[1] + k[at + 2] * w[2] if ball else w[0]
        lean, slide = (k[at + B_IN], k[at + B_IT]) if ball else (k[at + IN], k[at + SLIDE])
        square += lean * n * n + slide * (w[0] * w[0] + w[1] * w[1] + w[2] * w[2] - n * n)
    return backward_any(P, X, W, O, many, ids, unew, beta, (total, square))


@formula
def backward_any(P, X, W, O, many, ids, unew, beta, sums):
    """Of contacts of groups, of turning and of lines."""
    cur, prev, ucur, uprev, new = ids
    k, (total, square) = W.pack, sums
    begin, at = begin_any(many)
    for s in range(begin, begin + many[4]):
        c = W.sides[s, 2]
        x, y, w = mixed(W, new, new, 0.0, s), mixed(W, cur, prev, beta, s), mixed(W, ucur, uprev, beta, s)
        u = seen(P, W.own, X.wide, c)
        u = u[0] + P.soft[c] * x[0], u[1], u[2]
        write(W, unew, s, u)
        w = u[0] - w[0], u[1] - w[1], u[2] - w[2]
        total += inner(x, y, w)
        square += k[at + IN] * w[0] * w[0] + k[at + SLIDE] * (w[1] * w[1] + w[2] * w[2])
        at += 32
        if P.turn.shape[0] > 0:
            x, y = mixed(W, TORQUE + new, TORQUE + new, 0.0, s), mixed(W, TORQUE + cur, TORQUE + prev, beta, s)
            u, w = seen_turning(P, W.own, X.wide, c), mixed(W, TORQUE + ucur, TORQUE + uprev, beta, s)
            write(W, TORQUE + unew, s, u)
            total += inner(x, y, u) - inner(x, y, w)
    first, last = lines_of(P, O)
    for e in range(first, last):
        u = seen_line(P, X.wide, e) + P.line_x[e, LINE_SOFT] * W.lines[new, e]
        y = W.lines[cur, e] + beta * (W.lines[cur, e] - W.lines[prev, e])
        w = W.lines[ucur, e] + beta * (W.lines[ucur, e] - W.lines[uprev, e])
        W.lines[unew, e] = u
        total += (u - w) * (W.lines[new, e] - y)
        square += (u - w) * (u - w) / W.lines[METRIC, e]
    return total, square
