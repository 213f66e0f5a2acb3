"""Everything an interrupted integration needs to go on, and the names of its entries."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...compiler.layout import Float1, Float2, Int1

# entries of Clock.real
T, H, T_END, RTOL, ATOL, H_MAX, GROW, LARGEST, SCALE, LEDGER, SPAN = range(11)
# (of the steps refused since the last accepted one: the last error, the least, its width; an error that is good enough)
LAST, BEST, BEST_H, PARDON = range(11, 15)
# (widest step of late; begin of the step before, and of the last that was taken back; largest error accepted, its time;
# when an error was last found to be rounding)
WIDE, BEFORE, BACK, EXCESS, EXCESS_AT, BLURRED_AT = range(15, 21)
# (fixed width of steps, 0: adaptive; of the step in the making its width, its error in units of the tolerance, and a
# part of it that is asked for; a width at which the state within may be told, where it cannot: 0 if that is not known;
# the widest that is tried as that was so of late: 0 if any; at which step it last was, from 1 on)
STEP, TRIED, ERROR, PART, CLEARER, CALM, CALM_SINCE, REALS = range(21, 29)
# entries of Clock.count
ACCEPTED, REJECTED, NEXT, QUOTA, STATUS, STARTED, CONTROLLED, LIMIT, POSITIONS = range(9)
# (how the last step tried ended; whether the state within it was asked for: 1 there is one, 2 it is good)
TROUBLE, EXTENDED, COUNTS = range(9, 12)
# (STARTED: whether a stretch has begun; it does not yet, but only what pushes has jumped where it begins)
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


class Clock(NamedTuple):
    """Everything an interrupted integration needs to go on."""

    real: Float1  # (REALS,)
    count: Int1  # type: ignore[assignment]  # (COUNTS,)
    times: Float1  # output times, ascending
    y: Float2  # (STATES, ny)
    K: Float2  # (stages + 1, ny): derivatives of the stages, and one within the step
    accounts: Int1  # components that are integrals of the motion: works
    seen: Float2 = NOTHING  # what the inspection of laws within a step keeps; no columns: nothing is inspected
