"""Event functions (guards), and the distribution of indeterminate forces in a group of active constraints.

A guard is a number whose zero crossing is an event:

    a user's event expression      its value
    a switch                       a formula of `constraints.switches.switch_kind`
    a nonsmooth point of a law     direction * u; while the motion is held on u = 0: 1 - |direction|
    a contact point                see `contact_guard`

A guard without meaning in the present mode is nan. Modes and directions are in `Work` and change between steps only.

Where constraints are redundant, the multipliers are those of least squares plus any combination of ``null``, the
multipliers of self-balanced forces. A group stays active as long as some combination keeps all of its rows within their
bounds: for a sticking contact point |(t1, t2)| <= mu N, for sticking friction |lam| <= limit, for a stop or latch
direction * lam >= 0. The margin of the best combination is the guard of the group; the guards of its rows are not
evaluated.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..compiler.formulas import call, dispatch_by_kind, formula
from ..compiler.kernels import kernel
from ..compiler.struct_layout import Float1, Float2, Int1
from ..constraints.switches.switch_kind import (
    DISC,
    G_BACK,
    G_CONE,
    G_CORNER,
    G_HOLDS,
    G_LAW,
    G_LOWER,
    G_OWN,
    G_PULL,
    G_REVERSES,
    G_SHARED,
    G_SLIDES,
    G_TURNS,
    G_UPPER,
    GUARDS,
    INTERVAL,
    OFF,
    POSITION_ROUNDING,
    STATIC,
    significant_rate,
)
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
from ..tables.table_definitions import System, Work
from .calls import SOLVE, OutputBuffer
from .element_dispatch import effort, force_kind
from .loads import contact_guard, force_law, force_row, is_sliding, loads_end
from .rows import characteristic_rate, controller_column, count_measured, direction_column, largest_measured_rate

INACTIVE_GUARD = float("nan")
RELATIVE_ROUNDING = 1e-13  # relative to the fastest rate, or the largest force: rounding error of another rate or force
WRONG_SIDE = 1e-9  # relative to the terms of a corner function: beyond this the law is on the other side


@formula
def evaluate_guards(S, W, t, out):
    """Write the value of every guard to ``out`` (ng,), with the kinematics, rows and solution at t in W."""
    for g in range(S.guards.kind.shape[0]):
        kind, of = S.guards.kind[g], S.guards.of[g]
        if kind == G_LAW:
            out[g] = evaluate(S.code, S.const, of, W.stack, (t, 0.0, 0.0), W.sensed)
        else:
            out[g] = switch_guard(S, W, t, kind, of, S.guard_code[g])


guard = dispatch_by_kind(__name__, "guard", "mode, way, x, rate, force, numbers, units", GUARDS, "nan", 0)
"""Guard of a switch by its kind, or by the address of the code table of a user's kind."""


@formula
def switch_guard(S, W, t, kind, s, own):
    """Value of a guard of switch s; ``own`` is the address of the guard of a user's kind."""
    if kind == G_SHARED or (W.modes.shared[s] > 0.0 and (kind == G_PULL or kind == G_HOLDS or kind == G_CONE)):
        return INACTIVE_GUARD
    way = W.sensed.value[direction_column(S, W, s)]
    if kind == G_CORNER:
        return way * corner_value(S, W, t, s) if W.modes.mode[s] == OFF else 1.0 - magnitude(way)
    m, k = S.switches.measured[s], S.switches.row[s]
    if kind == G_TURNS and S.switches.partner[s] < 0 and is_sliding(S, W, s):
        return way * significant_rate(W.sensed.rate[m], characteristic_rate(S, W, m))
    if kind >= G_CONE:
        return contact_guard(S, W, W.sensed, W.rows.multiplier, kind, s)
    force = W.rows.multiplier[k] if k >= 0 else 0.0
    limited = (kind == G_HOLDS or kind == G_OWN) and W.modes.mode[s] != OFF
    largest = friction_limit(S, W, t, s) if limited else 0.0
    numbers = (W.modes.lower[s], W.modes.upper[s], S.switch_numbers.stiffness[s], S.switch_numbers.damping[s], largest)
    units = S.units[m], characteristic_rate(S, W, m)
    mode, x, rate = W.modes.mode[s], W.sensed.value[m], W.sensed.rate[m]
    return guard(own if kind == G_OWN else kind, mode, way, x, rate, force, numbers, units)


