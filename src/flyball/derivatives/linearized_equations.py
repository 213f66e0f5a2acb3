"""Linear equations of motion in free coordinates, with constraints and rates of inputs eliminated.

The equations of the elimination are the same for numbers and for expressions. Let x be a change of position along the
velocities, u a change of velocity, both seen from an evenly turning frame (see `steady_motion`), z a change of the
controller states, w the inputs. The perturbed kinematics, equations of motion, constraints and controllers at a state
are

    x' + H x = u + N x,    M (u' + H u) + D u + K x + R z + r_w w = G^T l,
    G x + g_w w = 0,       G u + V x + n_w w + g_w w' = 0,    z' = s_x x + s_u u + s_z z + s_w w

K contains the change of forces, inertia and *reactions* when positions change. Joint forces turn with the bodies, so K
is not only the stiffness of the springs. With x = Z a + X w and u = Zv b + P a + U w + U1 w' the multipliers drop out
of the equations along Zv. Joint friction depends on the reactions, adds F to -G^T, and needs another projection.
Inputs that move the mechanism act through their rates, too. The change of state y~ = y - B2 w' - (B1 + A B2) w
eliminates these.

The parts of this module, in order: the elimination; minimum-norm solutions of redundant equations; free coordinates
(bases of the motions that constraints allow, with identity rows for the chosen coordinates); bounds of the rounding
errors of coefficients (Parlett and Reinsch 1969; Watkins 2006); the reduction itself.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple, Protocol

import numpy as np

from ..assembly.compiled_mechanism import CompiledMechanism
from ..engine.kinematics import retract
from ..errors import ModelError, SingularityError
from ..model.messages import listing, suggest
from ..numerics.rank import (
    RANK_TOLERANCE,
    clearly_independent,
    column_space,
    fundamental_subspaces,
    null_basis,
    null_space,
)
from ..numerics.rank import sparse_matrix_rank as rank_of
from ..tables.structure_definition import VelocityName, velocity_names
from .equation_derivatives import EquationDerivatives, force_magnitudes, refuse_undetermined_friction, state_sizes

# Dependence of an output on an input's rate below this part of its total dependence on the input is rounding.
IMPROPER_TOLERANCE = 1e-12


def product(A: np.ndarray, B: np.ndarray) -> np.ndarray:
    """Product A B; of expressions without products of zeros."""
    if object not in (A.dtype, B.dtype):
        return np.asarray(A @ B)
    C = B if B.ndim == 2 else B[:, None]
    out = np.zeros((len(A), C.shape[1]), object)
    for row, a in zip(out, A, strict=True):
        for k in np.flatnonzero(a != 0.0):
            for j in np.flatnonzero(C[k] != 0.0):
                row[j] = row[j] + a[k] * C[k, j]
    return out.reshape(len(A), *B.shape[1:])


class FreeMotions(Protocol):
    """Motions that the constraints allow.

    ``chosen`` and ``chosen_v`` are the free coordinates and velocities; ``on_positions`` says which constraints are on
    positions.
    """

    chosen: np.ndarray
    chosen_v: np.ndarray
    on_positions: np.ndarray

    @property
    def Z(self) -> np.ndarray:
        """Basis of the changes of positions, (nv, f), with the identity in the rows ``chosen``."""

    @property
    def Zv(self) -> np.ndarray:
        """Basis of the changes of velocities, (nv, fv), with the identity in the rows ``chosen_v``."""

    def dependent_positions(self, right: np.ndarray) -> np.ndarray:
        """Changes x with G x + right = 0 that change no chosen coordinate; G: constraints on positions."""

    def dependent_velocities(self, right: np.ndarray) -> np.ndarray:
        """Changes u with G u + right = 0 that change no chosen velocity."""

    def coordinates(self, x: np.ndarray) -> np.ndarray:
        """Changes of the chosen coordinates in changes x."""


@dataclass
class InputTerms:
    """Derivatives of the equations by m inputs at a fixed state.

    r_w (nv, m), g_w (holonomic, m), n_w (rows, m), s_w (nz, m); a_w (rows, m) only where the motion is not steady.
    """

    r: np.ndarray
    g: np.ndarray
    n: np.ndarray
    s: np.ndarray
    a: np.ndarray | None = None


class ConstrainedChanges(NamedTuple):
    """Changes that keep the constraints; columns as in `ReducedEquations`.

    Attributes
    ----------
    x, u, z : ndarray
        Changes of positions, velocities and controller states.
    a_dot : ndarray
        Rates of the changes of the free coordinates.
    known : ndarray
        The part of the accelerations that does not depend on b'.
    """

    x: np.ndarray
    u: np.ndarray
    z: np.ndarray
    a_dot: np.ndarray
    known: np.ndarray


def constrained_changes(f: FreeMotions, w: InputTerms, V: np.ndarray, turning: np.ndarray) -> ConstrainedChanges:
    """Changes that keep the constraints; ``turning`` is N - H, ``V`` as in the module."""
    nv, nz, m = len(V.T), *w.s.shape
    kind = f.Z.dtype
    none, still, rates = np.zeros((nv, m), kind), np.zeros((nv, nz), kind), np.zeros((len(V), m), kind)
    rates[f.on_positions] = w.g
    X = f.dependent_positions(w.g)
    P, U, U1 = (f.dependent_velocities(b) for b in (product(V, f.Z), product(V, X) + w.n, rates))
    x = np.hstack([f.Z, np.zeros(f.Zv.shape, kind), still, X, none, none])
    u = np.hstack([P, f.Zv, still, U, U1, none])
    z = np.zeros((nz, x.shape[1]), kind)
    free = f.Z.shape[1] + f.Zv.shape[1]
    np.fill_diagonal(z[:, free:], 1.0)
    a_dot = f.coordinates(u + product(turning, x))
    return ConstrainedChanges(
        x, u, z, a_dot, product(P, a_dot) + np.hstack([np.zeros((nv, free + nz), kind), none, U, U1])
    )


def acting_terms(
    c: ConstrainedChanges, by_velocity: np.ndarray, by_position: np.ndarray, by_state: np.ndarray, by_input: np.ndarray
) -> np.ndarray:
    """Changes of forces, or of rates of controller states, along the columns."""
    n, m = by_input.shape
    free = c.x.shape[1] - by_state.shape[1] - 3 * m
    direct = [np.zeros((n, free), c.x.dtype), by_state, by_input, np.zeros((n, 2 * m), c.x.dtype)]
    return product(by_velocity, c.u) + product(by_position, c.x) + np.hstack(direct)


@dataclass
class ReducedEquations:
    """Linear equations in the changes y = (a, b, z) of free coordinates, velocities and controller states, and inputs.

    The columns of every array belong to y (n), the inputs, and their first and second rates (m each).

    Attributes
    ----------
    rate : ndarray (n, n + 3 m)
        y' as a linear function of y and the inputs.
    position, velocity, acceleration, multipliers, states : ndarray
        Changes of all positions, velocities, accelerations, multipliers and efforts of prescribed coordinates, and
        controller states.
    laws : ndarray (nz, n + 3 m)
        Changes of the rates of the controller states; for sampled ones of the values from the next instant on.
    changes : ndarray (nz,)
        Large changes of the controller states.
    M, D, K : ndarray (f, f) or None
        Matrices of M a'' + D a' + K a = 0; None unless all constraints are on positions and there are no states z.
    uncertainty : MatrixUncertainty
        Uncertainty of A due to rounding.
    """

    rate: np.ndarray
    position: np.ndarray
    velocity: np.ndarray
    acceleration: np.ndarray
    multipliers: np.ndarray
    states: np.ndarray
    laws: np.ndarray
    changes: np.ndarray
    M: np.ndarray | None = None
    D: np.ndarray | None = None
    K: np.ndarray | None = None
    uncertainty: Any = None

    @property
    def A(self) -> np.ndarray:
        """System matrix, y' = A y without inputs."""
        return self.rate[:, : len(self.rate)]

    def inputs(self, part: np.ndarray) -> list[np.ndarray]:
        """Columns of the inputs, of their first rates and of their second rates."""
        return np.split(part[:, len(self.rate) :], 3, axis=1)

    def add_second_order(
        self, f: FreeMotions, Y: np.ndarray, mass: np.ndarray, whole: Sequence[np.ndarray], turning: np.ndarray
    ) -> None:
        """Set M, D and K: ``mass``, and from M, M H + D, K of all velocities; Y^T eliminates the multipliers."""
        if f.Zv.shape != f.Z.shape or len(self.states):
            return
        M, D, K = whole
        turned = -product(turning, f.Z)  # u = Z a' + turned a
        self.M = mass
        self.D = product(Y.T, product(M, turned) + product(D, f.Z))
        self.K = product(Y.T, product(D, turned) + product(K, f.Z))

    def state_space(self, y: np.ndarray) -> tuple[list[np.ndarray], tuple[int, int, str] | None]:
        """A, B, C, D for the state in which the rates of inputs are eliminated, of outputs ``y`` along the columns.

        And (output, input, rate) of an output that depends on the rate of an input; None if there is none.
        """
        A, n = self.A, len(self.rate)
        B, B1, B2 = self.inputs(self.rate)
        C, (D, D1, D2) = y[:, :n], self.inputs(y)
        shift = B1 + product(A, B2)
        size = sum(_sizes(X) for X in (D, D1, D2)) + _sizes(C) @ sum(_sizes(X) for X in (B, B1, B2))
        improper = None
        for rate, part in (("rate", D1 + product(C, B2)), ("second rate", D2)):
            for k, i in np.argwhere(_sizes(part) > IMPROPER_TOLERANCE * size)[:1]:
                improper = improper or (int(k), int(i), rate)
        return [A, B + product(A, shift), C, D + product(C, shift)], improper


