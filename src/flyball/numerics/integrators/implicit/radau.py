"""Steps of Radau IIA of order 5 for equations of motion with constraints, stabilised index 2: a method of `asked`.

Step control after Hairer and Wanner, *Solving Ordinary Differential Equations II* (1996), section IV.8, with
Gustafsson's predictive control.
"""

from __future__ import annotations

from ....compiler.formulas import formula
from ..clock import (
    FROM,
    FROM_RATE,
    NEW,
    NOW,
    OLD,
    OLD_RATE,
    TO,
    TO_RATE,
)
from ..loop import shorten
from ..refusal import afresh, take_back
from .asked import WIDEST
from .coefficients import C
from .desk import (
    START,
)
from .even import refuse as narrower
from .newton import confirm, correct, factor, renew
from .step import MOST, STAGES, account, begin, estimate, iterate, predict, rates, share
from .whole import iterate_whole

SAFETY = 0.9
NARROWEST = 0.2  # what the width becomes at least
WALKED = 1e-3  # part of the widest step of late below which narrower ones lead into a singular position
FALLS, NARROWER = 0.5, 0.1  # what an error falls by at least in a step that is so much narrower, if it is no rounding
SLIGHT = 10.0  # an error from rounding that is accepted where no step of another width is found
ROUGH = 1e-5  # a relative error of a step above which rounding is no excuse
ELSEWHERE = 1.24  # what half a step taken back is taken wider by: two of them end beyond where it did
REFINED = 1  # times that solves are refined after a step that could not be taken
SINGULAR = 3


@formula
def rest(K, c):
    """Where the step begins, as a stage."""
    nv = K.v.shape[1]
    nq = c.y.shape[1] - nv - K.z.shape[1]
    for i in range(nv):
        K.d[START, i] = 0.0
        K.a[START, i] = c.K[0, nq + i]


@formula
def correct_at_end(callbacks, S, K, c, h):
    """One correction of the stages with the Jacobian of the last one. Returns a status, and its size."""
    residual, linearise = callbacks
    if renew(linearise, c.real.t + h, STAGES - 1, S, K, c) != 0 or factor(K, h) != 0:
        return SINGULAR, 0.0
    rates(K, h)
    for k in range(STAGES):
        if residual(c.real.t + C[k] * h, k, S, K, c) != 0:
            return SINGULAR, 0.0
    share(K, h)
    return 0, correct(K, h)


@formula
def attempt(callbacks, S, K, c, h):
    """One step of width h into c.y[NEW]. Returns (status, error, factor that a failed iteration asks for)."""
    residual, linearise, compose, arrive = callbacks[:4]
    begin(c, K)
    rest(K, c)
    predict(K, h)
    outdated = K.count.steep == 1 or (K.count.fresh == 0 and (c.count.trouble != 0 or K.real.theta > K.real.serves))
    if c.real.grow <= 1.0 and outdated:
        K.count.fresh = -1
    if K.count.fresh < 1 and not (K.count.fresh == 0 and K.real.width > 0.0):
        if renew(linearise, c.real.t, START, S, K, c) != 0:
            return SINGULAR, 0.0, 0.5
        K.count.fresh = 1
    if K.real.width != h and factor(K, h) != 0:
        return SINGULAR, 0.0, 0.5
    status, asked = iterate(residual, S, K, c, h)
    if status != 0 and K.count.fresh == 1:
        predict(K, h)
        status = iterate_whole((residual, linearise), S, K, c, h)
        if status == 0:
            asked = float(MOST)
            K.real.theta = 1.0
    if status == 0 and K.count.steep == 1:
        status = confirm(correct_at_end, (residual, linearise), S, K, c, h)
        asked = 0.5 if status != 0 else asked
        if status == 0:  # the Jacobian is that of the end now: `enter` has it serve on, another try does not
            K.count.fresh = -1
            status = account(residual, S, K, c, h)
    if status != 0:
        return status, 0.0, asked
    compose(c.y[NOW], K.d[2], K.v[2], K.z[2], c.y[NEW], S)
    error = 0.0
    if c.real.step == 0.0:
        status, error = estimate(residual, S, K, c, h)
        if status != 0 or not error < 1e300:
            return SINGULAR, 0.0, 0.5
        if error > max(1.0, c.real.pardon):
            return 0, error, asked
    status, _ = arrive(c.real.t + h, c.y[NEW], c.K[1], S, K)
    return status, error, asked if status == 0 else 0.5


@formula
def wider(h, error, iterations):
    """Width that an error asks for, less where the iteration took long."""
    safe = min(SAFETY, SAFETY * (1.0 + 2.0 * MOST) / (iterations + 2.0 * MOST))
    return h / max(1.0 / WIDEST, min(1.0 / NARROWEST, error**0.25 / safe)), safe


