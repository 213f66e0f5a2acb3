"""Simplified Newton of the three stages, in the transformed form of Hairer and Wanner (1996), section IV.8.

(A^-1 / h x F' + I x F) dZ = -R becomes one real system with GAMMA / h and one complex system with (ALPHA + i BETA) / h,
F' and F being the Jacobians by rates and by states where a step began. Diagonals of the constraints are regularised; a
Newton iteration takes that out again, with or without refinement of each solve.
"""

from __future__ import annotations

from ....compiler.formulas import formula
from ....math.scalar import sqrt
from ...lu import lu_factor, lu_solve, times
from .coefficients import ALPHA, BETA, GAMMA, T_INVERSE, T
from .desk import START

TI0, TI1, TI2 = T_INVERSE
T0, T1, T2 = T

GROWTH = 2.0  # what a correction may be larger by than the one before, if Newton's method has converged
MOST = 60  # corrections of `confirm`: from x = 0 sqrt(x) takes 8, abs(x)**0.2 takes 30
DIVERGED = 1


@formula
def fill(K, A, scale):
    """The matrix F + scale F' from the numbers of the Jacobian where the step begins."""
    J = K.J[START]
    for i in range(A.shape[0]):
        A[i] = 0.0
    for e in range(K.part[0]):
        A[K.put[e, 0]] += J[K.put[e, 1]]
    for e in range(K.part[0], K.part[1]):
        A[K.put[e, 0]] += scale * J[K.put[e, 1]]
    back = 1.0 / scale
    for e in range(K.part[1], K.put.shape[0]):
        A[K.put[e, 0]] += back * J[K.put[e, 1]]


@formula
def factor(K, h):
    """Factor both matrices for steps of width h. Returns 0, or not."""
    fill(K, K.real_A, GAMMA / h)
    fill(K, K.pair_A, complex(ALPHA / h, BETA / h))
    K.count.factors += 1
    K.real.width = h
    status = lu_factor(K.P, K.real_A, K.real_L, K.real_U, K.real_D, K.real_Y)
    if status == 0:
        status = lu_factor(K.P, K.pair_A, K.pair_L, K.pair_U, K.pair_D, K.pair_Y)
    if status != 0:
        K.real.width = 0.0
    return status


@formula
def solve(K, x, A, L, U, D, scale):
    """Solve for the right-hand side in x[0], in place; refined against the matrix without its regularisation."""
    n = x.shape[1]
    for i in range(n):
        x[1, i] = x[0, i]
    lu_solve(K.P, L, U, D, x[0])
    back = 1.0 / scale
    J = K.J[START]
    for _ in range(K.count.refine):
        times(K.P, A, x[0], x[2])
        for e in range(K.part[1], K.put.shape[0]):  # these stand on the diagonal alone
            i = K.P.Aj[K.put[e, 0]]
            x[2, i] -= back * J[K.put[e, 1]] * x[0, i]
        for i in range(n):
            x[2, i] = x[1, i] - x[2, i]
        lu_solve(K.P, L, U, D, x[2])
        for i in range(n):
            x[0, i] += x[2, i]


@formula
def solve_real(K, h):
    """Solve with the real matrix for what stands in K.x[0]."""
    solve(K, K.x, K.real_A, K.real_L, K.real_U, K.real_D, GAMMA / h)


@formula
def put_part(K, i, j, base):
    """Add the transformed unknown j to entry i of the stage values ``base``."""
    a = K.x[0, j]
    b = K.w[0, j].real
    c = -K.w[0, j].imag
    base[0, i] += T0[0] * a + T0[1] * b + T0[2] * c
    base[1, i] += T1[0] * a + T1[1] * b + T1[2] * c
    base[2, i] += T2[0] * a + T2[1] * b + T2[2] * c


@formula
def correct(K, h):
    """One correction of all stage values for what the equations miss in K.out. Returns its size."""
    nv = K.d.shape[1]
    nr = K.lam.shape[1]
    perm = K.P.perm
    out = K.out
    for i in range(perm.shape[0]):
        j = perm[i]
        K.x[0, j] = -(TI0[0] * out[0, i] + TI0[1] * out[1, i] + TI0[2] * out[2, i])
        b = TI1[0] * out[0, i] + TI1[1] * out[1, i] + TI1[2] * out[2, i]
        c = TI2[0] * out[0, i] + TI2[1] * out[1, i] + TI2[2] * out[2, i]
        K.w[0, j] = complex(-b, c)
    solve_real(K, h)
    solve(K, K.w, K.pair_A, K.pair_L, K.pair_U, K.pair_D, complex(ALPHA / h, BETA / h))
    s = 0.0
    for i in range(nv):
        j, k = perm[i], perm[nv + i]
        x = K.x[0, j] / K.tol[0, i]
        y = K.x[0, k] / K.tol[1, i]
        p = K.w[0, j] / K.tol[0, i]
        r = K.w[0, k] / K.tol[1, i]
        s += x * x + y * y + p.real * p.real + p.imag * p.imag + r.real * r.real + r.imag * r.imag
        put_part(K, i, j, K.d)
        put_part(K, i, k, K.v)
    for i in range(nr):
        put_part(K, i, perm[2 * nv + i], K.lam)
        put_part(K, i, perm[2 * nv + nr + i], K.mu)
    nx = K.tol_x.shape[0]
    for i in range(nx):
        j = perm[2 * nv + 2 * nr + i]
        x, p = K.x[0, j] / K.tol_x[i], K.w[0, j] / K.tol_x[i]
        s += x * x + p.real * p.real + p.imag * p.imag
        put_part(K, i, j, K.z)
    return sqrt(s / max(6 * nv + 3 * nx, 1))


@formula
def renew(linearise, t, k, S, K, c):
    """Put the Jacobian at stage k, or where the step begins, into row START. Returns a status."""
    if linearise(t, k, S, K, c) != 0:
        return DIVERGED
    for e in range(K.J.shape[1] if k != START else 0):
        K.J[START, e] = K.J[k, e]
    K.count.jacobians += 1
    K.real.width = 0.0
    return 0


@formula
def confirm(correct_at_end, callbacks, S, K, c, h):
    """Go on by corrections with the Jacobian at the end of the step. Returns a status.

    Where the slope of a law may be infinite (sqrt(x) at 0) corrections by it, and the error estimated with it, are next
    to nothing whatever the equations miss. Newton's method has converged once a correction that is small has not grown
    over the one before: from too steep a slope they grow, each with the slope of where the last one has led.
    """
    last = K.real.correction
    for _ in range(MOST):
        status, size = correct_at_end(callbacks, S, K, c, h)
        if status != 0 or not size < 1e300:
            return DIVERGED
        small = size <= K.real.newton or last < GROWTH * size <= GROWTH * K.real.rough
        if small and size <= GROWTH * last:
            K.real.theta = 0.0
            return 0
        last = size
    return DIVERGED
