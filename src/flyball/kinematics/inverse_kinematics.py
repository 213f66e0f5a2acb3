"""Inverse kinematics of a frame: coordinates at which it has a given position and orientation.

Damped least squares (Levenberg and Marquardt) from many starts at once. Positions are divided by the mechanism's
length, orientations are rotation vectors. Coordinates with stops (`Limit`) stay between these.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..errors import ModelError, NotConverged
from ..forces.limit import Limit
from ..model.geometry import orientation_matrix, rotation_about, vector
from ..rotations.arrays import quaternion_of
from ..tables.element_numbers import element_numbers

if TYPE_CHECKING:
    from .prepared import Prepared

Array = np.ndarray
MAX_ITERATIONS = 100
MIN_DAMPING, MAX_DAMPING = 1e-12, 1e8
"""Range of the damping, relative to the largest diagonal entry of J^T J."""
ROUNDING = 1e-13
"""Error, in lengths of the mechanism or radians, that rounding explains: iterations end there."""
ACCEPTED = 1e-9
"""Error up to which a start counts as converged: near singular positions convergence is slow."""
DISTINCT = 1e-5
"""Difference of coordinates, in radians or lengths of the mechanism, from which on two solutions are two."""
SINGULAR = 1e-6
"""Smallest singular value of the Jacobian, relative to the largest, below which a position is singular."""


REACH = 0.1
"""Size of random displacements to configurations nearby, in radians or lengths of the mechanism."""
LEAST_DISPLACEMENT = 0.1
"""Part of it that remains of a displacement after the constraints are satisfied again."""


@dataclass(frozen=True)
class InverseKinematics:
    """Configurations at which a frame has a given pose, the nearest to the one wanted first.

    Attributes
    ----------
    frame : str
    q : ndarray, (m, nq)
        The configurations.
    errors : ndarray, (m, 2)
        Remaining errors of position [m] and orientation [rad].
    singular : ndarray of bool, (m,)
        Whether some motion of the frame is impossible there that is possible nearby: the Jacobian loses rank.
    freedoms : int
        Motions of the mechanism that leave the frame where it is, but for singular configurations. If there are some,
        the solutions form a continuum, and ``q`` has some of them.
    """

    frame: str
    q: Array
    errors: Array
    singular: Array
    freedoms: int

    def __len__(self) -> int:
        return len(self.q)

    def lines(self) -> list[tuple[str, str]]:
        """Return labelled lines of text."""
        number = f"{len(self)} configuration{'s' * (len(self) != 1)}"
        more = f", of a continuum of {self.freedoms} freedoms" if self.freedoms else ""
        out = [("inverse kinematics", f"{self.frame}: {number}{more}")]
        for k, q in enumerate(self.q):
            note = "  (singular)" if self.singular[k] else ""
            out.append((f"  {k}", " ".join(f"{x:.6g}" for x in q) + note))
        return out

    def __repr__(self) -> str:
        """Return the lines as text."""
        return "\n".join(f"{label:<19} {text}" for label, text in self.lines())


class _Target(NamedTuple):
    """What the frame must reach; the rows of its Jacobian that count, and their units."""

    frame: str
    position: Array
    rotation: Array
    rows: Array
    scale: Array
    constraints: Callable[[Array], tuple[Array, Array]] | None


class _Starts(NamedTuple):
    """Configurations to begin from, and properties of the entries of q [(nq,)]."""

    q: Array
    lower: Array
    upper: Array
    turn: Array  # 2 pi for angles, else infinite
    units: Array  # the mechanism's length, or a radian
    sizes: Array  # (nv,): the same of the velocities
    entry: Array  # (nv,): see `PoseRequest`
    quaternions: list[int]  # first entry of each


class PoseRequest(NamedTuple):
    """Arguments of `Prepared.inverse_kinematics`, and the units of the coordinates."""

    frame: str
    position: Any
    rotation: Any
    near: Array
    starts: int
    seed: int
    constraints: Callable[[Array], tuple[Array, Array]] | None  # values and Jacobians of rows at q, scaled
    sizes: Array  # (nv,): the mechanism's length, or a radian
    entry: Array  # (nv,): the entry of q whose rate each velocity is; -1: of a quaternion
    drawn: Array  # (nv,): values of the coordinates where q is zero
    length: float


def inverse_kinematics(p: Prepared, request: PoseRequest) -> InverseKinematics:
    """See `Prepared.inverse_kinematics`."""
    frame, starts = request.frame, request.starts
    if not len(p.v):
        raise ModelError(f"{p.model.name!r} has no freedoms in these coordinates: drivers or joints prescribe it all")
    if not isinstance(request.seed, int) or request.seed < 0:
        raise ModelError(f"seed is {request.seed!r}; it must be a whole number, 0 or more")
    if not isinstance(starts, int) or starts < 1:
        raise ModelError(f"starts is {starts!r}; it must be a number of configurations to begin from, 1 or more")
    target = _target(p, request)
    begin = _starts(p, request)
    q, error = _iterate(p, target, begin)
    good = np.linalg.norm(error, axis=1) <= ACCEPTED
    if not good.any():
        if not len(target.rows):
            raise NotConverged(
                f"no configuration of {p.model.name!r} was found that closes its loops, from {starts} starts; they may "
                f"be open everywhere, or closed only beyond stops; more starts= search farther"
            )
        best = int(np.argmin(np.linalg.norm(error, axis=1)))
        shift, turn = _errors(p, target, q[best : best + 1])[0]
        raise NotConverged(
            f"no configuration of {p.model.name!r} was found at which {frame!r} has this pose, from {starts} starts; "
            f"the nearest found misses it by {shift:.4g} m and {np.degrees(turn):.4g} deg. It may be out of reach or "
            f"beyond stops; more starts= search farther"
        )
    return _distinct(p, target, q[good], begin)


def closed_nearby(p: Prepared, request: PoseRequest) -> Array:
    """Configurations near one, and apart from it, at which all constraints are satisfied, (m, nq)."""
    first, begin = request.near, _starts(p, request)
    steps = REACH * request.sizes * np.random.default_rng(request.seed).normal(size=(request.starts, len(p.v)))
    free = np.full(len(first), np.inf)
    begin = begin._replace(q=np.array([p.step(first, d) for d in steps]), lower=-free, upper=free)
    nothing = np.zeros(0, int)
    target = _Target(request.frame, np.zeros(3), np.eye(3), nothing, np.zeros(0), request.constraints)
    q, error = _iterate(p, target, begin)
    apart = np.linalg.norm((q - first) / begin.units, axis=1) > LEAST_DISPLACEMENT * REACH
    return np.asarray(q[apart & (np.linalg.norm(error, axis=1) <= ROUNDING)])


def _target(p: Prepared, request: PoseRequest) -> _Target:
    position, rotation = request.position, request.rotation
    planar = p.model.planar
    if position is None and rotation is None and request.constraints is None:
        raise ModelError("inverse_kinematics needs a position, a rotation, or both: there are no loops to be closed")
    where, R, rows = np.zeros(3), np.eye(3), list[int]()
    if position is not None:
        where = vector(_real(position, "position"), planar, "position")
        rows += [0, 1] if planar else [0, 1, 2]
    if rotation is not None:
        given = _real(rotation, "rotation")
        if planar and given.size != 1:
            raise ModelError(f"rotation: in the plane it is an angle [rad], not {rotation!r}")
        R = rotation_about(2, float(given)) if planar else orientation_matrix(given, "rotation")
        rows += [5] if planar else [3, 4, 5]
    if not (np.isfinite(where).all() and np.isfinite(R).all()):
        raise ModelError("position and rotation must be finite")
    scale = np.array([1.0 / request.length] * 3 + [1.0] * 3)
    return _Target(request.frame, where, R, np.array(rows, int), scale[rows], request.constraints)


def _real(value: Any, what: str) -> Array:
    """An array of numbers.

    Raises
    ------
    ModelError
    """
    try:
        return np.asarray(value, float)
    except (TypeError, ValueError):
        raise ModelError(f"{what} is {value!r}; it must be numbers, in SI units") from None


def _ranges(p: Prepared, drawn: Array) -> tuple[Array, Array]:
    """Range of each velocity's entry of q, from stops along its coordinate."""
    lower, upper = np.full(len(p.v), -np.inf), np.full(len(p.v), np.inf)
    numbers = element_numbers(p.model, p.parameters_given).of
    for e in p.model.limits:
        if isinstance(e, Limit) and e.coordinate in p.names:
            n, d = numbers[e.name], p.names.index(e.coordinate)
            lower[d] = max(lower[d], -np.inf if n.lower is None else float(n.lower) - drawn[d])
            upper[d] = min(upper[d], np.inf if n.upper is None else float(n.upper) - drawn[d])
    return lower, upper


