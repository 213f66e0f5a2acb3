"""Tree joints: how a body hangs on its parent. The coordinate layer is nothing but numbers that choose among these.

Absolute coordinates are a forest in which every body hangs on ground by FREE (7 q, 6 v) or PLANAR (3 q, 3 v), a point
mass by POINT: it moves along the world's axes (3 q, 3 v; in the plane 2) and stays turned as it is drawn. The others
act between a frame on the parent and one on the body: REVOLUTE turns about its z axis, PRISMATIC slides along
it, SPHERICAL (quaternion; velocities: angular velocity in the moved axes) turns about its origin, WELD does not move.

A tree joint must say: its ``pose`` and ``motion``, its world twist columns (``column``), what a wrench does along them
(``project``), the rates of its coordinates (``rates``) and a finite step along its velocities (``retract``).
"""

from __future__ import annotations

from ..compiler.formulas import formula
from ..math.cayley import quaternion
from ..math.scalar import cos, divide, sin, sqrt
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
from ..tables.system import (
    FREE,
    PLANAR,
    POINT,
    PRISMATIC,
    REVOLUTE,
    SPHERICAL,
    WELD,
)
from .records import load, store_motion, store_pose


@formula
def pose(S, W, b, q):
    """Position and rotation of body b, its reference point and what its twist columns need, from its parent's pose."""
    kind = S.tree.joint[b]
    q0 = S.tree.q[b]
    o = 0.0 * S.bodies.mass[b]
    if kind == PLANAR:
        c = cos(q[q0 + 2])
        s = sin(q[q0 + 2])
        o = 0.0 * c
        p = (q[q0], q[q0 + 1], o)
        store_pose(W.BK, b, p, (c, -s, o, s, c, o, o, o, o + 1.0))
        put3(W.O, b, 0, p)
    elif kind == FREE:
        p = (q[q0], q[q0 + 1], q[q0 + 2])
        store_pose(W.BK, b, p, quaternion_matrix(q[q0 + 3], q[q0 + 4], q[q0 + 5], q[q0 + 6]))
        put3(W.O, b, 0, p)
    elif kind == POINT:
        p = (q[q0], q[q0 + 1], q[q0 + 2] if S.tree.nv[b] == 3 else 0.0 * q[q0])
        store_pose(W.BK, b, p, load9(S.bodies.body_rotation, b, 0))
        put3(W.O, b, 0, p)
    else:
        hinge(S, W, b, kind, q, q0)


@formula
def hinge(S, W, b, kind, q, q0):
    """The other kinds: move the tree joint's frame on the parent, then go over to the body."""
    parent = S.tree.parent[b]
    p = load3(S.bodies.joint_position, b, 0)
    R = load9(S.bodies.joint_rotation, b, 0)
    if parent >= 0:
        A = load9(W.BK, parent, 3)
        p = add(load3(W.BK, parent, 0), mv(A, p))
        R = mm(A, R) if S.bodies.joint_turned[b] != 0.0 else A
    v0 = S.tree.v[b]
    axis = col(R, 2)
    if kind == REVOLUTE:
        put3(W.X, v0, 0, axis)
        R = turned(R, cos(q[q0]), sin(q[q0]))
    elif kind == PRISMATIC:
        put3(W.X, v0, 3, axis)
        p = add(p, scale(q[q0], axis))
    elif kind == SPHERICAL:
        R = mm(R, quaternion_matrix(q[q0], q[q0 + 1], q[q0 + 2], q[q0 + 3]))
        for i in range(3):
            put3(W.X, v0 + i, 0, (R[i], R[3 + i], R[6 + i]))
    put3(W.O, b, 0, p)
    p = add(p, mv(R, load3(S.bodies.body_position, b, 0)))
    if S.bodies.body_turned[b] != 0.0:
        R = mm(R, load9(S.bodies.body_rotation, b, 0))
    store_pose(W.BK, b, p, R)


@formula
def turned(R, c, s):
    """R turned about its own z axis."""
    return (
        c * R[0] + s * R[1],
        c * R[1] - s * R[0],
        R[2],
        c * R[3] + s * R[4],
        c * R[4] - s * R[3],
        R[5],
        c * R[6] + s * R[7],
        c * R[7] - s * R[6],
        R[8],
    )


@formula
def motion(S, W, b, v):
    """Velocities and bias accelerations of body b at its pose, from its parent's."""
    kind = S.tree.joint[b]
    v0 = S.tree.v[b]
    if kind == PLANAR:
        o = 0.0 * v[v0]
        zero = (o, o, o)
        store_motion(W.BK, b, (o, o, v[v0 + 2]), (v[v0], v[v0 + 1], o), zero, zero)
    elif kind == FREE:
        o = 0.0 * v[v0]
        zero = (o, o, o)
        w = mv(load9(W.BK, b, 3), (v[v0 + 3], v[v0 + 4], v[v0 + 5]))
        store_motion(W.BK, b, w, (v[v0], v[v0 + 1], v[v0 + 2]), zero, zero)
    elif kind == POINT:
        o = 0.0 * v[v0]
        zero = (o, o, o)
        store_motion(W.BK, b, zero, (v[v0], v[v0 + 1], v[v0 + 2] if S.tree.nv[b] == 3 else o), zero, zero)
    else:
        hinge_motion(S, W, b, kind, v, v0)


