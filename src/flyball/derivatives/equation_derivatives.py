"""Exact derivatives of the equations of motion at a state, and the force balance: magnitude and rounding error.

Derivatives are complex steps through the compiled formulas. With a step i h along one direction the imaginary part of
the result is h times the derivative, to rounding, because nothing is subtracted (Lyness and Moler 1967; Squire and
Trapp 1998). The equations are the residuals of ``engine/residual.py``; no equation is solved in them. Directions that
do not affect a common equation share one step (Curtis, Powell and Reid 1974), so that a chain of a thousand bodies
needs as many steps as one of three.

Joint friction depends on the reactions of its joint: in r = M vdot - f - G^T lam the forces f then depend on lam,
so that dr/dlam = -G^T + F. F is found by a complex step of each multiplier that loads a joint with friction.

The rounding error of an equation is the spread of its residual under random changes of the last digits (Vignes 1993).
The natural sizes of controller states make results independent of the units of controllers. A change of a state is
large if the forces that it causes are as large as the forces in the mechanism; a rate is large if large changes cause
it (equilibration: van der Sluis 1969).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any, NamedTuple

import numpy as np

from ..assembly.compiled_mechanism import CompiledMechanism
from ..compiler.kernels import StructBuffer
from ..engine.entry_point import MOTION, pooled_work
from ..engine.kinematics import count_plain_coordinates, retract
from ..engine.residual import evaluate_residuals
from ..errors import AnalysisError, ModelError
from ..laws.bytecode import BY_TIME, evaluate_jet
from ..laws.python_functions import refuse_function_laws
from ..numerics.rank import fundamental_subspaces
from ..tables.coordinate_choice import require_rotor_coordinates
from ..tables.structure_definition import Structure
from ..tables.table_definitions import ALONG, SLIDING, System, with_numbers
from ..tables.values import Values, values

COMPLEX_STEP = 1e-40
SELF_STRESS_LIMIT = 1e-8  # singular values of unit rows below this part of the largest count as zero
# Columns of F below this part of the largest entry of the row of G are rounding.
COUPLING_LIMIT = 1e-9


def complex_step_derivative(x: np.ndarray) -> np.ndarray:
    """Derivatives from the imaginary parts of numbers computed with a complex step.

    The third-order term leaves COMPLEX_STEP^2 / 6 times the third derivative, even where the first derivative is zero
    (a cube at 0), and products of several rounding errors are as small. Derivatives below COMPLEX_STEP times the
    largest one of ``x`` are set to 0; no units of length, mass and time make numbers of one mechanism differ that much.
    """
    found = np.imag(x) / COMPLEX_STEP
    size = np.abs(found)
    return np.where(size <= COMPLEX_STEP * size.max(initial=0.0), 0.0, found)


def friction_load_rows(s: Structure) -> np.ndarray:
    """Indices of the constraint rows whose multipliers load a joint with friction."""
    terms = s.tables["load_terms"].term if s.loads else np.zeros(0, int)
    return np.unique(s.tables["terms"].row[terms[terms >= 0] % len(s.terms)])


def complex_system(system: System) -> System:
    """Copy the tables with complex numbers."""
    return with_numbers(system, lambda _, x: x.astype(complex))


def friction_by_multipliers(x: MechanismState) -> np.ndarray:
    """F (nv, rows), the part that joint friction adds to -G^T in the derivatives of r by the multipliers."""
    s = x.c.structure
    nv, nr = s.nv, len(s.rows)
    out = np.zeros((nv, nr))
    width = nv + 3 * nr + 3 * len(s.measured)
    steps, found = np.zeros((1, 3 * nv + 1), complex), np.zeros((1, width), complex)
    y, vdot = x.y.astype(complex), x.vdot.astype(complex)
    rows = friction_load_rows(s)
    for k in rows.tolist():
        lam = x.lam.astype(complex)
        lam[k] += 1j * COMPLEX_STEP
        evaluate_residuals(*x.c.complex_tables, complex(x.t), y, vdot, lam, steps, found)
        out[:, k] = complex_step_derivative(found[0, :nv])
    if len(rows):
        x.c.at(x.t, x.q, x.v)
        G = x.c.jacobian()
        out[:, rows] += G[rows].T
        size = x.c.sizes[:, None]
        out[:, (size * np.abs(out)).max(axis=0) <= COUPLING_LIMIT * (size * np.abs(G.T)).max(axis=0)] = 0.0
    return out


def has_reaction_friction(x: MechanismState) -> bool:
    """Whether joint friction makes dr/dlam differ from -G^T."""
    s = x.c.structure
    nv, nr = s.nv, len(s.rows)
    x.c.at(x.t, x.q, x.v)
    G = x.c.sparse_jacobian()
    size = np.sqrt(G.multiply(G) @ x.c.sizes**2)
    random = np.random.default_rng(0).uniform(1.0, 2.0, nr) / np.where(size > 0.0, size, 1.0)
    steps = np.zeros((1, 3 * nv + 1), complex)
    found = np.zeros((1, nv + 3 * nr + 3 * len(s.measured)), complex)
    y, vdot, lam = x.y.astype(complex), x.vdot.astype(complex), x.lam + 1j * COMPLEX_STEP * random
    evaluate_residuals(*x.c.complex_tables, complex(x.t), y, vdot, lam, steps, found)
    left = complex_step_derivative(found[0, :nv]) + G.T @ random
    return bool((np.abs(left) > COUPLING_LIMIT * (abs(G).T @ random)).any())


def refuse_undetermined_friction(s: Structure, G: np.ndarray, F: np.ndarray) -> None:
    """Refuse joint friction whose reactions are undetermined because of redundant constraints.

    Parameters
    ----------
    s : Structure
    G : ndarray (rows, nv)
        Constraint rows; rotations are scaled to lengths.
    F : ndarray (nv, rows)
        Derivatives of the forces by the multipliers; torques are scaled likewise.

    Raises
    ------
    ModelError
        With the names of the friction elements.
    """
    size = np.maximum(np.sqrt((G * G).sum(axis=1)), 1e-300)
    free = fundamental_subspaces(G / size[:, None], SELF_STRESS_LIMIT).dependencies
    if not free.size or not np.abs(F / size @ free).max(initial=0.0) > SELF_STRESS_LIMIT * np.abs(F / size).max():
        return
    names = [
        e.name
        for e in s.loads
        if np.abs(free[s.slices[e.joint]]).max(initial=0.0)  # type: ignore[attr-defined]
        > SELF_STRESS_LIMIT * np.abs(free).max()
    ]
    raise ModelError(
        f"the friction of {', '.join(names)} depends on reactions that redundant constraints leave undetermined, so "
        f"there are no linear equations; take the redundancy out (m.mobility() names it)"
    )


DIRECTIONS_PER_CALL = 128  # directions per call


@dataclass
class MechanismState:
    """State of a mechanism at one time, with accelerations, multipliers and efforts."""

    c: CompiledMechanism
    t: float
    q: np.ndarray
    v: np.ndarray
    z: np.ndarray
    vdot: np.ndarray
    lam: np.ndarray  # multipliers of the rows
    effort: np.ndarray  # efforts of prescribed coordinates, (nv,), zero elsewhere

    @classmethod
    def moving(
        cls, c: CompiledMechanism, t: float, q: np.ndarray, v: np.ndarray, *, rotors: bool = True
    ) -> MechanismState:
        """State with the accelerations and multipliers that solve the equations of motion.

        Without ``rotors`` the inertia of rotors that is not along a velocity is neglected: for magnitudes only.

        Raises
        ------
        AnalysisError
            If the equations have no solution.
        ModelError
            If the inertia of a rotor is not along a velocity.
        """
        if rotors:
            require_rotor_coordinates(c.structure)
        if c.at(t, q, v, MOTION)[0] != 0:
            from ..simulation.diagnosis import reason_without_solution

            raise AnalysisError(f"{c.structure.model.name!r} at t = {t:.6g} s, {reason_without_solution(c, t, abs(t))}")
        W = c.work
        return cls(
            c, t, q, v, c.z.copy(), W.velocities.solved.copy(), W.rows.multiplier.copy(), W.velocities.effort.copy()
        )

    @classmethod
    def resting(cls, c: CompiledMechanism, t: float, q: np.ndarray, lam: np.ndarray | None = None) -> MechanismState:
        """State with zero velocities and accelerations, balanced or not, with the given multipliers (default 0)."""
        nv, nr = c.structure.nv, len(c.structure.rows)
        still = np.zeros(nv)
        c.at(t, q, still)
        return cls(c, t, q, still, c.z.copy(), still, np.zeros(nr) if lam is None else lam, still)

    @property
    def y(self) -> np.ndarray:
        """State vector."""
        return np.r_[self.q, self.v, self.z]


class EquationDerivatives:
    """The residuals at a state and their derivatives.

    Names of blocks: ``r`` = M vdot - f - G^T lam - effort, ``g``, ``n`` = G v - nu, ``a`` = G vdot - gamma,
    ``value``, ``rate``, ``acceleration`` of the measured quantities, and ``s``: the rates of the controller states z,
    for sampled ones their values from the next instant on.
    """

    def __init__(self, state: MechanismState) -> None:
        refuse_function_laws(state.c.structure.functions)
        self.state = state
        s = state.c.structure
        nv, nr, nm = s.nv, len(s.rows), len(s.measured)
        self.nz = len(s.controls)
        self.sizes: Any = None  # see `state_sizes`
        ends = np.cumsum([0, nv, nr, nr, nr, nm, nm, nm, self.nz])
        names = ("r", "g", "n", "a", "value", "rate", "acceleration", "s")
        self.at = {k: slice(i, j) for k, i, j in zip(names, ends[:-1], ends[1:], strict=True)}
        self.width = int(ends[-1])

    @cached_property
    def residual(self) -> np.ndarray:
        """All residuals at the state, (width,)."""
        out = self._run(self._steps(1))[0].real
        out[self.at["r"]] -= self.state.effort
        return out

    def block(self, name: str) -> np.ndarray:
        """One block of the residuals at the state."""
        return self.residual[self.at[name]]

    @cached_property
    def by_position(self):
        """Derivatives by position changes in the velocities' directions, sparse (width, nv)."""
        return self._jacobian(0)

    @cached_property
    def by_velocity(self):
        """Derivatives by velocities, sparse (width, nv)."""
        return self._jacobian(1)

    @cached_property
    def constraint_jacobian(self):
        """Jacobian G of all constraints, sparse (rows, nv): the rows n of `by_velocity`."""
        x = self.state
        x.c.at(x.t, x.q, x.v)
        G = x.c.sparse_jacobian()
        G.eliminate_zeros()
        return G

    @cached_property
    def by_acceleration(self):
        """Derivatives by accelerations, sparse (width, nv): the mass matrix in the rows of r."""
        return self._jacobian(2)

    @cached_property
    def by_state(self) -> np.ndarray:
        """Derivatives by the controller states, (width, nz)."""
        steps = self._steps(self.nz)
        steps[:, steps.shape[1] - self.nz :] = 1j * COMPLEX_STEP * np.eye(self.nz)
        return complex_step_derivative(self._run(steps)).T

    @cached_property
    def sampled(self) -> np.ndarray:
        """Whether each controller state is sampled, (nz,)."""
        return np.array([x.controller.sampled for x in self.state.c.structure.controls], bool)

    @property
    def state_rates(self) -> np.ndarray:
        """Rates of the controller states; for sampled ones the change at the next instant, (nz,)."""
        return self.block("s") - np.where(self.sampled, self.state.z[: self.nz], 0.0)

    @property
    def state_jacobian(self) -> np.ndarray:
        """Derivatives of `state_rates` by the controller states, (nz, nz)."""
        return self.by_state[self.at["s"]] - np.diag(1.0 * self.sampled)

    @cached_property
    def by_reactions(self) -> np.ndarray:
        """Derivatives of r by the multipliers besides -G^T (nv, rows): the part F of joint friction."""
        return friction_by_multipliers(self.state)

    def by_parameter(self, name: str) -> np.ndarray:
        """Derivatives by a parameter of the model at fixed state, (width,)."""
        return self.by_values(self.stepped(name))

    def by_values(self, stepped: Values) -> np.ndarray:
        """Derivatives from parameter values that contain a complex step, (width,)."""
        return complex_step_derivative(self._run(self._steps(1), complex_system(stepped.system))[0])

    def along(self, step: np.ndarray, stepped: Values) -> np.ndarray:
        """Derivatives (width,) along a change of positions, velocities, accelerations, time, states and parameters.

        ``stepped`` are values that contain a complex step.
        """
        steps = 1j * COMPLEX_STEP * step[None].astype(complex)
        return complex_step_derivative(self._run(steps, complex_system(stepped.system))[0])

    def stepped(self, name: str) -> Values:
        """Values of the mechanism with a complex step of one parameter."""
        return values_with_complex_step(self.state.c, name)

    def by_law(self, name: str) -> np.ndarray:
        """Derivatives by a parameter that occurs in laws only, (width,)."""
        return self.by_values(self.stepped_law(name))

    def stepped_law(self, name: str) -> Values:
        """Values with a complex step of a parameter that occurs in laws only."""
        c = self.state.c
        system = complex_system(c.values.system)
        system.const[list(c.structure.model.parameters).index(name)] += 1j * COMPLEX_STEP
        return replace(c.values, system=system)

    def _steps(self, count: int) -> np.ndarray:
        """Zero steps: of positions, velocities, accelerations, time and controller states."""
        return np.zeros((count, 3 * self.state.c.structure.nv + 1 + self.nz), complex)

    def _run(self, steps: np.ndarray, system: System | None = None) -> np.ndarray:
        s = self.state.c.structure
        S, W = self.state.c.complex_tables
        if system is not None:
            S, W = StructBuffer(system), pooled_work(s, system, complex)
        out = self.residuals(self.state, steps, S, W)
        if not np.isfinite(out.view(float)).all():
            raise self._not_finite(W.array("stack"))
        return out

    def residuals(self, x: MechanismState, steps: np.ndarray, system: StructBuffer, W: StructBuffer) -> np.ndarray:
        """Residuals at steps from a state, by tables in complex numbers, (steps, width); without efforts."""
        s = x.c.structure
        if s.sampled:  # the laws of sampled states in place of their zero rates
            laws = system.fields.control_laws.copy()
            for _, k, law, _ in s.sampled:
                laws[k] = law
            system = system.of(system.fields._replace(control_laws=laws))
        y, vdot, lam = (a.astype(complex) for a in (x.y, x.vdot, x.lam))
        out = np.zeros((len(steps), self.width), complex)
        evaluate_residuals(system, W, complex(x.t), y, vdot, lam, steps, out)
        out[:, self.at["s"]] *= -1.0
        return out

    def _not_finite(self, stack: np.ndarray) -> AnalysisError:
        """The error that names what is not finite; ``stack`` is the work array of the laws."""
        from ..simulation.diagnosis import force_fault

        x = self.state
        x.c.at(x.t, x.q, x.v, MOTION)
        missed = x.c.structure.missed(stack)
        why = (
            missed.message
            if missed
            else force_fault(x.c, x.t) or "look for a law that divides by zero or leaves its range"
        )
        return AnalysisError(
            f"the equations of {x.c.structure.model.name!r}, or their derivatives, are not finite at t = {x.t:.6g} s: "
            f"{why}"
        )

    def _jacobian(self, what: int):
        """Derivatives by positions (0), velocities (1) or accelerations (2)."""
        import scipy.sparse as sp

        nv = self.state.c.structure.nv
        touched, group = self._groups
        groups = int(group.max(initial=-1)) + 1
        rows, columns = touched.indices, np.repeat(np.arange(nv), np.diff(touched.indptr))
        entries = np.zeros(len(rows))
        for first in range(0, groups, DIRECTIONS_PER_CALL):
            count = min(DIRECTIONS_PER_CALL, groups - first)
            steps = self._steps(count)
            mine = np.flatnonzero((group >= first) & (group < first + count))
            steps[group[mine] - first, what * nv + mine] = 1j * COMPLEX_STEP
            found = complex_step_derivative(self._run(steps))
            own = group[columns] - first
            own = np.flatnonzero((own >= 0) & (own < count))
            entries[own] = found[group[columns[own]] - first, rows[own]]
        used = entries != 0.0
        return sp.csr_matrix((entries[used], (rows[used], columns[used])), shape=(self.width, nv))

    @property
    def _groups(self):
        """Sparsity pattern (width, nv), and groups of velocities without a common residual."""
        return sparsity_and_groups(self.state.c.structure, self.width, self.state.c.values.system)


