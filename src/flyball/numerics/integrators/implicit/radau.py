"""The adaptive loop of Radau IIA of order 5 for equations of motion with constraints, stabilised index 2.

Knows nothing of mechanisms: it is given ``residual`` (see `step`); ``linearise(t, k, S, K, c)``, which fills row k of
the numbers of the Jacobian at stage k, or where the step begins; ``compose(y, d, v, z, out, S)``, which makes a state
of increments; ``arrive`` (which leaves the multipliers in ``K.found``), ``inspect`` and ``report`` as explicit loops
are. It returns and goes on as these do. Step control after Hairer and Wanner, *Solving Ordinary Differential Equations
II* (1996), section IV.8, with Gustafsson's predictive control.
"""

from __future__ import annotations

from ....compiler.jit import formula
from ..clock import (
    ACCEPTED,
    ASIDE,
    AT_END,
    AT_START,
    BEST,
    BEST_H,
    BETWEEN,
    BLURRED_AT,
    DONE,
    EXCESS,
    EXCESS_AT,
    FROM,
    FROM_RATE,
    GROW,
    LIMIT,
    NEW,
    NEXT,
    NOT_FINITE,
    NOW,
    PARDON,
    QUOTA,
    REJECTED,
    RUNNING,
    SPAN,
    STARTED,
    STATUS,
    STUCK,
    T_END,
    TO,
    TO_RATE,
    TOO_MANY,
    UNREPORTED,
    WIDE,
    H,
    T,
)
from ..explicit import width
from ..refusal import afresh
from .desk import BEFORE, FRESH, JACOBIANS, LAST_ERROR, LAST_H, RATE, RTOL, START, STEP, THETA, WIDTH
from .newton import factor
from .step import MOST, begin, between, defect, estimate, iterate, predict
from .whole import iterate_whole

SAFETY = 0.9
WIDEST, NARROWEST = 8.0, 0.2  # what the width changes by at most
KEPT = 1.2  # a step that could be wider by this is not: the factors serve on
SURE = 1e-3  # a rate of the iteration below which the Jacobian serves on
FIRST = 1e-4  # part of the time span that is tried first
WALKED = 1e-3  # part of the widest step of late below which narrower ones lead into a singular position
FALLS, NARROWER = 0.5, 0.1  # what an error falls by at least in a step that is so much narrower, if it is no rounding
SLIGHT = 10.0  # an error from rounding that is accepted where no step of another width is found
ROUGH = 1e-5  # a relative error of a step above which rounding is no excuse
JUMPED = 1e-5  # part of size and speed by which a state that is off its constraints has not moved by itself
SINGULAR = 3


@formula
def start(callbacks, S, K, c, out, used):
    """The state at the very start, put on its constraints, and the output there. Returns (status, used)."""
    _, _, _, arrive, inspect, report = callbacks
    y = c.y[NEW]
    for i in range(y.shape[0]):
        y[i] = c.y[NOW, i]
    status, moved = arrive(c.real[T], y, c.K[0], S, K)
    if status != 0 or moved > JUMPED:
        return STUCK, used
    for i in range(y.shape[0]):
        c.y[NOW, i] = y[i]
        if not c.K[0, i] - c.K[0, i] == 0.0:
            return NOT_FINITE, used
    inspect(c.real[T], 0.0, c.real[SPAN], AT_START, c.seen, S)
    for i in range(K.found.shape[0]):
        K.lam[START, i] = K.found[i]
    while c.count[NEXT] < c.times.shape[0] and c.times[c.count[NEXT]] <= c.real[T]:
        for i in range(y.shape[0]):
            c.y[BETWEEN, i] = y[i]
        if report(c.times[c.count[NEXT]], c.y[BETWEEN], out[used], S) != 0:
            return UNREPORTED, used
        used += 1
        c.count[NEXT] += 1
    K.count[FRESH] = K.count[BEFORE] = 0
    K.real[WIDTH] = 0.0
    K.real[RATE], K.real[THETA] = 1.0, SURE
    K.real[LAST_ERROR] = 0.0
    c.real[GROW] = WIDEST
    c.real[EXCESS] = 1.0
    c.real[BLURRED_AT] = c.real[T] - c.real[SPAN]
    afresh(c)
    c.count[STARTED] = 1
    return 0, used


