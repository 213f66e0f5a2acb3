"""A motion by an implicit integrator: what its steps work with."""

from __future__ import annotations

import numpy as np

from ....compiler.buffers import JoinedBuffer, PooledBuffer, StructBuffer, StructPool
from ....compiler.kernels import BoundKernel
from ....equations import residual
from ....equations.implicit import SIZES, Means, Plan, Workshop, radau_steps
from ....equations.scratch import blank, fill
from ....equations.tasks import Bench
from ....errors import SimulationError
from ....numerics.integrators import clock as ex
from ....numerics.integrators.implicit import desk as ds
from ....numerics.integrators.implicit.desk import Desk
from ....tables.branches import steep_laws
from ....tables.system import FREE, SCHUR, SCRATCH, SPHERICAL, System
from ...compiled import Compiled
from ...linear.derivatives import refuse_functions
from ...linear.loads import STEP, as_complex
from .layout import layout, light, metric

SOFT, SOFTER = 1e-10, 1e-8  # regularisation of rows, as part of their natural size; where forces depend on multipliers
SMALL, LARGE = 1e-7, 1e-6  # relative corrections that are taken for rounding if they do not fall: where errors of steps
# are looked at, and where they are not
CHEAP, DEAR, FEW = 1e-3, 0.1, 12  # rates of the iteration up to which a Jacobian serves on, where it takes few
# evaluations and where it takes more
EPS = float(np.finfo(float).eps)
MOST = 2  # of what steps work with, of a structure, that is known
SEEN = np.array([0.0, 0.0, 0.25, 0.6, 0.857])  # places in a step at which guards are seen, behind two that are not


