"""Energies, accelerations and their errors at recorded states of a motion: the figures by which a result is judged.

Every state is evaluated once by the engine, in its general form. At some of the states the equations of motion are
solved as well.
"""

from __future__ import annotations

from math import nan
from typing import NamedTuple

from ..compiler.formulas import call, dispatch_by_kind, formula
from ..compiler.kernels import kernel
from ..compiler.struct_layout import Float1, Float2, Float3
from ..forces import EFFORTS, ENERGIES, WRENCHES
from ..math.scalar import magnitude
from ..math.vec import add, cross, dot, load3, load9, mtv, mv, norm, scale, store3, sub
from ..numerics.integrators.butcher_tableaux import Tableau
from ..numerics.integrators.time_loop import StepState
from ..tables.table_definitions import ALONG, BETWEEN, POINT, SCHUR, System, Work
from .calls import MOTION, POSITION, OutputBuffer, set_state
from .kinematics import load_record, twist_column
from .loads import force_row
from .rows import direction_column

energy_between = dispatch_by_kind(
    __name__, "energy_between", "par, F, M", {k: f for k, f in ENERGIES.items() if k in WRENCHES}, "0.0"
)
"""Energy stored in a force between frames; 0 for kinds that store none."""

energy_along = dispatch_by_kind(
    __name__, "energy_along", "par, x", {k: f for k, f in ENERGIES.items() if k in EFFORTS}, "0.0"
)
"""Energy stored in a force along a measured quantity; 0 for kinds that store none."""


class RecordedFigures(NamedTuple):
    """States at n recorded times, and figures of nb bodies and nk forces; nan where nothing was evaluated."""

    states: Float2  # (n, 1 + ny + nv): time, state, accelerations
    modes: Float2  # (n, 3 nw): mode, held value and direction of every switch; (0, 0) if nothing switches
    metric: Float1  # (nr,): 1 for rows in metres, 0 for angles
    kinetic: Float2  # (n, nb) [J]
    gravity: Float2  # (n, nb): potential energy [J]
    elastic: Float2  # (n, nk): energy stored in each force [J]; nan for formulas of users
    position: Float3  # (n, nb, 3): mass centres
    speed: Float2  # (n, nb): of the mass centres
    gain: Float2  # (n, nb): kinetic energy that the accelerations give a body at rest in a second [J]
    vdot: Float2  # (n, nv): accelerations
    violation: Float1  # (n,): |G vdot - gamma| relative to its terms


@formula
def record_energies(S, W, v, out, n):
    """Record the energies of all bodies and forces at the state in W, whose velocities are v."""
    gravity = (S.gravity[0], S.gravity[1], S.gravity[2])
    for b in range(S.tree.parent.shape[0]):
        p, u, m = load3(W.bodies.position, b, 0), load3(W.bodies.velocity, b, 0), S.bodies.mass[b]
        w = mtv(load9(W.bodies.rotation, b, 0), load3(W.bodies.angular_velocity, b, 0))
        out.kinetic[n, b] = 0.5 * (m * dot(u, u) + dot(w, mv(load9(S.bodies.inertia, b, 0), w)))
        for d in range(S.tree.v[b], S.tree.v[b] + S.tree.nv[b]):
            out.kinetic[n, b] += 0.5 * S.rotor_inertia[d] * v[d] * v[d]
        out.gravity[n, b] = -m * dot(gravity, p)
        out.speed[n, b] = norm(u)
        for i in range(3):
            out.position[n, b, i] = p[i]
    for k in range(S.forces.F.shape[0]):
        par, kind = force_row(S.force_parameters, k), S.forces.kind[k]
        out.elastic[n, k] = 0.0
        if S.force_code[k] != 0:
            out.elastic[n, k] = nan
        elif S.forces.family[k] == BETWEEN:
            F, M = load_record(W.frames, S.forces.F[k]), load_record(W.frames, S.forces.M[k])
            out.elastic[n, k] = energy_between(kind, par, F, M)
        elif S.forces.family[k] == ALONG:
            out.elastic[n, k] = energy_along(kind, par, W.sensed.value[S.forces.F[k]])


