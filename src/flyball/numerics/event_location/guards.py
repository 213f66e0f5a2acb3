"""Guard functions within a step: their state, their values, their rounding floor.

Between the ends of a step guards are predicted without evaluating the equations. Measured quantities are
interpolated by polynomials of degree five through their values, rates and accelerations at the ends; quantities
without a known rate (multipliers, loads) by the polynomial through the ends and late stages. If the stages of the
step do not confirm the prediction, the equations are evaluated on the dense output instead.

Rounding: a guard of a user-defined event may be zero throughout, such as the difference of two quantities that
symmetry keeps equal. Its values are then rounding errors without a meaningful sign or slope. So a guard changes its
side only when it passes zero by more than the rounding floor; the event is located at the zero before that. The
rounding error of the state grows from step to step like a random walk, with the square root of the number of
steps. The guard of a nonsmooth point of a law changes side exactly at zero, because forces follow the other branch
from there on.

The guard of a group of indeterminate contact forces is the smallest of several distances, a concave function of
smooth terms (bounds and forces of each cone, see `complementarity.interior_point`). It has a corner where another
distance becomes the smallest, so its terms are checked with it. Between two places it is at least

    (1 - u) f + u g - D u (1 - u),

with f, g its values there, u in (0, 1), D = h^2 |terms''| / 2.
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from ...compiler.formulas import formula
from ...compiler.struct_layout import Column, Float1, Float2, Float3, Int1, Int2, Record
from ...errors import ModelError
from ...math.scalar import sqrt
from ..integrators.time_loop import INTERPOLATE, ULP

# direction of a guard: which sign changes are events
FALLING, EITHER, RISING = -1, 0, 1
START, END = range(2)  # of the step, in `GuardState.moving`
NODES, CHECK_NODES = 8, 2
CHECK_PLACES = (0.131, 0.567)  # places in a subinterval; halving it does not map them onto each other
UNKNOWN_SIDE = 2.0  # the side is taken from the value where the next step begins
EVENT_FOUND = 6  # status besides those of StepState: the step ends on events, marked in GuardState.fired


class GuardReals(Record, kind="Float"):
    """Real numbers of the search for events within the step."""

    subinterval: float  # start of the subinterval
    width: float  # its width
    same: float  # time within which events count as simultaneous
    searched_to: float  # part of the step that was searched
    beyond: float  # place where a guard that changes side twice is on the other side
    bracket: float  # width of the bracket of a sign change
    drift: float  # rounding error of the state in units of the rounding of one evaluation
    latest: float  # time of the last event
    fastest: float  # the fastest rate so far


class GuardCounts(Record, kind="Int"):
    """Counters and flags of the search for events."""

    stage: int  # calls of the right-hand side since the step began
    fresh: int  # whether the sides of guards near zero must be determined
    steps: int  # number of steps with event detection
    looks: int  # places evaluated
    again: int  # steps repeated
    events: int
    predictions_agree: int  # whether the predictions within the step are confirmed
    exact_looks: int  # places evaluated with the equations in this step
    all_exact_looks: int  # the same in total
    lost: int  # whether the equations could not be evaluated at a place
    cuts: int  # times that a step was cut because it could not be searched completely
    leaves_required_side: int  # whether a guard leaves the side on which it must stay
    terms: int  # number of terms of the last guard, that of a group of contact forces
    short_step: int  # whether the step is so short that rates are more accurate than differences of values


class GuardValues(Record, kind="Float", vectors=True):
    """Numbers of the guards, followed by those of the terms of a group [(ng + terms,)]."""

    start: Float1  # values at the start of the step
    end: Float1
    exact: Float1  # from the equations within the step
    predicted: Float1  # within the step
    search_side: Column  # current side during the search
    zero_band: Column  # of guards that begin near zero; -1 of others
    trigger: Column  # size when they triggered
    start_rounding: Float1
    end_rounding: Float1
    lowest: Column  # smallest value at stages
    highest: Column
    prediction_error: Column  # largest there
    corner_depth: Float1  # allowed depth below zero of corners of laws; nan of other guards
    end_slope: Column


class GuardState(NamedTuple):
    """Workspace of event detection, besides the StepState."""

    way: Int1  # (ng,): direction of sign changes that are events
    nonnegative: Int1  # (ng,): 1 for guards that the active constraints keep above zero
    no_deeper: Int1  # (ng,): 1 for guards that rounding does not take farther below zero than they begin
    grain: Float1  # (ng,): rounding error of the guard; if it may have either sign, the smaller one of both ends
    least: Float1  # (ng,): rounding error of a force, for guards of forces; else 0
    tied: Float1  # (ng,): scale of guards of quantities that constraints keep at zero; else 0
    still: Float1  # (nm,): scale of rates that constraints keep at zero; else 0
    side: Float1  # (ng,): 1 above zero, -1 below; 0 at the start of a segment if the guard has just triggered
    fired: Int1  # (ng,): 1 for guards that end the step
    guards: GuardValues
    node_values: Float2  # (NODES + CHECK_NODES, ng + terms): at the nodes and check places of a subinterval
    polynomial: Float1  # (NODES,): power coefficients of a guard over a subinterval
    basis: Float2  # (NODES, NODES): power coefficients from values at the nodes
    nodes: Float1  # (NODES + CHECK_NODES,): places in a subinterval
    checks: Float2  # (CHECK_NODES, NODES): interpolation from the nodes to the check places
    real: GuardReals  # type: ignore[assignment]
    count: GuardCounts  # type: ignore[assignment]
    stages: Int1  # stages of a step at which levels are stored
    compared_stages: Int1  # stages of a step at which guards are stored
    compared_places: Float1  # their places in the step
    compared_values: Float2  # (compared stages, ng + terms): guards there
    moving: Float3  # (2, 3, nm): measured quantities, rates, accelerations, at the start and the end
    levels: Float2  # (2 + stages, rows + spots): quantities without a known rate: multipliers, loads
    places: Float1  # (2 + stages,): their places in the step
    rows: Int1  # multipliers that guards depend on
    sensed_places: Int2  # (..., 2): rows and columns of other sensed quantities
    sensed: Float2  # predicted sensed quantities: values and rates in its first rows; then rates as values
    lam: Float1  # predicted multipliers


@lru_cache(maxsize=1)
def chebyshev_nodes() -> np.ndarray:
    """Chebyshev nodes of a subinterval [0, 1], ends included."""
    return 0.5 - 0.5 * np.cos(np.pi * np.arange(NODES) / (NODES - 1))


@lru_cache(maxsize=1)
def power_basis() -> np.ndarray:
    """Matrix from values at the nodes to power coefficients."""
    return np.ascontiguousarray(np.linalg.inv(np.vander(chebyshev_nodes(), increasing=True)))


@lru_cache(maxsize=1)
def check_weights() -> np.ndarray:
    """Matrix from values at the nodes to polynomial values at the check places."""
    return np.ascontiguousarray(np.vander(CHECK_PLACES, NODES, increasing=True) @ power_basis())


def sampled_stages(c: np.ndarray, stages: int) -> tuple[list[int], list[int]]:
    """Choose the stages of a method at which levels are stored, evenly spaced, and those at which guards are compared.

    The first stages have low order and are used only if there are no others. At least one stage with compared guards
    has no stored levels, so that it tests the prediction.

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
    """Allocate the workspace of event detection.

    Parameters
    ----------
    way : ndarray (ng,)
        Directions of the guards.
    holding : ndarray (ng,)
        1 for guards that stay above zero as long as the active constraints are right; 2 for those of them that
        rounding does not take farther below zero than they begin: distances, rates.
    c : ndarray
        Places of the stages in a step.
    stages : int
        Number of stages of a step.
    measured : int
        Number of quantities with rates.
    rows : ndarray
        Multipliers that guards depend on.
    spots : ndarray (..., 2)
        Rows and columns of other sensed quantities.
    expected : tuple of ndarray
        Arrays for predicted sensed quantities and multipliers.
    terms : int, optional
        Number of terms of the guard of a group.
    """
    ng, real = len(way), GuardReals.blank()
    real.latest = -np.inf
    spots = np.asarray(spots, np.int64).reshape(-1, 2)
    guards = GuardValues.blank(ng + terms)
    guards[:] = np.nan
    guards.start_rounding = guards.end_rounding = 0.0
    return GuardState(
        **_arrays_of_guards(way, holding),
        **_arrays_of_stages(c, stages, ng + terms, len(rows) + len(spots)),
        still=np.zeros(measured),
        guards=guards,
        node_values=np.full((NODES + CHECK_NODES, ng + terms), np.nan),
        polynomial=np.zeros(NODES),
        basis=power_basis(),
        nodes=np.r_[chebyshev_nodes(), CHECK_PLACES],
        checks=check_weights(),
        real=real,
        count=GuardCounts.blank(),
        moving=np.zeros((2, 3, measured)),
        rows=np.array(rows, np.int64),
        sensed_places=spots,
        sensed=expected[0],
        lam=expected[1],
    )


