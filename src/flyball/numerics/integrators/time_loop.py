"""The time loop of all integrators, and the step state, from which an interrupted integration can continue.

A step method is a function ``ask(own, S, W, R, c, task)`` that performs the tasks listed here; only the method uses
its data ``own``. ``c`` is the `StepState`, which holds the width of a step (``tried``), its error (``error``) and
the requested part of it (``part``). ``report(t, y, out, S, W)`` writes a row of output. Two more callbacks complete
the start of a segment and the end of a step: `no_segment_start` and `finish_step`, or those of
`event_location.event_steps`, whose steps end on events.

The loop returns when its output buffer is full, its quota of steps is used, the end is reached, or it cannot
continue; the caller calls again with the same state. Progress display, interruption and restart rely on this.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...compiler.formulas import formula
from ...compiler.struct_layout import Float1, Float2, Int1, Record

# StepCounts.started if no segment has begun, but only forces have jumped at its start
FORCES_JUMPED = 2
# rows of StepState.inspection that the integrator uses: data of inspected laws at the start and the end of a step
INSPECTED_START, INSPECTED_START_RATE, INSPECTED_END, INSPECTED_END_RATE = range(1, 5)
AT_START, AT_END = -2, -1  # tasks of ``inspect``: store data of the start or end, instead of checking law k
INTEGRAL_TOLERANCE_FACTOR = 10.0  # the tolerance of integrals is this many times the relative tolerance
RUNNING, DONE, STEP_FAILED, NOT_FINITE, OUTPUT_FAILED, TOO_MANY_STEPS = 0, 1, 2, 3, 4, 5
DISTANT_SIZE_WEIGHT = 1e-3  # weight in the tolerance of the part of a coordinate beyond its unit
ULP = 2.3e-16  # relative unit in the last place
NO_INSPECTION = np.zeros((6, 0))


class StepReals(Record, kind="Float"):
    """Time, widths of steps, tolerances and errors of an integration."""

    t: float  # [s]
    h: float  # width of the next step
    t_end: float
    rtol: float
    atol: float  # relative to the units of the state, ``StepState.y.unit``
    h_max: float
    max_growth: float  # largest factor by which the step may grow
    largest: float  # time relative to which widths of steps are judged
    energy_size: float  # scale of energies
    span: float  # duration of the whole motion
    last: float  # of the steps rejected since the last accepted one: the last error,
    best: float  # the smallest error,
    best_h: float  # and its width
    accepted_error: float  # error above the tolerance that is accepted as rounding
    wide: float  # widest recent step
    before: float  # start time of the previous step
    back: float  # start time of the last step that was undone
    largest_error: float  # largest error accepted
    largest_error_at: float  # its time
    rounding_found_at: float  # when an error was last found to be rounding
    step: float  # fixed width of steps; 0: adaptive
    tried: float  # width of the current trial step
    error: float  # its error in units of the tolerance
    part: float  # requested part of it
    interpolation_width: float  # width at which interpolation may succeed, if it fails; 0: not known
    interpolation_limit: float  # largest width allowed because interpolation failed recently; 0: any
    interpolation_limit_since: float  # number of the step at which it last failed, from 1


class StepCounts(Record, kind="Int"):
    """Counters, choices and the status of an integration."""

    accepted: int
    rejected: int
    next: int  # index of the next output time
    quota: int  # steps until the loop returns
    status: int
    started: int  # whether a segment has begun, or `FORCES_JUMPED`
    controlled: int  # components of the state whose error is controlled
    limit: int  # maximum number of steps
    positions: int  # components that are positions
    step_status: int  # status of the last trial step
    extended: int  # dense output of the current step: 0 not used, 1 available, 2 accurate


class StateVectors(Record, kind="Float", vectors=True):
    """States of an integration [(ny,)]."""

    current: Float1
    proposed: Float1
    interpolated: Float1
    saved: Float1  # by trials
    saved_rate: Float1
    previous: Float1  # of the previous step
    previous_rate: Float1
    unit: Float1  # unit of each component


class StepState(NamedTuple):
    """State of an integration, complete for interruption and restart."""

    real: StepReals  # type: ignore[assignment]
    count: StepCounts  # type: ignore[assignment]
    times: Float1  # output times, ascending
    y: StateVectors
    K: Float2  # (stages + 1, ny): derivatives of the stages, and one within the step
    integrals: Int1  # components that are integrals over the motion, such as work
    inspection: Float2 = NO_INSPECTION  # data of inspected laws within a step; no columns: no inspection


# tasks of a method: start at the current state (returns a status of the loop); try a step of width c.real.tried to
# c.y.proposed (0 if it succeeds) and set c.real.error; interpolate at c.real.part to c.y.interpolated (0 if it
# succeeds); choose the next try after a rejected step (0, or 1 if there is none); check whether laws change within the
# step without being seen at its stages; store inspection data of its end; make its end the current state and choose the
# next width
BEGIN_SEGMENT, TRY_STEP, INTERPOLATE, REJECT_STEP, CHECK_MISSED_CHANGE, INSPECT_END, ACCEPT_STEP = range(7)


@formula
def no_segment_start(callbacks, S, W, c, back):
    """Do nothing at the start of a segment. Returns a status."""
    return 0


@formula
def start_integration(callbacks, S, W, R, c, out):
    """Initialise the method, and write the output at the start. Returns (status, rows written)."""
    ask, own, report, begun, _ = callbacks[:5]
    used = 0
    status = ask(own, S, W, R, c, BEGIN_SEGMENT)
    if status != 0:
        return status, used
    while c.count.next < c.times.shape[0] and c.times[c.count.next] <= c.real.t:
        for i in range(c.y.shape[1]):
            c.y.interpolated[i] = c.y.current[i]
        if report(c.times[c.count.next], c.y.interpolated, out[used], S, W) != 0:
            return OUTPUT_FAILED, used
        used += 1
        c.count.next += 1
    c.count.started = 1
    return (STEP_FAILED if begun(callbacks, S, W, c, False) != 0 else 0), used


@formula
def step_end_time(c):
    """Time at which the current step ends: exactly t_end for the last step, although t + h may round below it."""
    h = c.real.tried
    return c.real.t_end if h == c.real.t_end - c.real.t else c.real.t + h


@formula
def write_output(callbacks, S, W, R, c, out, used):
    """Write all output times within the step for which the buffer has rows. Returns (status, used)."""
    ask, own, report = callbacks[:3]
    t, h, end = c.real.t, c.real.tried, step_end_time(c)
    while c.count.next < c.times.shape[0] and used < out.shape[0]:
        s = c.times[c.count.next]
        if s > end:
            break
        if s == end:
            for i in range(c.y.shape[1]):
                c.y.interpolated[i] = c.y.proposed[i]
        else:
            c.real.part = (s - t) / h
            if ask(own, S, W, R, c, INTERPOLATE) != 0:
                return OUTPUT_FAILED, used
        if report(s, c.y.interpolated, out[used], S, W) != 0:
            return OUTPUT_FAILED, used
        used += 1
        c.count.next += 1
    return 0, used


@formula
def next_step_width(c):
    """Width of the next step, chosen to avoid a very short last step; 0 if it would be too short.

    Fixed steps never get wider; they are shortened only before events and at the final time.
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
    """Set the width to try after a rejected step."""
    c.count.rejected += 1
    c.real.max_growth = 1.0
    c.real.h = h


