"""The motion as an ordinary differential equation: y = (q, v, z), z being works, turned angles, places on curves.

Index 1: [M G^T; G 0] [vdot; -lam] = [f; gamma]. The constraints g = 0 and G v = nu are kept by one smooth
projection P, along M^-1 G^T or along dependent coordinates; the integrator sees f(P(y)), so its order is kept.
"""

from __future__ import annotations

from ..compiler.jit import formula
from ..laws.call import STACK_RESERVE
from ..laws.evaluation import evaluate_jet
from ..math.scalar import atan2, cos, sin
from ..tables.system import (
    ALPHA,
    BETA,
    BODY_LAW,
    BODY_WORK,
    COORDINATES,
    EFFORT,
    EVALUATIONS,
    F_APPLIED,
    G_VALUE,
    GAMMA,
    GIVEN,
    GUILTY,
    LAM,
    LENGTH,
    NU,
    OFFSET,
    PARTED,
    PASS,
    PROJECTIONS,
    Q0,
    R2,
    RESIDUAL,
    REVOLUTE,
    ROW_WORK,
    SCHUR,
    SOLVER,
    STABILIZE,
    STATUS,
    TOL_G,
    TOL_V,
    TREE,
    V0,
    V3,
    WORST_G,
    WORST_V,
    X_SOLVED,
)
from .dispatch import progress, remember, row_biases, row_values
from .friction import BLURRED, CONVERGED, SUBSTITUTIONS, improve, learnt, returned
from .kinematics import motions, poses
from .loads import efforts, forces, gather, inertial
from .partition import exchange
from .rows import BY_TIME, row_times
from .solve import REFINEMENTS, factor, magnitude, reuse, solve
from .tree import normalise, rates, retract

NONE, BAUMGARTE, STEPS, STAGES, POSITIONS, VELOCITIES, PARTITIONING = range(7)
NOT_CLOSED, NOT_FINITE, JAMMED, SINGULAR = 2, 3, 4, 5
OLD, NEAR, HERE = range(3)
PASSES = 16
CLOSED = 1e-9  # a projection that comes to rest above this has failed
TIGHT_G, TIGHT_V = 1e-15, 1e-14  # relative violations of accepted states that are left alone
SLOW = 0.1  # a Newton step that gains less than this wants a new factor
STALE = 10.0  # times the tolerance of the solve: a residual above this after refinement wants a new factor
FAR = 1e3  # a state this far off is given up at once


@formula
def prepare(S, W, t, q, v):
    """Unit quaternions; prescribed coordinates, velocities and accelerations (W.vel[GIVEN]) as their laws say."""
    normalise(S, q)
    for b in range(S.body_i.shape[0]):
        law = S.body_i[b, BODY_LAW]
        if law >= 0:
            f, f1, f2 = evaluate_jet(S.code, S.const, law, W.stack, t, W.sensed, BY_TIME)
            q[S.body_i[b, Q0]] = f - S.body_x[b, OFFSET]
            v[S.body_i[b, V0]] = f1
            W.vel[GIVEN, S.body_i[b, V0]] = f2


@formula
def astray(S, W, t, q, v):
    """How far prescribed coordinates and velocities are from their laws, relative to the mechanism's size and speed.

    They come from the derivatives of the laws: where these are not the whole truth, a law jumps.
    """
    worst = 0.0
    for b in range(S.body_i.shape[0]):
        law = S.body_i[b, BODY_LAW]
        if law >= 0:
            f, f1, _ = evaluate_jet(S.code, S.const, law, W.stack, t, W.sensed, BY_TIME)
            way = f - S.body_x[b, OFFSET] - q[S.body_i[b, Q0]]
            size = S.glob[LENGTH]
            if S.body_i[b, TREE] == REVOLUTE:  # its whole turns are the law's own
                way = atan2(sin(way), cos(way))
                size = 0.0 * size + 1.0
            rate = magnitude(f1 - v[S.body_i[b, V0]]) / (size + magnitude(f1))
            worst = max(worst, magnitude(way) / size, rate)
    return worst


@formula
def place(S, W, t, q, z):
    """Poses, and the constraint rows as far as they follow from them: g, G, nu. ``z`` tells angles their turns."""
    W.info[EVALUATIONS] += 1
    poses(S, W, q)
    row_values(S, W, t, z)


@formula
def move(S, W, t, v, z):
    """Velocities and bias accelerations at the poses in W, and what follows from them: gamma, measured rates."""
    motions(S, W, v)
    row_biases(S, W, t, v, z)


@formula
def violation(W, out):
    """Largest |g| (its row goes to W.info[GUILTY]) and -g into ``out``."""
    worst = 0.0
    for k in range(out.shape[0]):
        g = W.row[G_VALUE, k]
        out[k] = -g
        size = magnitude(g)
        if not size <= worst:
            worst = size
            W.info[GUILTY] = k
    return worst