def _arrays_of_guards(way: np.ndarray, holding: np.ndarray) -> dict[str, np.ndarray]:
    """Arrays of `GuardState` with one entry for each guard."""
    ng = len(way)
    return {
        "way": np.array(way, np.int64),
        "nonnegative": (np.asarray(holding) > 0).astype(np.int64),
        "no_deeper": (np.asarray(holding) > 1).astype(np.int64),
        "grain": np.zeros(ng),
        "least": np.zeros(ng),
        "tied": np.zeros(ng),
        "side": np.full(ng, UNKNOWN_SIDE),
        "fired": np.zeros(ng, np.int64),
    }


def _arrays_of_stages(c: np.ndarray, stages: int, guards: int, levels: int) -> dict[str, np.ndarray]:
    """Arrays of `GuardState` with one entry for each stage at which levels are stored or guards are compared."""
    kept, met = (np.array(x, np.int64) for x in sampled_stages(c, stages))
    return {
        "stages": kept,
        "compared_stages": met,
        "compared_places": c[met],
        "compared_values": np.full((len(met), guards), np.nan),
        "levels": np.zeros((2 + len(kept), levels)),
        "places": np.r_[0.0, c[kept], 1.0],
    }


POLYNOMIAL_TOLERANCE = 1e-2  # largest prediction error of a guard, relative to its change over a step
DISTANCE_TOLERANCE = 0.05  # the same, relative to its smallest distance from zero
SIZE_ROUNDING = 1e-9  # relative size of a guard that counts as rounding
ROUNDING_FACTOR = 4.0  # safety factor on the rounding of a guard
CURVATURE_SAFETY = 1.5  # safety factor on the second differences at the nodes


