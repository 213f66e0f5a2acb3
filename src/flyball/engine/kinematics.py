"""Kinematics of bodies and frames: poses, velocities and bias accelerations by recursion along tree joints.

The kinematic record of a body or frame is (p, R, w, v, alpha, a) in world components. ``alpha`` and ``a`` are the bias
accelerations: the accelerations at vdot = 0.

The table states how a body is connected to its parent. Absolute coordinates are a forest in which every body is
connected to ground by FREE (7 q, 6 v) or PLANAR (3 q, 3 v). A point mass is connected by POINT: it moves along the
world's axes (3 q, 3 v; in the plane 2) and keeps its reference orientation. The other kinds act between a frame on the
parent and one on the body: REVOLUTE turns about its z axis, PRISMATIC slides along it, SPHERICAL (quaternion;
velocities: angular velocity in the moved axes) turns about its origin, WELD does not move.

A tree joint must provide its ``body_pose`` and ``body_motion``, its world twist columns (``twist_column``), the power
of a wrench along them (``project_wrench``), the rates of its coordinates (``coordinate_rates``) and a finite step along
its velocities (``retract``). Kinematics at many states, and the inverse (velocities of tree joints from the velocities
of bodies), are at the end.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from ..compiler.formulas import formula
from ..compiler.kernels import kernel
from ..compiler.struct_layout import Float2, Float3
from ..math.rotation import cayley_quaternion
from ..math.scalar import atan2, cos, divide, sin, sqrt
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
    quaternion_matrix,
    quaternion_product,
    scale,
    store3,
    store9,
    sub,
)
from ..tables.forest import TreeJoint
from ..tables.reference_configuration import GROUND_STATE, BodyState, free_velocities, whole_turns
from ..tables.table_definitions import (
    FREE,
    PLANAR,
    POINT,
    PRISMATIC,
    REVOLUTE,
    SPHERICAL,
    WELD,
    Bodies,
    KinematicRecords,
    Tree,
    Twists,
)
from ..tables.values import Values


@formula
def load_record(K, k):
    """Record k of `KinematicRecords`."""
    return (
        load3(K.position, k, 0),
        load9(K.rotation, k, 0),
        load3(K.angular_velocity, k, 0),
        load3(K.velocity, k, 0),
        load3(K.bias_angular_acceleration, k, 0),
        load3(K.bias_acceleration, k, 0),
    )


@formula
def store_pose(K, k, p, R):
    """Write position and rotation of record k."""
    store3(K.position, k, 0, p)
    store9(K.rotation, k, 0, R)


@formula
def store_motion(K, k, w, v, alpha, a):
    """Write velocities and bias accelerations of record k."""
    store3(K.angular_velocity, k, 0, w)
    store3(K.velocity, k, 0, v)
    store3(K.bias_angular_acceleration, k, 0, alpha)
    store3(K.bias_acceleration, k, 0, a)


@formula
def attached_record(record, offset, turn):
    """Record of a frame carried by a body: at ``offset`` and turned by ``turn`` in the body's axes."""
    p, R, w, v, alpha, a = record
    r = mv(R, offset)
    wr = cross(w, r)
    return add(p, r), mm(R, turn), w, add(v, wr), alpha, add(a, add(cross(alpha, r), cross(w, wr)))


@formula
def stationary_record(offset, turn, o):
    """Record of a frame that does not move; ``o`` is a zero of the wanted number type."""
    zero = (o, o, o)
    return offset, turn, zero, zero, zero, zero


