"""Motion along the surface on which a law's corner lies: both sides push towards it, what is between holds it there.

The side of the corner, a number between -1 and 1, is such that du/dt = 0 (Filippov, *Differential Equations with
Discontinuous Righthand Sides*, 1988, section 4). Accelerations depend on it by one more solve; it is found by Newton's
method with Broyden's slopes, which are kept from one evaluation to the next.

Where du/dt does not follow from the sides and is zero, it is d^2u/dt^2 that they keep at zero (sliding of second order:
Levant, *International Journal of Control* 58, 1993): the switch is STEADY. Of a corner and that of its rate both
do; they bear in proportion to what they can.
"""

from __future__ import annotations

from ..compiler.formulas import formula
from ..constraints.modes import BRANCH
from ..laws.evaluation import evaluate_jet
from ..tables.system import (
    BIAS,
    OFF,
    RATE,
    STEADY,
    VALUE,
)
from .control import column_of
from .rows import measured, way_of

WHOLE = -1  # derivative along the motion
PASSES = 40
SETTLED = 1e-13  # change of a side that is none
FLAT = 1e-9


@formula
def along(S, W, s):
    """Whether the motion is held on the corner of switch s."""
    return S.switches.kind[s] == BRANCH and W.modes.mode[s] != OFF


@formula
def bound(S, W):
    """Whether the motion is held on some corner."""
    count = 0
    for s in range(S.switches.row.shape[0]):
        count += 1 if along(S, W, s) else 0
    return count > 0


@formula
def drifts(S, W, t):
    """How fast u of each corner changes, or its rate, with the accelerations at hand, into row DRIFT_OFF."""
    nr = S.rows.law.shape[0]
    nm = measured(S)
    for m in range(nm):
        a = W.sensed[BIAS, m]
        for e in range(S.row_start[nr + m], S.row_start[nr + m + 1]):
            a += W.G[e] * W.velocities.solved[S.column[e]]
        W.sensed[RATE, nm + m] = a
        W.sensed[BIAS, nm + m] = W.sensed[BIAS, m]
        W.sensed[BIAS, m] = a
    for c in range(S.control_laws.shape[0]):
        law = S.control_laws[c]
        at = column_of(S, W, c)
        W.sensed[BIAS, at] = evaluate_jet(S.code, S.const, law, W.stack, t, W.sensed, WHOLE)[1] if law >= 0 else 0.0
    for s in range(S.switches.row.shape[0]):
        if S.switches.kind[s] == BRANCH:
            law = S.switches.law[s]
            jet = evaluate_jet(S.code, S.const, law, W.stack, t, W.sensed, WHOLE)
            W.modes.drift[s] = jet[2] if W.modes.mode[s] == STEADY else jet[1]
    for m in range(nm):
        W.sensed[BIAS, m] = W.sensed[BIAS, nm + m]
        W.sensed[BIAS, nm + m] = 0.0 * W.sensed[VALUE, m]
        W.sensed[RATE, nm + m] = 0.0 * W.sensed[VALUE, m]


@formula
def settled(S, W, t, n):
    """Whether u stays zero on all corners that hold the motion; if not, their sides are moved. n counts the passes."""
    drifts(S, W, t)
    ns = S.switches.row.shape[0]
    if n > 0:
        learn(S, W)
    worst = 0.0
    for s in range(ns):
        if along(S, W, s):
            change = 0.0
            for k in range(ns):
                if along(S, W, k):
                    change += W.modes.inverse_slopes[s, k] * W.modes.drift[k]
            W.modes.moved_side[s] = change
            if not abs(change) <= worst:
                worst = abs(change)
    if worst <= SETTLED:
        return True
    for s in range(ns):
        if along(S, W, s):
            at = way_of(S, W, s)
            W.modes.previous_side[s] = W.sensed[VALUE, at]
            W.modes.previous_drift[s] = W.modes.drift[s]
            W.sensed[VALUE, at] -= W.modes.moved_side[s]
    return False


@formula
def learn(S, W):
    """Broyden's update of the inverse slopes, B += (dx - B dr) (dx^T B) / (dx^T B dr) (Broyden, 1965)."""
    ns = S.switches.row.shape[0]
    moved = 0.0
    share = 0.0
    for s in range(ns):
        W.modes.moved_side[s] = 0.0
        W.modes.given_side[s] = 0.0
    for s in range(ns):
        if along(S, W, s):
            dx = W.sensed[VALUE, way_of(S, W, s)] - W.modes.previous_side[s]
            for k in range(ns):
                if along(S, W, k):
                    b = W.modes.inverse_slopes[s, k]
                    W.modes.moved_side[s] += b * (W.modes.drift[k] - W.modes.previous_drift[k])
                    W.modes.given_side[k] += dx * b
            moved += dx * dx
            share += dx * W.modes.moved_side[s]
    if not share > FLAT * moved or moved < SETTLED * SETTLED:
        return
    for s in range(ns):
        if along(S, W, s):
            dx = W.sensed[VALUE, way_of(S, W, s)] - W.modes.previous_side[s]
            for k in range(ns):
                if along(S, W, k):
                    W.modes.inverse_slopes[s, k] += (dx - W.modes.moved_side[s]) * W.modes.given_side[k] / share