@formula
def terms_confirmed(W):
    """Whether the stages of the step confirm the predicted terms."""
    if W.count.terms == 0:
        return True
    last = W.way.shape[0] - 1
    near = DISTANCE_TOLERANCE * W.guards.lowest[last]
    for k in range(W.count.terms):
        i = last + 1 + k
        low, high, miss = W.guards.lowest[i], W.guards.highest[i], W.guards.prediction_error[i]
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
    """Whether the guard may become negative between two nodes of a subinterval, or its terms are not resolved."""
    last, n = W.way.shape[0] - 1, W.count.terms
    if n == 0:
        return False
    least = W.node_values[0, last]
    for j in range(1, NODES + CHECK_NODES):
        least = min(least, W.node_values[j, last])
    for k in range(n):
        if not is_polynomial(W, last + 1 + k, DISTANCE_TOLERANCE * least):
            return True
    for j in range(1, NODES):
        f, g = W.node_values[j - 1, last], W.node_values[j, last]
        if f < 0.0 or g < 0.0 or f != f or g != g:
            continue
        sag = CURVATURE_SAFETY * (W.nodes[j] - W.nodes[j - 1]) ** 2 * largest_curvature(W, j, last + 1, n)
        if sqrt(f) + sqrt(g) < sqrt(sag) and sag > ROUNDING_FACTOR * W.grain[last]:
            return True
    return False


@formula
def is_polynomial(W, i, near):
    """Whether the polynomial through the nodes represents a term within the tolerance."""
    low, high = W.node_values[0, i], W.node_values[0, i]
    for j in range(1, NODES + CHECK_NODES):
        low, high = min(low, W.node_values[j, i]), max(high, W.node_values[j, i])
    allowed = (
        max(near, POLYNOMIAL_TOLERANCE * (high - low))
        + SIZE_ROUNDING * max(abs(low), abs(high))
        + ROUNDING_FACTOR * W.grain[W.way.shape[0] - 1]
    )
    for j in range(CHECK_NODES):
        f = W.node_values[NODES + j, i]
        for k in range(NODES):
            f -= W.checks[j, k] * W.node_values[k, i]
        if not abs(f) <= allowed:
            return False
    return True


