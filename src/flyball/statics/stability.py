"""State at rest, and stability of an equilibrium.

`RestState` has the residual forces at a position, the stiffness, and the steps of Newton's method. All quantities are
energies: translations are divided by the mechanism's length. Controller states are further unknowns, with their rates
as residuals, if their sizes are given; else they keep their values. Stability follows from the constrained stiffness,
direction by direction, with each coordinate in units of the stiffness that acts on it (Sylvester's law of inertia).
At nonsmooth points an equilibrium is stable if the potential rises on all sides, and unstable if it falls along a
direction that leads into a side where it falls. Forces without potential are judged by the eigenvalues.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from ..assembly.compiled_mechanism import CompiledMechanism
from ..derivatives.eigenvalues import Spectrum, spectrum
from ..derivatives.equation_derivatives import (
    EquationDerivatives,
    MechanismState,
    StateSizes,
    force_magnitudes,
    is_balanced,
    stiffness_rounding,
    unbalanced_fraction,
)
from ..derivatives.linearized_equations import (
    DENSE_UNKNOWNS,
    FreeCoordinates,
    TurningFrame,
    free_coordinates,
    minimum_norm_solution,
    reduced_equations,
)
from ..derivatives.nonsmooth_points import NonsmoothPoint, nonsmooth_error, nonsmooth_points
from ..engine.kinematics import retract
from ..errors import AnalysisError
from ..numerics.rank import negative_pivots, null_space
from ..results.modes import largest_growth
from ..results.wording import MARGINAL, STABLE, UNSTABLE
from ..tables.structure_definition import velocity_names

CLOSED_GAP = 1e-12  # gap of rows of unit norm [rad, or relative to the mechanism's length] that counts as closed
VANISHING_STIFFNESS = 1e-14  # stiffness along a velocity below this part of the largest energy is rounding
BALANCED_PART = 1e-6  # forces are balanced by positions if no larger part of them is left
STATE_RANGE = 100.0  # natural size of a step of a controller state, in large changes: steps are limited in length


@dataclass
class RestState:
    """A state at rest with multipliers.

    Attributes
    ----------
    c : CompiledMechanism
        In absolute coordinates.
    t : float [s]
    q, lam : ndarray
    z : ndarray (nz,)
        Controller states that are unknowns beside the positions; empty if they keep their values in ``c``.
    sizes : StateSizes
        Their natural sizes.
    """

    c: CompiledMechanism
    t: float
    q: np.ndarray
    lam: np.ndarray
    z: np.ndarray = field(default_factory=lambda: np.zeros(0))
    sizes: StateSizes = field(default_factory=lambda: StateSizes(np.zeros(0), np.zeros(0), 1.0))
    known_stability: Any = field(default=None, repr=False)  # stability, stored when first computed

    @classmethod
    def at(cls, c: CompiledMechanism, t: float, q: np.ndarray) -> RestState:
        """State with the multipliers that balance the forces best."""
        return cls(c, t, q, np.zeros(len(c.structure.rows))).balanced()

    def balanced(self) -> RestState:
        """This state with the smallest multipliers that balance the forces best."""
        bare = replace(self, lam=0.0 * self.lam, known_stability=None)
        return replace(bare, lam=bare.balancing_multipliers())

    @cached_property
    def equations(self) -> EquationDerivatives:
        """Equations of motion and their derivatives at this state."""
        self.c.z[: len(self.z)] = self.z
        return EquationDerivatives(MechanismState.resting(self.c, self.t, self.q, self.lam))

    @cached_property
    def scale(self) -> np.ndarray:
        """Natural size of a step along every velocity (the mechanism's length, or 1 rad), and of every state."""
        return np.r_[self.c.sizes, STATE_RANGE * self.sizes.change]

    @cached_property
    def weight(self) -> np.ndarray:
        """Factors of the residuals that make them energies: `scale` for forces."""
        return np.r_[self.c.sizes, self.sizes.energy / np.where(self.sizes.rate > 0.0, self.sizes.rate, 1.0)]

    @cached_property
    def G(self):
        """Jacobian of all constraints, including those on velocities, with unit rows; sparse."""
        import scipy.sparse as sp

        G = self.equations.constraint_jacobian
        G = sp.diags(self.row_scale) @ G @ sp.diags(self.c.sizes)
        return sp.hstack([G, sp.csr_matrix((G.shape[0], len(self.z)))]).tocsr() if len(self.z) else G

    @cached_property
    def row_scale(self) -> np.ndarray:
        """Factors that scale the rows to unit norm."""
        G = self.equations.constraint_jacobian
        size = np.sqrt(np.asarray((G.multiply(G)) @ (self.c.sizes**2)).ravel())
        return 1.0 / np.where(size > 0.0, size, 1.0)

    @cached_property
    def K(self):
        """Scaled stiffness, and derivatives of and by the unknown controller states; sparse.

        The rows of states that keep their values have only a diagonal entry.
        """
        import scipy.sparse as sp

        e = self.equations
        K = e.by_position[e.at["r"]]
        if not len(self.z):
            return sp.diags(self.weight) @ K @ sp.diags(self.scale)
        K = sp.bmat([[K, e.by_state[e.at["r"]]], [-e.by_position[e.at["s"]], -e.state_jacobian]]).tocsr()
        K = (sp.diags(self.weight) @ K @ sp.diags(self.scale)).tocsr()
        kept = np.r_[np.zeros(len(self.c.sizes)), self._kept_states(K)]
        return (K + sp.diags(kept * np.abs(K.data).max(initial=1e-300))).tocsr()

    @cached_property
    def undetermined_states(self) -> np.ndarray:
        """Which unknown controller states have no rate near here, whatever the position, bool.

        Examples are the force of a friction element, the deflection of a standing tyre, and an integrator whose input
        is zero.
        """
        e = self.equations
        rows = abs(e.by_position[e.at["s"]]).sum(axis=1).A1 + np.abs(e.state_jacobian).sum(axis=1)
        return np.asarray(rows == 0.0)[: len(self.z)]

    def _kept_states(self, K) -> np.ndarray:
        """Which undetermined states keep their values, bool: positions can balance the forces of such a state.

        The friction of a rubber mount keeps its force, as the mount's spring carries what is missing. The deflection
        of a tyre is what holds a parked car on a slope, and no position can: it is an unknown.
        """
        import scipy.sparse as sp

        kept = self.undetermined_states.copy()
        if not kept.any():
            return kept
        nv = len(self.c.sizes)
        G = self.G[:, :nv]
        A = sp.bmat([[K[:nv, :nv], -G.T * np.abs(K.data).max(initial=1e-300)], [G, None]]).tocsr()
        for k in np.flatnonzero(kept):
            b = np.r_[K[:nv, nv + k].toarray().ravel(), np.zeros(len(self.g))]
            left = b - A @ minimum_norm_solution(A, b)
            kept[k] = np.abs(left).max(initial=0.0) <= BALANCED_PART * np.abs(b).max(initial=0.0)
        return kept

    @cached_property
    def r(self) -> np.ndarray:
        """Scaled residual forces with these multipliers, and negative rates of the unknown controller states."""
        e = self.equations
        return self.weight * np.r_[e.block("r"), -e.state_rates[: len(self.z)]]

    @cached_property
    def g(self) -> np.ndarray:
        """Violations of the constraints, scaled like G; zero for constraints on velocities."""
        which = np.array([r.holonomic for r in self.c.structure.rows], bool)
        return np.where(which, self.row_scale * self.equations.block("g"), 0.0)

    @cached_property
    def size(self) -> float:
        """Largest energy of the forces, or of the stiffness, for a unit step."""
        e = self.equations
        acts = np.r_[force_magnitudes(e), e.state_rates[: len(self.z)]]
        most = np.abs(self.weight * acts).max(initial=0.0)
        return float(max(most, np.abs(self.K.data).max(initial=0.0), 1e-300))

    @cached_property
    def turns(self) -> np.ndarray:
        """Which unknowns are rotations, bool."""
        units = [n.unit for n in velocity_names(self.c.structure)]
        return np.r_[[u == "rad" for u in units], np.zeros(len(self.z), bool)].astype(bool)

    def residual_size(self) -> float:
        """Largest residual force relative to the applied forces, plus the largest constraint gap."""
        return float(np.abs(self.r).max(initial=0.0) / self.size + np.abs(self.g).max(initial=0.0))

    def settled(self, part: float) -> bool:
        """Whether every residual is below ``part`` of the forces in its equation plus rounding, and states rest."""
        return is_balanced(self.equations, part, len(self.z) > 0)

    def unbalanced(self) -> float:
        """Largest residual with the best multipliers, relative to the forces of its equation."""
        return unbalanced_fraction(RestState(self.c, self.t, self.q, self.balancing_multipliers()).equations)

    def pushed(self) -> str:
        """Text that names the largest residual force along a free coordinate."""
        f = free_coordinates(self.equations)
        force = -f.Zv.T @ self.equations.block("r")
        if not len(force):
            return "no force"
        size = self.c.sizes[f.chosen_v]
        k = int(np.argmax(np.abs(force * size)))
        name = f.names[f.chosen_v[k]]
        return f"{force[k]:.3g} {'N' if name.unit == 'm' else 'N*m'} push along {name.name}"

    def open(self) -> float:
        """Largest gap, relative to the mechanism's length or in radians."""
        return float(np.abs(self.equations.block("g") / self.c.row_units).max(initial=0.0))

    def balancing_multipliers(self) -> np.ndarray:
        """Multipliers with the smallest residual forces."""
        if not len(self.g):
            return self.lam
        nv = len(self.c.sizes)
        return self.lam + self.row_scale * minimum_norm_solution(self.G[:, :nv].T, self.r[:nv])

    def step(self, damping: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
        """Scaled step of Newton's method and change of the multipliers, with ``damping`` times the identity added.

        Raises
        ------
        SingularityError
            If a law has no value or no derivative there.
        """
        try:
            return self._solve(self.r, self.g, damping)
        except AnalysisError:
            if found := nonsmooth_points(self.equations):
                raise nonsmooth_error(found, self.t, "its position of rest is not determined") from None
            raise

    def solved(self, r: np.ndarray, g: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Changes of positions (and states) and multipliers that compensate changes r and g of the equations."""
        step, lam = self._solve(self.weight * r, self.row_scale * g, 0.0)
        return self.scale * step, lam

    def _solve(self, r: np.ndarray, g: np.ndarray, damping: float) -> tuple[np.ndarray, np.ndarray]:
        """Solve the linear equations, scaled by each row's own stiffness so that soft directions stay accurate."""
        import scipy.sparse as sp

        n = len(self.scale)
        if n + len(g) <= DENSE_UNKNOWNS:
            return self._solve_dense(r, g, damping)
        K = (self.K + damping * self.size * sp.identity(n)).tocsr()
        stiff = np.asarray(abs(K).max(axis=1).todense()).ravel() if n else np.zeros(0)
        own = self._row_factors(stiff)
        D = sp.diags(own)
        if not len(g):
            return own * minimum_norm_solution(D @ K @ D, -own * r), np.zeros(0)
        G = self.G @ D
        rows = np.sqrt(np.asarray(G.multiply(G).sum(axis=1)).ravel())
        rows = 1.0 / np.where(rows > 0.0, rows, 1.0)
        G = sp.diags(rows) @ G
        x = minimum_norm_solution(sp.bmat([[D @ K @ D, -G.T], [G, None]]), np.r_[-own * r, -rows * g])
        return own * x[:n], rows * x[n:] * self.row_scale

    def _row_factors(self, stiff: np.ndarray) -> np.ndarray:
        """Factors 1 / sqrt(stiffness), so that all unknowns have one unit; `size` stands for vanishing stiffness."""
        return 1.0 / np.sqrt(np.where(stiff > VANISHING_STIFFNESS * self.size, stiff, self.size))

    def _solve_dense(self, r: np.ndarray, g: np.ndarray, damping: float) -> tuple[np.ndarray, np.ndarray]:
        """Like `_solve` with dense matrices, which are faster for a small mechanism."""
        n = len(self.scale)
        K = self.K.toarray() + damping * self.size * np.eye(n)
        stiff = np.abs(K).max(axis=1, initial=0.0)
        own = self._row_factors(stiff)
        K = own[:, None] * K * own
        if not len(g):
            return own * minimum_norm_solution(K, -own * r), np.zeros(0)
        G = self.G.toarray() * own
        rows = np.sqrt((G * G).sum(axis=1))
        rows = 1.0 / np.where(rows > 0.0, rows, 1.0)
        G = rows[:, None] * G
        x = minimum_norm_solution(np.block([[K, -G.T], [G, np.zeros((len(g), len(g)))]]), np.r_[-own * r, -rows * g])
        return own * x[:n], rows * x[n:] * self.row_scale

    def moved(self, step: np.ndarray, lam: np.ndarray) -> RestState:
        """State after a scaled step."""
        q, change = self.q.copy(), self.scale * step
        retract(self.c.values.system, q, change[: len(self.c.sizes)])
        return replace(self, q=q, lam=self.lam + lam, z=self.z + change[len(self.c.sizes) :], known_stability=None)

    def closed(self) -> RestState:
        """State projected onto the constraints, with the multipliers that balance best."""
        now = self
        for _ in range(8):
            if not len(now.g) or np.abs(now.g).max() < CLOSED_GAP:
                break
            now = now.moved(minimum_norm_solution(now.G, -now.g), 0.0 * now.lam)
        return now.balanced()


PROJECTION_ROUNDING = 4 * np.finfo(float).eps  # of products with the basis of free motions, relative to their terms
NEUTRAL_STIFFNESS = 1e-8  # stiffness below this part of its terms counts as zero


@dataclass
class ConstrainedStiffness:
    """Constrained stiffness at a position and its principal directions.

    ``matrix`` (f, f); ``along`` (nv, f) are the directions in scaled velocities; ``parts`` (f,) their stiffness
    relative to its terms; ``potential`` tells whether the matrix is symmetric; ``within`` implements `across`.
    """

    matrix: np.ndarray
    along: np.ndarray
    parts: np.ndarray
    potential: bool
    within: Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]] = field(repr=False)

    def across(self, normals: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """``along`` and ``parts`` for the motions orthogonal to some normals (m, nv), in scaled velocities."""
        return self.within(normals)


def constrained_stiffness(x: RestState, f: FreeCoordinates) -> ConstrainedStiffness:
    """Stiffness of the free motions at a position."""
    e = x.equations
    K = f.Zv.T @ e.by_position[e.at["r"]] @ f.Zv
    Z = f.Zv / x.scale[:, None]
    blur = np.max([np.abs(f.Zv.T @ d @ f.Zv) for d in stiffness_rounding(e)], axis=0)
    blur += PROJECTION_ROUNDING * (np.abs(f.Zv.T) @ (abs(e.by_position[e.at["r"]]) @ np.abs(f.Zv)))
    unit = np.abs(K).sum(axis=1) + blur.sum(axis=1)
    unit = 1.0 / np.sqrt(np.where(unit > 0.0, unit, 1.0))
    own, blur = (unit[:, None] * X * unit for X in (K, blur))
    acts_by = x.scale * force_magnitudes(e)

    def within(normals: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        B = null_space(normals @ Z * unit) if len(normals) else np.eye(len(own))
        w, V = np.linalg.eigh(0.5 * B.T @ (own + own.T) @ B)
        V = B @ V
        along = Z @ (unit[:, None] * V)
        size = np.abs(along)
        acts = np.einsum("ik,ik->k", size, abs(x.K) @ size) + acts_by @ size**2
        rounding = len(own) * PROJECTION_ROUNDING * np.abs(w).max(initial=0.0)  # of the eigenvalues
        real = np.abs(w) > (np.abs(V) * (blur @ np.abs(V))).sum(axis=0) + rounding
        parts = np.where(real, w / np.where(acts > 0.0, acts, 1.0), 0.0)
        return along / np.linalg.norm(along, axis=0), parts

    potential = bool((np.abs(own - own.T) <= NEUTRAL_STIFFNESS + 2.0 * blur).all())
    return ConstrainedStiffness(K, *within(np.zeros((0, len(Z)))), potential, within)


NEUTRAL_ON_SIDE = 1e-5  # the same limit for one side of a kink, where the offset adds error
MAX_NONSMOOTH = 6  # largest number of kinks whose sides are all examined
SIDE_OFFSET = 2e-6  # offset to one side of a kink [rad, or relative to the mechanism's length]
GROWTH_LIMIT = 1e-4  # growth rate below this part of the fastest counts as zero
INSIDE_TOLERANCE = 1e-6  # tolerance of the test whether a direction leads into a side


def one_sided_stability(
    x: RestState, f: FreeCoordinates, found: Sequence[NonsmoothPoint]
) -> tuple[str, ConstrainedStiffness]:
    """Stability from all sides of the kinks, and the stiffness of the side with the lowest one.

    Raises
    ------
    SingularityError
        If a force jumps, or stability does not follow from the sides.
    """
    if any(k.jump for k in found):
        raise nonsmooth_error(found, x.t, "its stability there is not determined")
    normals = _distinct_normals([k.along[0] * x.scale for k in found])
    if len(normals) > MAX_NONSMOOTH:
        raise nonsmooth_error(found, x.t, f"of more than {MAX_NONSMOOTH} at once its stability is not determined")
    kinds, least = [], None
    for signs in itertools.product((1.0, -1.0), repeat=len(normals)):
        own = np.array(signs)[:, None] * normals
        step = _interior_step(own @ (f.Zv / x.scale[:, None] * f.scale[f.chosen_v]))
        if step is None:
            continue
        way = f.Zv @ (f.scale[f.chosen_v] * step) / x.scale
        there = x.moved(SIDE_OFFSET * way / np.abs(own @ way).min(), 0.0 * x.lam)
        s = constrained_stiffness(there, f)
        kinds.append(_stability_on_side(s, own, there, f))
        if least is None or s.parts.min(initial=np.inf) < least.parts.min(initial=np.inf):
            least = s
    assert least is not None
    kind = next((k for k in (UNSTABLE, "", MARGINAL) if k in kinds), STABLE)
    if not kind:
        raise nonsmooth_error(found, x.t, "its stability there is not determined")
    return kind, least


def _stability_on_side(s: ConstrainedStiffness, normals: np.ndarray, x: RestState, f: FreeCoordinates) -> str:
    """Stability on one side of the kinks; empty if undetermined.

    The minimum of a quadratic form on a cone lies along a direction that is stationary within one of the faces of the
    cone (Kaplan 2000), so every face is examined. Without a potential only a growing motion that stays on the side is a
    proof of instability.
    """
    if not s.potential:
        return UNSTABLE if _has_growing_motion(x, f, normals) else ""
    said = STABLE
    for k in range(len(normals) + 1):
        for on in itertools.combinations(range(len(normals)), k):
            along, parts = s.across(normals[list(on)])
            inside = _lead_inside(along, np.delete(normals, on, axis=0))
            if (inside & (parts < -NEUTRAL_ON_SIDE)).any():
                return UNSTABLE
            if (inside & (parts <= NEUTRAL_ON_SIDE)).any():
                said = MARGINAL
    return said


def _lead_inside(along: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Which directions (nv, n), or their opposites, lead to the positive side of all normals, or along it."""
    inward = normals @ along / np.linalg.norm(normals, axis=1)[:, None]
    return (inward >= -INSIDE_TOLERANCE).all(axis=0) | (inward <= INSIDE_TOLERANCE).all(axis=0)


def _has_growing_motion(x: RestState, f: FreeCoordinates, normals: np.ndarray) -> bool:
    """Whether a growing straight motion stays on the side: d e^(s t) with real s > 0 and d on the side."""
    from scipy.linalg import eig

    e = x.equations
    r = e.at["r"]
    M, D, K = (f.Zv.T @ X[r] @ f.Zv for X in (e.by_acceleration, e.by_velocity, e.by_position))
    one, none = np.eye(len(M)), np.zeros_like(M)
    w, V = eig(np.block([[none, one], [-K, -D]]), np.block([[one, none], [none, M]]))
    grows = np.isfinite(w) & (w.real > GROWTH_LIMIT * np.abs(w[np.isfinite(w)]).max(initial=0.0)) & (w.imag == 0.0)
    d = f.Zv @ V[: len(M), grows].real / x.scale[:, None]
    return bool(_lead_inside(d / np.linalg.norm(d, axis=0), normals).any())


def _distinct_normals(normals: Sequence[np.ndarray]) -> np.ndarray:
    """Remove normals that are parallel to another one."""
    out: list[np.ndarray] = []
    for n in normals:
        n = n / np.linalg.norm(n)
        if not any(abs(abs(n @ m) - 1.0) < INSIDE_TOLERANCE for m in out):
            out.append(n)
    return np.array(out)


def _interior_step(A: np.ndarray) -> np.ndarray | None:
    """A step with A step > 0 and entries of at most one; None if there is none."""
    from scipy.optimize import linprog

    m, n = A.shape
    size = np.abs(A).max(axis=1, keepdims=True)
    found = linprog(
        np.r_[np.zeros(n), -1.0], np.hstack([-A / size, np.ones((m, 1))]), np.zeros(m), bounds=[(-1, 1)] * n + [(0, 1)]
    )
    return found.x[:n] if found.success and found.x[-1] > INSIDE_TOLERANCE else None


NEGATIVE_DAMPING = 1e-12  # negative damping below this part of what acts on its coordinate is rounding


@dataclass
class SoftestMotion:
    """Stiffness of the free motions, and the direction in which it is lowest.

    Attributes
    ----------
    free : FreeCoordinates
    stiffness : ndarray (f, f)
        Stiffness of the free motions; at a kink that of the side with the lowest one.
    direction : ndarray (nv,)
        Direction of lowest stiffness, in scaled velocities.
    least : float
        Lowest stiffness relative to the separate contributions of springs, weights and reactions.
    """

    free: FreeCoordinates
    stiffness: np.ndarray
    direction: np.ndarray
    least: float

    @classmethod
    def of(cls, f: FreeCoordinates, s: ConstrainedStiffness) -> SoftestMotion:
        """The direction of lowest stiffness among the principal ones."""
        k = int(np.argmin(s.parts))
        return cls(f, s.matrix, s.along[:, k], float(s.parts[k]))

    @classmethod
    def none(cls, f: FreeCoordinates) -> SoftestMotion:
        """No motion is free."""
        return cls(f, np.zeros((0, 0)), np.zeros(len(f.scale)), np.inf)


@dataclass
class Stability:
    """Stability of an equilibrium.

    Attributes
    ----------
    kind : str
        ``"stable"``, ``"marginal"`` or ``"unstable"``.
    kinks : tuple of str
        Descriptions of forces with a kink at this position.
    known : SoftestMotion or RestState
        The softest motion, or the state where it is computed on demand.
    """

    kind: str
    known: SoftestMotion | RestState
    kinks: tuple[str, ...] = ()

    @cached_property
    def softest(self) -> SoftestMotion:
        """The stiffness of the free motions with its softest direction: dense matrices."""
        if isinstance(self.known, SoftestMotion):
            return self.known
        f = free_coordinates(self.known.equations)
        return SoftestMotion.of(f, constrained_stiffness(self.known, f)) if f.Zv.shape[1] else SoftestMotion.none(f)


def stability(x: RestState) -> Stability:
    """Stability of an equilibrium; where forces have kinks, from all their sides.

    Raises
    ------
    SingularityError
        If a force jumps there, or stability does not follow from the sides of its kinks.
    """
    if x.known_stability is None:
        stable = _sign_of_stiffness(x) > 0 and not _may_have_negative_damping(x)
        x.known_stability = Stability(STABLE, x) if stable else _computed_stability(x)
    return x.known_stability


def is_unstable(x: RestState) -> bool:
    """Whether an equilibrium is unstable; that of a large mechanism may be decided without its `stability`."""
    return (x.known_stability is None and _sign_of_stiffness(x) < 0) or stability(x).kind == UNSTABLE


CONSTRAINT_PENALTY = 1e6  # factor of G^T G beside the largest stiffness


def _sign_of_stiffness(x: RestState) -> int:
    """Sign of the stiffness of a large mechanism: 1 positive definite, -1 not semidefinite, 0 not decided.

    With c > 0, K + c G^T G is positive definite only if K is so along the motions that the rows G allow; for a large c
    the converse holds (Finsler 1937). Pivots of the sparse matrix have the signs of its eigenvalues.
    """
    import scipy.sparse as sp

    K, n = x.K, len(x.scale)
    if n <= DENSE_UNKNOWNS or len(x.z) or abs(K - K.T).max() > NEUTRAL_STIFFNESS * x.size:
        return 0
    if nonsmooth_points(x.equations):
        return 0
    A = 0.5 * (K + K.T) + CONSTRAINT_PENALTY * x.size * x.G.T @ x.G
    margin = NEUTRAL_STIFFNESS * x.size * sp.identity(n)
    return 1 if not negative_pivots(A - margin) else -1 if negative_pivots(A + margin) else 0


def _may_have_negative_damping(x: RestState) -> bool:
    """Whether velocity-dependent forces may add energy to a motion: their scaled matrix has a negative pivot."""
    import scipy.sparse as sp

    e = x.equations
    D = e.by_velocity[e.at["r"]]
    own = sp.diags(_damping_scale(np.asarray(abs(D).sum(axis=1)).ravel()))
    D = own @ (D + D.T) @ own
    return bool(D.nnz) and negative_pivots(D + NEGATIVE_DAMPING * sp.identity(D.shape[0])) > 0


def _damping_scale(size: np.ndarray) -> np.ndarray:
    """Factors 1 / sqrt(damping) for each row, so that a strong damper hides no weak one."""
    return 1.0 / np.sqrt(np.where(size > 0.0, size, 1.0))


def _computed_stability(x: RestState) -> Stability:
    e = x.equations
    f = free_coordinates(e)
    if not f.Zv.shape[1]:
        return Stability(STABLE, SoftestMotion.none(f))
    still = 0.0 * f.Zv
    states = [k.name for k in x.c.structure.model.controllers]  # keep their values
    points = [k for k in nonsmooth_points(e) if k.element not in states]
    found = [k for k in points if k.is_crossed_by(f.Zv * f.scale[f.chosen_v], still)]
    if found:
        kind, s = one_sided_stability(x, f, found)
        return Stability(kind, SoftestMotion.of(f, s), tuple(dict.fromkeys(k.text for k in found)))
    s = constrained_stiffness(x, f)
    softest = SoftestMotion.of(f, s)
    least = softest.least
    kind = UNSTABLE if least < -NEUTRAL_STIFFNESS else MARGINAL if least <= NEUTRAL_STIFFNESS else STABLE
    if not s.potential:  # flutter follows from the eigenvalues only
        if moved := [k for k in points if k.is_crossed_by(still, f.Zv)]:
            raise nonsmooth_error(moved, x.t, "there are no linear equations")
        kind = _stability_by_motion(e, f)
    elif kind == STABLE and _has_negative_damping(e, f) and _stability_by_motion(e, f) == UNSTABLE:
        kind = UNSTABLE
    return Stability(kind, softest)


def _has_negative_damping(e: EquationDerivatives, f: FreeCoordinates) -> bool:
    """Whether velocity-dependent forces add energy to some motion (negative damping)."""
    D = e.by_velocity[e.at["r"]]
    size = np.abs(f.Zv.T) @ (abs(D) @ np.abs(f.Zv)).sum(axis=1)
    own = _damping_scale(size)
    D = own[:, None] * (f.Zv.T @ D @ f.Zv) * own
    d = np.linalg.eigvalsh(0.5 * (D + D.T))
    return bool(len(d) and d[0] < -NEGATIVE_DAMPING)


def stability_by_eigenvalues(eigenvalues: Spectrum, *, discrete: bool = False) -> str:
    """Stability from eigenvalues, each judged with its own uncertainty.

    Parameters
    ----------
    eigenvalues : Spectrum
    discrete : bool
        Whether they are multipliers of a discrete system, which must not exceed 1 in magnitude.
    """
    most = largest_growth(eigenvalues.values, eigenvalues.uncertainty, discrete=discrete)
    return UNSTABLE if most > 0.0 else MARGINAL if most == 0.0 else STABLE


def _stability_by_motion(e: EquationDerivatives, f: FreeCoordinates) -> str:
    """Stability from the eigenvalues, with damping."""
    none = np.zeros((len(f.scale),) * 2)
    r = reduced_equations(e, f, TurningFrame(np.zeros(3), none, none))
    return stability_by_eigenvalues(spectrum(r.A, r.uncertainty))
