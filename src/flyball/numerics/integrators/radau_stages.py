"""Radau IIA of three stages, order 5: coefficients, simplified Newton iteration, error estimate, interpolation.

After Hairer and Wanner, *Solving Ordinary Differential Equations II* (1996), sections IV.5 and IV.8. Stage
values Z satisfy Z' = A^-1 Z / h at the places `RADAU_C`. A^-1 has one real eigenvalue GAMMA and a pair ALPHA +-
i BETA; T^-1 A^-1 T is in real blocks. The callback ``residual(t, h, k, S, K, c)`` fills row k of the residuals and
of the rates of integrals.

Newton's method works in the transformed form: (A^-1 / h x F' + I x F) dZ = -R becomes one real system with
GAMMA / h and one complex system with (ALPHA + i BETA) / h, with F' and F the Jacobians by rates and by states
at the start of a step. The diagonals of the constraints are regularised; the Newton iteration removes the effect of
the regularisation, with or without refinement of each solve.
"""

from __future__ import annotations

import numpy as np

from ...compiler.formulas import formula
from ...math.scalar import sqrt
from ..sparse_factorisation import lu_factor, lu_solve, sparse_product
from .implicit_workspace import STEP_START
from .time_loop import DISTANT_SIZE_WEIGHT

_ROOT = 6.0**0.5
RADAU_C = ((4.0 - _ROOT) / 10.0, (4.0 + _ROOT) / 10.0, 1.0)
_RADAU_A = np.array(
    [
        [(88 - 7 * _ROOT) / 360, (296 - 169 * _ROOT) / 1800, (-2 + 3 * _ROOT) / 225],
        [(296 + 169 * _ROOT) / 1800, (88 + 7 * _ROOT) / 360, (-2 - 3 * _ROOT) / 225],
        [(16 - _ROOT) / 36, (16 + _ROOT) / 36, 1 / 9],
    ]
)


def _as_rows(M: np.ndarray) -> tuple[tuple[float, ...], ...]:
    return tuple(tuple(map(float, row)) for row in M)


def _eigenvalue_blocks() -> tuple[float, complex, np.ndarray]:
    """Compute the real eigenvalue of A^-1, the complex one, and T: columns u, Re w, Im w of the eigenvectors."""
    values, vectors = np.linalg.eig(np.linalg.inv(_RADAU_A))
    k = int(np.argmin(np.abs(values.imag)))
    m = int(np.argmax(values.imag))
    u, w = vectors[:, k].real, vectors[:, m] / vectors[2, m]
    return float(values[k].real), complex(values[m]), np.column_stack([u / u[2], w.real, w.imag])


GAMMA, _complex_eigenvalue, _TRANSFORM = _eigenvalue_blocks()
ALPHA, BETA = _complex_eigenvalue.real, _complex_eigenvalue.imag
RADAU_A = _as_rows(_RADAU_A)
RADAU_A_INVERSE = _as_rows(np.linalg.inv(_RADAU_A))
TRANSFORM = _as_rows(_TRANSFORM)
TRANSFORM_INVERSE = _as_rows(np.linalg.inv(_TRANSFORM))
ERROR_WEIGHTS = (-(13.0 + 7.0 * _ROOT) / 3.0, (-13.0 + 7.0 * _ROOT) / 3.0, -1.0 / 3.0)
"""Weights of the error estimate: (GAMMA M - h J) err = h f(t0, y0) + M (ERROR_WEIGHTS . Z)."""
POLYNOMIAL_THROUGH_START = _as_rows(np.linalg.inv(np.array([[c, c**2, c**3] for c in RADAU_C])))
"""Coefficients of x, x^2, x^3 of the polynomial through 0 at x = 0 and stage values Z: rows times Z."""
POLYNOMIAL_THROUGH_STAGES = _as_rows(np.linalg.inv(np.array([[1.0, c, c**2] for c in RADAU_C])))
"""Coefficients of 1, x, x^2 of the polynomial through values at the stages: rows times these."""
_NODES = np.array([0.0, *RADAU_C])
THIRD_DIFFERENCE = tuple(float(1.0 / np.prod([a - b for b in _NODES if b != a])) for a in _NODES)
"""Weights of the third divided difference of values at the start of a step and its stages. The cubic through all
four is the parabola through the stages plus this times (x - c1) (x - c2) (x - 1)."""
CUBIC_INTEGRAL = tuple(np.polynomial.Polynomial.fromroots(RADAU_C).integ().coef[1:].tolist())
"""Integral of (x - c1) (x - c2) (x - 1) from 0 to x, over x: coefficients of 1, x, x^2, x^3. It is 0 at 1 (Radau)."""
CUBIC_INTEGRAL_MAX = float(
    np.abs(np.polynomial.Polynomial.fromroots(RADAU_C).integ()(np.linspace(0.0, 1.0, 1001))).max()
)
"""Largest absolute value of that integral within the step."""