class Implicit:
    """Steps of an implicit method for one motion.

    Parameters
    ----------
    c : Compiled
        In the coordinates of the motion, with the scratch that it is run on.
    clock : Clock
    index_3 : bool
        Whether velocities are not held to the constraints.
    """

    door, workshop, means = radau_steps, Workshop, Means

    def __init__(self, c: Compiled, clock: ex.Clock, index_3: bool = False) -> None:
        refuse_functions(c.structure)
        s, S = c.structure, c.system
        self.clock, self.compiled = clock, c
        self.c, self.stages = SEEN, len(SEEN)
        self.layout = x = layout(s, S, index_3)
        self.width, self.system = x.width, S
        self.light = c.values.kept.get("light", None, 1, lambda: light(c))
        key = type(self).__name__, index_3, self.light.tobytes(), int(S.flat[SCRATCH])
        self.own: PooledBuffer = s.kept.get("implicit steps", key, MOST, lambda: self._mould(clock.y.shape[1])).new()
        fill(s, self._stepped(S).fields, lambda name: self.own.array(f"WC.{name}"))
        if len(s.rows):
            self.own.array("plan.metric")[:] = metric(c, float(clock.real.t), clock.y[ex.NOW])
        self.count = self.own.array("desk.count")
        self._settle(self.own.array("desk.real"), len(S.angles.F) > 0)

    def bind(
        self, tables: StructBuffer, scratch: StructBuffer, own: StructBuffer, going: StructBuffer, doors: np.ndarray
    ) -> BoundKernel:
        """The door with these tuples bound to it."""
        S = tables.fields
        if S is not self.system:  # other values of parameters: masses too, perhaps
            self.system = S
            self.count.jacobians = 0
        means = JoinedBuffer(self.means, self._stepped(S), self.own)
        doors[1] = residual.stepped.address
        return BoundKernel(self.door, tables, scratch, means, own, going)

    def _mould(self, ny: int) -> StructPool:
        """What steps work with besides tables, as it is new: scratch, benches, plan, desk."""
        x, S = self.layout, self.system
        still = [y for y in (*vars(x).values(), *x.terms, *x.mass, *x.P, *x.whole_P)
                 if isinstance(y, np.ndarray)]  # fmt: skip
        plan = Plan(
            x.first, x.pick, x.mass.pick, np.ones(x.nv), x.valued, x.valued.copy(), x.turns, x.pressing,
            np.array([int(S.sizes.solver == SCHUR)], np.int64), x.negative, self.light, x.own_mass,
        )  # fmt: skip
        springy = x.spring[self.light[x.spring[:, 0]] == 0.0] if len(self.light) else x.spring
        desk = self._desk(len(self.compiled.structure.states), springy)
        benches = self._benches(ny)
        still += [self.light, springy, *(b.steps for b in benches)]
        return StructPool(self.workshop(blank(x.s, self._stepped(S).fields, complex), *benches, plan, desk), still)

    def _stepped(self, S: System) -> StructBuffer:
        """Tables in complex numbers, as compiled code has them: the same for every run with them."""
        return self.layout.s.kept.get("stepped", id(S), MOST, lambda: (S, StructBuffer(as_complex(S))))[1]

    @property
    def failed(self) -> SimulationError | None:
        """Why steps of fixed width do not go on; else nothing."""
        t, step = float(self.clock.real.t), float(self.clock.real.step)
        if not step or self.clock.count.status != ex.STUCK:
            return None
        why = (
            f"the equations of a step of {step:g} s have no solution that Newton's method finds"
            if self.clock.count.trouble != 0
            else f"what happens within a step of {step:g} s cannot be told: between its ends it is too far off"
        )
        if steep := self._steep():
            why += f" (the slope of {' and of '.join(steep)} may be infinite there)"
        return SimulationError(f"at t = {t:.6g} s {why}; give a shorter step, or leave it out", t=t)

    def _benches(self, ny: int) -> tuple[Bench, Bench, Bench]:
        x = self.layout
        nv, nx, out = x.nv, x.nx, []
        for kinds, terms in (((0, 1), x.terms), ((2,), x.mass), ((), x.mass)):
            steps = np.zeros((len(kinds) * terms.groups if kinds else 1, 3 * nv + 1 + nx), complex)
            for n, kind in enumerate(kinds):
                steps[n * terms.groups + terms.group[:nv], kind * nv + np.arange(nv)] = 1j * STEP
            if 0 in kinds:
                steps[terms.group[nv:], 3 * nv + 1 + np.arange(nx)] = 1j * STEP
            found = np.zeros((len(steps), x.places), complex)
            t, y, vdot, lam = (np.zeros(m, complex) for m in (1, ny, nv, x.nr))
            out.append(Bench(t, y, vdot, lam, steps, found))
        return out[0], out[1], out[2]

    def _settle(self, real: ds.SolverReals, turns: bool) -> None:
        """Put the tolerances of a run, and what it counts by, on its desk."""
        x, count, step = self.layout, self.count, float(self.clock.real.step)
        rtol, atol = float(self.clock.real.rtol), float(self.clock.real.atol)
        own = 0.1 * rtol ** (2.0 / 3.0) if step == 0.0 else rtol
        near = min(0.03, own**0.5) if step == 0.0 else 0.01
        real.rtol, real.atol = own, own * atol / rtol
        real.newton = max(10.0 * EPS / own, near)
        real.rough = max(0.1, (SMALL if step == 0.0 else LARGE) / own)
        real.soft = SOFTER if len(x.pressing) else SOFT
        real.serves = CHEAP if x.groups <= FEW else DEAR
        real.stays = 2.0 if x.dear else 1.2  # Hairer and Wanner (1996), IV.8, of large systems and of others
        count.least, count.index_3 = 2 if turns else 1, int(x.index_3)
        count.shared = int(x.first[SIZES]) if len(x.pressing) else 0
        count.steep = int(len(self._steep()) > 0)

    def _steep(self) -> list[str]:
        s = self.layout.s
        return s.kept.get("steep laws", None, 1, lambda: steep_laws(s.model))

    def _desk(self, nz: int, springy: np.ndarray) -> Desk:
        """The desk of a run as it is new."""
        x = self.layout
        nv, nr, nx, P = x.nv, x.nr, x.nx, x.P
        n = x.n
        real, count = ds.SolverReals.blank(), ds.SolverCounts.blank()
        J = np.zeros((4, int(x.first[-1]) + 1 + len(x.negative)))
        J[:, 0], J[:, x.first[-1]] = 1.0, -1.0
        Q = x.whole_P

        def z(*shape: int) -> np.ndarray:
            return np.zeros(shape)

        def w(*shape: int) -> np.ndarray:
            return np.zeros(shape, complex)

        nA, nL, nU = len(P.Aj), len(P.Lj), len(P.Uj)
        return Desk(
            count, real, z(4, nv), z(4, nv), z(4, nv), z(4, nv), z(4, nr), z(nr), z(3, nr), z(4, nr), z(4, nz),
            z(4, nz), z(4, nx), z(4, n), z(4, nv), z(3, nr), z(4, nx), z(2, nv), z(nx), self._plain(), z(3, n), w(3, n),
            J, springy, x.put, x.part, z(nA), z(nL), z(nU), z(n), z(n), w(nA), w(nL), w(nU), w(n), w(n), P,
            x.whole_put, z(3, 3 * n), z(len(Q.Aj)), z(len(Q.Lj)), z(len(Q.Uj)), z(3 * n), z(3 * n), Q,
        )  # fmt: skip

    def _plain(self) -> np.ndarray:
        """Component of the state that each velocity is the rate of, or -1: a turn."""
        out = np.full(self.layout.nv, -1, np.int64)
        tree = self.system.tree
        for kind, q, v, nv in zip(tree.joint, tree.q, tree.v, tree.nv, strict=True):
            plain = nv if kind != FREE else 3
            if kind != SPHERICAL:
                out[v : v + plain] = np.arange(q, q + plain)
        return out
