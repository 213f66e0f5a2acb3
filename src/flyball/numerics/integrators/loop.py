"""The one loop of all integrators: output, quota, refusal, the end; its steps are asked of a method.

A method is ``ask(own, S, W, R, c, task)``, by the tasks named here; what it works with is its own business. ``c`` is
the `Clock`, in which the width of a step stands (TRIED), its error (ERROR), and which part of it is asked for (PART).
``report(t, y, out, S, W)`` writes a row of output. What is done besides at the begin of a stretch and at the end of a
step is ``begun`` and ``onward``: nothing and `whole`, or those of `watched`, whose steps end on events. The loop
returns when its output buffer is full, its share of steps is done, the end is reached, or it cannot go on; the caller
calls again with the same ``Clock``. Progress, interrupt and restart are this.
"""

from __future__ import annotations

from ...compiler.formulas import formula
from .clock import (
    BETWEEN,
    DONE,
    NEW,
    NOW,
    RUNNING,
    STUCK,
    TOO_MANY,
    UNREPORTED,
)

# what a method is asked: to begin at the state (a status of the clock); a step of the width TRIED to c.y[NEW] (0 or
# not), after which ERROR is known; the state at a part of it to c.y[BETWEEN] (0 or not); what to try after a step that
# is not good (0, or that there is nothing); whether laws do something in it that was not seen; to take note of its end;
# to make its end the present state, and the width of the next
BEGIN, TRY, WITHIN, REFUSE, OVERLOOKED, ENDED, ENTER = range(7)


@formula
def nothing(callbacks, S, W, c, back):
    """Nothing is done as a stretch begins. Returns a status."""
    return 0


@formula
def start(callbacks, S, W, R, c, out):
    """Have the method begin, and write the output at the very start. Returns (status, rows written)."""
    ask, own, report, begun, _ = callbacks[:5]
    used = 0
    status = ask(own, S, W, R, c, BEGIN)
    if status != 0:
        return status, used
    while c.count.next < c.times.shape[0] and c.times[c.count.next] <= c.real.t:
        for i in range(c.y.shape[1]):
            c.y[BETWEEN, i] = c.y[NOW, i]
        if report(c.times[c.count.next], c.y[BETWEEN], out[used], S, W) != 0:
            return UNREPORTED, used
        used += 1
        c.count.next += 1
    c.count.started = 1
    return (STUCK if begun(callbacks, S, W, c, False) != 0 else 0), used


@formula
def ending(c):
    """Time at which the step in the making ends: T_END itself where it reaches that, as T + h may be less."""
    h = c.real.tried
    return c.real.t_end if h == c.real.t_end - c.real.t else c.real.t + h


@formula
def write(callbacks, S, W, R, c, out, used):
    """Report every output time within the step, as far as the buffer reaches. Returns (status, used)."""
    ask, own, report = callbacks[:3]
    t, h, end = c.real.t, c.real.tried, ending(c)
    while c.count.next < c.times.shape[0] and used < out.shape[0]:
        s = c.times[c.count.next]
        if s > end:
            break
        if s == end:
            for i in range(c.y.shape[1]):
                c.y[BETWEEN, i] = c.y[NEW, i]
        else:
            c.real.part = (s - t) / h
            if ask(own, S, W, R, c, WITHIN) != 0:
                return UNREPORTED, used
        if report(s, c.y[BETWEEN], out[used], S, W) != 0:
            return UNREPORTED, used
        used += 1
        c.count.next += 1
    return 0, used


@formula
def width(c):
    """Width of the next step: none is left over at the end that is very short; 0 if it would be too short.

    Fixed steps are never wider, and narrower only where they end: at events, and at the end of the time.
    """
    left = c.real.t_end - c.real.t
    h = min(c.real.h, c.real.h_max)
    if 1.000001 * h >= left:
        h = left
    elif 2.0 * h > left and c.real.step == 0.0:
        h = 0.5 * left
    return 0.0 if h < 1e-14 * max(abs(c.real.t), c.real.largest) else h


@formula
def shorten(c, h):
    """Try a step of that width next, as the last was refused."""
    c.count.rejected += 1
    c.real.grow = 1.0
    c.real.h = h


@formula
def narrow(c, h):
    """The same after a step within which something cannot be: for steps of fixed width there is nothing to try."""
    shorten(c, h if c.real.step == 0.0 else 0.0)


@formula
def unclear(c, h):
    """Try a step next within which the state may be told, after one of width h in which it cannot be."""
    narrow(c, c.real.clearer if c.real.clearer > 0.0 else 0.25 * h)


@formula
def full(c):
    """Whether the buffer was full inside the step: it is taken again by the next call."""
    return c.count.next < c.times.shape[0] and c.times[c.count.next] <= ending(c)


@formula
def whole(callbacks, S, W, R, c, out, used):
    """Go on to the end of a step that is good. Returns (rows written, whether the loop returns)."""
    ask, own = callbacks[:2]
    h = c.real.tried
    if c.seen.shape[1] > 0 and ask(own, S, W, R, c, OVERLOOKED) != 0:
        narrow(c, 0.5 * h)
        return used, False
    status, used = write(callbacks, S, W, R, c, out, used)
    if status != 0:  # what lies inside the step cannot be reported: take a shorter one
        unclear(c, h)
        return used, False
    if full(c):
        return used, True
    ask(own, S, W, R, c, ENTER)
    return used, False


@formula
def advance(callbacks, S, W, R, c, out):
    """Go on until done, stuck, the buffer ``out`` is full or the quota of steps is used. Returns rows written.

    Callbacks: ask, own, report, begun, onward, and what these two need.
    """
    ask, own, _, begun, onward = callbacks[:5]
    used = 0
    c.count.status = RUNNING
    if c.count.started != 1:
        c.count.status, used = start(callbacks, S, W, R, c, out)
        if c.count.status != RUNNING:
            return used
    steps = 0
    while c.real.t < c.real.t_end:
        if used == out.shape[0] or steps >= c.count.quota:
            return used
        if c.count.accepted + c.count.rejected >= c.count.limit:
            c.count.status = TOO_MANY
            return used
        c.real.tried = width(c)
        if c.real.tried == 0.0:
            c.count.status = STUCK
            return used
        steps += 1
        t = c.real.t
        c.real.clearer = 0.0
        c.count.trouble = ask(own, S, W, R, c, TRY)
        if c.count.trouble != 0 or not c.real.error <= max(1.0, c.real.pardon):
            if ask(own, S, W, R, c, REFUSE) != 0:
                c.count.status = STUCK
                return used
            if c.real.t < t:  # the step before is taken back
                begun(callbacks, S, W, c, True)
            continue
        used, over = onward(callbacks, S, W, R, c, out, used)
        if over:
            return used
    c.count.status = DONE
    return used
