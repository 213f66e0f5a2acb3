"""One step of an explicit Runge-Kutta pair, its error, its dense output.

Step control after Hairer, Norsett and Wanner, *Solving Ordinary Differential Equations I* (1993), section II.4.
"""

from __future__ import annotations

from ...compiler.formulas import formula
from ...math.scalar import sqrt
from .clock import (
    BETWEEN,
    LOOSER,
    NEW,
    NOW,
)

BEYOND = 1e-3  # of a coordinate beyond the mechanism's size, what its tolerance still grows with
LARGE = 1e300  # the error of a step that was not tried, or is no number
FIRST = 1e-7  # part of the largest step: the least that is tried first


@formula
def combine(y, K, weights, stages, h, out):
    """Out = y + h sum_j weights[j] K[j]."""
    n = y.shape[0]
    for i in range(n):
        out[i] = 0.0
    for j in range(stages):
        w = h * weights[j]
        if w != 0.0:
            for i in range(n):
                out[i] += w * K[j, i]
    for i in range(n):
        out[i] += y[i]


@formula
def allowed(c, i, size):
    """Tolerance of component i of that size.

    Of the first c.count.positions what is beyond the size of what moves counts little: that a wheel has turned a
    hundred times, or that the world's origin is far away, is no reason to be less accurate.
    """
    if i < c.count.positions:
        size = max(min(size, max(1.0, c.real.scale)), BEYOND * size)
    return c.real.atol + c.real.rtol * size


@formula
def scaled(c, a, y, n):
    """Root mean square of a in units of the tolerance, over the first n components."""
    s = 0.0
    for i in range(n):
        e = a[i] / allowed(c, i, y[i] if y[i] > 0.0 else -y[i])
        s += e * e
    return sqrt(s / max(n, 1))


@formula
def first_step(derivative, S, W, R, c):
    """A first step width from the sizes of y, y' and y'' (Hairer, Norsett and Wanner, section II.4).

    A state that begins at rest near zero is small without changing fast: hence the least.
    """
    n = c.count.controlled
    y = c.y[NOW]
    d0 = scaled(c, y, y, n)
    d1 = scaled(c, c.K[0], y, n)
    h0 = 1e-6 if d0 < 1e-5 or d1 < 1e-5 else 0.01 * d0 / d1
    h0 = min(max(h0, FIRST * c.real.h_max), c.real.h_max)
    for i in range(y.shape[0]):
        c.y[NEW, i] = y[i] + h0 * c.K[0, i]
    if derivative(c.real.t + h0, c.y[NEW], c.K[1], S, W) != 0:
        return 1e-3 * h0
    for i in range(n):
        c.y[BETWEEN, i] = (c.K[1, i] - c.K[0, i]) / h0
    d2 = scaled(c, c.y[BETWEEN], y, n)
    m = max(d1, d2)
    h1 = max(1e-6, h0 * 1e-3) if m <= 1e-15 else (0.01 / m) ** (1.0 / R.order_i[0])
    return min(100.0 * h0, h1)


@formula
def attempt(derivative, arrive, tangent, S, W, R, c, h):
    """One step of width h into c.y[NEW]. Returns (status, error in units of the tolerance; 0 if it is fixed)."""
    y = c.y[NOW]
    new = c.y[NEW]
    stages = R.order_i[1]
    t = c.real.t
    for i in range(1, stages):
        combine(y, c.K, R.A[i], i, h, new)
        status = derivative(t + R.c[i] * h, new, c.K[i], S, W)
        if status != 0:
            return status, 0.0
    combine(y, c.K, R.A[stages], stages, h, new)
    status, moved = arrive(t + h, new, c.K[stages], S, W)
    if status != 0:
        return status, 0.0
    moved /= c.real.rtol + c.real.atol / c.real.scale
    moved = max(moved, accounting_error(R, c, h))
    error = estimate(tangent, S, W, R, c, h, False)
    if error > 1.0 and c.real.pardon > 0.0:
        error = estimate(tangent, S, W, R, c, h, True)
    error = moved if error <= moved else error  # an error that is no number stays one, and is refused
    return 0, 0.0 if c.real.step > 0.0 and error < LARGE else error


@formula
def estimate(tangent, S, W, R, c, h, kept):
    """Error of the step in units of the tolerance; ``kept``: of what is left of it once the state is projected."""
    e5 = part(tangent, S, W, R, c, 0, kept)
    e3 = part(tangent, S, W, R, c, 1, kept)
    return 0.0 if e5 == 0.0 and e3 == 0.0 else h * e5 / sqrt((e5 + 0.01 * e3) * max(c.count.controlled, 1))


@formula
def part(tangent, S, W, R, c, k, kept):
    """Sum of squares of one of the two error estimates, per second, in units of the tolerance."""
    y, new, e = c.y[NOW], c.y[NEW], c.y[BETWEEN]
    n = c.count.controlled
    for i in range(n):
        e[i] = 0.0
    for j in range(R.order_i[1] + 1):
        w = R.E[k, j]
        if w != 0.0:
            for i in range(n):
                e[i] += w * c.K[j, i]
    if kept:
        tangent(new, e, S, W)
    s = 0.0
    for i in range(n):
        s += (e[i] / allowed(c, i, max(abs(y[i]), abs(new[i])))) ** 2
    return s