def _starts(p: Prepared, request: PoseRequest) -> _Starts:
    """The wanted configuration, and random ones: angles anywhere, lengths as far as the mechanism's length."""
    first, sizes, n = request.near, request.sizes, len(p.q)
    plain = request.entry >= 0
    at = request.entry[plain]
    lower, upper = np.full(n, -np.inf), np.full(n, np.inf)
    lower[at], upper[at] = (x[plain] for x in _ranges(p, request.drawn))
    angles = _is_rotation(p)
    turn, units = np.full(n, np.inf), np.ones(n)
    units[at] = sizes[plain]
    turn[at] = np.where(angles[plain], 2.0 * np.pi, np.inf)
    low, high = (np.where(angles, sign * np.pi, sign * sizes) for sign in (-1.0, 1.0))
    low[plain] = np.where(np.isfinite(lower[at]), lower[at], low[plain])
    high[plain] = np.where(np.isfinite(upper[at]), upper[at], high[plain])
    values = np.random.default_rng(request.seed).uniform(low, np.maximum(low, high), (request.starts - 1, len(low)))
    values[:, plain] -= first[at]
    others = np.array([p.step(first, d) for d in values]).reshape(-1, n)
    taken = set(at.tolist())
    quaternions = [k for k in range(n) if k not in taken][::4]
    return _Starts(np.concatenate([first[None], others]), lower, upper, turn, units, sizes, request.entry, quaternions)


