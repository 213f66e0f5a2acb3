"""Residual of the equations at any state, accelerations and multipliers, its terms, and derivatives of forces.

    r = M vdot - f - G^T lam,  g,  G v - nu,  G vdot - gamma

The residual is what is differentiated by complex steps. Solves, projections and Newton iterations are unsuitable for
that: the regularised solve amplifies an inconsistent perturbation. M vdot comes from the inertial wrenches of the
actual accelerations (recursive Newton-Euler: Luh, Walker and Paul 1980; Featherstone 2008, section 5.3), so no matrix
is needed.

Jacobians are assembled from the terms of r: velocities that do not occur together in any term are stepped together
(Curtis, Powell and Reid 1974), so that a Jacobian takes as many evaluations as the widest term has velocities.

Slopes of forces (stiffness and damping, by differences) serve methods that treat forces implicitly and need them only
roughly. A force between frames has up to six directions: the line through both origins where the force acts along that
line, otherwise translations and rotations of M along F's axes.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..compiler.formulas import formula
from ..compiler.kernels import StructBuffer, first_order_kernel
from ..math.vec import add, col, cross, dot, load3, load9, mv, norm, scale, store3, sub
from ..tables.table_definitions import (
    ALONG,
    BETWEEN,
    FREE,
    PLANAR,
    SLIDING,
    ComplexSystem,
    ComplexWork,
)
from .calls import CONSTRAINT_GAPS, INERTIAL_TERMS, RESIDUAL_DRIVEN, RESIDUAL_STEPS, RESIDUAL_TERMS, ResidualBatch
from .element_dispatch import effort, force_kind, row_biases, row_values, whole_rows
from .kinematics import (
    body_motion,
    body_pose,
    load_record,
    project_wrench,
    retract,
    twist_column,
    update_frame_motions,
    update_frames,
    update_poses,
)
from .loads import (
    apply_efforts,
    apply_forces,
    contact_friction,
    effort_along,
    force_law,
    force_row,
    gather_forces,
    inertial_wrenches,
    loads_end,
    reaction_loads,
    sliding_sign,
    wrench_at,
    wrench_between_frames,
)
from .rows import count_measured, row_times, update_controllers
from .stabilization import set_prescribed


@formula
def inertial_terms(S, W, t, vdot, out):
    """Write inertial wrench and weight of every body, projected on its own and its ancestors' velocities.

    Inertias of rotors join the term of the velocity with which they turn.

    Returns the number of terms.
    """
    for i in range(out.shape[0]):
        out[i] = 0.0
    inertial_wrenches(S, W, t, W.trial.rate)
    at = 0
    for b in range(S.tree.parent.shape[0]):
        force, torque = load3(W.body_wrenches.force, b, 0), load3(W.body_wrenches.torque, b, 0)
        v0 = S.tree.v[b]
        for k in range(S.tree.nv[b]):
            out[at + k] += S.rotor_inertia[v0 + k] * vdot[v0 + k]
        at = wrench_terms(S, W, b, out, at, -1.0, force, torque, load3(W.bodies.position, b, 0))
    return at


@formula
def residual_terms(S, W, t, vdot, lam, out):
    """Write the terms of r; kinematics, rows and loads are known. Returns their number.

    The order is that of `simulation/jacobian_pattern.py`: bodies; of each force between frames the side of M,
    then that of F; rows; forces along measured quantities.
    """
    at = inertial_terms(S, W, t, vdot, out)
    for k in range(S.forces.F.shape[0]):
        if S.forces.family[k] == BETWEEN:
            _, M, force, torque, _ = wrench_between_frames(S, W, t, k)
            at = wrench_terms(S, W, S.frame_body[S.forces.M[k]], out, at, -1.0, force, torque, M[0])
            at = wrench_terms(S, W, S.frame_body[S.forces.F[k]], out, at, 1.0, force, torque, M[0])
    nr = S.rows.law.shape[0]
    for r in range(nr):
        at = row_terms(S, W, r, -lam[r], out, at)
    for k in range(S.forces.F.shape[0]):
        if S.forces.family[k] == ALONG:
            s, _ = effort_along(S, W, t, k)
            at = row_terms(S, W, nr + S.forces.F[k], -s, out, at)
        elif S.forces.family[k] == SLIDING:
            a, b, _ = contact_friction(S, W, k)
            at = row_terms(S, W, nr + S.forces.F[k], -a, out, at)
            if S.forces.M[k] >= 0:
                at = row_terms(S, W, nr + S.forces.M[k], -b, out, at)
    return at


@formula
def wrench_terms(S, W, b, out, at, sign, force, torque, point):
    """Project a wrench on body b on its velocities, then on those of its ancestors. Returns the next free place."""
    while b >= 0:
        project_wrench(S, W, b, out, at, sign, force, torque, point)
        at += S.tree.nv[b]
        b = S.tree.parent[b]
    return at


@formula
def row_terms(S, W, r, s, out, at):
    """Project the force s along row r on the velocities. Returns the next free place."""
    for e in range(S.row_start[r], S.row_start[r + 1]):
        out[at] = s * W.G[e]
        at += 1
    return at


# columns of the slopes: stiffness, damping and the force itself along up to six directions; the number of directions of
# a force between frames, which the caller sets
STIFFNESS, DAMPING, FORCE_ALONG, DIRECTIONS, SLOPE_WIDTH = 0, 6, 12, 18, 19
DIFFERENCE_STEP = 1e-6  # relative to the mechanism's length, or a radian; for rates also relative to themselves


@formula
def force_slopes(S, W, t, out):
    """Stiffness and damping (columns of ``out[k]``, see above) of every force at the state in W."""
    for k in range(S.forces.F.shape[0]):
        for i in range(DIRECTIONS):
            out[k, i] = 0.0
        if S.forces.family[k] == 1:
            effort_slopes(S, W, t, k, out)
        else:
            wrench_slopes(S, W, t, k, out)


@formula
def effort_slopes(S, W, t, k, out):
    """Stiffness and damping of force k along a measured quantity."""
    m = S.forces.F[k]
    x, rate = W.sensed.value[m], W.sensed.rate[m]
    d = DIFFERENCE_STEP * S.units[m]
    e = d * W.options.rate + DIFFERENCE_STEP * abs(rate)
    pressed = W.sensed.load[S.forces.load[k]] if S.forces.load[k] >= 0 else 0.0
    for j in range(5):
        dx = d if j == 1 else -d if j == 2 else 0.0
        dr = e if j == 3 else -e if j == 4 else 0.0
        laws = (force_law(S, W, k, 0, (t, x + dx, rate + dr)), 0.0, sliding_sign(S, W, k, rate))
        s = effort(force_kind(S, k), force_row(S.force_parameters, k), x + dx, rate + dr, laws, pressed)
        if j == 0:
            out[k, FORCE_ALONG] = s
        out[k, STIFFNESS] -= s * dx / (2.0 * d * d)
        out[k, DAMPING] -= s * dr / (2.0 * e * e)


@formula
def wrench_slopes(S, W, t, k, out):
    """Stiffness and damping of force k between frames, by central differences of the pose and motion of M."""
    F = load_record(W.frames, S.forces.F[k])
    p, R, w, v, alpha, a = load_record(W.frames, S.forces.M[k])
    speed = S.scales.length * W.options.rate + norm(sub(v, F[3]))
    n = int(out[k, DIRECTIONS])
    for j in range(4 * n):
        i = j // 4
        up = 1.0 if j % 2 == 0 else -1.0
        axis = probe_direction(F, p, n, i)
        d = DIFFERENCE_STEP * (S.scales.length if i < 3 else 1.0)
        e = DIFFERENCE_STEP * (speed if i < 3 else speed / S.scales.length)
        moved, moving = (up * d, 0.0) if j % 4 < 2 else (0.0, up * e)
        if i < 3:
            M = (add(p, scale(moved, axis)), R, w, add(v, scale(moving, axis)), alpha, a)
        else:
            M = (p, tilted_rotation(R, scale(moved, axis)), add(w, scale(moving, axis)), v, alpha, a)
        force, torque, _ = wrench_at(S, W, t, k, F, M)
        s = dot(force, axis) if i < 3 else dot(torque, axis)
        out[k, STIFFNESS + i] -= s * moved / (2.0 * d * d)
        out[k, DAMPING + i] -= s * moving / (2.0 * e * e)
        out[k, FORCE_ALONG + i] += 0.25 * s


@formula
def probe_direction(F, p, n, i):
    """Direction i of n for the slopes of a force between frames; p is the origin of M."""
    if n == 1:
        line = sub(p, F[0])
        size = norm(line)
        return scale(1.0 / size, line) if size > 0.0 else line
    return col(F[1], i % 3)


@formula
def tilted_rotation(R, a):
    """R rotated by a small rotation vector."""
    x, y, z = col(R, 0), col(R, 1), col(R, 2)
    x, y, z = add(x, cross(a, x)), add(y, cross(a, y)), add(z, cross(a, z))
    return (x[0], y[0], z[0], x[1], y[1], z[1], x[2], y[2], z[2])


@formula
def residuals(S, W, bench, task):
    """Residuals at several states, each a finite step from the given one; see `ResidualBatch`.

    ``bench.out`` is filled with r, g, G v - nu, G vdot - gamma; then value, rate and acceleration of every measured
    quantity. With RESIDUAL_STEPS the steps are taken as given. With RESIDUAL_DRIVEN the coordinates of tree joints that
    drivers prescribe follow their laws, whatever the steps are. CONSTRAINT_GAPS does the same, and computes g and G v -
    nu only. With RESIDUAL_TERMS the terms of r (`residual_terms`) are stored behind all others in place of r, with
    INERTIAL_TERMS those of the bodies only.
    """
    nq = S.sizes.coordinates
    nv = W.velocities.solved.shape[0]
    nr = S.rows.law.shape[0]
    known = nv + 3 * nr + 3 * count_measured(S)
    behind = known + bench.steps.shape[1] - (3 * nv + 1)
    a = W.velocities.scratch_2
    p = W.trial.state
    for n in range(bench.steps.shape[0]):
        t = bench.t[0] + bench.steps[n, 3 * nv]
        for i in range(p.shape[0]):
            p[i] = bench.state[i]
        retract(S, p[:nq], bench.steps[n, :nv])
        for d in range(nv):
            p[nq + d] += bench.steps[n, nv + d]
            a[d] = bench.vdot[d] + bench.steps[n, 2 * nv + d]
        for c in range(3 * nv + 1, bench.steps.shape[1]):
            p[nq + c - 2 * nv - 1] += bench.steps[n, c]
        if task == RESIDUAL_DRIVEN or task == CONSTRAINT_GAPS:
            set_prescribed(S, W, t, p[:nq], p[nq : nq + nv])
            for b in range(S.tree.parent.shape[0]):
                if S.tree.law[b] >= 0:
                    a[S.tree.v[b]] = W.velocities.prescribed[S.tree.v[b]]
        if task == CONSTRAINT_GAPS:
            update_poses(S, W, p[:nq])
            row_values(S, W, t, p[nq + nv :])
            for k in range(nr):
                bench.out[n, nv + k] = W.rows.value[k]
                bench.out[n, nv + nr + k] = row_times(S, W, k, p[nq : nq + nv]) - W.rows.nu[k]
        elif task == INERTIAL_TERMS:
            for b in range(S.tree.parent.shape[0]):
                body_pose(S, W, b, p[:nq])
                accelerated_motion(S, W, b, p[nq : nq + nv], a)
            inertial_terms(S, W, t, a, bench.out[n, behind:])
        else:
            update_accelerated_kinematics(S, W, t, p, a, task == RESIDUAL_STEPS or S.sensor_drivers.row.shape[0] > 0)
            if task == RESIDUAL_TERMS:
                store_residual_terms(S, W, t, p, a, bench.lam, bench.out[n], behind)
            else:
                store_residual(S, W, t, p, a, bench.lam, bench.out[n])
            for c in range(known, behind):
                bench.out[n, c] = -W.trial.rate[c - known]
    return 0


@formula
def residual(S, W, t, p, vdot, lam, out):
    """Residual at one state, using the loops that the engine already contains, so that less code is compiled."""
    nq = S.sizes.coordinates
    v = p[nq : nq + W.velocities.solved.shape[0]]
    z = p[nq + W.velocities.solved.shape[0] :]
    update_poses(S, W, p[:nq])
    row_values(S, W, t, z)
    for b in range(S.tree.parent.shape[0]):
        accelerated_motion(S, W, b, v, vdot)
    update_frame_motions(S, W)
    row_biases(S, W, t, v, z)  # the bias at the true accelerations is the acceleration itself
    store_residual(S, W, t, p, vdot, lam, out)


@formula
def update_accelerated_kinematics(S, W, t, p, vdot, whole):
    """The same kinematics and rows in one pass; accelerations of measured quantities only if ``whole``."""
    nq = S.sizes.coordinates
    v = p[nq : nq + W.velocities.solved.shape[0]]
    for b in range(S.tree.parent.shape[0]):
        body_pose(S, W, b, p[:nq])
        accelerated_motion(S, W, b, v, vdot)
    update_frames(S, W)
    whole_rows(S, W, t, v, p[nq + W.velocities.solved.shape[0] :], whole)


@formula
def store_residual(S, W, t, p, vdot, lam, out):
    """Store the residual of the equations with these accelerations and multipliers; kinematics and rows are known."""
    nq = S.sizes.coordinates
    nv = W.velocities.solved.shape[0]
    nr = S.rows.law.shape[0]
    v = p[nq : nq + nv]
    for k in range(nr):
        out[nv + k] = W.rows.value[k]
        out[nv + nr + k] = row_times(S, W, k, v) - W.rows.nu[k]
        out[nv + 2 * nr + k] = -W.rows.gamma[k]
    nm = count_measured(S)
    for m in range(nm):
        out[nv + 3 * nr + m] = W.sensed.value[m]
        out[nv + 3 * nr + nm + m] = W.sensed.rate[m]
        out[nv + 3 * nr + 2 * nm + m] = W.sensed.bias[m]
    f = W.velocities.applied
    apply_multipliers(S, W, t, p, lam)
    inertial_wrenches(S, W, t, W.trial.rate)
    apply_forces(S, W, t, W.trial.rate)
    gather_forces(S, W, f)
    apply_efforts(S, W, t, W.trial.rate, f)
    for d in range(nv):
        out[d] = S.rotor_inertia[d] * vdot[d] - f[d]
    for k in range(nr):
        for e in range(S.row_start[k], S.row_start[k + 1]):
            out[S.column[e]] -= W.G[e] * lam[k]


@formula
def store_residual_terms(S, W, t, p, vdot, lam, out, first):
    """Store G v - nu, and from ``first`` on the terms of r."""
    nv, nr = W.velocities.solved.shape[0], S.rows.law.shape[0]
    v = p[S.sizes.coordinates : S.sizes.coordinates + nv]
    for k in range(nr):
        out[nv + nr + k] = row_times(S, W, k, v) - W.rows.nu[k]
    apply_multipliers(S, W, t, p, lam)
    residual_terms(S, W, t, vdot, lam, out[first:])


@formula
def apply_multipliers(S, W, t, p, lam):
    """Set the inputs of forces besides motions: multipliers, loads of joints, states of controllers."""
    for k in range(S.rows.law.shape[0]):
        W.rows.multiplier[k] = lam[k]
    reaction_loads(S, W)
    for n in range(2 * count_measured(S), loads_end(S, W)):
        W.sensed.load[n] = W.sensed.returned[n]
    update_controllers(S, W, t, p[S.sizes.coordinates + W.velocities.solved.shape[0] :], W.trial.rate)


@formula
def accelerated_motion(S, W, b, v, vdot):
    """Velocity and true acceleration of body b at its pose in W, from its parent's."""
    body_motion(S, W, b, v)
    kind = S.tree.joint[b]
    v0 = S.tree.v[b]
    alpha = load3(W.bodies.bias_angular_acceleration, b, 0)
    a = load3(W.bodies.bias_acceleration, b, 0)
    if kind == PLANAR:
        a = add(a, (vdot[v0], vdot[v0 + 1], 0.0 * vdot[v0]))
        alpha = add(alpha, (0.0 * vdot[v0], 0.0 * vdot[v0], vdot[v0 + 2]))
    elif kind == FREE:
        a = add(a, (vdot[v0], vdot[v0 + 1], vdot[v0 + 2]))
        alpha = add(alpha, mv(load9(W.bodies.rotation, b, 0), (vdot[v0 + 3], vdot[v0 + 4], vdot[v0 + 5])))
    else:
        arm = sub(load3(W.bodies.position, b, 0), load3(W.O, b, 0))
        for k in range(S.tree.nv[b]):
            x, u = twist_column(S, W, b, k)
            turn = scale(vdot[v0 + k], x)
            alpha = add(alpha, turn)
            a = add(a, add(scale(vdot[v0 + k], u), cross(turn, arm)))
    store3(W.bodies.angular_acceleration, b, 0, alpha)
    store3(W.bodies.acceleration, b, 0, a)


@first_order_kernel
def residuals_kernel(
    S: ComplexSystem, W: ComplexWork, bench: ResidualBatch, _: ResidualBatch, __: ResidualBatch, task: int
) -> int:
    """`residuals` as a kernel; compiled for complex numbers, when first needed."""
    return residuals(S, W, bench, task)


def evaluate_residuals(
    S: Any, W: Any, t: complex, state: np.ndarray, vdot: np.ndarray, lam: np.ndarray, steps: np.ndarray, out: np.ndarray
) -> None:
    """Residuals at states near one state, see ``residuals``; nan where they cannot be evaluated."""
    bench = ResidualBatch(np.array([t]), state, vdot, lam, steps, out)
    out[:] = np.nan
    b = StructBuffer(bench)
    residuals_kernel(S, W, b, b, b, RESIDUAL_STEPS)
