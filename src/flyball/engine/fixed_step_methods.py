"""Steps of the two fixed-step methods, generalised alpha and the variational integrator, called by address.

The variational method integrates in absolute coordinates: masses are constant, bodies are coupled by rows and forces
only, and each body rotates freely within a step.
"""

from __future__ import annotations

from typing import NamedTuple

from ..compiler.formulas import formula
from ..compiler.kernels import kernel
from ..math.rotation import rotation_change
from ..math.scalar import atan, sqrt, tan
from ..math.vec import add, cross, dot, load9, mv, scale, sub
from ..numerics.integrators.generalised_alpha import accept_alpha_step, attempt_alpha_step
from ..numerics.integrators.implicit_method import halve_fixed_step, interpolate_hermite
from ..numerics.integrators.implicit_workspace import AlphaStepWorkspace, VariationalStepWorkspace
from ..numerics.integrators.variational import run_variational_task
from ..tables.table_definitions import ComplexSystem, ComplexWork, System, Work
from .calls import OUTPUT, OWN, POSITION, RESIDUAL, S_, SOLVE, W_, ResidualBatch, call_engine, engine_inspect
from .implicit_steps import (
    PLAN,
    TURNS,
    JacobianPlan,
    compose_state,
    integral_rates,
    perform_implicit,
    project_step_end,
    project_with_multipliers,
    stabilised_residual,
    stage_jacobian,
)
from .integration_loop import EngineArguments, RunState
from .kinematics import quaternion_at
from .solve import apply_inverse_mass


class AlphaWorkspace(NamedTuple):
    """Workspace of the generalised-alpha method; the counterpart of `ImplicitWorkspace`."""

    WC: ComplexWork
    moved: ResidualBatch
    pushed: ResidualBatch
    pressed: ResidualBatch
    plan: JacobianPlan
    step: AlphaStepWorkspace


class AlphaArguments(NamedTuple):
    """Arguments of the generalised-alpha method; the counterpart of `ImplicitArguments`."""

    SC: ComplexSystem
    workspace: AlphaWorkspace


SMALL_HALF_TURN = 1e-3  # half rotation angle [rad] below which the series of arctan(x) / x is used


@formula
def constant_velocity_increments(d, out, A):
    """Convert increments to those of constant velocity: the Cayley step of a rotation to its rotation vector."""
    for i in range(d.shape[0]):
        out[i] = d[i]
    turns = A[PLAN].turns
    for n in range(turns.shape[0]):
        i = turns[n]
        x = 0.5 * sqrt(d[i] * d[i] + d[i + 1] * d[i + 1] + d[i + 2] * d[i + 2])
        by = atan(x) / x if x > SMALL_HALF_TURN else 1.0 - x * x / 3.0 + x * x * x * x / 5.0
        for m in range(3):
            out[i + m] *= by


@formula
def alpha_residual(t, k, A, K, c):
    """Residual of the equations at the end of the step; rates of increments are those of constant velocities."""
    status = stabilised_residual(t, k, A, K, c)
    for i in range(K.v.shape[1]):
        K.out[k, i] = K.dd[k, i] - K.out[k, i]
    if status == 0:
        integral_rates(A, K, k)
    return status


@formula
def alpha_jacobian(t, k, A, K, c):
    """Jacobian as `implicit_steps.stage_jacobian`, where the rates of increments do not depend on the increments."""
    status = stage_jacobian(t, k, A, K, c)
    P = A[PLAN]
    for e in range(9 * P.turns.shape[0]):
        K.J[k, P.first[TURNS] + e] = 0.0
    return status


@formula
def by_alpha(S, W, M, engine_arguments, run_state, task):
    """Run a task of the generalised-alpha method."""
    callbacks = (
        alpha_residual,
        alpha_jacobian,
        compose_state,
        project_step_end,
        engine_inspect,
        constant_velocity_increments,
        project_with_multipliers,
    )
    return perform_implicit(
        (attempt_alpha_step, interpolate_hermite, accept_alpha_step, halve_fixed_step),
        callbacks,
        S,
        W,
        M,
        engine_arguments,
        run_state,
        task,
    )


@kernel
def alpha_steps(
    S: System, W: Work, M: AlphaArguments, engine_arguments: EngineArguments, run_state: RunState, task: int
) -> int:
    """`by_alpha` as a kernel."""
    return by_alpha(S, W, M, engine_arguments, run_state, task)


