"""Recursive dynamics of a forest: Newton-Euler, composite bodies, momenta, and their analytic derivatives.

Newton-Euler and composite bodies: Featherstone 2008, tables 5.1 and 6.2. Derivatives: in the manner of Carpentier and
Mansard (*Robotics: Science and Systems*, 2018), in world axes and for tree joints of any number of velocities.

All spatial vectors of one tree are taken about one point P, the reference point of its root, with components along the
world's axes: a motion is (angular velocity, velocity of the body's point at P), a force (moment about P, force). Sums
over subtrees then need no transformation. P is regarded as fixed.

Let S be the twist of one velocity d (per unit), v and a the velocity and the acceleration of a body (of ground: 0 and
-g), f = I a + v x* I v its force. Columns of a body turn with it, except translations along the world's axes (of FREE,
PLANAR and POINT): let vbar, abar be the velocity and acceleration of the parent plus those translations. With

    psi = vbar x S,    chi = abar x S + vbar x psi,    phi = psi + v x S  (without v x S for those translations)

a displacement along d changes the force of every body in the subtree by S x* f + I chi + B psi; a change of velocity
d changes it by I phi + B S. Here B psi = I (psi x v) + psi x* I v + v x* I psi depends on the angular part of psi
only: its moment is N psi, its force -2 l x psi with the linear momentum l. The displacement of S in the power of forces
at d and beyond cancels the term S x* f.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ..compiler.formulas import formula
from ..compiler.struct_layout import Float1, Float2, Int1
from ..math.vec import add, cross, dot, load3, load9, mtv, mv, scale, store3, store9, sub, symmetric
from ..tables.table_definitions import FREE, PLANAR, POINT, CompositeBodies, Tree
from .articulated_body import (
    add_symmetric,
    body_inertia,
    factor_articulated,
    load_symmetric,
    solve_articulated,
    store_symmetric,
)
from .kinematics import body_pose, normalise_quaternions, twist_column
from .loads import euler_moment


class VelocityPaths(NamedTuple):
    """The velocities of a forest, as a tree of their own [(nv,)]."""

    body: Int1  # the body that each moves first
    previous: Int1  # the next velocity on the path to ground; -1: none
    along_world: Int1  # 1: a translation along a world axis


class TreeDynamics(NamedTuple):
    """Workspace of recursive dynamics: spatial vectors about the reference point of each tree."""

    point: Float2  # (nb, 3): reference point of the root
    velocity: Float2  # (nb, 6)
    acceleration: Float2  # (nb, 6): includes that of gravity, upwards
    force: Float2  # (nb, 6): of a body; after the inward pass of its subtree
    composites: CompositeBodies  # (nb,): each subtree about the reference point of its root
    coriolis: Float2  # (nb, 12): N and l of the module's docstring; after the inward pass of its subtree
    column: Float2  # (nv, 6): twist per unit of each velocity
    psi: Float2  # (nv, 6)
    chi: Float2  # (nv, 6)
    phi: Float2  # (nv, 6)
    mass: Float2  # (nv, nv): the mass matrix, or its factor
    vector: Float2  # (3, nv): accelerations, forces, efforts of drivers
    coordinates: Float1  # (nq,): with normalised quaternions


def velocity_paths(tree: Tree) -> VelocityPaths:
    """Return the velocities of a forest in the order of their paths to ground."""
    body = np.repeat(np.arange(len(tree.parent)), tree.nv)
    previous = np.full(len(body), -1)
    last = np.full(len(tree.parent) + 1, -1)  # last velocity on the path to each body; ground is the last entry
    for b, parent in enumerate(tree.parent.tolist()):
        last[b] = last[parent]
        for d in range(int(tree.v[b]), int(tree.v[b] + tree.nv[b])):
            previous[d], last[b] = last[b], d
    number = np.arange(len(body)) - tree.v[body]
    kind = tree.joint[body]
    along = (kind == POINT) | ((kind == FREE) & (number < 3)) | ((kind == PLANAR) & (number < 2))
    return VelocityPaths(body.astype(np.int64), previous.astype(np.int64), along.astype(np.int64))


def tree_dynamics(bodies: int, coordinates: int, velocities: int, dtype: Any = float) -> TreeDynamics:
    """Workspace for a number of bodies, coordinates and velocities."""
    nb, nv = bodies, velocities

    def z(*shape: int) -> np.ndarray:
        return np.zeros(shape, dtype)

    return TreeDynamics(
        z(nb, 3), z(nb, 6), z(nb, 6), z(nb, 6), CompositeBodies.blank(nb, dtype=dtype), z(nb, 12), z(nv, 6), z(nv, 6),
        z(nv, 6), z(nv, 6), z(nv, nv), z(3, nv), z(coordinates),
    )  # fmt: skip


@formula
def load6(A, k):
    """Load a spatial vector from row k of a table."""
    return load3(A, k, 0), load3(A, k, 3)


@formula
def store6(A, k, x):
    """Write a spatial vector to row k of a table."""
    store3(A, k, 0, x[0])
    store3(A, k, 3, x[1])


@formula
def add6(a, b):
    """Sum of two spatial vectors."""
    return add(a[0], b[0]), add(a[1], b[1])


@formula
def scale6(s, a):
    """Multiple of a spatial vector."""
    return scale(s, a[0]), scale(s, a[1])


@formula
def dot6(a, b):
    """Power of a force along a motion."""
    return dot(a[0], b[0]) + dot(a[1], b[1])


@formula
def cross_motion(a, b):
    """Rate of a motion b that moves with a."""
    return cross(a[0], b[0]), add(cross(a[0], b[1]), cross(a[1], b[0]))


@formula
def cross_force(a, f):
    """Rate of a force f that moves with a."""
    return add(cross(a[0], f[0]), cross(a[1], f[1])), cross(a[0], f[1])


@formula
def inertia_times(I, a):
    """Momentum of an inertia (mass, first moment, inertia about P) at a motion."""
    m, h, J = I
    return add(symmetric(J, a[0]), cross(h, a[1])), sub(scale(m, a[1]), cross(h, a[0]))


@formula
def load_inertia(D, b):
    """Mass, first moment and inertia stored for body b."""
    I = D.composites
    return I.mass[b], load3(I.first_moment, b, 0), load_symmetric(I.inertia, b)


@formula
def place_bodies(S, W, D, q):
    """Poses of all bodies, the points that spatial vectors refer to, and the twists of all velocities.

    ``q`` is not changed; its quaternions may have any length.
    """
    for i in range(q.shape[0]):
        D.coordinates[i] = q[i]
    normalise_quaternions(S, D.coordinates)
    for b in range(S.tree.parent.shape[0]):
        body_pose(S, W, b, D.coordinates)
        a = S.tree.parent[b]
        at = load3(W.O, b, 0)
        P = at if a < 0 else load3(D.point, a, 0)
        store3(D.point, b, 0, P)
        for k in range(S.tree.nv[b]):
            w, u = twist_column(S, W, b, k)
            store6(D.column, S.tree.v[b] + k, (w, add(u, cross(w, sub(P, at)))))


@formula
def parent_motion(S, D, b):
    """Velocity and acceleration of the parent of body b; of ground 0 and -g."""
    a = S.tree.parent[b]
    o = 0.0 * D.point[b, 0]
    zero = (o, o, o)
    velocity = (zero, zero)
    acceleration = (zero, (o - S.gravity[0], o - S.gravity[1], o - S.gravity[2]))
    if a >= 0:
        velocity, acceleration = load6(D.velocity, a), load6(D.acceleration, a)
    return velocity, acceleration


@formula
def move_body(S, V, D, b, v, vdot):
    """Velocity and acceleration of body b, from its parent's."""
    velocity, acceleration = parent_motion(S, D, b)
    v0 = S.tree.v[b]
    for d in range(v0, v0 + S.tree.nv[b]):
        velocity = add6(velocity, scale6(v[d], load6(D.column, d)))
    for d in range(v0, v0 + S.tree.nv[b]):
        column = load6(D.column, d)
        acceleration = add6(acceleration, scale6(vdot[d], column))
        if V.along_world[d] == 0:
            acceleration = add6(acceleration, scale6(v[d], cross_motion(velocity, column)))
    store6(D.velocity, b, velocity)
    store6(D.acceleration, b, acceleration)


