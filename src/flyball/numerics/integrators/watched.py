"""The `loop`, watched: its steps end on events.

Guards are numbers that depend on time and state; an event is where one of them passes zero. The loop is given besides
``watch(t, y, S, W, row)``, ``note(S, W, row)`` and ``look(t, h, x, S, W, row)``, which write guards to a row of
``W.g``: with the equations, at the state last evaluated (which it also keeps), and as expected from what was kept.
W is a `Watch`. It returns besides when a step ends on events; whoever calls changes the state as these want it, sets
``c.count.started`` to 0 and calls again.
"""

from __future__ import annotations

from ...compiler.formulas import formula
from .clock import NOW, ULP
from .concave import NOISE
from .grains import hush, rounding, side_at_start, strayed
from .loop import ENDED, ENTER, OVERLOOKED, ending, full, narrow, shorten, unclear, write
from .panels import NEAR, side_of
from .sought import CUT, first_event
from .watching import (
    END,
    EVENT,
    FIRED,
    GRAIN_END,
    GRAIN_START,
    LEAST,
    MARK,
    MOST,
    SIDE,
    START,
    UNKNOWN,
)

OFTEN = 64.0  # times as long as from event to event that the step after one is at most
SAME = 4.0  # units in the last place: an output time so little before an event is the event's


@formula
def begun(callbacks, S, W, c, back):
    """See where guards are as a stretch of the motion begins, or where a step was taken back to. Returns a status."""
    watch, note = callbacks[5], callbacks[6]
    W.count.fresh = 1
    strayed(W, c)
    if back:
        for i in range(W.side.shape[0]):
            W.side[i] = UNKNOWN
    return see(watch, note, S, W, c)


@formula
def onward(callbacks, S, W, R, c, out, used):
    """Go on to the end of a step that is good, or to the first event in it.

    Returns (rows written, whether the loop returns); a step that cannot be taken makes the next one shorter.
    """
    ask, own, note = callbacks[0], callbacks[1], callbacks[6]
    most = c.real.tried
    note(S, W, END)
    strayed(W, c)
    if c.seen.shape[1] > 0 and ask(own, S, W, R, c, OVERLOOKED) != 0:
        narrow(c, 0.5 * most)
        return used, False
    status, h, hit = first_event(callbacks, S, W, R, c)
    if status == 0:
        if hit:
            ask(own, S, W, R, c, ENDED)
        status, used = write(callbacks, S, W, R, c, out, used)
    if status == CUT:
        W.count.cuts += 1
        shorten(c, h)
        return used, False
    if status != 0:  # what lies inside the step cannot be told: take a shorter one
        unclear(c, most)
        return used, False
    at_once = ending(c) - SAME * ULP * abs(ending(c))
    if hit and used > 0 and out[used - 1, 0] >= at_once:  # written when it is known how the motion goes on
        used -= 1
        c.count.next -= 1
    elif full(c):
        return used, True
    ask(own, S, W, R, c, ENTER)
    W.count.steps += 1
    W.count.cuts = 0
    if hit:
        c.real.h, c.real.wide = max(c.real.h, most), max(c.real.wide, most)
        if c.real.t > W.real.latest:  # as wide as it can be looked through for more that come as soon
            c.real.h = min(c.real.h, OFTEN * (c.real.t - W.real.latest))
            W.real.latest = c.real.t
        c.count.status = EVENT
        W.count.events += 1
        known_sides(W, c, c.real.tried)
    else:
        settled(W)
    return used, hit


@formula
def see(watch, note, S, W, c):
    """Guards where the next step begins, and what they depend on. Returns a status."""
    status = watch(c.real.t, c.y[NOW], S, W, START)
    if status == 0:
        note(S, W, START)
    for i in range(W.side.shape[0]):  # what jumped since is on no known side
        f = W.side[i] * W.g[START, i] + 2.0 * hush(W, i, 0.0)
        if abs(W.side[i]) == 1.0 and not f >= 0.5 * abs(W.g[END, i]):
            W.side[i] = UNKNOWN
    return status


@formula
def known_sides(W, c, h):
    """Sides of guards at the end of a step that ends on an event: 0 of what fired; others are known beyond rounding.

    So what is to fire next, however soon, is not taken for what has just fired. W.g[MARK] is what is zero of each.
    """
    for i in range(W.side.shape[0]):
        f, s, slope = W.g[END, i], side_at_start(W, i), (W.g[MOST, i] - W.g[LEAST, i]) / h
        nothing = rounding(W, c, i, slope, 1.0)
        W.side[i] = UNKNOWN
        if W.fired[i] == 1:
            W.side[i], W.g[FIRED, i] = 0.0, abs(f)
            if abs(f) <= NEAR * max(abs(W.g[LEAST, i]), abs(W.g[MOST, i])):  # it did not jump
                nothing = max(nothing, NOISE * abs(f))
        elif W.kept[i] == 0 and f - f == 0.0 and abs(f) > nothing:
            W.side[i] = side_of(f)
        elif W.kept[i] == 0 and abs(f) < hush(W, i, 1.0):  # it may be about to pass: it has not yet
            W.side[i] = s if s != 0.0 else UNKNOWN
        W.g[MARK, i] = nothing


@formula
def settled(W):
    """The end of the step is the start of the next."""
    W.count.fresh = 0
    for i in range(W.way.shape[0]):
        W.side[i] = 0.0 if W.kept[i] == 1 and abs(W.g[END, i]) <= NOISE * W.grain[i] else W.g[SIDE, i]
        W.g[START, i], W.g[GRAIN_START, i] = W.g[END, i], W.g[GRAIN_END, i]
    for i in range(W.way.shape[0], W.way.shape[0] + W.count.terms):
        W.g[START, i] = W.g[END, i]
    for k in range(W.moving.shape[1]):
        for m in range(W.moving.shape[2]):
            W.moving[0, k, m] = W.moving[1, k, m]
    last = W.levels.shape[0] - 1
    for m in range(W.levels.shape[1]):
        W.levels[0, m] = W.levels[last, m]