@formula
def accountable(c):
    """Tolerance of the accounts: relative to all that stands in them and to c.real.ledger."""
    size = c.real.ledger
    for k in range(c.accounts.shape[0]):
        size += abs(c.y[NEW, c.accounts[k]])
    return LOOSER * c.real.rtol * size


@formula
def accounting_error(R, c, h):
    """Error of the accounts in units of their tolerance.

    Where coordinates follow a driver their errors say nothing of forces that change abruptly; works do.
    """
    n = c.accounts.shape[0]
    s = accountable(c)
    e5 = 0.0
    e3 = 0.0
    for k in range(n):
        i = c.accounts[k]
        a = 0.0
        b = 0.0
        for j in range(R.order_i[1] + 1):
            a += R.E[0, j] * c.K[j, i]
            b += R.E[1, j] * c.K[j, i]
        e5 += (a / s) ** 2
        e3 += (b / s) ** 2
    if e5 == 0.0 and e3 == 0.0:
        return 0.0
    return h * e5 / sqrt((e5 + 0.01 * e3) * n)


@formula
def interpolate(R, c, x, h, out):
    """Dense output at t + x h."""
    n = out.shape[0]
    for i in range(n):
        out[i] = 0.0
    for j in range(R.order_i[2]):
        w = 0.0
        for p in range(R.P.shape[1] - 1, -1, -1):
            w = (w + R.P[j, p]) * x
        w *= h
        if w != 0.0:
            for i in range(n):
                out[i] += w * c.K[j, i]
    for i in range(n):
        out[i] += c.y[NOW, i]


@formula
def astray(R, c, h):
    """By how much the dense output is off within the step, in units of the tolerance; 0 where steps bound that.

    From its stages alone, which `extend` has made: no evaluation.
    """
    n, m = c.count.controlled, c.accounts.shape[0]
    s = accountable(c)
    e = less = a = a_less = 0.0
    for i in range(n):
        size = allowed(c, i, max(abs(c.y[NOW, i]), abs(c.y[NEW, i])))
        e += (off(R, c, 0, i) / size) ** 2
        less += (off(R, c, 1, i) / size) ** 2
    for k in range(m):
        a += (off(R, c, 0, c.accounts[k]) / s) ** 2
        a_less += (off(R, c, 1, c.accounts[k]) / s) ** 2
    of_state = e / (e + less) * sqrt(e / n) if e > 0.0 else 0.0
    of_accounts = a / (a + a_less) * sqrt(a / m) if a > 0.0 else 0.0
    return h * max(of_state, of_accounts)


@formula
def stretch(R, c, h):
    """About the step's width times the largest eigenvalue, as its last two stages tell, which are both at its end.

    The first look of Hairer and Wanner's dop853.f at whether a problem is stiff. Exact for y' = lambda y.
    """
    last = R.order_i[1]
    a = b = 0.0
    for i in range(c.count.controlled):
        size = allowed(c, i, max(abs(c.y[NOW, i]), abs(c.y[NEW, i])))
        d = 0.0
        for j in range(last):
            d += (R.A[last, j] - R.A[last - 1, j]) * c.K[j, i]
        a += ((c.K[last, i] - c.K[last - 1, i]) / size) ** 2
        b += (d / size) ** 2
    return sqrt(a / b) if b > 0.0 else 0.0


@formula
def off(R, c, k, i):
    """One of the two sums over stages that tell what the dense output of component i is off by, per second."""
    e = 0.0
    for j in range(R.order_i[2]):
        e += R.D[k, j] * c.K[j, i]
    return e


@formula
def extend(derivative, S, W, R, c, h):
    """The stages that only dense output needs. Returns a status."""
    for k in range(R.order_i[1] + 1, R.order_i[2]):
        combine(c.y[NOW], c.K, R.A[k], k, h, c.y[BETWEEN])
        status = derivative(c.real.t + R.c[k] * h, c.y[BETWEEN], c.K[k], S, W)
        if status != 0:
            return status
    return 0


@formula
def defect(derivative, S, W, R, c, h, x):
    """By how much the dense output at t + x h misses the equations, times h, in units of the tolerance.

    Not finite if they cannot be evaluated there.
    """
    n = c.count.controlled
    at = c.y[BETWEEN]
    gap = c.K[R.order_i[2]]
    interpolate(R, c, x, h, at)
    if derivative(c.real.t + x * h, at, gap, S, W) != 0:
        return 1e300
    for j in range(R.order_i[2]):
        w = 0.0
        for p in range(R.P.shape[1] - 1, -1, -1):
            w = w * x + (p + 1.0) * R.P[j, p]
        if w != 0.0:
            for i in range(n):
                gap[i] -= w * c.K[j, i]
    s = 0.0
    for i in range(n):
        s += (gap[i] / allowed(c, i, max(abs(c.y[NOW, i]), abs(at[i])))) ** 2
    return h * sqrt(s / max(n, 1))
