"""Loads of joints with friction: what presses their surfaces together is their own reaction, which friction changes.

For given loads the reactions follow from one more solve with the same factor. The loads that return themselves are
found by Newton's method. What a joint's friction returns to its own load is a sum of norms of affine functions, so it
is convex: Newton from below leads to the smallest solution, which is the one that holds. Where the slope reaches one
before that there is none: friction outweighs what causes it and the joint jams.
"""

from __future__ import annotations

from ..compiler.formulas import formula
from ..constraints.modes import STATIC
from ..forces.joint_friction import load as pressed
from ..math.scalar import sign
from ..math.vec import add
from ..tables.system import (
    GAP_BEFORE,
    INVERSE_JACOBIAN,
    LOAD,
    LOAD_BEFORE,
    MOVED,
    RETURNED,
    SLIDING,
    TOLD,
    VALUE,
)
from .dispatch import effort, kind_of
from .loads import law, wide
from .records import load
from .rows import measured, on_second
from .sliding import slides

NEWTON = 40  # steps of Newton's method, once the slopes are known
CONVERGED = 1e-12  # relative
NOTHING = 0.1  # times the largest force and CONVERGED: changes of loads below this are none
TRIAL = 0.05  # part of the way to the returned load that tells the slope
FLAT = 1e-6  # a step that changes the gap by less than this part of what was expected teaches nothing
FORGOTTEN = -1
BLURRED = 1e-6  # where redundancy leaves a reaction open, rounding over the regularisation blurs it: good enough


@formula
def loads_end(S, W):
    """Column behind those of the loads in W.sensed."""
    return 2 * measured(S) + W.sensed.shape[0] - INVERSE_JACOBIAN


@formula
def reaction_loads(S, W):
    """Loads that follow from the reactions now in W, into row RETURNED."""
    for k in range(S.forces.F.shape[0]):
        n = S.forces.load[k]
        if n < 0:
            continue
        if S.forces.family[k] == SLIDING:
            s = S.forces.switch[k]
            W.sensed[RETURNED, n] = W.rows.multiplier[S.switches.row[S.switches.other[s]]]
            if not slides(S, W, s):  # nothing follows from it
                W.sensed[LOAD, n] = W.sensed[RETURNED, n]
            continue
        o = 0.0 * W.rows.multiplier[0]
        force = (o, o, o)
        torque = (o, o, o)
        for x in range(S.load_terms.load.shape[0]):
            if S.load_terms.load[x] == n:
                f, m = on_second(S, W, S.load_terms.term[x])
                force, torque = add(force, f), add(torque, m)
        W.sensed[RETURNED, n] = pressed(wide(S.force_parameters, k), load(W.FK, S.forces.M[k]), force, torque)


@formula
def held_at_rest(S, W, k, t, arm, load):
    """The most that friction of force k, with this arm and load, holds along its quantity at rest."""
    return dry_part(S, W, k, (t, W.sensed[VALUE, S.forces.F[k]], 0.0), arm, load, STATIC)


@formula
def dry(S, W, k, t, rate, arm, load):
    """How much of it there is while it slides, without what is viscous."""
    return dry_part(S, W, k, (t, W.sensed[VALUE, S.forces.F[k]], rate), arm, load, sign(rate))


@formula
def dry_part(S, W, k, x, arm, load, way):
    """What the arm adds to the effort of force k for the inputs x = (t, value, rate) of its law."""
    par, kind = wide(S.force_parameters, k), kind_of(S, k)
    laws = (law(S, W, k, 0, x), 0.0, way)
    whole = effort(kind, (arm, *par[1:]), x[1], x[2], laws, load)
    return abs(whole - effort(kind, (0.0, *par[1:]), x[1], x[2], laws, load))


@formula
def pulled(S, n):
    """Whether load n may be negative: a place of contact pulls from where it opens to the end of the step."""
    for x in range(S.load_terms.load.shape[0]):
        if S.load_terms.load[x] == n:
            return S.load_terms.term[x] < 0
    return False


