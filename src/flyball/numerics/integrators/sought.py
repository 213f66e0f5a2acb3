"""The first event in a step, and a step that ends on it.

Where a guard may pass zero (`panels.survey`) it is looked for with the equations, and the step is taken again
(`pinned.py`). At last, whatever was seen in between: what has to stay above zero does so at the step's end, or where
it first does not is found by halves.
"""

from __future__ import annotations

from ...compiler.formulas import formula
from .clock import NEW, ULP
from .glance import compare, exactly, glance, true_guard
from .grains import hush, rounding, side_at_start
from .panels import band, begin_sides, fires, side_of, survey
from .pinned import crossing, end_on, retake
from .watching import (
    ASTRAY,
    END,
    MARK,
    SIDE,
    SLOPE,
    START,
    THERE,
    TRUE,
)

AT_ONCE = 1e-11  # part of the step within which events are at the same instant
SKIPPED = 2.0**-20  # part of the step that is gone on by at least, where there was no event after all
LITTLE = 1e-2  # part of the distance between places between which a guard passes zero over which its slope is found
SOON = 1e-7  # part of the step before which no slope is found
LAST = 1e-4  # part of the step over which slopes at its end are found
LONGER = 100.0  # times that part where a guard changes by no more than rounding over it
OTHERS = 20  # guards that may turn out to be earlier
HALVES = 44  # times that it is halved where a guard has been left unseen
SHORTER = 6  # times that a step is made shorter since what begins at zero does not go as expected
CUT, LOST_SIGHT = 2, 1  # why a step is not gone on from: not looked through; not to be evaluated


@formula
def first_event(callbacks, S, W, R, c):
    """End the step on the first event in it, if there is one: (status, width to try next, whether there is one).

    Where the status is `CUT` the step is not gone on from, and the width is one to try next.
    """
    watch, look = callbacks[5], callbacks[7]
    h = most = c.real.tried
    hit = False
    for i in range(W.fired.shape[0]):
        W.fired[i] = 0
    W.real.same = AT_ONCE * h + 8.0 * ULP * (abs(c.real.t) + h)
    compare(look, S, W, c.real.t, h, c.real.span)
    if W.count.plain == 0 and W.count.fresh == 1 and W.count.cuts < SHORTER and begins_at_zero(W):
        return CUT, 0.25 * h, False
    for _ in range(OTHERS):
        status, i, x, s = next_event(callbacks, S, W, R, c, h)
        if status == CUT and not hit:
            return CUT, max(W.real.done_to, SKIPPED) * h, False
        if status == LOST_SIGHT:
            return LOST_SIGHT, h, False
        if status != 0 or i < 0:
            break
        if hit and x * h >= h - W.real.same:
            W.fired[i] = 1
            continue
        for j in range(W.fired.shape[0]):
            W.fired[j] = 0
        if W.count.away == 1:
            status = retake(callbacks, S, W, R, c, x * h)
        else:
            slope = expected_slope(callbacks, S, W, R, c, h, x, i)
            status, found = end_on(callbacks, S, W, R, c, x * h, slope, i, s, (W.real.beyond * h, most))
            if not found and W.count.cuts < HALVES:  # the dense output told of what the step does not do
                return CUT, 0.5 * h, False
            if status == 0 and not found and s * W.g[END, i] > 0.0:  # nothing happened
                break
        h = c.real.tried
        if status != 0:
            return LOST_SIGHT, h, False
        hit = True
        compare(look, S, W, c.real.t, h, c.real.span)
        W.fired[i] = 1
        if W.count.away == 1:
            break
        at_once(callbacks, S, W, R, c, h, i)
    if not hit and h == c.real.t_end - c.real.t:
        hit = at_the_end(callbacks, S, W, R, c, h)
    if hit and c.count.extended > 0:  # places within were looked at: back to the end
        return watch(c.real.t + h, c.y[NEW], S, W, TRUE), h, True
    return 0, h, hit


@formula
def begins_at_zero(W):
    """Whether a guard is zero as the step begins."""
    n = 0
    for i in range(W.way.shape[0]):
        if W.g[START, i] == 0.0 or W.side[i] == 0.0:
            n += 1
    return n > 0


@formula
def next_event(callbacks, S, W, R, c, h):
    """The first place where a guard leaves its side: (status, guard or -1, place, side)."""
    W.real.done_to = 1.0
    i, a, b, at = begin_sides(callbacks, S, W, R, c, h)
    if i >= 0 and W.count.away == 1:
        return left(callbacks, S, W, R, c, h, i, b, band(W, i))
    if i < 0:
        i, a, b = survey(callbacks, S, W, R, c, h, at)
    skip = SKIPPED
    while i >= 0:
        s = W.g[SIDE, i]
        status, x = crossing(callbacks, S, W, R, c, h, i, a, b, s)
        if status != 0 or x > 0.0:
            return status, i, x, (s if fires(W.way[i], s) else -s)
        before, at = at, max(at + skip, b)
        skip *= 2.0  # of what is rounding there is no end
        if at >= 1.0:
            break
        status, i, x, s = resume(callbacks, S, W, R, c, h, before, at)
        if status != 0 or i >= 0:
            return status, i, x, s
        i, a, b = survey(callbacks, S, W, R, c, h, at)
    if W.count.lost == 1:
        return LOST_SIGHT, -1, 0.0, 0.0
    if W.real.done_to < 1.0:
        return CUT, -1, 0.0, 0.0
    return trespass(callbacks, S, W, R, c, h)