@formula
def move_bodies(S, V, D, v):
    """Velocities of all bodies at the poses in W, and accelerations where the generalised ones are zero."""
    rest = D.vector[0]
    for d in range(rest.shape[0]):
        rest[d] = 0.0 * D.column[d, 0]
    for b in range(S.tree.parent.shape[0]):
        move_body(S, V, D, b, v, rest)


@formula
def inertial_force(S, W, D, b):
    """Force that the motion of body b needs, by Newton's and Euler's laws about its centre of mass."""
    R, r = load9(W.bodies.rotation, b, 0), sub(load3(W.bodies.position, b, 0), load3(D.point, b, 0))
    (w, u), (alpha, a) = load6(D.velocity, b), load6(D.acceleration, b)
    a = add(a, add(cross(alpha, r), cross(w, add(u, cross(w, r)))))
    force = scale(S.bodies.mass[b], a)
    moment = mv(R, euler_moment(load9(S.bodies.inertia, b, 0), mtv(R, w), mtv(R, alpha)))
    return add(moment, cross(r, force)), force


@formula
def newton_euler(S, W, V, D, v, vdot, tau):
    """Generalised forces that accelerations vdot need at the poses in W: M vdot + bias - gravity (recursively).

    Forces of springs, dampers and other elements are not included.
    """
    n = S.tree.parent.shape[0]
    for b in range(n):
        move_body(S, V, D, b, v, vdot)
        store6(D.force, b, inertial_force(S, W, D, b))
    for b in range(n - 1, -1, -1):
        force = load6(D.force, b)
        for d in range(S.tree.v[b], S.tree.v[b] + S.tree.nv[b]):
            tau[d] = dot6(load6(D.column, d), force) + S.rotor_inertia[d] * vdot[d]
        a = S.tree.parent[b]
        if a >= 0:
            store6(D.force, a, add6(load6(D.force, a), force))


