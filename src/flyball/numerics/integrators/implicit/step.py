"""One step of Radau IIA: its start values, the iteration, its error, values between (Hairer and Wanner 1996, IV.8).

Given ``residual(t, h, k, S, K, c)``, which fills row k of what the equations miss and of the rates of integrals.
"""

from __future__ import annotations

from ....compiler.formulas import formula
from ....math.scalar import sqrt
from ..clock import NOW
from .coefficients import BEND, BENT, BENT_MOST, ERROR, GAMMA, INVERSE, THROUGH_STAGES, THROUGH_START, A, C
from .desk import START
from .newton import correct, solve_real

MOST = 7  # iterations
PASSES = 4  # of these, each beyond the multipliers of the last (`lead`)
STAGES = 3
SURE = 0.99  # what corrections fall by at least
WILD = 1e3  # what the second one may be larger by than the first
DIVERGED, SLOW = 1, 2


@formula
def begin(c, K):
    """Tolerances of the step from the state at which it begins, and that state's velocities."""
    y = c.y[NOW]
    nv = K.v.shape[1]
    nq = y.shape[0] - nv - K.z.shape[1]
    size = max(1.0, c.real.scale)
    for i in range(nv):
        x = 1.0
        if K.place[i] >= 0:
            x = abs(y[K.place[i]])
            x = max(min(x, size), 1e-3 * x)
        K.tol[0, i] = K.real.atol + K.real.rtol * x
        K.v[START, i] = y[nq + i]
        K.tol[1, i] = K.real.atol + K.real.rtol * abs(y[nq + i])
    for i in range(K.z.shape[1]):
        K.z[START, i] = y[nq + nv + i]
        K.rate[START, i] = c.K[0, nq + nv + i]
    for i in range(K.tol_x.shape[0]):
        K.tol_x[i] = K.real.atol + K.real.rtol * abs(K.z[START, i])


@formula
def predict(K, h):
    """Start values of the stages: all goes on as in the step before; where a stretch begins velocities and x stay."""
    nv = K.v.shape[1]
    for i in range(nv):
        for k in range(STAGES):
            K.v[k, i] = K.v[START, i]
        if K.count.before == 1:
            b1, b2, b3 = coefficients(K.before_v, i, K.before_v[START, i])
            for k in range(STAGES):
                x = 1.0 + C[k] * h / K.real.last_h
                K.v[k, i] = K.before_v[START, i] + x * (b1 + x * (b2 + x * b3))
    for i in range(nv):
        for k in range(STAGES):
            K.d[k, i] = h * (A[k][0] * K.v[0, i] + A[k][1] * K.v[1, i] + A[k][2] * K.v[2, i])
    for i in range(K.lam.shape[1]):
        for k in range(STAGES):
            K.mu[k, i] = 0.0
            K.lam[k, i] = K.lam[START, i]
        if K.count.before == 1:
            for k in range(STAGES):
                K.lam[k, i] = at_stages(K.before_lam, i, 1.0 + C[k] * h / K.real.last_h)
    for i in range(K.z.shape[1]):
        for k in range(STAGES):
            K.rate[k, i] = K.rate[START, i]
    for i in range(K.tol_x.shape[0]):
        for k in range(STAGES):
            K.z[k, i] = K.z[START, i]
        if K.count.before == 1:
            b1, b2, b3 = coefficients(K.before_x, i, K.before_x[START, i])
            for k in range(STAGES):
                x = 1.0 + C[k] * h / K.real.last_h
                K.z[k, i] = K.before_x[START, i] + x * (b1 + x * (b2 + x * b3))


@formula
def coefficients(stages, i, start):
    """Of x, x^2, x^3 of the polynomial through a start value and values at the stages, less the start."""
    a, b, c = stages[0, i] - start, stages[1, i] - start, stages[2, i] - start
    p, q, r = THROUGH_START
    return p[0] * a + p[1] * b + p[2] * c, q[0] * a + q[1] * b + q[2] * c, r[0] * a + r[1] * b + r[2] * c


