"""Kernels at many states: tasks of recursive dynamics, and constraint rows by calls of the engine."""

from __future__ import annotations

from typing import NamedTuple

from ..compiler.formulas import formula
from ..compiler.kernels import kernel
from ..compiler.struct_layout import Float1, Float2, Float3, Int1
from ..math.vec import add, load3, load9, mm, mv
from ..numerics.integrators.butcher_tableaux import Tableau
from ..numerics.integrators.time_loop import StepState
from ..tables.table_definitions import System, Work
from .calls import POSITION, OutputBuffer, call_engine, set_state
from .recursive_dynamics import (
    TreeDynamics,
    VelocityPaths,
    centroidal_momentum_matrix,
    composite_inertias,
    forward_dynamics,
    forward_dynamics_derivatives,
    frame_jacobian,
    frame_jacobian_rate,
    mass_matrix,
    move_bodies,
    newton_euler,
    newton_euler_derivatives,
    place_bodies,
    total_momentum,
)

(
    INVERSE_DYNAMICS,
    MASS_MATRIX,
    FORWARD_DYNAMICS,
    INVERSE_DERIVATIVES,
    FORWARD_DERIVATIVES,
    MOMENTUM,
    CENTROIDAL_MATRIX,
    FRAME_POSE,
    FRAME_JACOBIAN,
    FRAME_JACOBIAN_RATE,
) = range(10)


class FrameOnBody(NamedTuple):
    """A frame carried by a body."""

    body: Int1  # (1,): -1: ground
    position: Float1  # (3,): from the centre of mass, in the body's axes; of ground: from the world's origin
    rotation: Float1  # (9,)


class BatchArrays(NamedTuple):
    """States and results, a row each; of a task that needs fewer, the others have no columns."""

    q: Float2  # (k, nq)
    v: Float2  # (k, nv)
    given: Float2  # (k, nv): accelerations or generalised forces
    frame: FrameOnBody
    first: Float3  # (k, ...)
    second: Float3
    third: Float3
    singular: Int1  # (1,): where the task failed, the velocity that moves no inertia


@kernel
def batch_kernel(S: System, W: Work, V: VelocityPaths, D: TreeDynamics, batch: BatchArrays, task: int) -> int:
    """Perform a task at every state. Returns the number of states that succeeded before the first that did not."""
    for i in range(batch.q.shape[0]):
        status = perform_at_state(S, W, V, D, batch, i, task)
        if status != 0:
            batch.singular[0] = status - 1
            return i
    return int(batch.q.shape[0])


@formula
def perform_at_state(S, W, V, D, batch, i, task):
    """Perform a task at one state. Returns 0, or 1 + the index of a velocity that moves no inertia."""
    frame = batch.frame
    place_bodies(S, W, D, batch.q[i])
    if task == FRAME_POSE:
        frame_pose(W, frame, batch.first[i, 0])
        return 0
    if task == FRAME_JACOBIAN:
        frame_jacobian(S, W, V, D, frame.body[0], position(frame), batch.first[i])
        return 0
    if task == MASS_MATRIX or task == CENTROIDAL_MATRIX:
        composite_inertias(S, W, D)
        if task == CENTROIDAL_MATRIX:
            centroidal_momentum_matrix(S, V, D, batch.first[i])
            return 0
        mass_matrix(S, V, D, batch.first[i])
        return 0
    v = batch.v[i]
    if task == FORWARD_DYNAMICS or task == FORWARD_DERIVATIVES:
        acceleration = D.vector[0] if task == FORWARD_DERIVATIVES else batch.first[i, 0]
        status = forward_dynamics(S, W, V, D, v, batch.given[i], acceleration)
        if status != 0 or task == FORWARD_DYNAMICS:
            return status
        differentiate(S, W, V, D, v, acceleration, batch, i, D.mass)
        forward_dynamics_derivatives(V, D, batch.first[i], batch.second[i], batch.third[i])
        return 0
    if task == INVERSE_DYNAMICS:
        newton_euler(S, W, V, D, v, batch.given[i], batch.first[i, 0])
        return 0
    if task == INVERSE_DERIVATIVES:
        differentiate(S, W, V, D, v, batch.given[i], batch, i, batch.third[i])
        return 0
    move_bodies(S, V, D, v)
    if task == MOMENTUM:
        total_momentum(S, W, D, v, batch.first[i])
    else:
        frame_jacobian_rate(S, W, V, D, frame.body[0], position(frame), batch.first[i])
    return 0


@formula
def differentiate(S, W, V, D, v, acceleration, batch, i, mass):
    """Derivatives of the inverse dynamics by position and velocity, and the mass matrix."""
    newton_euler(S, W, V, D, v, acceleration, D.vector[1])
    newton_euler_derivatives(S, W, V, D, v, acceleration, batch.first[i], batch.second[i], mass)


@formula
def position(frame):
    """Position of a frame on its body."""
    return frame.position[0], frame.position[1], frame.position[2]


@formula
def frame_pose(W, frame, out):
    """Position (0 to 2) and axes, row by row (3 to 11), of a frame."""
    p, r, b = position(frame), frame.rotation, frame.body[0]
    R = (r[0], r[1], r[2], r[3], r[4], r[5], r[6], r[7], r[8])
    if b >= 0:
        A = load9(W.bodies.rotation, b, 0)
        p, R = add(load3(W.bodies.position, b, 0), mv(A, p)), mm(A, R)
    for i in range(3):
        out[i] = p[i]
    for i in range(9):
        out[3 + i] = R[i]


class ConstraintArrays(NamedTuple):
    """States and constraint rows, for each state: G(q) vdot = gamma, and the values g of the rows."""

    y: Float2  # (k, ny): q, v, and the states of turned angles
    jacobian: Float3  # (k, nr, nv)
    gamma: Float2  # (k, nr)
    value: Float2  # (k, nr)


@kernel
def constraint_kernel(
    address: int,
    S: System,
    W: Work,
    R: Tableau,
    clock: StepState,
    output: OutputBuffer,
    arrays: ConstraintArrays,
) -> int:
    """Evaluate the rows at every state. Returns the number of states.

    Parameters
    ----------
    address : int
        Address of the engine's kernel.
    """
    A = (address, S, W, R, clock, output)
    for i in range(arrays.y.shape[0]):
        set_state(clock, 0.0, arrays.y[i])
        call_engine(A, POSITION)
        for k in range(S.rows.law.shape[0]):
            for d in range(arrays.jacobian.shape[2]):
                arrays.jacobian[i, k, d] = 0.0
            for e in range(S.row_start[k], S.row_start[k + 1]):
                arrays.jacobian[i, k, S.column[e]] += W.G[e]
            arrays.gamma[i, k] = W.rows.gamma[k]
            arrays.value[i, k] = W.rows.value[k]
    return int(arrays.y.shape[0])