@formula
def forward_dynamics(S, W, V, D, v, tau, vdot):
    """Accelerations due to generalised forces tau at the poses in W, in O(n). Returns 0, or 1 + a velocity's index.

    The index is that of a velocity that moves no inertia.
    """
    f = D.vector[1]
    for d in range(tau.shape[0]):
        vdot[d] = 0.0 * tau[d]
    newton_euler(S, W, V, D, v, vdot, f)
    for d in range(tau.shape[0]):
        f[d] = tau[d] - f[d]
    status = factor_articulated(S, W)
    if status == 0:
        solve_articulated(S, W, f, vdot, D.vector[2])
    return status


@formula
def composite_inertias(S, W, D):
    """Inertia of every subtree about the reference point of its tree."""
    I = D.composites
    n = S.tree.parent.shape[0]
    for b in range(n):
        m, h, J = body_inertia(S, W, b, load3(D.point, b, 0))
        I.mass[b] = m
        store3(I.first_moment, b, 0, h)
        store_symmetric(I.inertia, b, J)
    for b in range(n - 1, -1, -1):
        a = S.tree.parent[b]
        if a >= 0:
            I.mass[a] += I.mass[b]
            store3(I.first_moment, a, 0, add(load3(I.first_moment, a, 0), load3(I.first_moment, b, 0)))
            store_symmetric(I.inertia, a, add_symmetric(load_symmetric(I.inertia, a), load_symmetric(I.inertia, b)))


@formula
def mass_matrix(S, V, D, M):
    """The whole mass matrix, symmetric, from the composite inertias; zero for velocities of different branches."""
    for d in range(V.body.shape[0]):
        momentum = inertia_times(load_inertia(D, V.body[d]), load6(D.column, d))
        e = d
        while e >= 0:
            M[d, e] = dot6(load6(D.column, e), momentum)
            M[e, d] = M[d, e]
            beyond = V.previous[e]
            for k in range(beyond + 1, e):
                M[d, k] = 0.0
                M[k, d] = 0.0
            e = beyond
        M[d, d] = M[d, d] + S.rotor_inertia[d]


