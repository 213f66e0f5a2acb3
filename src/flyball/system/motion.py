"""The motion as an ordinary differential equation: y = (q, v, z) with z the work of accounted elements and turned angles.

Index 1: [M G^T; G 0] [vdot; -lam] = [f; gamma]. The constraints g = 0 and G v = nu are kept by one smooth
projection P, along M^-1 G^T; the integrator sees f(P(y)), so its order is kept.
"""

from __future__ import annotations

from .._jit import formula
from ..constraints.angle import row as angle
from ..math.vec import dot, sub
from .dispatch import forces, rows
from .kinematics import bodies, frames
from .loads import gather, inertial
from .records import load
from .rows import row_times
from .solve import factor, magnitude, solve
from .tables import (
    ALPHA,
    BETA,
    EVALUATIONS,
    F_APPLIED,
    G_VALUE,
    GAMMA,
    GUILTY,
    LAM,
    NU,
    PROJECTIONS,
    R2,
    RESIDUAL,
    ROW_WORK,
    STABILIZE,
    TOL_G,
    TOL_V,
    V3,
    WORST_G,
    WORST_V,
    X_SOLVED,
)
from .tree import normalise, rates, retract

NONE, BAUMGARTE, STEPS, STAGES = 0, 1, 2, 3
NOT_CLOSED = 2
PASSES = 16
CLOSED = 1e-9  # a projection that comes to rest above this has failed
TIGHT_G, TIGHT_V = 1e-13, 1e-12  # violations of accepted and reported states that are left alone
FAR = 1e3  # a state this far off is given up at once


@formula
def place(S, W, t, q, v):
    """Kinematics and constraint rows at (t, q, v)."""
    W.info[EVALUATIONS] += 1
    bodies(S, W, q, v)
    frames(S, W)
    rows(S, W, t)


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
def project_state(S, W, t, q, v, tol_g, tol_v):
    """Put q on g = 0 and v on G v = nu, in place, and leave kinematics and rows there.

    Newton along M^-1 G^T until |g| passes, or until it is as small as rounding lets it be. A violation below the
    tolerance is left alone: near a singular position its correction is rounding divided by a small number, and the
    accelerations would follow it. Returns (0 or NOT_CLOSED, the violation that was found).
    """
    zero = W.vel[F_APPLIED]
    step = W.vel[V3]
    r = W.row[R2]
    normalise(S, q)
    place(S, W, t, q, v)
    if r.shape[0] == 0:
        return 0, 0.0
    for d in range(zero.shape[0]):
        zero[d] = 0.0
    worst = violation(W, r)
    found = worst
    last = 1e300
    for _ in range(PASSES):
        if worst <= tol_g or (worst > 0.7 * last and worst <= CLOSED):
            break
        last = worst
        if not worst <= FAR or factor(S, W) != 0:
            return NOT_CLOSED, found
        solve(S, W, zero, r, step, W.row[RESIDUAL])
        retract(S, q, step)
        place(S, W, t, q, v)
        worst = violation(W, r)
        W.info[PROJECTIONS] += 1
    if not worst <= CLOSED:
        return NOT_CLOSED, found
    worst, size = drift(S, W, v, r)
    if worst > tol_v * (1.0 + size):
        if factor(S, W) != 0:
            return NOT_CLOSED, found
        solve(S, W, zero, r, step, W.row[RESIDUAL])
        for d in range(step.shape[0]):
            v[d] += step[d]
        place(S, W, t, q, v)
    return 0, max(found, worst)


@formula
def accelerations(S, W, t, v, z, work):
    """Vdot into W.vel[X_SOLVED] and lam into W.row[LAM] at the kinematics and rows in W."""
    inertial(S, W)
    forces(S, W, t, z, work)
    gather(S, W, W.vel[F_APPLIED])
    if W.option[STABILIZE] == BAUMGARTE:
        a = 2.0 * W.option[ALPHA]
        b = W.option[BETA] * W.option[BETA]
        for k in range(S.row_i.shape[0]):
            W.row[GAMMA, k] -= a * (row_times(S, W, k, v) - W.row[NU, k]) + b * W.row[G_VALUE, k]
    if S.row_i.shape[0] > 0 or S.mass_i.shape[0] > 0:
        status = factor(S, W)
        if status != 0:
            return status
    solve(S, W, W.vel[F_APPLIED], W.row[GAMMA], W.vel[X_SOLVED], W.row[LAM])
    return 0


@formula
def derivative(t, y, dy, S, W):
    """dy/dt = f(P(y)). ``y`` is left as it is. Returns 0 or a status."""
    nq = S.kinds[-2]
    nv = W.vel.shape[1]
    p = W.y[0]
    for i in range(y.shape[0]):
        p[i] = y[i]
    q = p[:nq]
    v = p[nq : nq + nv]
    if W.option[STABILIZE] == STAGES:
        status, _ = project_state(S, W, t, q, v, W.option[TOL_G], W.option[TOL_V])
        if status != 0:
            return status
    else:
        normalise(S, q)
        place(S, W, t, q, v)
    work = dy[nq + nv :]
    status = accelerations(S, W, t, v, p[nq + nv :], work)
    if status != 0:
        return status
    rates(S, q, v, dy)
    for d in range(nv):
        dy[nq + d] = W.vel[X_SOLVED, d]
    for k in range(S.row_i.shape[0]):
        if S.row_i[k, ROW_WORK] >= 0:
            work[S.row_i[k, ROW_WORK]] = W.row[LAM, k] * W.row[NU, k]
    for k in range(S.angle_i.shape[0]):
        F = load(W.FK, S.angle_i[k, 0])
        M = load(W.FK, S.angle_i[k, 1])
        n = angle((0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0), F, M)[2]
        work[S.angle_i[k, 2]] = dot(n, sub(M[2], F[2]))
    return 0


@formula
def project(t, y, S, W):
    """Project the state y in place, to rounding. Returns (0 or a status, the violation found)."""
    nq = S.kinds[-2]
    nv = W.vel.shape[1]
    if W.option[STABILIZE] < STEPS:
        normalise(S, y[:nq])
        return 0, 0.0
    return project_state(S, W, t, y[:nq], y[nq : nq + nv], TIGHT_G, TIGHT_V)


@formula
def report(t, y, out, S, W):
    """Write t, the state, vdot and lam to a row of the output, with the state projected first."""
    nq = S.kinds[-2]
    nv = W.vel.shape[1]
    ny = y.shape[0]
    status, _ = project(t, y, S, W)
    if status == 0:
        status = derivative(t, y, W.y[1], S, W)
    W.option[WORST_G] = max(W.option[WORST_G], violation(W, W.row[R2]))
    W.option[WORST_V] = max(W.option[WORST_V], drift(S, W, y[nq : nq + nv], W.row[R2])[0])
    out[0] = t
    for i in range(ny):
        out[1 + i] = y[i]
    for d in range(nv):
        out[1 + ny + d] = W.vel[X_SOLVED, d]
    for k in range(S.row_i.shape[0]):
        out[1 + ny + nv + k] = W.row[LAM, k]
    return status