TI0, TI1, TI2 = TRANSFORM_INVERSE
T0, T1, T2 = TRANSFORM

MAX_CORRECTION_GROWTH = 2.0  # largest ratio of two successive corrections of a converged Newton iteration
MAX_CONFIRMATIONS = 60  # maximum corrections in `confirm_convergence`: from x = 0 sqrt(x) takes 8, abs(x)**0.2 takes 30
NEWTON_DIVERGED = 1


@formula
def fill_matrix(K, A, scale):
    """Assemble the matrix F + scale F' from the Jacobian entries at the start of the step."""
    J = K.J[STEP_START]
    for i in range(A.shape[0]):
        A[i] = 0.0
    for e in range(K.part[0]):
        A[K.scatter[e, 0]] += J[K.scatter[e, 1]]
    for e in range(K.part[0], K.part[1]):
        A[K.scatter[e, 0]] += scale * J[K.scatter[e, 1]]
    back = 1.0 / scale
    for e in range(K.part[1], K.scatter.shape[0]):
        A[K.scatter[e, 0]] += back * J[K.scatter[e, 1]]


@formula
def factor_matrices(K, h):
    """Factor both matrices for steps of width h. Returns 0 on success."""
    fill_matrix(K, K.real_A, GAMMA / h)
    fill_matrix(K, K.pair_A, complex(ALPHA / h, BETA / h))
    K.count.factors += 1
    K.real.width = h
    status = lu_factor(K.P, K.real_A, K.real_L, K.real_U, K.real_D, K.real_Y)
    if status == 0:
        status = lu_factor(K.P, K.pair_A, K.pair_L, K.pair_U, K.pair_D, K.pair_Y)
    if status != 0:
        K.real.width = 0.0
    return status


@formula
def solve_refined(K, x, A, L, U, D, scale):
    """Solve for the right-hand side in x[0], in place; refined against the matrix without its regularisation."""
    n = x.shape[1]
    for i in range(n):
        x[1, i] = x[0, i]
    lu_solve(K.P, L, U, D, x[0])
    back = 1.0 / scale
    J = K.J[STEP_START]
    for _ in range(K.count.refine):
        sparse_product(K.P, A, x[0], x[2])
        for e in range(K.part[1], K.scatter.shape[0]):  # regularisation is on the diagonal only
            i = K.P.Aj[K.scatter[e, 0]]
            x[2, i] -= back * J[K.scatter[e, 1]] * x[0, i]
        for i in range(n):
            x[2, i] = x[1, i] - x[2, i]
        lu_solve(K.P, L, U, D, x[2])
        for i in range(n):
            x[0, i] += x[2, i]


@formula
def solve_real(K, h):
    """Solve with the real matrix for the right-hand side in K.x[0]."""
    solve_refined(K, K.x, K.real_A, K.real_L, K.real_U, K.real_D, GAMMA / h)


@formula
def add_transformed(K, i, j, base):
    """Add the transformed unknown j to entry i of the stage values ``base``."""
    a = K.x[0, j]
    b = K.w[0, j].real
    c = -K.w[0, j].imag
    base[0, i] += T0[0] * a + T0[1] * b + T0[2] * c
    base[1, i] += T1[0] * a + T1[1] * b + T1[2] * c
    base[2, i] += T2[0] * a + T2[1] * b + T2[2] * c