@formula
def at_stages(stages, i, x):
    """The polynomial through values at the stages, at x."""
    a, b, c = stages[0, i], stages[1, i], stages[2, i]
    p, q, r = THROUGH_STAGES
    return (
        p[0] * a + p[1] * b + p[2] * c
        + x * (q[0] * a + q[1] * b + q[2] * c + x * (r[0] * a + r[1] * b + r[2] * c))
    )  # fmt: skip


@formula
def rates(K, h):
    """Rates of increments, velocities and x at the stages, and integrals there, by the stage values."""
    for k in range(STAGES):
        a, b, c = INVERSE[k]
        for i in range(K.v.shape[1]):
            v0 = K.v[START, i]
            K.dd[k, i] = (a * K.d[0, i] + b * K.d[1, i] + c * K.d[2, i]) / h
            K.a[k, i] = (a * (K.v[0, i] - v0) + b * (K.v[1, i] - v0) + c * (K.v[2, i] - v0)) / h
        for i in range(K.tol_x.shape[0]):
            x0 = K.z[START, i]
            K.xd[k, i] = (a * (K.z[0, i] - x0) + b * (K.z[1, i] - x0) + c * (K.z[2, i] - x0)) / h
    integrals(K, h)


@formula
def integrals(K, h):
    """Integrals of the motion at the stages by their rates there."""
    for k in range(STAGES):
        p, q, r = A[k]
        for i in range(K.tol_x.shape[0], K.z.shape[1]):
            K.z[k, i] = K.z[START, i] + h * (p * K.rate[0, i] + q * K.rate[1, i] + r * K.rate[2, i])


@formula
def share(K, h):
    """Ask for least multipliers where redundant rows leave some open and forces depend on them.

    Rows are as soft as their regularisation: G v - nu + delta D h A (lam - led) = 0, which leaves no multiplier open.
    """
    first = K.count.shared
    if first > 0:
        nv = K.v.shape[1]
        for r in range(K.lam.shape[1]):
            size = h * K.J[START, first + r]
            x, y, z = K.lam[0, r] - K.led[0, r], K.lam[1, r] - K.led[1, r], K.lam[2, r] - K.led[2, r]
            for k in range(STAGES):
                a, b, c = A[k]
                K.out[k, 2 * nv + r] += size * (a * x + b * y + c * z)


@formula
def lead(K, pass_):
    """What rows give way beyond in `share`: nothing at first, then what they carried. Returns whether there is more.

    Of all that redundant rows may carry the least is taken by the first pass. It is soft, though: what friction makes
    of the rows' giving way is no rounding (a wedge on a wedge multiplies it by 1e3). Each pass beyond what the last one
    found (proximal point: Rockafellar 1976; iterated regularisation: Hanke and Groetsch 1998) leaves of this its next
    power, and self-stress as it was.
    """
    for r in range(K.lam.shape[1] if K.count.shared > 0 else 0):
        for k in range(STAGES):
            K.led[k, r] = K.lam[k, r] if pass_ > 0 else 0.0
    return K.count.shared > 0 and pass_ < PASSES


@formula
def iterate(residual, S, K, c, h):
    """Find the stage values. Returns (status, factor by which the next width should change)."""
    more = lead(K, 0)
    status, asked, moved = settle(residual, S, K, c, h)
    pass_ = 0
    while status == 0 and more and (pass_ == 0 or moved > K.real.newton):
        pass_ += 1
        more = lead(K, pass_)
        status, again, moved = settle(residual, S, K, c, h)
        if status != 0 and not moved <= K.real.rough:
            return status, again
        if status != 0:  # what rounding makes of multipliers that redundant rows leave open
            status, more = 0, False
    return account(residual, S, K, c, h) if status == 0 else status, asked


