"""The engine's kernel: all tasks that need the right-hand side, compiled once and called by address with a task number.

Any loop may call it (an implicit method, time stepping with contact): it passes its own integrator state, with the time
in ``real.t`` and the state in ``y[0]``. A loop never contains the right-hand side, so it compiles in half a second.

This module also allocates the workspace of one run (`Work`), describes the tables for compiled code, and finds
dependent constraints at many states in absolute coordinates with one sparsity pattern of the factor (rows are divided
by their norm and velocities are scaled to lengths).
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, lru_cache
from typing import Any, NamedTuple

import numpy as np

from ..compiler.formulas import call, formula
from ..compiler.kernels import PooledBuffer, StructBuffer, StructPool, kernel
from ..compiler.struct_layout import Float1, Float2, Float3, Record
from ..laws.bytecode import STACK_RESERVE
from ..numerics.integrators.butcher_tableaux import Tableau, tableau
from ..numerics.integrators.explicit_runge_kutta import run_explicit_task
from ..numerics.integrators.time_loop import (
    StateVectors,
    StepCounts,
    StepReals,
    StepState,
    advance,
    finish_step,
    no_segment_start,
)
from ..numerics.rank import largest_singular_value, smallest_singular_values
from ..numerics.sparse_factorisation import ldl_factor
from ..tables.law_inputs import force_reading_count
from ..tables.structure_definition import Structure
from ..tables.table_definitions import (
    FLAT,
    SCRATCH,
    ArticulatedBodies,
    CompositeBodies,
    Counts,
    FactorVectors,
    KinematicRecords,
    Modes,
    Options,
    Pivots,
    RowScratch,
    Sensed,
    System,
    TrialState,
    Twists,
    VelocityScratch,
    Work,
    Wrenches,
)
from .calls import (
    ARRIVE,
    COMPLETE,
    FOLLOW,
    GUARD_VALUES,
    INSPECT,
    INTEGRATE,
    MOTION,
    POSITION,
    REPORT,
    RESIDUAL,
    SLOPES,
    SOLVE,
    TANGENT,
    OutputBuffer,
    select_generated_code,
)
from .element_dispatch import remember
from .guards import evaluate_guards
from .kinematics import store_ground_frames
from .motion import derivative, follow_drivers, project_and_evaluate, report_state, solve_response
from .pulse_detection import INSPECTION_ROWS, inspect_step
from .residual import force_slopes, residual
from .stabilization import project_error, update_positions, update_velocities

MAX_KEPT_LAYOUTS = 4  # layouts of workspaces and tables that are cached for each structure


DEFAULT_RATE = 1.0  # [1/s]: at an instant, where there is neither gravity nor any speed


def characteristic_rate_within(S: System, span: float = 0.0) -> float:
    """Characteristic rate [1/s] for a motion of that duration, which sets it where nothing else does."""
    return float(S.scales.rate.real) or (1.0 / span if span > 0.0 else DEFAULT_RATE)


def allocate_work(structure: Structure, system: System, dtype: Any = None) -> Work:
    """Workspace arrays for one run; ``dtype`` is that of the tables unless given."""
    dtype = np.dtype(system.const.dtype if dtype is None else dtype)
    if dtype.kind in "fc":
        return pooled_work(structure, system, dtype).fields  # type: ignore[no-any-return]
    W = zero_work(structure, system, dtype)
    W.modes.lower[:], W.modes.upper[:] = system.switch_numbers.lower, system.switch_numbers.upper
    W.options.rate = characteristic_rate_within(system)
    store_ground_frames(system, W)
    return W


def pooled_work(structure: Structure, system: System, dtype: Any) -> PooledBuffer:
    """Workspace for one run, as a pooled buffer for compiled code."""
    key = np.dtype(dtype).char, int(system.flat[SCRATCH])
    made = structure.cache.get(
        "scratch", key, MAX_KEPT_LAYOUTS, lambda: StructPool(zero_work(structure, system, dtype))
    ).new()
    initialise_work(structure, system, made.array)
    return made


def initialise_work(structure: Structure, system: System, array: Callable[[str], np.ndarray]) -> None:
    """Initialise a zeroed workspace, whose arrays are found by name, from the tables."""
    array("options").rate = characteristic_rate_within(system)  # type: ignore[attr-defined]
    if len(system.switch_numbers.lower):
        array("modes.lower")[:], array("modes.upper")[:] = system.switch_numbers.lower, system.switch_numbers.upper
    if n := system.sizes.ground_frames:
        frames = system.frames  # passed by address
        _, at_rest = structure.cache.get(
            "ground", id(frames), MAX_KEPT_LAYOUTS, lambda: (frames, ground_records(system))
        )
        array("frames")[:n] = at_rest


def struct_tables(structure: Structure, system: System) -> StructBuffer:
    """Tables as a struct buffer for compiled code."""
    return structure.cache.get(
        "written", id(system), MAX_KEPT_LAYOUTS, lambda: _new_struct_tables(structure, system)
    )  # the buffer keeps this address alive


def _new_struct_tables(structure: Structure, system: System) -> StructBuffer:
    first = structure.cache.get("written first", None, 1, lambda: StructBuffer(system))
    return first.of(system)


def ground_records(system: System) -> KinematicRecords:
    """Kinematic records of the frames on ground: the first rows of `Work.frames`, never written again."""
    W = FrameRecords(KinematicRecords.blank(system.sizes.ground_frames, dtype=system.const.dtype))
    store_ground_frames(system, W)
    return W.frames


class FrameRecords(NamedTuple):
    """Kinematic records of frames."""

    frames: KinematicRecords


def zero_work(structure: Structure, system: System, dtype: Any) -> Work:
    """Workspace filled with zeros."""
    nb, nf, nr, nv = len(system.tree.parent), len(system.frame_body), len(system.rows.law), structure.nv
    n, ny, nl, nw = (
        len(system.ldl.perm),
        structure.nq + nv + len(structure.states),
        len(structure.loads),
        len(structure.switches),
    )
    nc, ne = len(system.control_laws), force_reading_count(structure)

    def z(*shape: int) -> np.ndarray:
        return np.zeros(shape, dtype)

    def records(of: type[Record], count: int) -> Any:
        return of.blank(count, dtype=dtype)

    return Work(
        records(KinematicRecords, nb), records(KinematicRecords, nf), records(Twists, nv), z(nb, 3),
        records(Wrenches, nb), records(CompositeBodies, nb), records(ArticulatedBodies, nb), records(Pivots, nv),
        z(len(system.mass_entries.row)), z(len(system.column)), z(len(system.column)),
        records(Wrenches, len(structure.terms) if structure.loads or structure.sensed_columns else 0),
        RowScratch(*(z(nr) for _ in RowScratch._fields)), VelocityScratch(*(z(nv) for _ in VelocityScratch._fields)),
        z(Sensed.layout.width + nl, 2 * len(structure.measured) + nl + ne + nc + nw).view(Sensed),
        Modes(*(z(nw) for _ in Modes._fields[:-1]), z(nw, nw)),  # type: ignore[call-arg]
        z(len(system.ldl.Ai) + 1), z(len(system.ldl.Li)), records(FactorVectors, n),
        z(structure.depth + 1 + STACK_RESERVE, 3), records(TrialState, ny),
        Options.blank(), Counts.blank(),
        np.zeros(FLAT, np.int64), z(system.flat[SCRATCH]),
    )  # fmt: skip


@formula
def perform_task(S, W, R, clock, out, task):
    """Run one task; see `run_task`. A formula, so that its callees have one caller and are compiled once."""
    t = clock.real.t
    y = clock.y.current
    select_generated_code(S, W, task)
    if task == POSITION:
        nq = S.sizes.coordinates
        z = y[nq + W.velocities.solved.shape[0] :]
        update_positions(S, W, t, y[:nq], z)
        update_velocities(S, W, t, y[nq : nq + W.velocities.solved.shape[0]], z)
        remember(S, W, z)
        return 0
    if task == MOTION:
        return derivative(t, y, clock.K[0], S, W)
    if task == GUARD_VALUES:
        status = derivative(t, y, clock.K[0], S, W)
        evaluate_guards(S, W, t, out[0])
        return status
    if task == FOLLOW:
        return follow_drivers(S, W, clock, out)
    if task == ARRIVE:
        status, moved = project_and_evaluate(t, y, clock.K[0], S, W)
        out[0, 0] = moved
        return status
    if task == REPORT or task == COMPLETE:
        status = 0
        for n in range(out.shape[0] if task == COMPLETE else 1):
            if task == COMPLETE:
                t = out[n, 0]
                for i in range(y.shape[0]):
                    y[i] = out[n, 1 + i]
            found = report_state(t, y, out[n], S, W)
            status = max(status, found)
            if found != 0 and task == COMPLETE:
                for i in range(1 + y.shape[0], out.shape[1]):
                    out[n, i] = np.nan
        return status
    if task == RESIDUAL:
        for i in range(y.shape[0]):
            W.trial.state[i] = y[i]
        residual(S, W, t, W.trial.state, out[1], out[2], out[0])
        return 0
    if task == SOLVE:
        nv, nr = W.velocities.solved.shape[0], S.rows.law.shape[0]
        solve_response(S, W, out[0, :nv], out[1, :nr], out[2, :nv], out[3, :nr])
        return 0
    if task == TANGENT:
        project_error(y, clock.K[0], S, W)
        return 0
    if task == INSPECT:
        at = inspect_step(t, clock.real.h, clock.real.span, clock.count.next, clock.inspection, S, W)
        clock.count.next, clock.real.h, clock.real.max_growth = at
        return 0
    if task == SLOPES:
        force_slopes(S, W, t, out)
        return 0
    if task == INTEGRATE:
        calls = derivative, project_and_evaluate, project_error, inspect_step
        callbacks = run_explicit_task, calls, report_state, no_segment_start, finish_step
        return advance(callbacks, S, W, R, clock, out)
    return 0


@kernel
def engine(S: System, W: Work, R: Tableau, clock: StepState, output: OutputBuffer, task: int) -> int:
    """`perform_task` as a kernel."""
    return perform_task(S, W, R, clock, output.rows, task)


def run_task(S: System, W: Work, R: Tableau, clock: StepState, out: np.ndarray, task: int) -> int:
    """Run one task of the engine.

    Parameters
    ----------
    S, W : System, Work
        Tables and workspace; kinematics and rows at the state are left in W.
    R : Tableau
        The integrator's coefficients; used by INTEGRATE only.
    clock : StepState
        Time and state.
    out : (n, width)
        Rows of output.
    task : int
        POSITION: kinematics and rows; the turns and places on curves in the state are updated. MOTION: also the
        derivative of the state, in ``clock.K[0]``. ARRIVE: the state is projected on the constraints; the distance
        moved goes to ``out[0, 0]``. REPORT: its row of output, in ``out[0]``. COMPLETE: fill in the rows of ``out``
        whose accelerations and multipliers were deferred. RESIDUAL: residual of the equations at the accelerations
        ``out[1]`` and multipliers ``out[2]``, in ``out[0]``. SOLVE: at the state last evaluated, the accelerations
        ``out[2]`` and multipliers ``out[3]`` caused by forces ``out[0]`` and right-hand sides of the rows
        ``out[1]``; see ``motion.solve_response``. TANGENT: the error ``clock.K[0]`` less the part that the
        projection removes. INSPECT: see ``pulse_detection.inspect_step``; arguments and results in ``clock``.
        SLOPES: stiffness and damping of every force, see ``residual.force_slopes``. GUARD_VALUES: MOTION, and the
        guards in ``out[0]``; see `guards`. INTEGRATE: continue the integration; FOLLOW: continue the motion that
        drivers prescribe.

    Returns
    -------
    int
        Number of rows written for INTEGRATE and FOLLOW, otherwise a status.
    """
    return int(engine(S, W, R, clock, OutputBuffer(out), task))


def evaluate_state(S: System, W: Work, t: float, y: np.ndarray, task: int) -> tuple[int, np.ndarray]:
    """Evaluate at one state; returns (status, derivative) and leaves kinematics and rows in W.

    With POSITION the turns and places in ``y`` are updated.
    """
    clock = idle_clock_pool(len(y)).new()
    clock.array("real").t = t
    state = clock.array("y")[0]
    state[:] = y
    status = int(engine(S, W, idle_tableau(), clock, no_output(), task))
    y[:] = state
    return status, clock.array("K")[0]


@lru_cache
def idle_clock_pool(ny: int) -> StructPool:
    """Pool of integrator states without integration, for states of length ``ny``."""
    none, one = np.zeros(0, np.int64), np.zeros((1, ny))
    return StructPool(
        StepState(StepReals.blank(), StepCounts.blank(), np.zeros(0), StateVectors.blank(ny), one, none,
              np.zeros((INSPECTION_ROWS, 0)))
    )  # fmt: skip


@cache
def idle_tableau() -> StructBuffer:
    """Placeholder tableau for tasks that do not integrate."""
    return StructBuffer(tableau("rk45"))


@cache
def no_output() -> StructBuffer:
    """Output buffer for tasks that write no output."""
    return StructBuffer(OutputBuffer(np.zeros((0, 0))))


ADDED_DIAGONAL = 1e-13  # added to the diagonal, which is 1 for rows of unit norm


@formula
def unit_rows(S, W, scale):
    """Rows divided by their norms, into W.H; velocities are scaled to lengths. The norms go to `W.rows.diagonal`."""
    for k in range(S.rows.law.shape[0]):
        s = 0.0
        for e in range(S.row_start[k], S.row_start[k + 1]):
            W.H[e] = W.G[e] * scale[S.column[e]]
            s += W.H[e] * W.H[e]
        s = s**0.5 if s > 0.0 else 1.0
        for e in range(S.row_start[k], S.row_start[k + 1]):
            W.H[e] /= s
        W.rows.diagonal[k] = s


@formula
def factor_square(S, W):
    """Factor H H^T with a small addition to its diagonal; returns as `ldl_factor`."""
    for e in range(W.A.shape[0]):
        W.A[e] = 0.0
    for e in range(S.pairs.first.shape[0]):
        i, j = S.pairs.first[e], S.pairs.second[e]
        for k in range(S.pairs.length[e]):
            W.A[S.pairs.place[e]] += W.H[i + k] * W.H[j + k]
    for k in range(S.rows.law.shape[0]):
        W.A[S.ldl.Ap[S.ldl.perm[k] + 1] - 1] += ADDED_DIAGONAL
    return ldl_factor(S.ldl, W.A, W.L, W.ldl.inverse_diagonal, W.ldl.scratch)


@formula
def dependencies_at_states(address, S, W, R, clock, output, states, scale, block, combinations, out):
    """See `dependencies_kernel`."""
    last = block.shape[0] - 2
    for n in range(states.shape[0]):
        clock.real.t = states[n, 0]
        for i in range(clock.y.shape[1]):
            if states[n, 1 + i] == states[n, 1 + i]:  # a value that is not given (nan) continues from the state before
                clock.y.current[i] = states[n, 1 + i]
        call(address, S, W, R, clock, output, POSITION)
        unit_rows(S, W, scale)
        if factor_square(S, W) != 0:
            for i in range(3):
                out[n, i] = np.nan
            continue
        out[n, 0] = largest_singular_value(S.row_start, S.column, W.H, block[last + 1], W.velocities.scratch_1)
        X = block[: last + 1]
        out[n, 1], out[n, 2] = smallest_singular_values(
            S.ldl,
            W.L,
            W.ldl.inverse_diagonal,
            S.row_start,
            S.column,
            W.H,
            X,
            W.velocities.scratch_1,
            W.ldl.right_hand_side,
        )
        for i in range(last):
            for k in range(S.rows.law.shape[0]):
                combinations[n, k, i] = X[i, k] / W.rows.diagonal[k]


@kernel
def dependencies_kernel(
    address: int,
    S: System,
    W: Work,
    R: Tableau,
    clock: StepState,
    output: OutputBuffer,
    states: Float2,
    scale: Float1,
    block: Float2,
    combinations: Float3,
    out: Float2,
) -> None:
    """Weakest combinations of rows at every state; ``block`` ends with a vector for the largest singular value."""
    dependencies_at_states(address, S, W, R, clock, output, states, scale, block, combinations, out)


def dependent_rows(
    S: System, W: Work, states: np.ndarray, scale: np.ndarray, count: int
) -> tuple[np.ndarray, np.ndarray]:
    """Weakest combinations of the rows at many states, of which ``count`` are expected to be dependencies.

    Parameters
    ----------
    S, W : System, Work
        In absolute coordinates, with rows.
    states : ndarray (n, 1 + ny)
        Times and states; nan: turns and places nearest to those of the state before.
    scale : ndarray (nv,)
        Scale of each velocity.
    count : int

    Returns
    -------
    multipliers : ndarray (n, nr, count)
        Multipliers whose forces cancel.
    sizes : ndarray (n, 3)
        The largest singular value of the rows of unit size; the smallest of those that are not expected to be
        dependencies; the largest of those that are. nan where the rows are nan.
    """
    n, nr = len(states), len(S.rows.law)
    ny = states.shape[1] - 1
    real, y = StepReals.blank(), StateVectors.blank(ny)
    clock = StepState(real, StepCounts.blank(), np.zeros(0), y, np.zeros((1, ny)), np.zeros(0, np.int64))
    block = np.random.default_rng(0).standard_normal((count + 2, nr))
    kept, out = np.zeros((n, nr, count)), np.zeros((n, 3))
    sheet, R = OutputBuffer(np.zeros((0, 0))), tableau("rk45")
    dependencies_kernel(engine.address, S, W, R, clock, sheet, states, scale, block, kept, out)
    return kept, out
