"""Mass matrix of a forest by composite rigid bodies, and x = M^-1 f in O(n) by the articulated-body recursion.

Composite rigid bodies: Walker and Orin 1982; Featherstone 2008, table 6.2. Articulated bodies: Featherstone 2008,
chapter 7, split into a factorisation and solves with it. Where every body is connected to ground by FREE, PLANAR or
POINT, M is constant and block diagonal and none of this runs.

Wrenches and twists are taken about the reference points of the tree joints, W.O, with components along the world's
axes. From a body to its parent there is then a shift and no rotation, and mechanisms far from the world's origin lose
no accuracy. A joint of several velocities is treated as a chain of joints with one velocity each, all at its point: one
twist column X is eliminated at a time. Let

    I = [J H; H^T K]: (angular velocity, velocity of the point) -> (moment, force)

be the articulated inertia of everything beyond the joint. With U = I X and D = X . U + J, where J is the inertia of
rotors that turn with the velocity, the parent sees I - U U^T / D. M itself is not formed. Gravity, gyroscopic terms
and bias accelerations are contained in f, so no velocity occurs here. A velocity that a driver prescribes is not
eliminated: its acceleration is given, and the driver's effort is computed.

Parents precede their children in the body table. Where a body directly follows its parent, as in a chain, the
quantities passed between the two stay in registers; all others are stored in row b of
`ArticulatedBodies`. `Pivots` holds U, D and 1 / D of each velocity.
"""

from __future__ import annotations

from ..compiler.formulas import formula
from ..math.scalar import positive
from ..math.vec import add, cross, dot, load3, load9, mtv, mv, scale, store3, store9, sub, symmetric
from ..tables.table_definitions import POINT, REVOLUTE
from .kinematics import twist_column


@formula
def load_symmetric(A, k):
    """Load the symmetric matrix (xx, xy, xz, yy, yz, zz) in row k of a table."""
    return (A[k, 0], A[k, 1], A[k, 2], A[k, 3], A[k, 4], A[k, 5])


@formula
def store_symmetric(A, k, a):
    """Write a symmetric matrix into row k of a table."""
    A[k, 0] = a[0]
    A[k, 1] = a[1]
    A[k, 2] = a[2]
    A[k, 3] = a[3]
    A[k, 4] = a[4]
    A[k, 5] = a[5]


@formula
def add_symmetric(a, b):
    """Sum of two symmetric matrices."""
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2], a[3] + b[3], a[4] + b[4], a[5] + b[5])


@formula
def rotated_inertia(R, I):
    """R I R^T of a symmetric I, as I_zz times the identity plus the contribution of the first two columns of R."""
    x, y = I[0] - I[8], I[4] - I[8]
    u = (x * R[0], x * R[3], x * R[6])
    w = (y * R[1], y * R[4], y * R[7])
    if I[1] != 0.0 or I[2] != 0.0 or I[5] != 0.0:
        a, b, c = I[1], 2.0 * I[2], 2.0 * I[5]
        u = (u[0] + a * R[1] + b * R[2], u[1] + a * R[4] + b * R[5], u[2] + a * R[7] + b * R[8])
        w = (w[0] + a * R[0] + c * R[2], w[1] + a * R[3] + c * R[5], w[2] + a * R[6] + c * R[8])
        return (
            u[0] * R[0] + w[0] * R[1] + I[8],
            0.5 * (u[0] * R[3] + u[1] * R[0] + w[0] * R[4] + w[1] * R[1]),
            0.5 * (u[0] * R[6] + u[2] * R[0] + w[0] * R[7] + w[2] * R[1]),
            u[1] * R[3] + w[1] * R[4] + I[8],
            0.5 * (u[1] * R[6] + u[2] * R[3] + w[1] * R[7] + w[2] * R[4]),
            u[2] * R[6] + w[2] * R[7] + I[8],
        )
    return (
        u[0] * R[0] + w[0] * R[1] + I[8],
        u[0] * R[3] + w[0] * R[4],
        u[0] * R[6] + w[0] * R[7],
        u[1] * R[3] + w[1] * R[4] + I[8],
        u[1] * R[6] + w[1] * R[7],
        u[2] * R[6] + w[2] * R[7] + I[8],
    )


