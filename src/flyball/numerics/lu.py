"""Sparse L U of an unsymmetric matrix in a fixed pattern, real or complex, without pivoting.

For matrices of implicit integrators: their own order makes the pivots safe (`constrained_order`), a small part of
each row's natural size on the diagonal keeps them from zero, and whoever solves takes that out again. Row by row
(Doolittle), after Davis, *Direct Methods for Sparse Linear Systems* (2006), chapter 6; rows of U with one pattern, as
the coordinates of a body have, go two at a time.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..compiler.formulas import formula
from ..compiler.kernels import kernel
from ..compiler.layout import Int1
from ..math.scalar import nonzero


class Rows(NamedTuple):
    """Structure of A, L and U by rows, in the order of elimination; columns ascend, diagonals of L and U left out."""

    perm: Int1  # (n,): place of unknown i in the order of elimination
    Ap: Int1  # (n + 1,)
    Aj: Int1  # (nA,)
    Lp: Int1  # (n + 1,)
    Lj: Int1  # (nL,)
    Up: Int1  # (n + 1,)
    Uj: Int1  # (nU,)
    twin: Int1  # (n,): whether row i of U has i + 1 and then what row i + 1 has


@formula
def lu_factor(P, A, L, U, D, Y):
    """Factor A in place of L (unit diagonal), U and D (inverse diagonal of U). Returns 0, or 1 + the row that fails.

    ``A`` holds the entries by rows as in ``P.Aj``. ``Y`` is scratch, (n,).
    """
    for k in range(P.perm.shape[0]):
        first, last = P.Lp[k], P.Lp[k + 1]
        for p in range(first, last):
            Y[P.Lj[p]] = 0.0
        for p in range(P.Up[k], P.Up[k + 1]):
            Y[P.Uj[p]] = 0.0
        Y[k] = 0.0
        for p in range(P.Ap[k], P.Ap[k + 1]):
            Y[P.Aj[p]] = A[p]
        p = first
        while p < last:
            i = P.Lj[p]
            l = Y[i] * D[i]
            L[p] = l
            at = P.Up[i]
            if P.twin[i] == 1 and p + 1 < last:
                m = (Y[i + 1] - l * U[at]) * D[i + 1]
                L[p + 1] = m
                at += 1
                shift = P.Up[i + 1] - at
                for q in range(at, P.Up[i + 1]):
                    Y[P.Uj[q]] -= l * U[q] + m * U[q + shift]
                p += 2
            else:
                for q in range(at, P.Up[i + 1]):
                    Y[P.Uj[q]] -= l * U[q]
                p += 1
        d = Y[k]
        if not nonzero(d):
            return 1 + k
        D[k] = 1.0 / d
        for q in range(P.Up[k], P.Up[k + 1]):
            U[q] = Y[P.Uj[q]]
    return 0


@formula
def lu_solve(P, L, U, D, x):
    """Solve in place; x is in the factored order."""
    n = P.perm.shape[0]
    for k in range(n):
        v = x[k]
        for p in range(P.Lp[k], P.Lp[k + 1]):
            v -= L[p] * x[P.Lj[p]]
        x[k] = v
    for k in range(n - 1, -1, -1):
        v = x[k]
        for p in range(P.Up[k], P.Up[k + 1]):
            v -= U[p] * x[P.Uj[p]]
        x[k] = v * D[k]


@formula
def times(P, A, x, out):
    """Out = A x, both in the factored order."""
    for k in range(P.perm.shape[0]):
        s = 0.0 * x[k]
        for p in range(P.Ap[k], P.Ap[k + 1]):
            s += A[p] * x[P.Aj[p]]
        out[k] = s


def analyse(n: int, i: np.ndarray, j: np.ndarray, order: np.ndarray) -> tuple[Rows, np.ndarray]:
    """Pattern of the factors of a matrix with entries (i, j); where each of these goes in ``A``.

    Parameters
    ----------
    n : int
        Order of the matrix. The diagonal is always part of the pattern.
    i, j : ndarray of int
        Rows and columns of the entries, repeats allowed.
    order : (n,) of int
        Place of every unknown in the order of elimination.
    """
    order = np.asarray(order, np.int64)
    i, j = (order[np.r_[np.asarray(x, np.int64), np.arange(n)]] for x in (i, j))
    keys, place = np.unique(i * n + j, return_inverse=True)
    Ap, Aj = pointers(keys // n, n), (keys % n).astype(np.int64)
    room = 4 * len(Aj) + 64
    while True:
        Lp, Up = np.zeros(n + 1, np.int64), np.zeros(n + 1, np.int64)
        Lj, Uj = np.zeros(room, np.int64), np.zeros(room, np.int64)
        if fill_in(Ap, Aj, Lp, Lj, Up, Uj, np.zeros(n, np.int64)) == 0:
            break
        room *= 2
    Lj, Uj = Lj[: Lp[n]].copy(), Uj[: Up[n]].copy()
    twin = np.array([
        int(Up[k + 1] - Up[k] == Up[k + 2] - Up[k + 1] + 1 and Uj[Up[k]] == k + 1
            and np.array_equal(Uj[Up[k] + 1 : Up[k + 1]], Uj[Up[k + 1] : Up[k + 2]]))
        for k in range(n - 1)
    ] + [0], np.int64)  # fmt: skip
    return Rows(order, Ap, Aj, Lp, Lj, Up, Uj, twin), place[: len(place) - n].astype(np.int64)


def pointers(rows: np.ndarray, n: int) -> np.ndarray:
    """Where each row begins among entries in the order of rows, (n + 1,)."""
    return np.r_[0, np.cumsum(np.bincount(rows, minlength=n))].astype(np.int64)


@kernel
def fill_in(Ap: Int1, Aj: Int1, Lp: Int1, Lj: Int1, Up: Int1, Uj: Int1, seen: Int1) -> int:
    """Patterns of L and U of rows eliminated in turn. Returns 0, or 1 if there is no room for them."""
    n = Ap.shape[0] - 1
    for k in range(n):
        nl, nu = Lp[k], Up[k]
        first, last = k, k
        for p in range(Ap[k], Ap[k + 1]):
            seen[Aj[p]] = k + 1
            first, last = min(first, Aj[p]), max(last, Aj[p])
        if nl + k - first > Lj.shape[0]:
            return 1
        for i in range(first, k):
            if seen[i] == k + 1:
                Lj[nl] = i
                nl += 1
                for q in range(Up[i], Up[i + 1]):
                    seen[Uj[q]] = k + 1
                    last = max(last, Uj[q])
        if nu + last - k > Uj.shape[0]:
            return 1
        for j in range(k + 1, last + 1):
            if seen[j] == k + 1:
                Uj[nu] = j
                nu += 1
        Lp[k + 1], Up[k + 1] = nl, nu
    return 0


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
