"""One adaptive loop for every explicit Runge-Kutta pair, with dense output, projection and chunked output.

Knows nothing of mechanisms: it is given ``derivative(t, y, dy, S, W)``, ``arrive(t, y, dy, S, W)``, which also
projects y, and ``report(t, y, out, S, W)``. It returns when its output buffer is full, its share of steps is done,
the end is reached, or it cannot go on; the caller calls again with the same ``Clock``. Progress, interrupt and
restart are this.

Step control after Hairer, Norsett and Wanner, *Solving Ordinary Differential Equations I* (1993), section II.4.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...compiler.jit import formula
from ...math.scalar import sqrt

# entries of Clock.real
T, H, T_END, RTOL, ATOL, H_MAX, GROW, LARGEST, SCALE, LEDGER = range(10)
# entries of Clock.count
ACCEPTED, REJECTED, NEXT, QUOTA, STATUS, STARTED, CONTROLLED, LIMIT, POSITIONS = range(9)
SAFETY = 0.85
BEYOND = 1e-3  # of a coordinate beyond the mechanism's size, what its tolerance still grows with
FIRST = 1e-7  # part of the largest step: the least that is tried first
LOOSER = 10.0  # accounts are held to this many times the relative tolerance
RUNNING, DONE, STUCK, NOT_FINITE, UNREPORTED, TOO_MANY = 0, 1, 2, 3, 4, 5


class Clock(NamedTuple):
    """Everything an interrupted integration needs to go on."""

    real: np.ndarray  # (10,)
    count: np.ndarray  # type: ignore[assignment]  # (9,)
    times: np.ndarray  # output times, ascending
    y: np.ndarray  # (3, ny): state, state in the making, interpolated state
    K: np.ndarray  # (stages, ny): derivatives of the stages
    accounts: np.ndarray  # components that are integrals of the motion: works


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

    Of the first c.count[POSITIONS] what is beyond the size of what moves counts little: that a wheel has turned a
    hundred times, or that the world's origin is far away, is no reason to be less accurate.
    """
    if i < c.count[POSITIONS]:
        size = max(min(size, max(1.0, c.real[SCALE])), BEYOND * size)
    return c.real[ATOL] + c.real[RTOL] * size


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
    n = c.count[CONTROLLED]
    y = c.y[0]
    d0 = scaled(c, y, y, n)
    d1 = scaled(c, c.K[0], y, n)
    h0 = 1e-6 if d0 < 1e-5 or d1 < 1e-5 else 0.01 * d0 / d1
    h0 = min(max(h0, FIRST * c.real[H_MAX]), c.real[H_MAX])
    for i in range(y.shape[0]):
        c.y[1, i] = y[i] + h0 * c.K[0, i]
    if derivative(c.real[T] + h0, c.y[1], c.K[1], S, W) != 0:
        return 1e-3 * h0
    for i in range(n):
        c.y[2, i] = (c.K[1, i] - c.K[0, i]) / h0
    d2 = scaled(c, c.y[2], y, n)
    m = max(d1, d2)
    h1 = max(1e-6, h0 * 1e-3) if m <= 1e-15 else (0.01 / m) ** (1.0 / R.order_i[0])
    return min(100.0 * h0, h1)


@formula
def attempt(derivative, arrive, S, W, R, c, h):
    """One step of width h into c.y[1]. Returns (status, error in units of the tolerance)."""
    y = c.y[0]
    new = c.y[1]
    n = c.count[CONTROLLED]
    stages = R.order_i[1]
    t = c.real[T]
    for i in range(1, stages):
        combine(y, c.K, R.A[i], i, h, new)
        status = derivative(t + R.c[i] * h, new, c.K[i], S, W)
        if status != 0:
            return status, 0.0
    combine(y, c.K, R.A[stages], stages, h, new)
    status, moved = arrive(t + h, new, c.K[stages], S, W)
    if status != 0:
        return status, 0.0
    moved /= c.real[RTOL] + c.real[ATOL] / c.real[SCALE]
    e5 = 0.0
    e3 = 0.0
    for i in range(n):
        a = 0.0
        b = 0.0
        for j in range(stages + 1):
            a += R.E[0, j] * c.K[j, i]
            b += R.E[1, j] * c.K[j, i]
        s = allowed(c, i, max(abs(y[i]), abs(new[i])))
        e5 += (a / s) ** 2
        e3 += (b / s) ** 2
    moved = max(moved, accounting_error(R, c, h))
    if e5 == 0.0 and e3 == 0.0:
        return 0, moved
    error = h * e5 / sqrt((e5 + 0.01 * e3) * max(n, 1))
    return 0, moved if error <= moved else error  # an error that is no number stays one, and is refused


