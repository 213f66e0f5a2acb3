"""Where in a step a guard may pass zero, as far as can be told without the equations.

A step is looked at in panels. In each the guards are a polynomial through values at eight places; two more places say
whether that is so, else the panel is halved. `glance.glance` writes the guards at t + x h to a row of ``W.g``; W is a
`Watch`.
"""

from __future__ import annotations

from ...compiler.formulas import formula
from .clock import LARGEST, T
from .concave import BLURRED, NOISE, ODD, bent
from .glance import glance, true_guard
from .grains import RESOLVED, blur, corner, gone, hush, rounding
from .watching import (
    AWAY,
    CHECKS,
    CUTS,
    DONE_TO,
    END,
    FIRED,
    FRESH,
    LEAST,
    LOOKS,
    MARK,
    MOST,
    NODE,
    NODES,
    PANEL,
    PLAIN,
    SIDE,
    SOUGHT,
    START,
    TERMS,
    THERE,
    WIDTH,
)

MANY = 4000  # places that are looked at before panels are taken as they are: what is not smooth then is rounding
DEARLY = 1000  # of those with the equations, before the step is cut where it was looked through to
ALONG = 0.1  # part of a step below which it is not cut but taken as it is
OFTEN = 8  # times that a step is cut before it is taken as it is
NARROWEST = 2.0**-14  # part of a step that a panel is not narrower than
CLOSELY = 1e-6  # the same, where it might be zero between two places that are looked at, at slopes seen in the panel
REACH = 1.5  # times the steepest of these that its slope may be between them
QUIET = 0.3  # a guard that stays farther from zero than this part of its change has nothing to hide
NOTHING = 1e-200  # a guard that is no larger is zero
GRAZE = 2e-2  # part of its change within which an extremum is looked at with the equations
PARTS = 16  # of a panel, in which slopes are compared
AT_FIRST = 2.0**-40  # part of a step over which slopes at its start are found
CLOSEST, FARTHEST = 44, 5  # powers of a half: places near the start where a guard that begins at zero is looked at
NEAR = 1e-6  # part of its size in a step by which a guard that has just fired is not more than about zero
ROUNDING = 1e-12  # part of its size in a step by which any other guard is not more than zero


@formula
def survey(callbacks, S, W, R, c, h, first):
    """The first place after ``first`` where a guard passes zero or comes near: (guard or -1, from, to).

    From and to are parts of the step. Sides go on from W.g[SIDE]. W.real[DONE_TO] is 1, or how far it has come.
    """
    a = first
    w = 1.0 - first
    most = W.count[LOOKS] + MANY
    W.real[DONE_TO] = 1.0
    while a < 1.0:
        w = min(w, 1.0 - a)
        W.real[PANEL], W.real[WIDTH] = a, w
        fill(callbacks, S, W, R, c, h, a, w)
        smooth = resolved(W)
        if not smooth and w > NARROWEST and W.count[LOOKS] < most:
            if W.count[PLAIN] == 0 and W.count[SOUGHT] > DEARLY and a > ALONG and W.count[CUTS] < OFTEN:
                W.real[DONE_TO] = a
                return -1, a, a
            w *= 0.5
            continue
        best = -1
        xa, xb = a, 2.0
        for i in range(W.way.shape[0]):
            if W.fired[i] == 0 and restless(W, i):
                a1, b1 = passing(W, i) if smooth else jumping(W, i)
                if b1 >= 0.0 and a + w * b1 < xb:
                    best, xa, xb = i, a + w * a1, a + w * b1
        if best >= 0:
            return best, xa, xb
        if a + w >= 1.0:
            return -1, 1.0, 1.0
        a += w
        w *= 2.0
    return -1, 1.0, 1.0