def sparsity_and_groups(s: Structure, width: int, S: System) -> tuple[Any, np.ndarray]:
    """Sparsity pattern (width, nv) of the residuals by the velocities, and each velocity's column group, (nv,).

    Velocities of one group affect no common residual. ``width`` is the number of residuals.
    """
    return s.cache.get("sparsity", None, 1, lambda: _sparsity(s, width, S))


def _sparsity(s: Structure, width: int, S: System) -> tuple[Any, np.ndarray]:
    import scipy.sparse as sp

    if s.tree:
        return sp.csc_matrix(np.ones((width, s.nv), bool)), np.arange(s.nv)
    touched = sp.csc_matrix(sparsity_pattern(s, S))
    return touched, column_groups(touched)


def values_with_complex_step(c: CompiledMechanism, name: str) -> Values:
    """Values of a mechanism with a complex step of one parameter."""
    value = c.structure.model.environment(c.parameters)[name]
    return values(c.structure, c.parameters | {name: complex(value, COMPLEX_STEP)})  # type: ignore[arg-type]


def prescription_derivatives(x: MechanismState, stepped: Values) -> np.ndarray:
    """Derivatives (3, n) of q - f(t), v - f'(t), v' - f''(t) of prescribed coordinates, by a complex step in values."""
    S = complex_system(stepped.system)
    stack = np.zeros((x.c.structure.depth + 1, 3), complex)
    out = []
    for b in x.c.structure.prescribed.values():
        law = int(S.tree.law[b])
        f, f1, f2 = evaluate_jet(S.code, S.const, law, stack, complex(x.t), np.zeros((3, 0), complex), BY_TIME)
        out.append([-complex_step_derivative(y) for y in (f - S.bodies.offset[b], f1, f2)])
    return np.array(out).reshape(-1, 3).T


