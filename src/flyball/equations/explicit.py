"""Steps of explicit methods behind a door, for loops that are not the engine's own: see `callbacks`."""

from __future__ import annotations

import numpy as np

from ..compiler.buffers import StructBuffer
from ..compiler.formulas import formula
from ..compiler.kernels import BoundKernel, kernel
from ..numerics.integrators.explicit import answer
from ..numerics.integrators.loop import TRY
from ..numerics.integrators.tableaux import Tableau
from ..tables.system import System, Work
from .asking import OWN, arrive, inspect, put, tangent, through
from .callbacks import Going, Own, meet
from .tasks import MOTION, WATCH


@formula
def derivative(t, y, dy, A, K):
    """The right-hand side; guards and what they depend on are kept at the stages chosen for it."""
    own = A[OWN]
    put(own, t, y)
    K.count.stage += 1
    met = -1
    for j in range(K.met.shape[0]):
        if K.met[j] == K.count.stage:
            met = j
    status = through(A, WATCH if met >= 0 else MOTION)
    if status == 0:
        for i in range(dy.shape[0]):
            dy[i] = own.K[0, i]
    if met >= 0:
        meet(A, K, met)
    return status


@formula
def perform(S, W, R, own, going, task):
    """`explicit.answer`, asked of the engine."""
    if task == TRY:
        going.watch.count.stage = 0
    A = (own.doors[0], S, W, R, own.clock, own.sheet, going.group)
    return answer((derivative, arrive, tangent, inspect), A, going.watch, R, going.clock, task)


@kernel
def explicit_steps(S: System, W: Work, R: Tableau, own: Own, going: Going, task: int) -> int:
    """`perform` behind an address."""
    return perform(S, W, R, own, going, task)


class Explicit:
    """Steps of an explicit method.

    Parameters
    ----------
    R : Tableau
    """

    failed, width = None, 0  # what it has the engine write is a row of output

    def __init__(self, R: Tableau) -> None:
        self.R, self.c, self.stages = R, R.c, int(R.order_i[1])

    def bind(
        self, tables: StructBuffer, scratch: StructBuffer, own: StructBuffer, going: StructBuffer, doors: np.ndarray
    ) -> BoundKernel:
        """The door with these tuples bound to it."""
        return BoundKernel(explicit_steps, tables, scratch, StructBuffer(self.R), own, going)
