"""Guard functions within a step: their state, their values, their rounding floor.

Between the ends of a step guards are predicted without evaluating the equations: measured quantities by
polynomials of degree five through their values, rates and accelerations at the ends; quantities without a known
rate (multipliers, loads) by the polynomial through the ends and late stages. Where the stages of the step do
not confirm the prediction, the equations are evaluated on the dense output instead.

Rounding: a guard of the user's may be zero all along, as a difference of two quantities that symmetry keeps
equal; then it is rounding and has neither side nor slope. So a guard leaves its side only when it gets to the
other one by more than the rounding floor; the event is where it passed zero before. The state drifts from step
to step as the sum of so many roundings does, by the root of their number. The guard of a law's corner leaves
its side at zero, because forces are those of the other branch from there on.

The guard of a group of indeterminate contact forces is the smallest of several distances at best, a concave
function of smooth terms (bounds and forces of each cone, see `complementarity.interior_point`). It is flat
while another distance is the smallest, then has a corner, so its terms are checked with it. Between two places
it is no less than

    (1 - u) f + u g - D u (1 - u),

f, g being its values there, u in (0, 1), D = h^2 |terms''| / 2.
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from ...compiler.formulas import formula
from ...compiler.struct_layout import Float1, Float2, Float3, Int1, Int2, Record
from ...errors import ModelError
from ...math.scalar import sqrt
from ..integrators.time_loop import INTERPOLATE, INTERPOLATED, ULP

# what a guard's way means: which passing of zero is an event
FALLING, EITHER, RISING = -1, 0, 1
# rows of Watch.g: guards at the start and end of the step; of the equations within; expected within; sides in the
# making; what is zero of those that begin near it; what they were as they fired; what is rounding of them at the start
# and the end; least, largest and farthest from what is expected at stages; how far below zero they may end, nan where
# that tells nothing; their slopes at the end; then at the nodes of a panel, and where these are checked
(
    START_VALUES,
    END_VALUES,
    EXACT_VALUES,
    PREDICTED_VALUES,
    SIDES,
    ZERO_BANDS,
    TRIGGER_VALUES,
    START_ROUNDING,
    END_ROUNDING,
    LOWEST_VALUES,
    HIGHEST_VALUES,
    PREDICTION_ERRORS,
    CORNER_DEPTHS,
    END_SLOPES,
    NODE_VALUES,
) = range(15)
NODES, CHECK_NODES = 8, 2
GUARD_ROWS = NODE_VALUES + NODES + CHECK_NODES
CHECK_PLACES = (0.131, 0.567)  # places in a panel, far from those that are the same in a half of it
UNKNOWN_SIDE = 2.0  # a side that follows from the value where the next step begins
EVENT_FOUND = 6  # a status beside those of the clock: the step ends on events, told in Watch.fired


class GuardReals(Record, kind="Float"):
    """Where guards are looked for within the step."""

    subinterval: float  # begin of the panel
    width: float  # its width
    same: float  # time within which events are at the same instant
    searched_to: float  # part of the step that was looked through
    beyond: float  # where a guard that comes back is beyond zero
    bracket: float  # how far apart places are between which it passes
    drift: float  # how many roundings the state may be off by (`grains`)
    latest: float  # when the last event was
    fastest: float  # the fastest rate so far


class GuardCounts(Record, kind="Int"):
    """What was looked at."""

    stage: int  # calls of the right-hand side since the step began
    fresh: int  # whether the side of guards near zero is to be found
    steps: int  # watched
    looks: int  # places looked at
    again: int  # steps taken again
    events: int
    plain: int  # whether what is expected within the step is borne out
    exact_looks: int  # places looked at with the equations since the step was taken,
    all_exact_looks: int  # and in all
    lost: int  # whether they could not be evaluated at one
    cuts: int  # times that a step was cut since it could not be looked through
    leaves_kept_side: int  # whether a guard leaves the side that it has to keep
    terms: int  # of the last guard, that of a group: see `concave`
    short_step: int  # whether the step is so short that only rates tell of rates


class GuardState(NamedTuple):
    """What a watched integration keeps besides its clock."""

    way: Int1  # (ng,): which passing of zero is an event
    kept: Int1  # (ng,): 1 of those that are above zero by what holds now
    no_deeper: Int1  # (ng,): 1 of those that get no farther below zero by rounding than they begin
    grain: Float1  # (ng,): what is rounding of them; of those that may be anything, the less of both ends
    least: Float1  # (ng,): force that is rounding, of guards of forces; 0 of the rest
    tied: Float1  # (ng,): size of what those are of that others keep at zero; 0 of the rest
    still: Float1  # (nm,): size of rates that others keep at zero; 0 of the rest
    side: Float1  # (ng,): 1 where the guard is above zero, -1 below; as a segment begins 0 if it has just fired
    fired: Int1  # (ng,): 1 for those that the step ends on
    g: Float2  # (GUARDS, ng + terms of a group)
    polynomial: Float1  # (NODES,): a guard over a panel, in powers
    basis: Float2  # (NODES, NODES): powers from values at the nodes
    nodes: Float1  # (NODES + CHECKS,): places in a panel
    checks: Float2  # (CHECKS, NODES): the polynomial through the nodes where it is checked
    real: GuardReals  # type: ignore[assignment]
    count: GuardCounts  # type: ignore[assignment]
    stages: Int1  # of a step, where levels are kept
    compared_stages: Int1  # of a step, at which guards are kept
    compared_places: Float1  # where in the step these are
    compared_values: Float2  # (met, ng + terms): guards there
    moving: Float3  # (2, 3, nm): measured quantities, rates, accelerations, at the start and the end
    levels: Float2  # (2 + stages, rows + spots): what has no known rate: multipliers, loads
    places: Float1  # (2 + stages,): where in the step these were seen
    rows: Int1  # multipliers that guards depend on
    sensed_places: Int2  # (..., 2): rows and columns of what else is sensed
    sensed: Float2  # what is expected to be sensed: values and rates in its first rows; then rates as values
    lam: Float1  # multipliers expected


@lru_cache(maxsize=1)
def chebyshev_nodes() -> np.ndarray:
    """Places of a panel's nodes in it: Chebyshev's, ends included."""
    return 0.5 - 0.5 * np.cos(np.pi * np.arange(NODES) / (NODES - 1))


@lru_cache(maxsize=1)
def power_basis() -> np.ndarray:
    """What takes values at the nodes to powers of the place in the panel."""
    return np.ascontiguousarray(np.linalg.inv(np.vander(chebyshev_nodes(), increasing=True)))


@lru_cache(maxsize=1)
def check_weights() -> np.ndarray:
    """What takes values at the nodes to those of the polynomial where it is checked."""
    return np.ascontiguousarray(np.vander(CHECK_PLACES, NODES, increasing=True) @ power_basis())


def sampled_stages(c: np.ndarray, stages: int) -> tuple[list[int], list[int]]:
    """Stages of a method at which levels are kept, as evenly apart as there are, and at which guards are.

    Not the first ones, whose order is low, unless there are no others. One at least tells whether levels are what
    those kept let expect.

    Raises
    ------
    ModelError
        If a step has less than two stages between its ends.
    """
    good = [i for i in range(max(2, stages // 3), stages) if c[i] < 0.95]
    if len(good) < 2:
        good = [i for i in range(1, stages) if c[i] < 0.95]
    if len(good) < 2:
        raise ModelError(
            f"the method of integration has {len(good)} stages between the ends of a step; to find events (of limits, "
            f"friction, corners of laws) it needs two: take another method, such as rk45"
        )
    found: list[int] = []
    for x in (0.25, 0.6, 0.857):
        best = min(good, key=lambda i: (abs(c[i] - x), -i))
        if best not in found:
            found.append(best)
    others = [i for i in good if all(abs(c[i] - c[k]) > 0.03 for k in found)]
    if not others:
        others = [found.pop(1)] if len(found) > 1 else [i for i in good if i not in found][:1]
    return sorted(found, key=lambda i: c[i]), sorted({*found, *others}, key=lambda i: c[i])


def allocate_guard_state(
    way: np.ndarray,
    holding: np.ndarray,
    c: np.ndarray,
    stages: int,
    measured: int,
    rows: np.ndarray,
    spots: np.ndarray,
    expected: tuple[np.ndarray, np.ndarray],
    terms: int = 0,
) -> GuardState:
    """What a watched integration keeps, empty.

    Parameters
    ----------
    way : ndarray (ng,)
        Of the guards.
    holding : ndarray (ng,)
        1 for those that are above zero as long as what holds now is right, 2 for those of them that get no
        farther below by rounding than they begin: distances, rates.
    c : ndarray
        Where in a step a method's stages are.
    stages : int
        How many stages a step has.
    measured : int
        Quantities with rates.
    rows : ndarray
        Multipliers that guards depend on.
    spots : ndarray (..., 2)
        Rows and columns of what else is sensed.
    expected : tuple of ndarray
        Where expected values of what is sensed, and of multipliers, are written.
    terms : int, optional
        Room for terms of the guard of a group.
    """
    ng, real = len(way), GuardReals.blank()
    real.latest = -np.inf
    kept, met = (np.array(x, np.int64) for x in sampled_stages(c, stages))
    spots = np.asarray(spots, np.int64).reshape(-1, 2)
    g = np.full((GUARD_ROWS, ng + terms), np.nan)
    g[START_ROUNDING : END_ROUNDING + 1] = 0.0
    return GuardState(
        way=np.array(way, np.int64),
        kept=(np.asarray(holding) > 0).astype(np.int64),
        no_deeper=(np.asarray(holding) > 1).astype(np.int64),
        grain=np.zeros(ng),
        least=np.zeros(ng),
        tied=np.zeros(ng),
        still=np.zeros(measured),
        side=np.full(ng, UNKNOWN_SIDE),
        fired=np.zeros(ng, np.int64),
        g=g,
        polynomial=np.zeros(NODES),
        basis=power_basis(),
        nodes=np.r_[chebyshev_nodes(), CHECK_PLACES],
        checks=check_weights(),
        real=real,
        count=GuardCounts.blank(),
        stages=kept,
        compared_stages=met,
        compared_places=c[met],
        compared_values=np.full((len(met), ng + terms), np.nan),
        moving=np.zeros((2, 3, measured)),
        levels=np.zeros((2 + len(kept), len(rows) + len(spots))),
        places=np.r_[0.0, c[kept], 1.0],
        rows=np.array(rows, np.int64),
        sensed_places=spots,
        sensed=expected[0],
        lam=expected[1],
    )


POLYNOMIAL_TOLERANCE = 1e-2  # part of its change over a step by which a guard may differ from what is expected
DISTANCE_TOLERANCE = 0.05  # part of its least distance from zero by which it may
SIZE_ROUNDING = 1e-9  # part of its size that is nothing
ROUNDING_FACTOR = 4.0  # times what is rounding of a guard
CURVATURE_SAFETY = 1.5  # times the second differences that are seen that there may be


@formula
def terms_confirmed(W):
    """Whether terms are as expected where stages of the step have met them."""
    if W.count.terms == 0:
        return True
    last = W.way.shape[0] - 1
    near = DISTANCE_TOLERANCE * W.g[LOWEST_VALUES, last]
    for k in range(W.count.terms):
        i = last + 1 + k
        low, high, miss = W.g[LOWEST_VALUES, i], W.g[HIGHEST_VALUES, i], W.g[PREDICTION_ERRORS, i]
        if (
            miss
            > max(near, POLYNOMIAL_TOLERANCE * (high - low))
            + SIZE_ROUNDING * max(abs(low), abs(high))
            + ROUNDING_FACTOR * W.grain[last]
        ):
            return False
    return True


@formula
def group_may_dip(W):
    """Whether the guard may dip below zero between two nodes of a panel, or its terms are not resolved there."""
    last, n = W.way.shape[0] - 1, W.count.terms
    if n == 0:
        return False
    least = W.g[NODE_VALUES, last]
    for j in range(1, NODES + CHECK_NODES):
        least = min(least, W.g[NODE_VALUES + j, last])
    for k in range(n):
        if not is_polynomial(W, last + 1 + k, DISTANCE_TOLERANCE * least):
            return True
    for j in range(1, NODES):
        f, g = W.g[NODE_VALUES + j - 1, last], W.g[NODE_VALUES + j, last]
        if f < 0.0 or g < 0.0 or f != f or g != g:
            continue
        sag = CURVATURE_SAFETY * (W.nodes[j] - W.nodes[j - 1]) ** 2 * largest_curvature(W, j, last + 1, n)
        if sqrt(f) + sqrt(g) < sqrt(sag) and sag > ROUNDING_FACTOR * W.grain[last]:
            return True
    return False


@formula
def is_polynomial(W, i, near):
    """Whether a term is the polynomial through its values at the nodes, or as near to it as does not matter."""
    low, high = W.g[NODE_VALUES, i], W.g[NODE_VALUES, i]
    for j in range(1, NODES + CHECK_NODES):
        low, high = min(low, W.g[NODE_VALUES + j, i]), max(high, W.g[NODE_VALUES + j, i])
    allowed = (
        max(near, POLYNOMIAL_TOLERANCE * (high - low))
        + SIZE_ROUNDING * max(abs(low), abs(high))
        + ROUNDING_FACTOR * W.grain[W.way.shape[0] - 1]
    )
    for j in range(CHECK_NODES):
        f = W.g[NODE_VALUES + NODES + j, i]
        for k in range(NODES):
            f -= W.checks[j, k] * W.g[NODE_VALUES + k, i]
        if not abs(f) <= allowed:
            return False
    return True


@formula
def largest_curvature(W, j, first, n):
    """Half the most by which terms of a cell bend about the interval that ends at node j, by divided differences."""
    most = 0.0
    for c in range(first, first + n, 3):
        bend = 0.0
        for m in range(max(j, 2), min(j + 1, NODES - 1) + 1):
            here = 0.0
            for i in range(c, c + 3):
                here += abs(second_difference(W, m, i))
            bend = max(bend, here)
        most = max(most, bend)
    return most


@formula
def second_difference(W, m, i):
    """The second divided difference of column i at nodes m - 2, m - 1, m."""
    x, y, z = W.nodes[m - 2], W.nodes[m - 1], W.nodes[m]
    f, g, e = W.g[NODE_VALUES + m - 2, i], W.g[NODE_VALUES + m - 1, i], W.g[NODE_VALUES + m, i]
    return ((e - g) / (z - y) - (g - f) / (y - x)) / (z - x)


DRIFT_PER_STEP = 8.0  # grains that a step adds, as a random walk
INITIAL_DRIFT_STEPS = 16.0  # steps that it takes to stray as far as a state does that has just been made
TIME_RESOLUTION = 16.0 * ULP  # part of the largest time that is none


@formula
def note_state_drift(W, c):
    """Note how many grains the state may be off by."""
    W.real.drift = DRIFT_PER_STEP * sqrt(INITIAL_DRIFT_STEPS + c.count.accepted)


@formula
def is_law_corner(W, i):
    """Whether guard i is that of a law's corner: it is told how far it may be on the wrong side."""
    return W.g[CORNER_DEPTHS, i] == W.g[CORNER_DEPTHS, i]


