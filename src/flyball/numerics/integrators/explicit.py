"""Every explicit Runge-Kutta pair as a method of the `loop`: adaptive, with dense output and projection.

Knows nothing of mechanisms: it is given ``derivative(t, y, dy, S, W)``, ``arrive(t, y, dy, S, W)``, which also
projects y, ``tangent(y, e, S, W)``, which projects an error, and ``inspect(t, h, span, k, seen, S, W)``, which says
where in a step laws do what its stages have not seen.
"""

from __future__ import annotations

from ...compiler.formulas import formula
from .clock import (
    AT_END,
    AT_START,
    BETWEEN,
    NOT_FINITE,
    NOW,
    STUCK,
)
from .loop import BEGIN, ENDED, ENTER, OVERLOOKED, REFUSE, TRY, WITHIN, ending
from .refusal import SAFETY, afresh, enter, refuse
from .step import astray, attempt, defect, extend, first_step, interpolate, stretch

FAR = 4.0  # times the error of a step, if that is more than the tolerance, that the dense output may be off by
FARTHER = 8.0  # the same where accuracy limits steps, and of the tolerance: so it is there, now and then
EDGE = 3.5  # h |lambda| of steps that stability may limit
SOON = 20  # steps from one that is so refused to the next, by which the width of those to come is bounded
EXTENDED_TO, CLEAR = 1, 2  # what c.count.extended says: the stages of dense output are there; it is good


@formula
def begin(derivative, inspect, S, W, R, c):
    """First derivative and first step width. Returns a status."""
    if derivative(c.real.t, c.y[NOW], c.K[0], S, W) != 0:
        return STUCK
    inspect(c.real.t, 0.0, c.real.span, AT_START, c.seen, S, W)
    for i in range(c.y.shape[1]):
        if not c.K[0, i] - c.K[0, i] == 0.0:
            return NOT_FINITE
    if c.real.h <= 0.0:
        c.real.h = first_step(derivative, S, W, R, c)
    c.real.grow = 6.0
    c.real.excess = 1.0
    c.real.before = c.real.back = c.real.t
    c.real.blurred_at = c.real.t - c.real.span
    afresh(c)
    return 0


@formula
def within(derivative, S, W, R, c):
    """Dense output at a part of the step. Returns a status."""
    if c.count.extended == 0 and extend(derivative, S, W, R, c, c.real.tried) != 0:
        return 1
    if c.count.extended != CLEAR:
        c.count.extended = EXTENDED_TO
        if not clear(R, c):
            return 1
        c.count.extended = CLEAR
    interpolate(R, c, c.real.part, c.real.tried, c.y[BETWEEN])
    return 0


@formula
def clear(R, c):
    """Whether the dense output is as good as steps are. If not, c.real.clearer is a width at which it may be.

    Where stability limits steps, not accuracy, their ends are good and the dense output may be far off. A step that is
    read within has to be narrower there, and where that comes again so have the next ones (c.real.calm). Elsewhere
    it is off by a few tolerances, and steps are as they would be. Steps of fixed width are not judged.
    """
    if c.real.step > 0.0:
        return True
    h = c.real.tried
    gap = astray(R, c, h)
    if gap <= 1.0:
        return True
    limited = stretch(R, c, h) > EDGE
    most = max(1.0, FAR * c.real.error) if limited else FARTHER * max(1.0, c.real.error)
    if gap <= most:
        return True
    c.real.clearer = h * max(0.2, SAFETY * (gap / most) ** (-1.0 / R.order_i[0]))
    if limited:
        now = c.count.accepted + 1
        if c.real.calm_since > 0.0 and 0.0 < now - c.real.calm_since <= SOON:
            c.real.calm = SAFETY * h
        c.real.calm_since = now
    return False


@formula
def overlooked(derivative, inspect, S, W, R, c):
    """Whether laws do something within the step that its stages have not seen, and that matters.

    ``inspect`` names places where a law is not as its values elsewhere in the step let expect; what this comes to is
    what the dense output misses of the equations there, over the part of the step for which it lasts. What lasts for
    more than a step is another branch of a formula: no width is right. Steps of fixed width look for that only.
    """
    h = c.real.tried
    inspect(c.real.t, h, c.real.span, AT_END, c.seen, S, W)
    k, x, share = inspect(c.real.t, h, c.real.span, 0, c.seen, S, W)
    if k > 0 and c.count.extended == 0:
        if extend(derivative, S, W, R, c, h) != 0:
            return 1
        c.count.extended = EXTENDED_TO
    while k > 0:
        if share > 1.0:
            return 1
        if c.real.step == 0.0 and not defect(derivative, S, W, R, c, h, x) * share <= 1.0:
            return 1
        k, x, share = inspect(c.real.t, h, c.real.span, k, c.seen, S, W)
    return 0


@formula
def answer(own, S, W, R, c, task):
    """What the `loop` asks of a method; ``own`` are derivative, arrive, tangent, inspect."""
    derivative, arrive, tangent, inspect = own
    if task == TRY:
        c.count.extended = 0
        status, c.real.error = attempt(derivative, arrive, tangent, S, W, R, c, c.real.tried)
        return status
    if task == WITHIN:
        return within(derivative, S, W, R, c)
    if task == ENTER:
        enter(R, c, ending(c), c.real.tried, c.real.error)
        return 0
    if task == REFUSE:
        refuse(derivative, arrive, tangent, S, W, R, c, c.real.tried, c.count.trouble, c.real.error)
        return 0
    if task == OVERLOOKED:
        return overlooked(derivative, inspect, S, W, R, c)
    if task == ENDED:
        inspect(c.real.t, c.real.tried, c.real.span, AT_END, c.seen, S, W)
        return 0
    if task == BEGIN:
        return begin(derivative, inspect, S, W, R, c)
    return 0