@formula
def drift(S, W, v, out):
    """Largest |G v - nu|, the size of its largest term, and nu - G v into ``out``."""
    worst = 0.0
    size = 0.0
    for k in range(out.shape[0]):
        r = W.row[NU, k]
        for e in range(S.row_p[k], S.row_p[k + 1]):
            p = W.G[e] * v[S.col_i[e]]
            r -= p
            size = max(size, magnitude(p))
        out[k] = r
        worst = max(worst, magnitude(r))
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
    W.option[PARTED] = 1.0 if W.option[STABILIZE] == PARTITIONING else 0.0
    place(S, W, t, q, z)
    if S.row_i.shape[0] == 0:
        move(S, W, t, v, z)
        return 0, 0.0, OLD
    status = 0
    found = 0.0
    lost = 0.0
    factored = OLD
    if W.option[STABILIZE] != VELOCITIES:
        status, found, factored = close(S, W, t, q, z, tol_g)
        if status != 0:
            return status, found, OLD
    if W.option[STABILIZE] != POSITIONS:
        status, lost, factored = steer(S, W, v, tol_v, factored)
        if status != 0:
            return status, found, OLD
    else:  # positions follow the violated velocities and are put back: that is no error of the step
        found = 0.0
    move(S, W, t, v, z)
    return 0, max(found / S.glob[LENGTH], lost), factored


@formula
def close(S, W, t, q, z, tol_g):
    """Put q on g = 0 by Newton, until |g| passes, or until it is as small as rounding lets it be.

    Kinematics and rows are those of q, before and after. Returns (status, the violation found, what the factor is).
    """
    none = W.vel[F_APPLIED]
    step = W.vel[V3]
    r = W.row[R2]
    worst = violation(W, r)
    found = worst
    last = 1e300
    factored = OLD
    for _ in range(PASSES):
        if worst <= tol_g or (worst > 0.7 * last and worst <= CLOSED):
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
        left = solve(S, W, none, r, step, W.row[RESIDUAL], False, REFINEMENTS)
        if factored == NEAR and left > SLOW:  # too far from where it was made to serve
            if factor(S, W) != 0:
                return NOT_CLOSED, found, OLD
            solve(S, W, none, r, step, W.row[RESIDUAL], False, REFINEMENTS)
        factored = NEAR
        retract(S, q, step)
        place(S, W, t, q, z)
        worst = violation(W, r)
        W.info[PROJECTIONS] += 1
    if not worst <= CLOSED and not worst <= tol_g:
        return NOT_CLOSED, found, OLD
    return 0, found, factored


@formula
def steer(S, W, v, tol_v, factored):
    """Put v on G v = nu. Returns (status, the violation found relative to size and speed, what the factor is)."""
    none = W.vel[F_APPLIED]
    step = W.vel[V3]
    r = W.row[R2]
    worst, size = drift(S, W, v, r)
    if worst > tol_v * (1.0 + size):
        if factored == NEAR:
            reuse(S, W)
        if factored == OLD or solve(S, W, none, r, step, W.row[RESIDUAL], False, REFINEMENTS) > STALE * W.option[PASS]:
            if factor(S, W) != 0:
                return NOT_CLOSED, worst, OLD
            factored = HERE
            solve(S, W, none, r, step, W.row[RESIDUAL], False, REFINEMENTS)
        for d in range(step.shape[0]):
            v[d] += step[d]
    return 0, worst / (S.glob[LENGTH] + size), factored


