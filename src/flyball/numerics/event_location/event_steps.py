"""Steps that end on events: the first event in a step, and the callbacks of the `time_loop` for it.

Guards are numbers that depend on time and state; an event is where one of them passes zero. Besides the
callbacks of the loop there are ``watch(t, y, S, W, out)``, ``note(S, W, end)`` and ``look(t, h, x, S, W, out)``.
``watch`` and ``look`` write guards to ``out``: from the equations at a given state, and predicted. ``note`` stores
those at the state evaluated last, an end of the step, with the quantities that they depend on. W is a `GuardState`.
The loop also returns when a step ends on events; the caller then changes the state, sets ``c.count.started`` to 0
and calls again.

Where a guard may pass zero (`root_finding.find_crossing_interval`), the crossing is located with the equations,
and the step is repeated. A last check is independent of the search: if a guard that must stay above zero is below
at the end of the step, bisection finds where it becomes negative.
"""

from __future__ import annotations

from ...compiler.formulas import formula
from ..integrators.time_loop import (
    ACCEPT_STEP,
    CHECK_MISSED_CHANGE,
    INSPECT_END,
    ULP,
    output_buffer_full,
    set_rejected_width,
    shorten_for_interpolation,
    shorten_step,
    step_end_time,
    write_output,
)
from .guards import (
    END,
    EVENT_FOUND,
    ROUNDING_FACTOR,
    START,
    UNKNOWN_SIDE,
    compare_predictions,
    crossing_floor,
    evaluate_guards,
    evaluate_guards_exactly,
    exact_guard,
    note_state_drift,
    rounding_floor_with_time,
    side_at_start,
)
from .root_finding import (
    TRIGGERED_ZERO_TOLERANCE,
    allowed_depth,
    end_step_on_event,
    find_crossing_interval,
    find_start_sides,
    locate_crossing,
    retake_step,
    side_of,
    triggers,
)

SIMULTANEOUS_FRACTION = 1e-11  # part of the step within which events count as simultaneous
MIN_SKIP = 2.0**-20  # smallest advance after a place without an event, as a part of the step
SLOPE_STEP_FRACTION = 1e-2  # part of the bracket width over which the slope of a guard is computed
MIN_SLOPE_PLACE = 1e-7  # part of the step before which no slope is computed
END_SLOPE_STEP = 1e-4  # part of the step over which slopes at its end are computed
SLOPE_STEP_GROWTH = 100.0  # factor on that part where a guard changes only by rounding over it
MAX_EARLIER_EVENTS = 20  # repetitions in which another event may turn out to be earlier
MAX_BISECTIONS = 44  # bisections of a step with a missed crossing
MAX_START_CUTS = 6  # times that a step is shortened because a guard that begins at zero is not as predicted
STEP_CUT, EVALUATION_FAILED = 2, 1  # why a step is rejected: not searched completely; equations not evaluable


@formula
def end_on_first_event(callbacks, S, W, R, c):
    """End the step on the first event in it, if there is one: (status, width to try next, whether there is one).

    With status `STEP_CUT` the step is rejected, and the width is the one to try next.
    """
    watch, look = callbacks[5], callbacks[7]
    h = most = c.real.tried
    hit = False
    for i in range(W.fired.shape[0]):
        W.fired[i] = 0
    W.real.same = SIMULTANEOUS_FRACTION * h + 8.0 * ULP * (abs(c.real.t) + h)
    compare_predictions(look, S, W, c.real.t, h, c.real.span)
    if W.count.predictions_agree == 0 and W.count.fresh == 1 and W.count.cuts < MAX_START_CUTS and begins_at_zero(W):
        return STEP_CUT, 0.25 * h, False
    for _ in range(MAX_EARLIER_EVENTS):
        status, i, x, s = find_next_event(callbacks, S, W, R, c, h)
        if status == STEP_CUT and not hit:
            return STEP_CUT, max(W.real.searched_to, MIN_SKIP) * h, False
        if status == EVALUATION_FAILED:
            return EVALUATION_FAILED, h, False
        if status != 0 or i < 0:
            break
        if hit and x * h >= h - W.real.same:
            W.fired[i] = 1
            continue
        for j in range(W.fired.shape[0]):
            W.fired[j] = 0
        if W.count.leaves_required_side == 1:
            status = retake_step(callbacks, S, W, R, c, x * h)
        else:
            slope = predicted_slope(callbacks, S, W, R, c, h, x, i)
            status, found = end_step_on_event(callbacks, S, W, R, c, x * h, slope, i, s, (W.real.beyond * h, most))
            if not found and W.count.cuts < MAX_BISECTIONS:  # the dense output was wrong
                return STEP_CUT, 0.5 * h, False
            if status == 0 and not found and s * W.guards.end[i] > 0.0:  # no event
                break
        h = c.real.tried
        if status != 0:
            return EVALUATION_FAILED, h, False
        hit = True
        compare_predictions(look, S, W, c.real.t, h, c.real.span)
        W.fired[i] = 1
        if W.count.leaves_required_side == 1:
            break
        mark_simultaneous(callbacks, S, W, R, c, h, i)
    if not hit and h == c.real.t_end - c.real.t:
        hit = mark_at_final_time(callbacks, S, W, R, c, h)
    if hit and c.count.extended > 0:  # other places were evaluated: restore the end
        return watch(c.real.t + h, c.y.proposed, S, W, W.guards.exact), h, True
    return 0, h, hit


