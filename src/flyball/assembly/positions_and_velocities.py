"""Closed positions from rough guesses, and consistent velocities at a closed position.

Positions are found by damped Gauss-Newton with steps of least weighted size. Velocities are determined in this order.
The constraints are satisfied, with the rates that drivers and initial conditions prescribe. Described velocities are
kept exactly where the constraints allow it, else as nearly as possible, measured by the kinetic energy of the
difference. The remaining velocities minimise the kinetic energy of the whole mechanism (Thomson's theorem).

For a body the velocity of its reference frame's origin, its angular velocity, both or neither may be given, in world
axes. What is not given is free.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from ..math.vec import cross
from ..model.geometry import quaternion_to_matrix, rotation_about
from ..model.model import Model
from ..numerics.rank import svd
from ..results.health import LARGE_VELOCITY, InitialDeviation
from ..tables.table_definitions import POINT
from ..tables.values import Values
from .compiled_mechanism import CompiledMechanism, compile_mechanism

VELOCITY_TOLERANCE = (
    1e-6  # relative deviation of a velocity, near singular positions, that still counts as the given one
)
NEGLIGIBLE_VELOCITY = 1e-9  # negligible velocity, relative to the mechanism's largest


@dataclass(frozen=True)
class GivenVelocity:
    """The given velocities of a body."""

    name: str
    at: int  # index of its first velocity
    translations: int  # number of translational velocities
    turns: int  # number of angular velocities
    origin: bool  # whether the velocity of its reference frame's origin is given
    turning: bool  # whether its angular velocity is given
    from_reference: bool

    @property
    def whole(self) -> bool:
        """Whether all its velocities are given."""
        return self.origin and (self.turning or not self.turns)

    @property
    def n(self) -> int:
        """Number of its velocities."""
        return self.translations + self.turns

    @property
    def planar(self) -> bool:
        """Whether it moves in the plane."""
        return self.translations == 2


def given_velocities(x: Values) -> list[GivenVelocity]:
    """Return the bodies with given velocities; for a mechanism in absolute coordinates."""
    return [g for g in _all_bodies(x) if g.origin or g.turning]


def _all_bodies(x: Values) -> list[GivenVelocity]:
    """Return all bodies, with what is given of each."""
    out = []
    shifts = 2 if x.structure.model.planar else 3
    for b in x.structure.model.bodies:
        origin, turning = b.velocity is not None, b.angular_velocity is not None
        if (at := x.structure.place[b.name]) < 0:
            continue
        v0, nv = int(x.system.tree.v[at]), int(x.system.tree.nv[at])
        out.append(GivenVelocity(b.name, v0, shifts, nv - shifts, origin, turning, b.as_drawn))
    return out


def described_velocities(x: Values, q: np.ndarray) -> np.ndarray:
    """Return the velocities (nv,) of bodies alone at the pose q with least kinetic energy that are as described.

    Steps of least kinetic energy from these to the constraints lead to the least energy of all.
    """
    v = np.zeros(x.structure.nv, np.result_type(x.v, q))
    for g in given_velocities(x):
        v[g.at : g.at + g.n] = _described_velocity(x, g, q)
    return v


def _described_velocity(x: Values, g: GivenVelocity, q: np.ndarray) -> list[Any]:
    """Return the velocities of one body as described; if only its angular velocity is given, its mass centre rests."""
    d, R = x.bodies[g.name], body_rotation(x, g.name, q)
    if not g.turns:
        return list(_origin_velocity(d)[: g.translations])
    w = d.w if g.turning else R @ _angular_velocity_of_impulse(x, g, R.T @ _origin_velocity(d))
    u = _origin_velocity(d) + _cross_product(w, R @ d.com) if g.origin else np.zeros(3)
    return [u[0], u[1], w[2]] if g.planar else [*u, *(R.T @ w)]


def _angular_velocity_of_impulse(x: Values, g: GivenVelocity, u: np.ndarray) -> np.ndarray:
    """Return the angular velocity caused by an impulse at a body's origin that gives it the velocity u, in body axes.

    It is the w of least m |u + w x c|^2 + w J w. Missing inertias are substituted.
    """
    d, table, b = x.bodies[g.name], x.system.bodies, x.structure.place[g.name]
    J = (table.inertia[b] + table.excess_inertia[b]).reshape(3, 3)
    about = J + d.mass * ((d.com @ d.com) * np.eye(3) - np.outer(d.com, d.com))
    moment = d.mass * _cross_product(u, d.com)
    return np.array([0.0, 0.0, moment[2] / about[2, 2]]) if g.planar else np.linalg.solve(about, moment)


def _cross_product(a: Any, b: Any) -> np.ndarray:
    """Return the cross product; NumPy's own takes ten times as long."""
    return np.array(cross(a, b))