def sparsity_pattern(s: Structure, S: System) -> Any:
    """Which residuals can depend on which velocity's coordinate, in absolute coordinates; sparse (width, nv).

    The equations of an element, and the equations of motion of the bodies that it loads, depend on the bodies that it
    connects. Elements whose laws name sensors depend also on the bodies that these sensors measure.
    """
    import scipy.sparse as sp

    nb, nr, nm = len(S.tree.parent), len(s.rows), len(s.measured)
    body = np.repeat(np.arange(nb), S.tree.nv)
    of_row = [np.unique(body[S.column[S.row_start[k] : S.row_start[k + 1]]]) for k in range(nr + nm)]
    named = sorted({m % nm for m in s.slots.values() if m < 2 * nm})
    also = np.unique(np.concatenate([of_row[nr + m] for m in named])) if named else np.zeros(0, int)
    reach: list[tuple[np.ndarray, np.ndarray]] = [(np.arange(nb)[b : b + 1],) * 2 for b in range(nb)]
    reach += [(at, at) for at in of_row[:nr]]
    table = S.forces
    for F, M, family, laws in zip(table.F, table.M, table.family, table.laws, strict=True):
        if family == ALONG:
            at = of_row[nr + F]
        elif family == SLIDING:  # along one tangent or two
            at = np.unique(np.concatenate([of_row[nr + m] for m in (F, M) if m >= 0]))
        else:
            at = S.frame_body[[F, M]]
            at = at[at >= 0]
        has_law = (laws >= 0).any()
        reach.append((at, np.union1d(at, also) if has_law else at))
    i = np.concatenate([np.repeat(a, len(b)) for a, b in reach])
    j = np.concatenate([np.tile(b, len(a)) for a, b in reach])
    bodies = sp.csr_matrix((np.ones(len(i)), (i, j)), shape=(nb, nb))
    lines = sp.csr_matrix(
        (
            np.ones(sum(len(x) for x in of_row)),
            (np.repeat(np.arange(nr + nm), [len(x) for x in of_row]), np.concatenate([*of_row, np.zeros(0, int)])),
        ),
        shape=(nr + nm, nb),
    )
    expand = sp.csr_matrix((np.ones(len(body)), (body, np.arange(len(body)))), shape=(nb, len(body)))
    sensed, rows = lines[nr:], lines[:nr]
    states = np.tile(np.isin(body, also), (len(s.controls), 1))
    for k in np.flatnonzero(table.state >= 0):
        states[table.state[k] : table.state[k] + 2] = np.isin(body, S.frame_body[[table.F[k], table.M[k]]])
    laws = sp.csr_matrix(states)
    parts = [expand.T @ bodies @ expand, *(rows @ expand,) * 3, *(sensed @ expand,) * 3, laws]
    return sp.vstack(parts).astype(bool)