@formula
def write(callbacks, S, K, c, h, out, used):
    """Report every output time within the step of width h, as far as the buffer reaches. Returns (status, used)."""
    _, _, compose, _, _, report = callbacks
    t = c.real[T]
    end = t + h
    row = c.y[BETWEEN]
    while c.count[NEXT] < c.times.shape[0] and used < out.shape[0]:
        s = c.times[c.count[NEXT]]
        if s > end:
            break
        if s == end:
            for i in range(row.shape[0]):
                row[i] = c.y[NEW, i]
        else:
            z = c.y[ASIDE, : K.z.shape[1]]
            between(K, (s - t) / h, h, K.d[START], K.a[START], z)
            compose(c.y[NOW], K.d[START], K.a[START], z, row, S)
        if report(s, row, out[used], S) != 0:
            return UNREPORTED, used
        used += 1
        c.count[NEXT] += 1
    return 0, used


@formula
def rest(K, c):
    """Where the step begins, as a stage."""
    nv = K.v.shape[1]
    nq = c.y.shape[1] - nv - K.z.shape[1]
    for i in range(nv):
        K.d[START, i] = 0.0
        K.a[START, i] = c.K[0, nq + i]


@formula
def attempt(callbacks, S, K, c, h):
    """One step of width h into c.y[NEW]. Returns (status, error, factor that a failed iteration asks for)."""
    residual, linearise, compose, arrive, _, _ = callbacks
    begin(c, K)
    if K.count[FRESH] < 1 and not (K.count[FRESH] == 0 and K.real[WIDTH] > 0.0):
        rest(K, c)
        if linearise(c.real[T], START, S, K, c) != 0:
            return SINGULAR, 0.0, 0.5
        K.count[JACOBIANS] += 1
        K.count[FRESH] = 1
        K.real[WIDTH] = 0.0
    if K.real[WIDTH] != h and factor(K, h) != 0:
        return SINGULAR, 0.0, 0.5
    predict(K, h)
    status, asked = iterate(residual, S, K, c, h)
    if status != 0:
        if K.count[FRESH] == 1:
            predict(K, h)
            status = iterate_whole((residual, linearise), S, K, c, h)
            if status == 0:
                asked = float(MOST)
                K.real[THETA] = 1.0
        if status != 0:
            return status, 0.0, asked
    compose(c.y[NOW], K.d[2], K.v[2], K.z[2], c.y[NEW], S)
    error = 0.0
    if K.real[STEP] == 0.0:
        status, error = estimate(residual, S, K, c, h, c.count[ACCEPTED] == 0 or c.real[GROW] <= 1.0)
        if status != 0 or not error < 1e300:
            return SINGULAR, 0.0, 0.5
        if error > max(1.0, c.real[PARDON]):
            return 0, error, asked
    status, _ = arrive(c.real[T] + h, c.y[NEW], c.K[1], S, K)
    return status, error, asked if status == 0 else 0.5


@formula
def overlooked(callbacks, S, K, c, h):
    """Whether laws do something within the step that its stages have not seen, and that matters; see `explicit`.

    With steps of fixed width only what no width makes right: another branch of a formula.
    """
    residual, _, _, _, inspect, _ = callbacks
    if c.seen.shape[1] == 0:
        return False
    inspect(c.real[T], h, c.real[SPAN], AT_END, c.seen, S)
    k, x, share = inspect(c.real[T], h, c.real[SPAN], 0, c.seen, S)
    while k > 0:
        if share > 1.0 or (K.real[STEP] == 0.0 and not defect(residual, S, K, c, h, x) * share <= 1.0):
            return True
        k, x, share = inspect(c.real[T], h, c.real[SPAN], k, c.seen, S)
    return False


@formula
def wider(h, error, iterations):
    """Width that an error asks for, less where the iteration took long."""
    safe = min(SAFETY, SAFETY * (1.0 + 2.0 * MOST) / (iterations + 2.0 * MOST))
    return h / max(1.0 / WIDEST, min(1.0 / NARROWEST, error**0.25 / safe)), safe


@formula
def refuse(K, c, h, factor):
    """Try a narrower step, and with the Jacobian of where it begins."""
    c.count[REJECTED] += 1
    c.real[GROW] = 1.0
    c.real[H] = factor * h
    if K.count[FRESH] != 1:
        K.count[FRESH] = -1


@formula
def pardon(K, c, h, error):
    """Where ever narrower steps miss the tolerance by as much, rounding decides: the widest of them is taken.

    So it is near a singular position, where it grows as steps get narrower. What is accepted so is told
    (c.real[EXCESS]).
    """
    if error < FALLS * c.real[BEST]:
        c.real[BEST] = error
        c.real[BEST_H] = h
    elif h < NARROWER * c.real[BEST_H] and c.real[BEST] * K.real[RTOL] < ROUGH and c.real[PARDON] == 0.0:
        c.real[PARDON] = 2.0 * c.real[BEST]
        c.real[H] = c.real[BEST_H]
        c.real[BLURRED_AT] = c.real[T]