@formula
def correct_stages(K, h):
    """Correct all stage values once for the residuals in K.out. Returns the size of the correction."""
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
    solve_refined(K, K.w, K.pair_A, K.pair_L, K.pair_U, K.pair_D, complex(ALPHA / h, BETA / h))
    s = 0.0
    for i in range(nv):
        j, k = perm[i], perm[nv + i]
        x = K.x[0, j] / K.tol[0, i]
        y = K.x[0, k] / K.tol[1, i]
        p = K.w[0, j] / K.tol[0, i]
        r = K.w[0, k] / K.tol[1, i]
        s += x * x + y * y + p.real * p.real + p.imag * p.imag + r.real * r.real + r.imag * r.imag
        add_transformed(K, i, j, K.d)
        add_transformed(K, i, k, K.v)
    for i in range(nr):
        add_transformed(K, i, perm[2 * nv + i], K.lam)
        add_transformed(K, i, perm[2 * nv + nr + i], K.mu)
    nx = K.tol_x.shape[0]
    for i in range(nx):
        j = perm[2 * nv + 2 * nr + i]
        x, p = K.x[0, j] / K.tol_x[i], K.w[0, j] / K.tol_x[i]
        s += x * x + p.real * p.real + p.imag * p.imag
        add_transformed(K, i, j, K.z)
    return sqrt(s / max(6 * nv + 3 * nx, 1))


@formula
def update_jacobian(linearise, t, k, S, K, c):
    """Evaluate the Jacobian at stage k, or at the start of the step, into row STEP_START. Returns a status."""
    if linearise(t, k, S, K, c) != 0:
        return NEWTON_DIVERGED
    for e in range(K.J.shape[1] if k != STEP_START else 0):
        K.J[STEP_START, e] = K.J[k, e]
    K.count.jacobians += 1
    K.real.width = 0.0
    return 0


@formula
def confirm_convergence(correct_at_end, callbacks, S, K, c, h):
    """Continue with corrections that use the Jacobian at the end of the step. Returns a status.

    If the slope of a law is infinite (sqrt(x) at 0), corrections with it, and the error estimated with it, are nearly
    zero whatever the residual. Newton's method has converged once a small correction is not larger than the previous
    one. After a correction with a slope that is too steep they grow, each with the slope at the point the last one
    reached.
    """
    last = K.real.correction
    for _ in range(MAX_CONFIRMATIONS):
        status, size = correct_at_end(callbacks, S, K, c, h)
        if status != 0 or not size < 1e300:
            return NEWTON_DIVERGED
        small = (
            size <= K.real.newton or last < MAX_CORRECTION_GROWTH * size <= MAX_CORRECTION_GROWTH * K.real.rounding_size
        )
        if small and size <= MAX_CORRECTION_GROWTH * last:
            K.real.theta = 0.0
            return 0
        last = size
    return NEWTON_DIVERGED


MAX_ITERATIONS = 7  # Newton iterations
PROXIMAL_PASSES = 4  # maximum passes that shift the reference multipliers (`shift_proximal_point`)
STAGES = 3
MAX_CONTRACTION = 0.99  # contraction ratio above which the iteration has diverged
MAX_FIRST_GROWTH = 1e3  # largest ratio of the second correction to the first
ITERATION_DIVERGED, ITERATION_SLOW = 1, 2


@formula
def set_step_start(c, K):
    """Store the velocities at the start of the step, and compute the tolerances of the step from that state."""
    y = c.y.current
    nv = K.v.shape[1]
    nq = y.shape[0] - nv - K.z.shape[1]
    for i in range(nv):
        x = unit = 1.0
        if K.place[i] >= 0:
            x, unit = abs(y[K.place[i]]), c.y.unit[K.place[i]]
            x = max(min(x, unit), DISTANT_SIZE_WEIGHT * x)
        K.tol[0, i] = K.real.atol * unit + K.real.rtol * x
        K.v[STEP_START, i] = y[nq + i]
        K.tol[1, i] = K.real.atol * c.y.unit[nq + i] + K.real.rtol * abs(y[nq + i])
    for i in range(K.z.shape[1]):
        K.z[STEP_START, i] = y[nq + nv + i]
        K.rate[STEP_START, i] = c.K[0, nq + nv + i]
    for i in range(K.tol_x.shape[0]):
        K.tol_x[i] = K.real.atol * c.y.unit[nq + nv + i] + K.real.rtol * abs(K.z[STEP_START, i])