@formula
def accounting_error(R, c, h):
    """Error of the accounts in units of the tolerance: relative to all that stands in them and to c.real[LEDGER].

    Where coordinates follow a driver their errors say nothing of forces that change abruptly; works do.
    """
    n = c.accounts.shape[0]
    size = c.real[LEDGER]
    for k in range(n):
        size += abs(c.y[1, c.accounts[k]])
    s = LOOSER * c.real[RTOL] * size
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
        out[i] += c.y[0, i]


@formula
def write(derivative, report, S, W, R, c, h, out, used):
    """Report every output time within the step of width h, as far as the buffer reaches. Returns (status, used)."""
    t = c.real[T]
    end = t + h
    extra = R.order_i[1] + 1
    while c.count[NEXT] < c.times.shape[0] and used < out.shape[0]:
        s = c.times[c.count[NEXT]]
        if s > end:
            break
        if s == end:
            for i in range(c.y.shape[1]):
                c.y[2, i] = c.y[1, i]
        else:
            while extra < R.order_i[2]:
                combine(c.y[0], c.K, R.A[extra], extra, h, c.y[2])
                if derivative(t + R.c[extra] * h, c.y[2], c.K[extra], S, W) != 0:
                    return UNREPORTED, used
                extra += 1
            interpolate(R, c, (s - t) / h, h, c.y[2])
        if report(s, c.y[2], out[used], S, W) != 0:
            return UNREPORTED, used
        used += 1
        c.count[NEXT] += 1
    return 0, used


@formula
def start(derivative, report, S, W, R, c, out, used):
    """First derivative, first step width, and the output at the very start. Returns (status, used)."""
    if derivative(c.real[T], c.y[0], c.K[0], S, W) != 0:
        return STUCK, used
    for i in range(c.y.shape[1]):
        if not c.K[0, i] - c.K[0, i] == 0.0:
            return NOT_FINITE, used
    if c.real[H] <= 0.0:
        c.real[H] = first_step(derivative, S, W, R, c)
    while c.count[NEXT] < c.times.shape[0] and c.times[c.count[NEXT]] <= c.real[T]:
        for i in range(c.y.shape[1]):
            c.y[2, i] = c.y[0, i]
        if report(c.times[c.count[NEXT]], c.y[2], out[used], S, W) != 0:
            return UNREPORTED, used
        used += 1
        c.count[NEXT] += 1
    c.real[GROW] = 6.0
    c.count[STARTED] = 1
    return 0, used


@formula
def advance(derivative, arrive, report, S, W, R, c, out):
    """Go on until done, stuck, the buffer ``out`` is full or the quota of steps is used. Returns rows written."""
    used = 0
    c.count[STATUS] = RUNNING
    if c.count[STARTED] == 0:
        c.count[STATUS], used = start(derivative, report, S, W, R, c, out, used)
        if c.count[STATUS] != RUNNING:
            return used
    exponent = -1.0 / R.order_i[0]
    steps = 0
    while c.real[T] < c.real[T_END]:
        if used == out.shape[0] or steps >= c.count[QUOTA]:
            return used
        if c.count[ACCEPTED] + c.count[REJECTED] >= c.count[LIMIT]:
            c.count[STATUS] = TOO_MANY
            return used
        t = c.real[T]
        h = min(c.real[H], c.real[H_MAX])
        if t + 1.000001 * h >= c.real[T_END]:
            h = c.real[T_END] - t
        elif t + 2.0 * h > c.real[T_END]:
            h = 0.5 * (c.real[T_END] - t)
        if h < 1e-14 * max(abs(t), c.real[LARGEST]):
            c.count[STATUS] = STUCK
            return used
        status, error = attempt(derivative, arrive, S, W, R, c, h)
        steps += 1
        if status != 0 or not error <= 1.0:
            c.count[REJECTED] += 1
            shrink = 0.25 if status != 0 or not error < 1e300 else max(0.2, SAFETY * error**exponent)
            c.real[H] = h * shrink
            c.real[GROW] = 1.0
            continue
        status, used = write(derivative, report, S, W, R, c, h, out, used)
        if status != 0:  # what lies inside the step cannot be reported: take a shorter one
            c.count[REJECTED] += 1
            c.real[H] = 0.25 * h
            c.real[GROW] = 1.0
            continue
        if c.count[NEXT] < c.times.shape[0] and c.times[c.count[NEXT]] <= t + h:
            return used  # the buffer is full inside this step: it is taken again by the next call
        for i in range(c.y.shape[1]):
            c.y[0, i] = c.y[1, i]
            c.K[0, i] = c.K[R.order_i[1], i]
        c.count[ACCEPTED] += 1
        c.real[T] = c.real[T_END] if h == c.real[T_END] - t else t + h
        c.real[H] = h * (min(c.real[GROW], max(0.2, SAFETY * error**exponent)) if error > 0.0 else c.real[GROW])
        c.real[GROW] = 6.0
    c.count[STATUS] = DONE
    return used
