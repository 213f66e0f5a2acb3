"""A motion by an implicit integrator: what the compiled loop works with, and its calls."""

from __future__ import annotations

import time

import numpy as np

from ....equations import residual
from ....equations.engine import Sheet, engine
from ....equations.implicit import Plan, implicit_kernel
from ....equations.residual import Bench
from ....errors import SimulationError
from ....laws.breaks import Breaks
from ....laws.functions import forget
from ....numerics.integrators import clock as ex
from ....numerics.integrators.implicit import desk as ds
from ....numerics.integrators.implicit.desk import Desk
from ....numerics.integrators.tableaux import tableau
from ....tables.system import FREE, NV, Q0, SCHUR, SOLVER, SPHERICAL, TREE, V0
from ...compiled import Compiled
from ...linear.derivatives import refuse_functions
from ...linear.loads import STEP, complex_tables
from ...progress import Tell
from ..events.legs import Legs
from ..part import Part, whole
from .layout import layout, metric

SOFT = 1e-10  # regularisation of rows, as part of their natural size
SMALL, LARGE = 1e-7, 1e-6  # relative corrections that are taken for rounding if they do not fall: where errors of steps
# are looked at, and where they are not
SLICE = 0.05  # seconds that a call of the compiled loop should take
LONGEST = 100_000  # steps in one call of the compiled loop


class Implicit:
    """A motion by an implicit integrator, ready to run.

    Parameters
    ----------
    c : Compiled
        In the coordinates of the motion, with the scratch that it is run on.
    clock : Clock
    width : int
        Of a row of output.
    step : float
        Fixed width of steps [s]; 0: adaptive.
    index_3 : bool
        Whether velocities are not held to the constraints.
    """

    def __init__(self, c: Compiled, clock: ex.Clock, width: int, step: float = 0.0, index_3: bool = False) -> None:
        refuse_functions(c.structure)
        s, S = c.structure, c.system
        self.c, self.clock = c, clock
        self.layout = layout(s, S, index_3)
        ny = clock.y.shape[1]
        y = clock.y[ex.NOW].copy()
        x = self.layout
        self.own = clock._replace(
            real=clock.real.copy(), count=clock.count.copy(), y=np.zeros((ex.STATES, ny)), K=np.zeros((1, ny))
        )
        self.sheet = Sheet(np.zeros((3, max(width, x.width, 1))))
        self.R = tableau("rk45")
        self.SC, self.WC = complex_tables(c)
        self.benches = self._benches(ny)
        self.plan = Plan(
            x.first, x.pick, metric(c, float(clock.real[ex.T]), y), x.valued, x.turns, x.pressing,
            np.array([int(S.kinds[SOLVER] == SCHUR)], np.int64), x.negative,
        )  # fmt: skip
        self.desk = self._desk(len(s.states), step)

    @property
    def failed(self) -> SimulationError | None:
        """Why steps of fixed width do not go on; else nothing."""
        t, step = float(self.clock.real[ex.T]), float(self.desk.real[ds.STEP])
        if not step or self.clock.count[ex.STATUS] != ex.STUCK:
            return None
        return SimulationError(
            f"at t = {t:.6g} s the equations of a step of {step:g} s have no solution that Newton's method finds; give "
            f"a shorter step, or leave it out",
            t=t,
        )

    def _benches(self, ny: int) -> tuple[Bench, Bench, Bench]:
        x = self.layout
        nv, out = x.nv, []
        for kinds in ((0, 1), (2,), ()):
            steps = np.zeros((max(len(kinds) * x.groups, 0) if kinds else 1, 3 * nv + 1), complex)
            for n, kind in enumerate(kinds):
                steps[n * x.groups + x.group, kind * nv + np.arange(nv)] = 1j * STEP
            found = np.zeros((len(steps), x.width), complex)
            t, y, vdot, lam = (np.zeros(m, complex) for m in (1, ny, nv, x.nr))
            out.append(Bench(t, y, vdot, lam, steps, found))
        return out[0], out[1], out[2]

    def _desk(self, nz: int, step: float) -> Desk:
        x, clock = self.layout, self.clock
        nv, nr, n, P = x.nv, x.nr, 2 * (x.nv + x.nr), x.P
        real = np.zeros(ds.REALS)
        rtol = float(clock.real[ex.RTOL])
        real[ds.RTOL] = 0.1 * rtol ** (2.0 / 3.0) if step == 0.0 else rtol
        real[ds.ATOL] = real[ds.RTOL] * clock.real[ex.ATOL] / rtol
        near = min(0.03, real[ds.RTOL] ** 0.5) if step == 0.0 else 0.01
        real[ds.NEWTON] = max(10.0 * np.finfo(float).eps / real[ds.RTOL], near)
        real[ds.ROUGH] = max(0.1, (SMALL if step == 0.0 else LARGE) / real[ds.RTOL])
        real[ds.STEP], real[ds.SOFT] = step, SOFT
        count = np.zeros(ds.COUNTS, np.int64)
        count[ds.LEAST] = 2 if len(self.c.system.angle_i) else 1
        count[ds.INDEX_3] = int(x.index_3)
        J = np.zeros((4, int(x.first[-1]) + 1 + len(x.negative)))
        J[:, 0], J[:, x.first[-1]] = 1.0, -1.0
        Q = x.whole_P

        def z(*shape: int) -> np.ndarray:
            return np.zeros(shape)

        def w(*shape: int) -> np.ndarray:
            return np.zeros(shape, complex)

        half, L = len(P.Ai), len(P.Li)
        return Desk(
            count, real, z(4, nv), z(4, nv), z(4, nv), z(4, nv), z(4, nr), z(nr), z(4, nr), z(4, nz), z(4, nz),
            z(4, n), z(4, nv), z(3, nr), z(2, nv), self._plain(), z(3, n), w(3, n), J, x.put, x.part,
            z(2 * half), z(L), z(L), z(n), z(2, n), w(2 * half), w(L), w(L), w(n), w(2, n), P,
            x.whole_put, z(3, 3 * n), z(2 * len(Q.Ai)), z(len(Q.Li)), z(len(Q.Li)), z(3 * n), z(2, 3 * n), Q,
        )  # fmt: skip

    def _plain(self) -> np.ndarray:
        """Component of the state that each velocity is the rate of, or -1: a turn."""
        out = np.full(self.layout.nv, -1, np.int64)
        for row in self.c.system.body_i:
            plain = row[NV] if row[TREE] != FREE else 3
            if row[TREE] != SPHERICAL:
                out[row[V0] : row[V0] + plain] = np.arange(row[Q0], row[Q0] + plain)
        return out

    def go_on(self, out: np.ndarray) -> int:
        """Go on until the end, or what else `radau.advance` returns for. Returns rows written."""
        S, W = self.c.system, self.c.work
        doors = (
            engine.address(S, W, self.R, self.own, self.sheet),
            residual.address(self.SC, self.WC, self.benches[0]),
        )
        return implicit_kernel(
            doors, S, W, self.R, self.own, self.sheet, self.SC, self.WC, self.benches, self.plan, self.desk, self.clock,
            out,
        )  # fmt: skip


