"""An implicit method of equations of motion as the `loop` of all integrators asks for it.

A method is ``attempt(callbacks, S, K, c, h)`` (the step to c.y[NEW] and c.K[1]: status, error, what it asks for),
``between(K, x, h, d, v, z)`` (increments, velocities, integrals within it), ``enter(K, c, t, h, error, asked)`` and
``refuse(K, c)`` (what to try next). It knows nothing of mechanisms: it is given ``residual`` (see `step`);
``linearise(t, k, S, K, c)``, which fills row k of the numbers of the Jacobian at stage k, or where the step begins;
``compose(y, d, v, z, out, S)``, which makes a state of increments; ``arrive`` (which leaves the multipliers in
``K.found``) and ``inspect``.
"""

from __future__ import annotations

from ....compiler.formulas import formula
from ..clock import (
    ASIDE,
    AT_END,
    AT_START,
    BETWEEN,
    JUMPED,
    NEW,
    NOT_FINITE,
    NOW,
    STUCK,
)
from ..loop import BEGIN, ENDED, ENTER, OVERLOOKED, REFUSE, TRY, WITHIN, ending
from ..refusal import afresh
from .desk import START
from .step import defect

SURE = 1e-3  # a rate of the iteration below which the Jacobian serves on
WIDEST = 8.0  # what the width changes by at most
FIRST = 1e-4  # part of the time span that is tried first
MOVED = 1e-5  # part of size and speed by which a state that is off its constraints has not moved by itself


@formula
def begin(arrive, inspect, S, K, c):
    """The state as a stretch of time begins, put on its constraints, and its derivative. Returns a status.

    Where nothing but what pushes has jumped (JUMPED), Jacobian and factors serve on, as from step to step.
    """
    y = c.y[NEW]
    for i in range(y.shape[0]):
        y[i] = c.y[NOW, i]
    status, moved = arrive(c.real.t, y, c.K[0], S, K)
    if status != 0 or moved > MOVED:
        return STUCK
    for i in range(y.shape[0]):
        c.y[NOW, i] = y[i]
        if not c.K[0, i] - c.K[0, i] == 0.0:
            return NOT_FINITE
    inspect(c.real.t, 0.0, c.real.span, AT_START, c.seen, S, K)
    for i in range(K.found.shape[0]):
        K.lam[START, i] = K.found[i]
    K.count.before = 0
    K.real.last_error = 0.0
    c.real.grow = WIDEST
    if c.count.started != JUMPED:
        K.count.fresh = 0
        K.real.width = 0.0
        K.real.rate, K.real.theta = 1.0, SURE
        c.real.excess = 1.0
        c.real.wide = 0.0  # steps of before tell nothing of what is narrow now
    c.real.before = c.real.t
    c.real.blurred_at = c.real.back = c.real.t - c.real.span
    if c.real.h <= 0.0:
        c.real.h = FIRST * c.real.span
    afresh(c)
    return 0


@formula
def overlooked(residual, inspect, S, K, c):
    """Whether laws do something within the step that its stages have not seen, and that matters; see `explicit`."""
    h = c.real.tried
    inspect(c.real.t, h, c.real.span, AT_END, c.seen, S, K)
    k, x, share = inspect(c.real.t, h, c.real.span, 0, c.seen, S, K)
    while k > 0:
        if share > 1.0:
            return 1
        if c.real.step == 0.0 and not defect(residual, S, K, c, h, x) * share <= 1.0:
            return 1
        k, x, share = inspect(c.real.t, h, c.real.span, k, c.seen, S, K)
    return 0


@formula
def rates_at_begin(K, c):
    """Rates of integrals where the step begins: what else is looked at may have overwritten them."""
    at = c.y.shape[1] - K.z.shape[1]
    for i in range(K.z.shape[1]):
        K.rate[START, i] = c.K[0, at + i]


@formula
def within(between, compose, S, K, c):
    """The state at a part of the step."""
    z = c.y[ASIDE, : K.z.shape[1]]
    rates_at_begin(K, c)
    between(K, c.real.part, c.real.tried, K.d[START], K.a[START], z)
    compose(c.y[NOW], K.d[START], K.a[START], z, c.y[BETWEEN], S)
    c.count.extended = 1
    return 0


@formula
def answer(method, callbacks, S, K, c, task):
    """What the `loop` asks of a method."""
    attempt, between, enter, refuse = method
    residual, compose, arrive, inspect = callbacks[0], callbacks[2], callbacks[3], callbacks[4]
    if task == TRY:
        c.count.extended = 0
        status, c.real.error, K.real.asked = attempt(callbacks, S, K, c, c.real.tried)
        return status
    if task == WITHIN:
        return within(between, compose, S, K, c)
    if task == ENTER:
        c.real.before = c.real.t
        enter(K, c, ending(c), c.real.tried, c.real.error, K.real.asked)
        return 0
    if task == REFUSE:
        return refuse(K, c)
    if task == OVERLOOKED:
        return overlooked(residual, inspect, S, K, c)
    if task == ENDED:
        inspect(c.real.t, c.real.tried, c.real.span, AT_END, c.seen, S, K)
        return 0
    if task == BEGIN:
        return begin(arrive, inspect, S, K, c)
    return 0