@formula
def body_inertia(S, W, b, point):
    """Mass, first moment and inertia of body b about a point."""
    m = S.bodies.mass[b]
    if m == 0.0:
        return m, (m, m, m), (m, m, m, m, m, m)
    J = rotated_inertia(load9(W.bodies.rotation, b, 0), load9(S.bodies.inertia, b, 0))
    r = sub(load3(W.bodies.position, b, 0), point)
    return m, scale(m, r), shifted_inertia(J, scale(0.5 * m, r), r)


@formula
def shifted_inertia(J, e, d):
    """J + 2 (e . d) 1 - (e d^T + d e^T): inertia about a point displaced by -d from the reference point of J.

    ``e`` is the first moment about the point halfway between the two.
    """
    x, y, z = 2.0 * e[0] * d[0], 2.0 * e[1] * d[1], 2.0 * e[2] * d[2]
    return (
        J[0] + (y + z),
        J[1] - (e[0] * d[1] + e[1] * d[0]),
        J[2] - (e[0] * d[2] + e[2] * d[0]),
        J[3] + (x + z),
        J[4] - (e[1] * d[2] + e[2] * d[1]),
        J[5] + (x + y),
    )


@formula
def store_root_twists(S, W, b):
    """Store the twist columns of body b in `Work.twists` if it is a root: FREE, PLANAR or POINT.

    Those of all other bodies are there already.
    """
    if S.tree.joint[b] <= POINT:
        for k in range(S.tree.nv[b]):
            w, v = twist_column(S, W, b, k)
            store3(W.twists.angular, S.tree.v[b] + k, 0, w)
            store3(W.twists.linear, S.tree.v[b] + k, 0, v)


@formula
def update_composite_bodies(S, W):
    """Mass, first moment and inertia of every subtree about the reference point of its root.

    Also stores the vector from the reference point of the root's parent to that of the root.
    """
    C = W.composites
    n = S.tree.parent.shape[0]
    for b in range(n):
        store_root_twists(S, W, b)
        m, h, J = body_inertia(S, W, b, load3(W.O, b, 0))
        C.mass[b] = m
        store3(C.first_moment, b, 0, h)
        store_symmetric(C.inertia, b, J)
    for b in range(n - 1, -1, -1):
        a = S.tree.parent[b]
        if a >= 0:
            m, h = C.mass[b], load3(C.first_moment, b, 0)
            d = sub(load3(W.O, b, 0), load3(W.O, a, 0))
            to = scale(m, d)
            J = shifted_inertia(load_symmetric(C.inertia, b), add(h, scale(0.5, to)), d)
            C.mass[a] += m
            store3(C.first_moment, a, 0, add(load3(C.first_moment, a, 0), add(h, to)))
            store_symmetric(C.inertia, a, add_symmetric(load_symmetric(C.inertia, a), J))
            store3(C.offset, b, 0, d)


