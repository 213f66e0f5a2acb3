"""Sparse factorisation in a fixed pattern: L D L^T of symmetric matrices, L U of unsymmetric ones.

The elimination order and the pattern of the factors are found once, in Python (`analyse_ldl`, `analyse_lu`);
the compiled part only does arithmetic, without any search.

L D L^T, for symmetric quasi-definite matrices, is up-looking after Davis, *Algorithm 849: A concise sparse
Cholesky factorization package* (2005).

L U, real or complex and without pivoting, is for the matrices of implicit integrators. Their order
(`constrained_order`) keeps the pivots from zero together with a regularisation on the diagonal, whose effect the
caller removes by iterative refinement. It works row by row (Doolittle), after Davis, *Direct Methods for
Sparse Linear Systems* (2006), chapter 6. Rows of U with one pattern, such as those of the coordinates of a
body, are processed two at a time.
"""

from __future__ import annotations

import itertools
from typing import NamedTuple

import numpy as np

from ..compiler.formulas import formula
from ..compiler.kernels import kernel
from ..compiler.struct_layout import Float1, Int1
from ..math.scalar import nonzero
from .graphs import minimum_degree, nested_dissection

DISSECTION_ORDER = 300  # number of unknowns above which nested dissection is tried
DISSECTION_WORK = 100.0  # and multiplications per unknown above which it is tried


class LDLPattern(NamedTuple):
    """Structure of A (upper triangle, permuted) and L. Column k of A is row k of the lower triangle."""

    perm: Int1  # (n,): place of unknown i in the factored order
    Ap: Int1  # (n + 1,)
    Ai: Int1  # (nA,): the diagonal is the last entry of each column
    Lp: Int1  # (n + 1,): first entry of each column of L
    Li: Int1  # (nL,): rows of L
    Rp: Int1  # (n + 1,): first entry of each row of L
    Ri: Int1  # (nL,): columns of that row, ascending
    Rx: Int1  # (nL,): their places in the columns of L


@formula
def ldl_factor(P, A, L, D, Y):
    """Factor A into L and D (D holds the inverse diagonal). Returns 0, or 1 + the row of a zero pivot."""
    n = P.perm.shape[0]
    for k in range(n):
        last = P.Ap[k + 1] - 1
        d = A[last]
        for p in range(P.Ap[k], last):
            Y[P.Ai[p]] = A[p]
        for e in range(P.Rp[k], P.Rp[k + 1]):
            i = P.Ri[e]
            x = P.Rx[e]
            y = Y[i]
            Y[i] = 0.0
            for p in range(P.Lp[i], x):
                Y[P.Li[p]] -= L[p] * y
            l = y * D[i]
            d -= l * y
            L[x] = l
        if not nonzero(d):
            return 1 + k
        D[k] = 1.0 / d
    return 0


@formula
def ldl_solve(P, L, D, x):
    """Solve in place; x is in the factored order."""
    n = P.perm.shape[0]
    for k in range(n):
        v = x[k]
        for p in range(P.Lp[k], P.Lp[k + 1]):
            x[P.Li[p]] -= L[p] * v
    for k in range(n):
        x[k] *= D[k]
    for k in range(n - 1, -1, -1):
        v = x[k]
        for p in range(P.Lp[k], P.Lp[k + 1]):
            v -= L[p] * x[P.Li[p]]
        x[k] = v


COLUMNS = 8  # right-hand sides that `ldl_solve_columns` solves together: those of one cache line


@formula
def load_columns(x, k):
    """Row k of an array of `COLUMNS` columns."""
    return x[k, 0], x[k, 1], x[k, 2], x[k, 3], x[k, 4], x[k, 5], x[k, 6], x[k, 7]


@formula
def store_columns(x, k, a):
    """Write row k of an array of `COLUMNS` columns."""
    x[k, 0], x[k, 1], x[k, 2], x[k, 3], x[k, 4], x[k, 5], x[k, 6], x[k, 7] = a


@formula
def add_columns(a, l, b):
    """A + l b, for rows of `COLUMNS` entries."""
    return (
        a[0] + l * b[0],
        a[1] + l * b[1],
        a[2] + l * b[2],
        a[3] + l * b[3],
        a[4] + l * b[4],
        a[5] + l * b[5],
        a[6] + l * b[6],
        a[7] + l * b[7],
    )


@formula
def is_zero_row(a):
    """Whether all `COLUMNS` entries are zero."""
    return (a[0] == 0.0 and a[1] == 0.0 and a[2] == 0.0 and a[3] == 0.0 and a[4] == 0.0 and a[5] == 0.0
            and a[6] == 0.0 and a[7] == 0.0)  # fmt: skip