@formula
def crossing_floor(W, i, x):
    """By how much guard i is beyond zero at most at a part x of the step where it has not left its side."""
    return 0.0 if is_law_corner(W, i) else rounding_floor(W, i, x)


@formula
def rounding_floor(W, i, x):
    """What is rounding of guard i at a part x of the step."""
    if W.kept[i] == 1 or is_law_corner(W, i):
        return ROUNDING_FACTOR * W.grain[i]
    return W.real.drift * ((1.0 - x) * W.g[START_ROUNDING, i] + x * W.g[END_ROUNDING, i])


@formula
def rounding_floor_with_time(W, c, i, slope, x):
    """What is no more than rounding of a guard at a part x of the step, or of time, by which it changes so fast."""
    return rounding_floor(W, i, x) + TIME_RESOLUTION * max(abs(c.real.t), c.real.largest) * abs(slope)


@formula
def side_at_start(W, i):
    """The side that guard i is on as the step begins: that which it was last on beyond rounding; 0 if that is none."""
    f = W.g[START_VALUES, i]
    if abs(f) > crossing_floor(W, i, 0.0):
        return 1.0 if f > 0.0 else -1.0
    return W.side[i] if abs(W.side[i]) == 1.0 else 0.0


@formula
def has_left_side(W, i, s, f, x):
    """Whether guard i, which was on side s, has left it where it is f: beyond zero, or at zero and was not before."""
    return s * f < -crossing_floor(W, i, x) or (
        f == 0.0 and max(s * W.g[LOWEST_VALUES, i], s * W.g[HIGHEST_VALUES, i]) > crossing_floor(W, i, x)
    )


