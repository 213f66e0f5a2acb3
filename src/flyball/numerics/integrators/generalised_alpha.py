"""The generalised-alpha method on Lie groups, of order 2, at fixed steps, with constraints.

Chung and Hulbert (1993); for mechanisms Arnold and Bruels (2007), Bruels, Cardona and Arnold (2012); stabilised
index 2 by Arnold, Cardona and Bruels (2015), "A Lie algebra approach to Lie group time integration of
constrained systems":

    q1 = q0 exp(h (v0 + (1/2 - beta) h a0 + beta h a1 + D G^T mu)),  v1 = v0 + (1 - gamma) h a0 + gamma h a1,
    (1 - am) a1 + am a0 = (1 - af) v1' + af v0',  r(t1, q1, v1, v1', lam1) = 0,  G v1 = nu,  g = 0

States of first order, x' = f, are treated like velocities (Bruels and Golinval 2006, "The generalized-alpha
method in mechatronic applications"); they are the last columns of ``past``.

a is the acceleration at t + (am - af) h. The spectral radius at infinite frequency, rho, determines am, af, beta
and gamma. Callbacks: residual, linearise, compose, arrive, inspect as for `radau`; ``straight(d, out, S)``,
which converts increments to those of constant velocity; and an ``arrive`` for states within a step.
"""

from __future__ import annotations

from ...compiler.formulas import formula
from ...math.scalar import sqrt
from ..sparse_factorisation import lu_factor
from .implicit_method import END_ACCELERATION, END_ROW, START_ACCELERATION, integrate_by_trapezoids
from .implicit_method import accept_fixed_step as enter_step
from .implicit_workspace import STEP_START
from .radau_stages import confirm_convergence, solve_refined, update_jacobian
from .radau_stages import set_step_start as tolerances

# rows of past: a and v' at the start of the step; a at its end; v'' at the start of a segment
ALGORITHMIC_ACCELERATION, TRUE_ACCELERATION, NEXT_ALGORITHMIC, ACCELERATION_RATE = range(4)
RATE_STEP_FRACTION = 1e-3  # part of a step over which the rate of accelerations is computed at the start of a segment
MAX_ITERATIONS, MAX_FULL_ITERATIONS = 10, 25  # iterations: with one Jacobian, and with a new one in each
MAX_CONTRACTION = 0.5  # contraction ratio above which each iteration evaluates its own Jacobian
JACOBIAN_REUSE_RATE = 0.02  # contraction ratio below which the Jacobian is reused
DIVERGED = 1


@formula
def alpha_coefficients(rho):
    """Coefficients (alpha_m, alpha_f, beta, gamma) for a spectral radius at infinity (Chung and Hulbert 1993)."""
    am = (2.0 * rho - 1.0) / (rho + 1.0)
    af = rho / (rho + 1.0)
    gamma = 0.5 - am + af
    return am, af, 0.25 * (gamma + 0.5) ** 2, gamma


@formula
def begin_alpha(callbacks, S, K, c):
    """Initialise the stored accelerations and their rate at the start of a segment."""
    compose, arrive = callbacks[2], callbacks[6]
    nv = K.v.shape[1]
    at = c.y.shape[1] - K.z.shape[1] - nv
    ahead = RATE_STEP_FRACTION * c.real.step
    for i in range(nv):
        K.d[STEP_START, i] = ahead * c.y.current[at + i]
        K.v[STEP_START, i] = c.y.current[at + i] + ahead * c.K[0, at + i]
    for i in range(K.z.shape[1]):
        K.z[STEP_START, i] = c.y.current[at + nv + i] + (ahead * c.K[0, at + nv + i] if i < K.tol_x.shape[0] else 0.0)
    compose(c.y.current, K.d[STEP_START], K.v[STEP_START], K.z[STEP_START], c.y.saved, S)
    status, _ = arrive(c.real.t + ahead, c.y.saved, c.y.saved_rate, S, K)
    for i in range(nv + K.tol_x.shape[0]):  # x follows the velocities
        K.past[TRUE_ACCELERATION, i] = c.K[0, at + i]
        K.past[ACCELERATION_RATE, i] = (c.y.saved_rate[at + i] - c.K[0, at + i]) / ahead if status == 0 else 0.0


@formula
def scale_start_accelerations(K, h):
    """Write the accelerations a at the start of a step of width h to K.a[STEP_START]; their rate does not change."""
    am, af, _, _ = alpha_coefficients(K.rho[0])
    nv = K.v.shape[1]
    for i in range(nv + K.tol_x.shape[0]):
        a = K.past[ALGORITHMIC_ACCELERATION, i]
        if K.count.before == 0:
            a = K.past[TRUE_ACCELERATION, i] + (am - af) * h * K.past[ACCELERATION_RATE, i]
        elif h != K.real.last_h:
            a = K.past[TRUE_ACCELERATION, i] + (a - K.past[TRUE_ACCELERATION, i]) * (h / K.real.last_h)
        if i < nv:
            K.a[STEP_START, i] = a
        else:
            K.xd[STEP_START, i - nv] = a


