"""The equations themselves at any state, accelerations and multipliers, with nothing solved: what is differentiated.

    r = M vdot - f - G^T lam,  g,  G v - nu,  G vdot - gamma

A solve, a projection or a Newton loop is no place for complex steps (the regularised solve amplifies an inconsistent
perturbation); this has none. M vdot comes from the inertial wrenches of the actual accelerations (recursive
Newton-Euler: Luh, Walker and Paul 1980; Featherstone 2008, section 5.3), so no matrix is needed either.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..compiler.buffers import StructBuffer
from ..compiler.formulas import formula
from ..compiler.kernels import first_order_kernel
from ..math.vec import add, cross, load3, load9, mv, put3, scale, sub
from ..tables.system import (
    BIAS,
    FREE,
    LOAD,
    PLANAR,
    RATE,
    RETURNED,
    VALUE,
    ComplexSystem,
    ComplexWork,
)
from .control import control
from .dispatch import row_biases, row_values, whole_rows
from .friction import loads_end, reaction_loads
from .kinematics import frame_motions, frames, poses
from .loads import efforts, forces, gather, inertial
from .parts import parts, pushes
from .prescribed import prepare
from .rows import measured, row_times
from .tasks import ALONG, GAPS, PARTS, PUSHES, STEPS, Bench
from .tree import column, motion, pose, retract


@formula
def residuals(S, W, bench, task):
    """The residual at several states, each a finite step from the given one; see `Bench`.

    ``bench.out`` is filled with r, g, G v - nu, G vdot - gamma; then value, rate and acceleration of every measured
    quantity. With STEPS steps are taken as they are. With ALONG what drivers prescribe of tree joints is as their laws
    say, whatever the steps are; with GAPS also, and only g and G v - nu are found. With PARTS the terms of r stand
    behind all others in place of r (`parts`), with PUSHES those of the bodies alone.
    """
    nq = S.sizes.coordinates
    nv = W.velocities.solved.shape[0]
    nr = S.rows.law.shape[0]
    known = nv + 3 * nr + 3 * measured(S)
    behind = known + bench.steps.shape[1] - (3 * nv + 1)
    a = W.velocities.scratch_2
    p = W.y[0]
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
        if task == ALONG or task == GAPS:
            prepare(S, W, t, p[:nq], p[nq : nq + nv])
            for b in range(S.tree.parent.shape[0]):
                if S.tree.law[b] >= 0:
                    a[S.tree.v[b]] = W.velocities.prescribed[S.tree.v[b]]
        if task == GAPS:
            poses(S, W, p[:nq])
            row_values(S, W, t, p[nq + nv :])
            for k in range(nr):
                bench.out[n, nv + k] = W.rows.value[k]
                bench.out[n, nv + nr + k] = row_times(S, W, k, p[nq : nq + nv]) - W.rows.nu[k]
        elif task == PUSHES:
            for b in range(S.tree.parent.shape[0]):
                pose(S, W, b, p[:nq])
                accelerated(S, W, b, p[nq : nq + nv], a)
            pushes(S, W, bench.out[n, behind:])
        else:
            at_once(S, W, t, p, a, task == STEPS or S.sensor_drivers.row.shape[0] > 0)
            if task == PARTS:
                missed_by_parts(S, W, t, p, bench.lam, bench.out[n], behind)
            else:
                missed(S, W, t, p, bench.lam, bench.out[n])
            for c in range(known, behind):
                bench.out[n, c] = -W.y[1, c - known]
    return 0


@formula
def residual(S, W, t, p, vdot, lam, out):
    """The residual at one state, by the engine's own loops: no more of its code."""
    nq = S.sizes.coordinates
    v = p[nq : nq + W.velocities.solved.shape[0]]
    z = p[nq + W.velocities.solved.shape[0] :]
    poses(S, W, p[:nq])
    row_values(S, W, t, z)
    for b in range(S.tree.parent.shape[0]):
        accelerated(S, W, b, v, vdot)
    frame_motions(S, W)
    row_biases(S, W, t, v, z)  # the bias at true accelerations is the acceleration itself
    missed(S, W, t, p, lam, out)


@formula
def at_once(S, W, t, p, vdot, whole):
    """The same kinematics and rows in one pass; without accelerations of what is measured unless ``whole``."""
    nq = S.sizes.coordinates
    v = p[nq : nq + W.velocities.solved.shape[0]]
    for b in range(S.tree.parent.shape[0]):
        pose(S, W, b, p[:nq])
        accelerated(S, W, b, v, vdot)
    frames(S, W)
    whole_rows(S, W, t, v, p[nq + W.velocities.solved.shape[0] :], whole)