@formula
def guard_rounding(S, W, t, trial, so_far, out):
    """Write the rounding error of every guard at the state last evaluated to ``out`` (ng,).

    ``trial`` is scratch of the shape of ``W.sensed``; ``so_far`` is the largest rate so far, whose rounding errors
    persist. Multipliers are compared as forces.
    """
    fastest, strongest = largest_measured_rate(S, W), 0.0
    for k in range(S.rows.law.shape[0]):
        strongest = max(strongest, magnitude(W.rows.multiplier[k]) / S.row_levers[k])
    for g in range(S.guards.kind.shape[0]):
        kind, of = S.guards.kind[g], S.guards.of[g]
        out[g] = 0.0
        if kind == G_LOWER or kind == G_UPPER:
            m = S.switches.measured[of]
            out[g] = POSITION_ROUNDING * max(S.units[m], magnitude(W.sensed.value[m]))
        elif (
            kind == G_SLIDES or kind == G_REVERSES or kind == G_BACK or (kind == G_TURNS and S.switches.partner[of] < 0)
        ):
            m = S.switches.measured[of]
            out[g] = max(RELATIVE_ROUNDING * fastest * S.units[m], POSITION_ROUNDING * characteristic_rate(S, W, m))
        elif kind == G_PULL or kind == G_HOLDS or kind == G_CONE:
            k = S.switches.row[of]
            out[g] = RELATIVE_ROUNDING * strongest * S.row_levers[k] if k >= 0 else 0.0
        elif kind == G_LAW or kind == G_CORNER:
            at = of if kind == G_LAW else S.switches.law[of]
            most_of = (so_far, 1.0, strongest) if kind == G_LAW else (fastest, 0.0, strongest)
            out[g] = law_rounding(S, W, t, at, trial, most_of)


@formula
def law_rounding(S, W, t, at, trial, most_of):
    """Change of a law when its arguments change by their rounding errors.

    Each argument is varied by itself: a value that is zero by symmetry does not change if all vary together.
    ``most_of``: the largest rate relative to its unit, 1 where rates are compared at least with the characteristic
    rate, the largest force.
    """
    nm, first, last = count_measured(S), loads_end(S, W), controller_column(S, W, 0)
    f = evaluate(S.code, S.const, at, W.stack, (t, 0.0, 0.0), W.sensed)
    for m in range(trial.shape[1]):
        trial.value[m] = W.sensed.value[m]
    total = POSITION_ROUNDING * magnitude(f)
    for i in range(at + 2, at + 2 + 2 * S.code[at], 2):
        m = S.code[i + 1]
        if S.code[i] != SENSOR or sensor_repeated(S, at, i):
            continue
        x, dx = W.sensed.value[m], 0.0
        if m < 2 * nm:
            least = S.units[m] if m < nm else S.units[m - nm] * max(most_of[0], most_of[1] * W.options.rate)
            dx = POSITION_ROUNDING * max(magnitude(x), least)
        elif m >= first and m < last:
            dx = RELATIVE_ROUNDING * most_of[2]
        trial.value[m] = x + dx
        g = evaluate(S.code, S.const, at, W.stack, (t, 0.0, 0.0), trial)
        if not g - g == 0.0:
            trial.value[m] = x - dx
            g = evaluate(S.code, S.const, at, W.stack, (t, 0.0, 0.0), trial)
        total += magnitude(g - f) if g - g == 0.0 else 0.0
        trial.value[m] = x
    return total


