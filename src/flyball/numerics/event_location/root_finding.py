"""Search of a step for zeros of guards: subintervals, brackets, root refinement.

A step is searched in subintervals. In each the guards are a polynomial through their values at eight nodes. Two
more places check it; if it does not fit, the subinterval is halved. `guards.evaluate_guards` writes the guards at
t + x h to an array.

Where a guard may pass zero, the sign change is bracketed on the dense output, or shown not to exist. Then the
step is repeated with a width from the secant method until it ends on the event. The event time is therefore as
accurate as the integration, not as its interpolant.
"""

from __future__ import annotations

from ...compiler.formulas import formula
from ..integrators.time_loop import TRY_STEP, ULP
from .guards import (
    CHECK_NODES,
    END,
    NODES,
    POLYNOMIAL_TOLERANCE,
    ROUNDING_FACTOR,
    SIZE_ROUNDING,
    TIME_RESOLUTION,
    crossing_floor,
    evaluate_guards,
    exact_guard,
    group_may_dip,
    has_left_side,
    is_law_corner,
    rounding_floor,
    rounding_floor_with_time,
)

MAX_LOOKS = 4000  # places evaluated before unresolved subintervals are accepted: remaining roughness is rounding
MAX_EXACT_LOOKS = 1000  # of those with the equations, before the step is cut to the part already searched
MIN_CUT_PLACE = 0.1  # part of a step below which it is not cut
MAX_CUTS = 8  # times that a step is cut before it is accepted as it is
MIN_SUBINTERVAL = 2.0**-14  # smallest subinterval, as a part of the step
NEAR_ZERO_TOLERANCE = 1e-6  # tolerance instead of `POLYNOMIAL_TOLERANCE` if the guard might be zero between two nodes
SLOPE_SAFETY = 1.5  # safety factor on the steepest slope between nodes
QUIET_DISTANCE = 0.3  # a guard farther from zero than this part of its change cannot cross
ZERO_GUARD = 1e-200  # a smaller guard counts as zero
GRAZING_DISTANCE = 2e-2  # distance of an extremum from zero, relative to the change, within which it is checked exactly
SLOPE_SAMPLES = 16  # intervals of a subinterval in which slopes are compared
START_SLOPE_STEP = 2.0**-40  # part of a step over which slopes at its start are computed
CLOSEST_START_POWER, FARTHEST_START_POWER = (
    44,
    5,
)  # powers of one half: places near the start where a guard that begins at zero is evaluated
TRIGGERED_ZERO_TOLERANCE = 1e-6  # relative size within which a guard that has just triggered counts as zero
START_ZERO_TOLERANCE = 1e-12  # relative size within which any other guard counts as zero


@formula
def find_crossing_interval(callbacks, S, W, R, c, h, first):
    """Find the first interval after ``first`` in which a guard passes or approaches zero: (guard or -1, from, to).

    From and to are parts of the step. The search continues with the sides in W.guards.search_side.
    W.real.searched_to is 1, or the place where the search stopped.
    """
    a = first
    w = 1.0 - first
    most = W.count.looks + MAX_LOOKS
    W.real.searched_to = 1.0
    while a < 1.0:
        w = min(w, 1.0 - a)
        W.real.subinterval, W.real.width = a, w
        evaluate_subinterval(callbacks, S, W, R, c, h, a, w)
        smooth = subinterval_resolved(W)
        if not smooth and w > MIN_SUBINTERVAL and W.count.looks < most:
            if (
                W.count.predictions_agree == 0
                and W.count.exact_looks > MAX_EXACT_LOOKS
                and a > MIN_CUT_PLACE
                and W.count.cuts < MAX_CUTS
            ):
                W.real.searched_to = a
                return -1, a, a
            w *= 0.5
            continue
        best = -1
        xa, xb = a, 2.0
        for i in range(W.way.shape[0]):
            if W.fired[i] == 0 and may_cross(W, i):
                a1, b1 = crossing_of_polynomial(W, i) if smooth else crossing_at_nodes(W, i)
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
def evaluate_subinterval(callbacks, S, W, R, c, h, a, w):
    """Write the guards at the nodes and check places of a subinterval; values at the ends of the step are known."""
    for j in range(NODES + CHECK_NODES):
        x = a + w * W.nodes[j]
        if x <= 0.0 or x >= 1.0:
            for i in range(W.way.shape[0] + W.count.terms):
                W.node_values[j, i] = W.guards.start[i] if x <= 0.0 else W.guards.end[i]
        else:
            evaluate_guards(callbacks, S, W, R, c, h, x, W.node_values[j])


