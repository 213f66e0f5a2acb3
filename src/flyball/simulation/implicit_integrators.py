"""Implicit integrators bound to a mechanism (radau, generalised-alpha, variational): workspaces and tolerances."""

from __future__ import annotations

import numpy as np

from ..assembly.compiled_mechanism import CompiledMechanism
from ..compiler.kernels import BoundKernel, JoinedBuffer, PooledBuffer, StructBuffer, StructPool
from ..derivatives.equation_derivatives import COMPLEX_STEP, complex_system
from ..engine import residual
from ..engine.calls import ResidualBatch
from ..engine.entry_point import initialise_work, zero_work
from ..engine.fixed_step_methods import AlphaArguments, AlphaWorkspace, alpha_steps, variational_steps
from ..engine.implicit_steps import SIZES, ImplicitArguments, ImplicitWorkspace, JacobianPlan, radau_steps
from ..engine.kinematics import quaternion_at
from ..errors import ModelError, SimulationError
from ..laws.python_functions import refuse_function_laws
from ..numerics.integrators import implicit_workspace as ds
from ..numerics.integrators import time_loop as ex
from ..numerics.integrators.butcher_tableaux import tableau
from ..numerics.integrators.implicit_workspace import (
    AlphaStepWorkspace,
    ImplicitReals,
    RadauStepWorkspace,
    VariationalStepWorkspace,
)
from ..tables.law_inputs import steep_law_names
from ..tables.table_definitions import FREE, SCHUR, SCRATCH, SPHERICAL, System
from .initial_state import InitialState
from .integration_options import Integration
from .jacobian_pattern import inverse_inertias, jacobian_layout, substitute_inertias
from .method_choice import DEFAULT_RHO_INF, GENERALISED_ALPHA, VARIATIONAL

ROW_REGULARISATION, LOADED_ROW_REGULARISATION = (
    1e-10,
    1e-8,
)  # relative regularisation of rows; the second where forces depend on multipliers
SMALL_CORRECTION, LARGE_CORRECTION = (
    1e-7,
    1e-6,
)  # relative corrections that count as rounding if they do not fall: with step size control,
# and without
CHEAP_JACOBIAN_RATE, EXPENSIVE_JACOBIAN_RATE, FEW_GROUPS = (
    1e-3,
    0.1,
    12,
)  # convergence rates up to which a Jacobian is reused, where it takes few
# evaluations and where it takes more
MACHINE_EPSILON = float(np.finfo(float).eps)
MOST_POOLS = 2  # cached workspace pools of one structure
GUARD_POINTS = np.array(
    [0.0, 0.0, 0.25, 0.6, 0.857]
)  # points of a step at which guards are evaluated, after two unused entries


