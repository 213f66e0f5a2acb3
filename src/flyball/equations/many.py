"""Many runs in one call of compiled code, one after the other, in the memory of one.

All that a run reads as its own or writes to stands in one block of memory, in cells of eight bytes. For each run it is
made as new, the numbers of this run are put into their cells, a door is gone through, and what is asked for is copied
out. What that is nobody needs to know here: bits are copied.
"""

from __future__ import annotations

from ..compiler.formulas import call_bound, when_compiling
from ..compiler.kernels import kernel
from ..compiler.layout import Int1, Int2


def reckon(address, tables, constants):  # type: ignore[no-untyped-def]
    """Have made code reckon its constants (`special.made`), by addresses; in compiled code only."""
    raise NotImplementedError("code made for a mechanism is for compiled code")


@kernel
def one_after_another(
    asked: Int1,
    task: int,
    then: Int1,
    made: Int1,
    cells: Int1,
    new: Int1,
    at: Int1,
    x: Int2,
    ends: Int1,
    told: Int1,
    out: Int2,
) -> int:
    """Have a task done for each row of ``x``, until one ends as it should not.

    Parameters
    ----------
    asked : (6,) int64
        The door's address and those of its tuples (`bound.Bound.asked`).
    task : int
    then : (8,) int64
        The same of what is done after a task that ended as it should, a cell that is 0 then, and the task; 0: nothing.
    made : (3,) int64
        Address of what reckons constants of made code from the tables, of these, and where they go; 0: there is none.
    cells, new : (m,) int64
        The memory, and as it is to begin with.
    at : (j,) int64
        Cells in which each run has numbers of its own.
    x : (n, j) int64
        These.
    ends : (3,) int64
        What the task is to return; a cell, and what is to stand there at the end.
    told : (i,) int64
        Cells that are copied out.
    out : (n, 1 + i) int64
        Where to; first stands what the task returned.

    Returns
    -------
    int
        The number of the run that ended as it should not, which is still in memory; or n.
    """
    for k in range(x.shape[0]):
        for i in range(new.shape[0]):
            cells[i] = new[i]
        for j in range(at.shape[0]):
            cells[at[j]] = x[k, j]
        if made[0] != 0:
            reckon(made[0], made[1], made[2])
        found = call_bound(asked, task)
        good = found == ends[0] and cells[ends[1]] == ends[2]
        if good and then[0] != 0:
            cells[then[6]] = 0
            good = call_bound(then, then[7]) == 0
        out[k, 0] = found
        for i in range(told.shape[0]):
            out[k, 1 + i] = cells[told[i]]
        if not good:
            return k
    return x.shape[0]


@when_compiling
def _register() -> None:
    from llvmlite import ir
    from numba import types
    from numba.extending import intrinsic

    from ..compiler.target import overload

    @intrinsic
    def call(typing, address, tables, constants):  # type: ignore[no-untyped-def]
        def generate(context, builder, signature, args):  # type: ignore[no-untyped-def]
            word, real = ir.IntType(64), ir.DoubleType()
            of = ir.FunctionType(real, [word, word, real, word, word, word, word])
            given = [args[1], word(0), real(0.0), args[2], word(0), word(0), word(0)]
            return builder.call(builder.inttoptr(args[0], of.as_pointer()), given)

        return types.float64(types.int64, types.int64, types.int64), generate

    @overload(reckon)  # type: ignore[arg-type]
    def choose(address, tables, constants):  # type: ignore[no-untyped-def]
        return lambda address, tables, constants: call(address, tables, constants)  # type: ignore[call-arg]