@formula
def record_gain(S, W, x, out, n):
    """Record the kinetic energy that accelerations x would give bodies at rest; what they add to the
    bias accelerations goes to `Work.body_wrenches`.

    Returns the largest of these accelerations and gravity: [1/s^2], lengths by the mechanism's length.
    """
    largest = norm((S.gravity[0], S.gravity[1], S.gravity[2])) / S.scales.length
    for b in range(S.tree.parent.shape[0]):
        o = 0.0 * S.bodies.mass[b]
        p, parent = load3(W.bodies.position, b, 0), S.tree.parent[b]
        alpha = a = (o, o, o)  # beyond the bias accelerations
        if parent >= 0:
            alpha = load3(W.body_wrenches.angular_acceleration, parent, 0)
            a = load3(W.body_wrenches.acceleration, parent, 0)
            a = add(a, cross(alpha, sub(p, load3(W.bodies.position, parent, 0))))
        arm = sub(p, load3(W.O, b, 0))
        for i in range(S.tree.nv[b]):
            turn, shift = twist_column(S, W, b, i)
            alpha = add(alpha, scale(x[S.tree.v[b] + i], turn))
            a = add(a, scale(x[S.tree.v[b] + i], add(shift, cross(turn, arm))))
        store3(W.body_wrenches.angular_acceleration, b, 0, alpha)
        store3(W.body_wrenches.acceleration, b, 0, a)
        a = add(a, load3(W.bodies.bias_acceleration, b, 0))
        alpha = mtv(load9(W.bodies.rotation, b, 0), add(alpha, load3(W.bodies.bias_angular_acceleration, b, 0)))
        out.gain[n, b] = 0.5 * (S.bodies.mass[b] * dot(a, a) + dot(alpha, mv(load9(S.bodies.inertia, b, 0), alpha)))
        for d in range(S.tree.v[b], S.tree.v[b] + S.tree.nv[b]):
            out.gain[n, b] += 0.5 * S.rotor_inertia[d] * x[d] * x[d]
        largest = max(largest, norm(a) / S.scales.length, norm(alpha))
    return largest


@formula
def relative_violation(S, W, x, metric, least):
    """|G x - gamma| relative to its terms, lengths by the mechanism's length.

    The terms are at least ``least``: accelerations of bodies, whose contributions to a row may cancel in joint
    coordinates. They include the accelerations that forces would cause without constraints: where reactions cancel
    forces, as at rest, accelerations are only the rounding of those.
    """
    free = W.velocities.scratch_1
    for e in range(S.mass_entries.row.shape[0]):
        if S.mass_entries.row[e] == S.mass_entries.column[e]:
            free[S.mass_entries.row[e]] = 1.0 / W.M[e]
    if S.sizes.solver == SCHUR:
        free_body_masses(S, free)
    for d in range(x.shape[0]):
        free[d] *= magnitude(W.velocities.applied[d])
    gap = 0.0
    size = least
    for k in range(S.rows.law.shape[0]):
        r = W.rows.gamma[k]
        terms = magnitude(r)
        for e in range(S.row_start[k], S.row_start[k + 1]):
            d = S.column[e]
            p = W.G[e] * x[d]
            r -= p
            terms += magnitude(p) + magnitude(W.G[e]) * free[d]
        unit = S.scales.length if metric[k] > 0.0 else 1.0
        gap = max(gap, magnitude(r) / unit)
        size = max(size, terms / unit)
    return gap / size if gap > 0.0 else gap


@formula
def free_body_masses(S, out):
    """Write the inverse mass, or reference inertia, of each velocity of free bodies to ``out``."""
    for b in range(S.tree.parent.shape[0]):
        n = S.tree.nv[b]
        shifts = 2 if n == 3 and S.tree.joint[b] != POINT else min(n, 3)
        for k in range(n):
            per = S.bodies.inverse_mass[b] if k < shifts else S.bodies.inverse_reference_inertia[b]
            out[S.tree.v[b] + k] = per


@kernel
def record_motion_kernel(
    address: int,
    S: System,
    W: Work,
    R: Tableau,
    clock: StepState,
    output: OutputBuffer,
    out: RecordedFigures,
    least: float,
    stride: int,
    deferred: int,
    first: int,
    last: int,
) -> None:
    """Compute the figures of the recorded times from ``first`` to the one before ``last``.

    Parameters
    ----------
    address : int
        The engine's.
    least : float
        See `relative_violation`.
    stride : int
        Accelerations are evaluated at each time whose number is a multiple of it; 0: never.
    deferred : int
        Whether the accelerations of the motion have not been computed.
    """
    ny, nv, nw = clock.y.shape[1], W.velocities.solved.shape[0], S.switches.row.shape[0]
    for n in range(first, last):
        set_state(clock, out.states[n, 0], out.states[n, 1 : 1 + ny])
        for s in range(nw if out.modes.shape[0] > 0 else 0):
            W.modes.mode[s], W.modes.hold[s] = out.modes[n, s], out.modes[n, nw + s]
            W.sensed.value[direction_column(S, W, s)] = out.modes[n, 2 * nw + s]
        evaluated = stride > 0 and n % stride == 0
        status = call(address, S, W, R, clock, output, MOTION if evaluated else POSITION)
        nq = S.sizes.coordinates
        record_energies(S, W, out.states[n, 1 + nq : 1 + nq + nv], out, n)
        x = W.velocities.solved if deferred else out.states[n, 1 + ny : 1 + ny + nv]
        if evaluated and status == 0:
            largest = record_gain(S, W, x, out, n)
            out.violation[n] = relative_violation(S, W, x, out.metric, max(least, largest))
            for d in range(nv):
                out.vdot[n, d] = x[d]
        else:
            out.violation[n] = nan
            for b in range(S.tree.parent.shape[0]):
                out.gain[n, b] = nan
            for d in range(nv):
                out.vdot[n, d] = nan
