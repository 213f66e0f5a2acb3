"""Sparse factor L U of a matrix of 6 x 6 blocks with a symmetric pattern, order and pattern found on the spot.

Which bodies touch changes from step to step, so the pattern is found in compiled code: minimum degree on the explicit
elimination graph (the fill is made as it arises; Rose 1972), then a right-looking factor whose inner products are of
fixed size. Blocks outside the diagonal stand by columns, rows of a column ascending in the order of elimination. There
is no pivoting: matrices here are 1 and something positive semidefinite, or not far from that.
"""

from __future__ import annotations

from ...compiler.formulas import formula

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
def factor_six(D, d):
    """Factor the block at d in place: unit L below, U above, its diagonal inverted. False if a pivot is 0 or nan."""
    for c in range(SIX):
        o = d + SIX * c
        if not abs(D[o + c]) > 0.0:
            return False
        inverse = 1.0 / D[o + c]
        D[o + c] = inverse
        for r in range(c + 1, SIX):
            b = d + SIX * r
            l = D[b + c] * inverse
            D[b + c] = l
            for k in range(c + 1, SIX):
                D[b + k] -= l * D[o + k]
    return True


@formula
def divide(L, e, D, d):
    """Block e becomes itself times the inverse of U at d."""
    for r in range(SIX):
        o = e + SIX * r
        for c in range(SIX):
            s = L[o + c]
            for k in range(c):
                s -= L[o + k] * D[d + SIX * k + c]
            L[o + c] = s * D[d + SIX * c + c]


@formula
def divide_above(L, e, u, D, d, symmetric):
    """Block u becomes the inverse of L at d times itself; for a symmetric matrix that is what `divide` made of e."""
    for r in range(SIX):
        o = u + SIX * r
        for c in range(SIX):
            if symmetric:
                L[o + c] = L[e + SIX * c + r] / D[d + SIX * r + r]
            else:
                for k in range(r):
                    L[o + c] -= D[d + SIX * r + k] * L[u + SIX * k + c]


@formula
def subtract_product(C, c, A, a, b):
    """Block c of C less block a of A times its block b."""
    for r in range(SIX):
        o, p = a + SIX * r, c + SIX * r
        a0, a1, a2, a3, a4, a5 = A[o], A[o + 1], A[o + 2], A[o + 3], A[o + 4], A[o + 5]
        for j in range(b, b + SIX):
            C[p + j - b] -= (
                a0 * A[j] + a1 * A[j + 6] + a2 * A[j + 12] + a3 * A[j + 18] + a4 * A[j + 24] + a5 * A[j + 30]
            )


@formula
def factor(n, Lp, Li, D, L, symmetric):
    """Factor in place; diagonal blocks in D by place, those below it in L, those above it behind them.

    Of a symmetric matrix what is above need not be filled. False if a pivot is 0.
    """
    above = BLOCK * Lp[n]
    for k in range(n):
        if not factor_six(D, BLOCK * k):
            return False
        last = Lp[k + 1]
        for e in range(Lp[k], last):
            divide(L, BLOCK * e, D, BLOCK * k)
            divide_above(L, BLOCK * e, above + BLOCK * e, D, BLOCK * k, symmetric)
        for e in range(Lp[k], last):
            subtract_product(D, BLOCK * Li[e], L, BLOCK * e, above + BLOCK * e)
            t = Lp[Li[e]]
            for f in range(e + 1, last):
                while Li[t] != Li[f]:
                    t += 1
                subtract_product(L, BLOCK * t, L, BLOCK * f, above + BLOCK * e)
                if not symmetric:
                    subtract_product(L, above + BLOCK * t, L, BLOCK * e, above + BLOCK * f)
    return True


@formula
def solve(n, Lp, Li, D, L, x):
    """Solve in place; x by places, six numbers each."""
    above = BLOCK * Lp[n]
    for k in range(n):
        d, o = BLOCK * k, SIX * k
        for r in range(SIX):
            for c in range(r):
                x[o + r] -= D[d + SIX * r + c] * x[o + c]
        for e in range(Lp[k], Lp[k + 1]):
            multiply(L, BLOCK * e, x, SIX * Li[e], o)
    for k in range(n - 1, -1, -1):
        d, o = BLOCK * k, SIX * k
        for e in range(Lp[k], Lp[k + 1]):
            multiply(L, above + BLOCK * e, x, o, SIX * Li[e])
        for r in range(SIX - 1, -1, -1):
            s = x[o + r]
            for c in range(r + 1, SIX):
                s -= D[d + SIX * r + c] * x[o + c]
            x[o + r] = s * D[d + SIX * r + r]


@formula
def multiply(L, e, x, i, j):
    """The six of x at i less block e times the six at j."""
    for r in range(SIX):
        o = e + SIX * r
        for c in range(SIX):
            x[i + r] -= L[o + c] * x[j + c]