@formula
def hinge_motion(S, W, b, kind, v, v0):
    """The other kinds: the parent's motion at the reference point, then what the joint adds, then to the body."""
    parent = S.tree.parent[b]
    o = 0.0 * W.BK[b, 0]
    w = (o, o, o)
    u = w
    alpha = w
    a = w
    P = load3(W.O, b, 0)
    if parent >= 0:
        p, _, w, u, alpha, a = load(W.BK, parent)
        r = sub(P, p)
        wr = cross(w, r)
        u = add(u, wr)
        a = add(a, add(cross(alpha, r), cross(w, wr)))
    if kind == PRISMATIC:
        slide = scale(v[v0], load3(W.X, v0, 3))
        u = add(u, slide)
        a = add(a, scale(2.0, cross(w, slide)))
    elif kind != WELD:
        spin = scale(v[v0], load3(W.X, v0, 0))
        if kind == SPHERICAL:
            spin = add(spin, add(scale(v[v0 + 1], load3(W.X, v0 + 1, 0)), scale(v[v0 + 2], load3(W.X, v0 + 2, 0))))
        alpha = add(alpha, cross(w, spin))
        w = add(w, spin)
    r = sub(load3(W.BK, b, 0), P)
    wr = cross(w, r)
    store_motion(W.BK, b, w, add(u, wr), alpha, add(a, add(cross(alpha, r), cross(w, wr))))


@formula
def column(S, W, b, k):
    """World twist of body b per unit of its k-th own velocity: (angular velocity, velocity of the reference point)."""
    kind = S.tree.joint[b]
    o = 0.0 * W.BK[b, 0]
    l = o + 1.0
    zero = (o, o, o)
    if kind == REVOLUTE or kind == SPHERICAL:
        return load3(W.X, S.tree.v[b] + k, 0), zero
    if kind == PRISMATIC:
        return zero, load3(W.X, S.tree.v[b], 3)
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

    The twist columns times the wrench, with the zeros and ones left out.
    """
    kind = S.tree.joint[b]
    if kind == PRISMATIC:
        out[at] += sign * dot(load3(W.X, S.tree.v[b], 3), force)
        return
    if kind == POINT:
        for i in range(S.tree.nv[b]):
            out[at + i] += sign * force[i]
        return
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
    elif kind == REVOLUTE:
        out[at] += sign * dot(load3(W.X, S.tree.v[b], 0), t)
    elif kind == SPHERICAL:
        for i in range(3):
            out[at + i] += sign * dot(load3(W.X, S.tree.v[b] + i, 0), t)


@formula
def quaternion_at(S, b):
    """Where body b's quaternion begins in q, and its angular velocity in v; (-1, -1) if it has none."""
    kind = S.tree.joint[b]
    if kind == FREE:
        return S.tree.q[b] + 3, S.tree.v[b] + 3
    if kind == SPHERICAL:
        return S.tree.q[b], S.tree.v[b]
    return -1, -1


@formula
def lengths(S, b):
    """How many of body b's coordinates, its first, are plain: their rates are velocities."""
    kind = S.tree.joint[b]
    if kind == POINT:
        return S.tree.nv[b]
    return 0 if kind == SPHERICAL or kind == WELD else 1 if kind >= REVOLUTE else 3


@formula
def rates(S, q, v, dq):
    """Qdot of every body from its velocities."""
    for b in range(S.tree.parent.shape[0]):
        q0 = S.tree.q[b]
        v0 = S.tree.v[b]
        for i in range(lengths(S, b)):
            dq[q0 + i] = v[v0 + i]
        k, w = quaternion_at(S, b)
        if k >= 0:
            o = 0.0 * v[w]
            d = quaternion_product((q[k], q[k + 1], q[k + 2], q[k + 3]), (o, v[w], v[w + 1], v[w + 2]))
            for i in range(4):
                dq[k + i] = 0.5 * d[i]


@formula
def unrated(S, q, dq, v):
    """V of every body from its qdot: the reverse of ``rates``."""
    for b in range(S.tree.parent.shape[0]):
        q0 = S.tree.q[b]
        v0 = S.tree.v[b]
        for i in range(lengths(S, b)):
            v[v0 + i] = dq[q0 + i]
        k, w = quaternion_at(S, b)
        if k >= 0:
            d = quaternion_product((q[k], -q[k + 1], -q[k + 2], -q[k + 3]), (dq[k], dq[k + 1], dq[k + 2], dq[k + 3]))
            for i in range(3):
                v[w + i] = 2.0 * d[1 + i]


@formula
def retract(S, q, d):
    """Q (+) d: move every body by the finite step d along its velocities, in place."""
    for b in range(S.tree.parent.shape[0]):
        q0 = S.tree.q[b]
        v0 = S.tree.v[b]
        for i in range(lengths(S, b)):
            q[q0 + i] += d[v0 + i]
        k, w = quaternion_at(S, b)
        if k >= 0:
            e = quaternion_product((q[k], q[k + 1], q[k + 2], q[k + 3]), quaternion((d[w], d[w + 1], d[w + 2])))
            for i in range(4):
                q[k + i] = e[i]


@formula
def normalise(S, q):
    """Give every quaternion unit length again, in place."""
    for b in range(S.tree.parent.shape[0]):
        k, _ = quaternion_at(S, b)
        if k >= 0:
            square = q[k] * q[k] + q[k + 1] * q[k + 1] + q[k + 2] * q[k + 2] + q[k + 3] * q[k + 3]
            s = divide(1.0, sqrt(square))
            for i in range(4):
                q[k + i] *= s