@formula
def predict_stages(K, h):
    """Predict the stages from the previous step; at the start of a segment velocities and x are constant."""
    nv = K.v.shape[1]
    for i in range(nv):
        for k in range(STAGES):
            K.v[k, i] = K.v[STEP_START, i]
        if K.count.before == 1:
            b1, b2, b3 = polynomial_through_start(K.previous_v, i, K.previous_v[STEP_START, i])
            for k in range(STAGES):
                x = 1.0 + RADAU_C[k] * h / K.real.last_h
                K.v[k, i] = K.previous_v[STEP_START, i] + x * (b1 + x * (b2 + x * b3))
    for i in range(nv):
        for k in range(STAGES):
            K.d[k, i] = h * (RADAU_A[k][0] * K.v[0, i] + RADAU_A[k][1] * K.v[1, i] + RADAU_A[k][2] * K.v[2, i])
    for i in range(K.lam.shape[1]):
        for k in range(STAGES):
            K.mu[k, i] = 0.0
            K.lam[k, i] = K.lam[STEP_START, i]
        if K.count.before == 1:
            for k in range(STAGES):
                K.lam[k, i] = polynomial_through_stages(K.previous_lam, i, 1.0 + RADAU_C[k] * h / K.real.last_h)
    for i in range(K.z.shape[1]):
        for k in range(STAGES):
            K.rate[k, i] = K.rate[STEP_START, i]
    for i in range(K.tol_x.shape[0]):
        for k in range(STAGES):
            K.z[k, i] = K.z[STEP_START, i]
        if K.count.before == 1:
            b1, b2, b3 = polynomial_through_start(K.previous_x, i, K.previous_x[STEP_START, i])
            for k in range(STAGES):
                x = 1.0 + RADAU_C[k] * h / K.real.last_h
                K.z[k, i] = K.previous_x[STEP_START, i] + x * (b1 + x * (b2 + x * b3))


@formula
def polynomial_through_start(stages, i, start):
    """Coefficients of x, x^2, x^3 of the polynomial through a start value and the stages, minus the start value."""
    a, b, c = stages[0, i] - start, stages[1, i] - start, stages[2, i] - start
    p, q, r = POLYNOMIAL_THROUGH_START
    return p[0] * a + p[1] * b + p[2] * c, q[0] * a + q[1] * b + q[2] * c, r[0] * a + r[1] * b + r[2] * c


@formula
def polynomial_through_stages(stages, i, x):
    """Evaluate at x the polynomial through the values at the stages."""
    a, b, c = stages[0, i], stages[1, i], stages[2, i]
    p, q, r = POLYNOMIAL_THROUGH_STAGES
    return (
        p[0] * a + p[1] * b + p[2] * c
        + x * (q[0] * a + q[1] * b + q[2] * c + x * (r[0] * a + r[1] * b + r[2] * c))
    )  # fmt: skip


@formula
def stage_rates(K, h):
    """Compute rates of increments, velocities and x at the stages, and integrals there, from the stage values."""
    for k in range(STAGES):
        a, b, c = RADAU_A_INVERSE[k]
        for i in range(K.v.shape[1]):
            v0 = K.v[STEP_START, i]
            K.dd[k, i] = (a * K.d[0, i] + b * K.d[1, i] + c * K.d[2, i]) / h
            K.a[k, i] = (a * (K.v[0, i] - v0) + b * (K.v[1, i] - v0) + c * (K.v[2, i] - v0)) / h
        for i in range(K.tol_x.shape[0]):
            x0 = K.z[STEP_START, i]
            K.xd[k, i] = (a * (K.z[0, i] - x0) + b * (K.z[1, i] - x0) + c * (K.z[2, i] - x0)) / h
    stage_integrals(K, h)


@formula
def stage_integrals(K, h):
    """Compute integrals over the motion at the stages from their rates there."""
    for k in range(STAGES):
        p, q, r = RADAU_A[k]
        for i in range(K.tol_x.shape[0], K.z.shape[1]):
            K.z[k, i] = K.z[STEP_START, i] + h * (p * K.rate[0, i] + q * K.rate[1, i] + r * K.rate[2, i])