@formula
def predict_sensed(W, x, h):
    """What is measured at a part x of the step, and its rates, to W.sensed; multipliers to W.lam."""
    n = W.moving.shape[2]
    for m in range(n):
        value, rate = quintic_hermite(W.moving, m, x, h, W.count.short_step == 1)
        W.sensed[0, m], W.sensed[1, m], W.sensed[0, n + m] = value, rate, rate
    rows = W.rows.shape[0]
    count = W.places.shape[0]
    for m in range(W.levels.shape[1]):
        write_sensed(W, m, rows, 0.0)
    for j in range(count):
        w = 1.0
        for k in range(count):
            if k != j:
                w *= (x - W.places[k]) / (W.places[j] - W.places[k])
        for m in range(W.levels.shape[1]):
            write_sensed(W, m, rows, read_sensed(W, m, rows) + w * W.levels[j, m])


@formula
def write_sensed(W, m, rows, x):
    """Write what has no known rate to where guards look for it."""
    if m < rows:
        W.lam[W.rows[m]] = x
    else:
        W.sensed[W.sensed_places[m - rows, 0], W.sensed_places[m - rows, 1]] = x


@formula
def read_sensed(W, m, rows):
    """What stands there."""
    return W.lam[W.rows[m]] if m < rows else W.sensed[W.sensed_places[m - rows, 0], W.sensed_places[m - rows, 1]]