@formula
def refuse(K, c):
    """Try a narrower step, and with the Jacobian of where it begins. Returns 0, or that there is nothing to try."""
    h, error, asked = c.real.tried, c.real.error, K.real.asked
    if K.count.shared == 0 and (c.count.trouble != 0 or c.real.grow <= 1.0):
        K.count.refine = REFINED
    if c.count.trouble != 0:
        if c.real.step > 0.0 and K.count.fresh == 1:
            return narrower(K, c)
        if c.real.step > 0.0:
            shorten(c, h)
            return 0
        shorten(c, asked * h)
        stranded(K, c)
        return 0
    goes_on = K.count.before == 1 or c.real.back == c.real.t
    shorten(c, wider(h, error, asked)[0] if goes_on else 0.1 * h)
    if goes_on:  # what a jump excites is not followed by steps as wide as those before it
        pardon(K, c, h, error)
        if c.real.pardon > 0.0:
            stranded(K, c)
    return 0


@formula
def pardon(K, c, h, error):
    """Where ever narrower steps miss the tolerance by as much, rounding decides: the widest of them is taken.

    So it is near a singular position, where it grows as steps get narrower. What is accepted so is told
    (c.real.excess).
    """
    if error < FALLS * c.real.best:
        c.real.best = error
        c.real.best_h = h
    elif h < NARROWER * c.real.best_h and c.real.best * K.real.rtol < ROUGH and c.real.pardon == 0.0:
        c.real.pardon = 2.0 * c.real.best
        c.real.h = c.real.best_h
        c.real.blurred_at = c.real.t


@formula
def stranded(K, c):
    """Where ever narrower steps lead nowhere: too close to a singular position the last one may have ended.

    It is taken back and ends elsewhere. If that does not help, a wide step is tried, which ends beyond the place, then
    others, each somewhat narrower, with more pardoned.
    """
    if not (c.real.h < WALKED * c.real.wide and c.real.pardon * K.real.rtol < ROUGH):
        return
    if c.real.pardon == 0.0 and c.real.t - c.real.before > WALKED * c.real.wide and c.real.back < c.real.before:
        take_back(c)
        c.real.h *= ELSEWHERE
        K.count.before, K.count.fresh = 0, -1
        return
    c.real.pardon = max(SLIGHT, SLIGHT * c.real.pardon)
    c.real.h = c.real.wide * (SLIGHT / c.real.pardon) ** 0.15
    c.real.blurred_at = c.real.t


@formula
def enter(K, c, t, h, error, iterations):
    """Make the end of the step the present state, and choose the width of the next one."""
    for i in range(c.y.shape[1]):
        c.y[OLD, i], c.y[OLD_RATE, i] = c.y[NOW, i], c.K[0, i]
        c.y[NOW, i] = c.y[NEW, i]
        c.K[0, i] = c.K[1, i]
    for i in range(K.v.shape[1]):
        for k in range(4):
            K.before_v[k, i] = K.v[k, i]
    for i in range(K.tol_x.shape[0]):
        for k in range(4):
            K.before_x[k, i] = K.z[k, i]
    for i in range(K.lam.shape[1]):
        for k in range(3):
            K.before_lam[k, i] = K.lam[k, i]
        K.lam[START, i] = K.lam[2, i]
    if error > c.real.excess:
        c.real.excess = error
        c.real.excess_at = c.real.t
    wide, safe = wider(h, error, iterations)
    if K.real.last_error > 0.0 and error > 0.0:
        f = (h / K.real.last_h) * (K.real.last_error / (error * error)) ** 0.25 * safe
        wide = min(wide, h * max(NARROWEST, min(WIDEST, f)))
    if c.real.grow <= 1.0:
        wide = min(wide, h)
    else:
        K.count.refine = 0
    if c.real.pardon > 0.0:
        wide = max(h, c.real.wide)
    afresh(c)
    for i in range(c.seen.shape[1]):
        c.seen[FROM, i] = c.seen[TO, i]
        c.seen[FROM_RATE, i] = c.seen[TO_RATE, i]
    K.real.last_h = h
    K.real.last_error = max(1e-2, error)
    K.count.before = 1
    K.count.fresh = 0 if K.real.theta <= K.real.serves else -1
    if K.count.fresh == 0 and h <= wide <= K.real.stays * h:
        wide = h
    c.real.wide = max(h, 0.8 * c.real.wide)
    c.real.h = wide if c.real.step == 0.0 else c.real.step
    c.real.t = t
    c.real.grow = WIDEST
    c.count.accepted += 1