@formula
def stranded(c):
    """Where the iteration fails in ever narrower steps, a wide one is tried, which ends beyond the place."""
    if c.real[H] < WALKED * c.real[WIDE] and c.real[PARDON] == 0.0:
        c.real[PARDON] = SLIGHT
        c.real[H] = c.real[WIDE]
        c.real[BLURRED_AT] = c.real[T]


@formula
def enter(K, c, t, h, error, iterations):
    """Make the end of the step the present state, and choose the width of the next one."""
    for i in range(c.y.shape[1]):
        c.y[NOW, i] = c.y[NEW, i]
        c.K[0, i] = c.K[1, i]
    for i in range(K.v.shape[1]):
        for k in range(4):
            K.before_v[k, i] = K.v[k, i]
    for i in range(K.lam.shape[1]):
        for k in range(3):
            K.before_lam[k, i] = K.lam[k, i]
        K.lam[START, i] = K.lam[2, i]
    if error > c.real[EXCESS]:
        c.real[EXCESS] = error
        c.real[EXCESS_AT] = c.real[T]
    wide, safe = wider(h, error, iterations)
    if K.real[LAST_ERROR] > 0.0 and error > 0.0:
        f = (h / K.real[LAST_H]) * (K.real[LAST_ERROR] / (error * error)) ** 0.25 * safe
        wide = min(wide, h * max(NARROWEST, min(WIDEST, f)))
    if c.real[GROW] <= 1.0:
        wide = min(wide, h)
    if c.real[PARDON] > 0.0:
        wide = max(h, c.real[WIDE])
    afresh(c)
    for i in range(c.seen.shape[1]):
        c.seen[FROM, i] = c.seen[TO, i]
        c.seen[FROM_RATE, i] = c.seen[TO_RATE, i]
    K.real[LAST_H] = h
    K.real[LAST_ERROR] = max(1e-2, error)
    K.count[BEFORE] = 1
    K.count[FRESH] = 0 if K.real[THETA] <= SURE else -1
    if K.count[FRESH] == 0 and h <= wide <= KEPT * h:
        wide = h
    c.real[WIDE] = max(h, 0.8 * c.real[WIDE])
    c.real[H] = wide
    c.real[T] = t
    c.real[GROW] = WIDEST
    c.count[ACCEPTED] += 1


@formula
def advance(callbacks, S, K, c, out):
    """Go on until done, stuck, the buffer ``out`` is full or the quota of steps is used. Returns rows written."""
    used = 0
    c.count[STATUS] = RUNNING
    if c.count[STARTED] == 0:
        c.count[STATUS], used = start(callbacks, S, K, c, out, used)
        if c.count[STATUS] != RUNNING:
            return used
        if c.real[H] <= 0.0:
            c.real[H] = FIRST * (c.real[T_END] - c.real[T])
    steps = 0
    while c.real[T] < c.real[T_END]:
        if used == out.shape[0] or steps >= c.count[QUOTA]:
            return used
        if c.count[ACCEPTED] + c.count[REJECTED] >= c.count[LIMIT]:
            c.count[STATUS] = TOO_MANY
            return used
        h = width(c) if K.real[STEP] == 0.0 else even(K, c)
        if h == 0.0:
            c.count[STATUS] = STUCK
            return used
        steps += 1
        status, error, asked = attempt(callbacks, S, K, c, h)
        if status != 0 and K.real[STEP] > 0.0 and K.count[FRESH] == 1:
            c.count[STATUS] = STUCK
            return used
        if status != 0:
            refuse(K, c, h, asked)
            stranded(c)
            continue
        if error > max(1.0, c.real[PARDON]):
            refuse(K, c, h, wider(h, error, asked)[0] / h if c.count[ACCEPTED] > 0 else 0.1)
            pardon(K, c, h, error)
            continue
        if overlooked(callbacks, S, K, c, h):
            if K.real[STEP] > 0.0:
                c.count[STATUS] = STUCK
                return used
            refuse(K, c, h, 0.5)
            continue
        status, used = write(callbacks, S, K, c, h, out, used)
        if status != 0:
            refuse(K, c, h, 0.25)
            continue
        t = c.real[T_END] if h == c.real[T_END] - c.real[T] else c.real[T] + h
        if c.count[NEXT] < c.times.shape[0] and c.times[c.count[NEXT]] <= c.real[T] + h:
            return used  # the buffer is full inside this step: it is taken again by the next call
        enter(K, c, t, h, error, asked)
    c.count[STATUS] = DONE
    return used


@formula
def even(K, c):
    """Width of the next step of fixed width: the last one ends where the time does."""
    left = c.real[T_END] - c.real[T]
    return left if left < 1.000001 * K.real[STEP] else K.real[STEP]