@formula
def fill(callbacks, S, W, R, c, h, a, w):
    """Guards at the nodes of a panel and where it is checked; at the ends of the step they are known."""
    for j in range(NODES + CHECKS):
        x = a + w * W.nodes[j]
        row = NODE + j
        if x <= 0.0 or x >= 1.0:
            for i in range(W.way.shape[0] + W.count[TERMS]):
                W.g[row, i] = W.g[START if x <= 0.0 else END, i]
        else:
            glance(callbacks, S, W, R, c, h, x, row)


@formula
def resolved(W):
    """Whether every guard is the polynomial through its values at the nodes.

    A corner, as of the distance of what flies past or through something, is hardly seen where this is checked: 8 in 30
    differ by less than `ODD`. So it is asked closely of a guard that may have been zero between two nodes.
    """
    for i in range(W.way.shape[0]):
        low, high = extent(W, i)
        if not finite(low, high):
            continue
        odd = CLOSELY if hidden(W, i) else ODD
        allowed = odd * (high - low) + BLURRED * max(abs(low), abs(high)) + quiet(W, i)
        for j in range(CHECKS):
            f = W.g[NODE + NODES + j, i]
            for k in range(NODES):
                f -= W.checks[j, k] * W.g[NODE + k, i]
            if not abs(f) <= allowed:
                return False
    return not bent(W)


@formula
def hidden(W, i):
    """Whether a guard may fire and come back between two nodes: the sum of both is less than it can fall and rise."""
    steepest = 0.0
    for j in range(1, NODES):
        steepest = max(steepest, abs(W.g[NODE + j, i] - W.g[NODE + j - 1, i]) / (W.nodes[j] - W.nodes[j - 1]))
    for j in range(1, NODES):
        f, g = W.g[NODE + j - 1, i], W.g[NODE + j, i]
        near = abs(f) + abs(g) <= REACH * steepest * (W.nodes[j] - W.nodes[j - 1])
        if near and f * g > 0.0 and fires(W.way[i], side_of(f)):
            return True
    return False


@formula
def extent(W, i):
    """Least and largest value of a guard in the panel; both nan if it is not a number somewhere."""
    low = W.g[NODE, i]
    high = low
    for j in range(1, NODES + CHECKS):
        f = W.g[NODE + j, i]
        if f != f:
            return f, f
        low = min(low, f)
        high = max(high, f)
    return low, high


@formula
def finite(low, high):
    """Whether both are numbers."""
    return low - low == 0.0 and high - high == 0.0


@formula
def restless(W, i):
    """Whether a guard comes near zero in the panel. One that does not is on the side that it stays on."""
    low, high = extent(W, i)
    if not finite(low, high):  # not watched, or not everywhere
        return finite(W.g[NODE, i], 0.0) or finite(W.g[NODE + NODES - 1, i], 0.0)
    if max(abs(low), abs(high)) < NOTHING + (0.0 if corner(W, i) else quiet(W, i)):
        return False
    most = QUIET * (high - low)
    if low > most and W.g[SIDE, i] >= 0.0:
        W.g[SIDE, i] = 1.0
        return False
    if high < -most and W.g[SIDE, i] <= 0.0:
        W.g[SIDE, i] = -1.0
        return False
    return True


@formula
def quiet(W, i):
    """What is rounding of guard i anywhere in the panel."""
    return min(blur(W, i, W.real[PANEL]), blur(W, i, W.real[PANEL] + W.real[WIDTH]))


@formula
def side_of(f):
    """On which side of zero a value is; 0 if it is none."""
    return 1.0 if f > 0.0 else (-1.0 if f < 0.0 else 0.0)


@formula
def fires(way, side):
    """Whether a guard that leaves that side fires."""
    return side != 0.0 and way * side <= 0.0


