"""Motions and their derivatives by parameters: the variational equations, integrated by the compiled loop.

The compiled loop is ``engine/sensitivity_equations.py``. The initial state and its derivatives are found in absolute
coordinates (`parameter_derivatives`) and converted to joint coordinates by the motions of the bodies. Parameter changes
are relative, so that the tolerances of the motion also apply to the derivatives.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..derivatives.equation_derivatives import EquationDerivatives, MechanismState, complex_system, friction_load_rows
from ..engine import residual
from ..engine.calls import OutputBuffer
from ..engine.entry_point import FOLLOW, allocate_work, engine
from ..engine.sampled_controllers import INSTANT_ROUNDING, SampledControllers
from ..engine.sensitivity_equations import POWERS, SensitivityPlan, variation_kernel
from ..errors import SimulationError
from ..laws.python_functions import clear_faults
from ..numerics.integrators import time_loop as ex
from ..numerics.integrators.butcher_tableaux import Tableau, tableau
from ..results.health import Health
from ..results.result import Result
from ..simulation.diagnosis import failure_reason
from ..simulation.initial_state import InitialState
from ..simulation.integration_intervals import sampling
from ..simulation.prescribed_motion import cumulative_integrals, refined_nodes
from ..simulation.simulate import run_compiled_loop
from ..tables.structure_definition import Structure
from ..tables.table_definitions import KinematicRecords, System, Work, named_arrays, with_numbers
from ..tables.values import Values

PARAMETER_TABLES = (
    "bodies", "frames", "term_parameters", "force_parameters", "const", "gravity", "scales", "units", "rotor_inertia",
)  # fmt: skip
SOLVER_FIELDS = (
    "inverse_inertia", "excess_inertia", "inverse_mass", "inverse_reference_inertia", "excess_mass",
    "inverse_reference_mass",
)  # fmt: skip
OUTPUT_NUMBERS = 10_000_000  # numbers of output in memory at a time


@dataclass
class MotionDerivatives:
    """A motion, or its derivatives by one parameter; all arrays (n, ..) with the times first."""

    q: np.ndarray
    v: np.ndarray
    vdot: np.ndarray
    lam: np.ndarray
    z: np.ndarray

    @property
    def parts(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """All but the states ``z``."""
        return self.q, self.v, self.vdot, self.lam


@dataclass
class MotionSensitivity:
    """A motion and its derivatives.

    Attributes
    ----------
    t : ndarray (n,) [s]
    motion : MotionDerivatives
        Coordinates, velocities, accelerations, multipliers with efforts, states.
    by : list of MotionDerivatives
        Derivatives by each parameter; positions along the velocities.
    """

    t: np.ndarray
    motion: MotionDerivatives
    by: list[MotionDerivatives]

    def result(self, start: InitialState) -> Result:
        """The motion as a result."""
        c, m = start.assembly.compiled, self.motion
        health = Health(True, "a motion and its changes", 0.0, 0.0, 0, 0, 0, 0, 0.0)
        q, v, z, vdot, lam = (np.ascontiguousarray(x) for x in (m.q, m.v, m.z, m.vdot, m.lam))
        out = Result(c.structure.model, c.values, self.t, q, v, z, vdot, lam, health)
        out.wound = start.wound
        return out


def _no_progress(fraction: float, note: str = "") -> None:
    """Progress report that does nothing."""


def prescribed_motion_sensitivity(loop: VariationalIntegration) -> MotionSensitivity:
    """A prescribed motion and its derivatives, from the constraints; works are integrals of powers."""
    start, clock = loop.start, loop.clock
    at = 1 + clock.integrals
    own = clock._replace(real=clock.real.copy(), count=clock.count.copy(), y=clock.y.copy(), K=clock.K.copy())
    rows, _ = run_compiled_loop(start.assembly, own, loop.R, _no_progress, FOLLOW)
    if own.count.status != ex.DONE:
        raise loop.stopped(own, motion_only=True)
    z, n = clock.integrals - loop.nq - loop.nv, len(clock.integrals)

    def powers(some: np.ndarray) -> np.ndarray:
        found = loop.at(some[:, 0], some[:, 1 : 1 + len(start.y)])
        return np.hstack([some[:, at], *(size * by.z[:, z] for size, by in zip(loop.sizes, found.by, strict=True))])

    if n:
        known, P = refined_nodes(start.assembly, own, rows, powers)
    else:
        known = rows[np.isin(rows[:, 0], clock.times)]
        P = known[:, at]
    kept = np.isin(known[:, 0], clock.times)
    out = loop.at(known[kept, 0], known[kept, 1 : 1 + len(start.y)])
    works = cumulative_integrals(known[:, 0], P)[kept] if n else P
    out.motion.z[:, z] = start.y[clock.integrals] + works[:, :n]
    for k, by in enumerate(out.by):
        by.z[:, z] = works[:, (k + 1) * n : (k + 2) * n] / loop.sizes[k]
    return out


class VariationalIntegration:
    """Integration of a motion together with its derivatives.

    Parameters
    ----------
    start : InitialState
        Initial state, in the coordinates of the integration.
    clock : StepState
        Integrator state of the motion without derivatives.
    values : sequence of Values
        The mechanism's values with a complex step of each parameter.
    sizes : sequence of float
        Unit of change of each parameter.
    method : str
        The integrator.
    """

    def __init__(
        self,
        start: InitialState,
        clock: ex.StepState,
        values: Sequence[Values],
        sizes: Sequence[float],
        method: str = "dop853",
    ) -> None:
        self.start, self.clock, self.sizes, self.values = start, clock, np.array(sizes, float), tuple(values)
        c = start.assembly.compiled
        self.c, s, S = c, c.structure, c.values.system
        self.nq, self.nv, self.nz, self.nr, self.n = s.nq, s.nv, len(s.states), len(S.rows.law), len(values)
        self.controls = len(s.controls)
        self.prescribed = [int(S.tree.v[b]) for b in s.prescribed.values()]
        self.R: Tableau = tableau(method)
        self.motion_width = 1 + len(start.y) + self.nv + self.nr + len(self.prescribed)
        self.width = self.motion_width + self.n * (4 * self.nv + self.nr + self.nz)
        self.own = clock._replace(
            real=clock.real.copy(), count=clock.count.copy(), y=ex.StateVectors.blank(len(start.y)),
            K=np.zeros((1, len(start.y))),
        )  # fmt: skip
        self.output = OutputBuffer(np.zeros((4, max(self.motion_width, 1))))
        self.system, self.scratch, tables = _combined_tables(s, complex_system(S), values)
        found = np.zeros((1, self.nv + 3 * self.nr + 3 * len(s.measured) + self.controls), complex)
        steps = np.zeros((1, 3 * self.nv + 1 + self.controls), complex)
        t, y, vdot, lam = (np.zeros(n, complex) for n in (1, len(start.y), self.nv, self.nr))
        self.bench = residual.ResidualBatch(t, y, vdot, lam, steps, found)
        self.plan = self._step_plan(values, tables)
        self.ended = clock  # integrator state after the last run
        clear_faults(c.work.stack)

    def _step_plan(self, values: Sequence[Values], tables: np.ndarray) -> SensitivityPlan:
        """Table entries that each parameter changes, and work arrays."""
        s = self.c.structure
        entry, step, first = [np.zeros(0, np.int64)], [np.zeros(0)], [0]
        for x, size in zip(values, self.sizes, strict=True):
            found = np.concatenate([part.imag.ravel() for part in _residual_tables(s, complex_system(x.system))])
            at = np.flatnonzero(found)
            entry.append(2 * at + 1)
            step.append(found[at] * size)
            first.append(first[-1] + len(at))
        nv, nz, rows = self.nv, self.nz, friction_load_rows(s).astype(np.int64)
        m, wide = len(rows), nv + self.nr + nv
        return SensitivityPlan(
            np.array([self.nq, nz, self.n, 0, self.controls], np.int64), np.array(first, np.int64),
            np.concatenate(entry).astype(np.int64), np.concatenate(step), tables.view(float), np.zeros((self.n, wide)),
            np.zeros(nv), np.zeros(self._state_width), np.zeros(nz), np.zeros(nv), np.zeros(self.controls), rows,
            np.zeros((m, wide)), np.zeros((m, nz)), np.zeros((m, m + 1)),
        )  # fmt: skip

    @property
    def _state_width(self) -> int:
        """Number of state variables of motion and derivatives."""
        return self.nq + self.nv + self.nz + self.n * (2 * self.nv + self.nz)

    def _places(self, k: int) -> np.ndarray:
        """Places of the states of the motion (k = 0), or of their changes with parameter k - 1: see `state_place`."""
        at, n, i = self.nq + self.nv + 2 * self.nv * self.n, self.controls, np.arange(self.nz)
        return np.where(i < n, at + k * n + i, at + (self.n + 1) * n + k * (self.nz - n) + i - n)

    def run(self, dq: np.ndarray, dv: np.ndarray, dc: np.ndarray) -> MotionSensitivity:
        """Integrate from derivatives of the initial positions and velocities (parameters, nv), and controller states.

        Raises
        ------
        SimulationError
            If it stops: at a singular position, or where a law is not smooth.
        """
        size = self.sizes[:, None]
        clock = self._clock(np.concatenate([dq, dv], axis=1) * size)
        for k, change in enumerate(dc * size):
            clock.y.current[self._places(k + 1)[: self.controls]] = change
        buffer = np.zeros((max(2, min(len(clock.times), OUTPUT_NUMBERS // self.width + 1)), self.width))
        none, end = np.zeros((0, self._state_width)), float(clock.real.t_end)
        sampled = sampling(self.c, self.R, False, (float(clock.real.t), end), (0, 0))
        rows = []
        while True:
            if sampled is not None:
                if sampled.due(clock.real.t):
                    self._sample(clock, sampled)
                clock.real.t_end = min(sampled.next(clock.times), end)
            used = self._call(clock, none, buffer)
            if clock.count.status not in (ex.DONE, ex.RUNNING):
                raise self.stopped(clock)
            over = clock.count.status == ex.DONE and clock.real.t_end == end
            if not over and used and buffer[used - 1, 0] == clock.real.t_end:  # written later, with the new held values
                used -= 1
                clock.count.next -= 1
            rows.append(buffer[:used].copy())
            if over:
                break
        self.ended = clock
        return self._unpacked(np.concatenate(rows))

    def _sample(self, clock: ex.StepState, sampled: SampledControllers) -> None:
        """Sample the controllers that are due, and their changes: dz+ = dg/dx dx + dg/dz dz + dg/dp dp.

        Each sampled law g reads the present values of the signals before it; states come last and read all signals.
        """
        own, y, at = self.own, clock.y.current, self.nq + self.nv
        due = sampled.due_states(float(clock.real.t))
        own.real.t = clock.real.t
        own.y[0, :at], own.y[0, at:] = y[:at], y[self._places(0)]
        before = own.y[0, at:].copy()
        if sampled.sample(self.c.values.system, self.c.work, own) != 0:
            clock.count.status = ex.STEP_FAILED
            raise self.stopped(clock)
        after = own.y[0, at:].copy()
        y[self._places(0)] = after
        signals = [state for state, later in due if not later]
        before[signals] = after[signals]
        self._change_samples(clock, due, before)
        clock.count.started = ex.FORCES_JUMPED
        clock.real.h = max(clock.real.h, clock.real.wide)  # the last step was shortened to end here

    def _change_samples(self, clock: ex.StepState, due: Sequence[tuple[int, bool]], z: np.ndarray) -> None:
        """Update the changes of sampled states, at signals after and states before the instant, z."""
        c, y, nv, controls = self.c, clock.y.current, self.nv, self.controls
        t = float(clock.real.t)
        t += INSTANT_ROUNDING * abs(t)  # laws that jump at the instant have their later value
        W = c.work
        rates = W.velocities.solved.copy(), W.rows.multiplier.copy(), W.velocities.effort.copy()
        e = EquationDerivatives(MechanismState(c, t, y[: self.nq].copy(), y[self.nq : self.nq + nv].copy(), z, *rates))
        by_state, signals = e.by_state[e.at["s"]], [k for k, later in due if not later]
        for k, (x, size) in enumerate(zip(self.values, self.sizes, strict=True)):
            first = self.nq + nv + 2 * nv * k
            places = self._places(k + 1)[:controls]
            dz = y[places] / size
            old = dz.copy()
            old[signals] = 0.0
            step = np.r_[y[first : first + 2 * nv] / size, np.zeros(nv + 1), old]
            law = e.along(step, x)[e.at["s"]]
            known: list[int] = []  # signals whose changes are those after the instant
            for i, later in due:
                dz[i] = law[i] + by_state[i, known] @ dz[known]
                known += [] if later else [i]
            y[places] = dz * size

    def at(self, t: np.ndarray, y: np.ndarray) -> MotionSensitivity:
        """Derivatives at states (n, width) of a prescribed motion, with powers in place of works."""
        n = len(t)
        states = np.zeros((n, self._state_width))
        states[:, : self.nq + self.nv] = y[:, : self.nq + self.nv]
        states[:, self._places(0)] = y[:, self.nq + self.nv :]
        self.plan.size[POWERS] = 1
        clock = self._clock(np.zeros((self.n, 2 * self.nv)))._replace(times=np.ascontiguousarray(t))
        out = np.zeros((n, self.width))
        done = self._call(clock, states, out)
        if done < n:
            raise self.stopped(clock, float(t[done]))
        return self._unpacked(out)

    def _call(self, clock: ex.StepState, states: np.ndarray, out: np.ndarray) -> int:
        S, W = self.c.values.system, self.c.work
        given = (S, W, self.R, self.own, self.output)
        return variation_kernel(
            engine.address,
            residual.residuals_kernel.address,
            *given,
            self.system,
            self.scratch,
            self.bench,
            self.plan,
            clock,
            states,
            out,
        )

    def _clock(self, changes: np.ndarray) -> ex.StepState:
        """Integrator state of motion and derivatives."""
        own, n = self.clock, self.n
        Y = ex.StateVectors.blank(self._state_width)
        at, more = self.nq + self.nv, 2 * self.nv * n
        y = self.start.y
        Y[0, :at], Y[0, at : at + more], Y[0, self._places(0)] = y[:at], changes.ravel(), y[at:]
        unit, v_unit = own.y.unit, self.c.values.system.velocity_units
        rates = np.concatenate([v_unit, unit[self.nq : at]])
        Y.unit = 1.0
        Y.unit[:at], Y.unit[at : at + more] = unit[:at], np.tile(rates, n)
        accounts = [self._places(k)[own.integrals - at] for k in range(n + 1)]
        count = own.count.copy()
        count.controlled = at + more + (n + 1) * self.controls
        return own._replace(
            real=own.real.copy(), count=count, y=Y, K=np.zeros((len(own.K), self._state_width)),
            integrals=np.concatenate(accounts).astype(np.int64),
        )  # fmt: skip

    def _unpacked(self, rows: np.ndarray) -> MotionSensitivity:
        cuts = np.cumsum([1, self.nq, self.nv, self.nz, self.nv])
        t, q, v, z, vdot, lam = np.split(rows[:, : self.motion_width], cuts, axis=1)
        nv, nr, nz = self.nv, self.nr, self.nz
        by = []
        for k in range(self.n):
            first = self.motion_width + k * (4 * nv + nr + nz)
            part = rows[:, first : first + 4 * nv + nr + nz] / self.sizes[k]
            dq, dv, da, dlam, effort, dz = np.split(part, np.cumsum([nv, nv, nv, nr, nv]), axis=1)
            by.append(MotionDerivatives(dq, dv, da, np.hstack([dlam, effort[:, self.prescribed]]), dz))
        return MotionSensitivity(t[:, 0], MotionDerivatives(q, v, vdot, lam, z), by)

    def stopped(self, clock: ex.StepState, t: float | None = None, motion_only: bool = False) -> SimulationError:
        """The error for an integration that stopped; ``motion_only``: ``clock`` has no derivatives."""
        t = float(clock.real.t) if t is None else t
        real, own = clock.real.copy(), self.clock
        real.t = t
        y, at = own.y.copy(), self.nq + self.nv
        places = at + np.arange(self.nz) if motion_only else self._places(0)
        y[0, :at], y[0, at:] = clock.y.current[:at], clock.y.current[places]
        stopped = own._replace(real=real, count=clock.count, y=y)
        message, cause = failure_reason(self.start.assembly, self.start.base, stopped, with_result=False)
        error = SimulationError(
            f"the motion and its changes with the parameters stop at t = {t:.6g} s: {message}", None, t
        )
        error.__cause__ = cause
        return error


def _residual_tables(s: Structure, system: System) -> list[np.ndarray]:
    """The tables that the residuals read, and the frame records, whose ground frames contain parameters."""
    bodies = system.bodies._replace(**{name: 0.0 * getattr(system.bodies, name) for name in SOLVER_FIELDS})
    tables = [x for name in PARAMETER_TABLES for _, x in named_arrays(getattr(system._replace(bodies=bodies), name))]
    return [*tables, allocate_work(s, system, complex).frames]


def _combined_tables(s: Structure, system: System, values: Sequence[Values]) -> tuple[System, Work, np.ndarray]:
    """Tables and work arrays in complex numbers, with everything that parameters can change in one array."""
    # A rotation that is the identity now but depends on a parameter must be evaluated.
    for x in values:
        for name in ("joint_turned", "body_turned"):
            turned = getattr(system.bodies, name)
            turned[:] = np.maximum(turned.real, getattr(x.system.bodies, name).real)
    parts = _residual_tables(s, system)
    tables = np.concatenate([x.ravel() for x in parts])
    ends = np.cumsum([0, *(x.size for x in parts)])
    views = [tables[i:j].reshape(x.shape) for i, j, x in zip(ends[:-1], ends[1:], parts, strict=True)]
    own = iter(views)
    system = with_numbers(system, lambda _, x: next(own), PARAMETER_TABLES)
    work = allocate_work(s, system, complex)._replace(frames=views[-1].view(KinematicRecords))
    return system, work, tables