def _origin_velocity(d: Any) -> np.ndarray:
    """Return the velocity of the reference frame's origin, as described."""
    return d.v - _cross_product(d.w, d.R @ d.com)


def body_rotation(x: Values, name: str, q: np.ndarray) -> np.ndarray:
    """Return the rotation of a body at q; the reference rotation to the last bit where it was not rotated."""
    b = x.structure.place[name]
    if x.system.tree.joint[b] == POINT:
        return x.bodies[name].R
    at = int(x.system.tree.q[b])
    here = q[at + 2 : at + 3] if x.structure.model.planar else q[at + 3 : at + 7]
    drawn = x.q[at + 2 : at + 3] if x.structure.model.planar else x.q[at + 3 : at + 7]
    if np.array_equal(here, drawn):
        return x.bodies[name].R
    return rotation_about(2, here[0]) if x.structure.model.planar else quaternion_to_matrix(here)


def velocity_deviation(x: Values, g: GivenVelocity, q: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Return the deviation of a body's velocities from the given ones: of mass centre and rotation where both are
    given.

    Otherwise it is that of its reference frame's origin in world axes, or of its angular velocity (of a spatial body in
    body axes).
    """
    d, R = x.bodies[g.name], body_rotation(x, g.name, q)
    own = v[g.at : g.at + g.n]
    if g.whole:
        return own - np.array(_described_velocity(x, g, q))
    if g.origin:
        w = np.array([0.0, 0.0, own[2]]) if g.planar else R @ own[3:]
        moved = np.r_[own[:2], 0.0] if g.planar else own[:3]
        return (moved - _cross_product(w, R @ d.com) - _origin_velocity(d))[: g.translations]
    return own[2:] - d.w[2:] if g.planar else own[3:] - R.T @ d.w


def deviation_jacobian(x: Values, g: GivenVelocity, q: np.ndarray) -> np.ndarray:
    """Return the derivatives of `velocity_deviation` by the body's own velocities."""
    if g.whole:
        return np.eye(g.n)
    if g.turning:
        return np.eye(g.n)[g.translations :]
    d, R = x.bodies[g.name], body_rotation(x, g.name, q)
    a = R @ d.com
    if g.planar:
        return np.array([[1.0, 0.0, a[1]], [0.0, 1.0, -a[0]]])
    return np.hstack([np.eye(3), np.array([_cross_product(a, k) for k in R.T]).T])


