"""What follows a step that is refused: a shorter one, unless its error is rounding.

Near a singular position of a mechanism rounding grows without bound: shorter steps lead into it, where it is larger.
There the step is taken back and begun anew so that it ends elsewhere, or the place is passed by a wide one.
"""

from __future__ import annotations

from ...compiler.formulas import formula
from .clock import (
    ASIDE,
    ASIDE_RATE,
    FROM,
    FROM_RATE,
    NEW,
    NOW,
    OLD,
    OLD_RATE,
    TO,
    TO_RATE,
)
from .loop import shorten
from .step import LARGE, attempt

SAFETY = 0.85
DIGITS = 1e-14  # part of a state that its last digits are, once rounding has built up
BLUR = 0.1  # an error that changes by more than this part of it with the state's last digits is rounding
ROUGH = 1e-7  # a relative error of a step above which rounding is no excuse
SLOWLY = 0.8  # what the width of wide steps falls by with each that is not
BOLDER = 0.005  # what the width that steps are not wider than of late grows by, times the steps since
SLIGHT = 10.0  # an error from rounding that is accepted before a step is taken back


@formula
def afresh(c):
    """No step was refused since the last accepted one."""
    c.real.last = c.real.best = LARGE
    c.real.pardon = 0.0


@formula
def enter(R, c, t, h, error):
    """Make the state in the making the present one, and choose the width of the next step."""
    for i in range(c.y.shape[1]):
        c.y[OLD, i] = c.y[NOW, i]
        c.y[OLD_RATE, i] = c.K[0, i]
        c.y[NOW, i] = c.y[NEW, i]
        c.K[0, i] = c.K[R.order_i[1], i]
    for i in range(c.seen.shape[1]):
        c.seen[FROM, i] = c.seen[TO, i]
        c.seen[FROM_RATE, i] = c.seen[TO_RATE, i]
    c.real.before = c.real.t
    if error > c.real.excess:
        c.real.excess = error
        c.real.excess_at = c.real.t
    if c.real.grow > 1.0:
        c.real.wide = max(h, SLOWLY * c.real.wide)
    grow = c.real.grow
    c.real.h = h * (min(grow, max(0.2, SAFETY * error ** (-1.0 / R.order_i[0]))) if error > 0.0 else grow)
    if c.real.calm > 0.0:
        c.real.h = min(c.real.h, c.real.calm)
        c.real.calm *= 1.0 + BOLDER * (c.count.accepted + 1 - c.real.calm_since)
    if c.real.step > 0.0:
        c.real.h = c.real.step
    c.real.t = t
    c.real.grow = 6.0
    c.count.accepted += 1
    afresh(c)


@formula
def refuse(derivative, arrive, tangent, S, W, R, c, h, status, error):
    """Choose what to try after a step with that status and error; fixed steps that fail are the end."""
    if c.real.step > 0.0:
        shorten(c, 0.0)
        return
    if status != 0 or not error < LARGE:
        shorten(c, 0.25 * h)
        return
    shorten(c, h * max(0.2, SAFETY * error ** (-1.0 / R.order_i[0])))
    first = c.real.last == LARGE
    c.real.last = error
    if error < c.real.best:
        c.real.best = error
        c.real.best_h = h
    if c.real.pardon > 0.0:
        if h > c.real.best_h:
            c.real.h = c.real.best_h
        return
    wide = c.real.t - c.real.before > 0.5 * c.real.wide
    small = c.real.best * c.real.rtol < ROUGH
    back = wide and small and c.real.best > SLIGHT and c.real.back < c.real.before
    if first or not small or not blurred(derivative, arrive, tangent, S, W, R, c, h, error):
        return
    c.real.blurred_at = c.real.t
    if back:
        take_back(c)
    else:
        c.real.pardon = max(SLIGHT, 2.0 * c.real.best)
        c.real.h = max(c.real.wide, c.real.best_h)


@formula
def take_back(c):
    """Go back to where the last accepted step began, to end it elsewhere."""
    c.count.accepted -= 1
    c.real.h = 0.5 * (c.real.t - c.real.before)
    c.real.t = c.real.back = c.real.before
    for i in range(c.y.shape[1]):
        c.y[NOW, i] = c.y[OLD, i]
        c.K[0, i] = c.y[OLD_RATE, i]
    afresh(c)


@formula
def blurred(derivative, arrive, tangent, S, W, R, c, h, error):
    """Whether the error of a step is mostly rounding: another one from a state that differs in its last digits."""
    y, kept = c.y[NOW], c.y[ASIDE]
    for i in range(y.shape[0]):
        kept[i] = y[i]
        c.y[ASIDE_RATE, i] = c.K[0, i]
        if i < c.count.controlled:
            y[i] += (DIGITS if i % 2 == 0 else -DIGITS) * max(abs(y[i]), 1.0)
    status, _ = arrive(c.real.t, y, c.K[0], S, W)
    other = error
    if status == 0:
        status, other = attempt(derivative, arrive, tangent, S, W, R, c, h)
    for i in range(y.shape[0]):
        y[i] = kept[i]
        c.K[0, i] = c.y[ASIDE_RATE, i]
    return status != 0 or not abs(other - error) < BLUR * max(other, error)