@formula
def returned(S, W):
    """Loads that follow from the reactions now in W, into row RETURNED; the largest relative change."""
    reaction_loads(S, W)
    worst = 0.0
    small = NOTHING * force_scale(S, W)
    for k in range(S.forces.F.shape[0]):
        n = S.forces.load[k]
        if n < 0:
            continue
        new = W.sensed[RETURNED, n]
        change = abs(new - W.sensed[LOAD, n]) / (small + abs(new) + abs(W.sensed[LOAD, n]))
        if not change <= worst:
            worst = change
            W.counts.guilty_row = k
    return worst


@formula
def force_scale(S, W):
    """The largest force that moves anything, or that would keep a constraint: loads far below it are rounding."""
    size = 1e-300
    for d in range(W.velocities.solved.shape[0]):
        size = max(size, abs(W.velocities.applied[d]))
    for k in range(S.rows.law.shape[0]):
        if W.rows.diagonal[k] > 0.0:
            size = max(size, abs(W.rows.gamma[k]) / W.rows.diagonal[k])
    return size


@formula
def tries(W):
    """Solves after which loads are sought once more, from none at all: one for the slope of each, then Newton's."""
    return W.sensed.shape[0] - INVERSE_JACOBIAN + NEWTON


@formula
def improve(S, W, attempt):
    """Next loads. ``attempt`` counts from 0 within one evaluation.

    Newton's method on load - returned load = 0 with Broyden's inverse Jacobian, which is learnt from a small step of
    each load by itself and kept from one evaluation to the next.
    """
    first, last = 2 * measured(S), loads_end(S, W)
    if attempt == tries(W):
        W.counts.load_updates = FORGOTTEN
        for n in range(first, last):
            W.sensed[LOAD, n] = 0.0
        return
    if W.counts.load_updates == FORGOTTEN or (attempt == 0 and W.counts.load_updates == 0):
        W.counts.load_updates = 0
        for n in range(first, last):
            for k in range(first, last):
                W.sensed[INVERSE_JACOBIAN + n - first, k] = 1.0 if n == k else 0.0
    elif attempt > 0:
        learn(W, first, last)
    for n in range(first, last):
        W.sensed[LOAD_BEFORE, n] = W.sensed[LOAD, n]
        W.sensed[GAP_BEFORE, n] = W.sensed[LOAD, n] - W.sensed[RETURNED, n]
    if W.counts.load_updates < last - first:
        n = first + W.counts.load_updates
        W.sensed[LOAD, n] -= TRIAL * W.sensed[GAP_BEFORE, n]
        W.counts.load_updates += 1
        return
    for n in range(first, last):
        new = W.sensed[LOAD, n]
        for k in range(first, last):
            new -= W.sensed[INVERSE_JACOBIAN + n - first, k] * W.sensed[GAP_BEFORE, k]
        W.sensed[LOAD, n] = new if new > 0.0 or pulled(S, n) else 0.0


@formula
def learnt(S, W):
    """Whether the slopes of all loads are known: until then the steps are small and tell nothing of convergence."""
    return W.counts.load_updates >= W.sensed.shape[0] - INVERSE_JACOBIAN


@formula
def learn(W, first, last):
    """Broyden's update B += (dx - B dr) (dx^T B) / (dx^T B dr), r = load - returned load (Broyden, 1965)."""
    moved = 0.0
    along = 0.0
    for n in range(first, last):
        W.sensed[MOVED, n] = 0.0
        W.sensed[TOLD, n] = 0.0
    for n in range(first, last):
        dx = W.sensed[LOAD, n] - W.sensed[LOAD_BEFORE, n]
        for k in range(first, last):
            b = W.sensed[INVERSE_JACOBIAN + n - first, k]
            gap = W.sensed[LOAD, k] - W.sensed[RETURNED, k]
            W.sensed[MOVED, n] += b * (gap - W.sensed[GAP_BEFORE, k])
            W.sensed[TOLD, k] += dx * b
        moved += dx * dx
        along += dx * W.sensed[MOVED, n]
    if not abs(along) > FLAT * moved:
        return
    for n in range(first, last):
        dx = W.sensed[LOAD, n] - W.sensed[LOAD_BEFORE, n]
        for k in range(first, last):
            W.sensed[INVERSE_JACOBIAN + n - first, k] += (dx - W.sensed[MOVED, n]) * W.sensed[TOLD, k] / along
