"""Projection on the constraints: positions on g = 0, velocities on G v = nu, errors on the tangent space.

Coordinates of tree joints that drivers prescribe are set from their laws first. The choice of stabilisation determines
what is projected, and when (none, Baumgarte, at steps or stages, positions or velocities only, coordinate
partitioning).
"""

from __future__ import annotations

from ..compiler.formulas import formula
from ..laws.bytecode import evaluate_jet
from ..math.scalar import larger, magnitude
from ..tables.table_definitions import DRIFT, MOVE, PLACE, PREPARE, SHOW, TERMS
from .calls import call_generated
from .element_dispatch import row_biases, row_values
from .kinematics import (
    coordinate_rates,
    normalise_quaternions,
    retract,
    update_motions,
    update_poses,
    velocities_from_rates,
)
from .rows import BY_TIME, characteristic_speed, row_times
from .solve import MAX_REFINEMENTS, factor, reuse_factor, solve


@formula
def set_prescribed(S, W, t, q, v):
    """Normalise quaternions; set prescribed coordinates, velocities and accelerations from their laws."""
    if W.generated[PREPARE] != 0:
        call_generated(W.generated[PREPARE], S, W, t, q, v, q, v)
        return
    normalise_quaternions(S, q)
    for b in range(S.tree.parent.shape[0]):
        law = S.tree.law[b]
        if law >= 0:
            f, f1, f2 = evaluate_jet(S.code, S.const, law, W.stack, t, W.sensed, BY_TIME)
            q[S.tree.q[b]] = f - S.bodies.offset[b]
            v[S.tree.v[b]] = f1
            W.velocities.prescribed[S.tree.v[b]] = f2


NONE, BAUMGARTE, STEPS, STAGES, POSITIONS, VELOCITIES, PARTITIONING = range(7)
NOT_CLOSED = 2  # a status
FACTOR_OLD, FACTOR_NEAR, FACTOR_CURRENT = range(3)
MAX_PASSES = 16
TIGHT_G, TIGHT_V = 1e-15, 1e-14  # relative violations of accepted states that are not corrected
# relative to the mechanism's length: a projection that stalls above this has failed, unless rounding is larger
CLOSED_POSITIONS = 1e-9
LAST_DIGIT = 1e-15  # times the distance from the origin: rounding of a violation
# a Newton step that reduces the violation to no less than this fraction is followed by a new factorisation
SLOW_CONVERGENCE = 0.1
# times the tolerance of the solve: a residual above this after refinement requires a new factorisation
STALE_RESIDUAL = 10.0
HOPELESS_VIOLATION = 1e3  # relative to the mechanism's length: a state with a larger violation is given up at once


@formula
def update_positions(S, W, t, q, z):
    """Update poses and the position-dependent part of the rows: g, G, nu. ``z`` holds the turns of angles."""
    W.counts.evaluations += 1
    if W.generated[PLACE] != 0:
        call_generated(W.generated[PLACE], S, W, t, q, z, q, z)
    else:
        update_poses(S, W, q)
        row_values(S, W, t, z)


@formula
def update_velocities(S, W, t, v, z):
    """Update velocities and bias accelerations at the poses in W, and what follows from them: gamma, measured rates."""
    if W.generated[MOVE] != 0:
        call_generated(W.generated[MOVE], S, W, t, v, z, v, z)
    else:
        update_motions(S, W, v)
        row_biases(S, W, t, v, z)


@formula
def position_violation(S, W, out):
    """Largest |g| as a length; its row goes to `W.counts.guilty_row`, and -g to ``out``."""
    worst = 0.0
    for k in range(out.shape[0]):
        g = W.rows.value[k]
        out[k] = -g
        size = magnitude(g) * S.row_levers[k]
        if not size <= worst:
            worst = size
            W.counts.guilty_row = k
    return worst


@formula
def update_shown_frames(S, W, q):
    """Update the poses of frames that only results need, where the generated code has left them out."""
    if W.generated[SHOW] != 0:
        call_generated(W.generated[SHOW], S, W, 0.0, q, q, q, q)


