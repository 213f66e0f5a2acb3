"""The projection P: positions on g = 0, velocities on G v = nu, and errors on what these allow."""

from __future__ import annotations

from ..compiler.formulas import formula
from ..math.scalar import larger, magnitude
from ..tables.system import (
    DRIFT,
    MOVE,
    PLACE,
    SHOW,
    TERMS,
)
from .dispatch import row_biases, row_values
from .kinematics import motions, poses
from .made import run
from .pace import own_speed
from .rows import row_times
from .solve import REFINEMENTS, factor, reuse, solve
from .tree import rates, retract, unrated

NONE, BAUMGARTE, STEPS, STAGES, POSITIONS, VELOCITIES, PARTITIONING = range(7)
NOT_CLOSED = 2  # a status
OLD, NEAR, HERE = range(3)
PASSES = 16
TIGHT_G, TIGHT_V = 1e-15, 1e-14  # relative violations of accepted states that are left alone
METRE = 1.0  # [m] or, if less, the mechanism's length: at its own rate what slower rows are measured by
CLOSED = 1e-9  # a projection that comes to rest above this has failed, if rounding is less
LAST_DIGIT = 1e-15  # times the distance from the origin: what rounding leaves of a violation
SLOW = 0.1  # a Newton step that gains less than this wants a new factor
STALE = 10.0  # times the tolerance of the solve: a residual above this after refinement wants a new factor
FAR = 1e3  # a state this far off is given up at once


@formula
def place(S, W, t, q, z):
    """Poses, and the constraint rows as far as they follow from them: g, G, nu. ``z`` tells angles their turns."""
    W.counts.evaluations += 1
    if W.made[PLACE] != 0:
        run(W.made[PLACE], S, W, t, q, z, q, z)
    else:
        poses(S, W, q)
        row_values(S, W, t, z)


@formula
def move(S, W, t, v, z):
    """Velocities and bias accelerations at the poses in W, and what follows from them: gamma, measured rates."""
    if W.made[MOVE] != 0:
        run(W.made[MOVE], S, W, t, v, z, v, z)
    else:
        motions(S, W, v)
        row_biases(S, W, t, v, z)


@formula
def violation(W, out):
    """Largest |g| (its row goes to `W.counts.guilty_row`) and -g into ``out``."""
    worst = 0.0
    for k in range(out.shape[0]):
        g = W.rows.value[k]
        out[k] = -g
        size = magnitude(g)
        if not size <= worst:
            worst = size
            W.counts.guilty_row = k
    return worst


@formula
def show_frames(S, W, q):
    """Poses of frames as far as others look at them, where code made for the mechanism has not needed them."""
    if W.made[SHOW] != 0:
        run(W.made[SHOW], S, W, 0.0, q, q, q, q)


@formula
def rounding(S, W, q):
    """What rounding leaves of the largest violation: the last digit of the frames' distances from the origin."""
    show_frames(S, W, q)
    far = 0.0
    for f in range(W.FK.shape[0]):
        for i in range(3):
            far = max(far, magnitude(W.FK[f, i]))
    return LAST_DIGIT * far


@formula
def drift(S, W, v, out):
    """Largest |G v - nu|, the size of its largest term, and nu - G v into ``out``."""
    if W.made[DRIFT] != 0:
        worst = run(W.made[DRIFT], S, W, 0.0, v, out, v, out)
        return worst, W.flat[TERMS]
    worst = 0.0
    size = 0.0
    for k in range(out.shape[0]):
        r = W.rows.nu[k]
        for e in range(S.row_start[k], S.row_start[k + 1]):
            p = W.G[e] * v[S.column[e]]
            r -= p
            size = larger(size, magnitude(p))
        out[k] = r
        worst = larger(worst, magnitude(r))
    return worst, size