def column_groups(touched: Any) -> np.ndarray:
    """Groups of columns no two of which have an entry in one row; each column's group, (n,)."""
    rows = touched.tocsr()
    group = np.full(touched.shape[1], -1)
    for d in range(touched.shape[1]):
        mine = touched.indices[touched.indptr[d] : touched.indptr[d + 1]]
        near = np.concatenate([rows.indices[rows.indptr[r] : rows.indptr[r + 1]] for r in mine.tolist()] or [[]])
        taken = set(group[near.astype(int)].tolist())
        n = 0
        while n in taken:
            n += 1
        group[d] = n
    return group


PERTURBED_SAMPLES = 4
PERTURBATION = 4.0 * np.finfo(float).eps  # relative perturbation of positions and multipliers
EXACT_BITS = 24  # numbers with at most so many significant bits are taken as exact
ROUNDING_MARGIN = 8.0  # differences below so many times the spread of the samples are rounding


def force_magnitudes(e: EquationDerivatives) -> np.ndarray:
    """Magnitude of the forces in every equation of motion: total force plus each reaction, (nv,)."""
    x, r, G = e.state, e.at["r"], e.constraint_jacobian
    force = e.residual[r] + G.T @ x.lam
    if x.vdot.any():
        force = force - e.by_acceleration[r] @ x.vdot
    return np.abs(force) + abs(G).T @ np.abs(x.lam) + np.abs(x.effort)


