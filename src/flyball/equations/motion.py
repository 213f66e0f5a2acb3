"""The motion as an ordinary differential equation: y = (q, v, z), z being works, turned angles, places on curves.

Index 1: [M G^T; G 0] [vdot; -lam] = [f; gamma]. The constraints g = 0 and G v = nu are kept by one smooth
projection P, along M^-1 G^T or along dependent coordinates; the integrator sees f(P(y)), so its order is kept.
"""

from __future__ import annotations

from ..compiler.formulas import formula
from ..laws.call import STACK_RESERVE
from ..laws.evaluation import evaluate_jet
from ..math.scalar import atan2, cos, magnitude, sin
from ..tables.system import (
    FINISH,
    LOADS,
    REVOLUTE,
    SCHUR,
)
from .control import control
from .dispatch import progress, remember
from .friction import BLURRED, CONVERGED, improve, learnt, returned, tries
from .loads import efforts, forces, gather, inertial
from .made import run
from .partition import exchange
from .prescribed import prepare
from .projection import (
    BAUMGARTE,
    HERE,
    NEAR,
    OLD,
    STAGES,
    STALE,
    STEPS,
    TIGHT_G,
    TIGHT_V,
    drift,
    move,
    place,
    rounding,
    settle,
    show_frames,
    violation,
)
from .readings import readings
from .rows import BY_TIME, row_times
from .solve import REFINEMENTS, factor, reuse, solve
from .surfaces import PASSES, bound, settled
from .tree import rates

NOT_FINITE, JAMMED, SINGULAR = 3, 4, 5


@formula
def astray(S, W, t, q, v):
    """How far prescribed coordinates and velocities are from their laws, relative to the mechanism's size and speed.

    They come from the derivatives of the laws: where these are not the whole truth, a law jumps.
    """
    worst = 0.0
    for b in range(S.tree.parent.shape[0]):
        law = S.tree.law[b]
        if law >= 0:
            f, f1, _ = evaluate_jet(S.code, S.const, law, W.stack, t, W.sensed, BY_TIME)
            way = f - S.bodies.offset[b] - q[S.tree.q[b]]
            size = S.scales.length
            if S.tree.joint[b] == REVOLUTE:  # its whole turns are the law's own
                way = atan2(sin(way), cos(way))
                size = 0.0 * size + 1.0
            rate = magnitude(f1 - v[S.tree.v[b]]) / (size * S.scales.rate + magnitude(f1))
            worst = max(worst, magnitude(way) / size, rate)
    return worst


@formula
def accelerate(S, W, t, p, dy, factored):
    """Dy at the settled state p, whose kinematics and rows are in W; vdot and lam are left in W. Returns a status."""
    nq = S.sizes.coordinates
    nv = W.velocities.solved.shape[0]
    v = p[nq : nq + nv]
    work = dy[nq + nv :]
    if W.options.stabilization == BAUMGARTE:
        a = 2.0 * W.options.alpha
        b = W.options.beta * W.options.beta
        for k in range(S.rows.law.shape[0]):
            W.rows.gamma[k] -= a * (row_times(S, W, k, v) - W.rows.nu[k]) + b * W.rows.value[k]
    if W.options.partitioned > 0.0:  # from here on with the masses
        W.options.partitioned = 0.0
        factored = OLD
    if factored == NEAR:
        if S.sizes.solver == SCHUR:
            reuse(S, W)
        else:
            factored = OLD  # M is another one here
    for n in range(PASSES):
        status, factored = balance(S, W, t, p, work, factored)
        if status != 0:
            return status
        if not bound(S, W) or settled(S, W, t, n):
            return finish(S, W, t, p, dy)
    W.counts.status = NOT_FINITE
    return NOT_FINITE


@formula
def balance(S, W, t, p, work, factored):
    """Accelerations and multipliers into W, with the loads of joints that return themselves: (status, factored)."""
    x = W.velocities.solved
    change = 1e300
    # joints with friction need the solution to know their loads: again until these return themselves
    most = 2 * tries(W)
    for attempt in range(most):
        control(S, W, t, p[S.sizes.coordinates + W.velocities.solved.shape[0] :], work)
        loaded(S, W, t, p, work)
        if (
            factored == OLD
            or solve(S, W, W.velocities.applied, W.rows.gamma, x, W.rows.multiplier, True, REFINEMENTS)
            > STALE * W.options.solve_tolerance
        ):
            if factor(S, W) != 0:
                W.counts.status = SINGULAR
                return SINGULAR, factored
            factored = HERE
            solve(S, W, W.velocities.applied, W.rows.gamma, x, W.rows.multiplier, True, REFINEMENTS)
        if S.load_terms.load.shape[0] == 0:
            break
        last = change
        change = returned(S, W)
        if change <= CONVERGED or (change <= BLURRED and change > 0.5 * last and learnt(S, W)):
            break
        if attempt == most - 1:
            W.counts.status = JAMMED if finite(x) == 0 else NOT_FINITE
            return W.counts.status, factored
        improve(S, W, attempt)
    return 0, factored


@formula
def loaded(S, W, t, p, work):
    """Generalised forces into `W.velocities.applied`, and what accounted ones do."""
    if W.made[LOADS] != 0:
        run(W.made[LOADS], S, W, t, p, work, p, work)
        return
    inertial(S, W)
    forces(S, W, t, work)
    gather(S, W, W.velocities.applied)
    efforts(S, W, t, work, W.velocities.applied)