@formula
def trespass(callbacks, S, W, R, c, h):
    """The first guard that is not where it began, or not above zero as it has to be, as `next_event` returns it.

    Or on the other side than that which was taken for it, as the side of a law's corner is.

    Whatever was seen of it within the step.
    """
    best, at, side, away = -1, 2.0, 0.0, 0
    for i in range(W.way.shape[0]):
        f, s = W.g[END, i], side_at_start(W, i)
        if W.fired[i] == 1 or not W.g[START, i] == W.g[START, i]:
            continue
        if W.g[MARK, i] < 0.0 and s * f < -hush(W, i, 1.0) and fires(W.way[i], s):
            W.count.away = 0
            status, x = crossing(callbacks, S, W, R, c, h, i, 0.0, 1.0, s)
        elif (W.kept[i] == 1 and f < -band(W, i)) or f < -W.g[ASTRAY, i]:
            W.real.beyond = 0.0
            least = band(W, i) if W.kept[i] == 1 else W.g[ASTRAY, i]
            status, _, x, s = left(callbacks, S, W, R, c, h, i, 1.0, least)
        else:
            continue
        if status != 0:
            return LOST_SIGHT, -1, 0.0, 0.0
        if 0.0 < x < at:
            best, at, side, away = i, x, s, W.count.away
    W.count.away = away
    return 0, best, at, side


@formula
def left(callbacks, S, W, R, c, h, i, b, least):
    """Where guard i, below zero at b, goes there by more than rounding, as `next_event` returns it."""
    W.count.away = 1
    a = 0.0
    for _ in range(HALVES):
        x = 0.5 * (a + b)
        status, f = true_guard(callbacks, S, W, R, c, h, x, i)
        if status != 0:
            return LOST_SIGHT, i, x, 1.0
        if f < -least:
            b = x
        else:
            a = x
    return 0, i, b, 1.0


@formula
def resume(callbacks, S, W, R, c, h, a, x):
    """Sides at a place in the step, by the equations, nothing having happened up to a; as `next_event` returns it.

    What has left its side in between is an event.
    """
    if exactly(callbacks, S, W, R, c, h, x, THERE) != 0:
        return LOST_SIGHT, -1, 0.0, 0.0
    best, at, side = -1, 2.0, 0.0
    for i in range(W.way.shape[0]):
        f, s = W.g[THERE, i], W.g[SIDE, i]
        if W.fired[i] == 1 or (W.kept[i] == 1 and f <= 0.0 and W.g[MARK, i] >= 0.0):
            continue
        if s * f < -hush(W, i, x) and fires(W.way[i], s):
            status, z = crossing(callbacks, S, W, R, c, h, i, a, x, s)
            if status != 0:
                return LOST_SIGHT, -1, 0.0, 0.0
            if 0.0 < z < at:
                best, at, side = i, z, s
        elif f == f and abs(f) > hush(W, i, x):
            W.g[SIDE, i] = side_of(f)
    return 0, best, at, side


@formula
def expected_slope(callbacks, S, W, R, c, h, x, i):
    """How fast guard i is expected to change as it gets there [1/s]; 0 where that is so soon that it is rounding.

    Beyond it may be another function: one that jumps, or has a corner.
    """
    d = min(LAST, LITTLE * W.real.bracket, 0.25 * x)
    if x < SOON:
        return 0.0
    glance(callbacks, S, W, R, c, h, x - 2.0 * d, THERE)
    f = W.g[THERE, i]
    glance(callbacks, S, W, R, c, h, x - d, THERE)
    return (W.g[THERE, i] - f) / (d * h)


@formula
def slopes(callbacks, S, W, R, c, h):
    """Slopes of guards at the end of the step into W.g[SLOPE]; 0 of what has none that is more than rounding.

    Where it changes by no more than that so close to the end, it is asked farther off.
    """
    back, asked = LAST, True
    for i in range(W.way.shape[0]):
        W.g[SLOPE, i] = 0.0
    while asked and back <= 1.0:
        glance(callbacks, S, W, R, c, h, 1.0 - back, THERE)
        asked = False
        for i in range(W.way.shape[0]):
            if W.g[SLOPE, i] != 0.0:
                continue
            change = W.g[END, i] - (W.g[THERE, i] if back < 1.0 else W.g[START, i])
            if W.kept[i] == 1 or not abs(change) <= 2.0 * hush(W, i, 1.0):
                W.g[SLOPE, i] = change / (back * h)
            elif change != 0.0:
                asked = True
        back *= LONGER


@formula
def at_once(callbacks, S, W, R, c, h, first):
    """Note in W.fired all other guards that leave their sides with the first, at the end of the step."""
    slopes(callbacks, S, W, R, c, h)
    for i in range(W.way.shape[0]):
        if i == first:
            continue
        f, slope = W.g[END, i], W.g[SLOPE, i]
        came = -1.0 if slope > 0.0 else 1.0  # the side that it comes from
        if fires(W.way[i], came) and abs(f) <= W.real.same * abs(slope) and slope != 0.0:
            W.fired[i] = 1


@formula
def at_the_end(callbacks, S, W, R, c, h):
    """Note in W.fired the guards that are zero where the motion ends, to rounding of time; whether there are any.

    What passes zero at the very end belongs to the motion that ends there.
    """
    n = 0
    slopes(callbacks, S, W, R, c, h)
    for i in range(W.way.shape[0]):
        f, s, slope = W.g[END, i], W.g[SIDE, i], W.g[SLOPE, i]
        if W.kept[i] == 1 or not f - f == 0.0:
            continue
        if fires(W.way[i], s) and s * slope < 0.0 and abs(f) <= rounding(W, c, i, slope, 1.0):
            W.fired[i] = 1
            n += 1
    return n > 0
