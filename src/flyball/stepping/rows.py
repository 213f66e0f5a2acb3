"""Contacts made into rows of the cone problem: frames, arms, biases, friction, and the warm start."""

from __future__ import annotations

from ..compiler.jit import formula
from ..contact.surfaces import ACROSS, KINETIC, ROLLING, SPINNING, STATIC
from ..contact.tables import BEFORE, FOUND, GAP, MATERIAL, MOVER, NORMAL, POINT, SHAPE_1, SHAPE_2
from ..math.scalar import sqrt
from ..math.vec import add, axes_across, cross, dot, load3, load9, mv, put3, scale, sub
from ..numerics.cone.operator import along, seen
from .onward import arm, carry_on, lead
from .penalty import stiffness
from .tables import GRAVITY, IMPULSE, LEAD, SLIDES, STEP, TORQUE, YIELDING

SQUARE = 1e-6  # cosine between a grain and the surface below which it stands square on it


@formula
def fill_rows(G, M, C, P, L, pace):
    """Everything of the problem but impulses and masses; its sizes too."""
    h = pace.real[STEP]
    P.size[0] = C.count[FOUND]
    P.island[0], P.island[1] = 0, C.count[FOUND]
    turns = P.turn.shape[0] > 0
    for c in range(C.count[FOUND]):
        i, j = C.at[c, SHAPE_1], C.at[c, SHAPE_2]
        a, b = G.shape_i[i, MOVER], G.shape_i[j, MOVER]
        P.at[c, 0], P.at[c, 1] = a, b
        point = load3(C.x, c, POINT)
        put3(P.frame, c, 0, load3(C.x, c, NORMAL))
        put3(P.arm, c, 0, arm(M, a, point))
        put3(P.arm, c, 3, arm(M, b, point))
        law = L.pair[G.shape_i[i, MATERIAL], G.shape_i[j, MATERIAL]]
        tangents(G, M, C, P, L, c)
        gap = C.x[c, GAP]
        P.bias[c, 0] = gap / h if gap > 0.0 else 0.0
        P.mu[c] = law[KINETIC]
        P.soft[c] = 0.0
        if turns:
            P.turn[c, 0], P.turn[c, 1] = law[ROLLING], law[SPINNING]


@formula
def tangents(G, M, C, P, L, c):
    """Tangents of contact c, and how its surfaces move along these by themselves."""
    i, j = C.at[c, SHAPE_1], C.at[c, SHAPE_2]
    a, b = G.shape_i[i, MOVER], G.shape_i[j, MOVER]
    law = L.pair[G.shape_i[i, MATERIAL], G.shape_i[j, MATERIAL]]
    n, ratio = load3(P.frame, c, 0), law[ACROSS]
    t, along_it = axes_across(n)[0], ratio  # a grain that stands square on the surface: as across it all around
    if L.grain.shape[0] > 0:
        for side in range(2):
            g = along_grain(M, L, i if side == 0 else j, a if side == 0 else b, n)
            if dot(g, g) > 0.0:
                t, along_it = g, 1.0
    cross_frame(P.frame, c, scale(along_it, t), scale(ratio, cross(n, t)))
    P.bias[c, 1] = P.bias[c, 2] = 0.0
    if L.belt.shape[0] > 0:
        add_belt(M, L, P, c, i, a, -1.0)
        add_belt(M, L, P, c, j, b, 1.0)


@formula
def onward(G, M, C, D, N, P, L, pace, now):
    """Rows from the start of the step to its middle; of what gives way they stay, as its law is of the way."""
    for c in range(C.count[FOUND]):
        hard = pace.count[YIELDING] == 0 or stiffness(G, C, L, c) == 0.0
        ahead = (0.0, 0.0, 0.0)
        if hard and carry_on(M, C, D, N, P, c, pace):
            tangents(G, M, C, P, L, c)
            ahead = lead(M, C, P, c)
            put3(P.bias, c, 0, add(load3(P.bias, c, 0), ahead))
        put3(now, c, LEAD, ahead)


@formula
def along_grain(M, L, shape, mover, n):
    """The unit tangent along the grain of a shape; 0 where it has none, or one that stands square on the surface."""
    g = along_world(M, mover, load3(L.grain, shape, 0))
    g = sub(g, scale(dot(g, n), n))
    s = dot(g, g)
    return scale(1.0 / sqrt(s), g) if s > SQUARE * SQUARE else (0.0, 0.0, 0.0)


@formula
def along_world(M, a, g):
    """A vector in the axes of mover a, or of what stands still, along the world's."""
    return mv(load9(M.pose, a, 3), g) if a >= 0 else g


@formula
def cross_frame(frame, c, first, second):
    """The two tangential rows: in a circular cone, forces along one are as many times as large as it is long."""
    put3(frame, c, 3, first)
    put3(frame, c, 6, second)


@formula
def add_belt(M, L, P, c, shape, mover, sign):
    """The velocity of a surface on its mover, such as a conveyor's."""
    g = along_world(M, mover, load3(L.belt, shape, 0))
    for k in range(2):
        P.bias[c, 1 + k] += sign * dot(load3(P.frame, c, 3 + 3 * k), g)


@formula
def warm(C, P, X, now, before):
    """Impulses of the same contacts in the step before; what stuck there has the static friction coefficient."""
    for c in range(C.count[FOUND]):
        o = C.at[c, BEFORE]
        now[c, SLIDES] = before[o, SLIDES] if o >= 0 else -1.0
        put3(X.p, c, 0, again(P, c, before, o, IMPULSE))
        if X.torque.shape[0] > 0:
            put3(X.torque, c, 0, again(P, c, before, o, TORQUE))


@formula
def again(P, c, before, o, first):
    """What `across` makes a vector in the world that is kept in row o; 0 where nothing is (-1)."""
    if o < 0:
        return (0.0, 0.0, 0.0)
    x = along(P, c, load3(before, o, first))
    n, s, t = load3(P.frame, c, 0), load3(P.frame, c, 3), load3(P.frame, c, 6)
    return (x[0] / dot(n, n), parted(x[1], s), parted(x[2], t))


@formula
def parted(x, row):
    """Component x along a row over the square of the row's length; none along a row that is none: smooth across."""
    return x / dot(row, row) if dot(row, row) > 0.0 else 0.0 * x


@formula
def static_where_stuck(G, C, P, L, X, pace, now):
    """The static coefficient for contacts that stuck before, and for new ones that hardly slide."""
    h = pace.real[STEP]
    g0, g1, g2 = pace.real[GRAVITY], pace.real[GRAVITY + 1], pace.real[GRAVITY + 2]
    slow = h * sqrt(g0 * g0 + g1 * g1 + g2 * g2)
    for c in range(C.count[FOUND]):
        law = L.pair[G.shape_i[C.at[c, SHAPE_1], MATERIAL], G.shape_i[C.at[c, SHAPE_2], MATERIAL]]
        if law[STATIC] > law[KINETIC] and now[c, SLIDES] < 0.5:
            u = seen(P, X.v, X.wide, c)
            s, t = u[1] + P.bias[c, 1], u[2] + P.bias[c, 2]
            if now[c, SLIDES] == 0.0 or s * s + t * t <= slow * slow:
                P.mu[c] = law[STATIC]
