"""A loop of steps of fixed width, for methods that choose none: narrower only where the time ends."""

from __future__ import annotations

from ....compiler.jit import formula
from ..clock import (
    ACCEPTED,
    ASIDE,
    BETWEEN,
    BLURRED_AT,
    DONE,
    EXCESS,
    LIMIT,
    NEW,
    NEXT,
    NOT_FINITE,
    NOW,
    QUOTA,
    RUNNING,
    SPAN,
    STARTED,
    STATUS,
    STEP,
    STUCK,
    T_END,
    TOO_MANY,
    UNREPORTED,
    T,
)
from .desk import BEFORE as DESK_BEFORE
from .desk import START

JUMPED = 1e-5  # part of size and speed by which a state that is off its constraints has not moved by itself


@formula
def start(method, callbacks, S, K, c, out, used):
    """The state at the very start, put on its constraints, and the output there. Returns (status, used)."""
    arrive, report = callbacks[3], callbacks[-1]
    for i in range(c.y.shape[1]):
        c.y[NEW, i] = c.y[NOW, i]
    status, moved = arrive(c.real[T], c.y[NEW], c.K[0], S, K)
    if status != 0 or moved > JUMPED:
        return STUCK, used
    for i in range(c.y.shape[1]):
        c.y[NOW, i] = c.y[NEW, i]
        if not c.K[0, i] - c.K[0, i] == 0.0:
            return NOT_FINITE, used
    while c.count[NEXT] < c.times.shape[0] and c.times[c.count[NEXT]] <= c.real[T]:
        for i in range(c.y.shape[1]):
            c.y[BETWEEN, i] = c.y[NOW, i]
        if report(c.times[c.count[NEXT]], c.y[BETWEEN], out[used], S) != 0:
            return UNREPORTED, used
        used += 1
        c.count[NEXT] += 1
    c.real[EXCESS] = 1.0
    c.real[BLURRED_AT] = c.real[T] - c.real[SPAN]
    c.count[STARTED] = 1
    for i in range(K.found.shape[0]):
        K.lam[START, i] = K.found[i]
    K.count[DESK_BEFORE] = 0
    return 0, used


@formula
def write(method, callbacks, S, K, c, h, out, used):
    """Report every output time within the step of width h, as far as the buffer reaches. Returns (status, used)."""
    compose, report = callbacks[2], callbacks[-1]
    end = c.real[T] + h
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
            method[1](K, (s - c.real[T]) / h, h, K.d[START], K.a[START], z)
            compose(c.y[NOW], K.d[START], K.a[START], z, row, S)
        if report(s, row, out[used], S) != 0:
            return UNREPORTED, used
        used += 1
        c.count[NEXT] += 1
    return 0, used


@formula
def advance(method, callbacks, S, K, c, out):
    """Go on until done, stuck, the buffer ``out`` is full or the quota of steps is used. Returns rows written."""
    used = 0
    c.count[STATUS] = RUNNING
    if c.count[STARTED] == 0:
        c.count[STATUS], used = start(method, callbacks, S, K, c, out, used)
        if c.count[STATUS] != RUNNING:
            return used
    steps = 0
    while c.real[T] < c.real[T_END]:
        if used == out.shape[0] or steps >= c.count[QUOTA]:
            return used
        if c.count[ACCEPTED] >= c.count[LIMIT]:
            c.count[STATUS] = TOO_MANY
            return used
        left = c.real[T_END] - c.real[T]
        last = left < 1.000001 * c.real[STEP]
        h = left if last else c.real[STEP]
        steps += 1
        status, _, asked = method[0](callbacks, S, K, c, h)
        if status == 0:
            status, used = write(method, callbacks, S, K, c, h, out, used)
        if status != 0:
            c.count[STATUS] = STUCK
            return used
        if c.count[NEXT] < c.times.shape[0] and c.times[c.count[NEXT]] <= c.real[T] + h:
            return used  # the buffer is full inside this step: it is taken again by the next call
        method[2](K, c, c.real[T_END] if last else c.real[T] + h, h, 0.0, asked)
    c.count[STATUS] = DONE
    return used