class ImplicitIntegrator:
    """Steps of an implicit method for one motion.

    Parameters
    ----------
    c : CompiledMechanism
        In the coordinates of the motion, with the workspace that it is run on.
    clock : StepState
    index_3 : bool
        Whether only positions are kept on the constraints (index 3).
    """

    door, workspace_type, means = radau_steps, ImplicitWorkspace, ImplicitArguments

    def __init__(self, c: CompiledMechanism, clock: ex.StepState, index_3: bool = False) -> None:
        refuse_function_laws(c.structure.functions, between_samples=True)
        s, S = c.structure, c.system
        self.clock, self.compiled = clock, c
        self.c, self.stages = GUARD_POINTS, len(GUARD_POINTS)
        self.layout = x = jacobian_layout(s, S, index_3)
        self.width, self.system = x.width, S
        self.light = c.values.cache.get("light", None, 1, lambda: substitute_inertias(c))
        key = type(self).__name__, index_3, self.light.tobytes(), int(S.flat[SCRATCH])
        self.buffer: PooledBuffer = s.cache.get(
            "implicit steps", key, MOST_POOLS, lambda: self._workspace_pool(clock.y.shape[1])
        ).new()
        initialise_work(s, self._complex_tables(S).fields, lambda name: self.buffer.array(f"WC.{name}"))
        self.buffer.array("WC.options").rate = c.array("options").rate
        if len(s.rows):
            self.buffer.array("plan.metric")[:] = inverse_inertias(c, float(clock.real.t), clock.y.current)
        self.count = self.buffer.array("step.count")
        self._settle(self.buffer.array("step.real"), len(S.angles.F) > 0)

    def bind(
        self,
        tables: StructBuffer,
        scratch: StructBuffer,
        state: StructBuffer,
        progress: StructBuffer,
        addresses: np.ndarray,
    ) -> BoundKernel:
        """Return the kernel of the steps bound to these arguments."""
        S = tables.fields
        if S is not self.system:  # other parameter values: masses may have changed
            self.system = S
            self.count.jacobians = 0
        means = JoinedBuffer(self.means, self._complex_tables(S), self.buffer)
        addresses[1] = residual.residuals_kernel.address
        return BoundKernel(self.door, tables, scratch, means, state, progress)

    def _workspace_pool(self, ny: int) -> StructPool:
        """Return a new pool of workspaces: engine workspace, derivative workspaces, Jacobian plan, solver workspace."""
        x, S = self.layout, self.system
        still = [y for y in (*vars(x).values(), *x.terms, *x.mass, *x.P, *x.whole_P)
                 if isinstance(y, np.ndarray)]  # fmt: skip
        plan = JacobianPlan(
            x.first, x.pick, x.mass.pick, np.ones(x.nv), x.valued, x.valued.copy(), x.turns, x.pressing,
            np.array([int(S.sizes.solver == SCHUR)], np.int64), x.negative, self.light, x.inertia_entry,
        )  # fmt: skip
        springy = x.spring[self.light[x.spring[:, 0]] == 0.0] if len(self.light) else x.spring
        desk = self._solver_workspace(len(self.compiled.structure.states), springy)
        benches = self._derivative_workspaces(ny)
        still += [self.light, springy, *(b.steps for b in benches)]
        return StructPool(
            self.workspace_type(zero_work(x.s, self._complex_tables(S).fields, complex), *benches, plan, desk), still
        )

    def _complex_tables(self, S: System) -> StructBuffer:
        """Return the tables in complex numbers, shared by all runs with these tables."""
        return self.layout.s.cache.get("stepped", id(S), MOST_POOLS, lambda: (S, StructBuffer(complex_system(S))))[1]

    @property
    def failed(self) -> SimulationError | None:
        """Error that explains why steps of fixed width do not continue; None if they do."""
        t, step = float(self.clock.real.t), float(self.clock.real.step)
        if not step or self.clock.count.status != ex.STEP_FAILED:
            return None
        why = (
            f"the equations of a step of {step:g} s have no solution that Newton's method finds"
            if self.clock.count.step_status != 0
            else (
                f"what happens within a step of {step:g} s cannot be resolved: the interpolation within it is too "
                "inaccurate"
            )
        )
        if steep := self._steep_laws():
            why += f" (the slope of {' and of '.join(steep)} may be infinite there)"
        return SimulationError(f"at t = {t:.6g} s {why}; give a shorter step, or leave it out", t=t)

    def _derivative_workspaces(self, ny: int) -> tuple[ResidualBatch, ResidualBatch, ResidualBatch]:
        x = self.layout
        nv, nx, out = x.nv, x.nx, []
        for kinds, terms in (((0, 1), x.terms), ((2,), x.mass), ((), x.mass)):
            steps = np.zeros((len(kinds) * terms.groups if kinds else 1, 3 * nv + 1 + nx), complex)
            for n, kind in enumerate(kinds):
                steps[n * terms.groups + terms.group[:nv], kind * nv + np.arange(nv)] = 1j * COMPLEX_STEP
            if 0 in kinds:
                steps[terms.group[nv:], 3 * nv + 1 + np.arange(nx)] = 1j * COMPLEX_STEP
            found = np.zeros((len(steps), x.places), complex)
            t, y, vdot, lam = (np.zeros(m, complex) for m in (1, ny, nv, x.nr))
            out.append(ResidualBatch(t, y, vdot, lam, steps, found))
        return out[0], out[1], out[2]

    def _settle(self, real: ds.ImplicitReals, turns: bool) -> None:
        """Write tolerances and limits of a run into its workspace."""
        x, count, step = self.layout, self.count, float(self.clock.real.step)
        rtol, atol = float(self.clock.real.rtol), float(self.clock.real.atol)
        own = 0.1 * rtol ** (2.0 / 3.0) if step == 0.0 else rtol
        near = min(0.03, own**0.5) if step == 0.0 else 0.01
        real.rtol, real.atol = own, own * atol / rtol
        real.newton = max(10.0 * MACHINE_EPSILON / own, near)
        real.rounding_size = max(0.1, (SMALL_CORRECTION if step == 0.0 else LARGE_CORRECTION) / own)
        real.soft = LOADED_ROW_REGULARISATION if len(x.pressing) else ROW_REGULARISATION
        real.reuse_rate = CHEAP_JACOBIAN_RATE if x.groups <= FEW_GROUPS else EXPENSIVE_JACOBIAN_RATE
        real.stays = 2.0 if x.expensive else 1.2  # Hairer and Wanner (1996), IV.8, of large systems and of others
        count.least, count.index_3 = 2 if turns else 1, int(x.index_3)
        count.shared = int(x.first[SIZES]) if len(x.pressing) else 0
        count.infinite_slopes = int(len(self._steep_laws()) > 0)

    def _steep_laws(self) -> list[str]:
        s = self.layout.s
        return s.cache.get("steep laws", None, 1, lambda: steep_law_names(s.model))

    def _solver_workspace(self, nz: int, springy: np.ndarray) -> RadauStepWorkspace:
        """Return the new solver workspace of a run."""
        x = self.layout
        nv, nr, nx, P = x.nv, x.nr, x.nx, x.P
        n = x.n
        real, count = ds.ImplicitReals.blank(), ds.ImplicitCounts.blank()
        J = np.zeros((4, int(x.first[-1]) + 1 + len(x.negative)))
        J[:, 0], J[:, x.first[-1]] = 1.0, -1.0
        Q = x.whole_P

        def z(*shape: int) -> np.ndarray:
            return np.zeros(shape)

        def w(*shape: int) -> np.ndarray:
            return np.zeros(shape, complex)

        nA, nL, nU = len(P.Aj), len(P.Lj), len(P.Uj)
        return RadauStepWorkspace(
            count, real, z(4, nv), z(4, nv), z(4, nv), z(4, nv), z(4, nr), z(nr), z(3, nr), z(4, nr), z(4, nz),
            z(4, nz), z(4, nx), z(4, n), z(4, nv), z(3, nr), z(4, nx), z(2, nv), z(nx),
            self._coordinate_of_velocity(), z(3, n), w(3, n), J, springy, x.scatter, x.part, z(nA), z(nL), z(nU),
            z(n), z(n), w(nA), w(nL), w(nU), w(n), w(n), P,
            x.whole_scatter, z(3, 3 * n), z(len(Q.Aj)), z(len(Q.Lj)), z(len(Q.Uj)), z(3 * n), z(3 * n), Q,
        )  # fmt: skip

    def _coordinate_of_velocity(self) -> np.ndarray:
        """Return for each velocity the component of the state whose rate it is, or -1 for angular velocities."""
        out = np.full(self.layout.nv, -1, np.int64)
        tree = self.system.tree
        for kind, q, v, nv in zip(tree.joint, tree.q, tree.v, tree.nv, strict=True):
            plain = nv if kind != FREE else 3
            if kind != SPHERICAL:
                out[v : v + plain] = np.arange(q, q + plain)
        return out


