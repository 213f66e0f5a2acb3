"""One adaptive loop for every explicit Runge-Kutta pair, with dense output, projection and chunked output.

Knows nothing of mechanisms: it is given ``derivative(t, y, dy, S, W)``, ``arrive(t, y, dy, S, W)``, which also
projects y, ``tangent(y, e, S, W)``, which projects an error, ``report(t, y, out, S, W)``, and ``inspect(t, h, span, k,
seen, S, W)``, which says where in a step laws do what its stages have not seen. It returns when its output buffer is
full, its share of steps is done, the end is reached, or it cannot go on; the caller calls again with the same
``Clock``. Progress, interrupt and restart are this.
"""

from __future__ import annotations

from ...compiler.jit import formula
from .clock import (
    ACCEPTED,
    AT_END,
    AT_START,
    BACK,
    BEFORE,
    BETWEEN,
    BLURRED_AT,
    DONE,
    EXCESS,
    GROW,
    H_MAX,
    LARGEST,
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
    STEP,
    STUCK,
    T_END,
    TOO_MANY,
    UNREPORTED,
    H,
    T,
)
from .refusal import afresh, enter, refuse, shorten
from .step import attempt, defect, extend, first_step, interpolate


@formula
def write(derivative, report, S, W, R, c, h, out, used):
    """Report every output time within the step of width h, as far as the buffer reaches. Returns (status, used)."""
    t = c.real[T]
    end = t + h
    extended = False
    while c.count[NEXT] < c.times.shape[0] and used < out.shape[0]:
        s = c.times[c.count[NEXT]]
        if s > end:
            break
        if s == end:
            for i in range(c.y.shape[1]):
                c.y[BETWEEN, i] = c.y[NEW, i]
        else:
            if not extended and extend(derivative, S, W, R, c, h) != 0:
                return UNREPORTED, used
            extended = True
            interpolate(R, c, (s - t) / h, h, c.y[BETWEEN])
        if report(s, c.y[BETWEEN], out[used], S, W) != 0:
            return UNREPORTED, used
        used += 1
        c.count[NEXT] += 1
    return 0, used


@formula
def start(derivative, inspect, report, S, W, R, c, out, used):
    """First derivative, first step width, and the output at the very start. Returns (status, used)."""
    if derivative(c.real[T], c.y[NOW], c.K[0], S, W) != 0:
        return STUCK, used
    inspect(c.real[T], 0.0, c.real[SPAN], AT_START, c.seen, S, W)
    for i in range(c.y.shape[1]):
        if not c.K[0, i] - c.K[0, i] == 0.0:
            return NOT_FINITE, used
    if c.real[H] <= 0.0:
        c.real[H] = first_step(derivative, S, W, R, c)
    while c.count[NEXT] < c.times.shape[0] and c.times[c.count[NEXT]] <= c.real[T]:
        for i in range(c.y.shape[1]):
            c.y[BETWEEN, i] = c.y[NOW, i]
        if report(c.times[c.count[NEXT]], c.y[BETWEEN], out[used], S, W) != 0:
            return UNREPORTED, used
        used += 1
        c.count[NEXT] += 1
    c.real[GROW] = 6.0
    c.real[EXCESS] = 1.0
    c.real[BEFORE] = c.real[BACK] = c.real[T]
    c.real[BLURRED_AT] = c.real[T] - c.real[SPAN]
    afresh(c)
    c.count[STARTED] = 1
    return 0, used


@formula
def overlooked(derivative, inspect, S, W, R, c, h):
    """Whether laws do something within the step that its stages have not seen, and that matters.

    ``inspect`` names places where a law is not as its values elsewhere in the step let expect; what this comes to is
    what the dense output misses of the equations there, over the part of the step for which it lasts.
    """
    if c.seen.shape[1] == 0 or c.real[STEP] > 0.0:
        return False
    k, x, share = inspect(c.real[T], h, c.real[SPAN], 0, c.seen, S, W)
    if k > 0 and extend(derivative, S, W, R, c, h) != 0:
        return True
    while k > 0:
        if not defect(derivative, S, W, R, c, h, x) * share <= 1.0:
            return True
        k, x, share = inspect(c.real[T], h, c.real[SPAN], k, c.seen, S, W)
    return False


@formula
def width(c):
    """Width of the next step: none is left over at the end that is very short; 0 if it would be too short.

    Fixed steps are never wider, and narrower only where they end: at events, and at the end of the time.
    """
    left = c.real[T_END] - c.real[T]
    h = min(c.real[H], c.real[H_MAX])
    if 1.000001 * h >= left:
        h = left
    elif 2.0 * h > left and c.real[STEP] == 0.0:
        h = 0.5 * left
    return 0.0 if h < 1e-14 * max(abs(c.real[T]), c.real[LARGEST]) else h


@formula
def advance(derivative, arrive, tangent, inspect, report, S, W, R, c, out):
    """Go on until done, stuck, the buffer ``out`` is full or the quota of steps is used. Returns rows written."""
    used = 0
    c.count[STATUS] = RUNNING
    if c.count[STARTED] == 0:
        c.count[STATUS], used = start(derivative, inspect, report, S, W, R, c, out, used)
        if c.count[STATUS] != RUNNING:
            return used
    steps = 0
    while c.real[T] < c.real[T_END]:
        if used == out.shape[0] or steps >= c.count[QUOTA]:
            return used
        if c.count[ACCEPTED] + c.count[REJECTED] >= c.count[LIMIT]:
            c.count[STATUS] = TOO_MANY
            return used
        h = width(c)
        if h == 0.0:
            c.count[STATUS] = STUCK
            return used
        steps += 1
        status, error = attempt(derivative, arrive, tangent, S, W, R, c, h)
        if status != 0 or not error <= max(1.0, c.real[PARDON]):
            refuse(derivative, arrive, tangent, S, W, R, c, h, status, error)
            continue
        inspect(c.real[T], h, c.real[SPAN], AT_END, c.seen, S, W)
        if overlooked(derivative, inspect, S, W, R, c, h):
            shorten(c, 0.5 * h)
            continue
        status, used = write(derivative, report, S, W, R, c, h, out, used)
        if status != 0:  # what lies inside the step cannot be reported: take a shorter one
            shorten(c, 0.25 * h)
            continue
        t = c.real[T_END] if h == c.real[T_END] - c.real[T] else c.real[T] + h
        if c.count[NEXT] < c.times.shape[0] and c.times[c.count[NEXT]] <= c.real[T] + h:
            return used  # the buffer is full inside this step: it is taken again by the next call
        enter(R, c, t, h, error)
    c.count[STATUS] = DONE
    return used