@formula
def sensor_repeated(S, at, i):
    """Whether instruction i of the law at ``at`` reads a sensor that an earlier instruction reads."""
    n = 0
    for k in range(at + 2, i, 2):
        if S.code[k] == SENSOR and S.code[k + 1] == S.code[i + 1]:
            n += 1
    return n > 0


@formula
def corner_tolerances(S, W, t, out):
    """Write to ``out`` (ng,) how far below zero the guard of a law's corner may be on the chosen side.

    Smaller values are rounding of velocities that constraints hold. Farther off, the chosen side is wrong, however it
    was chosen.
    """
    fastest = -1.0
    for g in range(S.guards.kind.shape[0]):
        if S.guards.kind[g] == G_CORNER:
            fastest = largest_measured_rate(S, W) if fastest < 0.0 else fastest
            s = S.guards.of[g]
            out[g] = WRONG_SIDE * (corner_terms(S, W, t, s, fastest) if W.modes.mode[s] == OFF else 1.0)


@formula
def corner_terms(S, W, t, s, fastest):
    """Size of the terms of a corner function u: no input counts less than the quantity it is computed from."""
    nm, at = count_measured(S), S.switches.law[s]
    size = magnitude(t * evaluate_jet(S.code, S.const, at, W.stack, t, W.sensed, BY_TIME)[1])
    for i in range(at + 2, at + 2 + 2 * S.code[at], 2):
        if S.code[i] == SENSOR:
            m = S.code[i + 1]
            x = magnitude(W.sensed.value[m])
            if m < nm:
                x = max(x, S.units[m])
            elif m < 2 * nm:
                x = max(x, fastest * S.units[m - nm], characteristic_rate(S, W, m - nm))
            size += x * magnitude(evaluate_jet(S.code, S.const, at, W.stack, t, W.sensed, m)[1])
    return size


@formula
def friction_limit(S, W, t, s):
    """Largest force that switch s can hold: from the law of its friction at rest, or its own number."""
    k = S.switches.force[s]
    if k < 0:
        return S.switch_numbers.strength[s]
    x = W.sensed.value[S.forces.F[k]]
    load = W.sensed.returned[S.forces.load[k]] if S.forces.load[k] >= 0 else 0.0
    laws = (force_law(S, W, k, 0, (t, x, 0.0)), 0.0, STATIC)
    return magnitude(effort(force_kind(S, k), force_row(S.force_parameters, k), x, 0.0, laws, load))


@formula
def corner_value(S, W, t, s):
    """Corner function u of switch s, whose sign selects the side of the corner."""
    return evaluate(S.code, S.const, S.switches.law[s], W.stack, (t, 0.0 * t, 0.0 * t), W.sensed)


BALANCE_TOLERANCE = 1e-12  # residual of a null vector, relative to its terms
GROUP_ROUNDING = 1e-10  # rounding of the group's guard, relative to the largest force
MAX_BISECTIONS = 50  # bisections between the least-squares distribution and the best one
NO_MARGIN = float("nan")


class ForceDistribution(NamedTuple):
    """Group of active constraints with indeterminate forces; empty where ``Q.count[OPEN]`` is 0."""

    null: Float2  # (ns, nr): multipliers of self-balanced forces; the first Q.count[OPEN] rows are in use
    bend: Float2  # (ns, ns): change of the friction limit of each switch with each of them
    size: Float1  # (1,): the largest force of the group, weighted
    t: Float1  # (1,): time at which the guard is evaluated [s]
    values: Float1  # (1 + 3 ns,): the guard, its terms
    door: Int1  # (1,): address of `group_guard_kernel`, set once there is a group
    Q: ConeProgram


def empty_distribution(ns: int, nr: int) -> ForceDistribution:
    """Empty group with space for ``ns`` switches and ``nr`` rows."""
    return ForceDistribution(
        np.zeros((ns, nr)),
        np.zeros((ns, ns)),
        np.zeros(1),
        np.zeros(1),
        np.zeros(1 + 3 * ns),
        np.zeros(1, np.int64),
        allocate_cone_program(ns, ns),
    )