@formula
def factor_mass_matrix(V, D):
    """Factor the mass matrix as L^T diag L in place (Featherstone 2008, table 6.3)."""
    for k in range(V.body.shape[0] - 1, -1, -1):
        i = V.previous[k]
        while i >= 0:
            a = D.mass[k, i] / D.mass[k, k]
            j = i
            while j >= 0:
                D.mass[i, j] -= a * D.mass[k, j]
                j = V.previous[j]
            D.mass[k, i] = a
            i = V.previous[i]


@formula
def solve_mass_matrix(V, D, X, c):
    """Replace column c of X by M^-1 times it."""
    n = V.body.shape[0]
    for k in range(n - 1, -1, -1):
        j = V.previous[k]
        while j >= 0:
            X[j, c] -= D.mass[k, j] * X[k, c]
            j = V.previous[j]
    for k in range(n):
        X[k, c] = X[k, c] / D.mass[k, k]
        j = V.previous[k]
        while j >= 0:
            X[k, c] -= D.mass[k, j] * X[j, c]
            j = V.previous[j]


@formula
def body_coriolis(I, velocity):
    """N and l of one body: moment and force of B psi are N psi and -2 l x psi for an angular psi."""
    m, h, J = I
    w, u = velocity
    l = sub(scale(m, u), cross(h, w))
    Jw = symmetric(J, w)
    trace = J[0] + J[3] + J[5]
    x = sub(scale(trace, w), scale(2.0, Jw))
    # columns of N: N e = -2 J (w x e) + x x e + 2 h x (e x u)
    o = 0.0 * m
    one = o + 1.0
    first = coriolis_column(J, h, w, u, x, (one, o, o))
    second = coriolis_column(J, h, w, u, x, (o, one, o))
    third = coriolis_column(J, h, w, u, x, (o, o, one))
    return (
        first[0], second[0], third[0], first[1], second[1], third[1], first[2], second[2], third[2],
    ), l  # fmt: skip


@formula
def coriolis_column(J, h, w, u, x, e):
    """N e for a unit vector e."""
    return add(add(scale(-2.0, symmetric(J, cross(w, e))), cross(x, e)), scale(2.0, cross(h, cross(e, u))))


@formula
def composite_coriolis(S, W, D):
    """N and l of every subtree, at the velocities in D."""
    n = S.tree.parent.shape[0]
    for b in range(n):
        N, l = body_coriolis(body_inertia(S, W, b, load3(D.point, b, 0)), load6(D.velocity, b))
        store9(D.coriolis, b, 0, N)
        store3(D.coriolis, b, 9, l)
    for b in range(n - 1, -1, -1):
        a = S.tree.parent[b]
        if a >= 0:
            for i in range(12):
                D.coriolis[a, i] += D.coriolis[b, i]


@formula
def coriolis_times(D, b, w):
    """B of the subtree of body b times a motion with the angular velocity w."""
    return mv(load9(D.coriolis, b, 0), w), scale(-2.0, cross(load3(D.coriolis, b, 9), w))


@formula
def coriolis_transposed(D, b, column):
    """Angular part of B^T of the subtree of body b times a motion; the other part is zero."""
    turned = scale(2.0, cross(load3(D.coriolis, b, 9), column[1]))
    return add(mtv(load9(D.coriolis, b, 0), column[0]), turned)