@formula
def settle(residual, S, K, c, h):
    """Newton's iteration. Returns (0, how often it was corrected) or (status, factor of the next width); what it moved.

    The last is the size of the first correction in units of the tolerance.
    """
    found = 0
    rate = max(K.real.rate, 1e-16) ** 0.8
    theta = abs(K.real.theta)
    before = last = moved = 0.0
    for n in range(MOST):
        rates(K, h)
        for k in range(STAGES):
            if residual(c.real.t + C[k] * h, k, S, K, c) != 0:
                return DIVERGED, 0.5, moved
        share(K, h)
        K.real.correction = size = correct(K, h)
        K.count.iterations += 1
        if not size < 1e300:
            return DIVERGED, 0.5, moved
        if n == 0:
            moved = size
        else:
            ratio = size / last
            theta = ratio if n == 1 or before >= SURE else sqrt(ratio * before)
            before = ratio
            if n == 1 and SURE <= theta < WILD:  # the first one corrected multipliers, that are not looked at
                last = size
                continue
            if not theta < SURE:
                if size <= K.real.newton:  # rounding
                    found = n + 1
                    break
                return DIVERGED, 0.5, moved
            rate = theta / (1.0 - theta)
            left = rate * size * theta ** (MOST - 2 - n) / K.real.newton
            if left >= 1.0:
                q = max(1e-4, min(20.0, left))
                return SLOW, 0.8 * q ** (-1.0 / (4.0 + MOST - 2 - n)), moved
        last = max(size, 1e-16)
        if rate * size <= K.real.newton and n + 1 >= K.count.least:
            found = n + 1
            break
    if found == 0:
        return SLOW, 0.5, moved
    K.real.rate, K.real.theta = rate, theta
    return 0, float(found), moved


@formula
def account(residual, S, K, c, h):
    """Integrals of the motion by their rates at the stage values found. Returns a status."""
    if K.z.shape[1] == K.tol_x.shape[0]:
        return 0
    rates(K, h)
    for k in range(STAGES):
        if residual(c.real.t + C[k] * h, k, S, K, c) != 0:
            return DIVERGED
    integrals(K, h)
    return 0


@formula
def estimate(residual, S, K, c, h):
    """Error of the step in units of the tolerance. Returns (status, error).

    Filtered once, at the start of a motion too: twice (Hairer and Wanner, IV.8.20) would let a step pass over what is
    fast, whether it is damped or not.
    """
    nv = K.v.shape[1]
    accounts = unsure(K, c, h)  # rates at the begin are other ones below
    e, f, g = ERROR
    for i in range(nv):
        v0 = K.v[START, i]
        K.d[START, i] = 0.0
        K.dd[START, i] = -(e * K.d[0, i] + f * K.d[1, i] + g * K.d[2, i]) / h
        K.a[START, i] = -(e * (K.v[0, i] - v0) + f * (K.v[1, i] - v0) + g * (K.v[2, i] - v0)) / h
    for i in range(K.tol_x.shape[0]):
        x0 = K.z[START, i]
        K.xd[START, i] = -(e * (K.z[0, i] - x0) + f * (K.z[1, i] - x0) + g * (K.z[2, i] - x0)) / h
    for i in range(K.mu.shape[1]):
        K.mu[START, i] = 0.0
    status, size = filtered(residual, S, K, c, c.real.t, h)
    return status, max(size, accounts, springing(K, h) if status == 0 else 0.0)


@formula
def springing(K, h):
    """Error of the velocities that what is estimated of the increments springs back with, in units of the tolerance.

    A swing that is too fast for the step is all but filtered out of the velocities, while it lasts where nothing damps
    it: v follows from e K e = v M v. Where there is damping it counts as inertia does, h C / GAMMA.
    """
    nv = K.v.shape[1]
    perm = K.P.perm
    J, x, force, mass = K.J[START], K.x[0], K.x[1], K.x[2]
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
def filtered(residual, S, K, c, t, h):
    """What the equations miss in row START, solved with the real matrix, in units of the tolerance."""
    if residual(t, START, S, K, c) != 0:
        return 1, 0.0
    perm = K.P.perm
    nv, nx = K.v.shape[1], K.tol_x.shape[0]
    for i in range(perm.shape[0]):
        K.x[0, perm[i]] = -K.out[START, i]
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
def back(K, c):
    """Velocities and x of the begin of the step into their place again."""
    nv, nz = K.v.shape[1], K.z.shape[1]
    for i in range(nv):
        K.v[START, i] = c.y[NOW, c.y.shape[1] - nz - nv + i]
    for i in range(K.tol_x.shape[0]):
        K.z[START, i] = c.y[NOW, c.y.shape[1] - nz + i]