@formula
def mass_entries(S, W):
    """Entries of M in the order of `MassEntries`: each velocity with itself and with those of the body's ancestors.

    An entry is the momentum of the subtree at unit velocity, projected on the twist column of the body or ancestor.
    """
    update_composite_bodies(S, W)
    C = W.composites
    e = 0
    for b in range(S.tree.parent.shape[0]):
        h = load3(C.first_moment, b, 0)
        for d in range(S.tree.v[b], S.tree.v[b] + S.tree.nv[b]):
            w, v = load3(W.twists.angular, d, 0), load3(W.twists.linear, d, 0)
            force = cross(w, h)
            moment = symmetric(load_symmetric(C.inertia, b), w)
            if S.tree.joint[b] != REVOLUTE:
                force, moment = add(force, scale(C.mass[b], v)), add(moment, cross(h, v))
            a = b
            while a >= 0:
                a0 = S.tree.v[a]
                if S.tree.joint[a] == REVOLUTE:
                    W.M[e] = dot(load3(W.twists.angular, a0, 0), moment)
                    if a0 == d:
                        W.M[e] += S.rotor_inertia[d]
                    e += 1
                else:
                    for i in range(a0, min(a0 + S.tree.nv[a], d + 1)):
                        W.M[e] = dot(load3(W.twists.angular, i, 0), moment) + dot(load3(W.twists.linear, i, 0), force)
                        if i == d:
                            W.M[e] += S.rotor_inertia[d]
                        e += 1
                moment = add(moment, cross(load3(C.offset, a, 0), force))
                a = S.tree.parent[a]


PIVOT_ROUNDING = 1e-14  # relative to the inertia with all joints beyond locked; a smaller pivot counts as zero


@formula
def factor_articulated(S, W):
    """Factor the equations of motion of a forest at the kinematics now in W.

    Returns
    -------
    int
        0, or 1 + the index of the velocity that moves no inertia.
    """
    A = W.articulated
    n = S.tree.parent.shape[0]
    o = 0.0 * W.O[0, 0]
    for b in range(n):
        A.stored[b] = o
    I = zero_inertia(o)
    for b in range(n - 1, -1, -1):
        store_root_twists(S, W, b)
        I = add_body_inertia(S, W, b, I)
        status, I = eliminate_velocities(S, W, b, I)
        if status != 0:
            return status
        a = S.tree.parent[b]
        if a >= 0:
            I = shifted_articulated(I, sub(load3(W.O, b, 0), load3(W.O, a, 0)))
        if a != b - 1:
            if a >= 0:
                add_pending_inertia(A, a, I)
            I = zero_inertia(o)
    return 0


@formula
def zero_inertia(o):
    """Zero articulated inertia: J, H, K; eliminated part of the trace of J; mass."""
    zero = (o, o, o, o, o, o)
    return zero, (o, o, o, o, o, o, o, o, o), zero, o, o


@formula
def add_inertias(I, other):
    """Sum of two inertias."""
    J, H, K, lost, mass = I
    J2, H2, K2, lost2, mass2 = other
    x, y, z = add(H[0:3], H2[0:3]), add(H[3:6], H2[3:6]), add(H[6:9], H2[6:9])
    return add_symmetric(J, J2), (*x, *y, *z), add_symmetric(K, K2), lost + lost2, mass + mass2


@formula
def pending_inertia(A, b):
    """Sum of the inertias that children have stored for body b."""
    return (
        load_symmetric(A.rotational, b),
        load9(A.coupling, b, 0),
        load_symmetric(A.linear, b),
        A.eliminated[b],
        A.mass[b],
    )


@formula
def add_pending_inertia(A, b, I):
    """Add an inertia to the one stored for body b."""
    if A.stored[b].real > 0.0:
        I = add_inertias(I, pending_inertia(A, b))
    store_symmetric(A.rotational, b, I[0])
    store9(A.coupling, b, 0, I[1])
    store_symmetric(A.linear, b, I[2])
    A.eliminated[b] = I[3]
    A.mass[b] = I[4]
    A.stored[b] = 1.0


@formula
def add_body_inertia(S, W, b, I):
    """Articulated inertia of body b: ``I``, its own inertia and the inertia stored by other children."""
    J, H, K, lost, mass = I
    m, h, own = body_inertia(S, W, b, load3(W.O, b, 0))
    H = (H[0], H[1] - h[2], H[2] + h[1], H[3] + h[2], H[4], H[5] - h[0], H[6] - h[1], H[7] + h[0], H[8])
    I = add_symmetric(J, own), H, (K[0] + m, K[1], K[2], K[3] + m, K[4], K[5] + m), lost, mass + m
    if W.articulated.stored[b].real > 0.0:
        I = add_inertias(I, pending_inertia(W.articulated, b))
    return I