def residual_rounding(e: EquationDerivatives) -> np.ndarray:
    """Rounding error of every equation of motion, and of the rates of the controller states, (nv + nz,).

    Constraints transmit rounding errors. Each equation of motion therefore gets the largest error, as energy, of its
    connected part of the mechanism.
    """
    z = np.abs(e.state.z[: e.nz])
    return _residual_rounding(e, z + state_sizes(e).change if e.nz else z)


def _residual_rounding(e: EquationDerivatives, states: np.ndarray) -> np.ndarray:
    """Like `residual_rounding`, for given magnitudes of the controller states."""
    size = e.state.c.sizes
    forces, rates = np.zeros(len(size)), PERTURBATION * np.abs(e.state_rates)
    for x in perturbed_states(e.state, states):
        other = EquationDerivatives(x)
        np.maximum(forces, np.abs(other.block("r") - e.block("r")), out=forces)
        np.maximum(rates, np.abs(other.state_rates - e.state_rates), out=rates)
    part = _connected_parts(e)
    most = np.zeros(len(size))
    np.maximum.at(most, part, size * np.maximum(forces, PERTURBATION * force_magnitudes(e)))
    return ROUNDING_MARGIN * np.r_[most[part] / size, rates]


def _connected_parts(e: EquationDerivatives) -> np.ndarray:
    """Number of the connected part of the mechanism that each velocity belongs to, (nv,).

    Two velocities are connected if a constraint can act on both, even if it does not in this position. An equation may
    contain only a multiplier that is itself rounding; the forces connected to it give its magnitude.
    """
    from scipy.sparse.csgraph import connected_components

    G, r = e.state.c.sparse_jacobian(), e.at["r"]
    G.data[:] = 1.0
    return connected_components(abs(e.by_position[r]) + abs(e.by_acceleration[r]) + G.T @ G, directed=False)[1]