@formula
def displacement_terms(S, V, D, v, vdot):
    """Store psi, chi and phi of every velocity, at the velocities and accelerations in D."""
    for b in range(S.tree.parent.shape[0]):
        vbar, abar = parent_motion(S, D, b)
        v0 = S.tree.v[b]
        for d in range(v0, v0 + S.tree.nv[b]):
            if V.along_world[d] == 1:
                column = load6(D.column, d)
                vbar, abar = add6(vbar, scale6(v[d], column)), add6(abar, scale6(vdot[d], column))
        for d in range(v0, v0 + S.tree.nv[b]):
            column = load6(D.column, d)
            psi = cross_motion(vbar, column)
            store6(D.psi, d, psi)
            store6(D.chi, d, add6(cross_motion(abar, column), cross_motion(vbar, psi)))
            if V.along_world[d] == 0:
                psi = add6(psi, cross_motion(load6(D.velocity, b), column))
            store6(D.phi, d, psi)


@formula
def newton_euler_derivatives(S, W, V, D, v, vdot, by_position, by_velocity, by_acceleration):
    """Derivatives of `newton_euler` along the velocities, by them, and by accelerations (the mass matrix), after it.

    ``by_position[e, d]`` is the derivative of force e for a displacement of the bodies along velocity d.
    """
    composite_inertias(S, W, D)
    composite_coriolis(S, W, D)
    displacement_terms(S, V, D, v, vdot)
    mass_matrix(S, V, D, by_acceleration)
    clear(by_position, V.body.shape[0], V.body.shape[0])
    clear(by_velocity, V.body.shape[0], V.body.shape[0])
    for d in range(V.body.shape[0]):
        b = V.body[d]
        column, psi, chi, phi = load6(D.column, d), load6(D.psi, d), load6(D.chi, d), load6(D.phi, d)
        inertia = load_inertia(D, b)
        displaced = add6(inertia_times(inertia, chi), coriolis_times(D, b, psi[0]))
        with_force = add6(displaced, cross_force(column, load6(D.force, b)))
        moved = add6(inertia_times(inertia, phi), coriolis_times(D, b, column[0]))
        for e in range(S.tree.v[b], S.tree.v[b] + S.tree.nv[b]):
            other = load6(D.column, e)
            by_position[e, d] = dot6(other, with_force) if V.along_world[e] == 1 else dot6(other, displaced)
            by_velocity[e, d] = dot6(other, moved)
        momentum, coriolis = inertia_times(inertia, column), coriolis_transposed(D, b, column)
        e = V.previous[S.tree.v[b]]
        while e >= 0:
            other = load6(D.column, e)
            by_position[e, d] = dot6(other, with_force)
            by_velocity[e, d] = dot6(other, moved)
            by_position[d, e] = dot6(load6(D.chi, e), momentum) + dot(load3(D.psi, e, 0), coriolis)
            by_velocity[d, e] = dot6(load6(D.phi, e), momentum) + dot(other[0], coriolis)
            e = V.previous[e]


@formula
def forward_dynamics_derivatives(V, D, by_position, by_velocity, inverse):
    """Turn derivatives of `newton_euler` at the accelerations of forces tau into those of `forward_dynamics`.

    d vdot = -M^-1 d tau by position and velocity; ``inverse`` is M^-1, the derivative by tau. M is in D.mass.
    """
    factor_mass_matrix(V, D)
    n = V.body.shape[0]
    for d in range(n):
        for e in range(n):
            by_position[d, e] = -by_position[d, e]
            by_velocity[d, e] = -by_velocity[d, e]
            inverse[d, e] = 0.0 * by_velocity[d, e]
        inverse[d, d] = 1.0 + inverse[d, d]
    for c in range(n):
        solve_mass_matrix(V, D, by_position, c)
        solve_mass_matrix(V, D, by_velocity, c)
        solve_mass_matrix(V, D, inverse, c)