def run_implicit(
    loop: Implicit, width: int, known: Breaks, tell: Tell, part: Part | None = None
) -> tuple[np.ndarray, bool]:
    """Call the compiled loop until it is through, or the part is. Returns (rows, whether the user interrupted)."""
    c, clock = loop.c, loop.clock
    buffer = np.zeros((max(2, min(len(clock.times), 1_000_000 // width + 1)), width))
    rows = [np.zeros((0, width))]
    first = clock.real[ex.T]
    span, reached = clock.real[ex.T_END] - first or 1.0, 0.0
    forget(c.work.stack)
    legs, quota, part = Legs(clock, known), int(clock.count[ex.QUOTA]), part or whole()
    try:
        while True:
            begin, clock.count[ex.QUOTA] = time.perf_counter(), part.most(quota)
            before = clock.count[ex.ACCEPTED] + clock.count[ex.REJECTED]
            rows.append(buffer[: loop.go_on(buffer)].copy())
            reached = max(reached, (clock.real[ex.T] - first) / span)
            tell(min(1.0, reached))
            done = clock.count[ex.ACCEPTED] + clock.count[ex.REJECTED] - before
            part.took(done)
            if clock.count[ex.STATUS] == ex.DONE and legs.next():
                continue
            if part.over(clock) or clock.count[ex.STATUS] != ex.RUNNING:
                legs.whole()
                return np.concatenate(rows), False
            took = time.perf_counter() - begin
            quota = int(min(max(done * SLICE / max(took, 1e-6), 1.0), LONGEST))
    except KeyboardInterrupt:
        return np.concatenate(rows), True