@formula
def eliminate_velocities(S, W, b, I):
    """Eliminate the velocities of body b from the inertia, the last one first. Returns (status, remaining inertia).

    An inertia along a velocity counts as zero if it is not above the rounding errors of earlier eliminations.
    """
    J, H, K, lost, mass = I
    size = J[0] + J[3] + J[5] + lost
    v0 = S.tree.v[b]
    for d in range(v0 + S.tree.nv[b] - 1, v0 - 1, -1):
        w, v = load3(W.twists.angular, d, 0), load3(W.twists.linear, d, 0)
        t, f = symmetric(J, w), mtv(H, w)
        D = dot(w, t)
        least = size
        if v[0] != 0.0 or v[1] != 0.0 or v[2] != 0.0:
            t, f = add(t, mv(H, v)), add(f, symmetric(K, v))
            D = dot(w, t) + dot(v, f)
            least = dot(w, w) * size + dot(v, v) * mass
        store3(W.pivots.torque, d, 0, t)
        store3(W.pivots.force, d, 0, f)
        D = D + S.rotor_inertia[d]
        W.pivots.inertia[d] = D
        if S.tree.law[b] < 0:
            if not positive(D - PIVOT_ROUNDING * least):
                return 1 + d, (J, H, K, lost, mass)
            r = 1.0 / D
            W.pivots.inverse_inertia[d] = r
            y, z = scale(r, t), scale(r, f)
            J, H, K = downdate_symmetric(J, t, y), downdate_coupling(H, t, z), downdate_symmetric(K, f, z)
            lost = lost + dot(t, y)
    return 0, (J, H, K, lost, mass)


@formula
def downdate_symmetric(J, a, b):
    """J - a b^T, symmetric."""
    return (
        J[0] - a[0] * b[0],
        J[1] - a[0] * b[1],
        J[2] - a[0] * b[2],
        J[3] - a[1] * b[1],
        J[4] - a[1] * b[2],
        J[5] - a[2] * b[2],
    )


@formula
def downdate_coupling(H, a, b):
    """H - a b^T."""
    return (
        *sub(H[0:3], scale(a[0], b)),
        *sub(H[3:6], scale(a[1], b)),
        *sub(H[6:9], scale(a[2], b)),
    )


@formula
def shifted_articulated(I, d):
    """Articulated inertia about a point displaced by -d: H + d~ K, J + d~ (H + d~ K)^T - H d~."""
    J, H, K, lost, mass = I
    x = add((H[0], H[3], H[6]), cross(d, (K[0], K[1], K[2])))
    y = add((H[1], H[4], H[7]), cross(d, (K[1], K[3], K[4])))
    z = add((H[2], H[5], H[8]), cross(d, (K[2], K[4], K[5])))
    J = (
        J[0] + (d[1] * z[0] - d[2] * y[0]) + (d[1] * H[2] - d[2] * H[1]),
        J[1] + (d[1] * z[1] - d[2] * y[1]) + (d[2] * H[0] - d[0] * H[2]),
        J[2] + (d[1] * z[2] - d[2] * y[2]) + (d[0] * H[1] - d[1] * H[0]),
        J[3] + (d[2] * x[1] - d[0] * z[1]) + (d[2] * H[3] - d[0] * H[5]),
        J[4] + (d[2] * x[2] - d[0] * z[2]) + (d[0] * H[4] - d[1] * H[3]),
        J[5] + (d[0] * y[2] - d[1] * x[2]) + (d[0] * H[7] - d[1] * H[6]),
    )
    return J, (x[0], y[0], z[0], x[1], y[1], z[1], x[2], y[2], z[2]), K, lost, mass