@formula
def body_pose(S, W, b, q):
    """Position, rotation, reference point and twist data of body b, from its parent's pose."""
    kind = S.tree.joint[b]
    q0 = S.tree.q[b]
    o = 0.0 * S.bodies.mass[b]
    if kind == PLANAR:
        c = cos(q[q0 + 2])
        s = sin(q[q0 + 2])
        o = 0.0 * c
        p = (q[q0], q[q0 + 1], o)
        store_pose(W.bodies, b, p, (c, -s, o, s, c, o, o, o, o + 1.0))
        store3(W.O, b, 0, p)
    elif kind == FREE:
        p = (q[q0], q[q0 + 1], q[q0 + 2])
        store_pose(W.bodies, b, p, quaternion_matrix(q[q0 + 3], q[q0 + 4], q[q0 + 5], q[q0 + 6]))
        store3(W.O, b, 0, p)
    elif kind == POINT:
        p = (q[q0], q[q0 + 1], q[q0 + 2] if S.tree.nv[b] == 3 else 0.0 * q[q0])
        store_pose(W.bodies, b, p, load9(S.bodies.body_rotation, b, 0))
        store3(W.O, b, 0, p)
    else:
        joint_pose(S, W, b, kind, q, q0)


@formula
def joint_pose(S, W, b, kind, q, q0):
    """The same for the other kinds: move the tree joint's frame on the parent, then go to the body's centre of mass."""
    parent = S.tree.parent[b]
    p = load3(S.bodies.joint_position, b, 0)
    R = load9(S.bodies.joint_rotation, b, 0)
    if parent >= 0:
        A = load9(W.bodies.rotation, parent, 0)
        p = add(load3(W.bodies.position, parent, 0), mv(A, p))
        R = mm(A, R) if S.bodies.joint_turned[b] != 0.0 else A
    v0 = S.tree.v[b]
    axis = col(R, 2)
    if kind == REVOLUTE:
        store3(W.twists.angular, v0, 0, axis)
        R = rotated_about_z(R, cos(q[q0]), sin(q[q0]))
    elif kind == PRISMATIC:
        store3(W.twists.linear, v0, 0, axis)
        p = add(p, scale(q[q0], axis))
    elif kind == SPHERICAL:
        R = mm(R, quaternion_matrix(q[q0], q[q0 + 1], q[q0 + 2], q[q0 + 3]))
        for i in range(3):
            store3(W.twists.angular, v0 + i, 0, (R[i], R[3 + i], R[6 + i]))
    store3(W.O, b, 0, p)
    p = add(p, mv(R, load3(S.bodies.body_position, b, 0)))
    if S.bodies.body_turned[b] != 0.0:
        R = mm(R, load9(S.bodies.body_rotation, b, 0))
    store_pose(W.bodies, b, p, R)


@formula
def rotated_about_z(R, c, s):
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
def body_motion(S, W, b, v):
    """Velocities and bias accelerations of body b at its pose, from its parent's."""
    kind = S.tree.joint[b]
    v0 = S.tree.v[b]
    if kind == PLANAR:
        o = 0.0 * v[v0]
        zero = (o, o, o)
        store_motion(W.bodies, b, (o, o, v[v0 + 2]), (v[v0], v[v0 + 1], o), zero, zero)
    elif kind == FREE:
        o = 0.0 * v[v0]
        zero = (o, o, o)
        w = mv(load9(W.bodies.rotation, b, 0), (v[v0 + 3], v[v0 + 4], v[v0 + 5]))
        store_motion(W.bodies, b, w, (v[v0], v[v0 + 1], v[v0 + 2]), zero, zero)
    elif kind == POINT:
        o = 0.0 * v[v0]
        zero = (o, o, o)
        store_motion(W.bodies, b, zero, (v[v0], v[v0 + 1], v[v0 + 2] if S.tree.nv[b] == 3 else o), zero, zero)
    else:
        joint_motion(S, W, b, kind, v, v0)


@formula
def joint_motion(S, W, b, kind, v, v0):
    """The same for the other kinds: parent's motion at the reference point, plus the joint's, then to the body."""
    parent = S.tree.parent[b]
    o = 0.0 * W.bodies.position[b, 0]
    w = (o, o, o)
    u = w
    alpha = w
    a = w
    P = load3(W.O, b, 0)
    if parent >= 0:
        p, _, w, u, alpha, a = load_record(W.bodies, parent)
        r = sub(P, p)
        wr = cross(w, r)
        u = add(u, wr)
        a = add(a, add(cross(alpha, r), cross(w, wr)))
    if kind == PRISMATIC:
        slide = scale(v[v0], load3(W.twists.linear, v0, 0))
        u = add(u, slide)
        a = add(a, scale(2.0, cross(w, slide)))
    elif kind != WELD:
        spin = scale(v[v0], load3(W.twists.angular, v0, 0))
        if kind == SPHERICAL:
            y, z = load3(W.twists.angular, v0 + 1, 0), load3(W.twists.angular, v0 + 2, 0)
            spin = add(spin, add(scale(v[v0 + 1], y), scale(v[v0 + 2], z)))
        alpha = add(alpha, cross(w, spin))
        w = add(w, spin)
    r = sub(load3(W.bodies.position, b, 0), P)
    wr = cross(w, r)
    store_motion(W.bodies, b, w, add(u, wr), alpha, add(a, add(cross(alpha, r), cross(w, wr))))


