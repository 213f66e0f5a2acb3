"""Forces: wrenches gathered on bodies, then along the velocities; and the power of each element that needs accounting.

A force element says what it does to frame M; the same wrench, turned round, acts on frame F's body at the same point.
Gravity and gyroscopic terms are the inertial wrench of the bias accelerations.
"""

from __future__ import annotations

from .._jit import formula
from ..math.vec import add, cross, dot, load3, load9, mtv, mv, neg, put3, scale, sub
from .laws import evaluate
from .records import load
from .rows import parameters
from .tables import FORCE_F, FORCE_LAW, FORCE_M, FORCE_TURNS, FORCE_WORK, INERTIA, MASS, NV, PARENT, TERM_KINDS, V0
from .tree import project


@formula
def inertial(S, W):
    """Gravity less the inertial wrench at vdot = 0: f = m (g - a), t = -(I alpha + w x I w), about the mass centre."""
    gravity = (S.glob[0], S.glob[1], S.glob[2])
    for b in range(S.body_i.shape[0]):
        p, R, w, v, alpha, a = load(W.BK, b)
        I = load9(S.body_x, b, INERTIA)
        w_B = mtv(R, w)
        t = add(mv(I, mtv(R, alpha)), cross(w_B, mv(I, w_B)))
        put3(W.FB, b, 0, scale(S.body_x[b, MASS], sub(gravity, a)))
        put3(W.FB, b, 3, neg(mv(R, t)))


@formula
def act(W, b, sign, force, torque, point):
    """Add ``sign`` times a wrench about ``point`` to body b."""
    t = add(torque, cross(sub(point, load3(W.BK, b, 0)), force))
    for i in range(3):
        W.FB[b, i] += sign * force[i]
        W.FB[b, 3 + i] += sign * t[i]


@formula
def law(S, W, k, slot, x):
    """Value of one of the element's laws for the inputs x = (t, a, b); zero where there is none."""
    at = S.force_i[k, FORCE_LAW + slot]
    if at < 0:
        return 0.0 * x[0]
    return evaluate(S.code, S.const, at, W.stack, x, W.stack)  # chief: sensed


@formula
def each_force(S, W, t, z, work, kind, inputs, wrench):
    """Apply every force of one kind; the power of accounted ones goes to their work state."""
    base = TERM_KINDS + 1 + kind
    for k in range(S.kinds[base], S.kinds[base + 1]):
        i = S.force_i[k, FORCE_F]
        j = S.force_i[k, FORCE_M]
        F = load(W.FK, i)
        M = load(W.FK, j)
        par = parameters(S.force_x, k)
        turns = S.force_i[k, FORCE_TURNS]
        a, b = inputs(par, F, M, z[turns] if turns >= 0 else 0.0 * par[0])
        x = (t + 0.0 * a, a, b)
        force, torque = wrench(par, F, M, (law(S, W, k, 0, x), law(S, W, k, 1, x), law(S, W, k, 2, x)), (a, b))
        if S.frame_i[j] >= 0:
            act(W, S.frame_i[j], 1.0, force, torque, M[0])
        if S.frame_i[i] >= 0:
            act(W, S.frame_i[i], -1.0, force, torque, M[0])
        if S.force_i[k, FORCE_WORK] >= 0:
            u = sub(sub(M[3], F[3]), cross(F[2], sub(M[0], F[0])))
            work[S.force_i[k, FORCE_WORK]] = dot(force, u) + dot(torque, sub(M[2], F[2]))


@formula
def gather(S, W, f):
    """Generalised forces: the backward sweep of body wrenches, children to parents."""
    for d in range(f.shape[0]):
        f[d] = 0.0
    for b in range(S.body_i.shape[0] - 1, -1, -1):
        force = load3(W.FB, b, 0)
        torque = load3(W.FB, b, 3)
        point = load3(W.BK, b, 0)
        if S.body_i[b, NV] > 0:
            project(S, W, b, f, S.body_i[b, V0], 1.0, force, torque, point)
        if S.body_i[b, PARENT] >= 0:
            act(W, S.body_i[b, PARENT], 1.0, force, torque, point)