@formula
def shorten_step(c, h):
    """Set the width to try after a step whose interior cannot be evaluated; fixed steps have none to try."""
    set_rejected_width(c, h if c.real.step == 0.0 else 0.0)


@formula
def shorten_for_interpolation(c, h):
    """Set a width at which interpolation may succeed, after it failed in a step of width h."""
    shorten_step(c, c.real.interpolation_width if c.real.interpolation_width > 0.0 else 0.25 * h)


@formula
def output_buffer_full(c):
    """Whether the buffer became full within the step; the next call repeats the step."""
    return c.count.next < c.times.shape[0] and c.times[c.count.next] <= step_end_time(c)


@formula
def finish_step(callbacks, S, W, R, c, out, used):
    """Complete an accepted step. Returns (rows written, whether the loop returns)."""
    ask, own = callbacks[:2]
    h = c.real.tried
    if c.inspection.shape[1] > 0 and ask(own, S, W, R, c, CHECK_MISSED_CHANGE) != 0:
        shorten_step(c, 0.5 * h)
        return used, False
    status, used = write_output(callbacks, S, W, R, c, out, used)
    if status != 0:  # the step cannot be interpolated: take a shorter one
        shorten_for_interpolation(c, h)
        return used, False
    if output_buffer_full(c):
        return used, True
    ask(own, S, W, R, c, ACCEPT_STEP)
    return used, False


@formula
def advance(callbacks, S, W, R, c, out):
    """Integrate until the end, a failure, a full buffer ``out`` or the end of the quota. Returns the rows written.

    Callbacks: ask, own, report, begun, onward (``begun`` at the start of a segment, ``onward`` at the end of a step),
    and those that these two use.
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
            if c.real.t < t:  # the previous step has been undone
                begun(callbacks, S, W, c, True)
            continue
        used, over = onward(callbacks, S, W, R, c, out, used)
        if over:
            return used
    c.count.status = DONE
    return used
