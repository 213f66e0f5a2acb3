"""What is watched while a motion is integrated: one number for each guard, whose way through zero is an event.

    a law of the user's            its value
    a stop that is open            x - lower, upper - x
    one that is closed, a latch    way * lam: as long as it pushes
    friction that holds            most that it holds - |lam|
    friction that slides           way * rate
    a freewheel that overruns      rate
    a corner of a law              way * u; where the motion is held on u = 0: 1 - |way|
    an elastic stop that is open   -d, how far it is, or past it -(d + c ddot / k) where that is more
    one that is pressed            what it pushes with, k d + c ddot
    a place of contact             see `sliding.watched_place`
    a group that shares            see `sharing`, which is asked by itself

A guard that means nothing in the present mode is nan. Modes and ways stand in `Work` and change between steps only.
"""

from __future__ import annotations

from ..compiler.formulas import formula
from ..constraints.modes import BY_RATE, FROZEN, RATCHET, STATIC, TURN
from ..laws.evaluation import evaluate, evaluate_jet
from ..laws.opcodes import BY_TIME, SENSOR
from ..math.scalar import magnitude
from ..tables.system import (
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
)
from .control import column_of
from .dispatch import effort, kind_of
from .friction import loads_end
from .loads import law, wide
from .pace import pace, quickest
from .rows import measured, way_of
from .sliding import slides, watched_place

NOT_WATCHED = float("nan")
GRAIN = 2e-15  # of the mechanism's length, or a radian: a distance that is none
NOISE = 1e-13  # part of the fastest rate, of the strongest force, that is rounding of another
FIRM = (G_LOWER, G_UPPER, G_SLIDES, G_BACK, G_TURNS)  # of where something is, and how fast it goes
KEPT = (
    G_LOWER,
    G_UPPER,
    G_PULL,
    G_HOLDS,
    G_SLIDES,
    G_BACK,
    G_CONE,
    G_SHARED,
)  # guards above zero as long as modes are right
GRAZED = 1e-12  # of the same: an elastic stop that looks where it is by itself is pressed from there on
RESTING = 1e-9  # of the same, at the mechanism's own rate: not coming nearer
CREEP = 1e-13  # of the same: a rate that is none
OTHER = 1e-9  # of what decides a law's side: it is on the other one


@formula
def watch(S, W, t, out):
    """Value of every guard into ``out`` (ng,), kinematics, rows and solution at t being in W."""
    for g in range(S.guards.kind.shape[0]):
        kind, of = S.guards.kind[g], S.guards.of[g]
        if kind == G_LAW:
            out[g] = evaluate(S.code, S.const, of, W.stack, (t, 0.0, 0.0), W.sensed)
        else:
            out[g] = watched(S, W, t, kind, of)


@formula
def watched(S, W, t, kind, s):
    """Value of a guard of switch s."""
    if kind == G_SHARED or (W.modes.shared[s] > 0.0 and (kind == G_PULL or kind == G_HOLDS or kind == G_CONE)):
        return NOT_WATCHED
    way = W.sensed[VALUE, way_of(S, W, s)]
    if kind == G_CORNER:
        return way * corner(S, W, t, s) if W.modes.mode[s] == OFF else 1.0 - magnitude(way)
    if kind == G_PRESS_LOWER or kind == G_PRESS_UPPER:
        return pressing(S, W, s, kind, way - FROZEN)
    if kind == G_TURNS and S.switches.partner[s] < 0 and slides(S, W, s):
        m = S.switches.measured[s]
        return way * moving(S, m, W.sensed[RATE, m])
    if kind >= G_CONE:
        return watched_place(S, W, W.sensed, W.rows.multiplier, kind, s)
    m, k = S.switches.measured[s], S.switches.row[s]
    x, rate = W.sensed[VALUE, m], W.sensed[RATE, m]
    if W.modes.mode[s] == OFF:
        if kind == G_LOWER:
            return distance(S, m, x - W.modes.lower[s], rate)
        if kind == G_UPPER:
            return distance(S, m, W.modes.upper[s] - x, -rate)
        if kind == G_SLIDES:
            if way == BY_RATE:
                return NOT_WATCHED
            late = TURN * pace(S, m) if S.switches.kind[s] == RATCHET else 0.0
            return way * moving(S, m, rate) + late
        if kind == G_BACK:
            return moving(S, m, rate)
        return NOT_WATCHED
    if kind == G_PULL:
        return way * W.rows.multiplier[k]
    if kind == G_HOLDS:
        return most(S, W, t, S.switches.force[s]) - magnitude(W.rows.multiplier[k])
    return NOT_WATCHED


@formula
def moving(S, m, rate):
    """The rate of quantity m; none where that is rounding, as of what nothing moves, or what something else holds."""
    return 0.0 if magnitude(rate) <= CREEP * pace(S, m) else rate


@formula
def distance(S, m, x, rate):
    """How far quantity m is from a stop; none where that is rounding, as where it parts with no speed."""
    return 0.0 if magnitude(x) <= GRAIN * S.units[m] and rate >= -RESTING * pace(S, m) else x


