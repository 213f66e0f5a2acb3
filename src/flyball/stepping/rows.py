"""Contacts made into rows of the cone problem: frames, arms, biases, friction, and the warm start."""

from __future__ import annotations

from ..compiler.formulas import formula
from ..contact.surfaces import ACROSS, KINETIC, ROLLING, SPINNING, STATIC
from ..contact.tables import APART, BEFORE, FOUND, GAP, MATERIAL, MOVER, NORMAL, POINT, SHAPE_1, SHAPE_2
from ..math.scalar import sqrt
from ..math.vec import add, axes_across, cross, dot, load3, load9, mv, put3, scale, sub
from ..numerics.cone.operator import along, seen
from .motion import speed_of_fall
from .tables import IMPULSE, SLIDES, STEP, TORQUE


@formula
def fill_rows(G, M, C, P, L, pace):
    """Everything of the problem but impulses and masses; its sizes too."""
    h = pace.real[STEP]
    P.size[0] = C.count[FOUND]
    P.island[0], P.island[1] = 0, C.count[FOUND]
    turns = P.turn.shape[0] > 0
    for c in range(C.count[FOUND]):
        i, j = C.at[c, SHAPE_1], C.at[c, SHAPE_2]
        a, b = P.at[c, 0], P.at[c, 1] = sides(G, C, c)
        point = load3(C.x, c, POINT)
        put3(P.frame, c, 0, load3(C.x, c, NORMAL))
        apart = load3(C.x, c, APART)
        put3(P.arm, c, 0, arm(M, a, sub(point, apart)))
        put3(P.arm, c, 3, arm(M, b, add(point, apart)))
        law = L.pair[G.shape_i[i, MATERIAL], G.shape_i[j, MATERIAL]]
        tangents(G, M, C, P, L, c)
        gap = C.x[c, GAP]
        P.bias[c, 0] = gap / h if gap > 0.0 else 0.0
        P.mu[c] = law[KINETIC]
        P.soft[c] = 0.0
        if turns:
            P.turn[c, 0], P.turn[c, 1] = law[ROLLING], law[SPINNING]


@formula
def sides(G, C, c):
    """Movers of contact c."""
    return G.shape_i[C.at[c, SHAPE_1], MOVER], G.shape_i[C.at[c, SHAPE_2], MOVER]


@formula
def arm(M, a, point):
    """From the origin of mover a to a point; 0 for what stands still."""
    return sub(point, load3(M.pose, a, 0)) if a >= 0 else (0.0, 0.0, 0.0)


@formula
def tangents(G, M, C, P, L, c):
    """Tangents of contact c, and how its surfaces move along these by themselves."""
    i, j = C.at[c, SHAPE_1], C.at[c, SHAPE_2]
    a, b = G.shape_i[i, MOVER], G.shape_i[j, MOVER]
    law = L.pair[G.shape_i[i, MATERIAL], G.shape_i[j, MATERIAL]]
    tangent, square = direction(M, L, (i, a), (j, b), load3(P.frame, c, 0))
    cross_frame(P.frame, c, tangent, law[ACROSS] if square else 1.0, law[ACROSS])
    P.bias[c, 1] = P.bias[c, 2] = 0.0
    if L.belt.shape[0] > 0:
        add_belt(M, L, P, c, i, a, -1.0)
        add_belt(M, L, P, c, j, b, 1.0)


@formula
def direction(M, L, first, second, n):
    """A tangent along the grain of either shape, and whether there is none in the tangent plane: then it is any other.

    ``first`` and ``second``: shape and mover. Of two surfaces with a grain, friction does not depend on the direction.
    """
    if L.grain.shape[0] > 0:
        for shape, mover in (first, second):
            g = along_world(M, mover, load3(L.grain, shape, 0))
            g = sub(g, scale(dot(g, n), n))
            s = dot(g, g)
            if s > 1e-12:
                return scale(1.0 / sqrt(s), g), False
    return axes_across(n)[0], True


@formula
def along_world(M, a, g):
    """A vector in the axes of mover a, or of what stands still, along the world's."""
    return mv(load9(M.pose, a, 3), g) if a >= 0 else g


@formula
def cross_frame(frame, c, t, along, across):
    """Rows t1 = along t and t2 = across n x t: in a circular cone, forces are so many times as large in either."""
    put3(frame, c, 3, scale(along, t))
    put3(frame, c, 6, scale(across, cross(load3(frame, c, 0), t)))


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
    return (x[0] / dot(n, n), coefficient(x[1], s), coefficient(x[2], t))


@formula
def coefficient(x, row):
    """Product x of a vector and a row over the row's square; 0 along a row that is zero, where friction is none."""
    square = dot(row, row)
    return x / square if square > 0.0 else 0.0 * x


@formula
def static_where_stuck(G, C, P, L, X, pace, now):
    """The static coefficient for contacts that stuck before, and for new ones that hardly slide."""
    slow = speed_of_fall(pace, pace.real[STEP])
    for c in range(C.count[FOUND]):
        law = L.pair[G.shape_i[C.at[c, SHAPE_1], MATERIAL], G.shape_i[C.at[c, SHAPE_2], MATERIAL]]
        if law[STATIC] > law[KINETIC] and now[c, SLIDES] < 0.5:
            u = seen(P, X.v, X.wide, c)
            s, t = u[1] + P.bias[c, 1], u[2] + P.bias[c, 2]
            if now[c, SLIDES] == 0.0 or s * s + t * t <= slow * slow:
                P.mu[c] = law[STATIC]