@formula
def twist_column(S, W, b, k):
    """World twist of body b per unit of its k-th own velocity: (angular velocity, velocity of the reference point)."""
    kind = S.tree.joint[b]
    o = 0.0 * W.bodies.position[b, 0]
    l = o + 1.0
    zero = (o, o, o)
    if kind == REVOLUTE or kind == SPHERICAL:
        return load3(W.twists.angular, S.tree.v[b] + k, 0), zero
    if kind == PRISMATIC:
        return zero, load3(W.twists.linear, S.tree.v[b], 0)
    if kind == PLANAR and k == 2:
        return (o, o, l), zero
    if kind == FREE and k >= 3:
        return col(load9(W.bodies.rotation, b, 0), k - 3), zero
    if k == 0:
        return zero, (l, o, o)
    if k == 1:
        return zero, (o, l, o)
    return zero, (o, o, l)


@formula
def project_wrench(S, W, b, out, at, sign, force, torque, point):
    """Add ``sign`` times the power of a wrench (force and torque about ``point``) along body b's twist columns.

    This is the product of twist columns and wrench, without the zeros and ones.
    """
    kind = S.tree.joint[b]
    if kind == PRISMATIC:
        out[at] += sign * dot(load3(W.twists.linear, S.tree.v[b], 0), force)
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
        m = mtv(load9(W.bodies.rotation, b, 0), t)
        out[at] += sign * force[0]
        out[at + 1] += sign * force[1]
        out[at + 2] += sign * force[2]
        out[at + 3] += sign * m[0]
        out[at + 4] += sign * m[1]
        out[at + 5] += sign * m[2]
    elif kind == REVOLUTE:
        out[at] += sign * dot(load3(W.twists.angular, S.tree.v[b], 0), t)
    elif kind == SPHERICAL:
        for i in range(3):
            out[at + i] += sign * dot(load3(W.twists.angular, S.tree.v[b] + i, 0), t)


@formula
def quaternion_at(S, b):
    """Index in q of body b's quaternion, and in v of its angular velocity; (-1, -1) if it has none."""
    kind = S.tree.joint[b]
    if kind == FREE:
        return S.tree.q[b] + 3, S.tree.v[b] + 3
    if kind == SPHERICAL:
        return S.tree.q[b], S.tree.v[b]
    return -1, -1


@formula
def count_plain_coordinates(S, b):
    """Number of leading coordinates of body b whose rates are velocities."""
    kind = S.tree.joint[b]
    if kind == POINT:
        return S.tree.nv[b]
    return 0 if kind == SPHERICAL or kind == WELD else 1 if kind >= REVOLUTE else 3


@formula
def coordinate_rates(S, q, v, dq):
    """Compute qdot of every body from its velocities."""
    for b in range(S.tree.parent.shape[0]):
        q0 = S.tree.q[b]
        v0 = S.tree.v[b]
        for i in range(count_plain_coordinates(S, b)):
            dq[q0 + i] = v[v0 + i]
        k, w = quaternion_at(S, b)
        if k >= 0:
            o = 0.0 * v[w]
            d = quaternion_product((q[k], q[k + 1], q[k + 2], q[k + 3]), (o, v[w], v[w + 1], v[w + 2]))
            for i in range(4):
                dq[k + i] = 0.5 * d[i]