@formula
def passing(W, i):
    """Where in a panel guard i first passes zero, or may: (from, to), or to < 0. Its side goes on to there."""
    low, high = extent(W, i)
    if not finite(low, high):
        return jumping(W, i)
    powers(W, i)
    graze = GRAZE * (high - low)
    s = W.g[SIDE, i]
    _, d = value(W, 0.0)
    for n in range(PARTS):
        x = n / PARTS
        y = (n + 1.0) / PARTS
        f1, d1 = value(W, y)
        if n == PARTS - 1:
            f1 = W.g[NODE + NODES - 1, i]
        if s * d < 0.0 and s * d1 >= 0.0:  # it goes towards zero, and away again
            z = x + (y - x) * d / (d - d1)
            fz, _ = value(W, z)
            left = gone(W, i, s, fz, within(W, z)) and fires(W.way[i], s)
            if left or (s * fz <= graze and s * f1 > 0.0):
                W.g[SIDE, i] = s
                return x, z if left else y
        if s != 0.0 and gone(W, i, s, f1, within(W, y)) and (f1 != 0.0 or fires(W.way[i], s)):
            if fires(W.way[i], s):
                W.g[SIDE, i] = s
                return x, y
            s = side_of(f1)
        elif s == 0.0 and (f1 if W.kept[i] == 1 else abs(f1)) > W.g[MARK, i]:
            s = side_of(f1)
        d = d1
    W.g[SIDE, i] = s
    return 0.0, -1.0


@formula
def jumping(W, i):
    """As `passing`, of a guard that is no polynomial: by its values at the nodes."""
    s = W.g[SIDE, i]
    for j in range(1, NODES):
        f = W.g[NODE + j, i]
        if f != f:
            s = 0.0
        elif s != 0.0 and gone(W, i, s, f, within(W, W.nodes[j])) and (f != 0.0 or fires(W.way[i], s)):
            if fires(W.way[i], s):
                W.g[SIDE, i] = s
                return W.nodes[j - 1], W.nodes[j]
            s = side_of(f)
        elif s == 0.0 and (f if W.kept[i] == 1 else abs(f)) > W.g[MARK, i]:
            s = side_of(f)
    W.g[SIDE, i] = s
    return 0.0, -1.0


@formula
def within(W, y):
    """What place in the step a place in the panel is."""
    return W.real[PANEL] + W.real[WIDTH] * y


@formula
def powers(W, i):
    """The polynomial of guard i in powers of the place in the panel."""
    for p in range(NODES):
        s = 0.0
        for j in range(NODES):
            s += W.basis[p, j] * W.g[NODE + j, i]
        W.poly[p] = s


@formula
def value(W, x):
    """That polynomial and its slope."""
    f = 0.0
    d = 0.0
    for p in range(NODES - 1, -1, -1):
        d = d * x + f
        f = f * x + W.poly[p]
    return f, d


@formula
def begin_sides(callbacks, S, W, R, c, h):
    """Sides as the step begins, in W.g[SIDE]: (guard that leaves its side at once or -1, from, to, where to go on).

    A guard that is about zero as a segment of the motion begins, above all one that has just fired (its side is 0), is
    on the side that it goes to: places closer and closer to the start tell which that is, and whether it comes back
    soon. One that has to stay above zero (W.kept) has not to go below: W.count[AWAY] says that it does.
    """
    look, t, ng = callbacks[7], c.real[T], W.way.shape[0]
    W.count[AWAY] = 0
    if W.count[FRESH] == 0 and not doubtful(W):
        for i in range(ng):
            W.g[SIDE, i] = W.side[i]
            W.g[MARK, i] = blur(W, i, 0.0) if W.side[i] == 0.0 and W.kept[i] == 0 else -1.0
        return -1, 0.0, 0.0, 0.0
    if not begins_near(callbacks, S, W, R, c, h):
        return -1, 0.0, 0.0, 0.0
    before = 0.0
    for n in range(CLOSEST, FARTHEST - 1, -1):
        x = 0.5**n
        look(t, h, x, S, W, THERE)
        W.count[LOOKS] += 1
        i = begun(W, 0)
        while i >= 0 and W.count[AWAY] == 1:  # the equations tell whether it is: interpolation is less exact
            status, f = true_guard(callbacks, S, W, R, c, h, x, i)
            if status != 0 or not f >= -band(W, i):
                break
            W.count[AWAY] = 0
            i = begun(W, i + 1)
        if i >= 0:
            return i, before, x, x
        before = x
        if not undecided(W):
            break
    return -1, 0.0, 0.0, before


