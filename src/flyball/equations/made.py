"""Code made for one mechanism, where the engine calls it in place of its loops over the tables.

Such code (`special/`) is straight-line code that fills the same arrays at the same places; all decisions stay where
they are. Its addresses stand in `System.flat`. They are in use for tasks after which nobody reads the kinematics of
bodies and frames in `Work`: the code stores those that the engine itself needs. Every function takes (S, W, t, a, b, c,
d), four arrays among them, and returns a float:

    PREPARE        a: q, b: v                   `prescribed.prepare`
    PLACE          a: q, b: z                   `projection.place`
    MOVE           a: v, b: z                   `projection.move`
    LOADS          a: state, b: rates of works  forces into `W.velocities.applied`
    FACTOR, REUSE                               `solve.factor`, 0 or 1 + a guilty unknown; `solve.reuse`
    STEP           a: f, b: gamma, c: x, d: lam  begin of a solve; without rows all of it
    STEP_UNLOADED  the same with f = 0
    REFINE         the same                     a pass; `solve.remainder_coupled`: one returned, the others in W.flat
    FINISH         a: state, b: its derivative, c: x, d: lam   the derivative from the solution; 0, or it is not finite
    SHOW           a: q                         poses of frames that only ends of steps look at
    SAMPLED        no address: where those of the laws that `within.sample` asks for begin in `System.flat`, in the
                   order of `within.law_at`; t and a: sensors, inputs of a force in W.flat
    DRIFT          a: v, b: nu - G v            `projection.drift`: the largest; the size of its terms in W.flat
"""

from __future__ import annotations

from ..compiler.formulas import formula, when_compiling
from ..tables.system import FLAT, SCRATCH
from .tasks import COMPLETE, FOLLOW, INTEGRATE

PARTITIONING = 6


def run(address, S, W, t, a, b, c, d):  # type: ignore[no-untyped-def]
    """Call the code at ``address``; in compiled code only."""
    raise NotImplementedError("code made for a mechanism is for compiled code")


@formula
def choose_code(S, W, task):
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

    from ..compiler.target import overload

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

    @overload(run)
    def choose(address, S, W, t, a, b, c, d):  # type: ignore[no-untyped-def]
        if isinstance(a.dtype, types.Complex):
            return lambda address, S, W, t, a, b, c, d: 0.0
        return lambda address, S, W, t, a, b, c, d: jump(address, S, W, t, a, b, c, d)  # type: ignore[call-arg]