MAX_ROTATION_ITERATIONS = 20  # Newton iterations for one rotation
MOMENTUM_TOLERANCE = 1e-15  # accepted residual of the rotation equation, relative to the momentum
STALLED_TOLERANCE = 1e-12  # accepted residual, relative to the momentum, if the iteration no longer reduces it
SMALL_ROTATION = 0.02  # rotation angle [rad] below which series are used


@formula
def momenta_of_velocities(v, p, A):
    """Momenta p from velocities v; angular momenta along the body's axes."""
    S = A[S_]
    for b in range(S.tree.parent.shape[0]):
        i, n = S.tree.v[b], S.tree.nv[b]
        m = S.bodies.mass[b]
        p[i], p[i + 1] = m * v[i], m * v[i + 1]
        if n == 3:
            p[i + 2] = S.bodies.inertia[b, 8] * v[i + 2]
        elif n == 6:
            p[i + 2] = m * v[i + 2]
            L = mv(load9(S.bodies.inertia, b, 0), (v[i + 3], v[i + 4], v[i + 5]))
            p[i + 3], p[i + 4], p[i + 5] = L


@formula
def velocities_of_momenta(p, v, A):
    """Velocities v from momenta p."""
    S = A[S_]
    for b in range(S.tree.parent.shape[0]):
        apply_inverse_mass(S, b, p, S.tree.v[b], v, S.tree.v[b])


@formula
def free_flight(p, h, d, p1, A):
    """Displacements d of free bodies in a step, and momenta p1 at its end; see `free_rotation`. Returns a status."""
    S = A[S_]
    velocities_of_momenta(p, d, A)
    for i in range(d.shape[0]):
        d[i] *= h
        p1[i] = p[i]
    for b in range(S.tree.parent.shape[0]):
        if (
            quaternion_at(S, b)[1] >= 0
            and free_rotation(load9(S.bodies.inertia, b, 0), p, h, d, p1, S.tree.v[b] + 3) != 0
        ):
            return 1
    return 0


@formula
def free_rotation(J, p, h, d, p1, i):
    """Solve h p = J x + x~ J x / 2 + c x~ x~ J x for the rotation vector x of a step.

    The right-hand side is T(-x)^T J x, T being the inverse of the differential of the exponential map. At the end of
    the step x~ J x / 2 has the other sign: p1 = p - x~ J x / h. The Cayley step of the same rotation goes to d[i].
    Returns a status.
    """
    x = (d[i], d[i + 1], d[i + 2])
    w = (h * p[i], h * p[i + 1], h * p[i + 2])
    size = abs(w[0]) + abs(w[1]) + abs(w[2])
    last = 1e300
    for _ in range(MAX_ROTATION_ITERATIONS):
        L = mv(J, x)
        c, by = rotation_coefficients(sqrt(dot(x, x)))
        twist = cross(x, L)
        r = sub(sub(w, L), add(scale(0.5, twist), scale(c, cross(x, twist))))
        off = abs(r[0]) + abs(r[1]) + abs(r[2])
        if off <= MOMENTUM_TOLERANCE * size or (off >= last and off <= STALLED_TOLERANCE * size):
            store_free_rotation(p, scale(by, x), d, p1, i)
            return 0
        if not off < 1e300:
            return 1
        columns = (
            rotation_derivative((J[0], J[3], J[6]), x, L, c, (1.0, 0.0, 0.0)),
            rotation_derivative((J[1], J[4], J[7]), x, L, c, (0.0, 1.0, 0.0)),
            rotation_derivative((J[2], J[5], J[8]), x, L, c, (0.0, 0.0, 1.0)),
        )
        x = add(x, solve3(columns, r))
        last = off
    return 1


@formula
def store_free_rotation(p, x, d, p1, i):
    """Store the Cayley step x at d[i], and p in the rotated axes: equal to p - x~ J x / h, but preserving |p|.

    Computed as an increment, so that equal steps do not accumulate the same rounding error.
    """
    more = rotation_change(x, (p[i], p[i + 1], p[i + 2]))
    for k in range(3):
        d[i + k] = x[k]
        p1[i + k] = p[i + k] + more[k]


@formula
def rotation_coefficients(angle):
    """(1 - y cot y) / (4 y^2) and tan(y) / y, where y is half the angle of a rotation."""
    y = 0.5 * angle
    if angle < SMALL_ROTATION:
        s = angle * angle
        return 1.0 / 12.0 + s * (1.0 / 720.0 + s * (1.0 / 30240.0 + s / 1209600.0)), 1.0 + s / 12.0 + s * s / 120.0
    x = tan(y)
    return (1.0 - y / x) / (angle * angle), x / y


