"""Task numbers of the engine's kernel, calls of the kernel from integrator loops, and calls of generated code.

The tuple ``A`` of an integrator loop begins with the engine's address, tables, workspace, tableau, integrator state,
output buffer, and the group with indeterminate forces.

Code generated for one mechanism (`codegen/`) is straight-line code that fills the same arrays at the same places; all
decisions stay in the engine. Its addresses are in `System.flat`. It is used for tasks after which the kinematics of
bodies and frames in `Work` is not read: the code stores only what the engine itself needs. Every function takes (S, W,
t, a, b, c, d), where a to d are arrays, and returns a float:

    PREPARE        a: q, b: v                   `set_prescribed`
    PLACE          a: q, b: z                   `update_positions`
    MOVE           a: v, b: z                   `update_velocities`
    LOADS          a: state, b: rates of works  forces into `W.velocities.applied`
    FACTOR, REUSE                               `factor`, 0 or 1 + the singular unknown; `reuse_factor`
    STEP           a: f, b: gamma, c: x, d: lam  start of a solve; without rows the whole solve
    STEP_UNLOADED  the same with f = 0
    REFINE         the same                     a refinement pass; results as `remainder_coupled`, also in W.flat
    FINISH         a: state, b: derivative, c: x, d: lam  the derivative from the solution; 0 if it is finite
    SHOW           a: q                         poses of frames that are needed only at ends of steps
    SAMPLED        not an address: index in `System.flat` of the laws that `sample_law` evaluates, in the order of
                   `law_at`; t, a: sensors; the inputs of a force are in W.flat
    DRIFT          a: v, b: nu - G v            `velocity_violation`: the largest; the size of its terms in W.flat
"""

from __future__ import annotations

from typing import NamedTuple

from ..compiler.formulas import call, call_bound, formula, when_compiling
from ..compiler.struct_layout import Complex1, Complex2, Float2
from ..tables.table_definitions import FLAT, SCRATCH

POSITION, MOTION, INTEGRATE, FOLLOW, ARRIVE, REPORT, RESIDUAL, SOLVE, TANGENT, INSPECT, COMPLETE = range(11)
SLOPES, GUARD_VALUES = 11, 12
RESIDUAL_STEPS, RESIDUAL_DRIVEN, CONSTRAINT_GAPS, RESIDUAL_TERMS, INERTIAL_TERMS = range(5)


class OutputBuffer(NamedTuple):
    """Output buffer of the engine."""

    rows: Float2


class ResidualBatch(NamedTuple):
    """A state, finite or complex steps from it, and the residuals there; all complex."""

    t: Complex1  # (1,) [s]
    state: Complex1  # (nq + nv + nz,)
    vdot: Complex1  # (nv,)
    lam: Complex1  # (nr,)
    steps: Complex2  # (n, 3 nv + 1): steps of positions (along the velocities), velocities, accelerations, and of time;
    # followed, if there are more columns, by steps of controller states
    out: Complex2  # (n, nv + 3 nr + 3 nm), or more: residuals x' - f of the controller states with x' = 0


ENGINE, S_, W_, R_, OWN, OUTPUT, GROUP = range(7)


@formula
def call_engine(A, task):
    """Run a task of the engine at the time and state in its integrator state."""
    return call(A[ENGINE], A[S_], A[W_], A[R_], A[OWN], A[OUTPUT], task)


@formula
def call_step_method(method, A, K, R, c, task):
    """Run a task of a step method that is called by address."""
    return call_bound(method, task)


@formula
def set_state(clock, t, y):
    """Store a time and a state in the engine's integrator state."""
    clock.real.t = t
    for i in range(y.shape[0]):
        clock.y.current[i] = y[i]


@formula
def engine_arrive(t, y, dy, A, K):
    """Project y on the constraints, in place, and evaluate there. Returns (status, distance moved)."""
    own = A[OWN]
    set_state(own, t, y)
    status = call_engine(A, ARRIVE)
    if status == 0:
        for i in range(dy.shape[0]):
            y[i] = own.y[0, i]
            dy[i] = own.K[0, i]
    return status, A[OUTPUT].rows[0, 0]


@formula
def engine_tangent(y, e, A, K):
    """Remove from an error what the projection removes."""
    own = A[OWN]
    set_state(own, own.real.t, y)
    for i in range(e.shape[0]):
        own.K[0, i] = e[i]
    call_engine(A, TANGENT)
    for i in range(e.shape[0]):
        e[i] = own.K[0, i]


@formula
def engine_inspect(t, h, span, first, buffer, A, K):
    """Detect brief actions of laws within a step; see `pulse_detection.inspect_step`."""
    if buffer.shape[1] == 0:
        return 0, 0.0, 0.0
    own = A[OWN]
    own.real.t, own.real.h, own.real.span = t, h, span
    own.count.next = first
    call_engine(A, INSPECT)
    return own.count.next, own.real.h, own.real.max_growth


@formula
def engine_report(t, y, out, A, K):
    """Write a row of output."""
    own = A[OWN]
    set_state(own, t, y)
    status = call_engine(A, REPORT)
    for i in range(y.shape[0]):
        y[i] = own.y[0, i]
    for i in range(out.shape[0]):
        out[i] = A[OUTPUT].rows[0, i]
    return status


PARTITIONING = 6


def call_generated(address, S, W, t, a, b, c, d):  # type: ignore[no-untyped-def]
    """Call the code at ``address``; in compiled code only."""
    raise NotImplementedError("code made for a mechanism is for compiled code")


@formula
def select_generated_code(S, W, task):
    """Select for this task whether the code generated for the mechanism is used."""
    wanted = task == INTEGRATE or task == COMPLETE or task == FOLLOW
    if W.options.stabilization == PARTITIONING:
        wanted = False
    W.generated[SCRATCH] = 0
    for k in range(SCRATCH + 1, FLAT):
        W.generated[k] = S.flat[k] if wanted else 0


@when_compiling
def _register() -> None:
    from llvmlite import ir
    from numba import types
    from numba.core.errors import TypingError
    from numba.extending import intrinsic

    from ..compiler.numba_target import overload

    @intrinsic
    def jump(typing, address, S, W, t, a, b, c, d):  # type: ignore[no-untyped-def]
        arrays = [getattr(x, "array", x) for x in (a, b, c, d)]  # the whole arrays where these are fields of tables
        if any(x.layout != "C" for x in arrays):
            raise TypingError("code made for a mechanism takes arrays without gaps")

        def generate(context, builder, signature, args):  # type: ignore[no-untyped-def]
            data = [
                context.make_array(of)(context, builder, x).data
                for of, x in zip(signature.args[4:], args[4:], strict=True)
            ]
            given = [*args[1:4], *data]
            of = ir.FunctionType(ir.DoubleType(), [x.type for x in given])
            return builder.call(builder.inttoptr(args[0], of.as_pointer()), given)

        return types.float64(types.int64, S, W, types.float64, *arrays), generate

    @overload(call_generated)
    def choose(address, S, W, t, a, b, c, d):  # type: ignore[no-untyped-def]
        if isinstance(a.dtype, types.Complex):
            return lambda address, S, W, t, a, b, c, d: 0.0
        return lambda address, S, W, t, a, b, c, d: jump(address, S, W, t, a, b, c, d)  # type: ignore[call-arg]