@formula
def soften_redundant_rows(K, h):
    """Add the regularisation of the velocity rows, which selects minimum-norm multipliers of redundant rows.

    It is used if forces depend on multipliers. The rows become
    G v - nu + delta D h A (lam - K.proximal_point) = 0, which determines all multipliers.
    """
    first = K.count.shared
    if first > 0:
        nv = K.v.shape[1]
        for r in range(K.lam.shape[1]):
            size = h * K.J[STEP_START, first + r]
            x, y, z = (
                K.lam[0, r] - K.proximal_point[0, r],
                K.lam[1, r] - K.proximal_point[1, r],
                K.lam[2, r] - K.proximal_point[2, r],
            )
            for k in range(STAGES):
                a, b, c = RADAU_A[k]
                K.out[k, 2 * nv + r] += size * (a * x + b * y + c * z)


@formula
def shift_proximal_point(K, pass_):
    """Set the reference multipliers of `soften_redundant_rows`: zero in pass 0, then the current ones.

    Returns whether another pass may follow. The first pass takes the minimum-norm multipliers of redundant rows. Its
    regularisation has an effect, however: friction that depends on the multipliers can amplify it (a wedge on a wedge
    by 1e3). Each further pass from the multipliers of the previous one (proximal point: Rockafellar 1976; iterated
    regularisation: Hanke and Groetsch 1998) reduces this effect by another power and leaves the self-stress unchanged.
    """
    for r in range(K.lam.shape[1] if K.count.shared > 0 else 0):
        for k in range(STAGES):
            K.proximal_point[k, r] = K.lam[k, r] if pass_ > 0 else 0.0
    return K.count.shared > 0 and pass_ < PROXIMAL_PASSES


@formula
def solve_stages(residual, S, K, c, h):
    """Find the stage values. Returns (status, iterations, or the suggested factor of the width)."""
    more = shift_proximal_point(K, 0)
    status, asked, moved = iterate_newton(residual, S, K, c, h)
    pass_ = 0
    while status == 0 and more and (pass_ == 0 or moved > K.real.newton):
        pass_ += 1
        more = shift_proximal_point(K, pass_)
        status, again, moved = iterate_newton(residual, S, K, c, h)
        if status != 0 and not moved <= K.real.rounding_size:
            return status, again
        if status != 0:  # rounding in multipliers that redundant rows leave undetermined
            status, more = 0, False
    return update_integrals(residual, S, K, c, h) if status == 0 else status, asked


@formula
def iterate_newton(residual, S, K, c, h):
    """Run Newton's iteration. Returns (0, iterations) or (status, factor of the next width), and the first correction.

    The size of the first correction is in units of the tolerance.
    """
    found = 0
    rate = max(K.real.rate, 1e-16) ** 0.8
    theta = abs(K.real.theta)
    before = last = moved = 0.0
    for n in range(MAX_ITERATIONS):
        stage_rates(K, h)
        for k in range(STAGES):
            if residual(c.real.t + RADAU_C[k] * h, k, S, K, c) != 0:
                return ITERATION_DIVERGED, 0.5, moved
        soften_redundant_rows(K, h)
        K.real.correction = size = correct_stages(K, h)
        K.count.iterations += 1
        if not size < 1e300:
            return ITERATION_DIVERGED, 0.5, moved
        if n == 0:
            moved = size
        else:
            ratio = size / last
            theta = ratio if n == 1 or before >= MAX_CONTRACTION else sqrt(ratio * before)
            before = ratio
            if (
                n == 1 and MAX_CONTRACTION <= theta < MAX_FIRST_GROWTH
            ):  # the first one corrected multipliers, which are not measured
                last = size
                continue
            if not theta < MAX_CONTRACTION:
                if size <= K.real.newton:  # rounding
                    found = n + 1
                    break
                return ITERATION_DIVERGED, 0.5, moved
            rate = theta / (1.0 - theta)
            left = rate * size * theta ** (MAX_ITERATIONS - 2 - n) / K.real.newton
            if left >= 1.0:
                q = max(1e-4, min(20.0, left))
                return ITERATION_SLOW, 0.8 * q ** (-1.0 / (4.0 + MAX_ITERATIONS - 2 - n)), moved
        last = max(size, 1e-16)
        if rate * size <= K.real.newton and n + 1 >= K.count.least:
            found = n + 1
            break
    if found == 0:
        return ITERATION_SLOW, 0.5, moved
    K.real.rate, K.real.theta = rate, theta
    return 0, float(found), moved