@formula
def quintic_hermite(ends, m, x, h, brief):
    """Value and rate at a part x of the step of what has values, rates and accelerations ``ends[end, :, m]``."""
    f, u, a = ends[0, 0, m], h * ends[0, 1, m], h * h * ends[0, 2, m]
    change = ends[1, 0, m] - f
    if brief or (f == 0.0 and ends[1, 0, m] == 0.0):  # the integral of the rate's own cubic; some are rates of nothing
        change = 0.5 * (u + h * ends[1, 1, m]) + (a - h * h * ends[1, 2, m]) / 12.0
    d0 = change - u - 0.5 * a
    d1 = h * ends[1, 1, m] - u - a
    d2 = h * h * ends[1, 2, m] - a
    c3 = 10.0 * d0 - 4.0 * d1 + 0.5 * d2
    c4 = -15.0 * d0 + 7.0 * d1 - d2
    c5 = 6.0 * d0 - 3.0 * d1 + 0.5 * d2
    value = f + x * (u + x * (0.5 * a + x * (c3 + x * (c4 + x * c5))))
    return value, (u + x * (a + x * (3.0 * c3 + x * (4.0 * c4 + x * 5.0 * c5)))) / h


SHORT_STEP_FRACTION = 1e-7  # part of the time span: in steps so short there is nothing but rounding to be found