@formula
def subinterval_resolved(W):
    """Whether the polynomial through the nodes represents every guard.

    The check places hardly detect a corner, such as the distance to an object that is passed or hit: 8 in 30 differ by
    less than `POLYNOMIAL_TOLERANCE`. So a guard that may have been zero between two nodes gets a smaller tolerance.
    """
    for i in range(W.way.shape[0]):
        low, high = value_range(W, i)
        if not both_finite(low, high):
            continue
        odd = NEAR_ZERO_TOLERANCE if may_cross_between_nodes(W, i) else POLYNOMIAL_TOLERANCE
        allowed = odd * (high - low) + SIZE_ROUNDING * max(abs(low), abs(high)) + subinterval_floor(W, i)
        for j in range(CHECK_NODES):
            f = W.node_values[NODES + j, i]
            for k in range(NODES):
                f -= W.checks[j, k] * W.node_values[k, i]
            if not abs(f) <= allowed:
                return False
    return not group_may_dip(W)


@formula
def may_cross_between_nodes(W, i):
    """Whether a guard may cross zero twice between two nodes: its slope allows a change by the sum of both."""
    steepest = 0.0
    for j in range(1, NODES):
        steepest = max(steepest, abs(W.node_values[j, i] - W.node_values[j - 1, i]) / (W.nodes[j] - W.nodes[j - 1]))
    for j in range(1, NODES):
        f, g = W.node_values[j - 1, i], W.node_values[j, i]
        near = abs(f) + abs(g) <= SLOPE_SAFETY * steepest * (W.nodes[j] - W.nodes[j - 1])
        if near and f * g > 0.0 and triggers(W.way[i], side_of(f)):
            return True
    return False


@formula
def value_range(W, i):
    """Smallest and largest value of a guard in the subinterval; both nan if it is nan somewhere."""
    low = W.node_values[0, i]
    high = low
    for j in range(1, NODES + CHECK_NODES):
        f = W.node_values[j, i]
        if f != f:
            return f, f
        low = min(low, f)
        high = max(high, f)
    return low, high


@formula
def both_finite(low, high):
    """Whether both numbers are finite."""
    return low - low == 0.0 and high - high == 0.0


@formula
def may_cross(W, i):
    """Whether a guard comes near zero in the subinterval. Otherwise its side is set to that of its values."""
    low, high = value_range(W, i)
    if not both_finite(low, high):  # not defined, or not everywhere
        return both_finite(W.node_values[0, i], 0.0) or both_finite(W.node_values[NODES - 1, i], 0.0)
    if max(abs(low), abs(high)) < ZERO_GUARD + (0.0 if is_law_corner(W, i) else subinterval_floor(W, i)):
        return False
    most = QUIET_DISTANCE * (high - low)
    if low > most and W.guards.search_side[i] >= 0.0:
        W.guards.search_side[i] = 1.0
        return False
    if high < -most and W.guards.search_side[i] <= 0.0:
        W.guards.search_side[i] = -1.0
        return False
    return True


@formula
def subinterval_floor(W, i):
    """Return the rounding floor of guard i, the smaller one of both ends of the subinterval."""
    return min(rounding_floor(W, i, W.real.subinterval), rounding_floor(W, i, W.real.subinterval + W.real.width))


@formula
def side_of(f):
    """Sign of a value: 1, -1, or 0."""
    return 1.0 if f > 0.0 else (-1.0 if f < 0.0 else 0.0)


@formula
def triggers(way, side):
    """Whether leaving that side is an event of a guard with this direction."""
    return side != 0.0 and way * side <= 0.0