@formula
def update_integrals(residual, S, K, c, h):
    """Compute integrals over the motion from their rates at the stage values found. Returns a status."""
    if K.z.shape[1] == K.tol_x.shape[0]:
        return 0
    stage_rates(K, h)
    for k in range(STAGES):
        if residual(c.real.t + RADAU_C[k] * h, k, S, K, c) != 0:
            return ITERATION_DIVERGED
    stage_integrals(K, h)
    return 0


@formula
def radau_error(residual, S, K, c, h):
    """Estimate the error of the step in units of the tolerance. Returns (status, error).

    The estimate is filtered once, also at the start of a motion. Filtering twice (Hairer and Wanner, IV.8.20) would let
    a step miss fast components, damped or not.
    """
    nv = K.v.shape[1]
    accounts = radau_integral_error(K, c, h)  # computed first: the rates at the start are overwritten below
    e, f, g = ERROR_WEIGHTS
    for i in range(nv):
        v0 = K.v[STEP_START, i]
        K.d[STEP_START, i] = 0.0
        K.dd[STEP_START, i] = -(e * K.d[0, i] + f * K.d[1, i] + g * K.d[2, i]) / h
        K.a[STEP_START, i] = -(e * (K.v[0, i] - v0) + f * (K.v[1, i] - v0) + g * (K.v[2, i] - v0)) / h
    for i in range(K.tol_x.shape[0]):
        x0 = K.z[STEP_START, i]
        K.xd[STEP_START, i] = -(e * (K.z[0, i] - x0) + f * (K.z[1, i] - x0) + g * (K.z[2, i] - x0)) / h
    for i in range(K.mu.shape[1]):
        K.mu[STEP_START, i] = 0.0
    status, size = filtered_error(residual, S, K, c, c.real.t, h)
    return status, max(size, accounts, elastic_error(K, h) if status == 0 else 0.0)


@formula
def elastic_error(K, h):
    """Error of velocities that the elastic energy of the increments' error can produce, in units of the tolerance.

    The filter removes oscillations that are too fast for the step from the velocities, but they persist if nothing
    damps them: v follows from e K e = v M v. Damping counts as additional inertia, h C / GAMMA.
    """
    nv = K.v.shape[1]
    perm = K.P.perm
    J, x, force, mass = K.J[STEP_START], K.x[0], K.x[1], K.x[2]
    for i in range(nv):
        force[i] = mass[i] = 0.0
    for e in range(K.spring.shape[0]):
        i, j = K.spring[e, 0], K.spring[e, 1]
        force[i] += J[K.spring[e, 2]] * x[perm[j]]
        if i == j:
            mass[i] = abs(J[K.spring[e, 3]]) + h / GAMMA * abs(J[K.spring[e, 4]])
    s = 0.0
    for i in range(nv):
        if mass[i] > 0.0:
            s += abs(x[perm[i]] * force[i]) / (mass[i] * K.tol[1, i] * K.tol[1, i])
    return sqrt(s / max(nv, 1))


@formula
def filtered_error(residual, S, K, c, t, h):
    """Solve with the real matrix for the residual in row STEP_START. Returns (status, size in tolerances)."""
    if residual(t, STEP_START, S, K, c) != 0:
        return 1, 0.0
    perm = K.P.perm
    nv, nx = K.v.shape[1], K.tol_x.shape[0]
    for i in range(perm.shape[0]):
        K.x[0, perm[i]] = -K.out[STEP_START, i]
    solve_real(K, h)
    s = 0.0
    for i in range(nv):
        x, y = K.x[0, perm[i]] / K.tol[0, i], K.x[0, perm[nv + i]] / K.tol[1, i]
        s += x * x + y * y
    for i in range(nx):
        x = K.x[0, perm[perm.shape[0] - nx + i]] / K.tol_x[i]
        s += x * x
    return 0, sqrt(s / max(2 * nv + nx, 1))


@formula
def restore_step_start(K, c):
    """Restore velocities and x at the start of the step in row STEP_START."""
    nv, nz = K.v.shape[1], K.z.shape[1]
    for i in range(nv):
        K.v[STEP_START, i] = c.y.current[c.y.shape[1] - nz - nv + i]
    for i in range(K.tol_x.shape[0]):
        K.z[STEP_START, i] = c.y.current[c.y.shape[1] - nz + i]