TIGHT_VIOLATION, ALLOWED_VIOLATION = (
    1e-15,
    1e-9,
)  # relative to the mechanism's length: negligible violation; violation that rounding may leave

REMEMBERED_STEPS = 12  # steps stored by the iteration


class VariationalIntegrator:
    """Steps of the variational method for one motion.

    Parameters
    ----------
    c : CompiledMechanism
        In absolute coordinates.
    clock : StepState
    """

    R = tableau("rk45")  # not used
    c, stages = GUARD_POINTS, len(GUARD_POINTS)

    def __init__(self, c: CompiledMechanism, clock: ex.StepState) -> None:
        s, S = c.structure, c.system
        nv, nr, nz = s.nv, len(s.rows), len(s.states)
        self.clock = clock
        self.width = nv + 3 * nr + 3 * len(s.measured)
        turns = [w for w in (quaternion_at(S, b)[1] for b in range(len(S.tree.parent))) if w >= 0]
        real, count = ds.ImplicitReals.blank(), ds.ImplicitCounts.blank()
        real.newton, real.rounding_size = TIGHT_VIOLATION * S.scales.length, ALLOWED_VIOLATION * S.scales.length
        n, z = int(S.row_start[nr]), np.zeros
        self.workspace = VariationalStepWorkspace(
            count, real, z((4, nv)), z((4, nv)), z((4, nv)), z((4, nr)), z(nr), z((4, nz)), z((4, nz)), z((2, nv)),
            np.array(turns, np.int64), z((4, nv)), z((3, nv)), z(nr), z((2, n)), z((REMEMBERED_STEPS, nr)),
            z((REMEMBERED_STEPS, nv)),
        )  # fmt: skip

    def bind(
        self,
        tables: StructBuffer,
        scratch: StructBuffer,
        state: StructBuffer,
        progress: StructBuffer,
        addresses: np.ndarray,
    ) -> BoundKernel:
        """Return the kernel of the steps bound to these arguments."""
        return BoundKernel(variational_steps, tables, scratch, StructBuffer(self.workspace), state, progress)

    @property
    def failed(self) -> SimulationError | None:
        """Error that explains why steps do not continue; None if they do."""
        t, step = float(self.clock.real.t), float(self.clock.real.step)
        if self.clock.count.status != ex.STEP_FAILED:
            return None
        return SimulationError(
            f"at t = {t:.6g} s a step of {step:g} s finds no positions on the constraints, or no forces that its "
            f"velocities return: give a shorter step; for strong damping and stiff springs method='radau'",
            t=t,
        )