@formula
def crossing_of_polynomial(W, i):
    """Find where guard i first passes zero in a subinterval, or may: (from, to), or to < 0. Updates its side."""
    low, high = value_range(W, i)
    if not both_finite(low, high):
        return crossing_at_nodes(W, i)
    polynomial_coefficients(W, i)
    graze = GRAZING_DISTANCE * (high - low)
    s = W.guards.search_side[i]
    _, d = polynomial_value(W, 0.0)
    for n in range(SLOPE_SAMPLES):
        x = n / SLOPE_SAMPLES
        y = (n + 1.0) / SLOPE_SAMPLES
        f1, d1 = polynomial_value(W, y)
        if n == SLOPE_SAMPLES - 1:
            f1 = W.node_values[NODES - 1, i]
        if s * d < 0.0 and s * d1 >= 0.0:  # it approaches zero and then recedes
            z = x + (y - x) * d / (d - d1)
            fz, _ = polynomial_value(W, z)
            left = has_left_side(W, i, s, fz, place_in_step(W, z)) and triggers(W.way[i], s)
            if left or (s * fz <= graze and s * f1 > 0.0):
                W.guards.search_side[i] = s
                return x, z if left else y
        if s != 0.0 and has_left_side(W, i, s, f1, place_in_step(W, y)) and (f1 != 0.0 or triggers(W.way[i], s)):
            if triggers(W.way[i], s):
                W.guards.search_side[i] = s
                return x, y
            s = side_of(f1)
        elif s == 0.0 and (f1 if W.nonnegative[i] == 1 else abs(f1)) > W.guards.zero_band[i]:
            s = side_of(f1)
        d = d1
    W.guards.search_side[i] = s
    return 0.0, -1.0


@formula
def crossing_at_nodes(W, i):
    """Find the crossing as `crossing_of_polynomial`, from values at the nodes, for an unresolved guard."""
    s = W.guards.search_side[i]
    for j in range(1, NODES):
        f = W.node_values[j, i]
        if f != f:
            s = 0.0
        elif (
            s != 0.0 and has_left_side(W, i, s, f, place_in_step(W, W.nodes[j])) and (f != 0.0 or triggers(W.way[i], s))
        ):
            if triggers(W.way[i], s):
                W.guards.search_side[i] = s
                return W.nodes[j - 1], W.nodes[j]
            s = side_of(f)
        elif s == 0.0 and (f if W.nonnegative[i] == 1 else abs(f)) > W.guards.zero_band[i]:
            s = side_of(f)
    W.guards.search_side[i] = s
    return 0.0, -1.0


@formula
def place_in_step(W, y):
    """Convert a place in the subinterval to a place in the step."""
    return W.real.subinterval + W.real.width * y


@formula
def polynomial_coefficients(W, i):
    """Compute the power coefficients of guard i over the subinterval."""
    for p in range(NODES):
        s = 0.0
        for j in range(NODES):
            s += W.basis[p, j] * W.node_values[j, i]
        W.polynomial[p] = s


@formula
def polynomial_value(W, x):
    """Value and slope of the polynomial in W.polynomial."""
    f = 0.0
    d = 0.0
    for p in range(NODES - 1, -1, -1):
        d = d * x + f
        f = f * x + W.polynomial[p]
    return f, d


@formula
def find_start_sides(callbacks, S, W, R, c, h):
    """Find the sides at the start of the step: (guard that leaves its side at once or -1, from, to, where to continue).

    A guard about zero at the start of a segment, above all one that has just triggered (side 0), gets the side to which
    it moves. It is evaluated at places near the start, in order of distance, which show the side and an early return. A
    guard that must stay above zero (W.nonnegative) must not go below; W.count.leaves_required_side is 1 if it does.
    """
    look, t, ng = callbacks[7], c.real.t, W.way.shape[0]
    W.count.leaves_required_side = 0
    if W.count.fresh == 0 and not has_doubtful_side(W):
        for i in range(ng):
            W.guards.search_side[i] = W.side[i]
            W.guards.zero_band[i] = rounding_floor(W, i, 0.0) if W.side[i] == 0.0 and W.nonnegative[i] == 0 else -1.0
        return -1, 0.0, 0.0, 0.0
    if not mark_zero_starts(callbacks, S, W, R, c, h):
        return -1, 0.0, 0.0, 0.0
    before = 0.0
    for n in range(CLOSEST_START_POWER, FARTHEST_START_POWER - 1, -1):
        x = 0.5**n
        look(t, h, x, S, W, W.guards.predicted)
        W.count.looks += 1
        i = leaves_start_side(W, 0)
        while i >= 0 and W.count.leaves_required_side == 1:  # check with the equations: interpolation is less accurate
            status, f = exact_guard(callbacks, S, W, R, c, h, x, i)
            if status != 0 or not f >= -allowed_depth(W, i):
                break
            W.count.leaves_required_side = 0
            i = leaves_start_side(W, i + 1)
        if i >= 0:
            return i, before, x, x
        before = x
        if not has_undecided_side(W):
            break
    return -1, 0.0, 0.0, before


