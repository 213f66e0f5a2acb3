"""Loads of joints with friction: what presses their surfaces together is their own reaction, which friction changes.

For given loads the reactions follow from one more solve with the same factor. The loads that return themselves are
found by repeated substitution with the last difference quotient of each load (Aitken, Steffensen); it converges where
friction does not outweigh what causes it. Where it does, the joint jams and there is no solution, or several.
"""

from __future__ import annotations

from .._jit import formula
from ..forces.joint_friction import load as pressed
from ..math.vec import add, load3, scale
from .loads import wide
from .records import load
from .rows import COEFFICIENT, measured
from .tables import (
    FORCE_LOAD,
    FORCE_M,
    GUILTY,
    LAM,
    LOAD,
    LOAD_BEFORE,
    RETURNED,
    RETURNED_BEFORE,
    TERM_ROW,
)

SUBSTITUTIONS = 60
CONVERGED = 1e-12  # relative
BLURRED = (
    1e-6  # where redundancy leaves a reaction open, rounding over the regularisation blurs it: good enough at rest
)


@formula
def returned(S, W):
    """Loads that follow from the reactions now in W, into row RETURNED; the largest relative change."""
    worst = 0.0
    for k in range(S.force_i.shape[0]):
        n = S.force_i[k, FORCE_LOAD]
        if n < 0:
            continue
        force = (0.0, 0.0, 0.0)
        torque = (0.0, 0.0, 0.0)
        for x in range(S.load_i.shape[0]):
            if S.load_i[x, 0] == n:
                term = S.load_i[x, 1]
                c = W.row[LAM, S.term_i[term, TERM_ROW]] * S.term_x[term, COEFFICIENT]
                force = add(force, scale(c, load3(W.T, term, 0)))
                torque = add(torque, scale(c, load3(W.T, term, 3)))
        new = pressed(wide(S.force_x, k), load(W.FK, S.force_i[k, FORCE_M]), force, torque)
        W.sensed[RETURNED, n] = new
        change = abs(new - W.sensed[LOAD, n]) / (1e-300 + abs(new) + abs(W.sensed[LOAD, n]))
        if not change <= worst:
            worst = change
            W.info[GUILTY] = k
    return worst


@formula
def improve(S, W, first):
    """Next loads: each by its own secant of (load, returned load), or by substitution the first time."""
    for n in range(2 * measured(S), W.sensed.shape[1]):
        x = W.sensed[LOAD, n]
        y = W.sensed[RETURNED, n]
        new = y
        slope = W.sensed[RETURNED_BEFORE, n] - y
        step = W.sensed[LOAD_BEFORE, n] - x
        if not first and step != 0.0 and abs(slope) < 0.9 * abs(step):
            s = slope / step
            new = (y - s * x) / (1.0 - s)
        W.sensed[LOAD_BEFORE, n] = x
        W.sensed[RETURNED_BEFORE, n] = y
        W.sensed[LOAD, n] = new if new > 0.0 else 0.0