@formula
def evaluate_guards(callbacks, S, W, R, c, h, x, row):
    """Write guards at a part x of the step to a row."""
    W.count.looks += 1
    if W.count.plain == 1:
        callbacks[7](c.real.t, h, x, S, W, row)
    elif evaluate_guards_exactly(callbacks, S, W, R, c, h, x, row) != 0:
        W.count.lost = 1


@formula
def evaluate_guards_exactly(callbacks, S, W, R, c, h, x, row):
    """Write guards of the equations on the dense output at a part x of the step to a row. Returns a status."""
    ask, own, watch = callbacks[0], callbacks[1], callbacks[5]
    c.real.part = x
    if ask(own, S, W, R, c, INTERPOLATE) != 0:
        return 1
    W.count.exact_looks += 1
    W.count.all_exact_looks += 1
    return watch(c.real.t + x * h, c.y[INTERPOLATED], S, W, row)


@formula
def exact_guard(callbacks, S, W, R, c, h, x, i):
    """Guard i on the dense output at a part x of the step. Returns (status, value)."""
    if x <= 0.0:
        return 0, W.g[START_VALUES, i]
    if x >= 1.0:
        return 0, W.g[END_VALUES, i]
    if evaluate_guards_exactly(callbacks, S, W, R, c, h, x, EXACT_VALUES) != 0:
        return 1, 0.0
    return 0, W.g[EXACT_VALUES, i]


