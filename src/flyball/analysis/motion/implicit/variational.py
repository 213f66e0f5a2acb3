"""A motion by the variational method: what its compiled loop works with, and what it does not know."""

from __future__ import annotations

import numpy as np

from ....compiler.buffers import StructBuffer
from ....compiler.kernels import BoundKernel
from ....equations.tree import quaternion_at
from ....equations.variational import variational_steps
from ....errors import ModelError, SimulationError
from ....numerics.integrators import clock as ex
from ....numerics.integrators.implicit import desk as ds
from ....numerics.integrators.implicit.desk import VariationalDesk
from ....numerics.integrators.tableaux import tableau
from ...compiled import Compiled
from ..start import Start
from .loop import SEEN
from .suited import VARIATIONAL

TIGHT, CLOSED = 1e-15, 1e-9  # parts of the mechanism's length: violations that are none; that rounding may leave

KEPT = 12  # steps that the iteration remembers


class Variational:
    """Steps of the variational method for one motion.

    Parameters
    ----------
    c : Compiled
        In absolute coordinates.
    clock : Clock
    """

    R = tableau("rk45")  # is not looked at
    c, stages = SEEN, len(SEEN)

    def __init__(self, c: Compiled, clock: ex.Clock) -> None:
        s, S = c.structure, c.system
        nv, nr, nz = s.nv, len(s.rows), len(s.states)
        self.clock = clock
        self.width = nv + 3 * nr + 3 * len(s.measured)
        turns = [w for w in (quaternion_at(S, b)[1] for b in range(len(S.tree.parent))) if w >= 0]
        real, count = ds.SolverReals.blank(), ds.SolverCounts.blank()
        real.newton, real.rough = TIGHT * S.scales.length, CLOSED * S.scales.length
        n, z = int(S.row_start[nr]), np.zeros
        self.desk = VariationalDesk(
            count, real, z((4, nv)), z((4, nv)), z((4, nv)), z((4, nr)), z(nr), z((4, nz)), z((4, nz)), z((2, nv)),
            np.array(turns, np.int64), z((4, nv)), z((3, nv)), z(nr), z((2, n)), z((KEPT, nr)), z((KEPT, nv)),
        )  # fmt: skip

    def bind(
        self, tables: StructBuffer, scratch: StructBuffer, own: StructBuffer, going: StructBuffer, doors: np.ndarray
    ) -> BoundKernel:
        """The door with these tuples bound to it."""
        return BoundKernel(variational_steps, tables, scratch, StructBuffer(self.desk), own, going)

    @property
    def failed(self) -> SimulationError | None:
        """Why steps do not go on; else nothing."""
        t, step = float(self.clock.real.t), float(self.clock.real.step)
        if self.clock.count.status != ex.STUCK:
            return None
        return SimulationError(
            f"at t = {t:.6g} s a step of {step:g} s finds no positions on the constraints, or no forces that its "
            f"velocities return: give a shorter step; for strong damping and stiff springs method='radau'",
            t=t,
        )


def refuse_unknown(begun: Start) -> None:
    """Refuse what the variational method does not know.

    Raises
    ------
    ModelError
        Naming it.
    """
    c = begun.assembly.compiled
    s, S = c.structure, c.system
    rolling = dict.fromkeys(r.element.title for r in s.rows if not r.holonomic)
    if rolling:
        raise ModelError(
            f"method={VARIATIONAL!r} does not know rows that restrain velocities alone ({', '.join(rolling)}); leave "
            f"method out, or give method='radau'"
        )
    if S.scales.semidefinite > 0.0:
        thin = [
            n for n, b in s.place.items() if b >= 0 and (S.bodies.excess_mass[b] or S.bodies.excess_inertia[b].any())
        ]
        raise ModelError(
            f"method={VARIATIONAL!r} needs masses and inertias about all axes, which {', '.join(map(repr, thin))} does "
            f"not have: give them, or leave method out"
        )