@formula
def accelerate(S, W, t, p, dy, factored):
    """Dy at the settled state p, whose kinematics and rows are in W; vdot and lam are left in W. Returns a status."""
    nq = S.kinds[COORDINATES]
    nv = W.vel.shape[1]
    v = p[nq : nq + nv]
    work = dy[nq + nv :]
    if W.option[STABILIZE] == BAUMGARTE:
        a = 2.0 * W.option[ALPHA]
        b = W.option[BETA] * W.option[BETA]
        for k in range(S.row_i.shape[0]):
            W.row[GAMMA, k] -= a * (row_times(S, W, k, v) - W.row[NU, k]) + b * W.row[G_VALUE, k]
    x = W.vel[X_SOLVED]
    if W.option[PARTED] > 0.0:  # from here on with the masses
        W.option[PARTED] = 0.0
        factored = OLD
    if factored == NEAR:
        if S.kinds[SOLVER] == SCHUR:
            reuse(S, W)
        else:
            factored = OLD  # M is another one here
    change = 1e300
    # joints with friction need the solution to know their loads: again until these return themselves
    for attempt in range(SUBSTITUTIONS):
        inertial(S, W)
        forces(S, W, t, work)
        gather(S, W, W.vel[F_APPLIED])
        efforts(S, W, t, work, W.vel[F_APPLIED])
        if (
            factored == OLD
            or solve(S, W, W.vel[F_APPLIED], W.row[GAMMA], x, W.row[LAM], True, REFINEMENTS) > STALE * W.option[PASS]
        ):
            if factor(S, W) != 0:
                W.info[STATUS] = SINGULAR
                return SINGULAR
            factored = HERE
            solve(S, W, W.vel[F_APPLIED], W.row[GAMMA], x, W.row[LAM], True, REFINEMENTS)
        if S.load_i.shape[0] == 0:
            break
        last = change
        change = returned(S, W)
        if change <= CONVERGED or (change <= BLURRED and change > 0.5 * last and learnt(S, W)):
            break
        if attempt == SUBSTITUTIONS - 1:
            W.info[STATUS] = JAMMED if finite(x) == 0 else NOT_FINITE
            return W.info[STATUS]
        improve(S, W, attempt)
    rates(S, p, v, dy)
    for d in range(nv):
        dy[nq + d] = x[d]
    for k in range(S.row_i.shape[0]):
        if S.row_i[k, ROW_WORK] >= 0:
            work[S.row_i[k, ROW_WORK]] = W.row[LAM, k] * W.row[NU, k]
    for b in range(S.body_i.shape[0]):
        if S.body_i[b, BODY_LAW] >= 0:
            d = S.body_i[b, V0]
            work[S.body_i[b, BODY_WORK]] = W.vel[EFFORT, d] * v[d]
    progress(S, W, p[nq + nv :], work)
    W.info[STATUS] = finite(dy)
    return W.info[STATUS]


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
    nq = S.kinds[COORDINATES]
    p = W.y[0]
    for i in range(y.shape[0]):
        p[i] = y[i]
    q = p[:nq]
    v = p[nq : nq + W.vel.shape[1]]
    z = p[nq + W.vel.shape[1] :]
    prepare(S, W, t, q, v)
    factored = OLD
    if W.option[STABILIZE] >= STAGES:
        status, _, factored = settle(S, W, t, q, v, z, W.option[TOL_G], W.option[TOL_V])
        if status != 0:
            W.info[STATUS] = status
            return status
    else:
        place(S, W, t, q, z)
        move(S, W, t, v, z)
    return accelerate(S, W, t, p, dy, factored)


@formula
def arrive(t, y, dy, S, W):
    """Project the state y in place, to rounding, and evaluate there. Returns (0 or status, relative violation)."""
    nq = S.kinds[COORDINATES]
    q = y[:nq]
    v = y[nq : nq + W.vel.shape[1]]
    z = y[nq + W.vel.shape[1] :]
    astray_by = astray(S, W, t, q, v)
    found = 0.0
    factored = OLD
    fault = W.stack.shape[0] - STACK_RESERVE
    if W.stack[fault, 0].real > 0.0:  # overcome: the step that met it was taken again, shorter
        W.stack[fault, 0] = -W.stack[fault, 0]
    prepare(S, W, t, q, v)
    if W.option[STABILIZE] >= STEPS:
        status, found, factored = settle(S, W, t, q, v, z, TIGHT_G * S.glob[LENGTH], TIGHT_V)
        if status != 0:
            W.info[STATUS] = status
            return status, found
        if W.option[PARTED] > 0.0:
            exchange(S, W)
    else:
        place(S, W, t, q, z)
        move(S, W, t, v, z)
    remember(S, W, z)
    return accelerate(S, W, t, y, dy, factored), max(found, astray_by)


@formula
def report(t, y, out, S, W):
    """Write t, the state (projected first), vdot and lam to a row of the output."""
    status, _ = arrive(t, y, W.y[1], S, W)
    write_row(t, y, out, S, W)
    return status


@formula
def write_row(t, y, out, S, W):
    """Write t, the state y that W was last evaluated at, vdot, lam and the efforts of prescribed coordinates."""
    nq = S.kinds[COORDINATES]
    nv = W.vel.shape[1]
    ny = y.shape[0]
    if S.row_i.shape[0] > 0:
        W.option[WORST_G] = max(W.option[WORST_G], violation(W, W.row[R2]))
        W.option[WORST_V] = max(W.option[WORST_V], drift(S, W, y[nq : nq + nv], W.row[R2])[0])
    out[0] = t
    for i in range(ny):
        out[1 + i] = y[i]
    for d in range(nv):
        out[1 + ny + d] = W.vel[X_SOLVED, d]
    to = 1 + ny + nv
    for k in range(S.row_i.shape[0]):
        out[to + k] = W.row[LAM, k]
    to += S.row_i.shape[0]
    for b in range(S.body_i.shape[0]):
        if S.body_i[b, BODY_LAW] >= 0:
            out[to] = W.vel[EFFORT, S.body_i[b, V0]]
            to += 1
