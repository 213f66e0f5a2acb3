"""The adaptive loop of `explicit`, watched: its steps end on events.

Guards are numbers that depend on time and state; an event is where one of them passes zero. It is given what `explicit`
is, and ``watch(t, y, S, W, row)``, ``note(S, W, row)`` and ``look(t, h, x, S, W, row)``, which write guards to a row of
``W.g``: with the equations, at the state last evaluated (which it also keeps), and as expected from what was kept.
W is a `Watch`. It returns besides when a step ends on events; whoever calls changes the state as these want it, sets
``c.count[STARTED]`` to 0 and calls again.
"""

from __future__ import annotations

from ...compiler.jit import formula
from .clock import (
    ACCEPTED,
    AT_END,
    DONE,
    LIMIT,
    NEXT,
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
    TOO_MANY,
    WIDE,
    H,
    T,
)
from .explicit import overlooked, start, width, write
from .glance import NOISE
from .panels import rounding, side_of
from .refusal import enter, refuse, shorten
from .sought import CUT, first_event
from .step import attempt
from .watching import (
    CUTS,
    END,
    EVENT,
    EVENTS,
    EXTENDED,
    FIRED,
    FRESH,
    GRAIN_END,
    GRAIN_START,
    LATEST,
    LEAST,
    MOST,
    SIDE,
    STAGE,
    START,
    STEPS,
    UNKNOWN,
)

OFTEN = 64.0  # times as long as from event to event that the step after one is at most


@formula
def advance_watched(callbacks, inspect, report, S, W, R, c, out):
    """As `explicit.advance`, and returns where a step ends on events. Returns rows written.

    Callbacks: derivative, arrive, tangent, watch, note, look.
    """
    derivative, arrive, tangent, watch, note, _ = callbacks
    used = 0
    c.count[STATUS] = RUNNING
    if c.count[STARTED] == 0:
        c.count[STATUS], used = start(derivative, inspect, report, S, W, R, c, out, used)
        if c.count[STATUS] != RUNNING:
            return used
        W.count[FRESH] = 1
        if see(watch, note, S, W, c) != 0:
            c.count[STATUS] = STUCK
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
        t = c.real[T]
        W.count[STAGE] = W.count[EXTENDED] = 0
        status, error = attempt(derivative, arrive, tangent, S, W, R, c, h)
        if status != 0 or not error <= max(1.0, c.real[PARDON]):
            refuse(derivative, arrive, tangent, S, W, R, c, h, status, error)
            if c.real[T] < t:  # the step before is taken back
                W.count[FRESH] = 1
                for i in range(W.side.shape[0]):
                    W.side[i] = UNKNOWN
                see(watch, note, S, W, c)
            continue
        used, over = go_on(callbacks, inspect, report, S, W, R, c, out, used, (h, error))
        if over:
            return used
    c.count[STATUS] = DONE
    return used


@formula
def go_on(callbacks, inspect, report, S, W, R, c, out, used, step):
    """Go on to the end of a step that is good, (width, error), or to the first event in it.

    Returns (rows written, whether the loop returns); a step that cannot be taken makes the next one shorter.
    """
    derivative, _, _, _, note, _ = callbacks
    whole, error = step
    note(S, W, END)
    inspect(c.real[T], whole, c.real[SPAN], AT_END, c.seen, S, W)
    if overlooked(derivative, inspect, S, W, R, c, whole):
        shorten(c, 0.5 * whole)
        return used, False
    status, h, error, hit = first_event(callbacks, S, W, R, c, whole, error)
    if status == 0:
        if hit:
            inspect(c.real[T], h, c.real[SPAN], AT_END, c.seen, S, W)
        status, used = write(derivative, report, S, W, R, c, h, out, used)
    if status == CUT:
        W.count[CUTS] += 1
        shorten(c, h)
        return used, False
    if status != 0:  # what lies inside the step cannot be told: take a shorter one
        shorten(c, 0.25 * whole)
        return used, False
    t = c.real[T_END] if h == c.real[T_END] - c.real[T] else c.real[T] + h
    if hit and used > 0 and out[used - 1, 0] == t:  # written when it is known how the motion goes on
        used -= 1
        c.count[NEXT] -= 1
    elif c.count[NEXT] < c.times.shape[0] and c.times[c.count[NEXT]] <= c.real[T] + h:
        return used, True  # the buffer is full inside this step: it is taken again by the next call
    enter(R, c, t, h, error)
    W.count[STEPS] += 1
    W.count[CUTS] = 0
    if hit:
        c.real[H], c.real[WIDE] = max(c.real[H], whole), max(c.real[WIDE], whole)
        if c.real[T] > W.real[LATEST]:  # as wide as it can be looked through for more that come as soon
            c.real[H] = min(c.real[H], OFTEN * (c.real[T] - W.real[LATEST]))
            W.real[LATEST] = c.real[T]
        c.count[STATUS] = EVENT
        W.count[EVENTS] += 1
        known_sides(W, c, h)
    else:
        settled(W)
    return used, hit


@formula
def see(watch, note, S, W, c):
    """Guards where the next step begins, and what they depend on. Returns a status."""
    status = watch(c.real[T], c.y[NOW], S, W, START)
    if status == 0:
        note(S, W, START)
    for i in range(W.side.shape[0]):  # what jumped since is on no known side
        if abs(W.side[i]) == 1.0 and not W.side[i] * W.g[START, i] >= 0.5 * abs(W.g[END, i]):
            W.side[i] = UNKNOWN
    return status


@formula
def known_sides(W, c, h):
    """Sides of guards at the end of a step that ends on an event: 0 of what fired; others are known beyond rounding.

    So what is to fire next, however soon, is not taken for what has just fired.
    """
    for i in range(W.side.shape[0]):
        f, slope = W.g[END, i], (W.g[MOST, i] - W.g[LEAST, i]) / h
        W.side[i] = UNKNOWN
        if W.fired[i] == 1:
            W.side[i], W.g[FIRED, i] = 0.0, abs(f)
        elif W.kept[i] == 0 and f - f == 0.0 and abs(f) > rounding(W, c, i, slope, GRAIN_END):
            W.side[i] = side_of(f)


@formula
def settled(W):
    """The end of the step is the start of the next."""
    W.count[FRESH] = 0
    for i in range(W.way.shape[0]):
        W.side[i] = 0.0 if W.kept[i] == 1 and abs(W.g[END, i]) <= NOISE * W.grain[i] else W.g[SIDE, i]
        W.g[START, i], W.g[GRAIN_START, i] = W.g[END, i], W.g[GRAIN_END, i]
    for k in range(W.moving.shape[1]):
        for m in range(W.moving.shape[2]):
            W.moving[0, k, m] = W.moving[1, k, m]
    last = W.levels.shape[0] - 1
    for m in range(W.levels.shape[1]):
        W.levels[0, m] = W.levels[last, m]
