"""Newton's method on all three stages at once, with the Jacobian of each: where one Jacobian does not serve.

A mechanism that passes a singular position within a step has rows whose smallest singular value changes sign from one
stage to the next; with the Jacobian of the begin of the step the iteration then goes away from the solution.
"""

from __future__ import annotations

from ....compiler.formulas import formula
from ....math.scalar import sqrt
from ...lu import lu_factor, lu_solve, times
from .coefficients import GAMMA, INVERSE, C
from .step import STAGES, account, lead, rates, share

MOST = 12
REFINED = 6  # times that each solve is refined
AGAIN = 10.0  # what corrections may grow by
PLAIN, SOFT = -1, -2  # what a number is multiplied by, if not by an entry of A^-1 / h


@formula
def fill_whole(K, h):
    """The matrix of all stages."""
    A = K.whole_A
    for i in range(A.shape[0]):
        A[i] = 0.0
    for e in range(K.whole_put.shape[0]):
        x = K.J[K.whole_put[e, 1], K.whole_put[e, 2]]
        by = K.whole_put[e, 3]
        if by >= 0:
            x *= INVERSE[K.whole_put[e, 1]][by] / h
        elif by == SOFT:
            x *= h / GAMMA
        A[K.whole_put[e, 0]] += x


@formula
def solve_whole(K, h):
    """Solve for what stands in K.whole_x[0], refined against the matrix without its regularisation."""
    x = K.whole_x
    n = x.shape[1]
    for i in range(n):
        x[1, i] = x[0, i]
    lu_solve(K.whole_P, K.whole_L, K.whole_U, K.whole_D, x[0])
    for _ in range(REFINED if K.count.shared == 0 else 0):
        times(K.whole_P, K.whole_A, x[0], x[2])
        for e in range(K.whole_put.shape[0]):
            if K.whole_put[e, 3] == SOFT:
                i = K.whole_P.Aj[K.whole_put[e, 0]]
                x[2, i] -= h / GAMMA * K.J[K.whole_put[e, 1], K.whole_put[e, 2]] * x[0, i]
        for i in range(n):
            x[2, i] = x[1, i] - x[2, i]
        lu_solve(K.whole_P, K.whole_L, K.whole_U, K.whole_D, x[2])
        for i in range(n):
            x[0, i] += x[2, i]


@formula
def correct_whole(K, h):
    """One correction of all stage values. Returns its size in units of the tolerance."""
    nv, nr, nx = K.d.shape[1], K.lam.shape[1], K.tol_x.shape[0]
    n = 2 * nv + 2 * nr + nx
    perm = K.whole_P.perm
    for k in range(STAGES):
        for i in range(n):
            K.whole_x[0, perm[k * n + i]] = -K.out[k, i]
    solve_whole(K, h)
    s = 0.0
    for k in range(STAGES):
        for i in range(nv):
            x, y = K.whole_x[0, perm[k * n + i]], K.whole_x[0, perm[k * n + nv + i]]
            K.d[k, i] += x
            K.v[k, i] += y
            x /= K.tol[0, i]
            y /= K.tol[1, i]
            s += x * x + y * y
        for i in range(nr):
            K.lam[k, i] += K.whole_x[0, perm[k * n + 2 * nv + i]]
            K.mu[k, i] += K.whole_x[0, perm[k * n + 2 * nv + nr + i]]
        for i in range(nx):
            x = K.whole_x[0, perm[k * n + 2 * nv + 2 * nr + i]]
            K.z[k, i] += x
            x /= K.tol_x[i]
            s += x * x
    return sqrt(s / max(6 * nv + 3 * nx, 1))


@formula
def settle_whole(callbacks, S, K, c, h):
    """Newton's iteration. Returns a status, and the size of the first correction."""
    residual, linearise = callbacks
    last, moved = 1e300, 0.0
    for n in range(MOST):
        rates(K, h)
        for k in range(STAGES):
            t = c.real.t + C[k] * h
            if residual(t, k, S, K, c) != 0 or linearise(t, k, S, K, c) != 0:
                return 1, moved
        share(K, h)
        fill_whole(K, h)
        if lu_factor(K.whole_P, K.whole_A, K.whole_L, K.whole_U, K.whole_D, K.whole_Y) != 0:
            return 1, moved
        K.real.correction = size = correct_whole(K, h)
        K.count.whole += 1
        moved = size if n == 0 else moved
        if not size < 1e300 or (n > 1 and size > AGAIN * last):
            return 1, moved
        if size <= K.real.newton or (n > 0 and size * size / last <= K.real.newton and size < 0.1 * last):
            return 0, moved
        if n > 2 and 0.5 * last < size <= K.real.rough:
            return 0, moved
        last = size
    return 1, moved


@formula
def iterate_whole(callbacks, S, K, c, h):
    """Find the stage values. Returns a status."""
    more = lead(K, 0)
    status, moved = settle_whole(callbacks, S, K, c, h)
    pass_ = 0
    while status == 0 and more and (pass_ == 0 or moved > K.real.newton):
        pass_ += 1
        more = lead(K, pass_)
        status, moved = settle_whole(callbacks, S, K, c, h)
    return account(callbacks[0], S, K, c, h) if status == 0 else status
