"""Tree joints: how a body hangs on its parent. The coordinate layer is nothing but numbers that choose among these.

Absolute coordinates are a forest in which every body hangs on ground by FREE (7 q, 6 v) or PLANAR (3 q, 3 v).
A tree joint must say: its ``pose`` and ``motion``, its world twist columns (``column``), what a wrench does along them
(``project``), the rates of its coordinates (``rates``) and a finite step along its velocities (``retract``).
"""

from __future__ import annotations

from .._jit import formula
from ..math.scalar import cos, sin, sqrt
from ..math.vec import (
    add,
    col,
    cross,
    dot,
    load3,
    load9,
    mm,
    mtv,
    mv,
    put3,
    quaternion_matrix,
    quaternion_product,
    scale,
    sub,
)
from .records import at_rest, carried, load, store_motion, store_pose
from .tables import BODY_P, BODY_R, PARENT, Q0, TREE, TREE_P, TREE_R, V0

FREE, PLANAR, REVOLUTE = 0, 1, 2
NQ = (7, 3, 1)
NV = (6, 3, 1)


@formula
def pose(S, W, b, q):
    """Position and rotation of body b, its reference point and what its twist columns need, from its parent's pose."""
    kind = S.body_i[b, TREE]
    q0 = S.body_i[b, Q0]
    o = 0.0 * q[q0]
    if kind == PLANAR:
        c = cos(q[q0 + 2])
        s = sin(q[q0 + 2])
        p = (q[q0], q[q0 + 1], o)
        store_pose(W.BK, b, p, (c, -s, o, s, c, o, o, o, o + 1.0))
        put3(W.O, b, 0, p)
    elif kind == FREE:
        p = (q[q0], q[q0 + 1], q[q0 + 2])
        store_pose(W.BK, b, p, quaternion_matrix(q[q0 + 3], q[q0 + 4], q[q0 + 5], q[q0 + 6]))
        put3(W.O, b, 0, p)
    else:
        hinge(S, W, b, q[q0])


@formula
def hinge_frame(S, W, b, o):
    """Record of the tree joint's frame on the parent of body b."""
    parent = S.body_i[b, PARENT]
    if parent >= 0:
        return carried(load(W.BK, parent), load3(S.body_x, b, TREE_P), load9(S.body_x, b, TREE_R))
    return at_rest(load3(S.body_x, b, TREE_P), load9(S.body_x, b, TREE_R), o)


@formula
def hinge(S, W, b, angle):
    """REVOLUTE: turn by the angle about the z axis of the tree joint's frame on the parent."""
    o = 0.0 * angle
    F = hinge_frame(S, W, b, o)
    c = cos(angle)
    s = sin(angle)
    turned = mm(F[1], (c, -s, o, s, c, o, o, o, o + 1.0))
    store_pose(W.BK, b, add(F[0], mv(turned, load3(S.body_x, b, BODY_P))), mm(turned, load9(S.body_x, b, BODY_R)))
    put3(W.O, b, 0, F[0])
    put3(W.X, S.body_i[b, V0], 0, col(F[1], 2))


@formula
def motion(S, W, b, v):
    """Velocities and bias accelerations of body b at its pose, from its parent's."""
    kind = S.body_i[b, TREE]
    v0 = S.body_i[b, V0]
    o = 0.0 * v[v0]
    zero = (o, o, o)
    if kind == PLANAR:
        store_motion(W.BK, b, (o, o, v[v0 + 2]), (v[v0], v[v0 + 1], o), zero, zero)
    elif kind == FREE:
        w = mv(load9(W.BK, b, 3), (v[v0 + 3], v[v0 + 4], v[v0 + 5]))
        store_motion(W.BK, b, w, (v[v0], v[v0 + 1], v[v0 + 2]), zero, zero)
    else:
        F = hinge_frame(S, W, b, o)
        spin = scale(v[v0], load3(W.X, v0, 0))
        w = add(F[2], spin)
        alpha = add(F[4], cross(F[2], spin))
        r = sub(load3(W.BK, b, 0), F[0])
        wr = cross(w, r)
        store_motion(W.BK, b, w, add(F[3], wr), alpha, add(F[5], add(cross(alpha, r), cross(w, wr))))