@formula
def begins_at_zero(W):
    """Whether a guard is zero as the step begins."""
    n = 0
    for i in range(W.way.shape[0]):
        if W.guards.start[i] == 0.0 or W.side[i] == 0.0:
            n += 1
    return n > 0


@formula
def find_next_event(callbacks, S, W, R, c, h):
    """Find the first place where a guard leaves its side: (status, guard or -1, place, side)."""
    W.real.searched_to = 1.0
    i, a, b, at = find_start_sides(callbacks, S, W, R, c, h)
    if i >= 0 and W.count.leaves_required_side == 1:
        return bisect_violation(callbacks, S, W, R, c, h, i, b, allowed_depth(W, i))
    if i < 0:
        i, a, b = find_crossing_interval(callbacks, S, W, R, c, h, at)
    skip = MIN_SKIP
    while i >= 0:
        s = W.guards.search_side[i]
        status, x = locate_crossing(callbacks, S, W, R, c, h, i, a, b, s)
        if status != 0 or x > 0.0:
            return status, i, x, (s if triggers(W.way[i], s) else -s)
        before, at = at, max(at + skip, b)
        skip *= 2.0  # rounding can produce endlessly many
        if at >= 1.0:
            break
        status, i, x, s = update_sides(callbacks, S, W, R, c, h, before, at)
        if status != 0 or i >= 0:
            return status, i, x, s
        i, a, b = find_crossing_interval(callbacks, S, W, R, c, h, at)
    if W.count.lost == 1:
        return EVALUATION_FAILED, -1, 0.0, 0.0
    if W.real.searched_to < 1.0:
        return STEP_CUT, -1, 0.0, 0.0
    return find_missed_crossing(callbacks, S, W, R, c, h)


@formula
def find_missed_crossing(callbacks, S, W, R, c, h):
    """Find the first guard that ends the step on a wrong side, returned as by `find_next_event`.

    These are guards that have left their initial side, that must be above zero and are not, or that are beyond the
    allowed depth of a nonsmooth point of a law. The search within the step has no influence.
    """
    best, at, side, away = -1, 2.0, 0.0, 0
    for i in range(W.way.shape[0]):
        f, s = W.guards.end[i], side_at_start(W, i)
        if W.fired[i] == 1 or not W.guards.start[i] == W.guards.start[i]:
            continue
        if W.guards.zero_band[i] < 0.0 and s * f < -crossing_floor(W, i, 1.0) and triggers(W.way[i], s):
            W.count.leaves_required_side = 0
            status, x = locate_crossing(callbacks, S, W, R, c, h, i, 0.0, 1.0, s)
        elif (W.nonnegative[i] == 1 and f < -allowed_depth(W, i)) or f < -W.guards.corner_depth[i]:
            W.real.beyond = 0.0
            least = allowed_depth(W, i) if W.nonnegative[i] == 1 else W.guards.corner_depth[i]
            status, _, x, s = bisect_violation(callbacks, S, W, R, c, h, i, 1.0, least)
        else:
            continue
        if status != 0:
            return EVALUATION_FAILED, -1, 0.0, 0.0
        if 0.0 < x < at:
            best, at, side, away = i, x, s, W.count.leaves_required_side
    W.count.leaves_required_side = away
    return 0, best, at, side


@formula
def bisect_violation(callbacks, S, W, R, c, h, i, b, least):
    """Find by bisection where guard i, negative at b, passes the rounding depth; returned as by `find_next_event`."""
    W.count.leaves_required_side = 1
    a = 0.0
    for _ in range(MAX_BISECTIONS):
        x = 0.5 * (a + b)
        status, f = exact_guard(callbacks, S, W, R, c, h, x, i)
        if status != 0:
            return EVALUATION_FAILED, i, x, 1.0
        if f < -least:
            b = x
        else:
            a = x
    return 0, i, b, 1.0


