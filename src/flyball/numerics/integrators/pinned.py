"""Where on the dense output a guard passes zero, and a step that ends there.

Where a guard may pass zero it is bracketed, or shown not to get there. Then the step is taken again, by the secant of
its width, until it ends on the event: what is found is as good as the integration, not as its interpolant.
"""

from __future__ import annotations

from ...compiler.formulas import formula
from .clock import ULP
from .glance import true_guard
from .grains import blur, hush
from .loop import TRY
from .panels import fires
from .watching import END, MARK, START

GOLDEN = 0.381966011250105
ROUNDS = 60  # evaluations in which a bracket is closed, or an extremum found
CLOSE = 1e-13  # part of the step that a bracket is closed to
FLAT = 1e-8  # part of the step to which the place of an extremum is found
TRIES = 80  # times that a step is taken again
STEEPER = 1.5  # times the slope seen before: a guard that falls so past zero may jump there, and tells no place
SOMEWHERE = 1e3  # times that by which a guard may be beside zero where a step ends on it
REACHED = 1e-14  # part of a step's width to which it ends on an event: solutions of equations are no better


@formula
def crossing(callbacks, S, W, R, c, h, i, a, b, s):
    """Where in the step guard i fires, on side s at a, expected by b: (status, place or -1 if it does not).

    Where it only fires as it comes back to that side, it has to be on the other one in between. W.real[BEYOND] is a
    place where it has not fired yet, which the start need not be.
    """
    W.real.beyond = 0.0
    first, last = a, b
    status, fa = true_guard(callbacks, S, W, R, c, h, a, i)
    wide = max(b - a, CLOSE)  # a place may be told twice
    while status == 0 and not s * fa > 0.0 and a > 0.0:  # earlier than expected
        b = a
        a = max(0.0, a - wide)
        wide *= 4.0
        status, fa = true_guard(callbacks, S, W, R, c, h, a, i)
    if status != 0:
        return status, -1.0
    if a <= 0.0 and W.kept[i] == 0 and abs(fa) <= W.g[MARK, i]:
        fa = 0.0  # on no side: it is rounding
    elif a <= 0.0 and s * W.side[i] == 1.0 and s * fa <= 0.0 and -s * fa < hush(W, i, 0.0):
        status, fb = true_guard(callbacks, S, W, R, c, h, last, i)  # the step before ended beside it
        return status, (CLOSE if s * fb < -hush(W, i, last) else -1.0)
    if not s * fa > 0.0:  # it is on that side nowhere before: only for a while, perhaps, or not at all
        b = last
        status, a, fa = lowest(callbacks, S, W, R, c, h, i, max(0.0, first - (last - first)), last, -s)
        if status != 0 or not s * fa > 0.0:
            return status, -1.0
    status, fb = true_guard(callbacks, S, W, R, c, h, b, i)
    if status != 0:
        return status, -1.0
    if s * fb > 0.0:  # it may come back in between
        status, m, fm = lowest(callbacks, S, W, R, c, h, i, a, b, s)
        if status != 0 or s * fm > (0.0 if W.kept[i] == 1 else -hush(W, i, m)):
            return status, -1.0
        if fires(W.way[i], s):
            b, fb = m, fm
        else:
            a, fa = m, fm
    elif W.kept[i] == 0 and s * fb >= -hush(W, i, b) and not (fb == 0.0 and s * fa > hush(W, i, a)):
        return 0, -1.0  # it gets to zero, and no farther
    begun = W.kept[i] == 0 and abs(W.g[START, i]) <= W.g[MARK, i]  # about zero, on no side
    if a > 0.0 and (begun or W.g[START, i] * fa < 0.0):
        W.real.beyond = a
    W.real.bracket = b - a
    status, x = bracketed(callbacks, S, W, R, c, h, i, (a, fa, b, fb))
    return status, max(x, CLOSE)  # one within rounding of the step's start is an event too


@formula
def lowest(callbacks, S, W, R, c, h, i, a, b, s):
    """The least of s times guard i between a and b, or a place where it is not above zero: (status, place, value).

    Golden section with parabolas (Brent 1973, chapter 5).
    """
    x = w = v = a + GOLDEN * (b - a)
    status, f = true_guard(callbacks, S, W, R, c, h, x, i)
    fx = fw = fv = s * f
    e = d = 0.0
    for _ in range(ROUNDS):
        if status != 0 or fx <= 0.0:
            break
        m = 0.5 * (a + b)
        tol = FLAT * max(abs(x), b - a, FLAT)
        if abs(x - m) <= 2.0 * tol - 0.5 * (b - a):
            break
        p = q = 0.0
        if abs(e) > tol:
            r = (x - w) * (fx - fv)
            q = (x - v) * (fx - fw)
            p = (x - v) * q - (x - w) * r
            q = 2.0 * (q - r)
            if q > 0.0:
                p = -p
            q = abs(q)
        if q != 0.0 and abs(p) < abs(0.5 * q * e) and q * (a - x) < p and p < q * (b - x):
            e = d
            d = p / q
        else:
            e = (b if x < m else a) - x
            d = GOLDEN * e
        u = x + (d if abs(d) >= tol else (tol if d > 0.0 else -tol))
        status, f = true_guard(callbacks, S, W, R, c, h, u, i)
        fu = s * f
        if fu <= fx:
            if u < x:
                b = x
            else:
                a = x
            v, fv, w, fw, x, fx = w, fw, x, fx, u, fu
        else:
            if u < x:
                a = u
            else:
                b = u
            if fu <= fw or w == x:
                v, fv, w, fw = w, fw, u, fu
            elif fu <= fv or v == x or v == w:
                v, fv = u, fu
    return status, x, s * fx