@formula
def largest_curvature(W, j, first, n):
    """Half the largest curvature of the terms of a cell in the interval that ends at node j, by divided differences."""
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
    """Second divided difference of column i at nodes m - 2, m - 1, m."""
    x, y, z = W.nodes[m - 2], W.nodes[m - 1], W.nodes[m]
    f, g, e = W.node_values[m - 2, i], W.node_values[m - 1, i], W.node_values[m, i]
    return ((e - g) / (z - y) - (g - f) / (y - x)) / (z - x)


DRIFT_PER_STEP = 8.0  # rounding errors that a step adds, as a random walk
INITIAL_DRIFT_STEPS = 16.0  # steps whose random walk is as large as the error of an initial state
TIME_RESOLUTION = 16.0 * ULP  # relative resolution of time


@formula
def note_state_drift(W, c):
    """Store the rounding error of the state, in units of the rounding of one evaluation."""
    W.real.drift = DRIFT_PER_STEP * sqrt(INITIAL_DRIFT_STEPS + c.count.accepted)


@formula
def is_law_corner(W, i):
    """Whether guard i is that of a nonsmooth point of a law; only these have an allowed depth (not nan)."""
    return W.guards.corner_depth[i] == W.guards.corner_depth[i]


@formula
def crossing_floor(W, i, x):
    """Largest amount by which guard i may be past zero at x without having changed side; x: fraction of the step."""
    return 0.0 if is_law_corner(W, i) else rounding_floor(W, i, x)


@formula
def rounding_floor(W, i, x):
    """Return the rounding error of guard i at a fraction x of the step."""
    if W.nonnegative[i] == 1 or is_law_corner(W, i):
        return ROUNDING_FACTOR * W.grain[i]
    return W.real.drift * ((1.0 - x) * W.guards.start_rounding[i] + x * W.guards.end_rounding[i])


@formula
def rounding_floor_with_time(W, c, i, slope, x):
    """Return the rounding error of a guard of this slope at a fraction x of the step, including that of time."""
    return rounding_floor(W, i, x) + TIME_RESOLUTION * max(abs(c.real.t), c.real.largest) * abs(slope)


@formula
def side_at_start(W, i):
    """Side of guard i at the start of the step: the last one beyond rounding; 0 if there was none."""
    f = W.guards.start[i]
    if abs(f) > crossing_floor(W, i, 0.0):
        return 1.0 if f > 0.0 else -1.0
    return W.side[i] if abs(W.side[i]) == 1.0 else 0.0


@formula
def has_left_side(W, i, s, f, x):
    """Whether guard i has left side s where its value is f: beyond rounding, or newly at zero."""
    return s * f < -crossing_floor(W, i, x) or (
        f == 0.0 and max(s * W.guards.lowest[i], s * W.guards.highest[i]) > crossing_floor(W, i, x)
    )


@formula
def predict_sensed(W, x, h):
    """Predict measured quantities and rates at a fraction x of the step in W.sensed, and multipliers in W.lam."""
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
    """Write a quantity without a known rate to the place where guards read it."""
    if m < rows:
        W.lam[W.rows[m]] = x
    else:
        W.sensed[W.sensed_places[m - rows, 0], W.sensed_places[m - rows, 1]] = x


@formula
def read_sensed(W, m, rows):
    """Read a quantity from the place where `write_sensed` writes it."""
    return W.lam[W.rows[m]] if m < rows else W.sensed[W.sensed_places[m - rows, 0], W.sensed_places[m - rows, 1]]