@formula
def update_sides(callbacks, S, W, R, c, h, a, x):
    """Set the sides at a place from the equations, without an event up to a; returned as by `find_next_event`.

    A guard that has left its side in between is an event.
    """
    if evaluate_guards_exactly(callbacks, S, W, R, c, h, x, W.guards.predicted) != 0:
        return EVALUATION_FAILED, -1, 0.0, 0.0
    best, at, side = -1, 2.0, 0.0
    for i in range(W.way.shape[0]):
        f, s = W.guards.predicted[i], W.guards.search_side[i]
        if W.fired[i] == 1 or (W.nonnegative[i] == 1 and f <= 0.0 and W.guards.zero_band[i] >= 0.0):
            continue
        if s * f < -crossing_floor(W, i, x) and triggers(W.way[i], s):
            status, z = locate_crossing(callbacks, S, W, R, c, h, i, a, x, s)
            if status != 0:
                return EVALUATION_FAILED, -1, 0.0, 0.0
            if 0.0 < z < at:
                best, at, side = i, z, s
        elif f == f and abs(f) > crossing_floor(W, i, x):
            W.guards.search_side[i] = side_of(f)
    return 0, best, at, side


@formula
def predicted_slope(callbacks, S, W, R, c, h, x, i):
    """Slope [1/s] with which guard i approaches the crossing; 0 if that is too near to the start for rounding.

    Only places before the crossing are used: the guard may jump or have a corner there.
    """
    d = min(END_SLOPE_STEP, SLOPE_STEP_FRACTION * W.real.bracket, 0.25 * x)
    if x < MIN_SLOPE_PLACE:
        return 0.0
    evaluate_guards(callbacks, S, W, R, c, h, x - 2.0 * d, W.guards.predicted)
    f = W.guards.predicted[i]
    evaluate_guards(callbacks, S, W, R, c, h, x - d, W.guards.predicted)
    return (W.guards.predicted[i] - f) / (d * h)


@formula
def end_slopes(callbacks, S, W, R, c, h):
    """Write slopes of guards at the end of the step to W.guards.end_slope; 0 if the change does not exceed rounding.

    If a guard changes only by rounding so close to the end, a larger difference is used.
    """
    back, asked = END_SLOPE_STEP, True
    for i in range(W.way.shape[0]):
        W.guards.end_slope[i] = 0.0
    while asked and back <= 1.0:
        evaluate_guards(callbacks, S, W, R, c, h, 1.0 - back, W.guards.predicted)
        asked = False
        for i in range(W.way.shape[0]):
            if W.guards.end_slope[i] != 0.0:
                continue
            change = W.guards.end[i] - (W.guards.predicted[i] if back < 1.0 else W.guards.start[i])
            if W.nonnegative[i] == 1 or not abs(change) <= 2.0 * crossing_floor(W, i, 1.0):
                W.guards.end_slope[i] = change / (back * h)
            elif change != 0.0:
                asked = True
        back *= SLOPE_STEP_GROWTH


@formula
def mark_simultaneous(callbacks, S, W, R, c, h, first):
    """Mark in W.fired the other guards that leave their sides together with the first, at the end of the step."""
    end_slopes(callbacks, S, W, R, c, h)
    for i in range(W.way.shape[0]):
        if i == first:
            continue
        f, slope = W.guards.end[i], W.guards.end_slope[i]
        came = -1.0 if slope > 0.0 else 1.0  # the side from which it comes
        if triggers(W.way[i], came) and abs(f) <= W.real.same * abs(slope) and slope != 0.0:
            W.fired[i] = 1


@formula
def mark_at_final_time(callbacks, S, W, R, c, h):
    """Mark in W.fired the guards that are zero at the final time, within rounding of time; returns if there are any.

    A sign change at the final time belongs to the motion that ends there.
    """
    n = 0
    end_slopes(callbacks, S, W, R, c, h)
    for i in range(W.way.shape[0]):
        f, s, slope = W.guards.end[i], W.guards.search_side[i], W.guards.end_slope[i]
        if W.nonnegative[i] == 1 or not f - f == 0.0:
            continue
        if triggers(W.way[i], s) and s * slope < 0.0 and abs(f) <= rounding_floor_with_time(W, c, i, slope, 1.0):
            W.fired[i] = 1
            n += 1
    return n > 0


MAX_EVENT_STEP_RATIO = 64.0  # largest step after an event, relative to the time between the last two events
EVENT_TIME_ULPS = 4.0  # units in the last place: an output time this close before an event is replaced by the event


@formula
def start_event_segment(callbacks, S, W, c, back):
    """Evaluate the guards at the start of a segment, or after the step was taken back. Returns a status."""
    watch, note = callbacks[5], callbacks[6]
    W.count.fresh = 1
    note_state_drift(W, c)
    if back:
        for i in range(W.side.shape[0]):
            W.side[i] = UNKNOWN_SIDE
    return evaluate_start_guards(watch, note, S, W, c)


