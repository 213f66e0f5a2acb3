"""The generalised-alpha method on Lie groups, of order 2, at fixed steps, with constraints.

Chung and Hulbert (1993); for mechanisms Arnold and Bruels (2007), Bruels, Cardona and Arnold (2012); stabilised index 2
by Arnold, Cardona and Bruels (2015), "A Lie algebra approach to Lie group time integration of constrained systems":

    q1 = q0 exp(h (v0 + (1/2 - beta) h a0 + beta h a1 + D G^T mu)),  v1 = v0 + (1 - gamma) h a0 + gamma h a1,
    (1 - am) a1 + am a0 = (1 - af) v1' + af v0',  r(t1, q1, v1, v1', lam1) = 0,  G v1 = nu,  g = 0

States of the first order, x' = f, go as velocities do (Bruels and Golinval 2006, "The generalized-alpha method in
mechatronic applications"); of `past` they are the last columns.

a is the acceleration at t + (am - af) h. The spectral radius at infinite frequency, rho, sets am, af, beta and gamma.
Knows nothing of bodies: given (residual, linearise, compose, arrive, inspect) as `radau` is, and
``straight(d, out, S)``, which makes increments those of constant velocity, and an ``arrive`` of what is no end of a
step.
"""

from __future__ import annotations

from ....compiler.formulas import formula
from ....math.scalar import sqrt
from ...lu import lu_factor
from ..clock import ASIDE, ASIDE_RATE, NEW, NOW
from .desk import (
    START,
)
from .even import account
from .even import enter as enter_step
from .hermite import END, V_RATE, V_RATE_END
from .newton import confirm, renew, solve
from .step import begin as tolerances

# rows of past: a and v' where the step begins; a at its end; v'' at a start
ALGORITHMIC, TRUE, NEXT_ONE, RATE = range(4)
AHEAD = 1e-3  # part of a step over which the rate of accelerations is found at a start
MOST, MOST_WHOLE = 10, 25  # iterations: with one Jacobian, and with that of each
FALLS = 0.5  # what corrections fall by at least, or each iteration has its own Jacobian
SERVES = 0.02  # a rate of the iteration below which the Jacobian serves on
DIVERGED = 1


@formula
def coefficients(rho):
    """Of a spectral radius at infinity: (alpha_m, alpha_f, beta, gamma) (Chung and Hulbert 1993)."""
    am = (2.0 * rho - 1.0) / (rho + 1.0)
    af = rho / (rho + 1.0)
    gamma = 0.5 - am + af
    return am, af, 0.25 * (gamma + 0.5) ** 2, gamma


@formula
def begin(callbacks, S, K, c):
    """What the method remembers of steps, where it begins anew: accelerations, and their rate."""
    compose, arrive = callbacks[2], callbacks[6]
    nv = K.v.shape[1]
    at = c.y.shape[1] - K.z.shape[1] - nv
    ahead = AHEAD * c.real.step
    for i in range(nv):
        K.d[START, i] = ahead * c.y[NOW, at + i]
        K.v[START, i] = c.y[NOW, at + i] + ahead * c.K[0, at + i]
    for i in range(K.z.shape[1]):
        K.z[START, i] = c.y[NOW, at + nv + i] + (ahead * c.K[0, at + nv + i] if i < K.tol_x.shape[0] else 0.0)
    compose(c.y[NOW], K.d[START], K.v[START], K.z[START], c.y[ASIDE], S)
    status, _ = arrive(c.real.t + ahead, c.y[ASIDE], c.y[ASIDE_RATE], S, K)
    for i in range(nv + K.tol_x.shape[0]):  # x stands behind the velocities
        K.past[TRUE, i] = c.K[0, at + i]
        K.past[RATE, i] = (c.y[ASIDE_RATE, at + i] - c.K[0, at + i]) / ahead if status == 0 else 0.0


@formula
def place(K, h):
    """Accelerations a where the step begins, for its width, into K.a[START]; they keep their rate if h changes."""
    am, af, _, _ = coefficients(K.rho[0])
    nv = K.v.shape[1]
    for i in range(nv + K.tol_x.shape[0]):
        a = K.past[ALGORITHMIC, i]
        if K.count.before == 0:
            a = K.past[TRUE, i] + (am - af) * h * K.past[RATE, i]
        elif h != K.real.last_h:
            a = K.past[TRUE, i] + (a - K.past[TRUE, i]) * (h / K.real.last_h)
        if i < nv:
            K.a[START, i] = a
        else:
            K.xd[START, i - nv] = a