@formula
def rotation_derivative(Ju, x, L, c, u):
    """Derivative of J x + x~ J x / 2 + c x~ x~ J x along u at constant c; Ju = J u, L = J x."""
    bend = add(cross(u, L), cross(x, Ju))
    return add(add(Ju, scale(0.5, bend)), scale(c, add(cross(u, cross(x, L)), cross(x, bend))))


@formula
def solve3(columns, r):
    """Solution of three linear equations, given the columns of the matrix."""
    a, b, c = columns
    bc = cross(b, c)
    by = 1.0 / dot(a, bc)
    return (by * dot(r, bc), by * dot(a, cross(r, c)), by * dot(a, cross(b, r)))


@formula
def force_momenta(t, y, lam, f, A):
    """Generalised forces at a state without those of inertia and of rows; friction uses the multipliers ``lam``."""
    S, W, own, rows = A[S_], A[W_], A[OWN], A[OUTPUT].rows
    nv, nq = f.shape[0], S.sizes.coordinates
    own.real.t = t
    for i in range(y.shape[0]):
        own.y[0, i] = y[i]
    for i in range(nv):
        rows[1, i] = 0.0
    for r in range(lam.shape[0]):
        rows[2, r] = lam[r]
    call_engine(A, RESIDUAL)
    for i in range(nv):
        f[i] = -rows[0, i]
    for b in range(S.tree.parent.shape[0]):
        i = quaternion_at(S, b)[1]
        if i >= 0:
            w = (y[nq + i], y[nq + i + 1], y[nq + i + 2])
            g = cross(w, mv(load9(S.bodies.inertia, b, 0), w))
            for k in range(3):
                f[i + k] += g[k]
    for r in range(lam.shape[0]):
        for e in range(S.row_start[r], S.row_start[r + 1]):
            f[S.column[e]] -= W.G[e] * lam[r]


@formula
def position_gaps(t, y, g, A):
    """Constraint violations of the positions, into g; returns the largest. The turns in y are updated."""
    W, own = A[W_], A[OWN]
    own.real.t = t
    for i in range(y.shape[0]):
        own.y[0, i] = y[i]
    call_engine(A, POSITION)
    for i in range(y.shape[0]):
        y[i] = own.y[0, i]
    worst = 0.0
    for r in range(g.shape[0]):
        g[r] = W.rows.value[r]
        x = abs(g[r])
        if not x <= worst:
            worst = x
    return worst


@formula
def position_multipliers(g, lam, A):
    """Multipliers such that the displacement M^-1 G^T lam removes the violations g."""
    S, rows = A[S_], A[OUTPUT].rows
    for r in range(g.shape[0]):
        rows[1, r] = -g[r]
    for b in range(S.tree.parent.shape[0]):
        for k in range(S.tree.nv[b]):
            rows[0, S.tree.v[b] + k] = 0.0
    call_engine(A, SOLVE)
    for r in range(g.shape[0]):
        lam[r] = rows[3, r]


@formula
def add_constraint_momenta(G, lam, by, p, A):
    """Add ``by`` times G^T lam to the momenta p."""
    S = A[S_]
    for r in range(lam.shape[0]):
        for e in range(S.row_start[r], S.row_start[r + 1]):
            p[S.column[e]] += by * G[e] * lam[r]


@formula
def copy_rows(G, A):
    """Copy the Jacobian entries last evaluated to G."""
    for e in range(G.shape[0]):
        G[e] = A[W_].G[e]


@formula
def by_variation(S, W, M, engine_arguments, run_state, task):
    """Run a task of the variational method; the places in A are those of `implicit_steps`."""
    A = (
        engine_arguments.doors[0], S, W, engine_arguments.R, engine_arguments.clock, engine_arguments.output,
        run_state.group, 0, 0, 0, 0, 0, 0, M.turns, run_state, interpolate_hermite,
    )  # fmt: skip
    callbacks = (
        compose_state, project_step_end, engine_inspect, momenta_of_velocities, velocities_of_momenta,
        free_flight, force_momenta, position_gaps, position_multipliers, add_constraint_momenta, copy_rows,
    )  # fmt: skip
    return run_variational_task(callbacks, A, M, run_state.clock, task)


@kernel
def variational_steps(
    S: System, W: Work, M: VariationalStepWorkspace, engine_arguments: EngineArguments, run_state: RunState, task: int
) -> int:
    """`by_variation` as a kernel."""
    return by_variation(S, W, M, engine_arguments, run_state, task)