@formula
def end_rates(callbacks, S, K, h):
    """Compute the rates at the end of the step from the values there."""
    am, af, beta, gamma = alpha_coefficients(K.rho[0])
    straight = callbacks[5]
    straight(K.d[END_ROW], K.dd[END_ROW], S)
    for i in range(K.v.shape[1]):
        v0, a0 = K.v[STEP_START, i], K.a[STEP_START, i]
        a1 = (K.v[END_ROW, i] - v0) / (gamma * h) - (1.0 - gamma) / gamma * a0
        K.past[NEXT_ALGORITHMIC, i] = a1
        K.a[END_ROW, i] = ((1.0 - am) * a1 + am * a0 - af * K.past[TRUE_ACCELERATION, i]) / (1.0 - af)
        K.dd[END_ROW, i] = gamma / beta * (K.dd[END_ROW, i] / h - v0 - h * (0.5 - beta / gamma) * a0) + v0
    nv, nx = K.v.shape[1], K.tol_x.shape[0]
    for i in range(nx):
        w0 = K.xd[STEP_START, i]
        w1 = (K.z[END_ROW, i] - K.z[STEP_START, i]) / (gamma * h) - (1.0 - gamma) / gamma * w0
        K.past[NEXT_ALGORITHMIC, nv + i] = w1
        K.xd[END_ROW, i] = ((1.0 - am) * w1 + am * w0 - af * K.past[TRUE_ACCELERATION, nv + i]) / (1.0 - af)
    for i in range(nx, K.z.shape[1]):
        K.z[END_ROW, i] = K.z[STEP_START, i] + 0.5 * h * (K.rate[STEP_START, i] + K.rate[END_ROW, i])


@formula
def predict_end(K, h):
    """Predict the end of the step with constant accelerations and multipliers."""
    for i in range(K.v.shape[1]):
        K.v[END_ROW, i] = K.v[STEP_START, i] + h * K.a[STEP_START, i]
        K.d[END_ROW, i] = h * (K.v[STEP_START, i] + 0.5 * h * K.a[STEP_START, i])
    for r in range(K.lam.shape[1]):
        K.lam[END_ROW, r] = K.lam[STEP_START, r]
        K.mu[END_ROW, r] = 0.0
    for i in range(K.z.shape[1]):
        K.rate[END_ROW, i] = K.rate[STEP_START, i]
    for i in range(K.tol_x.shape[0]):
        K.z[END_ROW, i] = K.z[STEP_START, i] + h * K.xd[STEP_START, i]


@formula
def factor_alpha_matrix(K, h):
    """Factor F + F' scaled by the changes of rates per increment and velocity. Returns 0 on success."""
    am, af, beta, gamma = alpha_coefficients(K.rho[0])
    scale = (1.0 - am) / ((1.0 - af) * gamma * h)
    A, J = K.real_A, K.J[STEP_START]
    for i in range(A.shape[0]):
        A[i] = 0.0
    for e in range(K.part[0]):
        A[K.scatter[e, 0]] += J[K.scatter[e, 1]]
    for e in range(K.part[0], K.part[1]):
        by = gamma / (beta * h) if e - K.part[0] < K.v.shape[1] else scale
        A[K.scatter[e, 0]] += by * J[K.scatter[e, 1]]
    for e in range(K.part[1], K.scatter.shape[0]):
        A[K.scatter[e, 0]] += J[K.scatter[e, 1]] / scale
    K.count.factors += 1
    K.real.width = h
    status = lu_factor(K.P, A, K.real_L, K.real_U, K.real_D, K.real_Y)
    if status != 0:
        K.real.width = 0.0
    return status


@formula
def correct_end(K, h):
    """Correct the end once for the residuals in K.out. Returns the correction's size in units of the tolerance."""
    am, af, _, gamma = alpha_coefficients(K.rho[0])
    nv, nr, perm = K.v.shape[1], K.lam.shape[1], K.P.perm
    for i in range(perm.shape[0]):
        K.x[0, perm[i]] = -K.out[END_ROW, i]
    solve_refined(K, K.x, K.real_A, K.real_L, K.real_U, K.real_D, (1.0 - am) / ((1.0 - af) * gamma * h))
    s = 0.0
    for i in range(nv):
        x, y = K.x[0, perm[i]], K.x[0, perm[nv + i]]
        K.d[END_ROW, i] += x
        K.v[END_ROW, i] += y
        x /= K.tol[0, i]
        y /= K.tol[1, i]
        s += x * x + y * y
    for r in range(nr):
        K.lam[END_ROW, r] += K.x[0, perm[2 * nv + r]]
        K.mu[END_ROW, r] += K.x[0, perm[2 * nv + nr + r]]
    nx = K.tol_x.shape[0]
    for i in range(nx):
        x = K.x[0, perm[2 * nv + 2 * nr + i]]
        K.z[END_ROW, i] += x
        x /= K.tol_x[i]
        s += x * x
    return sqrt(s / max(2 * nv + nx, 1))


@formula
def end_residual(callbacks, S, K, c, h):
    """Evaluate the residual at the end of the step into its row. Returns a status."""
    end_rates(callbacks, S, K, h)
    return callbacks[0](c.real.t + h, END_ROW, S, K, c)


