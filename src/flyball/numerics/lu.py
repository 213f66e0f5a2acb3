"""Sparse L U of an unsymmetric matrix in a fixed symmetric pattern, real or complex, without pivoting.

For matrices of implicit integrators: their own order makes the pivots safe (`constrained_order`), a small part of
each row's natural size on the diagonal keeps them from zero, and whoever solves takes that out again. Up-looking, as
`ldl`; row i of U stands where column i of L does, so that one pattern serves both.
"""

from __future__ import annotations

import numpy as np

from ..compiler.jit import formula
from ..math.scalar import nonzero


@formula
def lu_factor(P, A, L, U, D, Y):
    """Factor A in place of L (unit diagonal), U and D (inverse diagonal of U). Returns 0, or 1 + the row that fails.

    ``A`` holds the upper triangle with the diagonal, by columns as in ``P.Ai``, then the lower triangle, by rows, at
    the same places. ``Y`` is scratch, (2, n), zero before and after.
    """
    n = P.perm.shape[0]
    half = P.Ai.shape[0]
    for k in range(n):
        last = P.Ap[k + 1] - 1
        d = A[last]
        for p in range(P.Ap[k], last):
            i = P.Ai[p]
            Y[0, i] = A[p]
            Y[1, i] = A[half + p]
        for e in range(P.Rp[k], P.Rp[k + 1]):
            i = P.Ri[e]
            x = P.Rx[e]
            u = Y[0, i]
            l = Y[1, i] * D[i]
            Y[0, i] = Y[1, i] = 0.0
            for p in range(P.Lp[i], x):
                j = P.Li[p]
                Y[0, j] -= L[p] * u
                Y[1, j] -= l * U[p]
            d -= l * u
            L[x] = l
            U[x] = u
        if not nonzero(d):
            return 1 + k
        D[k] = 1.0 / d
    return 0


@formula
def lu_solve(P, L, U, D, x):
    """Solve in place; x is in the factored order."""
    n = P.perm.shape[0]
    for k in range(n):
        v = x[k]
        for p in range(P.Lp[k], P.Lp[k + 1]):
            x[P.Li[p]] -= L[p] * v
    for k in range(n - 1, -1, -1):
        v = x[k]
        for p in range(P.Lp[k], P.Lp[k + 1]):
            v -= U[p] * x[P.Li[p]]
        x[k] = v * D[k]


@formula
def times(P, A, x, out):
    """Out = A x, both in the factored order."""
    n = P.perm.shape[0]
    half = P.Ai.shape[0]
    for k in range(n):
        last = P.Ap[k + 1] - 1
        s = A[last] * x[k]
        for p in range(P.Ap[k], last):
            i = P.Ai[p]
            s += A[half + p] * x[i]
            out[i] += A[p] * x[k]
        out[k] = s


def constrained_order(groups: np.ndarray, late: np.ndarray, i: np.ndarray, j: np.ndarray) -> np.ndarray:
    """Place (n,) of every unknown in an order by minimum degree, in which some come late.

    Parameters
    ----------
    groups : (n,) of int
        The group of each unknown; a group is eliminated as a whole, its unknowns in their order.
    late : (groups,) of bool
        Whether a group has to wait for all its neighbours that are not late: multipliers for the bodies that their
        rows touch.
    i, j : ndarray of int
        Entries of the matrix.
    """
    count = len(late)
    size = np.bincount(groups, minlength=count).tolist()
    near: list[set[int]] = [set() for _ in range(count)]
    pairs = np.unique(groups[i] * count + groups[j])
    for a, b in zip((pairs // count).tolist(), (pairs % count).tolist(), strict=True):
        if a != b:
            near[a].add(b)
            near[b].add(a)
    waits = [len([b for b in near[a] if not late[b]]) if late[a] else 0 for a in range(count)]
    follows = [[b for b in near[a] if late[b]] if not late[a] else [] for a in range(count)]
    degree = [sum(size[b] for b in near[a]) for a in range(count)]
    left, sequence = set(range(count)), []
    while left:
        least = min((a for a in left if waits[a] == 0), key=lambda a: (degree[a], a))
        sequence.append(least)
        left.remove(least)
        for b in follows[least]:
            waits[b] -= 1
        for a in near[least]:
            near[a] |= near[least]
            near[a] -= {a, least}
            degree[a] = sum(size[b] for b in near[a])
    at = np.empty(count, np.int64)
    at[sequence] = np.arange(count)
    place = np.empty(len(groups), np.int64)
    place[np.argsort(at[groups], kind="stable")] = np.arange(len(groups))
    return place