@formula
def settle(S, W, t, q, v, z, tol_g, tol_v):
    """Put q on g = 0 and v on G v = nu, in place, and leave kinematics and rows there.

    Along M^-1 G^T, or along dependent coordinates alone. Accepted states are taken down to rounding: near a singular
    position a violation e, left standing at a distance s, is a mechanism with other lengths, whose motion leaves the
    true one with the acceleration 2 e v^2 / s^3. One factor serves as long as it does.

    Returns (0 or NOT_CLOSED, the violation found relative to the mechanism's size and speed, what the factor in W is:
    OLD, of poses NEARby or of those HERE).
    """
    W.options.partitioned = 1.0 if W.options.stabilization == PARTITIONING else 0.0
    still = W.options.placed > 0.0  # nobody asks for accelerations there
    if S.rows.law.shape[0] == 0 and still and S.angles.F.shape[0] == 0:
        return 0, 0.0, OLD
    place(S, W, t, q, z)
    if S.rows.law.shape[0] == 0:
        if not still:
            move(S, W, t, v, z)
        return 0, 0.0, OLD
    status = 0
    found = 0.0
    lost = 0.0
    factored = OLD
    if W.options.stabilization != VELOCITIES:
        status, found, factored = close(S, W, t, q, z, tol_g)
        if status != 0:
            return status, found, OLD
    if W.options.stabilization != POSITIONS:
        status, lost, factored = steer(S, W, v, tol_v, factored)
        if status != 0:
            return status, found, OLD
    else:  # positions follow the violated velocities and are put back: that is no error of the step
        found = 0.0
    if not still:
        move(S, W, t, v, z)
    return 0, max(found / S.scales.length, lost), factored


@formula
def close(S, W, t, q, z, tol_g):
    """Put q on g = 0 by Newton, until |g| passes, or until it is as small as rounding lets it be.

    Kinematics and rows are those of q, before and after. Returns (status, the violation found, what the factor is).
    """
    none = W.velocities.applied
    step = W.velocities.scratch_3
    r = W.rows.scratch_2
    worst = violation(W, r)
    found = worst
    last = 1e300
    factored = OLD
    for _ in range(PASSES):
        if worst <= tol_g:
            break
        if worst > 0.7 * last and (worst <= CLOSED or worst <= rounding(S, W, q)):
            break
        if not worst <= FAR:
            return NOT_CLOSED, found, OLD
        if factored == OLD or worst > SLOW * last:
            if factor(S, W) != 0:
                return NOT_CLOSED, found, OLD
            factored = HERE
        else:
            reuse(S, W)
        last = worst
        left = solve(S, W, none, r, step, W.rows.residual, False, REFINEMENTS)
        if factored == NEAR and left > SLOW:  # too far from where it was made to serve
            if factor(S, W) != 0:
                return NOT_CLOSED, found, OLD
            solve(S, W, none, r, step, W.rows.residual, False, REFINEMENTS)
        factored = NEAR
        retract(S, q, step)
        place(S, W, t, q, z)
        worst = violation(W, r)
        W.counts.projections += 1
    if not worst <= CLOSED and not worst <= tol_g and not worst <= rounding(S, W, q):
        return NOT_CLOSED, found, OLD
    return 0, found, factored


@formula
def steer(S, W, v, tol_v, factored):
    """Put v on G v = nu. Returns (status, the violation found relative to size and speed, what the factor is)."""
    none = W.velocities.applied
    step = W.velocities.scratch_3
    r = W.rows.scratch_2
    worst, size = drift(S, W, v, r)
    if worst > tol_v * (min(METRE, S.scales.length) * S.scales.rate + size):
        if factored == NEAR:
            reuse(S, W)
        if (
            factored == OLD
            or solve(S, W, none, r, step, W.rows.residual, False, REFINEMENTS) > STALE * W.options.solve_tolerance
        ):
            if factor(S, W) != 0:
                return NOT_CLOSED, worst, OLD
            factored = HERE
            solve(S, W, none, r, step, W.rows.residual, False, REFINEMENTS)
        for d in range(step.shape[0]):
            v[d] += step[d]
    return 0, worst / (own_speed(S) + size), factored


@formula
def tangent(y, e, S, W):
    """Take from an error e of the state y, where W was last evaluated, what its projection takes: what leads off.

    Near a singular position rounding is large along what the constraints forbid, and small along what they allow.
    """
    choice = W.options.stabilization
    if S.rows.law.shape[0] == 0 or choice < STEPS or choice == PARTITIONING:
        return
    nq = S.sizes.coordinates
    way = W.velocities.applied
    if choice != VELOCITIES:
        unrated(S, y, e, way)
        stay(S, W, way)
        rates(S, y, way, e)
    if choice != POSITIONS:
        stay(S, W, e[nq : nq + way.shape[0]])


@formula
def stay(S, W, v):
    """Take from v what changes the constraints, with the factor in W."""
    r = W.rows.scratch_2
    for b in range(S.tree.parent.shape[0]):
        if S.tree.law[b] >= 0:
            v[S.tree.v[b]] = 0.0
    for k in range(r.shape[0]):
        r[k] = -row_times(S, W, k, v)
    step = W.velocities.scratch_3
    solve(S, W, W.velocities.applied, r, step, W.rows.residual, False, REFINEMENTS)
    for d in range(step.shape[0]):
        v[d] += step[d]