@formula
def solve_articulated(S, W, f, x, effort):
    """Solve M x = f with the factor in W.

    Parameters
    ----------
    S : System
    W : Work
    f : array, shape (nv,)
        Generalised forces [N, N m] without those of the drivers; not changed.
    x : array, shape (nv,)
        Accelerations, output. Where a driver prescribes one, its value is input.
    effort : array, shape (nv,)
        Output at the velocities that a driver prescribes: the generalised force (M x - f)[d] that the driver adds.
        The other entries are not changed.
    """
    A = W.articulated
    n = S.tree.parent.shape[0]
    o = 0.0 * W.O[0, 0]
    zero = (o, o, o)
    for b in range(n):
        if A.stored[b].real > 0.0:
            store3(A.torque, b, 0, zero)
            store3(A.force, b, 0, zero)
    moment, force = zero, zero
    for b in range(n - 1, -1, -1):
        moment, force = pass_wrench_inwards(S, W, b, (moment, force), f, x, effort)
        a = S.tree.parent[b]
        if a >= 0:
            moment = add(moment, cross(sub(load3(W.O, b, 0), load3(W.O, a, 0)), force))
        if a != b - 1:
            if a >= 0:
                store3(A.torque, a, 0, add(load3(A.torque, a, 0), moment))
                store3(A.force, a, 0, add(load3(A.force, a, 0), force))
            moment, force = zero, zero
    turn, shift = zero, zero
    for b in range(n):
        a = S.tree.parent[b]
        if a < 0:
            turn, shift = zero, zero
        else:
            if a != b - 1:
                turn, shift = load3(A.angular_acceleration, a, 0), load3(A.acceleration, a, 0)
            shift = add(shift, cross(turn, sub(load3(W.O, b, 0), load3(W.O, a, 0))))
        turn, shift = pass_acceleration_outwards(S, W, b, (turn, shift), x, effort)
        if A.stored[b].real > 0.0:
            store3(A.angular_acceleration, b, 0, turn)
            store3(A.acceleration, b, 0, shift)


@formula
def pass_wrench_inwards(S, W, b, wrench, f, x, effort):
    """Wrench that body b passes to its parent, from the wrench passed to it and the stored one.

    The remaining forces along its own velocities go to x, or to effort where a driver prescribes them.
    """
    t, p = wrench
    if W.articulated.stored[b].real > 0.0:
        t, p = add(t, load3(W.articulated.torque, b, 0)), add(p, load3(W.articulated.force, b, 0))
    v0 = S.tree.v[b]
    for d in range(v0 + S.tree.nv[b] - 1, v0 - 1, -1):
        u = f[d] - (dot(load3(W.twists.angular, d, 0), t) + dot(load3(W.twists.linear, d, 0), p))
        if S.tree.law[b] < 0:
            x[d] = u
            s = u * W.pivots.inverse_inertia[d]
        else:
            effort[d] = u
            s = x[d]
        t = add(t, scale(s, load3(W.pivots.torque, d, 0)))
        p = add(p, scale(s, load3(W.pivots.force, d, 0)))
    return t, p


@formula
def pass_acceleration_outwards(S, W, b, parent_acceleration, x, effort):
    """Accelerations of body b: along its velocities (stored in x) and as a body, given its parent's acceleration."""
    w, v = parent_acceleration
    for d in range(S.tree.v[b], S.tree.v[b] + S.tree.nv[b]):
        s = dot(load3(W.pivots.torque, d, 0), w) + dot(load3(W.pivots.force, d, 0), v)
        if S.tree.law[b] < 0:
            x[d] = (x[d] - s) * W.pivots.inverse_inertia[d]
        else:
            effort[d] = W.pivots.inertia[d] * x[d] + s - effort[d]
        w = add(w, scale(x[d], load3(W.twists.angular, d, 0)))
        v = add(v, scale(x[d], load3(W.twists.linear, d, 0)))
    return w, v