@formula
def has_doubtful_side(W):
    """Whether a guard that must stay above zero has been about zero since the start of the segment."""
    n = 0
    for i in range(W.way.shape[0]):
        if W.nonnegative[i] == 1 and W.side[i] <= 0.0 and W.guards.start[i] == W.guards.start[i]:
            n += 1
    return n > 0


@formula
def mark_zero_starts(callbacks, S, W, R, c, h):
    """Write zero bands of guards that begin near zero to W.guards.zero_band, else -1; returns if there are any."""
    evaluate_subinterval(callbacks, S, W, R, c, h, 0.0, 1.0)
    first = min(1.0, max(START_SLOPE_STEP, 4.0 * TIME_RESOLUTION * max(abs(c.real.t), c.real.largest) / h))
    callbacks[7](c.real.t, h, first, S, W, W.guards.predicted)
    near = False
    for i in range(W.way.shape[0]):
        low, high = value_range(W, i)
        fresh = W.count.fresh == 1 and (W.nonnegative[i] == 1 or abs(W.side[i]) != 1.0)
        W.guards.search_side[i] = side_of(W.guards.start[i]) if fresh else W.side[i]
        W.guards.zero_band[i] = -1.0
        if not fresh and (W.count.fresh == 1 or not (W.nonnegative[i] == 1 and W.side[i] <= 0.0)):
            continue
        size = max(abs(low), abs(high))
        now = abs(W.guards.start[i])
        just = W.side[i] == 0.0
        below = W.nonnegative[i] == 1 and W.guards.start[i] < 0.0
        nothing = 0.0
        if W.nonnegative[i] == 0 and both_finite(low, high):
            slope = min(high - low, abs(W.guards.predicted[i] - W.guards.start[i]) / first) / h
            nothing = max(
                rounding_floor_with_time(W, c, i, slope, 0.0), ROUNDING_FACTOR * W.guards.trigger[i] if just else 0.0
            )
        if both_finite(low, high) and (
            below or now <= max((TRIGGERED_ZERO_TOLERANCE if just else START_ZERO_TOLERANCE) * size, nothing)
        ):
            W.guards.search_side[i] = 0.0
            mark = allowed_depth_factor(W, i) * now if just or below else START_ZERO_TOLERANCE * size
            W.guards.zero_band[i] = max(mark, W.nonnegative[i] * ROUNDING_FACTOR * W.grain[i], nothing)
            near = True
    return near


@formula
def leaves_start_side(W, first):
    """Return the first guard from ``first`` on that leaves its side near the start, by the predicted values; or -1."""
    for i in range(first, W.way.shape[0]):
        f = W.guards.predicted[i]
        s = W.guards.search_side[i]
        if W.guards.zero_band[i] < 0.0 or W.fired[i] != 0:
            continue
        if W.nonnegative[i] == 1 and s <= 0.0 and f < -allowed_depth(W, i):
            W.count.leaves_required_side = 1
            return i
        if s == 0.0:
            if abs(f) > W.guards.zero_band[i]:
                W.guards.search_side[i] = side_of(f)
        elif s * f < -crossing_floor(W, i, 0.0):
            if triggers(W.way[i], s):
                return i
            W.guards.search_side[i] = side_of(f)
    return -1


@formula
def has_undecided_side(W):
    """Whether a guard that begins about zero has no side yet, or must be followed to the end of the search."""
    n = 0
    for i in range(W.way.shape[0]):
        if W.guards.zero_band[i] >= 0.0 and (W.guards.search_side[i] == 0.0 or W.nonnegative[i] == 1):
            n += 1
    return n > 0


