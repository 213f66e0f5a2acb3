"""Recursive dynamics with closed loops at many states: M vdot = tau - bias + G^T lam, G vdot = gamma.

M and the bias are those of the tree of joints; G are the rows of the joints that close loops. Rows may be dependent:
accelerations and forces are unique all the same.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ..compiler.kernels import StructBuffer
from ..derivatives.equation_derivatives import COMPLEX_STEP, complex_step_derivative, complex_system
from ..engine.batch_dynamics import ConstraintArrays, constraint_kernel
from ..engine.calls import OutputBuffer
from ..engine.entry_point import engine, idle_clock_pool, idle_tableau, pooled_work
from ..engine.residual import evaluate_residuals
from ..errors import AnalysisError, ModelError
from ..tables.table_definitions import Forces

if TYPE_CHECKING:
    from .recursive_methods import BatchDynamics

Array = np.ndarray
RANK = 1e-9
"""Singular values, relative to the largest, up to which rows count as dependent; rows have unit length before."""
NEARLY_DEPENDENT = 1e-6
"""A relative singular value between `RANK` and this marks a position close to a singular one; the state is refused."""
INCONSISTENT = 1e-6
"""Residual of constraints or forces, relative to the largest of the state, that counts as a contradiction."""
OFF_CONSTRAINTS = 1e-6
"""Violation of the constraints, in lengths of the mechanism or radians, from which on a state is refused."""


class ConstraintRows(NamedTuple):
    """Constraint rows at k states."""

    jacobian: Array  # (k, nr, nv)
    gamma: Array  # (k, nr)


class LoopEquations(NamedTuple):
    """M a = right + G^T lam, G a = gamma at k states."""

    rows: ConstraintRows
    M: Array  # (k, nv, nv)
    L: Array  # (k, nv, nv): M = L L^T
    G: Array  # (k, nr, nv): rows of unit length
    norms: Array  # (k, nr)

    def solved(self, right: Array, gamma: Array) -> tuple[Array, Array]:
        """Accelerations (k, nv, m) and multipliers (k, nr, m) for m right-hand sides.

        With X = L^-1 G^T the accelerations are those without loops plus L^-T y, where y is the shortest vector with
        X^T y = gamma - G a.
        """
        a = np.linalg.solve(self.M, right)
        X = np.linalg.solve(self.L, np.swapaxes(self.G, 1, 2))
        y = np.linalg.pinv(np.swapaxes(X, 1, 2), rcond=RANK) @ (gamma / self.norms[..., None] - self.G @ a)
        a = a + np.linalg.solve(np.swapaxes(self.L, 1, 2), y)
        return a, np.linalg.pinv(X, rcond=RANK) @ y / self.norms[..., None]


@dataclass(frozen=True)
class ClosedLoops:
    """The loops of a prepared mechanism.

    Attributes
    ----------
    dynamics : BatchDynamics
        Of the tree.
    names, rows : tuple of str
        Velocities, and constraint rows.
    q : ndarray, (nq,)
        The start.
    turns : ndarray, (angles, nq)
        Derivatives of turned angles by the coordinates.
    mass_matrix, bias_forces : callable
        Of the tree, at many states.
    closed_nearby : callable
        Gives positions near the start that satisfy the constraints.
    """

    dynamics: BatchDynamics
    names: tuple[str, ...]
    rows: tuple[str, ...]
    q: Array
    turns: Array
    mass_matrix: Callable[[Array], Array]
    bias_forces: Callable[[Array, Array], Array]
    closed_nearby: Callable[[], Array]

    def constraints(self, q: Array, v: Array) -> ConstraintRows:
        """Constraint rows at states (k, nq), (k, nv).

        Raises
        ------
        AnalysisError
            If a state violates them, or the mechanism has drivers or curves, whose rows depend on more than the state.
        """
        arrays = self.rows_at(q, v)
        self._refuse_inconsistent(arrays, v)
        return ConstraintRows(arrays.jacobian, arrays.gamma)

    def rows_at(self, q: Array, v: Array) -> ConstraintArrays:
        """Constraint rows at any states, whether or not they satisfy them."""
        x = self.dynamics
        c, k, nr = x.compiled, len(q), len(self.rows)
        if x.structure.model.drivers or c.has_curves:
            raise AnalysisError(
                f"{self._name!r} has drivers or curves, and recursive dynamics with closed loops supports neither; "
                "p.acceleration does. Leave drivers out, m.changed({...: None}), and name their coordinates as drives"
            )
        arrays = ConstraintArrays(
            self._state_vectors(q, v), np.zeros((k, nr, len(self.names))), np.zeros((k, nr)), np.zeros((k, nr))
        )
        clock, output = idle_clock_pool(arrays.y.shape[1]).new(), StructBuffer(OutputBuffer(np.zeros((1, 1))))
        work = pooled_work(x.structure, x.system, np.float64)
        constraint_kernel(engine.address, x.tables, work, idle_tableau(), clock, output, StructBuffer(arrays))
        return arrays

    def _state_vectors(self, q: Array, v: Array) -> Array:
        """Coordinates, velocities, and the states of turned angles, (k, nq + nv + nz)."""
        x = self.dynamics
        z = np.tile(x.compiled.z, (len(q), 1))
        if len(x.system.angles.F):
            z[:, x.system.angles.state] += (q - self.q) @ self.turns.T
        return np.hstack([q, v, z])

    def row_units(self) -> Array:
        """Factors that divide lengths in values of rows by the mechanism's length, (nr,)."""
        S = self.dynamics.system
        return S.row_levers / S.scales.length

    def _refuse_inconsistent(self, arrays: ConstraintArrays, v: Array) -> None:
        off = np.abs(arrays.value) * self.row_units()
        if off.max(initial=0.0) > OFF_CONSTRAINTS:
            i, row = np.unravel_index(np.argmax(off), off.shape)
            raise AnalysisError(
                f"state {i} violates the constraints of {self._name!r}: {self.rows[row]!r} is off by "
                f"{arrays.value[i, row]:.3g}. Recursive dynamics with closed loops needs states that satisfy them"
            )
        G, _ = self._unit_rows(ConstraintRows(arrays.jacobian, arrays.gamma))
        drift = np.abs((G @ v[..., None])[..., 0]).max(axis=1, initial=0.0)
        wrong = drift > OFF_CONSTRAINTS * np.abs(v).max(axis=1, initial=0.0)
        if wrong.any():
            raise AnalysisError(
                f"the velocities of state {int(np.argmax(wrong))} violate the constraints of {self._name!r}; with B of "
                "dependent_velocities at zero velocity they are B w"
            )

    @property
    def _name(self) -> str:
        return self.dynamics.structure.model.name

    @staticmethod
    def _unit_rows(rows: ConstraintRows) -> tuple[Array, Array]:
        """Rows divided by their norms, and the norms; rows that are zero but for rounding are zero, with norm 1."""
        norms = np.linalg.norm(rows.jacobian, axis=2, keepdims=True)
        zero = norms <= RANK * norms.max(axis=1, keepdims=True, initial=0.0)
        norms = np.where(zero, 1.0, norms)
        return np.where(zero, 0.0, rows.jacobian / norms), norms[..., 0]

    def forward_dynamics(self, q: Array, v: Array, tau: Array) -> tuple[Array, Array]:
        """Accelerations (k, nv) and multipliers (k, nr); with dependent rows the multipliers of least norm.

        Raises
        ------
        AnalysisError
            At a singular position, or where the mass matrix is singular.
        """
        equations = self._equations(q, v)
        free, gamma = tau - self.bias_forces(q, v), equations.rows.gamma
        a, lam = equations.solved(free[..., None], gamma[..., None])
        return a[..., 0], lam[..., 0]

    def forward_dynamics_derivatives(self, q: Array, v: Array, tau: Array) -> tuple[Array, Array, Array]:
        """Derivatives of the accelerations by positions, velocities and forces, (k, nv, nv) each.

        M da - G^T dlam = dtau - dr and G da = -ds, where dr and ds are the changes of r = M a + bias - tau - G^T lam
        and s = G a - gamma at fixed a and lam, by complex steps.
        """
        equations = self._equations(q, v)
        free, gamma = tau - self.bias_forces(q, v), equations.rows.gamma
        a, lam = equations.solved(free[..., None], gamma[..., None])
        dr, ds = self._residual_derivatives(q, v, a[..., 0], lam[..., 0])
        n = len(self.names)
        unit = np.broadcast_to(np.eye(n), (len(q), n, n))
        right = np.concatenate([-dr, unit], axis=2), np.concatenate([-ds, np.zeros((*ds.shape[:2], n))], axis=2)
        changes, _ = equations.solved(*right)
        by_position, by_velocity, by_force = (np.ascontiguousarray(x) for x in np.split(changes, 3, axis=2))
        return by_position, by_velocity, by_force

    def _residual_derivatives(self, q: Array, v: Array, a: Array, lam: Array) -> tuple[Array, Array]:
        """Derivatives of r (k, nv, 2 nv) and s (k, nr, 2 nv) by positions and velocities, without other forces."""
        x, n, nr = self.dynamics, len(self.names), len(self.rows)
        S = self._complex_tables
        W = pooled_work(x.structure, S.fields, np.complex128)
        steps = np.zeros((2 * n, 3 * n + 1), complex)
        steps[:, : 2 * n] = 1j * COMPLEX_STEP * np.eye(2 * n)
        out = np.zeros((2 * n, n + 3 * nr + 3 * len(x.structure.measured)), complex)
        found = np.zeros((len(q), out.shape[1], 2 * n))
        given = (array.astype(complex) for array in (self._state_vectors(q, v), a, lam))
        for i, (y, vdot, multipliers) in enumerate(zip(*given, strict=True)):
            evaluate_residuals(S, W, 0j, y, vdot, multipliers, steps, out)
            found[i] = complex_step_derivative(out).T
        return found[:, :n], found[:, n + 2 * nr : n + 3 * nr]

    @cached_property
    def _complex_tables(self) -> StructBuffer:
        """The tables in complex numbers, without forces and controllers."""
        S = complex_system(self.dynamics.system)
        forces = Forces(*(column[:0] for column in S.forces))
        return StructBuffer(S._replace(forces=forces, control_laws=S.control_laws[:0]))

    def _equations(self, q: Array, v: Array) -> LoopEquations:
        """The equations at states that satisfy the constraints; refuse singular ones."""
        rows = self.constraints(q, v)
        G, norms = self._unit_rows(rows)
        self._refuse_singular(G)
        M = self.mass_matrix(q)
        try:
            return LoopEquations(rows, M, np.linalg.cholesky(M), G, norms)
        except np.linalg.LinAlgError:
            values = np.linalg.eigvalsh(M)[:, 0]
            raise AnalysisError(
                f"{self._name!r}: the mass matrix of the tree is singular at state {int(np.argmin(values))}; give the "
                f"bodies mass and inertia, or use p.acceleration"
            ) from None

    def _relative_singular_values(self, G: Array) -> Array:
        values = np.linalg.svd(G * self.dynamics.compiled.sizes, compute_uv=False)
        return np.asarray(values / np.maximum(values[:, :1], np.finfo(float).tiny))

    @cached_property
    def regular_rank(self) -> int:
        """Rank of the constraint rows at positions that are not singular.

        Where the rows are dependent at the start, it is the largest at closed positions nearby; of an infinitesimal
        mechanism, for which there are none, the number of velocities.
        """
        ranks = self._ranks(self.q[None], RANK)
        if ranks[0] < min(len(self.rows), len(self.names)):
            ranks = self._ranks(self.closed_nearby(), NEARLY_DEPENDENT)
        return int(ranks.max(initial=0)) if len(ranks) else len(self.names)

    def _ranks(self, q: Array, tolerance: float) -> Array:
        rows = self.rows_at(q, np.zeros((len(q), len(self.names))))
        G, _ = self._unit_rows(ConstraintRows(rows.jacobian, rows.gamma))
        return np.asarray((self._relative_singular_values(G) > tolerance).sum(axis=1))

    def _refuse_singular(self, G: Array) -> None:
        """Refuse singular positions: rows of unit length that are nearly dependent, or more so than nearby."""
        relative = self._relative_singular_values(G)
        nearly = np.any((relative > RANK) & (relative < NEARLY_DEPENDENT), axis=1)
        singular = nearly | ((relative > RANK).sum(axis=1) < self.regular_rank)
        if singular.any():
            raise AnalysisError(
                f"state {int(np.argmax(singular))} is a singular position of {self._name!r}, or nearly one: its "
                "constraints do not determine the accelerations there. m.singularities() finds such positions"
            )

    def drive_forces(self, forces: Array, q: Array, v: Array, a: Array, drives: Sequence[str]) -> Array:
        """Forces (k, drives) along the drives that replace generalised forces (k, nv) of the tree.

        S^T u + G^T lam = forces.

        Raises
        ------
        AnalysisError
            If the drives cannot produce these forces, their forces are not unique, or the accelerations a do not
            satisfy the constraints.
        """
        rows = self.constraints(q, v)
        both, G, norms = self._with_rows(rows, drives)
        gamma = rows.gamma / norms
        off = np.abs((G @ a[..., None])[..., 0] - gamma).max(axis=1, initial=0.0)
        terms = (np.abs(G) @ np.abs(a)[..., None])[..., 0] + np.abs(gamma)
        wrong = off > INCONSISTENT * terms.max(axis=1, initial=0.0)
        if wrong.any():
            raise AnalysisError(
                f"the accelerations do not satisfy the constraints of {self._name!r} at state {int(np.argmax(wrong))}: "
                "with B and c of dependent_velocities they are B wdot + c"
            )
        n, sizes = len(drives), self.dynamics.compiled.sizes
        solved = np.linalg.pinv(np.swapaxes(both, 1, 2), rcond=RANK) @ forces[..., None]
        work = (np.swapaxes(both, 1, 2) @ solved - forces[..., None])[..., 0] * sizes
        largest = np.abs(forces * sizes).max(axis=1, initial=0.0)
        if (np.abs(work).max(axis=1, initial=0.0) > INCONSISTENT * largest).any():
            raise AnalysisError(
                f"the drives {', '.join(drives)} of {self._name!r} cannot give these accelerations: it has more "
                "freedoms"
            )
        return solved[:, :n, 0]

    def dependent_velocities(self, q: Array, v: Array, independent: Sequence[str]) -> tuple[Array, Array]:
        """B (k, nv, f) and c (k, nv) of all velocities v = B w and accelerations B wdot + c by the independent ones w.

        Raises
        ------
        AnalysisError
            If they do not determine all velocities, or are not independent.
        """
        rows, f = self.constraints(q, v), len(independent)
        both, _, norms = self._with_rows(rows, independent)
        values = np.linalg.matrix_rank(both, rtol=RANK)
        if (values < len(self.names)).any():
            raise AnalysisError(
                f"{', '.join(independent)} do not determine all velocities of {self._name!r} at state "
                f"{int(np.argmin(values))}; it has {len(self.names) - int(values.min())} more freedoms there"
            )
        inverse = np.linalg.pinv(both, rcond=RANK)
        c = inverse[..., f:] @ (rows.gamma / norms)[..., None]
        return inverse[..., :f], c[..., 0]

    def _with_rows(self, rows: ConstraintRows, names: Sequence[str]) -> tuple[Array, Array, Array]:
        """Rows that select velocities, above the constraint rows of unit length; these rows, and their norms.

        Raises
        ------
        AnalysisError
            If the velocities are not independent of each other and of the constraint rows.
        """
        at = self._velocity_indices(names)
        G, norms = self._unit_rows(rows)
        selection = np.zeros((len(G), len(at), len(self.names)))
        selection[:, np.arange(len(at)), at] = 1.0
        both = np.concatenate([selection, G], axis=1)
        added = np.linalg.matrix_rank(both, rtol=RANK) - np.linalg.matrix_rank(G, rtol=RANK)
        if (added < len(at)).any():
            raise AnalysisError(
                f"{', '.join(names)} are not independent in {self._name!r} at state {int(np.argmin(added))}: only "
                f"{int(added.min())} of them are"
            )
        return both, G, norms

    def _velocity_indices(self, names: Sequence[str]) -> list[int]:
        if isinstance(names, str) or not names:
            raise ModelError(f"give a list of names of velocities, such as [{self.names[0]!r}], not {names!r}")
        for name in names:
            if name not in self.names:
                raise ModelError(
                    f"{name!r} is no velocity of {self._name!r} in these coordinates: {', '.join(self.names)}"
                )
        return [self.names.index(name) for name in names]