@formula
def compare_predictions(predict, S, W, t, h, span):
    """Note in W.count[PLAIN] whether guards are as expected where stages of the step have met them."""
    ng = W.way.shape[0]
    W.count.exact_looks = W.count.lost = 0
    W.count.plain = 1
    W.count.short_step = 1 if h <= SHORT_STEP_FRACTION * span else 0
    every = ng + W.count.terms
    for i in range(every):
        W.g[LOWEST_VALUES, i] = min(W.g[START_VALUES, i], W.g[END_VALUES, i])
        W.g[HIGHEST_VALUES, i] = max(W.g[START_VALUES, i], W.g[END_VALUES, i])
        W.g[PREDICTION_ERRORS, i] = 0.0
    for j in range(W.compared_stages.shape[0]):
        predict(t, h, W.compared_places[j], S, W, PREDICTED_VALUES)
        for i in range(every):
            f, g = W.compared_values[j, i], W.g[PREDICTED_VALUES, i]
            if f == g or (f != f and g != g):
                continue
            if not f - g == f - g:  # a number, and none
                W.count.plain = 0
            W.g[LOWEST_VALUES, i] = min(W.g[LOWEST_VALUES, i], f, g)
            W.g[HIGHEST_VALUES, i] = max(W.g[HIGHEST_VALUES, i], f, g)
            W.g[PREDICTION_ERRORS, i] = max(W.g[PREDICTION_ERRORS, i], abs(f - g))
    if W.count.short_step == 1:
        W.count.plain = 1
        return
    for i in range(ng):
        low, high, miss = W.g[LOWEST_VALUES, i], W.g[HIGHEST_VALUES, i], W.g[PREDICTION_ERRORS, i]
        if miss == 0.0 or miss <= POLYNOMIAL_TOLERANCE * (high - low) + SIZE_ROUNDING * max(abs(low), abs(high)) + min(
            rounding_floor(W, i, 0.0), rounding_floor(W, i, 1.0)
        ):
            continue
        if miss < DISTANCE_TOLERANCE * low or miss < -DISTANCE_TOLERANCE * high:
            continue
        W.count.plain = 0
    if not terms_confirmed(W):
        W.count.plain = 0
