"""Forces: wrenches gathered on bodies, then along the velocities; and the power of each element that needs accounting.

A force element says what it does to frame M; the same wrench, turned round, acts on frame F's body at the same point.
Gravity and gyroscopic terms are the inertial wrench of the bias accelerations.
"""

from __future__ import annotations

from ..compiler.formulas import formula
from ..constraints.modes import BY_RATE
from ..laws.evaluation import evaluate
from ..math.scalar import magnitude, sign
from ..math.vec import add, cross, dot, load3, load9, mtv, mv, neg, put3, scale, sub
from ..tables.system import (
    ALONG,
    BETWEEN,
    LOAD,
    RATE,
    SLIDING,
    VALUE,
)
from .dispatch import effort, inputs, kind_of, wrench
from .pace import own_speed
from .records import load
from .rows import way_of
from .sliding import slide
from .tree import project

SLOW = 1e-9  # lengths of the mechanism, at its own rate: slower is at rest


@formula
def inertial(S, W):
    """Gravity less the inertial wrench at vdot = 0: f = m (g - a), t = -(I alpha + w x I w), about the mass centre."""
    gravity = (S.gravity[0], S.gravity[1], S.gravity[2])
    for b in range(S.tree.parent.shape[0]):
        put3(W.FB, b, 0, scale(S.bodies.mass[b], sub(gravity, load3(W.BK, b, 21))))
        R = load9(W.BK, b, 3)
        t = euler(load9(S.bodies.inertia, b, 0), mtv(R, load3(W.BK, b, 12)), mtv(R, load3(W.BK, b, 18)))
        put3(W.FB, b, 3, neg(mv(R, t)))


@formula
def euler(I, w, alpha):
    """I alpha + w x I w in body axes; by Euler's equations where these are principal axes."""
    if I[1] != 0.0 or I[2] != 0.0 or I[5] != 0.0:
        return add(mv(I, alpha), cross(w, mv(I, w)))
    return (
        I[0] * alpha[0] + (I[8] - I[4]) * w[1] * w[2],
        I[4] * alpha[1] + (I[0] - I[8]) * w[2] * w[0],
        I[8] * alpha[2] + (I[4] - I[0]) * w[0] * w[1],
    )


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
    at = S.forces.laws[k, slot]
    if at < 0:
        return 0.0 * x[0]
    return evaluate(S.code, S.const, at, W.stack, x, W.sensed)


@formula
def wide(T, k):
    """The sixteen parameters of row k of the force table."""
    return (
        T[k, 0],
        T[k, 1],
        T[k, 2],
        T[k, 3],
        T[k, 4],
        T[k, 5],
        T[k, 6],
        T[k, 7],
        T[k, 8],
        T[k, 9],
        T[k, 10],
        T[k, 11],
        T[k, 12],
        T[k, 13],
        T[k, 14],
        T[k, 15],
    )


@formula
def acting(S, W, t, k):
    """Records of frames F and M of force k between frames, and its wrench on M about M's origin."""
    kind = kind_of(S, k)
    F = load(W.FK, S.forces.F[k])
    M = load(W.FK, S.forces.M[k])
    par = wide(S.force_parameters, k)
    a, b = inputs(kind, par, F, M)
    x = (t + 0.0 * a, a, b)
    force, torque = wrench(kind, par, F, M, (law(S, W, k, 0, x), law(S, W, k, 1, x), law(S, W, k, 2, x)), (a, b))
    return F, M, force, torque


@formula
def forces(S, W, t, work):
    """Apply every force between frames to its bodies; the power of accounted ones goes to their work state."""
    for k in range(S.forces.F.shape[0]):
        if S.forces.family[k] != BETWEEN:
            continue
        i = S.forces.F[k]
        j = S.forces.M[k]
        F, M, force, torque = acting(S, W, t, k)
        if S.frame_body[j] >= 0:
            act(W, S.frame_body[j], 1.0, force, torque, M[0])
        if S.frame_body[i] >= 0:
            act(W, S.frame_body[i], -1.0, force, torque, M[0])
        if S.forces.work[k] >= 0:
            work[S.forces.work[k]] = power(F, M, force, torque)


@formula
def power(F, M, force, torque):
    """Power [W] of a wrench on M at M's origin, and of its reverse on F's body at the same point."""
    u = sub(sub(M[3], F[3]), cross(F[2], sub(M[0], F[0])))
    return dot(force, u) + dot(torque, sub(M[2], F[2]))


@formula
def at_rest(S):
    """Sliding no faster than this [m/s] is at rest."""
    return SLOW * own_speed(S).real


@formula
def way(S, W, k, rate):
    """Which way what force k acts along slides: as its switch says, where there is none by the sign of the rate."""
    s = S.forces.switch[k]
    if s < 0:
        return sign(rate)
    told = W.sensed[VALUE, way_of(S, W, s)]
    if told.real == BY_RATE:
        return sign(rate) if magnitude(rate) > at_rest(S) else 0.0 * told
    return told


@formula
def effort_of(S, W, t, k):
    """Force k along a measured quantity, and the rate of that."""
    m = S.forces.F[k]
    x = W.sensed[VALUE, m]
    rate = W.sensed[RATE, m]
    o = 0.0 * x
    pressed = W.sensed[LOAD, S.forces.load[k]] if S.forces.load[k] >= 0 else o
    laws = (law(S, W, k, 0, (t + o, x, rate)), o, way(S, W, k, rate))
    return effort(kind_of(S, k), wide(S.force_parameters, k), x, rate, laws, pressed), rate


@formula
def efforts(S, W, t, work, f):
    """Add every force along a measured quantity to the generalised forces ``f``; accounted ones as in ``forces``."""
    for k in range(S.forces.F.shape[0]):
        if S.forces.family[k] != ALONG:
            if S.forces.family[k] == SLIDING:
                slide(S, W, k, work, f)
            continue
        s, rate = effort_of(S, W, t, k)
        r = S.rows.law.shape[0] + S.forces.F[k]
        for e in range(S.row_start[r], S.row_start[r + 1]):
            f[S.column[e]] += s * W.G[e]
        if S.forces.work[k] >= 0:
            work[S.forces.work[k]] = s * rate


@formula
def gather(S, W, f):
    """Generalised forces: the backward sweep of body wrenches, children to parents."""
    for d in range(f.shape[0]):
        f[d] = 0.0
    for b in range(S.tree.parent.shape[0] - 1, -1, -1):
        force = load3(W.FB, b, 0)
        torque = load3(W.FB, b, 3)
        point = load3(W.BK, b, 0)
        if S.tree.nv[b] > 0:
            project(S, W, b, f, S.tree.v[b], 1.0, force, torque, point)
        if S.tree.parent[b] >= 0:
            act(W, S.tree.parent[b], 1.0, force, torque, point)
