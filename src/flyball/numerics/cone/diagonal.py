"""Diagonal blocks of N: what a contact's own impulses change its own velocities by.

A symmetric block is six numbers: nn, ns, nt, ss, st, tt.
"""

from __future__ import annotations

from ...compiler.formulas import formula
from ...math.vec import cross, dot, load3
from .operator import turned
from .problem import NONE


@formula
def axis(P, c, k):
    """Row k of the contact's frame."""
    return load3(P.frame, c, 3 * k)


@formula
def squares(P, i, m, e, r):
    """The block of m e . e + r . B r for three axes e and three torques r."""
    x, y, z = turned(P, i, r[0]), turned(P, i, r[1]), turned(P, i, r[2])
    return (
        m * dot(e[0], e[0]) + dot(r[0], x),
        m * dot(e[0], e[1]) + dot(r[0], y),
        m * dot(e[0], e[2]) + dot(r[0], z),
        m * dot(e[1], e[1]) + dot(r[1], y),
        m * dot(e[1], e[2]) + dot(r[1], z),
        m * dot(e[2], e[2]) + dot(r[2], z),
    )


@formula
def plus(a, b):
    """Sum of two blocks."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2], a[3] + b[3], a[4] + b[4], a[5] + b[5]


@formula
def squares_of_group(P, c, side, first):
    """The block of three rows of J and Y."""
    g, e = -2 - P.at[c, side], P.block[c, side]
    n = P.group[g + 1] - P.group[g]
    e += first * n
    nn, ns, nt, ss, st, tt = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for k in range(n):
        x, y, z = P.Y[e + k], P.Y[e + n + k], P.Y[e + 2 * n + k]
        nn += P.J[e + k] * x
        ns += P.J[e + k] * y
        nt += P.J[e + k] * z
        ss += P.J[e + n + k] * y
        st += P.J[e + n + k] * z
        tt += P.J[e + 2 * n + k] * z
    return nn, ns, nt, ss, st, tt


@formula
def diagonal(P, c):
    """The block of contact c, without compliance."""
    D = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    e = axis(P, c, 0), axis(P, c, 1), axis(P, c, 2)
    for side in range(2):
        i = P.at[c, side]
        if i >= 0:
            a = load3(P.arm, c, 3 * side)
            D = plus(D, squares(P, i, P.node[i, 0], e, (cross(a, e[0]), cross(a, e[1]), cross(a, e[2]))))
        elif i < NONE and P.block[c, side] >= 0:
            D = plus(D, squares_of_group(P, c, side, 0))
    return D


@formula
def diagonal_turning(P, c):
    """The block of the torques of contact c."""
    D = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    e = axis(P, c, 0), axis(P, c, 1), axis(P, c, 2)
    for side in range(2):
        i = P.at[c, side]
        if i >= 0:
            D = plus(D, squares(P, i, 0.0, e, e))
        elif i < NONE and P.block[c, side] >= 0:
            D = plus(D, squares_of_group(P, c, side, 3))
    return D
