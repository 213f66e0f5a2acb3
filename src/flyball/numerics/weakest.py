"""The weakest combinations of the rows of a sparse matrix H (n, m), by inverse iteration with one factor of H H^T.

Of a block of vectors all but the last are to be dependencies, x with x H = 0; the last then turns to the combination
with the least singular value that is none. Each multiplication with (H H^T)^-1 makes the weakest grow most; they are
kept orthogonal, and as many as are dependencies are improved with the true residual x H, which the square in H H^T
would blur (Golub and Van Loan 2013, sections 7.3 and 8.2).
"""

from __future__ import annotations

from ..compiler.formulas import formula
from .ldl import ldl_solve

MOST, LEAST = 50, 2  # iterations
SAME = 1e-4  # change of a singular value, of itself, at which its iteration ends
IMPROVED = 2  # times that a dependency is


@formula
def across(row_p, col_i, H, x, w):
    """Leave x H in w; returns its square."""
    for d in range(w.shape[0]):
        w[d] = 0.0
    for k in range(x.shape[0]):
        for e in range(row_p[k], row_p[k + 1]):
            w[col_i[e]] += H[e] * x[k]
    s = 0.0
    for d in range(w.shape[0]):
        s += w[d] * w[d]
    return s


@formula
def strongest(row_p, col_i, H, y, w):
    """The largest singular value, by multiplications of y with H H^T; y is to go on from one matrix to the next."""
    value = 0.0
    for _ in range(MOST):
        size = 0.0
        for k in range(y.shape[0]):
            size += y[k] * y[k]
        size = size**0.5
        for k in range(y.shape[0]):
            y[k] /= size
        before = value
        value = across(row_p, col_i, H, y, w) ** 0.5
        for k in range(y.shape[0]):
            y[k] = times(row_p, col_i, H, w, k)
        if abs(before - value) <= SAME * value:
            break
    return value


@formula
def times(row_p, col_i, H, w, k):
    """Row k of H times w."""
    s = 0.0
    for e in range(row_p[k], row_p[k + 1]):
        s += H[e] * w[col_i[e]]
    return s


@formula
def inverted(P, L, D, x, z):
    """x becomes (H H^T)^-1 x; ``z`` is scratch."""
    for k in range(x.shape[0]):
        z[P.perm[k]] = x[k]
    ldl_solve(P, L, D, z)
    for k in range(x.shape[0]):
        x[k] = z[P.perm[k]]


@formula
def improve(P, L, D, row_p, col_i, H, x, w, z):
    """Take off x what its residual x H says that is no dependency."""
    across(row_p, col_i, H, x, w)
    for k in range(x.shape[0]):
        z[P.perm[k]] = times(row_p, col_i, H, w, k)
    ldl_solve(P, L, D, z)
    for k in range(x.shape[0]):
        x[k] -= z[P.perm[k]]


@formula
def orthonormal(X, i):
    """Make vector i orthogonal to those before it, twice since rounding is magnified, and of unit length."""
    n = X.shape[1]
    for _ in range(2):
        s = 0.0
        for k in range(n):
            s += X[i, k] * X[i, k]
        s = 1.0 / s**0.5 if s > 0.0 else 0.0
        for k in range(n):
            X[i, k] *= s
        for j in range(i):
            s = 0.0
            for k in range(n):
                s += X[i, k] * X[j, k]
            for k in range(n):
                X[i, k] -= s * X[j, k]
    s = 0.0
    for k in range(n):
        s += X[i, k] * X[i, k]
    s = 1.0 / s**0.5 if s > 0.0 else 0.0
    for k in range(n):
        X[i, k] *= s


@formula
def weakest(P, L, D, row_p, col_i, H, X, w, z):
    """Turn the rows of X to the weakest combinations; ``w`` (m,) and ``z`` (n,) are scratch.

    Returns (singular value of the last one, the largest of those of the others, which are to be dependencies).
    """
    last = X.shape[0] - 1
    value = 1e300
    for turn in range(MOST):
        for i in range(last + 1):
            inverted(P, L, D, X[i], z)
            orthonormal(X, i)
        before = value
        value = across(row_p, col_i, H, X[last], w) ** 0.5
        if turn >= LEAST and abs(before - value) <= SAME * value:
            break
    largest = 0.0
    for i in range(last):
        for _ in range(IMPROVED):
            improve(P, L, D, row_p, col_i, H, X[i], w, z)
        orthonormal(X, i)
        largest = max(largest, across(row_p, col_i, H, X[i], w) ** 0.5)
    return value, largest