def _is_rotation(p: Prepared) -> Array:
    """Whether each velocity turns a body."""
    J = np.array([np.linalg.norm(p.frame_jacobian(b.name, p.q)[3:], axis=0) for b in p.model.bodies])
    return J.max(axis=0, initial=0.0) > 0.0


def _pose_error(p: Prepared, t: _Target, q: Array) -> Array:
    """Errors of pose in the rows of the target, scaled, (k, rows)."""
    x, R = p.pose(t.frame, q)
    e = quaternion_of(t.rotation @ np.swapaxes(R, 1, 2))
    s = np.linalg.norm(e[:, 1:], axis=1)
    turn = e[:, 1:] * np.where(s > 0.0, 2.0 * np.arctan2(s, e[:, 0]) / np.where(s > 0.0, s, 1.0), 2.0)[:, None]
    error = np.concatenate([t.position - x, turn], axis=1)[:, t.rows] * t.scale
    return error if t.constraints is None else np.concatenate([error, -t.constraints(q)[0]], axis=1)


def _errors(p: Prepared, t: _Target, q: Array) -> Array:
    """Errors of position [m] and orientation [rad], (k, 2)."""
    e = _pose_error(p, t, q)[:, : len(t.rows)] / t.scale
    return np.array([np.linalg.norm(e[:, part], axis=1) for part in (t.rows < 3, t.rows >= 3)]).T


def _jacobian(p: Prepared, t: _Target, q: Array) -> Array:
    J = p.frame_jacobian(t.frame, q)[:, t.rows] * t.scale[:, None]
    return J if t.constraints is None else np.concatenate([J, t.constraints(q)[1]], axis=1)


def _moved(p: Prepared, begin: _Starts, q: Array, d: Array) -> Array:
    """Configurations moved along the velocities, as far as stops permit."""
    moved = np.array([p.step(a, b) for a, b in zip(q, d, strict=True)]) if begin.quaternions else q + d
    return np.clip(moved, begin.lower, begin.upper)


