"""Linear equations with explicit constraints (descriptor form), sparse for large mechanisms.

    M x'' + D x' + K x = G^T l,   G x = 0

G contains independent rows only, so that the solution is unique. The equations of large mechanisms at rest stay sparse,
in absolute coordinates. They are refused in the same cases as by `linearize`, which are detected by sparse methods.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from ..assembly.positions_and_velocities import closed_position_near
from ..derivatives.equation_derivatives import (
    EquationDerivatives,
    MechanismState,
    has_reaction_friction,
    prescription_derivatives,
)
from ..derivatives.linearized_equations import NEARBY_STEP as AWAY
from ..derivatives.linearized_equations import (
    PARTICIPATION,
    FreeCoordinates,
    InputTerms,
    TurningFrame,
    massless_motion_error,
    massless_rotations,
    minimum_norm_solution,
    prescribed_rows,
    singular_position_error,
)
from ..derivatives.nonsmooth_points import nonsmooth_error, nonsmooth_points
from ..derivatives.output_derivatives import curve_derivatives, curve_gradients, refuse_undetermined_outputs_sparse
from ..derivatives.steady_motion import (
    COEFFICIENT_TOLERANCE,
    COMPARISON_ANGLE,
    has_time_laws,
    refuse_unbalanced,
    time_dependence_error,
)
from ..engine.kinematics import retract
from ..errors import AnalysisError, SingularityError
from ..mobility.null_spaces import scaled_jacobian
from ..model.element_laws import Input
from ..numerics.eigen import QuadraticPencil
from ..numerics.rank import weak_pivots
from ..results.linear_model import Descriptor
from ..tables.structure_definition import velocity_names
from ..tables.values import Values


def values_with_input_step(e: EquationDerivatives, i: Input) -> Values:
    """Values of the mechanism with a complex step of an input."""
    return e.stepped_law(i.parameter) if i.parameter != i.name else e.stepped(i.name)


def input_effects(e: EquationDerivatives, inputs: Sequence[Input]) -> InputTerms:
    """Derivatives by the inputs; those of constraints, also of forms without positions, have all rows."""
    every = [values_with_input_step(e, i) for i in inputs]
    W = np.array([e.by_values(values) for values in every]).reshape(len(inputs), e.width).T
    prescribed = len(e.state.c.structure.prescribed)
    given = np.array([prescription_derivatives(e.state, values) for values in every])
    given = given.reshape(len(inputs), 3, prescribed).T
    g, n, a = (np.vstack([W[e.at[name]], given[:, k]]) for k, name in enumerate("gna"))
    return InputTerms(W[e.at["r"]], g, n, W[e.at["s"]], a)


# Up to so many velocities and freedoms the constraints are eliminated and the matrices are dense.

DENSE_VELOCITIES = 600
DENSE_FREEDOMS = 150  # velocities minus constraint rows
# Dependencies of unit rows that change by more than this at a nearby position do not exist there.
LOST_DEPENDENCY = 1e-6
# A response this large, with every inertia scaled to one, shows a motion without inertia.
MASSLESS_MOTION = 1e12


def exceeds_dense_size(free: int, velocities: int, rows: int) -> bool:
    """Whether a mechanism is too large for dense equations: too many velocities, or more than ``free`` freedoms."""
    return velocities > DENSE_VELOCITIES or velocities - rows > free


def uses_sparse_equations(x: MechanismState, free: int) -> bool:
    """Whether the linear equations are sparse: large mechanism at rest, with constraints on positions only."""
    s = x.c.structure
    many = exceeds_dense_size(
        DENSE_VELOCITIES if s.loads else free, s.nv, len(s.rows)
    )  # joint friction is implemented in the dense equations only
    many = many and not s.controls  # these, too
    return many and not s.tree and not np.any(x.v) and all(r.holonomic for r in s.rows)


@dataclass
class SparseEquations:
    """Sparse linear equations.

    Attributes
    ----------
    e : EquationDerivatives
    scale : ndarray (nv,)
        Divisor of velocities: 1 for metres, 1 / length of the mechanism for radians.
    rows : ndarray (m,)
        Constraint index of each row of G. Larger indices are the rows that fix rotations of point masses.
    G : sparse (m, nv)
    """

    e: EquationDerivatives
    scale: np.ndarray
    rows: np.ndarray
    G: Any

    @cached_property
    def matrices(self) -> tuple[Any, Any, Any]:
        """M, D and K, sparse (nv, nv)."""
        r = self.e.at["r"]
        return tuple(X[r] for X in (self.e.by_acceleration, self.e.by_velocity, self.e.by_position))  # type: ignore

    @cached_property
    def pencil(self) -> QuadraticPencil:
        """The same matrices in scaled units."""
        import scipy.sparse as sp

        S = sp.diags(self.scale)
        M, D, K = ((S @ X @ S).tocsr() for X in self.matrices)
        return QuadraticPencil(M, D, K, unit_rows(self.G @ S)[0])

    @classmethod
    def at(cls, x: MechanismState, frozen: bool, to: Sequence[str] = ()) -> SparseEquations:
        """Equations at a state for which `uses_sparse_equations`; ``to`` are the inputs that are parameters.

        Raises
        ------
        AnalysisError, SingularityError, ModelError
            As `linearize`.
        """
        import scipy.sparse as sp

        e = EquationDerivatives(x)
        if x.c.structure.loads and has_reaction_friction(x):
            raise AnalysisError(
                f"{x.c.structure.model.name!r} has {len(x.v)} velocities, and friction that follows its joints' "
                f"reactions; linear equations of so large a mechanism are made without such friction only"
            )
        x.c.at(x.t, x.q, x.v)
        G, _, scale = scaled_jacobian(x.c)
        weak, vectors = weak_pivots(G @ G.T)
        if len(weak):
            _refuse_lost_rank(x, G, weak, vectors, scale)
        rows = np.setdiff1d(np.arange(G.shape[0]), weak)
        still = massless_rotations(e)
        one = sp.csr_matrix((np.ones(len(still)), (np.arange(len(still)), still)), shape=(len(still), len(x.v)))
        whole = sp.vstack([e.by_velocity[e.at["n"]][rows], one]).tocsr()
        found = cls(e, scale, np.r_[rows, G.shape[0] + np.arange(len(still))], whole)
        found._refuse_kinks(to)
        if not frozen:
            refuse_unbalanced(x, e)
        found._refuse_massless()
        if not frozen and has_time_laws(x.c.values.system):
            found._refuse_changing()
        return found

    def admissible_change(self, way: np.ndarray) -> np.ndarray:
        """Project a change of positions onto the motions that the constraints allow."""
        G = self.pencil.G
        along = way / self.scale
        return self.scale * (along - minimum_norm_solution(G, G @ along)) if G.shape[0] else way

    def _refuse_kinks(self, to: Sequence[str]) -> None:
        """Refuse kinks of forces that a free motion crosses."""
        found = []
        for k in nonsmooth_points(self.e, to):
            ways = [self.scale**2 * part for part in k.along[:2]]  # steepest direction, in scaled units
            dq, dv = (self.admissible_change(way) for way in ways)
            if k.is_crossed_by(np.stack([dq, 0.0 * dq], 1), np.stack([0.0 * dv, dv], 1)):
                found.append(k)
        if found:
            raise nonsmooth_error(found, self.e.state.t, "there are no linear equations")

    def _refuse_massless(self) -> None:
        """Refuse free motions without inertia."""
        import scipy.sparse as sp

        p = self.pencil
        if not p.freedoms:
            return
        own = p.M.diagonal()
        unit = sp.diags(1.0 / np.sqrt(np.where(own > 0.0, own, own.max())))
        M, G = (unit @ p.M @ unit).tocsr(), unit_rows(p.G @ unit)[0]
        force = np.random.default_rng(0).standard_normal(len(own))
        try:
            moved = QuadraticPencil(M, M, M, G).solver(0.0)(force, np.zeros(G.shape[0]))
        except AnalysisError:
            moved = np.where(own > 0.0, 0.0, np.inf)
        if not np.abs(moved).max() <= MASSLESS_MOTION:
            d = int(np.argmax(np.abs(moved)))
            raise massless_motion_error(velocity_names(self.e.state.c.structure)[d].name)

    def _refuse_changing(self) -> None:
        """Refuse equations that change with time although the mechanism rests."""
        x, r = self.e.state, self.e.at["r"]
        z = x.c.z.copy()
        then = EquationDerivatives(MechanismState.moving(x.c, x.t + COMPARISON_ANGLE / self.pencil.fastest, x.q, x.v))
        for now, later in ((self.e.by_velocity, then.by_velocity), (self.e.by_position, then.by_position)):
            if abs(later[r] - now[r]).max() > COEFFICIENT_TOLERANCE * abs(now[r]).max():
                raise time_dependence_error()
        x.c.at(x.t, x.q, x.v)
        x.c.z = z


def unit_rows(G: Any) -> tuple[Any, np.ndarray]:
    """Rows scaled to unit norm, and the norms."""
    import scipy.sparse as sp

    size = np.sqrt(np.asarray(G.multiply(G).sum(axis=1)).ravel())
    size = np.where(size > 0.0, size, 1.0)
    return (sp.diags(1.0 / size) @ G).tocsr(), size


def _refuse_lost_rank(x: MechanismState, G: Any, weak: np.ndarray, vectors: np.ndarray, scale: np.ndarray) -> None:
    """Refuse a position where rows are dependent that are independent nearby."""
    c = x.c
    z, random = c.z.copy(), np.random.default_rng(0).standard_normal(len(x.v))
    for _ in range(2):
        way = random - minimum_norm_solution(G, G @ random)
        q = x.q.copy()
        retract(c.values.system, q, AWAY * scale * way * c.values.length / np.abs(way).max())
        near = closed_position_near(c, x.t, q)
        if near is not None:
            c.at(x.t, near, 0.0 * x.v)
            H = scaled_jacobian(c)[0]
            if len(weak_pivots(H @ H.T)[0]) < len(weak):
                raise _lost_rank_error(x, H.T @ vectors, vectors)
        random = np.random.default_rng(1).standard_normal(len(x.v))
    c.at(x.t, x.q, x.v)
    c.z = z


def _lost_rank_error(x: MechanismState, remaining: np.ndarray, vectors: np.ndarray) -> SingularityError:
    """The error that names the elements of dependencies that do not exist nearby."""
    _, d, Vt = np.linalg.svd(remaining, full_matrices=False)
    lost = np.abs(vectors @ Vt[d > LOST_DEPENDENCY].T).max(axis=1, initial=0.0)
    rows = x.c.structure.rows
    names = tuple(dict.fromkeys(r.element.name for r, part in zip(rows, lost, strict=True) if part > PARTICIPATION))
    return singular_position_error(x.t, names)


def sparse_descriptor(whole: SparseEquations, inputs: Sequence[Input], outputs: Sequence[str]) -> Descriptor:
    """Descriptor form of a large mechanism at rest; errors as in `refuse_undetermined_outputs_sparse`."""
    import scipy.sparse as sp

    nv = len(whole.scale)
    none = sp.csr_matrix((nv, nv))
    C = curve_gradients(whole.e.state, outputs)
    refuse_undetermined_outputs_sparse(whole.e.state, outputs, C)
    return _assembled_descriptor(whole.e, whole.rows, (none, none), inputs, outputs, C)


def dense_descriptor(
    e: EquationDerivatives, f: FreeCoordinates, frame: TurningFrame, inputs: Sequence[Input], outputs: Sequence[str]
) -> Descriptor:
    """Descriptor form of any mechanism, in the coordinates of its equations.

    Raises
    ------
    AnalysisError
        If the motion is not steady and there are constraints, whose coefficients change with time.
    """
    import scipy.sparse as sp

    G = unit_rows(_all_rows(e) @ sp.diags(f.scale))[0]
    if not frame.steady and G.shape[0]:
        raise AnalysisError(
            "a descriptor has constant coefficients, and along a motion that is not steady those of the constraints "
            "change with time; A, B, C and D include that change"
        )
    return _assembled_descriptor(
        e,
        np.setdiff1d(np.arange(G.shape[0]), weak_pivots(G @ G.T)[0]) if G.shape[0] else np.zeros(0, int),
        (sp.csr_matrix(frame.N - frame.H), sp.csr_matrix(frame.H)),
        inputs,
        outputs,
        curve_gradients(e.state, outputs),
    )


def _all_rows(e: EquationDerivatives) -> Any:
    """Rows of constraints, of prescribed coordinates, and of rotations of point masses; sparse."""
    import scipy.sparse as sp

    nv, still = e.state.c.structure.nv, massless_rotations(e)
    one = sp.csr_matrix((np.ones(len(still)), (np.arange(len(still)), still)), shape=(len(still), nv))
    return sp.vstack([e.by_velocity[e.at["n"]], sp.csr_matrix(prescribed_rows(e.state.c)), one]).tocsr()


def _assembled_descriptor(
    e: EquationDerivatives,
    rows: np.ndarray,
    turning: tuple[Any, Any],
    inputs: Sequence[Input],
    outputs: Sequence[str],
    C: Any,
) -> Descriptor:
    """Descriptor form with the independent ``rows`` of all rows."""
    import scipy.sparse as sp

    c, s, at = e.state.c, e.state.c.structure, e.at
    names = velocity_names(s)
    G = _all_rows(e)
    others = G.shape[0] - len(s.rows)
    holonomic = np.r_[[r.holonomic for r in s.rows], np.ones(others, bool)].astype(bool)
    w = input_effects(e, inputs)
    gaps = np.where(holonomic[: len(w.g), None], w.g, w.n)
    gaps = np.vstack([gaps, np.zeros((G.shape[0] - len(gaps), len(inputs)))])
    V = sp.vstack([e.by_position[at["n"]], sp.csr_matrix((others, s.nv))]).tocsr()
    C = C.tocsc()
    nv, held = s.nv, len(s.rows) + len(s.prescribed)
    # Rows that fix rotations of point masses have no multiplier that anything depends on.
    kept = rows[rows < held]
    by_rows = sp.hstack([C[:, 3 * nv + kept], sp.csr_matrix((len(outputs), len(rows) - len(kept)))])
    D = np.array([_direct_feedthrough(e, outputs, i) for i in inputs]).reshape(len(inputs), len(outputs)).T
    of = [x.element.name for x in s.rows] + list(s.prescribed) + [names[d].name for d in massless_rotations(e)]
    M, W, K = (X[at["r"]] for X in (e.by_acceleration, e.by_velocity, e.by_position))
    kinematic, turned = turning
    out = Descriptor(
        mass=M,
        damping=W,
        stiffness=K,
        constraints=G[rows].tocsr(),
        on_positions=holonomic[rows],
        by_position=V[rows].tocsr(),
        kinematic=kinematic.tocsr(),
        turning=turned.tocsr(),
        forces=w.r,
        gaps=gaps[rows],
        C=sp.hstack([*(C[:, k * nv : (k + 1) * nv] for k in range(3)), by_rows]).tocsr(),
        D=D,
        coordinates=tuple(x.name for x in names),
        units=tuple(x.unit for x in names),
        rows=tuple(of[k] for k in rows),
        scale=c.sizes / c.values.length,
    )
    return _with_controllers(out, e, C[:, C.shape[1] - e.nz :], w.s) if e.nz else out


def _with_controllers(d: Descriptor, e: EquationDerivatives, by_state: Any, by_input: np.ndarray) -> Descriptor:
    """Add the controller states as velocities of further coordinates, their integrals; sampled ones are constant.

    ``by_state`` and ``by_input`` are the derivatives of the outputs by the states, and of the laws by the inputs.
    """
    import scipy.sparse as sp

    r, s, nv, n = e.at["r"], e.at["s"], e.state.c.structure.nv, e.nz
    changes = sp.diags(-1.0 * ~e.sampled)
    x, v, z = (changes @ sp.csr_matrix(X[s]) for X in (e.by_position, e.by_velocity, e.by_state))
    none, of_rows, of_outputs = (sp.csr_matrix((k, n)) for k in (n, len(d.rows), d.C.shape[0]))
    C = [d.C[:, :nv], of_outputs, d.C[:, nv : 2 * nv], by_state, d.C[:, 2 * nv : 3 * nv], of_outputs, d.C[:, 3 * nv :]]
    states = [k.name for k in e.state.c.structure.controls]
    return replace(
        d,
        mass=sp.block_diag([d.mass, sp.identity(n)]).tocsr(),
        damping=sp.bmat([[d.damping, sp.csr_matrix(e.by_state[r])], [v, z]]).tocsr(),
        stiffness=sp.bmat([[d.stiffness, None], [x, none]]).tocsr(),
        constraints=sp.hstack([d.constraints, of_rows]).tocsr(),
        by_position=sp.hstack([d.by_position, of_rows]).tocsr(),
        kinematic=sp.block_diag([d.kinematic, none]).tocsr(),
        turning=sp.block_diag([d.turning, none]).tocsr(),
        forces=np.vstack([d.forces, changes @ by_input]),
        C=sp.hstack(C).tocsr(),
        coordinates=(*d.coordinates, *(f"integral of {name}" for name in states)),
        units=(*d.units, *("" for _ in states)),
        scale=np.r_[d.scale, np.ones(n)],
    )


def _direct_feedthrough(e: EquationDerivatives, outputs: Sequence[str], i: Input) -> np.ndarray:
    """Derivatives of the outputs by an input at fixed state."""
    x = e.state
    n = len(x.v)
    still = [np.zeros((1, k)) for k in (n, n, n, len(x.lam) + len(x.c.structure.prescribed))]
    return curve_derivatives(x, outputs, still, values_with_input_step(e, i))[0]
