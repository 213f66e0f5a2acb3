"""The equations themselves at any state, accelerations and multipliers, with nothing solved: what is differentiated.

    r = M vdot - f - G^T lam,  g,  G v - nu,  G vdot - gamma

A solve, a projection or a Newton loop is no place for complex steps (the regularised solve amplifies an inconsistent
perturbation); this has none. M vdot comes from the inertial wrenches of the actual accelerations (recursive
Newton-Euler: Luh, Walker and Paul 1980; Featherstone 2008, section 5.3), so no matrix is needed either.
"""

from __future__ import annotations

from ..compiler.held import held
from ..compiler.jit import formula, kernel
from ..math.vec import add, cross, load3, put3, scale, sub
from ..tables.system import (
    BIAS,
    COORDINATES,
    F_APPLIED,
    G_VALUE,
    GAMMA,
    LAM,
    LOAD,
    NU,
    NV,
    PARENT,
    RATE,
    RETURNED,
    V0,
    V2,
    VALUE,
)
from .dispatch import row_biases, row_values
from .friction import reaction_loads
from .kinematics import motions, poses
from .loads import efforts, forces, gather, inertial
from .rows import measured, row_times
from .tree import column, retract


@formula
def residuals(S, W, t, state, vdot, lam, steps, out):
    """The residual at several states, each a finite step from the given one.

    Parameters
    ----------
    S, W
        Tables and scratch.
    t : number [s]
    state : (nq + nv + nz,)
    vdot, lam : (nv,), (nr,)
    steps : (n, 3 nv + 1)
        Steps of positions (along the velocities), of velocities, of accelerations, and of time.
    out : (n, nv + 3 nr + 3 nm)
        Filled with r, g, G v - nu, G vdot - gamma; then value, rate and acceleration of every measured quantity.
    """
    nq = S.kinds[COORDINATES]
    nv = W.vel.shape[1]
    a = W.vel[V2]
    for n in range(steps.shape[0]):
        p = W.y[0]
        for i in range(state.shape[0]):
            p[i] = state[i]
        retract(S, p[:nq], steps[n, :nv])
        for d in range(nv):
            p[nq + d] += steps[n, nv + d]
            a[d] = vdot[d] + steps[n, 2 * nv + d]
        residual(S, W, t + steps[n, 3 * nv], p, a, lam, out[n])


@formula
def residual(S, W, t, p, vdot, lam, out):
    """The residual at one state."""
    nq = S.kinds[COORDINATES]
    nv = W.vel.shape[1]
    nr = S.row_i.shape[0]
    v = p[nq : nq + nv]
    z = p[nq + nv :]
    poses(S, W, p[:nq])
    row_values(S, W, t, z)
    motions(S, W, v)
    row_biases(S, W, t, v, z)
    for k in range(nr):
        W.row[LAM, k] = lam[k]
        out[nv + k] = W.row[G_VALUE, k]
        out[nv + nr + k] = row_times(S, W, k, v) - W.row[NU, k]
        out[nv + 2 * nr + k] = row_times(S, W, k, vdot) - W.row[GAMMA, k]
    nm = measured(S)
    for m in range(nm):
        a = W.sensed[BIAS, m]
        for e in range(S.row_p[nr + m], S.row_p[nr + m + 1]):
            a += W.G[e] * vdot[S.col_i[e]]
        out[nv + 3 * nr + m] = W.sensed[VALUE, m]
        out[nv + 3 * nr + nm + m] = W.sensed[RATE, m]
        out[nv + 3 * nr + 2 * nm + m] = a
    accelerated(S, W, vdot)
    reaction_loads(S, W)
    for n in range(2 * nm, W.sensed.shape[1]):
        W.sensed[LOAD, n] = W.sensed[RETURNED, n]
    f = W.vel[F_APPLIED]
    inertial(S, W)
    forces(S, W, t, W.y[1])
    gather(S, W, f)
    efforts(S, W, t, W.y[1], f)
    for d in range(nv):
        out[d] = -f[d]
    for k in range(nr):
        for e in range(S.row_p[k], S.row_p[k + 1]):
            out[S.col_i[e]] -= W.G[e] * lam[k]


@formula
def accelerated(S, W, vdot):
    """Add what ``vdot`` does to the accelerations of the bodies in W, which held their bias."""
    for b in range(S.body_i.shape[0]):
        o = 0.0 * W.BK[b, 0]
        alpha = (o, o, o)
        a = alpha
        P = load3(W.O, b, 0)
        parent = S.body_i[b, PARENT]
        if parent >= 0:
            alpha = load3(W.IC, parent, 0)
            a = add(load3(W.IC, parent, 3), cross(alpha, sub(P, load3(W.BK, parent, 0))))
        for k in range(S.body_i[b, NV]):
            x, u = column(S, W, b, k)
            d = vdot[S.body_i[b, V0] + k]
            alpha = add(alpha, scale(d, x))
            a = add(a, scale(d, u))
        a = add(a, cross(alpha, sub(load3(W.BK, b, 0), P)))
        put3(W.IC, b, 0, alpha)
        put3(W.IC, b, 3, a)
        put3(W.BK, b, 18, add(load3(W.BK, b, 18), alpha))
        put3(W.BK, b, 21, add(load3(W.BK, b, 21), a))


@kernel
def residual_kernel(S, W, t, state, vdot, lam, steps, out):
    """The equations at states near one state, see ``residuals``; compiled for complex numbers, when first needed."""
    residuals(held(S), held(W), t, state, vdot, lam, steps, out)
