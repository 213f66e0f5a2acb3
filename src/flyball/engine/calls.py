"""Tasks of the engine's kernel by number, calls of it from integrator loops, and calls of generated code.

The tuple ``A`` of an integrator loop begins with the engine's address, tables, workspace, tableau, its own
integrator state, its output buffer, and the group with indeterminate forces.

Code made for one mechanism (`codegen/`) is straight-line code that fills the same arrays at the same places; all
decisions stay in the engine. Its addresses are in `System.flat`. It is used for tasks after which the kinematics of
bodies and frames in `Work` is not read: the code stores only what the engine itself needs. Every function takes (S,
W, t, a, b, c, d), four arrays among them, and returns a float:

    PREPARE        a: q, b: v                   `set_prescribed`
    PLACE          a: q, b: z                   `update_positions`
    MOVE           a: v, b: z                   `update_velocities`
    LOADS          a: state, b: rates of works  forces into `W.velocities.applied`
    FACTOR, REUSE                               `factor`, 0 or 1 + the singular unknown; `reuse_factor`
    STEP           a: f, b: gamma, c: x, d: lam  begin of a solve; without rows all of it
    STEP_UNLOADED  the same with f = 0
    REFINE         the same                     a pass; returns and leaves in W.flat what `remainder_coupled` returns
    FINISH         a: state, b: derivative, c: x, d: lam  the derivative from the solution; 0, or it is not finite
    SHOW           a: q                         poses of frames that are needed only at ends of steps
    SAMPLED        no address: where those of the laws that `sample_law` evaluates begin in `System.flat`, in the
                   order of `law_at`; t and a: sensors, inputs of a force in W.flat
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
    """Where the engine writes."""

    rows: Float2


class ResidualBatch(NamedTuple):
    """A state, steps from it, and what the residuals are there; all complex."""

    t: Complex1  # (1,) [s]
    state: Complex1  # (nq + nv + nz,)
    vdot: Complex1  # (nv,)
    lam: Complex1  # (nr,)
    steps: Complex2  # (n, 3 nv + 1): of positions (along the velocities), velocities, accelerations, and of time;
    # behind these, if there are more, of states of controllers
    out: Complex2  # (n, nv + 3 nr + 3 nm), or more: what x' = f misses of these where they do not change


ENGINE, S_, W_, R_, OWN, OUTPUT, GROUP = range(7)


@formula
def call_engine(A, task):
    """Have the engine do a task at the state on its desk."""
    return call(A[ENGINE], A[S_], A[W_], A[R_], A[OWN], A[OUTPUT], task)


@formula
def call_step_method(method, A, K, R, c, task):
    """What a loop asks of a method behind a door."""
    return call_bound(method, task)


@formula
def set_state(clock, t, y):
    """Lay a time and a state on the engine's desk."""
    clock.real.t = t
    for i in range(y.shape[0]):
        clock.y[0, i] = y[i]


@formula
def engine_arrive(t, y, dy, A, K):
    """Put y on the constraints, in place, and evaluate there; how far it moved."""
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
    """Take from an error what the projection takes."""
    own = A[OWN]
    set_state(own, own.real.t, y)
    for i in range(e.shape[0]):
        own.K[0, i] = e[i]
    call_engine(A, TANGENT)
    for i in range(e.shape[0]):
        e[i] = own.K[0, i]


@formula
def engine_inspect(t, h, span, first, buffer, A, K):
    """What laws do within a step; see ``within.inspect``."""
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
    """Say whether code made for the mechanism is in use for this task."""
    wanted = task == INTEGRATE or task == COMPLETE or task == FOLLOW
    if W.options.stabilization == PARTITIONING:
        wanted = False
    W.made[SCRATCH] = 0
    for k in range(SCRATCH + 1, FLAT):
        W.made[k] = S.flat[k] if wanted else 0


@when_compiling
def _register() -> None:
    from llvmlite import ir
    from numba import types
    from numba.core.errors import TypingError
    from numba.extending import intrinsic

    from ..compiler.numba_target import overload

    @intrinsic
    def jump(typing, address, S, W, t, a, b, c, d):  # type: ignore[no-untyped-def]
        arrays = [getattr(x, "array", x) for x in (a, b, c, d)]  # whole ones, if not parts of tables
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
