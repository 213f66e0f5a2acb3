"""The time loop of all integrators, and the step state: all that an interrupted integration needs to continue.

A step method is ``ask(own, S, W, R, c, task)``, with the tasks named here; its data ``own`` are its own
business. ``c`` is the `StepState`, which holds the width of a step (``tried``), its error (``error``) and the
requested part of it (``part``). ``report(t, y, out, S, W)`` writes a row of output. What else is done at the
start of a segment and at the end of a step is given by two more callbacks: `no_segment_start` and
`finish_step`, or those of `event_location.event_steps`, whose steps end on events.

The loop returns when its output buffer is full, its share of steps is done, the end is reached, or it cannot
continue; the caller calls again with the same state. Progress display, interruption and restart rest on this.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...compiler.formulas import formula
from ...compiler.struct_layout import Float1, Float2, Int1, Record

# ClockCounts.started, where no segment has begun, but only what pushes has jumped where it begins
FORCES_JUMPED = 2
# rows of Clock.y: the state, the one in the making, the interpolated one; what a trial puts aside; the step before
CURRENT, PROPOSED, INTERPOLATED, SAVED, SAVED_RATE, PREVIOUS, PREVIOUS_RATE, STATE_ROWS = range(8)
# rows of Clock.seen that the integrator looks at: what is kept of the begin of a step, and of its end
INSPECTED_START, INSPECTED_START_RATE, INSPECTED_END, INSPECTED_END_RATE = range(1, 5)
AT_START, AT_END = -2, -1  # what ``inspect`` takes note of, in place of looking at law k
INTEGRAL_TOLERANCE_FACTOR = 10.0  # accounts are held to this many times the relative tolerance
RUNNING, DONE, STEP_FAILED, NOT_FINITE, OUTPUT_FAILED, TOO_MANY_STEPS = 0, 1, 2, 3, 4, 5
ULP = 2.3e-16  # a unit in the last place, as a part
NO_INSPECTION = np.zeros((6, 0))


class StepReals(Record, kind="Float"):
    """Time, widths of steps, tolerances and errors of an integration."""

    t: float  # [s]
    h: float  # width of the next step
    t_end: float
    rtol: float
    atol: float
    h_max: float
    max_growth: float  # factor by which the step may grow
    largest: float  # time that widths of steps are compared with
    scale: float  # size of positions
    energy_size: float  # size of energies
    span: float  # of the whole motion
    last: float  # of the steps refused since the last accepted one: the last error,
    best: float  # the least error,
    best_h: float  # and its width
    accepted_error: float  # an error that is good enough
    wide: float  # widest step of late
    before: float  # begin of the step before
    back: float  # begin of the last step that was taken back
    largest_error: float  # largest error accepted
    largest_error_at: float  # its time
    rounding_found_at: float  # when an error was last found to be rounding
    step: float  # fixed width of steps; 0: adaptive
    tried: float  # width of the step in the making
    error: float  # its error in units of the tolerance
    part: float  # part of it that is asked for
    interpolation_width: float  # width at which the state within may be known, where it is not; 0: that is not known
    interpolation_limit: float  # the widest that is tried as that was so of late; 0: any
    interpolation_limit_since: float  # at which step it last was, from 1 on


class StepCounts(Record, kind="Int"):
    """Counters, choices and the status of an integration."""

    accepted: int
    rejected: int
    next: int  # output time
    quota: int  # steps until the loop returns
    status: int
    started: int  # whether a segment has begun; `FORCES_JUMPED`
    controlled: int  # components of the state whose error is controlled
    limit: int  # most steps
    positions: int  # components that are positions
    step_status: int  # how the last step tried ended
    extended: int  # whether the state within it was asked for: 1 there is one, 2 it is good


class StepState(NamedTuple):
    """Everything an interrupted integration needs to go on."""

    real: StepReals  # type: ignore[assignment]
    count: StepCounts  # type: ignore[assignment]
    times: Float1  # output times, ascending
    y: Float2  # (STATES, ny)
    K: Float2  # (stages + 1, ny): derivatives of the stages, and one within the step
    integrals: Int1  # components that are integrals of the motion: works
    seen: Float2 = NO_INSPECTION  # what the inspection of laws within a step keeps; no columns: nothing is inspected


# what a method is asked: to begin at the state (a status of the clock); a step of the width TRIED to c.y[NEW] (0 or
# not), after which ERROR is known; the state at a part of it to c.y[BETWEEN] (0 or not); what to try after a step that
# is not good (0, or that there is nothing); whether laws do something in it that was not seen; to take note of its end;
# to make its end the present state, and the width of the next
BEGIN_SEGMENT, TRY_STEP, INTERPOLATE, REJECT_STEP, CHECK_MISSED_CHANGE, INSPECT_END, ACCEPT_STEP = range(7)


@formula
def no_segment_start(callbacks, S, W, c, back):
    """Nothing is done as a stretch begins. Returns a status."""
    return 0


@formula
def start_integration(callbacks, S, W, R, c, out):
    """Have the method begin, and write the output at the very start. Returns (status, rows written)."""
    ask, own, report, begun, _ = callbacks[:5]
    used = 0
    status = ask(own, S, W, R, c, BEGIN_SEGMENT)
    if status != 0:
        return status, used
    while c.count.next < c.times.shape[0] and c.times[c.count.next] <= c.real.t:
        for i in range(c.y.shape[1]):
            c.y[INTERPOLATED, i] = c.y[CURRENT, i]
        if report(c.times[c.count.next], c.y[INTERPOLATED], out[used], S, W) != 0:
            return OUTPUT_FAILED, used
        used += 1
        c.count.next += 1
    c.count.started = 1
    return (STEP_FAILED if begun(callbacks, S, W, c, False) != 0 else 0), used


@formula
def step_end_time(c):
    """Time at which the step in the making ends: T_END itself where it reaches that, as T + h may be less."""
    h = c.real.tried
    return c.real.t_end if h == c.real.t_end - c.real.t else c.real.t + h


@formula
def write_output(callbacks, S, W, R, c, out, used):
    """Report every output time within the step, as far as the buffer reaches. Returns (status, used)."""
    ask, own, report = callbacks[:3]
    t, h, end = c.real.t, c.real.tried, step_end_time(c)
    while c.count.next < c.times.shape[0] and used < out.shape[0]:
        s = c.times[c.count.next]
        if s > end:
            break
        if s == end:
            for i in range(c.y.shape[1]):
                c.y[INTERPOLATED, i] = c.y[PROPOSED, i]
        else:
            c.real.part = (s - t) / h
            if ask(own, S, W, R, c, INTERPOLATE) != 0:
                return OUTPUT_FAILED, used
        if report(s, c.y[INTERPOLATED], out[used], S, W) != 0:
            return OUTPUT_FAILED, used
        used += 1
        c.count.next += 1
    return 0, used


@formula
def next_step_width(c):
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
def set_rejected_width(c, h):
    """Try a step of that width next, as the last was refused."""
    c.count.rejected += 1
    c.real.max_growth = 1.0
    c.real.h = h


@formula
def shorten_step(c, h):
    """The same after a step within which something cannot be: for steps of fixed width there is nothing to try."""
    set_rejected_width(c, h if c.real.step == 0.0 else 0.0)


@formula
def shorten_for_interpolation(c, h):
    """Try a step next within which the state may be told, after one of width h in which it cannot be."""
    shorten_step(c, c.real.interpolation_width if c.real.interpolation_width > 0.0 else 0.25 * h)


@formula
def output_buffer_full(c):
    """Whether the buffer was full inside the step: it is taken again by the next call."""
    return c.count.next < c.times.shape[0] and c.times[c.count.next] <= step_end_time(c)


@formula
def finish_step(callbacks, S, W, R, c, out, used):
    """Go on to the end of a step that is good. Returns (rows written, whether the loop returns)."""
    ask, own = callbacks[:2]
    h = c.real.tried
    if c.seen.shape[1] > 0 and ask(own, S, W, R, c, CHECK_MISSED_CHANGE) != 0:
        shorten_step(c, 0.5 * h)
        return used, False
    status, used = write_output(callbacks, S, W, R, c, out, used)
    if status != 0:  # what lies inside the step cannot be reported: take a shorter one
        shorten_for_interpolation(c, h)
        return used, False
    if output_buffer_full(c):
        return used, True
    ask(own, S, W, R, c, ACCEPT_STEP)
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
        c.count.status, used = start_integration(callbacks, S, W, R, c, out)
        if c.count.status != RUNNING:
            return used
    steps = 0
    while c.real.t < c.real.t_end:
        if used == out.shape[0] or steps >= c.count.quota:
            return used
        if c.count.accepted + c.count.rejected >= c.count.limit:
            c.count.status = TOO_MANY_STEPS
            return used
        c.real.tried = next_step_width(c)
        if c.real.tried == 0.0:
            c.count.status = STEP_FAILED
            return used
        steps += 1
        t = c.real.t
        c.real.interpolation_width = 0.0
        c.count.step_status = ask(own, S, W, R, c, TRY_STEP)
        if c.count.step_status != 0 or not c.real.error <= max(1.0, c.real.accepted_error):
            if ask(own, S, W, R, c, REJECT_STEP) != 0:
                c.count.status = STEP_FAILED
                return used
            if c.real.t < t:  # the step before is taken back
                begun(callbacks, S, W, c, True)
            continue
        used, over = onward(callbacks, S, W, R, c, out, used)
        if over:
            return used
    c.count.status = DONE
    return used
