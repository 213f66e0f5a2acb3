"""Loads of joints with friction: what presses their surfaces together is their own reaction, which friction changes.

For given loads the reactions follow from one more solve with the same factor. The loads that return themselves are
found by Newton's method. What a joint's friction returns to its own load is a sum of norms of affine functions, so it
is convex: Newton from below leads to the smallest solution, which is the one that holds. Where the slope reaches one
before that there is none: friction outweighs what causes it and the joint jams.
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
    DIAGONAL,
    F_APPLIED,
    FORCE_LOAD,
    FORCE_M,
    GAMMA,
    GAP_BEFORE,
    GUILTY,
    INVERSE_JACOBIAN,
    LAM,
    LEARNT,
    LOAD,
    LOAD_BEFORE,
    MOVED,
    RETURNED,
    TERM_KINDS,
    TERM_ROW,
    TOLD,
)

SUBSTITUTIONS = 60
AGAIN = 30  # after as many, once more from no load at all
CONVERGED = 1e-12  # relative
NOTHING = 0.1  # times the largest force and CONVERGED: changes of loads below this are none
TRIAL = 0.05  # part of the way to the returned load that tells the slope
FLAT = 1e-6  # a step that changes the gap by less than this part of what was expected teaches nothing
FORGOTTEN = -1


@formula
def returned(S, W):
    """Loads that follow from the reactions now in W, into row RETURNED; the largest relative change."""
    base = TERM_KINDS + 1 + KIND
    worst = 0.0
    small = NOTHING * force_scale(S, W)
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
        change = abs(new - W.load[LOAD, n]) / (small + abs(new) + abs(W.load[LOAD, n]))
        if not change <= worst:
            worst = change
            W.info[GUILTY] = k
    return worst


@formula
def force_scale(S, W):
    """The largest force that moves anything, or that would keep a constraint: loads far below it are rounding."""
    size = 1e-300
    for d in range(W.vel.shape[1]):
        size = max(size, abs(W.vel[F_APPLIED, d]))
    for k in range(S.row_i.shape[0]):
        if W.row[DIAGONAL, k] > 0.0:
            size = max(size, abs(W.row[GAMMA, k]) / W.row[DIAGONAL, k])
    return size


@formula
def improve(W, attempt):
    """Next loads. ``attempt`` counts from 0 within one evaluation.

    Newton's method on load - returned load = 0 with Broyden's inverse Jacobian, which is learnt from a small step of
    each load by itself and kept from one evaluation to the next.
    """
    nl = W.load.shape[1]
    if attempt == AGAIN:
        for n in range(nl):
            W.load[LOAD, n] = 0.0
        W.info[LEARNT] = FORGOTTEN
        return
    if W.info[LEARNT] == FORGOTTEN or (attempt == 0 and W.info[LEARNT] == 0):
        forget(W)
    elif attempt > 0:
        learn(W)
    for n in range(nl):
        W.load[LOAD_BEFORE, n] = W.load[LOAD, n]
        W.load[GAP_BEFORE, n] = W.load[LOAD, n] - W.load[RETURNED, n]
    if W.info[LEARNT] < nl:
        n = W.info[LEARNT]
        W.load[LOAD, n] -= TRIAL * W.load[GAP_BEFORE, n]
        W.info[LEARNT] += 1
        return
    for n in range(nl):
        new = W.load[LOAD, n]
        for k in range(nl):
            new -= W.load[INVERSE_JACOBIAN + n, k] * W.load[GAP_BEFORE, k]
        W.load[LOAD, n] = new if new > 0.0 else 0.0


@formula
def forget(W):
    """Begin with the Jacobian of loads that do not answer to friction at all."""
    W.info[LEARNT] = 0
    for n in range(W.load.shape[1]):
        for k in range(W.load.shape[1]):
            W.load[INVERSE_JACOBIAN + n, k] = 1.0 if n == k else 0.0


@formula
def learn(W):
    """Broyden's update B += (dx - B dr) (dx^T B) / (dx^T B dr), r = load - returned load (Broyden, 1965)."""
    nl = W.load.shape[1]
    moved = 0.0
    along = 0.0
    for n in range(nl):
        W.load[MOVED, n] = 0.0
        W.load[TOLD, n] = 0.0
    for n in range(nl):
        dx = W.load[LOAD, n] - W.load[LOAD_BEFORE, n]
        for k in range(nl):
            gap = W.load[LOAD, k] - W.load[RETURNED, k]
            W.load[MOVED, n] += W.load[INVERSE_JACOBIAN + n, k] * (gap - W.load[GAP_BEFORE, k])
            W.load[TOLD, k] += dx * W.load[INVERSE_JACOBIAN + n, k]
        moved += dx * dx
        along += dx * W.load[MOVED, n]
    if not abs(along) > FLAT * moved:
        return
    for n in range(nl):
        dx = W.load[LOAD, n] - W.load[LOAD_BEFORE, n]
        for k in range(nl):
            W.load[INVERSE_JACOBIAN + n, k] += (dx - W.load[MOVED, n]) * W.load[TOLD, k] / along