@formula
def allowed_depth(W, i):
    """Depth below zero that rounding allows for a guard that must stay above zero."""
    size = max(abs(W.guards.lowest[i]), abs(W.guards.highest[i]))
    return max(
        W.guards.zero_band[i],
        START_ZERO_TOLERANCE * size,
        ROUNDING_FACTOR * W.grain[i],
        allowed_depth_factor(W, i) * -W.guards.start[i],
    )


@formula
def allowed_depth_factor(W, i):
    """Factor on the initial depth below zero that rounding allows: 1 if the guard may get no deeper.

    With a larger factor, a body that bounces below a stop would sink from bounce to bounce.
    """
    return 1.0 if W.no_deeper[i] == 1 else ROUNDING_FACTOR


GOLDEN_SECTION = 0.381966011250105
MAX_EVALUATIONS = 60  # evaluations to close a bracket, or to find an extremum
BRACKET_TOLERANCE = 1e-13  # width of a closed bracket, as a part of the step
EXTREMUM_TOLERANCE = 1e-8  # accuracy of the place of an extremum, as a part of the step
MAX_RETAKES = 80  # times that a step is repeated
JUMP_SLOPE_RATIO = 1.5  # steeper than this factor times the known slope, a guard may jump: the secant is not used
END_VALUE_FACTOR = 1e3  # factor on (time tolerance * slope): a guard below that is zero at the end
WIDTH_TOLERANCE = 1e-14  # relative accuracy of the width of a step that ends on an event


@formula
def locate_crossing(callbacks, S, W, R, c, h, i, a, b, s):
    """Find where guard i leaves side s, predicted between a and b: (status, place or -1 if it does not).

    If only the return to that side is an event, the guard must be on the other side in between. W.real.beyond is a
    place where it has not triggered yet, which is not always the start.
    """
    W.real.beyond = 0.0
    first, last = a, b
    status, fa = exact_guard(callbacks, S, W, R, c, h, a, i)
    wide = max(b - a, BRACKET_TOLERANCE)  # the interval may have zero width
    while status == 0 and not s * fa > 0.0 and a > 0.0:  # crossing earlier than predicted
        b = a
        a = max(0.0, a - wide)
        wide *= 4.0
        status, fa = exact_guard(callbacks, S, W, R, c, h, a, i)
    if status != 0:
        return status, -1.0
    if a <= 0.0 and W.nonnegative[i] == 0 and abs(fa) <= W.guards.zero_band[i]:
        fa = 0.0  # rounding: on no side
    elif a <= 0.0 and s * W.side[i] == 1.0 and s * fa <= 0.0 and -s * fa < crossing_floor(W, i, 0.0):
        status, fb = exact_guard(callbacks, S, W, R, c, h, last, i)  # the previous step ended next to it
        return status, (BRACKET_TOLERANCE if s * fb < -crossing_floor(W, i, last) else -1.0)
    if not s * fa > 0.0:  # it is not on that side at the start: perhaps for a while within, or never
        b = last
        status, a, fa = find_minimum(callbacks, S, W, R, c, h, i, max(0.0, first - (last - first)), last, -s)
        if status != 0 or not s * fa > 0.0:
            return status, -1.0
    status, fb = exact_guard(callbacks, S, W, R, c, h, b, i)
    if status != 0:
        return status, -1.0
    if s * fb > 0.0:  # it may return in between
        status, m, fm = find_minimum(callbacks, S, W, R, c, h, i, a, b, s)
        if status != 0 or s * fm > (0.0 if W.nonnegative[i] == 1 else -crossing_floor(W, i, m)):
            return status, -1.0
        if triggers(W.way[i], s):
            b, fb = m, fm
        else:
            a, fa = m, fm
    elif (
        W.nonnegative[i] == 0
        and s * fb >= -crossing_floor(W, i, b)
        and not (fb == 0.0 and s * fa > crossing_floor(W, i, a))
    ):
        return 0, -1.0  # it reaches zero without passing it
    begun = W.nonnegative[i] == 0 and abs(W.guards.start[i]) <= W.guards.zero_band[i]  # about zero, on no side
    if a > 0.0 and (begun or W.guards.start[i] * fa < 0.0):
        W.real.beyond = a
    W.real.bracket = b - a
    status, x = refine_root(callbacks, S, W, R, c, h, i, (a, fa, b, fb))
    return status, max(x, BRACKET_TOLERANCE)  # an event within rounding of the start counts too