def _sizes(X: np.ndarray) -> Any:
    """Absolute values of numbers, or of expressions with the parameters' own values."""
    return np.abs(np.array([x.real for x in X.ravel()], float).reshape(X.shape))


def state_names(
    names: Sequence[VelocityName], f: FreeMotions, controls: Sequence[str]
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Names and units of the states y."""
    a, b = ([names[d] for d in of] for of in (f.chosen, f.chosen_v))
    units = (*(n.unit for n in a), *(f"{n.unit}/s" for n in b), *("" for _ in controls))
    return (*(n.name for n in a), *(f"{n.name} rate" for n in b), *controls), units


DENSE_UNKNOWNS = 400  # up to so many unknowns the solution uses singular values
SINGULAR_VALUE_LIMIT = 1e-11  # singular values below this part of the largest count as zero
REGULARISATION = 1e-10  # added to the diagonal of sparse equations, relative to their entries
MAX_REFINEMENTS = 4  # iterative refinements at most


def minimum_norm_solution(A, b: np.ndarray) -> np.ndarray:
    """Minimum-norm least-squares solution x of A x = b; A is sparse, or an array if it is small.

    Iterative refinement makes the small parts of b as accurate, relative to themselves, as the large ones.
    """
    A = A.toarray() if max(A.shape) <= DENSE_UNKNOWNS and not isinstance(A, np.ndarray) else A
    solve = _dense_solver(A) if max(A.shape) <= DENSE_UNKNOWNS else _sparse_solver(A)
    x, left, before = np.zeros(A.shape[1]), b, np.inf
    for _ in range(MAX_REFINEMENTS):
        step = solve(left)
        size = np.abs(step).max(initial=0.0)
        if not size < 0.5 * before:
            break
        x, before = x + step, size
        left = b - A @ x
    return x


def _dense_solver(A) -> Callable[[np.ndarray], np.ndarray]:
    """Solver by QR with column pivoting where A has full rank, by singular values elsewhere."""
    from scipy.linalg import qr, solve_triangular

    wide = A.shape[0] < A.shape[1]
    Q, R, order = qr(A.T if wide else A, mode="economic", pivoting=True)
    d = np.abs(np.diagonal(R))
    if d.size and d[-1] > SINGULAR_VALUE_LIMIT * d[0]:
        back = np.argsort(order)
        if wide:
            return lambda b: Q @ solve_triangular(R, b[order], trans="T")
        return lambda b: solve_triangular(R, Q.T @ b)[back]
    U, d, Vt = np.linalg.svd(A, full_matrices=False)
    k = int((d > SINGULAR_VALUE_LIMIT * d.max(initial=0.0)).sum())
    return lambda b: Vt[:k].T @ ((U[:, :k].T @ b) / d[:k])


def _sparse_solver(A) -> Callable[[np.ndarray], np.ndarray]:
    """Solver that factorises the regularised augmented matrix [-e I, A; A^T, e I]."""
    import scipy.sparse as sp
    from scipy.sparse.linalg import splu

    m, n = A.shape
    e = REGULARISATION * np.abs(A.data).max()
    factor = splu(sp.bmat([[-e * sp.identity(m), A], [A.T, e * sp.identity(n)]]).tocsc())
    return lambda b: factor.solve(np.r_[b, np.zeros(n)])[m:]


# Up to so many rows the null space follows from singular values; above, only if the rows may be dependent.
DENSE_ROWS = 150
BASIS_ROUNDING = 1e-14  # basis entries below this are zero; the largest are about 1
VANISHING = 1e-13  # forces or constraint entries below this part of the largest are rounding
CLOSURE_TOLERANCE = 1e-10  # relative to the mechanism's length, or a radian
CLOSURE_ITERATIONS = 20
# Distance [rad, or mechanism lengths] of the nearby position whose constraint rank is compared.
NEARBY_STEP = 1e-2


@dataclass
class FreeCoordinates:
    """Free coordinates and velocities of a mechanism at a state.

    Attributes
    ----------
    names : list of VelocityName
        Names of all velocities.
    holonomic, rows : ndarray
        Jacobian rows of the constraints on positions (n, nv), and of all constraints (m, nv). Prescribed
        coordinates count as constraints.
    Z, Zv : ndarray (nv, f), (nv, fv)
        Bases of the motions that these rows allow, without the rotations of point masses (`massless_rotations`).
        The rows ``chosen`` and ``chosen_v`` of the bases are the identity.
    """

    names: list[VelocityName]
    holonomic: np.ndarray
    rows: np.ndarray
    Z: np.ndarray
    Zv: np.ndarray
    chosen: np.ndarray
    chosen_v: np.ndarray
    scale: np.ndarray
    position_selector: np.ndarray  # (f, nv): selects the changes of the chosen coordinates
    velocity_selector: np.ndarray  # the same for velocities
    on_positions: np.ndarray  # (m,): True for constraints on positions

    @property
    def labels(self) -> list[str]:
        """Names of the chosen coordinates."""
        return [self.names[d].name for d in self.chosen]

    def turned(self, T: np.ndarray, later_equations: EquationDerivatives) -> FreeCoordinates:
        """The same motions turned by T (nv, nv), with the constraints of a later time."""
        other = free_coordinates(later_equations)
        back = np.linalg.inv(T)
        bases = {
            "Z": T @ self.Z,
            "Zv": T @ self.Zv,
            "position_selector": self.position_selector @ back,
            "velocity_selector": self.velocity_selector @ back,
        }
        return replace(self, holonomic=other.holonomic, rows=other.rows, **bases)

    def solve(self, right: np.ndarray, rows: np.ndarray | None = None) -> np.ndarray:
        """Minimum-norm x (nv, n) with rows x = right; by default with all rows."""
        A = self.rows if rows is None else rows
        return self.scale[:, None] * np.linalg.lstsq(A * self.scale, right, rcond=RANK_TOLERANCE)[0]

    def dependent_positions(self, right: np.ndarray) -> np.ndarray:
        """See `FreeMotions`."""
        x = -self.solve(right, self.holonomic)
        return x - self.Z @ (self.position_selector @ x)

    def dependent_velocities(self, right: np.ndarray) -> np.ndarray:
        """See `FreeMotions`."""
        if not right.any():
            return np.zeros((len(self.scale), right.shape[1]))
        u = -self.solve(right)
        return u - self.Zv @ (self.velocity_selector @ u)

    def coordinates(self, x: np.ndarray) -> np.ndarray:
        """See `FreeMotions`."""
        return self.position_selector @ x


def free_coordinates(e: EquationDerivatives, like: FreeCoordinates | None = None) -> FreeCoordinates:
    """Free coordinates at the state of the equations; with the chosen coordinates of ``like`` if given."""
    c = e.state.c
    s = c.structure
    names = velocity_names(s)
    scale = c.sizes / c.values.length
    G = e.by_velocity[e.at["n"]].toarray()
    which = np.array([r.holonomic for r in s.rows], bool)
    given = prescribed_rows(c)
    holonomic, rows = np.vstack([G[which], given]), np.vstack([G, given])
    still = _selection_rows(massless_rotations(e), s.nv)
    Z, chosen = _free_basis(np.vstack([holonomic, still]), scale, None if like is None else like.chosen)
    Zv, chosen_v = Z, chosen
    if not which.all():
        Zv, chosen_v = _free_basis(np.vstack([rows, still]), scale, None if like is None else like.chosen_v)
    left = _selection_rows(chosen, s.nv)
    left_v = left if chosen_v is chosen else _selection_rows(chosen_v, s.nv)
    on_positions = np.r_[which, np.ones(len(given), bool)]
    return FreeCoordinates(names, holonomic, rows, Z, Zv, chosen, chosen_v, scale, left, left_v, on_positions)


DETERMINED = 1e-6  # smallest singular value of the chosen part of an orthonormal basis of the free motions


def coordinates_named(e: EquationDerivatives, independent: Sequence[str]) -> FreeCoordinates:
    """Free coordinates whose changes of position are those of the named coordinates.

    Raises
    ------
    ModelError
        If there is no such coordinate, or their number is not that of the degrees of freedom.
    SingularityError
        If they do not determine the motions that the constraints allow.
    """
    names = [n.name for n in velocity_names(e.state.c.structure)]
    for k, name in enumerate(independent):
        if name not in names:
            layer = "joint" if e.state.c.structure.tree else "absolute"
            raise ModelError(
                f"independent: {name!r} is no coordinate of the equations, which are in {layer} coordinates"
                f"{suggest(name, names)}; {listing(names)}"
            )
        if name in independent[:k]:
            raise ModelError(f"independent: {name!r} is given twice")
    f = free_coordinates(e)
    if len(f.chosen) != len(independent):
        raise ModelError(
            f"independent: {len(independent)} coordinates are given, and the mechanism has {len(f.chosen)} degrees of "
            f"freedom at t = {e.state.t:.6g} s, for instance of {', '.join(f.labels)}"
        )
    chosen = np.array([names.index(name) for name in independent], int)
    motions = np.linalg.qr(f.Z / f.scale[:, None])[0]
    if len(chosen) and np.linalg.svd(motions[chosen], compute_uv=False)[-1] < DETERMINED:
        raise SingularityError(
            f"independent: {', '.join(independent)} do not determine the motion of the mechanism at t = "
            f"{e.state.t:.6g} s; choose other coordinates, for instance {', '.join(f.labels)}",
            e.state.t,
            tuple(independent),
        )
    return free_coordinates(e, replace(f, chosen=chosen, chosen_v=chosen if f.chosen_v is f.chosen else f.chosen_v))


def _selection_rows(which: np.ndarray, n: int) -> np.ndarray:
    """Unit rows (m, n) that select m of n numbers."""
    out = np.zeros((len(which), n))
    out[np.arange(len(which)), which] = 1.0
    return out


def massless_rotations(e: EquationDerivatives) -> np.ndarray:
    """Indices of the rotations of point masses, which have no inertia and on which nothing acts."""
    M, D, K = (X[e.at["r"]] for X in (e.by_acceleration, e.by_velocity, e.by_position))
    none = np.flatnonzero(M.diagonal() == 0.0)
    if not len(none):
        return none
    size, G = e.state.c.sizes, e.by_velocity[e.at["n"]]
    force = abs(D) + abs(K)
    acts = np.maximum((force @ size) * size, size * (force.T @ size))
    held = (abs(G).T @ np.ones(G.shape[0])) * size
    return np.array([d for d in none if all(x[d] <= VANISHING * x.max(initial=0.0) for x in (acts, held))], int)


def prescribed_rows(c: CompiledMechanism) -> np.ndarray:
    """Unit rows (n, nv) of the coordinates that drivers prescribe, in the order of ``Structure.prescribed``."""
    tree = c.structure.tables["tree"]
    out = np.zeros((len(c.structure.prescribed), c.structure.nv))
    for k, b in enumerate(c.structure.prescribed.values()):
        assert tree.law[b] >= 0
        out[k, tree.v[b]] = 1.0
    return out


def constraint_rank(G: np.ndarray, scale: np.ndarray) -> int:
    """Rank of constraint rows."""
    return rank_of(normalised_rows(G, scale)) if len(G) else 0


def _null_space(G: np.ndarray, scale: np.ndarray) -> np.ndarray:
    """Orthonormal basis of the scaled motions that the rows allow."""
    import scipy.sparse as sp

    A = normalised_rows(G, scale)
    if DENSE_ROWS < len(A) < len(scale) and clearly_independent(own := sp.csr_matrix(A)):
        return null_basis(own)
    return null_space(A)


def normalised_rows(G: np.ndarray, scale: np.ndarray) -> np.ndarray:
    """Rows scaled to unit norm, rotations scaled to lengths."""
    A = G * scale
    size = np.sqrt((A * A).sum(axis=1))
    return A / np.where(size > 0.0, size, 1.0)[:, None]


def gap_lengths(g: np.ndarray, G: np.ndarray, scale: np.ndarray) -> np.ndarray:
    """Constraint violations as lengths: each value divided by the norm of its row."""
    size = np.linalg.norm(G * scale, axis=1)
    return np.asarray(g / np.where(size > 0.0, size, 1.0))


def _free_basis(G: np.ndarray, scale: np.ndarray, chosen: np.ndarray | None) -> tuple[np.ndarray, np.ndarray]:
    N = _null_space(G, scale)
    if not N.shape[1]:
        return N, np.zeros(0, int)
    if chosen is None or len(chosen) != N.shape[1]:
        chosen = pivot_rows(N)
    Z = scale[:, None] * N
    Z = Z @ np.linalg.inv(Z[chosen])
    Z[np.abs(Z) <= BASIS_ROUNDING * scale[:, None] / scale[chosen]] = 0.0
    Z[chosen] = np.eye(len(chosen))
    return Z, chosen


def pivot_rows(N: np.ndarray) -> np.ndarray:
    """Indices (f,) of the rows of an orthonormal basis (nv, f) that determine the others, by pivoted QR."""
    from scipy.linalg import qr

    if not N.shape[1]:
        return np.zeros(0, int)
    *_, order = qr(N.T, mode="economic", pivoting=True)
    return np.sort(order[: N.shape[1]])


def refuse_singular_position(e: EquationDerivatives, f: FreeCoordinates) -> None:
    """Refuse a position where the constraints lose rank, because no linear model exists there.

    Raises
    ------
    SingularityError
        With the names of the elements whose rows are dependent here and independent nearby.
    """
    c, x = e.state.c, e.state
    if not len(f.holonomic) or not f.Z.shape[1]:
        return
    here = constraint_rank(f.holonomic, f.scale)
    rng = np.random.default_rng(0)
    for _ in range(2):
        a = f.Z @ (f.scale[f.chosen] * rng.standard_normal(f.Z.shape[1]))
        a *= NEARBY_STEP / np.abs(a / c.sizes).max()
        G = _nearby_jacobian(c, x.t, x.q, a, f.scale)
        if G is not None and constraint_rank(G, f.scale) > here:
            of = [r.element.name for r in c.structure.rows if r.holonomic] + list(c.structure.prescribed)
            now, there = (normalised_rows(rows, f.scale) for rows in (f.holonomic, G))
            raise singular_position_error(x.t, lost_constraints(now, there, of))


def singular_position_error(t: float, names: tuple[str, ...]) -> SingularityError:
    """The error that names the elements whose constraints lose rank at a position."""
    return SingularityError(
        f"the mechanism is in a singular position at t = {t:.6g} s: the constraints of {', '.join(names)} are "
        "dependent here and not nearby, so that there is no linear model; choose another position",
        t,
        names,
    )


def _nearby_jacobian(
    c: CompiledMechanism, t: float, q: np.ndarray, step: np.ndarray, scale: np.ndarray
) -> np.ndarray | None:
    """Rows of the position constraints at the assembled position nearest to a step; None if assembly fails."""
    z, q, still = c.z.copy(), q.copy(), np.zeros(len(step))
    which = np.array([r.holonomic for r in c.structure.rows], bool)
    G = np.zeros((0, len(step)))
    try:
        for _ in range(CLOSURE_ITERATIONS):
            retract(c.values.system, q, step)
            c.at(t, q, still)
            G, g = c.jacobian()[which], c.work.rows.value[which]
            rows = np.vstack([G, prescribed_rows(c)])
            if np.abs(g / c.row_units[which]).max(initial=0.0) < CLOSURE_TOLERANCE:
                return rows
            gaps = gap_lengths(np.r_[g, np.zeros(len(rows) - len(g))], rows, scale)
            step = -scale * np.linalg.lstsq(normalised_rows(rows, scale), gaps, rcond=RANK_TOLERANCE)[0]
        return None
    finally:
        c.z = z


PARTICIPATION = 1e-3  # elements whose part in a dependency is smaller do not take part in it


def lost_constraints(here: np.ndarray, there: np.ndarray, elements: Sequence[str]) -> tuple[str, ...]:
    """Elements whose normalised rows take part in dependencies that nearby positions do not have."""
    lost, span = fundamental_subspaces(here).dependencies, fundamental_subspaces(there).span
    part = np.abs(lost @ (lost.T @ span)).max(axis=1)
    return tuple(dict.fromkeys(name for name, x in zip(elements, part, strict=True) if x > PARTICIPATION))


def static_equations(e: EquationDerivatives) -> EquationDerivatives:
    """Equations with zero accelerations, and the multipliers and efforts that balance the forces best."""
    import scipy.sparse as sp

    x, c = e.state, e.state.c
    rows = e.by_velocity[e.at["n"]]
    still = replace(x, vdot=0.0 * x.vdot, lam=0.0 * x.lam, effort=0.0 * x.effort)
    A = sp.diags(c.sizes) @ sp.vstack([rows, prescribed_rows(c)]).T.tocsr()
    if not A.shape[1]:
        return EquationDerivatives(still)
    size = np.sqrt(np.asarray(A.multiply(A).sum(axis=0)).ravel())
    size = 1.0 / np.where(size > 0.0, size, 1.0)
    y = size * minimum_norm_solution(A @ sp.diags(size), c.sizes * EquationDerivatives(still).block("r"))
    return EquationDerivatives(replace(still, lam=y[: len(x.lam)], effort=prescribed_rows(c).T @ y[len(x.lam) :]))


COEFFICIENT_ROUNDING = 2e-14  # uncertainty of coefficients, relative to the largest term of the equation
DIRECTION_ROUNDING = 1e-15  # the same, relative to the largest term of all equations of the same bodies
SLOWEST_FRACTION = 1e-3  # lower bound of the fastest rate, relative to the rate that the uncancelled terms would give


class TermSizes(NamedTuple):
    """Magnitudes of the terms whose sums are the coefficients, p columns.

    Attributes
    ----------
    mass : ndarray (fv, fv)
        Mass matrix of the free velocities.
    rates : ndarray (f, p)
        Terms in the rates of the free coordinates.
    forces : ndarray (nv, p)
        Terms in the equations of motion.
    states : ndarray (nz, p)
        Terms in the rates of the controller states.
    Y, M : ndarray (nv, fv), (nv, nv)
        Directions along which the multipliers drop out; mass matrix.
    """

    mass: np.ndarray
    rates: np.ndarray
    forces: np.ndarray
    states: np.ndarray
    Y: np.ndarray
    M: np.ndarray


class MatrixUncertainty(NamedTuple):
    """Uncertainty of a matrix A: A + by X, with any X whose entries do not exceed those of ``size``, (n, n).

    ``unit``: natural sizes of the states, (n,).
    """

    by: np.ndarray
    size: np.ndarray
    unit: np.ndarray


def remove_rounding(
    terms: TermSizes,
    a_dot: np.ndarray,
    forces: np.ndarray,
    rates: np.ndarray,
    e: EquationDerivatives,
    f: FreeCoordinates,
) -> MatrixUncertainty:
    """Set coefficients within rounding to 0 and return the uncertainty of the others.

    The entries of an equation are compared in the natural units of the coordinates, and rates in units of the fastest
    motion. Terms that cancel in one column have the same rounding error as terms that do not cancel in another. A force
    on a body along one axis also appears along the other axes because the directions are rounded.

    Parameters
    ----------
    terms : TermSizes
        Entries of its mass matrix that are rounding are also set to 0.
    a_dot : ndarray (f, p)
        Rates of the free coordinates.
    forces : ndarray (fv, p)
        Forces along the directions in which the multipliers drop out.
    rates : ndarray (nz, p)
        Rates of the controller states.
    """
    a, fv, nv = len(a_dot), len(forces), len(f.scale)
    m = a + fv
    n = m + len(rates)
    scale, along = np.r_[f.scale[f.chosen], f.scale[f.chosen_v]], np.abs(terms.Y).T
    inertia = np.sqrt(np.maximum(np.abs(np.diag(terms.mass)), 1e-300))
    terms.mass[np.abs(terms.mass) <= COEFFICIENT_ROUNDING * np.outer(inertia, inertia)] = 0.0
    inverse = np.linalg.inv(terms.mass) if fv else terms.mass
    turned = _coupled_maximum(force_magnitudes(e), terms.M, e, f.scale)  # change of the forces by a rotation of 1 rad
    unit = np.r_[scale, state_sizes(e).change if e.nz else np.zeros(0)]
    if fv:
        A = np.abs(inverse @ forces[:, :n]) / scale[a:, None]
        most = np.hstack([along @ terms.forces[:, :m] * scale, (along @ turned)[:, None]])
        uncancelled = most / inertia[:, None] ** 2 / scale[a:, None]
        unit[a:m] *= _fastest_rate(A[:, :m] * scale, uncancelled, a, float((A[:, m:] * unit[m:]).max(initial=0.0)))
    rows = (terms.forces[:, :n] * unit).max(axis=1, initial=0.0) if n else np.zeros(nv)
    first, last = (
        COEFFICIENT_ROUNDING * (part[:, :n] * unit).max(axis=1, initial=0.0) for part in (terms.rates, terms.states)
    )
    second = along @ (
        COEFFICIENT_ROUNDING * rows + DIRECTION_ROUNDING * (_coupled_maximum(rows, terms.M, e, f.scale) + turned)
    )
    size = np.r_[first, second, last][:, None] / unit
    for own, least in ((a_dot[:, :n], size[:a]), (forces[:, :n], size[a:m]), (rates[:, :n], size[m:])):
        own[np.abs(own) <= least] = 0.0
    by = np.eye(n)
    by[a:m, a:m] = inverse
    return MatrixUncertainty(by, size, unit)


def _fastest_rate(A: np.ndarray, uncancelled: np.ndarray, a: int, pushed: float) -> float:
    """Rate [1/s] of the fastest motion, from accelerations and their uncancelled terms (fv, n), in natural units.

    ``pushed`` is the largest acceleration caused by controller states; if nothing else acts, the rest is rounding.
    """

    def rate(by_position: np.ndarray, by_velocity: np.ndarray) -> float:
        return max(float(np.sqrt(by_position.max(initial=0.0))), float(by_velocity.max(initial=0.0)))

    n = A.shape[1]
    static = np.hstack([uncancelled[:, :a], uncancelled[:, n:]])
    return max(rate(A[:, :a], A[:, a:]), SLOWEST_FRACTION * rate(static, uncancelled[:, a:n]), np.sqrt(pushed)) or 1.0


def _coupled_maximum(rows: np.ndarray, M: np.ndarray, e: EquationDerivatives, scale: np.ndarray) -> np.ndarray:
    """Largest entry on all bodies coupled by the mass matrix, for each velocity in its own units."""
    from scipy.sparse.csgraph import connected_components

    nv = e.state.c.structure.tables["tree"].nv
    body = np.repeat(np.arange(len(nv)), nv)
    _, part = connected_components((M != 0.0) | (body[:, None] == body), directed=False)
    most = np.zeros(part.max(initial=-1) + 1)
    np.maximum.at(most, part, rows * scale)
    return most[part] / scale


@dataclass
class TurningFrame:
    """An evenly turning frame.

    Attributes
    ----------
    turning : ndarray (3,) [rad/s]
        Angular velocity in world axes.
    H : ndarray (nv, nv) [1/s]
        Generator of the turning of co-moving changes of positions and velocities.
    N : ndarray (nv, nv) [1/s]
        (rate of a change of position) = (change of velocity) + N (change of position).
    description : str
        Description for messages and reports; empty at rest.
    steady : bool
        Whether the coefficients are constant as seen from the frame; if not, the equations are those of one instant.
    """

    turning: np.ndarray
    H: np.ndarray
    N: np.ndarray
    description: str = ""
    steady: bool = True


def reduced_equations(
    e: EquationDerivatives, f: FreeCoordinates, frame: TurningFrame, w: InputTerms | None = None
) -> ReducedEquations:
    """Eliminate the constraints.

    Raises
    ------
    ModelError
        If a free motion has no inertia.
    """
    r, s, nv = e.at["r"], e.at["s"], len(f.scale)
    M, D, K = (X[r].toarray() for X in (e.by_acceleration, e.by_velocity, e.by_position))
    S, T, Z = e.by_position[s].toarray(), e.by_velocity[s].toarray(), e.by_state[s]
    H, turning = frame.H, frame.N - frame.H
    w = w or InputTerms(*(np.zeros((n, 0)) for n in (nv, len(f.holonomic), len(f.rows), e.nz)))
    V = np.vstack([e.by_position[e.at["n"]].toarray(), np.zeros((len(f.rows) - e.block("n").size, nv))])
    c = constrained_changes(f, w, V, turning)
    if not frame.steady:
        c = c._replace(known=_accelerations_of_constraints(e, f, c, w))
    others = acting_terms(c, M @ H + D, K, e.by_state[r], w.r)
    laws = acting_terms(c, T, S, Z, w.s)
    by_multipliers = -f.rows.T
    Y = f.Zv
    if e.state.c.structure.loads:
        by_multipliers[:, : e.block("n").size] += e.by_reactions
        Y = _multiplier_free_directions(e, f)
    size = abs(M @ H) @ abs(c.u) + abs(D) @ abs(c.u) + abs(K) @ abs(c.x) + abs(M) @ abs(c.known)
    size += abs(e.by_state[r]) @ abs(c.z)
    law_terms = abs(S) @ abs(c.x) + abs(T) @ abs(c.u) + abs(Z) @ abs(c.z)
    terms = TermSizes(
        Y.T @ M @ f.Zv, abs(f.position_selector) @ (abs(c.u) + abs(turning) @ abs(c.x)), size, law_terms, Y, M
    )
    forces, rates = Y.T @ (M @ c.known + others), np.where(e.sampled[:, None], 0.0, laws)
    try:
        doubt = remove_rounding(terms, c.a_dot, forces, rates, e, f)
    except np.linalg.LinAlgError:
        d = f.chosen_v[int(np.argmin(np.abs(np.diag(terms.mass))))]
        raise massless_motion_error(f.names[d].name) from None
    b_dot = np.linalg.solve(terms.mass, 0.0 - forces) if f.Zv.shape[1] else c.a_dot[:0]
    acceleration = f.Zv @ b_dot + c.known + H @ c.u
    left = M @ (acceleration - H @ c.u) + others
    multipliers = np.linalg.lstsq(f.scale[:, None] * by_multipliers, -f.scale[:, None] * left, rcond=1e-12)[0]
    rate, changes = np.vstack([c.a_dot, b_dot, rates]), state_sizes(e).change if e.nz else np.zeros(0)
    out = ReducedEquations(rate, c.x, c.u, acceleration, multipliers, c.z, laws, changes, uncertainty=doubt)
    out.add_second_order(f, Y, terms.mass, (M, M @ H + D, K), turning)
    return out


def _accelerations_of_constraints(
    e: EquationDerivatives, f: FreeCoordinates, c: ConstrainedChanges, w: InputTerms
) -> np.ndarray:
    """Changes of the accelerations that keep the constraints and are zero along the chosen velocities.

    Along any motion the second derivative of the constraints, G v' - gamma = 0, is perturbed:
    G u' + a_x x + a_u u + a_w w + (n_w + g_w') w' + g_w w'' = 0, where g_w' = n_w for constraints on positions. In a
    steady motion this is the derivative of the perturbed constraints with constant coefficients.
    """
    a, m = e.at["a"], w.r.shape[1]
    below = ((0, len(f.rows) - e.block("n").size), (0, 0))  # prescribed coordinates depend on inputs only
    right = np.pad(e.by_position[a].toarray(), below) @ c.x + np.pad(e.by_velocity[a].toarray(), below) @ c.u
    if m:
        assert w.a is not None
        second = np.zeros((len(f.rows), m))
        second[f.on_positions] = w.g
        right[:, -3 * m :] += np.hstack([w.a, w.n * np.where(f.on_positions, 2.0, 1.0)[:, None], second])
    return f.dependent_velocities(right)


def massless_motion_error(name: str) -> ModelError:
    """The error that names a free motion without inertia."""
    return ModelError(
        f"nothing with inertia moves along {name}: there is no linear equation of motion; give it a mass or a moment "
        f"of inertia"
    )


def _multiplier_free_directions(e: EquationDerivatives, f: FreeCoordinates) -> np.ndarray:
    """Y (nv, fv) with Y^T dr/dl = 0, so that the multipliers drop out; equal to Zv without joint friction.

    Y^T = Zv^T - Zv^T R (C^T R)^+ C^T, with R = dr/dl and C a basis of the constraint directions.
    """
    F = np.zeros(f.rows.T.shape)
    F[:, : e.block("n").size] = e.by_reactions
    scaled = f.scale[:, None] * e.by_reactions
    refuse_undetermined_friction(e.state.c.structure, (f.rows * f.scale)[: e.block("n").size], scaled)
    R = f.scale[:, None] * (F - f.rows.T)
    C = column_space((f.rows * f.scale).T)
    Z = f.Zv / f.scale[:, None]
    return f.scale[:, None] * (Z - C @ (Z.T @ R @ np.linalg.pinv(C.T @ R, rcond=1e-12)).T)