@formula
def position_rounding(S, W, q):
    """Rounding of the largest violation: the last digit of the frames' distances from the origin."""
    update_shown_frames(S, W, q)
    far = 0.0
    for f in range(W.frames.shape[0]):
        for i in range(3):
            far = max(far, magnitude(W.frames.position[f, i]))
    return LAST_DIGIT * far


@formula
def velocity_violation(S, W, v, out):
    """Largest |G v - nu| and the size of its largest term, as speeds; nu - G v goes to ``out``."""
    if W.generated[DRIFT] != 0:
        worst = call_generated(W.generated[DRIFT], S, W, 0.0, v, out, v, out)
        return worst, W.flat[TERMS]
    worst = 0.0
    size = 0.0
    for k in range(out.shape[0]):
        r = W.rows.nu[k]
        largest = 0.0
        for e in range(S.row_start[k], S.row_start[k + 1]):
            p = W.G[e] * v[S.column[e]]
            r -= p
            largest = larger(largest, magnitude(p))
        out[k] = r
        size = larger(size, largest * S.row_levers[k])
        worst = larger(worst, magnitude(r) * S.row_levers[k])
    return worst, size


@formula
def project_state(S, W, t, q, v, z, tol_g, tol_v):
    """Project q on g = 0 and v on G v = nu, in place, and leave kinematics and rows there.

    The projection is along M^-1 G^T, or along dependent coordinates alone. Accepted states are projected to rounding:
    near a singular position, a violation e left at a distance s amounts to a mechanism with other lengths, whose motion
    leaves the true one with the acceleration 2 e v^2 / s^3. A factor is reused as long as it is accurate enough.

    Returns (0 or NOT_CLOSED, the violation found relative to the mechanism's size and speed, the state of the factor in
    W: FACTOR_OLD, FACTOR_NEAR (of poses near by) or FACTOR_CURRENT).
    """
    W.options.partitioned = 1.0 if W.options.stabilization == PARTITIONING else 0.0
    still = W.options.placed > 0.0  # accelerations are not needed
    if S.rows.law.shape[0] == 0 and still and S.angles.F.shape[0] == 0:
        return 0, 0.0, FACTOR_OLD
    update_positions(S, W, t, q, z)
    if S.rows.law.shape[0] == 0:
        if not still:
            update_velocities(S, W, t, v, z)
        return 0, 0.0, FACTOR_OLD
    status = 0
    found = 0.0
    lost = 0.0
    factored = FACTOR_OLD
    if W.options.stabilization != VELOCITIES:
        status, found, factored = project_positions(S, W, t, q, z, tol_g)
        if status != 0:
            return status, found, FACTOR_OLD
    if W.options.stabilization != POSITIONS:
        status, lost, factored = project_velocities(S, W, v, tol_v, factored)
        if status != 0:
            return status, found, FACTOR_OLD
    else:  # positions follow the violated velocities and are corrected: that is not an error of the step
        found = 0.0
    if not still:
        update_velocities(S, W, t, v, z)
    return 0, max(found / S.scales.length, lost), factored