def stiffness_rounding(e: EquationDerivatives) -> list:
    """Samples of the rounding error of the stiffness, sparse (nv, nv) each."""
    K = e.by_position[e.at["r"]]
    return [
        ROUNDING_MARGIN * (EquationDerivatives(other).by_position[e.at["r"]] - K)
        for other in perturbed_states(e.state, np.abs(e.state.z[: e.nz]))
    ]


def is_balanced(e: EquationDerivatives, part: float, states: bool = False) -> bool:
    """Whether the residual of every equation is below ``part`` of its forces plus rounding.

    ``states``: and whether the rates of the controller states are within rounding.
    """
    return is_balanced_beyond_rounding(e, part, states) or _is_below(e, part, states, residual_rounding(e))


def is_balanced_beyond_rounding(e: EquationDerivatives, part: float, states: bool = False) -> bool:
    """Like `is_balanced` without the rounding allowance, which is too large where a force jumps."""
    return _is_below(e, part, states, np.zeros(len(e.state.v) + e.nz))


def _is_below(e: EquationDerivatives, part: float, states: bool, rounding: np.ndarray) -> bool:
    nv = len(e.state.v)
    rates = np.abs(e.state_rates) if states else np.zeros(0)
    return bool(
        (np.abs(e.block("r")) <= part * force_magnitudes(e) + rounding[:nv]).all()
        and (rates <= rounding[nv:][: len(rates)]).all()
    )