def refuse_for_variational(start: InitialState) -> None:
    """Refuse what the variational method does not support.

    Raises
    ------
    ModelError
        Naming it.
    """
    c = start.assembly.compiled
    s, S = c.structure, c.system
    rolling = dict.fromkeys(r.element.title for r in s.rows if not r.holonomic)
    if rolling:
        raise ModelError(
            f"method={VARIATIONAL!r} does not support constraints on velocities ({', '.join(rolling)}); leave method "
            "out, or give method='radau'"
        )
    if S.scales.semidefinite > 0.0:
        thin = [
            n for n, b in s.place.items() if b >= 0 and (S.bodies.excess_mass[b] or S.bodies.excess_inertia[b].any())
        ]
        raise ModelError(
            f"method={VARIATIONAL!r} needs masses and inertias about all axes, which {', '.join(map(repr, thin))} does "
            f"not have: give them, or leave method out"
        )


def implicit_integrator(
    method: str, c: CompiledMechanism, clock: ex.StepState, o: Integration
) -> ImplicitIntegrator | VariationalIntegrator:
    """Return the integrator of a method for one motion.

    Parameters
    ----------
    method : str
    c : CompiledMechanism
        In the coordinates of the motion, with the workspace that it is run on.
    clock : StepState
    o : Integration
    """
    if method == VARIATIONAL:
        return VariationalIntegrator(c, clock)
    index_3 = o.stabilization == "none"
    if method == GENERALISED_ALPHA:
        return AlphaIntegrator(c, clock, DEFAULT_RHO_INF if o.rho_inf is None else float(o.rho_inf), index_3)
    return ImplicitIntegrator(c, clock, index_3)


# The generalised-alpha method.


class AlphaIntegrator(ImplicitIntegrator):
    """Steps of the generalised-alpha method for one motion.

    Parameters
    ----------
    c : CompiledMechanism
    clock : StepState
    rho : float
        Spectral radius at infinity: 1 damps nothing, 0 damps all modes that steps do not resolve.
    index_3 : bool
        Whether only positions are kept on the constraints (index 3).
    """

    door, workspace_type, means = alpha_steps, AlphaWorkspace, AlphaArguments  # type: ignore[assignment]

    def __init__(self, c: CompiledMechanism, clock: ex.StepState, rho: float, index_3: bool) -> None:
        self.rho = rho
        super().__init__(c, clock, index_3)

    def _settle(self, real: ImplicitReals, turns: bool) -> None:
        super()._settle(real, turns)
        steps = float(self.clock.real.span / self.clock.real.step)  # the iteration errors of all steps add up
        real.newton = max(10.0 * MACHINE_EPSILON / real.rtol, min(0.1, 1.0 / steps))
        self.buffer.array("step.rho")[0] = self.rho

    def _solver_workspace(self, nz: int, springy: np.ndarray) -> AlphaStepWorkspace:  # type: ignore[override]
        w = super()._solver_workspace(nz, springy)
        nv, nx = self.layout.nv, self.layout.nx
        kept = {
            name: getattr(w, name)
            for name in AlphaStepWorkspace._fields
            if name not in ("rho", "past", "ends", "turns")
        }
        past, ends = np.zeros((4, nv + nx)), np.zeros((2, nv))
        return AlphaStepWorkspace(**kept, rho=np.zeros(1), past=past, ends=ends, turns=self.layout.turns)