@formula
def project_positions(S, W, t, q, z, tol_g):
    """Project q on g = 0 by Newton's method, until |g| passes or is as small as rounding allows.

    Kinematics and rows are those of q before and after. Returns (status, the violation found, the state of the factor).
    """
    none = W.velocities.applied
    step = W.velocities.scratch_3
    r = W.rows.scratch_2
    worst = position_violation(S, W, r)
    found = worst
    closed = CLOSED_POSITIONS * S.scales.length
    last = 1e300
    factored = FACTOR_OLD
    for _ in range(MAX_PASSES):
        if worst <= tol_g:
            break
        if worst > 0.7 * last and (worst <= closed or worst <= position_rounding(S, W, q)):
            break
        if not worst <= HOPELESS_VIOLATION * S.scales.length:
            return NOT_CLOSED, found, FACTOR_OLD
        if factored == FACTOR_OLD or worst > SLOW_CONVERGENCE * last:
            if factor(S, W) != 0:
                return NOT_CLOSED, found, FACTOR_OLD
            factored = FACTOR_CURRENT
        else:
            reuse_factor(S, W)
        last = worst
        left = solve(S, W, none, r, step, W.rows.residual, False, MAX_REFINEMENTS)
        if factored == FACTOR_NEAR and left > SLOW_CONVERGENCE:  # too far from the poses of the factor
            if factor(S, W) != 0:
                return NOT_CLOSED, found, FACTOR_OLD
            solve(S, W, none, r, step, W.rows.residual, False, MAX_REFINEMENTS)
        factored = FACTOR_NEAR
        retract(S, q, step)
        update_positions(S, W, t, q, z)
        worst = position_violation(S, W, r)
        W.counts.projections += 1
    if not worst <= closed and not worst <= tol_g and not worst <= position_rounding(S, W, q):
        return NOT_CLOSED, found, FACTOR_OLD
    return 0, found, factored


@formula
def project_velocities(S, W, v, tol_v, factored):
    """Project v on G v = nu.

    Returns (status, the violation found relative to size and speed, the state of the factor).
    """
    none = W.velocities.applied
    step = W.velocities.scratch_3
    r = W.rows.scratch_2
    worst, size = velocity_violation(S, W, v, r)
    if worst > tol_v * (characteristic_speed(S, W) + size):
        if factored == FACTOR_NEAR:
            reuse_factor(S, W)
        if (
            factored == FACTOR_OLD
            or solve(S, W, none, r, step, W.rows.residual, False, MAX_REFINEMENTS)
            > STALE_RESIDUAL * W.options.solve_tolerance
        ):
            if factor(S, W) != 0:
                return NOT_CLOSED, worst, FACTOR_OLD
            factored = FACTOR_CURRENT
            solve(S, W, none, r, step, W.rows.residual, False, MAX_REFINEMENTS)
        for d in range(step.shape[0]):
            v[d] += step[d]
    return 0, worst / (characteristic_speed(S, W) + size), factored


@formula
def add_baumgarte_terms(S, W, v):
    """Add feedback of the violations: G vdot = gamma - 2 alpha (G v - nu) - beta^2 g.

    Baumgarte 1972, *Computer Methods in Applied Mechanics and Engineering* 1, 1-16.
    """
    a = 2.0 * W.options.alpha
    b = W.options.beta * W.options.beta
    for k in range(S.rows.law.shape[0]):
        W.rows.gamma[k] -= a * (row_times(S, W, k, v) - W.rows.nu[k]) + b * W.rows.value[k]


@formula
def project_error(y, e, S, W):
    """Remove the part of an error e that the projection of the state y removes; W was last evaluated at y.

    Near a singular position rounding is large along the directions that the constraints forbid, and small along those
    that they allow.
    """
    choice = W.options.stabilization
    if S.rows.law.shape[0] == 0 or choice < STEPS or choice == PARTITIONING:
        return
    nq = S.sizes.coordinates
    way = W.velocities.applied
    if choice != VELOCITIES:
        velocities_from_rates(S, y, e, way)
        project_tangent(S, W, way)
        coordinate_rates(S, y, way, e)
    if choice != POSITIONS:
        project_tangent(S, W, e[nq : nq + way.shape[0]])


@formula
def project_tangent(S, W, v):
    """Remove from v the part that changes the constraints, with the factor in W."""
    r = W.rows.scratch_2
    for b in range(S.tree.parent.shape[0]):
        if S.tree.law[b] >= 0:
            v[S.tree.v[b]] = 0.0
    for k in range(r.shape[0]):
        r[k] = -row_times(S, W, k, v)
    step = W.velocities.scratch_3
    solve(S, W, W.velocities.applied, r, step, W.rows.residual, False, MAX_REFINEMENTS)
    for d in range(step.shape[0]):
        v[d] += step[d]