@formula
def ends(callbacks, S, K, h):
    """Rates at the end of the step, by the values there."""
    am, af, beta, gamma = coefficients(K.rho[0])
    straight = callbacks[5]
    straight(K.d[END], K.dd[END], S)
    for i in range(K.v.shape[1]):
        v0, a0 = K.v[START, i], K.a[START, i]
        a1 = (K.v[END, i] - v0) / (gamma * h) - (1.0 - gamma) / gamma * a0
        K.past[NEXT_ONE, i] = a1
        K.a[END, i] = ((1.0 - am) * a1 + am * a0 - af * K.past[TRUE, i]) / (1.0 - af)
        K.dd[END, i] = gamma / beta * (K.dd[END, i] / h - v0 - h * (0.5 - beta / gamma) * a0) + v0
    nv, nx = K.v.shape[1], K.tol_x.shape[0]
    for i in range(nx):
        w0 = K.xd[START, i]
        w1 = (K.z[END, i] - K.z[START, i]) / (gamma * h) - (1.0 - gamma) / gamma * w0
        K.past[NEXT_ONE, nv + i] = w1
        K.xd[END, i] = ((1.0 - am) * w1 + am * w0 - af * K.past[TRUE, nv + i]) / (1.0 - af)
    for i in range(nx, K.z.shape[1]):
        K.z[END, i] = K.z[START, i] + 0.5 * h * (K.rate[START, i] + K.rate[END, i])


@formula
def predict(K, h):
    """Start values of the end: accelerations and multipliers stay."""
    for i in range(K.v.shape[1]):
        K.v[END, i] = K.v[START, i] + h * K.a[START, i]
        K.d[END, i] = h * (K.v[START, i] + 0.5 * h * K.a[START, i])
    for r in range(K.lam.shape[1]):
        K.lam[END, r] = K.lam[START, r]
        K.mu[END, r] = 0.0
    for i in range(K.z.shape[1]):
        K.rate[END, i] = K.rate[START, i]
    for i in range(K.tol_x.shape[0]):
        K.z[END, i] = K.z[START, i] + h * K.xd[START, i]


@formula
def factor(K, h):
    """Factor F + F', times what increments and velocities change their rates by in a step. Returns 0, or not."""
    am, af, beta, gamma = coefficients(K.rho[0])
    scale = (1.0 - am) / ((1.0 - af) * gamma * h)
    A, J = K.real_A, K.J[START]
    for i in range(A.shape[0]):
        A[i] = 0.0
    for e in range(K.part[0]):
        A[K.put[e, 0]] += J[K.put[e, 1]]
    for e in range(K.part[0], K.part[1]):
        by = gamma / (beta * h) if e - K.part[0] < K.v.shape[1] else scale
        A[K.put[e, 0]] += by * J[K.put[e, 1]]
    for e in range(K.part[1], K.put.shape[0]):
        A[K.put[e, 0]] += J[K.put[e, 1]] / scale
    K.count.factors += 1
    K.real.width = h
    status = lu_factor(K.P, A, K.real_L, K.real_U, K.real_D, K.real_Y)
    if status != 0:
        K.real.width = 0.0
    return status


@formula
def correct(K, h):
    """One correction for what the equations miss in K.out. Returns its size in units of the tolerance."""
    am, af, _, gamma = coefficients(K.rho[0])
    nv, nr, perm = K.v.shape[1], K.lam.shape[1], K.P.perm
    for i in range(perm.shape[0]):
        K.x[0, perm[i]] = -K.out[END, i]
    solve(K, K.x, K.real_A, K.real_L, K.real_U, K.real_D, (1.0 - am) / ((1.0 - af) * gamma * h))
    s = 0.0
    for i in range(nv):
        x, y = K.x[0, perm[i]], K.x[0, perm[nv + i]]
        K.d[END, i] += x
        K.v[END, i] += y
        x /= K.tol[0, i]
        y /= K.tol[1, i]
        s += x * x + y * y
    for r in range(nr):
        K.lam[END, r] += K.x[0, perm[2 * nv + r]]
        K.mu[END, r] += K.x[0, perm[2 * nv + nr + r]]
    nx = K.tol_x.shape[0]
    for i in range(nx):
        x = K.x[0, perm[2 * nv + 2 * nr + i]]
        K.z[END, i] += x
        x /= K.tol_x[i]
        s += x * x
    return sqrt(s / max(2 * nv + nx, 1))


