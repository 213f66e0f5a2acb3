"""Loads of joints with friction: what presses their surfaces together is their own reaction, which friction changes.

For given loads the reactions follow from one more solve with the same factor. The loads that return themselves are
found by repeated substitution with the last difference quotient of each load (Aitken, Steffensen); it converges where
friction does not outweigh what causes it. Where it does, the joint jams and there is no solution, or several.
"""

from __future__ import annotations

from .._jit import formula
from ..forces.joint_friction import KIND
from ..forces.joint_friction import load as pressed
from ..math.vec import load3
from .loads import wide
from .records import load
from .rows import COEFFICIENT
from .tables import (
    FORCE_LOAD,
    FORCE_M,
    GUILTY,
    LAM,
    LOAD,
    LOAD_BEFORE,
    RETURNED,
    RETURNED_BEFORE,
    TERM_KINDS,
    TERM_ROW,
)

SUBSTITUTIONS = 60
CONVERGED = 1e-12  # relative


@formula
def returned(S, W):
    """Loads that follow from the reactions now in W, into row RETURNED; the largest relative change."""
    base = TERM_KINDS + 1 + KIND
    worst = 0.0
    for k in range(S.kinds[base], S.kinds[base + 1]):
        n = S.force_i[k, FORCE_LOAD]
        fx = fy = fz = tx = ty = tz = 0.0
        for x in range(S.load_i.shape[0]):
            if S.load_i[x, 0] == n:
                term = S.load_i[x, 1]
                c = W.row[LAM, S.term_i[term, TERM_ROW]] * S.term_x[term, COEFFICIENT]
                f = load3(W.T, term, 0)
                m = load3(W.T, term, 3)
                fx += c * f[0]
                fy += c * f[1]
                fz += c * f[2]
                tx += c * m[0]
                ty += c * m[1]
                tz += c * m[2]
        M = load(W.FK, S.force_i[k, FORCE_M])
        new = pressed(wide(S.force_x, k), M, (fx, fy, fz), (tx, ty, tz))
        W.load[RETURNED, n] = new
        change = abs(new - W.load[LOAD, n]) / (1e-300 + abs(new) + abs(W.load[LOAD, n]))
        if not change <= worst:
            worst = change
            W.info[GUILTY] = k
    return worst


@formula
def improve(W, first):
    """Next loads: each by its own secant of (load, returned load), or by substitution the first time."""
    for n in range(W.load.shape[1]):
        x = W.load[LOAD, n]
        y = W.load[RETURNED, n]
        new = y
        if not first:
            slope = W.load[RETURNED_BEFORE, n] - y
            step = W.load[LOAD_BEFORE, n] - x
            if step != 0.0 and abs(slope) < 0.9 * abs(step):
                s = slope / step
                new = (y - s * x) / (1.0 - s)
        W.load[LOAD_BEFORE, n] = x
        W.load[RETURNED_BEFORE, n] = y
        W.load[LOAD, n] = new if new > 0.0 else 0.0