@formula
def total_momentum(S, W, D, v, out):
    """Centre of mass, momentum, angular momentum about it, kinetic and potential energy of all bodies, into ``out``.

    The potential of gravity is zero at the world's origin. `newton_euler` has computed the velocities. Rotors have
    kinetic energy at the generalised velocities v, and no momentum.
    """
    o = 0.0 * D.point[0, 0]
    zero = (o, o, o)
    mass, moment, momentum, angular, kinetic = o, zero, zero, zero, o
    for b in range(S.tree.parent.shape[0]):
        P, velocity = load3(D.point, b, 0), load6(D.velocity, b)
        I = body_inertia(S, W, b, P)
        p = inertia_times(I, velocity)
        mass += I[0]
        moment = add(moment, add(I[1], scale(I[0], P)))
        momentum = add(momentum, p[1])
        angular = add(angular, add(p[0], cross(P, p[1])))
        kinetic += 0.5 * dot6(velocity, p)
        for d in range(S.tree.v[b], S.tree.v[b] + S.tree.nv[b]):
            kinetic += 0.5 * S.rotor_inertia[d] * v[d] * v[d]
    centre = scale(1.0 / mass, moment)
    store3(out, 0, 0, centre)
    store3(out, 0, 3, momentum)
    store3(out, 0, 6, sub(angular, cross(centre, momentum)))
    out[0, 9] = kinetic
    out[0, 10] = -dot(moment, (S.gravity[0], S.gravity[1], S.gravity[2]))


@formula
def centroidal_momentum_matrix(S, V, D, out):
    """Momentum (rows 0 to 2) and angular momentum about the centre of mass (3 to 5) per unit of each velocity.

    The composite inertias in D are those of its poses.
    """
    o = 0.0 * D.point[0, 0]
    mass, moment = o, (o, o, o)
    for b in range(S.tree.parent.shape[0]):
        if S.tree.parent[b] < 0:
            m, h, _ = load_inertia(D, b)
            mass += m
            moment = add(moment, add(h, scale(m, load3(D.point, b, 0))))
    centre = scale(1.0 / mass, moment)
    for d in range(V.body.shape[0]):
        b = V.body[d]
        n, f = inertia_times(load_inertia(D, b), load6(D.column, d))
        n = add(n, cross(sub(load3(D.point, b, 0), centre), f))
        for i in range(3):
            out[i, d] = f[i]
            out[3 + i, d] = n[i]


@formula
def last_velocity(S, b):
    """The last velocity on the path from ground to body b; -1 if it does not move."""
    while b >= 0 and S.tree.nv[b] == 0:
        b = S.tree.parent[b]
    return S.tree.v[b] + S.tree.nv[b] - 1 if b >= 0 else -1


@formula
def frame_jacobian(S, W, V, D, b, offset, out):
    """Velocity (rows 0 to 2) and angular velocity (3 to 5) of a point of body b per unit of each velocity.

    ``offset`` is its position in the body's axes, from the centre of mass.
    """
    clear(out, 6, V.body.shape[0])
    d = last_velocity(S, b)
    if d < 0:
        return
    r = sub(add(load3(W.bodies.position, b, 0), mv(load9(W.bodies.rotation, b, 0), offset)), load3(D.point, b, 0))
    while d >= 0:
        w, u = load6(D.column, d)
        u = add(u, cross(w, r))
        for i in range(3):
            out[i, d] = u[i]
            out[3 + i, d] = w[i]
        d = V.previous[d]


@formula
def frame_jacobian_rate(S, W, V, D, b, offset, out):
    """Rate of `frame_jacobian`, at the velocities in D."""
    clear(out, 6, V.body.shape[0])
    d = last_velocity(S, b)
    if d < 0:
        return
    r = sub(add(load3(W.bodies.position, b, 0), mv(load9(W.bodies.rotation, b, 0), offset)), load3(D.point, b, 0))
    spin, shift = load6(D.velocity, b)
    moves = add(shift, cross(spin, r))
    while d >= 0:
        column = load6(D.column, d)
        u = cross(column[0], moves)
        if V.along_world[d] == 0:
            w_dot, u_dot = cross_motion(load6(D.velocity, V.body[d]), column)
            u = add(u, add(u_dot, cross(w_dot, r)))
            for i in range(3):
                out[3 + i, d] = w_dot[i]
        for i in range(3):
            out[i, d] = u[i]
        d = V.previous[d]


@formula
def clear(out, rows, columns):
    """Write zeros."""
    for i in range(rows):
        for k in range(columns):
            out[i, k] = 0.0