@formula
def residual(callbacks, S, K, c, h):
    """The residual at the end of the step, into its row. Returns a status."""
    ends(callbacks, S, K, h)
    return callbacks[0](c.real.t + h, END, S, K, c)


@formula
def correct_at_end(callbacks, S, K, c, h):
    """One correction with the Jacobian of the end of the step. Returns a status, and its size."""
    if residual(callbacks, S, K, c, h) != 0:
        return DIVERGED, 0.0
    if renew(callbacks[1], c.real.t + h, END, S, K, c) != 0 or factor(K, h) != 0:
        return DIVERGED, 0.0
    return 0, correct(K, h)


@formula
def iterate(callbacks, S, K, c, h, whole):
    """Find the end of the step, with one Jacobian or that of every iteration. Returns a status."""
    last = rate = 1.0
    predict(K, h)
    for n in range(MOST_WHOLE if whole else MOST):
        if whole:
            status, size = correct_at_end(callbacks, S, K, c, h)
        else:
            status = residual(callbacks, S, K, c, h)
            size = correct(K, h) if status == 0 else 0.0
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
        if n > 1 and rate > FALLS and size <= K.real.rough:  # rounding
            K.real.theta = 1.0
            return 0
        if n > 1 and rate > FALLS and not whole:
            return DIVERGED
        last = max(size, 1e-300)
    return DIVERGED


@formula
def attempt(callbacks, S, K, c, h):
    """One step of width h into c.y[NEW], derivatives there into c.K[1]. Returns (status, 0, 1), as `radau.attempt`."""
    _, _, compose, arrive = callbacks[:4]
    if K.count.before == 0:
        begin(callbacks, S, K, c)
        if K.real.width == 0.0:
            K.count.fresh = -1
    tolerances(c, K)
    if K.count.fresh < 0:
        for i in range(K.v.shape[1]):
            K.d[START, i] = 0.0
            K.a[START, i] = K.past[TRUE, i]
        status = renew(callbacks[1], c.real.t, START, S, K, c)
        if status != 0:
            return status, 0.0, 1.0
        K.count.fresh = 1
    place(K, h)
    status = factor(K, h) if K.real.width != h else 0
    if status == 0:
        status = iterate(callbacks, S, K, c, h, False)
    if status != 0:
        status = iterate(callbacks, S, K, c, h, True)
    if status == 0 and K.count.steep == 1:
        status = confirm(correct_at_end, callbacks, S, K, c, h)
        if status == 0:  # the Jacobian is that of the end now: `enter` has it serve on, another try does not
            K.count.fresh = -1
    if status != 0:
        return status, 0.0, 1.0
    ends(callbacks, S, K, h)
    conclude(K)
    compose(c.y[NOW], K.d[END], K.v[END], K.z[END], c.y[NEW], S)
    status, _ = arrive(c.real.t + h, c.y[NEW], c.K[1], S, K)
    account(c, h)
    return status, 0.0, 1.0


@formula
def conclude(K):
    """What is asked for within the step, found."""
    for i in range(K.v.shape[1]):
        K.ends[V_RATE, i] = K.past[TRUE, i]
        K.ends[V_RATE_END, i] = K.a[END, i]


@formula
def enter(K, c, t, h, error, asked):
    """Make the end of the step the present state, and remember what the next one needs."""
    for i in range(K.v.shape[1]):
        K.past[ALGORITHMIC, i] = K.past[NEXT_ONE, i]
        K.past[TRUE, i] = K.ends[V_RATE_END, i]
    nv = K.v.shape[1]
    for i in range(K.tol_x.shape[0]):
        K.past[ALGORITHMIC, nv + i] = K.past[NEXT_ONE, nv + i]
        K.past[TRUE, nv + i] = K.xd[END, i]
    for r in range(K.lam.shape[1]):
        K.lam[START, r] = K.lam[END, r]
    K.count.before, K.real.last_h = 1, h
    K.count.fresh = 0 if K.real.theta <= SERVES else -1
    enter_step(c, t)