@formula
def finish(S, W, t, p, dy):
    """Dy at the state p from the solution in W. Returns a status."""
    nq = S.sizes.coordinates
    nv = W.velocities.solved.shape[0]
    x = W.velocities.solved
    v = p[nq : nq + nv]
    work = dy[nq + nv :]
    if W.made[FINISH] != 0:
        W.counts.status = 0 if run(W.made[FINISH], S, W, t, p, dy, x, W.rows.multiplier) == 0.0 else NOT_FINITE
        return W.counts.status
    rates(S, p, v, dy)
    for d in range(nv):
        dy[nq + d] = x[d]
    for k in range(S.rows.law.shape[0]):
        if S.rows.work[k] >= 0:
            work[S.rows.work[k]] = W.rows.multiplier[k] * W.rows.nu[k]
    for b in range(S.tree.parent.shape[0]):
        if S.tree.law[b] >= 0:
            d = S.tree.v[b]
            work[S.tree.work[b]] = W.velocities.effort[d] * v[d]
    progress(S, W, p[nq + nv :], work)
    readings(S, W, t)
    W.counts.status = finite(dy)
    return W.counts.status


@formula
def respond(S, W, f, gamma, x, lam):
    """Accelerations x and multipliers that other forces and right-hand sides of the rows make at the state in W.

    Prescribed velocities do not change; what that takes is left in `W.velocities.effort`.
    """
    for d in range(x.shape[0]):
        W.velocities.prescribed[d] = 0.0
    if solve(S, W, f, gamma, x, lam, True, REFINEMENTS) > STALE * W.options.solve_tolerance and factor(S, W) == 0:
        solve(S, W, f, gamma, x, lam, True, REFINEMENTS)


@formula
def finite(dy):
    """0, or NOT_FINITE."""
    s = 0.0
    for i in range(dy.shape[0]):
        s += (dy[i] - dy[i]).real
    return 0 if s == 0.0 else NOT_FINITE


@formula
def derivative(t, y, dy, S, W):
    """dy/dt = f(P(y)) with P the projection; ``y`` is left as it is. Returns 0 or a status."""
    nq = S.sizes.coordinates
    p = W.y[0]
    for i in range(y.shape[0]):
        p[i] = y[i]
    q = p[:nq]
    v = p[nq : nq + W.velocities.solved.shape[0]]
    z = p[nq + W.velocities.solved.shape[0] :]
    prepare(S, W, t, q, v)
    factored = OLD
    if W.options.stabilization >= STAGES:
        status, _, factored = settle(S, W, t, q, v, z, W.options.position_tolerance, W.options.velocity_tolerance)
        if status != 0:
            W.counts.status = status
            return status
    else:
        place(S, W, t, q, z)
        move(S, W, t, v, z)
    return accelerate(S, W, t, p, dy, factored)


@formula
def arrive(t, y, dy, S, W):
    """Project the state y in place, to rounding, and evaluate there. Returns (0 or status, relative violation)."""
    nq = S.sizes.coordinates
    q = y[:nq]
    v = y[nq : nq + W.velocities.solved.shape[0]]
    z = y[nq + W.velocities.solved.shape[0] :]
    astray_by = astray(S, W, t, q, v)
    found = 0.0
    factored = OLD
    fault = W.stack.shape[0] - STACK_RESERVE
    if W.stack[fault, 0].real > 0.0:  # overcome: the step that met it was taken again, shorter
        W.stack[fault, 0] = -W.stack[fault, 0]
    prepare(S, W, t, q, v)
    if W.options.stabilization >= STEPS:
        status, found, factored = settle(S, W, t, q, v, z, TIGHT_G * S.scales.length, TIGHT_V)
        if status != 0:
            W.counts.status = status
            return status, found
        found = max(0.0, found - rounding(S, W, q) / S.scales.length)
        if W.options.partitioned > 0.0:
            exchange(S, W)
    else:
        place(S, W, t, q, z)
        move(S, W, t, v, z)
        show_frames(S, W, q)
    remember(S, W, z)
    if W.options.placed > 0.0:
        return 0, max(found, astray_by)
    return accelerate(S, W, t, y, dy, factored), max(found, astray_by)


@formula
def report(t, y, out, S, W):
    """Write t, the state (projected first), vdot and lam to a row of the output.

    Where accelerations are deferred vdot and lam stay open.
    """
    W.options.placed = W.options.deferred
    status, _ = arrive(t, y, W.y[1], S, W)
    W.options.placed = 0.0
    write_row(t, y, out, S, W)
    return status


@formula
def write_row(t, y, out, S, W):
    """Write t, the state y that W was last evaluated at, vdot, lam and the efforts of prescribed coordinates."""
    nq = S.sizes.coordinates
    nv = W.velocities.solved.shape[0]
    ny = y.shape[0]
    if S.rows.law.shape[0] > 0:
        W.options.position_violation = max(W.options.position_violation, violation(W, W.rows.scratch_2))
        W.options.velocity_violation = max(
            W.options.velocity_violation, drift(S, W, y[nq : nq + nv], W.rows.scratch_2)[0]
        )
    out[0] = t
    for i in range(ny):
        out[1 + i] = y[i]
    for d in range(nv):
        out[1 + ny + d] = W.velocities.solved[d]
    to = 1 + ny + nv
    for k in range(S.rows.law.shape[0]):
        out[to + k] = W.rows.multiplier[k]
    to += S.rows.law.shape[0]
    for b in range(S.tree.parent.shape[0]):
        if S.tree.law[b] >= 0:
            out[to] = W.velocities.effort[S.tree.v[b]]
            to += 1
