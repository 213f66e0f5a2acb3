"""Everything an interrupted integration needs to go on, and the names of its entries."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...compiler.layout import Float1, Float2, Int1, Record

# ClockCounts.started, where no segment has begun, but only what pushes has jumped where it begins
JUMPED = 2
# rows of Clock.y: the state, the one in the making, the interpolated one; what a trial puts aside; the step before
NOW, NEW, BETWEEN, ASIDE, ASIDE_RATE, OLD, OLD_RATE, STATES = range(8)
# rows of Clock.seen that the integrator looks at: what is kept of the begin of a step, and of its end
FROM, FROM_RATE, TO, TO_RATE = range(1, 5)
AT_START, AT_END = -2, -1  # what ``inspect`` takes note of, in place of looking at law k
LOOSER = 10.0  # accounts are held to this many times the relative tolerance
RUNNING, DONE, STUCK, NOT_FINITE, UNREPORTED, TOO_MANY = 0, 1, 2, 3, 4, 5
ULP = 2.3e-16  # a unit in the last place, as a part
NOTHING = np.zeros((6, 0))


class ClockReals(Record, kind="Float"):
    """Time, widths of steps, tolerances and errors of an integration."""

    t: float  # [s]
    h: float  # width of the next step
    t_end: float
    rtol: float
    atol: float
    h_max: float
    grow: float  # factor by which the step may grow
    largest: float  # time that widths of steps are compared with
    scale: float  # size of positions
    ledger: float  # size of energies
    span: float  # of the whole motion
    last: float  # of the steps refused since the last accepted one: the last error,
    best: float  # the least error,
    best_h: float  # and its width
    pardon: float  # an error that is good enough
    wide: float  # widest step of late
    before: float  # begin of the step before
    back: float  # begin of the last step that was taken back
    excess: float  # largest error accepted
    excess_at: float  # its time
    blurred_at: float  # when an error was last found to be rounding
    step: float  # fixed width of steps; 0: adaptive
    tried: float  # width of the step in the making
    error: float  # its error in units of the tolerance
    part: float  # part of it that is asked for
    clearer: float  # width at which the state within may be known, where it is not; 0: that is not known
    calm: float  # the widest that is tried as that was so of late; 0: any
    calm_since: float  # at which step it last was, from 1 on


class ClockCounts(Record, kind="Int"):
    """Counters, choices and the status of an integration."""

    accepted: int
    rejected: int
    next: int  # output time
    quota: int  # steps until the loop returns
    status: int
    started: int  # whether a segment has begun; `JUMPED`
    controlled: int  # components of the state whose error is controlled
    limit: int  # most steps
    positions: int  # components that are positions
    trouble: int  # how the last step tried ended
    extended: int  # whether the state within it was asked for: 1 there is one, 2 it is good


class Clock(NamedTuple):
    """Everything an interrupted integration needs to go on."""

    real: ClockReals  # type: ignore[assignment]
    count: ClockCounts  # type: ignore[assignment]
    times: Float1  # output times, ascending
    y: Float2  # (STATES, ny)
    K: Float2  # (stages + 1, ny): derivatives of the stages, and one within the step
    accounts: Int1  # components that are integrals of the motion: works
    seen: Float2 = NOTHING  # what the inspection of laws within a step keeps; no columns: nothing is inspected