@formula
def bracketed(callbacks, S, W, R, c, h, i, bracket):
    """Where in a bracket (a, f, b, f) guard i passes zero: (status, place). Chandrupatla (1997)."""
    x2, f2, x1, f1 = bracket  # the newest is 1; 1 and 2 are on two sides
    x3, f3 = x2, f2
    t = 0.5
    for n in range(ROUNDS):
        if f1 == 0.0:
            return 0, x1
        if n == 0 and f1 != f2:
            t = f1 / (f1 - f2)
        tol = CLOSE / max(abs(x2 - x1), CLOSE)
        if tol > 0.5:
            break
        t = min(max(t, tol), 1.0 - tol)
        x = x1 + t * (x2 - x1)
        status, f = true_guard(callbacks, S, W, R, c, h, x, i)
        if status != 0:
            return status, -1.0
        if (f > 0.0) == (f1 > 0.0):
            x3, f3 = x1, f1
        else:
            x3, f3, x2, f2 = x2, f2, x1, f1
        x1, f1 = x, f
        u = (x1 - x2) / (x3 - x2) if x3 != x2 else 0.5
        p = (f1 - f2) / (f3 - f2) if f3 != f2 else 0.5
        t = 0.5
        if p * p < u and (1.0 - p) * (1.0 - p) < 1.0 - u:
            t = f1 / (f2 - f1) * f3 / (f2 - f3) + (x3 - x1) / (x2 - x1) * f1 / (f3 - f1) * f2 / (f3 - f2)
    return 0, (x1 if abs(f1) < abs(f2) else x2)


@formula
def retake(callbacks, S, W, R, c, h):
    """Take the step again with width h, and note its end. Returns a status."""
    ask, own, note = callbacks[0], callbacks[1], callbacks[6]
    W.count.again += 1
    c.real.tried = h
    status = ask(own, S, W, R, c, TRY)
    if status == 0:
        note(S, W, END)
    return status


@formula
def end_on(callbacks, S, W, R, c, h, slope, i, s, between):
    """Take the step again until it ends where guard i leaves side s, near width h: (status, whether it does).

    The secant on the width; by halves where a guard jumps. ``slope``: of the guard by time, before it leaves;
    ``between``: a width at which it has not left, and the width of the step as it was. It does not end there where
    the guard was on that side nowhere, or has not left it at the end: the dense output told of what did not happen.
    """
    least, most = between
    ulp = ULP * max(abs(c.real.t) + h, 1e-3 * c.real.largest)
    near = 2.0 * ulp + REACHED * h
    low, high = least, most
    bound = False  # whether a step that does not reach the event is known
    rough = stride = CLOSE * most + 4.0 * ulp
    last, before, gone = 0.0, 0.0, 1e300
    status, done = 0, False
    for n in range(TRIES):
        status = retake(callbacks, S, W, R, c, h)
        f = W.g[END, i]
        if status != 0 or f == 0.0 or done:
            break
        leap = False
        if n > 0 and h != before and (f != last or abs(h - before) > near):
            secant = (f - last) / (h - before)
            leap = f * last < 0.0 and abs(secant) > STEEPER * abs(slope)
            slope = secant
        way = -f / slope if slope * s < 0.0 and not leap else 1e300
        if abs(way) <= near or (n > 2 and abs(way) >= 0.5 * gone and abs(way) < rough):
            break
        if s * f > 0.0:
            low, bound = h, True
        else:
            high = h
        last, before = f, h
        if high - low <= 4.0 * ulp:
            if s * f <= 0.0 or high >= most:
                break
            h, done = high, True
        elif abs(way) < 0.5 * gone and low < h + way and h + way < high:
            gone = abs(way)
            h += way
        else:
            h = halved(h, low, high, stride, bound, high < most, s * f > 0.0)
            stride *= 8.0
    f = W.g[END, i]
    there = abs(f) <= max(SOMEWHERE * near * abs(slope), blur(W, i, 1.0))
    found = there or (not s * f > 0.0 and (not least > 0.0 or bound or done))
    return status, found


@formula
def halved(h, low, high, stride, lower, upper, onward):
    """A width between those known to fall short of the event and to reach it; ``lower``, ``upper``: which are known."""
    if lower and upper:
        return 0.5 * (low + high)
    if onward:
        return min(h + stride, 0.5 * (h + high)) if h + stride >= high else h + stride
    return max(h - stride, 0.5 * (low + h))
