"""The mass matrix of trees: composite rigid bodies (Walker and Orin 1982; Featherstone 2008, table 6.2).

Where every body hangs on ground by FREE or PLANAR, M is constant and block diagonal and none of this runs.
"""

from __future__ import annotations

from .._jit import formula
from ..math.vec import add, cross, dot, load3, load9, mm, put3, scale, sub, transpose
from .tables import INERTIA, MASS, NV, PARENT, V0
from .tree import column, project


@formula
def symmetric(A, k, v):
    """J v for the symmetric matrix stored in A[k, 4:10] as xx, xy, xz, yy, yz, zz."""
    return (
        A[k, 4] * v[0] + A[k, 5] * v[1] + A[k, 6] * v[2],
        A[k, 5] * v[0] + A[k, 7] * v[1] + A[k, 8] * v[2],
        A[k, 6] * v[0] + A[k, 8] * v[1] + A[k, 9] * v[2],
    )


@formula
def add_shifted(C, k, m, d):
    """Add the inertia of a point mass m at d."""
    s = dot(d, d)
    C[k, 4] += m * (s - d[0] * d[0])
    C[k, 5] -= m * d[0] * d[1]
    C[k, 6] -= m * d[0] * d[2]
    C[k, 7] += m * (s - d[1] * d[1])
    C[k, 8] -= m * d[1] * d[2]
    C[k, 9] += m * (s - d[2] * d[2])


@formula
def composite(S, W):
    """Mass, mass centre and inertia about it (world axes) of every subtree."""
    C = W.IC
    n = S.body_i.shape[0]
    for b in range(n):
        R = load9(W.BK, b, 3)
        J = mm(mm(R, load9(S.body_x, b, INERTIA)), transpose(R))
        C[b, 0] = S.body_x[b, MASS]
        put3(C, b, 1, load3(W.BK, b, 0))
        put3(C, b, 4, (J[0], J[1], J[2]))
        put3(C, b, 7, (J[4], J[5], J[8]))
    for b in range(n - 1, -1, -1):
        a = S.body_i[b, PARENT]
        if a >= 0 and C[b, 0] > 0.0:
            m = C[a, 0] + C[b, 0]
            p, q = load3(C, a, 1), load3(C, b, 1)
            c = scale(1.0 / m, add(scale(C[a, 0], p), scale(C[b, 0], q)))
            add_shifted(C, a, C[a, 0], sub(p, c))
            add_shifted(C, a, C[b, 0], sub(q, c))
            for i in range(6):
                C[a, 4 + i] += C[b, 4 + i]
            C[a, 0] = m
            put3(C, a, 1, c)


@formula
def mass_entries(S, W):
    """Entries of M, in the order of S.mass_i: for each velocity of each body, itself and those of its ancestors."""
    composite(S, W)
    e = 0
    scratch = W.D[2]
    for b in range(S.body_i.shape[0]):
        c = load3(W.IC, b, 1)
        for k in range(S.body_i[b, NV]):
            w, v = column(S, W, b, k)
            momentum = scale(W.IC[b, 0], add(v, cross(w, sub(c, load3(W.O, b, 0)))))
            spin = symmetric(W.IC, b, w)
            a = b
            while a >= 0:
                v0 = S.body_i[a, V0]
                for i in range(v0, v0 + S.body_i[a, NV]):
                    scratch[i] = 0.0
                project(S, W, a, scratch, v0, 1.0, momentum, spin, c)
                for i in range(v0, v0 + S.body_i[a, NV]):
                    if i <= S.body_i[b, V0] + k:
                        W.M[e] = scratch[i]
                        e += 1
                a = S.body_i[a, PARENT]