@formula
def unsure(K, c, h):
    """Error of the integrals in units of the tolerance: relative to all that stands in them and to c.real.ledger.

    Within the step: at its end they are of a higher order, of the state too, but what lies between is told as well; and
    a fast beginning that the state forgets is not forgotten by its integrals.
    """
    size = c.real.ledger
    for n in range(c.accounts.shape[0]):
        size += abs(c.y[NOW, c.accounts[n]])
    at = c.y.shape[1] - K.z.shape[1]
    s = 0.0
    for n in range(c.accounts.shape[0]):
        e = BENT_MOST * bent(K, c.accounts[n] - at)
        s += e * e
    return h * sqrt(s / max(c.accounts.shape[0], 1)) / (K.real.rtol * size + 1e-300)


@formula
def bent(K, i):
    """Third divided difference of the rate of integral i, by its begin and the stages, over the step."""
    return (
        BEND[0] * K.rate[START, i] + BEND[1] * K.rate[0, i] + BEND[2] * K.rate[1, i] + BEND[3] * K.rate[2, i]
    )  # fmt: skip


@formula
def defect(residual, S, K, c, h, x):
    """Error that what the polynomial misses of the equations at t + x h would make if it lasted for the step.

    In units of the tolerance; huge if they cannot be evaluated there.
    """
    nv = K.v.shape[1]
    for i in range(nv):
        v0 = K.v[START, i]
        b1, b2, b3 = coefficients(K.d, i, 0.0)
        K.d[START, i] = x * (b1 + x * (b2 + x * b3))
        K.dd[START, i] = (b1 + x * (2.0 * b2 + x * 3.0 * b3)) / h
        b1, b2, b3 = coefficients(K.v, i, v0)
        K.v[START, i] = v0 + x * (b1 + x * (b2 + x * b3))
        K.a[START, i] = (b1 + x * (2.0 * b2 + x * 3.0 * b3)) / h
    for i in range(K.tol_x.shape[0]):
        b1, b2, b3 = coefficients(K.z, i, K.z[START, i])
        K.z[START, i] += x * (b1 + x * (b2 + x * b3))
        K.xd[START, i] = (b1 + x * (2.0 * b2 + x * 3.0 * b3)) / h
    for r in range(K.mu.shape[1]):
        K.lam[START, r] = at_stages(K.lam, r, x)
    status, size = filtered(residual, S, K, c, c.real.t + x * h, h)
    back(K, c)
    return max(size, springing(K, h)) if status == 0 else 1e300


@formula
def between(K, x, h, d, v, z):
    """Increments, velocities and integrals at t + x h, by the polynomial through the stages.

    That of the rates of integrals goes through the begin of the step too: K.rate[START].
    """
    for i in range(d.shape[0]):
        b1, b2, b3 = coefficients(K.d, i, 0.0)
        d[i] = x * (b1 + x * (b2 + x * b3))
        v0 = K.v[START, i]
        b1, b2, b3 = coefficients(K.v, i, v0)
        v[i] = v0 + x * (b1 + x * (b2 + x * b3))
    p, q, r = THROUGH_STAGES
    more = x * (BENT[0] + x * (BENT[1] + x * (BENT[2] + x * BENT[3])))
    nx = K.tol_x.shape[0]
    for i in range(nx):
        b1, b2, b3 = coefficients(K.z, i, K.z[START, i])
        z[i] = K.z[START, i] + x * (b1 + x * (b2 + x * b3))
    for i in range(nx, z.shape[0]):
        a, b, c = K.rate[0, i], K.rate[1, i], K.rate[2, i]
        s = p[0] * a + p[1] * b + p[2] * c
        s += x / 2.0 * (q[0] * a + q[1] * b + q[2] * c) + x * x / 3.0 * (r[0] * a + r[1] * b + r[2] * c)
        z[i] = K.z[START, i] + h * (x * s + more * bent(K, i))