@formula
def find_minimum(callbacks, S, W, R, c, h, i, a, b, s):
    """Minimise s times guard i between a and b, or find a place where it is not positive: (status, place, value).

    Golden section with parabolas (Brent 1973, chapter 5).
    """
    x = w = v = a + GOLDEN_SECTION * (b - a)
    status, f = exact_guard(callbacks, S, W, R, c, h, x, i)
    fx = fw = fv = s * f
    e = d = 0.0
    for _ in range(MAX_EVALUATIONS):
        if status != 0 or fx <= 0.0:
            break
        m = 0.5 * (a + b)
        tol = EXTREMUM_TOLERANCE * max(abs(x), b - a, EXTREMUM_TOLERANCE)
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
            d = GOLDEN_SECTION * e
        u = x + (d if abs(d) >= tol else (tol if d > 0.0 else -tol))
        status, f = exact_guard(callbacks, S, W, R, c, h, u, i)
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
def refine_root(callbacks, S, W, R, c, h, i, bracket):
    """Find where guard i passes zero in a bracket (a, f, b, f): (status, place). Chandrupatla (1997)."""
    x2, f2, x1, f1 = bracket  # point 1 is the newest; 1 and 2 have different signs
    x3, f3 = x2, f2
    t = 0.5
    for n in range(MAX_EVALUATIONS):
        if f1 == 0.0:
            return 0, x1
        if n == 0 and f1 != f2:
            t = f1 / (f1 - f2)
        tol = BRACKET_TOLERANCE / max(abs(x2 - x1), BRACKET_TOLERANCE)
        if tol > 0.5:
            break
        t = min(max(t, tol), 1.0 - tol)
        x = x1 + t * (x2 - x1)
        status, f = exact_guard(callbacks, S, W, R, c, h, x, i)
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
def retake_step(callbacks, S, W, R, c, h):
    """Repeat the step with width h, and store the guards at its end. Returns a status."""
    ask, own, note = callbacks[0], callbacks[1], callbacks[6]
    W.count.again += 1
    c.real.tried = h
    status = ask(own, S, W, R, c, TRY_STEP)
    if status == 0:
        note(S, W, END)
    return status


@formula
def end_step_on_event(callbacks, S, W, R, c, h, slope, i, s, between):
    """Repeat the step until it ends where guard i leaves side s, starting from width h: (status, whether it does).

    Secant method on the width; bisection where a guard jumps. ``slope``: time derivative of the guard before the event;
    ``between``: a width at which it has not left, and the original width of the step. The search fails if the guard is
    never on that side, or has not left it at the end; the dense output was misleading then.
    """
    least, most = between
    ulp = ULP * max(abs(c.real.t) + h, 1e-3 * c.real.largest)
    near = 2.0 * ulp + WIDTH_TOLERANCE * h
    low, high = least, most
    bound = False  # whether a step that ends before the event is known
    rough = stride = BRACKET_TOLERANCE * most + 4.0 * ulp
    last, before, gone = 0.0, 0.0, 1e300
    status, done = 0, False
    for n in range(MAX_RETAKES):
        status = retake_step(callbacks, S, W, R, c, h)
        f = W.guards.end[i]
        if status != 0 or f == 0.0 or done:
            break
        leap = False
        if n > 0 and h != before and (f != last or abs(h - before) > near):
            secant = (f - last) / (h - before)
            leap = f * last < 0.0 and abs(secant) > JUMP_SLOPE_RATIO * abs(slope)
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
            h = bisected_width(h, low, high, stride, bound, high < most, s * f > 0.0)
            stride *= 8.0
    f = W.guards.end[i]
    there = abs(f) <= max(END_VALUE_FACTOR * near * abs(slope), rounding_floor(W, i, 1.0))
    found = there or (not s * f > 0.0 and (not least > 0.0 or bound or done))
    return status, found


@formula
def bisected_width(h, low, high, stride, lower, upper, forward):
    """Choose a width between one before the event and one after; ``lower``, ``upper``: which of them are known."""
    if lower and upper:
        return 0.5 * (low + high)
    if forward:
        return min(h + stride, 0.5 * (h + high)) if h + stride >= high else h + stride
    return max(h - stride, 0.5 * (low + h))