def unbalanced_fraction(e: EquationDerivatives) -> float:
    """Largest residual relative to the forces of its equation; 0 where it is within rounding."""
    left, acts = np.abs(e.block("r")), force_magnitudes(e)
    return float(
        np.where(left > residual_rounding(e)[: len(left)], left / np.where(acts > 0.0, acts, 1.0), 0.0).max(initial=0.0)
    )


def perturbed_states(x: MechanismState, states: np.ndarray) -> Iterator[MechanismState]:
    """Yield copies of the state and the mechanism's values with random changes of the last digits.

    ``states`` (nz,) are the magnitudes of the controller states.
    """
    S = x.c.values.system
    size = x.c.sizes
    for b in range(len(S.tree.parent)):
        q0, v0, n = int(S.tree.q[b]), int(S.tree.v[b]), count_plain_coordinates(S, b)
        size[v0 : v0 + n] += np.abs(x.q[q0 : q0 + n])
    rng = np.random.default_rng(0)
    for _ in range(PERTURBED_SAMPLES):
        digits = partial(rng.uniform, -PERTURBATION, PERTURBATION)
        q = x.q.copy()
        retract(S, q, size * digits(size=len(size)))
        v, vdot, lam, effort = (a * (1.0 + digits(size=len(a))) for a in (x.v, x.vdot, x.lam, x.effort))
        rounded = with_numbers(S, lambda _, a: np.where(_is_exact(a), a, a * (1.0 + digits(size=a.shape))))  # noqa: B023
        z = x.z.copy()
        z[: len(states)] += states * digits(size=len(states))
        c = replace(x.c, values=replace(x.c.values, system=rounded))
        yield replace(x, c=c, q=q, v=v, z=z, vdot=vdot, lam=lam, effort=effort)


def _is_exact(a: np.ndarray) -> np.ndarray:
    """Which numbers have few significant bits, such as 0, 3 and 0.75: results of roundings have not."""
    leading = np.ldexp(np.frexp(a)[0], EXACT_BITS)
    return leading == np.rint(leading)