@formula
def finish_step_with_events(callbacks, S, W, R, c, out, used):
    """Complete an accepted step, up to its end or to the first event in it.

    Returns (rows written, whether the loop returns). A rejected step makes the next one shorter.
    """
    ask, own, note = callbacks[0], callbacks[1], callbacks[6]
    most = c.real.tried
    note(S, W, END)
    note_state_drift(W, c)
    if c.inspection.shape[1] > 0 and ask(own, S, W, R, c, CHECK_MISSED_CHANGE) != 0:
        shorten_step(c, 0.5 * most)
        return used, False
    status, h, hit = end_on_first_event(callbacks, S, W, R, c)
    if status == 0:
        if hit:
            ask(own, S, W, R, c, INSPECT_END)
        status, used = write_output(callbacks, S, W, R, c, out, used)
    if status == STEP_CUT:
        W.count.cuts += 1
        set_rejected_width(c, h)
        return used, False
    if status != 0:  # the step cannot be evaluated within: take a shorter one
        shorten_for_interpolation(c, most)
        return used, False
    at_once = step_end_time(c) - EVENT_TIME_ULPS * ULP * abs(step_end_time(c))
    if hit and used > 0 and out[used - 1, 0] >= at_once:  # written once the motion after the event is known
        used -= 1
        c.count.next -= 1
    elif output_buffer_full(c):
        return used, True
    ask(own, S, W, R, c, ACCEPT_STEP)
    W.count.steps += 1
    W.count.cuts = 0
    if hit:
        c.real.h, c.real.wide = max(c.real.h, most), max(c.real.wide, most)
        if c.real.t > W.real.latest:  # limited so that the next event, if as soon, is resolved
            c.real.h = min(c.real.h, MAX_EVENT_STEP_RATIO * (c.real.t - W.real.latest))
            W.real.latest = c.real.t
        c.count.status = EVENT_FOUND
        W.count.events += 1
        set_sides_after_event(W, c, c.real.tried)
    else:
        shift_guards_to_start(W)
    return used, hit


@formula
def evaluate_start_guards(watch, note, S, W, c):
    """Evaluate the guards, and what they depend on, at the start of the next step. Returns a status."""
    status = watch(c.real.t, c.y.current, S, W, W.guards.start)
    if status == 0:
        note(S, W, START)
    for i in range(W.side.shape[0]):  # a guard that jumped since has no known side
        f = W.side[i] * W.guards.start[i] + 2.0 * crossing_floor(W, i, 0.0)
        if abs(W.side[i]) == 1.0 and not f >= 0.5 * abs(W.guards.end[i]):
            W.side[i] = UNKNOWN_SIDE
    return status


@formula
def set_sides_after_event(W, c, h):
    """Set the sides after a step that ends on an event: 0 for triggered guards; others if they exceed rounding.

    So a guard that triggers soon after is not mistaken for one that has just triggered. Their zero bands are stored.
    """
    for i in range(W.side.shape[0]):
        f, s, slope = W.guards.end[i], side_at_start(W, i), (W.guards.highest[i] - W.guards.lowest[i]) / h
        nothing = rounding_floor_with_time(W, c, i, slope, 1.0)
        W.side[i] = UNKNOWN_SIDE
        if W.fired[i] == 1:
            W.side[i], W.guards.trigger[i] = 0.0, abs(f)
            if abs(f) <= TRIGGERED_ZERO_TOLERANCE * max(
                abs(W.guards.lowest[i]), abs(W.guards.highest[i])
            ):  # it did not jump
                nothing = max(nothing, ROUNDING_FACTOR * abs(f))
        elif W.nonnegative[i] == 0 and f - f == 0.0 and abs(f) > nothing:
            W.side[i] = side_of(f)
        elif W.nonnegative[i] == 0 and abs(f) < crossing_floor(W, i, 1.0):  # it may be about to cross, but has not yet
            W.side[i] = s if s != 0.0 else UNKNOWN_SIDE
        W.guards.zero_band[i] = nothing


@formula
def shift_guards_to_start(W):
    """Make the guards at the end of the step those at the start of the next."""
    W.count.fresh = 0
    for i in range(W.way.shape[0]):
        W.side[i] = (
            0.0
            if W.nonnegative[i] == 1 and abs(W.guards.end[i]) <= ROUNDING_FACTOR * W.grain[i]
            else W.guards.search_side[i]
        )
        W.guards.start[i], W.guards.start_rounding[i] = W.guards.end[i], W.guards.end_rounding[i]
    for i in range(W.way.shape[0], W.way.shape[0] + W.count.terms):
        W.guards.start[i] = W.guards.end[i]
    for k in range(W.moving.shape[1]):
        for m in range(W.moving.shape[2]):
            W.moving[0, k, m] = W.moving[1, k, m]
    last = W.levels.shape[0] - 1
    for m in range(W.levels.shape[1]):
        W.levels[0, m] = W.levels[last, m]