@formula
def doubtful(W):
    """Whether a guard that has to stay above zero is about zero since the motion's segment began."""
    n = 0
    for i in range(W.way.shape[0]):
        if W.kept[i] == 1 and W.side[i] <= 0.0 and W.g[START, i] == W.g[START, i]:
            n += 1
    return n > 0


@formula
def begins_near(callbacks, S, W, R, c, h):
    """Note in W.g[MARK] what is zero of guards that begin about there, -1 of others; whether there are any."""
    fill(callbacks, S, W, R, c, h, 0.0, 1.0)
    first = min(1.0, max(AT_FIRST, 4.0 * RESOLVED * max(abs(c.real[T]), c.real[LARGEST]) / h))
    callbacks[7](c.real[T], h, first, S, W, THERE)
    near = False
    for i in range(W.way.shape[0]):
        low, high = extent(W, i)
        fresh = W.count[FRESH] == 1 and (W.kept[i] == 1 or abs(W.side[i]) != 1.0)
        W.g[SIDE, i] = side_of(W.g[START, i]) if fresh else W.side[i]
        W.g[MARK, i] = -1.0
        if not fresh and (W.count[FRESH] == 1 or not (W.kept[i] == 1 and W.side[i] <= 0.0)):
            continue
        size = max(abs(low), abs(high))
        now = abs(W.g[START, i])
        just = W.side[i] == 0.0
        below = W.kept[i] == 1 and W.g[START, i] < 0.0
        nothing = 0.0
        if W.kept[i] == 0 and finite(low, high):
            slope = min(high - low, abs(W.g[THERE, i] - W.g[START, i]) / first) / h
            nothing = max(rounding(W, c, i, slope, 0.0), NOISE * W.g[FIRED, i] if just else 0.0)
        if finite(low, high) and (below or now <= max((NEAR if just else ROUNDING) * size, nothing)):
            W.g[SIDE, i] = 0.0
            mark = deeper(W, i) * now if just or below else ROUNDING * size
            W.g[MARK, i] = max(mark, W.kept[i] * NOISE * W.grain[i], nothing)
            near = True
    return near


@formula
def begun(W, first):
    """A guard from ``first`` on that leaves at once the side that it went to, or has to keep, by W.g[THERE]; or -1."""
    for i in range(first, W.way.shape[0]):
        f = W.g[THERE, i]
        s = W.g[SIDE, i]
        if W.g[MARK, i] < 0.0 or W.fired[i] != 0:
            continue
        if W.kept[i] == 1 and s <= 0.0 and f < -band(W, i):
            W.count[AWAY] = 1
            return i
        if s == 0.0:
            if abs(f) > W.g[MARK, i]:
                W.g[SIDE, i] = side_of(f)
        elif s * f < -hush(W, i, 0.0):
            if fires(W.way[i], s):
                return i
            W.g[SIDE, i] = side_of(f)
    return -1


@formula
def undecided(W):
    """Whether a guard that begins about zero is on no side yet, or has to be followed to the end."""
    n = 0
    for i in range(W.way.shape[0]):
        if W.g[MARK, i] >= 0.0 and (W.g[SIDE, i] == 0.0 or W.kept[i] == 1):
            n += 1
    return n > 0


@formula
def band(W, i):
    """How far below zero a guard that has to stay above may be by rounding."""
    size = max(abs(W.g[LEAST, i]), abs(W.g[MOST, i]))
    return max(W.g[MARK, i], ROUNDING * size, NOISE * W.grain[i], deeper(W, i) * -W.g[START, i])


@formula
def deeper(W, i):
    """How many times as far below zero as it begins a guard may be by rounding: no farther where it is firm.

    What bounces beneath a stop would sink by that factor from bounce to bounce.
    """
    return 1.0 if W.firm[i] == 1 else NOISE
