"""Sparse Cholesky factor of a symmetric positive definite matrix of 6 x 6 blocks, order and pattern found on the spot.

Which bodies touch changes from step to step, so the pattern is found in compiled code: minimum degree on the explicit
elimination graph (the fill is made as it arises; Rose 1972), then a right-looking factor whose inner products are of
fixed size. Blocks outside the diagonal stand by columns, rows of a column ascending in the order of elimination.
"""

from __future__ import annotations

from ...compiler.jit import formula

SIX, BLOCK = 6, 36


@formula
def join(pool, start, length, room, i, j, top, size):
    """Put j among the neighbours of i (known not to be there); returns the pool's new top, or -1 if it is full."""
    if length[i] == room[i]:
        if top + 2 * room[i] + 4 > size:
            return -1
        for k in range(length[i]):
            pool[top + k] = pool[start[i] + k]
        start[i] = top
        room[i] = 2 * room[i] + 4
        top += room[i]
    pool[start[i] + length[i]] = j
    length[i] += 1
    return top


@formula
def eliminate(n, pool, start, length, room, mark, place, order, top, size):
    """Minimum degree: what is left of each node's neighbours when it is eliminated is its column. -1: pool is full.

    ``mark`` holds 0 on entry for every node; ``place`` -1 for every node that is not eliminated yet.
    """
    stamp = 0
    for k in range(n):
        best = -1
        for i in range(n):
            if place[i] < 0 and (best < 0 or length[i] < length[best]):
                best = i
        place[best] = k
        order[k] = best
        for a in range(length[best]):
            i = pool[start[best] + a]
            stamp += 1
            mark[i] = stamp
            kept = 0
            for b in range(length[i]):
                j = pool[start[i] + b]
                if j != best:
                    pool[start[i] + kept] = j
                    mark[j] = stamp
                    kept += 1
            length[i] = kept
            for b in range(length[best]):
                j = pool[start[best] + b]
                if mark[j] != stamp:
                    top = join(pool, start, length, room, i, j, top, size)
                    if top < 0:
                        return -1
    return top


@formula
def columns(n, pool, start, length, place, order, Lp, Li):
    """Columns of the factor in the order of elimination, rows as places, ascending."""
    Lp[0] = 0
    for k in range(n):
        i = order[k]
        first = Lp[k]
        for a in range(length[i]):
            row = place[pool[start[i] + a]]
            e = first + a
            while e > first and Li[e - 1] > row:
                Li[e] = Li[e - 1]
                e -= 1
            Li[e] = row
        Lp[k + 1] = first + length[i]


@formula
def entry_of(Lp, Li, row, column):
    """Which block (row, column) is, row > column, both places."""
    for e in range(Lp[column], Lp[column + 1]):
        if Li[e] == row:
            return e
    return -1


@formula
def cholesky_six(D, d):
    """Factor the block at d in place: L below, its diagonal inverted. False if a pivot is not positive."""
    for c in range(SIX):
        s = D[d + SIX * c + c]
        for k in range(c):
            s -= D[d + SIX * c + k] * D[d + SIX * c + k]
        if not s > 0.0:
            return False
        s = 1.0 / s**0.5
        D[d + SIX * c + c] = s
        for r in range(c + 1, SIX):
            t = D[d + SIX * r + c]
            for k in range(c):
                t -= D[d + SIX * r + k] * D[d + SIX * c + k]
            D[d + SIX * r + c] = t * s
    return True


@formula
def divide(L, e, D, d):
    """Block e of L becomes itself times the transposed inverse of the factor at d."""
    for r in range(SIX):
        for c in range(SIX):
            s = L[e + SIX * r + c]
            for k in range(c):
                s -= L[e + SIX * r + k] * D[d + SIX * c + k]
            L[e + SIX * r + c] = s * D[d + SIX * c + c]


@formula
def subtract_product(C, c, A, a, b):
    """Block c of C less block a of A times the transpose of its block b."""
    for r in range(SIX):
        a0, a1, a2 = A[a + SIX * r], A[a + SIX * r + 1], A[a + SIX * r + 2]
        a3, a4, a5 = A[a + SIX * r + 3], A[a + SIX * r + 4], A[a + SIX * r + 5]
        for j in range(SIX):
            o = b + SIX * j
            C[c + SIX * r + j] -= (
                a0 * A[o] + a1 * A[o + 1] + a2 * A[o + 2] + a3 * A[o + 3] + a4 * A[o + 4] + a5 * A[o + 5]
            )


@formula
def factor(n, Lp, Li, D, L):
    """Factor in place; diagonal blocks in D by place, the others in L. False if the matrix is not positive definite."""
    for k in range(n):
        if not cholesky_six(D, BLOCK * k):
            return False
        for e in range(Lp[k], Lp[k + 1]):
            divide(L, BLOCK * e, D, BLOCK * k)
        for e in range(Lp[k], Lp[k + 1]):
            column = Li[e]
            subtract_product(D, BLOCK * column, L, BLOCK * e, BLOCK * e)
            t = Lp[column]
            for f in range(e + 1, Lp[k + 1]):
                while Li[t] != Li[f]:
                    t += 1
                subtract_product(L, BLOCK * t, L, BLOCK * f, BLOCK * e)
    return True


@formula
def solve(n, Lp, Li, D, L, x):
    """Solve in place; x by places, six numbers each."""
    for k in range(n):
        d, o = BLOCK * k, SIX * k
        for r in range(SIX):
            s = x[o + r]
            for c in range(r):
                s -= D[d + SIX * r + c] * x[o + c]
            x[o + r] = s * D[d + SIX * r + r]
        for e in range(Lp[k], Lp[k + 1]):
            i, b = SIX * Li[e], BLOCK * e
            for r in range(SIX):
                s = x[i + r]
                for c in range(SIX):
                    s -= L[b + SIX * r + c] * x[o + c]
                x[i + r] = s
    for k in range(n - 1, -1, -1):
        d, o = BLOCK * k, SIX * k
        for e in range(Lp[k], Lp[k + 1]):
            i, b = SIX * Li[e], BLOCK * e
            for c in range(SIX):
                s = x[o + c]
                for r in range(SIX):
                    s -= L[b + SIX * r + c] * x[i + r]
                x[o + c] = s
        for r in range(SIX - 1, -1, -1):
            s = x[o + r]
            for c in range(r + 1, SIX):
                s -= D[d + SIX * c + r] * x[o + c]
            x[o + r] = s * D[d + SIX * r + r]