@formula
def radau_integral_error(K, c, h):
    """Error of the integrals in units of the tolerance, relative to the sum of their sizes and c.real.energy_size.

    The error within the step is used. At its end integrals are of higher order, like the state, but values within the
    step are also output; and a fast initial transient that the state forgets stays in its integrals.
    """
    size = c.real.energy_size
    for n in range(c.integrals.shape[0]):
        size += abs(c.y.current[c.integrals[n]])
    at = c.y.shape[1] - K.z.shape[1]
    s = 0.0
    for n in range(c.integrals.shape[0]):
        e = CUBIC_INTEGRAL_MAX * third_difference_of_rate(K, c.integrals[n] - at)
        s += e * e
    return h * sqrt(s / max(c.integrals.shape[0], 1)) / (K.real.rtol * size + 1e-300)


@formula
def third_difference_of_rate(K, i):
    """Third divided difference over the step of the rate of integral i, from its start and the stages."""
    return (
        THIRD_DIFFERENCE[0] * K.rate[STEP_START, i] + THIRD_DIFFERENCE[1] * K.rate[0, i]
        + THIRD_DIFFERENCE[2] * K.rate[1, i] + THIRD_DIFFERENCE[3] * K.rate[2, i]
    )  # fmt: skip


@formula
def radau_defect(residual, S, K, c, h, x):
    """Error that the residual of the polynomial at t + x h would cause if it lasted for the whole step.

    In units of the tolerance; huge if the equations cannot be evaluated there.
    """
    nv = K.v.shape[1]
    for i in range(nv):
        v0 = K.v[STEP_START, i]
        b1, b2, b3 = polynomial_through_start(K.d, i, 0.0)
        K.d[STEP_START, i] = x * (b1 + x * (b2 + x * b3))
        K.dd[STEP_START, i] = (b1 + x * (2.0 * b2 + x * 3.0 * b3)) / h
        b1, b2, b3 = polynomial_through_start(K.v, i, v0)
        K.v[STEP_START, i] = v0 + x * (b1 + x * (b2 + x * b3))
        K.a[STEP_START, i] = (b1 + x * (2.0 * b2 + x * 3.0 * b3)) / h
    for i in range(K.tol_x.shape[0]):
        b1, b2, b3 = polynomial_through_start(K.z, i, K.z[STEP_START, i])
        K.z[STEP_START, i] += x * (b1 + x * (b2 + x * b3))
        K.xd[STEP_START, i] = (b1 + x * (2.0 * b2 + x * 3.0 * b3)) / h
    for r in range(K.mu.shape[1]):
        K.lam[STEP_START, r] = polynomial_through_stages(K.lam, r, x)
    status, size = filtered_error(residual, S, K, c, c.real.t + x * h, h)
    restore_step_start(K, c)
    return max(size, elastic_error(K, h)) if status == 0 else 1e300


@formula
def interpolate_radau(K, x, h, d, v, z):
    """Interpolate increments, velocities and integrals at t + x h by the polynomial through the stages.

    Rates of integrals are interpolated through the start of the step too, K.rate[STEP_START].
    """
    for i in range(d.shape[0]):
        b1, b2, b3 = polynomial_through_start(K.d, i, 0.0)
        d[i] = x * (b1 + x * (b2 + x * b3))
        v0 = K.v[STEP_START, i]
        b1, b2, b3 = polynomial_through_start(K.v, i, v0)
        v[i] = v0 + x * (b1 + x * (b2 + x * b3))
    p, q, r = POLYNOMIAL_THROUGH_STAGES
    more = x * (CUBIC_INTEGRAL[0] + x * (CUBIC_INTEGRAL[1] + x * (CUBIC_INTEGRAL[2] + x * CUBIC_INTEGRAL[3])))
    nx = K.tol_x.shape[0]
    for i in range(nx):
        b1, b2, b3 = polynomial_through_start(K.z, i, K.z[STEP_START, i])
        z[i] = K.z[STEP_START, i] + x * (b1 + x * (b2 + x * b3))
    for i in range(nx, z.shape[0]):
        a, b, c = K.rate[0, i], K.rate[1, i], K.rate[2, i]
        s = p[0] * a + p[1] * b + p[2] * c
        s += x / 2.0 * (q[0] * a + q[1] * b + q[2] * c) + x * x / 3.0 * (r[0] * a + r[1] * b + r[2] * c)
        z[i] = K.z[STEP_START, i] + h * (x * s + more * third_difference_of_rate(K, i))