@formula
def grains(S, W, t, trial, so_far, out):
    """What is rounding of every guard at the state last evaluated, into ``out`` (ng,).

    ``trial`` is scratch of the shape of ``W.sensed``, ``so_far`` the fastest rate: what was rounded of that is kept.
    """
    fastest, strongest = quickest(S, W), 0.0
    for k in range(S.rows.law.shape[0]):
        strongest = max(strongest, magnitude(W.rows.multiplier[k]))
    for g in range(S.guards.kind.shape[0]):
        kind, of = S.guards.kind[g], S.guards.of[g]
        out[g] = 0.0
        if kind == G_LOWER or kind == G_UPPER:
            m = S.switches.measured[of]
            out[g] = GRAIN * max(S.units[m], magnitude(W.sensed[VALUE, m]))
        elif kind == G_SLIDES or kind == G_BACK or (kind == G_TURNS and S.switches.partner[of] < 0):
            out[g] = max(NOISE * fastest, GRAIN * pace(S, S.switches.measured[of]))
        elif kind == G_PULL or kind == G_HOLDS or kind == G_CONE:
            out[g] = NOISE * strongest
        elif kind == G_LAW or kind == G_CORNER:
            at = of if kind == G_LAW else S.switches.law[of]
            most_of = (so_far, 1.0, strongest) if kind == G_LAW else (fastest, 0.0, strongest)
            out[g] = law_grain(S, W, t, at, trial, most_of)


@formula
def law_grain(S, W, t, at, trial, most_of):
    """By how much a law changes with the last places of what it is asked with.

    Of each by itself: what is zero by symmetry does not change as all of them do. ``most_of``: the largest rate, 1
    where rates count as no less than the mechanism's own, the largest force.
    """
    nm, first, last = measured(S), loads_end(S, W), column_of(S, W, 0)
    f = evaluate(S.code, S.const, at, W.stack, (t, 0.0, 0.0), W.sensed)
    for m in range(trial.shape[1]):
        trial[VALUE, m] = W.sensed[VALUE, m]
    total = GRAIN * magnitude(f)
    for i in range(at + 2, at + 2 + 2 * S.code[at], 2):
        m = S.code[i + 1]
        if S.code[i] != SENSOR or named_before(S, at, i):
            continue
        x, dx = W.sensed[VALUE, m], 0.0
        if m < 2 * nm:
            least = S.units[m] if m < nm else max(most_of[0], most_of[1] * pace(S, m - nm))
            dx = GRAIN * max(magnitude(x), least)
        elif m >= first and m < last:
            dx = NOISE * most_of[2]
        trial[VALUE, m] = x + dx
        g = evaluate(S.code, S.const, at, W.stack, (t, 0.0, 0.0), trial)
        if not g - g == 0.0:
            trial[VALUE, m] = x - dx
            g = evaluate(S.code, S.const, at, W.stack, (t, 0.0, 0.0), trial)
        total += magnitude(g - f) if g - g == 0.0 else 0.0
        trial[VALUE, m] = x
    return total


@formula
def named_before(S, at, i):
    """Whether what step i of the law at ``at`` reads is read by an earlier one."""
    n = 0
    for k in range(at + 2, i, 2):
        if S.code[k] == SENSOR and S.code[k + 1] == S.code[i + 1]:
            n += 1
    return n > 0


@formula
def astray(S, W, t, out):
    """How far below zero guards of laws' corners may be on the side that was taken, into ``out`` (ng,).

    Less is rounding of velocities that something holds. Farther off the side is wrong, whatever it was taken by.
    """
    fastest = -1.0
    for g in range(S.guards.kind.shape[0]):
        if S.guards.kind[g] == G_CORNER:
            fastest = quickest(S, W) if fastest < 0.0 else fastest
            s = S.guards.of[g]
            out[g] = OTHER * (terms(S, W, t, s, fastest) if W.modes.mode[s] == OFF else 1.0)


@formula
def terms(S, W, t, s, fastest):
    """Size of what the function u of a corner is the sum of: no input less than what it is told from."""
    nm, at = measured(S), S.switches.law[s]
    size = magnitude(t * evaluate_jet(S.code, S.const, at, W.stack, t, W.sensed, BY_TIME)[1])
    for i in range(at + 2, at + 2 + 2 * S.code[at], 2):
        if S.code[i] == SENSOR:
            m = S.code[i + 1]
            x = magnitude(W.sensed[VALUE, m])
            if m < nm:
                x = max(x, S.units[m])
            elif m < 2 * nm:
                x = max(x, fastest, pace(S, m - nm))
            size += x * magnitude(evaluate_jet(S.code, S.const, at, W.stack, t, W.sensed, m)[1])
    return size


@formula
def pressing(S, W, s, kind, way):
    """Of an elastic switch that is pressed at a side: what it pushes with there; of an open side: how far that is."""
    m, side = S.switches.measured[s], 1.0 if kind == G_PRESS_LOWER else -1.0
    bound = W.modes.lower[s] if kind == G_PRESS_LOWER else W.modes.upper[s]
    depth = side * (bound - W.sensed[VALUE, m])
    push = S.switch_numbers.stiffness[s] * depth - S.switch_numbers.damping[s] * side * W.sensed[RATE, m]
    told = way > -1.5  # an interpolated one is not exact; one that looks where it is by itself is far below
    if told and way * side > 0.5:
        return push
    if told and way * side < -0.5:
        return NOT_WATCHED
    if not told:  # it begins at the side, with nothing that tells where it goes
        return GRAZED * S.units[m] - depth
    # where it goes out faster than it is pushed it is open: without a jump as it leaves, so that nothing else that
    # happens there takes it for a zero
    return max(-depth, -push / S.switch_numbers.stiffness[s])


@formula
def most(S, W, t, k):
    """The most that force k holds along its quantity at rest: its own law, asked for that."""
    x = W.sensed[VALUE, S.forces.F[k]]
    load = W.sensed[RETURNED, S.forces.load[k]] if S.forces.load[k] >= 0 else 0.0
    laws = (law(S, W, k, 0, (t, x, 0.0)), 0.0, STATIC)
    return magnitude(effort(kind_of(S, k), wide(S.force_parameters, k), x, 0.0, laws, load))


@formula
def corner(S, W, t, s):
    """The function u whose sign says on which side of its corner a law is."""
    return evaluate(S.code, S.const, S.switches.law[s], W.stack, (t, 0.0 * t, 0.0 * t), W.sensed)