@formula
def missed(S, W, t, p, lam, out):
    """What the equations miss with these multipliers, kinematics and rows being known."""
    nq = S.sizes.coordinates
    nv = W.velocities.solved.shape[0]
    nr = S.rows.law.shape[0]
    v = p[nq : nq + nv]
    for k in range(nr):
        out[nv + k] = W.rows.value[k]
        out[nv + nr + k] = row_times(S, W, k, v) - W.rows.nu[k]
        out[nv + 2 * nr + k] = -W.rows.gamma[k]
    nm = measured(S)
    for m in range(nm):
        out[nv + 3 * nr + m] = W.sensed[VALUE, m]
        out[nv + 3 * nr + nm + m] = W.sensed[RATE, m]
        out[nv + 3 * nr + 2 * nm + m] = W.sensed[BIAS, m]
    f = W.velocities.applied
    told(S, W, t, p, lam)
    inertial(S, W)
    forces(S, W, t, W.y[1])
    gather(S, W, f)
    efforts(S, W, t, W.y[1], f)
    for d in range(nv):
        out[d] = -f[d]
    for k in range(nr):
        for e in range(S.row_start[k], S.row_start[k + 1]):
            out[S.column[e]] -= W.G[e] * lam[k]


@formula
def missed_by_parts(S, W, t, p, lam, out, first):
    """G v - nu, and from ``first`` on the terms of r."""
    nv, nr = W.velocities.solved.shape[0], S.rows.law.shape[0]
    v = p[S.sizes.coordinates : S.sizes.coordinates + nv]
    for k in range(nr):
        out[nv + nr + k] = row_times(S, W, k, v) - W.rows.nu[k]
    told(S, W, t, p, lam)
    parts(S, W, t, lam, out[first:])


@formula
def told(S, W, t, p, lam):
    """What forces are told besides motions: multipliers, loads of joints, states of controllers."""
    for k in range(S.rows.law.shape[0]):
        W.rows.multiplier[k] = lam[k]
    reaction_loads(S, W)
    for n in range(2 * measured(S), loads_end(S, W)):
        W.sensed[LOAD, n] = W.sensed[RETURNED, n]
    control(S, W, t, p[S.sizes.coordinates + W.velocities.solved.shape[0] :], W.y[1])


@formula
def accelerated(S, W, b, v, vdot):
    """Velocity and true acceleration of body b at its pose in W, its parent's being known."""
    motion(S, W, b, v)
    kind = S.tree.joint[b]
    v0 = S.tree.v[b]
    alpha = load3(W.BK, b, 18)
    a = load3(W.BK, b, 21)
    if kind == PLANAR:
        a = add(a, (vdot[v0], vdot[v0 + 1], 0.0 * vdot[v0]))
        alpha = add(alpha, (0.0 * vdot[v0], 0.0 * vdot[v0], vdot[v0 + 2]))
    elif kind == FREE:
        a = add(a, (vdot[v0], vdot[v0 + 1], vdot[v0 + 2]))
        alpha = add(alpha, mv(load9(W.BK, b, 3), (vdot[v0 + 3], vdot[v0 + 4], vdot[v0 + 5])))
    else:
        arm = sub(load3(W.BK, b, 0), load3(W.O, b, 0))
        for k in range(S.tree.nv[b]):
            x, u = column(S, W, b, k)
            turn = scale(vdot[v0 + k], x)
            alpha = add(alpha, turn)
            a = add(a, add(scale(vdot[v0 + k], u), cross(turn, arm)))
    put3(W.BK, b, 18, alpha)
    put3(W.BK, b, 21, a)


@first_order_kernel
def stepped(S: ComplexSystem, W: ComplexWork, bench: Bench, _: Bench, __: Bench, task: int) -> int:
    """`residuals` behind an address; compiled for complex numbers, when first needed."""
    return residuals(S, W, bench, task)


def residual_kernel(
    S: Any, W: Any, t: complex, state: np.ndarray, vdot: np.ndarray, lam: np.ndarray, steps: np.ndarray, out: np.ndarray
) -> None:
    """The equations at states near one state, see ``residuals``; nan where they cannot be evaluated."""
    bench = Bench(np.array([t]), state, vdot, lam, steps, out)
    out[:] = np.nan
    b = StructBuffer(bench)
    stepped(S, W, b, b, b, STEPS)