@formula
def ldl_solve_columns(P, L, D, x):
    """Solve for `COLUMNS` right-hand sides (n, COLUMNS) in place; x is in the factored order.

    Rows that are zero in all columns are skipped on the way forward: right-hand sides have few entries.
    """
    n, Lp, Li = P.perm.shape[0], P.Lp, P.Li
    zero = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    for k in range(n):
        v = load_columns(x, k)
        if is_zero_row(v):
            continue
        for p in range(Lp[k], Lp[k + 1]):
            store_columns(x, Li[p], add_columns(load_columns(x, Li[p]), -L[p], v))
    for k in range(n - 1, -1, -1):
        v = add_columns(zero, D[k], load_columns(x, k))
        for p in range(Lp[k], Lp[k + 1]):
            v = add_columns(v, -L[p], load_columns(x, Li[p]))
        store_columns(x, k, v)


def analyse_ldl(n: int, i: np.ndarray, j: np.ndarray, order: np.ndarray | None = None) -> tuple[LDLPattern, np.ndarray]:
    """Find an order of elimination and the pattern of L for a symmetric matrix with entries (i, j).

    Parameters
    ----------
    n : int
        Order of the matrix. The diagonal is always part of the pattern.
    i, j : ndarray of int
        Rows and columns of the entries, either triangle, repeats allowed.
    order : ndarray of int, optional
        Place of every unknown in the order of elimination; by default an order with little work.

    Returns
    -------
    LDLPattern
    place : ndarray of int
        Where each given entry goes in ``A``, followed by the places of the n diagonal entries.
    """
    i = np.r_[np.asarray(i, np.int64), np.arange(n)]
    j = np.r_[np.asarray(j, np.int64), np.arange(n)]
    L = _cheapest_order(n, i, j) if order is None else _lower_pattern(n, i, j, order)
    row, column = np.minimum(L.perm[i], L.perm[j]), np.maximum(L.perm[i], L.perm[j])
    keys, place = np.unique(column * n + row, return_inverse=True)
    Ap = np.r_[0, np.cumsum(np.bincount(keys // n, minlength=n))].astype(np.int64)
    by_row = np.argsort(L.Li, kind="stable")
    Ri = np.repeat(np.arange(n), np.diff(L.Lp))[by_row]
    Rp = np.r_[0, np.cumsum(np.bincount(L.Li, minlength=n))].astype(np.int64)
    P = LDLPattern(L.perm, Ap, (keys % n).astype(np.int64), L.Lp, L.Li, Rp, Ri, by_row.astype(np.int64))
    return P, place.astype(np.int64)


class LowerPattern(NamedTuple):
    """An order of elimination and the resulting pattern of L, by columns."""

    perm: np.ndarray
    Lp: np.ndarray
    Li: np.ndarray

    @property
    def work(self) -> float:
        """Number of multiplications of a factorisation."""
        column = np.diff(self.Lp).astype(float)
        return float((column * (column + 3.0)).sum() / 2.0)


def _cheapest_order(n: int, i: np.ndarray, j: np.ndarray) -> LowerPattern:
    """Choose the cheaper order: minimum degree, or nested dissection for large costly matrices."""
    L = _lower_pattern(n, i, j, minimum_degree(n, i, j))
    if n < DISSECTION_ORDER or L.work < DISSECTION_WORK * n:
        return L
    other = _lower_pattern(n, i, j, nested_dissection(n, i, j))
    return other if other.work < L.work else L


def _lower_pattern(n: int, i: np.ndarray, j: np.ndarray, perm: np.ndarray) -> LowerPattern:
    """Pattern of L: a column has the entries of A and of the columns whose first entry is in its row (Liu 1986)."""
    row, column = np.minimum(perm[i], perm[j]), np.maximum(perm[i], perm[j])
    order = np.argsort(row, kind="stable")
    start = np.searchsorted(row[order], np.arange(n + 1)).tolist()
    below = column[order].tolist()
    children: list[list[set[int]]] = [[] for _ in range(n)]
    columns: list[list[int]] = []
    for k in range(n):
        found = set(below[start[k] : start[k + 1]]).union(*children[k])
        children[k] = []
        found.discard(k)
        columns.append(sorted(found))
        if found:
            children[columns[-1][0]].append(found)
    Lp = np.r_[0, np.cumsum([len(c) for c in columns])].astype(np.int64)
    return LowerPattern(perm, Lp, np.fromiter(itertools.chain.from_iterable(columns), np.int64, Lp[-1]))


@kernel
def ldl_factor_kernel(P: LDLPattern, A: Float1, L: Float1, D: Float1, Y: Float1) -> None:
    """Factor a sparse symmetric matrix; see `ldl_factor`."""
    return ldl_factor(P, A, L, D, Y)


class LUPattern(NamedTuple):
    """Structure of A, L and U by rows, in the order of elimination; ascending columns, without diagonals of L, U."""

    perm: Int1  # (n,): place of unknown i in the order of elimination
    Ap: Int1  # (n + 1,)
    Aj: Int1  # (nA,)
    Lp: Int1  # (n + 1,)
    Lj: Int1  # (nL,)
    Up: Int1  # (n + 1,)
    Uj: Int1  # (nU,)
    twin: Int1  # (n,): 1 if the columns of row i of U are i + 1 and then those of row i + 1


@formula
def lu_factor(P, A, L, U, D, Y):
    """Factor A into L (unit diagonal), U and D (inverse diagonal of U). Returns 0, or 1 + the row that fails.

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
def sparse_product(P, A, x, out):
    """Write A x to ``out``, both in the factored order."""
    for k in range(P.perm.shape[0]):
        s = 0.0 * x[k]
        for p in range(P.Ap[k], P.Ap[k + 1]):
            s += A[p] * x[P.Aj[p]]
        out[k] = s


def analyse_lu(n: int, i: np.ndarray, j: np.ndarray, order: np.ndarray) -> tuple[LUPattern, np.ndarray]:
    """Find the pattern of the factors of a matrix with entries (i, j), and the place of each entry in ``A``.

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
    Ap, Aj = row_pointers(keys // n, n), (keys % n).astype(np.int64)
    room = 4 * len(Aj) + 64
    while True:
        Lp, Up = np.zeros(n + 1, np.int64), np.zeros(n + 1, np.int64)
        Lj, Uj = np.zeros(room, np.int64), np.zeros(room, np.int64)
        if lu_pattern(Ap, Aj, Lp, Lj, Up, Uj, np.zeros(n, np.int64)) == 0:
            break
        room *= 2
    Lj, Uj = Lj[: Lp[n]].copy(), Uj[: Up[n]].copy()
    twin = np.array([
        int(Up[k + 1] - Up[k] == Up[k + 2] - Up[k + 1] + 1 and Uj[Up[k]] == k + 1
            and np.array_equal(Uj[Up[k] + 1 : Up[k + 1]], Uj[Up[k + 1] : Up[k + 2]]))
        for k in range(n - 1)
    ] + [0], np.int64)  # fmt: skip
    return LUPattern(order, Ap, Aj, Lp, Lj, Up, Uj, twin), place[: len(place) - n].astype(np.int64)


def row_pointers(rows: np.ndarray, n: int) -> np.ndarray:
    """First entry of each row, (n + 1,), among entries sorted by row."""
    return np.r_[0, np.cumsum(np.bincount(rows, minlength=n))].astype(np.int64)


@kernel
def lu_pattern(Ap: Int1, Aj: Int1, Lp: Int1, Lj: Int1, Up: Int1, Uj: Int1, marks: Int1) -> int:
    """Find the patterns of L and U row by row. Returns 0, or 1 if the arrays are too short."""
    n = Ap.shape[0] - 1
    for k in range(n):
        nl, nu = Lp[k], Up[k]
        first, last = k, k
        for p in range(Ap[k], Ap[k + 1]):
            marks[Aj[p]] = k + 1
            first, last = min(first, Aj[p]), max(last, Aj[p])
        if nl + k - first > Lj.shape[0]:
            return 1
        for i in range(first, k):
            if marks[i] == k + 1:
                Lj[nl] = i
                nl += 1
                for q in range(Up[i], Up[i + 1]):
                    marks[Uj[q]] = k + 1
                    last = max(last, Uj[q])
        if nu + last - k > Uj.shape[0]:
            return 1
        for j in range(k + 1, last + 1):
            if marks[j] == k + 1:
                Uj[nu] = j
                nu += 1
        Lp[k + 1], Up[k + 1] = nl, nu
    return 0


def constrained_order(groups: np.ndarray, late: np.ndarray, i: np.ndarray, j: np.ndarray) -> np.ndarray:
    """Order unknowns by minimum degree, with some groups late; returns the place (n,) of each.

    Parameters
    ----------
    groups : (n,) of int
        The group of each unknown; a group is eliminated as a whole, its unknowns in their order.
    late : (groups,) of bool
        Whether a group is eliminated only after all its neighbours that are not late: multipliers after the bodies
        that their constraint rows involve.
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