@formula
def quintic_hermite(ends, m, x, h, brief):
    """Interpolate from ``ends[end, :, m]`` (value, rate, acceleration): value and rate at a fraction x of the step."""
    f, u, a = ends[0, 0, m], h * ends[0, 1, m], h * h * ends[0, 2, m]
    change = ends[1, 0, m] - f
    if brief or (f == 0.0 and ends[1, 0, m] == 0.0):  # integrate the rate; it may have no value
        change = 0.5 * (u + h * ends[1, 1, m]) + (a - h * h * ends[1, 2, m]) / 12.0
    d0 = change - u - 0.5 * a
    d1 = h * ends[1, 1, m] - u - a
    d2 = h * h * ends[1, 2, m] - a
    c3 = 10.0 * d0 - 4.0 * d1 + 0.5 * d2
    c4 = -15.0 * d0 + 7.0 * d1 - d2
    c5 = 6.0 * d0 - 3.0 * d1 + 0.5 * d2
    value = f + x * (u + x * (0.5 * a + x * (c3 + x * (c4 + x * c5))))
    return value, (u + x * (a + x * (3.0 * c3 + x * (4.0 * c4 + x * 5.0 * c5)))) / h


SHORT_STEP_FRACTION = 1e-7  # part of the time span; shorter steps contain no events beyond rounding


@formula
def evaluate_guards(callbacks, S, W, R, c, h, x, out):
    """Write the guards at a fraction x of the step to a row."""
    W.count.looks += 1
    if W.count.predictions_agree == 1:
        callbacks[7](c.real.t, h, x, S, W, out)
    elif evaluate_guards_exactly(callbacks, S, W, R, c, h, x, out) != 0:
        W.count.lost = 1


@formula
def evaluate_guards_exactly(callbacks, S, W, R, c, h, x, out):
    """Write the guards from the equations on the dense output, at a fraction x, to a row. Returns a status."""
    ask, own, watch = callbacks[0], callbacks[1], callbacks[5]
    c.real.part = x
    if ask(own, S, W, R, c, INTERPOLATE) != 0:
        return 1
    W.count.exact_looks += 1
    W.count.all_exact_looks += 1
    return watch(c.real.t + x * h, c.y.interpolated, S, W, out)


@formula
def exact_guard(callbacks, S, W, R, c, h, x, i):
    """Evaluate guard i on the dense output at a fraction x of the step. Returns (status, value)."""
    if x <= 0.0:
        return 0, W.guards.start[i]
    if x >= 1.0:
        return 0, W.guards.end[i]
    if evaluate_guards_exactly(callbacks, S, W, R, c, h, x, W.guards.exact) != 0:
        return 1, 0.0
    return 0, W.guards.exact[i]


@formula
def compare_predictions(predict, S, W, t, h, span):
    """Compare predictions with the guards at stages of the step; sets W.count.predictions_agree to 1 if they agree."""
    ng = W.way.shape[0]
    W.count.exact_looks = W.count.lost = 0
    W.count.predictions_agree = 1
    W.count.short_step = 1 if h <= SHORT_STEP_FRACTION * span else 0
    every = ng + W.count.terms
    for i in range(every):
        W.guards.lowest[i] = min(W.guards.start[i], W.guards.end[i])
        W.guards.highest[i] = max(W.guards.start[i], W.guards.end[i])
        W.guards.prediction_error[i] = 0.0
    for j in range(W.compared_stages.shape[0]):
        predict(t, h, W.compared_places[j], S, W, W.guards.predicted)
        for i in range(every):
            f, g = W.compared_values[j, i], W.guards.predicted[i]
            if f == g or (f != f and g != g):
                continue
            if not f - g == f - g:  # one is finite, the other is not
                W.count.predictions_agree = 0
            W.guards.lowest[i] = min(W.guards.lowest[i], f, g)
            W.guards.highest[i] = max(W.guards.highest[i], f, g)
            W.guards.prediction_error[i] = max(W.guards.prediction_error[i], abs(f - g))
    if W.count.short_step == 1:
        W.count.predictions_agree = 1
        return
    for i in range(ng):
        low, high, miss = W.guards.lowest[i], W.guards.highest[i], W.guards.prediction_error[i]
        if miss == 0.0 or miss <= POLYNOMIAL_TOLERANCE * (high - low) + SIZE_ROUNDING * max(abs(low), abs(high)) + min(
            rounding_floor(W, i, 0.0), rounding_floor(W, i, 1.0)
        ):
            continue
        if miss < DISTANCE_TOLERANCE * low or miss < -DISTANCE_TOLERANCE * high:
            continue
        W.count.predictions_agree = 0
    if not terms_confirmed(W):
        W.count.predictions_agree = 0
