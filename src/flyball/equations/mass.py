"""The mass matrix of trees: composite rigid bodies (Walker and Orin 1982; Featherstone 2008, table 6.2).

Everything has components along the world's axes, and moments about the reference points of the tree joints, W.O: going
from body to parent is a shift and no turn, and mechanisms far from the world's origin lose nothing. Massless bodies of
the table are bodies like all others. Where every body hangs on ground by FREE, PLANAR or POINT, M is constant and block
diagonal and none of this runs.
"""

from __future__ import annotations

from ..compiler.formulas import formula
from ..math.vec import add, cross, dot, load3, load9, put3, scale, sub, symmetric
from ..tables.system import POINT, REVOLUTE
from .tree import column


@formula
def load6(A, k, o):
    """Six neighbours of row k of a table, from column o: a symmetric matrix as xx, xy, xz, yy, yz, zz."""
    return (A[k, o], A[k, o + 1], A[k, o + 2], A[k, o + 3], A[k, o + 4], A[k, o + 5])


@formula
def put6(A, k, o, a):
    """Write a symmetric matrix into row k of a table, from column o."""
    A[k, o] = a[0]
    A[k, o + 1] = a[1]
    A[k, o + 2] = a[2]
    A[k, o + 3] = a[3]
    A[k, o + 4] = a[4]
    A[k, o + 5] = a[5]


@formula
def plus(a, b):
    """Sum of two symmetric matrices."""
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2], a[3] + b[3], a[4] + b[4], a[5] + b[5])


@formula
def turned(R, I):
    """R I R^T of a symmetric I: I_zz times the identity, and what the first two columns of R make of the rest."""
    x, y = I[0] - I[8], I[4] - I[8]
    u = (x * R[0], x * R[3], x * R[6])
    w = (y * R[1], y * R[4], y * R[7])
    if I[1] != 0.0 or I[2] != 0.0 or I[5] != 0.0:
        a, b, c = I[1], 2.0 * I[2], 2.0 * I[5]
        u = (u[0] + a * R[1] + b * R[2], u[1] + a * R[4] + b * R[5], u[2] + a * R[7] + b * R[8])
        w = (w[0] + a * R[0] + c * R[2], w[1] + a * R[3] + c * R[5], w[2] + a * R[6] + c * R[8])
        return (
            u[0] * R[0] + w[0] * R[1] + I[8],
            0.5 * (u[0] * R[3] + u[1] * R[0] + w[0] * R[4] + w[1] * R[1]),
            0.5 * (u[0] * R[6] + u[2] * R[0] + w[0] * R[7] + w[2] * R[1]),
            u[1] * R[3] + w[1] * R[4] + I[8],
            0.5 * (u[1] * R[6] + u[2] * R[3] + w[1] * R[7] + w[2] * R[4]),
            u[2] * R[6] + w[2] * R[7] + I[8],
        )
    return (
        u[0] * R[0] + w[0] * R[1] + I[8],
        u[0] * R[3] + w[0] * R[4],
        u[0] * R[6] + w[0] * R[7],
        u[1] * R[3] + w[1] * R[4] + I[8],
        u[1] * R[6] + w[1] * R[7],
        u[2] * R[6] + w[2] * R[7] + I[8],
    )


@formula
def rigid(S, W, b):
    """Mass, first moment and inertia of body b about W.O[b]."""
    m = S.bodies.mass[b]
    if m == 0.0:
        return m, (m, m, m), (m, m, m, m, m, m)
    J = turned(load9(W.BK, b, 3), load9(S.bodies.inertia, b, 0))
    r = sub(load3(W.BK, b, 0), load3(W.O, b, 0))
    return m, scale(m, r), shifted(J, scale(0.5 * m, r), r)


@formula
def shifted(J, e, d):
    """J + 2 (e . d) 1 - (e d^T + d e^T): inertia about a point that lies at -d from the one of J.

    ``e`` is the first moment about the point halfway between the two.
    """
    x, y, z = 2.0 * e[0] * d[0], 2.0 * e[1] * d[1], 2.0 * e[2] * d[2]
    return (
        J[0] + (y + z),
        J[1] - (e[0] * d[1] + e[1] * d[0]),
        J[2] - (e[0] * d[2] + e[2] * d[0]),
        J[3] + (x + z),
        J[4] - (e[1] * d[2] + e[2] * d[1]),
        J[5] + (x + y),
    )


@formula
def root_columns(S, W, b):
    """Twist columns of body b into W.X, where those of all others stand, if it is a root: FREE, PLANAR or POINT."""
    if S.tree.joint[b] <= POINT:
        for k in range(S.tree.nv[b]):
            w, v = column(S, W, b, k)
            put3(W.X, S.tree.v[b] + k, 0, w)
            put3(W.X, S.tree.v[b] + k, 3, v)


@formula
def composite(S, W):
    """Mass, first moment and inertia of every subtree about the reference point of its root, and where that lies from
    the one of the root's parent.
    """
    C = W.IC
    n = S.tree.parent.shape[0]
    for b in range(n):
        root_columns(S, W, b)
        m, h, J = rigid(S, W, b)
        C[b, 0] = m
        put3(C, b, 1, h)
        put6(C, b, 4, J)
    for b in range(n - 1, -1, -1):
        a = S.tree.parent[b]
        if a >= 0:
            m, h = C[b, 0], load3(C, b, 1)
            d = sub(load3(W.O, b, 0), load3(W.O, a, 0))
            to = scale(m, d)
            J = shifted(load6(C, b, 4), add(h, scale(0.5, to)), d)
            C[a, 0] += m
            put3(C, a, 1, add(load3(C, a, 1), add(h, to)))
            put6(C, a, 4, plus(load6(C, a, 4), J))
            put3(C, b, 10, d)


@formula
def mass_entries(S, W):
    """Entries of M, in the order of `MassEntries`: for each velocity of each body, itself and those of its ancestors.

    The momentum that a unit of the velocity gives all that hangs on the body, taken along the ancestors' columns.
    """
    composite(S, W)
    C = W.IC
    e = 0
    for b in range(S.tree.parent.shape[0]):
        h = load3(C, b, 1)
        for d in range(S.tree.v[b], S.tree.v[b] + S.tree.nv[b]):
            w, v = load3(W.X, d, 0), load3(W.X, d, 3)
            force = cross(w, h)
            moment = symmetric(load6(C, b, 4), w)
            if S.tree.joint[b] != REVOLUTE:
                force, moment = add(force, scale(C[b, 0], v)), add(moment, cross(h, v))
            a = b
            while a >= 0:
                a0 = S.tree.v[a]
                if S.tree.joint[a] == REVOLUTE:
                    W.M[e] = dot(load3(W.X, a0, 0), moment)
                    e += 1
                else:
                    for i in range(a0, min(a0 + S.tree.nv[a], d + 1)):
                        W.M[e] = dot(load3(W.X, i, 0), moment) + dot(load3(W.X, i, 3), force)
                        e += 1
                moment = add(moment, cross(load3(C, a, 10), force))
                a = S.tree.parent[a]