def _iterate(p: Prepared, t: _Target, begin: _Starts) -> tuple[Array, Array]:
    """Minimise the errors from all starts; returns configurations and errors."""
    q = _moved(p, begin, begin.q, np.zeros((len(begin.q), len(p.v))))
    error = _pose_error(p, t, q)
    damping = np.full(len(q), 1e-3)
    for _ in range(MAX_ITERATIONS):
        active = np.flatnonzero((np.linalg.norm(error, axis=1) > ROUNDING) & (damping < MAX_DAMPING))
        if not len(active):
            break
        J = _jacobian(p, t, q[active]) * begin.sizes
        A, b = np.swapaxes(J, 1, 2) @ J, np.einsum("kij,ki->kj", J, error[active])
        at_stop = np.zeros(b.shape, bool)  # a coordinate at a stop that would go beyond it stays
        plain = begin.entry >= 0
        x, downhill = q[active][:, begin.entry[plain]], b[:, plain]
        bounds = (y[begin.entry[plain]] for y in (begin.lower, begin.upper))
        at_stop[:, plain] = ((x <= next(bounds)) & (downhill < 0.0)) | ((x >= next(bounds)) & (downhill > 0.0))
        b = np.where(at_stop, 0.0, b)
        A = np.where(at_stop[:, :, None] | at_stop[:, None, :], 0.0, A)
        largest = np.maximum(np.einsum("kii->ki", A).max(axis=1), np.finfo(float).tiny)
        A = A + (damping[active] * largest)[:, None, None] * np.eye(A.shape[1])
        step = begin.sizes * np.linalg.solve(A, b[..., None])[..., 0]
        tried = _moved(p, begin, q[active], step)
        found = _pose_error(p, t, tried)
        better = np.linalg.norm(found, axis=1) < np.linalg.norm(error[active], axis=1)
        at = active[better]
        q[at], error[at] = tried[better], found[better]
        damping[at] = np.maximum(0.1 * damping[at], MIN_DAMPING)
        damping[active[~better]] *= 10.0
    return q, error


def _distinct(p: Prepared, t: _Target, q: Array, begin: _Starts) -> InverseKinematics:
    """Different solutions but for whole turns of angles, the nearest to the first start first."""
    first, units = begin.q[0], begin.units
    for k in begin.quaternions:  # of the two that are the same rotation, the one near the first
        flipped = q[:, k : k + 4] @ first[k : k + 4] < 0.0
        q[flipped, k : k + 4] *= -1.0

    def difference(a: Array, b: Array) -> Array:
        return a - b - np.where(np.isfinite(begin.turn), begin.turn, 0.0) * np.round((a - b) / begin.turn)

    q = first + difference(q, first)
    whole = np.where(np.isfinite(begin.turn), begin.turn, 1.0)
    q = q + whole * np.ceil(np.maximum(begin.lower - q, 0.0) / whole)  # back between the stops
    q = q - whole * np.ceil(np.maximum(q - begin.upper, 0.0) / whole)
    order = np.argsort(np.linalg.norm((q - first) / units, axis=1), kind="stable")
    found: list[int] = []
    for k in order.tolist():
        if all(np.abs(difference(q[k], q[i]) / units).max() > DISTINCT for i in found):
            found.append(k)
    q = q[found]
    ranks = _ranks(p, t, begin, q)
    # rows of loops that depend on each other do so only where the loops are closed: not at the starts
    usual = int((ranks if t.constraints is not None else _ranks(p, t, begin, begin.q)).max())
    return InverseKinematics(t.frame, q, _errors(p, t, q), ranks < usual, len(p.v) - usual)


def _ranks(p: Prepared, t: _Target, begin: _Starts, q: Array) -> Array:
    """Ranks of the Jacobians, (k,)."""
    values = np.linalg.svd(_jacobian(p, t, q) * begin.sizes, compute_uv=False)
    return (values > SINGULAR * values[:, :1]).sum(axis=1)