def _frame_velocity(x: Values, g: GivenVelocity, q: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the velocity of the origin of a body's reference frame, and its angular velocity, in world axes; three
    each.
    """
    d, R = x.bodies[g.name], body_rotation(x, g.name, q)
    own = v[g.at : g.at + g.n]
    w = np.zeros(3) if not g.turns else np.array([0.0, 0.0, own[2]]) if g.planar else R @ own[3:]
    return (np.r_[own[:2], 0.0] if g.planar else own[:3]) - _cross_product(w, R @ d.com), w


def velocity_departures(c: CompiledMechanism, q: np.ndarray, v: np.ndarray) -> list[InitialDeviation]:
    """Return the given velocities that the state (q, v) does not have."""
    x, out = c.values, []
    told, largest = given_velocities(x), float(np.abs(v / c.sizes).max(initial=0.0)) * x.length
    for g in told:
        d = x.bodies[g.name]
        u, w = _frame_velocity(x, g, q, v)
        pairs = (
            [("velocity", _origin_velocity(d)[: g.translations], u[: g.translations], "m/s", 1.0)] if g.origin else []
        )
        turns = slice(2, 3) if g.planar else slice(0, 3)
        pairs += [("angular_velocity", d.w[turns], w[turns], "rad/s", x.length)] if g.turning else []
        for what, wanted, got, unit, size in pairs:
            apart = np.abs(got - wanted).max()
            own_size = max(np.abs(wanted).max(), np.abs(got).max())
            if apart > VELOCITY_TOLERANCE * own_size and apart * size > NEGLIGIBLE_VELOCITY * max(
                largest, size * np.abs(wanted).max()
            ):
                out.append(InitialDeviation(g.name, what, tuple(wanted.tolist()), tuple(got.tolist()), unit))
    return out


def fast_velocities(c: CompiledMechanism, q: np.ndarray, v: np.ndarray, rates: np.ndarray) -> list[InitialDeviation]:
    """Return velocities that are not given and far exceed all given ones, as happens near a dead centre.

    ``rates``: those that drivers and initial conditions prescribe, in 1/s. Angular velocities are compared through the
    mechanism's length.
    """
    x = c.values
    told = given_velocities(x)
    if not told:
        return []
    drawn = [x.bodies[g.name] for g in told]
    speeds = [float(np.linalg.norm(y)) for d in drawn for y in (_origin_velocity(d) / x.length, d.w)]
    limit = LARGE_VELOCITY * max(*speeds, float(np.abs(rates).max(initial=0.0)))
    out = []
    for g in _all_bodies(x):
        u, w = _frame_velocity(x, g, q, v)
        turns = slice(2, 3) if g.planar else slice(0, 3)
        if not g.turning and np.linalg.norm(w) > limit:
            out.append(InitialDeviation(g.name, "angular_velocity", (), tuple(w[turns].tolist()), "rad/s"))
        elif not g.origin and np.linalg.norm(u) > limit * x.length:
            out.append(InitialDeviation(g.name, "velocity", (), tuple(u[: g.translations].tolist()), "m/s"))
    return out


CLOSED_TOLERANCE = 1e-10  # allowed residual of closed rows, relative to the mechanism's length, or [rad]
FAR_CLOSED_TOLERANCE = 1e-6  # the same for the residuals that converge from far away
MAX_RESTARTS = 12
MAX_ITERATIONS = 200
LONGEST_STEP = 0.7  # largest rotation [rad], or displacement relative to the mechanism's length, of a body in a step
STEPS_BEFORE_WIDENING = 50  # steps of the usual length before longer ones
DENSE_ROWS = 300  # largest number of rows for which a step uses a singular value decomposition
PIVOT_REGULARIZATION = 1e-14  # added for redundant rows of large mechanisms; iterations remove its effect
COORDINATE_ROUNDING = 16 * np.finfo(float).eps  # relative rounding of a coordinate after a few operations
SINGULAR_VALUE_CUTOFF = 1e-10  # relative singular value below which one counts as zero


def largest_residual(
    c: CompiledMechanism, t: float, q: np.ndarray, v: np.ndarray, uncertainty: float | None = None
) -> float:
    """Return the largest residual at a position: radians, or relative to the mechanism's length and the rounding there.

    ``uncertainty``: the rounding [m]; computed if not given.
    """
    c.at(t, q, v)
    g = np.abs(c.work.rows.value)
    if not np.isfinite(g).all():
        return np.inf
    rounding = position_rounding(c) if uncertainty is None else uncertainty
    far = rounding / (CLOSED_TOLERANCE * c.values.length)
    return float((g * row_scales(c) / np.where(c.metric, 1.0 + far, 1.0)).max(initial=0.0))


def position_rounding(c: CompiledMechanism) -> float:
    """Return the rounding of closed rows [m] at the positions last evaluated; it grows with the distance from the
    origin.
    """
    return COORDINATE_ROUNDING * float(np.abs(c.work.frames.position).max(initial=0.0))


def movable_velocities(c: CompiledMechanism) -> np.ndarray:
    """Return 1 for velocities of bodies that may move, 0 for those of bodies that stay as drawn."""
    s = c.structure
    out = np.ones(s.nv)
    for name, b in s.place.items():
        if b >= 0 and s.model[name].as_drawn:
            v0, n = s.tables["tree"].v[b], s.tables["tree"].nv[b]
            out[v0 : v0 + n] = 0.0
    return out


def inverse_weights(c: CompiledMechanism) -> np.ndarray:
    """Return the inverse weights of assembly steps: metres against radians; 0 for bodies that must not move."""
    return np.where(_translational_velocities(c), 1.0, 1.0 / c.values.length**2) * movable_velocities(c)


def _translational_velocities(c: CompiledMechanism) -> np.ndarray:
    """Return which velocities are translational."""
    tree = c.structure.tables["tree"]
    out = np.ones(c.structure.nv, bool)
    shifts = 2 if c.structure.model.planar else 3
    for v0, n in zip(tree.v, tree.nv, strict=True):
        out[v0 + min(n, shifts) : v0 + n] = False
    return out


def _step_lengths(c: CompiledMechanism, d: np.ndarray) -> tuple[float, float]:
    """Return the largest displacement and the largest rotation of a body in a step.

    Vector lengths are used, which do not depend on the world axes.
    """
    tree, shifts = c.structure.tables["tree"], _translational_velocities(c)
    body = np.repeat(np.arange(len(tree.nv)), tree.nv)
    place = np.concatenate([np.arange(v0, v0 + n) for v0, n in zip(tree.v, tree.nv, strict=True)])
    both = (np.bincount(body, (d**2 * kind)[place]) for kind in (shifts, ~shifts))
    shifted, turned = (float(np.sqrt(x.max(initial=0.0))) for x in both)
    return shifted, turned


def row_scales(c: CompiledMechanism) -> np.ndarray:
    """Return factors (nr,) that make rows dimensionless: lengths relative to the mechanism's length, angles in radians.

    Without them the sum of squares over rows, and the threshold of singular values, would depend on the unit of length.
    """
    return 1.0 / c.row_units


def _damped_step(
    c: CompiledMechanism, r: np.ndarray, scale: np.ndarray, root: np.ndarray, damping: float
) -> np.ndarray:
    """Return the least damped step with diag(scale) G d = r, in the metric of the inverse weights root^2.

    Near a singular position a motion may appear in a combination of rows with a factor of only 1e-8. Where the size
    allows it the singular values of G diag(root) are therefore used, not their squares, which would be lost in
    rounding.
    """
    if len(r) <= DENSE_ROWS:
        G = c.jacobian()
        used = np.flatnonzero(G.any(axis=0))
        U, s, Vt = svd(scale[:, None] * G[:, used] * root[used])
        largest = s.max(initial=0.0) or 1.0
        keep = s > SINGULAR_VALUE_CUTOFF * largest
        x = np.zeros(len(root))
        x[used] = Vt[keep].T @ (s[keep] / (s[keep] ** 2 + damping * largest**2) * (U[:, keep].T @ r))
        return root * x
    import scipy.sparse as sp
    from scipy.sparse.linalg import splu

    # [1 B^T; B -delta] with B of unit size: B B^T would square the condition number
    B = sp.diags(scale) @ c.sparse_jacobian() @ sp.diags(root)
    m, n = B.shape
    size = np.sqrt(B.multiply(B).sum(axis=1).max()) or 1.0
    B = B / size
    K = sp.bmat([[sp.identity(n), B.T], [B, -(damping + PIVOT_REGULARIZATION) * sp.identity(m)]], format="csc")
    return root * splu(K).solve(np.r_[np.zeros(n), r / size])[:n]


def _retracted(c: CompiledMechanism, q: np.ndarray, d: np.ndarray) -> np.ndarray:
    from ..engine.kinematics import retract

    new = q.copy()
    retract(c.values.system, new, d)
    return new


def gauss_newton(c: CompiledMechanism, t: float, q: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, int]:
    """Run damped Gauss-Newton until closed or no longer improving. Returns (q, iterations)."""
    root, scale = np.sqrt(inverse_weights(c)), row_scales(c)
    size = largest_residual(c, t, q, v)
    g = scale * c.work.rows.value
    damping, wider, capped = 0.0, 1.0, 0
    norm = float(g @ g)
    for k in range(MAX_ITERATIONS):
        if size < 1e-13 or not np.isfinite(size):
            return q, k
        c.at(t, q, v)
        d = _damped_step(c, -g, scale, root, damping)
        longest, farthest = _step_lengths(c, d)
        over = max(longest / (wider * LONGEST_STEP * c.values.length), farthest / LONGEST_STEP)
        d = d / over if over > 1.0 else d
        new = _retracted(c, q, d)
        new_size = largest_residual(c, t, new, v)
        trial = scale * c.work.rows.value
        new_norm = float(trial @ trial)
        if np.isfinite(new_size) and new_norm < norm:
            gain = 1.0 - new_norm / norm
            q, g, size, norm = new, trial, new_size, new_norm
            damping = 0.0 if damping < 1e-12 else damping / 10
            capped += over > 1.0
            if (
                capped > STEPS_BEFORE_WIDENING
            ):  # a long straight path would need more steps than allowed: take longer ones
                wider *= 2.0
            if gain < 1e-9:
                return q, k
        else:
            damping, wider, capped = max(10 * damping, 1e-8), 1.0, min(capped, STEPS_BEFORE_WIDENING)
            if damping > 1e4 or size < 1e-11:
                return q, k
    return q, MAX_ITERATIONS


def close_from_far(c: CompiledMechanism, t: float, q: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, int]:
    """Close from far away: Gauss-Newton from the guess, then from randomly perturbed guesses if it stops before
    closing.
    """
    w = inverse_weights(c)
    best, count = gauss_newton(c, t, q, v)
    least = largest_residual(c, t, best, v)
    random = np.random.default_rng(0)
    for k in range(MAX_RESTARTS):
        if least < 1e-9:
            break
        start = best if k % 2 == 0 else q
        shake = (
            _body_steps_in_world(c, start, random.normal(size=len(w))) * np.sqrt(w) * c.values.length * 0.05 * 1.5**k
        )
        trial, more = gauss_newton(c, t, _retracted(c, start, shake), v)
        count += more
        gap = largest_residual(c, t, trial, v)
        if gap < 1e-9:
            # closed from a perturbed start
            return trial, count
        if gap < least or not np.isfinite(least):
            best, least = trial, gap
    return best, count


def _body_steps_in_world(c: CompiledMechanism, q: np.ndarray, d: np.ndarray) -> np.ndarray:
    """Return the step with translations rotated from body axes to world axes: its effect is independent of world
    axes.
    """
    tree, out = c.structure.tables["tree"], d.copy()
    for name, b in c.structure.place.items():
        if b >= 0:
            at, n = int(tree.v[b]), min(int(tree.nv[b]), 2 if c.structure.model.planar else 3)
            out[at : at + n] = body_rotation(c.values, name, q)[:n, :n] @ d[at : at + n]
    return out


def closed_position_near(c: CompiledMechanism, t: float, q: np.ndarray) -> np.ndarray | None:
    """Return the closed position nearest to q, or None; for a mechanism with the rows of its positions."""
    q, _ = gauss_newton(c, t, q, np.zeros(c.structure.nv))
    return q if largest_residual(c, t, q, np.zeros(c.structure.nv)) <= CLOSED_TOLERANCE else None


CONSISTENT_TOLERANCE = 1e-13  # allowed residual of a row, relative to its terms
CONTRADICTION_TOLERANCE = 1e-9  # the same, above which rows contradict one another
BLOCKED_TOLERANCE = 1e-8  # relative singular value below which the constraints block a given velocity
STAGNATION_STEPS = 5  # steps without progress for large mechanisms: multipliers oscillate before they converge
SMALLEST_TERM = 1e-200  # lower bound on the terms to which residuals are compared
DENSE_VELOCITIES = 100  # largest number of velocities for which matrices are dense
FREE_VELOCITY_WEIGHT = 1e-10  # weight of free velocities in each iteration for large mechanisms, relative to given ones


@dataclass
class VelocityEquations:
    """Rows that velocities must satisfy (hard), and rows to be satisfied in the least-squares sense (soft), at a
    position.

    ``root``: R with R R^T the inverse mass matrix, zero for bodies whose motion is given and must not change. Soft rows
    are weighted so that the sum of their squares is twice the kinetic energy of the difference. Hard rows times
    ``scale`` are rates in 1/s, so that thresholds do not depend on the unit of length.
    """

    c: CompiledMechanism
    q: np.ndarray
    nu: np.ndarray
    G: Any  # dense up to `DENSE_VELOCITIES` velocities
    free: np.ndarray  # 0 for velocities that are given and must not change, else 1
    scale: np.ndarray  # of the hard rows
    held: list[GivenVelocity]  # further hard rows
    soft: list[GivenVelocity]

    @cached_property
    def root(self) -> Any:
        """See above; dense up to `DENSE_VELOCITIES` velocities."""
        return self.c.inverse_mass_root(self.free, dense=self.c.structure.nv <= DENSE_VELOCITIES)

    @cached_property
    def weights(self) -> dict[str, np.ndarray]:
        """Weights of the soft rows."""
        root = self.root
        return {g.name: _mass_root(_dense_array(root[g.at : g.at + g.n, g.at : g.at + g.n]), g) for g in self.soft}

    @classmethod
    def at(
        cls, c: CompiledMechanism, q: np.ndarray, nu: np.ndarray, still: np.ndarray | None = None
    ) -> VelocityEquations:
        """Create the equations at the position last evaluated, q, for rows with the right-hand sides nu."""
        told = given_velocities(c.values)
        small = c.structure.nv <= DENSE_VELOCITIES
        free = np.ones(c.structure.nv)
        for g in told:
            if g.from_reference and g.whole:
                free[g.at : g.at + g.n] = 0.0
        held = [g for g in told if g.from_reference and not g.whole]
        soft = [g for g in told if not g.from_reference]
        G = c.jacobian() if small else c.sparse_jacobian()
        if held:
            G = _stacked_rows(G, _deviation_rows(c, q, held, {}))
        scale = np.concatenate([row_scales(c), *(_rate_scales(c, g) for g in held)])
        return cls(c, q, nu, G, free, scale, held, soft)

    @property
    def determined(self) -> bool:
        """Whether these rows leave no velocity free."""
        A = np.vstack([_dense_array(x) / (_spectral_norm(_dense_array(x)) or 1.0) for x in self._whitened_rows()])
        free = (abs(self.root).sum(axis=0) > 0.0).sum()
        return (
            bool(np.linalg.matrix_rank(A, tol=BLOCKED_TOLERANCE * _spectral_norm(A)) == free) if A.size else free == 0
        )

    def _whitened_rows(self, soft: bool = True) -> tuple[Any, Any]:
        """Return both kinds of rows, in velocities whose squares are twice the kinetic energy."""
        return _scaled_rows(self.scale, self.G) @ self.root, _deviation_rows(
            self.c, self.q, self.soft if soft else [], self.weights
        ) @ self.root

    def missed(self, v: np.ndarray) -> np.ndarray:
        """Return the residuals of the hard rows."""
        n = len(self.nu)
        return np.r_[self.nu - self.G[:n] @ v, *(-velocity_deviation(self.c.values, g, self.q, v) for g in self.held)]

    def lost(self, v: np.ndarray) -> np.ndarray:
        """Return the residuals of the soft rows."""
        x = self.c.values
        parts = [-self.weights[g.name] @ velocity_deviation(x, g, self.q, v) for g in self.soft]
        return np.concatenate(parts) if parts else np.zeros(0)

    def steps(self, soft: bool = True) -> Callable[[np.ndarray, np.ndarray], np.ndarray]:
        """Return the function (missed, lost) -> correction of the velocities; without soft rows it corrects ``missed``
        only.
        """
        A, C = self._whitened_rows(soft)
        solve = (
            _dense_least_squares(A, C) if A.shape[0] + C.shape[0] <= DENSE_ROWS else _sparse_least_squares_step(A, C)
        )
        return lambda missed, lost: self.root @ solve(self.scale * missed, lost)


def _mass_root(R: np.ndarray, g: GivenVelocity) -> np.ndarray:
    """Return the square root of a body's mass matrix, restricted to its given velocities."""
    W = np.linalg.inv(R)
    return (
        W if g.whole else W[: g.translations, : g.translations] if g.origin else W[g.translations :, g.translations :]
    )


def _rate_scales(c: CompiledMechanism, g: GivenVelocity) -> np.ndarray:
    """Return factors that make the given velocities of a body rates in 1/s."""
    shifts = np.full(g.translations if g.origin else 0, 1.0 / c.values.length)
    return np.r_[shifts, np.ones(g.turns if g.turning else 0)]


def _scaled_rows(scale: np.ndarray, A: Any) -> Any:
    """Return a matrix with each row times a factor."""
    if isinstance(A, np.ndarray):
        return scale[:, None] * A
    import scipy.sparse as sp

    return (sp.diags(scale) @ A).tocsr()


def _deviation_rows(
    c: CompiledMechanism, q: np.ndarray, prescribed: list[GivenVelocity], weights: Mapping[str, np.ndarray]
):
    """Return the derivatives of (weighted) deviations of bodies by all velocities; dense up to `DENSE_VELOCITIES`."""
    i, j, x, n = [], [], [], 0
    for g in prescribed:
        T = deviation_jacobian(c.values, g, q)
        T = weights[g.name] @ T if g.name in weights else T
        rows, columns = np.indices(T.shape)
        i.append(n + rows.ravel())
        j.append(g.at + columns.ravel())
        x.append(T.ravel())
        n += len(T)
    nv = c.structure.nv
    if nv <= DENSE_VELOCITIES:
        dense = np.zeros((n, nv), np.result_type(float, *x))
        if n:
            dense[np.concatenate(i), np.concatenate(j)] = np.concatenate(x)
        return dense
    import scipy.sparse as sp

    if not n:
        return sp.csr_matrix((0, nv))
    entries = (np.concatenate(x), (np.concatenate(i), np.concatenate(j)))
    return sp.csr_matrix(entries, shape=(n, nv))


def _dense_least_squares(A, C) -> Callable[[np.ndarray, np.ndarray], np.ndarray]:
    """Return the solver for the least x of least |C x - s| among those with A x = r, by singular values.

    Golub and Van Loan, *Matrix Computations*, section 6.2 (least squares with equality constraints).
    """
    used = np.flatnonzero(_nonempty_columns(A) | _nonempty_columns(C))
    n = A.shape[1]
    A, C = _dense_array(A[:, used]), _dense_array(C[:, used])
    V, inverse = _pseudo_inverse(A, SINGULAR_VALUE_CUTOFF * _spectral_norm(A))
    left = C - (C @ V) @ V.T
    inverse_left = _pseudo_inverse(left, BLOCKED_TOLERANCE * _spectral_norm(C))[1]

    def solve(r: np.ndarray, s: np.ndarray) -> np.ndarray:
        x = np.zeros(n)
        x[used] = inverse @ r
        x[used] += inverse_left @ (s - C @ x[used])
        return x

    return solve


def _dense_array(A: Any) -> np.ndarray:
    return A if isinstance(A, np.ndarray) else A.toarray()


def _nonempty_columns(A: Any) -> np.ndarray:
    """Return which columns are not empty."""
    if isinstance(A, np.ndarray):
        return np.asarray(A.any(axis=0))
    used = np.zeros(A.shape[1], bool)
    used[A.indices] = True
    return used


def _stacked_rows(A: Any, B: Any) -> Any:
    if isinstance(A, np.ndarray):
        return np.vstack([A, B])
    import scipy.sparse as sp

    return sp.vstack([A, B]).tocsr()


def _spectral_norm(A: np.ndarray) -> float:
    """Return the largest singular value."""
    return float(np.linalg.norm(A, 2)) if A.size else 0.0


def _pseudo_inverse(A: np.ndarray, none: float) -> tuple[np.ndarray, np.ndarray]:
    """Return (basis of the row space, pseudo-inverse); singular values up to ``none`` count as zero."""
    U, s, Vt = svd(A)
    keep = s > none
    V = Vt[keep].T
    return V, (V / s[keep]) @ U[:, keep].T


def _sparse_least_squares_step(A, C) -> Callable[[np.ndarray, np.ndarray], np.ndarray]:
    """Return one step of the proximal method of multipliers for the same problem, to be iterated.

    It minimises e |x|^2 + |C x - s|^2 with A x = r, by [e 1, C^T, A^T; C, -1, 0; A, 0, -d] with rows of unit size. The
    multipliers kept from step to step remove the effect of d (Rockafellar, Math. Oper. Res. 1, 1976).
    """
    import scipy.sparse as sp
    from scipy.sparse.linalg import splu

    n, m, k = A.shape[1], A.shape[0], C.shape[0]
    size_A, size_C = (np.sqrt(np.asarray(X.multiply(X).sum(axis=1)).max(initial=0.0)) or 1.0 for X in (A, C))
    A, C = A / size_A, C / size_C
    d = PIVOT_REGULARIZATION / FREE_VELOCITY_WEIGHT
    K = splu(
        sp.bmat(
            [
                [FREE_VELOCITY_WEIGHT * sp.identity(n), C.T, A.T],
                [C, -sp.identity(k), None],
                [A, None, -d * sp.identity(m)],
            ],
            format="csc",
        )
    )
    multipliers = np.zeros(m)

    def solve(r: np.ndarray, s: np.ndarray) -> np.ndarray:
        x = K.solve(np.r_[np.zeros(n), s / size_C, r / size_A - d * multipliers])
        multipliers[:] = x[n + k :]
        return x[:n]

    return solve


def consistent_velocities(
    model: Model,
    compiled_model: CompiledMechanism,
    parameters: Mapping | None,
    t: float,
    q: np.ndarray,
    rates: Mapping[str, float],
) -> tuple[np.ndarray, VelocityEquations, CompiledMechanism]:
    """Return velocities at the closed position q, and the equations that they solve.

    Parameters
    ----------
    model : Model
    compiled_model : CompiledMechanism
        In absolute coordinates.
    parameters : mapping or None
        Values in place of the model's.
    t : float
    q : ndarray
    rates : mapping
        Initial conditions for rates.

    Returns
    -------
    v : ndarray (nv,)
        Where rows contradict one another, those of least residual; see `contradictory_elements`.
    wanted : VelocityEquations
    c : CompiledMechanism
        The mechanism of these rows, including those of the initial rates.
    """
    holds = [i for i in model.initial if i.name in rates]
    c = compile_mechanism(model, parameters=parameters, holds=holds, held={}) if holds else compiled_model
    c.follow(compiled_model.hints)
    v = described_velocities(c.values, q)
    c.at(t, q, v)
    nu = c.work.rows.nu.copy()
    for i in holds:
        nu[c.structure.slices[i.name]] = rates[i.name]
    w = VelocityEquations.at(c, q, nu)
    if not w.G.shape[0] or np.abs(w.scale * w.missed(v)).max() <= CONSISTENT_TOLERANCE * row_magnitude(w, v):
        return v, w, c
    v = _refined(w, v)
    if w.soft and np.abs(w.scale * w.missed(v)).max() > CONSISTENT_TOLERANCE * row_magnitude(
        w, v
    ):  # soft rows disturb the hard ones
        v = _refined(w, v, soft=False)
    return v, w, c


def row_magnitude(w: VelocityEquations, v: np.ndarray) -> float:
    """Return the magnitude of the terms of the scaled hard rows [1/s].

    A body that spins fast about its own axis causes rounding in all of them.
    """
    sizes = w.c.sizes
    largest = float(_scaled_rows(w.scale, _scaled_rows(sizes, abs(w.G).T).T).max()) if w.G.shape[0] else 0.0
    asked = float(np.abs(w.scale[: len(w.nu)] * w.nu).max(initial=0.0))
    return max(largest * float(np.abs(v / sizes).max(initial=0.0)), asked, SMALLEST_TERM)


def _refined(w: VelocityEquations, v: np.ndarray, soft: bool = True) -> np.ndarray:
    """Iterate corrections from the residuals, down to rounding."""
    step = w.steps(soft)
    last = moved = np.inf
    patience = 1 if isinstance(w.G, np.ndarray) or w.G.shape[0] <= DENSE_ROWS else STAGNATION_STEPS
    best, left, sizes = v, patience, w.c.sizes
    for _ in range(MAX_ITERATIONS):
        missed = w.missed(v)
        d = step(missed, w.lost(v) if soft else np.zeros(0))
        worst, way = float(np.abs(w.scale * missed).max()), float(np.abs(d / sizes).max(initial=0.0))
        if worst > 0.9 * last and way > 0.9 * moved:
            left -= 1
        else:
            best, last, moved, left = v, worst, way, patience
        if left == 0 or way <= CONSISTENT_TOLERANCE * float(np.abs(v / sizes).max(initial=0.0)):
            break
        v = v + d
    return v if patience == 1 else best


def contradictory_elements(w: VelocityEquations, v: np.ndarray) -> dict[str, float]:
    """Return the elements whose rows are not satisfied, with the residuals; empty where the velocities are
    consistent.
    """
    r = np.abs(w.missed(v))
    scaled, limit = w.scale * r, CONTRADICTION_TOLERANCE * row_magnitude(w, v)
    parts = dict(w.c.structure.slices)
    at = len(w.nu)
    for g in w.held:
        n = len(deviation_jacobian(w.c.values, g, w.q))
        parts[g.name] = slice(at, at + n)
        at += n
    missed = {k: float(scaled[rows].max(initial=0.0)) for k, rows in parts.items()}
    found = sorted((k for k in missed if missed[k] > limit), key=lambda k: -missed[k])
    return {k: float(r[parts[k]].max()) for k in found}