@formula
def velocities_from_rates(S, q, dq, v):
    """Compute v of every body from its qdot: the inverse of ``coordinate_rates``."""
    for b in range(S.tree.parent.shape[0]):
        q0 = S.tree.q[b]
        v0 = S.tree.v[b]
        for i in range(count_plain_coordinates(S, b)):
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
        for i in range(count_plain_coordinates(S, b)):
            q[q0 + i] += d[v0 + i]
        k, w = quaternion_at(S, b)
        if k >= 0:
            e = quaternion_product((q[k], q[k + 1], q[k + 2], q[k + 3]), cayley_quaternion((d[w], d[w + 1], d[w + 2])))
            for i in range(4):
                q[k + i] = e[i]


@formula
def normalise_quaternions(S, q):
    """Normalise every quaternion, in place."""
    for b in range(S.tree.parent.shape[0]):
        k, _ = quaternion_at(S, b)
        if k >= 0:
            square = q[k] * q[k] + q[k + 1] * q[k + 1] + q[k + 2] * q[k + 2] + q[k + 3] * q[k + 3]
            s = divide(1.0, sqrt(square))
            for i in range(4):
                q[k + i] *= s


@formula
def update_poses(S, W, q):
    """Positions and rotations of all bodies, parents first, and of the frames on them."""
    for b in range(S.tree.parent.shape[0]):
        body_pose(S, W, b, q)
    for k in range(S.sizes.ground_frames, S.sizes.moving_frames):
        p, R, _, _, _, _ = attached_record(
            load_record(W.bodies, S.frame_body[k]), load3(S.frames.position, k, 0), load9(S.frames.rotation, k, 0)
        )
        store_pose(W.frames, k, p, R)


@formula
def update_motions(S, W, v):
    """Velocities and bias accelerations at these poses."""
    for b in range(S.tree.parent.shape[0]):
        body_motion(S, W, b, v)
    update_frame_motions(S, W)


@formula
def update_frame_motions(S, W):
    """Velocities and bias accelerations of the frames, from their bodies'."""
    for k in range(S.sizes.ground_frames, S.sizes.moving_frames):
        _, _, w, u, alpha, a = attached_record(
            load_record(W.bodies, S.frame_body[k]), load3(S.frames.position, k, 0), load9(S.frames.rotation, k, 0)
        )
        store_motion(W.frames, k, w, u, alpha, a)


@formula
def update_frames(S, W):
    """Poses and motions of the frames in one pass."""
    for k in range(S.sizes.ground_frames, S.sizes.moving_frames):
        p, R, w, u, alpha, a = attached_record(
            load_record(W.bodies, S.frame_body[k]), load3(S.frames.position, k, 0), load9(S.frames.rotation, k, 0)
        )
        store_pose(W.frames, k, p, R)
        store_motion(W.frames, k, w, u, alpha, a)


@formula
def store_ground_frames(S, W):
    """Write the records of the frames on ground, once."""
    for k in range(S.sizes.ground_frames):
        p, R, w, v, alpha, a = stationary_record(
            load3(S.frames.position, k, 0), load9(S.frames.rotation, k, 0), 0.0 * S.frames.position[k, 0]
        )
        store_pose(W.frames, k, p, R)
        store_motion(W.frames, k, w, v, alpha, a)


class BodyTables(NamedTuple):
    """Tables of `System` that body kinematics is computed from."""

    tree: Tree
    bodies: Bodies


class BodyKinematics(NamedTuple):
    """Kinematics of the bodies at one state, as in `Work`."""

    bodies: KinematicRecords
    twists: Twists
    O: Float2


class BodyKinematicsOverTime(NamedTuple):
    """The same at all states, (bodies or columns, numbers, states)."""

    bodies: Float3  # in Python with the same names
    twists: Float3
    O: Float3