@formula
def correct_with_new_jacobian(callbacks, S, K, c, h):
    """Correct once with the Jacobian of the end of the step. Returns a status, and the size of the correction."""
    if end_residual(callbacks, S, K, c, h) != 0:
        return DIVERGED, 0.0
    if update_jacobian(callbacks[1], c.real.t + h, END_ROW, S, K, c) != 0 or factor_alpha_matrix(K, h) != 0:
        return DIVERGED, 0.0
    return 0, correct_end(K, h)


@formula
def solve_step_end(callbacks, S, K, c, h, whole):
    """Solve for the end of the step; ``whole``: with a new Jacobian in every iteration. Returns a status."""
    last = rate = 1.0
    predict_end(K, h)
    for n in range(MAX_FULL_ITERATIONS if whole else MAX_ITERATIONS):
        if whole:
            status, size = correct_with_new_jacobian(callbacks, S, K, c, h)
        else:
            status = end_residual(callbacks, S, K, c, h)
            size = correct_end(K, h) if status == 0 else 0.0
        if whole:
            K.count.whole += 1
        else:
            K.count.iterations += 1
        if status != 0 or not size < 1e300:
            return DIVERGED
        K.real.correction = size
        rate = size / last if n > 0 else 1.0
        left = size * rate / (1.0 - rate) if rate < 1.0 else 1e300
        if n + 1 >= K.count.least and (size <= 1e-3 * K.real.newton or left <= K.real.newton):
            K.real.theta = rate if n > 0 else 0.0
            return 0
        if n > 1 and rate > MAX_CONTRACTION and size <= K.real.rounding_size:  # rounding
            K.real.theta = 1.0
            return 0
        if n > 1 and rate > MAX_CONTRACTION and not whole:
            return DIVERGED
        last = max(size, 1e-300)
    return DIVERGED


@formula
def attempt_alpha_step(callbacks, S, K, c, h):
    """Try one step of width h to c.y.proposed, with derivatives there in c.K[1].

    Returns (status, 0, 1), as `radau.attempt_radau_step`.
    """
    _, _, compose, arrive = callbacks[:4]
    if K.count.before == 0:
        begin_alpha(callbacks, S, K, c)
        if K.real.width == 0.0:
            K.count.fresh = -1
    tolerances(c, K)
    if K.count.fresh < 0:
        for i in range(K.v.shape[1]):
            K.d[STEP_START, i] = 0.0
            K.a[STEP_START, i] = K.past[TRUE_ACCELERATION, i]
        status = update_jacobian(callbacks[1], c.real.t, STEP_START, S, K, c)
        if status != 0:
            return status, 0.0, 1.0
        K.count.fresh = 1
    scale_start_accelerations(K, h)
    status = factor_alpha_matrix(K, h) if K.real.width != h else 0
    if status == 0:
        status = solve_step_end(callbacks, S, K, c, h, False)
    if status != 0:
        status = solve_step_end(callbacks, S, K, c, h, True)
    if status == 0 and K.count.infinite_slopes == 1:
        status = confirm_convergence(correct_with_new_jacobian, callbacks, S, K, c, h)
        if status == 0:  # the Jacobian is now that of the end: `accept_alpha_step` reuses it, another try does not
            K.count.fresh = -1
    if status != 0:
        return status, 0.0, 1.0
    end_rates(callbacks, S, K, h)
    store_end_accelerations(K)
    compose(c.y.current, K.d[END_ROW], K.v[END_ROW], K.z[END_ROW], c.y.proposed, S)
    status, _ = arrive(c.real.t + h, c.y.proposed, c.K[1], S, K)
    integrate_by_trapezoids(c, h)
    return status, 0.0, 1.0


@formula
def store_end_accelerations(K):
    """Store the accelerations at both ends for interpolation."""
    for i in range(K.v.shape[1]):
        K.ends[START_ACCELERATION, i] = K.past[TRUE_ACCELERATION, i]
        K.ends[END_ACCELERATION, i] = K.a[END_ROW, i]


@formula
def accept_alpha_step(K, c, t, h, error, iterations):
    """Make the end of the step the current state, and store what the next step needs."""
    for i in range(K.v.shape[1]):
        K.past[ALGORITHMIC_ACCELERATION, i] = K.past[NEXT_ALGORITHMIC, i]
        K.past[TRUE_ACCELERATION, i] = K.ends[END_ACCELERATION, i]
    nv = K.v.shape[1]
    for i in range(K.tol_x.shape[0]):
        K.past[ALGORITHMIC_ACCELERATION, nv + i] = K.past[NEXT_ALGORITHMIC, nv + i]
        K.past[TRUE_ACCELERATION, nv + i] = K.xd[END_ROW, i]
    for r in range(K.lam.shape[1]):
        K.lam[STEP_START, r] = K.lam[END_ROW, r]
    K.count.before, K.real.last_h = 1, h
    K.count.fresh = 0 if K.real.theta <= JACOBIAN_REUSE_RATE else -1
    enter_step(c, t)