@formula
def fill_cell(S, W, t, G, s, c):
    """Write the bounds of switch s to cell c. Returns whether it has bounds."""
    D, k, kind = G.Q.D, G.Q.count[UNKNOWN_COUNT], S.switches.forces[s]
    row, other = S.switches.row[s], S.switches.partner[s]
    if -1 < other < s:
        return False
    for i in range(3):
        for j in range(k + 1):
            D[c, i, j] = 0.0
    if kind == DISC:
        mu, gap = S.switch_numbers.static_friction[s], S.switches.row[S.switches.other[s]]
        D[c, 0, 0], D[c, 1, 0] = mu * W.rows.multiplier[gap], W.rows.multiplier[row]
        for j in range(k):
            D[c, 0, 1 + j], D[c, 1, 1 + j] = mu * G.null[j, gap], G.null[j, row]
        if other >= 0:
            along = S.switches.row[other]
            D[c, 2, 0] = W.rows.multiplier[along]
            for j in range(k):
                D[c, 2, 1 + j] = G.null[j, along]
    elif kind == INTERVAL:
        D[c, 0, 0], D[c, 1, 0] = friction_limit(S, W, t, s), W.rows.multiplier[row]
        for j in range(k):
            D[c, 0, 1 + j], D[c, 1, 1 + j] = G.bend[j, s], G.null[j, row]
    else:
        way = W.sensed.value[direction_column(S, W, s)]
        if way == 0.0:  # holds in both directions
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
    """Write the bounds of all members of the group, from the multipliers in W."""
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
    """Margin by which the group can stay within its bounds; nan where there is no group."""
    if G.Q.count[UNKNOWN_COUNT] == 0:
        return NO_MARGIN
    fill_cells(S, W, t, G)
    return largest_margin(G.Q)


@formula
def group_terms(G, out, first):
    """Write the smooth terms of the last `group_margin` (q, a, b of every cell) to ``out``. Returns their number."""
    if G.Q.count[UNKNOWN_COUNT] == 0:
        return 0
    n = 0
    for c in range(G.Q.count[CONE_COUNT]):
        for i in range(3):
            out[first + n] = G.Q.D[c, i, 0]
            n += 1
    return n


@formula
def call_group_guard(S, W, t, G, K, out):
    """Write the group's guard, the last of the guards, to ``out``, and its terms behind it.

    The kernel is called by address, so that loops do not contain the code of all laws.
    """
    G.values[0] = NO_MARGIN
    K.count.terms = 0
    if G.Q.count[UNKNOWN_COUNT] > 0:
        G.t[0] = t
        call(G.door[0], S, W, G, K, K, 0)
    for i in range(1 + K.count.terms):
        out[K.way.shape[0] - 1 + i] = G.values[i]


@formula
def store_group_guard(S, W, G, K):
    """Store `group_margin` and `group_terms` in ``G.values``."""
    G.values[0] = group_margin(S, W, G.t[0], G)
    K.count.terms = group_terms(G, G.values, 1)
    return 0


@kernel
def group_guard_kernel(S: System, W: Work, G: ForceDistribution, K: GuardState, _: GuardState, __: int) -> int:
    """`store_group_guard` as a kernel."""
    return store_group_guard(S, W, G, K)


@formula
def update_null_vectors(address, S, W, R, engine_clock, output, G):
    """Update the null vectors to the state last evaluated: remove from each the part that is no longer balanced."""
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
    """Replace the least-squares distribution by the nearest one within all bounds, on the line to the best one."""
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
    """Whether the distribution at fraction x of the way to the best one is within all bounds."""
    for c in range(Q.count[CONE_COUNT]):
        q, a, b = cell_value(Q, c, 0, x), cell_value(Q, c, 1, x), cell_value(Q, c, 2, x)
        if not q >= sqrt(a * a + b * b):
            return False
    return True


@formula
def cell_value(Q, c, i, x):
    """Value i of cell c at fraction x of that way."""
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