@kernel
def kinematics_over_time(S: BodyTables, W: BodyKinematics, q: Float2, v: Float2, out: BodyKinematicsOverTime) -> int:
    """Poses, velocities and bias accelerations at the coordinates q (n, nq) and velocities v (n, nv)."""
    for i in range(q.shape[0]):
        for b in range(S.tree.parent.shape[0]):
            body_pose(S, W, b, q[i])
            body_motion(S, W, b, v[i])
            for k in range(W.bodies.shape[1]):
                out.bodies[b, k, i] = W.bodies[b, k]
            for k in range(3):
                out.O[b, k, i] = W.O[b, k]
        for j in range(v.shape[1]):
            for k in range(W.twists.shape[1]):
                out.twists[j, k, i] = W.twists[j, k]
    return 0


def joint_velocities(x: Values, bodies: Mapping[str, BodyState], W: Any) -> np.ndarray:
    """Velocities (nv,) of the forest from the motions of its bodies.

    Those of tree joints are the least-squares fit to each body's motion relative to its parent's, at the poses in W.
    """
    s = x.structure
    v = free_velocities(x, bodies)
    names = {b: name for name, b in s.place.items()}
    for t in s.tree_joints.values():
        parent = names[int(x.system.tree.parent[t.links[0]])]
        _set_joint_velocities(x, W, t, bodies[names[t.child]], bodies.get(parent, GROUND_STATE), v)
    return v


def turned_angles(x: Values, W: Any, q: np.ndarray) -> dict[str, Any]:
    """Rotation angle of every body of a planar mechanism with its whole turns, at the poses in W, which belong to q.

    Returns numbers for q (nq,), arrays over time for (nq, n). Bodies start at their angles in the reference
    configuration.
    """
    S = x.system
    since: list[Any] = []  # rotation by the coordinates along each chain since the reference configuration
    for b in range(len(S.tree.parent)):
        total = since[S.tree.parent[b]] if S.tree.parent[b] >= 0 else 0.0
        for i in range(S.tree.nv[b]):
            at = S.tree.q[b] + i
            total = total + twist_column(S, W, b, i)[0][2] * (q[at] - x.q[at])
        since.append(total)
    out = {}
    for name, b in x.structure.place.items():
        if b >= 0 and S.tree.joint[b] == PLANAR:
            out[name] = q[S.tree.q[b] + 2]
        elif b >= 0:
            near, angle = x.bodies[name].angle + since[b], atan2(W.bodies.rotation[b, 3], W.bodies.rotation[b, 0])
            out[name] = angle + whole_turns(near, angle)
    return out


def _set_joint_velocities(x: Values, W: Any, t: TreeJoint, d: BodyState, parent: BodyState, v: np.ndarray) -> None:
    """Velocities of one tree joint from the motions of the bodies on both sides."""
    S = x.system
    seen = parent.v + _cross_array(parent.w, d.p - parent.p)
    columns, at = [], []
    for link in t.links:
        for k in range(int(S.tree.nv[link])):
            turn, shift = twist_column(S, W, link, k)
            arm = d.p - W.O[link]
            columns.append(np.array((*add(shift, cross(turn, arm)), *scale(x.length, turn))))
            at.append(int(S.tree.v[link]) + k)
    if len(at) == 1 and not np.iscomplexobj(columns[0]):
        rel = np.concatenate((d.v - seen, x.length * (d.w - parent.w)))
        v[at[0]] = (columns[0] @ rel) / (columns[0] @ columns[0])
    elif at:
        rel = np.r_[d.v - seen, x.length * (d.w - parent.w)]
        unit = S.velocity_units[at] / x.length  # columns of one unit
        v[at] = unit * least_squares(np.array(columns).T * unit, rel)


def least_squares(A: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Least-squares solution x of A x = b; complex parts carry derivatives, so nothing is conjugated."""
    if A.shape[1] == 1:
        return (A.T @ b) / (A.T @ A)[0]
    x = np.linalg.lstsq(A.real, b.real, rcond=None)[0]
    if not (np.iscomplexobj(A) or np.iscomplexobj(b)):
        return x
    P = np.linalg.pinv(A.real)
    dx = P @ (b.imag - A.imag @ x) + P @ P.T @ A.imag.T @ (b.real - A.real @ x)
    return x + 1j * dx


def _cross_array(a: Any, b: Any) -> np.ndarray:
    """Cross product; NumPy's own takes ten times as long."""
    return np.array(cross(a, b))