class StateSizes(NamedTuple):
    """Natural sizes of the controller states.

    Attributes
    ----------
    change, rate : ndarray (nz,)
        A large change of each state; a large rate, 0 if nothing determines it.
    energy : float [J]
        Energy scale of the mechanism.
    """

    change: np.ndarray
    rate: np.ndarray
    energy: float


def state_sizes(e: EquationDerivatives) -> StateSizes:
    """Natural sizes of the controller states, from the derivatives at a state; computed once."""
    if e.sizes is None:
        e.sizes = _computed_sizes(e)
    return e.sizes  # type: ignore[no-any-return]


def _computed_sizes(e: EquationDerivatives) -> StateSizes:
    size, r, s = e.state.c.sizes, e.at["r"], e.at["s"]
    K, M = e.by_position[r].tocsr(), e.by_acceleration[r].diagonal()
    among = abs(K).multiply(size).multiply(size[:, None])
    inertia = float((size**2 * M).max(initial=0.0))
    pace = float(e.state.c.work.options.rate)
    moved = (abs(e.by_position[s].toarray()) * size).max(axis=1, initial=0.0)  # rates by large steps of the mechanism
    between = np.abs(e.state_jacobian)
    decay = np.diag(between)
    usual = usual_states(np.abs(e.state.z[: e.nz]), moved, between, np.where(decay > 0.0, decay, pace or 1.0))
    energy = _energy_scale(e, float(among.max() if among.nnz else 0.0), usual) or inertia * pace**2 or 1.0
    forces = (np.abs(e.by_state[r]) * size[:, None]).max(axis=0, initial=0.0)  # per unit state
    change = np.where(forces > 0.0, energy / np.where(forces > 0.0, forces, 1.0), np.nan)
    change = _propagated_changes(change, moved, between)
    alone = np.abs(e.state.z[: e.nz]) + np.where(
        decay > 0.0, np.abs(e.state_rates) / np.where(decay > 0.0, decay, 1.0), 0.0
    )
    change = np.where(np.isnan(change) & (alone > 0.0), alone, change)  # value plus distance to rest
    change = _propagated_changes(change, moved, between)
    change = np.where(np.isnan(change), 1.0, change)
    return StateSizes(change, _large_rates(change, moved, between), energy)


def _propagated_changes(change: np.ndarray, moved: np.ndarray, between: np.ndarray) -> np.ndarray:
    """Large changes of states that act on states with known changes; NaN if they act on none."""
    for _ in range(len(change)):
        rate = _large_rates(change, moved, between)[:, None]
        most = np.where(rate > 0.0, between / np.where(rate > 0.0, rate, 1.0), 0.0).max(axis=0, initial=0.0)
        found = np.isnan(change) & (most > 0.0)
        if not found.any():
            break
        change[found] = 1.0 / most[found]
    return change


def usual_states(z: np.ndarray, moved: np.ndarray, between: np.ndarray, decay: np.ndarray) -> np.ndarray:
    """Magnitudes of the states, at least those to which large steps of the mechanism lead them, (nz,)."""
    followed = moved / decay
    for _ in range(len(z)):
        followed = np.where(followed > 0.0, followed, (between * followed).max(axis=1, initial=0.0) / decay)
    return z + followed


def _large_rates(change: np.ndarray, moved: np.ndarray, between: np.ndarray) -> np.ndarray:
    """Large rates caused by the mechanism and by states with known large changes, (nz,)."""
    by_states = between * np.where(np.isnan(change), 0.0, change)
    return np.maximum(moved, by_states.max(axis=1, initial=0.0))


def _energy_scale(e: EquationDerivatives, stiff: float, usual: np.ndarray) -> float:
    """Energy scale [J] of forces and stiffness ``stiff``; 0 if they are rounding, with states of a ``usual`` size."""
    acts, size = force_magnitudes(e), e.state.c.sizes
    loads = float((size * acts).max(initial=0.0))
    if loads > stiff:
        rounding = _residual_rounding(e, usual)[: len(size)]
        loads = float((size * np.where(acts > rounding, acts, 0.0)).max(initial=0.0))
    return max(loads, stiff)
