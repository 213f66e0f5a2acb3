"""Event functions (guards), and the distribution of indeterminate forces in a group of active constraints.

A guard is a number whose zero crossing is an event:

    a law of the user's            its value
    a stop that is open            x - lower, upper - x
    one that is closed, a latch    direction * lam: as long as it pushes
    friction that sticks           static limit - |lam|
    friction that slides           direction * rate
    a freewheel that overruns      rate
    a corner of a law              direction * u; where the motion is held on u = 0: 1 - |direction|
    an elastic stop that is open   -d, the distance, or past it -(d + c ddot / k) where that is more
    one that is pressed            its force, k d + c ddot
    a contact point                see `contact_guard`

A guard that has no meaning in the present mode is nan. Modes and directions are in `Work` and change between steps
only.

Where constraints are redundant, multipliers are those of least squares plus any combination of ``null``, the forces
in balance by themselves. A group holds as long as some combination keeps all of its rows within their bounds: a
sticking contact point |(t1, t2)| <= mu N, sticking friction |lam| <= limit, a stop or latch direction * lam >= 0.
The margin of the best combination is the guard of the group; the guards of its rows are not evaluated.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..compiler.formulas import call, formula
from ..compiler.kernels import kernel
from ..compiler.struct_layout import Float1, Float2, Int1
from ..constraints.switch_kinds import BY_RATE, FRICTION, FROZEN, RATCHET, SLIP, STATIC, TURN
from ..laws.bytecode import BY_TIME, SENSOR, evaluate, evaluate_jet
from ..math.scalar import magnitude, sqrt
from ..numerics.complementarity.interior_point import (
    CONE_COUNT,
    UNKNOWN_COUNT,
    ConeProgram,
    allocate_cone_program,
    largest_margin,
)
from ..numerics.event_location.guards import GuardState
from ..numerics.integrators.butcher_tableaux import Tableau
from ..numerics.integrators.time_loop import StepState
from ..tables.table_definitions import (
    G_BACK,
    G_CONE,
    G_CORNER,
    G_HOLDS,
    G_LAW,
    G_LOWER,
    G_PRESS_LOWER,
    G_PRESS_UPPER,
    G_PULL,
    G_SHARED,
    G_SLIDES,
    G_TURNS,
    G_UPPER,
    OFF,
    RATE,
    RETURNED,
    VALUE,
    System,
    Work,
)
from .calls import SOLVE, OutputBuffer
from .element_dispatch import effort, force_kind
from .loads import contact_guard, force_law, force_row, is_sliding, loads_end
from .rows import characteristic_rate, controller_column, count_measured, direction_column, largest_measured_rate

INACTIVE_GUARD = float("nan")
POSITION_ROUNDING = 2e-15  # of the mechanism's length, or a radian: a distance that is none
RELATIVE_ROUNDING = 1e-13  # part of the fastest rate, of the strongest force, that is rounding of another
KINEMATIC_GUARDS = (G_LOWER, G_UPPER, G_SLIDES, G_BACK, G_TURNS)  # of where something is, and how fast it goes
MODE_GUARDS = (
    G_LOWER,
    G_UPPER,
    G_PULL,
    G_HOLDS,
    G_SLIDES,
    G_BACK,
    G_CONE,
    G_SHARED,
)  # guards above zero as long as modes are right
GRAZING_DEPTH = 1e-12  # of the same: an elastic stop that looks where it is by itself is pressed from there on
RESTING_RATE = 1e-9  # of the same, at the mechanism's own rate: not coming nearer
CREEP_RATE = 1e-13  # of the same: a rate that is none
WRONG_SIDE = 1e-9  # of what decides a law's side: it is on the other one


@formula
def evaluate_guards(S, W, t, out):
    """Value of every guard into ``out`` (ng,), kinematics, rows and solution at t being in W."""
    for g in range(S.guards.kind.shape[0]):
        kind, of = S.guards.kind[g], S.guards.of[g]
        if kind == G_LAW:
            out[g] = evaluate(S.code, S.const, of, W.stack, (t, 0.0, 0.0), W.sensed)
        else:
            out[g] = switch_guard(S, W, t, kind, of)


@formula
def switch_guard(S, W, t, kind, s):
    """Value of a guard of switch s."""
    if kind == G_SHARED or (W.modes.shared[s] > 0.0 and (kind == G_PULL or kind == G_HOLDS or kind == G_CONE)):
        return INACTIVE_GUARD
    way = W.sensed[VALUE, direction_column(S, W, s)]
    if kind == G_CORNER:
        return way * corner_value(S, W, t, s) if W.modes.mode[s] == OFF else 1.0 - magnitude(way)
    if kind == G_PRESS_LOWER or kind == G_PRESS_UPPER:
        return pressed_guard(S, W, s, kind, way - FROZEN)
    if kind == G_TURNS and S.switches.partner[s] < 0 and is_sliding(S, W, s):
        m = S.switches.measured[s]
        return way * significant_rate(S, m, W.sensed[RATE, m])
    if kind >= G_CONE:
        return contact_guard(S, W, W.sensed, W.rows.multiplier, kind, s)
    m, k = S.switches.measured[s], S.switches.row[s]
    x, rate = W.sensed[VALUE, m], W.sensed[RATE, m]
    if W.modes.mode[s] == OFF:
        if kind == G_LOWER:
            return stop_distance(S, m, x - W.modes.lower[s], rate)
        if kind == G_UPPER:
            return stop_distance(S, m, W.modes.upper[s] - x, -rate)
        if kind == G_SLIDES:
            if way == BY_RATE:
                return INACTIVE_GUARD
            late = TURN * characteristic_rate(S, m) if S.switches.kind[s] == RATCHET else 0.0
            return way * significant_rate(S, m, rate) + late
        if kind == G_BACK:
            return significant_rate(S, m, rate)
        return INACTIVE_GUARD
    if kind == G_PULL:
        return way * W.rows.multiplier[k]
    if kind == G_HOLDS:
        return friction_limit(S, W, t, S.switches.force[s]) - magnitude(W.rows.multiplier[k])
    return INACTIVE_GUARD


@formula
def significant_rate(S, m, rate):
    """The rate of quantity m; none where that is rounding, as of what nothing moves, or what something else holds."""
    return 0.0 if magnitude(rate) <= CREEP_RATE * characteristic_rate(S, m) else rate


@formula
def stop_distance(S, m, x, rate):
    """How far quantity m is from a stop; none where that is rounding, as where it parts with no speed."""
    return (
        0.0
        if magnitude(x) <= POSITION_ROUNDING * S.units[m] and rate >= -RESTING_RATE * characteristic_rate(S, m)
        else x
    )


@formula
def guard_rounding(S, W, t, trial, so_far, out):
    """What is rounding of every guard at the state last evaluated, into ``out`` (ng,).

    ``trial`` is scratch of the shape of ``W.sensed``, ``so_far`` the fastest rate: what was rounded of that is kept.
    """
    fastest, strongest = largest_measured_rate(S, W), 0.0
    for k in range(S.rows.law.shape[0]):
        strongest = max(strongest, magnitude(W.rows.multiplier[k]))
    for g in range(S.guards.kind.shape[0]):
        kind, of = S.guards.kind[g], S.guards.of[g]
        out[g] = 0.0
        if kind == G_LOWER or kind == G_UPPER:
            m = S.switches.measured[of]
            out[g] = POSITION_ROUNDING * max(S.units[m], magnitude(W.sensed[VALUE, m]))
        elif kind == G_SLIDES or kind == G_BACK or (kind == G_TURNS and S.switches.partner[of] < 0):
            out[g] = max(
                RELATIVE_ROUNDING * fastest, POSITION_ROUNDING * characteristic_rate(S, S.switches.measured[of])
            )
        elif kind == G_PULL or kind == G_HOLDS or kind == G_CONE:
            out[g] = RELATIVE_ROUNDING * strongest
        elif kind == G_LAW or kind == G_CORNER:
            at = of if kind == G_LAW else S.switches.law[of]
            most_of = (so_far, 1.0, strongest) if kind == G_LAW else (fastest, 0.0, strongest)
            out[g] = law_rounding(S, W, t, at, trial, most_of)


@formula
def law_rounding(S, W, t, at, trial, most_of):
    """By how much a law changes with the last places of what it is asked with.

    Of each by itself: what is zero by symmetry does not change as all of them do. ``most_of``: the largest rate, 1
    where rates count as no less than the mechanism's own, the largest force.
    """
    nm, first, last = count_measured(S), loads_end(S, W), controller_column(S, W, 0)
    f = evaluate(S.code, S.const, at, W.stack, (t, 0.0, 0.0), W.sensed)
    for m in range(trial.shape[1]):
        trial[VALUE, m] = W.sensed[VALUE, m]
    total = POSITION_ROUNDING * magnitude(f)
    for i in range(at + 2, at + 2 + 2 * S.code[at], 2):
        m = S.code[i + 1]
        if S.code[i] != SENSOR or sensor_repeated(S, at, i):
            continue
        x, dx = W.sensed[VALUE, m], 0.0
        if m < 2 * nm:
            least = S.units[m] if m < nm else max(most_of[0], most_of[1] * characteristic_rate(S, m - nm))
            dx = POSITION_ROUNDING * max(magnitude(x), least)
        elif m >= first and m < last:
            dx = RELATIVE_ROUNDING * most_of[2]
        trial[VALUE, m] = x + dx
        g = evaluate(S.code, S.const, at, W.stack, (t, 0.0, 0.0), trial)
        if not g - g == 0.0:
            trial[VALUE, m] = x - dx
            g = evaluate(S.code, S.const, at, W.stack, (t, 0.0, 0.0), trial)
        total += magnitude(g - f) if g - g == 0.0 else 0.0
        trial[VALUE, m] = x
    return total


@formula
def sensor_repeated(S, at, i):
    """Whether what step i of the law at ``at`` reads is read by an earlier one."""
    n = 0
    for k in range(at + 2, i, 2):
        if S.code[k] == SENSOR and S.code[k + 1] == S.code[i + 1]:
            n += 1
    return n > 0


@formula
def corner_tolerances(S, W, t, out):
    """How far below zero guards of laws' corners may be on the side that was taken, into ``out`` (ng,).

    Less is rounding of velocities that something holds. Farther off the side is wrong, whatever it was taken by.
    """
    fastest = -1.0
    for g in range(S.guards.kind.shape[0]):
        if S.guards.kind[g] == G_CORNER:
            fastest = largest_measured_rate(S, W) if fastest < 0.0 else fastest
            s = S.guards.of[g]
            out[g] = WRONG_SIDE * (corner_terms(S, W, t, s, fastest) if W.modes.mode[s] == OFF else 1.0)


@formula
def corner_terms(S, W, t, s, fastest):
    """Size of what the function u of a corner is the sum of: no input less than what it is told from."""
    nm, at = count_measured(S), S.switches.law[s]
    size = magnitude(t * evaluate_jet(S.code, S.const, at, W.stack, t, W.sensed, BY_TIME)[1])
    for i in range(at + 2, at + 2 + 2 * S.code[at], 2):
        if S.code[i] == SENSOR:
            m = S.code[i + 1]
            x = magnitude(W.sensed[VALUE, m])
            if m < nm:
                x = max(x, S.units[m])
            elif m < 2 * nm:
                x = max(x, fastest, characteristic_rate(S, m - nm))
            size += x * magnitude(evaluate_jet(S.code, S.const, at, W.stack, t, W.sensed, m)[1])
    return size


@formula
def pressed_guard(S, W, s, kind, direction):
    """Of an elastic switch that is pressed at a side: what it pushes with there; of an open side: how far that is."""
    m, side = S.switches.measured[s], 1.0 if kind == G_PRESS_LOWER else -1.0
    bound = W.modes.lower[s] if kind == G_PRESS_LOWER else W.modes.upper[s]
    depth = side * (bound - W.sensed[VALUE, m])
    push = S.switch_numbers.stiffness[s] * depth - S.switch_numbers.damping[s] * side * W.sensed[RATE, m]
    told = direction > -1.5  # an interpolated one is not exact; one that looks where it is by itself is far below
    if told and direction * side > 0.5:
        return push
    if told and direction * side < -0.5:
        return INACTIVE_GUARD
    if not told:  # it begins at the side, with nothing that tells where it goes
        return GRAZING_DEPTH * S.units[m] - depth
    # where it goes out faster than it is pushed it is open: without a jump as it leaves, so that nothing else that
    # happens there takes it for a zero
    return max(-depth, -push / S.switch_numbers.stiffness[s])


@formula
def friction_limit(S, W, t, k):
    """The most that force k holds along its quantity at rest: its own law, asked for that."""
    x = W.sensed[VALUE, S.forces.F[k]]
    load = W.sensed[RETURNED, S.forces.load[k]] if S.forces.load[k] >= 0 else 0.0
    laws = (force_law(S, W, k, 0, (t, x, 0.0)), 0.0, STATIC)
    return magnitude(effort(force_kind(S, k), force_row(S.force_parameters, k), x, 0.0, laws, load))


@formula
def corner_value(S, W, t, s):
    """The function u whose sign says on which side of its corner a law is."""
    return evaluate(S.code, S.const, S.switches.law[s], W.stack, (t, 0.0 * t, 0.0 * t), W.sensed)


BALANCE_TOLERANCE = 1e-12  # of its terms: what the forces of a null vector leave
GROUP_ROUNDING = 1e-10  # of the largest force: rounding of the guard
MAX_BISECTIONS = 50  # of the way from the shares of least squares to the best ones
NO_MARGIN = float("nan")


class ForceDistribution(NamedTuple):
    """The group: empty where ``Q.count[OPEN]`` is 0."""

    null: Float2  # (ns, nr): multipliers in balance by themselves, the first Q.count[OPEN] rows in use
    bend: Float2  # (ns, ns): how the most that the friction of a switch holds follows each of them
    size: Float1  # (1,): the largest force of the group, by its weight
    t: Float1  # (1,): the time at which its guard is asked for [s]
    door: Int1  # (1,): address of `group_guard_kernel`, once there is a group
    Q: ConeProgram


def empty_distribution(ns: int, nr: int) -> ForceDistribution:
    """No group, and room for one."""
    return ForceDistribution(
        np.zeros((ns, nr)),
        np.zeros((ns, ns)),
        np.zeros(1),
        np.zeros(1),
        np.zeros(1, np.int64),
        allocate_cone_program(ns, ns),
    )


@formula
def fill_cell(S, W, t, G, s, c):
    """Bounds of switch s into cell c. Returns whether it has one."""
    D, k, kind = G.Q.D, G.Q.count[UNKNOWN_COUNT], S.switches.kind[s]
    row, other = S.switches.row[s], S.switches.partner[s] if kind == SLIP else -1
    if -1 < other < s:
        return False
    for i in range(3):
        for j in range(k + 1):
            D[c, i, j] = 0.0
    if kind == SLIP:
        mu, gap = S.switch_numbers.static_friction[s], S.switches.row[S.switches.other[s]]
        D[c, 0, 0], D[c, 1, 0] = mu * W.rows.multiplier[gap], W.rows.multiplier[row]
        for j in range(k):
            D[c, 0, 1 + j], D[c, 1, 1 + j] = mu * G.null[j, gap], G.null[j, row]
        if other >= 0:
            along = S.switches.row[other]
            D[c, 2, 0] = W.rows.multiplier[along]
            for j in range(k):
                D[c, 2, 1 + j] = G.null[j, along]
    elif kind == FRICTION:
        D[c, 0, 0], D[c, 1, 0] = friction_limit(S, W, t, S.switches.force[s]), W.rows.multiplier[row]
        for j in range(k):
            D[c, 0, 1 + j], D[c, 1, 1 + j] = G.bend[j, s], G.null[j, row]
    else:
        way = W.sensed[VALUE, direction_column(S, W, s)]
        if way == 0.0:  # it holds both ways
            return False
        D[c, 0, 0] = way * W.rows.multiplier[row]
        for j in range(k):
            D[c, 0, 1 + j] = way * G.null[j, row]
    for i in range(3):
        for j in range(k + 1):
            D[c, i, j] *= W.modes.shared[s]
    return True


@formula
def fill_cells(S, W, t, G):
    """Bounds of all that is in the group, by the multipliers in W."""
    c, size = 0, 0.0
    for s in range(S.switches.row.shape[0]):
        if W.modes.shared[s] > 0.0 and fill_cell(S, W, t, G, s, c):
            for i in range(3):
                size = max(size, magnitude(G.Q.D[c, i, 0]))
            c += 1
    G.Q.count[CONE_COUNT] = c
    G.size[0] = size


@formula
def group_margin(S, W, t, G):
    """By how much the group can stay within its bounds; nan where there is none."""
    if G.Q.count[UNKNOWN_COUNT] == 0:
        return NO_MARGIN
    fill_cells(S, W, t, G)
    return largest_margin(G.Q)


@formula
def group_terms(G, out, first):
    """What `group_margin` just came from, from a place on: q, a, b of every cell, which are smooth. Returns how many."""
    if G.Q.count[UNKNOWN_COUNT] == 0:
        return 0
    n = 0
    for c in range(G.Q.count[CONE_COUNT]):
        for i in range(3):
            out[first + n] = G.Q.D[c, i, 0]
            n += 1
    return n


@formula
def call_group_guard(S, W, t, G, K, row):
    """The guard of the group by W, the last of a row of guards, and behind it its terms: row of ``K.g``, or -1 - j.

    -1 - j: place j of those within a step, ``K.met_g[j]``. Behind a door, so that loops do not contain all laws.
    """
    if G.Q.count[UNKNOWN_COUNT] > 0:
        G.t[0] = t
        call(G.door[0], S, W, G, K, K, row)
    elif row >= 0:
        K.g[row, K.way.shape[0] - 1] = NO_MARGIN
        K.count.terms = 0
    else:
        K.compared_values[-1 - row, K.way.shape[0] - 1] = NO_MARGIN
        K.count.terms = 0


@formula
def store_group_guard(S, W, G, K, row):
    """`group_margin` and `group_terms` into that row."""
    out, last = K.g[row] if row >= 0 else K.compared_values[-1 - row], K.way.shape[0] - 1
    out[last] = group_margin(S, W, G.t[0], G)
    K.count.terms = group_terms(G, out, last + 1)
    return 0


@kernel
def group_guard_kernel(S: System, W: Work, G: ForceDistribution, K: GuardState, _: GuardState, row: int) -> int:
    """`store_group_guard` behind an address."""
    return store_group_guard(S, W, G, K, row)


@formula
def update_null_vectors(address, S, W, R, engine_clock, output, G):
    """The null vectors at the state last evaluated: what is not in balance any more is taken from them."""
    out, nr = output.rows, S.rows.law.shape[0]
    for j in range(G.Q.count[UNKNOWN_COUNT]):
        terms, left = 0.0, 0.0
        for d in range(out.shape[1]):
            out[0, d] = out[1, d] = out[2, d] = 0.0
        for k in range(nr):
            if G.null[j, k] != 0.0:
                for e in range(S.row_start[k], S.row_start[k + 1]):
                    p = G.null[j, k] * W.G[e]
                    out[0, S.column[e]] += p
                    out[2, S.column[e]] += magnitude(p)
        for d in range(W.velocities.solved.shape[0]):
            left, terms = max(left, magnitude(out[0, d])), max(terms, out[2, d])
        if left > BALANCE_TOLERANCE * terms:
            call(address, S, W, R, engine_clock, output, SOLVE)
            for k in range(nr):
                G.null[j, k] += out[3, k]


@formula
def distribute_forces(S, W, t, G):
    """Put shares within all bounds in place of those of least squares: as near to these as on the way to the best."""
    if not group_margin(S, W, t, G) > 0.0:
        return
    Q, low, high = G.Q, 0.0, 1.0
    if within_bounds(Q, 0.0):
        return
    for _ in range(MAX_BISECTIONS):
        x = 0.5 * (low + high)
        if within_bounds(Q, x):
            high = x
        else:
            low = x
    for j in range(Q.count[UNKNOWN_COUNT]):
        for k in range(S.rows.law.shape[0]):
            W.rows.multiplier[k] += high * Q.y[j] * G.null[j, k]


@formula
def within_bounds(Q, x):
    """Whether shares at a part x of the way to the best are within all bounds."""
    for c in range(Q.count[CONE_COUNT]):
        q, a, b = cell_value(Q, c, 0, x), cell_value(Q, c, 1, x), cell_value(Q, c, 2, x)
        if not q >= sqrt(a * a + b * b):
            return False
    return True


@formula
def cell_value(Q, c, i, x):
    """A number of a cell there."""
    s = Q.D[c, i, 0]
    for j in range(Q.count[UNKNOWN_COUNT]):
        s += x * Q.D[c, i, 1 + j] * Q.y[j]
    return s


@kernel
def margin_kernel(S: System, W: Work, t: float, G: ForceDistribution) -> float:
    """`group_margin`, called from Python."""
    return group_margin(S, W, t, G)


@kernel
def distribute_forces_kernel(S: System, W: Work, t: float, G: ForceDistribution) -> None:
    """`distribute_forces`, called from Python."""
    distribute_forces(S, W, t, G)


@kernel
def update_null_vectors_kernel(
    address: int, S: System, W: Work, R: Tableau, engine_clock: StepState, output: OutputBuffer, G: ForceDistribution
) -> None:
    """`update_null_vectors`, called from Python."""
    update_null_vectors(address, S, W, R, engine_clock, output, G)
