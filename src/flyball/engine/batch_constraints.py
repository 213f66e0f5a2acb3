"""Kernel of constraint rows at many states: Jacobians, values and right-hand sides, by calls of the engine."""

from __future__ import annotations

from typing import NamedTuple

from ..compiler.kernels import kernel
from ..compiler.struct_layout import Float2, Float3
from ..numerics.integrators.butcher_tableaux import Tableau
from ..numerics.integrators.time_loop import StepState
from ..tables.table_definitions import System, Work
from .calls import POSITION, OutputBuffer, call_engine, set_state


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