@formula
def column(S, W, b, k):
    """World twist of body b per unit of its k-th own velocity: (angular velocity, velocity of the reference point)."""
    kind = S.body_i[b, TREE]
    o = 0.0 * W.BK[b, 0]
    l = o + 1.0
    zero = (o, o, o)
    if kind == REVOLUTE:
        return load3(W.X, S.body_i[b, V0], 0), zero
    if kind == PLANAR and k == 2:
        return (o, o, l), zero
    if kind == FREE and k >= 3:
        return (W.BK[b, k], W.BK[b, 3 + k], W.BK[b, 6 + k]), zero
    if k == 0:
        return zero, (l, o, o)
    if k == 1:
        return zero, (o, l, o)
    return zero, (o, o, l)


@formula
def project(S, W, b, out, at, sign, force, torque, point):
    """Add ``sign`` times the power of a wrench (force and torque about ``point``) along body b's twist columns.

    The twist columns times the wrench, with the zeros and ones of FREE and PLANAR left out.
    """
    kind = S.body_i[b, TREE]
    t = add(torque, cross(sub(point, load3(W.O, b, 0)), force))
    if kind == PLANAR:
        out[at] += sign * force[0]
        out[at + 1] += sign * force[1]
        out[at + 2] += sign * t[2]
    elif kind == FREE:
        m = mtv(load9(W.BK, b, 3), t)
        out[at] += sign * force[0]
        out[at + 1] += sign * force[1]
        out[at + 2] += sign * force[2]
        out[at + 3] += sign * m[0]
        out[at + 4] += sign * m[1]
        out[at + 5] += sign * m[2]
    else:
        out[at] += sign * dot(load3(W.X, S.body_i[b, V0], 0), t)


@formula
def rates(S, q, v, dq):
    """Qdot of every body from its velocities."""
    for b in range(S.body_i.shape[0]):
        kind = S.body_i[b, TREE]
        q0 = S.body_i[b, Q0]
        v0 = S.body_i[b, V0]
        if kind == FREE:
            for i in range(3):
                dq[q0 + i] = v[v0 + i]
            o = 0.0 * v[v0]
            e = (q[q0 + 3], q[q0 + 4], q[q0 + 5], q[q0 + 6])
            d = quaternion_product(e, (o, v[v0 + 3], v[v0 + 4], v[v0 + 5]))
            for i in range(4):
                dq[q0 + 3 + i] = 0.5 * d[i]
        elif kind == PLANAR:
            for i in range(3):
                dq[q0 + i] = v[v0 + i]
        else:
            dq[q0] = v[v0]


@formula
def retract(S, q, d):
    """Q (+) d: move every body by the finite step d along its velocities, in place."""
    for b in range(S.body_i.shape[0]):
        kind = S.body_i[b, TREE]
        q0 = S.body_i[b, Q0]
        v0 = S.body_i[b, V0]
        if kind == FREE:
            for i in range(3):
                q[q0 + i] += d[v0 + i]
            x = (0.5 * d[v0 + 3], 0.5 * d[v0 + 4], 0.5 * d[v0 + 5])
            r = 1.0 / sqrt(1.0 + dot(x, x))  # the Cayley step: a unit quaternion for any d
            e = (q[q0 + 3], q[q0 + 4], q[q0 + 5], q[q0 + 6])
            e = quaternion_product(e, (r, r * x[0], r * x[1], r * x[2]))
            for i in range(4):
                q[q0 + 3 + i] = e[i]
        elif kind == PLANAR:
            for i in range(3):
                q[q0 + i] += d[v0 + i]
        else:
            q[q0] += d[v0]


@formula
def normalise(S, q):
    """Give every quaternion unit length again, in place."""
    for b in range(S.body_i.shape[0]):
        if S.body_i[b, TREE] == FREE:
            k = S.body_i[b, Q0] + 3
            s = 1.0 / sqrt(q[k] * q[k] + q[k + 1] * q[k + 1] + q[k + 2] * q[k + 2] + q[k + 3] * q[k + 3])
            for i in range(4):
                q[k + i] *= s
